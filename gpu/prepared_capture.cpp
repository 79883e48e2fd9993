#include "gpu/prepared_capture.h"

#include <utility>

#include "scene/held_textures.h"

namespace tessera::gpu {

const PreparedScene& PreparedCapture::scene(scene::TextureSettings textures) const {
  if (capture.basis_images.empty()) textures.basis_target = ktx2::BasisTarget::kRgba32;
  const std::lock_guard lock(mutex_);
  if (const auto made = scenes_.find(textures); made != scenes_.end()) return *made->second;
  const scene::HeldTextures held = scene::hold_textures(capture, textures);
  // Geometry is the same for all: what was assembled for one is good for the next.
  scene::Assembly assembly = scenes_.empty() ? scene::assemble(capture) : scenes_.begin()->second->assembly;
  if (scenes_.empty()) materials_ = assembly.materials;
  assembly.materials = materials_;
  held.put_into(assembly.materials);
  assembly.texture_bytes = held.charged_bytes;
  return *scenes_.emplace(textures, std::make_unique<const PreparedScene>(std::move(assembly))).first->second;
}

}  // namespace tessera::gpu
