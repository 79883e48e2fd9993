// Further results of a replay: counters, effects, other ways to bin, the sensitivity of the verdict.

function counterSection() {
  const part = section('counters', 'Counters');
  const holder = make('div'), filter = make('input', { type: 'search', placeholder: 'name or meaning', input: () => paint() });
  part.append(make('div', { class: 'controls' }, make('label', {}, 'Find', filter)), holder);
  const entry = follow(part, ['run', 'frame', 'other'], () => paint());
  function paint() {
    const total = run().stats.total.counters, frame = frameOf(), other = otherFrame(), looked = filter.value.toLowerCase();
    const meaning = (name) => (data.counters[name] || {}).meaning || '';
    const names = Object.keys(total).filter((name) => !looked || name.includes(looked) || meaning(name).toLowerCase().includes(looked));
    holder.replaceChildren(table([
      { title: 'counter', of: (row) => row }, { title: nameOf(shown), of: (row) => frame.counters[row], zero: true },
      ...(other ? [{ title: `B: ${nameOf(shown.other)}`, of: (row) => other.counters[row], zero: true }, { title: 'B to A', of: (row) => (frame.counters[row] ? (other.counters[row] || 0) / frame.counters[row] - 1 : 0), show: (value) => (value ? signedPercent(value) : '') }] : []),
      { title: 'all frames', of: (row) => total[row], zero: true }, { title: 'unit', of: (row) => (data.counters[row] || {}).unit || '' }, { title: 'meaning', of: meaning, wide: true }], names, { label: 'Counters' }));
  }
  return entry;
}

// Energy that a frame saves without an effect, where --without measured it; else 0.
function savedEnergy(frame, effect) {
  const row = ((frame.without || {}).effects || []).find((of) => of.effect === effect);
  return row && frame.energy ? frame.energy.total_nj - row.energy_nj : 0;
}

function effectSection() {
  if (!frameOf().effects) return;
  const part = section('effects', 'Effects'), holder = make('div');
  part.append(holder);
  follow(part, ['run', 'frame'], () => {
    const frame = frameOf(), effects = Object.keys(frame.effects), at = (effect) => (frame.effect_places || {})[effect] || {};
    const ran = effects.filter((effect) => frame.effects[effect]), idle = effects.filter((effect) => !frame.effects[effect]);
    const saved = savings(frame, 'effects'), count = framesOf().length, frames = (effect) => framesOf().filter((of) => of.effects[effect]).length;
    holder.replaceChildren(ran.length > 0 ? table([
      { title: `effects of ${nameOf(shown)}`, of: words }, { title: 'frames', of: (row) => `${frames(row)} of ${count}` }, { title: 'sub-patches', of: (row) => at(row).sub_patches }, { title: 'sub-patches spared', of: (row) => at(row).sub_patches_elided },
      { title: 'tiles', of: (row) => at(row).tiles }, ...(saved.size > 0 ? [{ title: 'saves when left out', of: (row) => saved.get(row) ?? -1, show: (value) => (value === -1 ? 'not measured' : signedPercent(value)) }, { title: 'time', of: (row) => (saved.has(row) ? saved.get(row) * milliseconds(frame.timing.cycles) : 0), show: (value) => (value ? quantity(value, 'ms') : ''), help: 'Time that the frame saves without it' }, { title: 'energy', of: (row) => savedEnergy(frame, row), show: (value) => (value ? quantity(value, 'nJ') : ''), help: 'Energy that the frame saves without it' }] : []), { title: 'why', of: (row) => (frame.effect_reasons || {})[row] || '', wide: true }], ran, { label: 'Effects that ran' }) : make('p', {}, `No effect ran in ${nameOf(shown)}.`),
    idle.length > 0 ? make('details', {}, make('summary', {}, `Did not run: ${idle.map(words).join(', ')}`), table([{ title: 'effect', of: words }, { title: 'why not', of: (row) => (frame.effect_reasons || {})[row] || '', wide: true }], idle, { label: 'Effects that did not run' })) : '');
  });
}

