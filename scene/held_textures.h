#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "scene/capture.h"
#include "scene/texture_settings.h"

namespace tessera::scene {

// What the emulated memory holds in place of a capture's textures: ASTC blocks of KTX2 images, blocks of all textures for
// texture.format, and the texels that these decode to. A texture that is in neither map stays as it is.
//
// Invariants (cited by the tests):
//   HT1  Each level of a texture that is encoded is encoded for itself, from the texels that the file has or that were
//        made from them; its transfer function stays.
//   HT2  Displacement maps are those of the stored textures whatever texture.format is.
//   HT3  What is charged is never less than what it takes of memory.
struct HeldTextures {
  std::map<const shaders::Texture*, std::shared_ptr<const shaders::Texture>> textures;
  std::map<const shaders::ScalarTexture*, std::shared_ptr<const shaders::ScalarTexture>> heights;
  // Bytes that texture.format takes of those that the reader left: each format of a study takes its own. The reader
  // charged those of KTX2 images.
  std::uint64_t charged_bytes = 0;

  // Replaces the textures of the capture's materials, or of ones made from them.
  void put_into(std::vector<Material>& materials) const;
};

// Throws BudgetError before more is allocated than Capture::max_bytes leaves.
HeldTextures hold_textures(const Capture& capture, const TextureSettings& settings);

}  // namespace tessera::scene
