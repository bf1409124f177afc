// The page: its data, and what answers to clicks and keys.

const element = id => document.getElementById(id);
const data = JSON.parse(element('data').textContent);
const bytes = packed => Uint8Array.from(atob(packed), c => c.charCodeAt(0));
const numbers = (Kind, packed) => new Kind(bytes(packed).buffer);
const clamp = (x, from, to) => Math.min(to, Math.max(from, x));
const redrawOnScheme = redraw => matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);

document.title = data.title;
element('title').textContent = data.title;
for (const text of data.about) add(element('about'), 'p', text);
const curves = data.curves.map(curve => ({
  ...curve, shown: true, at: numbers(Uint32Array, curve.at), max: numbers(Float64Array, curve.max),
}));

/** What became of a run, in words. */
const verdict = run => run.outcome === 'converged' ? String(run.iterations) : `${run.outcome} at ${run.iterations}`;

/** The entry of a curve's history at an iteration, or the last before it; -1 after its end. */
function entryAt(curve, iteration) {
  if (iteration > curve.iterations) return -1;
  let [low, high] = [0, curve.at.length - 1];
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (curve.at[middle] <= iteration) low = middle; else high = middle - 1;
  }
  return low;
}

// Convergence.
{
  const host = element('convergence'), tip = element('tip');
  let plot, longest, cursor, iteration = null;
  const finite = curves.flatMap(curve => [...curve.max]).filter(e => e > 0 && Number.isFinite(e));
  const start = Math.max(...curves.map(curve => curve.max[0]).filter(Number.isFinite), data.tolerance);
  // Errors of runs that diverge may be of any size, and leave the frame.
  const least = finite.reduce((a, b) => Math.min(a, b), start);
  const range = [Math.max(Math.min(data.tolerance, Math.max(least, data.tolerance / 1e3)) / 10, least * 1e-12), start * 1e2];
  const redraw = () => {
    const visible = curves.filter(curve => curve.shown);
    longest = Math.max(1, ...visible.map(curve => curve.iterations));
    plot = axes(host, { x: [0, longest], y: range, log: true, height: 320, xLabel: 'iterations', label: 'errors over iterations' });
    const { inside, X, Y, left, width, top, height, bottom } = plot;
    const tolerance = Y(data.tolerance);
    draw(inside, 'line', { x1: left, x2: width, y1: tolerance, y2: tolerance, class: 'rule', 'stroke-dasharray': '5 4' });
    draw(plot.svg, 'text', { x: left + 6, y: tolerance - 4 }, 'tolerance');
    for (const curve of visible) {
      const points = [...curve.max].map((e, i) => e > 0 && Number.isFinite(e) ? [X(curve.at[i]), clamp(Y(e), -1e4, 1e4)] : null);
      draw(inside, 'path', { d: line(points), fill: 'none', 'stroke-width': 2, 'stroke-linejoin': 'round', class: 'curve', ...strokeOf(curve.look) });
      const last = points.findLast(p => p !== null);
      if (last && curve.outcome !== 'converged') {
        const [x, y] = [last[0], clamp(last[1], top + 4, height - bottom)];
        draw(plot.svg, 'path', { d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, 'stroke-width': 2, stroke: strokeOf(curve.look).stroke, class: 'failed' });
      }
    }
    cursor = draw(plot.svg, 'line', { y1: top, y2: height - bottom, class: 'rule', visibility: 'hidden' });
  };
  const hide = () => {
    iteration = null;
    cursor.setAttribute('visibility', 'hidden');
    tip.style.display = 'none';
  };
  const compare = (k, x, y) => {
    iteration = clamp(Math.round(k), 0, longest);
    for (const end of ['x1', 'x2']) cursor.setAttribute(end, plot.X(iteration));
    cursor.setAttribute('visibility', 'visible');
    tip.replaceChildren();
    add(tip, 'b', `iteration ${iteration}`);
    const entries = curves.filter(curve => curve.shown).map(curve => [curve, entryAt(curve, iteration)]);
    const running = entries.filter(([, i]) => i >= 0).sort(([a, i], [b, j]) => b.max[j] - a.max[i]);
    for (const [curve, i] of running) {
      const row = add(tip, 'div');
      swatch(row, curve.look);
      const earlier = curve.at[i] === iteration ? '' : ` (at ${curve.at[i]})`;
      add(row, 'span', `${curve.name}: ${curve.max[i].toExponential(2)}${earlier}`);
    }
    const ended = entries.length - running.length;
    if (ended > 0) add(tip, 'div', `${ended} ended before`);
    tip.style.display = 'block';
    const place = (at, size, room) => clamp(at + 14 + size < room ? at + 14 : at - size - 14, 8, Math.max(8, room - size - 8));
    tip.style.left = `${place(x, tip.offsetWidth, innerWidth)}px`;
    tip.style.top = `${place(y, tip.offsetHeight, innerHeight)}px`;
  };
  host.addEventListener('pointermove', event => {
    const box = plot.svg.getBoundingClientRect(), x = event.clientX - box.left;
    if (x < plot.left - 8 || x > plot.width) hide(); else compare(plot.at(x), event.clientX, event.clientY);
  });
  host.addEventListener('pointerleave', hide);
  host.addEventListener('blur', hide);
  host.addEventListener('keydown', event => {
    if (event.key === 'Escape') return hide();
    const by = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    const box = plot.svg.getBoundingClientRect(), k = clamp((iteration ?? 0) + by, 0, longest);
    compare(k, box.left + plot.X(k), box.top + plot.top);
  });
  for (const curve of curves) {
    const button = add(element('legend'), 'button', undefined, { type: 'button' });
    swatch(button, curve.look);
    add(button, 'span', curve.name);
    add(button, 'small', verdict(curve));
    button.setAttribute('aria-pressed', 'true');
    button.addEventListener('click', () => {
      curve.shown = !curve.shown;
      button.setAttribute('aria-pressed', String(curve.shown));
      redraw();
    });
  }
  keepDrawn(host, redraw);
}

