// Compressed buffer views inside captures: every reader reads the data of the plain views.
#include "scene/gltf/meshopt_reader.h"
#include "base/webp_codec.h"
#include "replay/pack/meshopt_encoder.h"
#include "scene/gltf/document.h"
#include "tests/support/meshopt_asset.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::meshopt_reader_test {
namespace {

using test::GltfAsset;

void expect_equal_data(const Capture& a, const Capture& b) {
  ASSERT_EQ(a.meshes.size(), b.meshes.size());
  for (std::size_t m = 0; m < a.meshes.size(); ++m) {
    const Primitive &p = a.meshes[m].primitives.at(0), &q = b.meshes[m].primitives.at(0);
    EXPECT_EQ(p.indices, q.indices);
    EXPECT_EQ(p.vertices.positions, q.vertices.positions);
    EXPECT_EQ(p.vertices.normals, q.vertices.normals);
    EXPECT_EQ(p.vertices.texcoords, q.vertices.texcoords);
    ASSERT_EQ(p.vertices.influences.size(), q.vertices.influences.size());
    for (std::size_t v = 0; v < p.vertices.influences.size(); ++v) {
      EXPECT_EQ(p.vertices.influences[v].joints, q.vertices.influences[v].joints);
      EXPECT_EQ(p.vertices.influences[v].weights, q.vertices.influences[v].weights);
    }
    ASSERT_EQ(p.vertices.morph_targets.size(), q.vertices.morph_targets.size());
    for (std::size_t t = 0; t < p.vertices.morph_targets.size(); ++t)
      EXPECT_EQ(p.vertices.morph_targets[t].positions, q.vertices.morph_targets[t].positions);
  }
  ASSERT_EQ(a.animations.size(), b.animations.size());
  for (std::size_t n = 0; n < a.animations.size(); ++n)
    for (std::size_t c = 0; c < a.animations[n].channels.size(); ++c) {
      EXPECT_EQ(a.animations[n].channels[c].times, b.animations[n].channels[c].times);
      EXPECT_EQ(a.animations[n].channels[c].values, b.animations[n].channels[c].values);
    }
  ASSERT_EQ(a.skins.size(), b.skins.size());
  for (std::size_t s = 0; s < a.skins.size(); ++s) EXPECT_EQ(a.skins[s].inverse_bind, b.skins[s].inverse_bind);
  const auto &t = a.materials.at(0).base_color_texture.texture, &u = b.materials.at(0).base_color_texture.texture;
  EXPECT_EQ(t->width(), u->width());
}

TEST(MeshoptViews, GiveEveryReaderThePlainData) {
  const Capture plain = test::read_contents(test::everything_asset().glb());
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    GltfAsset asset = test::meshopt_asset(name);
    expect_equal_data(test::read_contents(asset.glb()), plain);
    // Only used, not required; or not even declared.
    asset.document.erase("extensionsRequired");
    expect_equal_data(test::read_contents(asset.glb()), plain);
    asset.document.erase("extensionsUsed");
    expect_equal_data(test::read_contents(asset.glb()), plain);
  }
}

TEST(MeshoptViews, FallbackBuffersAreNeitherReadNorAllocated) {
  const Capture plain = test::read_contents(test::everything_asset().glb());
  for (const bool tagged : {true, false})
    for (const bool uri : {true, false}) {
      GltfAsset asset = test::meshopt_asset();
      json& fallback = asset.document["buffers"][1];
      fallback["byteLength"] = 1ull << 40;
      if (uri) fallback["uri"] = "there_is_no_such_file.bin";
      if (!tagged) fallback.erase("extensions");
      CaptureLimits limits;
      limits.max_bytes = 16 << 20;
      expect_equal_data(test::read_contents(asset.glb(), limits), plain);
    }
}

