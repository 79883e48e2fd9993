// Captures with KTX2 textures on the whole machine.
#include "base/ktx2/ktx2.h"
#include "base/image_codec.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/basis_asset.h"
#include "tests/support/image_bytes.h"
#include "tests/support/tests.h"

namespace tessera::replay::ktx2_test {
namespace {

using ktx2::BasisTarget;
using memory::Purpose;
using memory::Unit;

constexpr int kSide = 64;

// A square that shows a texture, unlit, by its only level; the image is a PNG or a KTX2 file.
scene::Capture square(const std::string& image, bool basis) {
  test::GltfAsset asset;
  const int positions = asset.add_accessor("VEC3", std::vector<float>{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0},
                                           {{"min", {-1, -1, 0}}, {"max", {1, 1, 0}}});
  const int texcoords = asset.add_accessor("VEC2", std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0});
  const int indices = asset.add_accessor("SCALAR", std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  asset.add("images",
            {{"mimeType", basis ? "image/ktx2" : "image/png"}, {"bufferView", asset.add_view(test::bytes_of(image))}});
  const json source = {{"source", 0}};
  asset.add("textures", basis ? json{{"extensions", {{"KHR_texture_basisu", source}}}} : source);
  asset.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                          {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  asset.add("meshes", {{"primitives",
                        {{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", texcoords}}},
                          {"indices", indices},
                          {"material", 0}}}}});
  asset.add("nodes", {{"mesh", 0}});
  const test::TemporaryFolder folder;
  test::write_text(folder / "square.glb", asset.glb());
  return scene::read_capture(folder / "square.glb");
}

gpu::FrameResult render(const scene::Capture& capture, BasisTarget target) {
  gpu::RunSettings settings;
  settings.textures.basis_target = target;
  gpu::RenderRequest request;
  request.width = request.height = kSide;
  request.region = {0, 0, kSide, kSide};
  return gpu::Device(capture, {}, settings, request).render(0);
}

// Decodes a file of one level and encodes it as PNG.
std::string as_png(const std::string& file, BasisTarget target = BasisTarget::kRgba32) {
  ktx2::BasisTexture texture;
  std::string fault;
  EXPECT_TRUE(ktx2::decode_ktx2(test::bytes_of(file), target, {}, texture, fault)) << fault;
  EXPECT_EQ(texture.levels.size(), 1u);
  Image8 image(texture.levels[0].width, texture.levels[0].height, 4);
  image.values = texture.levels[0].texels;
  return encode_png(image);
}

// Files of one level each, sRGB.
constexpr const char* kFiles[] = {"uastc_rdo_cloud_64", "uastc_l4_noisea_64", "etc1s_disc_32", "etc1s_noisea_32"};

TEST(Ktx2Captures, LookLikeTheSameTextureAsPng) {
  for (const char* name : kFiles) {
    const std::string file = test::basis_file(name);
    const scene::Capture capture = square(file, true);
    for (const BasisTarget target : {BasisTarget::kRgba32, BasisTarget::kAstc4x4})
      EXPECT_TRUE(test::image_bytes(render(capture, target).targets) ==
                  test::image_bytes(render(square(as_png(file, target), false), target).targets))
          << name;
  }
}

// The twin: a target is seen.
TEST(Ktx2Captures, BlocksOfATargetThatLosesSomethingAreSeen) {
  const scene::Capture capture = square(test::basis_file("etc1s_noisea_32"), true);
  EXPECT_FALSE(test::image_bytes(render(capture, BasisTarget::kRgba32).targets) ==
               test::image_bytes(render(capture, BasisTarget::kAstc4x4).targets));
}

TEST(Ktx2Captures, PlainTexelsCountAsTexelsOfAPng) {
  const std::string file = test::basis_file("uastc_rdo_cloud_64");
  const gpu::FrameResult basis = render(square(file, true), BasisTarget::kRgba32),
                         png = render(square(as_png(file), false), BasisTarget::kAstc4x4);
  EXPECT_EQ(basis.counters.texture.texels, png.counters.texture.texels);
  EXPECT_EQ(basis.counters.texture.cache_requests, png.counters.texture.cache_requests);
  EXPECT_EQ(basis.counters.texture.cache_misses, png.counters.texture.cache_misses);
  EXPECT_EQ(basis.counters.ledger.total().read_bytes, png.counters.ledger.total().read_bytes);
}

TEST(Ktx2Captures, BlocksTakeLessOfTheMemoryInterfaceThanTexels) {
  const scene::Capture opaque = square(test::basis_file("etc1s_q1_noise_64"), true);
  const auto bytes = [&](BasisTarget target) {
    return render(opaque, target).counters.ledger.traffic(Unit::kTilecore, Purpose::kTexture).read_bytes;
  };
  // All of the texture is seen: the frame reads at most its size, in whole lines.
  EXPECT_LE(3 * bytes(BasisTarget::kAstc4x4), bytes(BasisTarget::kRgba32));
}

TEST(Ktx2Captures, DevicesOfAllTargetsShareOnePreparedCapture) {
  const scene::Capture capture = square(test::basis_file("uastc_rdo_cloud_64"), true);
  const gpu::PreparedCapture prepared(capture);
  const auto scene_of = [](const gpu::PreparedCapture& of, BasisTarget target) -> const gpu::PreparedScene& {
    return of.scene({target, BlockFormat::kStored});
  };
  const gpu::PreparedScene& astc = scene_of(prepared, BasisTarget::kAstc4x4);
  EXPECT_EQ(&scene_of(prepared, BasisTarget::kAstc4x4), &astc);
  EXPECT_NE(&scene_of(prepared, BasisTarget::kRgba32), &astc);
  EXPECT_NE(astc.assembly.materials[0].base_color_texture.texture,
            scene_of(prepared, BasisTarget::kRgba32).assembly.materials[0].base_color_texture.texture);
  const scene::Capture plain = square(as_png(test::basis_file("etc1s_disc_32")), false);
  const gpu::PreparedCapture one(plain);
  EXPECT_EQ(&scene_of(one, BasisTarget::kAstc4x4), &scene_of(one, BasisTarget::kRgba32));
}

}  // namespace
}  // namespace tessera::replay::ktx2_test
