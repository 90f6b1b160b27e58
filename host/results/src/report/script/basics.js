'use strict';

// --- what every part needs ---------------------------------------------------------------------

/** Errors of this page, shown to the reader. */
const errors = [];

function complain(error) {
  const text = error && error.message ? error.message : String(error);
  errors.push(text);
  const note = make('div', { class: 'failure' }, 'A part of this page could not be drawn: ' + text);
  document.querySelector('header').append(note);
}

window.addEventListener('error', event => complain(event.error || event.message));

const runs = JSON.parse(document.getElementById('data').textContent);
const isComparison = runs.length > 1;

/** Of many runs: the settings that differ. They have no legend; a setting gives their colours. */
const varied = (node => (node ? JSON.parse(node.textContent) : null))(document.getElementById('varied'));
const isMany = varied != null;

/** Runs a part; if it fails the others still work. */
function part(start) {
  try {
    start();
  } catch (error) {
    complain(error);
  }
}

/** An element with attributes, listeners (on…) and children; texts stay texts. */
function make(tag, attributes, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
    else if (key.startsWith('aria-')) node.setAttribute(key, String(value));
    else if (value === true) node.setAttribute(key, '');
    else if (value !== false && value != null) node.setAttribute(key, value);
  }
  node.append(...children.filter(child => child != null));
  return node;
}

/** A drop-down list of [value, text] pairs. */
function choice(label, pairs, value, change) {
  const select = make('select', { onchange: () => change(select.value) },
    ...pairs.map(([key, text]) => make('option', { value: key, selected: String(key) === String(value) }, text)));
  return make('label', {}, label, select);
}

function tick(label, value, change) {
  const box = make('input', { type: 'checkbox', checked: value, onchange: () => change(box.checked) });
  return make('label', { class: 'tick' }, box, label);
}

const number = new Intl.NumberFormat('en', { maximumSignificantDigits: 6, useGrouping: false });

/** A number to read. */
function shown(value) {
  if (value == null || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (value === 0) return '0';
  if (size < 1e-3 || size >= 1e7) return String(Number(value.toPrecision(6)).toExponential());
  return number.format(value);
}

/** A name with its unit. */
function withUnit(name, unit) {
  return unit && unit !== '-' ? `${name} (${unit})` : name;
}

/** Lengths are shown in mm where that is what one would say. */
function scaled(unit, largest) {
  return unit === 'm' && largest < 0.1 ? { unit: 'mm', factor: 1000 } : { unit: unit || '', factor: 1 };
}

function largestOf(values) {
  let largest = 0;
  for (const value of values) if (value != null && Math.abs(value) > largest) largest = Math.abs(value);
  return largest;
}

function rangeOf(values) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value == null || !Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}

// --- colours -----------------------------------------------------------------------------------

// Okabe and Ito: they stay apart for most eyes and in grey.
const LIGHT = ['#0072b2', '#d55e00', '#009e73', '#b0528f', '#3a3f44', '#b8860b', '#56b4e9'];
const DARK = ['#56b4e9', '#ff8f4a', '#2fcf9f', '#e79cc8', '#d5dade', '#e6c229', '#8fb8ff'];
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [12, 5]];

const darkScheme = window.matchMedia('(prefers-color-scheme: dark)');
/** The page is for paper, whatever opens it. */
const onPaper = document.documentElement.classList.contains('paper');
let printing = onPaper;

function isDark() {
  return darkScheme.matches && !printing;
}

/** A series' colour: a number in the palette, a place 0 … 1 from first to last, a hue, or none. */
function colour(of, dark) {
  if (of.none) return '#888888';
  if (of.hue != null) return `hsl(${of.hue},${dark ? 70 : 75}%,${dark ? 66 : 38}%)`;
  if (of.along != null) return mapped(VIRIDIS, dark ? 1 - 0.65 * of.along : 0.9 * (1 - of.along));
  const palette = dark ? DARK : LIGHT;
  return palette[of % palette.length];
}

/** What many runs are coloured by: a number of `varied`, or their order. */
const colouring = { by: isMany && varied.length ? 0 : -1 };

/** A scale of the runs' values of a setting: numbers along a map, texts apart. */
const scaleOf = by => {
  const { name, numbers, texts } = by < 0 ? { name: 'order of the runs', numbers: runs.map((_, r) => r + 1) } : varied[by];
  if (numbers) {
    const [low, high] = rangeOf(numbers) || [0, 1];
    const log = low > 0 && high / low > 100;
    const at = value => (high > low ? (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)) : 0.5);
    return { name, low, high, log, middle: log ? Math.sqrt(low * high) : (low + high) / 2, of: r => ({ along: at(numbers[r]) }) };
  }
  const kinds = [...new Set(texts.filter(text => text !== ''))];
  const mark = kind => (kinds.length <= LIGHT.length ? kind : { hue: Math.round(360 * kind / kinds.length) });
  return { name, kinds, mark, of: r => (texts[r] === '' ? { none: true } : mark(kinds.indexOf(texts[r]))) };
};
let colourScale = null;

