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

// Values of keys, as --set takes them.
using KeyValues = std::vector<std::pair<std::string, nlohmann::json>>;

// One setting of a knob.
struct KnobSetting {
  std::string label;
  KeyValues values;
  bool in_double = false;        // the reference renderer with the machine's samples, instead of the machine
  Packing packing{};             // of the capture before it is drawn
  bool goes_on = false;          // from the frames before: left out where there are none
  bool ideal_registers = false;  // its register file takes the silicon that it has without the setting
};

// What a capture must have for a knob to change anything.
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

// Something of the emulated machine that buys accuracy and costs something.
struct Knob {
  std::string name;   // as --knob takes it
  std::string title;  // for tables
  KnobNeed need = KnobNeed::kNothing;
  KeyValues context;  // what else is set while it is turned
  std::vector<KnobSetting> settings;
  std::size_t against = 0;  // the setting that the others are compared with in words
  bool visual = true;       // else every setting gives the same image, and costs alone differ
  std::string watched;      // a column whose change is told as well: the cost that the knob is about; "" for none
  std::string watched_as;   // its name in words
  bool stored = false;      // the image that is compared is what the frame buffer holds, not the light before it
  bool timed = false;  // how accurately a frame is timed: all settings time one record of it, the first most finely
};

const std::vector<Knob>& knobs();
// Throws UsageError naming the nearest known one.
const Knob& knob_named(const std::string& name);

// Whether a setting goes on from the frames before, which are then rendered for each trial.
bool uses_history(const Knob& knob);

// Why a knob has no effect on a frame, or "" when it may have one. `history`: whether frames before it are rendered.
std::string why_without_effect(const Knob& knob, const scene::FrameGeometry& frame, bool history);

// Sets `values` in order. Throws UsageError as set_key does.
void apply(const KeyValues& values, gpu::RunSettings& settings, gpu::GpuConfiguration& gpu);

// Adds the area of a KiB of registers with which the register file of `values` takes as much silicon as that of `gpu`: a
// model that leaves registers out of account leaks no more than the machine that it times.
void keep_register_silicon(const gpu::GpuConfiguration& gpu, KeyValues& values);

// "--set a.b=1 --set c.d=x"; "" without values.
std::string as_arguments(const KeyValues& values);

}  // namespace tessera::replay
