// `tessera compare` of replays: why one is slower than another, and the gate for scripts.
#include "base/image_codec.h"
#include "replay/compare/comparison.h"
#include "tests/support/tests.h"

namespace tessera::replay::compare_test {
namespace {

using testing::ElementsAre;
using testing::Not;

// Statistics of frames with these cycles each; a texture unit that takes half of them, and two drawables.
json statistics(const std::vector<int>& cycles, int first = 0) {
  json frames = json::array();
  for (const int c : cycles) {
    json drawables = json::array({{{"node", "tree"}, {"material", "leaf"}, {"cycles", c * 0.75}},
                                  {{"node", "sky"}, {"material", ""}, {"cycles", 100.0}}});
    frames.push_back(
        {{"frame", first + static_cast<int>(frames.size())},
         {"counters", {{"tilecore.triangles", c * 2}, {"binner.queue_bytes_peak", c}}},
         {"effects", {{"motion", c > 1500}}},
         {"dram",
          json::array(
              {{{"unit", "texture"}, {"purpose", "texels"}, {"read_bytes", c * 4}, {"written_bytes", 0}},
               {{"unit", "resolve"}, {"purpose", "frame_buffer"}, {"read_bytes", 0}, {"written_bytes", 4096}}})},
         {"timing",
          {{"cycles", c},
           {"bound_by", c > 1500 ? "texture" : "shader"},
           {"bound_by_cycles", c / 4},
           {"units", {{"texture", {{"busy_cycles", c / 2}}}, {"shader", {{"busy_cycles", 400}}}}}}},
         {"energy", {{"total_nj", c * 10.0}, {"by_unit", {{"dram", c * 6.0}, {"shader", c * 4.0}}}}},
         {"drawables", drawables}});
  }
  return {{"schema", "tessera.stats/1"},
          {"capture", {{"file", "forest.glb"}}},
          {"gpu", {{"preset", "mid-mobile"}, {"clock", {{"mhz", 800.0}}}, {"texture", {{"cache_bytes", 16384}}}}},
          {"settings", {{"width", 64}, {"sampling.seed", 0}}},
          {"frames", frames},
          {"total", {{"counters", json::object()}}}};
}

class Compare : public testing::Test {
 protected:
  std::string run(const char* name, const json& root) const {
    fs::create_directories(folder_ / name);
    test::write_text(folder_ / name / "stats.json", root.dump());
    return (folder_ / name).string();
  }
  static json compared(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "compare");
    arguments.emplace_back("--json");
    const ProcessResult r = run_tessera(arguments);
    EXPECT_EQ(r.status, 0) << r.errors;
    return json::parse(r.output);
  }
  static json row(const json& rows, const std::string& name) {
    for (const json& row : rows)
      if (row["name"] == name) return row;
    return {};
  }
  test::TemporaryFolder folder_;
};

TEST_F(Compare, OneCommandSaysWhyAReplayIsSlower) {
  json slow = statistics({2000, 2200});
  slow["gpu"]["texture"]["cache_bytes"] = 4096;
  const std::string a = run("a", statistics({1000, 1200})), b = run("b", slow);
  const json why = compared({a, b})["why"]["b"];
  // 2100 against 1100 cycles at 800 MHz.
  EXPECT_EQ(why["text"],
            "B takes 90.9 % more time than A: 0.002625 ms a frame against 0.001375, 2100 cycles against 1100 (+1000)");
  const std::vector<std::pair<const char*, std::vector<const char*>>> parts = {
      {"what changed", {"texture.cache_bytes 16384 -> 4096", "motion runs"}},
      {"cycles by drawable", {"tree / leaf +750", "all others +250"}},
      {"busy cycles of units", {"texture +500"}},
      {"bytes", {"texture.texels +3.9 KiB"}},
      {"B is bound by texture, A by shader", {}}};
  ASSERT_EQ(why["parts"].size(), parts.size()) << why;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    EXPECT_EQ(why["parts"][p]["text"], parts[p].first);
    std::vector<std::string> texts;
    for (const json& part : why["parts"][p].value("parts", json::array())) texts.push_back(part["text"]);
    EXPECT_EQ(texts, std::vector<std::string>(parts[p].second.begin(), parts[p].second.end()));
  }
  const ProcessResult text = run_tessera({"compare", a, b});
  for (const auto& [title, texts] : parts) {
    EXPECT_THAT(text.output, HasSubstr(title));
    for (const char* part : texts) EXPECT_THAT(text.output, HasSubstr(std::string("    ") + part + "\n"));
  }
}

