// The machine as a block diagram: units filled by their utilisation, arrows as wide as their bytes.

// Places of units, in the drawing's own lengths; their counters and their keys.
const kUnits = {
  frontend: { title: 'Front end', at: [20, 84, 170, 150], counters: /^frontend\./, keys: /^frontend\./ },
  binner: { title: 'Binner', at: [232, 84, 150, 150], counters: /^binner\./, keys: /^(binner|parameter_buffer)\./ },
  entry_fetch: { title: 'List fetch', at: [440, 84, 126, 52], counters: /^(tilecore\.(entries_fetched|sort_steps|culled|tiles_|wrong)|binner\.queue_bytes_read)/, keys: /^tilecore\.occlusion/ },
  tessellator: { title: 'Tessellator', at: [574, 84, 126, 52], counters: /^tilecore\.(tessell|domain|vertex|triangles$|compulsory)/, keys: /^tessellator\./ },
  box_builder: { title: 'Box builder', at: [708, 84, 126, 52], counters: /^tilecore\.(boxes_built)/, keys: /^$/ },
  box_tests: { title: 'Box tests', at: [440, 144, 126, 52], counters: /^tilecore\.(box_|group_tests|node_visits|frustum|rays)/, keys: /^tilecore\.box/ },
  triangle_tests: { title: 'Triangle tests', at: [574, 144, 126, 52], counters: /^tilecore\.(triangle_|sample_hits)/, keys: /^$/ },
  stencil: { title: 'Time stencil', at: [708, 144, 126, 52], counters: /^tilecore\.stencil/, keys: /^tilecore\.stencil/ },
  sampling: { title: 'Procedures', at: [440, 204, 126, 52], counters: /^procedures\./, keys: /^procedures\./ },
  alpha_tests: { title: 'Alpha tests', at: [574, 204, 126, 52], counters: /^tilecore\.alpha/, keys: /^$/ },
  coarse_depth: { title: 'Coarse depth', at: [708, 204, 126, 52], counters: /^tilecore\.(depth|culled)/, keys: /^tilecore\.(depth|occlusion)/ },
  compaction: { title: 'Compaction', at: [862, 84, 106, 82], counters: /^tilecore\.(quads|fragments|samples_visible|warps)/, keys: /^$/ },
  shader: { title: 'Shader', at: [976, 84, 106, 82], counters: /^tilecore\.(pixel_shader|helper|surface|warps|shading_cache)/, keys: /^(shader|shading_cache)\./ },
  texture: { title: 'Texture unit', at: [976, 174, 106, 82], counters: /^texture\./, keys: /^texture\./ },
  blend: { title: 'Blending', at: [862, 174, 106, 82], counters: /^tilecore\.blend/, keys: /^tilecore\.blend/ },
  resolve: { title: 'Resolve', at: [1110, 84, 106, 172], counters: /^(resolve|transmission)\./, keys: /^(resolve|frame_buffer)\./ },
  l2: { title: 'L2 cache', at: [640, 336, 430, 50], counters: /^l2\./, keys: /^(l2|cache)\./ },
  dram: { title: 'External memory', at: [20, 504, 1200, 50], counters: /^dram\./, keys: /^memory\./ },
};
const kCores = [424, 40, 806, 230];
const kMachineSize = [1240, 566];
// Anchors of the arrows of the memory interface: from x to x, below y.
const kAnchors = { frontend: [24, 190, 234], binner: [236, 380, 234], visibility: [438, 636, 270], l2: [650, 1062, 386], resolve: [1078, 1222, 270] };
const kThroughL2 = ['texture', 'patch_data', 'attributes', 'sampling_maps', 'scene_color', 'shadow_map'];
const kShortPurpose = { tile_queue: 'lists', tile_state: 'tile state', frame_buffer: 'pixels', texture: 'textures', history: 'history', neighbours: 'neighbours', sampling_maps: 'maps', coarse_depth: 'depths', scene_color: 'behind', shadow_map: 'shadows', attachment: 'attachments', patch_data: 'scene' };

