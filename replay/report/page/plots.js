// Plots: Vega, from the distribution's modules, with colours that follow the page's.

// Loaded when the first plot is drawn.
let vegaLoaded = null;
function vega() {
  if (vegaLoaded) return vegaLoaded;
  const loaded = {};
  const load = (name) => {
    const real = name === 'vega-selections' ? 'vega-selection' : name;
    if (!loaded[real]) {
      const module = { exports: (loaded[real] = {}) };
      vegaModules[real](module.exports, load, module, undefined);
    }
    return loaded[real];
  };
  const { extend } = load('vega-util'), { transforms } = load('vega-dataflow');
  for (const name of ['vega-transforms', 'vega-view-transforms', 'vega-encode']) extend(transforms, load(name));
  const { expressionFunction } = load('vega-functions');
  // Numbers of axes and tooltips, as everywhere on the page.
  expressionFunction('tick', (value) => grouped(String(Number(Number(value).toPrecision(6)))));
  expressionFunction('human', (value, unit) => quantity(value, unit, 4));
  vegaLoaded = { View: load('vega-view').View, parse: load('vega-parser').parse };
  return vegaLoaded;
}

// Pixels of small text, which is larger on large screens.
function textSize() { return Math.round(12 * parseFloat(getComputedStyle(document.body).fontSize) / 14); }

function plotTheme() {
  const ink = style('--ink'), line = style('--line'), quiet = style('--quiet'), size = textSize();
  return {
    background: null,
    axis: { labelColor: quiet, titleColor: ink, domainColor: line, tickColor: line, gridColor: line, gridOpacity: 0.6, labelFontSize: size, titleFontSize: size, titleFontWeight: 'normal', labelLimit: 260, labelOverlap: true },
    legend: { labelColor: ink, titleColor: quiet, labelFontSize: size, titleFontSize: size, titleFontWeight: 'normal', labelLimit: 320, symbolStrokeWidth: 0 },
    title: { color: ink }, range: { category: kSeries },
  };
}

// Plots of more marks are drawn on a canvas, which is faster; the others are drawings, which stay sharp when they are enlarged.
const kManyMarks = 1000;
const drawn = [];

// Draws `spec()` into `holder` over its whole width; again when that changes, and when the page changes between dark and light. Screen
// readers read `says`; `press(datum)` is called for a press on a mark. A plot whose spec has `spot(row)`, the fields of a mark's place
// on the x and y scales, and `text(row)` is walked by arrow keys; Enter presses the mark.
function plot(holder, says, spec, press) {
  const place = make('div', { class: 'plot', role: 'img', 'aria-label': says, tabindex: 0 });
  holder.append(place);
  const entry = { draw: null }, keys = markKeys(place, () => view, press);
  let view = null, wide = 0;
  entry.draw = () => {
    if (view) view.finalize();
    view = null;
    const made = spec();
    place.replaceChildren();
    place.style.display = made ? '' : 'none';
    if (!made) return Promise.resolve();
    wide = place.clientWidth;
    keys.reset(made);
    const width = Math.max(280, Math.min((made.most || Infinity) * textSize() / 12, wide || 900));
    const { View, parse } = vega();
    view = new View(parse({ $schema: 'https://vega.github.io/schema/vega/v5.json', padding: 5, autosize: { type: 'fit', contains: 'padding' }, ...made, most: undefined, many: undefined, spot: undefined, text: undefined, height: made.height * textSize() / 12, width }, plotTheme()), { renderer: made.many ? 'canvas' : 'svg', container: place, hover: true });
    if (press) view.addEventListener('click', (event, item) => { if (item && item.datum) press(item.datum); });
    // Vega gives the place a role and a name of its own, and none to its drawing.
    place.setAttribute('role', made.spot ? 'application' : 'img');
    place.setAttribute('aria-label', made.spot ? `${says}. Arrow keys go from mark to mark${press ? ', Enter shows one' : ''}.` : says);
    return view.runAsync().then(() => place.querySelectorAll('svg, canvas').forEach((drawing) => drawing.setAttribute('aria-hidden', 'true')));
  };
  entry.signal = (name, value) => { if (view && view.getState().signals[name] !== undefined) view.signal(name, value).runAsync(); };
  entry.rows = () => (view ? view.data('rows') : []);
  entry.place = place;
  drawn.push(entry);
  entry.ready = entry.draw();
  whenResized(place, () => { if (view && Math.abs(place.clientWidth - wide) > 4) entry.draw(); });
  return entry;
}
darkness.addEventListener('change', () => drawn.forEach((entry) => entry.draw()));

