// The passes of a frame: a graph with the bytes that they write into images and read from them, and a table.

// Purposes of the bytes that a pass leaves for another pass, or for the screen; all its other bytes are its own.
const kPassImages = ['shadow_map', 'scene_color', 'attachment', 'frame_buffer', 'history', 'coarse_depth'];
const passBytes = (pass, way, purpose) => (pass.dram || []).filter((row) => !purpose || row.purpose === purpose).reduce((sum, row) => sum + row[way], 0);

function passSection() {
  if (!runs().some((of) => of.stats.frames.some((frame) => (frame.passes || []).length > 1))) return;
  const part = section('passes', 'Passes', 'Passes stand in the order in which they begin, from the top. An arrow to an image has the bytes that the pass writes into it, an arrow from an image the bytes that the pass reads. The table also has the bytes that a pass reads from the scene and from its own lists.');
  const holder = make('div');
  part.append(holder);
  const entry = follow(part, ['run', 'frame'], () => paint());
  whenResized(part, paint);
  let drawn = '';
  function paint() {
    const frame = frameOf(), passes = frame.passes || [], key = [shown.run, shown.frame, part.clientWidth].join();
    if (key === drawn) return;
    drawn = key;
    holder.replaceChildren(...(passes.length < 2 ? [make('p', { class: 'note' }, 'This frame has one pass.')] : [passGraph(passes, part.clientWidth), passTable(frame)]));
  }
  return entry;
}

// Passes at the left, images at the right, each with a line of text for every arrow, so that no label lies on another.
function passGraph(passes, wide) {
  const images = kPassImages.filter((image) => passes.some((pass) => passBytes(pass, 'written_bytes', image) + passBytes(pass, 'read_bytes', image) > 0));
  const width = Math.max(340, Math.min(wide, 760)), left = Math.max(212, Math.min(300, width * 0.45)), right = Math.max(116, Math.min(200, width * 0.3)), line = 18, arrows = [];
  const nodes = passes.map((pass) => ({ title: pass.name, lines: images.flatMap((image) => [['reads', 'read_bytes'], ['writes', 'written_bytes']].map(([verb, way]) => ({ image, verb, bytes: passBytes(pass, way, image) }))).filter((of) => of.bytes > 0) }));
  let y = 2;
  for (const node of nodes) { node.y = y; node.height = 8 + line * (1 + node.lines.length); y += node.height + 8; }
  const height = y, most = Math.max(1, ...nodes.flatMap((node) => node.lines.map((of) => of.bytes)));
  const places = new Map(images.map((image, k) => [image, (k + 0.5) * height / images.length]));
  const svg = draw('svg', { viewBox: `0 0 ${width} ${height}`, width, height, class: 'graph', role: 'img', 'aria-label': nodes.map((node) => `${node.title}: ${node.lines.map((of) => `${of.verb} ${quantity(of.bytes, 'bytes')}, ${purposeName(of.image)}`).join('; ') || 'neither reads nor writes an image'}`).join('. ') });
  const text = (x, at, words_, bold, anchor) => draw('text', { x, y: at, 'font-weight': bold ? 600 : 400, 'text-anchor': anchor || 'start' }, words_);
  for (const node of nodes) {
    svg.append(draw('rect', { x: 1, y: node.y, width: left, height: node.height, rx: 4, class: 'box' }), text(9, node.y + 17, node.title, true));
    node.lines.forEach((of, k) => {
      const at = node.y + line * (k + 1) + 13, to = places.get(of.image), x = width - right, half = (left + x) / 2;
      svg.append(text(9, at + 4, `${of.verb} ${purposeName(of.image)} ${quantity(of.bytes, 'bytes')}`));
      arrows.push(draw('path', { d: `M${left + 1},${at} C${half},${at} ${half},${to} ${x},${to}`, fill: 'none', stroke: purposeColor(of.image), 'stroke-width': 1 + 5 * of.bytes / most, 'stroke-dasharray': of.verb === 'reads' ? '6 4' : null, opacity: 0.8 }));
    });
  }
  svg.append(...arrows);
  for (const image of images) {
    const at = places.get(image), sum = (verb) => nodes.flatMap((node) => node.lines).filter((of) => of.image === image && of.verb === verb).reduce((all, of) => all + of.bytes, 0), lines = [['writes', 'written'], ['reads', 'read']].filter(([verb]) => sum(verb) > 0), tall = 8 + line * (1 + lines.length);
    svg.append(draw('rect', { x: width - right, y: at - tall / 2, width: right - 2, height: tall, rx: tall / 2.5, class: 'box', stroke: purposeColor(image) }), text(width - right / 2, at - tall / 2 + 17, purposeName(image), true, 'middle'), ...lines.map(([verb, says], k) => text(width - right / 2, at - tall / 2 + 17 + line * (k + 1), `${says} ${quantity(sum(verb), 'bytes')}`, false, 'middle')));
  }
  return make('div', { class: 'graph-holder' }, svg, make('p', { class: 'note' }, 'Solid: written. Dashed: read.'));
}

// Begin and end of the passes of a frame, and their bytes.
function passTable(frame) {
  const passes = frame.passes, times = (frame.timing || {}).passes || [], when = (row, end) => milliseconds((times[passes.indexOf(row)] || {})[end] || 0);
  const purposes = [...new Set(passes.flatMap((pass) => pass.dram.map((row) => row.purpose)))].filter((purpose) => passes.some((pass) => passBytes(pass, 'read_bytes', purpose) + passBytes(pass, 'written_bytes', purpose) > 0));
  return table([
    { title: 'pass', of: (row) => row.name }, { title: 'begins', of: (row) => when(row, 'begin_cycles'), show: (value) => quantity(value, 'ms'), zero: true }, { title: 'takes', of: (row) => when(row, 'end_cycles') - when(row, 'begin_cycles'), show: (value) => quantity(value, 'ms'), bar: true, zero: true, help: 'From its beginning to its end; passes may overlap' },
    { title: 'read', of: (row) => passBytes(row, 'read_bytes'), show: (value) => quantity(value, 'bytes'), bar: true, zero: true }, { title: 'written', of: (row) => passBytes(row, 'written_bytes'), show: (value) => quantity(value, 'bytes'), bar: true, zero: true },
    ...purposes.map((purpose) => ({ title: purposeName(purpose), of: (row) => passBytes(row, 'read_bytes', purpose) + passBytes(row, 'written_bytes', purpose), show: (value) => quantity(value, 'bytes'), zero: true })),
    { title: 'sub-patches', of: (row) => row.counters['frontend.sub_patches'], zero: true }, { title: 'invocations', of: (row) => row.counters['tilecore.pixel_shader_invocations'], zero: true }], passes, { label: 'Passes of the frame' });
}
