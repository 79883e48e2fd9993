// Over the frames: traffic by purpose, cycles, energy by unit; a press on a bar shows its frame.

// Frames that charts show: all, or every second, fourth ... of many.
function chartFrames() {
  const frames = framesOf(), step = Math.ceil(frames.length / 200);
  return frames.map((frame, index) => ({ frame, index })).filter(({ index }) => index % step === 0);
}
function frameChart(part, says, rows, titles) {
  const chart = plot(part, says, () => stackedBars(rows(), { ...titles, x: 'frame', mark: frameOf().frame, pressed: true }), (datum) => {
    const index = framesOf().findIndex((frame) => frame.frame === datum.at);
    if (index >= 0) show({ frame: index });
  });
  const entry = follow(part.appendChild(make('div')), ['frame'], () => chart.signal('mark', frameOf().frame));
  entry.always = true;
  const again = follow(part.appendChild(make('div')), ['run'], () => chart.draw());
  again.reset = () => chart.draw();
  again.stale = false;
  return chart;
}

function memorySection() {
  const part = section('memory', 'Memory traffic');
  frameChart(part, 'Bytes over the memory interface for each frame, by purpose', () => chartFrames().flatMap(({ frame }) => Object.keys(kPurposeColors).map((purpose) => ({
    at: frame.frame, part: purpose, value: frame.dram.filter((row) => row.purpose === purpose).reduce((sum, row) => sum + row.read_bytes + row.written_bytes, 0) })).filter((row) => row.value > 0)),
  { y: 'traffic', unit: 'bytes', part: 'purpose', colors: kPurposeColors, names: purposeName });
  const holder = make('div');
  part.append(holder);
  follow(holder, ['run', 'frame', 'other'], () => {
    const other = otherFrame(), key = (row) => row.unit + '\n' + row.purpose, its = new Map((other ? other.dram : []).map((row) => [key(row), row])), total = bytesOf(frameOf());
    const bytes = (value) => (value ? quantity(value, 'bytes', 4) : '–');
    holder.replaceChildren(make('h3', {}, nameOf(shown)), table([
      { title: 'unit', of: (row) => row.unit }, { title: 'purpose', of: (row) => purposeName(row.purpose) },
      { title: 'read', of: (row) => row.read_bytes, show: bytes, bar: true }, { title: 'written', of: (row) => row.written_bytes, show: bytes, bar: true },
      { title: 'share', of: (row) => (row.read_bytes + row.written_bytes) / Math.max(1, total), show: (value) => percent(value) },
      ...(other ? [{ title: 'B, read and written', of: (row) => (its.has(key(row)) ? its.get(key(row)).read_bytes + its.get(key(row)).written_bytes : 0), show: bytes }] : []),
      { title: 'bytes', of: (row) => row.read_bytes + row.written_bytes }], frameOf().dram, { sort: 4, up: false, label: 'Memory traffic of the frame' }));
  });
  queueSection();
}

function queueSection() {
  if (frameOf().counters['binner.queue_bytes_peak'] === undefined) return;
  const part = section('queues', 'List memory', 'Most parameter-buffer memory in use, against the bytes that the binner wrote and the tile cores read.');
  const names = { 'binner.queue_bytes_peak': 'most in use', 'binner.queue_bytes_written': 'written by the binner', 'binner.queue_bytes_read': 'read by tile cores' };
  if (framesOf().length > 1) {
    const rows = () => Object.keys(names).flatMap((name) => chartFrames().map(({ frame }) => ({ x: frame.frame, y: frame.counters[name] || 0, series: names[name], says: `frame ${frame.frame}: ${names[name]} ${quantity(frame.counters[name] || 0, 'bytes')}` })));
    const chart = plot(part, 'List memory over the frames', () => lines(rows(), { x: 'frame', y: 'list memory', unit: 'bytes', series: 'memory', step: 1 }));
    const again = follow(part.appendChild(make('div')), ['run'], () => chart.draw());
    again.reset = () => chart.draw();
    again.stale = false;
  } else {
    part.append(table([{ title: 'list memory', of: (name) => names[name] }, { title: 'bytes', of: (name) => frameOf().counters[name], show: (value) => quantity(value, 'bytes', 4) }], Object.keys(names)));
  }
}

// Cycles and energy, where the machine's timing model ran.
function costSections() {
  if (!frameOf().timing) return;
  const part = section('timing', 'Units');
  const bounds = [...new Set(framesOf().map((frame) => frame.timing.bound_by || 'nothing'))];
  if (framesOf().length > 1)
    frameChart(part, 'Time of each frame, by what bounds it', () => chartFrames().map(({ frame }) => ({ at: frame.frame, part: frame.timing.bound_by || 'nothing', value: milliseconds(frame.timing.cycles) })),
      { y: 'time', unit: 'ms', part: 'bound by', height: 180, colors: Object.fromEntries(bounds.map((name) => [name, kBoundColors[name] || '#7a7f87'])), names: boundWords });
  const holder = make('div');
  part.append(holder);
  follow(holder, ['run', 'frame', 'other'], () => {
    const frame = frameOf(), other = otherFrame(), units = Object.entries(frame.timing.units).filter(([name]) => name !== 'tilecores').map(([name, of]) => ({ name, ...of, nj: frame.energy ? frame.energy.by_unit[name] || 0 : 0 }));
    const its = (row) => (other && other.timing ? other.timing.units[row.name] : null);
    holder.replaceChildren(make('h3', {}, nameOf(shown)), table([
      { title: 'unit', of: (row) => (kUnits[row.name] ? kUnits[row.name].title : words(row.name)) + (row.name === frame.timing.bound_by ? ' (bounds the frame)' : '') }, { title: 'utilisation', of: (row) => row.utilisation, show: (value) => percent(value, 3), bar: true, zero: true },
      ...(other ? [{ title: 'B', of: (row) => (its(row) ? its(row).utilisation : 0), show: (value) => percent(value, 3), zero: true }] : []),
      { title: 'busy cycles', of: (row) => row.busy_cycles, zero: true }, { title: 'energy', of: (row) => row.nj, show: (value) => quantity(value, 'nJ'), bar: true, zero: true }], units, { sort: 1, up: false, label: 'Units of the frame' }));
  });
  if (!frameOf().energy) return;
  const energy = section('energy', 'Energy');
  frameChart(energy, 'Energy of each frame, by unit', () => chartFrames().flatMap(({ frame }) => Object.entries(frame.energy.by_unit).filter(([, nj]) => nj > 0).map(([unit, value]) => ({ at: frame.frame, part: unit, value }))),
    { y: 'energy', unit: 'nJ', part: 'unit', colors: kUnitColors, names: (unit) => (kUnits[unit] ? kUnits[unit].title : words(unit)) });
}
