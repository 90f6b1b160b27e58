'use strict';
// The pictures of a study: drawn from the data of the page, as SVG.

const data = JSON.parse(document.getElementById('data').textContent);
const { parameters, outputs, history } = data;
const SVG = 'http://www.w3.org/2000/svg';
const VIRIDIS = ['#440154', '#482475', '#414487', '#355f8d', '#2a788e', '#21918c', '#22a884', '#44bf70', '#7ad151', '#bddf26'];

function element(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  if (text != null) made.textContent = text;
  return made;
}

/** A number to read. */
function shown(value) {
  if (value == null || !Number.isFinite(value)) return '–';
  return String(Number(value.toPrecision(4)));
}

function rangeOf(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value == null) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) return null;
  const room = high > low ? 0.04 * (high - low) : Math.abs(low) * 0.1 || 1;
  return [low - room, high + room];
}

/** An empty plot with its frame, the ends of its axes and their names. */
function plot({ width, height, x, y, xName, yName, xTexts, label }) {
  const [left, right, top, bottom] = [64, 12, 12, 40];
  const svg = element('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label });
  const [w, h] = [width - left - right, height - top - bottom];
  const at = {
    x: value => left + (w * (value - x[0])) / (x[1] - x[0]),
    y: value => top + h - (h * (value - y[0])) / (y[1] - y[0]),
  };
  svg.append(element('rect', { class: 'frame', x: left, y: top, width: w, height: h }));
  const tick = (range, share) => range[0] + share * (range[1] - range[0]);
  if (xTexts) xTexts.forEach((text, i) => svg.append(element('text', { x: at.x(i), y: top + h + 15, 'text-anchor': 'middle' }, text)));
  else {
    for (const [share, anchor] of [[0, 'start'], [0.5, 'middle'], [1, 'end']]) {
      svg.append(element('text', { x: at.x(tick(x, share)), y: top + h + 15, 'text-anchor': anchor }, shown(tick(x, share))));
    }
  }
  for (const share of [0, 0.5, 1]) {
    svg.append(element('text', { x: left - 5, y: at.y(tick(y, share)) + 4, 'text-anchor': 'end' }, shown(tick(y, share))));
  }
  svg.append(element('text', { class: 'name', x: left + w / 2, y: height - 6, 'text-anchor': 'middle' }, xName));
  const turned = `rotate(-90 11 ${top + h / 2})`;
  svg.append(element('text', { class: 'name', x: 11, y: top + h / 2, 'text-anchor': 'middle', transform: turned }, yName));
  return { svg, at };
}

function withUnit(name) {
  const unit = data.units[name];
  return unit && unit !== '-' ? `${name} (${unit})` : name;
}

/** Every output against every parameter. */
function scatters() {
  const place = document.getElementById('scatters');
  for (const output of outputs) {
    const y = rangeOf(output.numbers);
    if (!y) continue;
    const row = document.createElement('div');
    parameters.forEach((parameter, p) => {
      const x = parameter.texts ? [-0.5, parameter.texts.length - 0.5] : rangeOf(parameter.numbers);
      const label = `${output.name} against ${parameter.name}`;
      const { svg, at } = plot({ width: 290, height: 220, x, y, xName: parameter.name, yName: withUnit(output.name), xTexts: parameter.texts, label });
      output.numbers.forEach((value, r) => {
        if (value == null) return;
        const point = element('circle', { class: 'point', cx: at.x(parameter.numbers[r]), cy: at.y(value), r: output.numbers.length > 300 ? 1.6 : 2.6 });
        point.append(element('title', {}, `run ${r + 1}: ${shown(value)}`));
        svg.append(point);
      });
      const effect = output.effects.find(e => e.parameter === p);
      if (effect && !parameter.texts) {
        const points = effect.levels.map(level => `${at.x(level.value)},${at.y(level.mean)}`);
        svg.append(element('polyline', { class: 'mean', points: points.join(' ') }));
      } else if (effect) {
        for (const level of effect.levels) {
          svg.append(element('line', { class: 'mean', x1: at.x(level.value - 0.3), x2: at.x(level.value + 0.3), y1: at.y(level.mean), y2: at.y(level.mean) }));
        }
      }
      row.append(svg);
    });
    place.append(row);
  }
}

/** Of every output: means at the lowest and at the highest level of each parameter. */
function tornado() {
  const place = document.getElementById('tornado');
  for (const output of outputs) {
    const effects = output.effects.filter(effect => effect.levels.length > 1);
    if (!effects.length) continue;
    const means = effects.flatMap(effect => effect.levels.map(level => level.mean));
    const known = output.numbers.filter(value => value != null);
    const middle = known.reduce((sum, value) => sum + value, 0) / known.length;
    const x = rangeOf([...means, middle]);
    const names = Math.max(...effects.map(effect => parameters[effect.parameter].name.length));
    const [left, width, step] = [Math.min(280, 7 * names + 16), 560, 24];
    const height = 40 + step * effects.length;
    const svg = element('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': `tornado of ${output.name}` });
    const at = value => left + ((width - left - 14) * (value - x[0])) / (x[1] - x[0]);
    effects.forEach((effect, i) => {
      const y = 8 + step * i;
      const ends = [effect.levels[0], effect.levels[effect.levels.length - 1]];
      svg.append(element('text', { class: 'name', x: left - 8, y: y + 14, 'text-anchor': 'end' }, parameters[effect.parameter].name));
      ends.forEach((level, end) => {
        const [a, b] = [at(middle), at(level.mean)];
        const bar = element('rect', { class: end ? 'bar' : 'bar low', x: Math.min(a, b), y, width: Math.max(Math.abs(b - a), 1), height: 18 });
        const of = parameters[effect.parameter].texts;
        const text = of ? of[level.value] : shown(level.value);
        bar.append(element('title', {}, `${parameters[effect.parameter].name} ${text}: ${shown(level.mean)}`));
        svg.append(bar);
      });
    });
    const bottom = 8 + step * effects.length;
    svg.append(element('line', { class: 'middle', x1: at(middle), x2: at(middle), y1: 4, y2: bottom }));
    for (const [value, anchor] of [[x[0], 'start'], [middle, 'middle'], [x[1], 'end']]) {
      svg.append(element('text', { x: at(value), y: bottom + 13, 'text-anchor': anchor }, shown(value)));
    }
    svg.append(element('text', { class: 'name', x: (left + width) / 2, y: bottom + 28, 'text-anchor': 'middle' }, `${withUnit(output.name)}: light at the lowest level, dark at the highest`));
    place.append(svg);
  }
}

