#include "gpu/configuration.h"

#include <cmath>
#include <filesystem>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/former_keys.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "binner/list_entry.h"
#include "binner/record_cache.h"
#include "gpu/presets.h"
#include "gpu/relative_value.h"
#include "gpu/unread_keys.h"
#include "hardware/voltage.h"
#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::gpu {
namespace {

using hardware::Event;
using nlohmann::json;
using Gpu = GpuConfiguration;

Keys<BaselineCaches> baseline_keys() {
  return {
      {"baselines.cache_bytes", &BaselineCaches::cache_bytes, "bytes", 0, 1073741824.0,
       "With --baselines: on-chip memory through which the tile cores of a machine that bins triangles read them; "
       "colour "
       "and depth cache of an immediate-mode machine.",
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

// Other units in which a key of the memory may be given.
struct ClockedKey {
  KeyInfo info;
  double (hardware::Machine::*get)() const;
  void (hardware::Machine::*set)(double);
};
const std::vector<ClockedKey>& clocked_keys() {
  static const std::vector<ClockedKey> kKeys = {
      {{"memory.bytes_per_clk", "bytes/clk", "", "", 0.125, 65536, {}, true, {}},
       &hardware::Machine::bytes_per_clk,
       &hardware::Machine::set_bytes_per_clk},
      {{"memory.latency_clk", "clk", "", "", 0, 10000, {}, true, {}},
       &hardware::Machine::latency_clk,
       &hardware::Machine::set_latency_clk}};
  return kKeys;
}

// The value of a key, or of a key in clocks; nullopt for others.
std::optional<KeyValue> value_of(const std::string& name, const Gpu& gpu) {
  if (const auto* key = gpu_keys().find(name)) return key->get(gpu);
  for (const ClockedKey& key : clocked_keys())
    if (key.info.name == name) return (gpu.*key.get)();
  return std::nullopt;
}

// Sets the keys that `root` names, nested by the dots of the keys; clock.mhz comes before memory.*, as JSON objects are
// sorted. `changed`, unless nullptr, gets the keys whose values change.
void set_values(const std::string& file, const json& root, Gpu& gpu, std::vector<std::string>* changed = nullptr) {
  const std::vector<std::string> names = key_names();
  std::function<void(const json&, const std::string&, const std::string&)> visit =
      [&](const json& object, const std::string& prefix, const std::string& pointer) {
        for (const auto& [name, value] : object.items()) {
          const std::string key = prefix.empty() ? name : prefix + "." + name, place = pointer + pointer_step(name);
          if (value.is_object()) {
            visit(value, key, place);
            continue;
          }
          try {
            const std::optional<KeyValue> before = value_of(key, gpu);
            if (!set_gpu_key(key, value, gpu)) throw UsageError(unknown_key_message(key, names));
            if (changed != nullptr && value_of(key, gpu) != before) changed->push_back(key);
          } catch (const UsageError& error) {
            throw InputError(file, place, error.what());
          }
        }
      };
  visit(root, "", "");
}

Gpu preset(const std::string& name) {
  const Preset* found = find_preset(name);
  if (found == nullptr) {
    const std::string nearest = nearest_name(name, preset_names());
    const bool file = name.find('/') != std::string::npos || name.ends_with(".json");
    throw UsageError(fmt::format("{} '{}'{}{}; presets: {}", file ? "no GPU file" : "unknown GPU preset",
                                 escape_control(name, 120), file ? "" : " and no such file",
                                 nearest.empty() || file ? "" : fmt::format("; did you mean '{}'?", nearest),
                                 fmt::join(preset_names(), ", ")));
  }
  Gpu gpu;
  gpu.preset = found->name;
  set_values(found->name, found->values, gpu);
  return gpu;
}

// Longest chain of files that name each other as base.
constexpr int kMaxBases = 8;

Gpu load(const std::string& preset_or_file, int depth);

Gpu from_json(const std::string& file, json root, int depth) {
  if (!root.is_object()) throw InputError(file, "", "a GPU configuration is a JSON object");
  const auto text = [&](const char* member, const std::string& otherwise) {
    const auto found = root.find(member);
    if (found == root.end()) return otherwise;
    if (!found->is_string()) throw InputError(file, std::string("/") + member, "is not a text");
    std::string value = found->get<std::string>();
    root.erase(found);
    return value;
  };
  if (root.contains("base") && root.contains("preset"))
    throw InputError(file, "/base",
                     "gives the machine that the file starts from, as \"preset\" does: leave one of them out");
  const std::string base = text("base", "");
  Gpu gpu;
  if (base.empty()) {
    gpu = preset(text("preset", Gpu().preset));
  } else {
    if (depth == kMaxBases)
      throw InputError(file, "/base",
                       fmt::format("is the last of more than {} files that start from each other", kMaxBases));
    const std::filesystem::path beside = std::filesystem::path(file).parent_path() / base;
    std::error_code ignored;
    const bool is_file = find_preset(base) == nullptr && std::filesystem::is_regular_file(beside, ignored);
    try {
      gpu = load(is_file ? beside.string() : base, depth + 1);
    } catch (const UsageError& error) {
      throw InputError(file, "/base", error.what());
    }
  }
  gpu.name = text("name", "");
  gpu.description = text("description", "");
  text("$schema", "");  // for editors
  // Only people read a file's sources of its numbers.
  if (const auto sources = root.find("sources"); sources != root.end()) {
    if (!sources->is_object()) throw InputError(file, "/sources", "is not an object of texts");
    root.erase(sources);
  }
  set_values(file, root, gpu, &gpu.file_keys);
  return gpu;
}

Gpu parse(std::string_view text, const std::string& name, int depth) {
  try {
    return from_json(name, parse_unique_json(text, name), depth);
  } catch (const UsageError& error) {
    throw InputError(name, "", error.what());
  }
}

Gpu load(const std::string& preset_or_file, int depth) {
  std::error_code ignored;
  if (std::filesystem::is_directory(preset_or_file, ignored))
    throw InputError(preset_or_file, "", "is a folder: give a preset or a JSON file");
  if (!std::filesystem::is_regular_file(preset_or_file, ignored)) return preset(preset_or_file);
  constexpr std::uint64_t kMaxBytes = 16u << 20;
  return parse(read_whole_text(preset_or_file, kMaxBytes), preset_or_file, depth);
}

// Sets of a cache are addressed by bits, so their number is a power of two; ways may be any number.
void check_cache(std::string_view keys, std::int64_t bytes, std::int64_t ways, std::int64_t line_bytes) {
  const std::int64_t sets = bytes / (ways * line_bytes);
  if (sets < 1 || sets * ways * line_bytes != bytes || (sets & (sets - 1)) != 0)
    throw UsageError(fmt::format("{}: {} bytes are not a power of two of sets of {} ways of {} bytes", keys, bytes,
                                 ways, line_bytes));
}

}  // namespace

int GpuConfiguration::depth_block_pixels() const {
  int side = 16;
  while (tile.width % side != 0 || tile.height % side != 0) side /= 2;
  return side;
}

hardware::Area GpuConfiguration::area() const {
  // A point of the shading cache: four colours of 16 bits and where it is from.
  constexpr std::int64_t kShadedBytes = 16;
  return hardware::machine_area(
      *this, {tessellator.cache_bytes + binner::RecordCache::kBytes + binner.combining_bursts * memory.burst_bytes,
              shading_cache.entries * kShadedBytes, tile.rendering_elimination, frame_buffer.transaction_elimination,
              !geometry.raw()});
}

bool set_gpu_key(const std::string& name, const json& value, GpuConfiguration& gpu) {
  if (const auto* key = gpu_keys().find(name)) {
    gpu_keys().set(gpu, *key, absolute_value(*key, gpu_keys().value(gpu, *key), value));
    return true;
  }
  for (const ClockedKey& key : clocked_keys())
    if (key.info.name == name) {
      (gpu.*
       key.set)(std::get<double>(parse_key_value(key.info, 0.0, absolute_value(key.info, (gpu.*key.get)(), value))));
      return true;
    }
  if (const FormerKey* former = find_former_key(name);
      former != nullptr && !former->now.empty() && set_gpu_key(std::string(former->now), value, gpu)) {
    gpu.key_notes.push_back(former_key_note(*former));
    return true;
  }
  return false;
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
                                       .add(&Gpu::geometry, scene::geometry_keys())
                                       .add(hardware::machine_keys()));
  return table;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const Preset& p : presets()) names.push_back(p.name);
  return names;
}

GpuConfiguration load_gpu(const std::string& preset_or_file) { return load(preset_or_file, 0); }

GpuConfiguration parse_gpu(std::string_view text, const std::string& name) { return parse(text, name, 0); }

void check_gpu(const GpuConfiguration& gpu) {
  for (const std::string& key : gpu.set_keys)
    if (const std::string_view because = unread_because(gpu, key); !because.empty())
      throw UsageError(fmt::format("{}: {}", key, because));
  if (const double most = hardware::max_clock_mhz(gpu.nominal_mhz); gpu.clock_mhz > most)
    throw UsageError(fmt::format(
        "clock.mhz: {} MHz need {:.2f} V, more than {} V; a machine of voltage.nominal_mhz={} reaches {:.0f} MHz",
        gpu.clock_mhz, hardware::supply_volts(gpu.clock_mhz, gpu.nominal_mhz), hardware::kMaxVolts, gpu.nominal_mhz,
        std::floor(most)));
  if (gpu.tile.width % 8 != 0 || gpu.tile.height % 8 != 0)
    throw UsageError("tile.width and tile.height must be multiples of 8 pixels");
  if ((gpu.memory.burst_bytes & (gpu.memory.burst_bytes - 1)) != 0)
    throw UsageError("memory.burst_bytes must be a power of two");
  if ((gpu.memory.channels & (gpu.memory.channels - 1)) != 0)
    throw UsageError("memory.channels must be a power of two");
  for (const std::int64_t chunk : {gpu.parameter_buffer.first_chunk_bytes, gpu.parameter_buffer.chunk_bytes})
    if (chunk % gpu.memory.burst_bytes != 0 && gpu.memory.burst_bytes % chunk != 0)
      throw UsageError(
          "parameter_buffer.first_chunk_bytes and parameter_buffer.chunk_bytes must be multiples or parts of "
          "memory.burst_bytes");
  // Compiled shaders say themselves how many registers they take (gpu/machine_model.cpp).
  if (const std::int64_t warp = gpu.queues.registers * 4 * gpu.shader.warp_lanes;
      !gpu.has_compiled_shaders() && warp > gpu.queues.register_bytes)
    throw UsageError(
        fmt::format("shader.register_bytes: {} bytes hold no warp of {} invocations with {} registers, which takes {}: "
                    "set more, or "
                    "less of shader.registers or shader.warp_lanes",
                    gpu.queues.register_bytes, gpu.shader.warp_lanes, gpu.queues.registers, warp));
  check_cache("texture.cache_bytes", gpu.caches.texture_bytes, hardware::Caches::kTextureWays, gpu.line_bytes());
  if (gpu.caches.l2_bytes > 0)
    check_cache("l2.bytes and l2.ways", gpu.caches.l2_bytes, gpu.caches.l2_ways, gpu.line_bytes());
}

nlohmann::json gpu_json(const GpuConfiguration& gpu) {
  json root = {{"preset", gpu.preset}};
  if (!gpu.name.empty()) root["name"] = gpu.name;
  if (!gpu.description.empty()) root["description"] = gpu.description;
  for (const auto& key : gpu_keys().keys()) {
    const std::string_view name = key.name;
    const std::size_t dot = name.find('.');
    root[std::string(name.substr(0, dot))][std::string(name.substr(dot + 1))] =
        key_value_json(gpu_keys().value(gpu, key));
  }
  return root;
}

}  // namespace tessera::gpu
