// Tiles of the sparse pass against the exact procedure: no visible point may lie in a tile that lacks its cell.
#include "base/parallel.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/tests.h"
#include "tests/tilecore/procedural/cell_lists.h"
#include "tests/tilecore/procedural/random_scene.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::tilecore::missed_tiles_test {
namespace {

using shaders::ShapeId;

struct Trials {
  std::uint32_t seed = 1;
  int scenes = 1000;
  bool general = true;   // with motion and lens
  bool deforms = false;  // parameters are animated, too
  int width = 96, height = 64;
  int points = 24;  // of each scene, anywhere on the surface
  int cells = 0;    // of each scene, where the points that come closest to leaving them are looked at
  ProcedureSettings settings;
};

// Visible points of random scenes, by the exact double-precision procedure, whose (object, tile) the tag map lacks and
// whose (cell, tile) the parameter map lacks.
struct Misses {
  int scenes = 0, points = 0, tags = 0, cells = 0;
};

constexpr int kTile = 16;

class Scene {
 public:
  Scene(Random& random, const Trials& trials, ShapeId id)
      : trials_(trials),
        id_(id),
        scene_(random, id, trials.general, trials.deforms, trials.width, trials.height),
        frame_(*scene_.scene.frame),
        drawable_(frame_.drawables[0]),
        grid_(trials.width, trials.height, kTile, kTile),
        maps_(frame_, grid_.region(), trials.settings, 2, 64) {
    const CellLists lists(frame_, maps_, grid_);
    for (binner::TileIndex tile = 0; tile < grid_.tile_count(); ++tile) of_tile_.push_back(lists.of_tile(tile));
  }

  const ParameterMaps& maps() const { return maps_; }

  // Looks at one point of the surface, at a time and through a point on the lens' edge.
  void look(double u, double v, double t, double angle, Misses& misses) const {
    const scene::Projection& projection = frame_.projection;
    const std::array<shaders::ShapePoint<double>, 2> p = {tangents(0, u, v), tangents(1, u, v)};
    const auto raster = [&](auto&& of, double w) {
      const auto at = [&](std::size_t key) {
        const Vector3<double>& a = of(p[key]);
        return DMat4(drawable_.to_raster[key]) * DVec4(a.x, a.y, a.z, w);
      };
      return at(0) * (1 - t) + at(1) * t;
    };
    const DVec4 r = raster(
                    [](const auto&q) -> const auto& { return q.position; }, 1),
                ru = raster(
                    [](const auto&q) -> const auto& { return q.by_u; }, 0),
                rv = raster(
                    [](const auto&q) -> const auto& { return q.by_v; }, 0);
    if (!(r.z > projection.near * 1.0001) || !std::isfinite(r.x + r.y)) return;
    const double w = projection.orthographic ? 1.0 : r.z, x = r.x / w, y = r.y / w,
                 coc =
                     projection.orthographic ? 1 - r.z * projection.inverse_focus : 1 / r.z - projection.inverse_focus;
    const double px = x + projection.lens_scale * std::cos(angle) * coc,
                 py = y + projection.lens_scale * std::sin(angle) * coc;
    if (!(px > 0.01 && py > 0.01 && px < trials_.width - 0.01 && py < trials_.height - 0.01)) return;
    const double turn = projection.orthographic ? 0 : 1, area = (ru.x - turn * x * ru.z) * (rv.y - turn * y * rv.z) -
                                                                (ru.y - turn * y * ru.z) * (rv.x - turn * x * rv.z);
    if (!drawable_.material->double_sided && area > -1e-9) return;  // culled at will
    ++misses.points;
    const auto tile = grid_.index(static_cast<int>(px) / kTile, static_cast<int>(py) / kTile);
    bool tagged = false, listed = false;
    for (const binner::ListEntry& entry : of_tile_[tile]) {
      const ParameterCell& cell = maps_.cells()[ParameterMaps::cell_of(entry.range)];
      if (t < entry.t0 / 256.0 || t > (entry.t1 + 1) / 256.0) continue;
      tagged = true;
      listed = listed || (u >= static_cast<double>(cell.u0) && u <= static_cast<double>(cell.u1) &&
                          v >= static_cast<double>(cell.v0) && v <= static_cast<double>(cell.v1));
    }
    misses.tags += tagged ? 0 : 1;
    misses.cells += listed ? 0 : 1;
  }

