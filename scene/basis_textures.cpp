#include "scene/basis_textures.h"

#include <utility>

namespace tessera::scene {
std::shared_ptr<const shaders::Texture> basis_texture(ktx2::BasisTexture unpacked) {
  std::vector<shaders::Texture::Level> levels;
  for (ktx2::BasisLevel& level : unpacked.levels)
    levels.push_back({level.width, level.height, std::move(level.texels)});
  const shaders::TexelBlocks blocks = unpacked.block_bytes == 0
                                          ? shaders::TexelBlocks{}
                                          : shaders::TexelBlocks{4, static_cast<int>(unpacked.block_bytes)};
  return std::make_shared<const shaders::Texture>(
      std::move(levels), unpacked.srgb ? shaders::ColorSpace::kSrgb : shaders::ColorSpace::kLinear, blocks);
}

std::shared_ptr<const shaders::ScalarTexture> basis_heights(const ktx2::BasisTexture& unpacked) {
  const ktx2::BasisLevel& level = unpacked.levels.front();
  std::vector<float> values;
  values.reserve(level.texels.size() / 4);
  for (std::size_t red = 0; red < level.texels.size(); red += 4)
    values.push_back(static_cast<float>(level.texels[red]) / 255.0f);
  return std::make_shared<const shaders::ScalarTexture>(level.width, level.height, std::move(values));
}

}  // namespace tessera::scene
