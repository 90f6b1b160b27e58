// --- contours of fields on the deformed mesh ---------------------------------------------------

part(() => {
  const host = document.getElementById('contour');
  if (!host) return;
  const drawn = runs.filter(run => run.fields);
  // By number of nodes: those of a quad or triangle around it, of an edge along it.
  const OUTLINE = { 9: [0, 4, 1, 5, 2, 6, 3, 7], 8: [0, 4, 1, 5, 2, 6, 3, 7], 6: [0, 3, 1, 4, 2, 5], 3: [0, 2, 1] };
  const isSolid = cell => cell.length > 3;
  const axes = run => (run.axisymmetric ? ['r', 'z'] : ['x', 'y']);

  /** Everything about a run's mesh that does not change with time. */
  const prepare = run => {
    const { fields } = run;
    const outlines = fields.cells.map(cell => OUTLINE[cell.length].map(i => cell[i]));
    const within = [];
    const counts = fields.groups.map(() => 0);
    fields.group.forEach(g => within.push(++counts[g]));
    // Edges between groups and at the boundary.
    const edges = new Map();
    fields.cells.forEach((cell, c) => {
      if (!isSolid(cell)) return;
      const corners = Math.floor(cell.length / 2);
      for (let k = 0; k < corners; k++) {
        const nodes = [cell[k], cell[corners + k], cell[(k + 1) % corners]];
        const key = nodes[0] < nodes[2] ? `${nodes[0]} ${nodes[2]}` : `${nodes[2]} ${nodes[0]}`;
        const known = edges.get(key);
        if (known) known.groups.push(fields.group[c]);
        else edges.set(key, { nodes, groups: [fields.group[c]] });
      }
    });
    const borders = [...edges.values()].filter(e => e.groups.length === 1 || e.groups[0] !== e.groups[1]);
    const extent = [0, 1].map(k => rangeOf(fields.nodes.filter((_, i) => i % 2 === k)) || [0, 1]);
    const size = Math.max(extent[0][1] - extent[0][0], extent[1][1] - extent[1][0]) || 1;
    // A group in which a field is zero at all times has no such field, or nothing to show.
    const blank = fields.names.map((_, f) => {
      const has = new Set();
      for (const time of fields.times) time.values[f].forEach((v, c) => { if (v) has.add(fields.group[c]); });
      return fields.groups.map((_name, g) => !has.has(g));
    });
    const [x, y] = axes(run);
    // Of a model before its first phase the groups, of a run its displacements.
    const own = run.model ? [['g', 'group']] : [['u', '|displacement|'], ['u0', `displacement ${x}`], ['u1', `displacement ${y}`]];
    const names = [...own, ...fields.names.map((name, f) => [String(f), name])];
    const values = (field, t) => {
      const time = fields.times[t];
      if (field === 'g') return fields.group;
      if (!field.startsWith('u')) {
        const f = Number(field);
        return fields.cells.map((_, c) => (blank[f][fields.group[c]] || !time.values[f].length ? null : time.values[f][c]));
      }
      const u = time.displacement;
      return fields.cells.map(cell => {
        let sum = 0;
        for (const n of cell) sum += field === 'u' ? Math.hypot(u[2 * n], u[2 * n + 1]) : u[2 * n + Number(field[1])];
        return sum / cell.length;
      });
    };
    const unit = field => (field === 'g' ? '' : field.startsWith('u') ? 'm' : unitOf(fields.names[Number(field)]));
    const title = field => names.find(([key]) => key === field)[1];
    const moved = Math.max(...fields.times.map(time => largestOf(time.displacement)));
    return { run, fields, outlines, within, borders, extent, size, names, values, unit, title, moved };
  };
  const meshes = new Map();
  const meshOf = run => {
    if (!meshes.has(run)) meshes.set(run, prepare(run));
    return meshes.get(run);
  };

  const SCALES = [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000];
  const suggested = mesh => {
    const most = mesh.moved > 0 ? 0.05 * mesh.size / mesh.moved : 1;
    return Math.max(1, SCALES.filter(s => s <= Math.max(1, most)).length - 1);
  };

  const state = {
    run: drawn[0], field: drawn[0].model ? 'g' : 'u', marks: new Set(['lines', 'supports', 'loads', 'water']), stage: drawn[0].model ? Math.min(1, drawn[0].model.stages.length - 1) : 0, time: drawn[0].fields.times.length - 1, scale: suggested(meshOf(drawn[0])), hidden: new Set(),
    range: '2', low: 0, high: 1, map: 'viridis', lines: true, outline: false, hover: null, centre: null, zoom: 1,
  };

  const canvas = make('canvas', { tabindex: 0, 'aria-label': 'contours; + - and arrows zoom and move' });
  const tip = make('div', { class: 'tip', hidden: true });
  const stage = make('div', { class: 'stage' }, canvas, tip);
  const title = make('h3', { id: 'contour-title' });
  const BAR = 104;
  let view = null;
  let shownValues = null;
  let bounds = [0, 1];
  let display = { unit: '', factor: 1 };
  // Whether there are values beyond the ends of the colour bar.
  let beyond = [false, false];

  const position = (mesh, n, factor) => {
    const u = mesh.fields.times[state.time].displacement;
    return [mesh.fields.nodes[2 * n] + factor * u[2 * n], mesh.fields.nodes[2 * n + 1] + factor * u[2 * n + 1]];
  };

  /** The part of the model that is looked at, and its place on the canvas. */
  const look = (mesh, width, height) => {
    let [xs, ys] = mesh.extent;
    if (state.hidden.size) {
      const seen = [...new Set([].concat(...mesh.fields.cells.filter((_, c) => !state.hidden.has(mesh.fields.groups[mesh.fields.group[c]]))))];
      xs = rangeOf(seen.map(n => mesh.fields.nodes[2 * n])) || xs;
      ys = rangeOf(seen.map(n => mesh.fields.nodes[2 * n + 1])) || ys;
    }
    const room = 28;
    const fit = Math.min((width - BAR - 2 * room) / (xs[1] - xs[0] || 1e-9), (height - 2 * room) / (ys[1] - ys[0] || 1e-9));
    const centre = state.centre || [(xs[0] + xs[1]) / 2, (ys[0] + ys[1]) / 2];
    const k = fit * state.zoom;
    return { k, centre, width, height, to: ([x, y]) => [(width - BAR) / 2 + (x - centre[0]) * k, height / 2 - (y - centre[1]) * k], from: (px, py) => [centre[0] + (px - (width - BAR) / 2) / k, centre[1] - (py - height / 2) / k] };
  };

  /** Whether a group is chosen, and there at this time: what is not active is left out, but of a model. */
  const isShown = (mesh, g) => !state.hidden.has(mesh.fields.groups[g]) && (mesh.run.model || !mesh.fields.times[state.time].inactive.includes(g));

  /** Pale, so that what is drawn over it stands out. */
  const groupColour = g => {
    if (g >= LIGHT.length) return `hsl(${(g * 137) % 360},45%,68%)`;
    const channel = k => Math.round(0.5 * parseInt(LIGHT[g].slice(1 + 2 * k, 3 + 2 * k), 16) + 0.5 * 235);
    return `rgb(${channel(0)},${channel(1)},${channel(2)})`;
  };

  const visible = (mesh, values) => values.filter((v, c) => v != null && isShown(mesh, mesh.fields.group[c]));

  const boundsOf = (mesh, values) => {
    const seen = visible(mesh, values);
    if (state.range === 'manual') return [state.low, state.high];
    let range = rangeOf(seen) || [0, 1];
    const outer = Number(state.range) / 100;
    if (outer && seen.length > 10) {
      const sorted = seen.slice().sort((a, b) => a - b);
      range = [sorted[Math.floor(outer * sorted.length)], sorted[Math.ceil((1 - outer) * sorted.length) - 1]];
    }
    if (state.map === 'diverging') {
      const far = Math.max(Math.abs(range[0]), Math.abs(range[1])) || 1;
      range = [-far, far];
    }
    return range[0] === range[1] ? [range[0] - (Math.abs(range[0]) || 1) / 2, range[1] + (Math.abs(range[1]) || 1) / 2] : range;
  };

  const map = () => (state.map === 'diverging' ? DIVERGING : VIRIDIS);

  /** Draws with the operations of `pen`: the canvas, or a text in SVG. */
  const paint = (pen, mesh, ink) => {
    const { fields } = mesh;
    const factor = SCALES[state.scale];
    const points = fields.nodes.length / 2;
    const at = new Array(points);
    for (let n = 0; n < points; n++) at[n] = view.to(position(mesh, n, factor));
    const colours = Array.from({ length: 257 }, (_, i) => mapped(map(), i / 256));
    const fine = Math.sqrt(fields.cells.length) * 3 < view.k * mesh.size;
    pen.within(view.width - BAR, view.height);
    const edges = [];
    fields.cells.forEach((cell, c) => {
      if (!isShown(mesh, fields.group[c])) return;
      const value = shownValues[c];
      const t = value == null ? null : (value - bounds[0]) / (bounds[1] - bounds[0]);
      const fill = state.field === 'g' ? groupColour(fields.group[c]) : t == null ? ink.blank : colours[Math.round(256 * Math.min(1, Math.max(0, t)))];
      const outline = mesh.outlines[c].map(n => at[n]);
      if (isSolid(cell)) pen.polygon(outline, fill, state.lines && fine ? ink.mesh : fill, state.lines && fine ? 0.5 : 0.7);
      else edges.push([outline, fill]);
    });
    for (const edge of mesh.borders) {
      if (!edge.groups.some(g => isShown(mesh, g))) continue;
      pen.line(edge.nodes.map(n => at[n]), ink.edge, 1);
    }
    for (const [outline, fill] of edges) pen.line(outline, fill, 5);
    if (state.outline) {
      for (const edge of mesh.borders) {
        if (edge.groups.length === 1) pen.line(edge.nodes.map(n => view.to(position(mesh, n, 0))), ink.soft, 1, [4, 3]);
      }
    }
    if (state.run.model) paintModel(pen, mesh, at, ink);
    pen.everywhere();
    if (state.field === 'g') {
      fields.groups.forEach((name, g) => {
        pen.box(view.width - BAR + 8, 12 + 18 * g, 12, 12, groupColour(g));
        pen.text(view.width - BAR + 25, 22 + 18 * g, name.length > 12 ? name.slice(0, 11) + '…' : name, ink.text, 'start');
      });
      return;
    }
    // The colour bar.
    const high = Math.min(320, view.height - 90);
    const left = view.width - BAR + 8;
    const top = 46;
    const name = state.field.startsWith('u') ? mesh.title(state.field).replace('displacement', 'u') : mesh.title(state.field);
    pen.text(view.width - 6, 18, name, ink.text, 'end');
    if (display.unit && display.unit !== '-') pen.text(view.width - 6, 34, display.unit, ink.soft, 'end');
    const slices = 64;
    for (let i = 0; i < slices; i++) pen.box(left, top + high * i / slices, 14, high / slices + 0.6, mapped(map(), 1 - (i + 0.5) / slices));
    for (let i = 0; i <= 6; i++) {
      const value = bounds[1] + (bounds[0] - bounds[1]) * i / 6;
      const y = top + high * i / 6;
      pen.line([[left + 14, y], [left + 18, y]], ink.soft, 1);
      const mark = i === 0 && beyond[1] ? '≥ ' : i === 6 && beyond[0] ? '≤ ' : '';
      pen.text(left + 22, y + 4, mark + barText(value * display.factor), ink.text, 'start');
    }
  };

  /** Places along a line, not nearer to each other than so many pixels. */
  const spread = (places, gap) => {
    const kept = [];
    for (const place of places) {
      if (kept.every(other => Math.hypot(other.at[0] - place.at[0], other.at[1] - place.at[1]) >= gap)) kept.push(place);
    }
    return kept;
  };

  const arrow = (pen, [x, y], [dx, dy], ink) => {
    const [tx, ty] = [x - 22 * dx, y - 22 * dy];
    pen.line([[tx, ty], [x, y]], ink, 1.5);
    pen.polygon([[x, y], [x - 7 * dx + 3 * dy, y - 7 * dy - 3 * dx], [x - 7 * dx - 3 * dy, y - 7 * dy + 3 * dx]], ink, ink, 1);
  };

  /** Lines with their names, supports, water table and loads over the mesh. */
  const paintModel = (pen, mesh, at, ink) => {
    const { model } = state.run;
    const stage = model.stages[state.stage];
    const labels = [];
    const label = (x, y, text, fill) => {
      // Names that would lie on each other stand one below the other.
      x = Math.min(view.width - BAR - 3.4 * text.length, Math.max(3.4 * text.length + 2, x));
      let line = y;
      while (labels.some(other => Math.abs(other.x - x) < 3.5 * (other.text.length + text.length) && Math.abs(other.y - line) < 13)) line += 13;
      labels.push({ x, y: line, text });
      pen.box(x - 3.4 * text.length - 2, line - 10, 6.8 * text.length + 4, 13, ink.paper);
      pen.text(x, line, text, fill, 'middle');
    };
    const places = line => (line.edges.length ? [].concat(...line.edges.map(edge => [0, 2, 1].map(k => ({ at: at[edge[k]], edge })))) : line.nodes.map(n => ({ at: at[n], edge: null })));
    if (state.marks.has('supports')) {
      for (const line of model.lines) {
        if (!line.fixed[0] && !line.fixed[1]) continue;
        for (const { at: [x, y] } of spread(places(line), 22)) {
          if (line.fixed[1]) pen.polygon([[x, y], [x - 5, y + 9], [x + 5, y + 9]], ink.paper, ink.edge, 1.2);
          if (line.fixed[0]) pen.polygon([[x, y], [x - 9, y - 5], [x - 9, y + 5]], ink.paper, ink.edge, 1.2);
        }
      }
    }
    if (state.marks.has('water') && stage.water.length) {
      pen.line(stage.water.map(place => view.to(place)), ink.paper, 4);
      pen.line(stage.water.map(place => view.to(place)), '#1f6fd6', 2, [8, 4]);
    }
    if (state.marks.has('lines')) {
      model.lines.forEach((line, i) => {
        const fill = colour(i, ink.dark);
        for (const edge of line.edges) pen.line([at[edge[0]], at[edge[2]], at[edge[1]]], fill, 3);
        if (!line.edges.length) for (const n of line.nodes) pen.box(at[n][0] - 3, at[n][1] - 3, 6, 6, fill);
      });
    }
    if (state.marks.has('loads')) {
      for (const load of stage.loads) {
        const line = model.lines.find(other => other.name === load.line);
        if (!line) continue;
        for (const { at: place, edge } of spread(places(line), 26)) {
          let way = load.towards ? [load.towards[0], -load.towards[1]] : null;
          if (load.kind === 'pressure' && edge) {
            // The body lies to the left of its edge, which is upside down on the canvas.
            const [a, b] = [at[edge[0]], at[edge[1]]];
            way = [load.sign * (b[1] - a[1]), -load.sign * (b[0] - a[0])];
          }
          const size = way ? Math.hypot(...way) : 0;
          if (size > 0) arrow(pen, place, way.map(c => c / size), load.kind === 'displacement' ? '#b0528f' : '#d13a2f');
        }
      }
    }
    if (state.marks.has('water') && stage.water.length) {
      const [x, y] = view.to(stage.water[stage.water.length - 1]);
      label(x - 40, y - 5, 'water', '#1f6fd6');
    }
    if (state.marks.has('lines')) {
      model.lines.forEach((line, i) => {
        const edge = line.edges[Math.floor(line.edges.length / 2)];
        const [x, y] = edge ? at[edge[2]] : at[line.nodes[0]] || [0, 0];
        label(x, y + 4, line.name, colour(i, ink.dark));
      });
    }
  };

  const barText = value => {
    const span = Math.abs(bounds[1] - bounds[0]) * display.factor;
    if (Math.abs(value) < 1e-9 * span) return '0';
    const size = Math.max(Math.abs(bounds[0]), Math.abs(bounds[1])) * display.factor;
    if (size >= 1e5 || size < 1e-3) return value.toExponential(2);
    return value.toFixed(Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(span || 1)))));
  };

  const onCanvas = context => ({
    within(width, height) {
      context.save();
      context.beginPath();
      context.rect(0, 0, width, height);
      context.clip();
    },
    everywhere() {
      context.restore();
    },
    trace(points) {
      context.beginPath();
      points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    },
    polygon(points, fill, stroke, width) {
      this.trace(points);
      context.closePath();
      context.fillStyle = fill;
      context.fill();
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.stroke();
    },
    line(points, stroke, width, dash) {
      this.trace(points);
      context.setLineDash(dash || []);
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.stroke();
      context.setLineDash([]);
    },
    box(x, y, width, height, fill) {
      context.fillStyle = fill;
      context.fillRect(x, y, width, height);
    },
    text(x, y, content, fill, anchor) {
      context.font = '12px system-ui, sans-serif';
      context.textAlign = anchor === 'middle' ? 'center' : anchor;
      context.fillStyle = fill;
      context.fillText(content, x, y);
    },
  });

  const inSvg = out => {
    const list = points => points.map(([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`).join(' ');
    return {
      within: (width, height) => out.push(`<clipPath id="mesh"><rect width="${width}" height="${height}"/></clipPath><g clip-path="url(#mesh)">`),
      everywhere: () => out.push('</g>'),
      polygon: (points, fill, stroke, width) => out.push(`<polygon points="${list(points)}" fill="${fill}" stroke="${stroke}" stroke-width="${width}"/>`),
      line: (points, stroke, width, dash) => out.push(`<polyline points="${list(points)}" fill="none" stroke="${stroke}" stroke-width="${width}"${dash ? ` stroke-dasharray="${dash.join(' ')}"` : ''}/>`),
      box: (x, y, width, height, fill) => out.push(`<rect x="${x.toFixed(1)}" y="${y.toFixed(1)}" width="${width}" height="${height.toFixed(2)}" fill="${fill}"/>`),
      text: (x, y, content, fill, anchor) => out.push(`<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" fill="${fill}">${xml(content)}</text>`),
    };
  };

  const caption = () => {
    const mesh = meshOf(state.run);
    if (state.run.model) return `${mesh.title(state.field)}, loads and water of: ${state.run.model.stages[state.stage].name}`;
    return `${isComparison ? state.run.name + ': ' : ''}${mesh.title(state.field)}, ${mesh.fields.times[state.time].label}, displacements × ${SCALES[state.scale]}`;
  };

  const compute = () => {
    const mesh = meshOf(state.run);
    shownValues = mesh.values(state.field, state.time);
    bounds = boundsOf(mesh, shownValues);
    const seen = rangeOf(visible(mesh, shownValues)) || bounds;
    beyond = [seen[0] < bounds[0], seen[1] > bounds[1]];
    display = scaled(mesh.unit(state.field), Math.max(Math.abs(bounds[0]), Math.abs(bounds[1])));
    lowInput.value = Number((bounds[0] * display.factor).toPrecision(4));
    highInput.value = Number((bounds[1] * display.factor).toPrecision(4));
    lowInput.disabled = highInput.disabled = state.range !== 'manual';
    title.textContent = caption();
    scaleText.textContent = `× ${SCALES[state.scale]}`;
  };

  const draw = () => {
    const mesh = meshOf(state.run);
    const width = Math.max(260, stage.clientWidth);
    const [x, y] = mesh.extent.map(([low, high]) => high - low);
    const height = Math.round(Math.min(760, Math.max(360, (width - BAR) * Math.max(0.4, y / (x || 1)))));
    const ratio = window.devicePixelRatio || 1;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.style.height = height + 'px';
    const context = canvas.getContext('2d');
    context.scale(ratio, ratio);
    context.clearRect(0, 0, width, height);
    context.lineJoin = 'round';
    view = look(mesh, width, height);
    paint(onCanvas(context), mesh, {
      dark: isDark(), paper: variable('--card'), blank: variable('--blank'), mesh: isDark() ? 'rgba(0,0,0,.45)' : 'rgba(255,255,255,.55)', edge: variable('--ink'), soft: variable('--soft'), text: variable('--ink'),
    });
    if (state.hover != null) {
      const outline = mesh.outlines[state.hover].map(n => view.to(position(mesh, n, SCALES[state.scale])));
      const pen = onCanvas(context);
      pen.within(view.width - BAR, view.height);
      pen.line(isSolid(mesh.fields.cells[state.hover]) ? [...outline, outline[0]] : outline, '#ff3b6b', 2);
      pen.everywhere();
    }
    host.dataset.drawn = `${state.field} ${state.time} ${SCALES[state.scale]} ${bounds.map(b => b.toPrecision(6)).join(' ')}`;
  };
  let wanted = false;
  const soon = () => {
    // Further events can come before the drawing.
    if (view) view = look(meshOf(state.run), view.width, view.height);
    if (wanted) return;
    wanted = true;
    requestAnimationFrame(() => {
      wanted = false;
      part(draw);
    });
  };
  const update = () => {
    compute();
    draw();
  };
  redraws.push(update);

  const pictureOf = () => {
    const mesh = meshOf(state.run);
    const out = [`<svg xmlns="${SVG}" width="${view.width}" height="${view.height + 28}" font-family="sans-serif" font-size="12">`, '<rect width="100%" height="100%" fill="#fff"/>',
      `<text x="${view.width / 2}" y="18" text-anchor="middle" font-size="14">${xml(caption())}</text>`, `<svg y="28" width="${view.width}" height="${view.height}"><g stroke-linejoin="round">`];
    paint(inSvg(out), mesh, { dark: false, paper: '#fff', blank: '#e9ecee', mesh: 'rgba(255,255,255,.55)', edge: '#222', soft: '#666', text: '#222' });
    out.push('</g></svg></svg>');
    return out.join('\n');
  };

  // --- pointer, wheel, keys ---

  const hit = (px, py) => {
    const mesh = meshOf(state.run);
    const factor = SCALES[state.scale];
    const { fields } = mesh;
    let found = null;
    fields.cells.forEach((cell, c) => {
      if (!isShown(mesh, fields.group[c])) return;
      const outline = mesh.outlines[c].map(n => view.to(position(mesh, n, factor)));
      if (!isSolid(cell)) {
        for (let i = 1; i < outline.length; i++) if (distance([px, py], outline[i - 1], outline[i]) < 5) found = c;
        return;
      }
      if (found != null && !isSolid(fields.cells[found])) return;
      let inside = false;
      for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
        const [a, b] = [outline[i], outline[j]];
        if (a[1] > py !== b[1] > py && px < (b[0] - a[0]) * (py - a[1]) / (b[1] - a[1]) + a[0]) inside = !inside;
      }
      if (inside) found = c;
    });
    return found;
  };
  const distance = ([px, py], [ax, ay], [bx, by]) => {
    const length = (bx - ax) ** 2 + (by - ay) ** 2 || 1;
    const t = Math.min(1, Math.max(0, ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length));
    return Math.hypot(px - ax - t * (bx - ax), py - ay - t * (by - ay));
  };

  const hoverAt = (px, py) => {
    const mesh = meshOf(state.run);
    const c = px < view.width - BAR ? hit(px, py) : null;
    tip.hidden = c == null;
    if (c !== state.hover) {
      state.hover = c;
      soon();
    }
    if (c == null) return '';
    const { fields } = mesh;
    const outline = mesh.outlines[c];
    const centre = [0, 1].map(k => outline.reduce((sum, n) => sum + fields.nodes[2 * n + k], 0) / outline.length);
    const [x, y] = axes(state.run);
    const value = state.field === 'g' ? fields.groups[fields.group[c]] : shownValues[c] == null ? 'none, or zero' : `${shown(shownValues[c] * display.factor)}${display.unit && display.unit !== '-' ? ' ' + display.unit : ''}`;
    tip.textContent = `${fields.groups[fields.group[c]]}, element ${mesh.within[c]}\n${mesh.title(state.field)}: ${value}\nat ${x} = ${shown(Number(centre[0].toPrecision(4)))}, ${y} = ${shown(Number(centre[1].toPrecision(4)))} m`;
    tip.style.left = px > view.width / 2 ? '' : px + 16 + 'px';
    tip.style.right = px > view.width / 2 ? view.width - px + 16 + 'px' : '';
    tip.style.top = Math.max(0, Math.min(py - 10, view.height - 70)) + 'px';
    return tip.textContent;
  };

  const zoomBy = (factor, px, py) => {
    const zoom = Math.min(2000, Math.max(0.2, state.zoom * factor));
    const [x, y] = view.from(px, py);
    const by = zoom / state.zoom;
    state.centre = [x + (view.centre[0] - x) / by, y + (view.centre[1] - y) / by];
    state.zoom = zoom;
    soon();
  };
  const middle = () => [(view.width - BAR) / 2, view.height / 2];
  const fit = () => {
    state.centre = null;
    state.zoom = 1;
    soon();
  };
  const move = (dx, dy) => {
    state.centre = [view.centre[0] - dx / view.k, view.centre[1] + dy / view.k];
    soon();
  };
  let held = null;
  const local = event => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener('pointerdown', event => {
    held = local(event);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', event => {
    const [px, py] = local(event);
    if (held) {
      move(px - held[0], py - held[1]);
      held = [px, py];
      tip.hidden = true;
    } else {
      hoverAt(px, py);
    }
  });
  canvas.addEventListener('pointerup', () => { held = null; });
  canvas.addEventListener('pointerleave', () => hoverAt(-1, -1));
  canvas.addEventListener('dblclick', fit);
  // The wheel scrolls the page until the picture is clicked.
  canvas.addEventListener('wheel', event => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoomBy(Math.exp(-0.0015 * event.deltaY), ...local(event));
  }, { passive: false });
  canvas.addEventListener('keydown', event => {
    const act = {
      '+': () => zoomBy(1.25, ...middle()), '-': () => zoomBy(0.8, ...middle()), 0: fit,
      ArrowLeft: () => move(40, 0), ArrowRight: () => move(-40, 0), ArrowUp: () => move(0, 40), ArrowDown: () => move(0, -40),
    }[event.key];
    if (act) {
      event.preventDefault();
      act();
    }
  });

  // --- controls ---

  const lowInput = make('input', { type: 'number', step: 'any', 'aria-label': 'lower end', onchange: () => { state.low = Number(lowInput.value) / display.factor; update(); } });
  const highInput = make('input', { type: 'number', step: 'any', 'aria-label': 'upper end', onchange: () => { state.high = Number(highInput.value) / display.factor; update(); } });
  const scaleText = make('span', {});
  const scaleInput = make('input', { type: 'range', min: 0, max: SCALES.length - 1, value: state.scale, 'aria-label': 'deformation scale', oninput: () => { state.scale = Number(scaleInput.value); update(); } });
  const time = slider('time', value => { state.time = value; state.hover = null; update(); });
  const fieldHost = make('span', {});
  const groupHost = make('span', { class: 'chips', role: 'group', 'aria-label': 'groups shown' });

  const fill = () => {
    const mesh = meshOf(state.run);
    if (!mesh.names.some(([key]) => key === state.field)) state.field = mesh.names[0][0];
    fieldHost.replaceChildren(choice('field', mesh.names, state.field, value => {
      state.field = value;
      if (state.range === 'manual') state.range = rangeChoice.querySelector('select').value = '2';
      update();
    }));
    groupHost.replaceChildren(...mesh.fields.groups.map(name => {
      const chip = make('button', {
        type: 'button', 'aria-pressed': !state.hidden.has(name), onclick: () => {
          if (!state.hidden.delete(name)) state.hidden.add(name);
          chip.setAttribute('aria-pressed', !state.hidden.has(name));
          fit();
          update();
        },
      }, name);
      return chip;
    }));
    state.time = Math.min(state.time, mesh.fields.times.length - 1);
    time.set(state.time, mesh.fields.times.length - 1);
    time.node.hidden = mesh.fields.times.length < 2;
  };
  const rangeChoice = choice('range', [['all', 'all values'], ['2', 'without outer 2 %'], ['10', 'without outer 10 %'], ['manual', 'as entered']], state.range, value => {
    state.range = value;
    [state.low, state.high] = bounds;
    update();
  });

  host.append(
    make('div', { class: 'card-head' }, title, saveButtons(() => `${state.run.name}_${meshOf(state.run).title(state.field).replace(/[^\w]+/g, '_')}`, pictureOf)),
    make('div', { class: 'side' }, stage, make('div', { class: 'controls' },
      drawn.length > 1 ? choice('run', drawn.map((run, i) => [i, run.name]), 0, value => {
        state.run = drawn[Number(value)];
        state.hover = null;
        fit();
        fill();
        update();
      }) : null,
      fieldHost, state.run.model ? null : time.node,
      ...(state.run.model ? [
        choice('loads and water', state.run.model.stages.map((stage, i) => [i, stage.name]), state.stage, value => { state.stage = Number(value); update(); }),
        ...['lines', 'supports', 'loads', 'water'].map(mark => tick(mark, true, value => {
          if (value) state.marks.add(mark);
          else state.marks.delete(mark);
          draw();
        })),
      ] : [make('label', {}, 'deformation', scaleText), scaleInput, tick('undeformed outline', state.outline, value => { state.outline = value; draw(); })]),
      rangeChoice, make('span', { class: 'chips' }, lowInput, highInput),
      choice('colours', [['viridis', 'viridis'], ['diverging', 'blue–red about 0']], state.map, value => { state.map = value; update(); }),
      make('div', {}, make('div', { class: 'small' }, 'groups'), groupHost),
      tick('mesh lines', state.lines, value => { state.lines = value; draw(); }),
      make('span', { class: 'chips' },
        make('button', { type: 'button', title: 'nearer', onclick: () => zoomBy(1.5, ...middle()) }, '+'),
        make('button', { type: 'button', title: 'farther', onclick: () => zoomBy(1 / 1.5, ...middle()) }, '−'),
        make('button', { type: 'button', onclick: fit }, 'Fit')),
      make('div', { class: 'small' }, 'Click the picture, then the wheel zooms; drag moves, double click fits.'))));
  fill();
  update();
  chosen.contour = {
    canvas, host, time, pictureOf, title, hoverMiddle: () => {
      for (const [, at] of meshOf(state.run).outlines.entries()) {
        const centre = [0, 1].map(k => at.reduce((sum, n) => sum + position(meshOf(state.run), n, SCALES[state.scale])[k], 0) / at.length);
        const text = hoverAt(...view.to(centre));
        if (text) return text;
      }
      return '';
    },
    field(value) {
      const select = fieldHost.querySelector('select');
      select.value = value;
      select.dispatchEvent(new Event('change'));
    },
    scaleInput,
  };
});
