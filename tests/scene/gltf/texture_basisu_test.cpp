// KHR_texture_basisu: KTX2 images in captures.
#include "base/color.h"
#include "base/error.h"
#include "base/ktx2/ktx2.h"
#include "scene/basis_textures.h"
#include "scene/held_textures.h"
#include "tests/support/basis_asset.h"
#include "tests/support/heap_meter.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::texture_basisu_test {
namespace {

using ktx2::BasisTarget;
using test::basis_file;
using test::basis_texture_asset;
using test::GltfAsset;

constexpr BasisTarget kTargets[] = {BasisTarget::kRgba32, BasisTarget::kAstc4x4};

std::vector<Material> materials_for(const Capture& capture, BasisTarget target) {
  std::vector<Material> materials = capture.materials;
  hold_textures(capture, {target, BlockFormat::kStored}).put_into(materials);
  return materials;
}

const shaders::Texture& base_color(const Capture& capture) {
  return *capture.materials.at(0).base_color_texture.texture;
}

// A texel as the file has it, in linear light.
Vec4 expected_texel(const ktx2::BasisTexture& texture, std::size_t level, int x, int y) {
  const ktx2::BasisLevel& l = texture.levels[level];
  const std::uint8_t* p = &l.texels[4 * static_cast<std::size_t>(y * l.width + x)];
  Vec4 out;
  for (int c = 0; c < 4; ++c)
    out[c] = texture.srgb && c < 3 ? srgb8_to_linear_table()[p[c]] : static_cast<float>(p[c]) / 255.0f;
  return out;
}

ktx2::BasisTexture unpacked(const std::string& file, BasisTarget target) {
  ktx2::BasisTexture texture;
  std::string fault;
  EXPECT_TRUE(ktx2::decode_ktx2(test::bytes_of(file), target, {}, texture, fault)) << fault;
  return texture;
}

// Invariants BT1 and BT2.
TEST(TextureBasisu, TexturesAreTheFilesLevelsAsEachTargetHoldsThem) {
  for (const char* name : {"etc1s_disc_mips_64", "uastc_cloud_mips_32x20", "uastc_normal_32", "etc1s_noisea_32"}) {
    const std::string file = basis_file(name);
    const Capture capture = test::read_contents(basis_texture_asset(file).gltf());
    ASSERT_EQ(capture.basis_images.size(), 1u);
    for (const BasisTarget target : kTargets) {
      const ktx2::BasisTexture wanted = unpacked(file, target);
      const std::vector<Material> materials = materials_for(capture, target);
      const shaders::Texture& texture = *materials.at(0).base_color_texture.texture;
      EXPECT_EQ(texture.blocks().bytes, wanted.block_bytes == 0 ? 4 : static_cast<int>(wanted.block_bytes));
      EXPECT_EQ(texture.blocks().side, wanted.block_bytes == 0 ? 1 : 4);
      if (wanted.levels.size() > 1) {
        EXPECT_EQ(static_cast<std::size_t>(texture.level_count()), wanted.levels.size()) << name;
      } else {
        EXPECT_EQ(texture.width(texture.level_count() - 1), 1) << name;
      }
      for (std::size_t level = 0; level < wanted.levels.size(); ++level)
        for (int y = 0; y < wanted.levels[level].height; ++y)
          for (int x = 0; x < wanted.levels[level].width; ++x)
            ASSERT_EQ(texture.texel(static_cast<int>(level), x, y), expected_texel(wanted, level, x, y))
                << name << " level " << level << " at " << x << ", " << y;
    }
  }
}

// The twin of BT1: generated levels differ from the levels of the file.
TEST(TextureBasisu, LevelsThatAreMadeWouldBeNoticed) {
  const std::string file = basis_file("etc1s_disc_mips_64");
  ktx2::BasisTexture one = unpacked(file, BasisTarget::kRgba32);
  const ktx2::BasisTexture all = one;
  one.levels.resize(1);
  const auto made = basis_texture(one);
  bool differs = false;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) differs = differs || made->texel(1, x, y) != expected_texel(all, 1, x, y);
  EXPECT_TRUE(differs);
}

TEST(TextureBasisu, IsReadFromBufferViewsDataUrisAndFiles) {
  const std::string file = basis_file("uastc_soft_mips_32");
  const GltfAsset in_view = basis_texture_asset(file);
  const Capture wanted = test::read_contents(in_view.gltf());
  GltfAsset in_uri = in_view;
  json& image = in_uri.document["images"][in_uri.document["images"].size() - 1];
  const test::TemporaryFolder folder;
  test::write_text(folder / "texture.ktx2", file);
  image = {{"uri", "texture.ktx2"}};
  test::write_text(folder / "capture.gltf", in_uri.gltf());
  const Capture from_file = read_capture(folder / "capture.gltf");
  std::string percent = "data:image/ktx2,";
  for (const char c : file) percent += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  image = {{"uri", percent}, {"mimeType", "image/ktx2"}};
  const Capture from_data = test::read_contents(in_uri.gltf());
  for (const Capture* capture : {&from_file, &from_data}) {
    EXPECT_EQ(base_color(*capture).level_count(), base_color(wanted).level_count());
    EXPECT_EQ(capture->basis_images.at(0).file, wanted.basis_images.at(0).file);
  }
}

