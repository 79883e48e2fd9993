// Looks at all elements of a page as it is drawn, and returns one text for each fault of its layout: texts and controls that
// overlap, texts that are cut, texts under 11 pixels, a page that is wider than its window, and boxes that scroll sideways
// without showing it.
(async () => {
  const kLeastText = 11, kSlack = 1.5, found = [];
  const pause = () => new Promise((resolve) => setTimeout(resolve, 250));
  document.querySelectorAll('details').forEach((part) => { part.open = true; });
  // Everything is at its place in the page: nothing is scrolled away vertically, and nothing stays in view over the rest.
  const whole = new CSSStyleSheet();
  whole.replaceSync('.scroll, .picks, pre { max-height: none !important; } .bar, .stay, .cards, .sides > img, thead th { position: static !important; }');
  document.adoptedStyleSheets = [whole];
  await pause();

  const nameOf = (element) => {
    const parts = [];
    for (let at = element; at && at !== document.body; at = at.parentElement) {
      if (at.id) { parts.unshift('#' + at.id); break; }
      const kind = at.getAttribute('class');
      parts.unshift(at.localName + (kind ? '.' + kind.trim().split(/\s+/).join('.') : ''));
    }
    return parts.slice(-4).join(' > ');
  };
  const words = (text) => `"${text.trim().replace(/\s+/g, ' ').slice(0, 60)}"`;
  const styles = new Map(), styleOf = (element) => { if (!styles.has(element)) styles.set(element, getComputedStyle(element)); return styles.get(element); };
  const hides = (value) => value === 'hidden' || value === 'clip', scrolls = (value) => value === 'auto' || value === 'scroll';
  // Part of a box that the boxes around it, which hide or scroll the rest, leave visible: {box, cut} or null. `cut`
  // says that a part is hidden where no scrolling brings it back.
  const visiblePart = (element, box) => {
    let { left, top, right, bottom } = box, cut = false, scrolled = false;
    for (let at = element; at && at !== document.documentElement; at = at.parentElement) {
      const look = styleOf(at), drawing = at.localName === 'svg' && !at.ownerSVGElement && look.overflow !== 'visible';
      if (at === element && look.display.startsWith('inline') && !drawing) continue;
      const edge = at.getBoundingClientRect();
      for (const [value, low, high] of [[look.overflowX, 'left', 'right'], [look.overflowY, 'top', 'bottom']]) {
        if (!drawing && !hides(value) && !scrolls(value)) continue;
        const outside = (low === 'left' ? left : top) < edge[low] - kSlack || (low === 'left' ? right : bottom) > edge[high] + kSlack;
        if (outside && (drawing || hides(value)) && !scrolled) cut = true;
        if (outside && scrolls(value) && !drawing) scrolled = true;
        if (low === 'left') { left = Math.max(left, edge.left); right = Math.min(right, edge.right); } else { top = Math.max(top, edge.top); bottom = Math.min(bottom, edge.bottom); }
      }
    }
    const box2 = { left, top, right, bottom };
    return { box: right - left > kSlack && bottom - top > kSlack ? box2 : null, cut };
  };
  const shownAtAll = (element) => element.checkVisibility({ opacityProperty: true, visibilityProperty: true, contentVisibilityAuto: true });

  // ---- Texts and controls, each with the boxes of its lines.
  const items = [];
  const addItem = (element, text, boxes, kind) => {
    for (const box of boxes) {
      if (box.width < kSlack || box.height < kSlack || box.right < 0 || box.bottom < 0) continue;
      const { box: left, cut } = visiblePart(element, box);
      if (cut) found.push(`cut: ${nameOf(element)}: ${words(text)}`);
      // A line's box is higher than its letters.
      if (left) items.push({ element, text, kind, left: left.left + 1, right: left.right - 1, top: left.top + (kind === 'text' ? box.height * 0.2 : 1), bottom: left.bottom - (kind === 'text' ? box.height * 0.2 : 1) });
    }
  };
  const pen = document.createElement('canvas').getContext('2d');
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), range = document.createRange();
  while (walker.nextNode()) {
    const node = walker.currentNode, element = node.parentElement;
    if (!node.data.trim() || ['SCRIPT', 'STYLE', 'NOSCRIPT', 'OPTION', 'TITLE', 'title', 'desc'].includes(element.nodeName) || element.closest('.skip, [hidden]') || !shownAtAll(element)) continue;
    const drawing = element.ownerSVGElement, look = styleOf(element);
    range.selectNodeContents(node);
    const boxes = [...range.getClientRects()];
    if (boxes.length === 0) continue;
    const scale = drawing ? Math.sqrt(Math.abs(element.getScreenCTM().a * element.getScreenCTM().d - element.getScreenCTM().b * element.getScreenCTM().c)) : 1, size = parseFloat(look.fontSize) * scale;
    if (size < kLeastText - 0.05) found.push(`small: ${nameOf(element)}: ${words(node.data)} has ${size.toFixed(1)} px`);
    if (drawing && /…\s*$/.test(node.data) && !element.querySelector('title') && !(element.parentElement.querySelector(':scope > title'))) found.push(`cut: ${nameOf(element)}: ${words(node.data)} is shortened and nothing says the rest`);
    addItem(element, node.data, boxes, 'text');
  }
  for (const element of document.querySelectorAll('input, select, button, textarea')) {
    if (element.closest('[hidden]') || !shownAtAll(element)) continue;
    const look = styleOf(element), value = element.localName === 'select' ? (element.selectedOptions[0] || {}).text || '' : element.localName === 'input' && !['range', 'checkbox', 'radio'].includes(element.type) ? element.value : '';
    pen.font = look.font;
    const room = element.clientWidth - parseFloat(look.paddingLeft) - parseFloat(look.paddingRight), arrow = element.localName === 'select' ? 16 : 0;
    if (value && pen.measureText(value).width > room - arrow + kSlack && element.title !== value) found.push(`cut: ${nameOf(element)}: ${words(value)}`);
    addItem(element, element.getAttribute('aria-label') || element.textContent || value, [element.getBoundingClientRect()], 'control');
  }

  // ---- Overlaps, from the top down.
  items.sort((a, b) => a.top - b.top);
  const related = (a, b) => a === b || a.contains(b) || b.contains(a) || (a.closest('label') && a.closest('label') === b.closest('label') && a.localName === 'label');
  const told = new Set();
  for (let k = 0; k < items.length; ++k)
    for (let j = k + 1; j < items.length && items[j].top < items[k].bottom - kSlack; ++j) {
      const a = items[k], b = items[j];
      if (Math.min(a.right, b.right) - Math.max(a.left, b.left) <= kSlack || Math.min(a.bottom, b.bottom) - b.top <= kSlack || related(a.element, b.element)) continue;
      const text = `overlap: ${nameOf(a.element)}: ${words(a.text)} and ${nameOf(b.element)}: ${words(b.text)}`;
      if (!told.has(text)) found.push(text);
      told.add(text);
    }

  // ---- Boxes that hide or scroll content that is too wide for them, and the page itself.
  for (const element of document.querySelectorAll('body *')) {
    if (element.ownerSVGElement || element.scrollWidth <= element.clientWidth + 1 || element.clientWidth === 0 || !element.checkVisibility() || ['INPUT', 'SELECT', 'OPTION'].includes(element.nodeName)) continue;
    const look = styleOf(element);
    if (hides(look.overflowX) && element.textContent.trim()) found.push(`cut: ${nameOf(element)}: ${element.scrollWidth} px in ${element.clientWidth}`);
    if (scrolls(look.overflowX) && !look.backgroundAttachment.includes('local')) found.push(`scroll: ${nameOf(element)}: scrolls sideways and does not show it`);
  }
  const room = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > room + 1) {
    const contained = (element) => { for (let at = element.parentElement; at && at !== document.body; at = at.parentElement) if (styleOf(at).overflowX !== 'visible') return true; return false; };
    const wide = [...document.querySelectorAll('body *')].filter((element) => element.getBoundingClientRect().right > room + 1 && !element.ownerSVGElement && element.checkVisibility() && !contained(element));
    found.push(`wide: the page has ${document.documentElement.scrollWidth} px in ${room}: ${wide.slice(0, 3).map(nameOf).join(', ')}`);
  }
  document.adoptedStyleSheets = [];
  return [...new Set(found)];
})()
