// Study files: their contents and their refusals.
#include "replay/sweep/study.h"
#include "base/error.h"
#include "baselines/scheme.h"
#include "replay/sweep/capture_library.h"
#include "replay/sweep/columns.h"
#include "replay/sweep/points.h"
#include "tests/support/tests.h"

namespace tessera::replay::study_test {
namespace {

using testing::ElementsAre;

constexpr std::uint64_t kMax = 1000;

// A study of the vases with further members.
json study_with(const json& members) {
  json study = {{"captures", {test::shipped_capture("vases").string()}}, {"size", "32x32"}};
  study.update(members);
  return study;
}

Study read(const test::TemporaryFolder& folder, const json& study, std::uint64_t most = kMax) {
  test::write_text(folder / "study.json", study.dump());
  return read_study(folder / "study.json", most);
}

std::vector<json> first_values(const StudyAxis& axis) {
  std::vector<json> values;
  for (const auto& step : axis.values) values.push_back(step.at(0));
  return values;
}

TEST(Study, AxesAreListsAndRanges) {
  const test::TemporaryFolder folder;
  const Study study = read(
      folder,
      study_with(
          {{"axes",
            {{{"key", "tile.width"}, {"values", {16, 64}}},
             {{"key", "frontend.split_depth"}, {"range", {{"from", 0}, {"to", 5}, {"step", 2}}}},
             {{"key", "parameter_buffer.bytes"}, {"range", {{"from", 4096}, {"to", 65536}, {"factor", 4}}}},
             {{"key", "tessellation.target_edge_pixels"}, {"range", {{"from", 0.5}, {"to", 1.0}, {"step", 0.1}}}}}}}));
  ASSERT_EQ(study.axes.size(), 4u);
  EXPECT_THAT(first_values(study.axes[0]), ElementsAre(16, 64));
  EXPECT_THAT(first_values(study.axes[1]), ElementsAre(0, 2, 4));
  EXPECT_THAT(first_values(study.axes[2]), ElementsAre(4096, 16384, 65536));
  EXPECT_EQ(study.axes[3].values.size(), 6u);  // the last step is there although 5 * 0.1 is not 0.5 exactly
  EXPECT_EQ(study.point_count, 2u * 3 * 3 * 6);
}

TEST(Study, KeysOfOneAxisAreSetTogether) {
  const test::TemporaryFolder folder;
  const Study study = read(
      folder,
      study_with({{"axes", {{{"keys", {"tile.width", "tile.height"}}, {"values", {16, json::array({32, 64})}}}}}}));
  EXPECT_EQ(study.point_count, 2u);
  const PointConfiguration same = configure_point(study, {0}), apart = configure_point(study, {1});
  EXPECT_EQ(same.gpu.tile.width, 16);
  EXPECT_EQ(same.gpu.tile.height, 16);
  EXPECT_EQ(apart.gpu.tile.width, 32);
  EXPECT_EQ(apart.gpu.tile.height, 64);
}

TEST(Study, MachineAndSizeAreAxesToo) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "mine.json", R"({"preset": "small", "tile": {"width": 24}})");
  const Study study = read(folder, study_with({{"settings", {{"tile.height", 48}}},
                                               {"axes",
                                                {{{"key", "gpu"}, {"values", {"large", "mine.json"}}},
                                                 {{"key", "size"}, {"values", {"64x36", "16x16"}}}}}}));
  const PointConfiguration large = configure_point(study, {0, 0}), mine = configure_point(study, {1, 1});
  EXPECT_EQ(large.gpu.cores.count, 12);
  EXPECT_EQ(large.gpu.tile.height, 48) << "fixed settings come after the machine";
  EXPECT_EQ(mine.gpu.tile.width, 24);
  EXPECT_EQ(mine.size->width, 16);
}

