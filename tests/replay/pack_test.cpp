// tessera pack: properties that a packed capture keeps, changes with their sizes, and refusals.
#include "base/error.h"
#include "base/image_metrics.h"
#include "base/parallel.h"
#include "gpu/device.h"
#include "shaders_cpp/tone_map.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/environments.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/radiance_files.h"
#include "tests/support/tests.h"

namespace tessera::replay::pack_test {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

std::set<std::string> files_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

class EveryMethod : public testing::TestWithParam<PackMethod> {};

TEST_P(EveryMethod, EveryKindOfAttributeSurvivesWithinItsQuantisation) {  // LT1
  const Packed p(dressed_grid(), with(GetParam()));
  const scene::Capture before = p.before(), after = p.after();
  const scene::Vertices &a = vertices_of(before), &b = vertices_of(after);
  ASSERT_EQ(b.count(), a.count());
  ASSERT_EQ(b.texcoords.size(), 2u);
  ASSERT_EQ(b.tangents.size(), a.count());
  const std::vector<std::size_t> number = packed_numbers(b);
  const QuantizationBits bits;
  for (std::size_t v = 0; v < a.count(); ++v) {
    const std::size_t w = number[v];
    ASSERT_LT(w, b.count()) << "vertex " << v << " is gone";
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(b.positions[w][c], a.positions[v][c], half_step(kSide - 1, bits.position));
    // Octahedral normals of 10 bits: on |x|+|y|+|z| = 1, x and y are off by half a step of 2/1022 and z by as much as
    // both together, so the point by sqrt(6)/1022; it is at least 1/sqrt(3) from the origin.
    EXPECT_GT(glm::dot(b.normals[w], a.normals[v]) / glm::length(b.normals[w]), std::cos(std::sqrt(18.0) / 1022));
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(b.tangents[w][c], a.tangents[v][c], half_step(2, bits.generic));
    EXPECT_EQ(b.tangents[w].w, a.tangents[v].w);
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(b.texcoords[0][w][c], a.texcoords[0][v][c], half_step(4, bits.texcoord));
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(b.texcoords[1][w][c], a.texcoords[1][v][c], half_step(1, bits.texcoord));
    EXPECT_EQ(b.colors[w], a.colors[v]);
    EXPECT_EQ(b.influences[w].joints, a.influences[v].joints);
    // Renormalising after quantisation moves weights by as much again.
    for (std::size_t k = 0; k < 8; ++k)
      EXPECT_NEAR(b.influences[w].weights[k], a.influences[v].weights[k], 4 * half_step(1, bits.generic));
  }
  EXPECT_EQ(after.skins[0].inverse_bind, before.skins[0].inverse_bind);
  EXPECT_EQ(after.meshes[0].primitives[0].indices.size(), before.meshes[0].primitives[0].indices.size());
}

INSTANTIATE_TEST_SUITE_P(Pack, EveryMethod,
                         testing::Values(PackMethod::kAuto, PackMethod::kEdgebreaker, PackMethod::kSequential,
                                         PackMethod::kNone));

TEST(Pack, WithoutCompressionEveryValueIsBitExact) {
  const Packed p(dressed_grid(), with(PackMethod::kNone));
  const scene::Capture before = p.before(), after = p.after();
  EXPECT_EQ(vertices_of(after).positions, vertices_of(before).positions);
  EXPECT_EQ(vertices_of(after).tangents, vertices_of(before).tangents);
  EXPECT_EQ(after.meshes[0].primitives[0].indices, before.meshes[0].primitives[0].indices);
  EXPECT_FALSE(p.parts.document.contains("extensionsRequired"));
}

TEST(Pack, FewerBitsMoveVerticesFurtherSoTheBoundsAboveCanFail) {
  PackOptions coarse;
  coarse.bits.position = 4;  // steps of 1; the grid's vertices have multiples of a quarter
  const Packed p(dressed_grid(), coarse);
  const scene::Capture before = p.before(), after = p.after();
  const scene::Vertices &a = vertices_of(before), &b = vertices_of(after);
  const std::vector<std::size_t> number = packed_numbers(b);
  float error = 0;
  for (std::size_t v = 0; v < a.count(); ++v)
    error = std::max(error, std::abs(b.positions[number[v]].z - a.positions[v].z));
  EXPECT_GT(error, half_step(kSide - 1, QuantizationBits{}.position));
}

// ---- Bezier patches ---------------------------------------------------------------------------------------------

TEST(Pack, ControlPointsKeepTheirOrderAndSharedEdgesStayBitEqual) {
  const Packed p(bezier());
  const scene::Capture before = p.before(), after = p.after();
  ASSERT_EQ(after.meshes[0].primitives[0].kind, scene::Primitive::Kind::kBezierPatches);
  const std::vector<Vec3>&a = vertices_of(before).positions, &b = vertices_of(after).positions;
  ASSERT_EQ(b.size(), a.size());
  for (std::size_t v = 0; v < a.size(); ++v)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[v][c], a[v][c], half_step(6.0 / 7.0, QuantizationBits{}.position)) << v;
  // Patch 1 lies to the right of patch 0: column 3 of the one is column 0 of the other.
  for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(b[4 * j + 3], b[16 + 4 * j]);
}

