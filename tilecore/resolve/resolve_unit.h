#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "base/rect.h"
#include "memory/ledger.h"
#include "tilecore/frame_targets.h"
#include "tilecore/resolve/edge_detector.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/resolve/history.h"
#include "tilecore/resolve/history_memory.h"
#include "tilecore/resolve/motion_field.h"
#include "tilecore/resolve/pixel_surfaces.h"
#include "tilecore/resolve/resolve_settings.h"
#include "tilecore/resolve/touched_bursts.h"
#include "tilecore/resolve/unchanged_blocks.h"
#include "tilecore/resolve/velocity_buffer.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

struct DesamplingCounters {
  std::uint64_t blocks_rate_4 = 0, blocks_rate_8 = 0, blocks_rate_16 = 0, blocks_rate_32 = 0;
  std::uint64_t blocks_advected = 0, blocks_edge = 0, blocks_foveated = 0, history_rejected = 0, blocks_discrepant = 0,
                blocks_highlight = 0;
  std::uint64_t pixels_advected = 0, pixels_reconstructed = 0, advections_disoccluded = 0;
  std::uint64_t velocity_operations = 0, stencil_taps = 0, light_tests = 0, contrast_operations = 0,
                highlight_tests = 0;
  std::uint64_t samples_skipped = 0, invocations_saved = 0;
};

// Source of advected pixels: an earlier frame, or this frame for the other eye.
struct AdvectionSource {
  const History* history = nullptr;  // nullptr: there is none
  const MotionField* motion = nullptr;
};

// Data about the resolve that the tile cores of one frame share. They only read it, except for `next` and `origin`, in
// which tiles write disjoint pixels.
struct ResolveFrame {
  ResolveSettings settings;
  Foveation foveation;        // of frames of this size
  std::uint32_t number = 0;   // of the frame, for the dither
  AdvectionSource previous;   // `motion` alone: speeds are known, but no pixel may be advected
  AdvectionSource other_eye;  // stereo: the left eye's finished frame
  float other_eye_depth = 0;  // both eyes must see a point farther than this
  bool keeps_records = true;  // the next frame's advection, or the right eye, needs depth and surface of each pixel
  bool keeps_blocks = false;  // unchanged blocks are neither read nor written
  bool cut = false;           // the camera's motion differs from the previous frame's
  bool auxiliary = false;     // images show velocities and edges that the machine does not need; not counted
  CreaseDetector creases;
  History* next = nullptr;
  std::vector<std::uint8_t> origin;   // per pixel of the region: PixelOrigin
  std::vector<std::uint8_t> written;  // per block of the region: colours of this frame were written, and may be again
  std::vector<std::uint8_t>
      deferred;  // per block of the region: to be filled in the second pass; 1, or 2 when it has an edge
};
enum class PixelOrigin : std::uint8_t { kShaded, kAdvected, kReconstructed };

// Decides which pixels of a tile are shaded and fills the others. Works on resolved pixels, by blocks of 4x4 that lie
// on multiples of four pixels of the frame. Owns scratch memory; one instance per thread.
//
//   plan():     surfaces -> edges, velocity -> rate -> pattern -> advectable pixels -> pixel-shader invocations
//   check():    mean of samples -> discrepancy -> pixels that are shaded after all
//   complete(): their mean -> stencils -> history, frame buffer
//   finish_deferred(), StencilReach::kNeighbours only: when all tiles are complete, the stencils that reach into other tiles
//
// Invariants (cited by the tests):
//   RU1  Decisions of a block depend on its own pixels and on the history alone: not on the tile, its neighbours, or
//        threads.
//   RU2  With StencilReach::kNeighbours neither do images; without, stencils stop at the tile's border.
//   RU3  A pixel that is shaded has the colour that it has without desampling, bit for bit.
//   RU4  A pixel without a surface is never skipped: it costs no pixel-shader invocation.
//   RU5  A pixel that neither advection nor a rendered pixel of its surface in the block can give is shaded.
//   RU6  The history keeps each pixel as the image shows it. It keeps, and charges, only data that is read. An
//        unchanged block is neither read nor written, and the image is the same.
//   RU7  A reconstructed pixel is never taken over: the history marks it.
class ResolveUnit {
 public:
  // The storage of the history and the charging of its traffic.
  using Memory = HistoryStorage;

  void plan(const ResolveFrame& resolve, const scene::FrameGeometry& frame, const TileSamples& samples,
            TileState& state);

  // The PixelRate of each pixel of the tile planned last.
  std::span<const std::uint8_t> pixel_rates() const { return pixel_rates_; }

