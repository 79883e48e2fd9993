#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// What of a file is drawn, where that is not what the file says: each by its name, or by its number in the file.
struct Selection {
  std::optional<std::string> scene;
  std::optional<std::string> camera;  // or a node that has one
  // The only animation that plays; "all": the first, and each further one that moves nothing already moved; "none".
  std::optional<std::string> animation;
};

// The scenes of a file.
struct SceneList {
  std::vector<std::string> names;
  int drawn = kNone;  // of `names`; kNone: the file has none
};

// Where automatic framing looks from, in degrees.
struct Orbit {
  double azimuth = 0;               // about +y, counterclockwise seen from above, from its usual place
  std::optional<double> elevation;  // above the horizon; unset: as usual. Between -89 and 89
};

// The node of the camera that takes the image (choose_camera()); kNone where the scene is framed.
int camera_node(const Capture& capture);

}  // namespace tessera::scene
