#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/rect.h"
#include "scene/tessellation_pattern.h"

namespace tessera::tilecore {

struct TileSamples;
struct TileState;

// The sub-patches whose triangles the samples of a tile kept, so that a pixel can name its sub-patch. It exists in the
// emulator only: the machine knows the sub-patches by its triangle table. It survives partial renders with the samples.
class SeenSubPatches {
 public:
  void clear() { triangles_.clear(), sorted_ = true; }
  // Adds triangles, numbered in the base patch, that samples kept of the sub-patch.
  void add(std::uint32_t patch, const scene::CellRange& range, std::span<const std::uint32_t> triangles);
  // Returns the cells of the sub-patch that a triangle belongs to; an empty range if it was not added.
  scene::CellRange find(std::uint32_t patch, std::uint32_t triangle);

 private:
  struct Triangle {
    std::uint32_t patch, triangle;
    scene::CellRange range;
  };
  static bool before(const Triangle& a, const Triangle& b);

  std::vector<Triangle> triangles_;
  bool sorted_ = true;
};

// One pixel of an image of ids: the surface that its first sample sees.
struct PixelId {
  static constexpr int kChannels = 4;

  std::uint32_t patch = 0;          // base patch + 1; 0 if no opaque surface is seen
  scene::CellRange range;           // of the sub-patch, in cells of its patch; empty for surfaces of procedures
  std::uint32_t samples = 0;        // of the pixel that see this patch; at most 255
  std::uint32_t layers = 0;         // blended surfaces in front of the first sample; at most 255
  std::uint32_t invocations = 0;    // of the pixel shader, for the pixel; at most 65535
  std::uint32_t nearest_layer = 0;  // base patch + 1 of the nearest layer; 0: none

  std::array<std::uint32_t, kChannels> packed() const;
  static PixelId unpacked(std::span<const std::uint32_t> channels);
  bool operator==(const PixelId&) const = default;
};

// Writes the ids of a finished tile. `invocations`: for each pixel of the tile; `region`: of the image.
void write_pixel_ids(const TileSamples& samples, TileState& state, std::span<const std::uint32_t> invocations,
                     const IntRect& region, ImageOf<std::uint32_t>& ids);

}  // namespace tessera::tilecore
