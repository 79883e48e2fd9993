// Records timed again: the same cycles and energies as a replay on that machine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/captures.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using test::ProcessResult;
using test::run_tessera;
using testing::HasSubstr;

class Time : public testing::Test {
 protected:
  // Replays two frames of a capture with a record; its stats.json.
  json replay(const std::string& capture, const std::vector<std::string>& sets, const std::string& name) {
    std::vector<std::string> arguments = {"replay",   test::shipped_capture(capture).string(),
                                          "--size",   "96x64",
                                          "--frames", "3:5",
                                          "--quiet",  "--no-report",
                                          "--out",    (folder_ / name).string(),
                                          "--record", record(name)};
    add(arguments, sets);
    const ProcessResult done = run_tessera(arguments);
    EXPECT_EQ(done.status, 0) << done.errors;
    return json::parse(test::read_text(folder_ / name / "stats.json"));
  }
  ProcessResult time(const std::string& name, const std::vector<std::string>& sets) {
    std::vector<std::string> arguments = {"time", record(name), "--json", (folder_ / "time.json").string()};
    add(arguments, sets);
    return run_tessera(arguments);
  }
  json times() { return json::parse(test::read_text(folder_ / "time.json")); }
  std::string record(const std::string& name) { return (folder_ / (name + ".record")).string(); }
  static void add(std::vector<std::string>& arguments, const std::vector<std::string>& sets) {
    for (const std::string& set : sets) arguments.insert(arguments.end(), {"--set", set});
  }
  static void expect_same(const json& times, const json& stats) {
    ASSERT_EQ(times["frames"].size(), stats["frames"].size());
    for (std::size_t f = 0; f < times["frames"].size(); ++f)
      for (const char* part : {"frame", "timing", "energy"})
        EXPECT_EQ(times["frames"][f][part], stats["frames"][f][part]);
    for (const char* part : {"timing", "energy"}) EXPECT_EQ(times["total"][part], stats["total"][part]);
  }

  test::TemporaryFolder folder_;
};

TEST_F(Time, IsThatOfTheReplayItself) {
  const json stats = replay("eggs", {}, "plain");
  const ProcessResult done = time("plain", {});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("bound by"));
  expect_same(times(), stats);
}

TEST_F(Time, IsThatOfAReplayOnTheOtherMachine) {
  const std::vector<std::string> machine = {"shader.lanes=64",    "clock.mhz=400",
                                            "tilecore.count=2",   "memory.bytes_per_clk=8",
                                            "energy.texel_pj=40", "tilecore.memory_bytes=40960"};
  replay("stroll", {}, "plain");
  const json stats = replay("stroll", machine, "other");
  EXPECT_EQ(time("plain", machine).status, 0);
  expect_same(times(), stats);
}

TEST_F(Time, HoldsBothEyes) {
  const std::vector<std::string> eyes = {"stereo.eye_separation=0.06"};
  const json stats = replay("vases", eyes, "eyes");
  EXPECT_EQ(time("eyes", {}).status, 0);
  expect_same(times(), stats);
}

TEST_F(Time, RefusesKeysThatChangeTheWork) {
  replay("eggs", {}, "plain");
  const ProcessResult tiles = time("plain", {"tile.width=16"});
  EXPECT_EQ(tiles.status, 2);
  EXPECT_THAT(tiles.errors, HasSubstr("tile.width: the record was made with 32, not 16"));
  EXPECT_EQ(time("plain", {"sampling.seed=3"}).status, 2);
  EXPECT_EQ(time("plain", {"clock.hz=3"}).status, 2);
}

// What a number at twice its value changes is what a replay on that machine says.
TEST_F(Time, SensitivityIsWhatAReplayOnTheOtherMachineSays) {
  const json stats = replay("eggs", {}, "plain"), faster = replay("eggs", {"shader.lanes=64"}, "faster");
  const ProcessResult done =
      run_tessera({"time", record("plain"), "--sensitivity", "--json", (folder_ / "time.json").string()});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("shader.lanes"));
  const json rows = times()["sensitivity"];
  EXPECT_GE(rows.size(), 50u);
  const auto cycles = [](const json& of) { return of["frames"][0]["timing"]["cycles"].get<double>(); };
  bool found = false;
  for (const json& row : rows)
    if (row["key"] == "shader.lanes") {
      found = true;
      EXPECT_NEAR(row["cycles"][1].get<double>(), cycles(faster) / cycles(stats), 1e-4);
      EXPECT_GT(row["cycles"][0].get<double>(), 1.0);
    }
  EXPECT_TRUE(found);
}