function anchorOf(row) {
  if (row.unit === 'frontend' || row.unit === 'sampling') return 'frontend';
  if (row.unit === 'binner') return 'binner';
  if (row.unit === 'tilecore' && kThroughL2.includes(row.purpose)) return 'l2';
  return row.unit === 'tilecore' && ['tile_queue', 'tile_state', 'coarse_depth'].includes(row.purpose) ? 'visibility' : 'resolve';
}
// Arrows of a frame: {anchor, purpose, unit, write, bytes}.
function flowsOf(frame) {
  return frame.dram.flatMap((row) => [['read', row.read_bytes], ['write', row.written_bytes]].filter(([, bytes]) => bytes > 0)
    .map(([way, bytes]) => ({ anchor: anchorOf(row), purpose: row.purpose, unit: row.unit, write: way === 'write', bytes })));
}
const l2Bytes = (frame, at) => (frame.counters['l2.requests'] || 0) * Math.max(64, run(at).stats.gpu.memory.burst_bytes);

// Utilisation of a unit, and its costs.
function unitState(name, frame, at = shown) {
  const unit = frame.timing && frame.timing.units[name];
  if (name === 'l2') {
    const asked = frame.counters['l2.requests'] || 0, missed = frame.counters['l2.misses'] || 0;
    return { part: null, text: asked > 0 ? `${percent(1 - missed / asked)} of ${number(asked)} lines hit` : 'idle', energy: frame.energy && frame.energy.by_unit.l2 };
  }
  return { part: unit ? unit.utilisation : null, text: unit ? percent(unit.utilisation) : '', busy: unit ? unit.busy_cycles : null, energy: frame.energy && frame.energy.by_unit[name] };
}

// Why units of a phase wait, as parts of the time that tiles are in work; from the frame's timeline.
function waitsOf(timeline) {
  if (!timeline) return null;
  const sums = Array(8).fill(0);
  timeline.spans.forEach((cycles, index) => { sums[index % 8] += cycles; });
  const all = Math.max(1, sums.reduce((a, b) => a + b, 0));
  return { visibility: { data: sums[0] / all }, shading: { unit: sums[2] / all, data: sums[3] / all }, store: { unit: sums[5] / all, data: sums[6] / all } };
}

function machineSection() {
  if (!frameOf().timing) return;
  const part = section('machine', 'The machine', 'Boxes fill with the share of the frame in which a unit is busy, the mean over the cores; arrows are as wide as their bytes, on one scale for all frames; of two that are compared A’s are full, B’s pale. A press on a unit opens its counters.');
  const holder = make('div', { class: 'machine', tabindex: 0, role: 'region', 'aria-label': 'Block diagram of the machine' }), panel = make('div', { class: 'panel', 'aria-live': 'polite' });
  part.append(holder, panel);
  let open = wantedOf('unit', Object.keys(kUnits), ''), waits = null, widest = 0;
  const entry = follow(part, ['run', 'frame', 'other'], () => {
    if (!widest) widest = Math.max(1, ...runs().flatMap((of, r) => of.stats.frames.flatMap((frame) => [...flowsOf(frame).map((flow) => flow.bytes), l2Bytes(frame, { run: r })])));
    const frame = frameOf();
    holder.replaceChildren(diagram(frame, widest, () => waits, (name) => { open = open === name ? '' : name; showPanel(); mark(); }));
    mark();
    showPanel();
    waits = null;
    viewOf().then((view) => { if (frame === frameOf()) waits = waitsOf(view && view.tiles && view.tiles.timeline); });
  });
  entry.always = true;
  entry.reset = () => { widest = 0; };
  const mark = () => holder.querySelectorAll('[data-unit]').forEach((unit) => unit.setAttribute('aria-expanded', String(unit.dataset.unit === open)));
  const showPanel = () => {
    panel.replaceChildren(...(open ? unitPanel(open) : []));
    panel.hidden = !open;
  };
}

