#include "tilecore/visibility/pattern_settings.h"

#include <utility>

namespace tessera::tilecore {

Keys<PatternSettings> pattern_keys() {
  using S = PatternSettings;
  return {
      {"sampling.samples_per_pixel", &S::samples_per_pixel, "samples", 1, 64,
       "Visibility samples per pixel; the same as --spp."},
      {"sampling.seed", &S::seed, "", 0, 4294967295.0,
       "Chooses among equally good sample patterns; the same as --seed."},
      {"sampling.temporal_pattern", &S::temporal_pattern,
       "Pixels after which the pattern of sample times repeats; the larger one shows less of itself and is slower to "
       "replay."},
      {"sampling.time_bits", &S::time_bits,
       "Precision of a sample's time; the stencil unit sees the upper 8 bits. A frame of more than 7 motion segments "
       "has 16."},
      {"sampling.times", &S::times, "times", 0, 256,
       "Distinct times of samples; with few of them a fast object appears at as many places. 0: 16 with "
       "tilecore.visibility_method=interleaved, else as many as the pattern and the precision have."},
      {"sampling.motion_segments", &S::motion_segments, "segments", 0, kMaxMotionSegments,
       "Straight pieces that approximate the curved motion of a shutter, of surfaces that turn, bend or swing. Each "
       "piece is bounded, binned and tessellated separately. 0: as many as sampling.motion_error needs; otherwise at "
       "most this number, cut for the least error."},
      {"sampling.motion_error", &S::motion_error, "pixels", 0.01, 100,
       "Largest distance of a piece of motion from the curve, with sampling.motion_segments=0."},
      {"sampling.motion_segments_max", &S::motion_segments_max, "segments", 2, kMaxMotionSegments,
       "Most pieces that sampling.motion_segments=0 cuts a shutter into; a note appears if they do not reach "
       "sampling.motion_error."},
  };
}

SamplingSettings sampling_settings(const PatternSettings& settings, const VisibilityMethodSettings& method, int frame,
                                   std::vector<ShutterSegment> segments) {
  const bool interleaved = method.method == VisibilityMethod::kInterleaved && settings.times == 0;
  return {settings.samples_per_pixel,
          settings.seed,
          static_cast<std::uint32_t>(frame),
          settings.temporal_pattern == TemporalPattern::k32x32 ? 32 : 8,
          settings.time_bits == TimeBits::k16 || segments.size() > kFewSegments ? 16 : 8,
          interleaved ? VisibilityMethodSettings::kInterleavedTimes : settings.times,
          std::move(segments)};
}

}  // namespace tessera::tilecore
