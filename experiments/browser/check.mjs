// Opens interactive pages in Chromium and does with each what people do: `node check.mjs CHROMIUM FOLDER PAGE.html…`.
// Pictures of the pages, light and dark, wide and on a phone, go to FOLDER. Ends with 1 at the first thing that is wrong.

import assert from 'node:assert/strict';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const [executablePath, folder, ...pages] = process.argv.slice(2);
assert(pages.length > 0, 'usage: node check.mjs CHROMIUM FOLDER PAGE.html…');

const browser = await chromium.launch({
  executablePath,
  args: [
    '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
    '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
  ],
});

/** The page of a file, in a window; what it says on its console and asks for elsewhere goes to `faults`. */
async function open(file, options, faults) {
  const page = await browser.newPage(options);
  page.setDefaultTimeout(120_000);
  const address = pathToFileURL(path.resolve(file)).href;
  page.on('console', message => faults.push(`console: ${message.text()}`));
  page.on('pageerror', error => faults.push(`script: ${error}`));
  page.on('request', request => { if (request.url() !== address) faults.push(`request: ${request.url()}`); });
  await page.goto(address);
  await page.waitForSelector('html[data-ready="true"]');
  await settled(page);
  return page;
}

/** Until what is drawn has been drawn. */
const settled = page => page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));

/** The pixels of the view, and how many of them are not empty. */
async function pixels(page) {
  await settled(page);
  return page.evaluate(() => {
    const canvas = document.getElementById('canvas'), gl = canvas.getContext('webgl2');
    const all = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, all);
    let sum = 0, full = 0;
    for (let k = 0; k < all.length; k++) sum = (sum * 31 + all[k]) % 4294967291;
    for (let k = 3; k < all.length; k += 4) full += all[k] > 0;
    return { sum, part: full / (canvas.width * canvas.height) };
  });
}

/** Puts a slider to a place from 0 to 1. */
async function slide(page, id, place) {
  await page.$eval(id, (slider, place) => {
    slider.value = Math.round(+slider.min + place * (slider.max - slider.min));
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  }, place);
}

async function use(page) {
  const count = selector => page.locator(selector).count();
  // Convergence: all methods at one iteration, by pointer and by keys; a click takes a curve away and brings it back.
  const curves = await count('#convergence .curve');
  assert.equal(curves, await count('#legend button'));
  assert(curves > 0, 'curves');
  const box = await page.locator('#convergence svg').boundingBox();
  await page.mouse.move(box.x + 60, box.y + 120);
  const tip = await page.textContent('#tip');
  assert.match(tip, /^iteration \d+/);
  assert.match(tip, /: \d\.\d\de[+-]\d+/);
  await page.focus('#convergence');
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  assert.match(await page.textContent('#tip'), /^iteration 1[^0-9]/);
  assert.equal(await count('#tip .swatch'), await page.$$eval('#legend small', all => all.filter(e => !/(^| )0$/.test(e.textContent)).length));
  await page.keyboard.press('Escape');
  assert(await page.isHidden('#tip'));
  const first = page.locator('#legend button').first();
  await first.click();
  assert.equal(await count('#convergence .curve'), curves - 1);
  assert.equal(await first.getAttribute('aria-pressed'), 'false');
  await first.click();
  assert.equal(await count('#convergence .curve'), curves);

  // Over ω: the slider moves the cursors and changes the table.
  const cursor = () => page.locator('#sweep-rates .cursor').getAttribute('x1');
  await slide(page, '#omega', 0.3);
  const [x, table] = [await cursor(), await page.textContent('#sweep-table')];
  await slide(page, '#omega', 0.6);
  assert.notEqual(await cursor(), x);
  assert.notEqual(await page.textContent('#sweep-table'), table);

  // The spectra of both matrices.
  for (const matrix of ['D⁻¹A', 'A']) {
    await page.selectOption('#matrix', matrix);
    assert(await count('#spectrum .eigenvalue') > 0);
    assert.match(await page.textContent('#spectrum-about'), /from .* to .*proven/);
  }
  assert(await count('#rows tr') > curves, 'a row a method');

  // Surfaces: there is something to see, and other errors, other methods, other surfaces, turning and playing change it.
  if (await page.isHidden('#view')) return;
  const seen = await pixels(page);
  assert(seen.part > 0.03 && seen.part < 0.95, `${seen.part} of the view is drawn`);
  let last = seen.sum;
  const changes = async what => {
    const { sum } = await pixels(page);
    assert.notEqual(sum, last, what);
    last = sum;
  };
  await slide(page, '#iteration', 1);
  await changes('the slider');
  assert.match(await page.textContent('#iteration-value'), /^iteration \d+ of \d+/);
  await page.focus('#canvas');
  await page.keyboard.press('ArrowLeft');
  await changes('an arrow key');
  await page.keyboard.press('+');
  await changes('nearer');
  const place = await page.locator('#canvas').boundingBox();
  await page.mouse.move(place.x + 100, place.y + 100);
  await page.mouse.down();
  await page.mouse.move(place.x + 150, place.y + 130);
  await page.mouse.up();
  await changes('dragging');
  for (const text of (await page.locator('#what option').allTextContents()).slice(1)) {
    await page.selectOption('#what', { label: text });
    await changes(text);
  }
  await page.click('#play');
  assert.equal(await page.getAttribute('#play', 'aria-label'), 'pause');
  await page.waitForFunction(() => +document.getElementById('iteration').value > 0);
  await page.click('#play');
  assert.equal(await page.getAttribute('#play', 'aria-label'), 'play');
  await page.selectOption('#what', { index: 0 });
}

const windows = {
  wide: { viewport: { width: 1400, height: 1000 } },
  dark: { viewport: { width: 1400, height: 1000 }, colorScheme: 'dark' },
  phone: { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true },
};
for (const file of pages) {
  for (const [name, options] of Object.entries(windows)) {
    const faults = [];
    const page = await open(file, options, faults);
    const stem = path.join(folder, `${path.basename(file, '.html')}-${name}`);
    await page.screenshot({ path: `${stem}.png`, fullPage: true });
    // Nothing is wider than the window.
    assert(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${file}, ${name}: too wide`);
    if (name === 'wide') {
      await use(page);
      await page.screenshot({ path: `${stem}-used.png`, fullPage: true });
    }
    assert.deepEqual(faults, [], `${file}, ${name}`);
    await page.close();
  }
  console.log(`${file}: as it should be`);
}
await browser.close();
