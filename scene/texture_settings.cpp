#include "scene/texture_settings.h"

namespace tessera::scene {

Keys<TextureSettings> texture_keys() {
  using S = TextureSettings;
  return {
      {"texture.basis_target", &S::basis_target,
       "What KTX2 textures become in memory: 4 bytes a texel; blocks of 4x4 texels, ETC2 of 8 bytes (16 with alpha); "
       "ASTC of 16. Images show what the blocks decode to."},
      {"texture.format", &S::format,
       "What memory holds of textures, KTX2 or not: them as they are stored (texture.basis_target), or all encoded to "
       "blocks: ETC2 of 4x4 texels (8 bytes, 16 with alpha), ASTC of so many texels (16 bytes). Images show what the "
       "blocks decode to. Displacement maps stay as they are."},
  };
}

}  // namespace tessera::scene