TEST_F(Compare, CyclesOfTheCriticalPathExplainWhereBothHaveThem) {
  json first = statistics({1000}), second = statistics({1400});
  first["frames"][0]["timing"]["events"]["critical_path"] = {{"shader", 600}, {"latency", 400}};
  second["frames"][0]["timing"]["events"]["critical_path"] = {{"shader", 600}, {"latency", 800}};
  const json why = compared({run("a", first), run("b", second)})["why"]["b"];
  EXPECT_EQ(why["parts"][2], json({{"text", "cycles by unit, on the critical path"},
                                   {"parts", json::array({{{"text", "latency +400"}}})}}));
}

TEST_F(Compare, PassesAreComparedByName) {
  const auto passes = [](int shadow, int main) {
    json root = statistics({1000});
    root["frames"][0]["timing"]["passes"] = {
        {{"name", "shadow 0.0"}, {"begin_cycles", 0}, {"end_cycles", shadow}},
        {{"name", "main"}, {"begin_cycles", shadow}, {"end_cycles", shadow + main}}};
    return root;
  };
  const json report = compared({run("a", passes(200, 800)), run("b", passes(500, 810))});
  EXPECT_EQ(row(report["passes"], "shadow 0.0"), json({{"name", "shadow 0.0"}, {"a", 200}, {"b", 500}}));
  EXPECT_EQ(row(report["passes"], "main")["b"], 810);
  EXPECT_THAT(report["why"]["b"].dump(), HasSubstr("[{\"text\":\"shadow 0.0 +300\"},{\"text\":\"main +10\"}]"));
  // One pass is the frame.
  EXPECT_TRUE(compared({run("c", statistics({1000})), run("d", statistics({1200}))})["passes"].empty());
}

TEST_F(Compare, FiguresAreMeansOverTheFramesThatAllHave) {
  const std::string a = run("a", statistics({1000, 1200, 9000})), b = run("b", statistics({2000, 2200}));
  const json report = compared({a, b});
  EXPECT_EQ(report["frames_compared"], json({0, 1}));
  EXPECT_THAT(report["notes"][0].get<std::string>(), HasSubstr("A has 3 frames, 2 of them are compared"));
  EXPECT_EQ(row(report["summary"], "cycles")["a"], 1100);
  EXPECT_EQ(row(report["summary"], "dram_bytes")["b"], 2100 * 4 + 4096);
  EXPECT_EQ(row(report["purposes"], "texture.texels")["b"], 8400);
  EXPECT_EQ(row(report["units"], "texture")["b"], 1050);
  EXPECT_DOUBLE_EQ(row(report["energy"], "dram")["a"].get<double>(), 1100 * 6e-6);
  EXPECT_EQ(row(report["drawables"], "tree / leaf")["a"], 825);
  // Counters are the counters of stats.json: summed, or the peak.
  EXPECT_EQ(row(report["counters"], "tilecore.triangles")["a"], 4400);
  EXPECT_EQ(row(report["counters"], "binner.queue_bytes_peak")["a"], 1200);
  EXPECT_EQ(report["bound_by"], json({{"a", "shader"}, {"b", "texture"}}));
}

TEST_F(Compare, FramesOfOtherNumbersAreComparedAsTheyAre) {
  const json report = compared({run("a", statistics({1000})), run("b", statistics({3000}, 7))});
  EXPECT_TRUE(report["frames_compared"].empty());
  EXPECT_THAT(report["notes"][0].get<std::string>(), HasSubstr("the runs have no frame in common"));
  EXPECT_EQ(row(report["summary"], "cycles")["b"], 3000);
}

