// The first screen: whether the frame holds the target rate on the machine, its costs, its bound, and how reliable the figures are.

// The figures of a frame on each card, in one place, so that sections and comparisons agree. `better`: -1 less, 1 more.
const kFigures = [
  { key: 'ms', title: 'frame time', unit: 'ms', better: -1, of: (frame, at) => (frame.timing ? milliseconds(frame.timing.cycles, at) : null) },
  { key: 'fps', title: 'frame rate', unit: 'frames/s', better: 1, of: (frame, at) => (frame.timing && frame.timing.cycles > 0 ? 1000 / milliseconds(frame.timing.cycles, at) : null) },
  { key: 'energy', title: 'energy', unit: 'nJ', better: -1, of: (frame) => (frame.energy ? frame.energy.total_nj : null) },
  { key: 'power', title: 'power', unit: 'W', better: -1, of: (frame, at) => powerOf(frame, at) },
  { key: 'bandwidth', title: 'bandwidth', unit: 'GB/s', better: -1, of: (frame, at) => (frame.timing && frame.timing.cycles > 0 ? bytesOf(frame) * 1e-6 / milliseconds(frame.timing.cycles, at) : null) },
  { key: 'bytes', title: 'memory traffic', unit: 'bytes', better: -1, of: (frame) => bytesOf(frame) },
  { key: 'lists', title: 'peak list memory', unit: 'bytes', better: -1, of: (frame) => frame.counters['binner.queue_bytes_peak'] ?? null },
];
// Watts at the target rate, or at the frame's own rate where that is lower, as in hardware/energy.h. Leakage continues between frames
// unless the supply is cut.
function powerOf(frame, at = shown) {
  if (!frame.timing || !frame.energy || !(frame.timing.cycles > 0)) return null;
  const ms = milliseconds(frame.timing.cycles, at), interval = Math.max(ms, 1000 / shown.target), leaked = frame.energy.by_unit.leakage || 0;
  const leaks = run(at).stats.gpu.energy.power_gating === 'between_frames' ? ms : interval;
  return (frame.energy.total_nj - leaked + leaked * leaks / ms) / interval * 1e-6;
}
// Milliseconds left within the target rate's time, negative where the frame misses it.
const spareOf = (frame, at = shown) => 1000 / shown.target - milliseconds(frame.timing.cycles, at);
const bytesOf = (frame) => frame.counters['dram.read_bytes'] + frame.counters['dram.written_bytes'];

// The figure over the frames as a line, with a mark at the shown frame.
function spark(values, at) {
  const width = 120, height = 26, known = values.filter((value) => value !== null);
  if (known.length < 2) return null;
  const most = Math.max(...known), least = Math.min(...known, most * 0.999);
  const x = (index) => 3 + index / (values.length - 1) * (width - 6), y = (value) => height - 3 - (value - least) / Math.max(1e-300, most - least) * (height - 6);
  const points = values.map((value, index) => (value === null ? null : `${x(index).toFixed(1)},${y(value).toFixed(1)}`)).filter(Boolean).join(' ');
  return draw('svg', { viewBox: `0 0 ${width} ${height}`, class: 'spark', 'aria-hidden': 'true', preserveAspectRatio: 'none' },
    draw('polyline', { points, fill: 'none', stroke: 'var(--quiet)', 'stroke-width': 1.2, 'vector-effect': 'non-scaling-stroke' }),
    values[at] === null ? null : draw('line', { x1: x(at), x2: x(at), y1: 0, y2: height, stroke: 'var(--mark)', 'stroke-width': 2, 'vector-effect': 'non-scaling-stroke' }));
}

// "Meets 60 frames/s: 3.2 ms of 16.7 ms, 13.5 ms to spare."
function targetWords(frame, at = shown) {
  const spare = spareOf(frame, at), interval = 1000 / shown.target, ms = milliseconds(frame.timing.cycles, at);
  const times = ms / interval;
  return spare >= 0 ? `Meets ${plain(shown.target)} frames/s: ${quantity(ms, 'ms')} of ${quantity(interval, 'ms')}, ${percent(spare / interval)} to spare.`
    : `Misses ${plain(shown.target)} frames/s: ${quantity(ms, 'ms')} where ${quantity(interval, 'ms')} are allowed, ${times >= 2 ? `${digits(times)} times as long` : `${percent(-spare / interval)} too much`}.`;
}
// The limit on the number of tiles in flight in the cores.
function flightWords(timing) {
  const waits = timing.tile_memory_waits / Math.max(1, timing.cycles * run().stats.gpu.tilecore.count);
  return waits > 0.005 ? `tile memory limits them: cores wait for it ${percent(waits)} of the time` : 'tile memory does not limit them';
}
// How reliable the figures are: the model, the coarser model, the assumed numbers, and the comparison with silicon.
function trustWords() {
  const frame = frameOf(), of = run().stats.sensitivity, out = [], coarse = frame.timing.coarse_cycles;
  out.push((frame.timing.coarser_models || []).length > 0 ? `Timed by ${frame.timing.coarser_models.join(' and ')}, coarser than the default.` : 'Timed by the default (finest) model.');
  if (coarse) out.push(`The coarse one says ${quantity(milliseconds(coarse), 'ms')} (${signedPercent(coarse / frame.timing.cycles - 1)}).`);
  out.push(of ? `Assumed numbers within their ranges: time ${signedPercent(-of.cycles[0])} to ${signedPercent(of.cycles[1])}, energy ${signedPercent(-of.energy[0])} to ${signedPercent(of.energy[1])}.` : 'How much assumed numbers change it: tessera replay --sensitivity.');
  return `${out.join(' ')} Compared with published counters of real GPUs in docs/validation.md.`;
}

