// The page of `tessera view`: a panel that changes settings and numbers of the machine, above the report of the newest
// result. data.view: {keys: rows of `tessera describe` with "start" and "timing", frames: [first, count], result, history, state,
// without: ViewSession::left_out()}.

const viewReport = (() => {
// Keys of the panel at the start, frequently used ones first; any other key can be added.
const kFirstKeys = ['clock.mhz', 'memory.channels', 'memory.type', 'tilecore.count', 'shader.lanes', 'l2.bytes', 'tile.width', 'tile.height', 'sampling.samples_per_pixel', 'frontend.split_pixels', 'shading.rate', 'resolve.desampling', 'machine.timing'];
// Values at which a slider stops: common hardware values, rather than steps of five per cent.
const kStops = {
  'tile.width': [8, 16, 24, 32, 40, 48, 64, 96, 128], 'tile.height': [8, 16, 24, 32, 40, 48, 64, 96, 128],
  'sampling.samples_per_pixel': [1, 2, 4, 8, 16, 32, 64], 'frontend.split_pixels': [4, 8, 16, 32, 64, 128, 256, 512, 1024],
};

// The values at which a key's slider stops, the value at the start among them.
function stopsOf(key) {
  const { start, min, max } = key, inside = (value) => value >= min && value <= max;
  const powers = (low, high) => { const out = []; for (let value = low; value <= high; value *= 2) out.push(value); return out; };
  let stops;
  if (kStops[key.key]) stops = kStops[key.key];
  else if (min < 0) stops = Array.from({ length: 33 }, (_, k) => min + (max - min) * k / 32);
  else if (start === 0) stops = [0, ...powers(key.type === 'integer' ? 1 : 1 / 64, Math.min(max, 1024))];
  else if (key.type === 'integer' && key.unit === 'bytes') stops = powers(start / 16, start * 16).map(Math.round);
  else if (key.type === 'integer' && start <= 32) stops = Array.from({ length: Math.max(16, 4 * start) }, (_, k) => k + 1);
  else stops = Array.from({ length: 76 }, (_, k) => start * (25 + 5 * k) / 100).map((value) => (key.type === 'integer' ? Math.round(value) : Number(value.toPrecision(6))));
  return [...new Set([...stops.filter(inside), start])].sort((a, b) => a - b);
}

// "+30 %", "-5.2 %"; "" where nothing changed.
function against(value, before) {
  if (typeof value !== 'number' || typeof before !== 'number' || before === 0 || value === before) return '';
  const by = 100 * (value / before - 1);
  return `${by > 0 ? '+' : '\u2212'}${Math.abs(by) >= 100 ? Math.abs(by).toFixed(0) : Number(Math.abs(by).toPrecision(2))}\u202f%`;
}

// The members of a result's summary on cards and in the history; `less` is better.
const kCards = [
  { title: 'frame time', unit: 'ms', of: (s) => s.ms, less: true, tried: true }, { title: 'frame rate', unit: 'frames/s', of: (s) => 1000 / s.ms, less: false },
  { title: 'energy', unit: 'nJ', of: (s) => s.energy_nj, less: true, tried: true }, { title: 'memory traffic', unit: 'bytes', of: (s) => s.dram_bytes, less: true, tried: true },
  { title: 'bandwidth used', unit: 'GB/s', of: (s) => s.dram_bytes * 1e-6 / s.ms }];

const valueText = (value) => (typeof value === 'number' ? number(value) : String(value));

// ---- Asking the program -------------------------------------------------------------------------------------------

// One request at a time; changes made meanwhile are sent together, newest values only.
function asker(told) {
  let waiting = null, busy = false, revision = 0;
  async function send() {
    busy = true;
    while (waiting) {
      const { changes, keep } = waiting;
      waiting = null;
      try {
        const reply = await fetch(keep ? 'set' : 'try', { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(changes) });
        const body = await reply.json();
        if (body.error) told(body.error);
        else { told(''); revision = Math.max(revision, body.revision); }
      } catch (error) {
        told('tessera view does not answer: it has ended, or the machine is very busy');
      }
    }
    busy = false;
  }
  return {
    ask(changes, keep) {
      waiting = { changes: { ...(waiting ? waiting.changes : {}), ...changes }, keep: keep || (waiting !== null && waiting.keep) };
      if (!busy) send();
    },
    // Whether a result belongs to the last request.
    answers: (result) => !busy && waiting === null && result.revision >= revision,
  };
}

// ---- One key ------------------------------------------------------------------------------------------------------

// A row of the panel: the control of a key, its meaning, and the way back. show(value) follows changes by other controls.
function keyRow(key, ask) {
  const delta = make('span', { class: 'delta' }), name = key.key;
  const change = (value, keep) => { delta.textContent = against(value, key.start); ask({ [name]: value }, keep); };
  const parts = [];
  let show;
  if (key.type === 'choice') {
    const select = make('select', { 'aria-label': name, change: () => change(select.value, true) }, ...key.choices.map((choice) => make('option', { value: choice }, choice)));
    parts.push(select);
    show = (value) => { select.value = value; };
  } else if (key.type === 'boolean') {
    const box = make('input', { type: 'checkbox', 'aria-label': name, change: () => change(box.checked, true) });
    parts.push(box);
    show = (value) => { box.checked = value; };
  } else {
    const stops = stopsOf(key);
    const slider = make('input', { type: 'range', min: 0, max: stops.length - 1, step: 1, 'aria-label': name,
      input: () => { const value = stops[Number(slider.value)]; field.value = value; slider.setAttribute('aria-valuetext', `${value} ${key.unit}`); change(value, false); },
      change: () => change(stops[Number(slider.value)], true) });
    const field = make('input', { type: 'number', min: key.min, max: key.max, step: key.type === 'integer' ? 1 : 'any', 'aria-label': `${name}, exactly`, change: () => { if (field.value !== '') change(Number(field.value), true); } });
    parts.push(slider, field, make('span', { class: 'unit' }, key.unit));
    show = (value) => {
      let nearest = 0;
      stops.forEach((stop, index) => { if (Math.abs(stop - value) < Math.abs(stops[nearest] - value)) nearest = index; });
      slider.value = nearest;
      slider.setAttribute('aria-valuetext', `${value} ${key.unit}`);
      field.value = value;
    };
  }
  const back = make('button', { type: 'button', title: `Back to ${valueText(key.start)}`, 'aria-label': `${name}: back to ${valueText(key.start)}`, click: () => ask({ [name]: null }, true) }, '\u21ba');
  const range = key.type === 'choice' || key.type === 'boolean' ? '' : `${number(key.min)} to ${number(key.max)}`;
  const line = make('div', { class: 'key', 'data-key': name },
    make('span', { class: 'name', title: `${key.meaning} ${range ? range + '; d' : 'D'}efault ${valueText(key.default)}.` }, name), make('span', { class: 'ways' }, ...parts), delta, back,
    make('span', { class: 'note' }, `${key.timing ? 'timed' : 'rendered'}${range ? ', ' + range : ''}, default ${valueText(key.default)}`));
  const follow = (value) => { show(value); delta.textContent = against(value, key.start); back.disabled = value === key.start; };
  follow(key.start);
  return { key, line, show: follow };
}

// ---- Leave-one-out ------------------------------------------------------------------------------------------------

// The frame without each drawable, or without one: the program measures it on request. `frameOf`: the newest frame of stats.json.
// show(state) follows ViewSession::left_out(); reset() follows a new result.
function leaveOneOut(frameOf) {
  const holder = make('div'), state = make('p', { class: 'state', 'aria-live': 'polite' }), fault = make('p', { class: 'error', role: 'alert' });
  const which = make('select', { 'aria-label': 'Drawable that is left out' });
  const post = async (path, body) => {
    try {
      const answer = await (await fetch(path, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) })).json();
      fault.textContent = answer.error || '';
    } catch (error) {
      fault.textContent = 'tessera view does not answer: it has ended, or the machine is very busy';
    }
  };
  const measure = make('button', { type: 'button', class: 'measure', click: () => post('without', which.value === '' ? {} : JSON.parse(which.value)) }, 'Measure');
  const cancel = make('button', { type: 'button', class: 'cancel', disabled: true, click: () => post('cancel', {}) }, 'Cancel');
  const nameOf = (row) => [row.node, row.material].filter(Boolean).join(' · ');
  let known = '';
  function reset() {
    const drawables = frameOf().drawables.filter((row) => row.node || row.material), names = JSON.stringify(drawables.map(nameOf));
    if (names === known) return;
    known = names;
    which.replaceChildren(make('option', { value: '' }, `each of ${drawables.length} drawables`), ...drawables.map((row) => make('option', { value: JSON.stringify({ node: row.node, material: row.material }) }, nameOf(row))));
  }
  function show(now) {
    if (!now.phase) return;
    const measuring = now.phase === 'measuring', frame = frameOf(), { cycles, time_ms: ms } = frame.timing, energy = frame.energy.total_nj;
    cancel.disabled = !measuring;
    measure.disabled = measuring;
    const count = now.all ? ` ${now.done} of ${now.all}` : '', current = now.revision === Number(document.body.dataset.revision);
    state.textContent = measuring ? `rendering without each${count}\u2026` : now.phase === 'cancelled' ? `cancelled after${count || ' 0'}` : now.phase === 'done' ? `measured${count}` : '';
    fault.textContent = now.error || '';
    holder.dataset.phase = now.phase;
    // Figures of another result than the shown one cannot be compared with it.
    if (!current) { state.textContent += now.rows.length > 0 ? `; for no. ${now.revision}, which is not shown` : ''; holder.replaceChildren(); return; }
    const attributed = new Map(frame.drawables.map((row) => [nameOf(row), row.cycles]));
    if (now.rows.length === 0) { holder.replaceChildren(); return; }
    holder.replaceChildren(table([{ title: 'without', of: nameOf, wide: true }, { title: 'saves, ms', of: (row) => ms * (1 - row.cycles / cycles), show: (value) => value.toPrecision(3), bar: true }, { title: 'saves', of: (row) => 1 - row.cycles / cycles, show: (value) => percent(value) },
      { title: 'attributed', of: (row) => (attributed.get(nameOf(row)) ?? 0) / cycles, show: (value) => percent(value) }, { title: 'ms without', of: (row) => ms * row.cycles / cycles, show: (value) => value.toPrecision(4) },
      { title: 'saves energy', of: (row) => 1 - row.energy_nj / energy, show: (value) => percent(value) }, { title: 'DRAM bytes without', of: (row) => row.dram_bytes }], now.rows, { label: 'Cost of the frame without each drawable' }));
  }
  return { parts: [make('h3', {}, 'Without each drawable'), make('p', { class: 'note' }, 'Renders and times the frame again without a drawable, as tessera replay --without does: the frame then draws the surfaces that it hid. A change of the settings ends it.'),
    make('div', { class: 'controls' }, which, measure, cancel), state, fault, make('div', { class: 'without' }, holder)], show, reset };
}

