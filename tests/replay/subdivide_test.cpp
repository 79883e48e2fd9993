// Control meshes from the file to the image: the extension in captures, and `tessera pack` that makes them.
#include "base/exr_file.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "replay/pack/quad_pairing.h"
#include "replay/pack/surfaces.h"
#include "scene/capture_reader.h"
#include "scene/subdivision/control_cage.h"
#include "tests/support/cages.h"
#include "tests/support/tests.h"

namespace tessera::replay::subdivide_test {
namespace {

using scene::Capture;
using scene::Primitive;

json one_node_document() {
  return {{"asset", {{"version", "2.0"}}},
          {"scene", 0},
          {"scenes", {{{"nodes", {0}}}}},
          {"nodes", {{{"mesh", 0}}}},
          {"meshes", {{{"primitives", {{{"attributes", json::object()}}}}}}}};
}

// Writes NAME.gltf and NAME.bin with one mesh of one primitive; `edit` may change the document first.
template <class Edit>
fs::path write_asset(const test::TemporaryFolder& folder, const std::string& name, const Primitive& primitive,
                     const Edit& edit) {
  EditedAsset asset(folder / (name + ".gltf"), one_node_document(), {}, false);
  json& out = asset.document["meshes"][0]["primitives"][0];
  asset.write_primitive(out, primitive, primitive.indices);
  edit(asset.document, out);
  asset.document["buffers"][0]["uri"] = name + ".bin";
  test::write_text(folder / (name + ".bin"), std::string(asset.binary().begin(), asset.binary().end()));
  test::write_text(folder / (name + ".gltf"), asset.document.dump());
  return folder / (name + ".gltf");
}

fs::path write_mesh(const test::TemporaryFolder& folder, const std::string& name, const Primitive& primitive) {
  return write_asset(folder, name, primitive, [](json&, json&) {});
}

json cage_extension(const test::Cage& cage) { return {{"levels", cage.rules.levels}, {"quads", cage.rules.quads}}; }

fs::path write_cage(const test::TemporaryFolder& folder, const test::Cage& cage, const json& more = json::object()) {
  return write_asset(folder, "cage", cage.primitive, [&](json& d, json& primitive) {
    d["extensionsUsed"] = {"TESSERA_subdivision"};
    json& extension = primitive["extensions"]["TESSERA_subdivision"] = cage_extension(cage);
    for (const auto& [key, value] : more.items()) extension[key] = value;
  });
}

const Primitive& only_primitive(const Capture& capture) { return capture.meshes.at(0).primitives.at(0); }

json json_of_glb(const fs::path& file) {
  const std::string bytes = test::read_text(file);
  const auto length =
      static_cast<std::size_t>(static_cast<unsigned char>(bytes[12]) | static_cast<unsigned char>(bytes[13]) << 8 |
                               static_cast<unsigned char>(bytes[14]) << 16);
  return json::parse(bytes.substr(20, length));
}

std::vector<std::string> pack(const fs::path& in, const fs::path& out, std::vector<std::string> more) {
  std::vector<std::string> arguments = {"pack", in.string(), out.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// ---- The extension ----------------------------------------------------------------------------------------------

TEST(Subdivision, AMarkedMeshLoadsAsThePatchesOfItsCage) {
  const test::TemporaryFolder folder;
  test::Cage cage = test::mixed_cage();
  cage.rules.levels = 2;
  test::add_crease(cage, {cage.faces[0][0], cage.faces[0][1]}, 1.5f);
  const json creases = {{{"vertices", cage.rules.creases[0].vertices}, {"sharpness", 1.5}}};
  const Capture capture = scene::read_capture(write_cage(folder, cage, {{"creases", creases}}));
  scene::MemoryBudget budget(1u << 30);
  const Primitive expected = convert(cage.primitive, cage.rules, budget, "test");
  EXPECT_EQ(only_primitive(capture).kind, Primitive::Kind::kBezierPatches);
  EXPECT_EQ(only_primitive(capture).vertices.positions, expected.vertices.positions);
  EXPECT_EQ(only_primitive(capture).vertices.texcoords, expected.vertices.texcoords);
}

TEST(Subdivision, BrokenExtensionsEndWithStatus3AndNameThePlace) {
  struct Broken {
    json more;
    const char* message;
  };
  const std::vector<Broken> cases = {
      {{{"scheme", "loop"}}, "/scheme: is \"loop\""},
      {{{"levels", 5}}, "/levels: is 5, outside [0, 4]"},
      {{{"levels", 1.5}}, "/levels: is not a whole number"},
      {{{"boundary", "round"}}, "/boundary: is \"round\""},
      {{{"quads", 7}}, "/quads: is 7, the primitive's 12 triangles make up to 6"},
      {{{"quads", -1}}, "/quads: is -1"},
      {{{"creases", {{{"vertices", {0}}}}}}, "/creases/0/vertices: has 1 elements, needs at least 2"},
      {{{"creases", {{{"vertices", {0, 24}}}}}}, "/creases/0/vertices/1: is vertex 24, there are 24"},
      {{{"creases", {{{"vertices", {0, 1}}, {"sharpness", 11}}}}}, "/creases/0/sharpness: is 11"},
      {{{"creases", {{{"vertices", {0, 2}}}}}}, "crease between the vertices 0 and 2, which no edge joins"},
      {{{"creases", {{{"sharpness", 1}}}}}, "lacks the property 'vertices'"},
      {{{"corners", {{{"vertices", {99}}}}}}, "/corners/0/vertices/0: is vertex 99"},
      {{{"corners", 3}}, "/corners: is not an array"},
  };
  const test::TemporaryFolder folder;
  for (const Broken& broken : cases) {
    const ProcessResult r = run_tessera({"inspect", write_cage(folder, test::cube_cage(), broken.more).string()});
    EXPECT_EQ(r.status, 3) << broken.more;
    EXPECT_THAT(r.errors, HasSubstr(broken.message)) << broken.more;
    EXPECT_THAT(r.errors, HasSubstr("/meshes/0/primitives/0/extensions/TESSERA_subdivision"));
  }
}

TEST(Subdivision, AQuadWhoseTrianglesDoNotFitIsRefused) {
  const test::TemporaryFolder folder;
  test::Cage cage = test::cube_cage();
  std::swap(cage.primitive.indices[4], cage.primitive.indices[5]);
  const ProcessResult r = run_tessera({"inspect", write_cage(folder, cage).string()});
  EXPECT_EQ(r.status, 3);
  EXPECT_THAT(r.errors, HasSubstr("quad 0 is no pair (a, b, c), (a, c, d)"));
}

TEST(Subdivision, LevelsBeyondTheMemoryLimitEndWithStatus4) {
  const test::TemporaryFolder folder;
  test::Cage cage = test::grid_cage(60, 60, 0.2f, 1);
  cage.rules.levels = 4;
  const ProcessResult r = run_tessera({"replay", write_cage(folder, cage).string(), "--size", "16x16", "--max-memory",
                                       "1", "--out", (folder / "x").string()});
  EXPECT_EQ(r.status, 4) << r.errors;
}

// ---- Pairing ----------------------------------------------------------------------------------------------------

TEST(QuadPairing, RestoresTheQuadsOfATriangulatedGridWhereverTheDiagonalsRan) {
  test::Random random(2);
  const int n = 12;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      positions.emplace_back(static_cast<float>(x), 0.8f * static_cast<float>(y), random.uniform(0, 0.1f));
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 2, d = a + n + 1;
      if (random.coin())
        indices.insert(indices.end(), {a, b, c, a, c, d});
      else
        indices.insert(indices.end(), {b, c, d, b, d, a});
    }
  const QuadDominantMesh out = pair_into_quads(test::triangles(positions, indices));
  EXPECT_EQ(out.quads, 144u);
  EXPECT_EQ(out.triangles, 0u);
  for (std::size_t q = 0; q < out.quads; ++q) {
    const std::uint32_t* t = &out.indices[6 * q];
    EXPECT_TRUE(t[0] == t[3] && t[2] == t[4]);
    // A cell of the grid: its corners differ by one column and one row.
    EXPECT_EQ(std::max({t[0], t[1], t[2], t[5]}) - std::min({t[0], t[1], t[2], t[5]}), n + 2u);
  }
}

TEST(QuadPairing, SeamsAndFoldsKeepTrianglesApart) {
  Primitive mesh =
      test::triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {0, 1, 2, 3, 4, 5});
  EXPECT_EQ(pair_into_quads(mesh).quads, 1u);  // vertices of their own, but alike
  mesh.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0.5f, 0}, {1, 1}, {0, 1}}};
  EXPECT_EQ(pair_into_quads(mesh).quads, 0u);
  mesh.vertices.texcoords.clear();
  mesh.vertices.positions[5] = {0.5f, 0.5f, 0.7f};
  EXPECT_EQ(pair_into_quads(mesh).quads, 0u);
  EXPECT_EQ(edges_sharper_than(mesh, 0, 60.0).size(), 1u);
  EXPECT_EQ(edges_sharper_than(mesh, 0, 120.0).size(), 0u);
}

