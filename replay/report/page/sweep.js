// The report of a sweep: data.sweep = {axes, columns, captures, points: [{capture, values}], rows: [[point, frame, status, ...columns]], ...}.

function sweepReport() {
  const sweep = data.sweep, axes = ['capture', ...sweep.axes];
  const known = sweep.columns.filter((name, c) => sweep.rows.some((row) => typeof row[c + 3] === 'number' && row[c + 3] !== 0));
  const columnIndex = Object.fromEntries(sweep.columns.map((name, c) => [name, c + 3]));
  // A point with its values along the axes and the mean over its frames of every column.
  const points = sweep.points.map((point, index) => ({ index, axis: Object.fromEntries(axes.map((key, a) => [key, a === 0 ? sweep.captures[point.capture] : point.values[a - 1]])), frames: [], mean: {} }));
  for (const row of sweep.rows) if (row[2] === 'ok') points[row[0]].frames.push(row);
  const done = points.filter((point) => point.frames.length > 0);
  for (const point of done)
    for (const name of known) {
      const column = columnIndex[name];
      let sum = 0, count = 0;
      for (const row of point.frames) if (typeof row[column] === 'number') { sum += row[column]; ++count; }
      if (count > 0) point.mean[name] = sum / count;
    }
  // The sum of reads and writes, which have separate columns.
  const kBoth = 'dram.read_bytes + dram.written_bytes';
  if (known.includes('dram.read_bytes') && known.includes('dram.written_bytes')) {
    for (const point of done) point.mean[kBoth] = point.mean['dram.read_bytes'] + point.mean['dram.written_bytes'];
    known.push(kBoth);
  }
  // A value that is the same at every point is stated once, and is no choice of the plots.
  const changing = known.filter((name) => done.some((point) => point.mean[name] !== done[0].mean[name])), moving = new Set(changing);
  // Columns that the goal names always stay.
  const wished = sweep.goal ? goalColumns(sweep.goal) : [], stays = (name) => moving.has(name) || wished.includes(name);
  const columns = changing.length > 0 ? known.filter(stays) : known, constant = changing.length > 0 ? known.filter((name) => !stays(name)) : [];
  const varying = axes.filter((key) => new Set(points.map((point) => JSON.stringify(point.axis[key]))).size > 1);
  const says = (point) => varying.map((key) => `${key} = ${point.axis[key]}`).join(', ') || `point ${point.index}`;
  const idle = varying.filter((key) => withoutEffect(done, varying, key, columns));
  const prefer = (...names) => names.find((name) => columns.includes(name)) || columns[0];
  const tools = { points: done, columns, known, varying, says, prefer, goal: sweep.goal, meets: new Map((sweep.ranking || []).map((row) => [row.point, row.meets])) };
  const detail = make('div', { 'aria-live': 'polite' });

  if (sweep.goal && done.length > 0) goalSection(tools, points, (datum) => press(datum));
  const part = section('study', 'Study');
  part.append(make('p', {}, `${sweep.points.length} points: ${done.length} with results, ${sweep.missing.length} not done yet, ${sweep.rows.filter((row) => row[2] !== 'ok').length} with values that do not fit each other. ` +
    'Plots show the mean over the frames of a point.'));
  if (sweep.rows_left_out > 0) part.append(make('p', { class: 'note' }, `${sweep.rows_left_out} rows are left out here; sweep.csv has them all.`));
  part.append(table([{ title: 'axis', of: (key) => key }, { title: 'values', of: (key) => valuesOfAxis(points, key).join(', '), wide: true }], axes.filter((key) => varying.includes(key)), { label: 'Axes' }));
  for (const key of idle) part.append(make('p', { class: 'note' }, `${key} is without effect here: all of its values give the same columns.`));
  if (constant.length > 0) part.append(make('details', {}, make('summary', {}, `${constant.length} columns are the same at every point`), table([{ title: 'column', of: (name) => name }, { title: 'value', of: (name) => done[0].mean[name] }], constant, { label: 'Columns that do not vary' })));

  const press = (datum) => {
    const point = points[datum.index];
    if (!point) return;
    detail.replaceChildren(make('h3', {}, `Point ${point.index}: ${says(point)}`), table([{ title: 'column', of: (name) => name }, { title: 'mean over frames', of: (name) => point.mean[name] }], columns));
    const shown = data.views.findIndex((view) => view.point === point.index);
    if (browser && shown >= 0) browser.choose(shown);
  };
  let browser = null;
  // The winner and the study are there first; plots and tables of thousands of points follow one by one.
  return [...(done.length > 0 ? [() => parallelSection(tools, press), () => paretoSection(tools, press, detail), () => curveSection(tools), () => purposeSection(tools)] : []),
    () => { if (data.views.length > 0) browser = sweepImages(); },
    () => section('points', 'Points').append(table([{ title: 'point', of: (row) => row[0] }, ...varying.map((key) => ({ title: key, of: (row) => points[row[0]].axis[key] })), { title: 'frame', of: (row) => (row[1] === null ? '' : row[1]) }, { title: 'status', of: (row) => row[2] },
      ...columns.filter((name) => name in columnIndex).map((name) => ({ title: name, of: (row) => (row[columnIndex[name]] === null ? '' : row[columnIndex[name]]) }))], sweep.rows, { press: (row) => press({ index: row[0] }), limit: 200 })),
    () => configurationSection([['Study', { title: sweep.title, captures: sweep.captures, frames: sweep.frames || 'as in the captures', fixed: sweep.settings }], ['Settings of the first point', sweep.first_point.settings], ['Machine of the first point', sweep.first_point.gpu]])];
}