  // `color` and `coverage`: spp values per pixel; values of skipped pixels are not read. Returns true if pixels were
  // taken over wrongly; the caller then shades the pixels with reshade_mask() == 1 before it calls complete().
  bool check(ResolveFrame& resolve, std::span<const Vec3> color, std::span<const float> coverage);
  std::span<const std::uint8_t> reshade_mask() const { return reshade_mask_; }

  // Makes the image of `targets` ready for the TileStore. Returns true if finish_deferred() has pixels left to fill.
  bool complete(ResolveFrame& resolve, std::span<const Vec3> color, std::span<const float> coverage,
                const Memory& memory, FrameTargets& targets);
  // The blocks of the tile completed last.
  const UnchangedBlocks& unchanged() const { return unchanged_; }
  // Lines of the L2 requested since the last call, numbered from 0 in a memory of their own.
  std::vector<std::uint32_t> take_lines() { return std::exchange(lines_, {}); }

  // Takes over into the history the changes that the TileStore made to the image of the tile completed last.
  void keep_stored(ResolveFrame& resolve, const FrameTargets& targets) const;

  // Second pass over a tile; no other tile may still be incomplete.
  void finish_deferred(ResolveFrame& resolve, IntRect tile, const Memory& memory, FrameTargets& targets);

  DesamplingCounters take_counters() { return std::exchange(counters_, {}); }
  HistoryCounters take_history_counters() { return std::exchange(history_counters_, {}); }
  std::uint64_t take_pixels_shaded() { return std::exchange(pixels_shaded_, 0); }
  // Number of requested places at shutter open, of samples that see a surface elsewhere.
  std::uint64_t take_places() { return std::exchange(places_, 0); }
  memory::Ledger take_ledger() { return std::exchange(ledger_, {}); }
  // Sends every transfer also to `log`, until take_ledger().
  void record_accesses(memory::AccessLog* log) { ledger_.record_into(log); }
  void count_skipped(std::uint64_t samples, std::uint64_t invocations);

 private:
  struct Block {
    IntRect pixels;
    BlockDecision decision;
    BlockMask rendered = 0, advected = 0, reconstructed = 0;
    BlockMask again = 0;             // pixels first advected or to be reconstructed, to be shaded now
    BlockMask exists = 0, seen = 0;  // inside the tile; with a surface
    bool uniform = false;            // all pixels show the same surfaces
    bool edge = false, outline = false, creased = false, still = false, same_shading = false, from_other_eye = false;
    bool plane = false;  // a record of the whole block gives its pixels' places
    bool leaves_contrast = false;
    std::uint8_t last_contrast = 0;  // the previous frame's byte at its place
    float left_by_blur = 1;          // of contrast, by this frame's shutter
    float plane_value = 0, plane_by_x = 0, plane_by_y = 0;
    float slope = 0;      // of depth_limit()
    bool copied = false;  // at rest; its pixels that are not shaded are copied
    BlockMask lost = 0;   // not copied, because the history has other pixels
    bool discrepant = false, kept = false;
    // Whether it shows the same as in the previous frame.
    bool rests() const { return copied && !discrepant && lost == 0; }
  };

