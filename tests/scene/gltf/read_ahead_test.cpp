// Streams and images that are decoded ahead: no result depends on it, or on the number of threads.
#include <atomic>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/parallel.h"
#include "base/webp_codec.h"
#include "captures/sources/jpeg_writer.h"
#include "replay/pack/draco_encoder.h"
#include "scene/capture_reader.h"
#include "scene/gltf/read_ahead.h"
#include "tests/support/basis_asset.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/heap_meter.h"
#include "tests/support/meshopt_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::read_ahead_test {
namespace {

using captures::encode_jpeg;

using test::GltfAsset;

constexpr int kMeshes = 6, kSide = 20;

// A grid of its own for each number.
std::vector<float> grid_positions(int number) {
  std::vector<float> out;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      out.insert(out.end(), {static_cast<float>(i), static_cast<float>(j), static_cast<float>(i * j % (number + 3))});
  return out;
}
std::vector<std::uint32_t> grid_indices() {
  std::vector<std::uint32_t> out;
  for (int j = 0; j + 1 < kSide; ++j)
    for (int i = 0; i + 1 < kSide; ++i)
      for (const int k : {0, 1, kSide, kSide, 1, kSide + 1})
        out.push_back(static_cast<std::uint32_t>(j * kSide + i + k));
  return out;
}

GltfAsset plain_meshes() {
  GltfAsset asset;
  for (int m = 0; m < kMeshes; ++m) {
    const int positions = asset.add_accessor("VEC3", grid_positions(m)),
              indices = asset.add_accessor("SCALAR", grid_indices());
    asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}});
    asset.add("nodes", {{"mesh", m}});
  }
  return asset;
}

GltfAsset meshopt_meshes() {
  GltfAsset asset = plain_meshes();
  test::compress_views(asset);
  return asset;
}

GltfAsset draco_meshes() {
  GltfAsset asset;
  for (int m = 0; m < kMeshes; ++m) {
    replay::DracoInput input;
    input.vertex_count = kSide * kSide;
    input.indices = grid_indices();
    replay::DracoAttribute positions;
    positions.name = "POSITION";
    positions.values = grid_positions(m);
    input.attributes = {positions};
    const replay::DracoOutput output = replay::encode_draco(input, {}, m % 2 == 0);
    const int view = asset.add_view(output.bytes);
    const int position =
        asset.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", input.vertex_count}});
    asset.add("accessors", {{"componentType", 5125}, {"type", "SCALAR"}, {"count", input.indices.size()}});
    const json stream = {{"bufferView", view}, {"attributes", {{"POSITION", output.unique_ids[0]}}}};
    asset.add("meshes", {{"primitives",
                          {{{"attributes", {{"POSITION", position}}},
                            {"indices", position + 1},
                            {"extensions", {{"KHR_draco_mesh_compression", stream}}}}}}});
    asset.add("nodes", {{"mesh", m}});
  }
  return asset;
}

Image8 noise(int side, int channels, std::uint32_t seed) {
  Image8 image(side, side, channels);
  test::Random random(seed);
  for (std::uint8_t& v : image.values) v = static_cast<std::uint8_t>(random.integer(0, 255));
  return image;
}

// Materials with an image of every kind, some of which serve twice.
GltfAsset textured() {
  GltfAsset asset;
  const auto add = [&](const std::string& file, const json& texture_extensions = json()) {
    const int image =
        asset.add("images", {{"mimeType", "image/png"}, {"bufferView", asset.add_view(test::bytes_of(file))}});
    json texture = {{"source", image}};
    if (!texture_extensions.is_null()) texture = {{"extensions", {{texture_extensions.get<std::string>(), texture}}}};
    return asset.add("textures", texture);
  };
  const int png = add(encode_png(noise(50, 4, 1))), jpeg = add(encode_jpeg(noise(64, 3, 2), 80)),
            webp = add(encode_webp(noise(40, 3, 3), 80, false), "EXT_texture_webp"),
            grey = add(encode_png(noise(30, 1, 4))),
            ktx2 = add(test::basis_file("etc1s_q128_cloud_128"), "KHR_texture_basisu");
  const auto info = [](int texture) { return json{{"index", texture}}; };
  asset.add("materials",
            {{"pbrMetallicRoughness", {{"baseColorTexture", info(png)}, {"metallicRoughnessTexture", info(jpeg)}}},
             {"normalTexture", info(png)},
             {"emissiveTexture", info(webp)}});
  asset.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", info(ktx2)}}},
                          {"occlusionTexture", info(ktx2)},
                          {"extensions", {{"TESSERA_displacement", {{"texture", info(grey)}}}}}});
  asset.add("materials", {{"extensions", {{"TESSERA_displacement", {{"texture", info(ktx2)}}}}}});
  return asset;
}

struct Named {
  const char* name;
  GltfAsset asset;
};
std::vector<Named> assets() {
  return {{"plain", plain_meshes()}, {"meshopt", meshopt_meshes()}, {"draco", draco_meshes()}, {"images", textured()}};
}

