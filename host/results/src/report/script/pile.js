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
  const state = { phase: tested || '', step: steps.length - 1, pins: [], over: 'slip', net: piled.some(run => run.history.names.includes('pile_head_load_net')) };
  const hasNet = state.net;
  const force = unitOf('pile_head_load') || 'kN';
  const netOf = name => (state.net ? name + '_net' : name);
  const kind = () => (state.net ? 'net' : 'gross');

  // Load and settlement: the head, shaft and base of one run, or the heads of several.
  const loads = [['pile_head_load', 'head'], ['pile_shaft_load', 'shaft'], ['pile_base_load', 'base']];
  const loadBody = make('div', {});
  const loadChart = makeChart(loadBody, 420, () => 'pile_load_settlement');
  const MM = 1000;
  /** A load over the settlement, each phase from where it starts: from zero where settlements are counted anew. */
  const courseOf = (run, name) => {
    const { history } = run;
    const [values, settled] = [column(run, name), column(run, 'pile_settlement')];
    const resets = run.section ? run.section.resets : [];
    const course = { x: [], y: [], told: [] };
    const add = (load, settlement, told) => {
      course.x.push(load);
      course.y.push(settlement == null ? null : settlement * MM);
      course.told.push(told);
    };
    if (!values || !settled) return null;
    for (let row = 0; row < values.length; row++) {
      const phase = history.phases[history.phase[row]];
      if (state.phase && phase !== state.phase) continue;
      if (row === 0 || history.phase[row - 1] !== history.phase[row]) {
        const before = row > 0 && values[row - 1] != null;
        if (resets.includes(phase)) {
          add(null, null, '');
          if (state.net || before) add(state.net ? 0 : values[row - 1], 0, 'start');
        } else if (before && state.phase) add(values[row - 1], settled[row - 1], 'start');
        else if (!before && state.net && values[row] != null) add(0, row > 0 && settled[row - 1] != null ? settled[row - 1] : 0, 'start');
      }
      add(values[row], settled[row], place(run, row));
    }
    return course;
  };
  /** Settlement where a curve passes a load. */
  const reaches = ({ x, y }, load) => {
    for (let i = x.length - 1; i > 0; i--) {
      if ([x[i - 1], x[i], y[i - 1], y[i]].some(v => v == null)) continue;
      if ((x[i - 1] < load) !== (x[i] < load)) return y[i - 1] + (y[i] - y[i - 1]) * (load - x[i - 1]) / (x[i] - x[i - 1]);
    }
    return null;
  };
  /** The criteria of a run on its net curve, with the diameter that they use. */
  const criteria = (run, head) => {
    const found = run.resistances;
    const series = [];
    if (isComparison || !found || !state.net || !head) return series;
    const tenth = 0.1 * found.diameter * MM;
    const mark = (name, load, s, n, phase) => {
      if (load == null || s == null || (state.phase && phase && state.phase !== phase)) return;
      series.push({ name: `${name}, D = ${shown(Number(found.diameter.toPrecision(4)))} m: ${shown(Number(load.toPrecision(4)))} ${force}`, x: [load], y: [s], colour: n, line: false, points: true, radius: 5, tip: () => 'resistance' });
    };
    const signed = load => (load == null ? null : -load);
    mark('D/10', found.resistance_10_percent_diameter, tenth, 3, found.resistance_10_percent_diameter_phase);
    mark('Davisson', found.resistance_davisson, reaches(head, found.resistance_davisson), 4, found.resistance_davisson_phase);
    mark('uplift D/10', signed(found.uplift_10_percent_diameter), -tenth, 3, found.uplift_10_percent_diameter_phase);
    mark('uplift Davisson', signed(found.uplift_davisson), reaches(head, signed(found.uplift_davisson)), 4, found.uplift_davisson_phase);
    if (found.resistance_chin != null && (!state.phase || state.phase === found.phase)) {
      const load = found.resistance_chin;
      series.push({ name: `Chin, extrapolated: ${shown(Number(load.toPrecision(4)))} ${force}`, x: [load, load], y: [0, Math.max(0, ...head.y.filter(v => v != null))], colour: 5, dash: [7, 4], tip: () => 'asymptote, reached by no load' });
    }
    return series;
  };
  const drawLoads = () => {
    const series = [];
    piled.forEach(run => {
      loads.slice(0, isComparison ? 1 : 3).forEach(([name, word], k) => {
        const course = courseOf(run, netOf(name));
        if (!course) return;
        series.push({
          name: isComparison ? run.name : word, x: course.x, y: course.y, colour: isComparison ? runColour(runs.indexOf(run)) : k, unnamed: isMany,
          width: k ? 1.6 : 2.2, points: !isMany && course.y.filter(v => v != null).length <= 60, radius: 1.8, tip: i => course.told[i],
        });
      });
      series.push(...criteria(run, courseOf(run, netOf('pile_head_load'))));
    });
    loadChart.set({ x: { label: `${kind()} load (${force})` }, y: { label: 'settlement of the head (mm)', down: true }, series, keepLegend: !isMany });
  };

  // Along the depth.
  const along = run => run.pile.z;
  const atStep = (run, step, quantity) => {
    const at = run.pile.increments.findIndex(other => key(other) === key(step));
    const number = run.pile.columns.indexOf(quantity);
    return at < 0 || number < 0 ? null : run.pile.values[number][at];
  };
  const units = { axial_force: force, shaft_friction: 'kPa', normal_stress: 'kPa', slip: 'm', settlement: 'm' };
  const hasNetAlong = { axial_force: true, shaft_friction: true };
  const read = name => (hasNetAlong[name] ? netOf(name) : name);
  const words = name => name.replace('_', ' ');
  const worded = name => (hasNetAlong[name] ? `${kind()} ${words(name)}` : words(name));
  /** A state by the head load of a run, not by its increment. */
  const loadAt = (run, step) => {
    const row = run.history.increment.findIndex((n, i) => n === step.increment && run.history.phases[run.history.phase[i]] === step.phase);
    const load = column(run, netOf('pile_head_load')) || column(run, 'pile_head_load');
    return load && row >= 0 && load[row] != null ? `${shown(Number(load[row].toPrecision(4)))} ${force}` : `increment ${step.increment}`;
  };
  const describe = step => (isComparison ? `${step.phase}, increment ${step.increment}` : `${step.phase}, head ${loadAt(piled[0], step)}`);
  const title = make('h3', {});
  const steer = slider('increment', value => { state.step = value; updateProfiles(); });
  const panels = ['axial_force', 'shaft_friction', 'normal_stress'].map(quantity => {
    const body = make('div', {});
    const panel = { quantity, chart: makeChart(body, 460, () => `pile_${panel.quantity}`) };
    panel.node = make('div', {},
      make('div', { class: 'panel-head' },
        choice('', Object.keys(units).map(name => [name, words(name)]), quantity, value => { panel.quantity = value; drawPanel(panel); }),
        panel.chart.save(() => `${worded(panel.quantity)} along the pile, ${describe(steps[state.step])}${colourWords()}`)),
      body);
    return panel;
  });
  const drawPanel = panel => {
    const { quantity } = panel;
    const { phase } = steps[state.step];
    const those = steps.filter((step, i) => step.phase === phase || state.pins.includes(i));
    const all = [].concat(...piled.map(run => [].concat(...those.map(step => atStep(run, step, read(quantity)) || []))));
    const scale = scaled(units[quantity], largestOf(all) / 10);
    const series = [];
    const add = (run, step, pin) => {
      const values = atStep(run, step, read(quantity));
      if (!values) return;
      const r = runs.indexOf(run);
      series.push({
        name: [isComparison ? run.name : '', isComparison && pin == null ? '' : `${step.phase}, ${loadAt(run, step)}`].filter(Boolean).join(', '),
        x: values.map(v => (v == null ? null : v * scale.factor)), y: along(run), points: !isMany, unnamed: isMany,
        colour: isComparison ? runColour(r) : pin != null ? { along: (pin + 0.5) / state.pins.length } : 0,
        dash: isComparison && pin != null ? DASHES[1 + (pin % (DASHES.length - 1))] : [],
        width: pin == null ? 2.2 : 1.3, radius: pin == null ? 2.6 : 1.6, tip: () => `${step.phase}, increment ${step.increment}`,
      });
    };
    state.pins.forEach((pinned, pin) => { if (pinned !== state.step) piled.forEach(run => add(run, steps[pinned], pin)); });
    piled.forEach(run => add(run, steps[state.step], null));
    const ends = rangeOf([].concat(...piled.map(along))) || [0, 1];
    const room = 0.02 * (ends[1] - ends[0] || 1);
    panel.chart.set({
      x: { label: withUnit(worded(quantity), scale.unit), range: padded(rangeOf([0, ...all.filter(v => v != null).map(v => v * scale.factor)])) },
      y: { label: piled[0].axisymmetric ? 'z (m)' : 'y (m)', range: [ends[0] - room, ends[1] + room] }, series, keepLegend: !isMany,
    });
  };
  // The ground beside the profiles: layers, water, outline of the pile.
  const ground = document.createElementNS(SVG, 'svg');
  ground.setAttribute('class', 'ground');
  const drawGround = () => {
    const section = piled[0].section;
    if (isComparison || !section) return;
    const { top, height, range } = panels[0].chart.frame();
    const at = z => top + height * (range[1] - z) / (range[1] - range[0]);
    const within = z => Math.min(range[1], Math.max(range[0], z));
    const [wide, middle] = [120, 24];
    const phase = steps[state.step].phase;
    const out = [];
    section.layers.forEach((layer, k) => {
      const [from, to] = [at(within(layer.top)), at(within(layer.bottom))];
      if (to - from < 1) return;
      out.push(`<rect x="0" y="${from}" width="${wide}" height="${to - from}" class="layer-${k % 2}"/>`,
        `<text x="${middle + 12}" y="${Math.max(from + 14, (from + to) / 2 + 4)}">${xml(layer.group)}</text>`);
    });
    const [head, toe] = [at(within(section.top)), at(within(section.bottom))];
    out.push(`<rect x="2" y="${head}" width="${middle}" height="${toe - head}" class="outline"/>`);
    const water = section.water.find(([name]) => name === phase);
    if (water && water[1] >= range[0] && water[1] <= range[1]) {
      const y = at(water[1]);
      out.push(`<path d="M${middle + 4} ${y}H${wide}M${wide - 18} ${y - 9}h12l-6 9z" class="water"/>`);
    }
    ground.setAttribute('width', wide);
    ground.setAttribute('height', top + height + 20);
    ground.innerHTML = out.join('');
  };
  const updateProfiles = () => {
    title.textContent = describe(steps[state.step]);
    host.dataset.step = state.step;
    panels.forEach(drawPanel);
    drawGround();
  };
  const spread = () => {
    const { phase } = steps[state.step];
    const inPhase = steps.map((step, i) => [step.phase, i]).filter(([name]) => name === phase).map(([, i]) => i);
    const n = Math.min(5, inPhase.length);
    state.pins = Array.from({ length: n }, (_, i) => inPhase[Math.round((i + 1) * inPhase.length / n) - 1]);
    updateProfiles();
  };

  // Friction against slip at depths of the first run; others at their nearest.
  const depths = [...new Set(along(piled[0]).filter((_, i) => piled[0].pile.values[1].some(values => values[i] != null)))];
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
        name: isComparison ? `${run.name}, ${z}` : z, x: xs, y: of(netOf('shaft_friction')), unnamed: isMany, points: rows.length <= 60 && !isMany, radius: 1.8,
        colour: isComparison ? runColour(runs.indexOf(run)) : { along: depths.length > 1 ? number / (depths.length - 1) : 0 },
        dash: isComparison ? DASHES[k % DASHES.length] : [], tip: i => `${run.pile.increments[rows[i]].phase}, increment ${run.pile.increments[rows[i]].increment}`,
      });
    };
    [...picked].sort((a, b) => a - b).forEach((number, k) => piled.forEach(run => add(run, number, k)));
    const scale = scaled('m', largest / 10);
    series.forEach(s => { s.x = s.x.map(v => (v == null ? null : v * scale.factor)); });
    curveChart.set({ x: { label: withUnit(state.over, scale.unit) }, y: { label: `${kind()} shaft friction (kPa)` }, series, keepLegend: !isMany });
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
      make('div', { class: 'controls' }, phaseChoice, hasNet ? choice('loads', [['net', 'net'], ['gross', 'gross']], 'net', value => { state.net = value === 'net'; draw(); }) : null), loadBody),
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
    make('div', { class: 'beside' }, ground, make('div', { class: 'panels' }, ...panels.map(panel => panel.node))));
  steer.set(state.step, steps.length - 1);
  draw();
  if (onPaper) {
    // States of the test, whose loads are in the legends.
    const last = steps.findLastIndex(step => step.phase === tested);
    if (last >= 0) state.step = last;
    spread();
  }
  redraws.push(drawGround);
  recolours.push(draw);
  chosen.pile = { loads: loadChart, body: panels[0].node.lastElementChild, along: panels[0].chart, curves: curveChart, steer, title };
});
