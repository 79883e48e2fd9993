#pragma once

#include "base/block_encoder.h"
#include "base/key_table.h"
#include "base/ktx2/ktx2.h"

namespace tessera::scene {

// Keys texture.* of a replay; those of the machine are hardware's.
struct TextureSettings {
  // [spec] Every GPU with Vulkan 1.0 or OpenGL ES 3.2 on a telephone of today decodes ASTC.
  ktx2::BasisTarget basis_target = ktx2::BasisTarget::kAstc4x4;
  BlockFormat format = BlockFormat::kStored;
  auto operator<=>(const TextureSettings&) const = default;
};
// Of the file's own texels: what reference images are made with.
inline constexpr TextureSettings kTexturesOfTheFile{ktx2::BasisTarget::kRgba32, BlockFormat::kStored};
Keys<TextureSettings> texture_keys();

}  // namespace tessera::scene

namespace tessera {

template <>
inline constexpr auto kEnumWords<ktx2::BasisTarget> = std::to_array<std::string_view>({"rgba8", "etc2", "astc"});

}  // namespace tessera
