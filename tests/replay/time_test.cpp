// Records timed again: the same cycles and energies as a replay on that machine.
#include "base/error.h"
#include "gpu/device.h"
#include "gpu/tile_memory.h"
#include "replay/describe.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::replay::time_test {
namespace {

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

TEST_F(Time, EqualsTheReplayItself) {
  const json stats = replay("eggs", {}, "plain");
  const ProcessResult done = time("plain", {});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("bound by"));
  expect_same(times(), stats);
}

TEST_F(Time, EqualsAReplayOnTheOtherMachine) {
  const std::vector<std::string> machine = {"shader.lanes=64",   "clock.mhz=400",      "tilecore.count=2",
                                            "memory.channels=2", "energy.texel_pj=40", "tilecore.memory_bytes=262144"};
  replay("stroll", {}, "plain");
  const json stats = replay("stroll", machine, "other");
  EXPECT_EQ(time("plain", machine).status, 0);
  expect_same(times(), stats);
}

// Question: how much do 30 % more bandwidth give? One key multiplies the value of the record's machine.
TEST_F(Time, ANumberIsSetAsAMultipleOfTheMachines) {
  const json stats = replay("eggs", {"clock.mhz=500", "memory.model=fluid"}, "plain");
  const auto cycles = [&](const std::vector<std::string>& sets) {
    const ProcessResult done = time("plain", sets);
    EXPECT_EQ(done.status, 0) << done.errors;
    const json of = times();
    return std::pair(of["gpu"], of["total"]["timing"]["cycles"].get<std::uint64_t>());
  };
  const double now = stats["gpu"]["memory"]["gb_per_s"];
  const auto more = cycles({"memory.gb_per_s=x1.3"}), same = cycles({fmt::format("memory.gb_per_s={}", now * 1.3)});
  EXPECT_EQ(more, same);
  EXPECT_EQ(more.first["memory"]["gb_per_s"], now * 1.3);
  EXPECT_EQ(more.first["clock"]["mhz"], 500);
  EXPECT_LT(more.second, stats["total"]["timing"]["cycles"].get<std::uint64_t>()) << "eggs wait for DRAM in part";
  EXPECT_EQ(cycles({"memory.gb_per_s=*1.3"}), same);
  EXPECT_EQ(cycles({"memory.bytes_per_clk=x1.3"}), same);
  EXPECT_EQ(cycles({"shader.lanes=x2", "shader.lanes=x0.5"}).first, cycles({}).first) << "one after the other";

  struct Wrong {
    const char *set, *message;
  };
  for (const Wrong& wrong :
       {Wrong{"shader.lanes=x1.3", "not a whole number: set shader.lanes="},
        Wrong{"memory.gb_per_s=x", "'x' is no multiple: write xFACTOR, as in x1.3"},
        Wrong{"memory.gb_per_s=x-1", "is no multiple"}, Wrong{"memory.gb_per_s=x1e9", "memory.gb_per_s: "},
        Wrong{"machine.timing=x2", "machine.timing: 'x2'"}, Wrong{"sampling.seed=x2", "only numbers of the machine"}}) {
    const ProcessResult done = time("plain", {wrong.set});
    EXPECT_EQ(done.status, 2) << wrong.set;
    EXPECT_THAT(done.errors, HasSubstr(wrong.message));
  }
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

// The change by a doubled number equals the change of a replay on that machine.
TEST_F(Time, SensitivityEqualsAReplayOnTheOtherMachine) {
  const json stats = replay("eggs", {}, "plain"), faster = replay("eggs", {"shader.lanes=64"}, "faster");
  const ProcessResult done =
      run_tessera({"time", record("plain"), "--sensitivity", "--json", (folder_ / "time.json").string()});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("shader.lanes"));
  const json rows = times()["sensitivity"]["numbers"];
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

// Each split of a frame adds up to it, and names parts of the capture.
TEST_F(Time, SplitsAFrame) {
  replay("garden", {}, "plain");
  const auto split = [&](const std::string& by) {
    const ProcessResult done =
        run_tessera({"time", record("plain"), "--split", by, "--json", (folder_ / "time.json").string()});
    EXPECT_EQ(done.status, 0) << done.errors;
    return times()["split"]["views"][0];
  };
  const json drawables = split("drawables");
  const double frame = times()["frames"][0]["timing"]["cycles"], nj = times()["frames"][0]["energy"]["total_nj"];
  const json counters = json::parse(test::read_text(folder_ / "plain" / "stats.json"))["frames"][0]["counters"];
  const double moved = counters["dram.read_bytes"].get<double>() + counters["dram.written_bytes"].get<double>();
  for (const json& rows : {drawables, split("materials")}) {
    double cycles = 0, shaded = 0, bytes = 0, energy = 0, last = 1e30;
    for (const json& row : rows) {
      cycles += row["cycles"].get<double>(), shaded += row["invocations"].get<double>();
      bytes += row["dram_bytes"].get<double>(), energy += row["energy_nj"].get<double>();
      EXPECT_LE(row["cycles"], last);
      last = row["cycles"];
    }
    EXPECT_NEAR(cycles, frame, 1);
    EXPECT_EQ(shaded, counters["tilecore.pixel_shader_invocations"]);
    EXPECT_EQ(bytes, moved);
    EXPECT_NEAR(energy / nj, 1, 1e-9);
  }
  EXPECT_GT(drawables.size(), 2u);
  EXPECT_NE(drawables[0]["node"], "");
  const json tiles = split("tiles");
  EXPECT_EQ(tiles.size(), 3u * 2u);  // of 32x32 in 96x64
  for (const json& tile : tiles) {
    EXPECT_LE(tile["cycles"], frame);
    EXPECT_NE(tile["bound_by"], "");
    EXPECT_LE(tile["bound_by_cycles"], tile["cycles"]);
  }
  const ProcessResult wrong = run_tessera({"time", record("plain"), "--split", "pixels"});
  EXPECT_EQ(wrong.status, 2);
  EXPECT_THAT(wrong.errors, HasSubstr("--split: 'pixels' is none of drawables, materials, tiles"));
}

// Each assumed number at both of its ends; the verdict hangs on those with which something else bounds the frame.
TEST_F(Time, SensitivityNamesTheNumbersThatDecideTheVerdict) {
  replay("eggs", {}, "plain");
  const ProcessResult done =
      run_tessera({"time", record("plain"), "--sensitivity", "--json", (folder_ / "time.json").string()});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("all assumed numbers, independent of each other: cycles -"));
  const json all = times()["sensitivity"];
  EXPECT_EQ(all["bound_by"], times()["frames"][0]["timing"]["bound_by"]);
  std::vector<std::string> others;
  double less = 0;
  for (const json& row : all["numbers"]) {
    for (int end = 0; end < 2; ++end)
      if (row["assumed"] == true && row["bound_by"][end] != all["bound_by"] &&
          (others.empty() || others.back() != row["key"]))
        others.push_back(row["key"]);
    if (row["assumed"] == true)
      less += std::pow(std::min({row["energy"][0].get<double>() - 1, row["energy"][1].get<double>() - 1, 0.0}), 2);
    if (row["key"] == "memory.gpu_share") {
      EXPECT_EQ(row["ends"], json({0.5, 0.9}));
    }
    if (row["key"] == "energy.leakage_mw_per_mm2") {
      EXPECT_EQ(row["cycles"], json({1, 1}));
      EXPECT_GT(row["energy"][1].get<double>(), 1);
    }
  }
  EXPECT_EQ(all["verdict_hangs_on"], json(others));
  EXPECT_NEAR(all["energy"][0].get<double>(), std::sqrt(less), 1e-12);
  // The same, right after a replay.
  const ProcessResult replayed =
      run_tessera({"replay", test::shipped_capture("eggs").string(), "--size", "96x64", "--frames", "3:5", "--quiet",
                   "--no-report", "--sensitivity", "--out", (folder_ / "again").string()});
  EXPECT_EQ(replayed.status, 0) << replayed.errors;
  EXPECT_EQ(json::parse(test::read_text(folder_ / "again" / "stats.json"))["sensitivity"], all);
}

