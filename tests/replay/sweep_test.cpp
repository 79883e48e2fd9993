// Sweeps: every point a pure function of its inputs, whatever happens on the way.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "tests/support/tests.h"

namespace tessera::replay::sweep_test {
namespace {

// 2 captures, 3 tile sizes, 2 depths, at a size that takes a moment.
json small_study() {
  return {{"title", "small"},
          {"captures", {test::shipped_capture("eggs").string(), test::shipped_capture("vases").string()}},
          {"size", "64x36"},
          {"axes",
           {{{"keys", {"tile.width", "tile.height"}}, {"values", {8, 16, 32}}},
            {{"key", "frontend.split_pixels"}, {"values", {16, 64}}}}}};
}

class Sweep : public testing::Test {
 protected:
  void write_study(const json& study) { test::write_text(folder_ / "study.json", study.dump()); }
  ProcessResult sweep(const std::string& out, std::vector<std::string> more = {},
                      const test::ProcessLimits& limits = {}) {
    std::vector<std::string> arguments = {"sweep", (folder_ / "study.json").string(), "--out",
                                          (folder_ / out).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_tessera(arguments, limits);
  }
  std::string text(const std::string& file) { return test::read_text(folder_ / file); }
  // Every file of a folder with its bytes.
  std::map<std::string, std::string> contents(const std::string& out) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / out))
      if (entry.is_regular_file())
        files[fs::relative(entry.path(), folder_ / out).string()] = test::read_text(entry.path());
    return files;
  }
  std::size_t results(const std::string& out) {
    std::size_t count = 0;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder_ / out / "points", ignored))
      count += entry.path().extension() == ".json" ? 1 : 0;
    return count;
  }
  test::TemporaryFolder folder_;
};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

// Rows of a CSV file without quotes, by the names in its head.
std::vector<std::map<std::string, std::string>> rows_of(const std::string& csv) {
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> head = split(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> cells = split(line);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c == 0) rows.emplace_back();
      rows.back()[head.at(c)] = cells[c];
    }
  }
  return rows;
}

TEST_F(Sweep, ARowPerPointAndFrameWithItsValuesAndColumns) {
  json study = small_study();
  study["captures"] = {test::shipped_capture("flyby").string()};
  study["frames"] = "0:2";
  study["columns"] = {"tilecore.triangles", "dram.binner.tile_queue.written_bytes"};
  write_study(study);
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  const std::string csv = text("out/sweep.csv");
  EXPECT_THAT(csv, testing::StartsWith("point,hash,capture,tile.width,tile.height,frontend.split_pixels,frame,status,"
                                       "tilecore.triangles,dram.binner.tile_queue.written_bytes\n"));
  const auto rows = rows_of(csv);
  ASSERT_EQ(rows.size(), 3u * 2 * 2);
  EXPECT_EQ(rows[5].at("point"), "2");
  EXPECT_EQ(rows[5].at("frame"), "1");
  EXPECT_EQ(rows[5].at("tile.width"), "16");
  EXPECT_EQ(rows[5].at("status"), "ok");
}

// Points share the capture, threads and memory; none of that may show.
TEST_F(Sweep, APointHasTheCountersOfItsReplay) {
  json study = small_study();
  study["columns"] = {"frontend.*", "binner.*",  "tilecore.*",   "resolve.*", "l2.*",
                      "lights.*",   "texture.*", "procedures.*", "dram.*",    "baseline.*"};
  study["zero_columns"] = true;
  write_study(study);
  ASSERT_EQ(sweep("out", {"--quiet", "--threads", "3"}).status, 0);
  const auto rows = rows_of(text("out/sweep.csv"));
  ASSERT_EQ(rows.size(), 12u);
  for (const std::size_t r : {std::size_t{0}, std::size_t{3}, std::size_t{10}}) {
    const auto& row = rows[r];
    const ProcessResult replay = run_tessera(
        {"replay", row.at("capture"), "--size", "64x36", "--baselines", "--quiet", "--no-report", "--set",
         "tile.width=" + row.at("tile.width"), "--set", "tile.height=" + row.at("tile.height"), "--set",
         "frontend.split_pixels=" + row.at("frontend.split_pixels"), "--out", (folder_ / "replay").string()});
    ASSERT_EQ(replay.status, 0) << replay.errors;
    const json frame = json::parse(text("replay/stats.json"))["frames"][0];
    EXPECT_EQ(row.at("frame"), frame["frame"].dump());
    for (const auto& [counter, value] : frame["counters"].items()) EXPECT_EQ(row.at(counter), value.dump()) << counter;
    for (const auto& [scheme, counters] : frame["baselines"].items())
      for (const auto& [counter, value] : counters.items())
        EXPECT_EQ(row.at("baseline." + scheme + counter.substr(8)), value.dump()) << scheme << " " << counter;
    std::uint64_t moved = 0;
    for (const auto& [column, value] : row)
      if (column.starts_with("dram.") && std::count(column.begin(), column.end(), '.') == 3)
        moved += std::stoull(value);
    EXPECT_EQ(moved, frame["counters"]["dram.read_bytes"].get<std::uint64_t>() +
                         frame["counters"]["dram.written_bytes"].get<std::uint64_t>());
  }
}