TEST(Study, ColumnsAreNamesAndPatterns) {
  const test::TemporaryFolder folder;
  const Study study = read(
      folder, study_with({{"columns", {"tilecore.triangles", "dram.*.tile_queue.*", "baseline.*.queue_bytes_peak"}}}));
  EXPECT_EQ(study.columns.front(), "tilecore.triangles");
  EXPECT_THAT(study.columns, testing::Contains("dram.binner.tile_queue.written_bytes"));
  EXPECT_THAT(study.columns, testing::Contains("baseline.post-tessellation.queue_bytes_peak"));
  EXPECT_EQ(study.columns.size(), 1u + 5 * 2 + baselines::kSchemeCount)
      << "five units move data, read and written; every scheme";
  EXPECT_TRUE(study.baselines) << "a column of theirs asks for them";
  const Study plain = read(folder, study_with(json::object()));
  EXPECT_FALSE(plain.baselines);
  EXPECT_THAT(plain.columns, testing::Contains("timing.cycles"));
  EXPECT_THAT(plain.columns, testing::Not(testing::Contains("timing.bound_by"))) << "only where it is asked for";
  EXPECT_THAT(
      read(folder, study_with({{"columns", {"timing.bound*", "area.*.l2", "timing.events.*.dram"}}})).columns,
      ElementsAre("timing.bound_by", "timing.bound_by_cycles", "area.by_unit.l2", "timing.events.critical_path.dram"));
}

TEST(Study, PointsAreThereOnceEachAndTheLastAxisIsTheFastest) {
  const test::TemporaryFolder folder;
  const Study study =
      read(folder,
           study_with(
               {{"captures", {test::shipped_capture("vases").string(), test::shipped_capture("flyby").string()}},
                {"axes",
                 {{{"key", "tile.width"}, {"values", {16, 32}}}, {{"key", "sampling.seed"}, {"values", {0, 1, 2}}}}}}));
  const std::vector<SweepPoint> points = expand_points(study, "program");
  ASSERT_EQ(points.size(), 12u);
  std::set<std::string> hashes;
  for (const SweepPoint& point : points) hashes.insert(point.hash);
  EXPECT_EQ(hashes.size(), 12u);
  EXPECT_THAT(points[0].steps, ElementsAre(0, 0));
  EXPECT_THAT(points[1].steps, ElementsAre(0, 1));
  EXPECT_THAT(points[3].steps, ElementsAre(1, 0));
  EXPECT_EQ(points[6].capture, 1u);
}

// Invariants SH1 and SH2, of studies with few and with many renders.
TEST(Study, ShardsAreAllPointsAndCutAGroupOnlyWhereThereAreFewerThanShards) {
  const test::TemporaryFolder folder;
  for (const std::size_t functions : {1u, 3u, 10u}) {
    json seeds = json::array();
    for (std::size_t s = 0; s < functions; ++s) seeds.push_back(s);
    const std::vector<SweepPoint> points =
        expand_points(read(folder, study_with({{"axes",
                                                {{{"key", "clock.mhz"}, {"values", {200, 300, 400, 500, 600}}},
                                                 {{"key", "sampling.seed"}, {"values", seeds}}}}})),
                      "program");
    EXPECT_EQ(render_groups(points).size(), functions);
    for (const std::size_t shards : {1u, 2u, 3u, 7u, 40u}) {
      std::vector<int> times(points.size(), 0);
      std::map<std::string, std::size_t> parts;
      for (std::size_t shard = 0; shard < shards; ++shard) {
        std::set<std::string> rendered;
        for (const std::size_t p : points_of_shard(points, shard, shards)) {
          ++times[p];
          rendered.insert(points[p].function);
        }
        for (const std::string& function : rendered) ++parts[function];
      }
      EXPECT_THAT(times, testing::Each(1)) << functions << " functions, " << shards << " shards";
      for (const auto& [function, count] : parts) EXPECT_LE(count, std::max<std::size_t>(1, shards / functions));
    }
  }
}

