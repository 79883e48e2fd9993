// The report of a replay.

function replayReport() {
  const stats = data.stats, frames = stats.frames;
  const titles = { x: 'frame', y: 'bytes', part: 'unit, purpose, direction' };
  let shown = frames[0];
  const moved = new EventTarget();  // to another frame

  if (data.views.length > 0) {
    const part = section('frames', 'Frames');
    let queues = null, counters = null;
    const browserPart = make('div');
    part.append(browserPart, make('h3', {}, 'Tiles by this map'));
    let state = { map: '' }, view = data.views[0];
    const spec = () => histogram(view.tiles && view.tiles.maps[state.map] ? view.tiles.maps[state.map].values : [], { x: state.map && view.tiles ? `${state.map.replaceAll('_', ' ')} of a tile, ${view.tiles.maps[state.map].unit}` : '', y: 'tiles' });
    const histogramPart = make('div');
    part.append(histogramPart);
    frameBrowser(browserPart, (nextView, nextState) => {
      view = nextView;
      state = nextState;
      shown = frames.find((frame) => frame.frame === view.frame) || shown;
      if (queues) queues.draw();
      if (counters) counters();
    });
    queues = plot(histogramPart, 'Histogram of the tiles of this frame by the chosen map', spec);
    counters = () => moved.dispatchEvent(new CustomEvent('frame'));
  }

  const memory = section('memory', 'Memory traffic');
  const traffic = frames.flatMap((frame) => frame.dram.flatMap((row) => [['read', row.read_bytes], ['written', row.written_bytes]].filter(([, bytes]) => bytes > 0)
    .map(([way, bytes]) => ({ at: frame.frame, part: `${row.unit} ${row.purpose.replaceAll('_', ' ')} ${way}`, value: bytes }))));
  plot(memory, 'Bytes over the memory interface for each frame, by unit and purpose', () => stackedBars(traffic, titles));
  memory.append(table([
    { title: 'unit', of: (row) => row.unit }, { title: 'purpose', of: (row) => row.purpose }, { title: 'bytes read', of: (row) => row.read_bytes }, { title: 'bytes written', of: (row) => row.written_bytes }], stats.total.dram));

  queueSection(frames);
  timingSection(frames, stats.total);
  baselineSection(stats);

  const part = section('counters', 'Counters');
  const holder = make('div');
  part.append(holder);
  const fill = () => holder.replaceChildren(table([
    { title: 'counter', of: (row) => row }, { title: 'all frames', of: (row) => stats.total.counters[row] }, { title: `frame ${shown.frame}`, of: (row) => shown.counters[row] },
    { title: 'unit', of: (row) => (data.counters[row] || {}).unit || '' }, { title: 'meaning', of: (row) => (data.counters[row] || {}).meaning || '', wide: true }], Object.keys(stats.total.counters)));
  fill();
  moved.addEventListener('frame', fill);

  const effects = Object.keys(shown.effects);
  const effectPart = section('effects', 'Effects');
  effectPart.append(table([{ title: 'frame', of: (row) => row.frame }, ...effects.map((effect) => ({ title: effect.replaceAll('_', ' '), of: (row) => (row.effects[effect] ? 'yes' : 'no') }))], frames));
  // Where and why, in the frame that is shown; which tiles, the maps of the frame show.
  const places = make('div');
  effectPart.append(places);
  const fillPlaces = () => {
    if (!shown.effect_places) return;
    const at = (effect) => shown.effect_places[effect] || {};
    places.replaceChildren(table([
      { title: `frame ${shown.frame}`, of: (row) => row.replaceAll('_', ' ') }, { title: 'sub-patches', of: (row) => at(row).sub_patches }, { title: 'sub-patches spared', of: (row) => at(row).sub_patches_elided },
      { title: 'tiles', of: (row) => at(row).tiles }, { title: 'why', of: (row) => shown.effect_reasons[row] || '', wide: true }], effects));
  };
  fillPlaces();
  moved.addEventListener('frame', fillPlaces);
  configurationSection([['Capture', stats.capture], ['Settings', stats.settings], ['Described machine', stats.gpu]]);
}