// Over ω.
{
  const omegas = [...new Set(data.sweep.flatMap(sweep => sweep.runs.map(run => run.omega)))].sort((a, b) => a - b);
  const slider = element('omega');
  slider.max = omegas.length - 1;
  const best = data.sweep.flatMap(sweep => sweep.runs).filter(run => run.outcome === 'converged').sort((a, b) => a.iterations - b.iterations)[0];
  slider.value = best ? omegas.indexOf(best.omega) : Math.floor(omegas.length / 2);
  const x = [0, omegas[omegas.length - 1]];
  const converged = data.sweep.flatMap(sweep => sweep.runs).filter(run => run.outcome === 'converged').map(run => Math.max(run.iterations, 1));
  const counts = converged.length ? [Math.min(...converged) / 1.5, Math.max(...converged) * 1.5] : [1, 10];
  // Powers of ten alone may be none.
  const between = [1, 2, 5].flatMap(m => [0, 1, 2, 3, 4, 5, 6].map(e => m * 10 ** e)).filter(v => v >= counts[0] && v <= counts[1]);
  const countTicks = between.filter(v => between.length <= 6 || /^1/.test(v)).map(v => [v, String(v)]);
  const redraw = () => {
    const omega = omegas[+slider.value];
    const above = axes(element('sweep-iterations'), { x, y: counts, log: true, height: 190, yTicks: countTicks, label: 'iterations over ω' });
    const below = axes(element('sweep-rates'), { x, y: [0, 1.5], height: 200, xLabel: 'ω', label: 'rates over ω' });
    draw(below.inside, 'line', { x1: below.left, x2: below.width, y1: below.Y(1), y2: below.Y(1), class: 'rule' });
    data.sweep.forEach(({ look, runs }) => {
      const plain = { fill: 'none', 'stroke-width': 2, class: 'curve', ...strokeOf(look) };
      draw(above.inside, 'path', { d: line(runs.map(run => run.outcome === 'converged' ? [above.X(run.omega), above.Y(Math.max(run.iterations, 1))] : null)), ...plain });
      draw(below.inside, 'path', { d: line(runs.map(run => run.predicted === null ? null : [below.X(run.omega), below.Y(Math.min(run.predicted, 9))])), ...plain });
      for (const run of runs.filter(run => run.measured !== null)) {
        draw(below.inside, 'circle', { cx: below.X(run.omega), cy: below.Y(Math.min(run.measured, 9)), r: 2.7, fill: plain.stroke });
      }
    });
    for (const { inside, X, height } of [above, below]) {
      draw(inside, 'line', { x1: X(omega), x2: X(omega), y1: 0, y2: height, stroke: 'var(--accent)', 'stroke-width': 1.5, class: 'cursor' });
    }
    element('omega-value').textContent = short(omega, 4);
    const table = element('sweep-table');
    table.replaceChildren();
    const head = add(table, 'tr');
    for (const text of ['method', 'iterations', 'measured rate', 'predicted', 'best ω', 'diverges from']) add(head, 'th', text);
    data.sweep.forEach(({ method, look, optimal, critical, runs }) => {
      const run = runs.find(run => run.omega === omega), row = add(table, 'tr'), name = add(row, 'td');
      swatch(name, look);
      name.append(` ${method}`);
      add(row, 'td', run ? verdict(run) : '–', { className: run && run.outcome !== 'converged' ? 'failed' : '' });
      for (const x of [run?.measured, run?.predicted, optimal, critical]) add(row, 'td', short(x, 4));
    });
  };
  slider.addEventListener('input', redraw);
  keepDrawn(element('sweep-rates'), redraw);
}

