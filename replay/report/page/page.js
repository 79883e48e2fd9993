// The parts that all reports share: faults that must be shown, packed data, small pieces of document.
'use strict';

document.body.dataset.errors = '0';
function complain(message) {
  document.body.dataset.errors = String(Number(document.body.dataset.errors) + 1);
  const line = document.createElement('p');
  line.className = 'error';
  line.textContent = 'This report has a fault: ' + message;
  document.body.prepend(line);
}
window.addEventListener('error', (event) => complain(event.message));
window.addEventListener('unhandledrejection', (event) => complain(String((event.reason && event.reason.stack) || event.reason)));

// The data that the page shows; ready when pageReady is done.
let data = null;

// An element with attributes (functions become listeners) and children; texts never become markup.
function make(name, attributes = {}, ...children) {
  return fill(document.createElement(name), attributes, children);
}
function draw(name, attributes = {}, ...children) {
  return fill(document.createElementNS('http://www.w3.org/2000/svg', name), attributes, children);
}
function fill(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(key, value);
    else if (value !== undefined && value !== null && value !== false) element.setAttribute(key, value === true ? '' : String(value));
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined).map((child) => (typeof child === 'number' ? String(child) : child)));
  return element;
}

const main = document.getElementById('main');

// The text after "#" chooses the first view: report.html#section=curves&curves.column=NAME; docs/studies.md lists the names.
const wanted = new URLSearchParams(location.hash.slice(1));
function wantedOf(name, allowed, otherwise) { return allowed.map(String).includes(wanted.get(name)) ? wanted.get(name) : otherwise; }

// A section with a heading, named in the contents.
function section(id, title, note) {
  const part = make('section', { id, 'aria-labelledby': id + '-title' }, make('h2', { id: id + '-title' }, title), note ? make('p', { class: 'note' }, note) : null);
  main.append(part);
  document.getElementById('contents').append(make('a', { href: '#' + id }, title));
  return part;
}

