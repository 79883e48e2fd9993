// Numbers as people read them, and colours that mean the same everywhere.

// "12 345 678"; fractions with at most five significant digits.
function number(value) {
  if (value === null || value === undefined || value === '') return '';
  if (typeof value !== 'number') return String(value);
  if (!Number.isInteger(value)) return Math.abs(value) >= 1e9 || (value !== 0 && Math.abs(value) < 1e-4) ? value.toExponential(3) : grouped(String(Number(value.toPrecision(5))));
  return grouped(String(value));
}
function grouped(text) {
  const [whole, fraction] = text.split('.');
  const out = whole.replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f');
  return fraction === undefined ? out : out + '.' + fraction;
}
// The number as a user would type it.
function plain(value) { return value === null || value === undefined ? '' : String(value); }

// Steps of a thousand that have a name, from the small to the large; `per` of the unit that values come in. Bytes go by 1024.
const kScales = {
  bytes: [[1, 'B'], [1024, 'KiB'], [1048576, 'MiB'], [1073741824, 'GiB']],
  nJ: [[1e-3, 'pJ'], [1, 'nJ'], [1e3, 'µJ'], [1e6, 'mJ'], [1e9, 'J']],
  ms: [[1e-6, 'ns'], [1e-3, 'µs'], [1, 'ms'], [1e3, 's']],
  W: [[1e-6, 'µW'], [1e-3, 'mW'], [1, 'W']],
  'GB/s': [[1e-3, 'MB/s'], [1, 'GB/s']],
};
const kLarge = [[1, ''], [1e3, ' k'], [1e6, ' M'], [1e9, ' G']];

function scaleFor(most, unit) {
  const steps = kScales[unit];
  if (!steps) return [1, unit || ''];
  let chosen = steps[0];
  for (const step of steps) if (Math.abs(most) >= step[0]) chosen = step;
  return most === 0 ? steps.find((step) => step[0] === 1) : chosen;
}
function digits(value, significant = 3) {
  if (value === 0) return '0';
  if (Math.abs(value) >= 10 ** significant) return grouped(String(Math.round(value)));
  return String(Number(value.toPrecision(significant)));
}
// "1.8 mJ", "0.05 ms", "12.3 MiB"; of a unit without steps the number and the unit.
function quantity(value, unit, significant = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (unit === '%') return digits(value, significant) + ' %';
  const [step, name] = scaleFor(value, unit);
  return digits(value / step, significant) + (name ? '\u00a0' + name : '');
}
// For an axis: all ticks in the unit step of the largest, which the title names.
function axisScale(most, unit) {
  if (kScales[unit]) return scaleFor(most, unit);
  let chosen = kLarge[0];
  for (const step of kLarge) if (Math.abs(most) >= 10 * step[0]) chosen = step;
  return [chosen[0], [chosen[1].trim() === 'k' ? 'thousand' : chosen[1].trim() === 'M' ? 'million' : chosen[1].trim() === 'G' ? 'billion' : '', unit].filter(Boolean).join(' ')];
}
function percent(part, significant = 2) { return part === 0 ? '0 %' : Math.abs(part) < 0.001 ? '<0.1\u00a0%' : digits(100 * part, significant) + '\u00a0%'; }
function signedPercent(part) { return Math.abs(part) < 0.001 ? percent(part) : (part > 0 ? '+' : part < 0 ? '−' : '') + percent(Math.abs(part), 3); }

// Okabe and Ito's colours and ones between: told apart by colour-blind readers too. The same purpose has the same colour in every
// section and in every report, whatever else is there.
const kPurposeColors = {
  patch_data: '#0072b2', tile_queue: '#bc8000', tile_state: '#c2739f', frame_buffer: '#009e73', texture: '#d55e00', history: '#8c6d1f',
  neighbours: '#4594c1', sampling_maps: '#7a7f87', attributes: '#7763a9', coarse_depth: '#9d8d00', signatures: '#6f6f6f', scene_color: '#e7298a', shadow_map: '#8a63b8', attachment: '#b06a6a' };
const kPurposeNames = {
  patch_data: 'scene', tile_queue: 'tile lists', tile_state: 'tile state', frame_buffer: 'frame buffer', texture: 'textures and heights', history: 'history', neighbours: 'neighbour pixels',
  sampling_maps: 'sampling maps', attributes: 'attributes', coarse_depth: 'coarse depth', signatures: 'signatures', scene_color: 'scene colour', shadow_map: 'shadow maps', attachment: 'attachments' };