// Spectrum.
{
  const host = element('spectrum'), choice = element('matrix');
  for (const { matrix } of data.spectra) choice.add(new Option(matrix, matrix));
  const all = data.spectra.map(({ all }) => all && all.map(packed => numbers(Float64Array, packed)));
  const redraw = () => {
    const at = choice.selectedIndex, { ends, bounds, matrix, most } = data.spectra[at];
    const known = all[at], complex = known && known[1].some(im => Math.abs(im) > 1e-12);
    const edges = [0, ...ends, ...bounds.filter(b => b !== null && b > -1 && b < 2 * ends[1])];
    const x = [Math.min(...edges), Math.max(...edges) * 1.03];
    let plot;
    if (complex) {
      const size = 1.2 * Math.max(...known[1].map(Math.abs));
      plot = axes(host, { x, y: [-size, size], height: 210, xLabel: 'real part', label: `eigenvalues of ${matrix} in the complex plane` });
      known[0].forEach((re, i) => draw(plot.inside, 'circle', { cx: plot.X(re), cy: plot.Y(known[1][i]), r: 2.5, fill: 'var(--accent)', class: 'eigenvalue' }));
    } else if (known) {
      const bins = Array(48).fill(0), width = (x[1] - x[0]) / bins.length;
      for (const value of known[0]) bins[clamp(Math.floor((value - x[0]) / width), 0, bins.length - 1)]++;
      plot = axes(host, { x, y: [0, 1.05 * Math.max(...bins)], height: 210, xLabel: 'eigenvalue', label: `histogram of the eigenvalues of ${matrix}` });
      bins.forEach((count, i) => {
        if (count > 0) draw(plot.inside, 'rect', { x: plot.X(x[0] + i * width) + 0.5, y: plot.Y(count), width: plot.X(width) - plot.X(0) - 1, height: plot.Y(0) - plot.Y(count), fill: 'var(--accent)', opacity: 0.75, class: 'eigenvalue' });
      });
    } else {
      plot = axes(host, { x, y: [0, 1], height: 130, xLabel: 'eigenvalue', yTicks: [], label: `ends of the spectrum of ${matrix}` });
      draw(plot.inside, 'rect', { x: plot.X(ends[0]), y: plot.Y(0.65), width: plot.X(ends[1]) - plot.X(ends[0]), height: plot.Y(0.35) - plot.Y(0.65), rx: 3, fill: 'var(--accent)', opacity: 0.75, class: 'eigenvalue' });
    }
    const upright = (value, style) => draw(plot.inside, 'line', { x1: plot.X(value), x2: plot.X(value), y1: 0, y2: plot.height - plot.bottom, stroke: 'var(--crease)', 'stroke-width': 1.5, ...style });
    for (const value of ends) upright(value, {});
    for (const bound of bounds) if (bound >= x[0] && bound <= x[1]) upright(bound, { 'stroke-dasharray': '4 3' });
    element('spectrum-about').textContent =
      `${known ? `All ${known[0].length} eigenvalues` : `The ends (all eigenvalues are computed up to ${most})`}` +
      `${complex ? ', complex ones among them' : ''}: from ${short(ends[0], 5)} to ${short(ends[1], 5)} (lines); proven: from ` +
      `${short(bounds[0], 5)} to ${short(bounds[1], 5)} (dashed).`;
  };
  choice.addEventListener('change', redraw);
  keepDrawn(host, redraw);
}

