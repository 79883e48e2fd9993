#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "scene/capture.h"
#include "scene/texture_settings.h"

namespace tessera::scene {

// Textures in the emulated memory that differ from the capture's: ASTC blocks of KTX2 images, blocks of all textures
// for texture.format, and the texels decoded from them. A texture that is in neither map stays as it is.
//
// Invariants (cited by the tests):
//   HT1  Each level of an encoded texture is encoded separately, from the texels of the file or from the levels that
//        were made from them; its transfer function stays.
//   HT2  Displacement maps are the stored textures' maps whatever texture.format is.
//   HT3  The charge is never less than the memory used.
struct HeldTextures {
  std::map<const shaders::Texture*, std::shared_ptr<const shaders::Texture>> textures;
  std::map<const shaders::ScalarTexture*, std::shared_ptr<const shaders::ScalarTexture>> heights;
  // Bytes that texture.format uses of the bytes that the reader left: each format of a study uses its own. The reader
  // charged the bytes of KTX2 images.
  std::uint64_t charged_bytes = 0;

  // Replaces the textures of the capture's materials, or of materials made from them.
  void put_into(std::vector<Material>& materials) const;
};

// Throws BudgetError before more is allocated than Capture::max_bytes leaves.
HeldTextures hold_textures(const Capture& capture, const TextureSettings& settings);

}  // namespace tessera::scene
