// All points of a study at once: a line for each point over its axes and some columns. A drag along a column keeps the points within.
// The lines are on a canvas, which holds thousands of them; the columns are a drawing over it, and both are one stop of the Tab key.

// Pieces of a name, of at most `room` letters where it has a place to break.
function nameLines(name, room) {
  const out = [''];
  for (const piece of name.match(/[^._ /]+[._ /]*|[._ /]+/g) || [name]) {
    if (out[out.length - 1] && (out[out.length - 1] + piece).trimEnd().length > room) out.push('');
    out[out.length - 1] += piece;
  }
  return out.map((line) => line.trimEnd());
}
const endOf = (text, room) => (text.length <= room ? text : '…' + text.slice(1 - room));

function parallelSection({ points, columns, varying }, press) {
  if (points.length < 2 || varying.length === 0) return;
  const liked = ['timing.cycles', 'energy.total_nj', 'dram.read_bytes + dram.written_bytes', 'binner.queue_bytes_peak', 'area.total_mm2', 'tilecore.pixel_shader_invocations'].filter((name) => columns.includes(name));
  const chosen = new Set(liked.length > 0 ? liked : columns.slice(0, 4));
  const part = section('parallel', 'All points', 'A line is a point. Drag along a column to keep what lies within, press it to let go; a press on a line shows the point. By keys: up and down choose a line in the order of a column, left and right the column, Enter shows the point; the space bar keeps lines from the chosen one, pressed again up to the chosen one, and Delete lets go.');
  const canvas = make('canvas', { 'aria-hidden': 'true' }), ruler = draw('svg', { 'aria-hidden': 'true' });
  const stage = make('div', { class: 'stage', tabindex: 0, role: 'application', 'aria-label': 'Parallel coordinates of all points. Up and down arrows choose a point, left and right arrows a column, Enter shows the point, the space bar twice keeps a range of the column, Delete lets it go. The table of points has the same numbers.' }, canvas, ruler);
  const holder = make('div', { class: 'parallel' }, stage), kept = new Map();
  const picks = make('details', {}, make('summary', {}, 'Columns'), make('div', { class: 'picks' }, ...columns.map((name) => make('label', {}, make('input', { type: 'checkbox', checked: chosen.has(name), change: (event) => { if (event.target.checked) chosen.add(name); else chosen.delete(name); paint(); } }), name))));
  const count = make('p', { class: 'note', 'aria-live': 'polite' });
  part.append(picks, holder, count);
  const firsts = new Map(valuesOfAxis(points, varying[0]).map((value, index) => [value, index]));
  const says = (point) => [`Point ${point.index}`, ...varying.map((key) => `${key} = ${point.axis[key]}`), ...[...chosen].map((name) => `${name}: ${number(point.mean[name])}`)];

  // The drawn data: axes, the place of each point on each of them (NaN where it has none), whether all kept ranges hold it.
  let shape = null;
  // The line and the column of the keyboard's cursor; -1 before the first key.
  const at = { line: -1, axis: 0 };

  // Axes of a drawing: {name, place(point) in [0, 1], labels: [[at, text]]}.
  function axes() {
    const ofKey = (key) => {
      const values = [...new Set(points.map((point) => String(point.axis[key])))];
      const sorted = values.every((value) => value !== '' && !Number.isNaN(Number(value))) ? values.sort((a, b) => a - b) : values;
      const places = new Map(sorted.map((value, k) => [value, sorted.length < 2 ? 0.5 : k / (sorted.length - 1)]));
      return { name: key, place: (point) => places.get(String(point.axis[key])), labels: sorted.filter((_, k) => sorted.length <= 12 || k % Math.ceil(sorted.length / 12) === 0).map((value) => [places.get(value), value]) };
    };
    const ofColumn = (name) => {
      const known = points.map((point) => point.mean[name]).filter((value) => value !== undefined), least = known.reduce((a, b) => Math.min(a, b), Infinity), most = known.reduce((a, b) => Math.max(a, b), -Infinity), unit = unitOfColumn(name), [step] = axisScale(most, '');
      return { name, place: (point) => (point.mean[name] === undefined ? NaN : most > least ? (point.mean[name] - least) / (most - least) : 0.5), labels: [least, (least + most) / 2, most].map((value, k) => [k / 2, unit ? quantity(value, unit, 4) : step > 1 ? `${digits(value / step, 4)}${({ 1000: ' k', 1000000: ' M', 1000000000: ' G' })[step] || ''}` : digits(value, 4)]) };
    };
    return [...varying.map(ofKey), ...[...chosen].map(ofColumn)];
  }
  function measure() {
    const all = axes(), width = Math.max(480, part.clientWidth, all.length * 122), distance = all.length === 1 ? width : (width - 160) / (all.length - 1), room = Math.floor(Math.min(distance, 112) / 7);
    const names = all.map((axis) => nameLines(axis.name, room)), top = 14 * Math.max(...names.map((lines) => lines.length)) + 16, bottom = top + 278;
    for (const name of kept.keys()) if (!all.some((axis) => axis.name === name)) kept.delete(name);
    const places = all.map((axis) => Float64Array.from(points, axis.place));
    const within = points.map((_, p) => all.every((axis, k) => { const range = kept.get(axis.name); return !range || (places[k][p] >= range[0] && places[k][p] <= range[1]); }));
    return { all, names, room, width, height: bottom + 18, top, bottom, places, within, x: (k) => 60 + k * (all.length === 1 ? 0 : distance), y: (place) => bottom - place * (bottom - top) };
  }
  function paintLines() {
    const { width, height, all, places, within, x, y } = shape, dense = window.devicePixelRatio || 1, pen = canvas.getContext('2d');
    canvas.width = width * dense;
    canvas.height = height * dense;
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
    pen.scale(dense, dense);
    const trace = (p) => { pen.beginPath(); all.forEach((_, k) => { if (!Number.isNaN(places[k][p])) pen.lineTo(x(k), y(places[k][p])); }); pen.stroke(); };
    // Many lines are thin and translucent, so that dense places show.
    const inside = within.filter(Boolean).length, alpha = Math.max(0.12, 0.75 / Math.sqrt(Math.max(1, inside / 300)));
    pen.lineWidth = inside > 1000 ? 1 : 1.6;
    for (const kind of [false, true]) {
      pen.globalAlpha = kind ? alpha : Math.min(0.12, alpha / 3);
      for (let p = 0; p < points.length; ++p) {
        if (within[p] !== kind) continue;
        pen.strokeStyle = seriesColor(null, firsts.get(String(points[p].axis[varying[0]])));
        trace(p);
      }
    }
    if (at.line >= 0) {
      pen.globalAlpha = 1;
      pen.strokeStyle = style('--ink');
      pen.lineWidth = 3;
      trace(at.line);
      if (!Number.isNaN(places[at.axis][at.line])) { pen.beginPath(); pen.arc(x(at.axis), y(places[at.axis][at.line]), 6, 0, 7); pen.stroke(); }
    }
    canvas.dataset.lines = inside;
  }
  function paintAxes() {
    const { all, names, room, width, height, top, bottom, x, y } = shape;
    fill(ruler, { viewBox: `0 0 ${width} ${height}`, width, height }, []);
    ruler.replaceChildren(...all.map((axis, k) => {
      const grip = draw('rect', { x: x(k) - 10, y: top - 8, width: 20, height: bottom - top + 16, fill: 'transparent', class: 'grip', pointerdown: (event) => { drag = { axis: axis.name, from: placeOf(event) }; } }), range = kept.get(axis.name);
      return draw('g', { class: 'column' }, draw('line', { x1: x(k), x2: x(k), y1: top, y2: bottom, class: 'rule' }), grip,
        ...names[k].map((line, row) => draw('text', { x: x(k), y: 14 + 14 * row, class: 'label strong', 'text-anchor': 'middle' }, line)),
        ...axis.labels.map(([place, text]) => draw('text', { x: x(k) + 7, y: y(place) + 4, class: 'label' }, text.length > room ? draw('title', {}, text) : null, endOf(text, room))),
        range ? draw('rect', { x: x(k) - 5, y: y(range[1]), width: 10, height: Math.max(2, y(range[0]) - y(range[1])), class: 'kept' }) : null);
    }));
  }
  function paint() {
    paint.wide = part.clientWidth;
    shape = measure();
    paintLines();
    paintAxes();
    count.textContent = kept.size > 0 ? `${shape.within.filter(Boolean).length} of ${points.length} points lie within.` : `${points.length} points.`;
  }

  // ---- By the pointer.
  let drag = null;
  const placeOf = (event) => { const box = ruler.getBoundingClientRect(); return Math.max(-0.02, Math.min(1.02, (shape.bottom - (event.clientY - box.top)) / (shape.bottom - shape.top))); };
  // The line that passes nearest under the pointer, within 8 pixels; -1 for none.
  const lineAt = (event) => {
    const { all, places, within, x, y } = shape, box = ruler.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    let nearest = -1, least = 8;
    for (let k = 0; k + 1 < all.length; ++k) {
      if (px < x(k) || px > x(k + 1)) continue;
      const t = (px - x(k)) / (x(k + 1) - x(k));
      for (let p = 0; p < points.length; ++p) {
        const off = within[p] ? Math.abs(y(places[k][p] * (1 - t) + places[k + 1][p] * t) - py) : Infinity;
        if (off < least) { least = off; nearest = p; }
      }
    }
    return nearest;
  };
  const onGrip = (event) => event.target.classList.contains('grip');
  stage.addEventListener('pointermove', (event) => { const p = drag || onGrip(event) ? -1 : lineAt(event); stage.style.cursor = p >= 0 ? 'pointer' : ''; showHint(p >= 0 ? says(points[p]) : null, event.clientX, event.clientY); });
  stage.addEventListener('pointerleave', () => showHint(null));
  stage.addEventListener('pointerup', (event) => {
    if (!drag) return;
    const { axis, from } = drag, to = placeOf(event);
    if (Math.abs(to - from) < 0.02) kept.delete(axis); else kept.set(axis, [Math.min(from, to), Math.max(from, to)]);
    drag = null;
    paint();
  });
  stage.addEventListener('click', (event) => { const p = onGrip(event) ? -1 : lineAt(event); if (p >= 0) { at.line = p; paintLines(); press({ index: points[p].index }); } });

  // ---- By keys: lines in the order of their places on the column, from its low end.
  function move(lines, columnsRight) {
    at.axis = Math.max(0, Math.min(shape.all.length - 1, at.axis + columnsRight));
    const places = shape.places[at.axis], order = points.map((_, p) => p).filter((p) => shape.within[p] && !Number.isNaN(places[p])).sort((a, b) => places[a] - places[b] || a - b);
    if (order.length === 0) return;
    const now = order.indexOf(at.line);
    at.line = order[now < 0 ? 0 : Math.max(0, Math.min(order.length - 1, now + lines))];
    paintLines();
    const box = ruler.getBoundingClientRect();
    showHint(says(points[at.line]), box.left + shape.x(at.axis), box.top + shape.y(places[at.line]));
    count.textContent = `${shape.all[at.axis].name}: line ${order.indexOf(at.line) + 1} of ${order.length}. ${says(points[at.line]).join(', ')}`;
  }
  // The space bar marks one end of a range of the column at the chosen line; pressed again, the other end.
  let end = null;
  function keep() {
    if (at.line < 0) return;
    const { name } = shape.all[at.axis], place = shape.places[at.axis][at.line];
    if (Number.isNaN(place)) return;
    if (!end || end.name !== name) { end = { name, place }; count.textContent = `${name}: one end of a range; the space bar at another line keeps all between.`; return; }
    kept.set(name, [Math.min(end.place, place), Math.max(end.place, place)]);
    end = null;
    paint();
  }
  function letGo() { end = null; kept.delete(shape.all[at.axis].name); paint(); }
  const keys = { ' ': keep, Delete: letGo, Backspace: letGo, ArrowUp: () => move(1, 0), ArrowDown: () => move(-1, 0), ArrowRight: () => move(0, 1), ArrowLeft: () => move(0, -1), Home: () => move(-Infinity, 0), End: () => move(Infinity, 0), Enter: () => { if (at.line >= 0) press({ index: points[at.line].index }); } };
  stage.addEventListener('keydown', (event) => { if (keys[event.key]) { event.preventDefault(); keys[event.key](); } });
  stage.addEventListener('blur', () => showHint(null));

  paint();
  darkness.addEventListener('change', paintLines);
  whenResized(part, () => { if (Math.abs(part.clientWidth - paint.wide) > 4) paint(); });
}
