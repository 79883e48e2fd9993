#pragma once

#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "gpu/machine_model.h"

namespace tessera::replay {

// Ways in which `time --split`, and a study's "split", divide a frame.
enum class Split { kDrawables, kMaterials, kTiles };

// Parses a word, "drawables" and so on. Throws UsageError for any other; `option` is the option with this value.
Split parse_split(const std::string& option, const std::string& word);
std::string_view name(Split split);

// Rows of one view of a frame, the ones with most cycles first (tiles: in the order of their numbers), as in the JSON:
//   drawables, materials  {"node" (of drawables), "material", "invocations", "tests", "requested_lines", "dram_bytes",
//                          "cycles", "energy_nj"}
//   tiles                 {"tile", "cycles", "dram_bytes", "energy_nj", "bound_by", "bound_by_cycles"}
// timing/attribution.h defines the figures. `head` is the record's head, for names. Work that no item of a tile asked
// for has the name "". `before`: the caches with which the view began. All but tiles need items.
nlohmann::json split_rows(Split split, const nlohmann::json& head, const hardware::Machine& gpu,
                          const timing::FrameWork& work, const gpu::ViewCost& cost, const timing::WarmCaches& before);

// Members of the rows, for tables: every member that some split has.
std::span<const std::string_view> split_columns();

// The first rows, as a table.
void print_split(std::FILE* out, Split split, const nlohmann::json& rows, double cycles);

}  // namespace tessera::replay
