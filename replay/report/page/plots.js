// Plots: Vega, from the distribution's modules, with colours that follow the page's.

const vega = (() => {
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
  return { View: load('vega-view').View, parse: load('vega-parser').parse };
})();

// Okabe and Ito's colours and darker and lighter ones between: told apart by colour-blind readers too.
const kColors = ['#0072b2', '#e69f00', '#009e73', '#d55e00', '#56b4e9', '#cc79a7', '#8c6d1f', '#7a7f87', '#004d7a', '#f0c36d'];

function plotTheme() {
  const ink = style('--ink'), line = style('--line'), quiet = style('--quiet');
  return {
    background: null,
    axis: { labelColor: quiet, titleColor: ink, domainColor: line, tickColor: line, gridColor: line, gridOpacity: 0.6, labelFontSize: 12, titleFontSize: 12, titleFontWeight: 'normal', labelLimit: 260 },
    legend: { labelColor: ink, titleColor: quiet, labelFontSize: 12, titleFontWeight: 'normal', labelLimit: 320 },
    title: { color: ink }, range: { category: kColors },
  };
}

const drawn = [];

// Draws `spec()` into `holder`, and again when the page changes between dark and light. `says` is what a reader who cannot see it gets.
function plot(holder, says, spec, press) {
  const place = make('div', { class: 'plot', role: 'img', 'aria-label': says, tabindex: 0 });
  holder.append(place);
  const entry = { draw: null };
  let view = null;
  entry.draw = () => {
    if (view) view.finalize();
    const made = spec();
    place.replaceChildren();
    place.style.display = made ? '' : 'none';
    if (!made) { view = null; return Promise.resolve(); }
    view = new vega.View(vega.parse({ $schema: 'https://vega.github.io/schema/vega/v5.json', padding: 5, autosize: 'pad', ...made }, plotTheme()), { renderer: 'svg', container: place, hover: true });
    if (press) view.addEventListener('click', (event, item) => { if (item && item.datum) press(item.datum); });
    return view.runAsync();
  };
  entry.rows = () => (view ? view.data('rows') : []);
  entry.place = place;
  drawn.push(entry);
  entry.ready = entry.draw();
  return entry;
}
window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => drawn.forEach((entry) => entry.draw()));

const kWidth = Math.min(900, Math.max(320, document.documentElement.clientWidth - 420));

// Stacked bars: rows {at, part, value}; `at` may be a text or a number.
function stackedBars(rows, titles) {
  if (rows.length === 0) return null;
  const places = new Set(rows.map((row) => row.at)).size;
  const width = Math.max(Math.min(kWidth, places * 90), places * 14, 160);
  return {
    width, height: 260,
    data: [{ name: 'rows', values: rows, transform: [{ type: 'stack', groupby: ['at'], sort: { field: 'part' }, field: 'value' }] }],
    scales: [
      { name: 'x', type: 'band', domain: { data: 'rows', field: 'at' }, range: 'width', padding: 0.15 },
      { name: 'y', type: 'linear', domain: { data: 'rows', field: 'y1' }, range: 'height', nice: true, zero: true },
      { name: 'color', type: 'ordinal', domain: { data: 'rows', field: 'part', sort: true }, range: 'category' }],
    axes: [
      { orient: 'left', scale: 'y', grid: true, title: titles.y, format: titles.format || '~s' },
      { orient: 'bottom', scale: 'x', title: titles.x, labelOverlap: true }],
    legends: [{ fill: 'color', orient: places > 24 ? 'bottom' : 'right', columns: places > 24 ? 3 : 1, title: titles.part }],
    marks: [{
      type: 'rect', from: { data: 'rows' }, encode: {
        update: {
          x: { scale: 'x', field: 'at' }, width: { scale: 'x', band: 1 }, y: { scale: 'y', field: 'y0' }, y2: { scale: 'y', field: 'y1' }, fill: { scale: 'color', field: 'part' }, fillOpacity: { value: 1 },
          tooltip: { signal: `datum.at + ': ' + datum.part + ' ' + format(datum.value, ',')` } },
        hover: { fillOpacity: { value: 0.7 } } } }],
  };
}

// Histogram of numbers.
function histogram(values, titles) {
  if (values.length === 0) return null;
  return {
    width: Math.min(kWidth, 640), height: 200,
    data: [{ name: 'rows', values: values.map((value) => ({ value })), transform: [
      { type: 'extent', field: 'value', signal: 'extent' },
      { type: 'bin', field: 'value', extent: { signal: 'extent[0] == extent[1] ? [extent[0], extent[0] + 1] : extent' }, maxbins: 40 },
      { type: 'aggregate', groupby: ['bin0', 'bin1'] }] }],
    scales: [
      { name: 'x', type: 'linear', domain: { data: 'rows', fields: ['bin0', 'bin1'] }, range: 'width', zero: false },
      { name: 'y', type: 'linear', domain: { data: 'rows', field: 'count' }, range: 'height', nice: true, zero: true }],
    axes: [{ orient: 'left', scale: 'y', grid: true, title: titles.y }, { orient: 'bottom', scale: 'x', title: titles.x, format: '~s' }],
    marks: [{ type: 'rect', from: { data: 'rows' }, encode: {
      update: {
        x: { scale: 'x', field: 'bin0', offset: 1 }, x2: { scale: 'x', field: 'bin1' }, y: { scale: 'y', field: 'count' }, y2: { scale: 'y', value: 0 }, fill: { value: kColors[0] }, fillOpacity: { value: 1 },
        tooltip: { signal: `format(datum.bin0, ',') + ' to ' + format(datum.bin1, ',') + ': ' + datum.count` } },
      hover: { fillOpacity: { value: 0.7 } } } }],
  };
}

