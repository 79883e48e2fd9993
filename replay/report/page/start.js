// Loaded last: chooses the kind of report. Another kind of folder adds its function here; its result is awaited after the first screen.
const kReports = { replay: replayReport, sweep: sweepReport, tradeoff: tradeoffReport, view: () => viewReport() };

function afterPaint() { return new Promise((resolve) => { setTimeout(resolve, 0); }); }

async function start() {
  data = JSON.parse(new TextDecoder().decode(await unzip(document.getElementById('data').textContent)));
  document.getElementById('title').textContent = data.title;
  document.getElementById('subtitle').textContent = data.subtitle;
  const rest = kReports[data.kind]() || [];
  document.body.dataset.first = String(Math.round(performance.now()));
  await complete;
  sections.forEach((entry) => { entry.stale = true; });
  for (const step of rest) {
    await afterPaint();
    step();
  }
  // All sections are drawn once, to be searched, printed and read aloud; from then on each is redrawn when it is visible.
  for (const entry of sections) {
    await afterPaint();
    repaint(entry);
  }
  // One section alone, for printing and images.
  if (document.getElementById(wanted.get('section') || '')) {
    document.getElementById('contents').hidden = true;
    main.querySelectorAll('section').forEach((part) => { part.hidden = part.id !== wanted.get('section'); });
  } else if (location.hash.length > 1 && document.getElementById(location.hash.slice(1))) {
    document.getElementById(location.hash.slice(1)).scrollIntoView();
  }
  await Promise.all(drawn.map((entry) => entry.ready));
  document.body.dataset.ready = 'true';
}
// Done when everything is drawn.
const pageReady = start().catch((error) => complain((error && error.stack) || String(error)));