// A size that the study chooses is kept; a preset's size grows with the tile.
TEST(Study, TileMemoryThatHoldsNoTileIsAFaultOnlyWhereItIsChosen) {
  const test::TemporaryFolder folder;
  const auto points = [&](const json& axis) {
    return expand_points(read(folder, study_with({{"axes", {axis}}})), "program");
  };
  const auto chosen = points({{"key", "tilecore.memory_bytes"}, {"values", {1024, 196608}}});
  EXPECT_THAT(chosen.at(0).fault, HasSubstr("1024 bytes hold no tile"));
  EXPECT_EQ(chosen.at(1).fault, "");
  const json large = {{"keys", {"tile.width", "tile.height"}}, {"values", {128}}};
  EXPECT_EQ(points(large).at(0).fault, "");
  const Study study = read(folder, study_with({{"axes", {large}}}));
  EXPECT_EQ(configure_point(study, {0}).gpu.cores.memory_bytes, 128 * 128 * 4 * 12);
}

// ---- Inputs of a hash -------------------------------------------------------------------------------------------

std::string first_hash(const json& members, const std::string& program = "program") {
  const test::TemporaryFolder folder;
  return expand_points(read(folder, study_with(members)), program).at(0).hash;
}

TEST(PointHash, CoversEverythingThatAResultFollowsFrom) {
  const std::string plain = first_hash(json::object());
  const std::vector<json> changes = {{{"frames", "1:2"}},
                                     {{"size", "33x32"}},
                                     {{"variant", "red"}},
                                     {{"gpu", "large"}},
                                     {{"settings", {{"sampling.seed", 1}}}},
                                     {{"settings", {{"tile.width", 64}}}},
                                     {{"pictures", true}},
                                     {{"baselines", true}},
                                     {{"split", {"tiles"}}},
                                     {{"split", {"tiles", "materials"}}},
                                     {{"captures", {test::shipped_capture("flyby").string()}}}};
  std::set<std::string> hashes = {plain};
  for (const json& change : changes) EXPECT_TRUE(hashes.insert(first_hash(change)).second) << change;
  EXPECT_TRUE(hashes.insert(first_hash(json::object(), "another program")).second);
}

TEST(PointHash, DoesNotCoverNamesAndColumns) {
  const std::string plain = first_hash(json::object());
  EXPECT_EQ(first_hash({{"title", "mine"}, {"columns", {"tilecore.triangles"}}}), plain);
  EXPECT_EQ(first_hash({{"settings", {{"sampling.seed", 0}}}}), plain) << "a default that is written down";
  EXPECT_EQ(first_hash({{"axes", {{{"key", "sampling.seed"}, {"values", {0, 1}}}}}}), plain)
      << "a value is the same on an axis";
}

TEST(CaptureFingerprint, CoversTheFilesThatACaptureNames) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "a.gltf",
                   R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "a%20b.bin", "byteLength": 3}]})");
  test::write_text(folder / "a b.bin", "abc");
  const std::string before = capture_fingerprint(folder / "a.gltf");
  EXPECT_EQ(capture_fingerprint(folder / "a.gltf"), before);
  test::write_text(folder / "a b.bin", "abd");
  EXPECT_NE(capture_fingerprint(folder / "a.gltf"), before);
  EXPECT_THROW(capture_fingerprint(folder / "none.gltf"), InputError);
}

// ---- Refusals ---------------------------------------------------------------------------------------------------

struct BrokenStudy {
  json members;
  const char* message;
};