const kPhaseColors = { geometry: '#0072b2', visibility: '#4594c1', shading: '#d55e00', store: '#009e73', other: '#7a7f87', unit: '#a8874a', data: '#c2739f' };
const kUnitPhase = {
  frontend: 'geometry', binner: 'geometry', entry_fetch: 'visibility', tessellator: 'visibility', box_builder: 'visibility', box_tests: 'visibility', stencil: 'visibility', sampling: 'visibility',
  triangle_tests: 'visibility', alpha_tests: 'visibility', coarse_depth: 'visibility', compaction: 'shading', shader: 'shading', texture: 'shading', blend: 'shading', resolve: 'store', dram: 'other', l2: 'other',
  latency: 'data', caches: 'other', tile_memory: 'unit', geometry: 'geometry', tilecores: 'shading', imbalance: 'unit', leakage: 'unit' };
// The colour of the value of an axis at a place in the order of its values, the same in all plots.
const seriesColor = (value, index) => kSeries[index % kSeries.length];
const kSeries = ['#0072b2', '#bc8000', '#009e73', '#d55e00', '#4594c1', '#c2739f', '#8c6d1f', '#7a7f87', '#7763a9', '#a8874a'];
// Colours of adjacent units: shades of their phase's colour, the same for a unit everywhere.
const kUnitColors = {
  frontend: '#0072b2', binner: '#bc8000', entry_fetch: '#a8874a', tessellator: '#4594c1', box_builder: '#3b73a1', box_tests: '#6691ad', stencil: '#a6761d', sampling: '#8c6d1f', triangle_tests: '#58718f',
  alpha_tests: '#9d8d00', coarse_depth: '#5a7d7c', compaction: '#bb7e62', shader: '#d55e00', texture: '#c2739f', blend: '#e7298a', resolve: '#009e73', dram: '#7a7f87', l2: '#7763a9', leakage: '#a95468' };
// Bounds that are no units have colours of their own.
const kBoundColors = { ...kUnitColors, latency: '#a95468', caches: '#756798', tile_memory: '#b5840b', geometry: '#5b7188', tilecores: '#e4663d', imbalance: '#539c51' };
const purposeName = (purpose) => kPurposeNames[purpose] || words(purpose);
const purposeColor = (purpose) => kPurposeColors[purpose] || '#7a7f87';
function words(name) { return String(name).replaceAll('_', ' '); }
const kBoundWords = {
  latency: 'memory latency', l2: 'the L2’s rate', caches: 'cache sizes', tile_memory: 'tile memory', geometry: 'front end and binner', tilecores: 'the tile cores', imbalance: 'uneven cores', dram: 'memory bandwidth',
  frontend: 'the front end', binner: 'the binner', shader: 'the shader', texture: 'the texture unit', resolve: 'the resolve unit', tessellator: 'the tessellator' };
const boundWords = (name) => kBoundWords[name] || words(name);

// Viridis (van der Walt and Smith 2015) at nine places: brighter is more, in every kind of colour vision.
const kRamp = [[68, 1, 84], [71, 45, 123], [59, 82, 139], [44, 114, 142], [33, 145, 140], [40, 174, 128], [94, 201, 98], [173, 220, 48], [253, 231, 37]];
function rampColor(t) {
  const at = Math.max(0, Math.min(1, t)) * (kRamp.length - 1), k = Math.min(kRamp.length - 2, Math.floor(at)), f = at - k;
  return `rgb(${kRamp[k].map((low, c) => Math.round(low + (kRamp[k + 1][c] - low) * f)).join(',')})`;
}

// The unit of a column of a study, as far as its name says it.
function unitOfColumn(name) {
  return /bytes/.test(name) ? 'bytes' : /power_w$/.test(name) ? 'W' : /time_ms$/.test(name) ? 'ms' : /_nj$|^energy\.|nJ$/.test(name) ? 'nJ' : /mm2/.test(name) ? 'mm²' : /frames_per_second$/.test(name) ? 'frames/s' : '';
}
const columnText = (name, value) => (unitOfColumn(name) ? quantity(value, unitOfColumn(name), 4) : number(value));

// Ticks of an axis from 0 or `least` to `most`: round numbers, about `count` of them.
function ticks(least, most, count) {
  if (!(most > least)) return [least];
  const rough = (most - least) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough * 0.999);
  const out = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most * (1 + 1e-12); ++k) out.push(Number((k * step).toPrecision(12)));
  return out;
}
