// The report of a tradeoff: data.tradeoff as tradeoff.json has it (replay/tradeoff/tradeoff.h).

const kTradeoffCosts = { ms: 'ms', dram_bytes: 'DRAM bytes', mj: 'energy, mJ', seconds: 'host seconds, median', processor_seconds: 'processor seconds, median' };
const kFrontNames = { ms: 'ms', dram_bytes: 'DRAM', mj: 'mJ', seconds: 'host', processor_seconds: 'CPU' };
const kTradeoffErrors = { flip: 'mean FLIP', mse: 'mean square error (from PSNR)', dissimilarity: '1 - SSIM', max_error: 'largest difference' };

function tradeoffReport() {
  const tradeoff = data.tradeoff, reference = tradeoff.reference;
  if (tradeoff.effects) {
    effectsReport(tradeoff);
    return;
  }
  const errorOf = (row, name) => (name === 'mse' ? (row.error.psnr_db === null ? 0 : 10 ** (-row.error.psnr_db / 10)) : name === 'dissimilarity' ? 1 - row.error.ssim : row.error[name]);
  const costOf = (row, name) => (name.endsWith('seconds') ? row.host[name].median : name === 'mj' ? (row.energy_nj === null ? null : row.energy_nj * 1e-6) : row[name]);
  const knobs = tradeoff.knobs.filter((knob) => knob.settings.length > 0 && !knob.timed);
  const rows = knobs.flatMap((knob) => knob.settings.map((row) => ({ knob, row })));

  const part = section('summary', 'Summary');
  if (reference) part.append(make('p', {}, `${rows.length} settings of ${knobs.length} knobs, each against a reference of ${number(reference.samples)} samples per pixel in double precision${reference.samples < reference.asked_samples ? ` (of ${number(reference.asked_samples)}: its noise is below ${reference.enough_db} dB)` : ''}, with ${reference.edge_pixels === 0 ? "the machine's own grids" : "cells of " + reference.edge_pixels + " pixels"}. ` +
    'Errors compare tone-mapped images, as a display shows them; host times are ' + runsWords(tradeoff) + '.'));
  if (reference && reference.psnr_db !== null) part.append(make('p', { class: 'note' }, `The reference's own noise, from the difference of its halves: ${reference.psnr_db.toFixed(1)} dB. Errors near it mean little.`));
  if (tradeoff.stopped) part.append(make('p', { class: 'note' }, 'Stopped before its end; the same command goes on.'));
  if (tradeoff.cheapest) {
    const { setting, missed, cost, max_flip: flip, min_psnr: psnr } = tradeoff.cheapest;
    const asked = [flip === null ? '' : `FLIP at most ${flip}`, psnr === null ? '' : `PSNR at least ${psnr} dB`].filter(Boolean).join(' and ');
    part.append(make('p', {}, setting === null ? `No setting that was tried has ${asked}.` + (missed === null ? '' : ` The nearest is ${missed.label} (${missed.knob}).`) : `Cheapest by ${kTradeoffCosts[cost]} with ${asked}: ${setting.label} (${setting.knob}).`));
    if (setting !== null) part.append(make('pre', {}, setting.arguments || '(as asked for)'));
  }
  if (rows.length > 0) tradeoffScatter(rows, errorOf, costOf);
  for (const knob of tradeoff.knobs) knobSection(knob, errorOf, costOf);
  if (reference) convergenceSection(reference);
  configurationSection([['Settings that all others are varied from', tradeoff.settings], ['Machine', tradeoff.gpu]]);
}

const runsWords = ({ rounds }) => (rounds === 1 ? 'from one run' : `medians of ${rounds} runs`);

