#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "replay/tradeoff/knobs.h"
#include "replay/tradeoff/results.h"

namespace tessera::replay {

// What a user asks of a tradeoff.
struct TradeoffOptions {
  std::filesystem::path capture, folder;
  KeyValues base;             // what --set changed, for --set to print again
  gpu::RunSettings settings;  // base, applied
  gpu::GpuConfiguration gpu;
  std::string gpu_name = "mid-mobile";
  int width = 640, height = 360;
  std::optional<int> frame;  // else the last of a run from the capture's first on
  int run = 6;               // frames that come to a history, the compared one included
  int rounds = 3;
  int reference_samples = 1024;
  double reference_edge_pixels = 1.0;
  double reference_enough_db = 60.0;  // reference::ReferenceSettings::enough_db
  std::filesystem::path
      kept_references;                   // reference::KeptReference's folder; empty: references are the output folder's
  std::vector<std::string> knobs;        // empty: all
  std::vector<std::string> joint;        // knobs that are turned together as well
  std::size_t max_points = 400;          // of the joint search
  bool effects = false;                  // instead of knobs: what each effect of the frame costs
  std::optional<CheapestWanted> search;  // tries combinations of `knobs` that may be the cheapest good enough
  std::uint64_t max_bytes = std::uint64_t{4} << 30;
  bool strict = false;                 // scene::CaptureLimits::strict
  std::optional<std::string> variant;  // scene::CaptureLimits::variant
  ViewChoices view;
  bool quiet = false;
};

// The output folder of a tradeoff:
//   reference/HASH.exr, .json   the reference and how far it has converged; where all knobs are timed, there is none, nor
//                               with kept_references
//   points/HASH.json            a trial (see trial_file.h); what is there is not run again
//   tradeoff.json, tradeoff.csv, report.html   made from these (see tradeoff_files.h)
//
// Invariants (cited by the tests):
//   TO1  But for members "host" and what is called after seconds, tradeoff.json follows from the capture, the options
//        and the program alone.
//   TO2  A front is what no other setting beats in error and in cost; every setting beaten is off it.
//   TO3  A trial or a reference whose result is there is not run again.
TradeoffResult run_tradeoff(const TradeoffOptions& options);

}  // namespace tessera::replay
