// A | B: two frames, or two runs, side by side: the keys that differ, images and figures.

// [[key, a, b]] of two configurations.
function differences(a, b) {
  const left = new Map(flatten(a)), right = new Map(flatten(b));
  return [...new Set([...left.keys(), ...right.keys()])].filter((key) => String(left.get(key)) !== String(right.get(key))).map((key) => [key, left.get(key), right.get(key)]);
}

// Lists the keys that differ between two runs. It comes after all figures, because presets differ in very many keys.
function differenceSection() {
  if (runs().length < 2) return;
  const part = section('differences', 'What differs'), holder = make('div');
  part.append(holder);
  const configuration = (at) => ({ ...run(at).stats.gpu, ...run(at).stats.settings, capture: run(at).stats.capture.file });
  const entry = follow(part, ['run', 'frame', 'other'], () => {
    const other = shown.other || firstOther(), rows = differences(configuration(shown), configuration(other));
    holder.replaceChildren(rows.length > 0 ? table([{ title: 'key', of: (row) => row[0] }, { title: `A: ${run(shown).label}`, of: (row) => row[1], show: plain }, { title: `B: ${run(other).label}`, of: (row) => row[2], show: plain },
      { title: 'unit', of: (row) => (data.keys[row[0]] || {}).unit || '' }, { title: 'meaning', of: (row) => (data.keys[row[0]] || {}).meaning || '', wide: true }], rows, { label: 'Keys that differ' }) : make('p', { class: 'note' }, 'No key differs.'));
  });
  entry.always = true;
}

function compareSection() {
  if (runs().length < 2 && framesOf().length < 2) return;
  const part = section('compare', 'A | B');
  const link = document.querySelector('#contents a[href="#compare"]');
  const figures = make('div'), images = make('div'), why = make('div');
  const left = make('img', { alt: '', decoding: 'async' }), right = make('img', { alt: '', decoding: 'async' }), canvas = make('canvas');
  const stage = make('div', { class: 'swipe' }, left, right, canvas), split = make('input', { type: 'range', min: 0, max: 100, value: 50, 'aria-label': 'Swipe between A and B', input: () => wipe() });
  const says = make('p', { class: 'note', 'aria-live': 'polite' });
  const how = chooser('Show', [['swipe', 'swipe'], ['beside', 'side by side'], ['difference', 'difference']], wantedOf('compare', ['swipe', 'beside', 'difference'], 'swipe'), () => paintImages());
  const gain = chooser('Amplify', [[1, '1×'], [4, '4×'], [16, '16×'], [64, '64×']], 4, () => paintImages());
  images.append(make('div', { class: 'controls' }, how.label, gain.label, split), stage, says);
  part.append(why, images, figures);
  const wipe = () => { right.style.clipPath = `inset(0 0 0 ${split.value}%)`; stage.style.setProperty('--at', split.value + '%'); };
  stage.addEventListener('pointermove', (event) => { if (how.select.value !== 'swipe') return; const at = stage.getBoundingClientRect(); split.value = Math.max(0, Math.min(100, 100 * (event.clientX - at.left) / at.width)); wipe(); });

  function paintImages() {
    const a = imageAddress(shown), b = shown.other ? imageAddress(shown.other) : '';
    images.hidden = !a || !b;
    if (images.hidden) return;
    const mode = how.select.value;
    stage.className = 'swipe ' + mode;
    split.hidden = mode !== 'swipe';
    gain.label.hidden = mode !== 'difference';
    left.src = a;
    right.src = b;
    left.alt = 'A: ' + nameOf(shown);
    right.alt = 'B: ' + nameOf(shown.other);
    says.textContent = mode === 'difference' ? '' : `A: ${nameOf(shown)} · B: ${nameOf(shown.other)}`;
    if (mode === 'swipe') wipe(); else right.style.clipPath = '';
    if (mode === 'difference') Promise.all([left.decode(), right.decode()]).then(paintDifference);
  }
  // The largest difference of a channel at each pixel, on a scale that stays.
  function paintDifference() {
    if (left.naturalWidth !== right.naturalWidth || left.naturalHeight !== right.naturalHeight) { says.textContent = 'The images differ in size.'; stage.className = 'swipe beside'; return; }
    const [width, height] = [left.naturalWidth, left.naturalHeight], pixels = [left, right].map((image) => {
      const pen = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d', { willReadFrequently: true });
      pen.drawImage(image, 0, 0);
      return pen.getImageData(0, 0, width, height).data;
    });
    canvas.width = width;
    canvas.height = height;
    const pen = canvas.getContext('2d'), out = pen.createImageData(width, height), by = Number(gain.select.value);
    let most = 0, sum = 0, count = 0;
    for (let k = 0; k < out.data.length; k += 4) {
      const off = Math.max(...[0, 1, 2].map((c) => Math.abs(pixels[0][k + c] - pixels[1][k + c])));
      most = Math.max(most, off);
      sum += off;
      if (off > 0) ++count;
      const color = Math.min(255, off * by);
      out.data[k] = out.data[k + 1] = out.data[k + 2] = color;
      out.data[k + 3] = 255;
    }
    pen.putImageData(out, 0, 0);
    says.textContent = `Largest difference of a channel ${most} of 255, mean ${digits(sum / (width * height))}, ${percent(count / (width * height))} of the pixels differ${data.lossy ? '; the images of this page are lossy, the files in the folder are not' : ''}.`;
  }

  const entry = follow(part, ['run', 'frame', 'other'], () => {
    part.hidden = !shown.other;
    if (link) link.hidden = !shown.other;
    if (!shown.other) return;
    const a = frameOf(), b = otherFrame(), both = kFigures.map((figure) => ({ ...figure, a: figure.of(a, shown), b: figure.of(b, shown.other) })).filter((row) => row.a !== null && row.b !== null);
    figures.replaceChildren(make('h3', {}, 'Figures'), table([{ title: 'figure', of: (row) => row.title }, { title: 'A', of: (row) => row.a, show: (value, row) => quantity(value, row.unit) }, { title: 'B', of: (row) => row.b, show: (value, row) => quantity(value, row.unit) },
      { title: 'B to A', of: (row) => (row.a ? row.b / row.a - 1 : 0), show: signedPercent }], both, { label: 'Figures of both' }));
    // The first of two runs is A; means over the frames that both have.
    const tree = shown.run === 0 && shown.other.run > 0 ? (data.why_runs || [])[shown.other.run] : null;
    why.replaceChildren(...(tree ? [make('h3', {}, `Why, over the frames that ${run(shown).label} (A) and ${run(shown.other).label} have`), causeList(tree)] : []));
    paintImages();
  });
  entry.always = true;
}
