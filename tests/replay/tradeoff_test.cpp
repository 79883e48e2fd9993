// `tessera tradeoff`: fronts, words, knobs, and the command as a whole.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "gpu/view_inputs.h"
#include "replay/sweep/columns.h"
#include "replay/tradeoff/tradeoff.h"
#include "replay/tradeoff/tradeoff_words.h"
#include "scene/capture_reader.h"
#include "tests/support/captures.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using test::ProcessResult;
using test::run_tessera;
using testing::HasSubstr;
namespace fs = std::filesystem;

// ---- Fronts -----------------------------------------------------------------------------------------------------

bool beats(const ErrorAndCost& b, const ErrorAndCost& a) {
  return b.error <= a.error && b.cost <= a.cost && (b.error < a.error || b.cost < a.cost);
}

TEST(ParetoFront, IsWhatNoOtherPointBeats) {  // TO2
  test::Random random(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<ErrorAndCost> points;
    for (int k = 0; k < 12; ++k)
      points.push_back({static_cast<double>(random.integer(0, 5)), static_cast<double>(random.integer(0, 5))});
    const std::vector<bool> front = pareto_front(points);
    EXPECT_TRUE(std::any_of(front.begin(), front.end(), [](bool on) { return on; }));
    for (std::size_t a = 0; a < points.size(); ++a) {
      // On the front: none beats it. Off it: one of the front does.
      const bool beaten =
          std::any_of(points.begin(), points.end(), [&](const ErrorAndCost& b) { return beats(b, points[a]); });
      EXPECT_EQ(front[a], !beaten);
      bool by_front = false;
      for (std::size_t b = 0; b < points.size(); ++b) by_front = by_front || (front[b] && beats(points[b], points[a]));
      EXPECT_EQ(!front[a], by_front);
    }
  }
  EXPECT_EQ(pareto_front({{1, 1}, {1, 1}}), (std::vector<bool>{true, true})) << "equal points do not beat each other";
}

json row(const char* label, double flip, double psnr, double cycles, bool in_double = false) {
  return {{"label", label},
          {"error", {{"flip", flip}, {"psnr_db", psnr}}},
          {"cycles", cycles},
          {"dram_bytes", 1},
          {"energy_nj", 1.0},
          {"watched", nullptr},
          {"picture", label},
          {"in_double", in_double},
          {"host", {{"seconds", {{"median", 1.0}}}, {"processor_seconds", {{"median", 1.0}}}}}};
}

TEST(Cheapest, IsTheLeastCostAmongThoseGoodEnough) {
  const json tradeoff = {
      {"knobs",
       {{{"name", "a"}, {"settings", {row("bad", 0.2, 20, 10), row("good", 0.04, 32, 50), row("best", 0.01, 40, 90)}}},
        {{"name", "b"}, {"settings", {row("too good", 0.0, 99, 1, true)}}}}}};
  EXPECT_EQ(cheapest(tradeoff, "cycles", 0.05, {})["label"], "good");
  EXPECT_EQ(cheapest(tradeoff, "cycles", {}, 35)["label"], "best");
  EXPECT_EQ(cheapest(tradeoff, "cycles", 0.05, 35)["label"], "best") << "both must hold";
  EXPECT_EQ(cheapest(tradeoff, "cycles", {}, {})["label"], "bad");
  EXPECT_TRUE(cheapest(tradeoff, "cycles", 0.001, {}).is_null()) << "what runs in double is no machine";
}

TEST(Words, SayWhatASettingCostsAndSaves) {
  json float_row = row("float", 0.1, 30.0, 1000), packed = row("packed", 0.1, 29.9, 1000);
  const json knob = {{"watched_as", "resolve cycles"}};
  float_row["watched"] = 200;
  packed["watched"] = 176;
  EXPECT_EQ(setting_in_words(packed, float_row, knob),
            "packed: costs 0.10 dB against float; saves 12.0 % of resolve cycles");
  packed["error"]["psnr_db"] = 30.25;
  packed["cycles"] = 2500;
  EXPECT_EQ(setting_in_words(packed, float_row, knob),
            "packed: gains 0.25 dB over float; saves 12.0 % of resolve cycles, takes 2.50 times the cycles");
  packed["picture"] = float_row["picture"];
  packed["watched"] = 200;
  packed["cycles"] = 1031;
  EXPECT_EQ(setting_in_words(packed, float_row, knob), "packed: the same image as float; takes 3.1 % more cycles");
}

