// Pixels: the surfaces of each pixel, from the runs of tiles_NNNN.json (replay/pixel_history.h), unpacked on demand.

// Finds the value at a place in runs of values.
function runFinder({ lengths, values }) {
  const ends = new Float64Array(lengths.length);
  let end = 0;
  lengths.forEach((length, k) => { ends[k] = end += length; });
  return (place) => {
    let low = 0, high = ends.length - 1;
    while (low < high) { const middle = (low + high) >> 1; if (ends[middle] > place) high = middle; else low = middle + 1; }
    return values[low];
  };
}

// {region, at(x, y), within(rows)} of a frame's tiles, or null where they hold no pixels. Pages with many frames know
// drawables alone, maybe of every second pixel and row: `whole` is false.
const unpackedPixels = new WeakMap();
function pixelsOf(tiles) {
  if (!tiles || !tiles.pixels) return null;
  if (!unpackedPixels.has(tiles)) unpackedPixels.set(tiles, unpackPixels(tiles.pixels));
  return unpackedPixels.get(tiles);
}
function unpackPixels(pixels) {
  const { region: [x0, y0, width, height], sub_patches: table, step = 1 } = pixels, whole = Boolean(table), columns = Math.ceil(width / step), rows = Math.ceil(height / step);
  const runs = whole ? pixels.seen : pixels.drawables, rowOf = whole ? (value) => (value > 0 ? table.row[value - 1] : -1) : (value) => value - 1;
  const finders = {};
  const find = (name, place) => (finders[name] = finders[name] || runFinder(pixels[name]))(place);
  return {
    region: pixels.region,
    whole,
    has: (x, y) => x >= x0 && y >= y0 && x < x0 + width && y < y0 + height,
    at: (x, y) => {
      const place = Math.floor((y - y0) / step) * columns + Math.floor((x - x0) / step);
      if (!whole) return { row: find('drawables', place) - 1 };
      const seen = find('seen', place);
      return { row: rowOf(seen), patch: seen > 0 ? table.patch[seen - 1] : -1, cells: seen > 0 ? table.cells.slice(4 * seen - 4, 4 * seen) : null,
        samples: find('samples', place), invocations: find('invocations', place), layers: find('layers', place), nearest: find('nearest_layer', place) - 1 };
    },
    // One byte a pixel: 1 where the first sample sees a drawable of these rows.
    within: (chosen) => {
      const known = new Uint8Array(columns * rows);
      let place = 0;
      runs.values.forEach((value, k) => { const next = place + runs.lengths[k]; if (chosen.includes(rowOf(value))) known.fill(1, place, next); place = next; });
      if (step === 1) return known;
      const out = new Uint8Array(width * height);
      for (let y = 0, at = 0; y < height; ++y) for (let x = 0; x < width; ++x, ++at) out[at] = known[Math.floor(y / step) * columns + Math.floor(x / step)];
      return out;
    },
  };
}

// An image of the pixels that are `within`: all others dark, or the outline alone.
function pixelShape({ region: [, , width, height] }, within, dark) {
  const canvas = make('canvas', { width, height }), pen = canvas.getContext('2d'), image = pen.createImageData(width, height), out = new Uint32Array(image.data.buffer);
  const kDark = 0x80000000, kLight = 0xffffffff;  // bytes are alpha, blue, green, red
  for (let y = 0, at = 0; y < height; ++y)
    for (let x = 0; x < width; ++x, ++at) {
      if (dark) { if (!within[at]) out[at] = kDark; continue; }
      if (!within[at]) continue;
      if (x === 0 || y === 0 || x === width - 1 || y === height - 1 || !within[at - 1] || !within[at + 1] || !within[at - width] || !within[at + width]) out[at] = kLight;
    }
  pen.putImageData(image, 0, 0);
  return canvas;
}

// Texts about the pinned pixel.
function pinnedPixel(tiles) {
  const pixels = pixelsOf(tiles);
  if (!pixels || !shown.pixel || !pixels.has(...shown.pixel)) return [];
  const [x, y] = shown.pixel, of = pixels.at(x, y), rows = frameOf().drawables || [], per = run().stats.settings['sampling.samples_per_pixel'];
  const some = (count, word) => `${number(count)} ${word}${count === 1 ? '' : 's'}`;
  const out = [make('h3', {}, `Pixel ${x}, ${y}`)];
  if (of.row < 0) { out.push(make('p', {}, 'Its first sample sees nothing opaque.')); }
  else {
    const place = of.patch >= 0 ? `, base patch ${number(of.patch)}${of.cells[2] > of.cells[0] ? `, sub-patch of its cells ${of.cells[0]}–${of.cells[2]} by ${of.cells[1]}–${of.cells[3]}` : ''}` : '';
    out.push(make('p', {}, make('strong', {}, drawableName(rows[of.row])), `${place}. `, pixels.whole ? `${of.samples}${per ? ` of ${per}` : ''} of its samples see that patch.` : 'Base patches are in tiles_NNNN.json; a page of fewer frames shows them.'));
  }
  if (pixels.whole) out.push(make('p', {}, [pixelCost(tiles, of, some), of.layers > 0 ? ` ${some(of.layers, 'blended surface')} in front of the first sample${of.nearest >= 0 ? `, the nearest of ${drawableName(rows[of.nearest])}` : ''}.` : ' No blended surface lies in front of it.'].join('')));
  if (of.row >= 0) out.push(make('button', { type: 'button', click: () => show({ row: shown.row === of.row ? -1 : of.row, material: '' }) }, shown.row === of.row ? 'Show all' : 'Show this drawable alone'));
  return out;
}
// Its share of the tile's cycles, by invocations.
function pixelCost(tiles, of, some) {
  const text = some(of.invocations, 'invocation') + ' of the pixel shader', all = tiles.maps.pixel_shader_invocations, tile = shown.tile;
  if (!tiles.costs || !all || tile < 0 || !(all.values[tile] > 0)) return `${text}.`;
  return `${text}: by its share of the tile’s ${number(all.values[tile])}, about ${number(Math.round(tiles.costs.cycles[tile] * of.invocations / all.values[tile]))} of the tile’s ${number(tiles.costs.cycles[tile])} cycles.`;
}