function diagram(frame, widest, waits, press) {
  const [width, height] = kMachineSize, cores = run().stats.gpu.tilecore.count;
  const drawing = draw('svg', { viewBox: `0 0 ${width} ${height}`, class: 'diagram', role: 'group', 'aria-label': 'Units of the machine and the bytes that they move' });
  // Cores behind the first.
  for (const shift of [12, 6].slice(cores > 2 ? 0 : cores > 1 ? 1 : 2)) drawing.append(draw('rect', { x: kCores[0] + shift, y: kCores[1] - shift, width: kCores[2] - 12, height: kCores[3], class: 'shell' }));
  drawing.append(draw('rect', { x: kCores[0], y: kCores[1], width: kCores[2] - 12 + (cores > 1 ? 0 : 12), height: kCores[3], class: frame.timing.bound_by === 'tilecores' ? 'shell bound' : 'shell' }),
    draw('text', { x: kCores[0] + 14, y: kCores[1] + 21, class: 'group' }, `${cores} tile core${cores === 1 ? '' : 's'}`),
    draw('text', { x: kCores[0] + 110, y: kCores[1] + 21, class: 'quiet' }, `a tile in work ${percent(frame.timing.units.tilecores.utilisation)} of the time${frame.timing.bound_by === 'tilecores' ? '; together they bound the frame' : ''}`));
  for (const [x, text] of [[20, 'geometry'], [440, 'visibility'], [862, 'shading'], [1110, 'pixels']]) drawing.append(draw('text', { x, y: 79, class: 'quiet' }, text));
  drawing.append(draw('path', { d: 'M190 159 H226', class: 'wire', 'marker-end': 'url(#tip)' }), draw('path', { d: 'M382 120 H434', class: 'wire', 'marker-end': 'url(#tip)' }),
    draw('path', { d: 'M834 170 H856', class: 'wire', 'marker-end': 'url(#tip)' }), draw('path', { d: 'M1082 170 H1104', class: 'wire', 'marker-end': 'url(#tip)' }),
    draw('defs', {}, draw('marker', { id: 'tip', viewBox: '0 0 8 8', refX: 6, refY: 4, markerWidth: 8, markerHeight: 8, orient: 'auto' }, draw('path', { d: 'M0 0 L8 4 L0 8 z', class: 'tip' }))));
  drawing.append(...arrows(frame, widest));
  for (const [name, unit] of Object.entries(kUnits)) drawing.append(unitBox(name, unit, frame, waits, press));
  return drawing;
}

function unitBox(name, unit, frame, waits, press) {
  const [x, y, w, h] = unit.at, state = unitState(name, frame), bound = frame.timing.bound_by === name, idle = state.part === 0;
  const other = otherFrame(), its = other && other.timing ? unitState(name, other, shown.other) : null, both = its && its.text ? `${state.part === null ? state.text : state.text.replace('\u00a0%', '')} | ${its.text}` : state.text;
  const filled = state.part === null ? 0 : Math.max(state.part > 0 ? 1.5 : 0, h * Math.min(1, state.part)), across = name === 'dram';
  // Texts of the box, from the top; its name begins with them.
  const said = [unit.title, name === 'dram' ? `${both} of the time · ${quantity(kFigures[4].of(frame, shown), 'GB/s')} of ${quantity(frame.timing.peak_gb_per_s, 'GB/s')}` : both, ...(bound && !across && h > 60 ? ['the bound'] : [])];
  const box = draw('g', { class: 'unit' + (bound ? ' bound' : '') + (idle ? ' idle' : ''), tabindex: 0, role: 'button', 'aria-expanded': 'false', 'data-unit': name, 'aria-label': `${said.join(' ')}: ${state.part === null ? 'lines of memory' : 'share of the frame in which it is busy'}${bound ? ', bounds the frame' : ''}` },
    draw('rect', { x, y, width: w, height: h, rx: 3, class: 'box' }),
    across ? draw('rect', { x, y, width: w * Math.min(1, state.part || 0), height: h, rx: 3, fill: kUnitColors[name], class: 'full' }) : draw('rect', { x, y: y + h - filled, width: w, height: filled, rx: 3, fill: kUnitColors[name] || '#7a7f87', class: 'full' }),
    draw('rect', { x, y, width: w, height: h, rx: 3, class: 'edge' }),
    ...said.flatMap((text, line) => [draw('text', { x: x + 10, y: y + 20 + 18 * line, class: line === 0 ? 'name' : 'value' }, text), ' ']));
  const lines = () => {
    const out = [unit.title];
    if (state.busy !== null && state.busy !== undefined) out.push(`busy ${number(state.busy)} of ${number(frame.timing.cycles)} cycles (${state.text})`);
    else out.push(state.text);
    if (state.energy !== undefined && state.energy !== null) out.push(`${quantity(state.energy, 'nJ')}, ${percent(state.energy / frame.energy.total_nj)} of the frame’s energy`);
    const stalls = name === 'shader' && frame.timing.events && frame.timing.events.shader_stalls;
    if (stalls) for (const [reason, cycles] of Object.entries(stalls)) out.push(`lanes idle, ${({ no_tile: 'no tile is ready', no_warp: 'no warp is packed', texture: 'the texture unit is busy', memory: 'texels are on their way' })[reason] || words(reason)}: ${percent(cycles / frame.timing.cycles)}`);
    const of = waits() && waits()[kUnitPhase[name]];
    if (of) {
      if (of.unit !== undefined) out.push(`tiles wait for this phase’s units ${percent(of.unit)} of their time`);
      if (of.data !== undefined) out.push(`and for its first data ${percent(of.data)}`);
    }
    if (bound) out.push(`bounds the frame: twice of it saves ${quantity(milliseconds(frame.timing.bound_by_cycles), 'ms')}`);
    return out;
  };
  hinted(box, lines);
  box.addEventListener('click', () => press(name));
  box.addEventListener('keydown', (event) => { if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); press(name); } });
  return box;
}