TEST(Pack, OtherViewersSeeTheControlCageAsAnOrdinaryMesh) {
  GltfSource source = bezier();
  const Packed p(source);
  // As a viewer that does not know the extension reads it.
  json d = p.parts.document;
  d["meshes"][0]["primitives"][0]["extensions"].erase("TESSERA_bezier_patches");
  EXPECT_EQ(d["extensionsRequired"], json({kDraco}));
  std::string text = d.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string glb = p.bytes.substr(0, 12);
  const auto word = [](std::size_t value) {
    const auto v = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&v), 4);
  };
  glb += word(text.size()) + "JSON" + text + word(p.parts.binary.size()) + std::string("BIN\0", 4) + p.parts.binary;
  glb.replace(8, 4, word(glb.size()));
  write_text(p.folder / "viewer.glb", glb);
  first_primitive(source).erase("extensions");
  const scene::Capture cage = scene::read_capture(source.write(p.folder.path(), "cage")),
                       seen = scene::read_capture(p.folder / "viewer.glb");
  ASSERT_EQ(seen.meshes[0].primitives[0].kind, scene::Primitive::Kind::kTriangles);
  EXPECT_EQ(seen.meshes[0].primitives[0].indices, cage.meshes[0].primitives[0].indices);
  EXPECT_EQ(seen.meshes[0].primitives[0].indices.size(), 4u * 18 * 3);
}

TEST(Pack, RenumberingPrimitivesThatMustKeepTheirOrderIsRefused) {
  for (const GltfSource& source : {bezier(), animated_grid()}) {
    const TemporaryFolder folder;
    EXPECT_THROW(pack_capture(source.write(folder.path()), folder / "x.glb", with(PackMethod::kEdgebreaker)),
                 UsageError);
    EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"source.gltf", "source.bin"}));
  }
}

// ---- The rest of the document -----------------------------------------------------------------------------------

TEST(Pack, MorphTargetsAnimationsAndSkinsAreBitExact) {
  const Packed p(animated_grid());
  const scene::Capture before = p.before(), after = p.after();
  EXPECT_EQ(p.report.compressed, 1u);
  ASSERT_EQ(vertices_of(after).morph_targets.size(), 1u);
  EXPECT_EQ(vertices_of(after).morph_targets[0].positions, vertices_of(before).morph_targets[0].positions);
  EXPECT_EQ(after.meshes[0].default_weights, before.meshes[0].default_weights);
  ASSERT_EQ(after.animations[0].channels.size(), 2u);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(after.animations[0].channels[c].times, before.animations[0].channels[c].times);
    EXPECT_EQ(after.animations[0].channels[c].values, before.animations[0].channels[c].values);
    EXPECT_EQ(after.animations[0].channels[c].interpolation, before.animations[0].channels[c].interpolation);
  }
}

