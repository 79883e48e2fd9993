#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/drawable_lookup.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// Groups the visible samples that share one pixel-shader invocation, for every shading.rate except `cache`.
//
// A *fragment* is the part of one primitive (triangle) that one pixel sees: the samples that the primitive covers there
// and that no surface hides. If drawables move or are defocused, the pixel is taken in the image of the surface at
// rest: only samples that a static pinhole camera would see in one pixel share. `primitive` shades each fragment once.
// `pixel` merges fragments first (quad-fragment merging, Fatahalian et al. 2010), as long as all of these hold:
//   - they are of one base patch, and their triangles share an edge: both vertices, with all their attributes;
//   - attributes do not break across that edge: not where triangles without normals are lit, each by its own;
//   - the triangles face the same way, in one segment of motion;
//   - no sample is in both: they are visible samples, each sees one primitive.
// Merged fragments merge with further ones. With shading.derivatives=quad all this is done for blocks of 2x2 pixels.
//
// Invariants (cited by the tests):
//   FM1  The invocations of `primitive` are the pairs of a pixel and a primitive that it sees.
//   FM2  Merged fragments have one facing and one base patch, and shared edges connect them.
class FragmentMerger {
 public:
  // One invocation.
  struct Run {
    std::size_t sample;   // the shaded sample: nearest to the middle of the pixel, or of its half
    float light_time;     // mean time of the samples that share it
    std::uint32_t pixel;  // number within the block
    bool rests;           // its surface is at rest and in focus
    bool moves;
    std::uint32_t quad;  // number within the block, see quads()
  };
  static constexpr std::uint32_t kNoRun = 0xFFFFFFFFu;

  // Groups the pixels of one block: a single pixel, or the pixels of a 2x2 block that are shaded together. `split`, for
  // each: whether samples in its left half are kept apart from samples in its right half, see DeferredShader::shade().
  void group(const TileJob& job, const TileSamples& samples, const TileState& state,
             std::span<const std::size_t> pixels, std::span<const bool> split);

  std::span<const Run> runs() const { return runs_; }
  // The run of sample k of the block's pixel p; kNoRun if it sees no opaque surface.
  std::uint32_t run_of(std::size_t p, std::size_t k) const { return run_of_[p * spp_ + k]; }

  std::size_t visible() const { return visible_; }  // samples
  std::size_t merged() const { return merged_; }    // fragments that are shaded with another one
  std::size_t places() const { return places_; }    // samples that see a surface away from its rest place
  // Number of quads, of 2x2 invocations: a fragment that moves or is defocused has its own time and lens point, and so
  // a quad.
  std::size_t quads() const { return quads_; }

 private:
  struct Fragment {
    std::uint32_t patch = 0, triangle = 0, pixel = 0;
    float cell_x = 0, cell_y = 0;
    int segment = 0;  // of motion
    bool right = false, positive = false, rests = false, moves = false, has_vertices = false;
    std::size_t sample = 0;
    float distance2 = 0, time_sum = 0;
    std::uint32_t samples = 0, parent = 0, run = 0, quad = 0;
    std::uint32_t vertices = 0;  // in vertices_, if has_vertices
  };
  // Groups a pixel's samples, from `first` on, as one fragment if all see one triangle at rest; otherwise returns
  // false.
  bool group_alike(const TileJob& job, const TileSamples& samples, const TileState& state, std::size_t first);
  // Fills the known_ members.
  void know(const TileJob& job, std::uint32_t patch);
  void add_sample(const TileJob& job, const TileSamples& samples, const TileState& state, std::size_t p, std::size_t k,
                  std::size_t s, bool split, std::size_t first_of_pixel);
  void merge_all(const TileJob& job);
  bool belong_together(const TileJob& job, Fragment& a, Fragment& b);
  std::uint32_t root(std::uint32_t f);
  void make_runs();

  // The drawable looked up last.
  scene::DrawableLookup drawable_of_;
  std::uint64_t known_frame_ = 0;
  std::uint32_t known_drawable_ = 0;
  bool known_rests_ = false, known_moves_ = false, known_curved_ = false;

  std::size_t spp_ = 0, visible_ = 0, merged_ = 0, quads_ = 0, places_ = 0;
  std::vector<Fragment> fragments_;
  std::vector<std::array<std::uint64_t, 3>> vertices_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> run_of_;  // first the fragment, then the run
};

// Whether samples see a patch at its rest place: it does not move and there is no lens.
bool is_at_rest(const scene::FrameGeometry& frame, std::uint32_t patch);

}  // namespace tessera::tilecore
