#include "scene/texture_settings.h"

namespace tessera::scene {

Keys<TextureSettings> texture_keys() {
  using S = TextureSettings;
  return {
      {"texture.format", &S::format,
       "How memory holds textures. stored: PNG, JPEG and WebP images as texels of 4 bytes, KTX2 "
       "images as ASTC blocks of 4x4 texels. Else all are encoded to blocks: ETC2 of 4x4 texels (8 "
       "bytes, 16 with alpha), ASTC of so many texels (16 bytes). Images show the decoded blocks. "
       "Displacement maps stay as they are stored."},
  };
}

}  // namespace tessera::scene
