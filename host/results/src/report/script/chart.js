// --- a chart: uPlot with curves that may turn back, hover, a legend, and the same as SVG --------

/** Room beside the extremes. Ranges that nearly reach zero start there. */
function padded(range) {
  if (!range) return [0, 1];
  let [low, high] = range;
  if (low === high) {
    const room = Math.abs(low) || 1;
    return [low - room / 2, high + room / 2];
  }
  const width = high - low;
  low = low >= 0 && low < 0.3 * high ? 0 : low - 0.04 * width;
  high = high <= 0 && high > 0.3 * low ? 0 : high + 0.04 * width;
  return [low, high];
}

function decades(range) {
  if (!range) return [1e-6, 1];
  const low = Math.floor(Math.log10(range[0]));
  return [10 ** low, 10 ** Math.max(low + 1, Math.ceil(Math.log10(range[1])))];
}

/** Ticks at powers of ten, at most ten of them. */
function decadeSplits(_, axis, low, high) {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-6), Math.floor(Math.log10(high) + 1e-6)];
  const step = Math.max(1, Math.ceil((last - first + 1) / 10));
  return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_none, i) => Number(`1e${first + i * step}`));
}

function decadeTexts(_, splits) {
  return splits.map(value => value.toExponential(0));
}

/** Values at the ticks of an axis. */
function tickTexts(_, splits) {
  return splits.map(value => (value == null ? '' : shown(Number(value.toPrecision(10)))));
}

/**
 * A chart in `host`. `set` takes
 * { x: { label, range }, y: { label, range, log }, series: [{ name, colour, dash, width, x, y, points, line, tip(i) }] }.
 */
