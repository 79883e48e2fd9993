#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "hardware/area.h"
#include "hardware/energy.h"
#include "timing/timing_model.h"

namespace tessera::replay {

// The member "timing" of stats.json:
//   {"cycles", "latency_cycles", "bound_by", "bound_by_cycles", "tiles_in_flight", "tile_memory_waits",
//    "units": {unit: {"busy_cycles", "utilisation"}}}
// tiles_in_flight is the mean of a core while it works; tile_memory_waits counts the cycles in which the core with most
// such cycles could have tested a tile if its memory had had room for it.
// Cycles and busy cycles are rounded up to whole ones. Units that exist once in each core give the mean over the cores;
// "tilecores" is the time in which a core had a tile in work. bound_by (timing/bound.h) is "" where nothing was done;
// bound_by_cycles is the reduction of the frame's cycles with twice as much of it. With machine.timing=events also
//   "events": {"critical_path": {part: cycles}, "texture_requests", "texture_misses", "l2_requests", "l2_misses",
//              "dram_read_bytes", "dram_written_bytes", "dram_activates", "dram_row_hits" (of memory.model=banks),
//              "shader_stalls": {reason: cycles}, "simulated"}
// with counts in the order of simulated time; the counters elsewhere in the file are in the emulated order.
nlohmann::json timing_json(const timing::FrameTiming& timing);

// The member "energy": {"total_nj", "by_unit": {unit: nanojoules}}. The units add up to the total, in the order of
// their names.
nlohmann::json energy_json(const hardware::FrameEnergy& energy);

// The member "area": {"total_mm2", "by_unit": {unit: mm2}} of the machine that the frame was timed on.
nlohmann::json area_json(const hardware::Area& area);

// Puts both into a frame of stats.json or the sum of `frames`, with timing.time_ms, timing.frames_per_second, and
// energy.power_w at machine.target_fps. timing.coarser_models lists the settings that time the machine more coarsely
// than the default; timing.peak_gb_per_s is the peak rate of memory for the GPU.
void put_model(const hardware::Machine& gpu, const timing::FrameTiming& timing, const hardware::FrameEnergy& energy,
               double frames, nlohmann::json& into);

// "timed by machine.timing=phases, a coarser model than the default", from a member "timing"; "" for the default model.
std::string coarser_models_note(const nlohmann::json& timing);

// Columns of stats.csv for timing, energy and the total area, each with a comma in front; model_csv() makes the row of
// a frame of stats.json.
std::string model_csv_header();
std::string model_csv(const nlohmann::json& frame);

}  // namespace tessera::replay
