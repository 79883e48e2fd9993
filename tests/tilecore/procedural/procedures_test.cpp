// The emulated SIMD array and the sampling controller's maps.
#include "shaders_cpp/procedures/procedures.h"
#include "base/simd_targets.h"
#include "tests/support/procedures.h"
#include "tests/support/programs.h"
#include "tests/support/tests.h"
#include "tests/tilecore/procedural/cell_lists.h"
#include "tests/tilecore/procedural/random_scene.h"
#include "tests/tilecore/support.h"
#include "tilecore/procedural/footprint.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::tilecore::procedures_test {
namespace {

using shaders::ShapeId;

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

// ---- SIMD array -------------------------------------------------------------------------------------------------

class ProcedureArray : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { force_simd_target(GetParam()); }
  void TearDown() override { force_simd_target(""); }
};
INSTANTIATE_TEST_SUITE_P(Targets, ProcedureArray, testing::ValuesIn(simd_target_names()),
                         [](const auto& target) { return target.param; });

// The scalar twin of a run: the same templates on floats, the view written out.
TEST_P(ProcedureArray, GivesTheBitsOfTheScalarTemplates) {
  Random random(7);
  auto registers = std::make_unique<SampleRegisters>();
  for (int trial = 0; trial < 60; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const shaders::ShapeInput in = test::random_shape(random, id);
    shaders::SurfaceProgram surface;
    surface.texture = static_cast<shaders::TextureId>(trial % 4);
    surface.shading = trial % 2 == 0 ? shaders::ShadingId::kPhong : shaders::ShadingId::kGooch;
    surface.two_sided = trial % 3 == 0;
    surface.texture_numbers = {0.9f, 0.8f, 0.7f, 0.1f, 0.2f, 0.3f, 5, 1.5f, 3};
    surface.shading_numbers = {0.3f, 0.6f, 0.4f, 20};
    surface.pixel_by_depth = 0.001f;
    surface.lights.eye = {0, 0, 5};
    ArrayProgram program;
    program.shape = id;
    program.input = &in;
    program.to_raster[0] = Mat4(100, 0, 0, 0, 0, -100, 0, 0, -50, -50, -1, -1, 250, 250, 5, 5);
    program.surface = &surface;
    const std::size_t count = 77;  // no multiple of a vector
    for (std::size_t k = 0; k < count; ++k)
      registers->u[k] = k == 0 ? 0.0f : random.uniform(0, 1), registers->v[k] = k < 2 ? 1.0f : random.uniform(0, 1);
    run_procedure(program, count, *registers);
    for (std::size_t k = 0; k < count; ++k)
      shaders::with_shape(id, [&](auto shape) {
        using Shape = decltype(shape);
        const float u = registers->u[k], v = registers->v[k];
        const auto p = shaders::shape_tangents<Shape>(in, u, v);
        const Mat4& m = program.to_raster[0];
        const auto row = [&](int r) {
          return (m[0][r] * p.position.x + m[1][r] * p.position.y) + (m[2][r] * p.position.z + m[3][r]);
        };
        const auto tangent = [&](int r, const Vector3<float>& t) {
          return (m[0][r] * t.x + m[1][r] * t.y) + m[2][r] * t.z;
        };
        const float z = row(2), inverse = 1.0f / z, x = row(0) * inverse,
                    xu = (tangent(0, p.by_u) - x * tangent(2, p.by_u)) * inverse;
        const auto& at = registers->at[0];
        ASSERT_TRUE(same_bits(at[SampleRegisters::kX][k], x) && same_bits(at[SampleRegisters::kZ][k], z) &&
                    same_bits(at[SampleRegisters::kXu][k], xu))
            << Shape::kName << " " << k;
        float margin;
        Vector3<float> n = shaders::unit_normal(p.by_u, p.by_v, margin);
        if (!(margin > 0)) {
          const auto beside =
              shaders::shape_tangents<Shape>(in, shaders::towards_middle(u), shaders::towards_middle(v));
          n = shaders::unit_normal(beside.by_u, beside.by_v, margin);
        }
        shaders::PointRecord<float> record;
        const Vector3<float> c = shaders::run_surface_stages<float>(surface, u, v, p.position, n, z, record);
        ASSERT_TRUE(same_bits(registers->r[k], c.x) && same_bits(registers->g[k], c.y) &&
                    same_bits(registers->b[k], c.z))
            << Shape::kName << " " << k;
      });
    if (HasFatalFailure()) return;
  }
}