// ---- The panel ----------------------------------------------------------------------------------------------------

function viewReport() {
  const view = data.view, keys = Object.fromEntries(view.keys.map((key) => [key.key, key]));
  const part = section('view', 'What if');
  const cards = make('div', { class: 'cards', 'aria-live': 'polite' }), notice = make('p', { class: 'note' }), state = make('p', { class: 'state', 'aria-live': 'polite' }), fault = make('p', { class: 'error', role: 'alert' });
  const list = make('div', { class: 'keys' }), image = make('img', { alt: 'the frame' });
  const command = make('pre', { class: 'command' }), without = leaveOneOut(() => latestStats.frames[0]), tried = make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Settings tried' });
  const asking = asker((text) => { fault.textContent = text; if (text) follow(latest); });
  const rows = new Map();
  let latest = view.result, history = view.history, latestStats = data.stats, measured = view.without;

  const add = (name) => {
    if (!keys[name] || rows.has(name)) return;
    const row = keyRow(keys[name], asking.ask);
    rows.set(name, row);
    list.append(row.line);
  };
  kFirstKeys.forEach(add);
  const names = make('datalist', { id: 'view-keys' }, ...view.keys.map((key) => make('option', { value: key.key }, key.meaning)));
  const field = make('input', { type: 'text', list: 'view-keys', size: 32, 'aria-label': 'Another key', placeholder: 'another key' });
  const more = make('form', { class: 'controls', submit: (event) => {
    event.preventDefault();
    const name = field.value.trim();
    if (name === '') return;
    if (!keys[name]) { asking.ask({ [name]: null }, false); return; }  // the program names the nearest key
    add(name);
    follow(latest);
    field.value = '';
  } }, field, make('button', { type: 'submit' }, 'Add'), names);
  const frame = make('input', { type: 'number', min: 0, step: 1, 'aria-label': 'Frame', change: () => { if (frame.value !== '') asking.ask({ frame: Number(frame.value) }, true); } });
  const all = make('button', { type: 'button', click: () => asking.ask(Object.fromEntries([...Object.keys(latest.changes), 'frame'].map((name) => [name, null])), true) }, 'All as at the start');
  const copy = make('button', { type: 'button', click: () => navigator.clipboard.writeText(command.textContent).then(() => { copy.textContent = 'Copied'; setTimeout(() => { copy.textContent = 'Copy'; }, 1500); }) }, 'Copy');

  part.append(cards, state, notice, fault, make('div', { class: 'sides' }, make('div', {}, list, more, make('div', { class: 'controls' }, make('label', {}, `Frame (${view.frames[1] > 1 ? `${view.frames[0]} to ${view.frames[0] + view.frames[1] - 1}` : `${view.frames[0]}, the only one`})`, frame), all)), image),
    make('h3', {}, 'As a command line'), make('div', { class: 'controls' }, copy), command, make('h3', {}, 'Settings tried'), tried, ...without.parts);

  function fillCards() {
    const start = history[0].summary;
    cards.replaceChildren(...kCards.map((card) => {
      const value = card.of(latest.summary), before = card.of(start), way = value === before || card.less === undefined ? '' : (value < before) === card.less ? 'better' : 'worse';
      return make('div', { class: 'card' }, make('span', { class: 'note' }, card.title), make('strong', {}, quantity(value, card.unit, 4)), make('span', { class: 'delta ' + way }, against(value, before) || '\u00a0'));
    }), make('div', { class: 'card' }, make('span', { class: 'note' }, 'bound by'), make('strong', {}, latest.summary.bound_by || '-'), make('span', { class: 'delta' }, latest.summary.bound_by === start.bound_by ? '\u00a0' : `before: ${start.bound_by}`)),
      latest.summary.coarser_models.length > 0 ? make('p', { class: 'note' }, `Times and energies come from ${latest.summary.coarser_models.join(' and ')}, which is coarser than the default.`) : '');
  }
  function fillTried() {
    const start = history[0].summary, shownCards = kCards.filter((card) => card.tried);
    const words = (entry) => Object.entries(entry.changes).map(([key, value]) => `${key}=${value}`).concat(entry.frame === history[0].frame ? [] : [`frame ${entry.frame}`]).join(' ') || 'the start';
    const cells = (entry) => shownCards.flatMap((card) => [make('td', { class: 'number' }, quantity(card.of(entry.summary), card.unit, 4)), make('td', { class: 'delta' }, against(card.of(entry.summary), card.of(start)))]);
    tried.replaceChildren(make('table', {}, make('thead', {}, make('tr', {}, make('th', {}, 'no.'), make('th', {}, 'settings'), ...shownCards.flatMap((card) => [make('th', { class: 'number' }, card.title), make('th', { title: 'against the start' }, '\u0394')]), make('th', {}, 'bound by'), make('th', {}, 'how'))),
      make('tbody', {}, ...history.slice().reverse().map((entry) => make('tr', { class: entry.revision === latest.revision ? 'chosen' : undefined }, make('td', { class: 'number' }, entry.revision),
        make('td', { class: 'wide' }, make('button', { type: 'button', title: 'Back to this', click: () => goBack(entry) }, words(entry))), ...cells(entry), make('td', {}, entry.summary.bound_by), make('td', {}, `${entry.rendered ? 'rendered' : 'timed'} in ${entry.seconds.toFixed(2)} s`))))));
  }
  function goBack(entry) {
    const others = Object.keys(latest.changes).filter((key) => !(key in entry.changes)).map((key) => [key, null]);
    asking.ask({ ...Object.fromEntries(others), ...entry.changes, frame: entry.frame }, true);
  }
  // Sliders as the result has them.
  function follow(result) {
    rows.forEach((row, name) => row.show(name in result.changes ? result.changes[name] : row.key.start));
    frame.value = result.frame;
  }
  function sayState(now) {
    const done = `${latest.rendered ? 'rendered' : 'timed'} in ${latest.seconds.toFixed(2)} s${latest.stale ? '; counters follow' : ''}`;
    if (now.phase === 'failed') fault.textContent = now.error;
    state.textContent = now.phase === 'rendering' ? `rendering${now.tiles ? ` ${now.done} of ${now.tiles} tiles` : ''}\u2026` : now.phase === 'timing' ? 'timing\u2026' : now.phase === 'failed' ? `shown: no. ${latest.revision}, ${done}` : done;
    document.body.dataset.phase = now.phase;
  }
  function showResult(stats) {
    fillCards();
    fillTried();
    command.textContent = latest.command;
    notice.textContent = stats.gpu_notices.join(' ');
    const address = `image/${latest.image}.png`;
    if (image.getAttribute('src') !== address) image.src = address;
    if (asking.answers(latest)) {
      Object.keys(latest.changes).forEach(add);
      follow(latest);
    }
    document.body.dataset.revision = String(latest.revision);
    document.body.dataset.rendered = String(latest.rendered);
    latestStats = stats;
    without.reset();
    without.show(measured);
  }
  data.runs = [{ label: '', stats: data.stats, views: data.views }];
  learnMaps(data.views);
  showResult(data.stats);
  follow(latest);
  sayState(view.state);
  const steps = replayReport();

  const events = new EventSource('events');
  const told = (name, use) => events.addEventListener(name, (event) => use(JSON.parse(event.data)));
  told('result', (news) => {
    if (news.result.revision < latest.revision) return;
    const again = news.result.revision === latest.revision && news.result.rendered === latest.rendered;
    latest = news.result;
    history = news.history;
    showResult(news.stats);
    if (!again) redrawReport(news.stats, news.views);
  });
  told('state', sayState);
  told('without', (now) => { measured = now; without.show(now); });
  events.addEventListener('error', () => { state.textContent = 'tessera view does not answer'; document.body.dataset.phase = 'lost'; });
  return steps;
}

// The report below the panel, once sliders rest for a moment: drawing it takes longer than timing a frame.
let redrawTimer = 0;
function redrawReport(stats, views) {
  clearTimeout(redrawTimer);
  redrawTimer = setTimeout(() => {
    data.stats = stats;
    data.views = views;
    update(stats, views);
  }, 100);
}
return viewReport;
})();
