#pragma once

#include <functional>

#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "tests/support/tests.h"

// Frames beside the same frames of the schemes.
namespace tessera::test {

using baselines::SchemeId;

// A frame and, when it was observed, the schemes beside it.
struct Compared : gpu::FrameResult {
  std::optional<baselines::BaselineSet> baselines;
};

inline Compared render(gpu::Device& device, int frame, bool observed = true) {
  baselines::BaselineObserver schemes;
  device.set_observer(observed ? &schemes : nullptr);
  gpu::FrameResult result = device.render(frame);
  device.set_observer(nullptr);
  return {std::move(result), observed ? std::optional(schemes.last()) : std::nullopt};
}

inline Compared render(const scene::Capture& capture, const gpu::GpuConfiguration& gpu, std::size_t thread_count = 0,
                       bool observed = true, gpu::RunSettings settings = {}) {
  const ThreadLimit threads(thread_count);
  gpu::Device device(capture, gpu, settings, {160, 90, {0, 0, 160, 90}});
  return render(device, capture.settings.first_frame, observed);
}

// Machines that bin or draw triangles.
inline std::vector<SchemeId> triangle_schemes() {
  std::vector<SchemeId> out;
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    if (baselines::kSchemes[s].make != nullptr) out.push_back(static_cast<SchemeId>(s));
  return out;
}
inline std::string name_of(SchemeId scheme) {
  return std::string(baselines::kSchemes[static_cast<std::size_t>(scheme)].name);
}

inline bool has_patches(const scene::Capture& capture) {
  return std::any_of(capture.meshes.begin(), capture.meshes.end(), [](const scene::Mesh& mesh) {
    return std::any_of(mesh.primitives.begin(), mesh.primitives.end(), [](const scene::Primitive& primitive) {
      return primitive.kind != scene::Primitive::Kind::kTriangles;
    });
  });
}

// All schemes with tiles.
inline std::vector<SchemeId> tiled_schemes(const scene::Capture& capture) {
  std::vector<SchemeId> out = triangle_schemes();
  std::erase_if(
      out, [&](SchemeId s) { return s == SchemeId::kImmediate || (s == SchemeId::kUntiled && has_patches(capture)); });
  return out;
}
inline constexpr std::array kMeshShaders = {SchemeId::kMeshShaderRing, SchemeId::kMeshShaderCompact,
                                            SchemeId::kMeshShaderReferences};

// Looks at a view with the parts of the baselines.
class Looking final : public gpu::ViewObserver {
 public:
  explicit Looking(std::function<void(const gpu::RenderedView&)> look) : look_(std::move(look)) {}
  void view_rendered(const gpu::RenderedView& view) override { look_(view); }

 private:
  std::function<void(const gpu::RenderedView&)> look_;
};

inline void look_at(const scene::Capture& capture, const std::function<void(const gpu::RenderedView&)>& look) {
  Looking observer(look);
  gpu::Device device(capture, {}, {}, {160, 90, {0, 0, 160, 90}});
  device.set_observer(&observer);
  device.render(capture.settings.first_frame);
}

}  // namespace tessera::test
