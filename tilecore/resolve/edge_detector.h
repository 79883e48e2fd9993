#pragma once

#include <cmath>
#include <cstddef>

#include "base/enum_words.h"
#include "scene/view.h"

namespace tessera::tilecore {

// The quantity whose Laplacian tells edges.
enum class EdgeMeasure {
  kInverseDepth,  // 1/z: linear over any plane of a perspective image
  kDepth,  // eye-space z: not linear over a plane on screen, so that steep planes at grazing angles are taken for edges
};

struct EdgeSettings {
  EdgeMeasure measure = EdgeMeasure::kInverseDepth;
  float threshold = 0.01f;  // edge where |L| > threshold * |value|; scale-free
  bool orthographic = false;
};

// Edge bit of one block: whether any pixel's Laplacian says edge, or the block sees surfaces at finite depth beside
// none. One bit per block.
//
// The Laplacian of a pixel is the sum of the second differences along x and y. The block is all that is looked at, so
// that the bit depends neither on the tile nor on neighbours: a border pixel takes the second difference of the pixel
// next to it. Along an axis on which the block is cut to fewer than three pixels there is none.
//
// `depth` is that of the block's pixels, `width` x `height` of them, at most 4 x 4, with `stride` values from row to
// row; infinity is nothing seen. Source: US 2015/0379692; there of z alone.
bool detect_edge(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height);

// The same, pixel by pixel: what SIMD has to agree with in whole blocks.
bool detect_edge_by_pixel(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height);

// Creases: where a surface bends within a block of 4x4 pixels, so that its shading jumps though depth does not. Normals
// follow from depth alone, those of the four squares of 2x2 pixels in the block's corners: 1/z of a plane is linear in
// the image, and its gradient is the plane's normal. Only blocks that the depth detector leaves, so that all depths are
// finite.
class CreaseDetector {
 public:
  CreaseDetector() = default;
  // `degrees` between two of the normals make a crease; 0: none does.
  CreaseDetector(double degrees, const scene::Projection& projection)
      : on_(degrees > 0),
        orthographic_(projection.orthographic),
        scale_(static_cast<float>(projection.scale)),
        center_x_(static_cast<float>(projection.center_x)),
        center_y_(static_cast<float>(projection.center_y)),
        cosine_(static_cast<float>(std::cos(degrees * 0.017453292519943295))) {}

  bool on() const { return on_; }
  // `depth` is that of the pixels of the whole block whose first pixel is (x, y) of the frame, with `stride` values
  // from row to row.
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