// Outcome of reading: the whole capture, or the refusal.
struct Outcome {
  std::optional<Capture> capture;
  std::string error;
  bool is_limit = false;
};
Outcome read_on(std::size_t threads, const std::filesystem::path& file, const CaptureLimits& limits = {}) {
  const ThreadLimit limit(threads);
  Outcome out;
  try {
    out.capture = read_capture(file, limits);
  } catch (const LimitError& error) {
    out.error = error.what();
    out.is_limit = true;
  } catch (const InputError& error) {
    out.error = error.what();
  }
  return out;
}

void expect_same_texture(const shaders::Texture* a, const shaders::Texture* b) {
  ASSERT_EQ(a == nullptr, b == nullptr);
  if (a == nullptr) return;
  ASSERT_EQ(a->level_count(), b->level_count());
  for (int level = 0; level < a->level_count(); ++level)
    for (int y = 0; y < a->height(level); ++y)
      for (int x = 0; x < a->width(level); ++x) ASSERT_EQ(a->texel(level, x, y), b->texel(level, x, y));
}

void expect_same(const Capture& a, const Capture& b) {
  EXPECT_EQ(a.charged_bytes, b.charged_bytes);
  EXPECT_EQ(a.file_bytes, b.file_bytes);
  EXPECT_EQ(a.notices, b.notices);
  ASSERT_EQ(a.meshes.size(), b.meshes.size());
  for (std::size_t m = 0; m < a.meshes.size(); ++m)
    for (std::size_t p = 0; p < a.meshes[m].primitives.size(); ++p) {
      EXPECT_EQ(a.meshes[m].primitives[p].vertices.positions, b.meshes[m].primitives[p].vertices.positions);
      EXPECT_EQ(a.meshes[m].primitives[p].indices, b.meshes[m].primitives[p].indices);
    }
  ASSERT_EQ(a.materials.size(), b.materials.size());
  for (std::size_t m = 0; m < a.materials.size(); ++m) {
    for (std::size_t s = 0; s < a.materials[m].slots().size(); ++s)
      expect_same_texture(a.materials[m].slots()[s]->texture.get(), b.materials[m].slots()[s]->texture.get());
    ASSERT_EQ(a.materials[m].displacement.has_value(), b.materials[m].displacement.has_value());
    if (!a.materials[m].displacement) continue;
    const auto &x = a.materials[m].displacement->texture->levels(), &y = b.materials[m].displacement->texture->levels();
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t level = 0; level < x.size(); ++level)
      EXPECT_TRUE(std::equal(x[level].values.begin(), x[level].values.end(), y[level].values.begin()));
  }
}

// Reads with one thread and with four, and expects the same.
Outcome expect_same_for_all_threads(const std::filesystem::path& file, const CaptureLimits& limits = {}) {
  Outcome alone = read_on(1, file, limits);
  const Outcome together = read_on(4, file, limits);
  EXPECT_EQ(together.error, alone.error);
  EXPECT_EQ(together.is_limit, alone.is_limit);
  EXPECT_EQ(together.capture.has_value(), alone.capture.has_value());
  if (alone.capture && together.capture) expect_same(*together.capture, *alone.capture);
  return alone;
}

TEST(ReadAhead, EqualsReadingInOrder) {  // RA1
  for (const Named& named : assets()) {
    SCOPED_TRACE(named.name);
    const test::TemporaryFolder folder;
    test::write_text(folder / "a.glb", named.asset.glb());
    test::write_text(folder / "b.gltf", named.asset.gltf());
    test::write_text(folder / "c.gltf", named.asset.gltf_with_file("c.bin"));
    test::write_text(folder / "c.bin", std::string(named.asset.binary.begin(), named.asset.binary.end()));
    for (const char* file : {"a.glb", "b.gltf", "c.gltf"})
      EXPECT_TRUE(expect_same_for_all_threads(folder / file).capture.has_value()) << file;
  }
}

// The twin of these tests: something is on the shelves, for otherwise equal outcomes would say nothing.
TEST(ReadAhead, DecodesStreamsAndImagesBeforeTheyAreAskedFor) {  // RA1, RA2
  const ThreadLimit threads(4);
  for (const Named& named : assets()) {
    MemoryBudget budget(64 << 20);
    const CaptureLimits limits;
    gltf::Document document(named.asset.document, "f.glb", named.asset.binary, true, limits, budget);
    const std::uint64_t before = budget.used_bytes();
    gltf::read_ahead(document);
    EXPECT_EQ(budget.used_bytes(), before) << named.name;
    ASSERT_NE(document.ahead, nullptr) << named.name;
    const std::string name = named.name;
    EXPECT_EQ(document.ahead->views.size(), name == "meshopt" ? 2u * kMeshes : 0u) << name;
    EXPECT_EQ(document.ahead->draco.size(), name == "draco" ? std::size_t{kMeshes} : 0u) << name;
    EXPECT_EQ(document.ahead->colors.size(), name == "images" ? 4u : 0u) << name;
    EXPECT_EQ(document.ahead->basis_colors.size(), name == "images" ? 1u : 0u) << name;
    EXPECT_EQ(document.ahead->heights.size() + document.ahead->basis_heights.size(), name == "images" ? 2u : 0u)
        << name;
  }
}