// ---- tessera pack -----------------------------------------------------------------------------------------------

TEST(PackCommand, SubdivideMarksMeshesAndConvertWritesTheSamePatches) {
  const test::TemporaryFolder folder;
  const fs::path mesh = write_mesh(folder, "mesh", test::bracket_cage().primitive);
  const ProcessResult marked = run_tessera(pack(mesh, folder / "marked.glb", {"--method", "none", "--subdivide", "2"}));
  EXPECT_EQ(marked.status, 0) << marked.errors;
  EXPECT_THAT(marked.output, HasSubstr("1 cages of 14 quads and 0 triangles"));
  const ProcessResult converted =
      run_tessera(pack(mesh, folder / "converted.glb", {"--method", "none", "--subdivide", "2", "--convert"}));
  EXPECT_EQ(converted.status, 0) << converted.errors;
  EXPECT_THAT(converted.output, HasSubstr("224 Bezier patches"));
  const Capture a = scene::read_capture(folder / "marked.glb"), b = scene::read_capture(folder / "converted.glb");
  EXPECT_EQ(only_primitive(a).vertices.positions, only_primitive(b).vertices.positions);
  EXPECT_EQ(only_primitive(a).vertices.texcoords, only_primitive(b).vertices.texcoords);
  EXPECT_EQ(json_of_glb(folder / "marked.glb")["meshes"][0]["primitives"][0]["extensions"]["TESSERA_subdivision"],
            json({{"scheme", "catmullClark"}, {"levels", 2}, {"quads", 14}}));
  const json d = json_of_glb(folder / "converted.glb");
  EXPECT_EQ(d["extensionsUsed"], json({"TESSERA_bezier_patches"}));
  EXPECT_EQ(d["meshes"][0]["primitives"][0]["extensions"], json({{"TESSERA_bezier_patches", {{"count", 224}}}}));
  // A cage that is there already can be converted later.
  EXPECT_EQ(run_tessera(pack(folder / "marked.glb", folder / "later.glb", {"--method", "none", "--convert"})).status,
            0);
  EXPECT_EQ(only_primitive(scene::read_capture(folder / "later.glb")).vertices.positions,
            only_primitive(a).vertices.positions);
}

