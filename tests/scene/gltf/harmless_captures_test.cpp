#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/tests.h"

namespace tessera::test::harmless_captures_test {
namespace {

// A capture that is odd, or that breaks a rule without any effect on the image: it must load.
struct Harmless {
  std::string name;
  std::function<fs::path(const fs::path& folder)> make;
};

Harmless odd(std::string name, std::function<void(GltfAsset&)> change) {
  return {std::move(name), [change = std::move(change)](const fs::path& folder) {
            GltfAsset asset = everything_asset();
            change(asset);
            return put(folder, "capture.glb", asset.glb());
          }};
}

Harmless file_with(std::string name, std::function<std::string()> contents) {
  return {name, [=](const fs::path& folder) { return put(folder, name, contents()); }};
}

std::vector<Harmless> containers() {
  const auto glb = [] { return everything_asset().glb(); };
  const auto chunk_after = [=](const std::string& chunk) {
    std::string bytes = glb() + chunk;
    return bytes.replace(8, 4, little_endian32(static_cast<std::uint32_t>(bytes.size())));
  };
  return {
      file_with("bytes_after_the_stated_length.glb", [=] { return glb() + "and more"; }),
      file_with("chunk_of_unknown_type.glb", [=] { return chunk_after(glb_chunk("ABCD", "whatever")); }),
      file_with("empty_chunk_of_unknown_type.glb", [=] { return chunk_after(glb_chunk("ABCD", "")); }),
      file_with("binary_chunk_longer_than_buffer.glb",
                [] {
                  GltfAsset a = everything_asset();
                  a.binary.resize(a.binary.size() + 3000);
                  return a.glb();
                }),
      file_with("spaces_after_json.glb",
                [] {
                  const GltfAsset a = everything_asset();
                  return make_glb(a.document.dump() + std::string(100, ' '), a.binary);
                }),
      file_with("glb_named.gltf", glb),
      file_with("gltf_named.glb", [] { return everything_asset().gltf(); }),
      // RFC 8259 section 8.1: a parser may ignore it.
      file_with("byte_order_mark.gltf", [] { return "\xEF\xBB\xBF" + everything_asset().gltf(); }),
      {"buffer_file_longer_than_buffer",
       [](const fs::path& folder) {
         const GltfAsset asset = everything_asset();
         put(folder, "a b.bin", std::string(asset.binary.begin(), asset.binary.end()) + std::string(500, 'x'));
         return put(folder, "capture.gltf", asset.gltf_with_file("a%20b.bin"));
       }},
      {"path_that_stays_inside",
       [](const fs::path& folder) {
         const GltfAsset asset = everything_asset();
         fs::create_directory(folder / "sub");
         put(folder / "sub", "data.bin", std::string(asset.binary.begin(), asset.binary.end()));
         fs::create_symlink(folder / "sub" / "data.bin", folder / "link.bin");
         return put(folder, "capture.gltf", asset.gltf_with_file("sub/../link.bin"));
       }},
      {"missing_file_of_unused_buffer",
       [](const fs::path& folder) {
         GltfAsset asset = everything_asset();
         asset.add("buffers", {{"uri", "none.bin"}, {"byteLength", 8}});
         return put(folder, "capture.glb", asset.glb());
       }},
  };
}

std::vector<Harmless> documents() {
  std::vector<Harmless> all = {
      odd("matrix_as_good_as_affine", [](GltfAsset& a) { a.poke(kInverseBind, 15, 1.000001f); }),
      odd("nodes_in_a_chain_of_100000",
          [](GltfAsset& a) {
            for (int i = 0; i < 100000; ++i) a.add("nodes", {{"children", {9 + i}}});
            a.add("nodes", json::object());
            a.document["scenes"][0]["nodes"].push_back(8);
          }),
      odd("lines_and_points",
          [](GltfAsset& a) {
            json lines = a.document["meshes"][0]["primitives"][0];
            for (lines["mode"] = 0; lines["mode"] < 4; lines["mode"] = lines["mode"].get<int>() + 1)
              a.document["meshes"][0]["primitives"].push_back(lines);
          }),
  };
  for (const json& row : capture_rows("harmless_captures.json"))
    all.push_back({row["name"], [row](const fs::path& folder) { return put_row(folder, row); }});
  return all;
}

std::vector<Harmless> contents() {
  return {
      odd("weights_that_do_not_sum_to_1",
          [](GltfAsset& a) {
            a.poke(kWeights, 0, 0.1f);
            a.poke(kWeights, 4, 7.0f);
          }),
      odd("weights_all_zero",
          [](GltfAsset& a) {
            for (std::size_t k = 0; k < 4; ++k) a.poke(kWeights, k, 0.0f);
          }),
      odd("joint_out_of_range_without_weight", [](GltfAsset& a) { a.poke(kJoints, 3, std::uint8_t{200}); }),
      odd("positions_near_the_largest_float",
          [](GltfAsset& a) {
            a.poke(kPositions, 3, 3.4e38f);
            a.poke(kPositions, 7, -3.4e38f);
          }),
      odd("positions_denormal", [](GltfAsset& a) { a.poke(kPositions, 3, 1e-42f); }),
      odd("triangles_of_no_area",
          [](GltfAsset& a) {
            for (std::size_t k = 0; k < 6; ++k) a.poke(kIndices, k, std::uint16_t{0});
          }),
      odd("quaternions_of_length_2", [](GltfAsset& a) { a.poke(kRotations, 3, 2.0f); }),
      odd("strided_animation",
          [](GltfAsset& a) {
            const std::vector<float> rows = {0, 9, 9, 0.5f, 9, 9, 1, 9, 9};
            const int view = a.add_view({reinterpret_cast<const std::uint8_t*>(rows.data()), 36}, {{"byteStride", 12}});
            a.document["accessors"][kTimes] = {
                {"bufferView", view}, {"componentType", 5126}, {"type", "SCALAR"}, {"count", 3}};
          }),
      {"draco_with_bytes_after",
       [](const fs::path& folder) {
         GltfAsset a = draco_asset(true);
         a.binary.resize(a.binary.size() + 40);
         a.document["buffers"][0]["byteLength"] = a.binary.size();
         a.document["bufferViews"][0]["byteLength"] = a.binary.size();
         return put(folder, "capture.glb", a.glb());
       }},
  };
}

void expect_loads(const std::vector<Harmless>& captures) {
  for (const Harmless& harmless : captures) {
    SCOPED_TRACE(harmless.name);
    const TemporaryFolder folder;
    const ProcessResult result = run_tessera({"inspect", harmless.make(folder.path()).string()}, {.seconds = 60});
    EXPECT_EQ(result.status, 0) << "signal " << result.signal << ": " << result.errors;
    EXPECT_EQ(result.errors, "");
  }
}

TEST(HarmlessCaptures, LoadWhenTheContainerIsOdd) { expect_loads(containers()); }
TEST(HarmlessCaptures, LoadWhenTheDocumentIsOdd) { expect_loads(documents()); }
TEST(HarmlessCaptures, LoadWhenTheContentsAreOdd) { expect_loads(contents()); }

}  // namespace
}  // namespace tessera::test::harmless_captures_test
