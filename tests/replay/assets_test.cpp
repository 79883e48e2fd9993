// Sample models of others: each is inspected, replayed, packed and replayed again through the program.
#include <cctype>

#include "base/exr_file.h"
#include "tests/replay/glb_rules.h"
#include "tests/support/tests.h"

namespace tessera::replay::assets_test {
namespace {

struct Model {
  const char* path;       // below the folder of sample models
  std::size_t triangles;  // as the asset's own index accessors say
  bool compressed;        // holds Draco streams already
};
void PrintTo(const Model& model, std::ostream* stream) { *stream << model.path; }

// Fixed, so that the list of tests does not depend on the folder; TheListIsComplete compares the two.
constexpr Model kModels[] = {
    {"AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb", 61, false},
    {"AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb", 12, false},
    {"AnimatedMorphCube/glTF/AnimatedMorphCube.gltf", 12, false},
    {"Avocado/glTF-Draco/Avocado.gltf", 682, true},
    {"Avocado/glTF/Avocado.gltf", 682, false},
    {"CesiumMilkTruck/glTF-Draco/CesiumMilkTruck.gltf", 2856, true},
    {"CesiumMilkTruck/glTF/CesiumMilkTruck.gltf", 2856, false},
    {"FlightHelmet/glTF/FlightHelmet.gltf", 94722, false},
    {"Fox/glTF-Binary/Fox.glb", 576, false},
    {"Fox/glTF-Draco/Fox.gltf", 576, true},
    {"Fox/glTF/Fox.gltf", 576, false},
    {"Helicopter/glTF-Draco/Helicopter.gltf", 219187, true},
    {"InterpolationTest/glTF/InterpolationTest.gltf", 110, false},
};

std::string test_name(const Model& model) {
  std::string name = fs::path(model.path).parent_path().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
}

#define SKIP_WITHOUT_MODELS(assets)          \
  const auto assets = test::assets_folder(); \
  if (!assets) GTEST_SKIP() << "no folder of sample models: set TESSERA_ASSETS"

void replay(const fs::path& capture, const fs::path& out) {
  const ProcessResult r =
      run_tessera({"replay", capture.string(), "--size", "160x90", "--spp", "2", "--quiet", "--out", out.string()});
  ASSERT_EQ(r.status, 0) << r.errors;
}

// In dB; 99 for images that are equal.
double psnr_of(const fs::path& a, const fs::path& b) {
  const json report = json::parse(run_tessera({"compare", a.string(), b.string(), "--json"}).output);
  const json& psnr = report["frames"][0]["psnr_db"];
  return psnr.is_null() ? 99.0 : psnr.get<double>();
}

// Share of the image that something covers, and the mean light of that part.
struct Content {
  double coverage = 0, light = 0;
};
Content content_of(const fs::path& exr) {
  const Image image = read_exr(exr);
  double covered = 0, light = 0;
  for (std::size_t i = 0; i < image.values.size(); i += 4) {
    const auto alpha = static_cast<double>(image.values[i + 3]);
    covered += alpha;
    light += static_cast<double>(image.values[i] + image.values[i + 1] + image.values[i + 2]) / 3 * alpha;
  }
  return {covered / (image.width * image.height), covered > 0 ? light / covered : 0.0};
}

class SampleModel : public testing::TestWithParam<Model> {};

TEST_P(SampleModel, InspectsReplaysPacksAndReplaysToNearlyTheSameImage) {
  SKIP_WITHOUT_MODELS(assets);
  const fs::path file = *assets / GetParam().path;
  if (!fs::exists(file)) GTEST_SKIP() << "the folder of sample models has no " << GetParam().path;
  const test::TemporaryFolder out;

  const ProcessResult inspected = run_tessera({"inspect", file.string(), "--json"});
  ASSERT_EQ(inspected.status, 0) << inspected.errors;
  const json report = json::parse(inspected.output);
  std::size_t triangles = 0;
  for (const json& mesh : report["meshes"]) triangles += mesh["triangles"].get<std::size_t>();
  EXPECT_EQ(triangles, GetParam().triangles);

  replay(file, out / "before");
  const Content content = content_of(out / "before" / "frame_0000.exr");
  // Automatic framing and the assets' own cameras show the whole model, with room around it.
  EXPECT_GT(content.coverage, 0.03);
  EXPECT_LT(content.coverage, 0.95);
  EXPECT_GT(content.light, 0.02);

  const fs::path packed = out / "packed.glb";
  const ProcessResult pack = run_tessera({"pack", file.string(), packed.string()});
  ASSERT_EQ(pack.status, 0) << pack.errors;
  EXPECT_THAT(test::glb_faults(test::read_text(packed)), testing::IsEmpty());
  replay(packed, out / "after");
  const double psnr = psnr_of(out / "before", out / "after");
  // Streams that are there already are copied, so nothing may change.
  EXPECT_GE(psnr, GetParam().compressed ? 99.0 : 40.0);
}

INSTANTIATE_TEST_SUITE_P(Khronos, SampleModel, testing::ValuesIn(kModels),
                         [](const auto& test) { return test_name(test.param); });

struct Twins {
  const char* name;
  const char* plain;
  const char* other;
  double psnr_db;
};
void PrintTo(const Twins& twins, std::ostream* stream) { *stream << twins.name; }

// Draco with 14 bits for positions and 8 for normals, or another container of the same data. (The truck's variants
// stand in different directions.)
constexpr Twins kTwins[] = {
    {"AvocadoDraco", "Avocado/glTF/Avocado.gltf", "Avocado/glTF-Draco/Avocado.gltf", 30.0},
    {"FoxDraco", "Fox/glTF/Fox.gltf", "Fox/glTF-Draco/Fox.gltf", 30.0},
    {"FoxBinary", "Fox/glTF/Fox.gltf", "Fox/glTF-Binary/Fox.glb", 99.0},
    {"AnimatedMorphCubeBinary", "AnimatedMorphCube/glTF/AnimatedMorphCube.gltf",
     "AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb", 99.0},
};

class SampleModelTwins : public testing::TestWithParam<Twins> {};

TEST_P(SampleModelTwins, LookAlike) {
  SKIP_WITHOUT_MODELS(assets);
  const test::TemporaryFolder out;
  replay(*assets / GetParam().plain, out / "a");
  replay(*assets / GetParam().other, out / "b");
  EXPECT_GE(psnr_of(out / "a", out / "b"), GetParam().psnr_db);
}

INSTANTIATE_TEST_SUITE_P(Khronos, SampleModelTwins, testing::ValuesIn(kTwins),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(SampleModels, DifferentModelsDoNotLookAlikeSoTheBoundsCanFail) {
  SKIP_WITHOUT_MODELS(assets);
  const test::TemporaryFolder out;
  replay(*assets / "Fox/glTF/Fox.gltf", out / "a");
  replay(*assets / "InterpolationTest/glTF/InterpolationTest.gltf", out / "b");
  EXPECT_LT(psnr_of(out / "a", out / "b"), 20.0);
}

TEST(SampleModels, TheListIsComplete) {
  SKIP_WITHOUT_MODELS(assets);
  std::set<std::string> found, listed;
  for (const auto& entry : fs::recursive_directory_iterator(*assets))
    if (entry.path().extension() == ".gltf" || entry.path().extension() == ".glb")
      found.insert(fs::relative(entry.path(), *assets).string());
  for (const Model& model : kModels) listed.insert(model.path);
  EXPECT_EQ(found, listed);
}

}  // namespace
}  // namespace tessera::replay::assets_test
