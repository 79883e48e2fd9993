#include "tilecore/frame_targets.h"

namespace tessera::tilecore {

FrameTargets::FrameTargets(IntRect region_in, bool auxiliary_in)
    : color(region_in.width(), region_in.height(), 4), auxiliary(auxiliary_in), region(region_in) {
  if (!auxiliary) return;
  depth = Image(region.width(), region.height(), 1);
  normal = Image(region.width(), region.height(), 3);
  invocations = Image(region.width(), region.height(), 1);
  patch = ImageOf<std::uint32_t>(region.width(), region.height(), 1);
}

}  // namespace tessera::tilecore
