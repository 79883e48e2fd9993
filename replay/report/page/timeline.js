// The frame in time: front end, binner, the slots of all cores, the utilisation of each unit, bandwidth and list memory, on one axis;
// below it the compared frame on the same axis.

// Spans of a tile, in the order of timeline.spans: their colour and their words.
const kSpans = [['data', 'waits for its list'], ['visibility', 'visibility'], ['unit', 'waits for the shader'], ['data', 'waits for texels'], ['shading', 'shading'], ['unit', 'waits for the resolve unit'], ['data', 'waits for pixels'], ['store', 'resolve and store']];

function timelineSection() {
  if (!frameOf().timing) return;
  const part = section('timeline', 'Timeline', 'Drag or arrow keys move, the wheel or + and − zoom, Home shows all; a press pins the tile. In Perfetto: tessera replay --trace FILE.pftrace.');
  const canvas = make('canvas', { tabindex: 0, class: 'gantt', role: 'application', 'aria-label': 'Timeline of the frame. Arrow keys move, plus and minus zoom, Home shows all.' });
  const legend = make('p', { class: 'keys' }, ...[['geometry', 'front end, binner'], ['visibility', 'visibility'], ['shading', 'shading'], ['store', 'resolve and store'], ['unit', 'waits for a unit'], ['data', 'waits for data']].map(([kind, text]) => make('span', {}, make('i', { style: `background:${kPhaseColors[kind]}` }), text)));
  const says = make('p', { class: 'note', 'aria-live': 'polite' }), missing = make('p', { class: 'note' }, 'No timeline is kept of this frame.');
  // Counters that are drawn over time, in the order in which they were chosen.
  const picker = chooser('Add a counter', [['', 'none']], '', (name) => { if (name && !series.includes(name)) series.push(name); picker.select.value = ''; pickers(); paint(); }), chosen = make('span', { class: 'chosen-series' });
  picker.select.setAttribute('aria-describedby', 'series-note');
  part.append(make('div', { class: 'controls' }, make('button', { type: 'button', click: () => zoom(0.5) }, 'Zoom in'), make('button', { type: 'button', click: () => zoom(2) }, 'Zoom out'), make('button', { type: 'button', click: () => { window_ = [0, 1]; paint(); } }, 'Whole frame'), legend),
    make('div', { class: 'controls' }, picker.label, chosen), canvas, says, missing, make('p', { class: 'note', id: 'series-note' }, 'A counter of tiles lies where the clock placed the phase of the tile that counts it, evenly over that phase; one of the front end or the binner, over their spans. Counters that no tile keeps by itself are in the table below.'));
  function pickers() {
    if (parts.length === 0 || !parts[0].tiles) return;
    const names = seriesNames(parts[0].tiles, frameOf(parts[0].at));
    picker.select.replaceChildren(make('option', { value: '' }, 'none'), ...names.filter(([name]) => !series.includes(name)).map(([name, title]) => make('option', { value: name }, title)));
    chosen.replaceChildren(...series.map((name) => make('button', { type: 'button', 'aria-label': `Take ${seriesTitle(name)} away`, click: () => { series = series.filter((other) => other !== name); pickers(); paint(); } }, `${seriesTitle(name)} ×`)));
  }
  const seriesTitle = (name) => (/^(frontend|binner)\./.test(name) ? words(name) : mapTitle(name));
  const seriesUnit = (name) => (/^(frontend|binner)\./.test(name) ? (data.counters[name] || {}).unit || '' : mapInfo(name).unit);
  const seriesAmount = (name, value) => (kScales[seriesUnit(name)] ? quantity(value, seriesUnit(name)) : number(Math.round(value)));

  // Frames from the top: A's, and B's where one is compared: {name ("" of one alone), at, timeline, tiles}. `whole`: ms of the longest.
  let series = [], parts = [], whole = 1, window_ = [0, 1], layout = null;
  const entry = follow(part, ['run', 'frame', 'tile', 'other'], () => {
    const wanted = () => [{ run: shown.run, frame: shown.frame }, ...(shown.other ? [shown.other] : [])], places = wanted();
    Promise.all(places.map((at) => viewOf(at))).then((views) => {
      if (JSON.stringify(places) !== JSON.stringify(wanted())) return;
      parts = places.map((at, index) => ({ name: places.length > 1 ? 'AB'[index] : '', at, tiles: views[index] && views[index].tiles, timeline: views[index] && views[index].tiles && views[index].tiles.timeline })).filter((of) => of.timeline);
      whole = Math.max(1e-9, ...parts.map((of) => milliseconds(of.timeline.cycles, of.at)));
      missing.hidden = parts.length === places.length;
      missing.textContent = parts.length > 0 ? `No timeline is kept of ${parts[0].name === 'A' ? 'B' : 'A'}.` : 'No timeline is kept of this frame.';
      canvas.hidden = parts.length === 0;
      if (parts.length > 0) { pickers(); paint(); }
    });
  });
  darkness.addEventListener('change', () => parts.length > 0 && paint());
  whenResized(part, () => parts.length > 0 && paint());

  const timeAt = (x) => whole * (window_[0] + (x - layout.left) / layout.width * (window_[1] - window_[0]));
  const xAt = (time) => layout.left + (time / whole - window_[0]) / (window_[1] - window_[0]) * layout.width;
  const xOf = (of, cycle) => xAt(milliseconds(cycle, of.at));
  function zoom(by, around = (window_[0] + window_[1]) / 2) {
    const span = Math.max(1e-4, Math.min(1, (window_[1] - window_[0]) * by)), share = (around - window_[0]) / (window_[1] - window_[0]);
    const begin = Math.max(0, Math.min(1 - span, around - share * span));
    window_ = [begin, begin + span];
    paint();
  }
  function move(by) {
    const span = window_[1] - window_[0], begin = Math.max(0, Math.min(1 - span, window_[0] + by * span));
    window_ = [begin, begin + span];
    paint();
  }

  // Rows from the top, each {title, y, height}; lengths suit text of 14 pixels.
  function rowsOf(of) {
    const { timeline } = of, cores = timeline.tile.length ? Math.max(...timeline.core) + 1 : 0, slot = cores * timeline.slots > 40 ? 5 : 11;
    const out = [...(of.name ? [{ kind: 'name', title: of.name, height: 18 }] : []), { kind: 'frontend', title: 'front end', height: 16 }, { kind: 'binner', title: 'binner', height: 16 }];
    for (let core = 0; core < cores; ++core) out.push({ kind: 'core', core, title: `core ${core}`, height: timeline.slots * slot + 3, slot });
    for (const unit of Object.keys(kUnits)) if (timeline.busy[unit] && unit !== 'dram') out.push({ kind: 'busy', unit, title: kUnits[unit].title.toLowerCase(), height: 13 });
    out.push({ kind: 'bandwidth', title: 'bandwidth', height: 96 }, { kind: 'lists', title: 'list memory', height: 64 }, ...series.map((name) => ({ kind: 'series', name, title: seriesTitle(name), height: 48 })));
    return out.map((row) => ({ ...row, of }));
  }
  function rows(by) {
    const out = parts.flatMap(rowsOf);
    let y = 4;
    for (const row of out) {
      row.height *= by;
      if (row.slot) row.slot *= by;
      row.y = y;
      y += row.height + (row.kind === 'busy' ? 1 : 6);
    }
    return { out, height: y };
  }

  function paint() {
    const by = parseFloat(getComputedStyle(document.body).fontSize) / 14, { out, height } = rows(by), wide = Math.max(260, part.clientWidth), scale = window.devicePixelRatio || 1, full = height + 26 * by, pen = canvas.getContext('2d'), font = `${12 * by}px system-ui, "DejaVu Sans", sans-serif`;
    pen.font = font;
    layout = { left: 12 + Math.max(...out.map((row) => pen.measureText(row.title).width)), width: 0, rows: out, by };
    layout.width = wide - layout.left - 12;
    canvas.width = Math.round(wide * scale);
    canvas.height = Math.round(full * scale);
    canvas.style.height = full + 'px';
    pen.scale(scale, scale);
    pen.font = font;
    pen.textBaseline = 'middle';
    const ink = style('--ink'), quiet = style('--quiet'), line = style('--line'), panel = style('--panel');
    for (const row of out) {
      if (row.kind === 'name') {
        pen.fillStyle = ink;
        pen.textAlign = 'left';
        pen.fillText(`${row.title}: ${nameOf(row.of.at)}, ${quantity(milliseconds(row.of.timeline.cycles, row.of.at), 'ms')}`, layout.left, row.y + row.height / 2);
        continue;
      }
      pen.fillStyle = quiet;
      pen.textAlign = 'right';
      pen.fillText(row.title, layout.left - 8, row.y + row.height / 2);
      pen.fillStyle = panel;
      pen.fillRect(layout.left, row.y, layout.width, row.height);
    }
    pen.save();
    pen.beginPath();
    pen.rect(layout.left, 0, layout.width, height);
    pen.clip();
    axis(pen, height, line, quiet, false);
    for (const row of out) if (row.kind !== 'name') kPaint[row.kind](pen, row, ink);
    pen.restore();
    axis(pen, height, line, quiet, true);
  }

  function axis(pen, height, line, quiet, labels) {
    const all = whole, [step, unit] = axisScale(all * (window_[1] - window_[0]), 'ms');
    for (const tick of ticks(all * window_[0] / step, all * window_[1] / step, Math.max(2, layout.width / (110 * layout.by)))) {
      const x = xAt(tick * step);
      if (labels) {
        pen.fillStyle = quiet;
        pen.textAlign = 'center';
        pen.fillText(`${plain(tick)} ${unit}`, Math.max(layout.left + 18 * layout.by, Math.min(layout.left + layout.width - 18 * layout.by, x)), height + 12 * layout.by);
      } else {
        pen.fillStyle = line;
        pen.fillRect(Math.round(x), 0, 1, height);
      }
    }
  }

  const bar = (pen, of, begin, end, y, height, color) => {
    const x = xOf(of, begin), width = xOf(of, end) - x;
    if (x > layout.left + layout.width || x + width < layout.left || end <= begin) return;
    pen.fillStyle = color;
    pen.fillRect(x, y, Math.max(0.5, width - (width > 3 ? 0.5 : 0)), height);
  };
  const kPaint = {
    frontend: (pen, row) => row.of.timeline.geometry.forEach((round) => bar(pen, row.of, round[0], round[1], row.y, row.height, kUnitColors.frontend)),
    binner: (pen, row) => row.of.timeline.geometry.forEach((round) => bar(pen, row.of, round[2], round[3], row.y, row.height, kUnitColors.binner)),
    core: (pen, row, ink) => {
      const { timeline } = row.of;
      for (let t = 0; t < timeline.tile.length; ++t) {
        if (timeline.core[t] !== row.core) continue;
        const y = row.y + 2 + timeline.slot[t] * row.slot;
        let at = timeline.begin[t];
        for (let k = 0; k < 8; ++k) { const end = at + timeline.spans[8 * t + k]; bar(pen, row.of, at, end, y, row.slot - 1, kPhaseColors[kSpans[k][0]]); at = end; }
        if (timeline.tile[t] === shown.tile && alike(row.of) && !mapOfTile(timeline, frameOf(row.of.at).passes, t)) {
          pen.strokeStyle = ink;
          pen.lineWidth = 2;
          pen.strokeRect(xOf(row.of, timeline.begin[t]), y, Math.max(3, xOf(row.of, at) - xOf(row.of, timeline.begin[t])), row.slot - 1);
        }
      }
    },
    busy: (pen, row) => {
      const values = row.of.timeline.busy[row.unit], width = row.of.timeline.cycles / values.length, color = kUnitColors[row.unit] || kPhaseColors.other;
      pen.fillStyle = color;
      values.forEach((value, w) => {
        if (value === 0) return;
        const x = xOf(row.of, w * width), end = xOf(row.of, (w + 1) * width);
        if (end < layout.left || x > layout.left + layout.width) return;
        pen.globalAlpha = Math.min(1, value / 100);
        pen.fillRect(x, row.y, end - x + 0.3, row.height);
      });
      pen.globalAlpha = 1;
    },
    bandwidth: (pen, row, ink) => {
      const { timeline, at } = row.of, width = timeline.cycles / timeline.windows, names = Object.keys(timeline.bytes), rate = (bytes) => bytes / width * clockOf(at) * 1e-3;
      const most = bandwidthTop();
      const upto = Array(timeline.windows).fill(0);
      for (const name of names) {
        pen.fillStyle = kPhaseColors[name];
        timeline.bytes[name].forEach((bytes, w) => {
          const from = rate(upto[w]) / most, to = rate(upto[w] += bytes) / most, x = xOf(row.of, w * width);
          pen.fillRect(x, row.y + row.height * (1 - to), xOf(row.of, (w + 1) * width) - x + 0.3, row.height * (to - from));
        });
      }
      scaleLabel(pen, row, quantity(most, 'GB/s'), ink);
    },
    lists: (pen, row, ink) => {
      const { timeline } = row.of, width = timeline.cycles / timeline.windows, most = listTop();
      pen.fillStyle = purposeColor('tile_queue');
      timeline.list_bytes.forEach((bytes, w) => { const x = xOf(row.of, w * width), h = row.height * bytes / most; pen.fillRect(x, row.y + row.height - h, xOf(row.of, (w + 1) * width) - x + 0.3, h); });
      scaleLabel(pen, row, quantity(most, 'bytes'), ink);
    },
    series: (pen, row, ink) => {
      const { timeline, at } = row.of, values = seriesOf(row.name, row.of, frameOf(at)), width = timeline.cycles / timeline.windows, most = Math.max(1e-9, ...parts.flatMap((of) => seriesOf(row.name, of, frameOf(of.at))));
      pen.fillStyle = kPhaseColors.visibility;
      values.forEach((value, w) => { const x = xOf(row.of, w * width), h = row.height * value / most; pen.fillRect(x, row.y + row.height - h, xOf(row.of, (w + 1) * width) - x + 0.3, h); });
      scaleLabel(pen, row, `${seriesAmount(row.name, most)} in ${quantity(milliseconds(width, at), 'ms')}`, ink);
    },
  };
  // Tiles with the same numbers as A's.
  const alike = (of) => of.tiles.grid.join() === parts[0].tiles.grid.join();
  // Scales are the same for all frames: the peak rate of the memory, and the largest peak.
  const bandwidthTop = () => Math.max(0.001, ...parts.map(({ at }) => frameOf(at).timing.peak_gb_per_s));
  const listTop = () => Math.max(1, ...parts.flatMap(({ at }) => framesOf(at).map((frame) => frame.counters['binner.queue_bytes_peak'] || 0)));
  const scaleLabel = (pen, row, text, ink) => {
    pen.textAlign = 'left';
    pen.lineJoin = 'round';
    pen.lineWidth = 4;
    pen.strokeStyle = style('--ground');
    pen.strokeText(text, layout.left + 5, row.y + 9 * layout.by);
    pen.fillStyle = ink;
    pen.fillText(text, layout.left + 5, row.y + 9 * layout.by);
  };

  // The item under the pointer: {lines, tile (a press pins it)}.
  function find(x, y) {
    if (!layout || x < layout.left || x > layout.left + layout.width) return null;
    const row = layout.rows.find((of) => y >= of.y && y < of.y + of.height), time = timeAt(x);
    const found = row && row.kind !== 'name' ? findIn(row, y, time) : null;
    return found && { ...found, lines: [`${row.of.name ? row.of.name + ': ' : ''}${found.lines[0]}`, ...found.lines.slice(1)] };
  }
  function findIn(row, y, time) {
    const { timeline, at, tiles } = row.of, cycle = time * clockOf(at) * 1e3, when = quantity(time, 'ms');
    if (cycle > timeline.cycles) return { lines: [`the frame has ended at ${when}`] };
    const w = Math.max(0, Math.min(timeline.windows - 1, Math.floor(cycle / timeline.cycles * timeline.windows)));
    if (row.kind === 'busy') return { lines: [words(row.unit), `busy ${percent(timeline.busy[row.unit][w] / 100)} at ${when}`] };
    if (row.kind === 'lists') return { lines: ['live list memory', `${quantity(timeline.list_bytes[w], 'bytes')} at ${when}`] };
    if (row.kind === 'series') { const values = seriesOf(row.name, row.of, frameOf(at)); return { lines: [row.title, `${seriesAmount(row.name, values[w])} in ${quantity(milliseconds(timeline.cycles / timeline.windows, at), 'ms')} at ${when}`, `${seriesAmount(row.name, values.reduce((a, b) => a + b, 0))} in all`] }; }
    if (row.kind === 'bandwidth') {
      const width = timeline.cycles / timeline.windows;
      return { lines: [`memory at ${when}`, ...Object.entries(timeline.bytes).filter(([, of]) => of[w] > 0).map(([name, of]) => `${name}: ${quantity(of[w] / width * clockOf(at) * 1e-3, 'GB/s')}`)] };
    }
    if (row.kind !== 'core') return { lines: [row.title, ...timeline.geometry.map((round) => (row.kind === 'binner' ? round.slice(2) : round)).map(([begin, end]) => `${quantity(milliseconds(begin, at), 'ms')} to ${quantity(milliseconds(end, at), 'ms')}`)] };
    const slot = Math.floor((y - row.y - 2) / row.slot);
    for (let t = 0; t < timeline.tile.length; ++t) {
      if (timeline.core[t] !== row.core || timeline.slot[t] !== slot || cycle < timeline.begin[t]) continue;
      const spans = timeline.spans.slice(8 * t, 8 * t + 8), length = spans.reduce((a, b) => a + b, 0);
      if (cycle >= timeline.begin[t] + length) continue;
      const tile = timeline.tile[t], map = mapOfTile(timeline, frameOf(at).passes, t);
      return { tile: alike(row.of) && !map ? tile : undefined, lines: [`${map ? `Tile ${tile} of ${map}` : `Tile ${tile % tiles.grid[0]}, ${Math.floor(tile / tiles.grid[0])}`}: ${quantity(milliseconds(length, at), 'ms')}`, ...kSpans.map(([, text], k) => (spans[k] > 0 ? `${text}: ${number(spans[k])} cycles` : null)).filter(Boolean)] };
    }
    return null;
  }
  const place = (event) => { const at = canvas.getBoundingClientRect(); return [event.clientX - at.left, event.clientY - at.top]; };
  let grip = null;
  canvas.addEventListener('pointermove', (event) => {
    if (parts.length === 0) return;
    if (grip) { const by = (grip.x - event.clientX) / layout.width; grip.moved = grip.moved || Math.abs(grip.x - event.clientX) > 3; grip.x = event.clientX; move(by); return; }
    const found = find(...place(event));
    showHint(found && found.lines, event.clientX, event.clientY);
  });
  canvas.addEventListener('pointerleave', () => showHint(null));
  canvas.addEventListener('pointerdown', (event) => { grip = { x: event.clientX, moved: false }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointerup', (event) => {
    const found = grip && !grip.moved ? find(...place(event)) : null;
    grip = null;
    if (found && found.tile !== undefined) { show({ tile: found.tile }); says.textContent = found.lines.join(' · '); }
  });
  canvas.addEventListener('wheel', (event) => {
    if (parts.length === 0 || !event.ctrlKey && Math.abs(event.deltaX) > Math.abs(event.deltaY)) return;
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(place(event)[0]) / whole);
  }, { passive: false });
  const keys = { ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), '+': () => zoom(0.6), '=': () => zoom(0.6), '-': () => zoom(1 / 0.6), Home: () => { window_ = [0, 1]; paint(); } };
  canvas.addEventListener('keydown', (event) => { if (keys[event.key] && parts.length > 0) { keys[event.key](); event.preventDefault(); } });
  return entry;
}
