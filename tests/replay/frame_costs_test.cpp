// Costs of drawables, materials and tiles in the folder of a replay.
#include "replay/frame_costs.h"
#include "tests/support/tests.h"

namespace tessera::replay::frame_costs_test {
namespace {

// The folder of a replay of `name`.
void replay_into(const test::TemporaryFolder& out, const char* name, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {
      "replay",           test::shipped_capture(name).string(), "--size", "160x90", "--quiet", "--no-report", "--out",
      out.path().string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const test::ProcessResult r = test::run_tessera(arguments);
  ASSERT_EQ(r.status, 0) << r.errors;
}
json stats_of(const test::TemporaryFolder& out) { return json::parse(test::read_text(out / "stats.json")); }

double sum(const json& rows, const char* member) {
  return std::accumulate(rows.begin(), rows.end(), 0.0,
                         [&](double all, const json& row) { return all + row.at(member).get<double>(); });
}
double sum(const json& values) {
  return std::accumulate(values.begin(), values.end(), 0.0,
                         [](double all, const json& value) { return all + value.get<double>(); });
}

// Figures of the frame that the rows do not add up to.
std::vector<std::string> missing(const json& frame, const char* rows) {
  std::vector<std::string> out;
  const auto differs = [](double a, double b, double tolerance) {
    return std::abs(a - b) > tolerance * std::max(1.0, b);
  };
  const json& counters = frame["counters"];
  if (differs(sum(frame[rows], "cycles"), frame["timing"]["cycles"].get<double>(),
              1e-6 + 1 / frame["timing"]["cycles"].get<double>()))
    out.emplace_back("cycles");
  if (differs(sum(frame[rows], "energy_nj"), frame["energy"]["total_nj"].get<double>(), 1e-9))
    out.emplace_back("energy");
  if (sum(frame[rows], "dram_bytes") !=
      counters["dram.read_bytes"].get<double>() + counters["dram.written_bytes"].get<double>())
    out.emplace_back("bytes");
  if (sum(frame[rows], "invocations") !=
      counters["tilecore.pixel_shader_invocations"].get<double>() + counters.value("tilecore.helper_invocations", 0.0))
    out.emplace_back("invocations");
  return out;
}

// AT1, in the file; of both eyes together.
TEST(FrameCosts, DrawablesAndMaterialsAddUpToTheFrame) {
  for (const auto& [name, run] : std::vector<std::pair<const char*, std::vector<std::string>>>{
           {"eggs", {}},
           {"flyby", {"--frames", "0:2"}},
           {"vases", {"--set", "parameter_buffer.bytes=4096"}},
           {"vases", {"--set", "stereo.eye_separation=0.06"}}}) {
    const test::TemporaryFolder out;
    replay_into(out, name, run);
    const json stats = stats_of(out);
    for (const json& frame : stats["frames"])
      for (const char* rows : {"drawables", "materials"}) {
        EXPECT_EQ(missing(frame, rows), std::vector<std::string>{}) << name << " " << rows;
        const json& all = frame[rows];
        EXPECT_TRUE(std::is_sorted(all.begin(), all.end(),
                                   [](const json& a, const json& b) { return a["cycles"] > b["cycles"]; }));
      }
  }
}

TEST(FrameCosts, ARowThatIsMissingIsNoticed) {
  const test::TemporaryFolder out;
  replay_into(out, "vases");
  json frame = stats_of(out)["frames"][0];
  ASSERT_EQ(missing(frame, "drawables"), std::vector<std::string>{});
  frame["drawables"].erase(0);
  EXPECT_EQ(missing(frame, "drawables"), (std::vector<std::string>{"cycles", "energy", "bytes", "invocations"}));
}

// The split of the record, by another way.
TEST(FrameCosts, EqualTheRecord) {
  const test::TemporaryFolder out;
  const std::string record = (out / "r.record").string(), split = (out / "s.json").string();
  replay_into(out, "flyby", {"--record", record});
  const json frame = stats_of(out)["frames"][0], tiles = json::parse(test::read_text(out / "tiles_0000.json"));
  for (const char* by : {"drawables", "materials", "tiles"}) {
    ASSERT_EQ(test::run_tessera({"time", record, "--split", by, "--json", split}).status, 0);
    const json rows = json::parse(test::read_text(split))["split"]["views"][0];
    if (by != std::string("tiles")) {
      EXPECT_EQ(frame[by], rows) << by;
      continue;
    }
    for (const json& row : rows) {
      const auto tile = row["tile"].get<std::size_t>();
      const json& costs = tiles["costs"];
      EXPECT_EQ(costs["cycles"][tile], std::ceil(row["cycles"].get<double>()));
      EXPECT_NEAR(costs["energy_nj"][tile].get<double>(), row["energy_nj"].get<double>(), 0.051);
      const int bound = costs["bound_by"][tile];
      EXPECT_EQ(bound < 0 ? "" : costs["bounds"][static_cast<std::size_t>(bound)].get<std::string>(), row["bound_by"]);
    }
  }
}

// Doubling takes too long with events: the path of a tile estimates its bound. For nearly all cycles the estimate
// agrees with doubling.
TEST(FrameCosts, WithEventsBoundsOfTilesAreEstimated) {
  double cycles = 0, right = 0;
  for (const char* name : {"vases", "eggs", "flyby"}) {
    const test::TemporaryFolder out;
    replay_into(out, name, {"--frames", "0:1", "--set", "machine.timing=phases"});
    EXPECT_EQ(json::parse(test::read_text(out / "tiles_0000.json"))["costs"]["estimated"], false);
    const std::string record = (out / "r.record").string(), split = (out / "s.json").string();
    replay_into(out, name, {"--frames", "0:1", "--record", record});
    const json costs = json::parse(test::read_text(out / "tiles_0000.json"))["costs"];
    EXPECT_EQ(costs["estimated"], true);
    ASSERT_EQ(test::run_tessera({"time", record, "--split", "tiles", "--json", split}).status, 0);
    const json rows = json::parse(test::read_text(split))["split"]["views"][0];
    for (const json& row : rows) {
      const auto tile = row["tile"].get<std::size_t>();
      const int bound = costs["bound_by"][tile];
      ASSERT_GE(bound, 0);
      EXPECT_LE(2 * costs["saves"][tile].get<double>(), costs["cycles"][tile].get<double>() + 1);
      cycles += row["cycles"].get<double>();
      if (costs["bounds"][static_cast<std::size_t>(bound)] == row["bound_by"]) right += row["cycles"].get<double>();
    }
  }
  EXPECT_GT(right, 0.9 * cycles);
}

// FSH1: the bytes that tiles move for each purpose equal the bytes that the ledger has for their units.
std::map<std::string, double> bytes_off(const json& frame, const json& tiles) {
  std::map<std::string, double> off;
  for (const auto& [purpose, values] : tiles["costs"]["dram"].items()) off[purpose] += sum(values);
  for (const json& row : frame["dram"])
    if (row["unit"] == "tilecore" || row["unit"] == "resolve")
      off[row["purpose"]] -= row["read_bytes"].get<double>() + row["written_bytes"].get<double>();
  std::erase_if(off, [](const auto& of) { return of.second == 0; });
  return off;
}

TEST(FrameCosts, BytesOfTilesEqualTheLedger) {
  for (const auto& [name, run] : std::vector<std::pair<const char*, std::vector<std::string>>>{
           {"eggs", {}},
           {"vases", {"--set", "parameter_buffer.bytes=4096"}},
           {"flyby", {"--frames", "0:2"}},
           {"serpent", {}}}) {
    const test::TemporaryFolder out;
    replay_into(out, name, run);
    const json stats = stats_of(out);
    for (const json& frame : stats["frames"]) {
      json tiles = json::parse(test::read_text(out / fmt::format("tiles_{:04d}.json", frame["frame"].get<int>())));
      EXPECT_EQ(bytes_off(frame, tiles), (std::map<std::string, double>{})) << name;
      json& value = tiles["costs"]["dram"]["frame_buffer"][1];
      value = value.get<int>() + 64;
      EXPECT_EQ(bytes_off(frame, tiles), (std::map<std::string, double>{{"frame_buffer", 64}}));
    }
  }
}

TEST(FrameCosts, ListsOfTilesNameTheirDrawables) {
  const test::TemporaryFolder out;
  replay_into(out, "flyby");
  const json frame = stats_of(out)["frames"][0], tiles = json::parse(test::read_text(out / "tiles_0000.json"));
  std::map<std::size_t, double> invocations;  // by row
  for (std::size_t tile = 0; tile < tiles["lists"].size(); ++tile) {
    const json& list = tiles["lists"][tile];
    double sub_patches = 0;
    for (std::size_t k = 0; k < list.size(); k += 3) {
      sub_patches += list[k + 1].get<double>();
      invocations[list[k].get<std::size_t>()] += list[k + 2].get<double>();
    }
    EXPECT_EQ(tiles["unlisted"][tile], 0);
    EXPECT_EQ(sub_patches, tiles["maps"]["sub_patches"]["values"][tile].get<double>()) << tile;
  }
  for (const auto& [row, count] : invocations) EXPECT_EQ(frame["drawables"][row]["invocations"], count) << row;
}

// With more drawables than are named, the rest has one row, and the lists of tiles are cut after the drawables that
// are seen most.
TEST(FrameCosts, TheRestOfManyDrawablesIsOneRow) {
  json head = {{"drawables", json::array()}};
  gpu::CostAttribution shares;
  shares.lists.resize(1);
  shares.traffic.resize(1);
  constexpr std::uint32_t kCount = 300;
  for (std::uint32_t d = 0; d < kCount; ++d) {
    head["drawables"].push_back(
        {{"first", d}, {"stride", 1u}, {"count", 1u}, {"node", fmt::format("n{}", d)}, {"material", "m"}});
    shares.drawables[d + 1] = {.invocations = 1, .cycles = 1000.0 - d};
    shares.lists[0].push_back({d + 1, 1, d});
  }
  const FrameCosts costs(shares, DrawableNames(head));
  ASSERT_EQ(costs.drawables().size(), FrameCosts::kMaxRows + 1);
  EXPECT_EQ(costs.drawables()[0]["node"], "n0");
  const json& others = costs.drawables().back();
  EXPECT_EQ(others["node"], FrameCosts::kOthers);
  EXPECT_EQ(others["invocations"], kCount - FrameCosts::kMaxRows);
  EXPECT_EQ(sum(costs.drawables(), "cycles"), sum(costs.materials(), "cycles"));
  ASSERT_EQ(costs.materials().size(), 1u);
  const std::string members = costs.tile_members();
  const json tile = json::parse("{" + members.substr(0, members.rfind(',')) + "}");
  // The 44 others are one row of it, seen most.
  EXPECT_EQ(tile["lists"][0].size(), 3 * FrameCosts::kMaxInList);
  EXPECT_EQ(tile["lists"][0][0], FrameCosts::kMaxRows);
  EXPECT_EQ(tile["lists"][0][1], kCount - FrameCosts::kMaxRows);
  EXPECT_EQ(tile["unlisted"][0], FrameCosts::kMaxRows + 1 - FrameCosts::kMaxInList);
}

// FT1, FT2 and FT3 of gpu/frame_timeline.h, in the file.
TEST(FrameCosts, TheTimelineHoldsTheBytesOfTheFrameAndTilesOfASlotFollowEachOther) {
  for (const char* model : {"phases", "events"}) {
    const test::TemporaryFolder out;
    replay_into(
        out, "serpent",
        {"--frames", "0:1", "--set", "tilecore.memory_bytes=1048576", "--set", std::string("machine.timing=") + model});
    const json frame = stats_of(out)["frames"][0], tiles = json::parse(test::read_text(out / "tiles_0000.json")),
               &of = tiles["timeline"];
    double bytes = 0;
    for (const auto& [source, values] : of["bytes"].items()) bytes += sum(values);
    const double moved =
        frame["counters"]["dram.read_bytes"].get<double>() + frame["counters"]["dram.written_bytes"].get<double>();
    EXPECT_NEAR(bytes, moved, 0.01 * moved) << model;
    const std::size_t windows = of["bytes"].begin()->size();
    const double most = 34.085e3 / 850 * of["cycles"].get<double>() / static_cast<double>(windows);
    for (std::size_t w = 0; w < windows; ++w) {
      double in_window = 0;
      for (const auto& [source, values] : of["bytes"].items()) in_window += values[w].get<double>();
      EXPECT_LE(in_window, 1.01 * most + 64) << model << ' ' << w << ": more than the memory moves at its peak";
    }
    for (const auto& [unit, values] : of["busy"].items()) {
      for (const json& value : values) EXPECT_LE(value, 100) << model << ' ' << unit << ": busier than all the time";
      EXPECT_NEAR(sum(values) / static_cast<double>(windows),
                  100 * frame["timing"]["units"][unit]["utilisation"].get<double>(), 0.6)
          << model << ' ' << unit;
    }
    double lists = 0;
    for (const json& value : of["list_bytes"]) lists = std::max(lists, value.get<double>());
    EXPECT_LE(lists, frame["counters"]["binner.queue_bytes_peak"].get<double>()) << model;
    std::map<std::pair<int, int>, std::vector<std::pair<double, double>>> slots;
    for (std::size_t t = 0; t < of["tile"].size(); ++t) {
      double end = of["begin"][t];
      for (std::size_t k = 0; k < 8; ++k) end += of["spans"][8 * t + k].get<double>();
      EXPECT_LE(end, of["cycles"].get<double>() + 1);
      EXPECT_NEAR(end - of["begin"][t].get<double>(),
                  tiles["costs"]["cycles"][of["tile"][t].get<std::size_t>()].get<double>(), 2.0);
      slots[{of["core"][t], of["slot"][t]}].emplace_back(of["begin"][t], end);
    }
    for (auto& [slot, spans] : slots) {
      std::sort(spans.begin(), spans.end());
      for (std::size_t k = 1; k < spans.size(); ++k) EXPECT_LE(spans[k - 1].second, spans[k].first + 1) << model;
    }
    EXPECT_GT(of["slots"], 1) << "the case needs tiles at once";
  }
}

}  // namespace
}  // namespace tessera::replay::frame_costs_test