function queueSection(frames) {
  if (frames[0].counters['binner.queue_bytes_peak'] === undefined) return;
  const part = section('queues', 'Queue memory');
  part.append(make('p', { class: 'note' }, 'Most parameter-buffer memory in use, against the bytes that the binner wrote and the tile cores read.'));
  const names = ['binner.queue_bytes_peak', 'binner.queue_bytes_written', 'binner.queue_bytes_read'];
  if (frames.length > 1) {
    const rows = names.flatMap((name) => frames.map((frame) => ({ x: frame.frame, y: frame.counters[name], series: name, says: `frame ${frame.frame}: ${name} ${number(frame.counters[name])}` })));
    plot(part, 'Queue memory over the frames', () => lines(rows, { x: 'frame', y: 'bytes', series: 'counter', step: 1 }));
  } else {
    plot(part, 'Queue memory of the frame', () => bars(names.map((name) => ({ at: name, value: frames[0].counters[name], says: number(frames[0].counters[name]) })), { x: 'bytes' }));
  }
}

// Cycles and energy, where the machine's timing model ran.
function timingSection(frames, total) {
  const timed = frames.filter((frame) => frame.timing);
  if (timed.length > 0) {
    const part = section('timing', 'Timeline');
    const units = timed.flatMap((frame) => Object.entries(frame.timing.units || {}).map(([unit, of]) => ({ frame: frame.frame, unit, ...of })));
    part.append(make('p', {}, timed.map((frame) => `Frame ${frame.frame}: ${number(frame.timing.cycles)} cycles, bound by ${frame.timing.bound_by}.`).slice(0, 12).join(' ')));
    if (timed.length > 1) plot(part, 'Cycles of each frame', () => lines(timed.map((frame) => ({ x: frame.frame, y: frame.timing.cycles, series: 'cycles', says: `${number(frame.timing.cycles)} cycles, bound by ${frame.timing.bound_by}` })), { x: 'frame', y: 'cycles', series: '', step: 1 }));
    const first = units.filter((row) => row.frame === timed[0].frame);
    plot(part, 'How busy each unit is', () => bars(first.map((row) => ({ at: row.unit, value: row.utilisation, says: `${number(row.busy_cycles)} cycles` })), { x: `share of frame ${timed[0].frame} in which the unit is busy`, domain: [0, 1], format: '.0%' }));
    part.append(table([{ title: 'frame', of: (row) => row.frame }, { title: 'unit', of: (row) => row.unit }, { title: 'busy cycles', of: (row) => row.busy_cycles }, { title: 'utilisation', of: (row) => row.utilisation }], units));
  }
  if (!total.energy || !total.energy.by_unit) return;
  const part = section('energy', 'Energy');
  plot(part, 'Energy by unit', () => bars(Object.entries(total.energy.by_unit).map(([unit, value]) => ({ at: unit, value, says: `${number(value)} nJ` })), { x: 'nJ' }));
}

function baselineSection(stats) {
  if (!stats.total.baselines) return;
  const part = section('baselines', 'Other ways to bin the same frames'), schemes = Object.keys(stats.total.baselines);
  const names = Object.keys(stats.total.baselines[schemes[0]]);
  for (const name of ['baseline.queue_bytes_peak', 'baseline.dram_bytes', 'baseline.cycles', 'baseline.energy_nj'])
    plot(part, name, () => bars(schemes.map((scheme) => ({ at: scheme, value: stats.total.baselines[scheme][name], says: number(stats.total.baselines[scheme][name]) })), { x: name }));
  part.append(table([{ title: 'counter', of: (row) => row }, ...schemes.map((scheme) => ({ title: scheme, of: (row) => stats.total.baselines[scheme][row] })),
    { title: 'meaning', of: (row) => (data.counters[row] || {}).meaning || '', wide: true }], names));
}
