#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/image.h"
#include "binner/parameter_buffer.h"
#include "binner/tile_grid.h"
#include "frontend/frame_geometry.h"
#include "hardware/counter.h"
#include "hardware/ledger.h"
#include "tilecore/pixel_shader.h"
#include "tilecore/resolve/multisample_resolve.h"
#include "tilecore/sample_pattern.h"
#include "tilecore/mesh_store.h"
#include "tilecore/tessellation_cache.h"
#include "tilecore/tile_frustum.h"
#include "tilecore/visibility_kernel.h"

namespace tessera::tilecore {

struct TileCoreCounters {
  std::uint64_t entries_fetched = 0;
  std::uint64_t culled_occlusion = 0;
  std::uint64_t box_tests = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t sample_hits = 0;
  std::uint64_t alpha_tests = 0;
  std::uint64_t samples_visible = 0;
  std::uint64_t blended_layers = 0;
  std::uint64_t pixel_shader_invocations = 0;
};

// When samples of a pixel share one run of the pixel shader.
enum class ShadingRate {
  kPixel,   // one run per pixel and surface (multisampling); moving and defocused surfaces: per pixel-sized piece
  kSample,  // one run per visible sample
};

// What the samples of a tile see. Survives partial renders, when it is stored to memory and loaded again.
struct TileState {
  static constexpr std::uint32_t kNoPatch = 0xFFFFFFFFu;
  static constexpr std::uint64_t kBytesPerSample = 20;   // z, patch, triangle, two weights
  static constexpr std::uint64_t kBytesPerLayer = 24;    // the same and the sample's number

  // Nearest opaque surface per sample, natural order.
  std::vector<float> z, b1, b2, rest_x, rest_y;
  std::vector<std::uint32_t> patch, triangle;

  // Blended surfaces in front of it, in any order until the tile is finished.
  struct Layer {
    std::uint32_t sample, patch, triangle;
    float z, b1, b2, rest_x, rest_y;
  };
  std::vector<Layer> layers;

  std::size_t unseen = 0;  // samples that see nothing opaque yet

  bool started = false;
  void start(std::size_t samples);
};

// Pictures that a frame is made of; tiles write disjoint pixels. Coordinates are those of the region.
struct FrameTargets {
  Image color;           // linear RGB and coverage
  bool auxiliary = false;
  Image depth;           // of the nearest sample; 0 where nothing is seen
  Image normal;          // world, mean of the pixel's shaded points
  Image invocations;     // runs of the pixel shader
  ImageOf<std::uint32_t> patch;  // base patch + 1 of the first sample; 0 where nothing is seen
  std::vector<float> tile_farthest;  // per tile: depth of its farthest sample; infinity where one sees
                                     // nothing opaque; kept where it has room
  IntRect region;

  FrameTargets(IntRect region_in, bool auxiliary_in);
};

// Everything that the tile cores of one frame share; read only.
struct TileJob {
  const frontend::FrameGeometry* frame = nullptr;
  const binner::TileGrid* grid = nullptr;
  const SamplePattern* pattern = nullptr;
  Lighting lighting;
  Vec3 background{0.0f};
  bool has_background = false;  // else the environment
  ShadingRate shading = ShadingRate::kPixel;
  bool cull_occlusion = true;
  bool force_motion = false, force_lens = false;  // run the general kernels where the scene does not ask for them
  std::uint64_t burst_bytes = 64;
  int box_bits = 32;  // precision of the boxes of cells
};

// One tile core: renders tile after tile with its own scratch memory. One instance per thread.
//
//   entries of the tile -> order by depth -> cull what is hidden -> tessellate -> moving boxes -> raster or ray path -> visible samples
//   all entries done    -> shade what is visible -> blend -> resolve -> store pixels
class TileCore {
 public:
  // Tests the sub-patches of `entries` against the tile's samples; `state` gathers what they see. May be called several
  // times for one tile (partial renders); the result does not depend on how the entries are divided or ordered.
  void render_entries(const TileJob& job, binner::TileIndex tile, std::vector<binner::QueueEntry> entries, TileState& state);

  // Shades, blends, resolves and writes the pixels of the tile that render_entries was last called for.
  void finish(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets);

  // Traffic of storing and loading an unfinished tile.
  void store_state(const TileJob& job, const TileState& state);
  void load_state(const TileJob& job, const TileState& state);