TEST_F(Compare, AnyNumberOfReplaysStandSideBySide) {
  const std::string a = run("a", statistics({1000})), b = run("b", statistics({1100})), c = run("c", statistics({900}));
  const json report = compared({a, b + "/stats.json", c});
  EXPECT_EQ(report["runs"].size(), 3u);
  EXPECT_EQ(row(report["summary"], "cycles"), json({{"name", "cycles"}, {"a", 1000}, {"b", 1100}, {"c", 900}}));
  EXPECT_THAT(report["why"]["c"]["text"].get<std::string>(), HasSubstr("C takes 10.0 % less time than A"));
  const ProcessResult csv = run_tessera({"compare", a, b, c, "--csv"});
  EXPECT_THAT(csv.output, testing::StartsWith("section,name,A,B,C\nsummary,time_ms,"));
  EXPECT_THAT(csv.output, HasSubstr("\ndrawables,tree / leaf,750,825,675\n"));
  EXPECT_THAT(csv.output, HasSubstr("\nsummary,bound_by,shader,shader,shader\n"));
  EXPECT_EQ(run_label(25), "Z");
  EXPECT_EQ(run_label(26), "R27");
}

TEST_F(Compare, EqualReplaysSaySo) {
  const std::string a = run("a", statistics({1000}));
  const json report = compared({a, a});
  EXPECT_THAT(report["why"]["b"]["text"].get<std::string>(), testing::StartsWith("B takes as long as A"));
  EXPECT_EQ(report["why"]["b"]["parts"][0]["parts"][0]["text"], "nothing: same capture, machine, settings and work");
  EXPECT_TRUE(report["keys"].empty());
  const ProcessResult text = run_tessera({"compare", a, a});
  EXPECT_THAT(text.output, HasSubstr("counters of all frames: all 2 are equal"));
  EXPECT_THAT(run_tessera({"compare", a, a, "--all"}).output, HasSubstr("tilecore.triangles"));
}

TEST_F(Compare, AThresholdThatIsExceededIsStatus5) {
  const std::string a = run("a", statistics({1000})), b = run("b", statistics({1030}));
  const auto gate = [&](const std::string& first, const std::string& second, std::vector<std::string> thresholds) {
    std::vector<std::string> arguments = {"compare", first, second};
    for (const std::string& threshold : thresholds) arguments.insert(arguments.end(), {"--threshold", threshold});
    return run_tessera(arguments);
  };
  // 3 % more cycles and energy; bytes grow by 120 of 8096, 1.5 %.
  EXPECT_EQ(gate(a, b, {"4"}).status, 0);
  EXPECT_EQ(gate(b, a, {"0"}).status, 0);
  const ProcessResult over = gate(a, b, {"cycles=2"});
  EXPECT_EQ(over.status, 5);
  EXPECT_EQ(over.errors, "tessera: B: cycles +3.0 %, at most 2 % more are allowed\n");
  EXPECT_THAT(gate(a, b, {"2"}).errors, HasSubstr("B: time +3.0 %, at most 2 % more are allowed; and 1 more"));
  EXPECT_EQ(gate(a, b, {"traffic=1.4"}).status, 5);
  EXPECT_EQ(gate(a, b, {"traffic=1.6"}).status, 0);
  EXPECT_EQ(gate(a, b, {"tilecore.triangles=1"}).status, 5);
  EXPECT_EQ(gate(a, b, {"tilecore.triangles=3"}).status, 0);
  for (const char* wrong : {"cycles=", "cycles=-1", "=1", "cycles=nan", "2%"})
    EXPECT_EQ(gate(a, b, {wrong}).status, 2) << wrong;
  EXPECT_THAT(gate(a, b, {"flip=0.1"}).errors, HasSubstr("there are no images to compare"));
}

