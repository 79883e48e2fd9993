#pragma once

#include <vector>

#include "scene/view.h"

namespace tessera::scene {

// A camera for a scene that has none: from the front, a little from above and the right, so that what the scene draws
// in all of its frames fills three quarters of the image's height, or nine tenths of its width where it is too wide for
// that. The frames are those that the file declares, else those of its whole animation; the camera is the same for all
// of them, so that a frame looks the same whichever others are rendered.
CameraChoice frame_scene(const Capture& capture, int width, int height);

// Times of the frames, in seconds, that frame_scene() looks at: evenly spaced, both ends included; one where nothing
// is animated. Exposed for tests.
std::vector<double> framed_times(const Capture& capture);

}  // namespace tessera::scene