// ---- Knobs ------------------------------------------------------------------------------------------------------

TEST(Knobs, HaveKeysThatExistValuesThatFitAndColumnsThatAreCounted) {
  std::set<std::string> names;
  for (const Knob& knob : knobs()) {
    EXPECT_TRUE(names.insert(knob.name).second) << knob.name;
    ASSERT_LT(knob.against, knob.settings.size()) << knob.name;
    EXPECT_GE(knob.settings.size(), 2u);
    for (const KnobSetting& setting : knob.settings) {
      gpu::RunSettings settings;
      gpu::GpuConfiguration gpu;
      EXPECT_NO_THROW(apply(knob.context, settings, gpu)) << knob.name;
      EXPECT_NO_THROW(apply(setting.values, settings, gpu)) << knob.name << " " << setting.label;
      EXPECT_NO_THROW(gpu::check_gpu(gpu));
    }
    const std::vector<std::string>& columns = known_columns();
    if (!knob.watched.empty() && !knob.watched.starts_with("timing.units.")) {
      EXPECT_NE(std::find(columns.begin(), columns.end(), knob.watched), columns.end()) << knob.watched;
    }
  }
  EXPECT_THROW(knob_named("smaples"), UsageError);
}

// The settings that the others are compared with are the machine's defaults, but for what the knob's context says.
TEST(Knobs, CompareWithTheDefaults) {
  for (const Knob& knob : knobs()) {
    if (knob.name.starts_with("reconstruction")) continue;  // with exact weights
    gpu::RunSettings settings, plain;
    gpu::GpuConfiguration gpu, plain_gpu;
    apply(knob.context, settings, gpu);
    apply(knob.context, plain, plain_gpu);
    apply(knob.settings[knob.against].values, settings, gpu);
    EXPECT_EQ(settings_json(settings), settings_json(plain)) << knob.name;
    EXPECT_EQ(gpu::gpu_json(gpu), gpu::gpu_json(plain_gpu)) << knob.name;
  }
}

TEST(Knobs, AreLeftOutWhereTheyChangeNothing) {
  const auto reason = [](const char* capture_name, const char* knob) {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(capture_name));
    const scene::Assembly assembly = scene::assemble(capture);
    const auto frame = scene::pose_frame(assembly, gpu::frame_camera(capture, {}, 64, 36),
                                         gpu::frame_request(capture, {}, {}, 64, 36, capture.settings.first_frame));
    return why_without_effect(knob_named(knob), *frame, false);
  };
  EXPECT_THAT(reason("vases", "temporal_pattern"), HasSubstr("nothing moves"));
  EXPECT_THAT(reason("vases", "lens_points"), HasSubstr("no lens"));
  EXPECT_THAT(reason("serpent", "displacement"), HasSubstr("nothing is displaced"));
  EXPECT_THAT(reason("serpent", "procedure_spacing"), HasSubstr("no procedures"));
  for (const char* knob : {"procedure_path", "procedure_spacing", "procedure_cells"})
    EXPECT_EQ(reason("workshop", knob), "") << knob;
  EXPECT_THAT(reason("serpent", "advection"), HasSubstr("no frame before"));
  for (const char* knob : {"temporal_pattern", "lens_points", "displacement", "edge", "samples"})
    EXPECT_EQ(reason("eggs", knob), "") << knob;
}

// ---- The command ------------------------------------------------------------------------------------------------

