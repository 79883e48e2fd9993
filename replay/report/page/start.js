// Last of all: which report this is. Another kind of folder adds its function here.
document.getElementById('title').textContent = data.title;
document.getElementById('subtitle').textContent = data.subtitle;
const kReports = { replay: replayReport, sweep: sweepReport, tradeoff: tradeoffReport, view: () => viewReport() };
try {
  kReports[data.kind]();
} catch (error) {
  complain(error.stack || String(error));
}
// One section alone, for printing and images.
if (document.getElementById(wanted.get('section') || '')) {
  document.getElementById('contents').hidden = true;
  main.querySelectorAll('section').forEach((part) => { part.hidden = part.id !== wanted.get('section'); });
}
Promise.all(drawn.map((entry) => entry.ready)).then(() => { document.body.dataset.ready = 'true'; }, (error) => complain(String(error)));