TEST(Pack, ObjectsThatHoldNoDataAreKeptWordForWord) {
  GltfSource source = animated_grid();
  const Packed p(source);
  for (const char* key : {"asset", "scene", "scenes", "nodes", "cameras", "materials", "extensions"})
    EXPECT_EQ(p.parts.document[key], source.document[key]) << key;
  EXPECT_EQ(p.parts.document["meshes"][0]["extras"], source.document["meshes"][0]["extras"]);
  EXPECT_EQ(p.parts.document["animations"][0]["channels"], source.document["animations"][0]["channels"]);
  EXPECT_EQ(p.parts.document["extensionsUsed"], json({"KHR_lights_punctual", "VENDOR_thing", kDraco}));
  EXPECT_EQ(p.parts.document["extensionsRequired"], json({kDraco}));
}

TEST(Pack, SettingsReplaceTheAssetsMemberByMember) {
  GltfSource source = animated_grid();
  source.document["extensions"]["TESSERA_capture"] = {{"frameRate", 24}, {"exposure", 2}};
  source.document["extensionsUsed"].push_back("TESSERA_capture");
  PackOptions options;
  options.capture_settings = {{"exposure", 0.5}, {"shutter", {0.0, 0.5}}};
  options.aperture_radius = 0.125;
  options.focus_distance = 3.0;
  const Packed p(source, options);
  EXPECT_EQ(p.parts.document["extensions"]["TESSERA_capture"],
            json({{"frameRate", 24}, {"exposure", 0.5}, {"shutter", {0.0, 0.5}}}));
  EXPECT_EQ(p.parts.document["cameras"][0]["extensions"]["TESSERA_lens"],
            json({{"apertureRadius", 0.125}, {"focusDistance", 3.0}}));
  const scene::Capture after = p.after();
  EXPECT_EQ(after.settings.frame_rate, 24.0);
  EXPECT_EQ(after.settings.exposure, 0.5f);
  EXPECT_EQ(after.cameras[0].lens.focus_distance, 3.0f);
}

TEST(Pack, ShadowsOfTheAssetStay) {
  GltfSource source = animated_grid();
  source.document["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "directional"}}};
  const json shadows = {{{"light", 0}, {"size", 512}, {"cascades", 3}, {"distance", 20}}};
  source.document["extensions"]["TESSERA_capture"] = {{"shadows", shadows}};
  source.document["extensionsUsed"].push_back("TESSERA_capture");
  PackOptions options;
  options.capture_settings = {{"exposure", 0.5}};
  const Packed p(source, options);
  EXPECT_EQ(p.parts.document["extensions"]["TESSERA_capture"], json({{"exposure", 0.5}, {"shadows", shadows}}));
  const scene::Capture after = p.after();
  ASSERT_EQ(after.settings.shadows.size(), 1u);
  EXPECT_EQ(after.settings.shadows[0].size, 512);
  EXPECT_EQ(after.settings.shadows[0].cascades, 3);
  EXPECT_EQ(after.settings.shadows[0].distance, 20.0);
}

TEST(Pack, PassesOfTheAssetStay) {
  GltfSource source = animated_grid();
  source.document["extensions"]["TESSERA_capture"] = test::deferred_passes();
  source.document["extensionsUsed"].push_back("TESSERA_capture");
  const Packed p(source);
  EXPECT_EQ(p.parts.document["extensions"]["TESSERA_capture"], test::deferred_passes());
  EXPECT_EQ(p.after().settings.graph.value().passes.size(), 3u);
}

TEST(Pack, AnEnvironmentsImageMovesInside) {
  const std::string sky = hdr_file(sky_image(8, [](const DVec3& d) { return DVec3(1.0 + d.y, 1.0, 2.0); }));
  const std::string uri = "data:;base64," + base64(bytes_of(sky));
  for (const json& form : {json(uri), json({{"image", uri}, {"rotation", 0.5}})})
    for (const bool darker : {false, true}) {
      GltfSource source = animated_grid();
      source.document["extensions"]["TESSERA_capture"] = {{"environment", form}};
      source.document["extensionsUsed"].push_back("TESSERA_capture");
      PackOptions options;
      if (darker) options.capture_settings = {{"environment", 0.25}};
      const Packed p(source, options);
      const json environment = p.parts.document["extensions"]["TESSERA_capture"]["environment"];
      ASSERT_TRUE(environment.contains("bufferView"));
      EXPECT_FALSE(environment.contains("image"));
      EXPECT_EQ(environment.value("rotation", 0.0), form.is_object() ? 0.5 : 0.0);
      const json view = p.parts.document["bufferViews"][environment["bufferView"].get<std::size_t>()];
      EXPECT_EQ(p.parts.binary.substr(view.value("byteOffset", std::size_t{0}), view["byteLength"]), sky);
      const scene::Capture after = p.after();
      EXPECT_NE(after.environment_image, nullptr);
      EXPECT_EQ(after.settings.environment, darker ? 0.25f : 1.0f) << "share of the image's own brightness";
      pack_capture(p.target, p.folder / "again.glb", {});
      EXPECT_EQ(read_text(p.folder / "again.glb"), p.bytes);
    }
}

TEST(Pack, SettingsThatNoCaptureMayHaveAreRefusedUnderTheTargetsName) {
  PackOptions options;
  options.capture_settings = {{"resolution", {0, 0}}};
  for (const PackMethod method : {PackMethod::kAuto, PackMethod::kNone}) {
    options.method = method;
    const TemporaryFolder folder;
    try {
      pack_capture(grid().write(folder.path()), folder / "x.glb", options);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), (folder / "x.glb").string());
      EXPECT_EQ(error.place(), "/extensions/TESSERA_capture/resolution/0");
    }
    EXPECT_FALSE(fs::exists(folder / "x.glb"));
  }
}

