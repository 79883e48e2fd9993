#pragma once

#include <cstdint>
#include "base/key_table.h"

#include "tilecore/resolve/advection.h"
#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/discrepancy.h"
#include "tilecore/resolve/edge_detector.h"
#include "tilecore/resolve/foveation.h"
#include "tilecore/resolve/pattern_dither.h"
#include "tilecore/resolve/rate_selector.h"
#include "tilecore/resolve/velocity_buffer.h"

namespace tessera::tilecore {

// Choice of the shaded pixels.
enum class Desampling {
  kOff,           // all; only the multisample resolve of the resolve unit runs
  kAdaptive,      // by motion, edges and history (rate_selector.h)
  kFixed8,        // half of every block, edges included: a yardstick
  kFixed4,        // a quarter of every block
  kCheckerboard,  // half, alternating, filled from all four neighbours on any surface: the usual baseline
};

// Whether stencils stop at the tile's border, or read pixels of neighbouring tiles in a second pass.
enum class StencilReach { kTile, kNeighbours };

// Source of the colours of the previous frame.
enum class HistoryColors {
  kFrameBuffer,  // its finished pixels, in the frame buffer's format and as it lies in memory
  kApart,        // as shaded, single precision, kept beside it: 16 bytes a pixel more are written
};
inline constexpr std::uint64_t kApartColorBytes = 16;

// Keys resolve.*.
struct ResolveSettings {
  Desampling desampling = Desampling::kOff;
  RateSettings rates;
  BlockSpeed block_speed = BlockSpeed::kMean;
  EdgeSettings edges;
  double edge_angle = 15;  // [measured] 20 saves 0.3 % more of `stroll`, at equal PSNR
  DitherSettings dither;
  bool advect = true;
  AdvectionSettings advection;
  DiscrepancySettings discrepancy;
  Reconstruction reconstruction = Reconstruction::kCubic;
  StencilReach reach = StencilReach::kTile;
  FoveationSettings foveation;
  HistoryColors colors = HistoryColors::kFrameBuffer;
  bool skip_unchanged = true;  // unchanged blocks (unchanged_blocks.h); no key: false for tests alone
};
Keys<ResolveSettings> resolve_keys();

// Throws UsageError when thresholds or radii are out of order.
void check_resolve(const ResolveSettings& settings);

// Whether blocks may take pixels from the previous frame, and so need its records (depth and surface of each pixel).
constexpr bool advects(const ResolveSettings& s) {
  return s.desampling == Desampling::kAdaptive && s.advect && s.rates.thresholds.reuse > 0;
}
// Whether decisions need the contrast that the previous frame left of each block.
constexpr bool reads_contrast(const ResolveSettings& s) {
  return s.desampling == Desampling::kAdaptive && s.rates.pattern_error > 0;
}
// Whether decisions need its regimes for the hysteresis, or its rejects for advection.
constexpr bool reads_blocks(const ResolveSettings& s) {
  return advects(s) || (s.desampling == Desampling::kAdaptive && s.rates.thresholds.hysteresis > 0);
}

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::Desampling> = std::to_array<std::string_view>({"off", "adaptive", "fixed_8",
                                                                                          "fixed_4", "checkerboard"});
template <>
inline constexpr auto kEnumWords<tilecore::HistoryColors> = std::to_array<std::string_view>({"frame_buffer", "apart"});
template <>
inline constexpr auto kEnumWords<tilecore::StencilReach> = std::to_array<std::string_view>({"tile", "neighbours"});

}  // namespace tessera
