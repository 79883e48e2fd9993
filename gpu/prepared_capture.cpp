#include "gpu/prepared_capture.h"

#include <utility>

#include "scene/held_textures.h"

namespace tessera::gpu {

PreparedCapture::PreparedCapture(const scene::Capture& capture_in, CaptureChanges changes)
    : capture(capture_in), changes_(std::move(changes)) {}

scene::Assembly PreparedCapture::assemble() const {
  scene::Assembly assembly = scene::assemble(capture, changes_.drawn);
  if (!changes_.without_effect.empty())
    for (scene::Material& material : assembly.materials) scene::leave_out(changes_.without_effect, material);
  return assembly;
}

const PreparedScene& PreparedCapture::scene(scene::TextureSettings textures,
                                            const scene::GeometrySettings& geometry) const {
  if (capture.basis_images.empty()) textures.basis_target = ktx2::BasisTarget::kRgba32;
  const std::lock_guard lock(mutex_);
  const Held held_as = {geometry.raw() ? scene::GeometrySettings() : geometry, textures};
  if (const auto made = scenes_.find(held_as); made != scenes_.end()) return *made->second;
  const scene::HeldTextures held = scene::hold_textures(capture, textures);
  // Geometry does not depend on textures, so a later scene reuses the first assembly. Raw geometry comes first.
  const bool assembled = !scenes_.empty() && scenes_.begin()->first.first.raw();
  scene::Assembly assembly = assembled ? scenes_.begin()->second->assembly : assemble();
  if (scenes_.empty()) materials_ = assembly.materials;
  assembly.materials = materials_;
  held.put_into(assembly.materials);
  assembly.texture_bytes = held.charged_bytes;
  scene::hold_geometry(held_as.first, assembly);
  return *scenes_.emplace(held_as, std::make_unique<const PreparedScene>(std::move(assembly))).first->second;
}

}  // namespace tessera::gpu
