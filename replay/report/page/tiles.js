// Tiles: the image with their maps, the pinned tile with all its data, and the costs of drawables and materials.

// Values of a map of a frame, from the maps and the tile costs in tiles_NNNN.json.
function mapValues(tiles, name) {
  if (!tiles || !name) return null;
  if (name.startsWith('cost.')) return tiles.costs ? tiles.costs[name.slice(5)] : null;
  if (name.startsWith('dram.')) return tiles.costs && tiles.costs.dram[name.slice(5)] ? tiles.costs.dram[name.slice(5)] : null;
  return tiles.maps[name] ? tiles.maps[name].values : null;
}
const kCostMaps = {
  'cost.cycles': ['cycles', 'cycles', 'From the cycle in which the core takes the tile to its last pixel.'], 'cost.energy_nj': ['energy', 'nJ', 'Of the units of its core, and of memory.'],
  'cost.saves': ['cycles saved by twice of its bound', 'cycles', 'Cycles by which the tile would end sooner if the unit that bounds it were twice as fast. With machine.timing=events an estimate: half of that unit’s part of the critical path.'], 'cost.bound_by': ['bound by', '', 'The unit that, twice as fast, would end the tile soonest. With machine.timing=events an estimate: the unit with the largest part of the path to the tile’s last pixel.'] };
function mapTitle(name) { return kCostMaps[name] ? kCostMaps[name][0] : name.startsWith('dram.') ? `bytes: ${purposeName(name.slice(5))}` : words(name); }
function mapInfo(name) {
  if (kCostMaps[name]) return { unit: kCostMaps[name][1], meaning: kCostMaps[name][2] };
  if (name.startsWith('dram.')) return { unit: 'bytes', meaning: 'Over the memory interface, read and written.' };
  return data.maps[name] || { unit: '', meaning: '' };
}
const showAs = (unit) => (value) => (kScales[unit] ? quantity(value, unit) : number(value));

// A map for the viewer: its colours, on a scale for all frames of all runs. `range`: [least, most].
function mapDrawing(tiles, name, range, opacity, logarithmic) {
  const values = mapValues(tiles, name);
  if (!values) return null;
  const { unit, meaning } = mapInfo(name);
  if (name === 'cost.bound_by') {
    const color = (bound) => (bound < 0 ? null : kBoundColors[tiles.costs.bounds[bound]] || '#7a7f87'), there = [...new Set(values)].filter((bound) => bound >= 0);
    return { values, color, opacity, kinds: there.map((bound) => [boundWords(tiles.costs.bounds[bound]), color(bound)]), range: [0, 0], show: String, says: meaning };
  }
  return { values, color: rampOf(range, logarithmic), opacity, range, show: showAs(unit), says: `${kScales[unit] ? '' : unit + ' '}per tile${logarithmic ? ', logarithmic' : ''}. ${meaning}` };
}