// The cost of each effect of the frame: the frame minus the frame without it.
function effectsReport(tradeoff) {
  const settings = tradeoff.knobs[0]?.settings ?? [], frame = settings[0];
  const ran = tradeoff.effects.filter((effect) => effect.ran), absent = tradeoff.effects.filter((effect) => !effect.ran);
  const work = (effect) => Object.values(effect.counters).reduce((sum, value) => sum + value, 0);
  // To the fourth digit of the frame's.
  const rounded = (value, all) => (value === null ? '' : Number.isInteger(all) || !all ? value : Number(value.toFixed(Math.max(0, 3 - Math.floor(Math.log10(all))))));
  const costs = [{ title: 'ms', of: (row) => row.ms }, { title: 'mJ', of: (row) => (row.energy_nj === null ? null : row.energy_nj * 1e-6) }, { title: 'DRAM bytes', of: (row) => row.dram_bytes },
    { title: 'processor s', of: (row) => row.host.processor_seconds.median }];
  const without = (effect) => (effect.setting === null ? null : settings[effect.setting]);
  // An effect's cost by one of `costs`; nothing where it is unknown.
  const costOf = (cost, effect) => { const row = without(effect), all = cost.of(frame); return !row || all === null || cost.of(row) === null ? null : all - cost.of(row); };
  const withShare = (cost) => (value, effect) => { const all = cost.of(frame); return value === '' ? '' : effect.whole || all === 0 ? number(value) : `${number(value)} (${(100 * value / all).toFixed(1)} %)`; };
  const change = (effect) => { const row = without(effect); return row ? (row.error.psnr_db === null ? 'the same' : Number(row.error.psnr_db.toFixed(1))) : ''; };

  const part = section('summary', 'Summary');
  part.append(make('p', {}, `${ran.length} of ${tradeoff.effects.length} effects run in this frame. Each was left out once: its cost is the cost of the frame minus the cost of the frame without it, and the image without it is compared with the full image. Processor seconds of the host are ${runsWords(tradeoff)}.`));
  if (tradeoff.stopped) part.append(make('p', { class: 'note' }, 'Stopped before its end; the same command goes on.'));
  if (frame) {
    const present = section('effects', 'Effects that the frame calls for');
    const rows = [{ whole: true, name: 'the frame, with all of them', reason: '', tiles: '', sub_patches: '', without: '', stays: '' }, ...ran];
    present.append(table([{ title: 'effect', of: (row) => words(row.name) }, ...costs.map((cost) => ({ title: cost.title, of: (row) => rounded(row.whole ? cost.of(frame) : costOf(cost, row), cost.of(frame)), show: withShare(cost) })),
      { title: 'image without it, dB', of: (row) => (row.whole ? '' : change(row)) }, { title: 'tiles', of: (row) => row.tiles }, { title: 'sub-patches', of: (row) => row.sub_patches }], rows, { label: 'Costs of effects' }),
      make('p', { class: 'note' }, 'In parentheses: the share of the frame. A cost below 0 saves.'),
      make('details', {}, make('summary', {}, 'Why each runs, and how it is left out'), table([{ title: 'effect', of: (row) => words(row.name) }, { title: 'runs because', of: (row) => row.reason, wide: true }, { title: 'left out by', of: (row) => row.stays || row.without, wide: true }], ran)),
      make('details', {}, make('summary', {}, 'The frames themselves'), table(tradeoffColumns({ watched: '' }).filter((column) => column.title !== 'front'), settings)));
  }
  const missing = section('absent', 'Effects that it does not call for');
  missing.append(make('p', {}, `They cost nothing: the ${absent.reduce((sum, effect) => sum + Object.keys(effect.counters).length, 0)} counters of their work add up to ${number(absent.reduce((sum, effect) => sum + work(effect), 0))}.`),
    table([{ title: 'effect', of: (row) => words(row.name) }, { title: 'work counted', of: work }, { title: 'does not run because', of: (row) => row.reason, wide: true }], absent, { label: 'Absent effects' }));
  configurationSection([['Settings of the frame', tradeoff.settings], ['Machine', tradeoff.gpu]]);
}

// Columns of the table of a knob that changes the timing of a frame only: it has no images.
function timedColumns() {
  const percent = (share) => (typeof share === 'number' ? Number((100 * share).toFixed(2)) : '');
  return [{ title: 'setting', of: (row) => (row.base ? `${row.label} (as asked)` : row.label) }, { title: 'cycles', of: (row) => row.cycles ?? '' }, { title: 'error, %', of: (row) => percent(row.cycles_error) },
    { title: 'energy, nJ', of: (row) => (row.energy_nj === null ? '' : Math.round(row.energy_nj)) }, { title: 'error, %', of: (row) => percent(row.energy_error) },
    { title: 'processor s', of: (row) => Number(row.host.processor_seconds.median.toPrecision(4)) }, { title: 'host s', of: (row) => Number(row.host.seconds.median.toPrecision(4)) }];
}