TEST(PackCommand, CagesKeepTheirOrderInDraco) {
  const test::TemporaryFolder folder;
  const fs::path mesh = write_mesh(folder, "mesh", test::bracket_cage().primitive);
  EXPECT_EQ(run_tessera(pack(mesh, folder / "draco.glb", {"--subdivide"})).status, 0);
  EXPECT_EQ(only_primitive(scene::read_capture(folder / "draco.glb")).vertices.count(), 16u * 56u);
  const ProcessResult r = run_tessera(pack(mesh, folder / "x.glb", {"--subdivide", "--method", "edgebreaker"}));
  EXPECT_EQ(r.status, 2);
  EXPECT_FALSE(fs::exists(folder / "x.glb"));
}

TEST(PackCommand, MorphTargetsAndSkinsSurviveConversion) {
  const test::TemporaryFolder folder;
  Primitive mesh = test::bracket_cage().primitive;
  scene::MorphTarget target;
  for (const Vec3& p : mesh.vertices.positions) target.positions.push_back({p.y, 0, 0});
  mesh.vertices.morph_targets = {target};
  scene::SkinInfluence influence;
  influence.joints = {0, 1, 0, 1, 0, 0, 0, 0};
  influence.weights = {0.5f, 0.5f};
  mesh.vertices.influences.assign(mesh.vertices.count(), influence);
  const fs::path file = write_asset(folder, "mesh", mesh, [](json& d, json&) {
    d["nodes"] = {{{"mesh", 0}, {"skin", 0}}, json::object(), json::object()};
    d["scenes"][0]["nodes"] = {0, 1, 2};
    d["skins"] = {{{"joints", {1, 2}}}};
  });
  const ProcessResult r = run_tessera(pack(file, folder / "out.glb", {"--subdivide", "--convert", "--method", "none"}));
  ASSERT_EQ(r.status, 0) << r.errors;
  const Capture capture = scene::read_capture(folder / "out.glb");
  const scene::Vertices& v = only_primitive(capture).vertices;
  ASSERT_EQ(v.morph_targets.size(), 1u);
  for (std::size_t i = 0; i < v.count(); ++i) {
    EXPECT_NEAR(v.morph_targets[0].positions[i].x, v.positions[i].y, 1e-6f);  // the shear is linear
    EXPECT_EQ(v.influences[i].weights[0], 0.5f);
  }
}