function baselineSection() {
  const total = run().stats.total;
  if (!total.baselines) return;
  const part = section('baselines', 'Other ways to bin the same frames'), order = total.baselines.tessera['baseline.cycles'] > 0 ? 'baseline.cycles' : 'baseline.dram_bytes';
  const schemes = Object.keys(total.baselines).sort((a, b) => total.baselines[a][order] - total.baselines[b][order]);
  const names = Object.keys(total.baselines[schemes[0]]);
  // Shipped: a product does this on patches; idealised: none is known to. Older files do not say which.
  const kinds = run().stats.baseline_kinds || {}, named = (scheme) => (kinds[scheme] ? `${words(scheme)} (${kinds[scheme]})` : words(scheme));
  const units = { 'baseline.queue_bytes_peak': ['list memory', 'bytes'], 'baseline.dram_bytes': ['memory traffic', 'bytes'], 'baseline.cycles': ['cycles', 'cycles'], 'baseline.energy_nj': ['energy', 'nJ'] };
  if (total.baseline_verdict) part.append(make('p', { class: 'verdict' }, total.baseline_verdict.sentence));
  part.append(...['ours', 'shipped', 'idealised'].flatMap((kind) => {
    const of = schemes.filter((scheme) => (kinds[scheme] || 'idealised') === kind);
    return of.length === 0 ? [] : [make('h3', {}, { ours: 'This machine', shipped: 'Shipped in a product', idealised: 'Idealised: in no known product' }[kind]), verdictTable(total, of, order)];
  }));
  const grid = make('div', { class: 'pairs' });
  part.append(grid);
  for (const [name, [title, unit]] of Object.entries(units).filter(([of]) => names.includes(of)))
    plot(grid.appendChild(make('div')), `${title} by scheme`, () => bars(schemes.map((scheme) => ({ at: named(scheme), value: total.baselines[scheme][name], says: quantity(total.baselines[scheme][name], unit, 4) })), { x: title, unit }));
  part.append(table([{ title: 'counter', of: (row) => row, title_of: (row) => (data.counters[row] || {}).meaning || '' }, ...schemes.map((scheme) => ({ title: named(scheme), of: (row) => total.baselines[scheme][row], zero: true }))], names, { label: 'Schemes' }));
}

// Schemes with the costs of a frame by each measure, also relative to tessera; the row of this machine is marked.
function verdictTable(total, schemes, order) {
  const frames = total.frames, clock = clockOf(), measures = [['time', 'baseline.cycles', (value) => quantity(value / frames / clock * 1e-3, 'ms')], ['energy', 'baseline.energy_nj', (value) => quantity(value / frames, 'nJ')],
    ['memory traffic', 'baseline.dram_bytes', (value) => quantity(value / frames, 'bytes')], ['peak list memory', 'baseline.queue_bytes_peak', (value) => quantity(value, 'bytes')]];
  const by = (name) => (scheme) => total.baselines[scheme][name] / total.baselines.tessera[name];
  return table([{ title: 'scheme', of: words }, ...measures.filter(([, name]) => total.baselines.tessera[name] > 0).flatMap(([title, name, show]) => [
    { title, of: (scheme) => total.baselines[scheme][name], show: (value) => (value > 0 ? show(value) : '–') }, { title: 'by tessera’s', of: by(name), show: (value) => (value > 0 ? digits(value) + '×' : '–'), help: `${title} as a multiple of tessera’s` }])],
  schemes, { chosen: (scheme) => scheme === 'tessera', sort: 1, up: true, label: `Schemes by ${order === 'baseline.cycles' ? 'time' : 'traffic'}` });
}

// --sensitivity: the numbers on which cycles, energy and the verdict depend.
function sensitivitySection() {
  const of = run().stats.sensitivity;
  if (!of) return;
  const part = section('sensitivity', 'Sensitivity of the verdict');
  part.append(make('p', {}, of.verdict_hangs_on.length > 0 ? `Within their ranges these numbers change the unit that bounds the frame: ${of.verdict_hangs_on.join(', ')}.` : `No assumed number changes the verdict: ${boundWords(of.bound_by)} bounds the frame.`),
    table([{ title: 'key', of: (row) => row.key }, { title: 'value', of: (row) => row.value, show: plain }, { title: 'from', of: (row) => row.ends[0], show: plain }, { title: 'to', of: (row) => row.ends[1], show: plain },
      ...['cycles', 'energy'].flatMap((what) => [0, 1].map((end) => ({ title: `${what} at ${end ? 'to' : 'from'}`, of: (row) => row[what][end] - 1, show: (value) => (Math.abs(value) < 5e-4 ? '' : signedPercent(value)), zero: true }))),
      { title: 'assumed', of: (row) => (row.assumed ? 'yes' : 'no') }], of.numbers, { limit: 20, label: 'Influence of each number' }));
}
