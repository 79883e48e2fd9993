#pragma once

#include "scene/frame_geometry.h"
#include "tests/support/tests.h"

namespace tessera::binner {

// A closed surface of six patches, posed at rest for an image of 128x128 pixels.
struct PosedObject {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;

  PosedObject() {
    test::add_node(capture, test::closed_patches(scene::kNone));
    assembly = scene::assemble(capture);
    scene::FrameRequest request;
    request.width = request.height = 128;
    frame = scene::pose_frame(assembly, scene::choose_camera(capture, 128, 128), request);
  }
};

}  // namespace tessera::binner
