#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/cell_test.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// SIMD part of visibility: samples against the cells of one mesh. Every function gives the same hits with the same bits
// on every instruction set; their order may differ. Counts are the tests of the emulated unit, independent of the
// host's vector width.

struct VisibilityKernels;

struct VisibilityWork {
  std::uint64_t boxes_built = 0;     // of leaves, cells, nodes and bounding polygons
  std::uint64_t box_tests = 0;       // a sample or a tile against a box
  std::uint64_t triangle_tests = 0;  // a sample against a triangle
  std::uint64_t sample_hits = 0;     // samples inside a triangle that faces the right way, inside the depth range

  // Lanes of these tests, idle ones included: the units test kTestLanes samples at a time. Lists of samples and of
  // pairs of sample and cell are packed, from the first to the last of a leaf; rows of pixels are not.
  static constexpr std::uint64_t kTestLanes = 16;
  std::uint64_t box_lanes = 0;       // also of samples tested against a leaf's own box
  std::uint64_t triangle_lanes = 0;  // both triangles of a cell one after the other
  static std::uint64_t lanes_of(std::uint64_t tests) { return (tests + kTestLanes - 1) / kTestLanes * kTestLanes; }

  // Pairs of the current leaf.
  std::uint64_t pairs = 0;
  void end_leaf() { triangle_lanes += 2 * lanes_of(std::exchange(pairs, 0)); }
};

// Hits between the kernel and the visibility buffer.
class HitSink {
 public:
  struct Hit {
    std::uint32_t sample;    // natural order of the tile
    std::uint32_t triangle;  // of the base patch
    float z, b1, b2;
    float rest_x, rest_y;   // screen place of the surface point at shutter open, seen through the lens centre
    bool positive = false;  // sign of the triangle's area in raster space, for this sample
  };
  virtual void take(std::span<const Hit> hits) = 0;
  // All hits of a leaf were taken, and the next leaf reads depths again. Within a leaf the number of lanes decides when
  // kernels read depths that hits have changed.
  virtual void leaf_done() {}

  // Called by the kernels; buffers hits and passes them on in blocks.
  void add(const Hit& hit) {
    buffer_[count_++] = hit;
    if (count_ == buffer_.size()) pass_on();
  }
  void flush() {
    pass_on();
    leaf_done();
  }

 protected:
  ~HitSink() = default;

 private:
  void pass_on() {
    take(std::span(buffer_).first(count_));
    count_ = 0;
  }

  std::array<Hit, 256> buffer_;
  std::size_t count_ = 0;
};

struct VisibilitySettings {
  HitLimits limits;
  bool orthographic = false;
  float inverse_focus = 0;
  // Depths of the tile's samples, natural order, or nullptr. Surfaces that cannot be nearer are not tested, and farther
  // hits are counted but not passed on. It may change while a sink takes hits.
  const float* depth = nullptr;
  float sharp_factor =
      0;  // a projected corner whose lens factor is no larger than this is seen as through the lens centre
  const VisibilityKernels* kernels = nullptr;  // nullptr: the kernels for the effects and the best SIMD target
  // An upper bound of the depths in `depth`.
  float farthest = std::numeric_limits<float>::infinity();
  // Weights of hits are multiples of 1 / weight_steps, and their sum is at most one; 0: not rounded.
  float weight_steps = 0;
};

// Number of steps of weights of so many bits. From 24 bits on weights keep their single precision.
inline float weight_steps(int bits) { return bits >= 24 ? 0.0f : static_cast<float>((1 << bits) - 1); }

// Rounds the weights of a hit's second and third corner to the tile memory's; kernels do the same with the same bits.
inline void round_weights(float steps, float& b1, float& b2) {
  if (steps == 0) return;
  b1 = std::nearbyint(b1 * steps) / steps;
  b2 = std::min(std::nearbyint(b2 * steps) / steps, 1.0f - b1);
}

// Static scene, pinhole: no rays. Tests the pixels under a cell, or, if cells are about as small as pixels, the pixels
// under a leaf, each sample with the boxes of all cells at once. Vertices and samples lie on the sub-pixel grid and
// their differences are exact, so the edge functions have the signs of exact fixed-point ones.
void raster_mesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                 VisibilityWork& work);

// Motion and defocus: all samples whose stencil value lies in `times` against one leaf.
//   1. Per class of the sample pattern, the leaf's box at the class's time and lens point gives the samples inside it,
//      by division: no search, the same work for any blur. Samples that already see a nearer surface drop out.
//   2. The samples are brought to the leaf's rest frame and compared with the boxes of its cells, a sample with all boxes at
//      once.
//   3. The remaining pairs of a sample and a cell are tested, a vector of pairs with both triangles at once.
void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

// The same for all leaves of a mesh whose times are not empty, in order; each is prefetched while the previous one is
// tested. `times`: one for each leaf.
void trace_leaves(const MicroMesh& mesh, std::span<const TimeRange> times, const TileSamples& samples,
                  RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

// The triangles of one cell, all corners projected, against given samples (natural order, each once). For visibility
// methods that find their samples in another way: the same hits with the same bits as above.
void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                       const TileSamples& samples, RayEffects effects, const VisibilitySettings& settings,
                       HitSink& sink, VisibilityWork& work);

// The kernels of one set of effects, described at the functions of the same names.
struct VisibilityKernels {
  void (*trace_leaf)(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);
  void (*test_cell_samples)(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                            const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                            VisibilityWork& work);
};

// Kernels for the best SIMD target. Each set of effects has its own file, compiled for all targets; a build with
// TESSERA_EFFECTS=static has only the first.
VisibilityKernels still_kernels();
VisibilityKernels motion_kernels();
VisibilityKernels lens_kernels();
VisibilityKernels motion_lens_kernels();

// The stage of a kernel of the ray path: samples of the pattern against the box of a leaf; survivors against the boxes
// of its cells; the remaining pairs against both triangles, with the fetch of their corners; the values of a hit, which
// goes to the sink. kRest: none of them.
enum class RayStage { kClasses, kBoxes, kTriangles, kHits, kRest };
inline constexpr int kRayStages = 5;

// Kernels report their stages to it. A benchmark compiles them with a clock that measures.
struct NoStageClock {
  static void enter(RayStage) {}
  static void count(RayStage, std::uint64_t) {}  // tests
};

}  // namespace tessera::tilecore
