#include "gpu/frame_counters.h"

namespace tessera::gpu {

void FrameCounters::accumulate(const FrameCounters& frame) {
  for_each_counter_struct(*this, frame,
                          [](auto& total, const auto& of_frame) { tessera::accumulate(total, of_frame); });
  ledger += frame.ledger;
}

void FrameCounters::merge(const FrameCounters& view) {
  for_each_counter_struct(*this, view, [](auto& into, const auto& of_view) { tessera::merge(into, of_view); });
  ledger += view.ledger;
}

FrameCounters FrameCounters::since(const FrameCounters& before) const {
  FrameCounters out = *this;
  for_each_counter_struct(out, before, [](auto& more, const auto& seen) { tessera::subtract(more, seen); });
  out.ledger -= before.ledger;
  return out;
}

}  // namespace tessera::gpu
