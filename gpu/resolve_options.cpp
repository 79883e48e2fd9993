#include "gpu/resolve_options.h"

#include <array>
#include <string_view>
#include <utility>

#include "base/check.h"
#include "base/error.h"

namespace tessera::gpu {
namespace {

// The value that a word stands for; settings are checked when they are set, so the word is one of them.
template <class T, std::size_t N>
T meaning_of(std::string_view word, const std::pair<std::string_view, T> (&words)[N]) {
  for (const auto& [name, value] : words)
    if (name == word) return value;
  TESSERA_CHECK(false, "a setting has a value that it may not have");
  return words[0].second;
}

}  // namespace

tilecore::ResolveSettings resolve_settings(const RunSettings& s, int width, int height) {
  using namespace tilecore;
  ResolveSettings out;
  out.desampling = meaning_of<Desampling>(s.desampling, {{"off", Desampling::kOff},
                                                         {"adaptive", Desampling::kAdaptive},
                                                         {"fixed_8", Desampling::kFixed8},
                                                         {"fixed_4", Desampling::kFixed4},
                                                         {"checkerboard", Desampling::kCheckerboard}});
  if (s.k_stat > s.k_fast1 || s.k_fast1 > s.k_fast2)
    throw UsageError("resolve.k_stat, resolve.k_fast1 and resolve.k_fast2 must not fall in this order");
  out.rates.thresholds = {static_cast<float>(s.k_stat), static_cast<float>(s.k_fast1), static_cast<float>(s.k_fast2),
                          static_cast<float>(s.hysteresis)};
  out.rates.supersampling = s.supersampling;
  out.rates.advect_still_edges = s.advect_still_edges;
  out.block_speed = meaning_of<BlockSpeed>(s.block_speed, {{"mean", BlockSpeed::kMean},
                                                           {"max", BlockSpeed::kMax},
                                                           {"median", BlockSpeed::kMedian},
                                                           {"min", BlockSpeed::kMin}});
  out.edges.measure = s.edges == "depth" ? EdgeMeasure::kDepth : EdgeMeasure::kInverseDepth;
  out.edges.threshold = static_cast<float>(s.edge_threshold);
  out.evidence = meaning_of<EdgeEvidence>(
      s.edge_evidence,
      {{"surface", EdgeEvidence::kSurface}, {"patch", EdgeEvidence::kPatch}, {"depth", EdgeEvidence::kDepth}});
  out.dithering = s.dither != "off";
  out.dither = {s.dither == "seeded" ? DitherOrder::kSeeded : DitherOrder::kCounter, static_cast<std::uint32_t>(s.seed),
                s.dither_per_block};
  out.advect = s.advection;
  out.advection.fetch = s.advection_fetch == "bicubic" ? Fetch::kBicubic : Fetch::kBilinear;
  out.advection.bfecc = s.bfecc;
  out.advection.depth_tolerance = static_cast<float>(s.depth_tolerance);
  out.discrepancy.check = meaning_of<DiscrepancyCheck>(s.discrepancy, {{"rendered", DiscrepancyCheck::kRendered},
                                                                       {"neighbours", DiscrepancyCheck::kNeighbours},
                                                                       {"off", DiscrepancyCheck::kOff}});
  out.discrepancy.tolerance = static_cast<float>(s.discrepancy_tolerance);
  out.discrepancy.frames = static_cast<int>(s.discrepancy_frames);
  out.reconstruction =
      meaning_of<Reconstruction>(s.reconstruction, {{"cubic", Reconstruction::kCubic},
                                                    {"cubic_interpolating", Reconstruction::kCubicInterpolating},
                                                    {"cubic_unscaled", Reconstruction::kCubicUnscaled},
                                                    {"bilinear", Reconstruction::kBilinear},
                                                    {"nearest", Reconstruction::kNearest}});
  out.packed_weights = s.stencil_weights == "packed";
  out.clamp_to_range = s.stencil_clamp;
  out.reach_neighbours = s.stencil_reach == "neighbours";
  out.foveation.on = s.foveation_r0 > 0;
  if (out.foveation.on && s.foveation_r1 < s.foveation_r0)
    throw UsageError("resolve.foveation_r1 must be at least resolve.foveation_r0");
  out.foveation.focus = Vec2(static_cast<float>(s.focus_x * width), static_cast<float>(s.focus_y * height));
  out.foveation.r0 = static_cast<float>(s.foveation_r0);
  out.foveation.r1 = static_cast<float>(s.foveation_r1);
  return out;
}

}  // namespace tessera::gpu
