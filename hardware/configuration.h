#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/key_table.h"
#include "hardware/machine_numbers.h"

namespace tessera::hardware {

// The described machine. Every number is a key of gpu_keys(), which gives unit, range, meaning and source; the
// values here are those of the preset "middle".
struct GpuConfiguration : MachineNumbers {
  std::string preset = "middle";

  std::string frontend_bound_method = "npatch";
  std::string frontend_split_criterion = "screen_extent";
  double frontend_split_pixels = 128;
  std::int64_t frontend_split_depth = 8;
  std::int64_t frontend_split_budget = 64;
  bool frontend_backface_culling = true;
  bool frontend_previous_depth_culling = false;

  std::int64_t tile_width = 32;   // pixels, multiple of 8
  std::int64_t tile_height = 32;  // pixels, multiple of 8

  std::int64_t parameter_buffer_bytes = 10 << 20;
  std::int64_t parameter_buffer_chunk_bytes = 256;
  std::string parameter_buffer_full_policy = "partial_render";

  std::string binner_coverage = "exact";
  bool binner_time_intervals = true;
  std::int64_t binner_time_segments = 1;       // 0: by blur length over primitive size
  std::int64_t binner_queue_levels = 1;        // queues of single tiles, of 2x2, 4x4 ... tiles
  std::int64_t binner_combining_bursts = 256;  // write-combining lines in front of the parameter buffer
  std::int64_t memory_burst_bytes = 64;

  bool tilecore_occlusion_culling = true;
  std::string tilecore_visibility_method = "patch-bvh";
  std::int64_t tilecore_stencil_segments = 0;      // of segments and clusters; 0: by blur length over primitive size
  std::int64_t tilecore_interleaved_times = 16;    // of interleaved
  std::string tilecore_traversal = "class";        // of patch-bvh
  std::string tilecore_branch_node = "leaf_mask";  // where single rays start
  std::int64_t tilecore_ray_segments = 1;          // of the shutter, each with a branch node
  std::int64_t tilecore_box_bits = 32;
  std::int64_t tilecore_blend_layers = 8;
  std::int64_t shading_cache_entries = 1024;
  std::int64_t shading_cache_group = 1;  // tiles

  std::string frame_buffer_compression = "none";

  std::int64_t tessellator_max_factor = 64;
  std::int64_t tessellator_subpixel_bits = 8;
  std::int64_t tessellator_sub_patch_cells = 16;  // cells a side of the largest sub-patch a core takes at once

  std::int64_t tessellator_cache_bytes = 256 << 10;
  // On-chip caches of the machines that `--baselines` compares; all the same size, so that none is favoured.
  std::int64_t post_tessellation_cache_bytes = 256 << 10;
  std::int64_t immediate_cache_bytes = 256 << 10;

  // A line of the texture caches and the L2: at least a burst.
  std::int64_t line_bytes() const {
    return cache_line_bytes > memory_burst_bytes ? cache_line_bytes : memory_burst_bytes;
  }
};

const KeyTable<GpuConfiguration>& gpu_keys();

// Names of the built-in presets.
std::vector<std::string> preset_names();

// A preset by name, or a JSON file with the same keys nested by their dots ({"tile": {"width": 16}}); keys that the
// file leaves out keep the value of its "preset" member (default "middle"). Throws UsageError for an unknown preset,
// InputError for a file that is not such a configuration, LimitError for one of more than 16 MiB.
GpuConfiguration load_gpu(const std::string& preset_or_file);

// The same from the text of such a file; `name` stands for it in messages. Throws InputError.
GpuConfiguration parse_gpu(std::string_view text, const std::string& name);

// Checks that the keys fit each other (tile sides multiples of 8, chunk a multiple of the burst, ...).
// Throws UsageError naming the keys.
void check_gpu(const GpuConfiguration& gpu);

// The whole configuration, nested by the dots of the keys.
nlohmann::json gpu_json(const GpuConfiguration& gpu);

}  // namespace tessera::hardware