TEST(TextureBasisu, TheExtensionsImageIsTakenBeforeTheFallback) {
  GltfAsset asset = basis_texture_asset(basis_file("uastc_cloud_mips_32x20"));
  const Capture with_fallback = test::read_contents(asset.gltf());
  EXPECT_EQ(base_color(with_fallback).width(), 32);
  EXPECT_EQ(with_fallback.materials[0].base_color_texture.source.format, TextureFormat::kKtx2Uastc);
  EXPECT_EQ(with_fallback.materials[0].base_color_texture.source.levels, 6);
  asset.document["textures"][0].erase("source");
  asset.document["extensionsRequired"] = {"KHR_texture_basisu"};
  const Capture required = test::read_contents(asset.gltf());
  EXPECT_EQ(base_color(required).width(), 32);
  EXPECT_EQ(required.materials.at(1).displacement->texture->levels()[0].width, 32);  // heights as well
}

TEST(TextureBasisu, AnImageThatCannotBeReadGivesWayToTheFallbackWithANotice) {
  std::string file = basis_file("uastc_cloud_mips_32x20");
  file.resize(file.size() - 1);
  GltfAsset asset = basis_texture_asset(file);
  const Capture capture = test::read_contents(asset.gltf());
  EXPECT_EQ(base_color(capture).width(), 4);
  EXPECT_TRUE(capture.basis_images.empty());
  ASSERT_EQ(capture.notices.size(), 1u);
  EXPECT_THAT(capture.notices[0], testing::HasSubstr("/images/1: "));
  // Without a fallback it is the texture's fault.
  asset.document["textures"][0].erase("source");
  EXPECT_THROW(test::read_contents(asset.gltf()), InputError);
}

TEST(TextureBasisu, FollowsTheFilesTransferFunctionAndSaysWhereTheUseIsAnother) {
  // Linear data as a colour.
  const Capture linear = test::read_contents(basis_texture_asset(basis_file("uastc_modes_linear")).gltf());
  ASSERT_EQ(linear.notices.size(), 1u);
  EXPECT_THAT(linear.notices[0], testing::HasSubstr("/images/1: is linear as it says, though it is used for colours"));
  EXPECT_TRUE(test::read_contents(basis_texture_asset(basis_file("uastc_modes")).gltf()).notices.empty());
}

// Invariant BT3.
TEST(TextureBasisu, HeightsAreTheRedChannelAndTheirCoarserLevelsMeans) {
  const std::string file = basis_file("etc1s_disc_mips_64");
  const Capture capture = test::read_contents(basis_texture_asset(file).gltf());
  for (const BasisTarget target : kTargets) {
    const ktx2::BasisTexture wanted = unpacked(file, target);
    const std::vector<Material> materials = materials_for(capture, target);
    const auto& levels = materials.at(1).displacement->texture->levels();
    ASSERT_EQ(levels.size(), 7u);
    for (std::size_t i = 0; i < levels[0].values.size(); ++i)
      ASSERT_EQ(levels[0].values[i], static_cast<float>(wanted.levels[0].texels[4 * i]) / 255.0f);
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        const auto at = [&](int dx, int dy) {
          return levels[0].values[static_cast<std::size_t>((2 * y + dy) * 64 + 2 * x + dx)];
        };
        EXPECT_NEAR(levels[1].values[static_cast<std::size_t>(y * 32 + x)],
                    (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4, 1e-6f);
      }
  }
}

TEST(TextureBasisu, OtherTexturesAreSharedByAllTargets) {
  const Capture capture = test::read_contents(test::everything_asset().gltf());
  EXPECT_TRUE(capture.basis_images.empty());
  for (const BasisTarget target : kTargets)
    EXPECT_EQ(materials_for(capture, target).at(0).base_color_texture.texture,
              capture.materials.at(0).base_color_texture.texture);
}

TEST(TextureBasisu, SidesBeyondTheLimitsAreRefusedWithThePlaceOfTheImage) {
  CaptureLimits limits;
  limits.image.max_side = 31;
  try {
    test::read_contents(basis_texture_asset(basis_file("uastc_cloud_mips_32x20")).gltf(), limits);
    FAIL();
  } catch (const LimitError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/images/1"));
  }
}

TEST(TextureBasisu, MaterialsWithBlocksTakeNoMoreThanReadingCharged) {
  for (const char* name : {"etc1s_q128_cloud_128", "uastc_l4_noisea_64", "uastc_zstd_mips_ramp_32"}) {
    const Capture capture = test::read_contents(basis_texture_asset(basis_file(name)).gltf());
    const test::HeapMeter meter;
    const std::vector<Material> astc = materials_for(capture, BasisTarget::kAstc4x4);
    EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(capture.charged_bytes) + (512 << 10)) << name;
  }
}

}  // namespace
}  // namespace tessera::scene::texture_basisu_test