// The keys of a plot: arrows go through its marks from left to right and from top to bottom, a ring shows the mark, and the hint says it.
function markKeys(place, viewOf, press) {
  const ring = make('i', { class: 'ring', 'aria-hidden': 'true', hidden: true });
  let spec = null, marks = null, at = -1;
  const middle = (name, value) => { const scale = viewOf().scale(name); return scale(value) + (scale.bandwidth ? scale.bandwidth() / 2 : 0); };
  const spotOf = (row) => { const [x, y] = spec.spot(row); return [middle('x', x), middle('y', y)]; };
  function go(to) {
    if (!marks) marks = viewOf().data('rows').map((row) => ({ row, spot: spotOf(row) })).filter(({ spot }) => spot.every(Number.isFinite)).sort((a, b) => a.spot[0] - b.spot[0] || a.spot[1] - b.spot[1]);
    if (marks.length === 0) return;
    at = Math.max(0, Math.min(marks.length - 1, to));
    const { row, spot } = marks[at], drawing = place.querySelector('svg, canvas').getBoundingClientRect(), box = place.getBoundingClientRect(), pad = viewOf().padding(), [left, top] = viewOf().origin().map((at, k) => at + (k === 0 ? pad.left : pad.top));
    ring.hidden = false;
    ring.style.left = `${drawing.left - box.left + place.scrollLeft + left + spot[0]}px`;
    ring.style.top = `${drawing.top - box.top + top + spot[1]}px`;
    place.append(ring);
    showHint([spec.text(row), `${at + 1} of ${marks.length}`], drawing.left + left + spot[0], drawing.top + top + spot[1]);
  }
  const steps = { ArrowRight: () => go(at + 1), ArrowDown: () => go(at + 1), ArrowLeft: () => go(at - 1), ArrowUp: () => go(at - 1), Home: () => go(0), End: () => go(Infinity), Enter: () => { if (press && at >= 0) press(marks[at].row); } };
  place.addEventListener('keydown', (event) => { if (spec && viewOf() && steps[event.key]) { event.preventDefault(); steps[event.key](); } });
  place.addEventListener('blur', () => { ring.hidden = true; showHint(null); });
  return { reset: (made) => { spec = made.spot ? made : null; marks = null; at = -1; ring.hidden = true; } };
}

// The legend of series and the height that a plot needs for it: beside the plot on a wide screen, below it on a narrow one. With more
// series than it could distinguish there is no legend: tooltips name the points.
const kMaxSeries = 24;
function legendOf(names, channel, title, height, more = {}) {
  if (!title || names.length > kMaxSeries) return { legends: [], height };
  const wide = document.documentElement.clientWidth > 900, letters = names.reduce((most, name) => Math.max(most, String(name).length), 0);
  const columns = wide ? 1 : Math.max(1, Math.floor((document.documentElement.clientWidth - 60) / (letters * 7 + 30))), rows = Math.ceil(names.length / columns);
  return { legends: [{ [channel]: 'color', orient: wide ? 'right' : 'bottom', columns, title, labelLimit: wide ? 320 : document.documentElement.clientWidth - 70, ...more }], height: wide ? Math.max(height, rows * 16 + 60) : height + Math.max(0, rows - 3) * 16 };
}
const namesOfSeries = (rows, titles) => titles.order || [...new Set(rows.map((row) => row.series))];

const tickLabels = { labels: { update: { text: { signal: 'tick(datum.value)' } } } };
// Rows with `field` in the unit step of the largest value, and the axis's title.
function scaledRows(rows, field, title, unit) {
  const [step, name] = axisScale(Math.max(0, ...rows.map((row) => Math.abs(row[field]))), unit);
  return { rows: rows.map((row) => ({ ...row, [`raw_${field}`]: row[field], [field]: row[field] / step })), title: title === unit ? name : name ? `${title}, ${name}` : title, step };
}