// Each split of a frame adds up to it, and names what the capture has.
TEST_F(Time, SplitsAFrame) {
  replay("garden", {"machine.timing=events"}, "plain");
  const auto split = [&](const std::string& by) {
    const ProcessResult done =
        run_tessera({"time", record("plain"), "--split", by, "--json", (folder_ / "time.json").string()});
    EXPECT_EQ(done.status, 0) << done.errors;
    return times()["split"]["views"][0];
  };
  const json drawables = split("drawables");
  const double frame = times()["frames"][0]["timing"]["cycles"];
  const double invocations = json::parse(
      test::read_text(folder_ / "plain" / "stats.json"))["frames"][0]["counters"]["tilecore.pixel_shader_invocations"];
  for (const json& rows : {drawables, split("materials")}) {
    double cycles = 0, shaded = 0, last = 1e30;
    for (const json& row : rows) {
      cycles += row["cycles"].get<double>(), shaded += row["invocations"].get<double>();
      EXPECT_LE(row["cycles"], last);
      last = row["cycles"];
    }
    EXPECT_NEAR(cycles, frame, 1);
    EXPECT_EQ(shaded, invocations);
  }
  EXPECT_GT(drawables.size(), 2u);
  EXPECT_NE(drawables[0]["node"], "");
  const json tiles = split("tiles");
  EXPECT_EQ(tiles.size(), 3u * 2u);  // of 32x32 in 96x64
  for (const json& tile : tiles) EXPECT_LE(tile["cycles"], frame);
  EXPECT_EQ(run_tessera({"time", record("plain"), "--split", "pixels"}).status, 2);
}

TEST_F(Time, RefusesWhatIsNoRecord) {
  EXPECT_EQ(run_tessera({"time", (folder_ / "none").string()}).status, 3);
  const ProcessResult capture = run_tessera({"time", test::shipped_capture("eggs").string()});
  EXPECT_EQ(capture.status, 3);
  EXPECT_THAT(capture.errors, HasSubstr("is not a record"));
  const ProcessResult modelless =
      run_tessera({"replay", test::shipped_capture("eggs").string(), "--out", (folder_ / "x").string(), "--record",
                   record("x"), "--set", "output.machine_model=false"});
  EXPECT_EQ(modelless.status, 2);
}

// Points that differ in timing keys only are one render; each has what it has alone.
TEST_F(Time, SweepsRenderOncePerFunctionalPoint) {
  const auto study = [](const json& axes) {
    return json{{"title", "clocks"},
                {"captures", {test::shipped_capture("eggs").string()}},
                {"size", "64x36"},
                {"frames", "3:4"},
                {"axes", axes}}
        .dump();
  };
  const auto axis = [](const char* key, const json& values) { return json{{"key", key}, {"values", values}}; };
  const auto sweep = [&](const std::string& name) {
    const ProcessResult done =
        run_tessera({"sweep", (folder_ / (name + ".json")).string(), "--out", (folder_ / name).string()});
    EXPECT_EQ(done.status, 0) << done.errors;
    return done.output;
  };
  test::write_text(folder_ / "all.json", study({axis("tile.width", {8, 16, 32}), axis("shader.lanes", {8, 32, 128}),
                                                axis("clock.mhz", {300, 600, 900})}));
  EXPECT_THAT(sweep("all"), HasSubstr("3 rendered and 24 timed from their records"));
  // One of them alone, which is rendered: its result has the same name and the same bytes.
  test::write_text(folder_ / "one.json",
                   study({axis("tile.width", {16}), axis("shader.lanes", {128}), axis("clock.mhz", {600})}));
  EXPECT_THAT(sweep("one"), HasSubstr("1 rendered and 0 timed"));
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "one" / "points")) {
    if (entry.path().extension() != ".json") continue;
    EXPECT_EQ(test::read_text(entry.path()), test::read_text(folder_ / "all" / "points" / entry.path().filename()));
    ++compared;
  }
  EXPECT_EQ(compared, 1);
}

}  // namespace
}  // namespace tessera::replay
