// Folders of results, and flags that people get wrong.
#include "replay/result_folder.h"

#include "base/error.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::result_folder_test {
namespace {

std::set<std::string> names_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

class ResultFolder : public testing::Test {
 protected:
  ResultFolder() : capture_(folder_ / "c.glb"), out_(folder_ / "out") {
    test::write_text(capture_, test::everything_asset().glb());
  }
  ProcessResult replay(std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"replay", capture_.string(), "--size", "16x16", "--out", out_.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments);
  }
  test::TemporaryFolder folder_;
  fs::path capture_, out_;
};

TEST_F(ResultFolder, AShorterReplayLeavesNoFrameOfALongerOne) {  // RFO2
  ASSERT_EQ(replay({"--frames", "2:6", "--quiet", "--set", "stereo.eye_separation=0.1", "--baselines"}).status, 0);
  EXPECT_TRUE(names_in(out_).contains("frame_0005.right.exr"));
  test::write_text(out_ / "frame_0100.png", "mine");
  test::write_text(out_ / "notes.txt", "mine");
  ASSERT_EQ(replay({"--frames", "3:4", "--quiet", "--no-report"}).status, 0);
  EXPECT_EQ(names_in(out_), (std::set<std::string>{"frame_0003.exr", "frame_0003.png", "tiles_0003.json", "stats.csv",
                                                   "stats.json", "frame_0100.png", "notes.txt"}));
}

TEST_F(ResultFolder, ResultsOfOneKindOfCommandStayAlone) {  // RFO1
  test::write_text(folder_ / "study.json",
                   json{{"captures", {"c.glb"}}, {"size", "16x16"}, {"axes", json::array()}}.dump());
  const std::map<ResultKind, std::pair<std::string, std::vector<std::string>>> commands = {
      {ResultKind::kReplay, {"stats.json", {"replay", capture_.string(), "--size", "16x16"}}},
      {ResultKind::kSweep, {"sweep.json", {"sweep", (folder_ / "study.json").string()}}},
      {ResultKind::kTradeoff, {"tradeoff.json", {"tradeoff", capture_.string(), "--size", "16x16"}}}};
  for (const auto& [there, mark] : commands)
    for (const auto& [kind, command] : commands) {
      fs::remove_all(out_);
      fs::create_directory(out_);
      test::write_text(out_ / mark.first, "{}");
      if (kind == there) {
        EXPECT_NO_THROW(check_results_of(kind, out_));
        continue;
      }
      EXPECT_THROW(check_results_of(kind, out_), UsageError);
      std::vector<std::string> arguments = command.second;
      arguments.insert(arguments.end(), {"--out", out_.string()});
      const ProcessResult r = run_tessera(arguments);
      EXPECT_EQ(r.status, 2) << r.errors;
      EXPECT_THAT(r.errors, HasSubstr("it holds the results of a"));
      EXPECT_EQ(names_in(out_), std::set<std::string>{mark.first});
    }
}

TEST_F(ResultFolder, FramesBehindTheEndOfTheAnimationGetANote) {
  const ProcessResult within = replay({"--frames", "0:2", "--no-report"});
  EXPECT_THAT(within.errors, testing::Not(HasSubstr("behind the end of the animation")));
  const ProcessResult beyond = replay({"--frames", "0:300", "--no-report", "--set", "output.machine_model=false"});
  EXPECT_THAT(beyond.errors, HasSubstr("lie behind the end of the animation at 1 s and show how it ends"));
  EXPECT_THAT(json::parse(test::read_text(out_ / "stats.json"))["capture"]["notices"].dump(),
              HasSubstr("behind the end of the animation"));
}

TEST_F(ResultFolder, ATruncatedRecordIsCalledTruncated) {
  const fs::path record = folder_ / "r.record", part = folder_ / "part.record";
  ASSERT_EQ(replay({"--quiet", "--no-report", "--record", record.string()}).status, 0);
  const std::string whole = test::read_text(record);
  for (const std::size_t size :
       {whole.size() - 1, whole.size() - 20, whole.size() / 2, whole.size() / 4, std::size_t{40}}) {
    test::write_text(part, whole.substr(0, size));
    const ProcessResult r = run_tessera({"time", part.string()});
    EXPECT_EQ(r.status, 3) << size;
    EXPECT_THAT(r.errors, HasSubstr("is truncated")) << size;
  }
}

TEST_F(ResultFolder, NumbersOfBytesMayHaveUnits) {
  const auto set = [&](const char* text) { return replay({"--no-report", "--quiet", "--set", text}); };
  ASSERT_EQ(set("l2.bytes=512K").status, 0);
  EXPECT_EQ(json::parse(test::read_text(out_ / "stats.json"))["gpu"]["l2"]["bytes"], 524288);
  EXPECT_EQ(set("l2.bytes=1MiB").status, 0);
  for (const char* wrong : {"l2.bytes=512X", "l2.bytes=K", "l2.bytes=9999999G", "l2.bytes=0.5M", "l2.ways=4K"}) {
    const ProcessResult r = set(wrong);
    EXPECT_EQ(r.status, 2) << wrong;
    EXPECT_THAT(r.errors, HasSubstr("is not a whole number from")) << wrong;
  }
}

TEST_F(ResultFolder, KeysAndLimitsAreCalledByTheirNames) {
  const ProcessResult ways = replay({"--set", "l2.ways=9"});
  EXPECT_EQ(ways.status, 2);
  EXPECT_THAT(ways.errors, HasSubstr("l2.bytes and l2.ways: "));
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--max-flip", "5"}, {"--max-flip", "-1"}, {"--min-psnr", "-3"}}) {
    std::vector<std::string> arguments = {"tradeoff", capture_.string(), "--out", out_.string()};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 2);
    EXPECT_THAT(r.errors, HasSubstr(wrong[0]));
  }
}

}  // namespace
}  // namespace tessera::replay::result_folder_test