// The column of the goal's objective, then the columns with limits.
const goalColumns = (goal) => [goal.minimise || goal.maximise, ...Object.keys(goal.subject_to || {})];
const limitWords = (limit, name) => [limit.at_least === undefined ? '' : `at least ${columnText(name, limit.at_least)}`, limit.at_most === undefined ? '' : `at most ${columnText(name, limit.at_most)}`].filter(Boolean).join(' and ');

// The winner by the goal, candidates from the best on with beaten ones folded away, and the objective against the first limit.
function goalSection({ goal, says, varying }, points, press) {
  const part = section('goal', 'The goal'), columns = goalColumns(goal), limits = Object.entries(goal.subject_to || {}), ranking = data.sweep.ranking || [];
  if (ranking.length === 0) return;
  const best = points[ranking[0].point], front = unbeaten(ranking, (row) => goalPlace(goal, points[row.point])), aim = `${goal.maximise ? 'most' : 'least'} ${columns[0]}`;
  part.append(make('p', { class: 'verdict' }, make('b', { class: ranking[0].meets ? 'good' : 'bad' }, ranking[0].meets ? `Best: ${says(best)}` : `None meets the limits; nearest: ${says(best)}`), `, ${columns.map((name) => `${name} ${columnText(name, best.mean[name])}`).join(', ')}.`),
    make('p', { class: 'note' }, `Wanted: the ${aim}${limits.length > 0 ? ' with ' + limits.map(([name, limit]) => `${name} ${limitWords(limit, name)}`).join(', ') : ''}. ${ranking.filter((row) => row.meets).length} of ${ranking.length} candidates meet the limits in every frame.`));
  const candidates = (rows, more) => table([...varying.map((key) => ({ title: key, of: (row) => points[row.point].axis[key] })), ...columns.map((name) => ({ title: name, of: (row) => points[row.point].mean[name], show: (value) => columnText(name, value) })), { title: 'limits', of: (row) => (row.meets ? 'met' : 'missed') }], rows,
    { press: (row) => press({ index: row.point }), chosen: (row) => row === ranking[0], limit: 12, ...more });
  const beaten = ranking.slice(1).filter((row) => !front.has(row));
  part.append(candidates(ranking.filter((row, k) => k === 0 || front.has(row)), { label: 'Candidates that no other beats, the best first' }));
  if (beaten.length > 0) part.append(make('details', {}, make('summary', {}, `${beaten.length} candidates that another beats in all of these columns`), candidates(beaten, { label: 'Candidates that another beats' })));
}

