#include "frontend/bounds/drawable_box.h"

#include <algorithm>
#include <cmath>

#include "scene/subpixel.h"

namespace tessera::frontend {

double largest_offset(const scene::PosedDrawable& drawable, const PyramidLibrary& pyramids) {
  if (drawable.drawable->kind != scene::Primitive::Kind::kBezierPatches || !drawable.material->displacement) return 0;
  const scene::Displacement& displacement = *drawable.material->displacement;
  const ValueRange heights = pyramids.of(*displacement.texture).whole();
  const auto offset = [&](float height) {
    return std::abs(static_cast<double>(displacement.scale) * static_cast<double>(height)) +
           std::abs(static_cast<double>(displacement.bias));
  };
  return std::max(offset(heights.low), offset(heights.high)) * (1 + 0x1p-18);
}

double largest_coordinate(const MovingBox& box) {
  double largest = 0;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      largest = std::max({largest, std::abs(box.low[key][axis]), std::abs(box.high[key][axis])});
  return largest;
}

SubPatchBody box_body(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, const MovingBox& box) {
  SubPatchBody body{box_corners(box, drawable.to_raster),
                    vertex_rounding_margin(box, largest_coordinate(box), drawable.to_raster,
                                           static_cast<double>(frame.request.subpixels())),
                    {}};
  body.margin.pixels += static_cast<double>(scene::kStillPixels);
  return body;
}

std::optional<ScreenBounds> bounds_in_view(const SubPatchBody& body, const scene::FrameGeometry& frame) {
  std::optional<ScreenBounds> bounds = screen_bounds(body.corners, frame.projection, body.margin);
  if (bounds && outside_frame(*bounds, frame.request.width, frame.request.height)) bounds.reset();
  return bounds;
}

bool outside_view(const SubPatchBody& body, const scene::FrameGeometry& frame) { return !bounds_in_view(body, frame); }

}  // namespace tessera::frontend
