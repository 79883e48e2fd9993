#include "gpu/prepared_capture.h"

#include <utility>

#include "scene/basis_textures.h"

namespace tessera::gpu {

const PreparedScene& PreparedCapture::scene(ktx2::BasisTarget target) const {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<const PreparedScene>& slot =
      scenes_[capture.basis_images.empty() ? 0 : static_cast<std::size_t>(target)];
  if (slot != nullptr) return *slot;
  // Geometry is the same for all: what was assembled for one target is good for the next.
  const scene::Assembly* other = nullptr;
  for (const std::unique_ptr<const PreparedScene>& made : scenes_)
    if (made != nullptr) other = &made->assembly;
  scene::Assembly assembly = other != nullptr ? *other : scene::assemble(capture);
  if (!capture.basis_images.empty()) {
    assembly.materials = scene::materials_for(capture, target);
    assembly.materials.push_back(scene::Material{});  // of primitives without
  }
  slot = std::make_unique<const PreparedScene>(std::move(assembly));
  return *slot;
}

}  // namespace tessera::gpu
