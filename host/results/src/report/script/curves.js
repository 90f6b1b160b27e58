// --- curves of probes --------------------------------------------------------------------------

/** Values of a column of a run's history; of one phase only, if asked for. */
function column(run, name, phase) {
  const { history } = run;
  const number = history.names.indexOf(name);
  if (number < 0) return null;
  const only = phase == null ? -1 : history.phases.indexOf(phase);
  if (phase != null && only < 0) return null;
  return history.values[number].map((value, row) => (only < 0 || history.phase[row] === only ? value : null));
}

function unitOf(name) {
  const run = runs.find(r => r.units[name]);
  return run ? run.units[name] : '';
}

/** The unit all of these have. */
function commonUnit(names) {
  const unit = unitOf(names[0]);
  return names.every(name => unitOf(name) === unit) ? unit : '';
}

function place(run, row) {
  const { history } = run;
  return `${history.phases[history.phase[row]]}, increment ${history.increment[row]}`;
}

/** Curves of several probes of all runs. Runs have colours and probes dashes, or probes colours. */
function curves(x, ys, phase) {
  const series = [];
  runs.forEach((run, r) => ys.forEach((y, k) => {
    const [xs, values] = [column(run, x, phase), column(run, y, phase)];
    if (!xs || !values) return;
    // Of many runs the legend tells the probes apart, not the runs.
    const byProbe = isMany && ys.length > 1;
    const name = !isComparison || byProbe ? y : ys.length > 1 ? `${run.name}: ${y}` : run.name;
    series.push({
      name, x: xs, y: values, colour: isComparison ? runColour(r) : k, dash: isComparison ? DASHES[k % DASHES.length] : [],
      unnamed: isMany && !(byProbe && r === 0), width: isMany ? 1.2 : undefined,
      points: !isMany && xs.filter(v => v != null).length <= 60, radius: 1.8, tip: row => (byProbe ? `${run.name}, ` : '') + place(run, row),
    });
  }));
  return series;
}

/** What makes figures of several cases the same. */
const figureKey = figure => JSON.stringify([figure.name, figure.x, figure.y, figure.phase]);

/** Points that were measured for a figure of any run, as markers; `n` colours are taken. Those of one curve have its colour. */
function measured(figure, n) {
  const same = [].concat(...runs.map(run => (run.figures || []).filter(other => figureKey(other) === figureKey(figure))));
  const all = [].concat(...same.map(other => other.measured || []));
  const curves = figure.y.length;
  const colourOf = k => (isComparison ? n + k : curves === 1 ? 0 : all.length === curves ? k : n + k);
  return all.map(({ label, x, y }, k) => ({ name: label, x, y, colour: colourOf(k), line: false, points: true, radius: 3, tip: () => 'measured' }));
}

/** Figures of all cases; those of the same name and probes once. */
function allFigures() {
  const figures = new Map();
  for (const run of runs) {
    for (const figure of run.figures || []) {
      const key = figureKey(figure);
      if (!figures.has(key)) figures.set(key, figure);
    }
  }
  return [...figures.values()];
}

const chosen = {};

part(() => {
  const host = document.getElementById('figures');
  if (!host) return;
  const figures = allFigures();
  chosen.figures = figures.map(figure => {
    const title = figure.title || figure.name.replace(/[_-]/g, ' ');
    const body = make('div', {});
    const chart = makeChart(body, 340, () => figure.name);
    host.append(make('div', { class: 'card', 'data-figure': figure.name },
      make('div', { class: 'card-head' }, make('h3', {}, title), chart.save(() => title + colourWords())), body));
    const fill = () => chart.set({
      x: { label: figure.x_label || withUnit(figure.x, unitOf(figure.x)) },
      y: { label: figure.y_label || withUnit(figure.y.join(', '), commonUnit(figure.y)), down: figure.y_reversed },
      series: [...curves(figure.x, figure.y, figure.phase), ...measured(figure, isComparison ? runs.length : figure.y.length)],
      keepLegend: !isMany,
    });
    fill();
    recolours.push(fill);
    return chart;
  });
  if (!figures.length) host.remove();
});

// --- any probe over any other ------------------------------------------------------------------

part(() => {
  const host = document.getElementById('chooser');
  if (!host) return;
  const names = [...new Set([].concat(...runs.map(run => run.history.names)))];
  const phases = [...new Set([].concat(...runs.map(run => run.history.phases)))];
  const first = allFigures()[0];
  const state = { x: first ? first.x : 'time', phase: first && first.phase ? first.phase : '' };
  const unseen = names.filter(name => name !== state.x && name !== 'time' && !allFigures().some(f => f.y.includes(name)));
  state.y = new Set([unseen[0] || names[names.length - 1]]);
  const body = make('div', {});
  const chart = makeChart(body, 340, () => [...state.y].join('_') + '_over_' + state.x);
  const title = make('h3', {});
  const caption = () => `${[...state.y].join(', ')} over ${state.x}`;
  const captioned = () => caption() + colourWords();
  const update = () => {
    const ys = names.filter(name => state.y.has(name));
    title.textContent = ys.length ? caption() : 'nothing chosen';
    chart.set({
      x: { label: withUnit(state.x, unitOf(state.x)) },
      y: { label: ys.length ? withUnit(ys.join(', '), commonUnit(ys)) : '' },
      series: curves(state.x, ys, state.phase || null),
    });
  };
  const chips = names.map(name => {
    const chip = make('button', {
      type: 'button', 'aria-pressed': state.y.has(name), onclick: () => {
        if (!state.y.delete(name)) state.y.add(name);
        chip.setAttribute('aria-pressed', state.y.has(name));
        update();
      },
    }, name);
    return chip;
  });
  host.append(
    make('div', { class: 'card-head' }, title, chart.save(captioned)),
    make('div', { class: 'controls' },
      choice('over', names.map(name => [name, withUnit(name, unitOf(name))]), state.x, value => { state.x = value; update(); }),
      choice('phase', [['', 'all'], ...phases.map(p => [p, p])], state.phase, value => { state.phase = value; update(); }),
      make('span', { class: 'chips', role: 'group', 'aria-label': 'curves' }, ...chips)),
    body);
  update();
  recolours.push(update);
  chosen.chart = chart;
});

// --- colours of many runs ----------------------------------------------------------------------

part(() => {
  const host = document.getElementById('colouring');
  if (!host) return;
  const key = make('div', { class: 'colour-key' });
  const swatch = of => {
    const node = make('i', { class: 'swatch' });
    node.style.background = colour(of, isDark());
    return node;
  };
  const draw = () => {
    const { kinds, mark, low, middle, high, log } = colourScale || scaleOf(colouring.by);
    if (kinds) {
      key.replaceChildren(...kinds.map((text, kind) => make('span', {}, swatch(mark(kind)), text)));
      return;
    }
    const bar = make('div', { class: 'bar' });
    const stops = Array.from({ length: 11 }, (_, i) => colour({ along: i / 10 }, isDark()));
    bar.style.background = `linear-gradient(to right, ${stops.join(', ')})`;
    key.replaceChildren(bar, make('div', { class: 'bar-ends' }, make('span', {}, shown(low)), make('span', {}, shown(middle) + (log ? ' (logarithmic)' : '')), make('span', {}, shown(high))));
  };
  const pairs = [...varied.map((setting, by) => [by, setting.name]), [-1, 'order of the runs']];
  host.append(make('div', { class: 'controls' }, choice('colour by', pairs, colouring.by, value => colourBy(Number(value))), key));
  draw();
  redraws.push(draw);
  recolours.push(draw);
});
