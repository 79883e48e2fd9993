#pragma once

#include <cstdint>
#include <limits>

namespace tessera::tilecore {

// Speeds in pixels per frame. They tell which regime a block is in: below `reuse` it takes pixels from the previous
// frame, from there to `half_rate` it is shaded fully, above `half_rate` at half and above `quarter_rate` at a quarter
// of its pixels. By default [measured: docs/resolve.md] nothing lies between `reuse` and `half_rate`: reuse goes on
// until half of the pixels need no history; blocks that may not reuse pixels are shaded fully up to `half_rate`.
struct SpeedThresholds {
  float reuse = 2.0f, half_rate = 2.0f, quarter_rate = 8.0f;
  // Share of a threshold by which a speed must pass it before a block leaves the regime that it was in, so that one
  // that moves at a threshold does not flicker. 0: none.
  float hysteresis = 0.05f;
  // By how much the camera's motion must change from one frame to the next to be a cut. 0: nothing is.
  float cut = 16.0f;  // [assumed]
};

// The evidence on a block of 4x4 pixels before anything of it is shaded.
struct BlockEvidence {
  bool edge = false;
  bool outline = false;  // that edge is one between surfaces, of which each pixel's own may be advected
  bool still = false;    // every sample is at rest between the frames
  bool velocity_usable = false;
  float speed = 0;  // where usable
  // No less than that of what is as sharp as if it moved as fast during the frame's shutter: infinite without one.
  float blurred_speed = std::numeric_limits<float>::infinity();
  bool advection_allowed = false;  // a valid history, same lights, no discrepancy around the block
  bool cut = false;                // the frame is the first after one
  int max_samples = 32;            // foveation
  // The contrast of the previous frame in the block's place, as far as this frame's shutter leaves it
  // (block_contrast.h).
  float contrast = 0;
  std::uint8_t last_samples = 0;  // what the block had last, 0 unknown: rate, or 1 when it was advected
};

struct RateSettings {
  SpeedThresholds thresholds;
  bool supersampling = false;  // 32 on edges
  int advected = 12;           // pixels of 16 that slow blocks take over: 8 or 12; the others are rendered
  // The largest error, of displayed values between 0 and 1, that stencils may be predicted to have in a block; 0: any.
  float pattern_error = 0.008f;  // [measured] docs/resolve.md
};

struct BlockDecision {
  int samples = 16;     // 4, 8, 16 or 32 of 4x4 pixels; 32: the two halves of each pixel apart
  bool advect = false;  // pixels that are not rendered come from the history, else from their neighbours
  // The value of BlockEvidence::last_samples in the next frame.
  std::uint8_t memory() const { return advect ? std::uint8_t{1} : static_cast<std::uint8_t>(samples); }
};

// The first that holds (US 2015/0379692, fig. 4 and 5):
//   edge, supersampling on                -> 32
//   edge                                  -> 16
//   velocity unknown                      -> 16
//   speed < reuse, advection allowed      -> 4, and 12 advected; or 8 and 8, as where several surfaces meet
//   first frame after a cut               -> 16
//   speed > quarter_rate                  -> 4
//   speed > half_rate                     -> 8
//   else                                  -> 16
// where a speed above `reuse` counts only as far as the frame's own shutter blurs the block (blurred_speed): what is
// sharp although it came far shows its pattern. 4 becomes 8, and 8 becomes 16, where the contrast says that stencils
// would miss more than pattern_error. The result is the smaller one of that and what foveation allows; a block that
// foveation limits and that was filled from 4 or 8 pixels last goes on so. Deviation: a
// block of which every sample is at rest may be advected although it has an edge, since what is copied is what would be
// shaded, bit for bit; and one in which several surfaces meet, since a pixel only takes over what its own surface
// showed, and those that see two are shaded. Deviation from [0033]: no rate of 12, which the paragraph allows and which
// does not pay (docs/resolve.md).
BlockDecision select_rate(const RateSettings& settings, const BlockEvidence& block);

}  // namespace tessera::tilecore
