#include "gpu/tile_memory.h"

#include <fmt/format.h>

#include "base/error.h"
#include "hardware/tile_rules.h"
#include "tilecore/tile_state.h"

namespace tessera::gpu {
namespace {

// The layout without sampled procedures; frames with sampled procedures keep more.
tilecore::SampleLayout layout_of(const GpuConfiguration& gpu, const RunSettings& settings) {
  return {gpu.tilecore.weight_bits, false, false, false, settings.shading.gbuffer_bytes()};
}

std::string does_not_fit(const GpuConfiguration& gpu, const RunSettings& settings) {
  return fmt::format("tilecore.memory_bytes: {} bytes hold no tile of {}x{} pixels with {} samples of {} bytes",
                     gpu.cores.memory_bytes, gpu.tile.width, gpu.tile.height, settings.sampling.samples_per_pixel,
                     layout_of(gpu, settings).room_bytes());
}

}  // namespace

std::uint64_t tile_sample_bytes(const GpuConfiguration& gpu, const RunSettings& settings) {
  return static_cast<std::uint64_t>(gpu.tile.width) * static_cast<std::uint64_t>(gpu.tile.height) *
         static_cast<std::uint64_t>(settings.sampling.samples_per_pixel) * layout_of(gpu, settings).room_bytes();
}

void fit_tile(GpuConfiguration& gpu, const RunSettings& settings) {
  constexpr std::uint64_t kTiles = 2;  // one is rendered while another one is stored
  const auto samples = static_cast<std::uint64_t>(settings.sampling.samples_per_pixel);
  const hardware::TilePixels tile = hardware::largest_tile(samples * layout_of(gpu, settings).room_bytes(),
                                                           static_cast<std::uint64_t>(gpu.cores.memory_bytes), kTiles);
  gpu.tile.width = tile.width, gpu.tile.height = tile.height;
}

std::string grow_tile_memory(GpuConfiguration& gpu, const RunSettings& settings) {
  if (gpu.tile.fit) {
    fit_tile(gpu, settings);
    return "";
  }
  const std::uint64_t needed = tile_sample_bytes(gpu, settings);
  if (static_cast<std::uint64_t>(gpu.cores.memory_bytes) >= needed) return "";
  const std::string what = does_not_fit(gpu, settings);
  gpu.cores.memory_bytes = static_cast<std::int64_t>(needed);
  return fmt::format("{}; the machine has {}, or set tile.width and tile.height", what, needed);
}

void check_tile_memory(const GpuConfiguration& gpu, const RunSettings& settings) {
  if (gpu.tile.fit) return;
  const std::uint64_t needed = tile_sample_bytes(gpu, settings);
  if (static_cast<std::uint64_t>(gpu.cores.memory_bytes) < needed)
    throw UsageError(fmt::format("{}: set {} at least, smaller tiles (tile.width, tile.height) or fewer samples",
                                 does_not_fit(gpu, settings), needed));
}

std::string fit_tile_memory(GpuConfiguration& gpu, const RunSettings& settings, bool chosen) {
  if (chosen) check_tile_memory(gpu, settings);
  return grow_tile_memory(gpu, settings);
}

}  // namespace tessera::gpu