// Columns of a knob's table.
function tradeoffColumns(knob) {
  return [{ title: 'setting', of: (row) => (row.base ? `${row.label} (as asked)` : row.label) }, { title: 'PSNR, dB', of: (row) => (row.error.psnr_db === null ? 'equal' : Number(row.error.psnr_db.toFixed(2))) },
    { title: 'SSIM', of: (row) => Number(row.error.ssim.toFixed(5)) }, { title: 'FLIP', of: (row) => Number(row.error.flip.toFixed(5)) }, { title: 'largest', of: (row) => Number(row.error.max_error.toFixed(4)) },
    { title: 'front', of: (row) => Object.keys(kTradeoffCosts).filter((cost) => (cost.endsWith('seconds') ? row.host['front_' + cost] : row.front[cost])).map((cost) => kFrontNames[cost]).join(', ') },
    { title: 'ms', of: (row) => (row.ms === null ? '' : Number(row.ms.toPrecision(4))) }, { title: 'cycles', of: (row) => row.cycles ?? '' }, { title: 'DRAM bytes', of: (row) => row.dram_bytes ?? '' },
    { title: 'energy, mJ', of: (row) => (row.energy_nj === null ? '' : Number((row.energy_nj * 1e-6).toPrecision(4))) },
    ...(knob.watched ? [{ title: knob.watched_as, of: (row) => row.watched ?? '' }] : []),
    { title: 'processor s', of: (row) => Number(row.host.processor_seconds.median.toPrecision(4)) }, { title: 'host s', of: (row) => Number(row.host.seconds.median.toPrecision(4)) },
    { title: 'spread, s', of: (row) => `${row.host.seconds.low.toPrecision(3)} to ${row.host.seconds.high.toPrecision(3)}` }];
}

function tradeoffScatter(rows, errorOf, costOf) {
  const part = section('front', 'Error against cost');
  part.append(make('p', { class: 'note' }, 'All settings of the chosen knobs. The line joins the settings that no other beats in both (less is better). A press on a point shows its arguments.'));
  const names = [...new Set(rows.map((entry) => entry.knob.name))];
  const state = { x: wantedOf('front.across', Object.keys(kTradeoffCosts), 'ms'), y: wantedOf('front.up', Object.keys(kTradeoffErrors), 'flip'), knob: wantedOf('front.knob', names, ''), log: wanted.get('front.log') === 'on' };
  const draw = (key) => (value) => { state[key] = value; shown.draw(); };
  const log = make('input', { type: 'checkbox', checked: state.log, change: () => { state.log = log.checked; shown.draw(); } });
  part.append(make('div', { class: 'controls' }, chooser('Cost', Object.entries(kTradeoffCosts), state.x, draw('x')).label, chooser('Error', Object.entries(kTradeoffErrors), state.y, draw('y')).label,
    chooser('Knob', [['', 'all'], ...names], state.knob, draw('knob')).label, make('label', {}, log, 'logarithmic')));
  const points = () => {
    const chosen = rows.map((entry, index) => ({ ...entry, index })).filter((entry) => state.knob === '' || entry.knob.name === state.knob)
      .map(({ knob, row, index }) => ({ index, x: costOf(row, state.x), y: errorOf(row, state.y), series: knob.title, says: `${knob.title}: ${row.label}: ${number(costOf(row, state.x))}, ${number(errorOf(row, state.y))}` }))
      .filter((point) => typeof point.x === 'number' && (!state.log || (point.x > 0 && point.y > 0)));
    return markFront(chosen);
  };
  const detail = make('div', { 'aria-live': 'polite' });
  const press = (datum) => {
    const entry = rows[datum.index];
    if (entry) detail.replaceChildren(make('h3', {}, `${entry.knob.title}: ${entry.row.label}`), make('p', {}, entry.row.says), make('pre', {}, entry.row.arguments || '(as asked for)'));
  };
  const shown = plot(part, 'Settings of all knobs, an error against a cost', () => scatter(points(), { x: kTradeoffCosts[state.x], y: kTradeoffErrors[state.y], series: 'knob', log: state.log }), press);
  part.append(detail);
  // The same for the keyboard: every setting is a row with the text of its point.
  part.append(make('details', {}, make('summary', {}, 'All settings as a table'), table([{ title: 'knob', of: (entry) => entry.knob.title }, { title: 'setting', of: (entry) => entry.row.label },
    ...Object.entries(kTradeoffErrors).map(([name, title]) => ({ title, of: (entry) => errorOf(entry.row, name) })), ...Object.entries(kTradeoffCosts).map(([name, title]) => ({ title, of: (entry) => costOf(entry.row, name) ?? '' }))],
    rows, { press: (entry) => press({ index: rows.indexOf(entry) }) })));
}

