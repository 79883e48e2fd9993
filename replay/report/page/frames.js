// The browser of images: one of many views, with a map of its tiles over it.

// Viridis (van der Walt and Smith 2015) at nine places: brighter is more, in every kind of colour vision.
const kRamp = [[68, 1, 84], [71, 45, 123], [59, 82, 139], [44, 114, 142], [33, 145, 140], [40, 174, 128], [94, 201, 98], [173, 220, 48], [253, 231, 37]];
function rampColor(t) {
  const at = Math.max(0, Math.min(1, t)) * (kRamp.length - 1), k = Math.min(kRamp.length - 2, Math.floor(at)), f = at - k;
  return `rgb(${kRamp[k].map((low, c) => Math.round(low + (kRamp[k + 1][c] - low) * f)).join(',')})`;
}

// data.views: [{label, image, size: [w, h], region: [x, y], tiles}]; `tiles` as in tiles_NNNN.json. Calls changed(view) for what is shown.
function frameBrowser(part, changed) {
  const views = data.views;
  const state = { view: 0, map: '', opacity: 0.7, log: false, tile: -1 };
  const image = make('img', { alt: '' }), overlay = make('canvas', { 'aria-hidden': 'true' });
  const frame = make('div', { class: 'browser', tabindex: 0, role: 'application', 'aria-label': 'Image with a map of its tiles. Arrow keys choose a tile, Page Up and Page Down the image.' }, image, overlay);
  const says = make('p', { class: 'tile', 'aria-live': 'polite' });
  const ramp = make('canvas', { width: 256, height: 1, 'aria-hidden': 'true' }), low = make('span'), high = make('span'), unit = make('span');
  const legend = make('div', { class: 'legend' }, low, ramp, high, unit);
  const pen = ramp.getContext('2d');
  for (let i = 0; i < 256; ++i) { pen.fillStyle = rampColor(i / 255); pen.fillRect(i, 0, 1, 1); }

  const names = [...new Set(views.flatMap((view) => (view.tiles ? Object.keys(view.tiles.maps) : [])))];
  const maps = chooser('Map', [['', 'none'], ...names.map((name) => [name, name.replaceAll('_', ' ')])], '', (value) => { state.map = value; show(); });
  const images = chooser('Image', views.map((view, index) => [index, view.label]), 0, (value) => { state.view = Number(value); show(); });
  const slider = make('input', { type: 'range', min: 0, max: views.length - 1, value: 0, 'aria-label': 'Image', input: () => { state.view = Number(slider.value); show(); } });
  const opacity = make('input', { type: 'range', min: 0, max: 1, step: 0.05, value: state.opacity, input: () => { state.opacity = Number(opacity.value); show(); } });
  const log = make('input', { type: 'checkbox', change: () => { state.log = log.checked; show(); } });

  const tiles = () => views[state.view].tiles;
  const values = () => (tiles() && state.map && tiles().maps[state.map] ? tiles().maps[state.map].values : null);
  // Where a tile lies in the image, in its pixels; cut to it.
  const tileRect = (index) => {
    const t = tiles(), view = views[state.view];
    const x = t.origin[0] - view.region[0] + (index % t.grid[0]) * t.tile[0], y = t.origin[1] - view.region[1] + Math.floor(index / t.grid[0]) * t.tile[1];
    const x0 = Math.max(0, x), y0 = Math.max(0, y);
    return [x0, y0, Math.min(view.size[0], x + t.tile[0]) - x0, Math.min(view.size[1], y + t.tile[1]) - y0];
  };

  function paintMap() {
    const view = views[state.view], list = values(), canvas = overlay.getContext('2d');
    overlay.width = view.size[0];
    overlay.height = view.size[1];
    legend.style.visibility = list ? 'visible' : 'hidden';
    if (list) {
      const least = list.reduce((a, b) => Math.min(a, b), Infinity), most = list.reduce((a, b) => Math.max(a, b), 0);
      const of = state.log ? (v) => Math.log1p(v - least) / Math.max(1e-9, Math.log1p(most - least)) : (v) => (v - least) / Math.max(1e-9, most - least);
      canvas.globalAlpha = state.opacity;
      list.forEach((value, index) => { canvas.fillStyle = rampColor(of(value)); canvas.fillRect(...tileRect(index)); });
      canvas.globalAlpha = 1;
      low.textContent = number(least);
      high.textContent = number(most);
      unit.textContent = `${tiles().maps[state.map].unit} per tile${state.log ? ', logarithmic' : ''}. ${tiles().maps[state.map].meaning}`;
    }
    if (tiles() && state.tile >= 0) {
      const [x, y, w, h] = tileRect(state.tile);
      canvas.lineWidth = Math.max(2, view.size[0] / 400);
      canvas.strokeStyle = '#000000';
      canvas.strokeRect(x, y, w, h);
      canvas.setLineDash([4, 4]);
      canvas.strokeStyle = '#ffffff';
      canvas.strokeRect(x, y, w, h);
    }
  }
  function sayTile() {
    const t = tiles();
    if (!t || state.tile < 0) { says.textContent = t ? 'Point at a tile, or focus the image and use the arrow keys.' : ''; return; }
    const entries = Object.entries(t.maps).map(([name, map]) => `${name.replaceAll('_', ' ')} ${number(map.values[state.tile])}`);
    says.textContent = `Tile ${state.tile % t.grid[0]}, ${Math.floor(state.tile / t.grid[0])}: ${entries.join(' · ')}`;
  }
  function show() {
    const view = views[state.view];
    image.src = view.image;
    image.alt = view.label;
    slider.value = state.view;
    images.select.value = state.view;
    maps.select.value = state.map;
    if (!tiles() || state.tile >= tiles().grid[0] * tiles().grid[1]) state.tile = -1;
    paintMap();
    sayTile();
    changed(view, state);
  }
  function move(dx, dy) {
    const t = tiles();
    if (!t) return;
    const x = state.tile < 0 ? 0 : Math.max(0, Math.min(t.grid[0] - 1, (state.tile % t.grid[0]) + dx)), y = state.tile < 0 ? 0 : Math.max(0, Math.min(t.grid[1] - 1, Math.floor(state.tile / t.grid[0]) + dy));
    state.tile = y * t.grid[0] + x;
    paintMap();
    sayTile();
  }
  const turn = (by) => { state.view = Math.max(0, Math.min(views.length - 1, state.view + by)); show(); };
  const keys = { ArrowLeft: () => move(-1, 0), ArrowRight: () => move(1, 0), ArrowUp: () => move(0, -1), ArrowDown: () => move(0, 1), PageUp: () => turn(-1), PageDown: () => turn(1) };
  frame.addEventListener('keydown', (event) => {
    if (!keys[event.key]) return;
    keys[event.key]();
    event.preventDefault();
  });
  frame.addEventListener('mousemove', (event) => {
    const t = tiles(), box = overlay.getBoundingClientRect(), view = views[state.view];
    if (!t) return;
    const x = Math.floor(((event.clientX - box.left) / box.width * view.size[0] + view.region[0] - t.origin[0]) / t.tile[0]);
    const y = Math.floor(((event.clientY - box.top) / box.height * view.size[1] + view.region[1] - t.origin[1]) / t.tile[1]);
    if (x < 0 || y < 0 || x >= t.grid[0] || y >= t.grid[1] || y * t.grid[0] + x === state.tile) return;
    state.tile = y * t.grid[0] + x;
    paintMap();
    sayTile();
  });

  part.append(make('div', { class: 'controls' }, ...(views.length > 1 ? [images.label, slider] : []), maps.label, make('label', {}, 'Opacity', opacity), make('label', {}, log, 'logarithmic')), frame, legend, says);
  if (data.left_out > 0) part.append(make('p', { class: 'note' }, `${data.left_out} further images are left out, to keep this file small.`));
  state.map = wantedOf('map', ['', ...names], names.includes('queue_bytes_read') ? 'queue_bytes_read' : '');
  if (wanted.has('picture')) state.view = Math.max(0, Math.min(views.length - 1, Number(wanted.get('picture')) || 0));
  show();
  return { choose: (index) => { state.view = index; show(); } };
}
