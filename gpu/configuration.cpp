#include "gpu/configuration.h"

#include <filesystem>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "binner/queue_entry.h"
#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::gpu {
namespace {

using nlohmann::json;
using Gpu = GpuConfiguration;

// What a preset changes against the defaults of GpuConfiguration.
struct Preset {
  const char* name;
  std::vector<std::pair<std::string_view, json>> values;
};

const std::vector<Preset>& presets() {
  static const std::vector<Preset> kPresets = {
      // [spec] Entry-level mobile parts bin 16x16 pixels; [spec] 2 MiB is where PowerVR's driver starts.
      {"small",
       {{"tile.width", 16},
        {"tile.height", 16},
        {"parameter_buffer.bytes", 2 << 20},
        {"binner.combining_bursts", 64},
        {"memory.burst_bytes", 32},
        {"tessellator.sub_patch_cells", 8},
        {"clock.mhz", 650},
        {"tilecore.count", 1},
        {"tilecore.memory_bytes", 40 << 10},
        {"shader.lanes", 8},
        {"texture.texels_per_clk", 1},
        {"resolve.pixels_per_clk", 2},
        {"texture.cache_bytes", 8 << 10},
        {"l2.bytes", 32 << 10},
        {"tessellator.cache_bytes", 32 << 10},
        {"post_tessellation.cache_bytes", 32 << 10},
        {"immediate.cache_bytes", 32 << 10},
        {"visibility_stream.gmem_bytes", 132 << 10},
        {"memory.bytes_per_clk", 19.7},
        {"memory.latency_clk", 160},
        {"energy.leakage_mw", 15}}},
      {"middle", {}},
      // [spec] The largest mobile parts render 64x64 pixels; [spec] 128 MiB is where Mali's tiler heap ends.
      {"large",
       {{"tile.width", 64},
        {"tile.height", 64},
        {"parameter_buffer.bytes", 128 << 20},
        {"parameter_buffer.chunk_bytes", 256},
        {"binner.combining_bursts", 1024},
        {"clock.mhz", 900},
        {"tilecore.count", 12},
        {"tilecore.memory_bytes", 640 << 10},
        {"frontend.bounds_per_clk", 1},
        {"binner.entries_per_clk", 2},
        {"binner.tiles_per_clk", 8},
        {"shader.lanes", 128},
        {"texture.texels_per_clk", 8},
        {"tilecore.box_tests_per_clk", 32},
        {"tilecore.triangle_tests_per_clk", 32},
        {"resolve.pixels_per_clk", 8},
        {"texture.cache_bytes", 32 << 10},
        {"l2.bytes", 512 << 10},
        {"l2.ways", 16},
        {"tessellator.cache_bytes", 512 << 10},
        {"post_tessellation.cache_bytes", 512 << 10},
        {"immediate.cache_bytes", 512 << 10},
        {"visibility_stream.gmem_bytes", 2 << 20},
        {"memory.bytes_per_clk", 75.9},
        {"memory.latency_clk", 224},
        {"memory.pj_per_bit", 8},
        {"energy.leakage_mw", 300}}},
  };
  return kPresets;
}

Keys<BaselineCaches> baseline_keys() {
  return {
      {"post_tessellation.cache_bytes", &BaselineCaches::post_tessellation_cache_bytes, "bytes", 0, 1073741824.0,
       "With --baselines: on-chip memory through which the tile cores of a machine that bins triangles read them.",
       "[assumed] as tessellator.cache_bytes"},
      {"immediate.cache_bytes", &BaselineCaches::immediate_cache_bytes, "bytes", 0, 1073741824.0,
       "With --baselines: colour and depth cache of an immediate-mode machine.",
       "[assumed] as tessellator.cache_bytes"},
      {"immediate.color_compression", &BaselineCaches::immediate_color_compression,
       "With --baselines: whether an immediate-mode machine compresses colour without loss when that moves fewer "
       "bytes.",
       "[spec] all immediate-mode parts do; [assumed] a driver that knows when it pays"},
      {"visibility_stream.gmem_bytes", &BaselineCaches::gmem_bytes, "bytes", 8192, 1073741824.0,
       "With --baselines: tile memory of a machine that bins into visibility streams; its bins are as large as fit.",
       "[spec] 1 MiB: Adreno 630 and 640; presets: 610 (132 KiB) and 680 (2 MiB), in Mesa's a6xx catalogue"},
  };
}

std::vector<std::string> key_names() {
  std::vector<std::string> names;
  for (const auto& key : gpu_keys().keys()) names.emplace_back(key.name);
  return names;
}

Gpu preset(const std::string& name) {
  for (const Preset& p : presets()) {
    if (p.name != name) continue;
    Gpu gpu;
    gpu.preset = name;
    for (const auto& [key, value] : p.values) gpu_keys().set(gpu, *gpu_keys().find(key), value);
    return gpu;
  }
  throw UsageError(
      fmt::format("unknown GPU preset '{}' and no such file; presets: {}", name, fmt::join(preset_names(), ", ")));
}

Gpu from_json(const std::string& file, const json& root) {
  if (!root.is_object()) throw InputError(file, "", "a GPU configuration is a JSON object");
  const auto base = root.find("preset");
  if (base != root.end() && !base->is_string()) throw InputError(file, "/preset", "is not a text");
  Gpu gpu = preset(base == root.end() ? "middle" : base->get<std::string>());
  const std::vector<std::string> names = key_names();
  std::function<void(const json&, const std::string&, const std::string&)> visit =
      [&](const json& object, const std::string& prefix, const std::string& pointer) {
        for (const auto& [name, value] : object.items()) {
          const std::string key = prefix.empty() ? name : prefix + "." + name, place = pointer + pointer_step(name);
          if (key == "preset") continue;
          if (value.is_object()) {
            visit(value, key, place);
            continue;
          }
          try {
            const auto* row = gpu_keys().find(key);
            if (row == nullptr) throw UsageError(unknown_key_message(key, names));
            gpu_keys().set(gpu, *row, value);
          } catch (const UsageError& error) {
            throw InputError(file, place, error.what());
          }
        }
      };
  visit(root, "", "");
  return gpu;
}

// Sets of a cache are addressed by bits, ways may be any number.
void check_cache(std::string_view name, std::int64_t bytes, std::int64_t ways, std::int64_t line_bytes) {
  const std::int64_t sets = bytes / (ways * line_bytes);
  if (sets < 1 || sets * ways * line_bytes != bytes || (sets & (sets - 1)) != 0)
    throw UsageError(
        fmt::format("{0}_bytes and {0}_ways: {1} bytes are not a power of two of sets of {2} ways of {3} bytes", name,
                    bytes, ways, line_bytes));
}

}  // namespace