TEST(Study, FaultsAreNamedByTheirPlaceWithTheNearestKnownName) {
  const auto axis = [](json value) { return json{{"axes", {std::move(value)}}}; };
  const std::vector<BrokenStudy> studies = {
      {{{"axs", json::array()}}, "/axs: unknown key 'axs'; did you mean 'axes'?"},
      {{{"captures", json::array()}}, "/captures: is not a list of captures"},
      {{{"captures", {"no.glb"}}}, "/captures/0: no such file"},
      {{{"captures", {3}}}, "/captures/0: is not a text"},
      {{{"frames", "3:1"}}, "/frames: frames 3:1: expected A:B with A < B"},
      {{{"size", 3}}, "/size: is not a text"},
      {{{"gpu", "enormous"}}, "/gpu: no GPU file"},
      {{{"settings", {{"tile.widht", 16}}}},
       "/settings/tile.widht: unknown key 'tile.widht'; did you mean 'tile.width'?"},
      {{{"settings", {{"tile.width", 4000}}}},
       "/settings/tile.width: tile.width: '4000' is not a whole number from 8 to 256 pixels"},
      {{{"settings", {{"size", "3x3"}}}}, "/settings/size: is a member of the study itself"},
      {{{"columns", {"tilecore.triangels"}}},
       "/columns/0: unknown key 'tilecore.triangels'; did you mean 'tilecore.triangles'?"},
      {{{"columns", {"nothing.*"}}}, "/columns/0: unknown key 'nothing.*'"},
      {{{"columns", json::array()}}, "/columns: is not a list"},
      {{{"pictures", "yes"}},
       "/pictures"
       ": is neither true nor false"},
      {{{"split", "tiles"}}, "/split: is not a list of drawables, materials, tiles"},
      {{{"split", {"tiles", "pixels"}}}, "/split/1: split: 'pixels' is none of drawables, materials, tiles"},
      {{{"split", {"tiles", "tiles"}}}, "/split/1: is there twice"},
      {{{"split", {3}}}, "/split/0: is not a text"},
      {axis({{"key", "tile.widht"}, {"values", {16}}}),
       "/axes/0/key: unknown key 'tile.widht'; did you mean 'tile.width'?"},
      {axis({{"key", "tile.width"}, {"vales", {16}}}), "/axes/0/vales: unknown key 'vales'; did you mean 'values'?"},
      {axis({{"key", "tile.width"}}), "/axes/0: needs either 'values' or 'range'"},
      {axis({{"values", {16}}}), "/axes/0: needs either 'key' or 'keys'"},
      {axis({{"key", "tile.width"}, {"values", json::array()}}), "/axes/0/values: is not a list of values"},
      {axis({{"key", "tile.width"}, {"values", {16, 16}}}), "/axes/0/values/1: is there twice"},
      {axis({{"key", "tile.width"}, {"values", {16, "wide"}}}), "/axes/0/values/1: tile.width: 'wide'"},
      {axis({{"keys", {"tile.width", "tile.height"}}, {"values", {json::array({16})}}}),
       "/axes/0/values/0: has 1 values for 2 keys"},
      {axis({{"key", "tile.width"}, {"range", {{"from", 8}, {"to", 64}}}}),
       "/axes/0/range: needs either 'step' or 'factor'"},
      {axis({{"key", "tile.width"}, {"range", {{"from", 8}, {"to", 64}, {"step", 0}}}}),
       "/axes/0/range/step: is not greater than 0"},
      {axis({{"key", "tile.width"}, {"range", {{"from", 64}, {"to", 8}, {"step", 8}}}}),
       "/axes/0/range: ends before it begins"},
      {axis({{"key", "tile.width"}, {"range", {{"from", 0}, {"to", 8}, {"factor", 2}}}}), "begins above 0"},
      {axis({{"key", "tile.width"}, {"range", {{"from", 8}, {"to", "64"}, {"step", 8}}}}),
       "/axes/0/range/to: is not a number"},
      {{{"settings", {{"tile.width", 16}}}, {"axes", {{{"key", "tile.width"}, {"values", {16}}}}}},
       "/axes/0: 'tile.width' is set by the study or by another axis already"},
      {{{"axes",
         {{{"key", "tile.width"}, {"values", {16}}}, {{"keys", {"tile.height", "tile.width"}}, {"values", {16}}}}}},
       "/axes/1: 'tile.width' is set"},
  };
  const test::TemporaryFolder folder;
  for (const BrokenStudy& broken : studies) {
    try {
      read(folder, study_with(broken.members));
      ADD_FAILURE() << "accepted " << broken.members;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("study.json: ")) << broken.members;
      EXPECT_THAT(error.what(), HasSubstr(broken.message)) << broken.members;
    }
  }
}

