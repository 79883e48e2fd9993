#pragma once

#include <cmath>
#include <cstddef>

#include "base/enum_words.h"
#include "scene/view.h"

namespace tessera::tilecore {

// The quantity whose Laplacian shows edges.
enum class EdgeMeasure {
  kInverseDepth,  // 1/z: linear over any plane of a perspective image
  kDepth,  // eye-space z: not linear over a plane on screen, so that steep planes at grazing angles are taken for edges
};

struct EdgeSettings {
  EdgeMeasure measure = EdgeMeasure::kInverseDepth;
  float threshold = 0.01f;  // edge where |L| > threshold * |value|; scale-free
  bool orthographic = false;
};

// Edge bit of one block: whether any pixel's Laplacian shows an edge, or the block has samples with and without a
// surface. One bit per block.
//
// The Laplacian of a pixel is the sum of the second differences along x and y. Only the block itself is read, so the
// bit depends neither on the tile nor on neighbours: a border pixel takes the second difference of the pixel next to
// it. An axis on which the block is cut to fewer than three pixels has none.
//
// `depth`: the block's `width` x `height` pixels, at most 4 x 4, with `stride` values from row to row; infinity means
// no surface. Source: US 2015/0379692, which uses z alone.
bool detect_edge(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height);

// The same, pixel by pixel: the reference for the SIMD version in whole blocks.
bool detect_edge_by_pixel(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height);

// Creases: places where a surface bends within a block of 4x4 pixels, so that its shading jumps although depth does
// not. Normals follow from depth alone, one for each of the four squares of 2x2 pixels in the block's corners: 1/z of a
// plane is linear in the image, and its gradient gives the plane's normal. Only for blocks without a depth edge, in
// which all depths are finite.
class CreaseDetector {
 public:
  CreaseDetector() = default;
  // Normals that differ by `degrees` or more make a crease; 0: there are no creases.
  CreaseDetector(double degrees, const scene::Projection& projection)
      : on_(degrees > 0),
        orthographic_(projection.orthographic),
        scale_(static_cast<float>(projection.scale)),
        center_x_(static_cast<float>(projection.center_x)),
        center_y_(static_cast<float>(projection.center_y)),
        cosine_(static_cast<float>(std::cos(degrees * 0.017453292519943295))) {}

  bool on() const { return on_; }
  // `depth`: the pixels of the whole block whose first pixel is (x, y) of the frame, with `stride` values from row to
  // row.
  bool detect(const float* depth, std::size_t stride, int x, int y) const;

 private:
  bool on_ = false, orthographic_ = false;
  float scale_ = 1, center_x_ = 0, center_y_ = 0, cosine_ = 1;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::EdgeMeasure> = std::to_array<std::string_view>({"inverse_depth", "depth"});

}  // namespace tessera
