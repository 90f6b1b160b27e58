// --- residuals of all iterations ---------------------------------------------------------------

part(() => {
  const host = document.getElementById('residuals');
  if (!host) return;
  const logged = runs.filter(run => run.log.attempts.length);
  if (!logged.length) {
    host.append(make('p', { class: 'small' }, 'There is no convergence history.'));
    return;
  }
  const state = { run: logged[0], phase: '' };
  const body = make('div', {});
  const chart = makeChart(body, 320, () => `${state.run.name}_residuals`);
  const title = make('h3', {});
  const phases = run => [...new Set(run.log.attempts.map(a => a.phase))];
  const update = () => {
    const { log, force_tolerance: tolerance } = state.run;
    const [x, y, tips] = [[], [], []];
    const cut = { x: [], y: [], tips: [] };
    const reasons = new Map(log.cut_backs.map(c => [c.attempt, c]));
    let n = 0;
    let attempts = 0;
    let least = Infinity;
    log.attempts.forEach(a => a.residuals.forEach(r => { if (r > 0 && r < least) least = r; }));
    log.attempts.forEach((attempt, i) => {
      if (state.phase && attempt.phase !== state.phase) return;
      attempts++;
      const name = `${attempt.phase}, increment ${attempt.increment}, load factor ${shown(attempt.load_factor)}`;
      let last = null;
      attempt.residuals.forEach((residual, k) => {
        n++;
        // A residual of exactly zero has no logarithm.
        last = residual == null ? null : Math.max(residual, least);
        x.push(n);
        y.push(last);
        tips.push(`${name}, iteration ${k}`);
      });
      if (reasons.has(i)) {
        cut.x.push(n);
        cut.y.push(last == null ? 1 : last);
        cut.tips.push(`${name}: ${reasons.get(i).reason}`);
      }
      x.push(n);
      y.push(null);
      tips.push('');
    });
    const series = [{ name: 'residual', x, y, colour: 0, width: 1, points: n <= 600, radius: 1.7, tip: i => tips[i] }];
    if (tolerance) series.push({ name: 'tolerance', x: [0, n], y: [tolerance, tolerance], colour: 4, dash: [6, 4], width: 1, silent: true });
    if (cut.x.length) series.push({ name: 'cut-back', x: cut.x, y: cut.y, colour: 1, line: false, points: true, radius: 4.5, tip: i => cut.tips[i] });
    title.textContent = `${isComparison ? state.run.name + ': ' : ''}${n} iterations in ${attempts} steps, ${cut.x.length} cut back`;
    chart.set({ x: { label: 'iteration, counted through' }, y: { label: 'relative residual', log: true }, series });
  };
  const phaseHost = make('span', {});
  const fill = () => {
    state.phase = '';
    phaseHost.replaceChildren(choice('phase', [['', 'all'], ...phases(state.run).map(p => [p, p])], '', value => { state.phase = value; update(); }));
  };
  host.append(
    make('div', { class: 'card-head' }, title, chart.save(() => title.textContent)),
    make('div', { class: 'controls' },
      logged.length > 1 ? choice('run', logged.map((run, i) => [i, run.name]), 0, value => { state.run = logged[Number(value)]; fill(); update(); }) : null,
      phaseHost),
    body);
  fill();
  update();
  chosen.residuals = { chart, host };
});

part(() => {
  const box = document.getElementById('show-equal');
  if (box) box.addEventListener('change', () => document.getElementById('differences').classList.toggle('only-different', !box.checked));
});

/** Colours beside the names of the runs. */
redraws.push(() => runs.forEach((_, r) => document.querySelectorAll(`.run-${r}`).forEach(node => { node.style.background = colour(runColour(r), isDark()); })));
recolours.push(redraws[redraws.length - 1]);
part(redraws[redraws.length - 1]);
