// Hard cases against double precision: docs/hard_cases.md shows them, `tessera selfcheck --stability` measures them.
#include "replay/stability/stability.h"
#include "base/parallel.h"
#include "base/simd_targets.h"
#include "replay/stability/judge.h"
#include "tests/support/tests.h"

namespace tessera::replay::stability_test {
namespace {

using namespace stability;

const std::string& page() {
  static const std::string kPage = test::read_text(fs::path(TESSERA_SOURCE_DIR) / "docs/hard_cases.md");
  return kPage;
}

class Stability : public testing::TestWithParam<std::size_t> {
 protected:
  const StabilityCase& of() const { return stability_cases()[GetParam()]; }
};

TEST_P(Stability, KeepsItsBound) {  // STB1
  const StabilityResult result = measure(of());
  EXPECT_LE(result.error, of().bound) << of().name << ", " << of().unit;
  EXPECT_THAT(page(), HasSubstr(page_row(result, "images/stability")))
      << "run tessera selfcheck --stability --out docs/images/stability";
}

TEST_P(Stability, ATwinIsNoticed) {  // STB2
  const Stage stage = of().scene();
  EXPECT_GT(of().error(stage, true), of().bound) << of().name << ": " << of().twin;
}

INSTANTIATE_TEST_SUITE_P(Case, Stability, testing::Range(std::size_t{0}, stability_cases().size()),
                         [](const auto& instance) { return std::string(stability_cases()[instance.param].law); });

// One case of each section.
TEST(StabilityCases, STB3ErrorsAreTheSameForAnyThreadsAndInstructionSet) {
  for (const StabilitySection& section : stability_sections()) {
    const auto& all = stability_cases();
    const auto of = std::ranges::find(all, section.name, &StabilityCase::section);
    ASSERT_NE(of, all.end()) << section.name;
    const double error = measure(*of).error;
    {
      const ThreadLimit one(1);
      EXPECT_EQ(measure(*of).error, error) << of->name << ", one thread";
    }
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      EXPECT_EQ(measure(*of).error, error) << of->name << ", " << target;
    }
    force_simd_target("");
  }
}

TEST(StabilityCases, HaveNamesAndImagesOfTheirOwn) {
  std::set<std::string_view> names;
  std::set<std::string> images;
  std::uintmax_t bytes = 0;
  for (const StabilityCase& of : stability_cases()) {
    EXPECT_TRUE(names.insert(of.name).second) << of.name;
    EXPECT_TRUE(images.insert(thumbnail_file(of)).second) << of.law;
    for (const std::string_view sentence : {of.hard, of.kept}) EXPECT_TRUE(sentence.ends_with('.')) << sentence;
    EXPECT_FALSE(of.twin.empty());
    const fs::path file = fs::path(TESSERA_SOURCE_DIR) / "docs/images/stability" / thumbnail_file(of);
    ASSERT_TRUE(fs::exists(file)) << file;
    bytes += fs::file_size(file);
  }
  EXPECT_GE(names.size(), 40u);
  EXPECT_LE(bytes, 600'000u);
}

// ---- The judge --------------------------------------------------------------------------------------------------

// p(u, v) = (u, v, u v) and its normal (-v, -u, 1), displaced by a half.
TEST(StabilityJudge, DisplacesASaddleAsTheFormulaSays) {
  std::array<DVec3, 16> net;
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const double u = static_cast<double>(i) / 3, v = static_cast<double>(j) / 3;
      net[4 * j + i] = DVec3(u, v, u * v);
    }
  for (const double u : {0.0, 0.3, 1.0})
    for (const double v : {0.0, 0.6, 1.0}) {
      const DVec3 wanted = DVec3(u, v, u * v) + 0.5 * glm::normalize(DVec3(-v, -u, 1));
      EXPECT_LT(glm::distance(displaced(net, u, v, 0.5), wanted), 1e-15) << u << " " << v;
      EXPECT_GT(glm::distance(displaced(net, u, v, 0.49), wanted), 0.009) << "the twin";
    }
}

// A point on a node that turns by a quarter, seen from 4 units away: where sine and cosine take it.
TEST(StabilityJudge, SeesATurningPointWhereSineAndCosineTakeIt) {
  Stage stage;
  stage.turn(stage.add(triangles({{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}, {0, 1, 2}, stage.flat(Vec4(1.0f)))), {0, 0, 1},
             0.25);
  scene::Camera camera;
  camera.vertical_fov = 2 * std::atan(0.25f);
  stage.look({0, 0, 4}, camera);
  const PosedStage posed(stage);
  for (const double t : {0.0, 0.4, 1.0}) {
    const DVec4 at = Judge(posed, t).vertex(posed.assembly.drawables[0], 0);
    const double angle = std::numbers::pi / 2 * t;
    // A unit is 45 pixels of the 90 at that distance.
    EXPECT_NEAR(at.x / at.w, 80 + 45 * std::cos(angle), 1e-4);
    EXPECT_NEAR(at.y / at.w, 45 - 45 * std::sin(angle), 1e-4);
  }
}

// ---- The command ------------------------------------------------------------------------------------------------

TEST(StabilityCommand, TakesNoCapturesAndWritesOnRequestAlone) {
  EXPECT_EQ(run_tessera({"selfcheck", "--stability", "a.glb"}).status, 2);
  EXPECT_EQ(run_tessera({"selfcheck", "--out", "folder"}).status, 2);
}

}  // namespace
}  // namespace tessera::replay::stability_test
