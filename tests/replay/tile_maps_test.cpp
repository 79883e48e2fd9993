// The work of each tile: maps that add up to the frame's counters.
#include "replay/frame_files.h"
#include "tests/support/tests.h"

namespace tessera::replay::tile_maps_test {
namespace {

void replay_into(const fs::path& folder, const char* name, std::vector<std::string> more) {
  std::vector<std::string> arguments = {
      "replay",       test::shipped_capture(name).string(), "--size", "160x90", "--quiet", "--no-report", "--out",
      folder.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const test::ProcessResult r = test::run_tessera(arguments);
  ASSERT_EQ(r.status, 0) << r.errors;
}

json read_json(const fs::path& file) { return json::parse(test::read_text(file)); }

// Maps whose sum is not the counter that they are declared to add up to.
std::vector<std::string> maps_off(const json& tiles, const json& counters) {
  std::vector<std::string> off;
  for (const gpu::TileMapField& field : gpu::kTileMapFields) {
    if (field.counter.empty()) continue;
    const auto values = tiles.at("maps").at(std::string(field.name)).at("values").get<std::vector<std::uint64_t>>();
    if (std::accumulate(values.begin(), values.end(), std::uint64_t{0}) !=
        counters.value(std::string(field.counter), std::uint64_t{0}))
      off.emplace_back(field.name);
  }
  return off;
}

TEST(TileMaps, AddUpToTheCountersOfTheFrame) {
  // Plain; with partial renders; with a second pass for geometry that the previous frame hid.
  const std::vector<std::vector<std::string>> runs = {
      {},
      {"--set", "parameter_buffer.bytes=4096"},
      {"--frames", "0:3", "--set", "frontend.previous_depth_culling=on"},
      {"--set", "binner.queue_levels=3"},
      {"--region", "30,20,70,50"}};
  for (const char* name : {"eggs", "vases"})
    for (const auto& run : runs) {
      const test::TemporaryFolder out;
      replay_into(out.path(), name, run);
      const json frames = read_json(out / "stats.json")["frames"];
      ASSERT_FALSE(frames.empty());
      for (const json& frame : frames) {
        const json tiles = read_json(out / tile_maps_name(frame["frame"].get<int>()));
        EXPECT_EQ(maps_off(tiles, frame["counters"]), std::vector<std::string>{})
            << name << " " << (run.empty() ? "" : run[1]);
      }
    }
}

TEST(TileMaps, OneTileMiscountedIsNoticed) {
  const test::TemporaryFolder out;
  replay_into(out.path(), "flyby", {});
  const json counters = read_json(out / "stats.json")["frames"][0]["counters"];
  json tiles = read_json(out / "tiles_0000.json");
  json& value = tiles["maps"]["box_tests"]["values"][5];
  value = value.get<std::uint64_t>() + 1;
  EXPECT_EQ(maps_off(tiles, counters), std::vector<std::string>{"box_tests"});
}

TEST(TileMaps, AreTheSameForAnyNumberOfThreads) {
  const test::TemporaryFolder out;
  for (const char* threads : {"1", "2", "5"}) replay_into(out / threads, "eggs", {"--threads", threads});
  EXPECT_EQ(test::read_text(out / "1" / "tiles_0014.json"), test::read_text(out / "2" / "tiles_0014.json"));
  EXPECT_EQ(test::read_text(out / "1" / "tiles_0014.json"), test::read_text(out / "5" / "tiles_0014.json"));
}

TEST(TileMaps, CoverTheImageTileByTile) {
  const test::TemporaryFolder out;
  replay_into(out.path(), "vases", {"--region", "40,24,50,40", "--set", "tile.width=16", "--set", "tile.height=24"});
  const json tiles = read_json(out / "tiles_0000.json");
  // The region begins inside the third column and on the second row; it reaches pixel 89 and 63.
  EXPECT_EQ(tiles["origin"], json({32, 24}));
  EXPECT_EQ(tiles["tile"], json({16, 24}));
  EXPECT_EQ(tiles["grid"], json({4, 2}));
  for (const gpu::TileMapField& field : gpu::kTileMapFields)
    EXPECT_EQ(tiles["maps"][std::string(field.name)]["values"].size(), 8u) << field.name;
}

TEST(TileMaps, OnlyMovingSurfacesCountAsMoving) {
  const test::TemporaryFolder out;
  replay_into(out / "moving", "flyby", {});
  replay_into(out / "still", "flyby", {"--set", "effects.motion=off"});
  const auto sum = [&](const char* run) {
    const auto values = read_json(out / run / "tiles_0000.json")["maps"]["moving_sub_patches"]["values"]
                            .get<std::vector<std::uint64_t>>();
    return std::accumulate(values.begin(), values.end(), std::uint64_t{0});
  };
  EXPECT_GT(sum("moving"), 0u);
  EXPECT_EQ(sum("still"), 0u);
}

}  // namespace
}  // namespace tessera::replay::tile_maps_test
