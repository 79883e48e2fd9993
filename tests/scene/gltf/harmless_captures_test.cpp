#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::test::harmless_captures_test {
namespace {

// A capture that is odd, or that breaks a rule without any effect on the image: it must load.
struct Harmless {
  std::string name;
  std::function<fs::path(const fs::path& folder)> make;
};

fs::path put(const fs::path& folder, const std::string& name, const std::string& contents) {
  write_text(folder / name, contents);
  return folder / name;
}

Harmless odd(std::string name, std::function<void(GltfAsset&)> change) {
  return {std::move(name), [change = std::move(change)](const fs::path& folder) {
            GltfAsset asset = everything_asset();
            change(asset);
            return put(folder, "capture.glb", asset.glb());
          }};
}

Harmless edited(std::string name, const char* pointer, json value) {
  return odd(std::move(name), [=](GltfAsset& a) { a.document[json::json_pointer(pointer)] = value; });
}

Harmless file_of(std::string name, std::function<std::string()> contents) {
  return {name, [=](const fs::path& folder) { return put(folder, name, contents()); }};
}

Harmless odd_draco(std::string name, bool sequential, std::function<void(GltfAsset&)> change) {
  return {std::move(name), [=](const fs::path& folder) {
            GltfAsset asset = draco_asset(sequential);
            change(asset);
            return put(folder, "capture.glb", asset.glb());
          }};
}

std::vector<Harmless> containers() {
  const auto glb = [] { return everything_asset().glb(); };
  const auto chunk_after = [=](const std::string& chunk) {
    std::string bytes = glb() + chunk;
    return bytes.replace(8, 4, little_endian32(static_cast<std::uint32_t>(bytes.size())));
  };
  return {
      file_of("bytes_after_the_stated_length.glb", [=] { return glb() + "and more"; }),
      file_of("chunk_of_unknown_type.glb", [=] { return chunk_after(glb_chunk("ABCD", "whatever")); }),
      file_of("empty_chunk_of_unknown_type.glb", [=] { return chunk_after(glb_chunk("ABCD", "")); }),
      file_of("binary_chunk_longer_than_buffer.glb",
              [] {
                GltfAsset a = everything_asset();
                a.binary.resize(a.binary.size() + 3000);
                return a.glb();
              }),
      file_of("spaces_after_json.glb",
              [] {
                const GltfAsset a = everything_asset();
                return make_glb(a.document.dump() + std::string(100, ' '), a.binary);
              }),
      file_of("glb_named.gltf", glb),
      file_of("gltf_named.glb", [] { return everything_asset().gltf(); }),
      // RFC 8259 section 8.1: a parser may ignore it.
      file_of("byte_order_mark.gltf", [] { return "\xEF\xBB\xBF" + everything_asset().gltf(); }),
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
  return {
      edited("version_2_9", "/asset/version", "2.9"),
      edited("extension_used_unknown", "/extensionsUsed", {"MADE_up", "KHR_lights_punctual"}),
      edited("extension_required_but_known", "/extensionsRequired", {"KHR_lights_punctual", "TESSERA_lens"}),
      edited("extension_object_unknown", "/nodes/0/extensions", {{"MADE_up", {{"mesh", 999}}}}),
      edited("extras_that_look_broken", "/nodes/0/extras", {{"mesh", -7}, {"matrix", "x"}, {"extensions", 5}}),
      edited("extras_a_number", "/extras", 7),
      edited("property_unknown", "/nodes/0/colour", "red"),
      edited("children_empty", "/nodes/3/children", json::array()),
      edited("skins_empty", "/textures", {{{"source", 0}, {"sampler", 0}}}),
      edited("scene_empty", "/scenes/0/nodes", json::array()),
      edited("whole_number_with_fraction_zero", "/accessors/0/count", 4.0),
      edited("image_type_disagrees", "/images/0/mimeType", "image/jpeg"),
      edited("image_type_unknown", "/images/0/mimeType", "image/webp"),
      odd("unused_image_broken",
          [](GltfAsset& a) {
            a.add("images", {{"uri", "none.png"}});
          }),
      odd("unused_texture_without_source",
          [](GltfAsset& a) {
            a.add("textures", {{"extensions", {{"MSFT_texture_dds", {{"source", 3}}}}}});
          }),
      odd("no_scene",
          [](GltfAsset& a) {
            a.document.erase("scene");
            a.document.erase("scenes");
          }),
      odd("asset_alone",
          [](GltfAsset& a) {
            a.document = {{"asset", {{"version", "2.0"}}}};
          }),
      odd("matrix_as_good_as_affine", [](GltfAsset& a) { a.poke(kInverseBind, 15, 1.000001f); }),
      odd("nodes_in_a_chain_of_100000",
          [](GltfAsset& a) {
            for (int i = 0; i < 100000; ++i) a.add("nodes", {{"children", {9 + i}}});
            a.add("nodes", json::object());
            a.document["scenes"][0]["nodes"].push_back(8);
          }),
      odd("names_of_controls", [](GltfAsset& a) { a.document["meshes"][0]["name"] = "a\nb\x1b[31m"; }),
      odd("mesh_without_position",
          [](GltfAsset& a) {
            a.document["meshes"][0]["primitives"][0]["attributes"].erase("POSITION"),
                a.document["meshes"][0]["primitives"][0].erase("targets"), a.document["meshes"][0].erase("weights"),
                a.document["nodes"][1].erase("weights"), a.document["animations"][0]["channels"].erase(3);
          }),
      odd("lines_and_points",
          [](GltfAsset& a) {
            json lines = a.document["meshes"][0]["primitives"][0];
            for (lines["mode"] = 0; lines["mode"] < 4; lines["mode"] = lines["mode"].get<int>() + 1)
              a.document["meshes"][0]["primitives"].push_back(lines);
          }),
      odd("positions_without_view", [](GltfAsset& a) { a.document["accessors"][kPositions].erase("bufferView"); }),
      odd("pointer_at_what_is_not_read",
          [](GltfAsset& a) {
            a.document["animations"][0]["channels"][0]["target"] = {
                {"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", "/made/up"}}}}}};
          }),
      edited("hidden_node", "/nodes/1/extensions", {{"KHR_node_visibility", {{"visible", false}}}}),
      odd("channel_without_node",
          [](GltfAsset& a) { a.document["animations"][0]["channels"][0]["target"].erase("node"); }),
      odd("animation_without_view", [](GltfAsset& a) { a.document["accessors"][kTranslations].erase("bufferView"); }),
  };
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
      odd("indices_not_a_multiple_of_3", [](GltfAsset& a) { a.document["accessors"][kIndices]["count"] = 5; }),
      odd("quaternions_of_length_2", [](GltfAsset& a) { a.poke(kRotations, 3, 2.0f); }),
      odd("strided_animation",
          [](GltfAsset& a) {
            const std::vector<float> rows = {0, 9, 9, 0.5f, 9, 9, 1, 9, 9};
            const int view = a.add_view({reinterpret_cast<const std::uint8_t*>(rows.data()), 36}, {{"byteStride", 12}});
            a.document["accessors"][kTimes] = {
                {"bufferView", view}, {"componentType", 5126}, {"type", "SCALAR"}, {"count", 3}};
          }),
      odd_draco("draco_decodes_to_fewer_points_than_declared", true,
                [](GltfAsset& a) {
                  for (const std::size_t k : {0u, 1u}) a.document["accessors"][k]["count"] = 6;
                }),
      odd_draco("draco_decodes_to_more_points_than_declared", true,
                [](GltfAsset& a) {
                  for (const std::size_t k : {0u, 1u}) a.document["accessors"][k]["count"] = 3;
                }),
      odd_draco("draco_of_fewer_triangles_than_declared", false,
                [](GltfAsset& a) { a.document["accessors"][2]["count"] = 9; }),
      odd_draco("draco_not_required", false, [](GltfAsset& a) { a.document.erase("extensionsRequired"); }),
      odd_draco("draco_says_strip", true,
                [](GltfAsset& a) {
                  a.document["meshes"][0]["primitives"][0]["mode"] = 5;
                  a.document["accessors"][2]["count"] = 4;
                }),
      odd_draco("draco_with_bytes_after", true,
                [](GltfAsset& a) {
                  a.binary.resize(a.binary.size() + 40);
                  a.document["buffers"][0]["byteLength"] = a.binary.size();
                  a.document["bufferViews"][0]["byteLength"] = a.binary.size();
                }),
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
