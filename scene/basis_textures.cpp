#include "scene/basis_textures.h"

#include <limits>
#include <map>
#include <utility>

#include "base/check.h"

namespace tessera::scene {
namespace {

ktx2::BasisTexture unpack(const BasisImage& image, ktx2::BasisTarget target) {
  // What the reader accepted and charged.
  const ImageLimits limits{std::numeric_limits<int>::max(), std::numeric_limits<std::uint64_t>::max()};
  ktx2::BasisTexture texture;
  std::string fault;
  TESSERA_CHECK(ktx2::decode_ktx2(image.file, target, limits, texture, fault), "a file that was unpacked before");
  return texture;
}

}  // namespace

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

std::vector<Material> materials_for(const Capture& capture, ktx2::BasisTarget target) {
  std::vector<Material> materials = capture.materials;
  if (target == ktx2::BasisTarget::kRgba32 || capture.basis_images.empty()) return materials;
  std::map<const void*, std::shared_ptr<const shaders::Texture>> textures;
  std::map<const void*, std::shared_ptr<const shaders::ScalarTexture>> heights;
  for (const BasisImage& image : capture.basis_images) {
    ktx2::BasisTexture unpacked = unpack(image, target);
    if (image.heights != nullptr) heights[image.heights.get()] = basis_heights(unpacked);
    if (image.texture != nullptr) textures[image.texture.get()] = basis_texture(std::move(unpacked));
  }
  const auto replace = [](auto& texture, const auto& made) {
    if (const auto found = made.find(texture.get()); found != made.end()) texture = found->second;
  };
  for (Material& material : materials) {
    for (TextureSlot* slot : {&material.base_color_texture, &material.metallic_roughness_texture,
                              &material.normal_texture, &material.occlusion_texture, &material.emissive_texture})
      replace(slot->texture, textures);
    if (material.displacement) replace(material.displacement->texture, heights);
  }
  return materials;
}

}  // namespace tessera::scene
