#pragma once

#include <memory>

#include "frontend/frame_geometry.h"
#include "tests/support/captures.h"

namespace tessera::binner {

// A closed surface of six patches, posed at rest for a picture of 128x128 pixels.
struct PosedObject {
  frontend::Capture capture;
  frontend::Assembly assembly;
  std::unique_ptr<frontend::FrameGeometry> frame;

  PosedObject() {
    test::add_node(capture, test::closed_patches(frontend::kNone));
    assembly = frontend::assemble(capture);
    frontend::FrameRequest request;
    request.width = request.height = 128;
    frame = frontend::pose_frame(assembly, frontend::choose_camera(capture, 0, 128, 128), request);
  }
};

}  // namespace tessera::binner
