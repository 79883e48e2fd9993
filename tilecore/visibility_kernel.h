#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tilecore/cell_test.h"
#include "tilecore/micro_mesh.h"
#include "tilecore/ray_effects.h"
#include "tilecore/sample_pattern.h"

namespace tessera::tilecore {

// SIMD part of visibility: samples against the cells of one mesh. Every function gives the same hits with the same bits
// on every instruction set; their order may differ. Counts are of what the emulated unit tests, independent of the
// host's vector width.

struct VisibilityWork {
  std::uint64_t box_tests = 0;       // a sample or a tile against a box
  std::uint64_t triangle_tests = 0;  // a sample against a triangle
  std::uint64_t sample_hits = 0;     // samples inside a triangle that faces the right way, inside the depth range
};

// Hits on their way from the kernel to the visibility buffer.
class HitSink {
 public:
  struct Hit {
    std::uint32_t sample;    // natural order of the tile
    std::uint32_t triangle;  // of the base patch
    float z, b1, b2;
    float rest_x, rest_y;    // where the surface point is on screen at shutter open, seen through the lens's middle
  };
  virtual void take(std::span<const Hit> hits) = 0;

  // Called by the kernels; buffers and hands over in blocks.
  void add(const Hit& hit) {
    buffer_[count_++] = hit;
    if (count_ == buffer_.size()) flush();
  }
  void flush() {
    take(std::span(buffer_).first(count_));
    count_ = 0;
  }

 protected:
  ~HitSink() = default;

 private:
  std::array<Hit, 256> buffer_;
  std::size_t count_ = 0;
};

struct VisibilitySettings {
  HitLimits limits;
  bool orthographic = false;
  float inverse_focus = 0;
};

// Static scene, pinhole: no rays; each cell's rectangle of samples in natural order. Vertices and samples lie on the
// sub-pixel grid and their differences are exact, so the edge functions have the signs of exact fixed-point ones.
void raster_mesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                 VisibilityWork& work);

// Motion and defocus: packets of 16 samples, neighbours in time, against the moving box of a leaf; the samples that
// are left against the boxes of its 16 cells; the pairs that are left against the cells' triangles.
void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, std::span<const SampleRange> ranges,
                RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

// One cell, all of whose corners are projected, against chosen samples (natural order of the tile, each once).
void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> samples, const TileSamples& tile, RayEffects effects,
                       const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

}  // namespace tessera::tilecore
