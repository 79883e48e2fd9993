#include <pty.h>
#include <unistd.h>
#include <regex>

#include "replay/progress.h"
#include "tests/support/tests.h"

namespace tessera::replay::progress_test {
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

TEST(Progress, WorkWithoutStepsIsReportedAfterASecond) {
  EXPECT_EQ(said_by(std::chrono::milliseconds(1700), false), "reading a.glb\n");
  EXPECT_EQ(said_by(std::chrono::milliseconds(1), false), "");
  EXPECT_EQ(said_by(std::chrono::milliseconds(1200), true), "");
}

// Output of `work` on standard error while that is a terminal.
template <class Work>
std::string said_on_a_terminal(const Work& work) {
  int master = -1, terminal = -1;
  EXPECT_EQ(openpty(&master, &terminal, nullptr, nullptr, nullptr), 0);
  const int before = dup(STDERR_FILENO);
  dup2(terminal, STDERR_FILENO);
  work();
  dup2(before, STDERR_FILENO);
  close(before);
  std::string said(4096, '\0');
  const ssize_t size = write(terminal, "end", 3) == 3 ? read(master, said.data(), said.size()) : 0;
  said.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
  close(terminal);
  close(master);
  return said;
}

TEST(Progress, WithinAStepIsSaidOnceItTakesASecond) {
  const auto step_of = [](int milliseconds, bool quiet) {
    return said_on_a_terminal([&] {
      Progress progress(2, quiet, [] { return std::string("3 of 9 tiles"); });
      std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
      progress.update(1, "frame 0");
    });
  };
  const std::string said = step_of(1700, false);
  EXPECT_NE(said.find("0/2  3 of 9 tiles"), std::string::npos) << said;
  EXPECT_LT(said.find("3 of 9 tiles"), said.find("1/2  frame 0")) << said;
  const std::string soon = step_of(1, false);
  EXPECT_EQ(soon.find("tiles"), std::string::npos) << soon;
  EXPECT_NE(soon.find("1/2  frame 0"), std::string::npos) << soon;
  EXPECT_EQ(step_of(1300, true), "end");
}

// Half a step in the first second leaves three halves.
TEST(Progress, WithinAStepTellsTheRest) {
  const std::string said = said_on_a_terminal([&] {
    Progress progress(2, false, [] { return StepProgress("6 of 12 tiles", 0.5); });
    std::this_thread::sleep_for(std::chrono::milliseconds(1300));
  });
  EXPECT_TRUE(std::regex_search(said, std::regex("0/2  6 of 12 tiles  [3-9] s left"))) << said;
  testing::internal::CaptureStderr();
  {
    Progress progress(2, false, [] { return StepProgress("6 of 12 tiles", 0.5); });
    std::this_thread::sleep_for(std::chrono::milliseconds(1300));
  }
  const std::string line = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(std::regex_match(line, std::regex("\\[0/2\\] 6 of 12 tiles, [3-9] s left\n"))) << line;
}

// Work that knows its time left says it, between steps and within them.
TEST(Progress, SaysTheTimeLeftThatTheWorkMeasured) {
  testing::internal::CaptureStderr();
  {
    Progress progress(3, false, [] { return StepProgress("6 of 12 tiles", 0.5, 77.0); });
    progress.update(1, "frame 0");
    progress.update(3, "frame 2");
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "[1/3] frame 0, 77 s left\n[3/3] frame 2\n");
}

// Half of a step that is nine tenths of the work leaves more than as much again; were the steps alike, three times as much.
TEST(Progress, CountsTheWorkOfUnequalSteps) {
  const auto line_of = [](const std::vector<double>& works) {
    testing::internal::CaptureStderr();
    {
      Progress progress(works, false, [] { return StepProgress("6 of 12 tiles", 0.5); });
      std::this_thread::sleep_for(std::chrono::milliseconds(1300));
    }
    return testing::internal::GetCapturedStderr();
  };
  const auto matches = [](const std::string& line, const char* seconds) {
    return std::regex_match(line, std::regex(fmt::format("\\[0/2\\] 6 of 12 tiles, {} s left\n", seconds)));
  };
  const std::string long_first = line_of({9, 1}), alike = line_of({1, 1}), nothing = line_of({0, 0});
  EXPECT_TRUE(matches(long_first, "[12]")) << long_first;
  EXPECT_TRUE(matches(alike, "[3-9]")) << alike;
  EXPECT_EQ(nothing, "[0/2] 6 of 12 tiles\n") << "no work is left";
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
}  // namespace tessera::replay::progress_test
