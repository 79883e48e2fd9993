#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hardware/counter.h"
#include "tilecore/frame_targets.h"
#include "tilecore/sample_pattern.h"
#include "tilecore/tile_job.h"
#include "tilecore/tile_state.h"

namespace tessera::tilecore {

struct ShadingCounters {
  std::uint64_t samples_visible = 0;
  std::uint64_t blended_layers = 0;
  std::uint64_t pixel_shader_invocations = 0;
};

// Deferred shading of one tile: runs the pixel shader where samples see something, and composes blended layers over it.
// Keeps its scratch memory from tile to tile; one instance per thread.
class DeferredShader {
 public:
  // Colours every sample of the tile. `state` is what all entries of the tile left; its layers are sorted and those
  // behind what is opaque are dropped.
  void shade(const TileJob& job, const TileSamples& samples, TileState& state);

  // Of the tile shaded last, natural order: linear colour with the background in it, and how much of the sample is covered.
  std::span<const Vec3> color() const { return sample_color_; }
  std::span<const float> coverage() const { return sample_coverage_; }

  // Writes depth, normal, patch and invocations of the tile shaded last.
  void write_auxiliary(const TileSamples& samples, const TileState& state, FrameTargets& targets) const;

  ShadingCounters take_counters() { return std::exchange(counters_, {}); }

 private:
  void shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state);
  void fill_background(const TileJob& job, const TileSamples& samples, std::size_t first, std::size_t count);
  void shade_layers(const TileJob& job, const TileSamples& samples, TileState& state);

  std::vector<Vec3> sample_color_;     // natural order, opaque then blended
  std::vector<float> sample_coverage_;
  std::vector<Vec3> pixel_normal_;     // sums over the pixel's shaded points
  std::vector<std::uint32_t> pixel_invocations_;
  ShadingCounters counters_;
};

}  // namespace tessera::tilecore

namespace tessera::hardware {

template <>
inline constexpr auto kCounterFields<tilecore::ShadingCounters> = std::to_array<CounterField<tilecore::ShadingCounters>>({
    {"tilecore.samples_visible", &tilecore::ShadingCounters::samples_visible, Combine::kSum, "samples",
     "Samples that see an opaque surface when the tile is finished.", ""},
    {"tilecore.blended_layers", &tilecore::ShadingCounters::blended_layers, Combine::kSum, "layers",
     "Blended surfaces that samples see in front of what is opaque.", ""},
    {"tilecore.pixel_shader_invocations", &tilecore::ShadingCounters::pixel_shader_invocations, Combine::kSum, "invocations",
     "Runs of the pixel shader.", "MaliFragThread; fragment invocations"},
});
TESSERA_COUNTERS_COVER(tilecore::ShadingCounters);

}  // namespace tessera::hardware
