#pragma once

#include <array>

#include "scene/capture.h"
#include "scene/pose.h"

namespace tessera::scene {

// Raster space: the space in which the machine works. A point of the scene becomes r = (xh, yh, depth, w) with pixel
// position X = xh/w, Y = yh/w (x right, y down, (0,0) the corner of the first pixel) and depth growing away from the
// camera. Perspective: w = depth. Orthographic: w = 1. Both are linear in the point, so a vertex that moves linearly in
// camera space moves linearly in raster space.
//
// A thin lens moves a point by lens(u, v) * coc, where coc = w_inverse - 1/focus (perspective) or 1 - depth/focus
// (orthographic), in pixels after scaling by lens_scale; (u, v) is a point of the unit disc.
struct Projection {
  bool orthographic = false;
  double center_x = 0, center_y = 0;  // pixels
  double scale = 1;                   // pixels: focal length (perspective), pixels per unit (orthographic)
  double near = 0.1, far = 0;         // drawn depth range; far 0 = unlimited
  double lens_scale = 0;              // scale * aperture radius; 0 = pinhole
  double inverse_focus = 0;           // 1 / focus distance; 0 = infinity

  // Camera space (x right, y up, -z forward) to raster space, as a matrix on (x, y, z, 1).
  DMat4 matrix() const;
  // The inverse on points of the scene: (xh, yh, depth, 1) to camera space.
  DMat4 unprojection() const;

  bool operator==(const Projection&) const = default;
};

Projection make_projection(const Camera& camera, int width, int height);

// The camera at one motion key of the shutter.
struct View {
  DMat4 world_to_camera{1.0};
  DMat4 camera_to_world{1.0};
};

// Rigid view of a camera node: scale and mirroring of the node are ignored, as glTF asks.
View view_from_world(const DMat4& camera_world);

// Camera that takes the image: a camera node of the capture, or a camera that frames the whole scene.
struct CameraChoice {
  Camera camera;
  int node = kNone;  // kNone: fixed
  DMat4 fixed_world{1.0};
  double eye_offset = 0;  // moves the camera to its right, in scene units: the other eye of a stereo pair

  View view(const Pose& pose) const;
  // The camera with the values that animations give it at `time`.
  Camera at(const Capture& capture, double time) const;
};

// The camera of the capture's settings, else the first camera of the scene, else a camera that frames the scene
// (scene/framing.h).
CameraChoice choose_camera(const Capture& capture, int width, int height);

}  // namespace tessera::scene