class TradeoffCommand : public testing::Test {
 protected:
  ProcessResult run(const std::string& out, std::vector<std::string> more, const char* capture = "eggs") {
    std::vector<std::string> arguments = {"tradeoff", test::shipped_capture(capture).string(),
                                          "--out",    (folder_ / out).string(),
                                          "--size",   "64x36",
                                          "--rounds", "1",
                                          "--run",    "2"};
    if (std::find(more.begin(), more.end(), "--reference-samples") == more.end())
      arguments.insert(arguments.end(), {"--reference-samples", "32"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments);
  }
  json result(const std::string& out) { return json::parse(test::read_text(folder_ / out / "tradeoff.json")); }
  // Without what the host's clock says.
  static json timeless(json value) {
    if (value.is_object()) {
      value.erase("host");
      for (auto& [name, member] : value.items()) member = timeless(member);
    }
    if (value.is_array())
      for (json& member : value) member = timeless(member);
    return value;
  }
  std::map<std::string, fs::file_time_type> files(const std::string& out) {
    std::map<std::string, fs::file_time_type> times;
    for (const char* part : {"points", "reference"})
      for (const auto& entry : fs::directory_iterator(folder_ / out / part))
        times[entry.path().filename().string()] = entry.last_write_time();
    return times;
  }
  test::TemporaryFolder folder_;
};

const std::vector<std::string> kSome = {"--knobs", "samples,lens_points,displacement,arithmetic,desampling", "--quiet"};

TEST_F(TradeoffCommand, FollowsFromItsInputsButForTimes) {  // TO1
  std::vector<std::string> one = kSome, two = kSome;
  one.insert(one.end(), {"--threads", "1"});
  two.insert(two.end(), {"--threads", "2"});
  ASSERT_EQ(run("a", one).status, 0);
  ASSERT_EQ(run("b", two).status, 0);
  EXPECT_EQ(timeless(result("a")), timeless(result("b")));
  EXPECT_NE(result("a"), result("b")) << "the twin: times differ";
}

TEST_F(TradeoffCommand, DoesNotRunAgainWhatIsThere) {  // TO3
  ASSERT_EQ(run("a", kSome).status, 0);
  const auto first = files("a");
  const json before = result("a");
  ASSERT_EQ(run("a", kSome).status, 0);
  EXPECT_EQ(files("a"), first);
  EXPECT_EQ(result("a"), before);
  // A lost trial, and only that, is run again.
  const auto gone = std::find_if(first.begin(), first.end(),
                                 [&](const auto& f) { return fs::exists(folder_ / "a" / "points" / f.first); });
  fs::remove(folder_ / "a" / "points" / gone->first);
  ASSERT_EQ(run("a", kSome).status, 0);
  auto again = files("a");
  EXPECT_NE(again[gone->first], gone->second);
  again[gone->first] = gone->second;
  EXPECT_EQ(again, first);
  EXPECT_EQ(timeless(result("a")), timeless(before));
}

TEST_F(TradeoffCommand, ErrorFallsWithSamplesAndTheDoubleOneIsNearTheSingleOne) {
  ASSERT_EQ(
      run("a", {"--knobs", "samples,arithmetic", "--quiet", "--reference-edge", "0", "--reference-samples", "256"})
          .status,
      0);
  const json knobs_json = result("a")["knobs"];
  const auto knob = [&](const char* name) {
    return *std::find_if(knobs_json.begin(), knobs_json.end(), [&](const json& k) { return k["name"] == name; });
  };
  const json samples = knob("samples")["settings"], arithmetic = knob("arithmetic")["settings"];
  EXPECT_GT(samples[0]["error"]["flip"], samples[3]["error"]["flip"]);
  EXPECT_GT(samples[3]["error"]["flip"], samples[6]["error"]["flip"]);
  EXPECT_LT(samples[0]["cycles"], samples[6]["cycles"]);
  EXPECT_TRUE(samples[2]["base"]);
  EXPECT_EQ(arithmetic[0]["cycles"], nullptr);
  EXPECT_NEAR(arithmetic[0]["error"]["psnr_db"].get<double>(), arithmetic[1]["error"]["psnr_db"].get<double>(), 0.1);
}

TEST_F(TradeoffCommand, PrintsArgumentsThatReplayTakes) {
  const ProcessResult r = run("a", {"--knobs", "samples,shading", "--max-flip", "0.9", "--set", "tile.width=16"});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, HasSubstr("cheapest by cycles"));
  const std::string arguments = result("a")["cheapest"]["setting"]["arguments"];
  EXPECT_THAT(arguments, HasSubstr("--set tile.width=16"));
  std::vector<std::string> replay = {"replay",  test::shipped_capture("eggs").string(),
                                     "--size",  "64x36",
                                     "--quiet", "--no-report",
                                     "--out",   (folder_ / "r").string()};
  std::istringstream words(arguments);
  for (std::string word; words >> word;) replay.push_back(word);
  ASSERT_EQ(run_tessera(replay).status, 0);
  const json stats = json::parse(test::read_text(folder_ / "r" / "stats.json"));
  EXPECT_EQ(stats["frames"][0]["timing"]["cycles"], result("a")["cheapest"]["setting"]["cycles"])
      << "the same machine does the same work";
  EXPECT_THAT(run("a", {"--knobs", "samples", "--max-flip", "0"}).output, HasSubstr("no setting that was tried"));
}