TEST(Study, BrokenJsonIsNamedByItsByte) {
  const test::TemporaryFolder folder;
  const std::string whole = study_with({{"title", "t"}}).dump();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    test::write_text(folder / "study.json", whole.substr(0, length));
    EXPECT_THROW(read_study(folder / "study.json", kMax), InputError) << length;
  }
  test::write_text(folder / "study.json", R"({"captures": [], "captures": []})");
  EXPECT_THROW(read_study(folder / "study.json", kMax), InputError)
      << "which of the two counts would be anybody's guess";
  test::write_text(folder / "study.json", "[]");
  EXPECT_THROW(read_study(folder / "study.json", kMax), InputError);
}

TEST(Study, MorePointsThanAllowedAreRefusedBeforeTheyAreMade) {
  const test::TemporaryFolder folder;
  const auto seeds = [](double to) {
    return json{{"key", "sampling.seed"}, {"range", {{"from", 0}, {"to", to}, {"step", 1}}}};
  };
  EXPECT_THROW(read(folder, study_with({{"axes", {seeds(4e9)}}})), LimitError);
  EXPECT_THROW(read(folder, study_with({{"axes", {seeds(1e300)}}})), LimitError);
  const json axes = {seeds(99), {{"key", "tile.width"}, {"range", {{"from", 8}, {"to", 80}, {"step", 8}}}}};
  EXPECT_EQ(read(folder, study_with({{"axes", axes}}), 1000).point_count, 1000u);
  EXPECT_THROW(read(folder, study_with({{"axes", axes}}), 999), LimitError);
}

TEST(SweepCommand, FaultsEndWithTheirStatusAndLeaveNothing) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "good.json",
                   study_with({{"axes", {{{"key", "sampling.seed"}, {"values", {0, 1}}}}}}).dump());
  test::write_text(folder / "bad.json", study_with({{"axs", 1}}).dump());
  struct Call {
    std::vector<std::string> arguments;
    int status;
    const char* message;
  };
  const std::vector<Call> calls = {
      {{"bad.json"}, 3, "did you mean 'axes'?"},
      {{"none.json"}, 3, "none.json: no such file"},
      {{"good.json", "--max-points", "1"}, 4, "more than 1 values (--max-points)"},
      {{"good.json", "--shard", "2/2"}, 2, "--shard 2/2: expected I/N with I < N, counted from 0"},
      {{"good.json", "--shard", "1"}, 2, "--shard 1"},
      {{"good.json", "--max-memory", "0"}, 2, "--max-memory 0"},
      {{"good.json", "--sharrd", "0/2"}, 2, "did you mean '--shard'?"},
      {{"good.json", "--max-points", "0"}, 2, "--max-points"},
  };
  for (const Call& call : calls) {
    std::vector<std::string> arguments = {"sweep", (folder / call.arguments[0]).string(), "--out",
                                          (folder / "out").string()};
    arguments.insert(arguments.end(), call.arguments.begin() + 1, call.arguments.end());
    const test::ProcessResult r = test::run_tessera(arguments);
    EXPECT_EQ(r.status, call.status) << call.message << ": " << r.errors;
    EXPECT_THAT(r.errors, HasSubstr(call.message));
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
    EXPECT_FALSE(std::filesystem::exists(folder / "out")) << call.message;
  }
  EXPECT_EQ(test::run_tessera({"sweep", (folder / "good.json").string()}).status, 2) << "--out is needed";
}

}  // namespace
}  // namespace tessera::replay::study_test