  void plan_block(const ResolveFrame& resolve, Block& block);
  void decide(const ResolveFrame& resolve, Block& block);
  void settle(const ResolveFrame& resolve, Block& block, const BlockEvidence& evidence, float nearest);
  void fetch_ahead(const ResolveFrame& resolve, const Block& block) const;
  // Whether the block sees several surfaces.
  bool is_outline(const Block& block) const;
  bool is_edge(const ResolveFrame& resolve, Block& block);
  float blur_of(const Block& block) const;
  bool is_relit(const MotionField& motion, const Block& block);
  float slope_of(const Block& block) const;
  // The previous frame's contrast at the block's origin, by its motion in velocity_.
  float contrast_before(const History& history, Block& block);
  void keep_contrast(ResolveFrame& resolve);
  void charge_contrast(const HistoryMemory& places, const Memory& memory);
  bool any_rests(const IntRect& blocks) const;
  // The missing pixels that have a rendered pixel of their surface in the block.
  BlockMask reconstructible(const ResolveSettings& settings, const Block& block, BlockMask missing) const;
  void try_advection(const ResolveFrame& resolve, Block& block, BlockMask missing);
  void copy_still(const ResolveFrame& resolve, Block& block, BlockMask missing);
  // Calls advect() for the plain pixels of `wanted`; returns them. `out` points to the block's first pixel.
  BlockMask advect_plain(const ResolveFrame& resolve, const Block& block, const VelocityBuffer& velocity,
                         BlockMask wanted, Vec4* out, std::ptrdiff_t out_stride);
  bool advect(const ResolveFrame& resolve, const Block& block, const VelocityBuffer& velocity, int x, int y, Vec4& out,
              bool count);
  BlockMask kept_pixels(const History& history, const Block& block, BlockMask wanted, Vec4* out16) const;
  BlockMask advectable(const ResolveFrame& resolve, const Block& block, BlockMask wanted, Vec4* there);
  void average_samples(const Block& block, BlockMask pixels, std::span<const Vec3> color,
                       std::span<const float> coverage);
  void shade_again(Block& block);
  void keep_records(ResolveFrame& resolve) const;
  void resolve_pixels(ResolveFrame& resolve, const FrameTargets& targets);
  void look_at_pixels(const ResolveFrame& resolve, Block& block, float& nearest) const;
  bool is_discrepant(const ResolveFrame& resolve, const Block& block);
  // Whether the border of a highlight runs through the block: some rendered pixels are brighter than white, others much
  // darker.
  bool shows_highlight(const Block& block);
  // Colour, depth and surface of the pixels of `region`, row by row.
  struct Records {
    Vec4* color;
    const float* depth;
    const std::uint32_t* surface;
    IntRect region;
    std::size_t index(int x, int y) const { return region.index(x, y); }
    float depth_at(int x, int y) const { return std::abs(depth[index(x, y)]); }
  };
  // Fills pixels by stencils, which read pixels of `records` alone.
  void reconstruct(ResolveFrame& resolve, const Block& block, const Records& records);
  std::array<std::uint16_t, kWindowSide> usable_window(const ResolveFrame& resolve, const Block& block,
                                                       std::uint32_t surface, const Records& records) const;
  void write_auxiliary(const ResolveFrame& resolve, FrameTargets& targets) const;
  void record(bool orthographic, Block& block);
  bool may_stay(const ResolveFrame& resolve, const Block& block) const;
  void compare_with_signature(ResolveFrame& resolve, const Memory& memory, Block& block, bool open);
  void find_unchanged_blocks(ResolveFrame& resolve, const Memory& memory, bool open);
  struct HistoryReads {
    const History& history;
    std::span<const IntRect> states, signatures;  // of blocks
    std::span<const IntRect> records, colors;     // of pixels
    std::uint32_t first_line;
  };
  static constexpr std::uint32_t kOtherEyeLine = 1u << 28;  // the other eye's history lies behind this eye's
  std::uint64_t read_touched(const Memory& memory, std::uint32_t first_line);
  std::uint64_t write_touched(const Memory& memory);
  void read_history(const ResolveFrame& resolve, const Memory& memory, const HistoryReads& reads);
  BlockRecord record_of(const Block& block) const;
  void write_cells(ResolveFrame& resolve, const HistoryMemory& places, const Memory& memory);
  void write_records(ResolveFrame& resolve, const HistoryMemory& places, const Memory& memory);
  void charge(ResolveFrame& resolve, const Memory& memory);

