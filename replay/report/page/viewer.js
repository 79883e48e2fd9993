// An image with data of its tiles over it: a map in colours, a mask, the pinned tile.

// Calls `choose(tile, pixel)` for a press or a key: the tile's number and [x, y] of the frame; -1 and null when it is left. Arrow
// keys move by a tile, with Shift by a pixel. The pointer alone shows `says(tile)`.
function tileViewer(label, choose, says) {
  const image = make('img', { alt: '', decoding: 'async' }), overlay = make('canvas', { 'aria-hidden': 'true' });
  const frame = make('div', { class: 'browser', tabindex: 0, role: 'application', 'aria-label': label }, image, overlay);
  let what = null;
  // Where a tile lies in the image, in its pixels; cut to it.
  const tileRect = (index) => {
    const { tiles: t, view } = what;
    const x = t.origin[0] - view.region[0] + (index % t.grid[0]) * t.tile[0], y = t.origin[1] - view.region[1] + Math.floor(index / t.grid[0]) * t.tile[1];
    const x0 = Math.max(0, x), y0 = Math.max(0, y);
    return [x0, y0, Math.min(view.size[0], x + t.tile[0]) - x0, Math.min(view.size[1], y + t.tile[1]) - y0];
  };
  function paint() {
    const { view, tiles, map, mask, shape, pixel, tile } = what, pen = overlay.getContext('2d');
    if (overlay.width !== view.size[0] || overlay.height !== view.size[1]) { overlay.width = view.size[0]; overlay.height = view.size[1]; }
    pen.clearRect(0, 0, overlay.width, overlay.height);
    if (!tiles) return;
    if (map) {
      pen.globalAlpha = map.opacity;
      map.values.forEach((value, index) => { const color = map.color(value); if (color) { pen.fillStyle = color; pen.fillRect(...tileRect(index)); } });
      pen.globalAlpha = 1;
    }
    if (mask) {
      pen.fillStyle = 'rgba(0, 0, 0, 0.72)';
      for (let index = 0; index < tiles.grid[0] * tiles.grid[1]; ++index) if (!mask.has(index)) pen.fillRect(...tileRect(index));
    }
    if (shape) pen.drawImage(shape.image, shape.region[0] - view.region[0], shape.region[1] - view.region[1]);
    if (tile >= 0) outline(pen, tileRect(tile));
    if (pixel) outline(pen, [pixel[0] - view.region[0], pixel[1] - view.region[1], 1, 1]);
  }
  function outline(pen, [x, y, w, h]) {
    const thick = Math.max(2, overlay.width / 500);
    pen.lineWidth = thick;
    pen.strokeStyle = '#000000';
    pen.setLineDash([]);
    pen.strokeRect(x - thick / 2, y - thick / 2, w + thick, h + thick);
    pen.setLineDash([2 * thick, 2 * thick]);
    pen.strokeStyle = '#ffffff';
    pen.strokeRect(x - thick / 2, y - thick / 2, w + thick, h + thick);
    pen.setLineDash([]);
  }
  // [x, y] of the frame under the pointer; the tile that holds it, or -1.
  const pixelAt = (event) => {
    const { view } = what, box = overlay.getBoundingClientRect();
    return [Math.floor((event.clientX - box.left) / box.width * view.size[0]) + view.region[0], Math.floor((event.clientY - box.top) / box.height * view.size[1]) + view.region[1]];
  };
  const tileOf = ([px, py]) => {
    const t = what.tiles, x = Math.floor((px - t.origin[0]) / t.tile[0]), y = Math.floor((py - t.origin[1]) / t.tile[1]);
    return x < 0 || y < 0 || x >= t.grid[0] || y >= t.grid[1] ? -1 : y * t.grid[0] + x;
  };
  const tileAt = (event) => (what && what.tiles ? tileOf(pixelAt(event)) : -1);
  frame.addEventListener('pointermove', (event) => { const tile = tileAt(event); showHint(tile >= 0 && says ? says(tile) : null, event.clientX, event.clientY); });
  frame.addEventListener('pointerleave', () => showHint(null));
  frame.addEventListener('click', (event) => {
    const tile = tileAt(event);
    if (tile < 0) return;
    const pixel = pixelAt(event), again = what.pixel ? what.pixel.join() === pixel.join() : tile === what.tile && what.pixel === undefined;
    if (again) choose(-1, null); else choose(tile, pixel);
  });
  const within = (value, low, high) => Math.max(low, Math.min(high, value));
  function move(dx, dy) {
    if (!what || !what.tiles) return;
    const t = what.tiles, at = what.tile;
    const x = at < 0 ? 0 : within((at % t.grid[0]) + dx, 0, t.grid[0] - 1), y = at < 0 ? 0 : within(Math.floor(at / t.grid[0]) + dy, 0, t.grid[1] - 1), tile = y * t.grid[0] + x, [left, top, w, h] = tileRect(tile);
    choose(tile, [what.view.region[0] + left + (w >> 1), what.view.region[1] + top + (h >> 1)]);
  }
  function movePixel(dx, dy) {
    if (!what || !what.tiles) return;
    if (!what.pixel) { move(0, 0); return; }
    const { region, size } = what.view, pixel = [within(what.pixel[0] + dx, region[0], region[0] + size[0] - 1), within(what.pixel[1] + dy, region[1], region[1] + size[1] - 1)];
    choose(tileOf(pixel), pixel);
  }
  const kSteps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  frame.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') choose(-1, null);
    else if (kSteps[event.key]) (event.shiftKey ? movePixel : move)(...kSteps[event.key]);
    else return;
    event.preventDefault();
  });
  // {view: {image, size, region, label}, tiles, map: {values, color(value), opacity}, mask: Set of tiles, shape: {region, image} that lies on it, tile, pixel: [x, y] of the frame}
  return {
    element: frame,
    draw: (next) => {
      if (!what || what.address !== next.address) image.src = next.address;
      image.alt = next.label || '';
      image.style.aspectRatio = `${next.view.size[0]} / ${next.view.size[1]}`;
      what = next;
      paint();
    },
  };
}

// The scale of a map, the same for all frames: a ramp with its ends, or the map's own words.
function mapLegend() {
  const ramp = make('canvas', { width: 256, height: 1, 'aria-hidden': 'true' }), low = make('span'), high = make('span'), unit = make('span', { class: 'means' });
  const pen = ramp.getContext('2d');
  for (let i = 0; i < 256; ++i) { pen.fillStyle = rampColor(i / 255); pen.fillRect(i, 0, 1, 1); }
  const scale = make('div', { class: 'legend' }, low, ramp, high), kinds = make('p', { class: 'keys' }), all = make('div', {}, scale, kinds, unit);
  return {
    element: all,
    draw: (map) => {
      all.style.visibility = map ? 'visible' : 'hidden';
      if (!map) return;
      scale.hidden = Boolean(map.kinds);
      kinds.hidden = !map.kinds;
      if (map.kinds) kinds.replaceChildren(...map.kinds.map(([text, color]) => make('span', {}, make('i', { style: `background:${color}` }), text)));
      low.textContent = map.show(map.range[0]);
      high.textContent = map.show(map.range[1]);
      unit.textContent = map.says;
    },
  };
}

// Colours of numbers between the ends of a scale.
function rampOf(range, logarithmic) {
  const [least, most] = range;
  return logarithmic ? (value) => rampColor(Math.log1p(value - least) / Math.max(1e-9, Math.log1p(most - least))) : (value) => rampColor((value - least) / Math.max(1e-9, most - least));
}