// The goal's columns of a point, each so that less is better.
function goalPlace(goal, point) {
  return goalColumns(goal).map((name, k) => {
    const limit = (goal.subject_to || {})[name], more = k === 0 ? goal.maximise !== undefined : limit.at_least !== undefined && limit.at_most === undefined;
    return (more ? -1 : 1) * (point.mean[name] ?? Infinity);
  });
}

// The rows that no other beats: none is at least as good in all of `place(row)`, less being better, and better in one. Rows that were
// not beaten are kept in a list, so that thousands of rows take few comparisons.
function unbeaten(rows, place) {
  const sorted = rows.map((row) => ({ row, at: place(row) })).sort((a, b) => a.at.reduce((sum, value, k) => sum || Math.sign(value - b.at[k]) || 0, 0)), front = [];
  for (const one of sorted) if (!front.some((other) => other.at.every((value, k) => value <= one.at[k]) && other.at.some((value, k) => value < one.at[k]))) front.push(one);
  return new Set(front.map((one) => one.row));
}

// Whether an axis changes no column: points that differ in it alone are alike.
function withoutEffect(points, varying, key, columns) {
  const others = varying.filter((other) => other !== key && !moveTogether(points, other, key)), first = new Map();
  return points.every((point) => {
    const place = JSON.stringify(others.map((other) => point.axis[other])), seen = first.get(place);
    if (!seen) first.set(place, point);
    return !seen || columns.every((name) => seen.mean[name] === point.mean[name]);
  }) && first.size < points.length;
}

// Marks the rows on the front of x and y, among the rows that meet the goal's limits.
function markFront(rows) {
  let last = { x: NaN, y: Infinity };
  for (const row of rows.filter((one) => one.meets !== false).sort((a, b) => a.x - b.x || a.y - b.y)) {
    // Equal points do not beat each other.
    row.front = row.y < last.y || (row.y === last.y && row.x === last.x);
    if (row.front) last = row;
  }
  return rows;
}

function paretoSection({ points, columns, varying, says, prefer, goal, meets }, press, detail) {
  const part = section('pareto', 'Two columns against each other');
  part.append(make('p', { class: 'note' }, `The line joins the points that no other beats in both (less is better)${goal ? '; dashed lines are the goal’s limits, pale points miss one' : ''}. A press on a point shows its numbers.`));
  const wished = goal ? goalColumns(goal) : [];
  const state = { x: wantedOf('pareto.across', columns, prefer('timing.time_ms', ...wished.slice(1), 'timing.cycles', 'binner.queue_bytes_peak')), y: wantedOf('pareto.up', columns, prefer(...wished.slice(0, 1), 'energy.total_nj', 'dram.read_bytes + dram.written_bytes', 'dram.read_bytes')),
    series: wantedOf('pareto.colour', varying, varying[0] || 'capture'), log: wanted.get('pareto.log') === 'on' };
  // Two columns, not one twice: the goal's next, or what else is asked most.
  if (state.x === state.y && columns.length > 1) state.y = [...wished, 'energy.total_nj', 'dram.read_bytes', ...columns].find((name) => name !== state.x && columns.includes(name));
  const draw = (key) => (value) => { state[key] = value; shown.draw(); };
  const log = make('input', { type: 'checkbox', checked: state.log, change: () => { state.log = log.checked; shown.draw(); } });
  part.append(make('div', { class: 'controls' }, chooser('Across', columns, state.x, draw('x')).label, chooser('Up', columns, state.y, draw('y')).label,
    chooser('Colour', varying.length > 0 ? varying : ['capture'], state.series, draw('series')).label, make('label', {}, log, 'logarithmic')));
  const rows = () => markFront(points.filter((point) => point.mean[state.x] !== undefined && point.mean[state.y] !== undefined && (!state.log || (point.mean[state.x] > 0 && point.mean[state.y] > 0)))
    .map((point) => ({ index: point.index, meets: meets.get(point.index) !== false, x: point.mean[state.x], y: point.mean[state.y], series: String(point.axis[state.series]), says: `${says(point)}: ${number(point.mean[state.x])}, ${number(point.mean[state.y])}` })));
  const onFront = make('div');
  const shown = plot(part, 'Points of the study, one column against another', () => scatter(listed(), { x: state.x, y: state.y, series: state.series, log: state.log, order: valuesOfAxis(points, state.series), limits: limitsOf(state.x, 'x').concat(limitsOf(state.y, 'y')) }), press);
  function limitsOf(name, axis) { const limit = goal && (goal.subject_to || {})[name]; return limit ? [limit.at_least, limit.at_most].filter((value) => value !== undefined).map((value) => ({ [axis]: value, says: `${name} ${limitWords(limit, name)}` })) : []; }
  // The points of the line as a table; the beaten ones are in the table of all points.
  function listed() {
    const all = rows(), byIndex = new Map(points.map((point) => [point.index, point])), front = all.filter((row) => row.front).sort((a, b) => a.x - b.x);
    onFront.replaceChildren(make('p', { class: 'note' }, `${front.length} of ${all.length} points ${front.length === 1 ? 'is' : 'are'} on the line; they beat the rest.`), table([...varying.map((key) => ({ title: key, of: (row) => byIndex.get(row.index).axis[key] })),
      { title: state.x, of: (row) => row.x, show: (value) => columnText(state.x, value) }, { title: state.y, of: (row) => row.y, show: (value) => columnText(state.y, value) }], front, { press, limit: 8, label: 'Points on the line' }));
    return all;
  }
  part.append(onFront, detail);
}