TEST(Pack, NothingIsRequiredThatNoPrimitiveUses) {
  GltfSource lines = grid();
  first_primitive(lines)["mode"] = 1;
  GltfSource two = grid();  // two indices: no triangle
  first_primitive(two)["indices"] = two.accessor(std::vector<std::uint16_t>{0, 1}, kUnsignedShortType, "SCALAR");
  for (const GltfSource& source : {lines, two}) {
    const Packed p(source);
    EXPECT_EQ(p.report.compressed, 0u);
    EXPECT_FALSE(p.parts.document.contains("extensionsUsed"));
    EXPECT_FALSE(p.parts.document.contains("extensionsRequired"));
  }
}

TEST(Pack, ApplicationSpecificAttributesStayExactAndInStep) {
  GltfSource source = grid();
  std::vector<float> ids;
  for (std::uint32_t v = 0; v < kSide * kSide; ++v) ids.push_back(static_cast<float>(v) * 1000.0f + 0.125f);
  first_primitive(source)["attributes"]["_FEATURE_ID"] = source.accessor(ids, kFloatType, "SCALAR");
  const Packed p(source);
  EXPECT_EQ(p.report.compressed, 1u);
  EXPECT_EQ(packed_numbers(vertices_of(p.after()))[17], 17u);
  const json& d = p.parts.document;
  const json& primitive = d["meshes"][0]["primitives"][0];
  EXPECT_FALSE(primitive["extensions"][kDraco]["attributes"].contains("_FEATURE_ID"));
  const json& view =
      d["bufferViews"]
       [d["accessors"][primitive["attributes"]["_FEATURE_ID"].get<std::size_t>()]["bufferView"].get<std::size_t>()];
  EXPECT_EQ(p.parts.binary.substr(view["byteOffset"], view["byteLength"]),
            std::string(reinterpret_cast<const char*>(ids.data()), ids.size() * 4));
}

TEST(Pack, PrimitivesThatDracoCannotHoldStay) {
  GltfSource flat = grid();  // every triangle has two equal corners
  first_primitive(flat)["indices"] =
      flat.accessor(std::vector<std::uint16_t>{0, 0, 1, 2, 3, 3, 4, 4, 4}, kUnsignedShortType, "SCALAR");
  GltfSource pool = animated_grid();  // one triangle of a model's shared vertices
  first_primitive(pool)["indices"] =
      pool.accessor(std::vector<std::uint16_t>{0, 1, kSide}, kUnsignedShortType, "SCALAR");
  for (const GltfSource& source : {flat, pool}) {
    const Packed p(source);
    EXPECT_EQ(p.report.compressed, 0u);
    EXPECT_EQ(vertices_of(p.after()).positions, vertices_of(p.before()).positions);
  }
  // Where the order is free, vertices that no triangle uses are dropped instead.
  GltfSource free = grid();
  first_primitive(free)["indices"] =
      free.accessor(std::vector<std::uint16_t>{0, 1, kSide}, kUnsignedShortType, "SCALAR");
  EXPECT_EQ(vertices_of(Packed(free).after()).count(), 3u);
}