// A verdict does not hang on anything where one unit is far slower than all others.
TEST_F(Time, AVerdictThatIsClearHangsOnNothing) {
  replay("eggs", {}, "plain");
  const ProcessResult done = run_tessera(
      {"time", record("plain"), "--sensitivity", "--set", "memory.model=fluid", "--set", "memory.gb_per_s=0.01"});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr("bound by dram, which hangs on none of them alone"));
}

// Whoever reads a time of another model than the default is told.
TEST_F(Time, CoarserModelsAreNamedWhereTheirFiguresAre) {
  const auto replayed = [&](const char* name, const std::vector<std::string>& models) {
    std::vector<std::string> arguments = {"replay",
                                          test::shipped_capture("vases").string(),
                                          "--size",
                                          "64x36",
                                          "--no-report",
                                          "--out",
                                          (folder_ / name).string(),
                                          "--record",
                                          record(name)};
    for (const std::string& model : models) arguments.insert(arguments.end(), {"--set", model});
    const ProcessResult done = run_tessera(arguments);
    EXPECT_EQ(done.status, 0) << done.errors;
    return done.output;
  };
  const std::string phases = "timed by machine.timing=phases, a coarser model than the default",
                    both = "timed by memory.model=fluid and shader.costs=constant, coarser models than the default";
  EXPECT_THAT(replayed("finest", {}), testing::Not(HasSubstr("coarser")));
  EXPECT_THAT(replayed("phases", {"machine.timing=phases"}), HasSubstr(phases));
  EXPECT_THAT(replayed("both", {"memory.model=fluid", "shader.costs=constant"}), HasSubstr(both));
  EXPECT_THAT(time("finest", {}).output, testing::Not(HasSubstr("coarser")));
  EXPECT_THAT(time("finest", {"machine.timing=phases"}).output, HasSubstr(phases));
  const ProcessResult compared = run_tessera({"compare", (folder_ / "finest").string(), (folder_ / "both").string()});
  EXPECT_THAT(compared.output, HasSubstr("B is " + both));
  EXPECT_THAT(compared.output, testing::Not(HasSubstr("A is timed")));
}

