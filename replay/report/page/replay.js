// The report of a replay, or of several side by side: data.runs = [{label, stats, views: [{image, tiles, size, region} or null]}].

function replayReport() {
  const last = framesOf().length - 1;
  shown.map = wantedOf('map', ['', ...Object.keys(data.scales)], data.scales['cost.cycles'] && data.scales['cost.cycles'][1] > 0 ? 'cost.cycles' : '');
  shown.frame = Math.max(0, Math.min(last, Number(wanted.get('picture') || wanted.get('frame')) || 0));
  shown.target = Number(wanted.get('target')) > 0 ? Number(wanted.get('target')) : run().stats.gpu.machine.target_fps || 60;
  if (wanted.has('tile')) shown.tile = Number(wanted.get('tile'));
  if (runs().length > 1 || wanted.has('compare')) shown.other = runs().length > 1 || last > 0 ? firstOther() : null;
  controlBar();
  cardSection();
  rateSection();
  compareSection();
  machineSection();
  return [() => { timelineSection(); tileSection(); }, passSection, memorySection, costSections, baselineSection, sensitivitySection, counterSection, effectSection, differenceSection,
    () => followedConfiguration()];
}

// The data of the shown run.
function followedConfiguration() {
  const part = configurationSection([]), heading = part.firstChild;
  const entry = follow(part, ['run'], () => part.replaceChildren(heading, ...configurationParts([['Capture', run().stats.capture], ['Settings', run().stats.settings], ['Described machine', run().stats.gpu]])));
  entry.always = true;
  repaint(entry);
}