// Stacked bars: rows {at, part, value}; `at` is a number or a text. titles: {x, y, unit, part, colors: {part: color}, names(part)}. The
// signal `mark` puts a mark at a place.
function stackedBars(rows, titles) {
  if (rows.length === 0) return null;
  const sums = new Map();
  rows.forEach((row) => sums.set(row.at, (sums.get(row.at) || 0) + row.value));
  const [step, unit] = axisScale(Math.max(0, ...sums.values()), titles.unit), places = sums.size;
  const there = new Set(rows.map((row) => row.part)), parts = titles.colors ? Object.keys(titles.colors).filter((part) => there.has(part)) : [...there].sort();
  const names = titles.names || ((part) => part);
  const values = rows.map((row) => ({ ...row, raw: row.value, value: row.value / step, order: parts.indexOf(row.part), name: names(row.part) }));
  return {
    height: Math.max(titles.height || 240, document.documentElement.clientWidth > 900 ? parts.length * 15 + 40 : 0),
    most: places < 6 ? Math.max(420, 260 + places * 90) : undefined,
    spot: (row) => [row.at, (row.y0 + row.y1) / 2], text: (row) => `${titles.x} ${row.at}: ${row.name} ${quantity(row.raw, titles.unit || '', 4)}`,
    signals: [{ name: 'mark', value: titles.mark ?? null }],
    data: [{ name: 'rows', values, transform: [{ type: 'stack', groupby: ['at'], sort: { field: 'order' }, field: 'value' }] }],
    scales: [
      { name: 'x', type: 'band', domain: { data: 'rows', field: 'at' }, range: 'width', padding: places > 40 ? 0.05 : 0.15 },
      { name: 'y', type: 'linear', domain: titles.most ? [0, titles.most / step] : { data: 'rows', field: 'y1' }, range: 'height', nice: true, zero: true },
      { name: 'color', type: 'ordinal', domain: parts.map(names), range: titles.colors ? parts.map((part) => titles.colors[part]) : 'category' }],
    axes: [
      { orient: 'left', scale: 'y', grid: true, title: unit ? `${titles.y}, ${unit}` : titles.y, tickCount: 5, encode: tickLabels },
      { orient: 'bottom', scale: 'x', title: titles.x }],
    legends: [{ fill: 'color', orient: document.documentElement.clientWidth > 900 ? 'right' : 'bottom', columns: document.documentElement.clientWidth > 900 ? 1 : 2, title: titles.part }],
    marks: [{
      type: 'rect', from: { data: 'rows' }, encode: {
        update: {
          x: { scale: 'x', field: 'at' }, width: { scale: 'x', band: 1 }, y: { scale: 'y', field: 'y0' }, y2: { scale: 'y', field: 'y1' }, fill: { scale: 'color', field: 'name' }, fillOpacity: { value: 1 }, cursor: { value: titles.pressed ? 'pointer' : 'default' },
          tooltip: { signal: `'${titles.x} ' + datum.at + ': ' + datum.name + ' ' + human(datum.raw, '${titles.unit || ''}')` } },
        hover: { fillOpacity: { value: 0.7 } } } },
    { type: 'rect', interactive: false, encode: { update: {
      x: { scale: 'x', signal: 'mark' }, width: { scale: 'x', band: 1 }, y: { value: 0 }, y2: { signal: 'height' }, stroke: { value: style('--mark') }, strokeWidth: { value: 2 }, fill: null, opacity: { signal: 'mark === null ? 0 : 1' } } } }],
  };
}

// Lines with marks: rows {x, y, series, says}. Places along x are evenly spaced, one for each value that occurs, when they are no numbers
// or `even`.
function lines(rows, titles) {
  if (rows.length === 0) return null;
  const even = titles.even || rows.some((row) => typeof row.x !== 'number');
  const scaled = scaledRows(rows, 'y', titles.y, titles.unit || unitOfColumn(titles.y));
  return {
    ...legendOf(namesOfSeries(rows, titles), 'stroke', titles.series, 280, { symbolType: 'stroke', symbolStrokeWidth: 3 }), most: 1100, spot: (row) => [row.x, row.y], text: (row) => row.says,
    data: [{ name: 'rows', values: scaled.rows }],
    scales: [
      even ? { name: 'x', type: 'point', domain: { data: 'rows', field: 'x' }, range: 'width', padding: 0.5 } : { name: 'x', type: 'linear', domain: { data: 'rows', field: 'x' }, range: 'width', zero: false, nice: true },
      { name: 'y', type: titles.log ? 'log' : 'linear', domain: { data: 'rows', field: 'y' }, range: 'height', nice: true, zero: !titles.log },
      { name: 'color', type: 'ordinal', domain: titles.order || { data: 'rows', field: 'series' }, range: titles.order ? titles.order.map(seriesColor) : 'category' }],
    axes: [{ orient: 'left', scale: 'y', grid: true, title: scaled.title, tickCount: 6, encode: tickLabels }, { orient: 'bottom', scale: 'x', title: titles.x, tickMinStep: titles.step }],
    marks: [{ type: 'group', from: { facet: { name: 'of', data: 'rows', groupby: 'series' } }, marks: [
      { type: 'line', from: { data: 'of' }, encode: { update: { x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, stroke: { scale: 'color', field: 'series' }, strokeWidth: { value: 2 } } } },
      { type: 'symbol', from: { data: 'of' }, encode: { update: {
        x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, fill: { scale: 'color', field: 'series' }, size: { value: 60 }, tooltip: { field: 'says' } }, hover: { size: { value: 140 } } } }] }],
  };
}

