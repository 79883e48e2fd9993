#pragma once

#include "scene/frame_geometry.h"
#include "tests/support/tests.h"
#include "tilecore/tessellation/tessellator.h"
#include "tilecore/visibility/sample_tests.h"

namespace tessera::tilecore {

// A posed frame of a capture made in memory.
struct TestFrame {
  std::unique_ptr<scene::Capture> capture = std::make_unique<scene::Capture>();
  std::unique_ptr<scene::Assembly> assembly;
  std::unique_ptr<scene::FrameGeometry> frame;

  void pose(int width = 96, int height = 64, double close_time = 1.0) {
    assembly = std::make_unique<scene::Assembly>(scene::assemble(*capture));
    scene::FrameRequest request;
    request.width = width;
    request.height = height;
    request.close_time = close_time;
    frame = scene::pose_frame(*assembly, scene::choose_camera(*capture, width, height), request);
  }
};

// Whole grid of a base patch.
inline scene::CellRange whole_patch(const scene::FrameGeometry& frame, std::uint32_t patch) {
  const auto& drawable = frame.drawable_of(patch);
  if (drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches)
    return {0, 0, frame.pattern_of(patch).nu, frame.pattern_of(patch).nv};
  const auto& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  return {0, 0, static_cast<std::uint8_t>(clusters.clusters[patch - drawable.drawable->first_patch].cell_count), 1};
}

// Keeps hits in a set that ignores their order.
class HitSet final : public HitSink {
 public:
  using Key = std::tuple<std::uint32_t, std::uint32_t, float, float, float>;  // sample, triangle, z, b1, b2
  std::set<Key> hits;
  void take(std::span<const Hit> block) override {
    for (const Hit& h : block) hits.emplace(h.sample, h.triangle, h.z, h.b1, h.b2);
  }
};

}  // namespace tessera::tilecore
