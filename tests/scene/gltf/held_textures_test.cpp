// Textures that memory holds in place of a capture's textures: texture.format.
#include "scene/held_textures.h"
#include "base/error.h"
#include "scene/assembly.h"
#include "tests/support/basis_asset.h"
#include "tests/support/heap_meter.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::held_textures_test {
namespace {

using shaders::ColorSpace;
using shaders::Texture;

constexpr ktx2::BasisTarget kPlain = ktx2::BasisTarget::kRgba32;

std::shared_ptr<const Texture> waves(int width, int height, int channels, ColorSpace space) {
  Image8 image(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c)
        image.at(x, y)[c] = static_cast<std::uint8_t>(100 + 90 * ((x / 5 + c) % 2) + (7 * x + 3 * y * c) % 40);
  return std::make_shared<const Texture>(DecodedImage{image}, space);
}

// Colour with alpha, data without, and the data once more.
Capture with_textures() {
  Capture capture;
  Material material;
  material.base_color_texture.texture = waves(30, 17, 4, ColorSpace::kSrgb);
  material.normal_texture.texture = waves(16, 16, 3, ColorSpace::kLinear);
  material.occlusion_texture.texture = material.metallic_roughness_texture.texture = material.normal_texture.texture;
  material.emissive_texture.texture = waves(9, 1, 3, ColorSpace::kSrgb);
  test::add_material(capture, material);
  test::add_material(capture, material);
  return capture;
}

Material held(const Capture& capture, const TextureSettings& settings) {
  std::vector<Material> materials = capture.materials;
  hold_textures(capture, settings).put_into(materials);
  return materials.at(0);
}

std::vector<std::uint8_t> encoded_level(const Texture& texture, int level, BlockFormat format) {
  Texture::Level stored = texture.stored_level(level);
  ktx2::BasisLevel blocks{stored.width, stored.height, {}, std::move(stored.rgba)};
  BlockEncoder(format, texture.color_space() == ColorSpace::kSrgb).encode(!texture.opaque(), blocks);
  return blocks.texels;
}

// Invariant HT1. The twin: levels made from decoded texels, as an encoder of level 0 alone has to.
TEST(HeldTextures, EveryLevelIsEncodedFromTheCapturesTexels) {
  const Capture capture = with_textures();
  for (const BlockFormat format :
       {BlockFormat::kEtc2, BlockFormat::kAstc4x4, BlockFormat::kAstc6x6, BlockFormat::kAstc12x12}) {
    const Material material = held(capture, {kPlain, format});
    int others = 0;
    for (std::size_t slot = 0; slot < 5; ++slot) {
      const Texture &stored = *capture.materials[0].slots()[slot]->texture, &texture = *material.slots()[slot]->texture;
      EXPECT_EQ(texture.color_space(), stored.color_space());
      EXPECT_EQ(texture.opaque(), stored.opaque());
      EXPECT_EQ(texture.blocks().side, block_side(format));
      EXPECT_EQ(texture.blocks().bytes, format == BlockFormat::kEtc2 && stored.opaque() ? 8 : 16);
      ASSERT_EQ(texture.level_count(), stored.level_count());
      const Texture made({texture.stored_level(0)}, texture.color_space(), texture.blocks());
      for (int level = 0; level < stored.level_count(); ++level) {
        EXPECT_EQ(texture.stored_level(level).rgba, encoded_level(stored, level, format)) << word(format) << level;
        others += texture.stored_level(level).rgba != made.stored_level(level).rgba ? 1 : 0;
      }
    }
    EXPECT_GT(others, 0) << word(format);
  }
}

TEST(HeldTextures, OnesThatMaterialsShareAreEncodedOnce) {
  const Capture capture = with_textures();
  const HeldTextures textures = hold_textures(capture, {kPlain, BlockFormat::kEtc2});
  EXPECT_EQ(textures.textures.size(), 3u);
  std::vector<Material> materials = capture.materials;
  textures.put_into(materials);
  EXPECT_EQ(materials[0].normal_texture.texture, materials[1].occlusion_texture.texture);
}

TEST(HeldTextures, AsStoredTheyStayAndCostNothing) {
  const Capture capture = with_textures();
  const HeldTextures textures = hold_textures(capture, {ktx2::BasisTarget::kAstc4x4, BlockFormat::kStored});
  EXPECT_TRUE(textures.textures.empty() && textures.heights.empty());
  EXPECT_EQ(textures.charged_bytes, 0u);
}

// Invariant HT2.
TEST(HeldTextures, AnyFormatTakesTheTexturesOfKtx2ImagesAndLeavesTheirHeights) {
  const Capture capture = test::read_asset(test::basis_texture_asset(test::basis_file("uastc_cloud_mips_32x20")));
  ASSERT_EQ(capture.basis_images.size(), 1u);
  for (const ktx2::BasisTarget target : {kPlain, ktx2::BasisTarget::kAstc4x4}) {
    std::vector<Material> stored = capture.materials, blocks = capture.materials;
    hold_textures(capture, {target, BlockFormat::kStored}).put_into(stored);
    hold_textures(capture, {target, BlockFormat::kAstc6x6}).put_into(blocks);
    const Texture &plain = *capture.materials[0].base_color_texture.texture,
                  &texture = *blocks[0].base_color_texture.texture;
    EXPECT_EQ(texture.blocks(), (shaders::TexelBlocks{6, 16}));
    EXPECT_EQ(texture.stored_level(0).rgba, encoded_level(plain, 0, BlockFormat::kAstc6x6));
    const shaders::ScalarTexture &a = *stored[1].displacement->texture, &b = *blocks[1].displacement->texture;
    ASSERT_EQ(a.levels().size(), b.levels().size());
    EXPECT_TRUE(std::equal(a.levels()[0].values.begin(), a.levels()[0].values.end(), b.levels()[0].values.begin()));
  }
}

// Points without normals have materials of their own, made from the capture's.
TEST(HeldTextures, MaterialsThatAssemblyAddedHaveThemToo) {
  Capture capture = with_textures();
  Primitive points = test::points({Vec3(0.0f), Vec3(1.0f)}, 0);
  points.vertices.texcoords.emplace_back(points.vertices.count());
  test::add_node(capture, points);
  Assembly assembly = assemble(capture);
  ASSERT_EQ(assembly.materials.size(), 4u);
  hold_textures(capture, {kPlain, BlockFormat::kEtc2}).put_into(assembly.materials);
  EXPECT_EQ(assembly.materials.size(), 4u);
  EXPECT_EQ(assembly.materials[3].base_color_texture.texture, assembly.materials[0].base_color_texture.texture);
  EXPECT_EQ(assembly.materials[3].base_color_texture.texture->blocks().side, 4);
}

// Invariant HT3.
TEST(HeldTextures, TakeNoMoreThanIsCharged) {
  Capture capture;
  Material material;
  material.base_color_texture.texture = waves(512, 200, 3, ColorSpace::kSrgb);
  material.normal_texture.texture = waves(3, 1000, 3, ColorSpace::kLinear);
  test::add_material(capture, material);
  capture.max_bytes = 512ull << 20;
  for (const BlockFormat format : {BlockFormat::kEtc2, BlockFormat::kAstc12x12}) {
    const test::HeapMeter meter;
    const HeldTextures textures = hold_textures(capture, {kPlain, format});
    EXPECT_LE(meter.live_bytes(), static_cast<std::int64_t>(textures.charged_bytes) + (64 << 10)) << word(format);
    EXPECT_LE(meter.peak_bytes(),
              static_cast<std::int64_t>(textures.charged_bytes + BlockEncoder::kWorkingBytes + (2 << 20)))
        << word(format);
    EXPECT_GT(textures.charged_bytes, 512u * 200 * 4);
  }
}

// PSNR of all textures of a capture with all their levels, over the channels that they have.
double psnr_of(const Capture& capture, BlockFormat format) {
  double sum = 0, count = 0;
  for (const auto& [stored, texture] : hold_textures(capture, {kPlain, format}).textures)
    for (int level = 0; level < stored->level_count(); ++level) {
      const std::vector<std::uint8_t> a = stored->stored_level(level).rgba, b = texture->stored_level(level).rgba;
      for (std::size_t i = 0; i < a.size(); ++i) {
        if (i % 4 == 3 && stored->opaque()) continue;
        const double difference = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        sum += difference * difference, count += 1;
      }
    }
  return 10 * std::log10(255.0 * 255.0 * count / sum);
}

// The least PSNR: the measured value less half a decibel.
struct Floors {
  double etc2, astc_4x4, astc_6x6, astc_12x12;
};
void expect_floors(const Capture& capture, const Floors& floors) {
  const double measured[] = {psnr_of(capture, BlockFormat::kEtc2), psnr_of(capture, BlockFormat::kAstc4x4),
                             psnr_of(capture, BlockFormat::kAstc6x6), psnr_of(capture, BlockFormat::kAstc12x12)};
  EXPECT_GE(measured[0], floors.etc2);
  EXPECT_GE(measured[1], floors.astc_4x4);
  EXPECT_GE(measured[2], floors.astc_6x6);
  EXPECT_GE(measured[3], floors.astc_12x12);
  // Fewer bits a texel lose more.
  EXPECT_GT(measured[1], measured[2]);
  EXPECT_GT(measured[2], measured[3]);
}

TEST(TexturesOfCaptures, KeepTheQualityThatTheirBlocksAllow) {
  expect_floors(read_capture(test::shipped_capture("vases")), {38.9, 46.8, 39.9, 32.8});
  expect_floors(read_capture(test::shipped_capture("garden")), {39.6, 45.7, 36.6, 28.2});
}
TEST(TexturesOfCaptures, KeepAsMuchInSampleModels) {
  const auto assets = test::assets_folder();
  if (!assets) GTEST_SKIP() << "no sample models";
  expect_floors(read_capture(*assets / "Fox" / "glTF" / "Fox.gltf"), {42.5, 56.1, 46.1, 31.9});
}

TEST(HeldTextures, AreRefusedBeforeAnyIsEncoded) {
  Capture capture = with_textures();
  capture.max_bytes = 100'000;
  capture.charged_bytes = 99'000;
  try {
    hold_textures(capture, {kPlain, BlockFormat::kAstc4x4});
    FAIL();
  } catch (const LimitError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("texture.format"));
  }
  EXPECT_NO_THROW(hold_textures(capture, {kPlain, BlockFormat::kStored}));
}

}  // namespace
}  // namespace tessera::scene::held_textures_test
