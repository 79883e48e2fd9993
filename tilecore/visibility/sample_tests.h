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
// on every instruction set; their order may differ. Counts are of what the emulated unit tests, independent of the
// host's vector width.

struct VisibilityKernels;

struct VisibilityWork {
  std::uint64_t boxes_built = 0;     // of leaves, cells, nodes and bounding polygons
  std::uint64_t box_tests = 0;       // a sample or a tile against a box
  std::uint64_t triangle_tests = 0;  // a sample against a triangle
  std::uint64_t sample_hits = 0;     // samples inside a triangle that faces the right way, inside the depth range

  // Lanes that these take, idle ones included: the units test kTestLanes samples at a time. Lists of samples and of
  // pairs of sample and cell are packed, from the first to the last of a leaf; rows of pixels are not.
  static constexpr std::uint64_t kTestLanes = 16;
  std::uint64_t box_lanes = 0;       // also of samples that a leaf's own box is tested against
  std::uint64_t triangle_lanes = 0;  // both triangles of a cell one after the other
  static std::uint64_t lanes_of(std::uint64_t tests) { return (tests + kTestLanes - 1) / kTestLanes * kTestLanes; }

  // Pairs of the leaf in hand.
  std::uint64_t pairs = 0;
  void end_leaf() { triangle_lanes += 2 * lanes_of(std::exchange(pairs, 0)); }
};

// Hits on their way from the kernel to the visibility buffer.
class HitSink {
 public:
  struct Hit {
    std::uint32_t sample;    // natural order of the tile
    std::uint32_t triangle;  // of the base patch
    float z, b1, b2;
    float rest_x, rest_y;   // where the surface point is on screen at shutter open, seen through the lens centre
    bool positive = false;  // sign of the triangle's area in raster space, for this sample
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
  // Of the tile's samples, natural order, or null: what cannot be nearer is not looked for, and hits that are farther
  // are counted but not handed over. It may change while a sink takes hits.
  const float* depth = nullptr;
  float sharp_factor =
      0;  // a projected corner whose lens factor is no larger than this is seen as through the lens centre
  const VisibilityKernels* kernels = nullptr;  // null: those for the effects and the best SIMD target
  // With `depth`: no depth is farther.
  float farthest = std::numeric_limits<float>::infinity();
  // Hits have weights in multiples of 1 / weight_steps, whose sum is no more than one; 0: as computed.
  float weight_steps = 0;
};

// Steps of weights of so many bits. From 24 bits on they are as computed, in single precision.
inline float weight_steps(int bits) { return bits >= 24 ? 0.0f : static_cast<float>((1 << bits) - 1); }

// The weights of a hit's second and third corner as the tile memory keeps them; kernels do the same with the same bits.
inline void round_weights(float steps, float& b1, float& b2) {
  if (steps == 0) return;
  b1 = std::nearbyint(b1 * steps) / steps;
  b2 = std::min(std::nearbyint(b2 * steps) / steps, 1.0f - b1);
}

// Static scene, pinhole: no rays; the pixels under a cell, or, where cells are about as small as pixels, the pixels
// under a leaf, each sample with the boxes of all cells at once. Vertices and samples lie on the sub-pixel grid and
// their differences are exact, so the edge functions have the signs of exact fixed-point ones.
void raster_mesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                 VisibilityWork& work);

// Motion and defocus: all samples whose stencil value lies in `times` against one leaf.
//   1. Per class of the sample pattern, the leaf's box at the class's time and lens point gives the samples inside it,
//      by division: no search, the same work for any blur. Those that already see something nearer drop out.
//   2. They are brought to the leaf's rest frame and compared with the boxes of its cells, a sample with all boxes at
//      once.
//   3. The pairs of a sample and a cell that are left are tested, a vector of pairs with both triangles at once.
void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

// The same of all leaves of a mesh whose times are not empty, in order, each asked for from memory while the one before it
// is tested. `times`: one for each leaf.
void trace_leaves(const MicroMesh& mesh, std::span<const TimeRange> times, const TileSamples& samples,
                  RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);

// The triangles of one cell, all corners projected, against given samples (natural order, each once). For visibility
// methods that find their samples in another way: the same hits with the same bits as above.
void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                       const TileSamples& samples, RayEffects effects, const VisibilitySettings& settings,
                       HitSink& sink, VisibilityWork& work);

// The kernels of one set of effects, as the functions below of the same names describe them.
struct VisibilityKernels {
  void (*trace_leaf)(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);
  void (*test_cell_samples)(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                            const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                            VisibilityWork& work);
};

// Kernels for the best SIMD target. Each set of effects has a file of its own, compiled for all targets; a build with
// TESSERA_EFFECTS=static has the first only.
VisibilityKernels still_kernels();
VisibilityKernels motion_kernels();
VisibilityKernels lens_kernels();
VisibilityKernels motion_lens_kernels();

// The stage that a kernel of the ray path is at: samples of the pattern against the box of a leaf; those that are left
// against the boxes of its cells; the pairs that are left against both triangles, corners fetched; the values of a hit,
// which goes to the sink. kRest: none of them.
enum class RayStage { kClasses, kBoxes, kTriangles, kHits, kRest };
inline constexpr int kRayStages = 5;

// Kernels tell it where they are. A benchmark compiles them with a clock that looks.
struct NoStageClock {
  static void enter(RayStage) {}
  static void count(RayStage, std::uint64_t) {}  // tests
};

}  // namespace tessera::tilecore
