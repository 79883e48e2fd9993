#pragma once

#include <cstdint>

namespace tessera::tilecore {

// Work of the tile cores for one drawable of a frame. Summed over all drawables, each member equals the frame's counter
// that gpu::kDrawableCosts names.
struct DrawableCounts {
  std::uint64_t entries = 0;
  std::uint64_t sub_patches = 0;
  std::uint64_t triangles = 0;
  std::uint64_t procedure_samples = 0;
  std::uint64_t box_tests = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t sample_hits = 0;
  std::uint64_t samples_visible = 0;
  std::uint64_t pixel_shader_invocations = 0;
};

}  // namespace tessera::tilecore
