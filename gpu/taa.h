#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "base/image.h"
#include "base/rect.h"
#include "gpu/settings.h"
#include "scene/capture.h"
#include "scene/frame_geometry.h"
#include "tilecore/attachment_actions.h"
#include "tilecore/resolve/motion_field.h"
#include "tilecore/resolve/stored_texels.h"
#include "tilecore/resolve/surface_velocities.h"

namespace tessera::gpu {

// The temporal antialiasing of a capture, a pass over the image between the pass that draws and the others: it mixes the
// colours into a history (shaders_cpp/taa.h), which later passes read instead. Frames take their samples at jittered
// places.
//
// Invariants (cited by the tests):
//   TAP1  Each image that the pass reads or writes moves once, raw as many bytes as its format has: the colours, velocities,
//         depths if the capture samples them, the history of the previous frame, the new history. A frame without a previous one
//         moves the colours and the new history alone.
//   TAP2  A frame follows from itself and the frames rendered before it without a gap. After a cut it equals a first frame
//         with the same number.
//   TAP3  Without the pass (post.taa=0) a frame is the same, to the bit, as without temporal antialiasing.
struct Taa {
  std::string name;
  tilecore::ColorAttachment source, history;  // the colours that the pass reads, and the history that it writes
  // Base address of the older history within the memory of attachments. The driver swaps the two from frame to frame.
  std::uint64_t before_base = 0;
  std::uint64_t depth_bytes = 0;  // of a pixel; 0: the pass samples no depths
  float share = 0.1f;             // post.taa

  static constexpr std::uint64_t kVelocityBytes = 4;  // of a pixel: rg16f
  static tilecore::TexelFormat velocity_format() { return {.planes = {tilecore::kTwoHalvesBlock}}; }
  static tilecore::TexelFormat history_format() {
    return {.planes = {tilecore::stored_block(tilecore::FrameFormat::kRgba16f)}};
  }
};

// Whether frames of a capture are antialiased over time, so that each depends on those before.
bool antialiases(const scene::Capture& capture, const RunSettings& settings);

// Jittered places repeat after this number of frames.
inline constexpr int kJitteredFrames = 8;

// Displacement of a frame's samples in pixels: point `frame` mod kJitteredFrames + 1 of Halton's sequence to the bases 2 and 3,
// less the mean of the first eight, in 256ths of a pixel. The mean over kJitteredFrames frames is 0.
std::array<float, 2> taa_jitter(int frame);

// The history of a view, frame after frame.
class TaaHistory {
 public:
  // Begins frame `number`, posed as `geometry`, in which tiles fill the result. The previous frame counts if its number is
  // one less.
  tilecore::VelocityAttachment& begin(int number, const scene::FrameGeometry& geometry, IntRect region);

  // Makes the new history on the host from the colours of the frame, and leaves it in `color`, rounded to its format. There
  // is a cut where the places of more than half of nine points over the image lie outside of the previous frame.
  void resolve(const Taa& taa, Image& color);

  // Whether resolve() has used the previous frame.
  bool follows() const { return length_ > 1; }
  // Ends the frame, whose pose the next one compares itself with. A frame that is not ended leaves no history.
  void end(std::shared_ptr<const scene::FrameGeometry> pose);

 private:
  bool is_cut() const;

  std::shared_ptr<const scene::FrameGeometry> pose_;    // of the last ended frame
  std::shared_ptr<const scene::FrameGeometry> before_;  // the previous frame's, during a frame; nullptr: there is none
  std::unique_ptr<tilecore::MotionField> motion_;       // from it; nullptr: there is none
  tilecore::VelocityAttachment velocities_;
  Image image_;
  int number_ = 0;
  int length_ = 0;  // frames in the history
};

}  // namespace tessera::gpu
