// texture.format on the whole machine: its image and its cost.
#include "base/block_encoder.h"
#include "base/image_codec.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "replay/tradeoff/knobs.h"
#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/image_bytes.h"
#include "tests/support/tests.h"

namespace tessera::replay::texture_format_test {
namespace {

using memory::Purpose;
using memory::Unit;

// A multiple of the sides of all blocks.
constexpr int kSide = 120;

constexpr BlockFormat kFormats[] = {BlockFormat::kEtc2,     BlockFormat::kAstc4x4, BlockFormat::kAstc5x5,
                                    BlockFormat::kAstc6x6,  BlockFormat::kAstc8x8, BlockFormat::kAstc10x10,
                                    BlockFormat::kAstc12x12};

Image8 pattern(bool alpha) {
  Image8 image(kSide, kSide, alpha ? 4 : 3);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < image.channels; ++c)
        image.at(x, y)[c] = static_cast<std::uint8_t>((x * x / 9 + 3 * y * c + (x / 8 + y / 8) % 2 * 90) % 256);
  return image;
}

// Encodes the image in blocks and decodes it again.
Image8 in_blocks(const Image8& image, BlockFormat format) {
  const shaders::Texture texture(DecodedImage{image}, shaders::ColorSpace::kSrgb);
  ktx2::BasisLevel level{kSide, kSide, {}, texture.stored_level(0).rgba};
  BlockEncoder(format, true).encode(image.channels == 4, level);
  Image8 decoded(kSide, kSide, 4);
  decoded.values = level.texels;
  return decoded;
}

// A square that fills the view, unlit; a texel of its image is a pixel, taken as the nearest of the only level.
scene::Capture screen(const Image8& image) {
  test::GltfAsset asset;
  const int positions = asset.add_accessor("VEC3", std::vector<float>{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0},
                                           {{"min", {-1, -1, 0}}, {"max", {1, 1, 0}}});
  const int texcoords = asset.add_accessor("VEC2", std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0});
  const int indices = asset.add_accessor("SCALAR", std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  const std::string png = encode_png(image);
  asset.add("images", {{"mimeType", "image/png"}, {"bufferView", asset.add_view(test::bytes_of(png))}});
  asset.add("samplers", {{"magFilter", 9728}, {"minFilter", 9728}});
  asset.add("textures", {{"source", 0}, {"sampler", 0}});
  asset.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                          {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  asset.add("meshes", {{"primitives",
                        {{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", texcoords}}},
                          {"indices", indices},
                          {"material", 0}}}}});
  asset.add("cameras",
            {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 1}, {"zfar", 10}}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.add("nodes", {{"camera", 0}, {"translation", {0, 0, 5}}});
  asset.document["extensionsUsed"] = {"KHR_materials_unlit"};
  const test::TemporaryFolder folder;
  test::write_text(folder / "screen.glb", asset.glb());
  return scene::read_capture(folder / "screen.glb");
}

gpu::FrameResult render(const scene::Capture& capture, BlockFormat format) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  gpu::set_key("texture.format", word(format), settings, gpu);
  gpu::set_key("l2.bytes", 16 << 20, settings, gpu);
  gpu::RenderRequest request;
  request.width = request.height = kSide;
  request.region = {0, 0, kSide, kSide};
  return gpu::Device(capture, gpu, settings, request).render(0);
}

TEST(TextureFormat, ImagesShowTheDecodedBlocks) {
  for (const bool alpha : {false, true}) {
    const scene::Capture capture = screen(pattern(alpha));
    for (const BlockFormat format : kFormats) {
      const gpu::FrameResult blocks = render(capture, format);
      const gpu::FrameResult wanted = render(screen(in_blocks(pattern(alpha), format)), BlockFormat::kStored);
      EXPECT_TRUE(test::image_bytes(blocks.targets) == test::image_bytes(wanted.targets)) << word(format);
      // The twin: the loss of the blocks is visible.
      EXPECT_FALSE(test::image_bytes(blocks.targets) ==
                   test::image_bytes(render(capture, BlockFormat::kStored).targets))
          << word(format);
    }
  }
}

// Each line of the blocks is read once from memory, whatever tiles read it: the L2 keeps it.
TEST(TextureFormat, AScreenOfTexelsTakesTheBytesOfTheirBlocks) {
  for (const bool alpha : {false, true}) {
    const scene::Capture capture = screen(pattern(alpha));
    const auto bytes = [&](BlockFormat format) {
      return render(capture, format).counters.ledger.traffic(Unit::kTilecore, Purpose::kTexture).read_bytes;
    };
    EXPECT_EQ(bytes(BlockFormat::kStored), std::uint64_t{kSide} * kSide * 4);
    for (const BlockFormat format : kFormats) {
      const int blocks = kSide / block_side(format), in_line = 64 / block_bytes(format, alpha);
      const int across = in_line == 8 ? 4 : 2;  // 4 x 2 blocks of 8 bytes, 2 x 2 of 16
      const int lines = (blocks + across - 1) / across * ((blocks + 1) / 2);
      EXPECT_EQ(bytes(format), static_cast<std::uint64_t>(lines) * 64) << word(format) << alpha;
      if (blocks % across == 0) {
        EXPECT_EQ(bytes(format), static_cast<std::uint64_t>(blocks * blocks * block_bytes(format, alpha)));
      }
    }
  }
}

TEST(TextureFormat, TheKnobTurnsAllFormatsAndNeedsTextures) {
  const Knob& knob = knob_named("texture_format");
  ASSERT_EQ(knob.settings.size(), kEnumWords<BlockFormat>.size());
  for (std::size_t k = 0; k < knob.settings.size(); ++k) EXPECT_EQ(knob.settings[k].label, kEnumWords<BlockFormat>[k]);
  EXPECT_EQ(knob.settings[knob.against].label, "stored");
  const auto reason = [&](const scene::Capture& capture) {
    const scene::Assembly assembly = scene::assemble(capture);
    const auto frame = scene::pose_frame(assembly, gpu::frame_camera(capture, {}, kSide, kSide),
                                         gpu::frame_request(capture, {}, {}, kSide, kSide, 0));
    return why_without_effect(knob, *frame, false);
  };
  scene::Capture capture = screen(pattern(false));
  EXPECT_EQ(reason(capture), "");
  capture.materials[0].base_color_texture.texture.reset();
  EXPECT_THAT(reason(capture), testing::HasSubstr("no textures"));
}

}  // namespace
}  // namespace tessera::replay::texture_format_test
