#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"
#include "binner/settings.h"
#include "frontend/settings.h"
#include "hardware/area.h"
#include "hardware/machine.h"
#include "scene/geometry_settings.h"
#include "tilecore/core_settings.h"

namespace tessera::gpu {

// On-chip memories of the machines that `--baselines` compares; all caches have the same size, so that no machine is
// favoured.
struct BaselineCaches {
  std::int64_t cache_bytes = 256 << 10;
  bool immediate_color_compression = true;
  std::int64_t gmem_bytes = 1 << 20;
};

// The described machine: the settings of its units. Every number is a key of gpu_keys(), which gives unit, range,
// meaning and source; the defaults here are the preset "mid-mobile".
struct GpuConfiguration : hardware::Machine {
  std::string preset = "mid-mobile";
  std::string name, description;       // of a file: the names its writer gives the machine
  std::vector<std::string> key_notes;  // about keys that were set by a former name
  std::vector<std::string> file_keys;  // keys that a file changes against its preset or base
  std::vector<std::string> set_keys;   // keys set by name: each must act (check_gpu())
  frontend::Settings frontend;
  binner::TileSize tile;
  binner::ParameterBufferSettings parameter_buffer;
  binner::Settings binner;
  tilecore::TessellatorSettings tessellator;
  BaselineCaches baselines;
  tilecore::CoreSettings tilecore;
  tilecore::ShadingCacheSettings shading_cache;
  tilecore::FrameBufferSettings frame_buffer;
  scene::GeometrySettings geometry;

  // Side of the blocks whose farthest depths tile cores store: 16, halved until it divides both sides of a tile
  // [assumed].
  int depth_block_pixels() const;
  frontend::FrontEndSpec front_end_spec() const {
    return {frontend, tessellator.sub_patch_cells, static_cast<std::uint64_t>(memory.burst_bytes), caches.l2_bytes,
            caches.l2_ways};
  }
  // Silicon area of the drawing units, without the memories that only the baselines have.
  hardware::Area area() const;
  binner::BinnerSpec binner_spec() const { return {binner, parameter_buffer, memory.burst_bytes}; }
};

const KeyTable<GpuConfiguration>& gpu_keys();

// Sets a key of gpu_keys(), or memory.bytes_per_clk or memory.latency_clk: the memory's rate and latency in clocks of
// the GPU at its present clock.mhz (in a file: the file's). A later change of clock.mhz leaves the memory as it is.
// Numbers also take the text "x1.3" (relative_value.h), a multiple of the present value. A former name sets the key
// that replaced it, and leaves a note in gpu.key_notes. Returns false if there is no such key. Throws UsageError for a
// value out of range.
bool set_gpu_key(const std::string& name, const nlohmann::json& value, GpuConfiguration& gpu);

// Names of the built-in presets.
std::vector<std::string> preset_names();

// A preset by name, or a JSON file with the same keys nested by their dots ({"tile": {"width": 16}}); keys that the
// file leaves out keep the value of its "preset" member (default "mid-mobile"). "name", "description" and "sources" (texts
// by key) are for people, "$schema" is for editors. Throws UsageError for an unknown preset,
// InputError for a file that is not such a configuration, LimitError for one of more than 16 MiB.
GpuConfiguration load_gpu(const std::string& preset_or_file);

// The same from the text of such a file; messages name it `name`. Throws InputError.
GpuConfiguration parse_gpu(std::string_view text, const std::string& name);

// Checks that the keys fit each other (tile sides multiples of 8, chunk a multiple of the burst, a clock that the
// process supports, registers for a warp, ...), and that the chosen models read every one of gpu.set_keys. Throws
// UsageError naming the keys.
void check_gpu(const GpuConfiguration& gpu);

// The whole configuration, nested by the dots of the keys.
nlohmann::json gpu_json(const GpuConfiguration& gpu);

}  // namespace tessera::gpu
