#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gpu/frame_result.h"
#include "replay/tradeoff/knobs.h"
#include "replay/tradeoff/results.h"

namespace tessera::replay {

// An effect of docs/shading.md, the way to draw a frame without it, and the counters of its work.
struct EffectCase {
  std::string name;   // its name in stats.json
  KeyValues without;  // keys that turn it off; none: the scene is drawn without it (PackedCaptures::without)
  std::vector<std::string_view> counters;  // all 0 in a frame in which it did not run (EFC2)

  bool of_scene() const { return without.empty(); }
};

// Invariants (cited by the tests):
//   EFC1  Every effect that a frame reports has a case.
//   EFC2  The counters of an effect that did not run are 0.
//   EFC3  An effect's cost is the cost of the frame minus the cost of the frame without it; the image change is
//         measured between the two images, as shown.
const std::vector<EffectCase>& effect_cases();

// A frame's report about all effects, in the order of effect_cases(): whether, why and where each ran, and its
// counters.
std::vector<EffectResult> effects_of(const gpu::FrameResult& frame);

// Effects for people, about one line for each effect that ran. `knob`: the measured settings; the first has all
// effects.
std::string effects_table(const std::vector<EffectResult>& effects, const KnobResult& knob);

// A row for each effect.
std::string effects_csv(const std::string& capture, const std::vector<EffectResult>& effects, const KnobResult& knob);

}  // namespace tessera::replay