// Any member of stats.json is a column. Columns that a pattern names, or all columns where none is named, are left
// out if they are 0 in all rows.
TEST_F(Sweep, ColumnsThatSayNothingAreLeftOutUnlessTheyAreNamed) {
  json study = small_study();
  study["captures"] = {test::shipped_capture("eggs").string()};
  const auto head = [&](const json& columns) {
    if (columns.is_null())
      study.erase("columns");
    else
      study["columns"] = columns;
    write_study(study);
    EXPECT_EQ(sweep("out", {"--quiet"}).status, 0);
    const std::string csv = text("out/sweep.csv");
    return csv.substr(0, csv.find('\n'));
  };
  const std::string all = head(nullptr);
  EXPECT_THAT(all, HasSubstr(",tilecore.triangles,"));
  EXPECT_THAT(all, testing::Not(HasSubstr("binner.partial_renders"))) << "there are none";
  EXPECT_THAT(head({"binner.*", "binner.partial_renders"}), HasSubstr(",binner.partial_renders,"));
  const std::string model = head({"timing.bound_by", "timing.units.*.utilisation", "energy.by_unit.*", "effects.*",
                                  "effect_places.motion.tiles", "effect_reasons.motion"});
  for (const char* column : {"timing.bound_by", "timing.units.dram.utilisation", "energy.by_unit.shader",
                             "effects.motion", "effect_places.motion.tiles", "effect_reasons.motion"})
    EXPECT_THAT(model + ",", HasSubstr(std::string(",") + column + ",")) << model;
  EXPECT_THAT(model, testing::Not(HasSubstr("effects.stereo")));
  for (const auto& row : rows_of(text("out/sweep.csv"))) {
    EXPECT_EQ(row.at("effects.motion"), "true");
    EXPECT_GT(std::stod(row.at("timing.units.dram.utilisation")), 0);
  }
  study["zero_columns"] = true;
  EXPECT_THAT(head({"effects.*"}), HasSubstr("effects.stereo"));
}

// No record has the cycles of the other schemes: they depend on the point's own machine.
TEST_F(Sweep, PointsWithBaselinesAreAllRendered) {
  json study = small_study();
  study["captures"] = {test::shipped_capture("vases").string()};
  study["axes"] = {{{"key", "memory.channels"}, {"values", {1, 4}}}};
  study["columns"] = {"baseline.post-tessellation.cycles"};
  write_study(study);
  EXPECT_THAT(sweep("out").output, HasSubstr("2 rendered and 0 timed"));
  const auto rows = rows_of(text("out/sweep.csv"));
  EXPECT_GT(std::stod(rows.at(0).at("baseline.post-tessellation.cycles")),
            std::stod(rows.at(1).at("baseline.post-tessellation.cycles")));
}

// Invariant SW2.
TEST_F(Sweep, TheFolderIsTheSameForAnyNumberOfThreadsAndPointsAtOnce) {
  json study = small_study();
  study["pictures"] = true;
  write_study(study);
  ASSERT_EQ(sweep("one", {"--quiet", "--threads", "1"}).status, 0);
  ASSERT_EQ(sweep("many", {"--quiet", "--threads", "4"}).status, 0);
  ASSERT_EQ(sweep("wide", {"--quiet", "--threads", "4", "--jobs", "1"}).status, 0);
  const auto one = contents("one");
  EXPECT_EQ(
      one.size(),
      12u * 3 + 4);  // a result, an image and the tiles of each point; sweep.json, sweep.csv, report.html, the lock
  EXPECT_EQ(one, contents("many"));
  EXPECT_EQ(one, contents("wide"));
}

