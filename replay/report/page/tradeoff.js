// The report of a tradeoff: data.tradeoff as tradeoff.json has it (replay/tradeoff/tradeoff.h).

const kTradeoffCosts = { ms: 'ms', dram_bytes: 'DRAM bytes', mj: 'energy, mJ', seconds: 'host seconds, median', processor_seconds: 'processor seconds, median' };
const kTradeoffErrors = { flip: 'mean FLIP', mse: 'mean square error (from PSNR)', dissimilarity: '1 - SSIM', max_error: 'largest difference' };

function tradeoffReport() {
  const tradeoff = data.tradeoff, reference = tradeoff.reference;
  const errorOf = (row, name) => (name === 'mse' ? (row.error.psnr_db === null ? 0 : 10 ** (-row.error.psnr_db / 10)) : name === 'dissimilarity' ? 1 - row.error.ssim : row.error[name]);
  const costOf = (row, name) => (name.endsWith('seconds') ? row.host[name].median : name === 'mj' ? (row.energy_nj === null ? null : row.energy_nj * 1e-6) : row[name]);
  const knobs = tradeoff.knobs.filter((knob) => knob.settings.length > 0 && !knob.timed);
  const rows = knobs.flatMap((knob) => knob.settings.map((row) => ({ knob, row })));

  const part = section('summary', 'Summary');
  if (reference) part.append(make('p', {}, `${rows.length} settings of ${knobs.length} knobs, each against a reference of ${number(reference.samples)} samples per pixel in double precision${reference.samples < reference.asked_samples ? ` (of ${number(reference.asked_samples)}: its noise is below ${reference.enough_db} dB)` : ''}, with ${reference.edge_pixels === 0 ? "the machine's own grids" : "cells of " + reference.edge_pixels + " pixels"}. ` +
    'Errors are those of what a display shows; host times are medians of ' + tradeoff.rounds + ' runs.'));
  if (reference && reference.psnr_db !== null) part.append(make('p', { class: 'note' }, `The reference's own noise, from the difference of its halves: ${reference.psnr_db.toFixed(1)} dB. Errors near it mean little.`));
  if (tradeoff.effects) {
    const names = (ran) => tradeoff.effects.filter((effect) => effect.ran === ran).map((effect) => effect.name).join(', ');
    part.append(make('p', {}, `Effects of the frame: ${names(true)}. Each is left out once, and images are compared with the one that has all of them.`),
      make('p', { class: 'note' }, `Absent, at no cost: ${names(false)}.`));
  }
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

// Columns of the table of a knob that is about how a frame is timed: there is nothing to see.
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
    { title: 'front', of: (row) => Object.keys(kTradeoffCosts).filter((cost) => (cost.endsWith('seconds') ? row.host['front_' + cost] : row.front[cost])).map((cost) => kTradeoffCosts[cost].split(',')[0]).join(', '), wide: true },
    { title: 'ms', of: (row) => (row.ms === null ? '' : Number(row.ms.toPrecision(4))) }, { title: 'cycles', of: (row) => row.cycles ?? '' }, { title: 'DRAM bytes', of: (row) => row.dram_bytes ?? '' },
    { title: 'energy, mJ', of: (row) => (row.energy_nj === null ? '' : Number((row.energy_nj * 1e-6).toPrecision(4))) },
    ...(knob.watched ? [{ title: knob.watched_as, of: (row) => row.watched ?? '' }] : []),
    { title: 'processor s', of: (row) => Number(row.host.processor_seconds.median.toPrecision(4)) }, { title: 'host s', of: (row) => Number(row.host.seconds.median.toPrecision(4)) },
    { title: 'spread, s', of: (row) => `${row.host.seconds.low.toPrecision(3)} to ${row.host.seconds.high.toPrecision(3)}` }];
}

function tradeoffScatter(rows, errorOf, costOf) {
  const part = section('front', 'Error against cost');
  part.append(make('p', { class: 'note' }, 'All settings of the chosen knobs. The line joins those that no other beats in both (less is better). A press on a point says what it is.'));
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
  // The same by keyboard: every setting is a row, and a row says what a point says.
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
  part.append(make('ul', {}, ...knob.settings.map((row) => make('li', {}, row.says))));
  if (knob.timed) {
    part.append(table(timedColumns(), knob.settings));
    return;
  }
  const points = () => markFront(knob.settings.filter((row) => row.ms !== null).map((row, index) => ({ index, x: costOf(row, 'ms'), y: errorOf(row, 'flip'), series: row.label, says: row.says })));
  plot(part, `${knob.title}: mean FLIP against time, one point per setting`, () => scatter(points(), { x: 'ms', y: 'mean FLIP', series: 'setting' }));
  part.append(table(tradeoffColumns(knob), knob.settings), make('details', {}, make('summary', {}, 'As arguments'), table([{ title: 'setting', of: (row) => row.label }, { title: 'arguments', of: (row) => row.arguments || '(as asked for)', wide: true }], knob.settings)));
}

function convergenceSection(reference) {
  const { samples, rms_error: errors, slope, size } = reference.convergence;
  const part = section('convergence', 'Convergence of the reference');
  part.append(make('p', {}, `Error of an image of ${size.join('x')} pixels of the same frame, from four series of independent samples` + (slope === null ? '.' : `: it falls as samples to the power ${slope.toFixed(3)} (plain random numbers: -0.5).`)));
  const rows = () => samples.map((n, k) => ({ x: n, y: errors[k], series: 'measured', says: `${n} samples: ${number(errors[k])}` })).concat(samples.map((n) => ({ x: n, y: errors[0] * Math.sqrt(samples[0] / n), series: 'power -0.5', says: `${n} samples` }))).filter((row) => row.y > 0);
  plot(part, 'Root mean square error of the reference over its samples per pixel, both logarithmic', () => lines(rows(), { x: 'samples per pixel', y: 'root mean square error, linear light', series: '', log: true, even: true }));
}
