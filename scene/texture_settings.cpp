#include "scene/texture_settings.h"

namespace tessera::scene {

Keys<TextureSettings> texture_keys() {
  using S = TextureSettings;
  return {
      {"texture.basis_target", &S::basis_target,
       "What KTX2 textures become in memory: 4 bytes a texel; blocks of 4x4 texels, ETC2 of 8 bytes (16 with alpha); "
       "ASTC of 16. Images show what the blocks decode to."},
  };
}

}  // namespace tessera::scene