TEST(PackCommand, CreasesKeepACubeACube) {
  const test::TemporaryFolder folder;
  const fs::path mesh = write_mesh(folder, "mesh", test::cube_cage().primitive);
  ASSERT_EQ(run_tessera(pack(mesh, folder / "out.glb", {"--subdivide", "--crease", "60", "--method", "none"})).status,
            0);
  const Capture capture = scene::read_capture(folder / "out.glb");
  for (const Vec3& p : only_primitive(capture).vertices.positions) {
    float nearest = 1;
    for (int axis = 0; axis < 3; ++axis) nearest = std::min({nearest, std::abs(p[axis]), std::abs(p[axis] - 1)});
    EXPECT_LT(nearest, 1e-6f);
  }
}

// An image of bumps.
std::string bumps() {
  Image8 image;
  image.width = image.height = 32;
  image.channels = 1;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) image.values.push_back(static_cast<std::uint8_t>((x / 8 + y / 8) % 2 * 255));
  return encode_png(image);
}

TEST(PackCommand, DisplaceEmbedsAnImageAndChangesTheImage) {
  const test::TemporaryFolder folder;
  const fs::path mesh = write_mesh(folder, "mesh", test::bracket_cage().primitive);
  test::write_text(folder / "bumps.png", bumps());
  ASSERT_EQ(run_tessera(pack(mesh, folder / "flat.glb", {"--subdivide"})).status, 0);
  const ProcessResult r = run_tessera(
      pack(mesh, folder / "bumpy.glb", {"--subdivide", "--displace", (folder / "bumps.png").string() + ",0.08,-0.02"}));
  ASSERT_EQ(r.status, 0) << r.errors;
  const json d = json_of_glb(folder / "bumpy.glb");
  EXPECT_EQ(d["materials"][0]["extensions"]["TESSERA_displacement"],
            json({{"texture", {{"index", 0}}}, {"scale", 0.08}, {"bias", -0.02}}));
  for (const char* name : {"flat", "bumpy"})
    ASSERT_EQ(run_tessera({"replay", (folder / (std::string(name) + ".glb")).string(), "--size", "96x96", "--quiet",
                           "--out", (folder / name).string()})
                  .status,
              0);
  EXPECT_NE(read_exr(folder / "flat" / "frame_0000.exr").values, read_exr(folder / "bumpy" / "frame_0000.exr").values);
}

TEST(PackCommand, DisplaceTakesAMaterialsOwnTextureWithItsTransform) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "bumps.png", bumps());
  const json transform = {{"KHR_texture_transform", {{"scale", {2, 2}}}}};
  const fs::path mesh = write_asset(folder, "mesh", test::bracket_cage().primitive, [&](json& d, json& primitive) {
    d["images"] = {{{"uri", "bumps.png"}}};
    d["textures"] = {{{"source", 0}}};
    d["materials"] = {{{"occlusionTexture", {{"index", 0}, {"texCoord", 1}, {"extensions", transform}}}}};
    primitive["material"] = 0;
  });
  ASSERT_EQ(run_tessera(pack(mesh, folder / "own.glb", {"--subdivide", "--displace", "occlusion"})).status, 0);
  const json displacement = json_of_glb(folder / "own.glb")["materials"][0]["extensions"]["TESSERA_displacement"];
  EXPECT_EQ(displacement["texture"], json({{"index", 0}, {"texCoord", 1}, {"extensions", transform}}));
  EXPECT_NEAR(displacement["scale"].get<double>(), 0.02 * 2.2, 0.01);  // the bracket is about 2.2 units long
  EXPECT_EQ(run_tessera(pack(mesh, folder / "number.glb", {"--subdivide", "--displace", "0,0.1"})).status, 0);
}

