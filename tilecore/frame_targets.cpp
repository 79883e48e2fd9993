#include "tilecore/frame_targets.h"

#include "base/large_pages.h"
#include "tilecore/pixel_ids.h"

namespace tessera::tilecore {
namespace {

template <class T>
ImageOf<T> image_of(IntRect region, int channels) {
  ImageOf<T> image;
  image.width = region.width(), image.height = region.height(), image.channels = channels;
  const std::size_t count = image.index(0, image.height);
  reserve_in_large_pages(image.values, count);
  image.values.resize(count);
  return image;
}

}  // namespace

FrameTargets::FrameTargets(IntRect region_in, bool auxiliary_in, bool resolve_auxiliary_in, bool pixel_ids)
    : color(image_of<float>(region_in, 4)),
      auxiliary(auxiliary_in),
      region(region_in),
      resolve_auxiliary(resolve_auxiliary_in) {
  if (resolve_auxiliary) {
    for (Image* image : {&rate, &edges, &discrepancy, &origin, &error}) *image = image_of<float>(region, 1);
    velocity = image_of<float>(region, 2);
  }
  if (pixel_ids) ids = image_of<std::uint32_t>(region, PixelId::kChannels);
  if (!auxiliary) return;
  depth = image_of<float>(region, 1);
  normal = image_of<float>(region, 3);
  invocations = image_of<float>(region, 1);
  patch = image_of<std::uint32_t>(region, 1);
}

}  // namespace tessera::tilecore