int GpuConfiguration::depth_block_pixels() const {
  int side = frontend.depth_block_pixels;
  while (tile.width % side != 0 || tile.height % side != 0) side /= 2;
  return side;
}

frontend::SplitPrices GpuConfiguration::split_prices() const {
  frontend::SplitPrices prices;
  prices.bin_width = tile.width;
  prices.bin_height = tile.height;
  prices.rectangles = binner.coverage == binner::CoverageMethod::kRectangle;
  // The front end and the binner exist once, and the cores wait for them; the cores share what follows.
  const double core = frontend.split_core_share / static_cast<double>(cores.count);
  prices.bound = 1 / rates.bounds_per_clk;
  prices.byte = 1 / (memory.bytes_per_clk * memory.gpu_share);
  prices.entry = 1 / rates.binned_entries_per_clk + core / rates.fetched_entries_per_clk;
  prices.entry_bytes = 1;
  prices.entry_time_bytes = 2;
  prices.record_bytes = static_cast<double>(binner::kRecordBytes);
  prices.box = core / rates.boxes_per_clk;
  prices.boxes_per_cell = 1 + 1.0 / static_cast<double>(tilecore::kLeafCells);
  return prices;
}

const KeyTable<GpuConfiguration>& gpu_keys() {
  static const KeyTable<Gpu> table(Keys<Gpu>()
                                       .add(&Gpu::frontend, frontend::settings_keys())
                                       .add(&Gpu::tile, binner::tile_keys())
                                       .add(&Gpu::parameter_buffer, binner::parameter_buffer_keys())
                                       .add(&Gpu::binner, binner::settings_keys())
                                       .add(&Gpu::tessellator, tilecore::tessellator_keys())
                                       .add(&Gpu::baselines, baseline_keys())
                                       .add(&Gpu::tilecore, tilecore::core_keys())
                                       .add(&Gpu::shading_cache, tilecore::shading_cache_keys())
                                       .add(hardware::burst_keys())
                                       .add(&Gpu::frame_buffer, tilecore::frame_buffer_keys())
                                       .add(hardware::machine_keys()));
  return table;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const Preset& p : presets()) names.emplace_back(p.name);
  return names;
}

