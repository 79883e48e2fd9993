// The files of --trace and --dram-trace.
#include "tests/support/tests.h"

namespace tessera::replay::trace_test {
namespace {

struct Slice {
  double begin, end;
  std::string name;
};

// Slices that begin inside another of their track and end outside it, or on no track that has a name.
int misplaced(const json& trace) {
  std::map<int, std::vector<Slice>> tracks;
  std::set<int> named;
  for (const json& e : trace["traceEvents"]) {
    if (e["ph"] == "M" && e["name"] == "thread_name") named.insert(e["tid"].get<int>());
    if (e["ph"] == "X")
      tracks[e["tid"].get<int>()].push_back(
          {e["ts"].get<double>(), e["ts"].get<double>() + e["dur"].get<double>(), e["name"]});
  }
  int wrong = 0;
  for (auto& [track, slices] : tracks) {
    if (!named.contains(track)) ++wrong;
    std::sort(slices.begin(), slices.end(),
              [](const Slice& a, const Slice& b) { return a.begin != b.begin ? a.begin < b.begin : a.end > b.end; });
    std::vector<double> open;
    for (const Slice& s : slices) {
      while (!open.empty() && open.back() <= s.begin) open.pop_back();
      if (!open.empty() && s.end > open.back()) ++wrong;
      open.push_back(s.end);
    }
  }
  return wrong;
}

std::set<std::string> names(const json& trace, const char* phase, const char* key = "name") {
  std::set<std::string> all;
  for (const json& e : trace["traceEvents"])
    if (e["ph"] == phase)
      all.insert(key == std::string("track") ? e["args"].value("name", "") : e["name"].get<std::string>());
  return all;
}

std::string capture(const char* name) { return test::shipped_capture(name).string(); }

// Invariants TL1 and TL2.
TEST(Trace, IsJsonWhoseSlicesNestWithATrackForEveryUnit) {
  const test::TemporaryFolder out;
  for (const char* gpu : {"small", "middle", "large"}) {
    const std::string file = (out / "t.json").string();
    const auto r =
        run_tessera({"replay", capture("serpent"), "--size", "320x180", "--frames", "0:2", "--gpu", gpu, "--set",
                     "tessellator.domain_shading=unit", "--quiet", "--out", out.path().string(), "--trace", file});
    ASSERT_EQ(r.status, 0) << r.errors;
    const json trace = json::parse(test::read_text(file));
    EXPECT_EQ(misplaced(trace), 0) << gpu;
    const std::set<std::string> tracks = names(trace, "M", "track"), slices = names(trace, "X");
    const json stats = json::parse(test::read_text(out / "stats.json"));
    for (const char* track : {"front end", "binner", "DRAM"}) EXPECT_TRUE(tracks.contains(track)) << track;
    for (int c = 0; c < stats["gpu"]["tilecore"]["count"]; ++c)
      EXPECT_TRUE(tracks.contains("core " + std::to_string(c) + ", slot 0"));
    for (const char* slice : {"frame 0", "frame 1", "tile 0", "bound", "bin", "fetch", "tessellate", "BVH", "sample",
                              "shade", "resolve", "store", "transfer"})
      EXPECT_TRUE(slices.contains(slice)) << gpu << " " << slice;
    const std::set<std::string> counters = names(trace, "C");
    for (const char* counter : {"DRAM bandwidth", "live list memory", "tiles at work", "tiles waiting for a unit",
                                "tiles waiting for data", "busy: shader", "busy: dram"})
      EXPECT_TRUE(counters.contains(counter)) << counter;
    // The frames take as long as the statistics say.
    double end = 0;
    for (const json& e : trace["traceEvents"])
      if (e["ph"] == "X") end = std::max(end, e["ts"].get<double>() + e["dur"].get<double>());
    EXPECT_NEAR(end, stats["total"]["timing"]["cycles"].get<double>() / stats["gpu"]["clock"]["mhz"].get<double>(),
                0.01);
  }
}

// The render stages of each pass, by the pass that its slice names: the stage and the slice.
using Stages = std::map<std::string, std::map<std::string, Slice>>;
Stages stages_of(const json& trace) {
  Stages stages;
  for (const json& e : trace["traceEvents"])
    if (e["ph"] == "X" && e["args"].contains("pass")) {
      const double begin = e["ts"].get<double>();
      EXPECT_TRUE(
          stages[e["args"]["pass"]].insert({e["name"], {begin, begin + e["dur"].get<double>(), e["name"]}}).second)
          << e;
    }
  return stages;
}

std::set<std::string> names_of(const std::map<std::string, Slice>& stages) {
  std::set<std::string> names;
  for (const auto& [name, slice] : stages) names.insert(name);
  return names;
}

// A trace of the first frame of a capture with some settings.
json trace_of(const std::string& file, const std::vector<std::string>& settings) {
  const test::TemporaryFolder out;
  const std::string trace = (out / "t.json").string();
  std::vector<std::string> arguments = {"replay",  file,      "--size",      "96x54", "--frames",
                                        "0:1",     "--quiet", "--no-report", "--out", out.path().string(),
                                        "--trace", trace};
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  const auto r = run_tessera(arguments);
  EXPECT_EQ(r.status, 0) << r.errors;
  return json::parse(test::read_text(trace));
}

// Invariants RS1 and RS2: shadow passes store depths, the pass that draws stores colours.
TEST(Trace, PassesHaveTheRenderStagesOfTheirTargets) {
  const json trace = trace_of(capture("city_evening"), {});
  EXPECT_EQ(misplaced(trace), 0);
  const std::set<std::string> tracks = names(trace, "M", "track");
  for (const char* track :
       {"vertex queue", "fragment queue: Render", "fragment queue: StoreColor", "fragment queue: StoreDepth"})
    EXPECT_TRUE(tracks.contains(track)) << track;
  EXPECT_FALSE(tracks.contains("fragment queue: LoadColor"));
  const Stages stages = stages_of(trace);
  ASSERT_TRUE(stages.contains("main"));
  EXPECT_GT(stages.size(), 1u);
  for (const auto& [pass, of] : stages) {
    EXPECT_EQ(names_of(of), (std::set<std::string>{"Binning", "Render", pass == "main" ? "StoreColor" : "StoreDepth"}))
        << pass;
    // The tiles of the pass, by their own slices.
    double first = 1e9, last = 0;
    for (const json& e : trace["traceEvents"])
      if (e["ph"] == "X" && e["name"].get<std::string>().starts_with(pass + ": tile ")) {
        first = std::min(first, e["ts"].get<double>());
        last = std::max(last, e["ts"].get<double>() + e["dur"].get<double>());
      }
    EXPECT_EQ(of.at("Render").begin, first) << pass;
    EXPECT_LE(of.at("Render").end, last) << pass;
    EXPECT_EQ(of.at(pass == "main" ? "StoreColor" : "StoreDepth").end, last) << pass;
    EXPECT_LT(of.at("Binning").begin, of.at("Render").begin) << pass;
  }
}

// A partial render stores colours and depths, and loads them again.
TEST(Trace, PartialRendersLoadAndStoreColorsAndDepths) {
  const Stages whole = stages_of(trace_of(capture("serpent"), {})),
               partial = stages_of(trace_of(capture("serpent"), {"parameter_buffer.bytes=2048"}));
  EXPECT_EQ(names_of(whole.at("main")), (std::set<std::string>{"Binning", "Render", "StoreColor"}));
  EXPECT_EQ(names_of(partial.at("main")),
            (std::set<std::string>{"Binning", "LoadColor", "LoadDepth", "Render", "StoreColor", "StoreDepth"}));
  const auto& stages = partial.at("main");
  EXPECT_GT(stages.at("LoadColor").begin, stages.at("StoreColor").begin) << "a load comes after the store";
}

// Every tile has its slice, from when its core took it; none hides another.
TEST(Trace, ShowsAllTilesOfACoreAndWhereTheyAre) {
  const test::TemporaryFolder out;
  const std::string file = (out / "t.json").string();
  ASSERT_EQ(run_tessera({"replay", capture("serpent"), "--frames", "0:1", "--size", "320x180", "--set",
                         "tilecore.memory_bytes=1048576", "--quiet", "--no-report", "--out", out.path().string(),
                         "--trace", file})
                .status,
            0);
  const json trace = json::parse(test::read_text(file)), tiles = json::parse(test::read_text(out / "tiles_0000.json"));
  const int columns = tiles["grid"][0];
  const double mhz = json::parse(test::read_text(out / "stats.json"))["gpu"]["clock"]["mhz"];
  std::map<int, double> cycles;
  std::set<int> slots;
  for (const json& e : trace["traceEvents"]) {
    if (e["ph"] != "X" || !e["name"].get<std::string>().starts_with("tile ")) continue;
    const int tile = std::stoi(e["name"].get<std::string>().substr(5));
    EXPECT_EQ(e["args"]["x"], tile % columns);
    EXPECT_EQ(e["args"]["y"], tile / columns);
    cycles[tile] = e["dur"].get<double>() * mhz;
    slots.insert(e["tid"].get<int>() % 16);
  }
  EXPECT_GT(slots.size(), 1u) << "a core has room for more than one tile";
  const json& expected = tiles["costs"]["cycles"];
  ASSERT_EQ(cycles.size(), expected.size());
  for (const auto& [tile, length] : cycles)
    EXPECT_NEAR(length, expected[static_cast<std::size_t>(tile)].get<double>(), 2.0) << tile;
}

TEST(Trace, SlicesThatCrossAreFound) {
  const json tracks = {{"ph", "M"}, {"tid", 1}, {"name", "thread_name"}, {"args", {{"name", "core 0"}}}};
  const auto slice = [](double ts, double dur) {
    return json{{"ph", "X"}, {"tid", 1}, {"name", "s"}, {"ts", ts}, {"dur", dur}};
  };
  EXPECT_EQ(misplaced({{"traceEvents", {tracks, slice(0, 10), slice(0, 4), slice(4, 6), slice(10, 2)}}}), 0);
  EXPECT_EQ(misplaced({{"traceEvents", {tracks, slice(0, 10), slice(5, 6)}}}), 1);
}

// Bytes per microsecond over all windows are the bytes of the frame.
TEST(Trace, TheBandwidthCounterHoldsTheTrafficOfTheFrame) {
  const test::TemporaryFolder out;
  const std::string file = (out / "t.json").string();
  ASSERT_EQ(run_tessera({"replay", capture("eggs"), "--size", "320x180", "--quiet", "--out", out.path().string(),
                         "--trace", file})
                .status,
            0);
  const json trace = json::parse(test::read_text(file)), stats = json::parse(test::read_text(out / "stats.json"));
  std::vector<std::pair<double, double>> steps;
  for (const json& e : trace["traceEvents"])
    if (e["ph"] == "C" && e["name"] == "DRAM bandwidth") steps.push_back({e["ts"], e["args"]["GB/s"]});
  double bytes = 0;
  for (std::size_t i = 0; i + 1 < steps.size(); ++i)
    bytes += (steps[i + 1].first - steps[i].first) * steps[i].second * 1e3;
  const double moved = stats["total"]["counters"]["dram.read_bytes"].get<double>() +
                       stats["total"]["counters"]["dram.written_bytes"].get<double>();
  EXPECT_NEAR(bytes, moved, 0.01 * moved);
}

TEST(Trace, HoldsOnlyTheFramesAndTilesThatAreAskedFor) {
  const test::TemporaryFolder out;
  const std::string file = (out / "t.json").string(), dram = (out / "d.trace").string();
  ASSERT_EQ(run_tessera({"replay", capture("flyby"), "--size", "320x180", "--frames", "0:3", "--trace-frames", "1:2",
                         "--trace-tiles", "5:8", "--quiet", "--out", out.path().string(), "--trace", file,
                         "--dram-trace", dram})
                .status,
            0);
  std::set<std::string> tiles, frames;
  for (const std::string& name : names(json::parse(test::read_text(file)), "X")) {
    if (name.starts_with("tile ")) tiles.insert(name);
    if (name.starts_with("frame ")) frames.insert(name);
  }
  EXPECT_EQ(tiles, (std::set<std::string>{"tile 5", "tile 6", "tile 7"}));
  EXPECT_EQ(frames, (std::set<std::string>{"frame 1"}));
  const json events = json::parse(test::read_text(out / "stats.json"))["frames"][1]["timing"]["events"];
  const std::string text = test::read_text(dram);
  EXPECT_EQ(static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n')) * 32,
            events["dram_read_bytes"].get<std::uint64_t>() + events["dram_written_bytes"].get<std::uint64_t>());
}

TEST(DramTrace, HoldsTheModelsTrafficInTheFormatsOfBothMemorySimulators) {
  const test::TemporaryFolder out;
  for (const auto& [name, desampling] :
       {std::pair{"d.trace", "off"}, {"d.loadstore", "off"}, {"d.trace", "adaptive"}}) {
    const std::string file = (out / name).string();
    ASSERT_EQ(run_tessera({"replay", capture("vases"), "--size", "320x180", "--frames", "0:2", "--set",
                           std::string("resolve.desampling=") + desampling, "--quiet", "--out", out.path().string(),
                           "--dram-trace", file})
                  .status,
              0);
    const json events = json::parse(test::read_text(out / "stats.json"))["total"]["timing"]["events"];
    std::istringstream lines(test::read_text(file));
    std::uint64_t read = 0, written = 0, last = 0;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string address, kind;
      std::uint64_t cycle = last;
      if (name == std::string("d.trace"))
        words >> address >> kind >> cycle;
      else
        words >> kind >> address;
      ASSERT_FALSE(words.fail()) << line;
      EXPECT_EQ(address.substr(0, 2), "0x");
      EXPECT_EQ(std::stoull(address, nullptr, 16) % 32, 0u);
      EXPECT_LE(last, cycle);
      last = cycle;
      const bool write = kind == "WRITE" || kind == "ST";
      EXPECT_TRUE(write || kind == "READ" || kind == "LD") << kind;
      (write ? written : read) += 32;
    }
    EXPECT_EQ(read, events["dram_read_bytes"]);
    EXPECT_EQ(written, events["dram_written_bytes"]);
  }
}

// `tessera dram` reads the trace's unit and memory from the trace itself: it ends with the frame.
TEST(DramTrace, DescribesItselfAndEndsWithItsFrame) {
  const test::TemporaryFolder out;
  const std::string file = (out / "d.trace").string();
  for (const auto& [type, units] : {std::pair{"lpddr5-6400", std::vector<std::string>{}},
                                    {"lpddr4x-4266", {"--dram-clock", "1000", "--dram-transaction", "64"}}}) {
    std::vector<std::string> arguments = {"replay",
                                          capture("vases"),
                                          "--size",
                                          "320x180",
                                          "--set",
                                          std::string("memory.type=") + type,
                                          "--quiet",
                                          "--out",
                                          out.path().string(),
                                          "--dram-trace",
                                          file};
    arguments.insert(arguments.end(), units.begin(), units.end());
    ASSERT_EQ(run_tessera(arguments).status, 0);
    const json total = json::parse(test::read_text(out / "stats.json"))["total"];
    const ProcessResult done = run_tessera({"dram", file, "--json"});
    ASSERT_EQ(done.status, 0) << done.errors;
    const json played = json::parse(done.output);
    EXPECT_EQ(played["memory"], type);
    EXPECT_NEAR(played["end_ns"].get<double>() * 1e-6 / total["timing"]["time_ms"].get<double>(), 1, 0.02) << type;
  }
}

TEST(DramTrace, NeedsBanks) {
  const test::TemporaryFolder out;
  for (const char* coarse : {"machine.timing=phases", "memory.model=fluid"}) {
    const auto r = run_tessera({"replay", capture("vases"), "--size", "32x32", "--set", coarse, "--out",
                                out.path().string(), "--dram-trace", (out / "d.trace").string()});
    EXPECT_EQ(r.status, 2);
    EXPECT_THAT(r.errors, testing::HasSubstr("memory.model=banks"));
    EXPECT_FALSE(std::filesystem::exists(out / "d.trace"));
  }
}

TEST(Trace, WithoutTheModelIsRefused) {
  const test::TemporaryFolder out;
  const auto r = run_tessera({"replay", capture("vases"), "--size", "32x32", "--set", "output.machine_model=false",
                              "--out", out.path().string(), "--trace", (out / "t.json").string()});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.errors, testing::HasSubstr("output.machine_model"));
  EXPECT_FALSE(std::filesystem::exists(out / "t.json"));
}

TEST(SelfCheckCommand, PrintsExpectedGotAndPassAndWhyNot) {
  const test::ProcessResult table = run_tessera({"selfcheck", capture("vases")});
  EXPECT_THAT(table.output, testing::HasSubstr("lpddr5-6400"));
  EXPECT_THAT(table.output, testing::HasSubstr("vases "));
  const test::ProcessResult as_json = run_tessera({"selfcheck", "--json", capture("vases")});
  EXPECT_EQ(as_json.status, table.status);
  bool failed = false;
  for (const json& row : json::parse(as_json.output)) {
    for (const char* key : {"name", "condition", "expected", "got", "note"})
      EXPECT_FALSE(row[key].get<std::string>().empty()) << key;
    const bool no = !row["pass"].get<bool>();
    failed = failed || (no && row["reason"].get<std::string>().empty());
    EXPECT_THAT(table.output, testing::HasSubstr((no ? "NO   " : "yes  ") + row["name"].get<std::string>()));
  }
  EXPECT_EQ(table.status, failed ? 1 : 0) << table.errors;
  EXPECT_EQ(run_tessera({"selfcheck", "nosuch.glb"}).status, 3);
}

}  // namespace
}  // namespace tessera::replay::trace_test