// A counter that grew from zero exceeds any percentage.
TEST_F(Compare, ACounterThatIsNewExceedsEveryThreshold) {
  json with = statistics({1000});
  with["frames"][0]["counters"]["binner.partial_renders"] = 1;
  const std::string a = run("a", statistics({1000})), b = run("b", with);
  EXPECT_EQ(run_tessera({"compare", a, b, "--threshold", "binner.partial_renders=1000"}).status, 5);
  EXPECT_EQ(run_tessera({"compare", b, a, "--threshold", "binner.partial_renders=0"}).status, 0);
}

TEST_F(Compare, RealReplaysAndRecordsTimedAgain) {
  const auto replay = [&](const char* name, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"replay",  test::shipped_capture("vases").string(),
                                          "--size",  "96x64",
                                          "--quiet", "--no-report",
                                          "--out",   (folder_ / name).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(run_tessera(arguments).status, 0);
    return (folder_ / name).string();
  };
  const std::string a = replay("a", {"--record", (folder_ / "a.record").string()}),
                    b = replay("b", {"--set", "tile.width=8", "--set", "tile.height=8"});
  const json report = compared({a, b});
  const json stats = json::parse(test::read_text(folder_ / "b" / "stats.json"));
  EXPECT_EQ(row(report["summary"], "cycles")["b"], stats["total"]["timing"]["cycles"]);
  EXPECT_EQ(row(report["keys"], "tile.width"), json({{"name", "tile.width"}, {"a", 32}, {"b", 8}})) << report["keys"];
  EXPECT_EQ(report["frames"].size(), 1u);
  // Images are the same for any tile size.
  EXPECT_EQ(run_tessera({"compare", a, b, "--threshold", "max=0", "--threshold", "ssim=1"}).status, 0);
  ASSERT_EQ(run_tessera({"time", (folder_ / "a.record").string(), "--set", "clock.mhz=400", "--json",
                         (folder_ / "time.json").string()})
                .status,
            0);
  EXPECT_THAT(compared({a, (folder_ / "time.json").string()})["why"]["b"]["text"].get<std::string>(),
              HasSubstr("more time than A"));
}

TEST_F(Compare, ThresholdsOfImages) {
  const auto image = [&](const char* name, std::uint8_t value) {
    Image8 made(16, 16, 3);
    made.values.assign(made.values.size(), value);
    write_png(folder_ / name, made);
    return (folder_ / name).string();
  };
  const std::string a = image("a.png", 100), b = image("b.png", 151), c = image("c.png", 100);
  EXPECT_EQ(run_tessera({"compare", a, c, "--threshold", "psnr=60"}).status, 0);  // identical: any
  // A difference of 0.2 is a PSNR of 14 dB.
  EXPECT_EQ(run_tessera({"compare", a, b, "--threshold", "psnr=13.9"}).status, 0);
  const ProcessResult r = run_tessera({"compare", a, c, b, "--threshold", "psnr=14.1", "--threshold", "max=0.1"});
  EXPECT_EQ(r.status, 5);
  EXPECT_THAT(r.errors, HasSubstr("b.png: psnr 13.979, at least 14.1 is allowed; and 1 more"));
  EXPECT_EQ(run_tessera({"compare", a, b, "--threshold", "cycles=1"}).status, 2);
}

// Whatever a file holds, it is its fault.
TEST_F(Compare, StatisticsOfAnyShapeEndWithStatus0Or3) {
  const std::string good = run("good", statistics({1000}));
  for (const char* frames :
       {"7", "[]", "[7]", R"([{"frame":-1}])", R"([{"frame":0,"timing":[],"dram":{},"energy":7,"counters":[]}])",
        R"([{"frame":0,"dram":[7,{"unit":1}],"drawables":[[]],"timing":{"units":{"x":7},"events":7}}])"}) {
    json root = statistics({1000});
    root["frames"] = json::parse(frames);
    const ProcessResult r = run_tessera({"compare", good, run("bad", root)});
    EXPECT_TRUE(r.status == 0 || r.status == 3) << frames << r.errors;
    EXPECT_EQ(run_tessera({"compare", run("bad", root), good}).status, r.status);
  }
}

}  // namespace
}  // namespace tessera::replay::compare_test
