#include "scene/held_textures.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "base/check.h"
#include "scene/basis_textures.h"
#include "scene/limits.h"

namespace tessera::scene {
namespace {

using shaders::Texture;

ktx2::BasisTexture unpack(const BasisImage& image, ktx2::BasisTarget target) {
  // No limits: the reader accepted and charged this image.
  const ImageLimits limits{std::numeric_limits<int>::max(), std::numeric_limits<std::uint64_t>::max()};
  ktx2::BasisTexture texture;
  std::string fault;
  TESSERA_CHECK(ktx2::decode_ktx2(image.file, target, limits, texture, fault), "a file that was unpacked before");
  return texture;
}

// Replaces KTX2 images by their blocks; `colors` is false where other blocks replace the colour textures.
void hold_basis_images(const Capture& capture, ktx2::BasisTarget target, bool colors, HeldTextures& held) {
  if (target == ktx2::BasisTarget::kRgba32) return;
  for (const BasisImage& image : capture.basis_images) {
    const bool texture = colors && image.texture != nullptr;
    if (!texture && image.heights == nullptr) continue;
    ktx2::BasisTexture unpacked = unpack(image, target);
    if (image.heights != nullptr) held.heights[image.heights.get()] = basis_heights(unpacked);
    if (texture) held.textures[image.texture.get()] = basis_texture(std::move(unpacked));
  }
}

// Bytes that a texture takes for good, and while it is encoded: texels of its levels and their blocks.
struct EncodedBytes {
  std::uint64_t kept = 0, working = 0;
};
EncodedBytes encoded_bytes(const Texture& texture, BlockFormat format) {
  const auto side = static_cast<std::uint64_t>(block_side(format));
  EncodedBytes bytes;
  for (int level = 0; level < texture.level_count(); ++level) {
    const auto width = static_cast<std::uint64_t>(texture.width(level)),
               height = static_cast<std::uint64_t>(texture.height(level));
    bytes.kept += 64 * ((width + 3) / 4) * ((height + 3) / 4);
    bytes.working += 4 * width * height + 16 * ((width + side - 1) / side) * ((height + side - 1) / side);
  }
  return bytes;
}

std::shared_ptr<const Texture> encoded(const Texture& texture, BlockFormat format, BlockEncoder& encoder) {
  const bool alpha = !texture.opaque();
  std::vector<Texture::Level> levels;
  for (int number = 0; number < texture.level_count(); ++number) {
    Texture::Level level = texture.stored_level(number);
    ktx2::BasisLevel blocks{level.width, level.height, {}, std::move(level.rgba)};
    encoder.encode(alpha, blocks);
    levels.push_back({level.width, level.height, std::move(blocks.texels)});
  }
  return std::make_shared<const Texture>(std::move(levels), texture.color_space(),
                                         shaders::TexelBlocks{block_side(format), block_bytes(format, alpha)});
}

void hold_blocks(const Capture& capture, BlockFormat format, HeldTextures& held) {
  // Textures by transfer function, in the order of the materials: an encoder has one transfer function.
  std::array<std::vector<const Texture*>, 2> wanted;
  MemoryBudget budget(capture.max_bytes, capture.file.string(), std::min(capture.charged_bytes, capture.max_bytes));
  std::uint64_t working = 0;
  for (const Material& material : capture.materials)
    for (const TextureSlot* slot : material.slots()) {
      if (slot->texture == nullptr || !held.textures.try_emplace(slot->texture.get()).second) continue;
      const EncodedBytes bytes = encoded_bytes(*slot->texture, format);
      budget.charge(bytes.kept, 1, "a texture's blocks (texture.format)");
      working = std::max(working, bytes.working);
      wanted[slot->texture->color_space() == shaders::ColorSpace::kSrgb ? 1 : 0].push_back(slot->texture.get());
    }
  held.charged_bytes = budget.used_bytes() - std::min(capture.charged_bytes, capture.max_bytes);
  if (held.textures.empty()) return;
  budget.charge(working + BlockEncoder::kWorkingBytes, 1, "encoding textures (texture.format)");
  for (const bool srgb : {false, true}) {
    if (wanted[srgb].empty()) continue;
    BlockEncoder encoder(format, srgb);
    for (const Texture* texture : wanted[srgb]) held.textures[texture] = encoded(*texture, format, encoder);
  }
}

}  // namespace

void HeldTextures::put_into(std::vector<Material>& materials) const {
  const auto replace = [](auto& texture, const auto& by) {
    if (const auto found = by.find(texture.get()); found != by.end()) texture = found->second;
  };
  for (Material& material : materials) {
    for (TextureSlot* slot : material.slots()) replace(slot->texture, textures);
    if (material.displacement) replace(material.displacement->texture, heights);
  }
}

HeldTextures hold_textures(const Capture& capture, const TextureSettings& settings) {
  HeldTextures held;
  const bool stored = settings.format == BlockFormat::kStored;
  hold_basis_images(capture, settings.basis_target, stored, held);
  if (!stored) hold_blocks(capture, settings.format, held);
  return held;
}

}  // namespace tessera::scene