  // Looks at the points of a cell that reach farthest along x and y on screen, found by the array on a grid of 8 x 8
  // points, corners included; and at one corner, where several cells meet.
  void look_at_extremes(const ParameterCell& cell, Random& random, SampleRegisters& registers, Misses& misses) const {
    constexpr std::size_t kSide = 8;
    ArrayProgram program;
    program.shape = id_;
    program.input = &drawable_.procedure->pieces[cell.piece].input;
    if (drawable_.deforming) program.close = &drawable_.procedure_close->pieces[cell.piece].input;
    program.to_raster = drawable_.to_raster;
    program.keys = drawable_.moving ? 2 : 1;
    program.orthographic = frame_.projection.orthographic;
    program.divided = false;
    for (std::size_t k = 0; k < kSide * kSide; ++k) {
      const auto at = [](float from, float to, std::size_t step) {
        return step + 1 == kSide ? to : from + (to - from) * (static_cast<float>(step) / (kSide - 1));
      };
      registers.u[k] = at(cell.u0, cell.u1, k % kSide), registers.v[k] = at(cell.v0, cell.v1, k / kSide);
    }
    run_procedure(program, kSide * kSide, registers);
    // At one of the shutter's ends mostly, where bounds are tight.
    const std::size_t key = program.keys == 2 && random.coin() ? 1 : 0;
    const float t = random.integer(0, 2) == 0 ? random.uniform(0, 1) : static_cast<float>(key);
    std::array<std::size_t, 4> farthest{};
    const auto screen = [&](std::size_t column, std::size_t k) {
      const float z = program.orthographic ? 1.0f : registers.at[key][SampleRegisters::kZ][k];
      return registers.at[key][column][k] / z;
    };
    for (std::size_t k = 1; k < kSide * kSide; ++k)
      for (const std::size_t axis : {0u, 1u}) {
        const std::size_t column = axis == 0 ? SampleRegisters::kX : SampleRegisters::kY;
        if (screen(column, k) < screen(column, farthest[2 * axis])) farthest[2 * axis] = k;
        if (screen(column, k) > screen(column, farthest[2 * axis + 1])) farthest[2 * axis + 1] = k;
      }
    // The lens moves a point on along the same axis, one way or the other.
    constexpr double kQuarter = 1.5707963267948966;
    for (std::size_t e = 0; e < farthest.size(); ++e)
      look(static_cast<double>(registers.u[farthest[e]]), static_cast<double>(registers.v[farthest[e]]),
           static_cast<double>(t), kQuarter * random.integer(0, 3), misses);
    look(static_cast<double>(random.coin() ? cell.u0 : cell.u1), static_cast<double>(random.coin() ? cell.v0 : cell.v1),
         static_cast<double>(t), kQuarter * random.integer(0, 3), misses);
  }

 private:
  shaders::ShapePoint<double> tangents(std::size_t key, double u, double v) const {
    const scene::Procedure& procedure = key == 0 ? *drawable_.procedure : *drawable_.procedure_close;
    return shaders::with_shape(
        id_, [&](auto shape) { return shaders::shape_tangents<decltype(shape)>(procedure.pieces[0].input, u, v); });
  }