TEST_F(Time, AMachineThatCannotBeBuiltIsRefused) {
  replay("eggs", {}, "plain");
  const ProcessResult small = time("plain", {"tilecore.memory_bytes=40960"});
  EXPECT_EQ(small.status, 2);
  EXPECT_THAT(small.errors,
              HasSubstr("40960 bytes hold no tile of 32x32 pixels with 4 samples of 12 bytes: set 49152"));
  const ProcessResult registers = time("plain", {"shader.costs=constant", "shader.register_bytes=4096"});
  EXPECT_EQ(registers.status, 2);
  EXPECT_THAT(registers.errors, HasSubstr("shader.register_bytes: 4096 bytes hold no warp"));
  const ProcessResult clock = time("plain", {"clock.mhz=1500"});
  EXPECT_EQ(clock.status, 2);
  EXPECT_THAT(clock.errors, HasSubstr("voltage.nominal_mhz"));
  const ProcessResult compiled = time("plain", {"shader.register_bytes=1024"});
  EXPECT_EQ(compiled.status, 2);
  EXPECT_THAT(compiled.errors, HasSubstr("a shader of the frame takes"));
  EXPECT_EQ(time("plain", {"energy.leakage_mw=3"}).status, 2);
}

// The samples need more than a preset's tile memory: the machine has the memory that they need, and says so.
TEST_F(Time, AReplayOfMoreSamplesHasTheTileMemoryThatItNeeds) {
  const ProcessResult done =
      run_tessera({"replay", test::shipped_capture("eggs").string(), "--size", "96x64", "--spp", "16", "--frames",
                   "3:4", "--no-report", "--gpu", "entry-mobile", "--out", (folder_ / "many").string()});
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.errors, HasSubstr("note: tilecore.memory_bytes: 40960 bytes hold no tile of 16x16"));
  const json stats = json::parse(test::read_text(folder_ / "many" / "stats.json"));
  EXPECT_EQ(stats["gpu"]["tilecore"]["memory_bytes"], 16 * 16 * 16 * 12);
  EXPECT_EQ(stats["gpu_notices"].size(), 1u);
  double mm2 = 0;
  for (const auto& [unit, area] : stats["total"]["area"]["by_unit"].items()) mm2 += area.get<double>();
  EXPECT_EQ(stats["total"]["area"]["total_mm2"], mm2);
}

TEST_F(Time, RefusesOtherFiles) {
  EXPECT_EQ(run_tessera({"time", (folder_ / "none").string()}).status, 3);
  const ProcessResult capture = run_tessera({"time", test::shipped_capture("eggs").string()});
  EXPECT_EQ(capture.status, 3);
  EXPECT_THAT(capture.errors, HasSubstr("is a capture"));
  const ProcessResult modelless =
      run_tessera({"replay", test::shipped_capture("eggs").string(), "--out", (folder_ / "x").string(), "--record",
                   record("x"), "--set", "output.machine_model=false"});
  EXPECT_EQ(modelless.status, 2);
}

