#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/option_numbers.h"
#include "scene/capture.h"
#include "scene/view.h"

namespace tessera::scene {

// Parts of a file that are drawn in place of those that it names itself: each by its name, or by its number in the file.
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

// What of a capture is drawn and how it is looked at, where that is not what the file says. The words are those of the
// options --scene, --camera, --animation, --orbit, --lens and --shutter, of members of a study and of stats.json, of
// tessera::View and of the Python module.
struct ViewChoices {
  Selection selection;
  std::optional<std::string> orbit, lens, shutter;

  bool empty() const;
  // {"camera": "eye", "shutter": "0:0.5"}: those that are given.
  nlohmann::json json() const;

  // The scene is framed automatically, whatever cameras there are.
  bool framed() const { return orbit.has_value() || selection.camera == "auto"; }
  // What is chosen of the file itself: of its cameras none where the scene is framed.
  Selection of_file() const;

  // Throws UsageError for words that are no numbers, and for choices that contradict each other.
  void check() const;
};

// "OPEN:CLOSE", fractions of a frame. Throws UsageError.
NumberPair parse_shutter(const std::string& option, const std::string& text);

// All of these want a capture that was read with of_file(), and throw what check() throws.

// Its shutter is that of `view`, if that has one.
void set_shutter(Capture& capture, const ViewChoices& view);

// Where the image is taken from, as choose_camera(capture, width, height) says where nothing else is chosen.
CameraChoice choose_camera(const Capture& capture, const ViewChoices& view, int width, int height);

// Makes both of them the capture's own: what has to be framed gets a camera in a node of its own.
void look_at(Capture& capture, const ViewChoices& view, ImageSize size);

}  // namespace tessera::scene
