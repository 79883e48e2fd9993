// Variants of materials as users meet them: drawn, listed, packed, refused.
#include "base/exr_file.h"
#include "base/image_codec.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/tests.h"

namespace tessera::replay::variants_test {
namespace {

// A square that fills an orthographic image: unlit red by itself, green as "meadow", blue as "it's sea".
fs::path write_square(const fs::path& folder) {
  GltfSource s;
  const int points = s.positions({{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}});
  const int texcoords = s.accessor(std::vector<float>{0, 0, 1, 0, 0, 1, 1, 1}, kFloatType, "VEC2");
  const int indices = s.accessor(std::vector<std::uint16_t>{0, 1, 3, 0, 3, 2}, kUnsignedShortType, "SCALAR");
  json& d = s.document;
  for (const json& color : {json({0.5, 0, 0, 1}), json({0, 0.5, 0, 1}), json({0, 0, 0.5, 1})})
    d["materials"].push_back({{"pbrMetallicRoughness", {{"baseColorFactor", color}}},
                              {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  const json mappings = {{{"variants", {0}}, {"material", 1}, {"name", "grass"}},
                         {{"variants", {1}}, {"material", 2}, {"extras", {{"depth", 3}}}}};
  d["meshes"] = {{{"primitives",
                   {{{"attributes", {{"POSITION", points}, {"TEXCOORD_0", texcoords}}},
                     {"indices", indices},
                     {"material", 0},
                     {"extensions", {{"KHR_materials_variants", {{"mappings", mappings}}}}}}}}}};
  d["cameras"] = {
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 9}}}}};
  d["nodes"] = {{{"mesh", 0}}, {{"camera", 0}, {"translation", {0, 0, 2}}}};
  d["scenes"] = {{{"nodes", {0, 1}}}};
  d["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "meadow"}}, {{"name", "it's sea"}}};
  d["extensionsUsed"] = {"KHR_materials_unlit", "KHR_materials_variants"};
  return s.write(folder, "square");
}

Vec3 drawn_color(const fs::path& capture, const std::vector<std::string>& more, const fs::path& out) {
  std::vector<std::string> arguments = {"replay",  capture.string(), "--size", "16x16",
                                        "--quiet", "--no-report",    "--out",  out.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const ProcessResult r = run_tessera(arguments);
  EXPECT_EQ(r.status, 0) << r.errors;
  const Image image = read_exr(out / "frame_0000.exr");
  return {image.at(8, 8)[0], image.at(8, 8)[1], image.at(8, 8)[2]};
}

TEST(VariantOption, DrawsTheMaterialsOfTheVariant) {
  const TemporaryFolder folder;
  const fs::path square = write_square(folder.path());
  EXPECT_EQ(drawn_color(square, {}, folder / "plain"), Vec3(0.5f, 0, 0));
  EXPECT_EQ(drawn_color(square, {"--variant", "meadow"}, folder / "meadow"), Vec3(0, 0.5f, 0));
  EXPECT_EQ(drawn_color(square, {"--variant", "it's sea"}, folder / "sea"), Vec3(0, 0, 0.5f));
  const auto capture_of = [&](const char* out) {
    return json::parse(read_text(folder / out / "stats.json"))["capture"];
  };
  EXPECT_EQ(capture_of("sea")["variant"], "it's sea");
  EXPECT_FALSE(capture_of("plain").contains("variant"));
}

TEST(VariantOption, AnUnknownNameIsWrongUsageThatListsTheNames) {
  const TemporaryFolder folder;
  const std::string square = write_square(folder.path()).string(), out = (folder / "out").string();
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"replay", square}, {"tradeoff", square}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--variant", "Meadow", "--out", out});
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 2) << command[0];
    EXPECT_THAT(r.errors, HasSubstr("no variant 'Meadow' in ")) << command[0];
    EXPECT_THAT(r.errors, HasSubstr("which has 'meadow', 'it's sea'")) << command[0];
    EXPECT_FALSE(fs::exists(folder / "out" / "frame_0000.png"));
  }
  const ProcessResult none =
      run_tessera({"replay", shipped_capture("vases").string(), "--variant", "sea", "--out", out});
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.errors, HasSubstr("which has none"));
  test::write_text(folder / "study.json", json({{"captures", {square}}, {"size", "16x16"}, {"variant", "sea"}}).dump());
  const ProcessResult sweep = run_tessera({"sweep", (folder / "study.json").string(), "--out", out, "--quiet"});
  EXPECT_EQ(sweep.status, 2);
  EXPECT_THAT(sweep.errors, HasSubstr("no variant 'sea' in "));
}

TEST(VariantOption, InspectListsTheNames) {
  const TemporaryFolder folder;
  const std::string square = write_square(folder.path()).string();
  EXPECT_THAT(run_tessera({"inspect", square}).output, HasSubstr("variants    meadow, it's sea\n"));
  EXPECT_EQ(json::parse(run_tessera({"inspect", square, "--json"}).output)["variants"], json({"meadow", "it's sea"}));
  const std::string vases = shipped_capture("vases").string();
  EXPECT_THAT(run_tessera({"inspect", vases}).output, testing::Not(HasSubstr("variants")));
}

TEST(VariantOption, PackKeepsVariantsWordForWord) {
  const TemporaryFolder folder;
  const fs::path square = write_square(folder.path());
  const json before = json::parse(read_text(square));
  for (const PackMethod method : {PackMethod::kAuto, PackMethod::kMeshopt, PackMethod::kNone}) {
    PackOptions options;
    options.method = method;
    pack_capture(square, folder / "packed.glb", options);
    const json after = glb_parts(read_text(folder / "packed.glb")).document;
    const json::json_pointer mappings("/meshes/0/primitives/0/extensions/KHR_materials_variants"),
        names("/extensions/KHR_materials_variants");
    EXPECT_EQ(after[mappings], before[mappings]);
    EXPECT_EQ(after[names], before[names]);
    EXPECT_THAT(after["extensionsUsed"], testing::Contains("KHR_materials_variants"));
    EXPECT_EQ(drawn_color(folder / "packed.glb", {"--variant", "meadow"}, folder / "out"), Vec3(0, 0.5f, 0));
  }
}

TEST(VariantOption, PackDisplacesTheMaterialsOfAllVariants) {
  const TemporaryFolder folder;
  const fs::path square = write_square(folder.path());
  test::write_text(folder / "bumps.png", encode_png(Image8(4, 4, 1)));
  PackOptions options;
  options.surfaces.subdivide = 1;
  options.surfaces.displace = parse_displace((folder / "bumps.png").string() + ",0.1");
  const PackReport report = pack_capture(square, folder / "packed.glb", options);
  EXPECT_EQ(report.surfaces.displaced_materials, 3u);
  const json document = glb_parts(read_text(folder / "packed.glb")).document;
  for (const json& material : document["materials"])
    EXPECT_TRUE(material["extensions"].contains("TESSERA_displacement")) << material;
}

}  // namespace
}  // namespace tessera::replay::variants_test