function tileSection() {
  if (!runs().some((of) => of.views.some((view) => view && view.tiles))) { if (runs().some((of) => of.views.some((view) => view && view.image))) imageSection(); return; }
  const part = section('frames', 'Tiles, drawables and materials', 'A press on the image names what that pixel shows and pins its tile; a press on a drawable or a material shows where it is drawn. Arrow keys move by a tile, with Shift by a pixel; Escape lets go.');
  const state = { opacity: 0.75, log: false };
  const viewer = tileViewer('Image with a map of its tiles. Arrow keys choose a tile, with Shift a pixel.', (tile, pixel) => show({ tile, pixel }), (tile) => hintOf(tile));
  const second = tileViewer('Image B with the same map.', (tile, pixel) => show({ tile, pixel }), (tile) => hintOf(tile, tilesB)), secondPart = make('div', { hidden: true }, make('p', { class: 'note' }), second.element);
  const partial = make('p', { class: 'note', hidden: true }, 'Some tiles draw more than are listed here: those where it is seen least may be missing.');
  const legend = mapLegend(), pinned = make('div', { class: 'tile', 'aria-live': 'polite' }), tables = make('div', { class: 'costs' });
  const names = Object.keys(data.scales).filter((name) => data.scales[name][1] > 0);
  const order = ['cost.cycles', 'cost.bound_by', 'cost.energy_nj', 'cost.saves'];
  names.sort((a, b) => (order.indexOf(b) >= 0) - (order.indexOf(a) >= 0) || (order.indexOf(a) - order.indexOf(b)));
  const maps = chooser('Map', [['', 'none'], ...names.map((name) => [name, mapTitle(name)])], shown.map, (value) => show({ map: value }));
  const opacity = make('input', { type: 'range', min: 0, max: 1, step: 0.05, value: state.opacity, input: () => { state.opacity = Number(opacity.value); paint(); } });
  const log = make('input', { type: 'checkbox', change: () => { state.log = log.checked; paint(); } });
  const release = make('button', { type: 'button', click: () => show({ row: -1, material: '' }) }, 'Show all');
  part.append(make('div', { class: 'controls' }, maps.label, make('label', {}, 'Opacity', opacity), make('label', {}, log, 'logarithmic'), release),
    make('div', { class: 'split' }, make('div', { class: 'stay' }, viewer.element, legend.element, secondPart, partial, ...[data.image_note, data.pixel_note, data.left_out > 0 ? `${data.left_out} further images are left out.` : ''].filter(Boolean).map((note) => make('p', { class: 'note' }, note))), make('div', {}, pinned, tables)));
  let tiles = null, tilesB = null, ranks = null;
  const rows = () => frameOf().drawables || [];
  // The selected rows of the frame's drawables.
  const chosenRows = () => (shown.row >= 0 ? [shown.row] : shown.material ? rows().map((row, index) => [row, index]).filter(([row]) => row.material === shown.material.slice(1)).map(([, index]) => index) : null);
  function maskOf() {
    const chosen = chosenRows();
    if (!chosen || !tiles || !tiles.lists) return null;
    const mask = new Set();
    tiles.lists.forEach((list, tile) => { for (let k = 0; k < list.length; k += 3) if (chosen.includes(list[k]) && (list[k + 2] > 0 || list[k + 1] > 0)) mask.add(tile); });
    return mask;
  }
  // Overlay of the image: darkens all pixels but the selected drawables' pixels, or outlines the drawable that the pinned pixel shows.
  function shapeOf() {
    const pixels = pixelsOf(tiles), chosen = chosenRows();
    if (!pixels) return null;
    const row = !chosen && shown.pixel && pixels.has(...shown.pixel) ? pixels.at(...shown.pixel).row : -1;
    if (!chosen && row < 0) return null;
    const within = pixels.within(chosen || [row]);
    return chosen && !within.includes(1) ? null : { region: pixels.region, image: pixelShape(pixels, within, Boolean(chosen)) };
  }
  function hintOf(tile, of = tiles) {
    if (!of) return [];
    const out = [`Tile ${tile % of.grid[0]}, ${Math.floor(tile / of.grid[0])}`];
    const values = mapValues(of, shown.map);
    if (values && shown.map !== 'cost.bound_by') out.push(`${mapTitle(shown.map)}: ${showAs(mapInfo(shown.map).unit)(values[tile])}${kScales[mapInfo(shown.map).unit] ? '' : ' ' + mapInfo(shown.map).unit}`);
    if (of.costs && of.costs.bound_by && of.costs.bound_by[tile] >= 0) out.push(`bound by ${boundWords(of.costs.bounds[of.costs.bound_by[tile]])}`);
    return out;
  }
  function paint() {
    const view = run().views[shown.frame];
    maps.select.value = shown.map;
    release.hidden = shown.row < 0 && !shown.material;
    if (release.hidden) tables.querySelectorAll('.chosen').forEach((line) => line.classList.remove('chosen'));
    if (!view) return;
    if (tiles && shown.tile >= tiles.grid[0] * tiles.grid[1]) shown.tile = -1, shown.pixel = null;
    // Pixels of chosen drawables stay as they are, and tiles that have them in their lists, hidden or not, stay brighter than others.
    const shape = shapeOf(), mask = maskOf(), map = mask ? null : mapDrawing(tiles, shown.map, data.scales[shown.map], state.opacity, state.log);
    viewer.draw({ view, address: imageAddress(), label: nameOf(shown), tiles, map, mask, shape, tile: shown.tile, pixel: shown.pixel });
    legend.draw(map);
    partial.hidden = !mask || !tiles.unlisted || tiles.unlisted.every((count) => count === 0);
    paintSecond();
    pinned.replaceChildren(...pinnedPixel(tiles), ...pinnedTile(tiles, ranks));
  }
  // B beside A: the same map on the same scale.
  function paintSecond() {
    const at = shown.other, view = at ? run(at).views[at.frame] : null;
    secondPart.hidden = !view;
    if (!view) return;
    secondPart.querySelector('p').textContent = `B: ${nameOf(at)}`;
    viewOf(at).then((of) => {
      if (shown.other !== at) return;
      tilesB = of && of.tiles;
      const there = tilesB && shown.tile >= 0 && shown.tile < tilesB.grid[0] * tilesB.grid[1] && tiles && tiles.grid.join() === tilesB.grid.join();
      second.draw({ view, address: imageAddress(at), label: nameOf(at), tiles: tilesB, map: tilesB ? mapDrawing(tilesB, shown.map, data.scales[shown.map], state.opacity, state.log) : null, mask: null, tile: there ? shown.tile : -1, pixel: there ? shown.pixel : null });
    });
  }
  function paintTables() {
    tables.replaceChildren(...costTables(rows(), (row) => show({ row: shown.row === row ? -1 : row, material: '' }), (material) => show({ material: shown.material === material ? '' : material, row: -1 })));
  }
  const load = follow(part, ['run', 'frame', 'other'], () => {
    const at = { ...shown };
    viewOf(at).then((view) => {
      if (at.frame !== shown.frame || at.run !== shown.run) return;
      tiles = view && view.tiles;
      ranks = tiles && tiles.costs ? tiles.costs.cycles.map((cycles, tile) => [cycles, tile]).sort((a, b) => b[0] - a[0]).map(([, tile]) => tile) : null;
      paint();
    });
    paintTables();
  });
  follow(part.appendChild(make('div')), ['tile', 'pixel', 'row', 'material', 'map', 'other'], () => paint()).always = true;
  load.always = false;
  // Without a pinned tile, a press pins the tile with most cycles.
  part.querySelector('.controls').append(make('button', { type: 'button', click: () => { if (ranks) show({ tile: ranks[0], pixel: null }); } }, 'Slowest tile'));
}