function choice(name, options, chosen, change) {
  const label = document.createElement('label');
  const select = document.createElement('select');
  select.id = `choice-${name}`;
  options.forEach((option, i) => {
    const made = document.createElement('option');
    made.value = i;
    made.textContent = option;
    made.selected = i === chosen;
    select.append(made);
  });
  select.addEventListener('change', change);
  label.append(`${name} `, select);
  document.getElementById('choices').append(label);
  return () => Number(select.value);
}

/** The colour of a run by the value of a parameter. */
function colour(parameter, r) {
  const { numbers, texts } = parameter;
  const [low, high] = texts ? [0, texts.length - 1] : [Math.min(...numbers), Math.max(...numbers)];
  const share = high > low ? (numbers[r] - low) / (high - low) : 0.5;
  return VIRIDIS[Math.min(VIRIDIS.length - 1, Math.floor(share * VIRIDIS.length))];
}

/** Two columns of all histories, each run in the colour of a parameter. */
function curves() {
  const { names, phases, runs } = history;
  if (!names.length) {
    document.getElementById('curve').textContent = 'No run has a history yet.';
    return;
  }
  const redraw = () => draw();
  const probe = names.findIndex(name => name !== 'increment' && name !== 'time');
  const firstAt = data.at ? names.indexOf(data.at) : -1;
  const firstOutput = names.indexOf(data.first);
  const x = choice('x', names, Math.max(firstAt, 0), redraw);
  const y = choice('y', names, firstOutput >= 0 ? firstOutput : Math.max(probe, 0), redraw);
  const phase = choice('phase', ['all', ...phases], data.phase ? phases.indexOf(data.phase) + 1 : phases.length, redraw);
  const by = choice('colour', parameters.map(parameter => parameter.name), 0, redraw);
  function draw() {
    const place = document.getElementById('curve');
    const wanted = phase() - 1;
    const lines = runs.map(run => {
      const [xs, ys, ps] = [run.values[x()] || [], run.values[y()] || [], run.phase];
      const points = [];
      xs.forEach((value, i) => {
        if (value != null && ys[i] != null && (wanted < 0 || ps[i] === wanted)) points.push([value, ys[i]]);
      });
      return points;
    });
    const [xr, yr] = [0, 1].map(k => rangeOf(lines.flatMap(line => line.map(point => point[k]))));
    place.replaceChildren();
    if (!xr || !yr) {
      place.textContent = 'No run has these columns in this phase.';
      return;
    }
    const parameter = parameters[by()];
    const { svg, at } = plot({ width: 900, height: 460, x: xr, y: yr, xName: withUnit(names[x()]), yName: withUnit(names[y()]), label: `${names[y()]} over ${names[x()]}` });
    lines.forEach((line, k) => {
      if (!line.length) return;
      const r = runs[k].run;
      const points = line.map(([a, b]) => `${at.x(a).toFixed(1)},${at.y(b).toFixed(1)}`).join(' ');
      const drawn = element('polyline', { class: 'run', points, stroke: colour(parameter, r) });
      const value = parameter.texts ? parameter.texts[parameter.numbers[r]] : shown(parameter.numbers[r]);
      drawn.append(element('title', {}, `run ${r + 1}: ${parameter.name} ${value}`));
      svg.append(drawn);
    });
    place.append(svg, legend(parameter));
  }
  draw();
}

function legend(parameter) {
  const { numbers, texts, name } = parameter;
  const svg = element('svg', { class: 'plot', width: 300, height: 46, role: 'img', 'aria-label': `colours of ${name}` });
  const n = VIRIDIS.length;
  VIRIDIS.forEach((fill, i) => svg.append(element('rect', { x: 10 + (280 / n) * i, y: 18, width: 280 / n, height: 10, fill })));
  const ends = texts ? [texts[0], texts[texts.length - 1]] : [Math.min(...numbers), Math.max(...numbers)].map(shown);
  svg.append(element('text', { class: 'name', x: 150, y: 13, 'text-anchor': 'middle' }, name));
  svg.append(element('text', { x: 10, y: 41 }, ends[0]), element('text', { x: 290, y: 41, 'text-anchor': 'end' }, ends[1]));
  return svg;
}

tornado();
scatters();
curves();
document.documentElement.dataset.drawn = 'yes';
