#pragma once

#include <cstdint>
#include <limits>

namespace tessera::tilecore {

// Speeds in pixels per frame, which decide the regime of a block: below `reuse` it takes pixels from the previous
// frame, from there to `half_rate` it is shaded fully, above `half_rate` at half and above `quarter_rate` at a quarter
// of its pixels. By default [measured: docs/resolve.md] `reuse` equals `half_rate`: a block reuses pixels until half
// rate needs no history; blocks that may not reuse pixels are shaded fully up to `half_rate`.
struct SpeedThresholds {
  float reuse = 2.0f, half_rate = 2.0f, quarter_rate = 8.0f;
  // Share of a threshold by which a speed must pass it before a block leaves its regime, so that a block at a threshold
  // does not flicker. 0: no hysteresis.
  float hysteresis = 0.05f;
  // Change of the camera's motion between frames that counts as a cut. 0: no change does.
  float cut = 16.0f;  // [assumed]
};

// The evidence on a block of 4x4 pixels before any of it is shaded.
struct BlockEvidence {
  bool edge = false;
  bool outline = false;  // the edge lies between surfaces; each pixel may be advected from its own
  bool still = false;    // every sample is at rest between the frames
  bool velocity_usable = false;
  float speed = 0;  // where usable
  // At least the speed that would blur the block as much during the frame's shutter; infinite without an open shutter.
  float blurred_speed = std::numeric_limits<float>::infinity();
  bool advection_allowed = false;  // a valid history, same lights, no discrepancy around the block
  bool cut = false;                // the frame is the first after one
  int max_samples = 32;            // foveation
  // The previous frame's contrast at the block's place, times the share that this frame's shutter leaves
  // (block_contrast.h).
  float contrast = 0;
  std::uint8_t last_samples = 0;  // the block's last rate, or 1 if it was advected; 0: unknown
};

struct RateSettings {
  SpeedThresholds thresholds;
  bool supersampling = false;  // 32 on edges
  int advected = 12;           // pixels of 16 that slow blocks take over: 8 or 12; the others are rendered
  // The largest predicted error of stencils in a block, of displayed values between 0 and 1; 0: no limit.
  float pattern_error = 0.008f;  // [measured] docs/resolve.md
};

struct BlockDecision {
  int samples = 16;     // 4, 8, 16 or 32 of 4x4 pixels; 32: the two halves of each pixel apart
  bool advect = false;  // pixels that are not rendered come from the history, else from their neighbours
  // The value of BlockEvidence::last_samples in the next frame.
  std::uint8_t memory() const { return advect ? std::uint8_t{1} : static_cast<std::uint8_t>(samples); }
};

// The first line that applies decides (US 2015/0379692, fig. 4 and 5):
//   edge, supersampling on                -> 32
//   edge                                  -> 16
//   velocity unknown                      -> 16
//   speed < reuse, advection allowed      -> 4, and 12 advected; or 8 and 8, for example where several surfaces meet
//   first frame after a cut               -> 16
//   speed > quarter_rate                  -> 4
//   speed > half_rate                     -> 8
//   else                                  -> 16
//
// A speed above `reuse` counts only as far as the frame's own shutter blurs the block (blurred_speed): a block that
// moved far but is sharp would show its pattern. 4 becomes 8, and 8 becomes 16, if the contrast predicts that stencils
// would miss more than pattern_error. The result is the smaller one of that and the foveation limit; a block that
// foveation limits and that was last filled from 4 or 8 pixels stays at that rate. Deviations: a block whose samples
// are all at rest may be advected although it has an edge, since the copied colours equal the shaded ones, bit for bit;
// so may one in which several surfaces meet, since a pixel takes over only colours of its own surface, and pixels that
// see two are shaded. Deviation from [0033]: no rate of 12, which the paragraph allows and which does not pay
// (docs/resolve.md).
BlockDecision select_rate(const RateSettings& settings, const BlockEvidence& block);

}  // namespace tessera::tilecore