TEST(Pack, ExtensionsThatNameDataInUnknownWaysAreRefused) {
  GltfSource source = animated_grid();
  source.document["nodes"][2]["extensions"]["VENDOR_thing"] = {{"parts", {{{"bufferView", 0}}}}};
  const TemporaryFolder folder;
  try {
    pack_capture(source.write(folder.path()), folder / "x.glb", {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "/nodes/2/extensions/VENDOR_thing/parts/0/bufferView");
  }
  // Instancing is known well enough to keep its accessors alive.
  GltfSource instances = grid();
  instances.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      instances.accessor(std::vector<float>{1, 2, 3, 4, 5, 6}, kFloatType, "VEC3");
  instances.document["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  const TemporaryFolder other;
  pack_capture(instances.write(other.path()), other / "x.glb", {});
  const json d = glb_parts(read_text(other / "x.glb")).document;
  EXPECT_EQ(d["accessors"][d["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"]
                               .get<std::size_t>()]["count"],
            2);
}

// ---- Data ---------------------------------------------------------------------------------------------------------

TEST(Pack, StridedAndSparseDataComesOutTightAndEqual) {
  GltfSource source = animated_grid(8);
  // A target of zeros but for two vertices.
  const int indices = source.view(std::string("\x03\x00\x00\x00\x10\x00\x00\x00", 8));
  const float values[6] = {1, 2, 3, 4, 5, 6};
  const int moved = source.view(std::string(reinterpret_cast<const char*>(values), sizeof values));
  source.document["accessors"].push_back({{"componentType", kFloatType},
                                          {"count", kSide * kSide},
                                          {"type", "VEC3"},
                                          {"min", {0, 0, 0}},
                                          {"max", {4, 5, 6}},
                                          {"sparse",
                                           {{"count", 2},
                                            {"indices", {{"bufferView", indices}, {"componentType", kUnsignedIntType}}},
                                            {"values", {{"bufferView", moved}}}}}});
  first_primitive(source)["targets"].push_back({{"POSITION", source.document["accessors"].size() - 1}});
  source.document["meshes"][0]["weights"] = {0.25, 0};
  source.document["animations"][0]["samplers"][0]["output"] =
      source.accessor(std::vector<float>{0, 0, 1, 1, 0, 1}, kFloatType, "SCALAR", {}, 8);
  for (const PackMethod method : {PackMethod::kAuto, PackMethod::kNone}) {
    const Packed p(source, with(method));  // checks the rules of strides and targets
    const scene::Capture before = p.before(), after = p.after();
    for (std::size_t t = 0; t < 2; ++t)
      EXPECT_EQ(vertices_of(after).morph_targets[t].positions, vertices_of(before).morph_targets[t].positions);
    for (std::size_t c = 0; c < 2; ++c)
      EXPECT_EQ(after.animations[0].channels[c].values, before.animations[0].channels[c].values);
    EXPECT_EQ(p.parts.binary.find("\x5A\x5A\x5A\x5A"), std::string::npos) << "gaps were copied";
  }
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

TEST(Pack, ExternalFilesDataUrisAndContainersGiveTheSameBytes) {
  const GltfSource source = animated_grid();
  const Packed external(source);
  const TemporaryFolder folder;
  json d = source.document;
  d["buffers"] = {
      {{"byteLength", source.bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(source.bytes)}}};
  write_text(folder / "data.gltf", d.dump());
  d["buffers"][0]["uri"] = "a%20b.bin";
  write_text(folder / "percent.gltf", d.dump());
  write_text(folder / "a b.bin", source.bytes + "more than byteLength");
  PackOptions none = with(PackMethod::kNone);
  pack_capture(folder / "data.gltf", folder / "container.glb", none);
  for (const char* name : {"data.gltf", "percent.gltf", "container.glb"}) {
    pack_capture(folder / name, folder / "out.glb", {});
    EXPECT_TRUE(read_text(folder / "out.glb") == external.bytes) << name;
  }
}

TEST(Pack, PackingIsDeterministicAndPackingAgainChangesNothing) {
  for (const GltfSource& source : {grid(), dressed_grid(), bezier(), animated_grid(), animated_grid(8)})
    for (const PackMethod method : {PackMethod::kAuto, PackMethod::kNone}) {
      const Packed once(source, with(method));
      {
        const ThreadLimit one(1);
        EXPECT_TRUE(Packed(source, with(method)).bytes == once.bytes);
      }
      pack_capture(once.target, once.folder / "again.glb", with(method));
      EXPECT_TRUE(read_text(once.folder / "again.glb") == once.bytes);
      pack_capture(once.target, once.target, with(method));  // onto itself
      EXPECT_TRUE(read_text(once.target) == once.bytes);
    }
}

Image first_image(const scene::Capture& capture) {
  gpu::Device renderer(capture, {}, {}, {160, 120, {0, 0, 160, 120}, false});
  const Image8 shown = shaders::to_display(renderer.render(0).targets.color, 1.0f);
  Image out(shown.width, shown.height, 3);
  for (std::size_t i = 0; i < out.values.size(); ++i)
    out.values[i] = static_cast<float>(shown.values[i / 3 * static_cast<std::size_t>(shown.channels) + i % 3]) / 255.0f;
  return out;
}

TEST(Pack, APackedCaptureReplaysToNearlyTheSameImage) {
  for (const PackMethod method : {PackMethod::kAuto, PackMethod::kMeshopt})
    for (const GltfSource& source : {bezier(), animated_grid(), dressed_grid()}) {
      PackOptions options = with(method);
      // Smooth shading shows the steps of normals of a byte.
      if (method == PackMethod::kMeshopt) options.bits = {14, 12, 12, 8, 8};
      const Packed p(source, options);
      EXPECT_GT(psnr(first_image(p.before()), first_image(p.after())), 45.0);
    }
}

TEST(Pack, AWrongClaimOfAnOrderOfClustersLeavesTheImage) {
  scene::Capture capture = Packed(dressed_grid()).after();
  const Image before = first_image(capture);
  capture.meshes[0].primitives[0].in_cluster_order = true;
  EXPECT_GT(psnr(before, first_image(capture)), 60.0);
}

// ---- Refusals and files -----------------------------------------------------------------------------------------

TEST(Pack, BrokenAssetsAreRefusedAndTheTargetIsUntouched) {
  std::vector<std::pair<const char*, GltfSource>> broken;
  const auto add = [&](const char* what) -> GltfSource& { return broken.emplace_back(what, animated_grid()).second; };
  add("short buffer");
  first_primitive(add("index beyond the vertices"))["indices"] =
      broken.back().second.accessor(std::vector<std::uint16_t>{0, 1, 9999}, kUnsignedShortType, "SCALAR");
  first_primitive(add("accessor that is not there"))["attributes"]["POSITION"] = 999;
  add("another version").document["asset"]["version"] = "1.0";
  add("an unknown extension").document["extensionsRequired"] = {"VENDOR_thing"};
  first_primitive(add("normals of another count"))["attributes"]["NORMAL"] =
      broken.back().second.accessor(std::vector<float>{0, 0, 1}, kFloatType, "VEC3");
  for (auto& [what, source] : broken) {
    const TemporaryFolder folder;
    const fs::path file = source.write(folder.path());
    if (std::string(what) == "short buffer") {
      json d = json::parse(read_text(file));
      d["buffers"][0]["byteLength"] = 2 * source.bytes.size();
      write_text(file, d.dump());
    }
    write_text(folder / "old.glb", "old");
    EXPECT_THROW(pack_capture(file, folder / "new" / "x.glb", {}), InputError) << what;
    EXPECT_THROW(pack_capture(file, folder / "old.glb", {}), InputError) << what;
    EXPECT_EQ(read_text(folder / "old.glb"), "old");
    EXPECT_EQ(files_in(folder.path()), (std::set<std::string>{"source.gltf", "source.bin", "old.glb"})) << what;
  }
}

TEST(Pack, ATruncatedContainerIsRefusedAtEveryLength) {
  const Packed p(animated_grid());
  for (std::size_t length = 0; length < p.bytes.size(); length += 37) {
    write_text(p.folder / "short.glb", p.bytes.substr(0, length));
    EXPECT_THROW(pack_capture(p.folder / "short.glb", p.folder / "out.glb", {}), InputError) << length;
  }
  EXPECT_FALSE(fs::exists(p.folder / "out.glb"));
}

TEST(Pack, ItMakesFoldersOverwritesFilesAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const fs::path source = grid().write(folder.path());
  pack_capture(source, folder / "a" / "b" / "x.glb", {});
  EXPECT_EQ(files_in(folder / "a" / "b"), std::set<std::string>{"x.glb"});
  const std::string first = read_text(folder / "a" / "b" / "x.glb");
  write_text(folder / "a" / "b" / "x.glb", "something else");
  pack_capture(source, folder / "a" / "b" / "x.glb", {});
  EXPECT_EQ(read_text(folder / "a" / "b" / "x.glb"), first);
  EXPECT_THROW(pack_capture(source, folder / "a" / "b", {}), SystemError);                // a folder
  EXPECT_THROW(pack_capture(source, folder / "source.gltf" / "x.glb", {}), SystemError);  // below a file
  EXPECT_EQ(files_in(folder / "a"), std::set<std::string>{"b"});
  EXPECT_EQ(files_in(folder / "a" / "b"), std::set<std::string>{"x.glb"});
}

TEST(ShippedCaptures, KeepTheRulesOfGltfWriters) {  // BIN1, BIN2, BIN3
  for (const char* name : {"eggs", "vases", "serpent", "flyby", "stroll"})
    EXPECT_THAT(glb_faults(read_text(shipped_capture(name))), IsEmpty()) << name;
}

// ---- The rules themselves -----------------------------------------------------------------------------------------

TEST(GlbRules, EachIsBrokenByAFileThatBreaksIt) {  // BIN1, BIN2, BIN3
  const Packed p(animated_grid());
  const auto expect_fault = [&](const char* fault, const std::function<void(json&)>& change) {
    GlbParts parts = p.parts;
    change(parts.document);
    EXPECT_THAT(glb_faults(parts), testing::Contains(HasSubstr(fault)));
  };
  const auto keys_view = [](const json& d) {
    return d["accessors"][d["animations"][0]["samplers"][0]["input"].get<std::size_t>()]["bufferView"]
        .get<std::size_t>();
  };
  const auto target_view = [](const json& d) {
    return d["accessors"][d["meshes"][0]["primitives"][0]["targets"][0]["POSITION"].get<std::size_t>()]["bufferView"]
        .get<std::size_t>();
  };
  expect_fault("has a byteStride", [&](json& d) { d["bufferViews"][keys_view(d)]["byteStride"] = 4; });
  expect_fault("has target 34963", [&](json& d) { d["bufferViews"][target_view(d)]["target"] = 34963; });
  expect_fault("kinds of users", [&](json& d) {
    d["accessors"][d["animations"][0]["samplers"][0]["input"].get<std::size_t>()]["bufferView"] = target_view(d);
  });
  expect_fault("starts at",
               [&](json& d) { d["bufferViews"][1]["byteOffset"] = d["bufferViews"][1]["byteOffset"].get<int>() + 1; });
  expect_fault("does not follow",
               [&](json& d) { d["bufferViews"][1]["byteOffset"] = d["bufferViews"][1]["byteOffset"].get<int>() + 4; });
  expect_fault("not in extensionsUsed", [](json& d) { d["extensionsUsed"] = {kDraco}; });
  expect_fault("is required but not used", [](json& d) { d["extensionsRequired"].push_back("KHR_mesh_quantization"); });
  expect_fault("is never read", [](json& d) { d["accessors"].push_back(d["accessors"][0]); });
  expect_fault("has no min and max", [](json& d) {
    d["accessors"][d["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()].erase("min");
  });
  expect_fault("times without min", [](json& d) {
    d["accessors"][d["animations"][0]["samplers"][0]["input"].get<std::size_t>()].erase("min");
  });
  expect_fault("of another count", [](json& d) {
    d["accessors"][d["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()]["count"] = 3;
  });
  expect_fault("the chunk has", [](json& d) { d["buffers"][0]["byteLength"] = 4; });
  EXPECT_THAT(glb_faults(p.bytes + "abcd"), testing::Contains(HasSubstr("length")));
}

}  // namespace
}  // namespace tessera::replay::pack_test
