#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "reference/reference_info.h"
#include "replay/view_options.h"

namespace tessera::replay {

// What a frame reports under a name: a count, bytes, cycles (whole), or an energy or a quotient.
using Figure = std::variant<std::uint64_t, double>;

// What an image, as a display shows it, differs from the reference by.
struct ImageError {
  std::optional<double> psnr_db;  // nothing: it is the reference
  double ssim = 0, flip = 0, max_error = 0;
  bool operator==(const ImageError&) const = default;
};

// Of every round; the second one over all threads.
struct RoundTimes {
  std::vector<double> wall_seconds, processor_seconds;
  bool operator==(const RoundTimes&) const = default;
};

struct TrialResult {
  std::optional<ImageError> error;        // nothing where only time is modelled: there is nothing to see
  std::string image_sha256;               // of its linear values
  std::map<std::string, Figure> figures;  // of the compared frame, by columns.h's names, those not 0; none in double
  RoundTimes host;
  bool operator==(const TrialResult&) const = default;
};

struct Spread {
  double median = 0, low = 0, high = 0;
};

// What a setting is judged by. Time, bytes and energy are the machine's: what runs in double has none.
struct Measurement {
  std::optional<ImageError> error;
  std::string image_sha256;
  std::optional<std::uint64_t> cycles, dram_bytes;
  std::optional<double> ms, energy_nj;  // ms: of the cycles, at the machine's clock
  std::optional<Figure> watched;        // what the knob is about, where it names something
  Spread wall_seconds, processor_seconds;
};

// What a setting may be cheap by, in the order of kCostNames.
enum class Cost : std::uint8_t { kMs, kDramBytes, kMj, kWallSeconds, kProcessorSeconds };
inline constexpr std::array<Cost, 5> kCosts = {Cost::kMs, Cost::kDramBytes, Cost::kMj, Cost::kWallSeconds,
                                               Cost::kProcessorSeconds};
inline constexpr std::array<std::string_view, kCosts.size()> kCostNames = {"ms", "dram_bytes", "mj", "seconds",
                                                                           "processor_seconds"};

struct SettingResult {
  std::string label, arguments;
  bool is_base = false;  // the configuration that was asked for
  bool in_double = false;
  Measurement measured;
  // Filled by judge():
  bool same_image = false;                               // as the one that its knob compares with
  std::optional<double> cycles_error, energy_error;      // of timed knobs: over those of the finest, less 1
  std::array<std::optional<bool>, kCosts.size()> front;  // by cost; nothing where it has no such cost
  std::string says;

  std::optional<bool> on_front(Cost cost) const { return front[static_cast<std::size_t>(cost)]; }
};

// A knob, or several turned together.
struct KnobResult {
  std::string name, title, context;
  std::size_t against = 0;  // of `settings`: the one that the others are compared with
  bool visual = true;
  std::string watched, watched_as;
  std::string skipped;    // why it was not turned; "" when it was
  bool timed = false;     // Knob::timed; no fronts: what is cheap is the host's work
  bool idle = false;      // all settings gave the same image at the same cost
  bool combines = false;  // its settings are combinations of settings of the other knobs
  std::vector<SettingResult> settings;
};

// An effect of the compared frame. One that ran and was left out has a setting of the knob "effects".
struct EffectResult {
  std::string name, reason;  // why it ran, or did not
  bool ran = false;
  std::uint64_t sub_patches = 0, tiles = 0;       // with it
  std::map<std::string, std::uint64_t> counters;  // of its work; all 0 where it did not run
  std::string without;                            // how it is left out; "" where it did not run
  std::string stays;                              // why it could not be; "" where it could
  std::optional<std::size_t> setting;
};

struct TradeoffResult {
  std::string capture;
  std::optional<std::string> variant;  // of its materials
  ViewChoices view{};
  int frame = 0, first_frame = 0, width = 0, height = 0, rounds = 0;
  std::string arguments;  // of --set
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  std::string gpu_name;
  std::optional<reference::ReferenceInfo> reference;  // nothing where all knobs are timed
  std::vector<KnobResult> knobs;                      // the last one is "joint" where knobs were turned together
  std::vector<EffectResult> effects{};                // with --effects, whose only knob is "effects"
  bool stopped = false;                               // by a signal, before its end
};

// What --max-flip and --min-psnr ask for, and the answer.
struct CheapestWanted {
  Cost cost = Cost::kMs;
  std::optional<double> max_flip, min_psnr_db;
};
struct CheapestSetting {
  std::string knob;  // its name
  SettingResult setting;
};

}  // namespace tessera::replay
