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

// A figure that a frame reports: a count, bytes or cycles (whole), or an energy or a quotient.
using Figure = std::variant<std::uint64_t, double>;

// Errors of an image, as a display shows it, against the reference.
struct ImageError {
  std::optional<double> psnr_db;  // nothing: it equals the reference
  double ssim = 0, flip = 0, max_error = 0;
  bool operator==(const ImageError&) const = default;
};

// Times of every round; processor time is the sum over all threads.
struct RoundTimes {
  std::vector<double> wall_seconds, processor_seconds;
  bool operator==(const RoundTimes&) const = default;
};

struct TrialResult {
  std::optional<ImageError> error;  // nothing for a trial that only times a frame: it has no image
  std::string image_sha256;         // of its linear values
  std::map<std::string, Figure>
      figures;  // figures of the compared frame that are not 0, by the names in columns.h; none in double
                // precision
  RoundTimes host;
  bool operator==(const TrialResult&) const = default;
};

struct Spread {
  double median = 0, low = 0, high = 0;
};

// Quantities by which a setting is judged. Time, bytes and energy are the machine's; a trial in double precision has
// none.
struct Measurement {
  std::optional<ImageError> error;
  std::string image_sha256;
  std::optional<std::uint64_t> cycles, dram_bytes;
  std::optional<double> ms, energy_nj;  // ms: of the cycles, at the machine's clock
  std::optional<Figure> watched;        // the figure that the knob affects, if it names one
  Spread wall_seconds, processor_seconds;
};

// Costs by which a setting may be cheap, in the order of kCostNames.
enum class Cost : std::uint8_t { kMs, kDramBytes, kMj, kWallSeconds, kProcessorSeconds };
inline constexpr std::array<Cost, 5> kCosts = {Cost::kMs, Cost::kDramBytes, Cost::kMj, Cost::kWallSeconds,
                                               Cost::kProcessorSeconds};
inline constexpr std::array<std::string_view, kCosts.size()> kCostNames = {"ms", "dram_bytes", "mj", "seconds",
                                                                           "processor_seconds"};

struct SettingResult {
  std::string label, arguments;
  bool is_base = false;  // the requested configuration
  bool in_double = false;
  Measurement measured;
  // Filled by judge():
  bool same_image = false;                           // equal to the image of the setting that its knob compares with
  std::optional<double> cycles_error, energy_error;  // of timed knobs: ratio to the finest setting's, less 1
  std::array<std::optional<bool>, kCosts.size()> front;  // by cost; nothing for a cost that the setting lacks
  std::string says;

  std::optional<bool> on_front(Cost cost) const { return front[static_cast<std::size_t>(cost)]; }
};

// A knob, or several turned together.
struct KnobResult {
  std::string name, title, context;
  std::size_t against = 0;  // index into `settings`: the one with which the others are compared
  bool visual = true;
  std::string watched, watched_as;
  std::string skipped;    // why it was not measured; "" when it was
  bool timed = false;     // Knob::timed; without fronts, because only the host's work varies
  bool idle = false;      // all settings gave the same image at the same cost
  bool combines = false;  // its settings are combinations of settings of the other knobs
  std::vector<SettingResult> settings;
};

// An effect of the compared frame. An effect that ran and was left out has a setting of the knob "effects".
struct EffectResult {
  std::string name, reason;  // why it ran, or did not
  bool ran = false;
  std::uint64_t sub_patches = 0, tiles = 0;       // with it
  std::map<std::string, std::uint64_t> counters;  // of its work; all 0 where it did not run
  std::string without;                            // the way to leave it out; "" where it did not run
  std::string stays;                              // why it could not be left out; "" where it could
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
  std::optional<reference::ReferenceInfo> reference;  // unset where all knobs are timed
  std::vector<KnobResult> knobs;                      // the last one is "joint" where knobs were turned together
  std::vector<EffectResult> effects{};                // with --effects, whose only knob is "effects"
  bool stopped = false;                               // a signal ended it early
};

// The limits of --max-flip and --min-psnr, and the answer.
struct CheapestWanted {
  Cost cost = Cost::kMs;
  std::optional<double> max_flip, min_psnr_db;
};
struct CheapestSetting {
  std::string knob;  // its name
  SettingResult setting;
};

}  // namespace tessera::replay