// Lines with marks: rows {x, y, series, says}. Places along x are those that occur, evenly spaced, when they are not numbers or `even`.
function lines(rows, titles) {
  if (rows.length === 0) return null;
  const even = titles.even || rows.some((row) => typeof row.x !== 'number');
  return {
    width: Math.min(kWidth, 640), height: 280,
    data: [{ name: 'rows', values: rows }],
    scales: [
      even ? { name: 'x', type: 'point', domain: { data: 'rows', field: 'x' }, range: 'width', padding: 0.5 } : { name: 'x', type: 'linear', domain: { data: 'rows', field: 'x' }, range: 'width', zero: false, nice: true },
      { name: 'y', type: titles.log ? 'log' : 'linear', domain: { data: 'rows', field: 'y' }, range: 'height', nice: true, zero: !titles.log },
      { name: 'color', type: 'ordinal', domain: { data: 'rows', field: 'series' }, range: 'category' }],
    axes: [{ orient: 'left', scale: 'y', grid: true, title: titles.y, format: '~s' }, { orient: 'bottom', scale: 'x', title: titles.x, tickMinStep: titles.step }],
    legends: [{ stroke: 'color', symbolType: 'stroke', symbolStrokeWidth: 3, orient: 'right', title: titles.series }],
    marks: [{ type: 'group', from: { facet: { name: 'of', data: 'rows', groupby: 'series' } }, marks: [
      { type: 'line', from: { data: 'of' }, encode: { update: { x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, stroke: { scale: 'color', field: 'series' }, strokeWidth: { value: 2 } } } },
      { type: 'symbol', from: { data: 'of' }, encode: { update: {
        x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, fill: { scale: 'color', field: 'series' }, size: { value: 60 }, tooltip: { field: 'says' } }, hover: { size: { value: 140 } } } }] }],
  };
}

// Points with the front of those that no other beats in both directions (less is better): rows {x, y, series, says, front}.
function scatter(rows, titles) {
  if (rows.length === 0) return null;
  const scale = (name, field, range) => ({ name, type: titles.log ? 'log' : 'linear', domain: { data: 'rows', field }, range, nice: true, zero: false });
  return {
    width: Math.min(kWidth, 720), height: 380,
    data: [{ name: 'rows', values: rows }, { name: 'front', source: 'rows', transform: [{ type: 'filter', expr: 'datum.front' }, { type: 'collect', sort: { field: 'x' } }] }],
    scales: [scale('x', 'x', 'width'), scale('y', 'y', 'height'), { name: 'color', type: 'ordinal', domain: { data: 'rows', field: 'series' }, range: 'category' }],
    axes: [{ orient: 'left', scale: 'y', grid: true, title: titles.y, format: '~s' }, { orient: 'bottom', scale: 'x', grid: true, title: titles.x, format: '~s', labelOverlap: true }],
    legends: [{ fill: 'color', orient: 'right', title: titles.series }],
    marks: [
      { type: 'line', from: { data: 'front' }, encode: { update: { x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, interpolate: { value: 'step-after' }, stroke: { value: style('--mark') }, strokeWidth: { value: 2 } } } },
      { type: 'symbol', from: { data: 'rows' }, encode: { update: {
        x: { scale: 'x', field: 'x' }, y: { scale: 'y', field: 'y' }, fill: { scale: 'color', field: 'series' }, size: { signal: 'datum.front ? 110 : 50' }, stroke: { signal: `datum.front ? '${style('--mark')}' : null` },
        strokeWidth: { value: 2 }, cursor: { value: 'pointer' }, tooltip: { field: 'says' } }, hover: { size: { value: 180 } } } }],
  };
}

// Horizontal bars: rows {at, value, says}.
function bars(rows, titles) {
  if (rows.length === 0) return null;
  return {
    width: Math.min(kWidth, 560), height: rows.length * 24,
    data: [{ name: 'rows', values: rows }],
    scales: [
      { name: 'y', type: 'band', domain: { data: 'rows', field: 'at' }, range: 'height', padding: 0.2 },
      { name: 'x', type: 'linear', domain: titles.domain || { data: 'rows', field: 'value' }, range: 'width', nice: true, zero: true }],
    axes: [{ orient: 'left', scale: 'y' }, { orient: 'bottom', scale: 'x', grid: true, title: titles.x, format: titles.format || '~s' }],
    marks: [{ type: 'rect', from: { data: 'rows' }, encode: {
      update: { y: { scale: 'y', field: 'at' }, height: { scale: 'y', band: 1 }, x: { scale: 'x', value: 0 }, x2: { scale: 'x', field: 'value' }, fill: { value: kColors[0] }, fillOpacity: { value: 1 }, tooltip: { field: 'says' } },
      hover: { fillOpacity: { value: 0.7 } } } }],
  };
}
