// Counters over time. The counts of each tile are spread over their phase, at its simulated time; the counts of the front end and the
// binner are spread over their spans.

const kShadingCounts = ['pixel_shader_invocations', 'desampled_blocks', 'foveated_blocks', 'dram.texture', 'dram.attributes', 'dram.scene_color', 'dram.shadow_map'], kStoreCounts = ['advected_pixels', 'dram.frame_buffer', 'dram.history'];
const phaseOfCount = (name) => (kShadingCounts.includes(name) ? 4 : kStoreCounts.includes(name) ? 7 : 1);  // of timeline.spans

// The pass of a tile of the timeline, where it draws no tile of the image: a shadow map has tiles of its own.
function mapOfTile(timeline, passes, t) {
  const name = ((passes || [])[(timeline.pass || [])[t]] || { name: '' }).name;
  return name.startsWith('shadow ') ? name : '';
}

// Names that can be drawn of a frame: [name, title].
function seriesNames(tiles, { counters }) {
  const ofTiles = [...Object.keys(tiles.maps), ...Object.keys((tiles.costs || {}).dram || {}).map((purpose) => 'dram.' + purpose)];
  const ofGeometry = Object.keys(counters).filter((name) => /^(frontend|binner)\./.test(name) && counters[name] > 0 && !/peak|queue_bytes_read/.test(name));
  return [...ofTiles.map((name) => [name, `${mapTitle(name)}, by tiles`]), ...ofGeometry.map((name) => [name, name])];
}

// Counts in each window of the timeline; they add up to the frame's.
function seriesOf(name, { timeline, tiles }, { counters, passes }) {
  const out = Array(timeline.windows).fill(0), width = timeline.cycles / timeline.windows;
  const spread = (begin, end, count) => {
    const first = Math.max(0, Math.min(timeline.windows - 1, Math.floor(begin / width))), last = Math.max(first, Math.min(timeline.windows - 1, Math.ceil(end / width) - 1));
    for (let w = first; w <= last; ++w) out[w] += first === last ? count : count * Math.max(0, Math.min(end, (w + 1) * width) - Math.max(begin, w * width)) / (end - begin);
  };
  const values = mapValues(tiles, name);
  if (values) {
    const phase = phaseOfCount(name);
    // A tile that is rendered in several parts counts for each by its length.
    const pieces = [...timeline.tile.keys()].filter((t) => !mapOfTile(timeline, passes, t)).map((t) => {
      const begin = timeline.begin[t] + timeline.spans.slice(8 * t, 8 * t + phase).reduce((a, b) => a + b, 0);
      return { tile: timeline.tile[t], begin, end: begin + timeline.spans[8 * t + phase] };
    }), lengths = new Map(), times = new Map();
    for (const { tile, begin, end } of pieces) { lengths.set(tile, (lengths.get(tile) || 0) + end - begin); times.set(tile, (times.get(tile) || 0) + 1); }
    for (const { tile, begin, end } of pieces) if (values[tile] > 0) spread(begin, end, values[tile] * (lengths.get(tile) > 0 ? (end - begin) / lengths.get(tile) : 1 / times.get(tile)));
    return out;
  }
  const spans = timeline.geometry.map((round) => (name.startsWith('binner.') ? round.slice(2) : round.slice(0, 2))), all = spans.reduce((sum, [begin, end]) => sum + end - begin, 0);
  for (const [begin, end] of spans) spread(begin, end, (counters[name] || 0) * (all > 0 ? (end - begin) / all : 1 / spans.length));
  return out;
}