// A value of a key that is not its default, as rows of `describe gpu` have it.
json other_value(const json& row) {
  const json& now = row["default"];
  if (row["type"] == "choice") return row["choices"][row["choices"][0] == now ? 1 : 0];
  if (row["type"] == "boolean") return !now.get<bool>();
  // A power of two further, where there is room.
  const double most = row["max"], least = row["min"], number = now;
  double other = number * 2 <= most ? number * 2 : number / 2;
  if (number == 0) other = std::min(most, 1.0);
  other = std::max(other, least);
  return row["type"] == "integer" ? json(static_cast<std::int64_t>(other)) : json(other);
}

// Every key that only timing reads, with another value.
std::vector<std::pair<std::string, json>> timing_keys() {
  std::vector<std::pair<std::string, json>> keys;
  for (const json& row : describe_json("gpu"))
    if (row["pass"] == "timing") keys.emplace_back(row["key"], other_value(row));
  return keys;
}

// A frame of eggs on the preset with one key changed; "" where there is no such machine.
std::string frame_alone(const std::shared_ptr<const gpu::PreparedCapture>& eggs, const std::string& key,
                        const json& value) {
  gpu::GpuConfiguration gpu;
  const gpu::RunSettings settings;
  if (!key.empty()) gpu::set_gpu_key(key, value, gpu);
  gpu::RenderRequest request;
  request.width = request.height = 32;
  request.region = {0, 0, 32, 32};
  try {
    gpu::check_gpu(gpu);
    gpu::fit_tile_memory(gpu, settings, key == "tilecore.memory_bytes");
    return frame_json(gpu, gpu::Device(eggs, gpu, settings, request).render(3)).dump();
  } catch (const UsageError&) {
    return "";
  }
}

// Machine files that differ in a key of timing are timed points: each equals a replay on that machine.
TEST_F(Time, PointsOfEveryTimingKeyAndOfFilesAreTimed) {
  const std::vector<std::pair<std::string, json>> changed = timing_keys();
  ASSERT_GT(changed.size(), 90u);
  json machines = {"mid-mobile"};
  for (const auto& [key, value] : changed) {
    const std::size_t dot = key.find('.');
    const json file = {{key.substr(0, dot), {{key.substr(dot + 1), value}}}};
    test::write_text(folder_ / (key + ".json"), file.dump());
    machines.push_back(key + ".json");
  }
  const json study = {{"captures", {test::shipped_capture("eggs").string()}},
                      {"size", "32x32"},
                      {"frames", "3:4"},
                      {"axes", {{{"key", "gpu"}, {"values", machines}}}}};
  test::write_text(folder_ / "study.json", study.dump());
  const ProcessResult done =
      run_tessera({"sweep", (folder_ / "study.json").string(), "--out", (folder_ / "out").string()});
  ASSERT_EQ(done.status, 0) << done.errors;
  EXPECT_THAT(done.output, HasSubstr(" 1 rendered and "));

  const json points = json::parse(test::read_text(folder_ / "out" / "sweep.json"))["points"];
  const scene::Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  const auto eggs = std::make_shared<const gpu::PreparedCapture>(capture);
  const std::string plain = frame_alone(eggs, "", {});
  int apart = 0, refused = 0;
  for (std::size_t k = 0; k < changed.size(); ++k) {
    const auto& [key, value] = changed[k];
    const std::string hash = points.at(k + 1)["hash"];
    const json result = json::parse(test::read_text(folder_ / "out" / "points" / (hash + ".json")));
    const std::string alone = frame_alone(eggs, key, value);
    EXPECT_EQ(result.contains("fault") ? "" : result["frames"][0].dump(), alone) << key;
    apart += alone != plain ? 1 : 0;
    refused += alone.empty() ? 1 : 0;
  }
  EXPECT_GT(apart, 50) << "keys that change nothing at all prove little";
  EXPECT_LT(refused, 10);
}

// Points that differ in timing keys only are one render; each has the result that it has alone.
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
  const ProcessResult dry =
      run_tessera({"sweep", (folder_ / "all.json").string(), "--out", (folder_ / "all").string(), "--dry-run"});
  EXPECT_EQ(dry.status, 0) << dry.errors;
  EXPECT_THAT(dry.output, HasSubstr("27 points: 0 are there, 3 to render and 24 to time from their records"));
  EXPECT_THAT(dry.output, HasSubstr(" s, "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "all"));
  EXPECT_THAT(sweep("all"), HasSubstr("3 rendered and 24 timed from their records"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "all" / "records")) << "gone with the last point";
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
}  // namespace tessera::replay::time_test
