#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "reference/reference_store.h"
#include "replay/tradeoff/knobs.h"

namespace tessera::replay {

// What a user asks of a tradeoff.
struct TradeoffOptions {
  std::filesystem::path capture, folder;
  KeyValues base;             // what --set changed, for --set to print again
  gpu::RunSettings settings;  // base, applied
  gpu::GpuConfiguration gpu;
  std::string gpu_name = "middle";
  int width = 640, height = 360;
  std::optional<int> frame;  // else the last of a run from the capture's first on
  int run = 6;               // frames that come to a history, the compared one included
  int rounds = 3;
  int reference_samples = 1024;
  double reference_edge_pixels = 1.0;
  std::vector<std::string> knobs;  // empty: all
  std::vector<std::string> joint;  // knobs that are turned together as well
  std::size_t max_points = 400;    // of the joint search
  std::uint64_t max_bytes = std::uint64_t{4} << 30;
  bool quiet = false;
};

// The output folder of a tradeoff:
//   reference/HASH.exr, .json   the reference and how far it has converged
//   points/HASH.json            a trial (see trial.h); what is there is not run again
//   tradeoff.json, tradeoff.csv, report.html   made from these
//
// Invariants (cited by the tests):
//   TO1  But for members "host" and what is called after seconds, tradeoff.json follows from the capture, the options
//        and the program alone.
//   TO2  A front is what no other setting beats in error and in cost; every setting beaten is off it.
//   TO3  A trial or a reference whose result is there is not run again.
//
// {"schema": "tessera.tradeoff/1", "capture", "frame", "size", "settings", "gpu", "reference": Reference::info,
//  "knobs": [{"name", "title", "context", "against", "watched", "skipped": reason or "",
//     "idle": whether all settings gave the same image at the same cost, "settings": [
//     {"label", "arguments", "base": whether this is the configuration that was asked for, "error", "image",
//      "cycles", "dram_bytes", "energy_nj", "watched", "same_image": as `against`, "front": {"cycles", "dram_bytes",
//      "energy_nj"}, "says": one line, "host": {"seconds": {"median", "low", "high"}, "processor_seconds": {...},
//      "front_seconds"}}]}],
//  "stopped": whether a signal ended it early}
// The last knob is "joint" where knobs were turned together.
nlohmann::json run_tradeoff(const TradeoffOptions& options);

// Costs that a setting may be judged by.
inline constexpr const char* kCosts[] = {"cycles", "dram_bytes", "energy_nj", "seconds", "processor_seconds"};
// A cost of a row of the above; nothing where the row has none (cycles of what ran in double).
std::optional<double> cost_of(const nlohmann::json& row, const std::string& cost);

// Which of the points no other one beats: none has both numbers as small and one of them smaller.
struct ErrorAndCost {
  double error, cost;
};
std::vector<bool> pareto_front(const std::vector<ErrorAndCost>& points);

// The row with the least cost among those that are good enough; null when none is. Ties: the smaller error, then the
// first.
nlohmann::json cheapest(const nlohmann::json& tradeoff, const std::string& cost, std::optional<double> max_flip,
                        std::optional<double> min_psnr);

// For people, for spreadsheets.
std::string tradeoff_table(const nlohmann::json& tradeoff);
std::string tradeoff_csv(const nlohmann::json& tradeoff);

}  // namespace tessera::replay
