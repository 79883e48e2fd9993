#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/tradeoff/packed_captures.h"
#include "scene/frame_geometry.h"

namespace tessera::replay {

// Values of keys, in the form that --set takes.
using KeyValues = std::vector<std::pair<std::string, nlohmann::json>>;

// One setting of a knob.
struct KnobSetting {
  std::string label;
  KeyValues values;
  bool in_double = false;        // the reference renderer with the machine's samples, instead of the machine
  Packing packing{};             // packing of the capture before it is drawn
  bool goes_on = false;          // continues from the previous frames: left out where there are none
  bool ideal_registers = false;  // its register file has the same silicon as without the setting
};

// The property of a capture without which a knob changes nothing.
enum class KnobNeed {
  kNothing,
  kMotion,
  kCurves,
  kDisplacement,
  kGrids,
  kProcedures,
  kTextures,
  kMeshes,
  kShadows,
  kMovingShadows
};

// A property of the emulated machine that trades accuracy for cost.
struct Knob {
  std::string name;   // name for --knob
  std::string title;  // for tables
  KnobNeed need = KnobNeed::kNothing;
  KeyValues context;  // further values that are set while it is turned
  std::vector<KnobSetting> settings;
  std::size_t against = 0;  // index of the setting with which texts compare the others
  bool visual = true;       // false: every setting gives the same image, and only costs differ
  std::string watched;      // a column whose change is reported as well, the cost that the knob affects; "" for none
  std::string watched_as;   // its name in words
  bool stored = false;      // compares the image in the frame buffer's format, not the light before it
  bool timed =
      false;  // the knob changes the timing model: all settings time one record of the frame, the first most finely
};

const std::vector<Knob>& knobs();
// Throws UsageError with the nearest known name.
const Knob& knob_named(const std::string& name);

// Whether a setting continues from the previous frames, which are then rendered for each trial.
bool uses_history(const Knob& knob);

// Why a knob has no effect on a frame, or "" when it may have one. `history`: whether previous frames are rendered.
std::string why_without_effect(const Knob& knob, const scene::FrameGeometry& frame, bool history);

// Sets `values` in order. Throws the UsageError of set_key().
void apply(const KeyValues& values, gpu::RunSettings& settings, gpu::GpuConfiguration& gpu);

// Adds to `values` the area per KiB of registers with which their register file takes as much silicon as `gpu`'s: a
// model with ideal registers then leaks no more than the machine that it stands for.
void keep_register_silicon(const gpu::GpuConfiguration& gpu, KeyValues& values);

// "--set a.b=1 --set c.d=x"; "" without values.
std::string as_arguments(const KeyValues& values);

}  // namespace tessera::replay
