// --- with ?selftest the page tries itself out and writes the outcome at its end ----------------

/** Whether something is drawn on a canvas. */
function isDrawn(canvas) {
  const copy = make('canvas', { width: canvas.width, height: canvas.height }).getContext('2d', { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  const seen = new Set();
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 3]) seen.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
  return seen.size > 8;
}

function isSvg(text) {
  const parsed = new DOMParser().parseFromString(text, 'image/svg+xml');
  return !parsed.querySelector('parsererror') && parsed.querySelectorAll('path, polygon').length > 3;
}

async function selftest() {
  const outcome = {};
  // Charts are laid out after the event that changes them.
  const settled = () => new Promise(resolve => setTimeout(resolve, 20));
  const input = (node, value) => {
    node.value = value;
    node.dispatchEvent(new Event('input'));
    return settled();
  };
  await settled();
  outcome.canvases = [...document.querySelectorAll('canvas')].map(isDrawn);
  outcome.figures = (chosen.figures || []).map(chart => ({ svg: isSvg(chart.svg('<title> & "figure"')), hover: chart.hoverLast() }));
  const pick = document.querySelector('#chooser select');
  if (pick) {
    const before = chosen.chart.canvas.closest('[data-drawn]').dataset.drawn;
    pick.value = pick.options[0].value;
    pick.dispatchEvent(new Event('change'));
    outcome.chooser_changes = before !== chosen.chart.canvas.closest('[data-drawn]').dataset.drawn;
  }
  await settled();
  const { pile, profile, contour, residuals } = chosen;
  if (pile) {
    const state = () => [pile.title.textContent, pile.body.dataset.drawn];
    await input(pile.steer.input, 0);
    const first = state();
    await input(pile.steer.input, pile.steer.input.max);
    outcome.pile = { first, last: state(), svg: [pile.loads, pile.along, pile.curves].map(chart => isSvg(chart.svg('pile'))), hover: pile.loads.hoverLast() };
  }
  if (profile) {
    const drawn = () => profile.body.dataset.drawn;
    await input(profile.steer.input, 0);
    const first = [profile.title.textContent, drawn()];
    await input(profile.steer.input, profile.steer.input.max);
    const last = [profile.title.textContent, drawn()];
    profile.spread();
    await settled();
    outcome.profile = { first, last, overlaid: drawn(), svg: isSvg(profile.chart.svg('profile')), hover: profile.chart.hoverLast() };
  }
  if (contour) {
    const states = [];
    await input(contour.time.input, 0);
    states.push(contour.host.dataset.drawn);
    await input(contour.time.input, contour.time.input.max);
    states.push(contour.host.dataset.drawn);
    contour.field('0');
    states.push(contour.host.dataset.drawn);
    await input(contour.scaleInput, 0);
    states.push(contour.host.dataset.drawn);
    outcome.contour = { states, svg: isSvg(contour.pictureOf()), hover: contour.hoverMiddle(), drawn: isDrawn(contour.canvas) };
  }
  if (residuals) outcome.residuals = { svg: isSvg(residuals.chart.svg('')), hover: residuals.chart.hoverLast() };
  const by = document.querySelector('#colouring select');
  if (by) {
    outcome.colouring = [];
    for (const option of [...by.options]) {
      by.value = option.value;
      by.dispatchEvent(new Event('change'));
      await settled();
      const key = document.querySelector('.colour-key').textContent;
      outcome.colouring.push({ by: option.textContent, key, colours: chosen.figures[0].colours() });
    }
  }
  outcome.legend_entries = Math.max(0, ...[...document.querySelectorAll('.legend')].map(legend => legend.querySelectorAll('button').length));
  if (chosen.chart) outcome.png_bytes = (await png(chosen.chart.svg('chosen'))).size;
  redrawAll();
  await settled();
  return outcome;
}

if (new URLSearchParams(location.search).has('selftest')) {
  selftest().catch(error => ({ failed: String(error && error.stack || error) })).then(outcome => {
    outcome.errors = errors;
    document.body.append(make('pre', { id: 'selftest' }, JSON.stringify(outcome)));
  });
}