// Images alone, where tiles are not known.
function imageSection() {
  const part = section('frames', 'Frames'), viewer = tileViewer('Image', () => {}, null);
  part.append(viewer.element);
  follow(part, ['run', 'frame'], () => { const view = run().views[shown.frame]; if (view) viewer.draw({ view, address: imageAddress(), label: nameOf(shown), tiles: null, map: null, mask: null, tile: -1 }); });
}

function pinnedTile(tiles, ranks) {
  if (!tiles) return [];
  if (shown.tile < 0) return [make('p', { class: 'note' }, 'No tile is pinned.')];
  const tile = shown.tile, costs = tiles.costs, rows = frameOf().drawables || [], x = tile % tiles.grid[0], y = Math.floor(tile / tiles.grid[0]);
  const out = [make('h3', {}, `Tile ${x}, ${y}`)];
  if (costs) {
    const place = ranks.indexOf(tile) + 1, bound = costs.bound_by ? costs.bound_by[tile] : null;
    out.push(make('p', { class: 'verdict' }, `${number(costs.cycles[tile])} cycles (${quantity(milliseconds(costs.cycles[tile]), 'ms')}), ${place} of ${ranks.length} from the slowest; ${quantity(costs.energy_nj[tile], 'nJ')}. `,
      bound === null ? 'What bounds it: tessera time --split tiles.' : bound >= 0 ? make('b', {}, `Bound by ${boundWords(costs.bounds[bound])}: twice of it saves ${costs.estimated ? 'about ' : ''}${number(costs.saves[tile])} cycles (${percent(costs.saves[tile] / Math.max(1, costs.cycles[tile]))}).`, costs.estimated ? ' By what its path went to; tessera time --split tiles simulates it.' : '') : 'Nothing that is doubled alone ends it sooner.'));
    const bytes = Object.entries(costs.dram).map(([purpose, of]) => [purpose, of[tile]]).filter(([, value]) => value > 0).sort((a, b) => b[1] - a[1]), all = bytes.reduce((sum, [, value]) => sum + value, 0);
    out.push(make('div', { class: 'bytes', role: 'img', 'aria-label': bytes.map(([purpose, value]) => `${purposeName(purpose)} ${quantity(value, 'bytes')}`).join(', ') }, ...bytes.map(([purpose, value]) => make('i', { style: `flex:${value};background:${purposeColor(purpose)}`, title: `${purposeName(purpose)} ${quantity(value, 'bytes')}` }))),
      make('p', { class: 'keys' }, ...bytes.map(([purpose, value]) => make('span', {}, make('i', { style: `background:${purposeColor(purpose)}` }), `${purposeName(purpose)} ${quantity(value, 'bytes')}`)), make('span', {}, `all ${quantity(all, 'bytes')}`)));
  }
  const list = tiles.lists ? tiles.lists[tile] : [], drawn = [];
  for (let k = 0; k < list.length; k += 3) drawn.push({ row: list[k], sub_patches: list[k + 1], invocations: list[k + 2] });
  const unlisted = tiles.unlisted && tiles.unlisted[tile] ? `; ${tiles.unlisted[tile]} more drawables` : '';
  const counts = Object.entries(tiles.maps).map(([name, map]) => ({ name, value: map.values[tile] }));
  out.push(make('div', { class: 'beside' },
    drawn.length > 0 ? table([{ title: 'in its list', of: (row) => drawableName(rows[row.row]), wide: true }, { title: 'sub-patches', of: (row) => row.sub_patches }, { title: 'invocations', of: (row) => row.invocations, bar: true }], drawn, { label: `Drawables of the tile${unlisted}`, limit: 8 }) : null,
    table([{ title: 'count', of: (row) => words(row.name) }, { title: 'tile', of: (row) => row.value, zero: true }], counts, { label: 'Counts of the tile' })));
  return out;
}
function drawableName(row) {
  if (!row) return '(others)';
  if (!row.node && !row.material) return '(none: background, resolve)';
  return row.node && row.material && row.node !== row.material ? `${row.node} · ${row.material}` : row.node || row.material;
}