  PixelSurfaces surfaces_;
  const TileSamples* samples_ = nullptr;  // of the current tile
  const TileState* state_ = nullptr;
  VelocityBuffer velocity_, eye_velocity_;
  std::vector<Block> blocks_;
  std::vector<std::uint8_t> pixel_rates_, reshade_mask_;
  std::vector<Vec4> colors_;    // per pixel of the tile: from plan() on the advected ones, then all
  std::vector<float> records_;  // depth of each pixel, as the history keeps it
  // Pixels of the histories whose records (looked at) and whose colours (fetched) this tile read.
  std::vector<IntRect> looked_at_, eye_looked_at_, fetched_, eye_fetched_;
  std::vector<IntRect> signatures_read_, signatures_written_;  // column and row of blocks
  std::vector<IntRect> contrast_rects_, written_contrast_;     // of blocks
  UnchangedBlocks unchanged_;
  TouchedBursts touched_;
  std::vector<std::uint32_t> lines_;
  std::uint64_t vertex_bytes_ = 0;  // of the other frames' vertices, for velocities of this tile
  int spp_ = 1;
  AdvectionWork advection_work_;
  ReconstructionWork reconstruction_work_;
  DesamplingCounters counters_;
  HistoryCounters history_counters_;
  std::uint64_t pixels_shaded_ = 0, places_ = 0;
  memory::Ledger ledger_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::DesamplingCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::DesamplingCounters> =
    std::to_array<CounterField<tilecore::DesamplingCounters>>({
        {"resolve.blocks_rate_4", &tilecore::DesamplingCounters::blocks_rate_4, Combine::kSum, "blocks",
         "Blocks of 4x4 pixels of which 4 were to be shaded.", ""},
        {"resolve.blocks_rate_8", &tilecore::DesamplingCounters::blocks_rate_8, Combine::kSum, "blocks",
         "Blocks of which 8 pixels were to be shaded.", ""},
        {"resolve.blocks_rate_16", &tilecore::DesamplingCounters::blocks_rate_16, Combine::kSum, "blocks",
         "Blocks that were shaded fully.", ""},
        {"resolve.blocks_rate_32", &tilecore::DesamplingCounters::blocks_rate_32, Combine::kSum, "blocks",
         "Blocks that were shaded at two groups of samples per pixel.", ""},
        {"resolve.blocks_advected", &tilecore::DesamplingCounters::blocks_advected, Combine::kSum, "blocks",
         "Blocks of blocks_rate_4 and blocks_rate_8 whose other pixels come from the previous frame or the other eye.",
         ""},
        {"resolve.blocks_foveated", &tilecore::DesamplingCounters::blocks_foveated, Combine::kSum, "blocks",
         "Blocks with surfaces that foveation limits to fewer than 16 samples.", ""},
        {"resolve.blocks_edge", &tilecore::DesamplingCounters::blocks_edge, Combine::kSum, "blocks",
         "Blocks with an edge that are rendered fully, or twice; blocks that are advected nevertheless do not count.",
         ""},
        {"resolve.history_rejected", &tilecore::DesamplingCounters::history_rejected, Combine::kSum, "blocks",
         "Blocks without advection because reprojection had gone wrong around them.", ""},
        {"resolve.blocks_highlight", &tilecore::DesamplingCounters::blocks_highlight, Combine::kSum, "blocks",
         "Blocks whose missing pixels were shaded instead of filled by stencils, because the border of a highlight "
         "runs through their first shaded pixels.",
         ""},
        {"resolve.blocks_discrepant", &tilecore::DesamplingCounters::blocks_discrepant, Combine::kSum, "blocks",
         "Blocks whose advected pixels differed from the shaded ones.", ""},
        {"resolve.pixels_advected", &tilecore::DesamplingCounters::pixels_advected, Combine::kSum, "pixels",
         "Pixels taken from the previous frame or the other eye.", ""},
        {"resolve.pixels_reconstructed", &tilecore::DesamplingCounters::pixels_reconstructed, Combine::kSum, "pixels",
         "Pixels made from rendered neighbours.", ""},
        {"resolve.advections_disoccluded", &tilecore::DesamplingCounters::advections_disoccluded, Combine::kSum,
         "pixels", "Pixels shaded because the previous frame shows another surface or depth in their place.", ""},
        {"resolve.velocity_operations", &tilecore::DesamplingCounters::velocity_operations, Combine::kSum, "operations",
         "Operations of four channels for velocities, of desampling or of temporal antialiasing: 5 for a point of a "
         "rigid drawable (a matrix and a division), 15 "
         "for a point of a deforming triangle in both frames, 41 for a point of a deforming patch, 120 more if it is "
         "displaced. Unless shading.surface=evaluated, a patch's vertices that a tile's pixels see are evaluated, once "
         "each, and points lie on triangles.",
         ""},
        {"resolve.highlight_tests", &tilecore::DesamplingCounters::highlight_tests, Combine::kSum, "tests",
         "Shaded pixels of blocks to be filled whose brightness was tested, to find borders of highlights.", ""},
        {"resolve.light_tests", &tilecore::DesamplingCounters::light_tests, Combine::kSum, "tests",
         "Tests of a block against the reach of a light that changed.", ""},
        {"resolve.contrast_operations", &tilecore::DesamplingCounters::contrast_operations, Combine::kSum, "operations",
         "Operations of four channels for the contrast of blocks: one for each pixel, three for each difference.", ""},
        {"resolve.stencil_taps", &tilecore::DesamplingCounters::stencil_taps, Combine::kSum, "multiply-adds",
         "Rendered pixels that entered a reconstructed one, four channels each.", ""},
        {"resolve.samples_skipped", &tilecore::DesamplingCounters::samples_skipped, Combine::kSum, "samples",
         "Visible samples and blended layers of pixels that were not shaded.", ""},
        {"resolve.invocations_saved", &tilecore::DesamplingCounters::invocations_saved, Combine::kSum, "invocations",
         "Pixel-shader invocations that the pixels of resolve.samples_skipped would have taken; with "
         "shading.rate=cache the lookups.",
         "MaliFragThread, as a difference"},
    });
TESSERA_COUNTERS_COVER(tilecore::DesamplingCounters);

}  // namespace tessera
