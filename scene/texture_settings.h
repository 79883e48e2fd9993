#pragma once

#include "base/block_encoder.h"
#include "base/key_table.h"
#include "base/ktx2/ktx2.h"

namespace tessera::scene {

// Keys texture.* of a replay; hardware declares the keys of the machine.
struct TextureSettings {
  // Form of KTX2 images in memory; no key. [spec] Every GPU with Vulkan 1.0 or OpenGL ES 3.2 in a current telephone
  // decodes ASTC.
  ktx2::BasisTarget basis_target = ktx2::BasisTarget::kAstc4x4;
  BlockFormat format = BlockFormat::kStored;
  auto operator<=>(const TextureSettings&) const = default;
};
// Reference images are made with the texels of the files.
inline constexpr TextureSettings kTexturesOfTheFile{ktx2::BasisTarget::kRgba32, BlockFormat::kStored};
Keys<TextureSettings> texture_keys();

}  // namespace tessera::scene
