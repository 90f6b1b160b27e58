// --- a pile: load and settlement, forces along it, friction against slip -----------------------

part(() => {
  const host = document.getElementById('pile-charts');
  if (!host) return;
  const piled = runs.filter(run => run.pile);
  const key = place => (place.time == null ? `${place.phase} ${place.increment}` : place.time.toFixed(9));
  const places = new Map();
  for (const run of piled) for (const place of run.pile.increments) if (!places.has(key(place))) places.set(key(place), place);
  const steps = [...places.values()];
  if (steps.every(step => step.time != null)) steps.sort((a, b) => a.time - b.time);
  const phases = [...new Set(steps.map(step => step.phase))];
  const tested = piled.map(run => run.resistances && run.resistances.phase).find(phase => phases.includes(phase));
  const state = { phase: tested || '', step: steps.length - 1, pins: [], over: 'slip' };
  const force = unitOf('pile_head_load') || 'kN';

  // Load and settlement: the head, shaft and base of one run, or the heads of several.
  const loads = [['pile_head_load', 'head'], ['pile_shaft_load', 'shaft'], ['pile_base_load', 'base']];
  const loadBody = make('div', {});
  const loadChart = makeChart(loadBody, 420, () => 'pile_load_settlement');
  const allSettlements = () => [].concat(...piled.map(run => column(run, 'pile_settlement', state.phase || null) || []));
  const reaches = (xs, ys, load) => {
    for (let i = 1; i < xs.length; i++) {
      if ([xs[i - 1], xs[i], ys[i - 1], ys[i]].some(v => v == null)) continue;
      if (xs[i - 1] < load && xs[i] >= load) return ys[i - 1] + (ys[i] - ys[i - 1]) * (load - xs[i - 1]) / (xs[i] - xs[i - 1]);
    }
    return null;
  };
  const drawLoads = () => {
    const scale = scaled('m', largestOf(allSettlements()) / 10);
    const series = [];
    piled.forEach(run => {
      const r = runs.indexOf(run);
      const settled = column(run, 'pile_settlement', state.phase || null);
      if (!settled) return;
      const down = settled.map(v => (v == null ? null : v * scale.factor));
      // From where settlements are counted, in front of the first increment.
      const start = state.phase && run.resistances && run.resistances.phase === state.phase ? run.resistances.start : null;
      const at = settled.findIndex(v => v != null);
      const from = (values, first) => (start && at >= 0 ? [...values.slice(0, at), first, ...values.slice(at)] : values);
      const told = row => (!start || row < at ? place(run, row) : row === at ? 'start' : place(run, row - 1));
      loads.slice(0, isComparison ? 1 : 3).forEach(([name, word], k) => {
        const load = column(run, name, state.phase || null);
        if (load) {
          series.push({
            name: isComparison ? run.name : word, x: from(load, start && start[k + 1]), y: from(down, start && start[0] * scale.factor), colour: isComparison ? runColour(r) : k, unnamed: isMany,
            width: k ? 1.6 : 2.2, points: !isMany && down.filter(v => v != null).length <= 60, radius: 1.8, tip: told,
          });
        }
      });
      const found = run.resistances;
      if (isComparison || !found || (state.phase && state.phase !== found.phase)) return;
      const head = column(run, 'pile_head_load', state.phase || null);
      const mark = (name, load, s, n) => {
        if (load == null || s == null) return;
        series.push({ name: `${name}: ${shown(Number(load.toPrecision(4)))} ${force}`, x: [load], y: [s], colour: n, line: false, points: true, radius: 5, tip: () => 'resistance' });
      };
      mark('10 % of the diameter', found.resistance_10_percent_diameter, 0.1 * found.diameter * scale.factor, 3);
      mark('Davisson', found.resistance_davisson, reaches(head, down, found.resistance_davisson), 4);
      if (found.resistance_chin != null) {
        const deepest = largestOf(down);
        const load = found.resistance_chin;
        series.push({ name: `Chin: ${shown(Number(load.toPrecision(4)))} ${force}`, x: [load, load], y: [0, deepest], colour: 5, dash: [7, 4], tip: () => 'asymptote' });
      }
    });
    loadChart.set({ x: { label: `load (${force})` }, y: { label: `settlement of the head (${scale.unit})`, down: true }, series, keepLegend: !isMany });
  };

  // Along the depth.
  const along = run => run.pile.z;
  const atStep = (run, step, quantity) => {
    const at = run.pile.increments.findIndex(other => key(other) === key(step));
    const number = run.pile.columns.indexOf(quantity);
    return at < 0 || number < 0 ? null : run.pile.values[number][at];
  };
  const units = { axial_force: force, shaft_friction: 'kPa', normal_stress: 'kPa', slip: 'm', settlement: 'm' };
  const words = name => name.replace('_', ' ');
  const describe = step => {
    const run = piled[0];
    const row = run.history.increment.findIndex((n, i) => n === step.increment && run.history.phases[run.history.phase[i]] === step.phase);
    const load = column(run, 'pile_head_load');
    const head = load && row >= 0 && load[row] != null && !isComparison ? `head ${shown(Number(load[row].toPrecision(5)))} ${force}` : '';
    return [`${step.phase}, increment ${step.increment}`, head].filter(Boolean).join(' · ');
  };
  const title = make('h3', {});
  const steer = slider('increment', value => { state.step = value; updateProfiles(); });
  const panels = ['axial_force', 'shaft_friction', 'normal_stress'].map(quantity => {
    const body = make('div', {});
    const panel = { quantity, chart: makeChart(body, 460, () => `pile_${panel.quantity}`) };
    panel.node = make('div', {},
      make('div', { class: 'panel-head' },
        choice('', Object.keys(units).map(name => [name, words(name)]), quantity, value => { panel.quantity = value; drawPanel(panel); }),
        panel.chart.save(() => `${words(panel.quantity)} along the pile, ${describe(steps[state.step])}${colourWords()}`)),
      body);
    return panel;
  });
  const drawPanel = panel => {
    const { quantity } = panel;
    const { phase } = steps[state.step];
    const those = steps.filter((step, i) => step.phase === phase || state.pins.includes(i));
    const all = [].concat(...piled.map(run => [].concat(...those.map(step => atStep(run, step, quantity) || []))));
    const scale = scaled(units[quantity], largestOf(all) / 10);
    const series = [];
    const add = (run, step, pin) => {
      const values = atStep(run, step, quantity);
      if (!values) return;
      const r = runs.indexOf(run);
      series.push({
        name: [isComparison ? run.name : '', isComparison && pin == null ? '' : `${step.phase} ${step.increment}`].filter(Boolean).join(', '),
        x: values.map(v => (v == null ? null : v * scale.factor)), y: along(run), points: !isMany, unnamed: isMany,
        colour: isComparison ? runColour(r) : pin != null ? { along: (pin + 0.5) / state.pins.length } : 0,
        dash: isComparison && pin != null ? DASHES[1 + (pin % (DASHES.length - 1))] : [],
        width: pin == null ? 2.2 : 1.3, radius: pin == null ? 2.6 : 1.6, tip: () => describe(step),
      });
    };
    state.pins.forEach((pinned, pin) => { if (pinned !== state.step) piled.forEach(run => add(run, steps[pinned], pin)); });
    piled.forEach(run => add(run, steps[state.step], null));
    const ends = rangeOf([].concat(...piled.map(along))) || [0, 1];
    const room = 0.02 * (ends[1] - ends[0] || 1);
    panel.chart.set({
      x: { label: withUnit(words(quantity), scale.unit), range: padded(rangeOf([0, ...all.filter(v => v != null).map(v => v * scale.factor)])) },
      y: { label: piled[0].axisymmetric ? 'z (m)' : 'y (m)', range: [ends[0] - room, ends[1] + room] }, series, keepLegend: !isMany,
    });
  };
  const updateProfiles = () => {
    title.textContent = describe(steps[state.step]);
    host.dataset.step = state.step;
    panels.forEach(drawPanel);
  };
  const spread = () => {
    const { phase } = steps[state.step];
    const inPhase = steps.map((step, i) => [step.phase, i]).filter(([name]) => name === phase).map(([, i]) => i);
    const n = Math.min(5, inPhase.length);
    state.pins = Array.from({ length: n }, (_, i) => inPhase[Math.round((i + 1) * inPhase.length / n) - 1]);
    updateProfiles();
  };

  // Friction against slip at depths of the first run; others at their nearest.
  const depths = along(piled[0]).filter((_, i) => piled[0].pile.values[1].some(values => values[i] != null));
  const first = n => [...new Set(Array.from({ length: n }, (_, i) => Math.round((i + 0.5) * depths.length / n - 0.5)))];
  const picked = new Set(isComparison ? first(1) : first(4));
  const curveBody = make('div', {});
  const curveChart = makeChart(curveBody, 360, () => `pile_t_z_${state.over}`);
  const drawCurves = () => {
    const find = (run, z) => along(run).reduce((best, other, i) => (Math.abs(other - z) < Math.abs(along(run)[best] - z) ? i : best), 0);
    const series = [];
    let largest = 0;
    const add = (run, number, k) => {
      const station = find(run, depths[number]);
      const rows = run.pile.increments.map((step, i) => (state.phase && step.phase !== state.phase ? -1 : i)).filter(i => i >= 0);
      const of = name => rows.map(i => run.pile.values[run.pile.columns.indexOf(name)][i][station]);
      const xs = of(state.over);
      largest = Math.max(largest, largestOf(xs));
      const z = `z = ${shown(Number(along(run)[station].toPrecision(4)))} m`;
      series.push({
        name: isComparison ? `${run.name}, ${z}` : z, x: xs, y: of('shaft_friction'), unnamed: isMany, points: rows.length <= 60 && !isMany, radius: 1.8,
        colour: isComparison ? runColour(runs.indexOf(run)) : { along: depths.length > 1 ? number / (depths.length - 1) : 0 },
        dash: isComparison ? DASHES[k % DASHES.length] : [], tip: i => `${run.pile.increments[rows[i]].phase}, increment ${run.pile.increments[rows[i]].increment}`,
      });
    };
    [...picked].sort((a, b) => a - b).forEach((number, k) => piled.forEach(run => add(run, number, k)));
    const scale = scaled('m', largest / 10);
    series.forEach(s => { s.x = s.x.map(v => (v == null ? null : v * scale.factor)); });
    curveChart.set({ x: { label: withUnit(state.over, scale.unit) }, y: { label: 'shaft friction (kPa)' }, series, keepLegend: !isMany });
  };
  const chips = depths.map((z, number) => {
    const chip = make('button', {
      type: 'button', 'aria-pressed': picked.has(number), onclick: () => {
        if (!picked.delete(number)) picked.add(number);
        chip.setAttribute('aria-pressed', picked.has(number));
        drawCurves();
      },
    }, shown(Number(z.toPrecision(4))));
    return chip;
  });

  const draw = () => {
    drawLoads();
    updateProfiles();
    drawCurves();
  };
  const phaseChoice = choice('phase', [['', 'all'], ...phases.map(name => [name, name])], state.phase, value => { state.phase = value; drawLoads(); drawCurves(); });
  host.append(
    make('div', { class: 'card' },
      make('div', { class: 'card-head' }, make('h3', {}, 'Load and settlement'), loadChart.save(() => 'load and settlement' + colourWords())),
      make('div', { class: 'controls' }, phaseChoice), loadBody),
    make('div', { class: 'card' },
      make('div', { class: 'card-head' }, make('h3', {}, 'Friction at chosen depths'), curveChart.save(() => 'shaft friction' + colourWords())),
      make('div', { class: 'controls' },
        choice('over', [['slip', 'slip'], ['settlement', 'settlement there']], state.over, value => { state.over = value; drawCurves(); }),
        make('span', { class: 'chips', role: 'group', 'aria-label': 'depths' }, 'z (m) ', ...chips)), curveBody));
  document.getElementById('pile-profiles').append(
    make('div', { class: 'card-head' }, title),
    make('div', { class: 'controls' }, steer.node),
    make('div', { class: 'controls' },
      make('button', { type: 'button', title: 'keep this state in the picture', onclick: () => { if (!state.pins.includes(state.step)) state.pins.push(state.step); state.pins.sort((a, b) => a - b); updateProfiles(); } }, 'Pin'),
      make('button', { type: 'button', title: 'pin five states spread over this phase', onclick: spread }, 'Spread of the phase'),
      make('button', { type: 'button', title: 'unpin all', onclick: () => { state.pins = []; updateProfiles(); } }, 'Clear')),
    make('div', { class: 'panels' }, ...panels.map(panel => panel.node)));
  steer.set(state.step, steps.length - 1);
  draw();
  recolours.push(draw);
  chosen.pile = { loads: loadChart, body: panels[0].node.lastElementChild, along: panels[0].chart, curves: curveChart, steer, title };
});