  // Traffic on behalf of this core that another unit counted (its queue's bursts).
  void charge(const hardware::Ledger& ledger) { ledger_ += ledger; }

  // All samples that single entries touch, hidden or not, for machines that draw in another order: begin_tile(), then entry by entry in
  // any order. Alpha is not tested, nothing is kept.
  void begin_tile(const TileJob& job, binner::TileIndex tile) { prepare_samples(job, job.grid->pixels(tile)); }
  void find_hits(const TileJob& job, const binner::QueueEntry& entry, HitSink& sink);

  // Since the last call; the caller adds them up, and passes the requests on to the TessellationCache in emulated order.
  std::vector<TessellationRequest> take_tessellations() { return std::exchange(tessellations_, {}); }
  TileCoreCounters take_counters();
  ResolveCounters take_resolve_counters();
  hardware::Ledger take_ledger();

 private:
  void prepare_samples(const TileJob& job, IntRect pixels);
  void render_sub_patch(const TileJob& job, const binner::QueueEntry& entry, TileState& state);
  // `entry_times`: codes of the samples that the mesh may touch in this tile; others are not tested.
  void test_mesh(const TileJob& job, const MicroMesh& mesh, TimeRange entry_times, RayEffects effects, const VisibilitySettings& settings, HitSink& sink);
  void shade_opaque(const TileJob& job, const TileState& state);
  void fill_background(const TileJob& job, std::size_t first, std::size_t count);
  void shade_layers(const TileJob& job, TileState& state);
  void write_auxiliary(const TileState& state, FrameTargets& targets);

  MeshStore meshes_;
  TileSamples samples_;
  std::vector<Vec3> sample_color_;     // natural order, opaque then blended
  std::vector<float> sample_coverage_;
  std::vector<Vec3> pixel_normal_;     // sums over the pixel's shaded points
  std::vector<std::uint32_t> pixel_invocations_;
  TileCoreCounters counters_;
  ResolveCounters resolve_counters_;
  hardware::Ledger ledger_;
  std::vector<TessellationRequest> tessellations_;
};

}  // namespace tessera::tilecore

namespace tessera::hardware {

template <>
inline constexpr auto kCounterFields<tilecore::TileCoreCounters> = std::to_array<CounterField<tilecore::TileCoreCounters>>({
    {"tilecore.entries_fetched", &tilecore::TileCoreCounters::entries_fetched, Combine::kSum, "entries",
     "Queue entries read by tile cores.", "MaliFragRdPrim"},
    {"tilecore.culled_occlusion", &tilecore::TileCoreCounters::culled_occlusion, Combine::kSum, "entries",
     "Entries dropped before tessellation because every sample of the tile sees something nearer.",
     "MaliFragFPKKilledQd; Adreno LRZ; PowerVR HSR (after rasterisation, there)"},
    {"tilecore.box_tests", &tilecore::TileCoreCounters::box_tests, Combine::kSum, "tests",
     "Samples (ray path) or tiles (raster path) tested against boxes of leaves and cells.", "MaliRTUBox"},
    {"tilecore.triangle_tests", &tilecore::TileCoreCounters::triangle_tests, Combine::kSum, "tests",
     "Samples tested against triangles.", "MaliRTUTri"},
    {"tilecore.sample_hits", &tilecore::TileCoreCounters::sample_hits, Combine::kSum, "samples",
     "Triangle tests whose sample is inside, facing and depth range included.", ""},
    {"tilecore.alpha_tests", &tilecore::TileCoreCounters::alpha_tests, Combine::kSum, "tests",
     "Hits whose alpha was looked up because the material masks.", "MaliFragLZSTestTd"},
    {"tilecore.samples_visible", &tilecore::TileCoreCounters::samples_visible, Combine::kSum, "samples",
     "Samples that see an opaque surface when the tile is finished.", ""},
    {"tilecore.blended_layers", &tilecore::TileCoreCounters::blended_layers, Combine::kSum, "layers",
     "Blended surfaces that samples see in front of what is opaque.", ""},
    {"tilecore.pixel_shader_invocations", &tilecore::TileCoreCounters::pixel_shader_invocations, Combine::kSum, "invocations",
     "Runs of the pixel shader.", "MaliFragThread; fragment invocations"},
});
TESSERA_COUNTERS_COVER(tilecore::TileCoreCounters);

}  // namespace tessera::hardware
