// All points of a study at once: a line for each over its axes and some columns. A drag along a column keeps the points within.

function parallelSection({ points, columns, varying }, press) {
  if (points.length < 2 || varying.length === 0) return;
  const liked = ['timing.cycles', 'energy.total_nj', 'dram.read_bytes + dram.written_bytes', 'binner.queue_bytes_peak', 'area.total_mm2', 'tilecore.pixel_shader_invocations'].filter((name) => columns.includes(name));
  const chosen = new Set(liked.length > 0 ? liked : columns.slice(0, 4));
  const part = section('parallel', 'All points', 'A line is a point. Drag along a column to keep what lies within, press it to let go; a press on a line shows the point.');
  const holder = make('div', { class: 'parallel' }), kept = new Map();
  const picks = make('details', {}, make('summary', {}, 'Columns'), make('div', { class: 'picks' }, ...columns.map((name) => make('label', {}, make('input', { type: 'checkbox', checked: chosen.has(name), change: (event) => { if (event.target.checked) chosen.add(name); else chosen.delete(name); paint(); } }), name))));
  const count = make('p', { class: 'note', 'aria-live': 'polite' });
  part.append(picks, holder, count);

  // Axes of a drawing: {name, place(point) in [0, 1], labels: [[at, text]]}.
  function axes() {
    const ofKey = (key) => {
      const values = [...new Set(points.map((point) => String(point.axis[key])))];
      const sorted = values.every((value) => value !== '' && !Number.isNaN(Number(value))) ? values.sort((a, b) => a - b) : values;
      const at = (value) => (sorted.length < 2 ? 0.5 : sorted.indexOf(String(value)) / (sorted.length - 1));
      return { name: key, place: (point) => at(point.axis[key]), labels: sorted.filter((_, k) => sorted.length <= 12 || k % Math.ceil(sorted.length / 12) === 0).map((value) => [at(value), value]), given: true };
    };
    const ofColumn = (name) => {
      const known = points.map((point) => point.mean[name]).filter((value) => value !== undefined), least = Math.min(...known), most = Math.max(...known), unit = unitOfColumn(name), [step] = axisScale(most, '');
      return { name, place: (point) => (point.mean[name] === undefined ? null : most > least ? (point.mean[name] - least) / (most - least) : 0.5), labels: [least, (least + most) / 2, most].map((value, k) => [k / 2, unit ? quantity(value, unit, 4) : step > 1 ? `${digits(value / step, 4)}${({ 1000: ' k', 1000000: ' M', 1000000000: ' G' })[step] || ''}` : digits(value, 4)]) };
    };
    return [...varying.map(ofKey), ...[...chosen].map(ofColumn)];
  }
  function paint() {
    const all = axes(), width = Math.max(480, part.clientWidth, all.length * 110), height = 340, top = 44, bottom = height - 18;
    const x = (k) => 60 + (all.length === 1 ? 0 : k * (width - 160) / (all.length - 1)), y = (place) => bottom - place * (bottom - top);
    for (const name of kept.keys()) if (!all.some((axis) => axis.name === name)) kept.delete(name);
    const within = (point) => all.every((axis) => { const range = kept.get(axis.name), place = axis.place(point); return !range || (place !== null && place >= range[0] && place <= range[1]); });
    const room = Math.max(12, Math.floor((x(1) - x(0)) * 2 / 7) - 1), first = all[0], drawing = draw('svg', { viewBox: `0 0 ${width} ${height}`, width, height, role: 'img', 'aria-label': 'Parallel coordinates of all points; the table of points has the same numbers' });
    let inside = 0;
    for (const point of points.slice(0, 4000)) {
      const places = all.map((axis, k) => [x(k), axis.place(point)]).filter(([, place]) => place !== null), kind = within(point);
      if (kind) ++inside;
      const line = draw('polyline', { points: places.map(([at, place]) => `${at.toFixed(1)},${y(place).toFixed(1)}`).join(' '), class: kind ? 'through' : 'through out', stroke: seriesColor(null, valuesOfAxis(points, first.name).indexOf(String(point.axis[first.name]))) });
      hinted(line, () => [`Point ${point.index}`, ...varying.map((key) => `${key} = ${point.axis[key]}`), ...[...chosen].map((name) => `${name}: ${number(point.mean[name])}`)]);
      line.addEventListener('click', () => press({ index: point.index }));
      drawing.append(line);
    }
    all.forEach((axis, k) => {
      const column = draw('g', { class: 'column' }, draw('line', { x1: x(k), x2: x(k), y1: top, y2: bottom, class: 'rule' }), draw('rect', { x: x(k) - 10, y: top - 8, width: 20, height: bottom - top + 16, fill: 'transparent', class: 'grip' }),
        draw('text', { x: x(k), y: k % 2 === 0 ? 14 : 30, class: 'label strong', 'text-anchor': k === 0 ? 'start' : k === all.length - 1 ? 'end' : 'middle' }, axis.name.length > (k === all.length - 1 ? room / 2 : room) ? axis.name.slice(0, (k === all.length - 1 ? room / 2 : room) - 1) + '…' : axis.name),
        ...axis.labels.map(([place, text]) => draw('text', { x: x(k) + 7, y: y(place) + 4, class: 'label' }, text)));
      const range = kept.get(axis.name);
      if (range) column.append(draw('rect', { x: x(k) - 5, y: y(range[1]), width: 10, height: Math.max(2, y(range[0]) - y(range[1])), class: 'kept' }));
      let from = null;
      const place = (event) => { const box = drawing.getBoundingClientRect(); return Math.max(-0.02, Math.min(1.02, (bottom - (event.clientY - box.top) / box.height * height) / (bottom - top))); };
      column.querySelector('.grip').addEventListener('pointerdown', (event) => { from = place(event); });
      drawing.addEventListener('pointerup', (event) => {
        if (from === null) return;
        const to = place(event);
        if (Math.abs(to - from) < 0.02) kept.delete(axis.name); else kept.set(axis.name, [Math.min(from, to), Math.max(from, to)]);
        from = null;
        paint();
      });
      drawing.append(column);
    });
    holder.replaceChildren(drawing);
    count.textContent = kept.size > 0 ? `${inside} of ${points.length} points lie within.` : `${points.length} points.`;
  }
  paint();
  new ResizeObserver(() => { if (Math.abs(part.clientWidth - (paint.wide || 0)) > 4) { paint.wide = part.clientWidth; paint(); } }).observe(part);
}
