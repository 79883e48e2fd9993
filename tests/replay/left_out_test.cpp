// Costs of a frame without a part of it (--without), against scenes that lack the part.
#include "replay/left_out.h"

#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::replay::left_out_test {
namespace {

using testing::HasSubstr;

json frame_of(const char* name, const std::vector<std::string>& more) {
  const test::TemporaryFolder out;
  std::vector<std::string> arguments = {"replay",      test::shipped_capture(name).string(),
                                        "--size",      "160x90",
                                        "--frames",    "5:6",
                                        "--no-report", "--quiet",
                                        "--out",       out.path().string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const test::ProcessResult r = test::run_tessera(arguments);
  EXPECT_EQ(r.status, 0) << r.errors;
  return json::parse(test::read_text(out / "stats.json"))["frames"][0];
}

std::uint64_t cycles_of(const json& frame) { return frame["timing"]["cycles"].get<std::uint64_t>(); }

// Cycles of frame 5 of a capture of which the nodes of that name draw nothing.
std::uint64_t cycles_without_node(const char* name, const std::string& node) {
  scene::Capture capture = scene::read_capture(test::shipped_capture(name));
  for (scene::Node& of : capture.nodes)
    if (of.name == node) of.mesh = scene::kNone;
  gpu::Device device(capture, {}, {}, {160, 90, {0, 0, 160, 90}});
  return static_cast<std::uint64_t>(std::ceil(device.render(5).model->timing.cycles));
}

TEST(LeftOut, FramesEqualScenesWithoutThePart) {
  const json frame = frame_of("eggs", {"--without", "all"});
  const json& drawables = frame["without"]["drawables"];
  ASSERT_GE(drawables.size(), 4u);
  std::set<std::uint64_t> several;
  for (const json& row : drawables) {
    const std::string node = row["node"];
    // More than one drawable of a name are left out one by one.
    const auto same =
        std::count_if(drawables.begin(), drawables.end(), [&](const json& r) { return r["node"] == node; });
    if (same == 1) {
      EXPECT_EQ(row["cycles"], cycles_without_node("eggs", node)) << node;
    }
    several.insert(row["cycles"].get<std::uint64_t>());
  }
  // No part was left in: each frame is another.
  EXPECT_EQ(several.size(), drawables.size());
  EXPECT_FALSE(several.contains(cycles_of(frame)));
}

TEST(LeftOut, AMaterialOfOneDrawableSavesTheSameAsTheDrawable) {
  const json frame = frame_of("eggs", {"--without", "all"});
  for (const json& material : frame["without"]["materials"]) {
    std::vector<json> of;
    for (const json& row : frame["without"]["drawables"])
      if (row["material"] == material["material"]) of.push_back(row);
    if (of.size() == 1) {
      EXPECT_EQ(of[0]["cycles"], material["cycles"]);
    }
  }
}

TEST(LeftOut, AnEffectIsLeftOutAsItsKeyDoes) {
  const json frame = frame_of("serpent", {"--without", "1"});
  const json still = frame_of("serpent", {"--set", "effects.motion=off"});
  bool moved = false;
  for (const json& row : frame["without"]["effects"])
    if (row["effect"] == "motion") {
      moved = true;
      EXPECT_EQ(row["cycles"], cycles_of(still));
    }
  EXPECT_TRUE(moved);
  EXPECT_EQ(frame["without"]["drawables"].size(), 1u);
}

// The first frame after others goes on from them, with the part and without.
TEST(LeftOut, FramesGoOnFromTheStateOfEarlierFrames) {
  const std::vector<std::string> desampled = {"--set", "resolve.desampling=adaptive"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), desampled.begin(), desampled.end());
    return frame_of("stroll", more);
  };
  const json alone = with({"--without", "1"}), later = with({"--without", "1", "--warmup", "2"});
  EXPECT_NE(alone["without"]["drawables"][0]["cycles"], later["without"]["drawables"][0]["cycles"]);
  const json effect = with({"--warmup", "2", "--set", "effects.motion=off"});
  for (const json& row : later["without"]["effects"])
    if (row["effect"] == "motion") {
      EXPECT_EQ(row["cycles"], cycles_of(effect));
    }
}

TEST(LeftOut, WrongNumbersAreRefused) {
  for (const char* parts : {"0", "-1", "some"}) {
    const test::TemporaryFolder out;
    const test::ProcessResult r =
        test::run_tessera({"replay", test::shipped_capture("eggs").string(), "--without", parts, "--size", "16x16",
                           "--frames", "0:1", "--out", out.path().string()});
    EXPECT_EQ(r.status, 2) << parts;
    EXPECT_THAT(r.errors, HasSubstr("--without"));
  }
  const test::TemporaryFolder out;
  const test::ProcessResult r = test::run_tessera({"replay", test::shipped_capture("eggs").string(), "--without", "1",
                                                   "--set", "output.machine_model=false", "--size", "16x16", "--frames",
                                                   "0:1", "--out", out.path().string()});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.errors, HasSubstr("output.machine_model=true"));
}

TEST(LeftOut, TheTableHasSharesBesideSavings) {
  const json frame = frame_of("eggs", {"--without", "2"});
  const std::string table = left_out_table(frame);
  EXPECT_THAT(table, HasSubstr("attributed"));
  for (const json& row : frame["without"]["drawables"])
    EXPECT_THAT(table, HasSubstr("drawable " + row["node"].get<std::string>()));
}

}  // namespace
}  // namespace tessera::replay::left_out_test
