// The images of a sweep: one of many views, with a map of its tiles over it.

function sweepImages() {
  const views = data.views, part = section('frames', 'Images');
  const state = { view: 0, map: '', opacity: 0.7, log: false, tile: -1 };
  if (wanted.has('picture')) state.view = Math.max(0, Math.min(views.length - 1, Number(wanted.get('picture')) || 0));
  const names = Object.keys(data.scales).filter((name) => data.scales[name][1] > 0);
  state.map = wantedOf('map', ['', ...names], names.includes('queue_bytes_read') ? 'queue_bytes_read' : '');
  let tiles = null;
  const nameOfTile = (tile) => `Tile ${tile % tiles.grid[0]}, ${Math.floor(tile / tiles.grid[0])}`;
  const viewer = tileViewer('Image with a map of its tiles. Arrow keys choose a tile.', (tile) => { state.tile = tile; paint(); }, (tile) => (tiles && mapValues(tiles, state.map) ? [nameOfTile(tile), `${mapTitle(state.map)}: ${number(mapValues(tiles, state.map)[tile])}`] : null));
  const legend = mapLegend(), says = make('p', { class: 'tile', 'aria-live': 'polite' });
  const images = chooser('Image', views.map((view, index) => [index, view.label]), state.view, (value) => { state.view = Number(value); load(); });
  const slider = make('input', { type: 'range', min: 0, max: views.length - 1, value: state.view, 'aria-label': 'Image', input: () => { state.view = Number(slider.value); load(); } });
  const maps = chooser('Map', [['', 'none'], ...names.map((name) => [name, mapTitle(name)])], state.map, (value) => { state.map = value; paint(); });
  const opacity = make('input', { type: 'range', min: 0, max: 1, step: 0.05, value: state.opacity, input: () => { state.opacity = Number(opacity.value); paint(); } });
  const log = make('input', { type: 'checkbox', change: () => { state.log = log.checked; paint(); } });
  part.append(make('div', { class: 'controls' }, images.label, slider, maps.label, make('label', {}, 'Opacity', opacity), make('label', {}, log, 'logarithmic')), viewer.element, legend.element, says);
  for (const note of [data.image_note, data.left_out > 0 ? `${data.left_out} further images are left out, to keep this file small.` : '']) if (note) part.append(make('p', { class: 'note' }, note));
  function paint() {
    const view = views[state.view], map = tiles ? mapDrawing(tiles, state.map, data.scales[state.map], state.opacity, state.log) : null;
    if (!tiles || state.tile >= tiles.grid[0] * tiles.grid[1]) state.tile = -1;
    viewer.draw({ view, address: addressOf(view), label: view.label, tiles, map, mask: null, tile: state.tile });
    legend.draw(map);
    says.textContent = state.tile >= 0 ? `${nameOfTile(state.tile)}: ${Object.entries(tiles.maps).filter(([, of]) => of.values[state.tile] > 0).map(([name, of]) => `${words(name)} ${number(of.values[state.tile])}`).join(' · ')}` : '';
  }
  function load() {
    const view = views[state.view];
    slider.value = state.view;
    images.select.value = state.view;
    if (!view.tiles) { tiles = null; paint(); return; }
    documentOf(view.tiles).then((document) => { if (views[state.view] === view) { tiles = document; paint(); } });
  }
  load();
  return { choose: (index) => { state.view = index; load(); } };
}
