// Bounding polygons of the visibility methods against brute force in double precision.
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"

namespace tessera::tilecore::bounding_polygons_test {
namespace {

struct Point {
  double x, y;
};

// Where a vertex is relative to a sample, by the definition, without rounding.
Point exact_corner(const MethodMesh& m, std::size_t v, std::uint32_t s) {
  const MicroMesh& mesh = m.mesh;
  const double t = m.effects.motion ? static_cast<double>(m.samples.t(s)) : 0.0, z0 = static_cast<double>(mesh.z0[v]),
               z1 = m.effects.motion ? static_cast<double>(mesh.z1[v]) : z0;
  const double z = (1 - t) * z0 + t * z1, rate = m.settings.orthographic ? t : t * z1 / z,
               invf = static_cast<double>(m.settings.inverse_focus);
  const double coc = !m.effects.lens ? 0 : m.settings.orthographic ? 1 - z * invf : 1 / z - invf;
  const auto at = [&](float open, float close, float sample, double lens) {
    const double x0 = static_cast<double>(open), x1 = m.effects.motion ? static_cast<double>(close) : x0;
    return x0 + rate * (x1 - x0) - static_cast<double>(sample) - lens * coc;
  };
  const double u = m.effects.lens ? static_cast<double>(m.samples.lens_u[s]) : 0.0,
               w = m.effects.lens ? static_cast<double>(m.samples.lens_v[s]) : 0.0;
  return {at(mesh.x0[v], mesh.x1[v], m.samples.x[s], u), at(mesh.y0[v], mesh.y1[v], m.samples.y[s], w)};
}

bool inside(const Point& a, const Point& b, const Point& c) {
  const auto edge = [](const Point& p, const Point& q) { return p.x * q.y - p.y * q.x; };
  const double ab = edge(a, b), bc = edge(b, c), ca = edge(c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0 && ab + bc + ca > 0) || (ab <= 0 && bc <= 0 && ca <= 0 && ab + bc + ca < 0);
}

bool exactly_hit(const MethodMesh& m, std::size_t cell, std::uint32_t s) {
  std::array<Point, 4> p;
  for (std::size_t k = 0; k < 4; ++k) p[k] = exact_corner(m, static_cast<std::size_t>(m.mesh.corner[k][cell]), s);
  return inside(p[0], p[1], p[2]) || inside(p[0], p[2], p[3]);
}

using Cut = std::function<void(const PrimitiveBound&, const MethodMesh&, std::vector<BoundingPiece>&)>;

struct Coverage {
  int hits = 0, missed = 0, twice = 0, outside = 0;
};

// Exact hits of every cell against the cell's pieces.
Coverage cover(const MethodMesh& m, const Cut& cut, double lens_radius) {
  Coverage result;
  PrimitiveBound bound(m.mesh, m.effects, m.settings, lens_radius);
  std::vector<BoundingPiece> pieces;
  std::vector<int> count;
  StencilUnit unit;
  std::vector<std::uint32_t> kept;
  m.for_each_cell([&](std::size_t cell) {
    bound.clear();
    bound.add_cell(cell);
    pieces.clear();
    cut(bound, m, pieces);
    count.assign(m.samples.count, 0);
    for (const BoundingPiece& piece : pieces) {
      if (piece.pixels.empty() || !(piece.pixels.intersect(m.samples.pixels) == piece.pixels)) ++result.outside;
      unit.keep(m.samples, piece.pixels, piece.references, kept);
      for (const std::uint32_t s : kept) ++count[s];
    }
    for (std::uint32_t s = 0; s < m.samples.count; ++s) {
      result.twice += count[s] > 1 ? 1 : 0;
      if (!exactly_hit(m, cell, s)) continue;
      ++result.hits;
      result.missed += count[s] == 0 ? 1 : 0;
    }
  });
  return result;
}

const std::vector<std::pair<const char*, Cut>> kCuts = {
    {"whole motion",
     [](const PrimitiveBound& b, const MethodMesh& m, auto& out) { whole_motion_piece(b, m.samples.pixels, {}, out); }},
    {"own number of segments", [](const PrimitiveBound& b, const MethodMesh& m,
                                  auto& out) { segment_pieces(b, m.samples.pixels, {}, segments_for(b), out); }},
    {"3 segments",
     [](const PrimitiveBound& b, const MethodMesh& m, auto& out) { segment_pieces(b, m.samples.pixels, {}, 3, out); }},
    {"256 segments", [](const PrimitiveBound& b, const MethodMesh& m,
                        auto& out) { segment_pieces(b, m.samples.pixels, {}, 256, out); }},
    {"interleaved", [](const PrimitiveBound& b, const MethodMesh& m,
                       auto& out) { interleaved_pieces(b, m.samples.pixels, {}, *m.samples.classes, out); }},
    {"partition",
     [](const PrimitiveBound& b, const MethodMesh& m, auto& out) { partition_pieces(b, m.samples.pixels, {}, out); }}};

template <class Visit>
void for_random_meshes(std::uint32_t seed, int trials, const Visit& visit) {
  Random random(seed);
  for (int trial = 0; trial < trials; ++trial)
    for (const bool orthographic : {false, true})
      for (const auto& [motion, lens] : {std::pair{false, false}, {true, false}, {false, true}, {true, true}})
        for (const bool cluster : {false, true}) visit(random_mesh(random, {{motion, lens}, orthographic, cluster}));
}

TEST(BoundingPolygons, HoldEveryExactHitInExactlyOnePiece) {
  int hits = 0;
  for_random_meshes(1, 3, [&](const MethodMesh& m) {
    for (const auto& [name, cut] : kCuts) {
      const Coverage c = cover(m, cut, static_cast<double>(m.lens_radius));
      EXPECT_EQ(c.missed, 0) << name;   // BP1
      EXPECT_EQ(c.twice, 0) << name;    // BP2
      EXPECT_EQ(c.outside, 0) << name;  // BP3
      hits += c.hits;
    }
  });
  EXPECT_GT(hits, 100000);
}

TEST(BoundingPolygons, APartOfTheShutterIsCutOutOfTheWhole) {
  for_random_meshes(2, 1, [&](const MethodMesh& m) {
    PrimitiveBound bound(m.mesh, m.effects, m.settings, static_cast<double>(m.lens_radius));
    StencilUnit unit;
    std::vector<std::uint32_t> kept;
    m.for_each_cell([&](std::size_t cell) {
      bound.clear();
      bound.add_cell(cell);
      std::vector<BoundingPiece> pieces;
      segment_pieces(bound, m.samples.pixels, {50, 180}, 4, pieces);
      partition_pieces(bound, m.samples.pixels, {50, 180}, pieces);
      whole_motion_piece(bound, m.samples.pixels, {50, 180}, pieces);
      for (const BoundingPiece& piece : pieces) {
        unit.keep(m.samples, piece.pixels, piece.references, kept);
        for (const std::uint32_t s : kept)
          ASSERT_TRUE(m.samples.stencil(s) >= 50 && m.samples.stencil(s) <= 180);  // BP3
      }
    });
  });
}

// Missed hits of all random meshes with a cut made wrong on purpose.
int missed_by(const Cut& cut, double lens_share) {
  int missed = 0;
  for_random_meshes(3, 1, [&](const MethodMesh& m) {
    missed += cover(m, cut, lens_share * static_cast<double>(m.lens_radius)).missed;
  });
  return missed;
}

TEST(BoundingPolygons, TwinsWithHalfTheLensOpenAtTheTopOrWithTheMiddleOfASegmentAreCaught) {
  EXPECT_EQ(missed_by(kCuts[4].second, 1), 0);
  EXPECT_GT(missed_by(kCuts[0].second, 0.5), 0);
  EXPECT_GT(missed_by(
                [](const PrimitiveBound& b, const MethodMesh& m, auto& out) {
                  segment_pieces(b, m.samples.pixels, {}, 4, out);
                  for (BoundingPiece& piece : out) piece.references.closed = false;
                },
                1),
            0);
  // Each segment with the rectangle of its middle.
  EXPECT_GT(missed_by(
                [](const PrimitiveBound& b, const MethodMesh& m, auto& out) {
                  for (int k = 0; k < 4; ++k) {
                    const IntRect pixels = b.pixels(k / 4.0 + 0.125, k / 4.0 + 0.125, m.samples.pixels);
                    if (!pixels.empty()) out.push_back({pixels, StencilReferences::of({64 * k, 64 * k + 63})});
                  }
                },
                1),
            0);
}

TEST(BoundingPolygons, PartsWhoseTimesAreNotWidenedAreCaught) {
  // An upright square that creeps: samples are hit as soon as its edge has passed them, so the first and the last
  // stencil value of a part count.
  MethodMesh m;
  m.effects = {true, false};
  m.resize(4);
  m.place(0, 2.3f, 2, 1);
  m.place(1, 5.3f, 2, 1);
  m.place(2, 5.3f, 5, 1);
  m.place(3, 2.3f, 5, 1);
  for (std::size_t v = 0; v < 4; ++v) m.move(v, 5, 0, 1);
  m.mesh.begin_leaf();
  m.mesh.add_cell({0, 1, 2, 3}, 0);
  m.finish({0, 0, 16, 8}, 64);
  EXPECT_EQ(cover(m, kCuts[4].second, 0).missed, 0);
  // References between the times of the crossing, rounded to the stencil value after it.
  const Cut inwards = [](const PrimitiveBound& b, const MethodMesh& mesh, auto& out) {
    partition_pieces(b, mesh.samples.pixels, {}, out);
    for (BoundingPiece& piece : out) {
      const PrimitiveBound::Times times = b.times_over(piece.pixels);
      piece.references = {static_cast<std::uint8_t>(std::min(255.0, std::floor(times.low * 256) + 1)),
                          static_cast<std::uint8_t>(std::min(255.0, std::floor(times.high * 256))), false};
    }
  };
  EXPECT_GT(cover(m, inwards, 0).missed, 0);
}

TEST(BoundingPolygons, FollowVerticesThatApproachAtDifferentRates) {
  // One vertex comes towards the camera, the other recedes: linear interpolation of positions would be wrong by pixels.
  MethodMesh m;
  m.effects = {true, false};
  m.resize(3);
  m.place(0, 2, 2, 8);
  m.place(1, 4, 2, 0.5f);
  m.place(2, 2, 4, 8);
  m.move(0, 16, 0, 0.5f);
  m.move(1, 16, 0, 8);
  m.move(2, 16, 0, 0.5f);
  m.mesh.begin_leaf();
  m.mesh.add_cell({0, 1, 2, 2}, 0);
  m.finish({0, 0, 32, 8}, 16);
  PrimitiveBound bound(m.mesh, m.effects, m.settings, 0);
  bound.add_cell(0);
  // At t = 1/2: rates 1/17 and 16/17.
  const PrimitiveBound::Box box = bound.over(0.5, 0.5);
  EXPECT_NEAR(box.x0, 2 + 16.0 / 17, 1e-4);
  EXPECT_NEAR(box.x1, 4 + 16.0 * 16 / 17, 1e-4);
  for (const auto& [name, cut] : kCuts) EXPECT_EQ(cover(m, cut, 0).missed, 0) << name;
}

}  // namespace
}  // namespace tessera::tilecore::bounding_polygons_test
