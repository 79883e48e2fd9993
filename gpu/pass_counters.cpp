#include "gpu/pass_counters.h"

namespace tessera::gpu {

FrameCounters PassCounters::all() {
  const WorkRecorder::Sums more = run_.recorder.take_sums();
  tilecore::merge(sums_.core, more.core);
  tessera::merge(sums_.l2, more.l2);
  sums_.ledger += more.ledger;
  FrameCounters all = run_.result.counters;
  tilecore::merge(all, sums_.core);
  tessera::merge(all.l2, sums_.l2);
  tessera::merge(all.tessellation, cache_.counters());
  tessera::merge(all.binner, binner_.buffer().counters());
  for (const TileCounts& tile : run_.result.maps.tiles) all.binner.queue_bytes_read += tile.queue_bytes_read;
  all.frontend = front_end_.counters;
  all.instances = front_end_.instances;
  all.groups = front_end_.groups;
  all.previous_depth = front_end_.previous_depth;
  all.ledger += sums_.ledger;
  all.ledger += binner_.buffer().ledger();
  all.ledger += front_end_.ledger;
  return all;
}

void PassCounters::end(std::string_view pass) {
  FrameCounters now = all();
  run_.result.passes.push_back({std::string(pass), now.since(seen_)});
  seen_ = now;
}

}  // namespace tessera::gpu
