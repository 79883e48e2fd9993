// An image with what belongs to its tiles over it: a map in colours, a mask, the tile that is pinned.

// Calls `choose(tile)` for a press or a key; -1 when the tile is left. The pointer alone shows `says(tile)`.
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
    const { view, tiles, map, mask, tile } = what, pen = overlay.getContext('2d');
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
    if (tile >= 0) outline(pen, tileRect(tile));
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
  const tileAt = (event) => {
    if (!what || !what.tiles) return -1;
    const { tiles: t, view } = what, box = overlay.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width * view.size[0] + view.region[0] - t.origin[0]) / t.tile[0]);
    const y = Math.floor(((event.clientY - box.top) / box.height * view.size[1] + view.region[1] - t.origin[1]) / t.tile[1]);
    return x < 0 || y < 0 || x >= t.grid[0] || y >= t.grid[1] ? -1 : y * t.grid[0] + x;
  };
  frame.addEventListener('pointermove', (event) => { const tile = tileAt(event); showHint(tile >= 0 && says ? says(tile) : null, event.clientX, event.clientY); });
  frame.addEventListener('pointerleave', () => showHint(null));
  frame.addEventListener('click', (event) => { const tile = tileAt(event); if (tile >= 0) choose(tile === what.tile ? -1 : tile); });
  function move(dx, dy) {
    if (!what || !what.tiles) return;
    const t = what.tiles, at = what.tile;
    const x = at < 0 ? 0 : Math.max(0, Math.min(t.grid[0] - 1, (at % t.grid[0]) + dx)), y = at < 0 ? 0 : Math.max(0, Math.min(t.grid[1] - 1, Math.floor(at / t.grid[0]) + dy));
    choose(y * t.grid[0] + x);
  }
  const keys = { ArrowLeft: () => move(-1, 0), ArrowRight: () => move(1, 0), ArrowUp: () => move(0, -1), ArrowDown: () => move(0, 1), Escape: () => choose(-1) };
  frame.addEventListener('keydown', (event) => {
    if (!keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
  // {view: {image, size, region, label}, tiles, map: {values, color(value), opacity}, mask: Set of tiles, tile}
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

// The scale of a map, which stays over frames: a ramp with its ends, or the words of what is in it.
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
