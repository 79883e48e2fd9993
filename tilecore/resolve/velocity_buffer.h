#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>
#include "base/enum_words.h"

#include "tilecore/resolve/advection.h"
#include "tilecore/resolve/motion_field.h"
#include "tilecore/resolve/pixel_surfaces.h"
#include "tilecore/shading/grid_vertices.h"

namespace tessera::tilecore {

// Choice of a block's speed from its pixels. The mean hides a small fast object in a still block; `max` does not.
enum class BlockSpeed { kMean, kMax, kMedian, kMin };

// Screen-space motion, in pixels, of the surfaces that the pixels of a tile see, from another frame to this one.
// Evaluated block by block on request; pixels without an opaque surface have velocity zero and no part in a block's
// speed. Vertices of deforming patches are evaluated once for the tile.
class VelocityBuffer {
 public:
  struct Block {
    bool still = false;  // every sample of every pixel is at rest: speed is zero, exactly
    bool usable = true;  // every pixel with an opaque surface has a usable velocity
    float speed = 0;     // the chosen statistic of |velocity|, pixels per frame
  };

  // Forgets the last tile. `motion` may be nullptr (then no velocity is usable); it and the others must stay until the
  // next tile.
  void start(const scene::FrameGeometry& frame, const TileSamples& samples, const TileState& state,
             const PixelSurfaces& surfaces, const MotionField* motion);

  // Evaluates the pixels of `block` (frame coordinates, inside the tile, at most 4 x 4). `counted`: the machine needs
  // the values; otherwise an image does.
  Block evaluate(IntRect block, BlockSpeed statistic, bool counted);

  // Values of the tile, row by row. Pixels that were not evaluated are unusable, with velocity zero.
  const std::vector<Vec2>& velocity() const { return velocity_; }
  const std::vector<std::uint8_t>& usable() const { return usable_; }
  const std::vector<float>& then_depth() const { return then_depth_; }  // of the point in the other frame
  // The view of `block` alone, the only part that a decision may read.
  VelocityView view(IntRect block) const {
    const std::size_t first = surfaces_->index(block.x0, block.y0);
    return {&velocity_[first], &usable_[first], block, surfaces_->pixels.width()};
  }

  struct Work {
    std::uint64_t operations = 0;
    std::uint64_t vertex_bytes = 0;  // read from the other frame
    std::uint64_t places = 0;        // at shutter open, of samples that see the surface elsewhere
  };
  Work take_work() { return std::exchange(work_, {}); }

 private:
  struct Vertex {
    MotionField::Places places;
    bool counted = false;
  };

  MotionField::Step evaluate_pixel(std::size_t pixel);
  void count_point(std::size_t pixel);
  void count_vertices(const scene::PosedDrawable& drawable, const SurfaceLocation& at);
  // Numbers in vertices_ of the corners of the triangle of a patch's grid that holds `at`.
  std::array<std::int32_t, 3> corners(const SurfaceLocation& at);
  SurfaceLocation location(std::size_t pixel) const;
  // Evaluates a whole block that sees one rigid drawable and no blended surface; bit i of `usable` is pixel i. Returns
  // false for other blocks.
  bool evaluate_rigid(IntRect block, std::array<float, 16>& speeds, std::uint32_t& usable);
  bool rests(IntRect block) const;
  // Whether samples see the drawable at its place at shutter open.
  bool is_seen_at_rest(std::uint32_t drawable) const {
    return !frame_->drawables[drawable].moving && frame_->projection.lens_scale == 0;
  }

  const scene::FrameGeometry* frame_ = nullptr;
  const TileSamples* samples_ = nullptr;
  const TileState* state_ = nullptr;
  const PixelSurfaces* surfaces_ = nullptr;
  const MotionField* motion_ = nullptr;
  bool knows_still_ = false;  // surfaces_->still is of this motion
  std::vector<Vec2> velocity_;
  std::vector<std::uint8_t> usable_;
  std::vector<float> then_depth_;
  std::uint32_t last_patch_ = TileState::kNoPatch, last_drawable_ = 0;
  // The patch and triangle whose vertices of the other frame the machine has read last.
  std::uint32_t read_patch_ = TileState::kNoPatch, read_triangle_ = 0;
  bool last_rests_ = false, last_rigid_ = false, last_interpolates_ = false;
  GridVertices grid_vertices_;
  std::vector<Vertex> vertices_;
  Work work_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::BlockSpeed> = std::to_array<std::string_view>({"mean", "max", "median",
                                                                                          "min"});

}  // namespace tessera
