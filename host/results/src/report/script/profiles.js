// --- profiles along interfaces -----------------------------------------------------------------

part(() => {
  const host = document.getElementById('profile');
  if (!host) return;
  const profiled = runs.filter(run => run.profile);
  const groups = [...new Set([].concat(...profiled.map(run => run.profile.groups.map(g => g.name))))];
  const quantities = [...new Set([].concat(...profiled.map(run => run.profile.columns)))];
  // Increments are matched by their time, so that runs in steps of different length compare.
  const key = place => (place.time == null ? `${place.phase} ${place.increment}` : place.time.toFixed(9));
  const places = new Map();
  for (const run of profiled) {
    for (const place of run.profile.increments) if (!places.has(key(place))) places.set(key(place), place);
  }
  const steps = [...places.values()];
  if (steps.every(step => step.time != null)) steps.sort((a, b) => a.time - b.time);

  const state = { group: groups[0], rows: 'mean', step: steps.length - 1, pins: [], fixed: true };
  const groupOf = run => run.profile.groups.find(g => g.name === state.group);

  /** Profiles of one run at one step: the mean over the rows across the layer, or every row. */
  const lines = (run, step, quantity) => {
    const { profile } = run;
    const group = groupOf(run);
    const number = profile.columns.indexOf(quantity);
    const at = profile.increments.findIndex(place => key(place) === key(step));
    if (!group || number < 0 || at < 0) return [];
    const values = profile.values[number][at];
    if (state.rows === 'mean' || group.rows === 1) {
      const mean = group.s.map((_, i) => {
        const here = values.slice(group.offset + i * group.rows, group.offset + (i + 1) * group.rows).filter(v => v != null);
        return here.length ? here.reduce((a, b) => a + b, 0) / here.length : null;
      });
      return [{ s: group.s, values: mean, row: null }];
    }
    const axis = run.axisymmetric ? (group.vertical ? 'r' : 'z') : group.vertical ? 'x' : 'y';
    return Array.from({ length: group.rows }, (_, k) => ({
      s: group.s,
      values: group.s.map((_s, i) => values[group.offset + i * group.rows + k]),
      row: group.across.length ? `${axis} = ${shown(Number((1000 * group.across[k]).toPrecision(5)))} mm` : `row ${k + 1}`,
    }));
  };

  /** What a step is called, with the displacement or whatever the first figure is drawn over. */
  const driver = (allFigures()[0] || {}).x;
  const driven = step => {
    const run = profiled[0];
    const values = driver && column(run, driver);
    const row = run.history.increment.findIndex((n, i) => n === step.increment && run.history.phases[run.history.phase[i]] === step.phase);
    if (!values || row < 0 || values[row] == null) return '';
    const unit = unitOf(driver);
    // Rounding errors of zero are shown as zero.
    const value = Math.abs(values[row]) < 1e-9 * largestOf(values) ? 0 : values[row];
    return `${driver} = ${shown(value)}${unit && unit !== '-' ? ' ' + unit : ''}`;
  };
  const describe = step => [`${step.phase}, increment ${step.increment}`, driven(step)].filter(Boolean).join(' · ');

  const title = make('h3', { id: 'profile-title' });
  const steer = slider('increment', value => { state.step = value; update(); });

  // Up to three quantities side by side.
  const wanted = ['traction_t', 'traction_n', 'jump_t', ...quantities];
  const picked = [...new Set(wanted.filter(name => quantities.includes(name)))].slice(0, 3);
  const panels = picked.map(quantity => {
    const body = make('div', {});
    const panel = { quantity, chart: makeChart(body, 480, () => `profile_${panel.quantity}`) };
    panel.node = make('div', {},
      make('div', { class: 'panel-head' },
        choice('', quantities.map(name => [name, name]), quantity, value => { panel.quantity = value; update(); }),
        panel.chart.save(() => `${panel.quantity} along ${state.group}, ${describe(steps[state.step])}${colourWords()}`)),
      body);
    panel.body = body;
    return panel;
  });

  /** The range of a quantity over the phase and what is pinned, so that the axis stands still. */
  const ranges = new Map();
  const wholeRange = quantity => {
    const { phase } = steps[state.step];
    const now = JSON.stringify([quantity, state.group, state.rows, phase, state.pins]);
    if (!ranges.has(now)) {
      const those = steps.filter((step, i) => step.phase === phase || state.pins.includes(i));
      const all = function* all() {
        for (const run of profiled) for (const step of those) for (const line of lines(run, step, quantity)) yield* line.values;
      };
      ranges.set(now, rangeOf(all()));
    }
    return ranges.get(now);
  };

  const draw = panel => {
    const { quantity } = panel;
    const upright = profiled.map(groupOf).filter(Boolean).every(group => group.vertical);
    const whole = wholeRange(quantity);
    const scale = scaled(unitOf(quantity), largestOf(whole || []));
    const series = [];
    const add = (run, step, pin) => {
      const r = runs.indexOf(run);
      lines(run, step, quantity).forEach((line, k) => {
        const words = [isComparison ? run.name : '', isComparison && pin == null ? '' : driven(step) || `${step.phase}, increment ${step.increment}`, line.row];
        const values = line.values.map(v => (v == null ? null : v * scale.factor));
        series.push({
          name: words.filter(Boolean).join(', '), x: upright ? values : line.s, y: upright ? line.s : values, points: !isMany, unnamed: isMany,
          colour: isComparison ? runColour(r) : pin != null ? { along: (pin + 0.5) / state.pins.length } : k,
          dash: isComparison && pin != null ? DASHES[1 + (pin % (DASHES.length - 1))] : line.row && (isComparison || pin != null) ? DASHES[k % DASHES.length] : [],
          width: pin == null ? 2.2 : 1.3, radius: pin == null ? 2.6 : 1.6, tip: () => describe(step),
        });
      });
    };
    state.pins.forEach((pinned, pin) => { if (pinned !== state.step) profiled.forEach(run => add(run, steps[pinned], pin)); });
    profiled.forEach(run => add(run, steps[state.step], null));
    const ends = rangeOf([].concat(...profiled.map(groupOf).filter(Boolean).map(group => group.s))) || [0, 1];
    const room = 0.03 * (ends[1] - ends[0] || 1);
    const along = { label: `position along ${state.group} (m)`, range: [ends[0] - room, ends[1] + room] };
    const across = { label: withUnit(quantity, scale.unit), range: state.fixed && whole ? padded(whole.map(v => v * scale.factor)) : undefined };
    panel.chart.set({ x: upright ? across : along, y: upright ? along : across, series, keepLegend: !isMany });
  };

  const update = () => {
    title.textContent = describe(steps[state.step]);
    host.dataset.step = state.step;
    panels.forEach(draw);
  };

  const spread = () => {
    const { phase } = steps[state.step];
    const inPhase = steps.map((step, i) => [step.phase, i]).filter(([name]) => name === phase).map(([, i]) => i);
    const n = Math.min(5, inPhase.length);
    state.pins = Array.from({ length: n }, (_, i) => inPhase[Math.round((i + 1) * inPhase.length / n) - 1]);
    update();
  };
  const pin = () => {
    if (!state.pins.includes(state.step)) state.pins.push(state.step);
    state.pins.sort((a, b) => a - b);
    update();
  };
  const hasRows = profiled.some(run => run.profile.groups.some(g => g.rows > 1));
  host.append(
    make('div', { class: 'card-head' }, title),
    make('div', { class: 'controls' }, steer.node),
    make('div', { class: 'controls' },
      groups.length > 1 ? choice('along', groups.map(name => [name, name]), state.group, value => { state.group = value; update(); }) : null,
      hasRows ? choice('across the layer', [['mean', 'mean'], ['each', 'every row']], state.rows, value => { state.rows = value; update(); }) : null,
      tick('axes stand still within a phase', state.fixed, value => { state.fixed = value; update(); }),
      make('button', { type: 'button', title: 'keep this profile in the picture', onclick: pin }, 'Pin'),
      make('button', { type: 'button', title: 'pin five profiles spread over this phase', onclick: spread }, 'Spread of the phase'),
      make('button', { type: 'button', title: 'unpin all', onclick: () => { state.pins = []; update(); } }, 'Clear')),
    make('div', { class: 'panels' }, ...panels.map(panel => panel.node)));
  steer.set(state.step, steps.length - 1);
  update();
  recolours.push(update);
  chosen.profile = { chart: panels[0].chart, body: panels[0].body, steer, title, host, spread };
});
