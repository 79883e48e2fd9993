// The first screen: what the frame takes on the machine, and what bounds it.

// Of a frame: what is on each card, in one place, so that sections and comparisons agree. `better`: -1 less, 1 more.
const kFigures = [
  { key: 'ms', title: 'frame time', unit: 'ms', better: -1, of: (frame, at) => (frame.timing ? milliseconds(frame.timing.cycles, at) : null) },
  { key: 'fps', title: 'frame rate', unit: 'frames/s', better: 1, of: (frame, at) => (frame.timing && frame.timing.cycles > 0 ? 1000 / milliseconds(frame.timing.cycles, at) : null) },
  { key: 'energy', title: 'energy', unit: 'nJ', better: -1, of: (frame) => (frame.energy ? frame.energy.total_nj : null) },
  { key: 'power', title: 'power', unit: 'W', better: -1, of: (frame) => frame.energy?.power_w ?? null },
  { key: 'bandwidth', title: 'bandwidth', unit: 'GB/s', better: -1, of: (frame, at) => (frame.timing && frame.timing.cycles > 0 ? bytesOf(frame) * 1e-6 / milliseconds(frame.timing.cycles, at) : null) },
  { key: 'bytes', title: 'memory traffic', unit: 'bytes', better: -1, of: (frame) => bytesOf(frame) },
  { key: 'lists', title: 'peak list memory', unit: 'bytes', better: -1, of: (frame) => frame.counters['binner.queue_bytes_peak'] ?? null },
];
const bytesOf = (frame) => frame.counters['dram.read_bytes'] + frame.counters['dram.written_bytes'];

// The figure over the frames as a line, with a mark at the frame that is shown.
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

function cardSection() {
  const part = section('summary', 'At a glance');
  const holder = make('div', { class: 'cards' }), words = make('div');
  part.append(holder, words);
  const card = (title, value, unit, below, extra) => make('div', { class: 'card' }, make('h3', {}, title), make('p', { class: 'figure' }, make('b', {}, value), unit ? make('span', {}, ' ' + unit) : null), ...(below || []), extra || null);
  const entry = follow(part, ['run', 'frame', 'other'], () => {
    const frame = frameOf(), other = otherFrame();
    const cards = kFigures.filter((figure) => figure.key !== 'bytes').map((figure) => {
      const value = figure.of(frame, shown);
      if (value === null) return null;
      const [text, unit] = quantity(value, figure.unit).split('\u00a0');
      const below = [];
      if (other) {
        const its = figure.of(other, shown.other), part = value ? its / value - 1 : 0;
        const good = part * figure.better > 0;
        below.push(make('p', { class: 'versus' }, 'B ', quantity(its, figure.unit), ' ', make('span', { class: Math.abs(part) < 0.0005 ? '' : good ? 'good' : 'bad' }, signedPercent(part))));
      }
      return card(figure.title, text, unit, below, spark(framesOf().map((of) => figure.of(of, shown)), shown.frame));
    });
    if (frame.timing && frame.timing.bound_by) {
      const saves = frame.timing.bound_by_cycles / Math.max(1, frame.timing.cycles);
      const below = [make('p', {}, `Twice of it saves ${quantity(milliseconds(frame.timing.bound_by_cycles), 'ms')} (${percent(saves)}).`)];
      if (other && other.timing) below.push(make('p', { class: 'versus' }, 'B ', boundWords(other.timing.bound_by)));
      const made = card('bound by', boundWords(frame.timing.bound_by), '', below);
      made.classList.add('bound');
      cards.push(made);
    }
    holder.replaceChildren(...cards.filter(Boolean));
    if (!frame.timing) words.replaceChildren(make('p', { class: 'note' }, 'The machine’s model did not run (output.machine_model=false): counters and traffic alone.'));
    else words.replaceChildren(make('p', { class: 'note' }, `On '${run().stats.gpu.preset}' at ${plain(clockOf())} MHz: ${number(frame.timing.cycles)} cycles, bound by ${frame.timing.bound_by || 'nothing'}${coarserModels(frame.timing.coarser_models)}.`));
  });
  entry.always = true;
}