// Built-in stages and their twins as programs.
TEST_P(ProcedureArray, ProgramsGiveTheBitsOfBuiltInStages) {  // PGM1
  Random random(8);
  const auto a = std::make_unique<SampleRegisters>(), b = std::make_unique<SampleRegisters>();
  for (int trial = 0; trial < 80; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const auto texture = static_cast<shaders::TextureId>(trial % test::kTextureCount);
    const shaders::ShapeInput in = test::random_shape(random, id);
    const test::ShapeTwin shape_twin(id, in);
    shaders::SurfaceProgram surface, own;
    surface.texture = texture;
    surface.texture_numbers = test::random_texture(random, texture);
    surface.shading_numbers = {0.3f, 0.6f, 0.4f, 20};
    surface.pixel_by_depth = 0.001f;
    surface.lights.eye = {0, 0, 5};
    own = surface;
    const test::TextureTwin texture_twin(texture, surface.texture_numbers);
    texture_twin.put(own);
    ArrayProgram first, second;
    first.shape = id, first.input = &in;
    second.shape = ShapeId::kProgram, second.input = &shape_twin.input;
    first.to_raster[0] = second.to_raster[0] = Mat4(100, 0, 0, 0, 0, -100, 0, 0, -50, -50, -1, -1, 250, 250, 5, 5);
    first.surface = &surface, second.surface = &own;
    const auto count = static_cast<std::size_t>(random.integer(1, static_cast<int>(kArraySamples)));
    for (std::size_t k = 0; k < count; ++k) {
      a->u[k] = b->u[k] = k == 0 ? 0.0f : random.uniform(0, 1);
      a->v[k] = b->v[k] = k < 2 ? 1.0f : random.uniform(0, 1);
    }
    run_procedure(first, count, *a);
    run_procedure(second, count, *b);
    std::array<std::array<float, kArraySamples + 64>, 6> points{};
    const auto arrays = [&](std::size_t from) {
      return PointArrays{points[from].data(), points[from + 1].data(), points[from + 2].data()};
    };
    procedure_vertices(id, in, a->u.data(), a->v.data(), count, arrays(0));
    procedure_vertices(ShapeId::kProgram, shape_twin.input, a->u.data(), a->v.data(), count, arrays(3));
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t c = 0; c < SampleRegisters::kColumns; ++c)
        ASSERT_TRUE(same_bits(a->at[0][c][k], b->at[0][c][k])) << trial << " " << c << " " << k;
      ASSERT_TRUE(same_bits(a->r[k], b->r[k]) && same_bits(a->g[k], b->g[k]) && same_bits(a->b[k], b->b[k])) << trial;
      for (std::size_t c = 0; c < 3; ++c) ASSERT_TRUE(same_bits(points[c][k], points[c + 3][k])) << trial << " " << k;
    }
  }
}

// ---- Maps -------------------------------------------------------------------------------------------------------

TEST(ParameterMaps, ACellsHalfStepsStayInsideTheSpacing) {  // PM2
  Random random(3);
  for (int n = 0; n < 300; ++n) {
    const double spacing = n % 2 == 0 ? 1 : 4;
    const auto id = static_cast<ShapeId>(n % test::kShapeCount);
    const RandomScene random_scene(random, id, false);
    const scene::FrameGeometry& frame = *random_scene.scene.frame;
    ProcedureSettings settings;
    settings.spacing = spacing;
    const ParameterMaps maps(frame, {0, 0, 96, 64}, settings, 4, 64);
    if (maps.counters().rates_clamped > 0) continue;
    for (std::size_t c = 0; c < maps.cells().size(); c += 7) {
      const ParameterCell& cell = maps.cells()[c];
      const double u = static_cast<double>(random.uniform(cell.u0, cell.u1)),
                   v = static_cast<double>(random.uniform(cell.v0, cell.v1));
      shaders::ShapePoint<double> p;
      shaders::with_shape(id, [&](auto shape) {
        p = shaders::shape_tangents<decltype(shape)>(frame.drawables[0].procedure->pieces[0].input, u, v);
      });
      const DMat4 m(frame.drawables[0].to_raster[0]);
      const DVec4 r = m * DVec4(p.position.x, p.position.y, p.position.z, 1),
                  ru = m * DVec4(p.by_u.x, p.by_u.y, p.by_u.z, 0), rv = m * DVec4(p.by_v.x, p.by_v.y, p.by_v.z, 0);
      if (!(r.z > frame.projection.near)) continue;
      const double hu = (static_cast<double>(cell.u1) - static_cast<double>(cell.u0)) / cell.steps.u / 2,
                   hv = (static_cast<double>(cell.v1) - static_cast<double>(cell.v0)) / cell.steps.v / 2;
      const double w = frame.projection.orthographic ? 1 : r.z, turn = frame.projection.orthographic ? 0 : 1;
      const auto reach = [&](double by_u, double by_v, double at) {
        return (std::abs(by_u - turn * at / w * ru.z) * hu + std::abs(by_v - turn * at / w * rv.z) * hv) / w;
      };
      EXPECT_LE(std::max(reach(ru.x, rv.x, r.x), reach(ru.y, rv.y, r.y)), spacing / 4 * 1.001);
    }
  }
}

