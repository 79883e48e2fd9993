#pragma once

#include <optional>
#include <vector>

#include "scene/view.h"
#include "scene/view_choices.h"

namespace tessera::scene {

// A camera for a scene that has none: from the front, a little from above and the right (or as `orbit` says), so that what the scene draws
// in all of its frames fills three quarters of the image's height, or nine tenths of its width where it is too wide for
// that. The frames are those that the file declares, else those of its whole animation; the camera is the same for all
// of them, so that a frame looks the same whichever others are rendered.
CameraChoice frame_scene(const Capture& capture, int width, int height,
                         const std::optional<Orbit>& orbit = std::nullopt);

// From a camera to the middle of what the scene draws at `time`, in scene units along the camera's view; negative where
// that is behind it, 1 where nothing is drawn.
double middle_distance(const Capture& capture, const DMat4& camera_world, double time);

// Times of the frames, in seconds, that frame_scene() looks at: evenly spaced, both ends included; one where nothing
// is animated. Exposed for tests.
std::vector<double> framed_times(const Capture& capture);

// Seconds of the last key of what plays; 0 where nothing does.
double played_seconds(const Capture& capture);
// Frames that there are to see, from the first on: the capture's own, or as many more as open while something plays.
int frames_to_see(const Capture& capture);

}  // namespace tessera::scene
