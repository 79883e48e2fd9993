#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/random.h"
#include "scene/capture_reader.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/pixel_shader.h"

namespace tessera::bench {

// Invocations across a capture's first frame, 1280x720: cell by cell and patch by patch, in the order of tiles' requests.
struct CaptureInvocations {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
  tilecore::Lighting lighting;
  std::vector<tilecore::Invocation> invocations;

  CaptureInvocations(const std::string& file, std::size_t count)
      : capture(scene::read_capture(file)), assembly(scene::assemble(capture)) {
    scene::FrameRequest request;
    request.close_time = 0.5 / capture.settings.frame_rate;
    frame = scene::pose_frame(assembly, scene::choose_camera(capture, request.width, request.height), request);
    const std::size_t patches = assembly.patch_drawable.size(), each = count / patches + 1;
    for (std::uint32_t patch = 0; patch < patches && invocations.size() < count; ++patch) {
      const scene::PosedDrawable& drawable = frame->drawable_of(patch);
      if (drawable.procedure != nullptr || drawable.material->alpha_mode == scene::AlphaMode::kMask) continue;
      const scene::CellRange cells = scene::patch_cells(*frame, patch);
      const std::uint32_t all = static_cast<std::uint32_t>((cells.i1 - cells.i0) * (cells.j1 - cells.j0));
      for (std::size_t k = 0; k < each && invocations.size() < count; ++k) {
        const std::uint32_t h = hash32(patch, static_cast<std::uint32_t>(k));
        const auto share = [&](int shift) { return static_cast<float>(h >> shift & 0xFF) / 512.0f; };
        tilecore::Invocation v;
        v.at = {patch, 2 * static_cast<std::uint32_t>(k * all / each), share(0), share(8), 0};
        v.at.t = tilecore::time_seen(*frame, patch, 2 * share(16));
        v.light_time = v.at.t;
        invocations.push_back(v);
      }
    }
  }
  CaptureInvocations(const CaptureInvocations&) = delete;
  CaptureInvocations& operator=(const CaptureInvocations&) = delete;
};

}  // namespace tessera::bench