function curveSection({ points, columns, varying, prefer }) {
  if (varying.length === 0) return;
  const part = section('curves', 'A column along an axis');
  // Lines may be the schemes of one counter of the baselines, instead of values of an axis.
  const schemes = [...new Set(columns.filter((name) => name.startsWith('baseline.')).map((name) => name.split('.')[1]))];
  const series = schemes.length > 1 ? [...varying, 'scheme'] : varying;
  const state = { x: wantedOf('curves.along', varying, varying[varying.length - 1]), y: wantedOf('curves.column', columns, prefer('binner.queue_bytes_peak')),
    series: wantedOf('curves.lines', series, varying[0]), log: wanted.get('curves.log') === 'on' };
  const held = {};
  const holders = make('div', { class: 'controls' });
  const values = (key) => valuesOfAxis(points, key);
  const fillHeld = () => {
    const others = varying.filter((key) => key !== state.x && key !== state.series && !moveTogether(points, key, state.x) && !moveTogether(points, key, state.series));
    for (const key of Object.keys(held)) delete held[key];
    holders.replaceChildren(...others.map((key) => {
      held[key] = wantedOf('curves.' + key, values(key), '');
      return chooser(key, [['', 'mean over all'], ...values(key)], held[key], (value) => { held[key] = value; shown.draw(); }).label;
    }));
  };
  const change = (key) => (value) => { state[key] = value; fillHeld(); shown.draw(); };
  const log = make('input', { type: 'checkbox', checked: state.log, change: () => { state.log = log.checked; shown.draw(); } });
  part.append(make('div', { class: 'controls' }, chooser('Along', varying, state.x, change('x')).label, chooser('Column', columns, state.y, change('y')).label, chooser('Lines', series, state.series, change('series')).label,
    make('label', {}, log, 'logarithmic')), holders);
  // [name of the line, column] of a point: one, or one for each scheme.
  const linesOf = (point) => {
    if (state.series !== 'scheme') return [[state.series === state.x ? state.y : String(point.axis[state.series]), state.y]];
    const [baseline, , ...counter] = state.y.split('.');
    return baseline === 'baseline' ? schemes.map((scheme) => [scheme, ['baseline', scheme, ...counter].join('.')]) : [[state.y, state.y]];
  };
  // A mean is over the same points at every place of a line; otherwise it would depend on the choice of points. So combinations of the
  // other axes that are missing somewhere along the line are left out.
  const others = () => varying.filter((key) => key !== state.x && (state.series === 'scheme' || key !== state.series));
  const slice = (point) => JSON.stringify(others().filter((key) => !moveTogether(points, key, state.x)).map((key) => point.axis[key]));
  function complete() {
    const places = new Set(points.map((point) => String(point.axis[state.x]))), seen = new Map();
    for (const point of points) { const key = slice(point) + (state.series === 'scheme' ? '' : point.axis[state.series]); seen.set(key, (seen.get(key) || new Set()).add(String(point.axis[state.x]))); }
    return state.series === state.x ? null : new Set([...seen].filter(([, at]) => at.size === places.size).map(([key]) => key));
  }
  const partial = make('p', { class: 'note', hidden: true }, 'A search left no combination of the other axes complete along the line, so each of its places is a mean over other points. Hold an axis to compare like with like.');
  part.append(partial);
  const rows = () => {
    const groups = new Map(), whole = complete(), used = whole && whole.size > 0 ? whole : null;
    partial.hidden = !whole || whole.size > 0;
    for (const point of points) {
      if (used && !used.has(slice(point) + (state.series === 'scheme' ? '' : point.axis[state.series]))) continue;
      if (Object.entries(held).some(([key, value]) => value !== '' && String(point.axis[key]) !== value)) continue;
      for (const [line, column] of linesOf(point)) {
        if (point.mean[column] === undefined) continue;
        const key = JSON.stringify([point.axis[state.x], line]);
        if (!groups.has(key)) groups.set(key, { x: point.axis[state.x], series: line, sum: 0, count: 0 });
        const group = groups.get(key);
        group.sum += point.mean[column];
        group.count += 1;
      }
    }
    return [...groups.values()].map((group) => ({ ...group, y: group.sum / group.count, says: `${state.x} = ${group.x}, ${group.series}: ${number(group.sum / group.count)}` }))
      .filter((row) => !state.log || row.y > 0).sort((a, b) => inOrder(a.x, b.x) || inOrder(Number(a.series), Number(b.series)) || 0);
  };
  fillHeld();
  const shown = plot(part, 'A column of the study along one of its axes', () => lines(rows(), { x: state.x, y: state.series === 'scheme' ? state.y.replace(/^baseline\.[^.]*/, 'baseline.*') : state.y, series: state.series, log: state.log, even: true, order: state.series === 'scheme' || state.series === state.x ? undefined : valuesOfAxis(points, state.series) }));
}

