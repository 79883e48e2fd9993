#include "replay/progress.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include <nlohmann/json.hpp>

#include "tests/support/captures.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera::replay {
namespace {

// Standard error of tests is no terminal once it is captured.
std::string said_by(std::chrono::milliseconds time, bool quiet) {
  testing::internal::CaptureStderr();
  {
    const LongStep step("reading a.glb", quiet);
    std::this_thread::sleep_for(time);
    EXPECT_GE(step.seconds(), std::chrono::duration<double>(time).count());
  }
  return testing::internal::GetCapturedStderr();
}

TEST(Progress, OfWorkWithoutStepsIsSaidOnceItTakesASecond) {
  EXPECT_EQ(said_by(std::chrono::milliseconds(1700), false), "reading a.glb\n");
  EXPECT_EQ(said_by(std::chrono::milliseconds(1), false), "");
  EXPECT_EQ(said_by(std::chrono::milliseconds(1200), true), "");
}

TEST(Replay, SaysHowLongLoadingTook) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  const test::ProcessResult r = test::run_tessera(
      {"replay", test::shipped_capture("vases").string(), "--size", "64x36", "--quiet", "--no-report", "--out", out});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_EQ(r.errors, "");
  const auto stages = nlohmann::json::parse(test::read_text(folder / "out" / "stats.json"))["host"]["stages"];
  EXPECT_EQ(stages.size(), 3u);
  double sum = 0;
  for (const char* stage : {"load", "decode", "assemble"}) {
    ASSERT_TRUE(stages.contains(stage)) << stage;
    EXPECT_GE(stages[stage].get<double>(), 0.0) << stage;
    sum += stages[stage].get<double>();
  }
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace tessera::replay
