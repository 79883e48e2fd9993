// The bar above all sections: chooses the frame, the run, and the frame or run with which it is compared.

function controlBar() {
  const several = runs().length > 1;
  const bar = make('div', { class: 'bar', role: 'group', 'aria-label': 'Frame and comparison' });
  document.querySelector('header').after(bar);
  const side = (name, at, change) => {
    const label = make('output', { class: 'which' });
    const slider = make('input', { type: 'range', min: 0, max: Math.max(0, framesOf(at()).length - 1), value: at().frame, 'aria-label': `Frame${name ? ' ' + name : ''}`, input: () => change({ ...at(), frame: Number(slider.value) }) });
    const pick = several ? chooser(name || 'Run', runs().map((of, r) => [r, of.label]), at().run, (value) => change({ run: Number(value), frame: Math.min(at().frame, runs()[Number(value)].stats.frames.length - 1) })) : null;
    const step = (by) => change({ ...at(), frame: Math.max(0, Math.min(framesOf(at()).length - 1, at().frame + by)) });
    const moves = [make('button', { type: 'button', 'aria-label': `Frame before${name ? ', ' + name : ''}`, click: () => step(-1) }, '‹'), slider,
      make('button', { type: 'button', 'aria-label': `Next frame${name ? ', ' + name : ''}`, click: () => step(1) }, '›')];
    const part = make('div', { class: 'side' }, name && !several ? make('span', {}, name) : null, pick && pick.label, ...moves, label);
    const fresh = () => {
      const count = framesOf(at()).length;
      moves.forEach((move) => { move.hidden = count === 1; });
      slider.max = count - 1;
      slider.value = at().frame;
      slider.setAttribute('aria-valuetext', `frame ${frameOf(at()).frame}`);
      label.textContent = `frame ${frameOf(at()).frame}${count === 1 ? ', the only one' : ` (${at().frame + 1} of ${count})`}`;
      if (pick) pick.select.value = at().run;
    };
    return { part, fresh };
  };
  const left = side('', () => ({ run: shown.run, frame: shown.frame }), (at) => show({ run: at.run, frame: at.frame }));
  const holder = make('div', { class: 'side' });
  const toggle = make('button', { type: 'button', 'aria-pressed': 'false', click: () => show({ other: shown.other ? null : firstOther() }) }, 'Compare A | B');
  const can = several || framesOf().length > 1;
  const slowest = framesOf().length > 1 && frameOf().timing ? [make('button', { type: 'button', click: () => show({ frame: slowestFrame() }) }, 'Slowest frame')] : [];
  bar.append(left.part, ...slowest, ...(can ? [toggle] : []), holder);
  let right = null;
  const entry = follow(bar, ['run', 'frame', 'other'], () => {
    left.fresh();
    toggle.setAttribute('aria-pressed', String(Boolean(shown.other)));
    if (shown.other && !right) {
      right = side('B', () => shown.other, (at) => show({ other: { run: at.run, frame: at.frame } }));
      holder.replaceChildren(right.part);
    }
    if (!shown.other) { right = null; holder.replaceChildren(); }
    if (right) right.fresh();
  });
  entry.always = true;
  repaint(entry);
}
// With two runs the same frame of the other; with one its next frame.
function firstOther() {
  if (runs().length > 1) { const r = shown.run === 0 ? 1 : 0; return { run: r, frame: Math.min(shown.frame, runs()[r].stats.frames.length - 1) }; }
  return { run: 0, frame: shown.frame + 1 < framesOf().length ? shown.frame + 1 : shown.frame - 1 };
}