// Values of an axis as texts: numbers in their order, because searches and samples meet them in none, others as they come.
function valuesOfAxis(points, key) {
  const values = [...new Set(points.map((point) => point.axis[key]))];
  if (values.every((value) => typeof value === 'number')) values.sort((a, b) => a - b);
  return values.map(String);
}
function inOrder(a, b) { return typeof a === 'number' && typeof b === 'number' ? a - b : 0; }

// Whether two axes are set together: each value of one goes with one value of the other.
function moveTogether(points, a, b) {
  const seen = new Map();
  return points.every((point) => {
    const key = String(point.axis[a]), value = String(point.axis[b]);
    if (!seen.has(key)) seen.set(key, value);
    return seen.get(key) === value;
  }) && seen.size === new Set(seen.values()).size;
}

function purposeSection({ points, known, varying }) {
  const names = known.filter((name) => name.startsWith('dram.') && name.split('.').length === 4);
  if (names.length === 0) return;
  const part = section('purposes', 'Memory traffic by purpose');
  const most = 80, shown = points.slice(0, most);
  if (points.length > most) part.append(make('p', { class: 'note' }, `The first ${most} of ${points.length} points.`));
  // Few points are named by their values, of axes set together once.
  const keys = varying.filter((key, k) => !varying.slice(0, k).some((other) => moveTogether(points, other, key)));
  const named = shown.length <= 24, place = (point) => (named ? keys.map((key) => point.axis[key]).join(' / ') || 'all' : point.index);
  const purposes = Object.keys(kPurposeColors), bytes = (point, purpose) => names.filter((name) => name.split('.')[2] === purpose).reduce((sum, name) => sum + (point.mean[name] || 0), 0);
  const rows = shown.flatMap((point) => purposes.map((purpose) => ({ at: place(point), part: purpose, value: bytes(point, purpose) })).filter((row) => row.value > 0));
  plot(part, 'Bytes over the memory interface for each point, by purpose', () => stackedBars(rows, { x: named ? keys.join(' / ') : 'point', y: 'traffic', unit: 'bytes', part: 'purpose', colors: kPurposeColors, names: purposeName }));
}
