// Over the frames of a replay: mean, median, 95th percentile and worst of each figure, its curve, and the slowest frame.

// The value that `part` of the values do not exceed, by nearest rank.
function percentile(values, part) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil(part * sorted.length) - 1)];
}
// A figure over all frames of a run: {mean, median, tail, worst, at}, `tail` the 95th percentile from its better end, `at` the index of
// the worst frame. null where no frame has it.
function spreadOf(figure, at = shown) {
  const rows = framesOf(at).map((frame, index) => ({ index, value: figure.of(frame, at) })).filter((row) => row.value !== null);
  if (rows.length === 0) return null;
  const values = rows.map((row) => row.value), sign = -figure.better;
  const worst = rows.reduce((a, b) => (sign * b.value > sign * a.value ? b : a));
  return { mean: values.reduce((a, b) => a + b, 0) / values.length, median: percentile(values, 0.5), tail: sign * percentile(values.map((value) => sign * value), 0.95), worst: worst.value, at: worst.index };
}
const slowestFrame = () => { const spread = spreadOf(kFigures[0]); return spread ? spread.at : shown.frame; };

function rateSection() {
  if (framesOf().length < 2 || !frameOf().timing) return;
  const part = section('rates', 'Over the frames'), holder = make('div'), figures = kFigures.filter((figure) => spreadOf(figure));
  const named = (key) => figures.find((figure) => figure.key === key);
  let chosen = wantedOf('rates.figure', figures.map((figure) => figure.key), 'ms');
  const pick = chooser('Curve', figures.map((figure) => [figure.key, figure.title]), chosen, (value) => { chosen = value; chart.draw(); });
  part.append(holder, make('div', { class: 'controls' }, pick.label));
  const rows = () => {
    const figure = named(chosen), sides = [shown, ...(shown.other && shown.other.run !== shown.run ? [shown.other] : [])];
    return sides.flatMap((at) => framesOf(at).map((frame) => ({ x: frame.frame, y: figure.of(frame, at), series: run(at).label, says: `frame ${frame.frame}: ${quantity(figure.of(frame, at), figure.unit)}` })).filter((row) => row.y !== null));
  };
  const chart = plot(part, 'The chosen figure over the frames', () => {
    const all = rows(), several = new Set(all.map((row) => row.series)).size > 1;
    return lines(all, { x: 'frame', y: named(chosen).title, unit: named(chosen).unit, series: several ? 'run' : '', step: 1 });
  }, (datum) => { const index = framesOf().findIndex((frame) => frame.frame === datum.x); if (index >= 0) show({ frame: index }); });
  const why = make('div');
  part.append(why);
  follow(why, ['run'], () => {
    const of = (data.why_slowest || [])[shown.run];
    why.replaceChildren(...(of ? [make('h3', {}, `Why frame ${of.frame} (B) is the slowest, against frame ${of.median} (A) of median time`), causeList(of.why)] : []));
  });
  const entry = follow(part, ['run', 'other', 'target'], () => {
    const value = (title, key) => ({ title, of: (row) => row.spread[key], show: (number, row) => quantity(number, row.figure.unit) });
    holder.replaceChildren(table([
      { title: 'figure', of: (row) => row.figure.title }, value('mean', 'mean'), value('median', 'median'), { ...value('95th percentile', 'tail'), help: '95 of 100 frames are at least as good' }, value('worst', 'worst'),
      { title: 'worst frame', of: (row) => framesOf()[row.spread.at].frame }], figures.map((figure) => ({ figure, spread: spreadOf(figure) })),
    { press: (row) => show({ frame: row.spread.at }), label: 'Figures over the frames; a press on one shows its worst frame' }));
    chart.draw();
  });
  entry.reset = () => chart.draw();
}