// The savings of the frame without a part, among the parts that `kind` of --without measured: a map from its name to the share of the
// cycles.
const partName = (row) => row.effect ?? (row.node === undefined ? row.material : row.node + '\n' + row.material);
function savings(frame, kind) {
  const cycles = Math.max(1, frame.timing ? frame.timing.cycles : 1);
  return new Map((((frame.without || {})[kind]) || []).map((row) => [partName(row), 1 - row.cycles / cycles]));
}

function costTables(rows, pressDrawable, pressMaterial) {
  if (rows.length === 0) return [];
  const frame = frameOf(), cycles = Math.max(1, frame.timing ? frame.timing.cycles : 1), other = otherFrame();
  const of = new Map((other && other.drawables ? other.drawables : []).map((row) => [row.node + '\n' + row.material, row]));
  // Measured savings come first: the surfaces that a part hides cost nothing while the part is there.
  const columns = (its, saved) => [
    ...(saved.size > 0 ? [{ title: 'saves when left out', of: (row) => saved.get(partName(row)) ?? -1, show: (value) => (value === -1 ? 'not measured' : signedPercent(value)), bar: true, help: 'Share of the frame’s cycles that it saves, rendered and timed without it' }] : []),
    { title: 'cycles', of: (row) => row.cycles, show: (value) => percent(value / cycles, 3), bar: true, help: 'Share of the frame’s cycles' },
    ...(its ? [{ title: 'B', of: (row) => (its(row) ? its(row).cycles : 0), show: (value) => percent(value / Math.max(1, other.timing ? other.timing.cycles : 1), 3) }] : []),
    { title: 'time', of: (row) => row.cycles, show: (value) => quantity(milliseconds(value), 'ms') },
    { title: 'energy', of: (row) => row.energy_nj, show: (value) => quantity(value, 'nJ') },
    { title: 'bytes', of: (row) => row.dram_bytes, show: (value) => quantity(value, 'bytes') },
    { title: 'invocations', of: (row) => row.invocations },
    { title: 'tests', of: (row) => row.tests },
    { title: 'lines', of: (row) => row.requested_lines, help: 'Lines asked of the L2 and of texture caches' }];
  const note = frame.without ? 'Ordered by the time that the frame saves without each: it was rendered and timed again, as surfaces behind a part cost nothing while the part hides them.'
    : 'Cycles are attributed to the drawable whose work took them. Leaving a drawable out saves another amount, as the frame then draws the surfaces behind it: tessera replay --without 10 measures that.';
  return [make('h3', {}, 'Drawables'), make('p', { class: 'note' }, note), table([{ title: 'drawable', of: (row) => drawableName(row), wide: true }, ...columns(other ? (row) => of.get(row.node + '\n' + row.material) : null, savings(frame, 'drawables'))], rows,
    { press: (row) => pressDrawable(rows.indexOf(row)), chosen: (row) => rows.indexOf(row) === shown.row, sort: 1, up: false, limit: 12, label: 'Drawables by cost' }),
  make('h3', {}, 'Materials'), table([{ title: 'material', of: (row) => row.material || '(none: background, resolve)', wide: true }, ...columns(null, savings(frame, 'materials'))], frame.materials,
    { press: (row) => pressMaterial('=' + row.material), chosen: (row) => shown.material === '=' + row.material, sort: 1, up: false, limit: 8, label: 'Materials by cost' })];
}
