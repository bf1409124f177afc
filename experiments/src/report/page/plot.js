'use strict';
// Plots in SVG, drawn at the size in pixels that they have, so that their text has its size on every screen.

const SVG = 'http://www.w3.org/2000/svg';

/** Adds an element of SVG to `parent`. */
function draw(parent, name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

/** Adds an element of HTML to `parent`. */
function add(parent, name, text, properties) {
  const element = document.createElement(name);
  if (text !== undefined) element.textContent = text;
  Object.assign(element, properties);
  parent.append(element);
  return element;
}

/** The colour and the dashes of a method: as in the plots of the programs. Black is the colour of the text, light on dark. */
function strokeOf({ colour, dash }) {
  const dashes = { Solid: 'none', Dashed: '7 4', Dotted: '2 3', DashDotted: '8 3 2 3' };
  return { stroke: colour === '000000' ? 'var(--ink)' : `#${colour}`, 'stroke-dasharray': dashes[dash] };
}

/** A piece of a curve of this look, for legends. */
function swatch(parent, look) {
  const svg = draw(parent, 'svg', { class: 'swatch', viewBox: '0 0 24 10', 'aria-hidden': 'true' });
  draw(svg, 'line', { x1: 0, x2: 24, y1: 5, y2: 5, 'stroke-width': 2.5, ...strokeOf(look) });
}

/** A power of ten in words. */
function power(exponent) {
  const digits = { '-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹' };
  return '10' + String(exponent).replace(/./g, c => digits[c]);
}

/** A number with a few digits. */
function short(x, digits = 3) {
  if (x === null || x === undefined || !Number.isFinite(x)) return '–';
  return x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5) ? x.toExponential(digits - 1) : String(+x.toPrecision(digits));
}

/** Numbers of a linear axis, about `count` of them, with their labels. */
function linearTicks([from, to], count) {
  const raw = (to - from) / Math.max(count, 1), size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(k => k * size).find(s => s >= raw * 0.999);
  const ticks = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to * (1 + 1e-9); k++) ticks.push([k * step, String(+(k * step).toPrecision(6))]);
  return ticks;
}

/** Powers of ten of a logarithmic axis. */
function powerTicks([from, to], count) {
  const first = Math.ceil(Math.log10(from) - 1e-9), last = Math.floor(Math.log10(to) + 1e-9);
  const step = Math.max(1, Math.ceil((last - first) / Math.max(count, 1)));
  const ticks = [];
  for (let k = first; k <= last; k++) if (k % step === 0) ticks.push([10 ** k, power(k)]);
  return ticks;
}

/**
 * An empty plot in `host`: ranges `x` and `y`, the latter logarithmic if `log`. Has the places `X` and `Y` of numbers in
 * pixels, the number `at` a pixel, and a group `inside` whose parts are cut off at the frame.
 */
function axes(host, { x, y, log, height, xLabel, yTicks, label }) {
  host.replaceChildren();
  const width = Math.max(host.clientWidth, 200), left = 46, right = 12, top = 8, bottom = xLabel ? 34 : 20;
  const svg = draw(host, 'svg', { viewBox: `0 0 ${width} ${height}`, height, role: 'img', 'aria-label': label });
  const scale = log ? Math.log10 : v => v;
  const X = v => left + (v - x[0]) / (x[1] - x[0]) * (width - left - right);
  const Y = v => height - bottom - (scale(v) - scale(y[0])) / (scale(y[1]) - scale(y[0])) * (height - top - bottom);
  for (const [v, text] of linearTicks(x, width / 80)) {
    draw(svg, 'line', { x1: X(v), x2: X(v), y1: top, y2: height - bottom, class: 'grid' });
    draw(svg, 'text', { x: X(v), y: height - bottom + 15, 'text-anchor': 'middle' }, text);
  }
  for (const [v, text] of yTicks ?? (log ? powerTicks : linearTicks)(y, height / 40)) {
    draw(svg, 'line', { x1: left, x2: width - right, y1: Y(v), y2: Y(v), class: 'grid' });
    draw(svg, 'text', { x: left - 6, y: Y(v) + 4, 'text-anchor': 'end' }, text);
  }
  if (xLabel) draw(svg, 'text', { x: (left + width - right) / 2, y: height - 3, 'text-anchor': 'middle' }, xLabel);
  const id = `${host.id}-frame`;
  const clip = draw(draw(svg, 'defs', {}), 'clipPath', { id });
  draw(clip, 'rect', { x: left, y: top - 3, width: width - left - right + 3, height: height - top - bottom + 6 });
  const inside = draw(svg, 'g', { 'clip-path': `url(#${id})` });
  const at = pixel => x[0] + (pixel - left) / (width - left - right) * (x[1] - x[0]);
  return { svg, inside, X, Y, at, width, height, left, right, top, bottom };
}

/** The commands of a line through points; one that is `null` breaks it. */
function line(points) {
  let move = true;
  return points.map(p => {
    if (p === null) { move = true; return ''; }
    const command = `${move ? 'M' : 'L'}${p[0].toFixed(1)} ${p[1].toFixed(1)}`;
    move = false;
    return command;
  }).join('');
}

/** Calls `redraw` now, and again when the width of `host` changes. */
function keepDrawn(host, redraw) {
  let width = 0;
  new ResizeObserver(() => {
    if (host.clientWidth !== width) { width = host.clientWidth; redraw(); }
  }).observe(host);
}
