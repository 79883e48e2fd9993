// The frame in time: front end, binner, the slots of all cores, how busy each unit is, bandwidth and list memory, on one axis.

// Spans of a tile, in the order of timeline.spans: their colour and their words.
const kSpans = [['data', 'waits for its list'], ['visibility', 'visibility'], ['unit', 'waits for the shader'], ['data', 'waits for texels'], ['shading', 'shading'], ['unit', 'waits for the resolve unit'], ['data', 'waits for pixels'], ['store', 'resolve and store']];

function timelineSection() {
  if (!frameOf().timing) return;
  const part = section('timeline', 'Timeline', 'Drag or arrow keys move, the wheel or + and − zoom, Home shows all; a press pins the tile. In Perfetto: tessera replay --trace FILE.pftrace.');
  const canvas = make('canvas', { tabindex: 0, class: 'gantt', role: 'application', 'aria-label': 'Timeline of the frame. Arrow keys move, plus and minus zoom, Home shows all.' });
  const legend = make('p', { class: 'keys' }, ...[['geometry', 'front end, binner'], ['visibility', 'visibility'], ['shading', 'shading'], ['store', 'resolve and store'], ['unit', 'waits for a unit'], ['data', 'waits for data']].map(([kind, text]) => make('span', {}, make('i', { style: `background:${kPhaseColors[kind]}` }), text)));
  const says = make('p', { class: 'note', 'aria-live': 'polite' }), missing = make('p', { class: 'note' }, 'No timeline is kept of this frame.');
  part.append(make('div', { class: 'controls' }, make('button', { type: 'button', click: () => zoom(0.5) }, 'Zoom in'), make('button', { type: 'button', click: () => zoom(2) }, 'Zoom out'), make('button', { type: 'button', click: () => { window_ = [0, 1]; paint(); } }, 'Whole frame'), legend), canvas, says, missing);

  let timeline = null, window_ = [0, 1], layout = null, hover = null, tiles = null;
  const entry = follow(part, ['run', 'frame', 'tile'], () => {
    const at = { ...shown };
    viewOf(at).then((view) => {
      if (at.frame !== shown.frame || at.run !== shown.run) return;
      tiles = view && view.tiles;
      timeline = tiles && tiles.timeline;
      missing.hidden = Boolean(timeline);
      canvas.hidden = !timeline;
      if (timeline) paint();
    });
  });
  darkness.addEventListener('change', () => timeline && paint());
  new ResizeObserver(() => timeline && paint()).observe(part);

  const cycleAt = (x) => timeline.cycles * (window_[0] + (x - layout.left) / layout.width * (window_[1] - window_[0]));
  const xOf = (cycle) => layout.left + (cycle / timeline.cycles - window_[0]) / (window_[1] - window_[0]) * layout.width;
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

  // Rows from the top, each {title, y, height}; lengths are those of text of 14 pixels.
  function rows(by) {
    const cores = timeline.tile.length ? Math.max(...timeline.core) + 1 : 0, slot = cores * timeline.slots > 40 ? 5 : 11;
    const out = [{ kind: 'frontend', title: 'front end', height: 16 }, { kind: 'binner', title: 'binner', height: 16 }];
    for (let core = 0; core < cores; ++core) out.push({ kind: 'core', core, title: `core ${core}`, height: timeline.slots * slot + 3, slot });
    for (const unit of Object.keys(kUnits)) if (timeline.busy[unit] && unit !== 'dram') out.push({ kind: 'busy', unit, title: kUnits[unit].title.toLowerCase(), height: 13 });
    out.push({ kind: 'bandwidth', title: 'bandwidth', height: 96 }, { kind: 'lists', title: 'list memory', height: 64 });
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
    for (const row of out) kPaint[row.kind](pen, row, ink);
    pen.restore();
    axis(pen, height, line, quiet, true);
  }

  function axis(pen, height, line, quiet, labels) {
    const all = milliseconds(timeline.cycles), [step, unit] = axisScale(all * (window_[1] - window_[0]), 'ms');
    for (const tick of ticks(all * window_[0] / step, all * window_[1] / step, Math.max(2, layout.width / (110 * layout.by)))) {
      const x = xOf(tick * step / all * timeline.cycles);
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

  const bar = (pen, begin, end, y, height, color) => {
    const x = xOf(begin), width = xOf(end) - x;
    if (x > layout.left + layout.width || x + width < layout.left || end <= begin) return;
    pen.fillStyle = color;
    pen.fillRect(x, y, Math.max(0.5, width - (width > 3 ? 0.5 : 0)), height);
  };
  const kPaint = {
    frontend: (pen, row) => timeline.geometry.forEach((round) => bar(pen, round[0], round[1], row.y, row.height, kUnitColors.frontend)),
    binner: (pen, row) => timeline.geometry.forEach((round) => bar(pen, round[2], round[3], row.y, row.height, kUnitColors.binner)),
    core: (pen, row, ink) => {
      for (let t = 0; t < timeline.tile.length; ++t) {
        if (timeline.core[t] !== row.core) continue;
        const y = row.y + 2 + timeline.slot[t] * row.slot;
        let at = timeline.begin[t];
        for (let k = 0; k < 8; ++k) { const end = at + timeline.spans[8 * t + k]; bar(pen, at, end, y, row.slot - 1, kPhaseColors[kSpans[k][0]]); at = end; }
        if (timeline.tile[t] === shown.tile) {
          pen.strokeStyle = ink;
          pen.lineWidth = 2;
          pen.strokeRect(xOf(timeline.begin[t]), y, Math.max(3, xOf(at) - xOf(timeline.begin[t])), row.slot - 1);
        }
      }
    },
    busy: (pen, row) => {
      const values = timeline.busy[row.unit], width = timeline.cycles / values.length , color = kUnitColors[row.unit] || kPhaseColors.other;
      pen.fillStyle = color;
      values.forEach((value, w) => {
        if (value === 0) return;
        const x = xOf(w * width), end = xOf((w + 1) * width);
        if (end < layout.left || x > layout.left + layout.width) return;
        pen.globalAlpha = Math.min(1, value / 100);
        pen.fillRect(x, row.y, end - x + 0.3, row.height);
      });
      pen.globalAlpha = 1;
    },
    bandwidth: (pen, row, ink) => {
      const width = timeline.cycles / timeline.windows, names = Object.keys(timeline.bytes), rate = (bytes) => bytes / width * clockOf() * 1e-3;
      const most = bandwidthTop();
      const upto = Array(timeline.windows).fill(0);
      for (const name of names) {
        pen.fillStyle = kPhaseColors[name];
        timeline.bytes[name].forEach((bytes, w) => {
          const from = rate(upto[w]) / most, to = rate(upto[w] += bytes) / most, x = xOf(w * width);
          pen.fillRect(x, row.y + row.height * (1 - to), xOf((w + 1) * width) - x + 0.3, row.height * (to - from));
        });
      }
      scaleLabel(pen, row, quantity(most, 'GB/s'), ink);
    },
    lists: (pen, row, ink) => {
      const width = timeline.cycles / timeline.windows, most = Math.max(1, listTop());
      pen.fillStyle = purposeColor('tile_queue');
      timeline.list_bytes.forEach((bytes, w) => { const x = xOf(w * width), h = row.height * bytes / most; pen.fillRect(x, row.y + row.height - h, xOf((w + 1) * width) - x + 0.3, h); });
      scaleLabel(pen, row, quantity(most, 'bytes'), ink);
    },
  };
  // Scales stay over frames: what the memory gives, and the largest peak.
  const bandwidthTop = () => Math.max(0.001, run().stats.gpu.memory.gb_per_s * run().stats.gpu.memory.gpu_share);
  const listTop = () => Math.max(1, ...framesOf().map((frame) => frame.counters['binner.queue_bytes_peak'] || 0));
  const scaleLabel = (pen, row, text, ink) => {
    pen.textAlign = 'left';
    pen.lineJoin = 'round';
    pen.lineWidth = 4;
    pen.strokeStyle = style('--ground');
    pen.strokeText(text, layout.left + 5, row.y + 9 * layout.by);
    pen.fillStyle = ink;
    pen.fillText(text, layout.left + 5, row.y + 9 * layout.by);
  };

  // What lies under the pointer.
  function find(x, y) {
    if (!layout || x < layout.left || x > layout.left + layout.width) return null;
    const row = layout.rows.find((of) => y >= of.y && y < of.y + of.height), cycle = cycleAt(x);
    if (!row) return null;
    const w = Math.max(0, Math.min(timeline.windows - 1, Math.floor(cycle / timeline.cycles * timeline.windows))), when = quantity(milliseconds(cycle), 'ms');
    if (row.kind === 'busy') return { lines: [words(row.unit), `busy ${percent(timeline.busy[row.unit][w] / 100)} at ${when}`] };
    if (row.kind === 'lists') return { lines: ['live list memory', `${quantity(timeline.list_bytes[w], 'bytes')} at ${when}`] };
    if (row.kind === 'bandwidth') {
      const width = timeline.cycles / timeline.windows;
      return { lines: [`memory at ${when}`, ...Object.entries(timeline.bytes).filter(([, of]) => of[w] > 0).map(([name, of]) => `${name}: ${quantity(of[w] / width * clockOf() * 1e-3, 'GB/s')}`)] };
    }
    if (row.kind !== 'core') return { lines: [row.title, ...timeline.geometry.map((round) => (row.kind === 'binner' ? round.slice(2) : round)).map(([begin, end]) => `${quantity(milliseconds(begin), 'ms')} to ${quantity(milliseconds(end), 'ms')}`)] };
    const slot = Math.floor((y - row.y - 2) / row.slot);
    for (let t = 0; t < timeline.tile.length; ++t) {
      if (timeline.core[t] !== row.core || timeline.slot[t] !== slot || cycle < timeline.begin[t]) continue;
      const spans = timeline.spans.slice(8 * t, 8 * t + 8), length = spans.reduce((a, b) => a + b, 0);
      if (cycle >= timeline.begin[t] + length) continue;
      const tile = timeline.tile[t];
      return { tile, lines: [`Tile ${tile % tiles.grid[0]}, ${Math.floor(tile / tiles.grid[0])}: ${quantity(milliseconds(length), 'ms')}`, ...kSpans.map(([, text], k) => (spans[k] > 0 ? `${text}: ${number(spans[k])} cycles` : null)).filter(Boolean)] };
    }
    return null;
  }
  const place = (event) => { const at = canvas.getBoundingClientRect(); return [event.clientX - at.left, event.clientY - at.top]; };
  let grip = null;
  canvas.addEventListener('pointermove', (event) => {
    if (!timeline) return;
    if (grip) { const by = (grip.x - event.clientX) / layout.width; grip.moved = grip.moved || Math.abs(grip.x - event.clientX) > 3; grip.x = event.clientX; move(by); return; }
    hover = find(...place(event));
    showHint(hover && hover.lines, event.clientX, event.clientY);
  });
  canvas.addEventListener('pointerleave', () => showHint(null));
  canvas.addEventListener('pointerdown', (event) => { grip = { x: event.clientX, moved: false }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener('pointerup', (event) => {
    const found = grip && !grip.moved ? find(...place(event)) : null;
    grip = null;
    if (found && found.tile !== undefined) { show({ tile: found.tile }); says.textContent = found.lines.join(' · '); }
  });
  canvas.addEventListener('wheel', (event) => {
    if (!timeline || !event.ctrlKey && Math.abs(event.deltaX) > Math.abs(event.deltaY)) return;
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, cycleAt(place(event)[0]) / timeline.cycles);
  }, { passive: false });
  const keys = { ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), '+': () => zoom(0.6), '=': () => zoom(0.6), '-': () => zoom(1 / 0.6), Home: () => { window_ = [0, 1]; paint(); } };
  canvas.addEventListener('keydown', (event) => { if (keys[event.key] && timeline) { keys[event.key](); event.preventDefault(); } });
  return entry;
}