// An arrow from (x, from) to (x, to), `thick` wide; B's are pale within their edge.
function arrow(x, from, to, thick, color, side, bytes) {
  const down = to > from ? 1 : -1, head = Math.min(14, 5 + thick / 2) * down, half = thick / 2, tip = half + 4;
  return draw('path', { d: `M${x - half} ${from} H${x + half} V${to - head} H${x + tip} L${x} ${to} L${x - tip} ${to - head} H${x - half} z`, fill: color, stroke: color, class: side === 'B' ? 'flow pale' : 'flow', 'data-side': side, 'data-bytes': bytes });
}

// Arrows of the frame; in a comparison of both frames, A's left of B's, on one scale of half the width.
function arrows(frame, widest) {
  const out = [], dram = kUnits.dram.at[1], other = otherFrame(), sides = [['A', frame, shown], ...(other ? [['B', other, shown.other]] : [])];
  const thick = (bytes) => Math.max(1.5, 38 / sides.length * bytes / widest);
  // Flows from a place to another, of each side: {x, gap (of B from the middle), from, to, color, name, bytes: [of each side], inMemory,
  // label(texts): elements}.
  const flow = ({ x, gap, from, to, color, name, bytes: of, inMemory, label }) => {
    const there = sides.map(([side, its], s) => ({ side, bytes: of[s], all: bytesOf(its) })).filter(({ bytes }) => bytes > 0), said = ({ side, bytes }) => `${other ? side + ' ' : ''}${quantity(bytes, 'bytes')}`;
    const says = [name, ...there.map((one) => said(one) + (inMemory ? `, ${percent(one.bytes / one.all)} of ${other ? 'its' : 'the frame’s'} traffic` : ''))];
    const made = draw('g', { tabindex: 0, role: 'img', 'aria-label': says.join(': ') }, ...there.map(({ side, bytes }) => arrow(other ? x + (side === 'A' ? -gap : gap) : x, from, to, thick(bytes), color, side, bytes)), ...label(there.map(said)));
    hinted(made, () => says);
    out.push(made);
  };
  for (const [anchor, [left, right, top]] of Object.entries(kAnchors)) {
    const key = (row) => `${row.purpose}\n${row.unit}\n${row.write}`, rows = new Map();
    sides.forEach(([, of], s) => flowsOf(of).filter((row) => row.anchor === anchor).forEach((row) => {
      if (!rows.has(key(row))) rows.set(key(row), { ...row, of: sides.map(() => 0) });
      rows.get(key(row)).of[s] = row.bytes;
    }));
    const sorted = [...rows.values()].sort((a, b) => a.purpose.localeCompare(b.purpose) || a.write - b.write), step = (right - left) / Math.max(1, sorted.length), lines = 14 * sides.length;
    sorted.forEach((row, index) => {
      const x = left + step * (index + 0.5), short = anchor === 'frontend' && row.purpose === 'texture' ? 'heights' : row.unit === 'tilecore' && row.purpose === 'patch_data' ? 'patches' : kShortPurpose[row.purpose] || words(row.purpose);
      const at = dram - 64 - lines + (step > 64 ? 18 : (index % 2) * (20 + lines)), [from, to] = row.write ? [top + 2, dram - 3] : [dram - 2, top + 3];
      flow({ x, gap: Math.min(11, step / 4), from, to, color: purposeColor(row.purpose), name: `${purposeName(row.purpose)} ${row.write ? 'written by' : 'read by'} ${row.unit === 'tilecore' ? 'tile cores' : words(row.unit)}`, bytes: row.of, inMemory: true,
        label: (texts) => (step < 20 ? [] : [draw('text', { x, y: at, class: 'label', 'text-anchor': 'middle' }, short), ...texts.map((text, line) => draw('text', { x, y: at + 14 * (line + 1), class: 'label strong', 'text-anchor': 'middle' }, text))]) });
    });
  }
  const asked = sides.map(([, of, at]) => l2Bytes(of, at)), right = 855 + (other ? 11 : 0) + thick(Math.max(...asked)) / 2 + 8;
  if (asked.some((bytes) => bytes > 0))
    flow({ x: 855, gap: 11, from: kUnits.l2.at[1] - 2, to: kAnchors.visibility[2] + 3, color: kUnitColors.l2, name: 'L2 to tile cores, lines of heights, patches, attributes and textures', bytes: asked, inMemory: false,
      label: (texts) => texts.map((text, line) => draw('text', { x: right, y: 308 + 14 * line - 7 * (texts.length - 1), class: 'label strong' }, text)) });
  return out;
}