TEST(PackCommand, WrongSurfaceOptionsEndWithOneClearMessage) {
  const test::TemporaryFolder folder;
  const fs::path mesh = write_mesh(folder, "mesh", test::bracket_cage().primitive);
  Primitive bare = test::bracket_cage().primitive;
  bare.vertices.texcoords.clear();
  const fs::path plain = write_mesh(folder, "bare", bare);
  test::write_text(folder / "bumps.png", bumps());
  struct Wrong {
    fs::path in;
    std::vector<std::string> arguments;
    int status;
    const char* message;
  };
  const std::vector<Wrong> calls = {
      {mesh, {"--subdivide", "5"}, 2, "expected 0 to 4 levels"},
      {mesh, {"--subdivide", "many"}, 2, "expected 0 to 4 levels"},
      {mesh, {"--convert"}, 2, "has no TESSERA_subdivision cage"},
      {mesh, {"--crease", "30"}, 2, "--crease needs --subdivide"},
      {mesh, {"--displace", "occlusion"}, 2, "neither cages nor Bezier patches"},
      {mesh, {"--subdivide", "--displace", "occlusion"}, 2, "material 0 has no such texture"},
      {mesh, {"--subdivide", "--displace", "7"}, 2, "the asset has 0 textures"},
      {mesh, {"--subdivide", "--displace", (folder / "bumps.png").string() + ",big"}, 2, "HEIGHTS[,SCALE[,BIAS]]"},
      {mesh, {"--subdivide", "--displace", (folder / "none.png").string()}, 3, "none.png"},
      {mesh, {"--subdivide", "--displace", mesh.string()}, 3, "mesh.gltf"},
      {plain, {"--subdivide", "--displace", (folder / "bumps.png").string()}, 2, "lacks TEXCOORD_0"},
  };
  for (const Wrong& call : calls) {
    const ProcessResult r = run_tessera(pack(call.in, folder / "x.glb", call.arguments));
    EXPECT_EQ(r.status, call.status) << call.message << ": " << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(call.message));
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
    EXPECT_FALSE(fs::exists(folder / "x.glb"));
  }
}

TEST(PackCommand, HelpTeachesSurfaces) {
  const std::string help = run_tessera({"pack", "--help"}).output;
  for (const char* option : {"--subdivide", "--crease", "--convert", "--displace", "HEIGHTS[,SCALE[,BIAS]]", "0 to 4"})
    EXPECT_THAT(help, HasSubstr(option));
}

// ---- Real models ------------------------------------------------------------------------------------------------

TEST(SampleModels, SubdividedModelsFillAboutTheSamePartOfTheImage) {
  const auto assets = test::assets_folder();
  if (!assets) GTEST_SKIP() << "no folder of sample models: set TESSERA_ASSETS";
  const test::TemporaryFolder folder;
  for (const char* model : {"Fox", "Avocado", "CesiumMilkTruck"}) {
    const fs::path source = *assets / model / "glTF" / (std::string(model) + ".gltf"),
                   packed = folder / (std::string(model) + ".glb");
    const ProcessResult r = run_tessera(pack(source, packed, {"--subdivide", "--crease", "40"}));
    ASSERT_EQ(r.status, 0) << r.errors;
    const auto covered = [&](const fs::path& file, const char* out) {
      EXPECT_EQ(run_tessera({"replay", file.string(), "--size", "160x120", "--quiet", "--out", (folder / out).string()})
                    .status,
                0);
      const Image frame_image = read_exr(folder / out / "frame_0000.exr");
      double sum = 0;
      for (std::size_t i = 3; i < frame_image.values.size(); i += 4) sum += static_cast<double>(frame_image.values[i]);
      return sum;
    };
    EXPECT_NEAR(covered(packed, "packed") / covered(source, "source"), 1.0, 0.15) << model;
  }
}

}  // namespace
}  // namespace tessera::replay::subdivide_test