// Invariants SW1 and SW2.
TEST_F(Sweep, KilledAndStartedAgainGivesTheSameBytes) {
  json study = small_study();
  study["size"] = "320x180";
  write_study(study);
  ASSERT_EQ(sweep("whole", {"--quiet"}).status, 0);
  int kills = 0;
  for (std::size_t after = 1; after <= 7; after += 3) {
    const ProcessResult r = sweep("killed", {"--quiet"}, {.kill_when = [&] { return results("killed") >= after; }});
    kills += r.signal == SIGKILL ? 1 : 0;
    for (const auto& entry : fs::directory_iterator(folder_ / "killed" / "points"))
      if (entry.path().extension() == ".json") {
        EXPECT_TRUE(json::accept(test::read_text(entry.path()))) << entry.path();
      }
  }
  EXPECT_EQ(kills, 3);
  EXPECT_FALSE(fs::exists(folder_ / "killed" / "sweep.csv"));
  ASSERT_EQ(sweep("killed", {"--quiet"}).status, 0);
  EXPECT_EQ(contents("whole"), contents("killed"));
}

TEST_F(Sweep, HalfWrittenFilesOfAKilledRunAreRemoved) {
  write_study(small_study());
  fs::create_directories(folder_ / "out" / "points");
  test::write_text(folder_ / "out" / "points" / "0123.json.77-1.part", "{");
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  for (const auto& [name, bytes] : contents("out")) EXPECT_FALSE(name.ends_with(".part")) << name;
}

// Invariant SW3.
TEST_F(Sweep, NothingIsRenderedTwice) {
  write_study(small_study());
  EXPECT_THAT(sweep("out").output, HasSubstr("12 points: 0 were there, 12 rendered"));
  const auto before = contents("out");
  EXPECT_THAT(sweep("out").output, HasSubstr("12 points: 12 were there, 0 rendered"));
  EXPECT_EQ(contents("out"), before);
  // One result lost, and two further points.
  fs::remove(folder_ / "out" / "points" / (rows_of(text("out/sweep.csv"))[4].at("hash") + ".json"));
  json study = small_study();
  study["axes"][1]["values"].push_back(128);
  write_study(study);
  EXPECT_THAT(sweep("out").output, HasSubstr("18 points: 11 were there, 7 rendered"));
}

TEST_F(Sweep, ADamagedResultIsComputedAgain) {  // SW3
  write_study(small_study());
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  const auto whole = contents("out");
  const auto point = std::find_if(whole.begin(), whole.end(), [](const auto& file) {
    return file.first.starts_with("points/") && file.first.ends_with(".json");
  });
  json wrong = json::parse(point->second);
  wrong["frames"][0]["counters"] = 3;
  json nameless = json::parse(point->second);
  nameless["frames"][0].erase("frame");
  for (const std::string& damage : {std::string(), point->second.substr(0, point->second.size() / 2), std::string("{}"),
                                    wrong.dump(), nameless.dump()}) {
    test::write_text(folder_ / "out" / point->first, damage);
    const ProcessResult r = sweep("out");
    EXPECT_EQ(r.status, 0) << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(fs::path(point->first).filename().string() + " is damaged"));
    EXPECT_THAT(r.output, HasSubstr("12 points: 11 were there, 1 rendered"));
    EXPECT_TRUE(contents("out") == whole) << damage.substr(0, 100);
  }
}

TEST_F(Sweep, AChangedCaptureIsAnotherInput) {
  json study = small_study();
  fs::copy(test::shipped_capture("vases"), folder_ / "mine.glb");
  study["captures"] = {"mine.glb"};  // found from the folder of the study
  write_study(study);
  EXPECT_THAT(sweep("out").output, HasSubstr("0 were there, 6 rendered"));
  fs::copy(test::shipped_capture("flyby"), folder_ / "mine.glb", fs::copy_options::overwrite_existing);
  EXPECT_THAT(sweep("out").output, HasSubstr("0 were there, 6 rendered"));
}