function knobSection(knob, errorOf, costOf) {
  const part = section('knob-' + knob.name, knob.title);
  if (knob.skipped) {
    part.append(make('p', { class: 'note' }, `Left out: ${knob.skipped}.`));
    return;
  }
  // One line is enough.
  if (knob.idle) {
    part.append(make('p', { class: 'note' }, `Without effect here: ${knob.settings.map((row) => row.label).join(', ')} give the same image at the same cost.`));
    return;
  }
  if (knob.context) part.append(make('p', { class: 'note' }, `With ${knob.context}.`));
  if (knob.timed) {
    part.append(make('ul', {}, ...knob.settings.map((row) => make('li', {}, row.says))), table(timedColumns(), knob.settings));
    return;
  }
  // Settings that others beat decide nothing: they are folded.
  const deciding = knob.settings.filter((row) => row.base || row.front.ms !== false), beaten = knob.settings.length - deciding.length;
  // With many settings the legend names only the ones on the front.
  const many = knob.settings.length > 20, series = (row) => (!many ? row.label : deciding.includes(row) ? 'decides' : 'beaten');
  const points = () => markFront(knob.settings.filter((row) => row.ms !== null).map((row, index) => ({ index, x: costOf(row, 'ms'), y: errorOf(row, 'flip'), series: series(row), says: row.says })));
  plot(part, `${knob.title}: mean FLIP against time, one point per setting`, () => scatter(points(), { x: 'ms', y: 'mean FLIP', series: 'setting' }));
  part.append(make('p', { class: 'note' }, beaten > 0 ? `The ${deciding.length} settings that no other beats in mean FLIP and ms, and the one that was asked for; the other ${beaten} are folded.` : 'No setting is beaten in mean FLIP and ms.'),
    table(tradeoffColumns(knob), deciding, { sort: knob.name === 'joint' || knob.name === 'search' ? 6 : -1, label: `Settings of ${knob.title} that decide` }));
  if (beaten > 0) part.append(make('details', {}, make('summary', {}, `All ${knob.settings.length} settings`), table(tradeoffColumns(knob), knob.settings)));
  part.append(make('details', {}, make('summary', {}, 'In words'), make('ul', {}, ...knob.settings.map((row) => make('li', {}, row.says)))), make('details', {}, make('summary', {}, 'As arguments'), table([{ title: 'setting', of: (row) => row.label }, { title: 'arguments', of: (row) => row.arguments || '(as asked for)', wide: true }], knob.settings)));
}

function convergenceSection(reference) {
  const { samples, rms_error: errors, slope, size } = reference.convergence;
  const part = section('convergence', 'Convergence of the reference');
  part.append(make('p', {}, `Error of an image of ${size.join('x')} pixels of the same frame, from four series of independent samples` + (slope === null ? '.' : `: it falls as samples to the power ${slope.toFixed(3)} (plain random numbers: -0.5).`)));
  const rows = () => samples.map((n, k) => ({ x: n, y: errors[k], series: 'measured', says: `${n} samples: ${number(errors[k])}` })).concat(samples.map((n) => ({ x: n, y: errors[0] * Math.sqrt(samples[0] / n), series: 'power -0.5', says: `${n} samples` }))).filter((row) => row.y > 0);
  plot(part, 'Root mean square error of the reference over its samples per pixel, both logarithmic', () => lines(rows(), { x: 'samples per pixel', y: 'root mean square error, linear light', series: '', log: true, even: true }));
}
