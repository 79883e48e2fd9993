#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "hardware/machine.h"
#include "timing/attribution.h"

namespace tessera::replay {

// How `time --split` splits a frame.
enum class Split { kDrawables, kMaterials, kTiles };

// Takes the word of --split. Throws UsageError for any other.
Split parse_split(const std::string& word);

// Rows of one view of a frame, those with most cycles first (tiles: in the order of their numbers), as in the JSON:
//   drawables, materials  {"node" (of drawables), "material", "invocations", "tests", "requested_lines", "cycles", "energy_nj"}
//   tiles                 {"tile", "cycles", "dram_bytes", "energy_nj", "busiest"}
// `head`: of the record, for names. What no item of a tile asked for has the name "".
nlohmann::json split_rows(Split split, const nlohmann::json& head, const hardware::Machine& gpu,
                          const timing::FrameWork& work, const timing::FrameTiming& timing,
                          const timing::Schedule& schedule);

// The first rows, as a table.
void print_split(std::FILE* out, Split split, const nlohmann::json& rows, double cycles);

}  // namespace tessera::replay