function makeChart(host, height, name) {
  const plot = make('div', { class: 'plot' });
  const legend = make('div', { class: 'legend' });
  host.append(plot, legend);
  const hidden = new Set();
  const tip = make('div', { class: 'tip', hidden: true });
  const dot = make('div', { class: 'dot', hidden: true });
  let spec = { x: {}, y: {}, series: [] };
  let u = null;
  let names = '';

  const visible = () => spec.series.filter(s => !hidden.has(s.name));
  const rangeAlong = axis => {
    const { range, log } = spec[axis];
    if (range) return range;
    const values = [].concat(...visible().map(s => s[axis].filter((v, i) => s.x[i] != null && s.y[i] != null)));
    return log ? decades(rangeOf(values.filter(v => v > 0))) : padded(rangeOf(values));
  };

  const paths = (_, number) => uPlot.orient(u, number, (series, xs, ys, sx, sy, toX, toY, left, top, width, high, moveTo, lineTo, rect, arc) => {
    const s = spec.series[number - 1];
    const stroke = new Path2D();
    const fill = new Path2D();
    const radius = (s.radius || 2.5) * uPlot.pxRatio;
    let pen = false;
    for (let i = 0; i < xs.length; i++) {
      if (xs[i] == null || ys[i] == null) {
        pen = false;
        continue;
      }
      const x = toX(xs[i], sx, width, left);
      const y = toY(ys[i], sy, high, top);
      if (s.line !== false) {
        (pen ? lineTo : moveTo)(stroke, x, y);
        pen = true;
      }
      if (s.points) {
        moveTo(fill, x + radius, y);
        arc(fill, x, y, radius, 0, 2 * Math.PI);
      }
    }
    return { stroke, fill, clip: null, band: null, gaps: null, flags: 0 };
  });

  const nearest = (left, top) => {
    let best = null;
    let least = 40 ** 2;
    spec.series.forEach(s => {
      if (hidden.has(s.name) || s.silent) return;
      for (let i = 0; i < s.x.length; i++) {
        if (s.x[i] == null || s.y[i] == null) continue;
        const dx = u.valToPos(s.x[i], 'x') - left;
        const dy = u.valToPos(s.y[i], 'y') - top;
        if (dx * dx + dy * dy < least) {
          least = dx * dx + dy * dy;
          best = { s, i, left: left + dx, top: top + dy };
        }
      }
    });
    return best;
  };

  const hover = () => {
    const { left, top } = u.cursor;
    const found = left >= 0 ? nearest(left, top) : null;
    tip.hidden = dot.hidden = !found;
    if (!found) return;
    const { s, i } = found;
    const lines = [s.name, `${spec.x.label || 'x'}: ${shown(s.x[i])}`, `${spec.y.label || 'y'}: ${shown(s.y[i])}`];
    if (s.tip) lines.push(s.tip(i));
    tip.textContent = lines.join('\n');
    dot.style.left = found.left + 'px';
    dot.style.top = found.top + 'px';
    dot.style.background = colour(s.colour, isDark());
    const wide = u.over.clientWidth;
    const right = found.left > wide / 2;
    tip.style.left = right ? '' : found.left + 12 + 'px';
    tip.style.right = right ? wide - found.left + 12 + 'px' : '';
    tip.style.top = Math.max(0, Math.min(found.top - 20, u.over.clientHeight - tip.offsetHeight)) + 'px';
  };

  const columns = () => [null, ...spec.series.map(s => [s.x, s.y])];

  const build = () => {
    if (u) u.destroy();
    const dark = isDark();
    const [ink, grid] = [variable('--soft'), variable('--grid')];
    const axis = (scale, label) => ({
      scale, label, stroke: ink, labelSize: 22, labelGap: 2, size: scale === 'x' ? 32 : 62, gap: 4,
      font: '12px system-ui, sans-serif', labelFont: '13px system-ui, sans-serif',
      grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1, size: 4 }, space: scale === 'x' ? 64 : 36,
      ...(spec[scale].log ? { splits: decadeSplits, values: decadeTexts, filter: (_, splits) => splits } : { values: tickTexts }),
    });
    const scale = key => ({
      time: false, range: () => rangeAlong(key), ...(spec[key].down ? { dir: -1 } : {}), ...(spec[key].log ? { distr: 3, log: 10 } : {}),
    });
    u = new uPlot({
      mode: 2,
      width: Math.max(240, plot.clientWidth),
      height,
      pxAlign: 0,
      legend: { show: false },
      cursor: { points: { show: false }, dataIdx: () => null, drag: { x: true, y: true, uni: 30, dist: 6 } },
      scales: { x: scale('x'), y: scale('y') },
      axes: [axis('x', spec.x.label || ''), axis('y', spec.y.label || '')],
      series: [null, ...spec.series.map(s => ({
        show: !hidden.has(s.name),
        stroke: colour(s.colour, dark), fill: colour(s.colour, dark), width: s.width || 1.8, dash: s.dash || [],
        points: { show: false }, paths, facets: [{ scale: 'x', auto: true }, { scale: 'y', auto: true }],
      }))],
      hooks: { setCursor: [hover] },
    }, columns(), plot);
    u.over.append(tip, dot);
    if (spec.series[0] === NOTHING) legend.replaceChildren(make('span', { class: 'small' }, 'no values'));
    else legend.replaceChildren(...(spec.series.length > 1 || spec.keepLegend ? spec.series.filter(s => !s.unnamed).map(key) : []));
  };

  const key = s => {
    const button = make('button', { type: 'button', title: 'show or hide', class: hidden.has(s.name) ? 'off' : '', onclick: () => toggle(s.name) }, s.name);
    const line = document.createElementNS(SVG, 'svg');
    line.setAttribute('width', 24);
    line.setAttribute('height', 8);
    line.innerHTML = keyMark(s, colour(s.colour, isDark()));
    button.prepend(line);
    return button;
  };

  const toggle = which => {
    if (!hidden.delete(which)) hidden.add(which);
    build();
  };

  const chart = {
    set(next) {
      spec = next.series.length ? next : { ...next, series: [NOTHING] };
      // The same curves with other values keep their zoom.
      const now = JSON.stringify([spec.x, spec.y, spec.series.map(s => [s.name, s.colour, s.dash, s.unnamed])]);
      if (u && now === names && spec.x.range && spec.y.range) {
        u.setData(columns(), false);
        u.redraw(true);
        tip.hidden = dot.hidden = true;
      } else {
        names = now;
        build();
      }
      host.dataset.drawn = digest(visible());
    },
    svg: title => chartSvg(u, spec, visible(), title),
    /** Colours of the curves, as they are on white. */
    colours: () => spec.series.map(s => colour(s.colour, false)),
    save: title => saveButtons(name, () => chart.svg(title ? title() : '')),
    get canvas() {
      return u.ctx.canvas;
    },
    /** Where the plot lies in the picture, in pixels, and what its vertical axis shows. */
    frame: () => ({ top: u.bbox.top / uPlot.pxRatio, height: u.bbox.height / uPlot.pxRatio, range: rangeAlong('y') }),
    /** What is shown where the last point of the first curve is pointed at. */
    hoverLast() {
      const { x, y } = spec.series[0];
      if (!x.length) return '';
      const i = x.findLastIndex((value, k) => value != null && y[k] != null);
      u.setCursor({ left: u.valToPos(x[i], 'x'), top: u.valToPos(y[i], 'y') });
      return tip.hidden ? '' : tip.textContent;
    },
  };
  redraws.push(() => build());
  return chart;
}

/** In place of curves where there are none. */
const NOTHING = { name: '', unnamed: true, silent: true, colour: 0, x: [], y: [] };

/** A few letters that change with what is drawn. */
function digest(series) {
  let sum = 0;
  for (const s of series) {
    for (let i = 0; i < s.x.length; i++) sum = (31 * sum + (s.x[i] || 0) * 7919 + (s.y[i] || 0) * 104729 + i) % 1e9;
  }
  return `${series.length}:${sum.toExponential(6)}`;
}