// Surfaces.
const colours = Uint8Array.from('/*COLOURS*/'.match(/../g), hex => parseInt(hex, 16));
if (!data.view) element('view').hidden = true;
else {
  const canvas = element('canvas'), slider = element('iteration'), play = element('play'), what = element('what');
  const { about, range, given, cage, limit } = data.view;
  element('view-about').textContent = about;
  const scale = element('scale'), strip = scale.getContext('2d');
  scale.width = colours.length / 3;
  for (let k = 0; k < scale.width; k++) {
    strip.fillStyle = `rgb(${colours.subarray(3 * k, 3 * k + 3).join()})`;
    strip.fillRect(k, 0, 1, 1);
  }
  element('scale-from').textContent = short(range[0], 2);
  element('scale-to').textContent = `${short(range[1], 2)} ${data.unit}`;
  const view = viewOn(canvas, colours);
  if (!view) {
    const text = 'This browser has no WebGL 2, so that surfaces cannot be drawn.';
    element('view').replaceChildren(element('view-title'), add(document.body, 'p', text));
  } else {
    const unpacked = ({ points, corners, creases }) =>
      ({ points: numbers(Float32Array, points), corners: numbers(Uint32Array, corners), creases: numbers(Uint32Array, creases) });
    const mesh = unpacked(given), count = mesh.points.length / 3;
    const solids = { given: view.load(mesh) };
    const options = [['given mesh', { solid: 'given', cage: 'given' }]];
    if (cage) {
      solids.cage = view.load({ ...mesh, points: numbers(Float32Array, cage) });
      options.push(['control mesh', { solid: 'cage', cage: 'cage' }]);
    }
    let shownBy = null;
    if (limit) {
      solids.limit = view.load(unpacked(limit));
      shownBy = numbers(Uint32Array, limit.shown_by);
      options.push(['limit surface', { solid: 'limit' }], ['limit surface in its control mesh', { solid: 'limit', cage: 'cage' }]);
    }
    options.forEach(([text], k) => what.add(new Option(text, k)));
    const runs = curves.filter(curve => curve.frames).map(curve => ({
      curve, at: numbers(Uint32Array, curve.frames.at), errors: bytes(curve.frames.errors),
    }));
    for (const { curve } of runs) element('method').add(new Option(`${curve.name}: ${verdict(curve)}`));
    const none = { errors: new Uint8Array(count) };
    let inks;
    const readInks = () => {
      const style = getComputedStyle(document.documentElement);
      const ink = name => [...style.getPropertyValue(name).trim().slice(1).match(/../g).map(hex => parseInt(hex, 16) / 255), 1];
      inks = { edge: ink('--edge'), crease: ink('--crease') };
    };
    const redraw = () => {
      const { solid, cage } = options[what.selectedIndex][1];
      const run = runs[element('method').selectedIndex] ?? none, frame = +slider.value;
      let errors = run.errors.subarray(frame * count, (frame + 1) * count);
      if (solid === 'limit') errors = Uint8Array.from(shownBy, v => errors[v]);
      view.show({ solid: solids[solid], errors, cage: solids[cage], inks });
      if (!run.curve) return;
      const { curve } = run, iteration = run.at[frame], entry = entryAt(curve, iteration);
      const error = curve.at[entry] === iteration ? `, largest error ${curve.max[entry].toExponential(2)} ${data.unit}` : '';
      const end = iteration === curve.iterations ? `: ${curve.outcome}` : '';
      element('iteration-value').textContent = `iteration ${iteration} of ${curve.iterations}${error}${end}`;
    };
    const choose = () => {
      slider.max = Math.max(0, (runs[element('method').selectedIndex]?.at.length ?? 1) - 1);
      slider.value = Math.min(+slider.value, +slider.max);
      redraw();
    };
    let timer = null;
    const stop = () => {
      clearInterval(timer);
      timer = null;
      play.textContent = '▶';
      play.setAttribute('aria-label', 'play');
    };
    const toggle = () => {
      if (timer !== null) return stop();
      if (slider.value === slider.max) slider.value = 0;
      play.textContent = '❚❚';
      play.setAttribute('aria-label', 'pause');
      redraw();
      timer = setInterval(() => {
        slider.value = +slider.value + 1;
        redraw();
        if (slider.value === slider.max) stop();
      }, 150);
    };
    const move = (yaw, pitch, zoom) => {
      const { camera } = view;
      camera.yaw += yaw;
      camera.pitch = clamp(camera.pitch + pitch, -1.55, 1.55);
      camera.distance = clamp(camera.distance * zoom, 1.4, 12);
      redraw();
    };
    const fingers = new Map();
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    canvas.addEventListener('pointerdown', event => {
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', event => {
      const last = fingers.get(event.pointerId);
      if (!last) return;
      const before = fingers.size === 2 ? spread() : 0;
      const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
      Object.assign(last, { x: event.clientX, y: event.clientY });
      if (fingers.size === 2) move(0, 0, before / Math.max(spread(), 1)); else move(0.008 * dx, 0.008 * dy, 1);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, event => fingers.delete(event.pointerId));
    canvas.addEventListener('wheel', event => {
      event.preventDefault();
      move(0, 0, Math.exp(0.001 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener('keydown', event => {
      const keys = {
        ArrowLeft: () => move(-0.1, 0, 1), ArrowRight: () => move(0.1, 0, 1),
        ArrowUp: () => move(0, -0.1, 1), ArrowDown: () => move(0, 0.1, 1),
        '+': () => move(0, 0, 0.9), '-': () => move(0, 0, 1 / 0.9), ' ': toggle,
      };
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    what.addEventListener('change', redraw);
    element('method').addEventListener('change', choose);
    slider.addEventListener('input', () => { stop(); redraw(); });
    play.addEventListener('click', toggle);
    readInks();
    redrawOnScheme(() => { readInks(); redraw(); });
    new ResizeObserver(redraw).observe(canvas);
    choose();
  }
}

// All methods.
{
  const columns = [
    ['method', row => row.method], ['parameter', row => row.parameter], ['outcome', row => row.status],
    ['iterations', row => row.iterations], [`largest error (${data.unit})`, row => short(row.max_error)],
    ['measured rate', row => short(row.observed_rate, 4)], ['predicted', row => short(row.predicted_rate, 4)],
    ['set-up (s)', row => short(row.seconds.setup)], ['solve (s)', row => short(row.seconds.solve)], ['', row => row.detail ?? ''],
  ];
  const table = element('rows'), head = add(table, 'tr');
  columns.forEach(([name], k) => add(head, 'th', name, { className: k < 3 ? 'text' : '' }));
  for (const row of data.rows) {
    const line = add(table, 'tr');
    columns.forEach(([, value], k) => {
      const failed = k === 2 && row.status !== 'converged' ? ' failed' : '';
      add(line, 'td', String(value(row)), { className: k < 3 ? `text${failed}` : k === columns.length - 1 ? 'detail' : '' });
    });
  }
  const others = data.rows.filter(row => row.status !== 'converged');
  element('refused').textContent = [
    others.length > 0 ? `${others.length} of ${data.rows.length} did not converge.` : 'All converged.',
    data.refused ? `Not run: ${data.refused}.` : '',
  ].join(' ').trim();
}
document.documentElement.dataset.ready = 'true';
