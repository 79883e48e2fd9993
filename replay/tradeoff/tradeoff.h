#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "replay/tradeoff/knobs.h"
#include "replay/tradeoff/results.h"

namespace tessera::replay {

// Options of a tradeoff.
struct TradeoffOptions {
  std::filesystem::path capture, folder;
  KeyValues base;             // values of --set, for printing commands
  gpu::RunSettings settings;  // base, applied
  gpu::GpuConfiguration gpu;
  std::string gpu_name = "mid-mobile";
  int width = 640, height = 360;
  std::optional<int> frame;  // unset: the last frame of a run from the capture's first frame on
  int run = 6;               // number of frames of a history, the compared one included
  int rounds = 3;
  int reference_samples = 1024;
  double reference_edge_pixels = 1.0;
  double reference_enough_db = 60.0;  // reference::ReferenceSettings::enough_db
  std::filesystem::path
      kept_references;  // folder of reference::KeptReference; empty: references are kept in the output folder
  std::vector<std::string> knobs;        // empty: all
  std::vector<std::string> joint;        // knobs that are also turned together
  std::size_t max_points = 400;          // of the joint search
  bool effects = false;                  // measures the cost of each effect of the frame instead of knobs
  std::optional<CheapestWanted> search;  // tries combinations of `knobs` that may be the cheapest good-enough one
  std::uint64_t max_bytes = std::uint64_t{4} << 30;
  bool strict = false;                 // scene::CaptureLimits::strict
  std::optional<std::string> variant;  // scene::CaptureLimits::variant
  ViewChoices view;
  bool quiet = false;
};

// The output folder of a tradeoff:
//   reference/HASH.exr, .json   the reference and how far it has converged; missing where all knobs are timed, and with
//                               kept_references
//   points/HASH.json            a trial (see trial_file.h); an existing trial is not run again
//   tradeoff.json, tradeoff.csv, report.html   made from these (see tradeoff_files.h)
//
// Invariants (cited by the tests):
//   TO1  Except for members "host" and members named after seconds, tradeoff.json depends on the capture, the options
//        and the program alone.
//   TO2  A front has the settings that no other setting beats in error and in cost; every beaten setting is off it.
//   TO3  A trial or a reference with a result is not run again.
TradeoffResult run_tradeoff(const TradeoffOptions& options);

}  // namespace tessera::replay