// split.csv: rows of each point and frame, of the rendered one and of those timed from its record, that add up to the
// columns of sweep.csv; the same from shards, and gone with the study that asked for it.
TEST_F(Sweep, FramesAreSplitByDrawablesMaterialsAndTiles) {
  json study = small_study();
  study["captures"] = {test::shipped_capture("garden").string()};
  study["frames"] = "3:5";
  study["settings"] = {{"machine.timing", "events"}};
  study["axes"] = {{{"key", "shader.lanes"}, {"values", {8, 32}}}};
  study["columns"] = {"tilecore.pixel_shader_invocations",
                      "dram.read_bytes",
                      "dram.written_bytes",
                      "timing.cycles",
                      "timing.bound_by",
                      "energy.total_nj"};
  study["split"] = {"tiles", "drawables", "materials"};
  write_study(study);
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  const auto frames = rows_of(text("out/sweep.csv")), parts = rows_of(text("out/split.csv"));
  ASSERT_EQ(frames.size(), 4u);
  for (const auto& frame : frames) {
    std::map<std::string, std::map<std::string, double>> sums;
    std::map<std::string, int> rows;
    for (const auto& part : parts) {
      if (part.at("point") != frame.at("point") || part.at("frame") != frame.at("frame")) continue;
      EXPECT_EQ(part.at("shader.lanes"), frame.at("shader.lanes"));
      ++rows[part.at("split")];
      EXPECT_EQ(part.at("tile").empty(), part.at("split") != "tiles");
      for (const char* column : {"invocations", "dram_bytes", "cycles", "energy_nj"})
        if (!part.at(column).empty()) sums[part.at("split")][column] += std::stod(part.at(column));
      if (part.at("split") != "tiles") continue;
      EXPECT_NE(part.at("bound_by"), "");
      EXPECT_LE(std::stod(part.at("bound_by_cycles")), std::stod(part.at("cycles")));
    }
    const auto number = [&](const char* column) { return std::stod(frame.at(column)); };
    EXPECT_NE(frame.at("timing.bound_by"), "");
    EXPECT_EQ(rows["tiles"], 2 * 2);  // of 32x32 in 64x36
    EXPECT_GT(rows["drawables"], rows["materials"]);
    for (const char* split : {"drawables", "materials"}) {
      EXPECT_EQ(sums[split]["invocations"], number("tilecore.pixel_shader_invocations"));
      EXPECT_EQ(sums[split]["dram_bytes"], number("dram.read_bytes") + number("dram.written_bytes"));
      EXPECT_NEAR(sums[split]["cycles"], number("timing.cycles"), 1);
      EXPECT_NEAR(sums[split]["energy_nj"] / number("energy.total_nj"), 1, 1e-9);
    }
    EXPECT_LT(sums["tiles"]["dram_bytes"], sums["drawables"]["dram_bytes"]) << "geometry is no tile's";
  }
  ASSERT_EQ(sweep("shards", {"--quiet", "--shard", "1/2"}).status, 0);
  ASSERT_EQ(sweep("shards", {"--quiet", "--shard", "0/2"}).status, 0);
  ASSERT_EQ(run_tessera({"report", (folder_ / "shards").string()}).status, 0);
  EXPECT_EQ(contents("shards"), contents("out"));
  study.erase("split");
  write_study(study);
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  EXPECT_FALSE(fs::exists(folder_ / "out" / "split.csv"));
  EXPECT_THAT(run_tessera({"sweep", "--help"}).output, HasSubstr("DIR/split.csv"));
}

TEST_F(Sweep, ShardsJoinToTheWhole) {
  write_study(small_study());
  ASSERT_EQ(sweep("whole", {"--quiet"}).status, 0);
  ASSERT_EQ(sweep("shards", {"--quiet", "--shard", "2/3"}).status, 0);
  ASSERT_EQ(sweep("shards", {"--quiet", "--shard", "0/3"}).status, 0);
  EXPECT_FALSE(fs::exists(folder_ / "shards" / "sweep.csv"));
  // With some shards done early, the report says which points are there and which are missing.
  const ProcessResult early = run_tessera({"report", (folder_ / "shards").string()});
  EXPECT_EQ(early.status, 0);
  EXPECT_THAT(early.errors, HasSubstr("4 of 12 points are not done yet"));
  EXPECT_EQ(rows_of(text("shards/sweep.csv")).size(), 8u);
  EXPECT_NE(text("shards/sweep.csv"), text("whole/sweep.csv"));
  ASSERT_EQ(sweep("shards", {"--quiet", "--shard", "1/3"}).status, 0);
  ASSERT_EQ(run_tessera({"report", (folder_ / "shards").string()}).status, 0);
  EXPECT_EQ(contents("shards"), contents("whole"));
}