// ---- Footprints -------------------------------------------------------------------------------------------------

TEST(Footprint, NeighboursLeaveNoGapAndHardlyOverlap) {  // PM3
  Random random(4);
  int covered = 0, twice = 0, points = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const float ax = random.uniform(0.05f, 0.2f), ay = random.uniform(-0.03f, 0.03f),
                bx = random.uniform(-0.03f, 0.03f), by = random.uniform(0.05f, 0.2f);
    const float px = random.uniform(-0.3f, 0.3f), py = random.uniform(-0.3f, 0.3f);
    int hits = 0;
    for (int i = -8; i <= 8; ++i)
      for (int j = -8; j <= 8; ++j) {
        const Parallelogram p{2 * (static_cast<float>(i) * ax + static_cast<float>(j) * bx),
                              2 * (static_cast<float>(i) * ay + static_cast<float>(j) * by),
                              ax,
                              ay,
                              bx,
                              by,
                              ax * by - ay * bx,
                              1.0f / 256};
        float u, v;
        hits += p.holds(px, py, u, v) ? 1 : 0;
      }
    ++points;
    covered += hits > 0 ? 1 : 0;
    twice += hits > 1 ? 1 : 0;
  }
  EXPECT_EQ(covered, points);
  EXPECT_LT(twice, points / 4);
}

// ---- One tile ---------------------------------------------------------------------------------------------------

struct Drawn {
  TileState state;
  SamplingCounters counters;
};

// A whole image as one tile, with 16 samples a pixel.
Drawn draw(const scene::FrameGeometry& frame, const ProcedureSettings& settings) {
  const SamplePattern pattern({16, 1, 0});
  const binner::TileGrid grid(96, 64, 96, 64);
  const ParameterMaps maps(frame, grid.region(), settings, 4, 64);
  TileSamples samples;
  samples.fill(pattern, {0, 0, 96, 64}, static_cast<float>(frame.projection.lens_scale),
               frame.projection.lens_scale != 0);
  Drawn out;
  out.state.start(samples.count, 96, samples.spp);
  SamplingController controller;
  draw_cells(controller, {frame, maps, samples, out.state}, CellLists(frame, maps, grid).of_tile(0));
  out.counters = controller.take_counters();
  tessera::merge(out.counters, maps.counters());
  return out;
}

// Covered samples inside the image that have an uncovered one between two covered ones of their pixel row.
std::size_t seen(const TileState& state) {
  return static_cast<std::size_t>(
      std::count_if(state.patch.begin(), state.patch.end(), [](std::uint32_t p) { return p != TileState::kNoPatch; }));
}

TestFrame one(ShapeId id, const shaders::ShapeInput& in, const DVec3& place, bool double_sided = false,
              double eye = 4) {
  TestFrame scene;
  scene::Camera camera;
  camera.near = 0.2f;
  test::add_camera(*scene.capture, DVec3(0, 0, eye), camera);
  scene::Material material;
  material.double_sided = double_sided;
  const int number = test::add_material(*scene.capture, material);
  test::add_procedure(*scene.capture, id, in, place, number);
  scene.pose(96, 64);
  return scene;
}

TEST(SamplingController, EverySampleIsCountedOnce) {  // SC3
  Random random(5);
  for (int n = 0; n < 40; ++n) {
    const RandomScene scene(random, static_cast<ShapeId>(n % test::kShapeCount), false);
    const Drawn drawn = draw(*scene.scene.frame, {});
    const SamplingCounters& c = drawn.counters;
    EXPECT_LE(c.samples_outside_tile + c.samples_behind + c.samples_backfacing + c.samples_not_finite, c.samples);
    EXPECT_GE(c.array_slots, c.samples);
    EXPECT_GE(c.writes, seen(drawn.state));
  }
}

