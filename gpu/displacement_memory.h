#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "scene/capture.h"
#include "scene/frame_geometry.h"

namespace tessera::gpu {

// Places of the displacement maps of a capture in the emulated memory, behind its other textures: 2 bytes a height, in
// cache lines that are blocks of heights (64 bytes: 8x4), level by level. It also finds the lines that tessellating a
// sub-patch needs.
class DisplacementMemory {
 public:
  // `first_line`: the first free line.
  DisplacementMemory(std::span<const scene::Material> materials, std::int64_t line_bytes, std::uint64_t first_line);

  // One line behind the last.
  std::uint64_t end() const { return end_; }

  // Replaces `lines` by the lines of the heights around the vertices of a range of a patch: the rectangle that its
  // parameters span in the map, in both levels around its level of detail. Empty if nothing displaces the patch.
  void lines_of(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& range,
                std::vector<std::uint32_t>& lines) const;

 private:
  struct Level {
    std::uint32_t first_line, blocks_across;
    int width, height;
  };
  void add_level(const Level& level, const shaders::Sampler& sampler, Vec2 low, Vec2 high,
                 std::vector<std::uint32_t>& lines) const;

  int width_log2_, height_log2_;
  std::uint64_t end_;
  std::unordered_map<const shaders::ScalarTexture*, std::vector<Level>> maps_;
};

}  // namespace tessera::gpu