TEST(MeshoptViews, AreDecodedOnce) {
  GltfAsset asset = test::meshopt_asset();
  MemoryBudget budget(1 << 20);
  const CaptureLimits limits;
  gltf::Notes notes;
  gltf::Resources resources(asset.document, "f.glb", asset.binary, true, limits, budget, notes);
  const std::uint64_t before = budget.used_bytes();
  const gltf::Bytes first = resources.buffer_view(0);
  const std::uint64_t used = budget.used_bytes();
  EXPECT_EQ(used - before, 48u);
  EXPECT_EQ(resources.buffer_view(0).data(), first.data());
  EXPECT_EQ(budget.used_bytes(), used);
}

TEST(MeshoptViews, AreChargedBeforeTheyAreAllocated) {
  // A megabyte of zeros in some kilobytes of stream.
  constexpr std::uint64_t kCount = 1 << 18;
  std::vector<std::uint8_t> stream = {0xA1};
  stream.resize(1 + kCount / 256, 0xAA);
  stream.resize(stream.size() + 24, 0);
  GltfAsset asset;
  asset.add_view(stream);
  const json extension = {
      {"buffer", 0}, {"byteLength", stream.size()}, {"byteStride", 4}, {"count", kCount}, {"mode", "ATTRIBUTES"}};
  MemoryBudget budget(kCount * 4 - 1), enough(kCount * 4);
  const gltf::Place place("f.glb");
  EXPECT_THROW(gltf::read_meshopt(extension, stream, budget, place), LimitError);
  EXPECT_EQ(gltf::read_meshopt(extension, stream, enough, place), std::vector<std::uint8_t>(kCount * 4, 0));
}

// Views of gltfpack -c: 16-bit positions, bytes for normals, shorts for rotations, each with its filter.
TEST(MeshoptViews, FiltersAndQuantisedTypesGoTogether) {
  GltfAsset asset;
  const std::vector<std::int8_t> octahedra = {127, 0, 127, 0, 0, -127, 127, 0, 0, 0, 127, 0};
  const std::vector<std::uint16_t> positions = {0, 0, 0, 0, 16383, 0, 0, 0, 0, 16383, 100, 0};
  std::size_t fallback = 0;
  const auto add = [&](const auto& values, std::size_t stride, const char* type, const char* filter, json accessor) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
    const replay::MeshoptStream stream =
        replay::encode_elements({bytes, values.size() * sizeof values[0]}, stride, filter);
    const int view = asset.add_view(stream.bytes);
    json& object = asset.document["bufferViews"][static_cast<std::size_t>(view)];
    json extension = stream.layout;
    extension.update(object);
    object = {{"buffer", 1},
              {"byteOffset", fallback},
              {"byteLength", values.size() * sizeof values[0]},
              {"byteStride", stride},
              {"extensions", {{"EXT_meshopt_compression", extension}}}};
    fallback += 64;
    accessor.update({{"bufferView", view}, {"type", type}, {"count", 3}});
    return asset.add("accessors", accessor);
  };
  const int position = add(positions, 8, "VEC3", "NONE", {{"componentType", 5123}});
  const int normal = add(octahedra, 4, "VEC3", "OCTAHEDRAL", {{"componentType", 5120}, {"normalized", true}});
  asset.add("buffers", {{"byteLength", fallback}});
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}}}}});
  asset.add("nodes", {{"mesh", 0}, {"scale", {0.5, 0.5, 0.5}}});
  asset.document["extensionsUsed"] = {"KHR_mesh_quantization", "EXT_meshopt_compression"};
  asset.document["extensionsRequired"] = asset.document["extensionsUsed"];
  const Primitive primitive = test::read_contents(asset.glb()).meshes.at(0).primitives.at(0);
  EXPECT_EQ(primitive.vertices.positions, (std::vector<Vec3>{{0, 0, 0}, {16383, 0, 0}, {0, 16383, 100}}));
  EXPECT_EQ(primitive.vertices.normals, (std::vector<Vec3>{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}));
}

