// The study of docs/when_it_pays.md: some of its points rendered again, its lines and tables made again from its points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/captures.h"
#include "tests/support/csv_rows.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using test::csv_rows;
using test::number_of;
using test::read_text;

const fs::path kRoot = TESSERA_SOURCE_DIR;

// A row of points.csv: one capture, frame, tile size and triangle size.
using StudyRow = std::map<std::string, std::string>;
const fs::path kPaysFolder = kRoot / "docs" / "images" / "when_it_pays";
constexpr double kFinishedFrame = 640 * 360 * 8;  // bytes

std::string place_of(const StudyRow& row) {
  return row.at("layers") + "," + row.at("attributes") + "," + row.at("blur") + "," + row.at("tile");
}

// What a replay gives in the place of a row, by scheme.
nlohmann::json wall_replay(const StudyRow& row) {
  const test::TemporaryFolder out;
  const std::string capture = "wall_" + row.at("layers") + (row.at("attributes") == "yes" ? "" : "_plain"),
                    frame = row.at("blur") == "0" ? "0:1" : (row.at("blur") == "8" ? "1:2" : "2:3");
  const std::map<std::string, std::string> edges = {
      {"0.5", "1"}, {"1.0", "1.414"}, {"4.0", "2.828"}, {"16.0", "5.657"}, {"64.0", "11.314"}};
  EXPECT_EQ(
      test::run_tessera(
          {"replay", (kRoot / "captures" / "studies" / (capture + ".glb")).string(), "--size", "640x360", "--frames",
           frame, "--baselines", "--quiet", "--no-report", "--set", "parameter_buffer.bytes=268435456", "--set",
           "tessellation.target_edge_pixels=" + edges.at(row.at("px2")), "--set", "tile.width=" + row.at("tile"),
           "--set", "tile.height=" + row.at("tile"), "--out", out.path().string()})
          .status,
      0);
  return nlohmann::json::parse(read_text(out / "stats.json"))["frames"][0]["baselines"];
}

// Columns of a row that a replay contradicts.
std::vector<std::string> contradictions(const StudyRow& row, const nlohmann::json& schemes) {
  std::vector<std::string> wrong;
  for (const auto& [scheme, counters] : schemes.items()) {
    const auto value = [&counters = counters](const char* name) {
      return counters["baseline." + std::string(name)].get<std::uint64_t>();
    };
    if (number_of(row.at("traffic " + scheme)) != value("dram_bytes")) wrong.push_back("traffic " + scheme);
    if (number_of(row.at("evaluations " + scheme)) !=
        value("position_evaluations") + value("domain_evaluations_cached"))
      wrong.push_back("evaluations " + scheme);
    if (number_of(row.at("cycles " + scheme)) != value("cycles")) wrong.push_back("cycles " + scheme);
    if (number_of(row.at("energy " + scheme)) != value("energy_nj")) wrong.push_back("energy " + scheme);
  }
  if (number_of(row.at("triangles")) != schemes["post-tessellation"]["baseline.primitives"].get<std::uint64_t>())
    wrong.push_back("triangles");
  return wrong;
}

TEST(WhenItPays, ItsPointsAreThoseOfReplays) {
  const std::set<std::string> again = {"1,yes,8,16 4.0", "4,no,0,32 16.0", "4,yes,32,64 1.0", "16,yes,0,32 64.0"};
  std::set<std::string> done;
  for (StudyRow row : csv_rows(kPaysFolder / "points.csv")) {
    const std::string name = place_of(row) + " " + row.at("px2");
    if (!again.contains(name)) continue;
    const nlohmann::json schemes = wall_replay(row);
    ASSERT_EQ(schemes.size(), 8u);
    EXPECT_THAT(contradictions(row, schemes), testing::IsEmpty()) << name << ": run docs/images/when_it_pays/make.sh";
    row["traffic control-list"] += "0";
    EXPECT_THAT(contradictions(row, schemes), testing::ElementsAre("traffic control-list"));
    done.insert(name);
  }
  EXPECT_EQ(done, again);
}

// Triangle sizes in px² at which the first of two costs is the smaller one, as break_even.csv writes them. The logarithm
// of the costs' ratio is linear in that of the size.
struct TwoCosts {
  double px2, ours, theirs;
};
std::string sizes_where_ours_is_less(const std::vector<TwoCosts>& costs) {
  const auto text_of = [](double x) {
    std::ostringstream text;
    text << std::fixed << std::setprecision(x < 10 ? 1 : 0) << x;
    return text.str();
  };
  std::vector<std::string> parts;
  std::string begin = "open";
  const auto advantage = [&](std::size_t i) { return std::log(costs[i].ours / costs[i].theirs); };
  bool inside = advantage(0) < 0;
  for (std::size_t i = 1; i < costs.size(); ++i) {
    const double a = advantage(i - 1), b = advantage(i);
    if ((b < 0) == inside) continue;
    const std::string line = text_of(costs[i - 1].px2 * std::pow(costs[i].px2 / costs[i - 1].px2, a / (a - b)));
    if (inside) parts.push_back(begin == "open" ? "<" + line : begin + "-" + line);
    begin = line;
    inside = !inside;
  }
  if (inside) parts.push_back(begin == "open" ? "all" : ">" + begin);
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : "+") + part;
  return all.empty() ? "none" : all;
}

TEST(WhenItPays, EqualCostsAreFoundBetweenTwoSizes) {
  EXPECT_EQ(sizes_where_ours_is_less({{1, 1, 2}, {4, 2, 3}}), "all");
  EXPECT_EQ(sizes_where_ours_is_less({{1, 2, 2}, {4, 3, 3}}), "none");
  EXPECT_EQ(sizes_where_ours_is_less({{1, 1, 2}, {4, 2, 1}}), "<2.0");
  EXPECT_EQ(sizes_where_ours_is_less({{1, 2, 1}, {4, 1, 2}, {16, 1, 2}}), ">2.0");
  EXPECT_EQ(sizes_where_ours_is_less({{1, 1, 2}, {4, 2, 1}, {16, 1, 2}, {64, 2, 1}}), "<2.0+8.0-32");
}