// Points with the front, which no other point beats in both directions (less is better): rows {x, y, series, says, front}.
function scatter(rows, titles) {
  if (rows.length === 0) return null;
  const across = scaledRows(rows, 'x', titles.x, unitOfColumn(titles.x)), up = scaledRows(across.rows, 'y', titles.y, unitOfColumn(titles.y));
  // Lines of limits: {x} or {y}, in the columns' own numbers.
  const limits = (titles.limits || []).map((limit) => ({ ...limit, x: limit.x === undefined ? null : limit.x / across.step, y: limit.y === undefined ? null : limit.y / up.step }));
  const scale = (name, field, range) => ({ name, type: titles.log ? 'log' : 'linear', domain: { fields: [{ data: 'rows', field }, { data: 'limits', field }] }, range, nice: true, zero: false });
  return {
    ...legendOf(namesOfSeries(rows, titles), 'fill', titles.series, 380), most: 1100, many: rows.length > kManyMarks, spot: (row) => [row.x, row.y], text: (row) => row.says,
    data: [{ name: 'rows', values: up.rows }, { name: 'limits', values: limits }, { name: 'front', source: 'rows', transform: [{ type: 'filter', expr: 'datum.front' }, { type: 'collect', sort: { field: 'x' } }] }],
    scales: [scale('x', 'x', 'width'), scale('y', 'y', 'height'), { name: 'color', type: 'ordinal', domain: titles.order || { data: 'rows', field: 'series' }, range: titles.order ? titles.order.map(seriesColor) : 'category' }],
    axes: [{ orient: 'left', scale: 'y', grid: true, title: up.title, tickCount: 6, encode: tickLabels }, { orient: 'bottom', scale: 'x', grid: true, title: across.title, tickCount: 8, encode: tickLabels }],
    marks: [
      { type: 'rule', from: { data: 'limits' }, clip: true, encode: { update: { x: { signal: "datum.x === null ? 0 : scale('x', datum.x)" }, x2: { signal: "datum.x === null ? width : scale('x', datum.x)" }, y: { signal: "datum.y === null ? 0 : scale('y', datum.y)" }, y2: { signal: "datum.y === null ? height : scale('y', datum.y)" },
        stroke: { value: style('--ink') }, strokeWidth: { value: 1.5 }, strokeDash: { value: [6, 4] }, tooltip: { field: 'says' } } } },
      { type: 'line', from: { data: 'front' }, encode: { update: { x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, interpolate: { value: 'step-after' }, stroke: { value: style('--mark') }, strokeWidth: { value: 2 } } } },
      { type: 'symbol', from: { data: 'rows' }, encode: { update: {
        x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, fill: { scale: 'color', field: 'series' }, fillOpacity: { signal: 'datum.meets === false ? 0.25 : 1' }, size: { signal: 'datum.front ? 110 : 50' }, stroke: { signal: `datum.front ? '${style('--mark')}' : null` },
        strokeWidth: { value: 2 }, cursor: { value: 'pointer' }, tooltip: { field: 'says' } }, hover: { size: { value: 180 } } } }],
  };
}

// Horizontal bars: rows {at, value, says}.
function bars(rows, titles) {
  if (rows.length === 0) return null;
  const scaled = scaledRows(rows, 'value', titles.x, titles.unit);
  return {
    height: rows.length * 24 + 44, most: 900, spot: (row) => [row.value, row.at], text: (row) => `${row.at}: ${row.says}`,
    data: [{ name: 'rows', values: scaled.rows }],
    scales: [
      { name: 'y', type: 'band', domain: { data: 'rows', field: 'at' }, range: 'height', padding: 0.2 },
      { name: 'x', type: 'linear', domain: titles.domain || { data: 'rows', field: 'value' }, range: 'width', nice: true, zero: true }],
    axes: [{ orient: 'left', scale: 'y' }, { orient: 'bottom', scale: 'x', grid: true, title: scaled.title, tickCount: 6, encode: tickLabels }],
    marks: [{ type: 'rect', from: { data: 'rows' }, encode: {
      update: { y: { scale: 'y', field: 'at' }, height: { scale: 'y', band: 1 }, x: { scale: 'x', value: 0 }, x2: { scale: 'x', field: 'value' }, fill: { value: kSeries[0] }, fillOpacity: { value: 1 }, tooltip: { field: 'says' } },
      hover: { fillOpacity: { value: 0.7 } } } }],
  };
}
