#include "tilecore/resolve/joint_decision.h"

#include <algorithm>
#include <array>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr std::size_t kMaxParts = 16;  // 16x16 pixels

float joint_speed(std::span<const BlockEvidence> parts, BlockSpeed statistic) {
  std::array<float, kMaxParts> speed{};
  std::size_t n = 0;
  for (const BlockEvidence& part : parts)
    if (part.velocity_usable) speed[n++] = part.speed;
  if (n == 0) return 0.0f;
  const auto end = speed.begin() + static_cast<std::ptrdiff_t>(n);
  switch (statistic) {
    case BlockSpeed::kMean: {
      float sum = 0.0f;
      for (std::size_t i = 0; i < n; ++i) sum += speed[i];
      return sum / static_cast<float>(n);
    }
    case BlockSpeed::kMax:
      return *std::max_element(speed.begin(), end);
    case BlockSpeed::kMin:
      return *std::min_element(speed.begin(), end);
    case BlockSpeed::kMedian: {
      std::sort(speed.begin(), end);
      return n % 2 == 1 ? speed[n / 2] : 0.5f * (speed[n / 2 - 1] + speed[n / 2]);
    }
  }
  return 0.0f;
}

}  // namespace

BlockEvidence join(std::span<const BlockEvidence> parts, BlockSpeed statistic) {
  TESSERA_CHECK(!parts.empty() && parts.size() <= kMaxParts, "a decision is made for 1 to 16 blocks");
  BlockEvidence all = parts.front();
  bool every_edge_is_an_outline = true;
  for (const BlockEvidence& part : parts) {
    every_edge_is_an_outline = every_edge_is_an_outline && (!part.edge || part.outline);
    all.edge = all.edge || part.edge;
    all.outline = all.outline || part.outline;
    all.cut = all.cut || part.cut;
    all.still = all.still && part.still;
    all.velocity_usable = all.velocity_usable && part.velocity_usable;
    all.advection_allowed = all.advection_allowed && part.advection_allowed;
    all.blur = std::min(all.blur, part.blur);
    all.blurred_speed = std::min(all.blurred_speed, part.blurred_speed);
    all.contrast = std::max(all.contrast, part.contrast);
    all.max_samples = std::min(all.max_samples, part.max_samples);
  }
  all.outline = all.outline && every_edge_is_an_outline;
  all.speed = joint_speed(parts, statistic);
  return all;
}

}  // namespace tessera::tilecore