function cardSection() {
  const part = section('summary', 'At a glance');
  const target = make('input', { type: 'number', min: 1, max: 1000, step: 'any', value: shown.target, inputmode: 'decimal', 'aria-label': 'Target frame rate in frames per second', input: () => { const value = Number(target.value); if (value > 0 && value <= 10000) show({ target: value }); } });
  const verdict = make('p', { class: 'rate', 'aria-live': 'polite' }), holder = make('div', { class: 'cards' }), words = make('div');
  const image = make('img', { alt: '', decoding: 'async' }), preview = make('a', { class: 'preview', href: '#frames' }, image);
  part.append(make('div', { class: 'controls' }, make('label', {}, 'Target', target, 'frames/s'), verdict), make('div', { class: 'glance' }, preview, make('div', {}, holder, words)));
  const card = (title, value, unit, below, extra) => make('div', { class: 'card' }, make('h3', {}, title), make('p', { class: 'figure' }, make('b', {}, value), unit ? make('span', {}, ' ' + unit) : null), ...(below || []), extra || null);
  const entry = follow(part, ['run', 'frame', 'other', 'target'], () => {
    const address = data.kind === 'view' ? '' : imageAddress();
    preview.hidden = !address;
    if (address && image.src !== address) image.src = address;
    image.alt = `${nameOf(shown)}; to its tiles`;
    const frame = frameOf(), other = otherFrame(), timed = framesOf().filter((of) => of.timing);
    verdict.replaceChildren();
    verdict.hidden = !frame.timing;
    if (frame.timing) {
      const meets = timed.filter((of) => spareOf(of) >= 0).length;
      verdict.append(make('b', { class: spareOf(frame) >= 0 ? 'good' : 'bad' }, targetWords(frame)), timed.length > 1 ? ` ${meets} of ${timed.length} frames meet it.` : '', ...(other && other.timing ? [' B: ', make('span', { class: spareOf(other, shown.other) >= 0 ? 'good' : 'bad' }, targetWords(other, shown.other))] : []));
    }
    const cards = kFigures.filter((figure) => figure.key !== 'bytes').map((figure) => {
      const value = figure.of(frame, shown);
      if (value === null) return null;
      const [text, unit] = quantity(value, figure.unit).split('\u00a0');
      const below = [];
      if (figure.key === 'power') below.push(make('p', {}, `at ${digits(Math.min(shown.target, 1000 / milliseconds(frame.timing.cycles)))} frames/s`));
      if (other) {
        const its = figure.of(other, shown.other), part = value ? its / value - 1 : 0;
        const good = part * figure.better > 0;
        below.push(make('p', { class: 'versus' }, 'B ', quantity(its, figure.unit), ' ', make('span', { class: Math.abs(part) < 0.0005 ? '' : good ? 'good' : 'bad' }, signedPercent(part))));
      }
      return card(figure.title, text, unit, below, spark(framesOf().map((of) => figure.of(of, shown)), shown.frame));
    });
    if (frame.timing) {
      const count = run().stats.gpu.tilecore.count;
      const flight = card('tiles in flight a core', digits(frame.timing.tiles_in_flight ?? 0), '', [make('p', {}, `${count} core${count === 1 ? '' : 's'}; ${flightWords(frame.timing)}`), ...(other && other.timing ? [make('p', { class: 'versus' }, 'B ', digits(other.timing.tiles_in_flight ?? 0))] : [])]);
      flight.classList.add('wide');
      cards.push(flight);
    }
    if (frame.timing && frame.timing.bound_by) {
      const saves = frame.timing.bound_by_cycles / Math.max(1, frame.timing.cycles);
      const below = [make('p', {}, `With twice of it the frame takes ${percent(saves)} less time (${quantity(milliseconds(frame.timing.bound_by_cycles), 'ms')}).`)];
      if (other && other.timing) below.push(make('p', { class: 'versus' }, 'B ', boundWords(other.timing.bound_by)));
      const made = card('bound by', boundWords(frame.timing.bound_by), '', below);
      made.classList.add('bound');
      cards.unshift(made);
    }
    holder.replaceChildren(...cards.filter(Boolean));
    if (!frame.timing) words.replaceChildren(make('p', { class: 'note' }, 'The machine’s model did not run (output.machine_model=false): counters and traffic alone.'));
    else words.replaceChildren(make('p', { class: 'note' }, `On '${run().stats.gpu.preset}' at ${plain(clockOf())} MHz: ${number(frame.timing.cycles)} cycles, bound by ${frame.timing.bound_by || 'nothing'}.`), make('p', { class: 'note trust' }, trustWords()));
  });
  entry.always = true;
}
