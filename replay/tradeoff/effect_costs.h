#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gpu/frame_result.h"
#include "replay/tradeoff/knobs.h"
#include "replay/tradeoff/results.h"

namespace tessera::replay {

// An effect of docs/shading.md, how a frame is drawn without it, and what counts its work.
struct EffectCase {
  std::string name;   // as stats.json calls it
  KeyValues without;  // keys that leave it out; none: the scene is drawn without it (PackedCaptures::without)
  std::vector<std::string_view> counters;  // all 0 in a frame in which it did not run (EFC2)

  bool of_scene() const { return without.empty(); }
};

// Invariants (cited by the tests):
//   EFC1  Every effect that a frame reports has a case.
//   EFC2  The counters of an effect that did not run are 0.
//   EFC3  An effect's cost is that of the frame less that of the frame without it; the image change is measured between the
//        two images, as shown.
const std::vector<EffectCase>& effect_cases();

// What a frame says of all effects, by effect_cases()'s order: whether, why and where each ran, and its counters.
std::vector<EffectResult> effects_of(const gpu::FrameResult& frame);

// Effects for people, in about as many lines as effects ran. `knob`: the measured settings; the first has all effects.
std::string effects_table(const std::vector<EffectResult>& effects, const KnobResult& knob);

// A row for each effect.
std::string effects_csv(const std::string& capture, const std::vector<EffectResult>& effects, const KnobResult& knob);

}  // namespace tessera::replay
