#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "scene/capture.h"
#include "scene/frame_geometry.h"

namespace tessera::gpu {

// Where the displacement maps of a capture lie in the emulated memory, behind its other textures: 2 bytes a height, in
// cache lines that are blocks of heights (64 bytes: 8x4), level by level; and which lines a sub-patch needs when it is
// tessellated.
class DisplacementMemory {
 public:
  // `first_line`: the first that is free.
  DisplacementMemory(std::span<const scene::Material> materials, std::int64_t line_bytes, std::uint64_t first_line);

  // One line behind the last.
  std::uint64_t end() const { return end_; }

  // Replaces `lines` by those of the heights that the vertices of a range of a patch lie among: of the rectangle that
  // its parameters span in the map, in each of the levels that its level of detail lies between. None where nothing
  // displaces.
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
