// Returns the barriers that keep a page with axe-core from levels A and AA of WCAG 2.2, one text each: rule,
// selector, and the reason or the colours.
(async () => {
  const tags = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'], found = [];
  const settled = () => new Promise((resolve) => setTimeout(resolve, 300));
  const selector = (node) => node.target.join(' ');
  document.querySelectorAll('details').forEach((part) => { part.open = true; });
  await settled();
  const all = await axe.run(document, { runOnly: { type: 'tag', values: tags }, rules: { 'color-contrast': { enabled: false } } });
  for (const rule of all.violations) for (const node of rule.nodes) found.push(`${rule.id}: ${selector(node)}: ${node.failureSummary.split('\n').slice(1).map((line) => line.trim()).join('; ')}`);

  // Colours where nothing is scrolled away or under something that stays in view.
  const whole = new CSSStyleSheet();
  whole.replaceSync('.scroll, .picks, pre { max-height: none !important; } .bar, .stay, .cards, .sides > img, thead th { position: static !important; }');
  document.adoptedStyleSheets = [whole];
  await settled();
  const { violations, incomplete } = await axe.run(document, { runOnly: { type: 'rule', values: ['color-contrast'] }, elementRef: true });
  for (const node of violations.flatMap((rule) => rule.nodes)) {
    const { fgColor, bgColor, contrastRatio, expectedContrastRatio } = node.any[0].data;
    found.push(`color-contrast: ${selector(node)}: ${fgColor} on ${bgColor}, ${contrastRatio} of ${expectedContrastRatio}`);
  }

  // axe takes a drawing for an image, and does not look at several grounds behind a text: there the grounds are
  // computed, and all must do.
  const { Color, flattenColors, getContrast } = axe.commons.color;
  const color = (text, alpha = 1) => {
    const out = new Color();
    out.parseString(text);
    out.alpha *= alpha;
    return out;
  };
  // Background colours of the elements around it, a gradient's stops each.
  const groundsOf = (element) => {
    const around = [];
    for (let at = element; at; at = at.parentElement) around.unshift(at);
    return around.reduce((grounds, at) => {
      const look = getComputedStyle(at), plain = grounds.map((under) => flattenColors(color(look.backgroundColor), under));
      return [...plain, ...(look.backgroundImage.match(/rgba?\([^)]*\)/g) || []).flatMap((stop) => plain.map((under) => flattenColors(color(stop), under)))];
    }, [color('rgb(255, 255, 255)')]);
  };
  // Backgrounds of a text in a drawing: its own halo, or the rectangles before it that lie behind some of it.
  const groundsInDrawing = (text, look) => {
    const drawing = text.ownerSVGElement, box = text.getBoundingClientRect(), { stroke: halo } = look;
    if (look.paintOrder !== 'normal' && halo !== 'none') return [color(halo)];
    return [...drawing.querySelectorAll('rect')].reduce((grounds, rect) => {
      const its = rect.getBoundingClientRect(), style = getComputedStyle(rect);
      if (style.fill === 'none' || !(text.compareDocumentPosition(rect) & Node.DOCUMENT_POSITION_PRECEDING) || its.right <= box.left || its.left >= box.right || its.bottom <= box.top || its.top >= box.bottom) return grounds;
      const over = grounds.map((under) => flattenColors(color(style.fill, style.fillOpacity * style.opacity), under));
      return its.left <= box.left && its.right >= box.right && its.top <= box.top && its.bottom >= box.bottom ? over : [...grounds, ...over];
    }, groundsOf(drawing));
  };
  for (const node of incomplete.flatMap((rule) => rule.nodes)) {
    const look = getComputedStyle(node.element), drawn = node.element.ownerSVGElement, size = parseFloat(look.fontSize), large = size >= 24 || (size >= 18.66 && look.fontWeight >= 700) ? 3 : 4.5;
    const text = drawn ? color(look.fill, look.fillOpacity * look.opacity) : color(look.color);
    const worst = (drawn ? groundsInDrawing(node.element, look) : groundsOf(node.element)).map((ground) => ({ ground, contrast: getContrast(ground, flattenColors(text, ground)) })).sort((a, b) => a.contrast - b.contrast)[0];
    if (worst.contrast < large) found.push(`color-contrast: ${selector(node)}: ${flattenColors(text, worst.ground).toHexString()} on ${worst.ground.toHexString()}, ${worst.contrast.toFixed(2)} of ${large}:1`);
  }
  document.adoptedStyleSheets = [];
  return found;
})()