const SVG = 'http://www.w3.org/2000/svg';

function keyMark(s, stroke) {
  const dash = s.dash && s.dash.length ? ` stroke-dasharray="${s.dash.join(' ')}"` : '';
  const line = s.line === false ? '' : `<path d="M0 4H24" stroke="${stroke}" stroke-width="${Math.max(2, s.width || 2)}"${dash}/>`;
  return line + (s.points ? `<circle cx="12" cy="4" r="3" fill="${stroke}"/>` : '');
}

/** The chart as it is seen, on white. */
function chartSvg(u, spec, series, title) {
  const ratio = uPlot.pxRatio;
  const [left, top, width, height] = [u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height].map(v => v / ratio);
  const head = title ? 26 : 4;
  const keys = series.filter(s => !s.unnamed);
  const perRow = Math.max(1, Math.floor(u.width / (46 + 7 * Math.max(1, ...keys.map(s => s.name.length)))));
  const foot = keys.length > 1 ? 20 * Math.ceil(keys.length / perRow) : 0;
  const at = (x, y) => `${(left + u.valToPos(x, 'x')).toFixed(2)} ${(head + top + u.valToPos(y, 'y')).toFixed(2)}`;
  const words = (x, y, content, more) => `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}"${more || ''}>${xml(content)}</text>`;
  const out = [`<svg xmlns="${SVG}" width="${u.width}" height="${u.height + head + foot}" font-family="sans-serif" font-size="12" fill="#222">`,
    '<rect width="100%" height="100%" fill="#fff"/>'];
  if (title) out.push(words(u.width / 2, 18, title, ' text-anchor="middle" font-size="14"'));
  const bottom = head + top + height;
  u.axes[0]._splits.forEach((value, i) => {
    if (value == null || !u.axes[0]._values[i]) return;
    const x = left + u.valToPos(value, 'x');
    if (x < left - 1 || x > left + width + 1) return;
    out.push(`<path d="M${x.toFixed(2)} ${head + top}V${bottom}" stroke="#ddd"/>`, words(x, bottom + 17, u.axes[0]._values[i], ' text-anchor="middle"'));
  });
  u.axes[1]._splits.forEach((value, i) => {
    if (value == null || !u.axes[1]._values[i]) return;
    const y = head + top + u.valToPos(value, 'y');
    if (y < head + top - 1 || y > bottom + 1) return;
    out.push(`<path d="M${left} ${y.toFixed(2)}H${left + width}" stroke="#ddd"/>`, words(left - 7, y + 4, u.axes[1]._values[i], ' text-anchor="end"'));
  });
  out.push(`<clipPath id="plot"><rect x="${left}" y="${head + top}" width="${width}" height="${height}"/></clipPath><g clip-path="url(#plot)" fill="none" stroke-linejoin="round">`);
  for (const s of series) {
    const stroke = colour(s.colour, false);
    let path = '';
    let pen = false;
    const dots = [];
    for (let i = 0; i < s.x.length; i++) {
      if (s.x[i] == null || s.y[i] == null || (spec.y.log && s.y[i] <= 0)) {
        pen = false;
        continue;
      }
      path += (pen ? 'L' : 'M') + at(s.x[i], s.y[i]);
      pen = true;
      if (s.points) dots.push(at(s.x[i], s.y[i]).split(' '));
    }
    const dash = s.dash && s.dash.length ? ` stroke-dasharray="${s.dash.join(' ')}"` : '';
    if (s.line !== false && path) out.push(`<path d="${path}" stroke="${stroke}" stroke-width="${s.width || 1.8}"${dash}/>`);
    for (const [x, y] of dots) out.push(`<circle cx="${x}" cy="${y}" r="${s.radius || 2.5}" fill="${stroke}"/>`);
  }
  out.push(`</g><rect x="${left}" y="${head + top}" width="${width}" height="${height}" fill="none" stroke="#555"/>`);
  out.push(words(left + width / 2, bottom + 38, spec.x.label || '', ' text-anchor="middle" font-size="13"'));
  const middle = head + top + height / 2;
  out.push(words(16, middle, spec.y.label || '', ` text-anchor="middle" font-size="13" transform="rotate(-90 16 ${middle.toFixed(1)})"`));
  if (foot) {
    keys.forEach((s, i) => {
      const inRow = Math.min(perRow, keys.length - perRow * Math.floor(i / perRow));
      const cell = u.width / inRow;
      const x = cell * (i % perRow) + cell / 2 - (30 + 6 * s.name.length) / 2;
      const y = u.height + head + 20 * Math.floor(i / perRow);
      out.push(`<g transform="translate(${x.toFixed(1)} ${y})" fill="none">${keyMark(s, colour(s.colour, false))}</g>`, words(x + 30, y + 8, s.name));
    });
  }
  out.push('</svg>');
  return out.join('\n');
}
