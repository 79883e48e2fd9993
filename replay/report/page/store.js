// The page's state about a replay, and the sections that follow it. Sections draw themselves again when a member on which they depend
// changes: at once if they are visible, else when they come into view.

const shown = { run: 0, frame: 0, other: null, map: '', tile: -1, pixel: null, row: -1, material: '', target: 60 };
const sections = [];

// `paint()` draws the present state into the section; `on`: the members of `shown` on which it depends ('other' is the compared run and
// frame: {run, frame}).
function follow(part, on, paint) {
  const entry = { part, on, paint, stale: true, seen: false };
  sections.push(entry);
  sight.observe(part);
  return entry;
}
const sight = new IntersectionObserver((changes) => changes.forEach((change) => {
  const entry = sections.find((of) => of.part === change.target);
  if (!entry) return;
  entry.seen = change.isIntersecting;
  if (entry.seen) repaint(entry);
}), { rootMargin: '200px' });

function repaint(entry) {
  if (!entry.stale) return;
  entry.stale = false;
  entry.paint();
}
// Repaints every section, visible or not: for print, for readers of the whole document, and when the page is complete.
function repaintAll() { sections.forEach(repaint); }
window.addEventListener('beforeprint', repaintAll);

function show(change) {
  const changed = Object.keys(change).filter((key) => JSON.stringify(shown[key]) !== JSON.stringify(change[key]));
  if (changed.length === 0) return;
  Object.assign(shown, change);
  for (const entry of sections) {
    if (!entry.on.some((key) => changed.includes(key))) continue;
    entry.stale = true;
    if (entry.seen || entry.always) repaint(entry);
  }
}

const runs = () => data.runs;
const run = (at = shown) => data.runs[at.run];
const framesOf = (at = shown) => run(at).stats.frames;
const frameOf = (at = shown) => framesOf(at)[at.frame];
const clockOf = (at = shown) => run(at).stats.gpu.clock.mhz;
const milliseconds = (cycles, at = shown) => cycles / clockOf(at) * 1e-3;
const otherFrame = () => (shown.other ? frameOf(shown.other) : null);
const nameOf = (at) => `${data.runs.length > 1 ? run(at).label + ', ' : ''}frame ${frameOf(at).frame}`;

// ---- Tiles and images, unpacked on demand

async function viewOf(at = shown) {
  const place = run(at).views[at.frame];
  return place ? { place, tiles: place.tiles ? await (Array.isArray(place.tiles) ? documentOf(place.tiles) : place.tiles) : null } : null;
}
// An address of its own, or the element that holds the PNG or WebP in base64.
function addressOf(place) {
  if (!place.image) return '';
  const element = document.getElementById(place.image);
  if (!element) return place.image.startsWith('image-') ? '' : place.image;
  return `data:image/${element.textContent.startsWith('iVBOR') ? 'png' : 'webp'};base64,` + element.textContent;
}
function imageAddress(at = shown) {
  const place = run(at).views[at.frame];
  return place ? addressOf(place) : '';
}

// Extends maps, their meanings and scales by later views.
function learnMaps(views) {
  data.maps = data.maps || {};
  data.scales = data.scales || {};
  const note = (name, values) => {
    const [least, most] = data.scales[name] || [Infinity, 0];
    data.scales[name] = [values.reduce((a, b) => Math.min(a, b), least), values.reduce((a, b) => Math.max(a, b), most)];
  };
  for (const { tiles } of views) {
    if (!tiles || Array.isArray(tiles)) continue;
    for (const [name, map] of Object.entries(tiles.maps)) {
      data.maps[name] = map;
      note(name, map.values);
    }
    for (const [name, values] of Object.entries(tiles.costs || {})) if (Array.isArray(values) && name !== 'bounds') note('cost.' + name, values);
    for (const [purpose, values] of Object.entries((tiles.costs || {}).dram || {})) note('dram.' + purpose, values);
  }
}

// Takes new statistics of the same capture, in the form of stats.json, from the program that serves this page: all sections follow.
// `views`: as data.runs[].views, but with addresses as images and objects in the form of tiles_NNNN.json as tiles.
function update(stats, views) {
  const of = data.runs[shown.run];
  of.stats = stats;
  if (views) {
    of.views = views;
    learnMaps(views);
  }
  shown.frame = Math.min(shown.frame, stats.frames.length - 1);
  sections.forEach((entry) => { entry.stale = true; if (entry.reset) entry.reset(); });
  sections.filter((entry) => entry.seen || entry.always).forEach(repaint);
}