  const Trials& trials_;
  ShapeId id_;
  RandomScene scene_;
  const scene::FrameGeometry& frame_;
  const scene::PosedDrawable& drawable_;
  binner::TileGrid grid_;
  ParameterMaps maps_;
  std::vector<std::vector<binner::ListEntry>> of_tile_;
};

Misses count_misses(const Trials& trials) {
  Random random(trials.seed);
  const auto registers = std::make_unique<SampleRegisters>();
  Misses misses;
  for (int n = 0; n < trials.scenes; ++n) {
    const Scene scene(random, trials, static_cast<ShapeId>(n % test::kShapeCount));
    ++misses.scenes;
    for (int k = 0; k < trials.points; ++k) {
      const double u = static_cast<double>(random.uniform(0, 1)), v = static_cast<double>(random.uniform(0, 1)),
                   t = static_cast<double>(random.uniform(0, 1)),
                   angle = static_cast<double>(random.uniform(0, 6.2831f));
      scene.look(u, v, t, angle, misses);
    }
    const std::vector<ParameterCell>& cells = scene.maps().cells();
    for (int k = 0; k < trials.cells && !cells.empty(); ++k)
      scene.look_at_extremes(cells[static_cast<std::size_t>(random.integer(0, static_cast<int>(cells.size()) - 1))],
                             random, *registers, misses);
  }
  return misses;
}

Trials interval_trials(std::uint32_t seed) {
  Trials trials;
  trials.seed = seed;
  trials.settings.cell_pixels = 24;
  return trials;
}

TEST(ParameterMaps, IntervalsMissNothingInRandomScenes) {  // PM1
  const Misses misses = count_misses(interval_trials(1));
  EXPECT_GT(misses.points, 10 * misses.scenes / 4);
  EXPECT_EQ(misses.tags, 0);
  EXPECT_EQ(misses.cells, 0);
}

TEST(ParameterMaps, IntervalsMissNothingWhereParametersAreAnimated) {  // PM1
  Trials trials = interval_trials(2);
  trials.deforms = true;
  trials.cells = 4;
  const Misses misses = count_misses(trials);
  EXPECT_GT(misses.points, 10 * misses.scenes / 4);
  EXPECT_EQ(misses.tags, 0);
  EXPECT_EQ(misses.cells, 0);
}

TEST(ParameterMaps, ThePublishedOnesMissPointsBetweenTheirTuples) {
  Trials trials;
  trials.scenes = 2000;
  trials.general = false;
  trials.settings.mode = ProcedureSettings::Mode::kPublished;
  trials.settings.padding = 0;
  trials.settings.sparse_spacing = 16;
  const Misses bare = count_misses(trials);
  trials.settings.padding = 1;
  const Misses padded = count_misses(trials);
  EXPECT_GT(bare.tags, 0);
  EXPECT_GT(bare.cells, padded.cells);
}

// At length, ten thousand scenes for each seed: small frames, whose cells are looked at where they come closest to
// leaving their bounds. Half of the scenes are general, a quarter deforms besides.
class HundredThousandScenes : public testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, HundredThousandScenes, testing::Range(0u, 10u));

TEST_P(HundredThousandScenes, MissNoTile) {  // PM1
#ifdef TESSERA_SANITIZED
  constexpr int kScenes = 20;
#else
  constexpr int kScenes = 500;
#endif
  constexpr std::size_t kRounds = 20;
  std::array<Misses, kRounds> rounds;
  parallel_for(kRounds, [&](std::size_t k) {
    Trials trials =
        interval_trials(1000 + static_cast<std::uint32_t>(kRounds) * GetParam() + static_cast<std::uint32_t>(k));
    trials.scenes = kScenes;
    trials.deforms = k % 4 == 3;
    trials.width = 48, trials.height = 32;
    trials.points = 8;
    trials.cells = 4;
    rounds[k] = count_misses(trials);
  });
  Misses all;
  for (const Misses& round : rounds) {
    all.scenes += round.scenes, all.points += round.points;
    all.tags += round.tags, all.cells += round.cells;
  }
  std::printf("%d scenes of procedures, %d visible points: %d in tiles without their object, %d without their cell\n",
              all.scenes, all.points, all.tags, all.cells);
  EXPECT_EQ(all.scenes, static_cast<int>(kRounds) * kScenes);
  EXPECT_GT(all.points, 10 * all.scenes / 4);
  EXPECT_EQ(all.tags, 0);
  EXPECT_EQ(all.cells, 0);
}

// The twin of the law: the same points catch cells whose tiles belong to another place on screen.
TEST(ParameterMaps, PublishedCellsAreCaughtWhereTheyComeClosestToLeavingTheirBounds) {
  Trials trials;
  trials.scenes = 300;
  trials.general = false;
  trials.width = 48, trials.height = 32;
  trials.points = 8;
  trials.settings.mode = ProcedureSettings::Mode::kPublished;
  trials.settings.padding = 0.5;
  trials.settings.sparse_spacing = 16;
  const Misses anywhere = count_misses(trials);
  trials.cells = 4;
  const Misses extremes = count_misses(trials);
  EXPECT_GT(anywhere.cells, 0);
  EXPECT_GT(extremes.cells, 2 * anywhere.cells);
}

}  // namespace
}  // namespace tessera::tilecore::missed_tiles_test