function style(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
const darkness = window.matchMedia('(prefers-color-scheme: dark)');

// Calls `then` in the frame after an element changed its size: a change of the layout in the observer itself is an error.
function whenResized(element, then) { new ResizeObserver(() => requestAnimationFrame(then)).observe(element); }

function chooser(label, options, chosen, change) {
  const select = make('select', { pointerenter: () => named(), change: () => { named(); change(select.value); } });
  // A list that is too narrow for its choice shows all of it in its title, and when it is open.
  const named = () => { select.title = select.selectedOptions.length > 0 ? select.selectedOptions[0].text : ''; };
  for (const option of options) {
    const [value, text] = Array.isArray(option) ? option : [option, option];
    select.append(make('option', { value, selected: String(value) === String(chosen) }, text));
  }
  named();
  return { label: make('label', {}, label, select), select };
}

// A tooltip that follows the pointer and the focus: `says()` gives lines, or null. One for the page.
const hint = make('div', { class: 'hint', role: 'tooltip', 'aria-live': 'polite', hidden: true });
document.body.append(hint);
function showHint(lines, x, y) {
  if (!lines || lines.length === 0) { hint.hidden = true; return; }
  hint.replaceChildren(...lines.map((line, index) => make(index === 0 ? 'strong' : 'div', {}, line)));
  hint.hidden = false;
  const room = hint.getBoundingClientRect();
  hint.style.left = Math.max(4, Math.min(x + 14, document.documentElement.clientWidth - room.width - 8)) + 'px';
  hint.style.top = Math.max(4, y + room.height + 24 > window.innerHeight ? y - room.height - 10 : y + 16) + 'px';
}
function hinted(element, says) {
  element.addEventListener('pointermove', (event) => showHint(says(), event.clientX, event.clientY));
  element.addEventListener('pointerleave', () => showHint(null));
  element.addEventListener('focus', () => { const at = element.getBoundingClientRect(); showHint(says(), at.left, at.bottom - 10); });
  element.addEventListener('blur', () => showHint(null));
}

// columns: [{title, of(row), wide, show(value, row), bar}]; a press on a heading sorts by it, numbers in falling order first.
// `press(row)` makes rows selectable: they are one stop of the Tab key, and arrow keys go between them. `chosen(row)` tells the selected
// one. Rows in which all columns with `zero` are 0 are folded.
function table(columns, rows, { press, chosen, sort = -1, up = true, limit = Infinity, label = 'Table' } = {}) {
  const body = make('tbody');
  const folds = columns.filter((column) => column.zero);
  const nothing = (row) => folds.length > 0 && folds.every((column) => !column.of(row));
  const full = rows.filter((row) => !nothing(row)), folded = rows.length - full.length;
  let all = false, order = full.slice();
  const most = columns.map((column) => (column.bar ? Math.max(1e-300, ...full.map((row) => column.of(row) || 0)) : 1));
  const numbers = columns.map((column) => rows.slice(0, 20).some((row) => typeof column.of(row) === 'number'));
  const cell = (column, row, c) => {
    const value = column.of(row), numeric = typeof value === 'number' || (numbers[c] && !column.wide);
    const text = column.show ? column.show(value, row) : number(value);
    const made = make('td', { class: numeric ? 'number' : column.wide ? 'wide' : undefined }, text);
    if (column.bar && typeof value === 'number') made.style.backgroundImage = `linear-gradient(to left, var(--bar) ${(100 * value / most[c]).toFixed(1)}%, transparent 0)`;
    if (column.title_of) made.title = column.title_of(row);
    return made;
  };
  // The row at which the Tab key stops.
  const stopAt = (line) => { for (const other of body.children) other.tabIndex = other === line ? 0 : -1; };
  const show = () => {
    body.replaceChildren(...order.slice(0, all ? Infinity : limit).map((row) => {
      const line = make('tr', { class: chosen && chosen(row) ? 'chosen' : undefined }, ...columns.map((column, c) => cell(column, row, c)));
      if (press) {
        line.tabIndex = -1;
        const choose = () => { body.querySelectorAll('.chosen').forEach((other) => other.classList.remove('chosen')); line.classList.add('chosen'); stopAt(line); press(row); };
        line.addEventListener('click', choose);
        line.addEventListener('keydown', (event) => {
          const to = { ArrowDown: line.nextElementSibling, ArrowUp: line.previousElementSibling, Home: body.firstElementChild, End: body.lastElementChild }[event.key];
          if (event.target !== line || (to === undefined && event.key !== 'Enter' && event.key !== ' ')) return;
          event.preventDefault();
          if (to === undefined) choose();
          else if (to) { stopAt(to); to.focus(); }
        });
      }
      return line;
    }));
    if (press) stopAt(body.querySelector('.chosen') || body.firstElementChild);
    const left = order.length - body.children.length;
    const notes = [];
    if (left > 0) notes.push(make('button', { type: 'button', click: () => { all = true; show(); } }, `${left} more row${left === 1 ? '' : 's'}`));
    if (folded > 0) notes.push(all && left === 0 && order.length === rows.length ? '' : make('button', { type: 'button', click: () => { all = true; order = rows.slice(); sortBy(sort, up); show(); } }, `${folded} row${folded === 1 ? '' : 's'} of zeros`));
    foot.replaceChildren(...(order.length === rows.length ? notes.slice(0, left > 0 ? 1 : 0) : notes));
    foot.hidden = foot.childNodes.length === 0;
  };
  const compare = (a, b) => (typeof a === 'number' && typeof b === 'number' ? a - b : String(a ?? '').localeCompare(String(b ?? '')));
  const sortBy = (index, ascending) => {
    if (index < 0) return;
    order.sort((a, b) => (ascending ? 1 : -1) * compare(columns[index].of(a), columns[index].of(b)));
    heads.forEach((head, h) => { if (h === index) head.setAttribute('aria-sort', ascending ? 'ascending' : 'descending'); else head.removeAttribute('aria-sort'); });
  };
  const heads = columns.map((column, index) => {
    const numeric = numbers[index];
    return make('th', { scope: 'col', class: numeric ? 'number' : undefined }, make('button', {
      type: 'button', title: column.help, click: () => { up = sort === index ? !up : !numeric; sort = index; sortBy(sort, up); show(); } }, column.title));
  });
  const foot = make('div', { class: 'foot' });
  sortBy(sort, up);
  show();
  return make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, make('table', {}, make('thead', {}, make('tr', {}, ...heads)), body), foot);
}

// Why one run takes longer than another: a cause and its parts, as in `tessera compare`.
function causeList(cause) {
  const list = (parts) => make('ul', {}, ...parts.map((part) => make('li', {}, part.text, part.parts ? list(part.parts) : null)));
  return make('div', { class: 'why' }, make('p', { class: 'verdict' }, cause.text), cause.parts ? list(cause.parts) : null);
}

// {a: {b: 1}} as [["a.b", 1]].
function flatten(value, name = '') {
  if (value === null || typeof value !== 'object' || Array.isArray(value)) return [[name, Array.isArray(value) ? value.join(', ') : value]];
  return Object.entries(value).flatMap(([key, inner]) => flatten(inner, name ? name + '.' + key : key));
}

// The configuration in full: tables of keys, and the JSON itself.
function configurationParts(parts) {
  return [...parts.map(([title, value]) => make('details', {}, make('summary', {}, title), table([
    { title: 'key', of: (row) => row[0] },
    { title: 'value', of: (row) => (typeof row[1] === 'boolean' ? String(row[1]) : row[1]), show: (value) => (typeof value === 'number' ? plain(value) : String(value ?? '')) },
    { title: 'unit', of: (row) => (data.keys[row[0]] || {}).unit || '' },
    { title: 'meaning', of: (row) => (data.keys[row[0]] || {}).meaning || '', wide: true }], flatten(value)))),
  make('details', {}, make('summary', {}, 'The same as JSON'), make('pre', { tabindex: 0, role: 'region', 'aria-label': 'The configuration as JSON' }, JSON.stringify(Object.fromEntries(parts), null, 1)))];
}
function configurationSection(parts) {
  const part = section('configuration', 'Configuration');
  if (parts.length > 0) part.append(...configurationParts(parts));
  return part;
}