// 2 captures, 2 functions, 6 timings of each: renders and timings.
json mixed_study() {
  json study = small_study();
  study["axes"] = {{{"key", "shader.lanes"}, {"values", {8, 32, 128}}},
                   {{"keys", {"tile.width", "tile.height"}}, {"values", {16, 32}}},
                   {{"key", "clock.mhz"}, {"values", {"x0.7", "x1.3"}}}};
  study["pictures"] = true;
  return study;
}

// 9 timings of 3 captures, and of 3 values of a key that a render hangs on.
TEST_F(Sweep, TwentySevenPointsOverTimingKeysRenderThreeTimesAndHaveTheRowsOfRenderingEach) {
  json study = {
      {"captures",
       {test::shipped_capture("eggs").string(), test::shipped_capture("vases").string(),
        test::shipped_capture("serpent").string()}},
      {"size", "32x18"},
      {"axes",
       {{{"key", "shader.lanes"}, {"values", {16, 64, 256}}}, {{"key", "clock.mhz"}, {"values", {300, 600, 850}}}}}};
  write_study(study);
  constexpr const char* kThree = "27 points: 0 were there, 3 rendered and 24 timed";
  EXPECT_THAT(sweep("whole").output, HasSubstr(kThree));
  // A shard of one point in a folder of its own finds nothing to be timed from; nor does the next one.
  for (int point = 0; point < 27; ++point) {
    EXPECT_THAT(sweep("alone", {"--shard", fmt::format("{}/27", point)}).output,
                HasSubstr("0 were there, 1 rendered and 0 timed"));
    fs::remove_all(folder_ / "alone" / "records");
    fs::copy(folder_ / "alone", folder_ / "each", fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    fs::remove_all(folder_ / "alone");
  }
  ASSERT_EQ(run_tessera({"report", (folder_ / "each").string()}).status, 0);
  EXPECT_EQ(rows_of(text("each/sweep.csv")).size(), 27u);
  EXPECT_EQ(contents("each"), contents("whole"));

  study["captures"] = {test::shipped_capture("eggs").string()};
  study["axes"].push_back({{"key", "sampling.seed"}, {"values", {0, 1, 2}}});
  write_study(study);
  EXPECT_THAT(sweep("seeds").output, HasSubstr(kThree));
}

// SW2; SH2: groups go to shards as a whole, or are cut where there are fewer than shards.
TEST_F(Sweep, ShardsOfAMixedStudyRenderOncePerFunction) {
  write_study(mixed_study());
  EXPECT_THAT(sweep("whole").output, HasSubstr("24 points: 0 were there, 4 rendered and 20 timed"));
  for (const auto& [shards, renders] : {std::pair(3, 4), std::pair(8, 8)}) {
    const std::string out = fmt::format("of{}", shards);
    int rendered = 0;
    for (int shard = shards; shard-- > 0;) {
      const std::string said = sweep(out, {"--shard", fmt::format("{}/{}", shard, shards)}).output;
      rendered += std::stoi(said.substr(said.find("there, ") + 7));
    }
    // A part of a group finds the record that another part left, if that is not done yet.
    EXPECT_LE(rendered, renders);
    EXPECT_GE(rendered, 4);
    ASSERT_EQ(run_tessera({"report", (folder_ / out).string()}).status, 0);
    EXPECT_EQ(contents(out), contents("whole")) << shards;
  }
}

// A run that is killed between a render and the points that are timed from it leaves its record.
TEST_F(Sweep, AKilledRunDoesNotRenderAgainForPointsThatAreTimed) {
  json study = mixed_study();
  study["captures"] = {test::shipped_capture("garden").string()};
  study["size"] = "160x90";
  study["axes"][0]["values"] = {4, 8, 16, 32, 64, 128, 256};
  study["settings"] = {{"machine.timing", "events"}};
  study["axes"].erase(1);
  write_study(study);
  ASSERT_EQ(sweep("whole", {"--quiet"}).status, 0);
  const ProcessResult killed =
      sweep("killed", {"--quiet", "--threads", "1"}, {.kill_when = [&] { return results("killed") >= 2; }});
  EXPECT_EQ(killed.signal, SIGKILL);
  EXPECT_TRUE(fs::exists(folder_ / "killed" / "records"));
  EXPECT_THAT(sweep("killed").output, HasSubstr(", 0 rendered and "));
  EXPECT_EQ(contents("killed"), contents("whole"));

  // A damaged record is made again; one that is wanted stays.
  study["records"] = true;
  write_study(study);
  ASSERT_EQ(sweep("kept", {"--quiet"}).status, 0);
  study["axes"][0]["values"].push_back(512);
  write_study(study);
  EXPECT_THAT(sweep("kept").output, HasSubstr("16 points: 14 were there, 0 rendered and 2 timed"));
  for (const auto& entry : fs::directory_iterator(folder_ / "kept" / "records"))
    test::write_text(entry.path(), test::read_text(entry.path()).substr(0, 1000));
  study["axes"][0]["values"].push_back(1);
  write_study(study);
  EXPECT_THAT(sweep("kept").output, HasSubstr("18 points: 16 were there, 1 rendered and 1 timed"));
}

TEST_F(Sweep, ADryRunTellsTheRemainingPointsAndWritesNothing) {
  write_study(mixed_study());
  const auto dry = [&](std::vector<std::string> more) {
    more.emplace_back("--dry-run");
    const ProcessResult r = sweep("out", more);
    EXPECT_EQ(r.status, 0) << r.errors;
    return r.output;
  };
  EXPECT_THAT(dry({}), HasSubstr("24 points: 0 are there, 4 to render and 20 to time from their records"));
  EXPECT_THAT(dry({}), testing::ContainsRegex("about [0-9.]+ s, [0-9]+ at a time: a frame renders in [0-9.]+ s and is "
                                              "timed in [0-9.]+ s"));
  EXPECT_THAT(dry({"--shard", "0/2"}), HasSubstr("12 points: 0 are there, 2 to render and 10 to time"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  ASSERT_EQ(sweep("out", {"--quiet", "--shard", "0/2"}).status, 0);
  const auto before = contents("out");
  EXPECT_THAT(dry({}), HasSubstr("24 points: 12 are there, 2 to render and 10 to time"));
  EXPECT_EQ(contents("out"), before);
}

// Five lines at most: points, renders and time; the best point; where the results are.
TEST_F(Sweep, TheEndNamesTheBestPointAndItsPlace) {
  json study = mixed_study();
  study["axes"].push_back({{"key", "parameter_buffer.bytes"}, {"values", {256, 65536}}});
  write_study(study);
  const std::string said = sweep("out").output;
  EXPECT_LE(std::count(said.begin(), said.end(), '\n'), 5) << said;
  EXPECT_THAT(said, HasSubstr("24 points have values that do not fit each other"));
  EXPECT_THAT(said, testing::ContainsRegex("best: timing.time_ms [0-9.e+-]+ at point [0-9]+: shader.lanes="));
  EXPECT_THAT(said, HasSubstr("results are in " + (folder_ / "out" / "sweep.csv").string()));
}

TEST_F(Sweep, ValuesThatDoNotFitEachOtherAreARowThatSaysWhy) {
  json study = small_study();
  study["captures"] = {test::shipped_capture("vases").string()};
  // A multiple of 8 or not; a buffer that holds the list heads or not.
  study["axes"] = {{{"keys", {"tile.width", "tile.height"}}, {"values", {8, 20}}},
                   {{"key", "parameter_buffer.bytes"}, {"values", {256, 65536}}}};
  write_study(study);
  ASSERT_EQ(sweep("out", {"--quiet"}).status, 0);
  const auto rows = rows_of(text("out/sweep.csv"));
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_THAT(rows[0].at("status"), HasSubstr("cannot hold the first chunks"));
  EXPECT_EQ(rows[1].at("status"), "ok");
  EXPECT_THAT(rows[2].at("status"), HasSubstr("multiples of 8"));
  EXPECT_EQ(rows[2].at("frame"), "");
}

TEST_F(Sweep, CtrlCFinishesTheRunningPointsAndTheNextRunGoesOn) {
  json study = small_study();
  study["size"] = "320x180";
  study["axes"].push_back({{"key", "sampling.seed"}, {"range", {{"from", 0}, {"to", 199}, {"step", 1}}}});
  write_study(study);
  const ProcessResult r = sweep("out", {}, {.interrupt_after_ms = 1500});
  EXPECT_EQ(r.status, 130) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("the same command goes on"));
  EXPECT_EQ(rows_of(text("out/sweep.csv")).size(), results("out"));
  EXPECT_LT(results("out"), 2400u);
}

TEST_F(Sweep, TwoWholeSweepsDoNotWorkInOneFolderButShardsDo) {
  write_study(small_study());
  fs::create_directories(folder_ / "out" / "points");
  const int lock = ::open((folder_ / "out" / "points" / ".lock").c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_GE(lock, 0);
  ASSERT_EQ(::flock(lock, LOCK_SH), 0);  // as a shard holds it
  const ProcessResult whole = sweep("out", {"--quiet"});
  EXPECT_EQ(whole.status, 6);
  EXPECT_THAT(whole.errors, HasSubstr("another sweep is at work in"));
  EXPECT_EQ(sweep("out", {"--quiet", "--shard", "0/4"}).status, 0);
  ::close(lock);
  EXPECT_EQ(sweep("out", {"--quiet"}).status, 0);
}

TEST_F(Sweep, ImagesBeyondTheMemoryLimitEndWithStatus4) {
  json study = small_study();
  study["size"] = "16384x16384";
  write_study(study);
  const ProcessResult r = sweep("out", {"--quiet", "--max-memory", "1"});
  EXPECT_EQ(r.status, 4) << r.errors;
  EXPECT_THAT(r.errors, HasSubstr("--max-memory allows"));
  EXPECT_EQ(results("out"), 0u);
}

TEST_F(Sweep, ACaptureThatCannotBeReadIsNamed) {
  json study = small_study();
  test::write_text(folder_ / "bad.glb", "glTF");
  study["captures"] = {"bad.glb"};
  write_study(study);
  const ProcessResult r = sweep("out", {"--quiet"});
  EXPECT_EQ(r.status, 3);
  EXPECT_THAT(r.errors, HasSubstr("bad.glb"));
}

TEST_F(Sweep, ProgressNamesThePointAndTheTimeLeft) {
  write_study(small_study());
  const ProcessResult r = sweep("out");
  EXPECT_THAT(r.errors, HasSubstr("[1/12] "));
  EXPECT_THAT(r.errors, HasSubstr("tile.width=8 tile.height=8 frontend.split_pixels=16: "));
  EXPECT_THAT(r.errors, HasSubstr(" s left"));
  EXPECT_THAT(r.output, HasSubstr("% of it rendering"));
}

// A cluster of this machine alone, started and stopped by the script; one of its tasks is killed and requeued.
TEST_F(Sweep, ASlurmArrayWithAKilledTaskGivesTheWhole) {
  // 12 renders and 24 timings.
  json study = small_study();
  study["size"] = "640x360";
  study["axes"].push_back({{"key", "clock.mhz"}, {"values", {300, 600, 850}}});
  write_study(study);
  const fs::path root = TESSERA_SOURCE_DIR;
  const ProcessResult r =
      test::run_process({"/usr/bin/env", "bash", (root / "tests" / "replay" / "slurm_cluster.sh").string(),
                         TESSERA_PROGRAM, (root / "captures" / "studies" / "sweep.sbatch").string(),
                         (folder_ / "study.json").string(), (folder_ / "cluster").string(), "2"},
                        {.seconds = 500});
  if (r.status == 77) GTEST_SKIP() << r.output;
  ASSERT_EQ(r.status, 0) << r.output << r.errors;
  EXPECT_THAT(r.output, HasSubstr("Restarts=1"));
  EXPECT_THAT(sweep("whole").output, HasSubstr("36 points: 0 were there, 12 rendered and 24 timed"));
  EXPECT_EQ(contents("cluster"), contents("whole"));
}

// ---- Goals without a search, machines for a capture -------------------------------------------------------------------

// The table's own rows, ranked by hand.
TEST(SweepGoal, OfAllCombinationsNamesTheBestThatMeetsItsLimits) {
  const test::TemporaryFolder folder;
  json study = {{"captures", {test::shipped_capture("eggs").string()}},
                {"frames", "0:1"},
                {"size", "96x54"},
                {"axes", {{{"key", "shader.lanes"}, {"values", {8, 16, 32, 64}}}}},
                {"columns", {"timing.time_ms", "area.total_mm2"}}};
  test::write_text(folder / "plain.json", study.dump());
  const test::ProcessResult plain =
      test::run_tessera({"sweep", (folder / "plain.json").string(), "--quiet", "--out", (folder / "plain").string()});
  ASSERT_EQ(plain.status, 0) << plain.errors;
  std::map<double, double> area_of;  // by time
  for (const auto& row : rows_of(test::read_text(folder / "plain" / "sweep.csv")))
    area_of[std::stod(row.at("timing.time_ms"))] = std::stod(row.at("area.total_mm2"));
  ASSERT_EQ(area_of.size(), 4u);
  // The slowest misses the limit; of the others the one with the least area wins, which is the slowest of them.
  const auto second = std::prev(area_of.end(), 2);
  study["goal"] = {{"minimise", "area.total_mm2"}, {"subject_to", {{"timing.time_ms", {{"at_most", second->first}}}}}};
  test::write_text(folder / "goal.json", study.dump());
  const test::ProcessResult goal =
      test::run_tessera({"sweep", (folder / "goal.json").string(), "--out", (folder / "goal").string()});
  ASSERT_EQ(goal.status, 0) << goal.errors;
  EXPECT_THAT(goal.output,
              HasSubstr(fmt::format("best: area.total_mm2 {:.6g} at point 1: shader.lanes=16", second->second)));
  EXPECT_THAT(goal.output, testing::ContainsRegex("shader.lanes=8 .*misses them"));
  EXPECT_THAT(goal.output, testing::ContainsRegex("shader.lanes=64 .*meets the limits"));
  // Nothing is fast enough.
  study["goal"]["subject_to"]["timing.time_ms"]["at_most"] = area_of.begin()->first / 2;
  test::write_text(folder / "goal.json", study.dump());
  const test::ProcessResult none =
      test::run_tessera({"sweep", (folder / "goal.json").string(), "--out", (folder / "goal").string()});
  EXPECT_THAT(none.output, HasSubstr("best (none meets the limits)"));
}

TEST(SweepMachines, OfACaptureEqualAStudysMachines) {
  const test::TemporaryFolder folder;
  const std::string capture = test::shipped_capture("eggs").string();
  const test::ProcessResult r =
      test::run_tessera({"sweep", capture, "--gpu", "mid-mobile", "--gpu", "high-mobile", "--fps", "90", "--watts", "2",
                         "--frames", "0:1", "--size", "96x54", "--out", (folder / "out").string()});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, testing::ContainsRegex("best: area.total_mm2 [0-9.]+ at point 0: gpu=mid-mobile"));
  // Power is that at 90 frames a second, as replays say.
  for (const char* gpu : {"mid-mobile", "high-mobile"}) {
    const test::ProcessResult replay =
        test::run_tessera({"replay", capture, "--gpu", gpu, "--set", "machine.target_fps=90", "--frames", "0:1",
                           "--size", "96x54", "--no-report", "--quiet", "--out", (folder / gpu).string()});
    ASSERT_EQ(replay.status, 0) << replay.errors;
    const json frame = json::parse(test::read_text(folder / gpu / "stats.json"))["frames"][0];
    EXPECT_THAT(r.output, HasSubstr(fmt::format("{:.5g}", frame["energy"]["power_w"].get<double>()))) << gpu;
    EXPECT_THAT(r.output, HasSubstr(fmt::format("{:.5g}", frame["timing"]["time_ms"].get<double>()))) << gpu;
  }
  const auto refused = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "sweep");
    more.insert(more.end(), {"--out", (folder / "refused").string()});
    return test::run_tessera(more);
  };
  EXPECT_EQ(refused({capture, "--frames", "0:1"}).status, 2);
  EXPECT_EQ(refused({capture, "--fps", "0"}).status, 2);
  EXPECT_EQ(refused({capture, "--watts", "-1"}).status, 2);
  EXPECT_EQ(refused({capture, "--gpu", "no-such-machine"}).status, 3);
  EXPECT_EQ(refused({(folder / "missing.glb").string(), "--fps", "60"}).status, 3);
}

}  // namespace
}  // namespace tessera::replay::sweep_test
