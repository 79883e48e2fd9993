// Walls that stand on edges inside of a sheet, and sheets that cross: one curve for all that meet there.
#include <map>

#include "scene/subdivision/control_cage.h"
#include "tests/support/tests.h"

namespace tessera::scene::subdivision::cage_walls_test {
namespace {

// Sheets of quads that share vertices inside of each, none between them.
struct Sheets {
  Primitive primitive;
  std::size_t quads = 0;

  // `point(i, j)` over cells x cells quads.
  template <class Point>
  void add(int columns, int rows, const Point& point) {
    auto& positions = primitive.vertices.positions;
    const auto first = static_cast<std::uint32_t>(positions.size());
    for (int j = 0; j <= rows; ++j)
      for (int i = 0; i <= columns; ++i) positions.push_back(point(i, j));
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i) {
        const auto at = [&](int di, int dj) {
          return first + static_cast<std::uint32_t>((j + dj) * (columns + 1) + i + di);
        };
        for (const std::uint32_t v : {at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)})
          primitive.indices.push_back(v);
        ++quads;
      }
  }
};

Vec3 ground(int i, int j) {
  return {static_cast<float>(i), static_cast<float>(j),
          0.4f * std::sin(1.7f * static_cast<float>(i) + static_cast<float>(j * j))};
}

// How many patch edges lie between two places where at least three meet, and whether all of those are one curve.
struct Meeting {
  std::size_t places = 0, torn = 0;
};
Meeting meeting_edges(const Primitive& patches) {
  using Key = std::array<float, 6>;
  std::map<Key, std::vector<std::array<float, 12>>> edges;
  constexpr std::array<std::array<std::size_t, 4>, 4> kEdges = {
      {{0, 1, 2, 3}, {12, 13, 14, 15}, {0, 4, 8, 12}, {3, 7, 11, 15}}};
  for (std::size_t p = 0; p + 16 <= patches.vertices.count(); p += 16)
    for (const auto& edge : kEdges) {
      std::array<float, 12> curve, back;
      for (std::size_t k = 0; k < 4; ++k)
        for (int c = 0; c < 3; ++c) {
          curve[3 * k + static_cast<std::size_t>(c)] = patches.vertices.positions[p + edge[k]][c];
          back[3 * k + static_cast<std::size_t>(c)] = patches.vertices.positions[p + edge[3 - k]][c];
        }
      const auto& one = std::min(curve, back);
      edges[{one[0], one[1], one[2], one[9], one[10], one[11]}].push_back(one);
    }
  Meeting out;
  for (const auto& [ends, curves] : edges) {
    if (curves.size() < 3) continue;
    ++out.places;
    for (const auto& curve : curves)
      for (std::size_t k = 0; k < 12; ++k)
        if (curve[k] != curves[0][k]) {
          ++out.torn;
          break;
        }
  }
  return out;
}

TEST(CageWalls, MeetTheirSheetInOneCurve) {
  for (const int levels : {0, 1, 2, 3, 4})
    for (const int length : {1, 2, 4})
      for (const int kind : {0, 1, 2}) {
        SCOPED_TRACE(std::to_string(levels) + ", wall of " + std::to_string(length) + ", kind " + std::to_string(kind));
        Sheets sheets;
        sheets.add(4, 4, ground);
        // On the row of edges j = 2: a wall above it, one on each side, or a sheet that goes through.
        const int rows = kind == 2 ? 2 : 1;
        const auto wall = [&](float way) {
          return
              [=](int i, int j) { return ground(i, 2) + Vec3(0, 0, way * static_cast<float>(kind == 2 ? j - 1 : j)); };
        };
        sheets.add(length, rows, wall(1.0f));
        if (kind == 1) sheets.add(length, rows, wall(-1.5f));
        CageRules rules;
        rules.quads = sheets.quads;
        rules.levels = levels;
        MemoryBudget budget(1u << 30);
        const Meeting meeting = meeting_edges(convert(sheets.primitive, rules, budget, "test"));
        EXPECT_EQ(meeting.places, static_cast<std::size_t>(length << levels));
        EXPECT_EQ(meeting.torn, 0u);
      }
}

// A leaf with a front and a back: no wall stands on anything, its edges inside are as smooth as the edges of one side
// alone.
TEST(CageWalls, SheetsThatLieOnEachOtherHaveNoSharpEdges) {
  Sheets sheets;
  sheets.add(3, 3, ground);
  sheets.add(3, 3, [](int i, int j) { return ground(3 - i, j); });
  CageRules rules;
  rules.quads = sheets.quads;
  rules.levels = 1;
  EXPECT_TRUE(build_cage(sheets.primitive, rules).crease_sharpness.empty());
}

}  // namespace
}  // namespace tessera::scene::subdivision::cage_walls_test