TEST(WhenItPays, ItsLinesFollowFromItsPoints) {
  const std::vector<StudyRow> points = csv_rows(kPaysFolder / "points.csv");
  int lines = 0;
  for (const StudyRow& row : csv_rows(kPaysFolder / "break_even.csv"))
    for (const auto& [column, said] : row) {
      if (!points.front().contains("traffic " + column)) continue;
      std::vector<TwoCosts> costs;
      const std::string cost = row.at("cost");
      const double both = cost == "traffic" ? kFinishedFrame : 0;
      for (const StudyRow& point : points)
        if (place_of(point) == place_of(row))
          costs.push_back({std::stod(point.at("px2")), std::stod(point.at(cost + " tessera")) - both,
                           std::stod(point.at(cost + " " + column)) - both});
      EXPECT_EQ(said, sizes_where_ours_is_less(costs)) << cost << " " << place_of(row) << " " << column;
      ++lines;
    }
  EXPECT_EQ(lines, 4 * 36 * 7);
}

// Parts of the traffic in 4 layers of triangles of 1 px².
std::vector<StudyRow> rows_of_parts() {
  std::vector<StudyRow> rows;
  for (const StudyRow& row : csv_rows(kPaysFolder / "parts.csv"))
    if (place_of(row) == "4,yes,0,32" && row.at("px2") == "1.0") rows.push_back(row);
  return rows;
}

TEST(WhenItPays, ItsPartsAreThoseOfAReplay) {
  const std::vector<StudyRow> rows = rows_of_parts();
  ASSERT_EQ(rows.size(), 8u);
  const nlohmann::json schemes = wall_replay(rows.front());
  for (const StudyRow& row : rows) {
    const auto value = [&](const char* name) {
      return schemes[row.at("scheme")]["baseline." + std::string(name)].get<std::uint64_t>();
    };
    const std::uint64_t frame = value("frame_bytes_read") + value("frame_bytes_written"),
                        records = value("patch_bytes_cached");
    for (const auto& [column, measured] :
         {std::pair{"lists", value("dram_bytes") - frame - records}, std::pair{"records", records},
          std::pair{"frame", frame}, std::pair{"lists_written", value("queue_bytes_written")},
          std::pair{"bounding_operations", value("bounding_operations")},
          std::pair{"partial_render_at_half", value("partial_render_bytes")},
          std::pair{"spill_at_half", value("spill_bytes")}, std::pair{"cycles", value("cycles")},
          std::pair{"energy_nj", value("energy_nj")}})
      EXPECT_EQ(number_of(row.at(column)), measured)
          << row.at("scheme") << ", " << column << ": run docs/images/when_it_pays/make.sh";
  }
}

// "| `SCHEME` | LEAST to MOST | LEAST to MOST |" of theirs over ours, a cell for each cost.
std::string line_of_ranges(const std::vector<StudyRow>& points, const std::string& scheme) {
  std::ostringstream line;
  line << std::fixed << "| `" << scheme << "` |";
  for (const char* cost : {"traffic ", "evaluations ", "cycles ", "energy "}) {
    const double both = cost[0] == 't' ? kFinishedFrame : 0;
    std::vector<double> ratios;
    for (const StudyRow& point : points)
      ratios.push_back((std::stod(point.at(cost + scheme)) - both) /
                       (std::stod(point.at(std::string(cost) + "tessera")) - both));
    const double most = *std::max_element(ratios.begin(), ratios.end());
    line << " " << std::setprecision(2) << *std::min_element(ratios.begin(), ratios.end()) << " to "
         << std::setprecision(most < 10 ? 2 : 1) << most << " |";
  }
  return line.str();
}

TEST(WhenItPays, ThePageShowsItsTables) {
  const std::string page = read_text(kRoot / "docs" / "when_it_pays.md");
  const std::vector<StudyRow> points = csv_rows(kPaysFolder / "points.csv");
  const std::map<std::string, std::string> names = {
      {"1,yes,0,32", "1 layer"},  {"4,yes,0,32", "4 layers"}, {"16,yes,0,32", "16 layers"}, {"4,yes,8,32", "blur 8"},
      {"4,yes,32,32", "blur 32"}, {"4,no,0,32", "plain"},     {"4,yes,0,16", "tiles 16"},   {"4,yes,0,64", "tiles 64"}};
  const std::set<std::string> of_others = {"1 layer", "4 layers", "blur 32"};
  int rows = 0;
  for (const StudyRow& row : csv_rows(kPaysFolder / "break_even.csv")) {
    const auto name = names.find(place_of(row));
    if (name == names.end() || row.at("cost") == "evaluations" ||
        (row.at("cost") != "traffic" && !of_others.contains(name->second)))
      continue;
    std::string line = "| " + name->second + " |";
    for (const char* scheme : {"patch-whole", "post-tessellation", "post-position", "deferred-vertex",
                               "visibility-stream", "control-list", "immediate"}) {
      line += " " + row.at(scheme) + " |";
      EXPECT_THAT(page, testing::HasSubstr("\n" + line_of_ranges(points, scheme) + "\n"));
    }
    EXPECT_THAT(page, testing::HasSubstr("\n" + line + "\n")) << "run docs/images/when_it_pays/make.sh";
    ++rows;
  }
  EXPECT_EQ(rows, 8 + 2 * 3);
}

}  // namespace
}  // namespace tessera
