#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "base/option_numbers.h"
#include "scene/capture.h"
#include "scene/view.h"

namespace tessera::scene {

// Parts of a file to draw instead of its defaults: each by its name, or by its number in the file.
struct Selection {
  std::optional<std::string> scene;
  std::optional<std::string> camera;  // or a node that has one
  // The played animation; "all": the first, and each further one that moves nothing already moved; "none".
  std::optional<std::string> animation;
};

// The scenes of a file.
struct SceneList {
  std::vector<std::string> names;
  int drawn = kNone;  // of `names`; kNone: the file has none
};

// Direction of automatic framing, in degrees.
struct Orbit {
  double azimuth = 0;               // about +y, counterclockwise seen from above, from the default direction
  std::optional<double> elevation;  // above the horizon, between -89 and 89; unset: the default
};

// The node of the camera that takes the image (choose_camera()); kNone where the scene is framed.
int camera_node(const Capture& capture);

// A user's choices about the drawn parts of a capture and the view of it, in place of the file's own. The texts are the
// values of the options --scene, --camera, --animation, --orbit, --lens and --shutter, of members of a study and of
// stats.json, of tessera::View and of the Python module.
struct ViewChoices {
  Selection selection;
  std::optional<std::string> orbit, lens, shutter;

  bool empty() const;
  // The choices that are set: {"camera": "eye", "shutter": "0:0.5"}.
  nlohmann::json json() const;

  // Whether the scene is framed automatically, in spite of the file's cameras.
  bool framed() const { return orbit.has_value() || selection.camera == "auto"; }
  // The selection within the file; it has no camera where the scene is framed.
  Selection of_file() const;

  // Throws UsageError for words that are no numbers, and for choices that contradict each other.
  void check() const;
};

// "OPEN:CLOSE", fractions of a frame. Throws UsageError.
NumberPair parse_shutter(const std::string& option, const std::string& text);

// All of these take a capture that was read with of_file(), and throw the errors of check().

// Replaces the capture's shutter by the shutter of `view`, if it has one.
void set_shutter(Capture& capture, const ViewChoices& view);

// The chosen camera; without a choice, the result of choose_camera(capture, width, height).
CameraChoice choose_camera(const Capture& capture, const ViewChoices& view, int width, int height);

// Writes the shutter and the camera of `view` into the capture: a scene that is framed gets a camera in a node of its
// own.
void look_at(Capture& capture, const ViewChoices& view, ImageSize size);

}  // namespace tessera::scene
