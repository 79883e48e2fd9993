#include "base/error.h"
#include "base/image_codec.h"
#include "base/webp_codec.h"
#include "captures/sources/jpeg_writer.h"
#include "replay/pack/draco_encoder.h"
#include "scene/capture_reader.h"
#include "tests/support/basis_asset.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/heap_meter.h"
#include "tests/support/meshopt_asset.h"
#include "tests/support/tests.h"

namespace tessera::test::memory_budget_test {
namespace {

using captures::encode_jpeg;
using scene::CaptureLimits;

// Bytes that no file decides: the rules of the schema, buffers of streams, messages.
constexpr std::int64_t kConstantBytes = 512 << 10;

CaptureLimits memory_limit(std::uint64_t bytes) {
  CaptureLimits limits;
  limits.max_bytes = bytes;
  return limits;
}

struct Sized {
  std::string name;
  std::function<std::string()> contents;
};

// A grid of n x n points as one triangle list, or as strips of its index list.
GltfAsset grid(int n, int mode, bool quantized_indices) {
  GltfAsset asset;
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      positions.insert(positions.end(), {static_cast<float>(i), static_cast<float>(j), 0.0f});
      if (i + 1 < n && j + 1 < n)
        for (const int k : {0, 1, n, n, 1, n + 1}) indices.push_back(static_cast<std::uint32_t>(j * n + i + k));
    }
  const int p = asset.add_accessor("VEC3", positions);
  json primitive = {{"attributes", {{"POSITION", p}, {"NORMAL", p}}},
                    {"mode", mode},
                    {"targets", {{{"POSITION", p}}, {{"POSITION", p}, {"NORMAL", p}}}}};
  if (quantized_indices) primitive["indices"] = asset.add_accessor("SCALAR", indices);
  asset.add("meshes", {{"primitives", json::array({primitive})}});
  asset.add("nodes", {{"mesh", 0}});
  return asset;
}

GltfAsset draco_grid(int n, bool sequential) {
  const GltfAsset plain = grid(n, 4, true);
  replay::DracoInput input;
  input.vertex_count = static_cast<std::size_t>(n * n);
  replay::DracoAttribute positions;
  positions.name = "POSITION";
  positions.values.resize(3 * input.vertex_count);
  std::memcpy(positions.values.data(), plain.binary.data(), positions.values.size() * 4);
  input.indices.resize(static_cast<std::size_t>(6 * (n - 1) * (n - 1)));
  std::memcpy(input.indices.data(), &plain.binary[plain.first_byte(1)], input.indices.size() * 4);
  input.attributes = {positions};
  const replay::DracoOutput output = replay::encode_draco(input, {}, sequential);
  GltfAsset asset;
  asset.add_view(output.bytes);
  asset.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", input.vertex_count}});
  asset.add("accessors", {{"componentType", 5125}, {"type", "SCALAR"}, {"count", input.indices.size()}});
  asset.add("meshes", {{"primitives",
                        {{{"attributes", {{"POSITION", 0}}},
                          {"indices", 1},
                          {"extensions",
                           {{"KHR_draco_mesh_compression",
                             {{"bufferView", 0}, {"attributes", {{"POSITION", output.unique_ids[0]}}}}}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  return asset;
}

GltfAsset textured(const std::string& image) {
  GltfAsset asset = everything_asset();
  asset.document["images"][0]["bufferView"] = asset.add_view(bytes_of(image));
  return asset;
}

std::string repeated(const std::string& before, const std::string& element, int count, const std::string& after) {
  std::string out = before + element;
  for (int i = 1; i < count; ++i) out += "," + element;
  return out + after;
}

std::vector<Sized> captures() {
  const std::string asset = R"({"asset":{"version":"2.0"},)";
  Image8 noise(256, 256, 4);
  Random random(1);
  for (std::uint8_t& v : noise.values) v = static_cast<std::uint8_t>(random.integer(0, 255));
  Image16 wide(200, 300, 1);
  Image8 photo(500, 40, 3);
  return {
      {"everything.glb", [] { return everything_asset().glb(); }},
      {"everything.gltf", [] { return everything_asset().gltf(); }},
      {"triangles.glb", [] { return grid(150, 4, true).glb(); }},
      {"strip.glb", [] { return grid(150, 5, true).glb(); }},
      {"fan_without_indices.glb", [] { return grid(150, 6, false).glb(); }},
      {"points.glb", [] { return grid(150, 0, true).glb(); }},
      {"points_without_indices.glb", [] { return grid(150, 0, false).glb(); }},
      {"lines.glb", [] { return grid(150, 1, true).glb(); }},
      {"line_loop.glb", [] { return grid(150, 2, true).glb(); }},
      {"line_strip_without_indices.glb", [] { return grid(150, 3, false).glb(); }},
      {"weights_that_are_missing.glb",
       [] {
         GltfAsset out = grid(2, 4, true);
         json& targets = out.document["meshes"][0]["primitives"][0]["targets"];
         for (int k = 0; k < 2000; ++k) targets.push_back(json::object());
         for (int k = 0; k < 2000; ++k) out.add("nodes", {{"mesh", 0}, {"weights", {0}}});
         return out.glb();
       }},
      {"extensions_that_are_not_read.gltf",
       [=] {
         std::string out = asset + R"("extensionsUsed":["E")";
         for (int i = 0; i < 20000; ++i) out += fmt::format(R"(,"{}")", i);
         return out + "]}";
       }},
      {"data_uri.gltf", [] { return grid(150, 4, true).gltf(); }},
      {"sequential.glb", [] { return draco_grid(150, true).glb(); }},
      {"edgebreaker.glb", [] { return draco_grid(150, false).glb(); }},
      {"meshopt.glb",
       [] {
         GltfAsset compressed = grid(150, 4, true);
         compress_views(compressed);
         return compressed.glb();
       }},
      {"webp.glb", [=] { return textured(encode_webp(noise, 80, false)).glb(); }},
      {"webp_lossless.glb", [=] { return textured(encode_webp(noise, 0, true)).glb(); }},
      {"ktx2_etc1s.glb", [] { return basis_texture_asset(basis_file("etc1s_q128_cloud_128")).glb(); }},
      {"ktx2_uastc.glb", [] { return basis_texture_asset(basis_file("uastc_l4_noisea_64")).glb(); }},
      {"png.glb", [=] { return textured(encode_png(noise)).glb(); }},
      {"png_wide.glb", [=] { return textured(encode_png(wide)).glb(); }},
      {"jpeg.glb", [=] { return textured(encode_jpeg(photo, 80)).glb(); }},
      {"empty_nodes.gltf", [=] { return repeated(asset + R"("nodes":[)", "{}", 30000, "]}"); }},
      {"empty_materials.gltf", [=] { return repeated(asset + R"("materials":[)", "{}", 20000, "]}"); }},
      {"empty_samplers.gltf", [=] { return repeated(asset + R"("samplers":[)", "{}", 30000, "]}"); }},
      {"empty_objects.gltf", [=] { return repeated(asset + R"("extras":[)", "{}", 100000, "]}"); }},
      {"empty_arrays.gltf", [=] { return repeated(asset + R"("extras":[)", "[]", 100000, "]}"); }},
      {"numbers.gltf", [=] { return repeated(asset + R"("extras":[)", "1e5", 200000, "]}"); }},
      {"keys.gltf",
       [=] {
         std::string out = asset + R"("extras":{"k":0)";
         for (int i = 0; i < 60000; ++i) out += fmt::format(R"(,"{}":0)", i);
         return out + "}}";
       }},
      {"texts.gltf",
       [=] {
         return repeated(asset + R"("extensionsUsed":[)", R"("A text longer than any that lies inside")", 30000, "]}");
       }},
      {"extension_values.gltf",
       [=] { return repeated(asset + R"("nodes":[{"extensions":{"MADE_up":{"rows":[)", "[0]", 30000, "]}}}]}"); }},
      {"named_nodes.gltf",
       [=] {
         return repeated(
             asset + R"("nodes":[)",
             R"({"name":"a name that is quite long for a node","matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})", 5000,
             "]}");
       }},
  };
}

TEST(MemoryBudget, ChargesAtLeastThePeakHeapOfReading) {
  for (const Sized& sized : captures()) {
    const TemporaryFolder folder;
    const fs::path file = folder / sized.name;
    write_text(file, sized.contents());
    const HeapMeter meter;
    const scene::Capture capture = scene::read_capture(file);
    EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(capture.charged_bytes) + kConstantBytes) << sized.name;
    // A budget that charges a hundred times the need would pass as well, and be of no use.
    EXPECT_LE(static_cast<std::int64_t>(capture.charged_bytes), 16 * meter.peak_bytes() + kConstantBytes) << sized.name;
  }
}

TEST(MemoryBudget, SufficesExactlyAndRefusesOneByteBelow) {
  for (const Sized& sized : captures()) {
    const TemporaryFolder folder;
    const fs::path file = folder / sized.name;
    write_text(file, sized.contents());
    const std::uint64_t need = scene::read_capture(file).charged_bytes;
    EXPECT_NO_THROW(scene::read_capture(file, memory_limit(need))) << sized.name;
    EXPECT_THROW(scene::read_capture(file, memory_limit(need - 1)), LimitError) << sized.name;
  }
}

TEST(MemoryBudget, IsKeptAndNothingLeaksWhereverItRunsOut) {
  for (const Sized& sized : captures()) {
    const TemporaryFolder folder;
    const fs::path file = folder / sized.name;
    write_text(file, sized.contents());
    const std::uint64_t need = scene::read_capture(file).charged_bytes;
    for (int sixteenth = 0; sixteenth < 16; ++sixteenth) {
      const std::uint64_t limit = need * static_cast<std::uint64_t>(sixteenth) / 16;
      const HeapMeter meter;
      try {
        scene::read_capture(file, memory_limit(limit));
        ADD_FAILURE() << sized.name << " at " << limit << " was read";
      } catch (const LimitError& error) {
        EXPECT_EQ(std::string(error.what()).rfind(file.string() + ": ", 0), 0u) << error.what();
      }
      EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(limit) + kConstantBytes) << sized.name << " at " << limit;
      EXPECT_EQ(meter.live_bytes(), 0) << sized.name << " at " << limit;
    }
  }
}

// Small files that ask for much: counts without data behind them, streams and images that unpack to more.
std::vector<Sized> hostile() {
  const auto keys_without_data = [](std::uint64_t count) {
    return [=] {
      GltfAsset asset = everything_asset();
      for (const std::size_t k : {kTranslations, kTimes, kRotations, kMorphWeights}) {
        asset.document["accessors"][k]["count"] = count;
        asset.document["accessors"][k].erase("bufferView");
      }
      return asset.glb();
    };
  };
  const auto draco_counts = [](std::uint8_t method, std::uint64_t declared) {
    return [=] {
      GltfAsset asset = draco_asset(method == 0);
      std::string stream = std::string("DRACO\x02\x02\x01", 8) + static_cast<char>(method) + std::string(2, '\0');
      if (method == 1) stream += '\0';
      const std::string varint = "\xFF\xFF\xFF\x1F";  // 2^26 - 1, for faces and points alike
      stream += varint + varint + std::string(64, '\xFF');
      const int view = asset.add_view(bytes_of(stream));
      asset.document["bufferViews"][0] = asset.document["bufferViews"][static_cast<std::size_t>(view)];
      asset.document["accessors"][2]["count"] = declared;
      return asset.glb();
    };
  };
  return {
      {"animation_of_2_to_30_keys.glb", keys_without_data(1u << 30)},
      {"sequential_of_2_to_26_faces.glb", draco_counts(0, 3ull << 27 >> 1)},
      {"edgebreaker_of_2_to_26_faces.glb", draco_counts(1, 3ull << 27 >> 1)},
      {"image_8000_a_side.glb", [] { return textured(encode_png(Image8(8000, 8000, 1))).glb(); }},
      {"million_objects.gltf",
       [] { return repeated(R"({"asset":{"version":"2.0"},"extras":[)", "{}", 1000000, "]}"); }},
      {"million_nodes.gltf", [] { return repeated(R"({"asset":{"version":"2.0"},"nodes":[)", "{}", 1000000, "]}"); }},
  };
}

TEST(MemoryBudget, RefusesLargerContentsBeforeUnpackingThem) {
  constexpr std::uint64_t kLimit = 48 << 20;
  for (const Sized& sized : hostile()) {
    const TemporaryFolder folder;
    const fs::path file = folder / sized.name;
    write_text(file, sized.contents());
    EXPECT_THROW(scene::read_capture(file, memory_limit(kLimit)), LimitError)
        << sized.name;  // allocates the objects that are made once
    const HeapMeter meter;
    EXPECT_THROW(scene::read_capture(file, memory_limit(kLimit)), LimitError) << sized.name;
    EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(kLimit) + kConstantBytes) << sized.name;
    EXPECT_EQ(meter.live_bytes(), 0) << sized.name;
  }
}

TEST(MemoryBudget, RefusesAFileBeforeReadingIt) {
  const TemporaryFolder folder;
  const fs::path file = folder / "large.glb";
  write_text(file, "glTF");
  fs::resize_file(file, 64 << 20);
  CaptureLimits file_limit;
  file_limit.max_file_bytes = 1 << 20;
  const HeapMeter meter;
  EXPECT_THROW(scene::read_capture(file, memory_limit(1 << 20)), LimitError);
  EXPECT_THROW(scene::read_capture(file, file_limit), LimitError);
  EXPECT_LE(meter.peak_bytes(), kConstantBytes);
}

// Files and claims much larger than their contents.
TEST(MemoryBudget, RefusesSizesBeyondTheBudgetBeforeAllocating) {
  const TemporaryFolder folder;
  const std::string claim =
      R"({"asset":{"version":"2.0"},"nodes":[{}],"accessors":[{"componentType":5126,"count":300000000,"type":"SCALAR"},
      {"componentType":5126,"count":300000000,"type":"VEC3"}],"animations":[{"samplers":[{"input":0,"output":1}],
      "channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}]})";
  write_text(folder / "keys.gltf", claim);
  write_text(folder / "zeros.glb", "");
  fs::resize_file(folder / "zeros.glb", 1'900'000'000);
  std::string head("glTF\2\0\0\0", 8);
  head +=
      std::string("\0\xb3\x3f\x71", 4) + std::string("\xec\xb2\x3f\x71JSON{}", 10);  // 1.9e9 bytes, all of them JSON
  write_text(folder / "json.glb", head);
  fs::resize_file(folder / "json.glb", 1'900'000'000);
  for (const char* name : {"keys.gltf", "zeros.glb", "json.glb"}) {
    const HeapMeter meter;
    EXPECT_THROW(scene::read_capture(folder / name), LimitError) << name;
    EXPECT_LE(meter.peak_bytes(), kConstantBytes) << name;
  }
}

}  // namespace
}  // namespace tessera::test::memory_budget_test
