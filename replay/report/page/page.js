// What all reports share: faults that must not stay uncovered, small pieces of document, numbers, tables.
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
window.addEventListener('unhandledrejection', (event) => complain(String(event.reason)));

const data = JSON.parse(document.getElementById('data').textContent);

// An element with attributes (functions become listeners) and children; texts never become markup.
function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(key, value);
    else if (value !== undefined && value !== false) element.setAttribute(key, value === true ? '' : String(value));
  }
  element.append(...children.map((child) => (typeof child === 'number' ? String(child) : child)));
  return element;
}

const main = document.getElementById('main');

// What follows "#" chooses what is shown first: report.html#section=curves&curves.column=NAME; docs/studies.md lists the names.
const wanted = new URLSearchParams(location.hash.slice(1));
function wantedOf(name, allowed, otherwise) { return allowed.map(String).includes(wanted.get(name)) ? wanted.get(name) : otherwise; }

// A section with a heading, named in the contents.
function section(id, title) {
  const part = make('section', { id, 'aria-labelledby': id + '-title' }, make('h2', { id: id + '-title' }, title));
  main.append(part);
  document.getElementById('contents').append(make('a', { href: '#' + id }, title));
  return part;
}

function style(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

// "12 345 678"; fractions with four significant digits.
function number(value) {
  if (value === null || value === undefined || value === '') return '';
  if (typeof value !== 'number') return String(value);
  if (!Number.isInteger(value)) return Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3 ? value.toExponential(3) : String(Number(value.toPrecision(5)));
  return String(value).replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f');
}

function chooser(label, options, chosen, change) {
  const select = make('select', { change: () => change(select.value) });
  for (const option of options) {
    const [value, text] = Array.isArray(option) ? option : [option, option];
    select.append(make('option', { value, selected: String(value) === String(chosen) }, text));
  }
  return { label: make('label', {}, label, select), select };
}

// columns: [{title, of(row), wide}]; a press on a heading sorts by it. `press(row)` makes rows choosable.
function table(columns, rows, press) {
  const body = make('tbody');
  let order = rows.slice(), sorted = -1, up = true;
  const cell = (column, row) => {
    const value = column.of(row);
    return make('td', { class: typeof value === 'number' ? 'number' : column.wide ? 'wide' : undefined }, number(value));
  };
  const fill = () => body.replaceChildren(...order.map((row) => {
    const line = make('tr', {}, ...columns.map((column) => cell(column, row)));
    if (press) {
      line.tabIndex = 0;
      const choose = () => { body.querySelectorAll('.chosen').forEach((other) => other.classList.remove('chosen')); line.classList.add('chosen'); press(row); };
      line.addEventListener('click', choose);
      line.addEventListener('keydown', (event) => { if (event.key === 'Enter') choose(); });
    }
    return line;
  }));
  const heads = columns.map((column, index) => make('th', { scope: 'col', class: rows.length > 0 && typeof column.of(rows[0]) === 'number' ? 'number' : undefined }, make('button', {
    type: 'button', click: () => {
      up = sorted === index ? !up : true;
      sorted = index;
      const compare = (a, b) => (typeof a === 'number' && typeof b === 'number' ? a - b : String(a).localeCompare(String(b)));
      order = rows.slice().sort((a, b) => (up ? 1 : -1) * compare(column.of(a), column.of(b)));
      heads.forEach((head, h) => { if (h === index) head.setAttribute('aria-sort', up ? 'ascending' : 'descending'); else head.removeAttribute('aria-sort'); });
      fill();
    } }, column.title)));
  fill();
  return make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Table' }, make('table', {}, make('thead', {}, make('tr', {}, ...heads)), body));
}

// {a: {b: 1}} as [["a.b", 1]].
function flatten(value, name = '') {
  if (value === null || typeof value !== 'object' || Array.isArray(value)) return [[name, Array.isArray(value) ? value.join(', ') : value]];
  return Object.entries(value).flatMap(([key, inner]) => flatten(inner, name ? name + '.' + key : key));
}

// The configuration in full: a table of keys, and the JSON itself.
function configurationSection(parts) {
  const part = section('configuration', 'Configuration');
  for (const [title, value] of parts) {
    part.append(make('h3', {}, title), table([
      { title: 'key', of: (row) => row[0] },
      { title: 'value', of: (row) => (typeof row[1] === 'boolean' ? String(row[1]) : row[1]) },
      { title: 'unit', of: (row) => (data.keys[row[0]] || {}).unit || '' },
      { title: 'meaning', of: (row) => (data.keys[row[0]] || {}).meaning || '', wide: true }], flatten(value)));
  }
  part.append(make('details', {}, make('summary', {}, 'The same as JSON'), make('pre', {}, JSON.stringify(Object.fromEntries(parts), null, 1))));
}