void expect_sound_or_refused(const std::string& contents, const fs::path& file) {
  test::write_text(file, contents);
  try {
    CaptureLimits limits;
    limits.max_bytes = 16 << 20;
    const Capture capture = read_capture(file, limits);
    for (const Mesh& mesh : capture.meshes)
      for (const Primitive& primitive : mesh.primitives) {
        for (const std::uint32_t index : primitive.indices) EXPECT_LT(index, primitive.vertices.count());
        for (const Vec3& p : primitive.vertices.positions)
          EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
      }
  } catch (const InputError& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
  } catch (const LimitError&) {
  }
}

TEST(MeshoptViews, AreSoundOrRefusedWhicheverByteIsWrong) {
  const test::TemporaryFolder folder;
  const GltfAsset good = test::meshopt_asset();
  test::Random random(21);
  for (std::size_t at = 0; at < good.binary.size(); at += 3) {
    GltfAsset bad = good;
    bad.binary[at] = static_cast<std::uint8_t>(bad.binary[at] ^ (1 << random.integer(0, 7)));
    expect_sound_or_refused(bad.glb(), folder / "f.glb");
  }
}

TEST(MeshoptViews, ATruncatedStreamIsRefusedWithItsPointerAtEveryLength) {
  const test::TemporaryFolder folder;
  for (const std::size_t view : {0u, 3u, 7u}) {
    GltfAsset asset = test::meshopt_asset();
    const std::size_t size = test::meshopt_member(asset, view)["byteLength"];
    for (std::size_t length = 1; length < size; length += 1 + length / 16) {
      test::meshopt_member(asset, view)["byteLength"] = length;
      test::write_text(folder / "f.glb", asset.glb());
      try {
        read_capture(folder / "f.glb");
        ADD_FAILURE() << view << " of length " << length;
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("/bufferViews/" + std::to_string(view) +
                                                     "/extensions/EXT_meshopt_compression: is a stream that "));
      }
    }
  }
}

// ---- EXT_texture_webp -------------------------------------------------------------------------------------------

GltfAsset webp_asset(const Image8& image, bool lossless) {
  GltfAsset asset = test::everything_asset();
  const std::string bytes = encode_webp(image, 90, lossless);
  const int source = asset.add("images", {{"bufferView", asset.add_view(test::bytes_of(bytes))}});
  asset.document["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = source;
  return asset;
}

TEST(TextureWebp, TheExtensionsImageIsTakenBeforeTheFallback) {
  for (const bool lossless : {true, false}) {
    GltfAsset asset = webp_asset(Image8(20, 12, 3), lossless);
    EXPECT_EQ(test::read_contents(asset.glb()).materials.at(0).base_color_texture.texture->width(), 20);
    asset.document["textures"][0].erase("source");
    asset.document["extensionsRequired"] = {"EXT_texture_webp"};
    const Capture capture = test::read_contents(asset.glb());
    EXPECT_EQ(capture.materials.at(0).base_color_texture.texture->width(), 20);
    EXPECT_EQ(capture.materials.at(1).displacement->texture->levels()[0].width, 20);  // heights as well
    EXPECT_TRUE(capture.notices.empty());
  }
}

TEST(TextureWebp, AnImageThatCannotBeReadGivesWayToTheFallbackWithANotice) {
  GltfAsset asset = webp_asset(Image8(20, 12, 3), true);
  const auto source = asset.document["textures"][0]["extensions"]["EXT_texture_webp"]["source"].get<std::size_t>();
  const int view = asset.document["images"][source]["bufferView"];
  asset.binary[asset.first_byte_of_view(view) + 13] ^= 0xFF;
  const Capture capture = test::read_contents(asset.glb());
  EXPECT_EQ(capture.materials.at(0).base_color_texture.texture->width(), 4);
  ASSERT_EQ(capture.notices.size(), 1u);
  EXPECT_THAT(capture.notices[0], testing::HasSubstr("/images/1"));
  // Without a fallback it is the texture's fault.
  asset.document["textures"][0].erase("source");
  EXPECT_THROW(test::read_contents(asset.glb()), InputError);
}

}  // namespace
}  // namespace tessera::scene::meshopt_reader_test