TEST(ReadAhead, DamagedStreamsAreRefusedInTheFilesOrder) {  // RA1
  test::Random random(5);
  std::size_t refused = 0;
  for (const Named& named : assets()) {
    const std::size_t views = named.asset.document["bufferViews"].size();
    for (std::size_t first = 0; first < views; ++first) {
      GltfAsset damaged = named.asset;
      // This one and one after it: the first is to be named.
      for (const std::size_t view : {first, std::min(first + 2, views - 1)}) {
        const json& range = damaged.document["bufferViews"][view].contains("extensions")
                                ? test::meshopt_member(damaged, view)
                                : damaged.document["bufferViews"][view];
        const std::size_t begin = range.value("byteOffset", std::size_t{0}), size = range["byteLength"];
        for (int k = 0; k < 12; ++k)
          damaged.binary[begin + static_cast<std::size_t>(random.integer(0, static_cast<int>(size) - 1))] ^= 0x5A;
      }
      SCOPED_TRACE(std::string(named.name) + ", view " + std::to_string(first));
      const test::TemporaryFolder folder;
      test::write_text(folder / "f.glb", damaged.glb());
      refused += expect_same_for_all_threads(folder / "f.glb").capture ? 0 : 1;
    }
  }
  EXPECT_GT(refused, 20u);
}

TEST(ReadAhead, TheMemoryLimitIsTheSame) {  // RA1, RA2, MB1
  for (const Named& named : assets()) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "f.glb", named.asset.glb());
    test::write_text(folder / "f.gltf", named.asset.gltf());
    for (const char* file : {"f.glb", "f.gltf"}) {
      SCOPED_TRACE(std::string(named.name) + ", " + file);
      const std::uint64_t need = read_on(1, folder / file).capture->charged_bytes;
      for (std::uint64_t part = 0; part <= 40; ++part) {
        CaptureLimits limits;
        limits.max_bytes = part == 40 ? need - 1 : need * part / 40;
        EXPECT_TRUE(expect_same_for_all_threads(folder / file, limits).is_limit);
      }
      CaptureLimits limits;
      limits.max_bytes = need;
      EXPECT_TRUE(expect_same_for_all_threads(folder / file, limits).capture.has_value());
    }
  }
}

TEST(ReadAhead, StaysWithinTheMemoryLimitOnManyThreads) {  // RA2, MB2
  constexpr std::int64_t kConstantBytes = 1 << 20;
  const ThreadLimit threads(4);
  for (const Named& named : assets()) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "f.glb", named.asset.glb());
    const std::uint64_t need = read_capture(folder / "f.glb").charged_bytes;
    for (std::uint64_t part = 1; part <= 8; ++part) {
      CaptureLimits limits;
      limits.max_bytes = need * part / 8;
      const test::HeapMeter meter;
      try {
        read_capture(folder / "f.glb", limits);
      } catch (const LimitError&) {
      }
      EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(limits.max_bytes) + kConstantBytes) << named.name;
    }
  }
}

TEST(MemoryBudgetAhead, WaitingPartsGiveWayBeforeAChargeIsRefused) {  // MB1, MB2
  MemoryBudget budget(100, "f.glb");
  int drops = 0;
  budget.charge(10, 1, "a");
  budget.keep_waiting(60, [&] { ++drops; });
  budget.charge(30, 1, "b");
  EXPECT_EQ(drops, 0);  // exactly full
  budget.charge(1, 1, "c");
  EXPECT_EQ(drops, 1);
  budget.charge(59, 1, "d");
  EXPECT_EQ(drops, 1);
  EXPECT_EQ(budget.used_bytes(), 100u);
  MemoryBudget plain(100, "f.glb", 100);
  const auto refusal = [](MemoryBudget& of) {
    try {
      of.charge(3, 7, "e");
    } catch (const BudgetError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(budget), refusal(plain));
  EXPECT_NE(refusal(plain), "");
}

TEST(MemoryBudgetAhead, AccountsOfWorkAheadShareOneRoom) {  // MB2
  std::atomic<std::uint64_t> room = 100;
  std::vector<Charge> charges, others;
  MemoryBudget one(room, charges), other(room, others);
  one.charge(10, 4, "x");
  other.charge(60, 1, "y");
  EXPECT_EQ(room, 0u);
  EXPECT_THROW(one.charge(1, 1, "z"), BudgetError);
  EXPECT_THROW(other.charge(~0ull, 16, "z"), BudgetError);
  EXPECT_NO_THROW(one.charge(5, 0, "nothing"));
  ASSERT_EQ(charges.size(), 2u);
  EXPECT_EQ(charges[0].count * charges[0].size, 40u);
  EXPECT_EQ(charges[0].what, "x");
  EXPECT_EQ(one.used_bytes() + other.used_bytes(), 100u);
}

}  // namespace
}  // namespace tessera::scene::read_ahead_test