TEST_F(TradeoffCommand, TurnsKnobsTogether) {
  ASSERT_EQ(run("a", {"--joint", "samples,shading", "--knobs", "samples", "--quiet"}).status, 0);
  const json knobs_json = result("a")["knobs"];
  ASSERT_EQ(knobs_json.back()["name"], "joint");
  std::size_t expected = 1;
  for (const json& knob : knobs_json) {
    if (knob["name"] == "joint") continue;
    expected *=
        static_cast<std::size_t>(std::count_if(knob["settings"].begin(), knob["settings"].end(), [](const json& r) {
          return r["front"]["cycles"] == true || r["base"] == true;
        }));
  }
  EXPECT_EQ(knobs_json.back()["settings"].size(), expected);
  EXPECT_GT(expected, 2u);
  EXPECT_THAT(run("a", {"--joint", "samples,shading", "--max-points", "2"}).errors, HasSubstr("--max-points allows 2"));
  EXPECT_THAT(run("a", {"--joint", "reconstruction,reconstruction_4"}).errors,
              HasSubstr("would be set by two of the knobs"));
}

TEST_F(TradeoffCommand, CtrlCStopsAmongTheRoundsOfAKnobAndTheNextRunGoesOn) {
  const std::vector<std::string> arguments = {"tradeoff",
                                              test::shipped_capture("eggs").string(),
                                              "--out",
                                              (folder_ / "a").string(),
                                              "--size",
                                              "64x36",
                                              "--reference-samples",
                                              "4",
                                              "--knobs",
                                              "box_bits",
                                              "--rounds"};
  std::vector<std::string> long_one = arguments, short_one = arguments;
  long_one.emplace_back("1000");
  short_one.emplace_back("1");
  const ProcessResult stopped = run_tessera(long_one, {.interrupt_after_ms = 2000});
  EXPECT_EQ(stopped.status, 0) << stopped.errors;
  EXPECT_TRUE(result("a").at("stopped").get<bool>());
  EXPECT_TRUE(result("a").at("knobs").empty());
  EXPECT_EQ(run_tessera(short_one).status, 0);
  EXPECT_FALSE(result("a").at("stopped").get<bool>());
  EXPECT_EQ(result("a").at("knobs").at(0).at("settings").size(), 3u);
}

TEST_F(TradeoffCommand, RefusesWhatItCannotCompare) {
  EXPECT_THAT(run("a", {"--knobs", "smaples"}).errors, HasSubstr("samples"));
  EXPECT_EQ(run("a", {"--knobs", "smaples"}).status, 2);
  EXPECT_EQ(run("a", {"--cost", "money"}).status, 2);
  EXPECT_EQ(run("a", {"--set", "stereo.eye_separation=0.1"}).status, 2);
  EXPECT_EQ(run("a", {"--set", "output.machine_model=false"}).status, 2);
  EXPECT_EQ(run("a", {"--reference-edge", "-1"}).status, 2);
  EXPECT_EQ(run("a", {"--max-memory", "0.0001"}).status, 4);
}

}  // namespace
}  // namespace tessera::replay