TEST(SamplingController, ABlurredSphereIsSeenWhereItPassesAndCountedOnce) {  // SC3, with motion and a lens
  TestFrame scene;
  scene::Camera camera;
  camera.lens = {0.1f, 3.0f};
  test::add_camera(*scene.capture, DVec3(0, 0, 4), camera);
  test::add_material(*scene.capture);
  shaders::ShapeInput in;
  in.p[0] = 0.4f;
  test::add_motion(*scene.capture, test::add_procedure(*scene.capture, ShapeId::kSphere, in, DVec3(-0.5, 0, 0), 0),
                   DVec3(1, 0, 0));
  scene.pose(96, 64);
  const Drawn drawn = draw(*scene.frame, {});
  const SamplingCounters& c = drawn.counters;
  EXPECT_LE(c.samples_outside_tile + c.samples_behind + c.samples_backfacing + c.samples_not_finite, c.samples);
  // The middle of the way is covered most of the time, its ends and the pixels beyond are not.
  const auto covered = [&](int x) {
    std::size_t n = 0;
    for (std::size_t k = 0; k < 16; ++k)
      n += drawn.state.patch[(32 * 96 + static_cast<std::size_t>(x)) * 16 + k] != TileState::kNoPatch ? 1 : 0;
    return n;
  };
  EXPECT_GT(covered(48), 8u);
  EXPECT_LT(covered(33), covered(48));
  EXPECT_EQ(covered(5), 0u);
}

TEST(SamplingController, SeesASphereWhereItIs) {
  shaders::ShapeInput in;
  in.p[0] = 1;
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 0));
  ProcedureSettings settings;
  settings.spacing = 1;
  const Drawn drawn = draw(*scene.frame, settings);
  // A ray of the pinhole meets the sphere where its distance from the centre is less than the radius.
  const scene::Projection& p = scene.frame->projection;
  const SamplePattern pattern({16, 1, 0});
  TileSamples samples;
  samples.fill(pattern, {0, 0, 96, 64}, 0, false);
  int wrong = 0, inside = 0;
  for (std::size_t s = 0; s < samples.count; ++s) {
    const double x = (static_cast<double>(samples.x[s]) - p.center_x) / p.scale,
                 y = (static_cast<double>(samples.y[s]) - p.center_y) / p.scale;
    const double b = 4 / (1 + x * x + y * y), c = 15 / (1 + x * x + y * y),
                 square = b * b - c;  // |t (x, y, 1) - (0, 0, 4)| = 1
    const bool hit = square >= 0, found = drawn.state.patch[s] != TileState::kNoPatch;
    inside += hit ? 1 : 0;
    if (hit != found && std::abs(square) > 2e-2) ++wrong;
    if (hit && found && square > 2e-2) {
      EXPECT_NEAR(static_cast<double>(drawn.state.z[s]), b - std::sqrt(square),
                  2e-3);  // extrapolated half a step, steepest at the outline
    }
  }
  EXPECT_EQ(wrong, 0);  // no hole, and nothing beside the outline
  EXPECT_GT(inside, 10000);
}

TEST(SamplingController, EqualDepthsGoToTheLowerPatchWhateverComesFirst) {  // SC1
  // Two equal flat patches in one place: the first node's patches win, in either order of the cells.
  shaders::ShapeInput in;
  in.p = {-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0};
  TestFrame scene = one(ShapeId::kBilinearPatch, in, DVec3(0, 0, 0), true);
  test::add_procedure(*scene.capture, ShapeId::kBilinearPatch, in, DVec3(0, 0, 0), 0);
  scene.pose(96, 64);
  const Drawn drawn = draw(*scene.frame, {});
  const std::uint32_t second = scene.frame->drawables[1].drawable->first_patch;
  for (const std::uint32_t patch : drawn.state.patch)
    if (patch != TileState::kNoPatch) {
      ASSERT_LT(patch, second);
    }
  EXPECT_GT(seen(drawn.state), 1000u);
}

TEST(SamplingController, PublishedSamplesLeaveFewSubPixelsOutAndFewerTheDenserTheyAre) {
  shaders::ShapeInput in;
  in.p[0] = 1;
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 0));
  ProcedureSettings settings;
  settings.mode = ProcedureSettings::Mode::kPublished;
  const Drawn published = draw(*scene.frame, settings);
  settings.spacing = 0.25;
  const Drawn dense = draw(*scene.frame, settings);
  const Drawn whole = draw(*scene.frame, {});
  EXPECT_LT(seen(published.state), seen(dense.state));
  EXPECT_GT(seen(published.state), seen(whole.state) * 9 / 10);
  EXPECT_GT(seen(dense.state), seen(whole.state) * 99 / 100);
  EXPECT_GT(dense.counters.samples, 4 * published.counters.samples);
  EXPECT_EQ(published.counters.footprint_tests, 0u);  // each is written where it falls
}

// ---- Hard cases -------------------------------------------------------------------------------------------------

