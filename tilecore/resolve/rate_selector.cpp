#include "tilecore/resolve/rate_selector.h"

#include <algorithm>

#include "tilecore/resolve/block_contrast.h"

namespace tessera::tilecore {
namespace {

// Number of 16 pixels that are reused where several surfaces meet: fewer rendered witnesses miss surfaces that emerge
// from behind an edge [measured: a lip of brass is wrong by 0.13 at 12].
constexpr int kReusedOnOutlines = 8;

// Whether the speed counts as above the threshold: a speed that was above stays so a little longer, and vice versa.
bool above(float speed, float threshold, float hysteresis, bool known, bool was_above) {
  if (!known) return speed > threshold;
  return was_above ? speed > threshold * (1.0f - hysteresis) : speed > threshold * (1.0f + hysteresis);
}

BlockDecision by_motion(const RateSettings& settings, const BlockEvidence& block) {
  const BlockDecision full{block.edge && settings.supersampling ? 32 : 16, false};
  if (block.edge && !(block.advection_allowed && (block.still || block.outline))) return full;
  if (!block.velocity_usable) return full;
  const SpeedThresholds& t = settings.thresholds;
  const std::uint8_t last = block.last_samples;
  const bool known = last == 1 || last == 4 || last == 8 || last == 16;
  const bool slow = known && last == 1 ? block.speed < t.reuse * (1.0f + t.hysteresis)
                                       : block.speed < t.reuse * (known ? 1.0f - t.hysteresis : 1.0f);
  // Foveation filled the block from a part of its pixels: that is no history. Taken for one, it would be found wrong,
  // rejected and filled again, in turns of some frames.
  const bool invented = block.max_samples < 16 && (last == 4 || last == 8);
  if (slow && block.advection_allowed && !invented)
    return {16 - (block.edge && !block.still ? kReusedOnOutlines : settings.advected), true};
  if (block.edge || block.cut) return full;
  const float speed = std::min(block.speed, block.blurred_speed);
  int samples = above(speed, t.quarter_rate, t.hysteresis, known, last == 4)             ? 4
                : above(speed, t.half_rate, t.hysteresis, known, last == 4 || last == 8) ? 8
                                                                                         : 16;
  if (settings.pattern_error > 0)
    while (predicted_error(samples, block.contrast) > settings.pattern_error) samples *= 2;
  return {samples, false};
}

}  // namespace

BlockDecision select_rate(const RateSettings& settings, const BlockEvidence& block) {
  BlockDecision decision = by_motion(settings, block);
  decision.samples = std::min(decision.samples, block.max_samples);
  return decision;
}

}  // namespace tessera::tilecore