GpuConfiguration load_gpu(const std::string& preset_or_file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(preset_or_file, ignored)) return preset(preset_or_file);
  constexpr std::uint64_t kMaxBytes = 16u << 20;
  return parse_gpu(read_whole_text(preset_or_file, kMaxBytes), preset_or_file);
}

GpuConfiguration parse_gpu(std::string_view text, const std::string& name) {
  try {
    return from_json(name, parse_unique_json(text, name));
  } catch (const UsageError& error) {
    throw InputError(name, "", error.what());
  }
}

void check_gpu(const GpuConfiguration& gpu) {
  if (gpu.tile.width % 8 != 0 || gpu.tile.height % 8 != 0)
    throw UsageError("tile.width and tile.height must be multiples of 8 pixels");
  if ((gpu.frontend.depth_block_pixels & (gpu.frontend.depth_block_pixels - 1)) != 0)
    throw UsageError("frontend.depth_block_pixels must be a power of two");
  if (gpu.tilecore.box_bits != 8 && gpu.tilecore.box_bits != 16 && gpu.tilecore.box_bits != 32)
    throw UsageError("tilecore.box_bits must be 8, 16 or 32");
  if ((gpu.memory.burst_bytes & (gpu.memory.burst_bytes - 1)) != 0)
    throw UsageError("memory.burst_bytes must be a power of two");
  for (const std::int64_t chunk : {gpu.parameter_buffer.first_chunk_bytes, gpu.parameter_buffer.chunk_bytes})
    if (chunk % gpu.memory.burst_bytes != 0 && gpu.memory.burst_bytes % chunk != 0)
      throw UsageError(
          "parameter_buffer.first_chunk_bytes and parameter_buffer.chunk_bytes must be multiples or parts of "
          "memory.burst_bytes");
  if ((gpu.caches.line_bytes & (gpu.caches.line_bytes - 1)) != 0)
    throw UsageError("cache.line_bytes must be a power of two");
  check_cache("texture.cache", gpu.caches.texture_bytes, gpu.caches.texture_ways, gpu.line_bytes());
  if (gpu.caches.l2_bytes > 0) check_cache("l2", gpu.caches.l2_bytes, gpu.caches.l2_ways, gpu.line_bytes());
}

nlohmann::json gpu_json(const GpuConfiguration& gpu) {
  json root = {{"preset", gpu.preset}};
  for (const auto& key : gpu_keys().keys()) {
    const std::string_view name = key.name;
    const std::size_t dot = name.find('.');
    root[std::string(name.substr(0, dot))][std::string(name.substr(dot + 1))] =
        key_value_json(gpu_keys().value(gpu, key));
  }
  return root;
}

}  // namespace tessera::gpu
