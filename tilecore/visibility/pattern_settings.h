#pragma once

#include <cstdint>

#include "base/key_table.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

enum class TemporalPattern : std::uint8_t { k8x8, k32x32 };
enum class TimeBits : std::uint8_t { k8, k16 };

// Places and times of samples, for all frames; keys sampling.*.
struct PatternSettings {
  int samples_per_pixel = 4;
  std::uint32_t seed = 0;
  TemporalPattern temporal_pattern = TemporalPattern::k8x8;
  TimeBits time_bits = TimeBits::k8;
  int times = 0;
  int motion_segments = 0;
  double motion_error = 0.25;
  int motion_segments_max = 64;
};
Keys<PatternSettings> pattern_keys();

// The pattern of one frame for a visibility method: interleaved has few times of its own. `segments`: of the frame's
// motion; with more than kFewSegments of them times have 16 bits, whatever the setting.
SamplingSettings sampling_settings(const PatternSettings& settings, const VisibilityMethodSettings& method, int frame,
                                   std::vector<ShutterSegment> segments = {});

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::TemporalPattern> = std::to_array<std::string_view>({"8x8", "32x32"});
template <>
inline constexpr auto kEnumWords<tilecore::TimeBits> = std::to_array<std::string_view>({"8", "16"});

}  // namespace tessera