// Counters, traffic and keys of a unit, for the shown frame.
function unitPanel(name) {
  const unit = kUnits[name], frame = frameOf(), other = otherFrame(), state = unitState(name, frame);
  const counters = Object.keys(frame.counters).filter((counter) => unit.counters.test(counter));
  const charged = new Set(data.events.filter((event) => event.unit === name).flatMap((event) => event.keys));
  const keys = flatten(run().stats.gpu).filter(([key]) => unit.keys.test(key) || charged.has(key));
  const close = make('p', { class: 'note' }, `${state.busy !== undefined && state.busy !== null ? `Busy ${number(state.busy)} cycles, ${state.text} of the frame` : state.text}${state.energy ? `; ${quantity(state.energy, 'nJ')}` : ''}.`);
  const rows = name === 'dram' ? frame.dram : [];
  return [make('h3', {}, unit.title), close,
    make('div', { class: 'beside' },
      counters.length > 0 ? table([{ title: 'counter', of: (row) => row }, { title: 'frame', of: (row) => frame.counters[row], zero: true }, ...(other ? [{ title: 'B', of: (row) => other.counters[row], zero: true }] : []),
        { title: 'unit', of: (row) => (data.counters[row] || {}).unit || '' }, { title: 'meaning', of: (row) => (data.counters[row] || {}).meaning || '', wide: true }], counters, { label: `Counters of ${unit.title}` }) : null,
      rows.length > 0 ? table([{ title: 'unit', of: (row) => row.unit }, { title: 'purpose', of: (row) => purposeName(row.purpose) }, { title: 'read', of: (row) => row.read_bytes, show: (value) => quantity(value, 'bytes'), bar: true }, { title: 'written', of: (row) => row.written_bytes, show: (value) => quantity(value, 'bytes'), bar: true }], rows, { label: 'Traffic' }) : null,
      keys.length > 0 ? table([{ title: 'key', of: (row) => row[0] }, { title: 'value', of: (row) => row[1], show: plain }, { title: 'unit', of: (row) => (data.keys[row[0]] || {}).unit || '' }], keys, { label: `Keys of ${unit.title}` }) : null)];
}
