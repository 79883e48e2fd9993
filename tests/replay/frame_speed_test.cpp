// A unit's share of a frame: ratios, never times.
#include "tests/support/tests.h"

namespace tessera::replay::frame_speed_test {
namespace {

TEST(FrameSpeed, ResolvingIsAFractionOfATilesWork) {
  const test::TemporaryFolder folder;
  const test::ProcessResult r =
      test::run_tessera({"replay", test::shipped_capture("stroll").string(), "--frames", "0:8", "--set",
                         "resolve.desampling=adaptive", "--quiet", "--no-report", "--out", (folder / "out").string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  const auto stats = nlohmann::json::parse(test::read_text(folder / "out" / "stats.json"));
  double resolve = 0, tiles = 0;
  for (const auto& frame : stats["frames"]) {
    resolve += frame["host"]["stages"]["resolve_threads"].get<double>();
    tiles += frame["host"]["stages"]["tile_threads"].get<double>();
  }
  RecordProperty("ratio", std::to_string(resolve / tiles));
  EXPECT_LT(resolve / tiles, 0.25);  // measured: 0.15
}

}  // namespace
}  // namespace tessera::replay::frame_speed_test