TEST(HardProcedures, ASurfaceOfNoSizeIsAPointOrNothing) {
  shaders::ShapeInput in;  // radius 0
  in.p = {};
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 0), true);
  const Drawn drawn = draw(*scene.frame, {});
  EXPECT_LE(seen(drawn.state), 2u);
  EXPECT_EQ(drawn.counters.samples_not_finite, 0u);
}

// Far away a step across the whole domain is less than a sub-pixel; right before the eye no step is small enough.
TEST(HardProcedures, ARateOfZeroOrWithoutBoundStaysWithinTheStepsOfACell) {
  const auto maps = [&](float radius, double distance) {
    shaders::ShapeInput in;
    in.p[0] = radius;
    const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 4 - distance), true);
    return ParameterMaps(*scene.frame, {0, 0, 96, 64}, {}, 4, 64);
  };
  const ParameterMaps far = maps(1e-3f, 1e6), close = maps(1e6f, 1e6 + 0.21);
  for (const ParameterMaps* m : {&far, &close})
    for (const ParameterCell& cell : m->cells()) {
      ASSERT_GE(std::min(cell.steps.u, cell.steps.v), 1);
      ASSERT_LE(std::max(cell.steps.u, cell.steps.v), CellSteps::kMax);
    }
  EXPECT_LE(far.cells().size(), 1u);
  EXPECT_EQ(far.counters().rates_clamped, 0u);
  EXPECT_GT(close.counters().rates_clamped, 0u);
}

TEST(HardProcedures, AnObjectInOnePixelIsSeen) {
  shaders::ShapeInput in;
  in.p[0] = 0.02f;
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0.01, 0.01, 0));
  const Drawn drawn = draw(*scene.frame, {});
  EXPECT_GT(seen(drawn.state), 2u);
  EXPECT_LT(drawn.counters.samples, 4000u);
}

TEST(HardProcedures, AnObjectOverAllTilesWithTheCameraInsideLeavesNoSampleOut) {  // SC2
  shaders::ShapeInput in;
  in.p[0] = 3;
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 0), true, 0);
  const Drawn drawn = draw(*scene.frame, {});
  EXPECT_EQ(seen(drawn.state), drawn.state.patch.size());
}

TEST(HardProcedures, BehindTheCameraCostsNoSamples) {
  shaders::ShapeInput in;
  in.p[0] = 1;
  const TestFrame scene = one(ShapeId::kSphere, in, DVec3(0, 0, 10));
  const Drawn drawn = draw(*scene.frame, {});
  EXPECT_EQ(drawn.counters.samples, 0u);
  EXPECT_EQ(drawn.counters.cells, 0u);
}

TEST(HardProcedures, AFloorThatStraddlesTheCameraReachesTheFrontOfTheImage) {
  shaders::ShapeInput in;  // y = -1 from far before the camera to far behind it
  in.p = {-20, -1, 20, 20, -1, 20, -20, -1, -20, 20, -1, -20};
  const TestFrame scene = one(ShapeId::kBilinearPatch, in, DVec3(0, 0, 0), true, 0);
  const Drawn drawn = draw(*scene.frame, {});
  // All samples of the lower rows look at it.
  const std::size_t row = 96 * 16;
  for (std::size_t s = 60 * row; s < 64 * row; ++s) ASSERT_NE(drawn.state.patch[s], TileState::kNoPatch) << s;
}

TEST(HardProcedures, EdgeOnThereIsHardlyAnythingToSee) {
  shaders::ShapeInput in;  // the plane y = 0, through the eye
  in.p = {-1, 0, 1, 1, 0, 1, -1, 0, -1, 1, 0, -1};
  const TestFrame scene = one(ShapeId::kBilinearPatch, in, DVec3(0, 0, 0), true);
  EXPECT_LT(seen(draw(*scene.frame, {}).state), 96u * 16);
}

TEST(HardProcedures, ValuesThatAreNotFiniteAreCountedAndSkipped) {
  shaders::ShapeInput in;  // a path that stands still has no direction
  in.p = {0, 0, 0, 0, 0, 0, 0, 0, 0.1f, -1, 0.1f, -0.3f, 0.1f, 0.3f, 0.1f, 1};
  const TestFrame scene = one(ShapeId::kSweptCubic, in, DVec3(0, 0, 0), true);
  const Drawn drawn = draw(*scene.frame, {});
  EXPECT_GT(drawn.counters.samples_not_finite, 0u);
  EXPECT_EQ(drawn.counters.samples_not_finite, drawn.counters.samples);
  EXPECT_EQ(seen(drawn.state), 0u);
  EXPECT_GT(drawn.counters.rates_clamped, 0u);  // a step of unknown size
}

}  // namespace
}  // namespace tessera::tilecore::procedures_test
