#include "tilecore/frame_targets.h"

namespace tessera::tilecore {

FrameTargets::FrameTargets(IntRect region_in, bool auxiliary_in, bool resolve_auxiliary_in)
    : color(region_in.width(), region_in.height(), 4),
      auxiliary(auxiliary_in),
      region(region_in),
      resolve_auxiliary(resolve_auxiliary_in) {
  if (resolve_auxiliary) {
    for (Image* image : {&rate, &edges, &discrepancy, &origin, &error})
      *image = Image(region.width(), region.height(), 1);
    velocity = Image(region.width(), region.height(), 2);
  }
  if (!auxiliary) return;
  depth = Image(region.width(), region.height(), 1);
  normal = Image(region.width(), region.height(), 3);
  invocations = Image(region.width(), region.height(), 1);
  patch = ImageOf<std::uint32_t>(region.width(), region.height(), 1);
}

}  // namespace tessera::tilecore
