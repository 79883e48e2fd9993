#pragma once

#include <optional>
#include <vector>

#include "scene/view.h"
#include "scene/view_choices.h"

namespace tessera::scene {

// Makes a camera for a scene without one. It looks from the front, a little from above and the right (or as `orbit`
// says), and the scene in all its frames fills three quarters of the image's height, or nine tenths of its width where
// it is too wide for that. The frames are the ones that the file declares, else the frames of its whole animation. The
// camera is the same for all of them, so that a frame looks the same whichever other frames are rendered.
CameraChoice frame_scene(const Capture& capture, int width, int height,
                         const std::optional<Orbit>& orbit = std::nullopt);

// Distance from a camera to the middle of the drawn scene at `time`, in scene units along the camera's view; negative
// where the middle is behind the camera, 1 where nothing is drawn.
double middle_distance(const Capture& capture, const DMat4& camera_world, double time);

// Times, in seconds, at which frame_scene() samples the scene: evenly spaced, both ends included; a single time where
// nothing is animated. Exposed for tests.
std::vector<double> framed_times(const Capture& capture);

// Seconds of the last key among the played animations; 0 where nothing is played.
double played_seconds(const Capture& capture);
// Number of frames of the capture, from the first on: as declared, or as many more as open during the played
// animations.
int frames_to_see(const Capture& capture);

}  // namespace tessera::scene