/** The colour of a run. */
function runColour(r) {
  if (!isMany) return r;
  colourScale = colourScale || scaleOf(colouring.by);
  return colourScale.of(r);
}

/** What is to be drawn again with other colours. */
const recolours = [];

function colourBy(by) {
  colouring.by = by;
  colourScale = scaleOf(by);
  for (const recolour of recolours) part(recolour);
}

/** What a picture of many runs says of its colours. */
function colourWords() {
  if (!isMany) return '';
  const { name, kinds, low, high } = colourScale || scaleOf(colouring.by);
  return `; colour: ${name}` + (kinds ? '' : `, ${shown(low)} to ${shown(high)}`);
}

function variable(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

const VIRIDIS = ['#440154', '#482475', '#414487', '#355f8d', '#2a788e', '#21918c', '#22a884', '#44bf70', '#7ad151', '#bddf26', '#fde725'];
const DIVERGING = ['#2b5c9e', '#5b8cc4', '#9dbfe0', '#d6e4f0', '#f3f3f3', '#f6d9cc', '#eba88e', '#d16a55', '#a82a33'];

/** The colour at 0 … 1 of a map. */
function mapped(map, t) {
  const at = Math.min(1, Math.max(0, t)) * (map.length - 1);
  const i = Math.min(map.length - 2, Math.floor(at));
  const channel = (text, k) => parseInt(text.slice(1 + 2 * k, 3 + 2 * k), 16);
  const mix = k => Math.round(channel(map[i], k) + (at - i) * (channel(map[i + 1], k) - channel(map[i], k)));
  return `rgb(${mix(0)},${mix(1)},${mix(2)})`;
}

// --- drawing again when the page changes -------------------------------------------------------

const redraws = [];

function redrawAll() {
  for (const redraw of redraws) part(redraw);
}

let pending = 0;
window.addEventListener('resize', () => {
  clearTimeout(pending);
  pending = setTimeout(redrawAll, 120);
});
darkScheme.addEventListener('change', redrawAll);
function setPrinting(on) {
  printing = on;
  document.documentElement.classList.toggle('print', on);
  redrawAll();
}
window.addEventListener('beforeprint', () => setPrinting(true));
window.addEventListener('afterprint', () => setPrinting(onPaper));

// --- saving pictures ---------------------------------------------------------------------------

function xml(text) {
  return String(text).replace(/[&<>"']/g, c => `&#${c.charCodeAt(0)};`);
}

function save(blob, name) {
  const url = URL.createObjectURL(blob);
  make('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** The picture of a text in SVG, twice as fine. */
function png(svg) {
  return new Promise((resolve, reject) => {
    const image = new Image();
    image.onload = () => {
      const canvas = make('canvas', { width: 2 * image.width, height: 2 * image.height });
      canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob(blob => (blob ? resolve(blob) : reject(new Error('the picture is too large'))));
    };
    image.onerror = () => reject(new Error('the picture cannot be drawn'));
    image.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(svg);
  });
}

/** Buttons that save what `draw` returns. */
function saveButtons(name, draw) {
  const svg = () => save(new Blob([draw()], { type: 'image/svg+xml' }), name() + '.svg');
  const picture = () => png(draw()).then(blob => save(blob, name() + '.png')).catch(complain);
  return make('span', { class: 'save' },
    make('button', { type: 'button', title: 'save as SVG', onclick: svg }, 'SVG'),
    make('button', { type: 'button', title: 'save as PNG', onclick: picture }, 'PNG'));
}

/** A slider with a button that plays it. */
function slider(label, change) {
  let timer = 0;
  const input = make('input', { type: 'range', min: 0, max: 0, step: 1, value: 0, 'aria-label': label, oninput: () => change(Number(input.value)) });
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = '▶';
    play.title = 'play';
  };
  const step = () => {
    const next = Number(input.value) + 1;
    if (next > Number(input.max)) return stop();
    input.value = next;
    change(next);
  };
  const start = () => {
    if (Number(input.value) >= Number(input.max)) {
      input.value = 0;
      change(0);
    }
    timer = setInterval(step, Math.max(60, Math.min(700, 5000 / (Number(input.max) + 1))));
    play.textContent = '⏸';
    play.title = 'stop';
  };
  const play = make('button', { type: 'button', title: 'play', 'aria-label': 'play', onclick: () => (timer ? stop() : start()) }, '▶');
  const go = by => {
    input.value = Number(input.value) + by;
    change(Number(input.value));
  };
  const node = make('span', { class: 'controls grow' }, play,
    make('button', { type: 'button', title: 'one back', onclick: () => go(-1) }, '‹'), input,
    make('button', { type: 'button', title: 'one on', onclick: () => go(1) }, '›'));
  return { node, input, set: (value, last) => { input.max = last; input.value = value; } };
}
