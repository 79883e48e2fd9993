#pragma once

#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "gpu/machine_model.h"

namespace tessera::replay {

// How `time --split`, and a study's "split", split a frame.
enum class Split { kDrawables, kMaterials, kTiles };

// Takes a word, "drawables" and so on. Throws UsageError for any other; `option` is what it was given to.
Split parse_split(const std::string& option, const std::string& word);
std::string_view name(Split split);

// Rows of one view of a frame, those with most cycles first (tiles: in the order of their numbers), as in the JSON:
//   drawables, materials  {"node" (of drawables), "material", "invocations", "tests", "requested_lines", "dram_bytes",
//                          "cycles", "energy_nj"}
//   tiles                 {"tile", "cycles", "dram_bytes", "energy_nj", "bound_by", "bound_by_cycles"}
// as timing/attribution.h has them. `head`: of the record, for names. What no item of a tile asked for has the name "".
// `before`: the caches with which the view began. Needs items, but for tiles.
nlohmann::json split_rows(Split split, const nlohmann::json& head, const hardware::Machine& gpu,
                          const timing::FrameWork& work, const gpu::ViewCost& cost, const timing::WarmCaches& before);

// Members of the rows, for tables: all that some split has.
std::span<const std::string_view> split_columns();

// The first rows, as a table.
void print_split(std::FILE* out, Split split, const nlohmann::json& rows, double cycles);

}  // namespace tessera::replay
