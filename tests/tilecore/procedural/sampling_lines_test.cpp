// procedures.style=lines: lines along parameter lines, against the surface that the same procedures show in the
// ordinary style.
#include "base/simd_targets.h"
#include "scene/procedure_patch.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"
#include "tests/tilecore/procedural/cell_lists.h"
#include "tests/tilecore/support.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore::sampling_lines_test {
namespace {

using shaders::ShapeId;

constexpr int kWidth = 64, kHeight = 48, kSpp = 4, kSide = 2;  // kSide x kSide sub-pixels
constexpr int kLines = 64;                                     // of each parameter over a piece
constexpr double kHalfWidth = 0.55;                            // pixels, of a line
constexpr double kHalfStep = 1.4143 / kSide;                   // pixels along a line: a sub-pixel along x and along y
constexpr double kRounding = 0.02;  // pixels: footprints are wider by a 256th of their size and of a pixel

ProcedureSettings style(ProcedureSettings::Style s) {
  ProcedureSettings settings;
  settings.style = s;
  return settings;
}
const ProcedureSettings kSurfaceStyle = style(ProcedureSettings::Style::kSurface),
                        kLineStyle = style(ProcedureSettings::Style::kLines);

// Surface that a sample point sees, and the point's place, time and lens point.
struct Sample {
  std::uint32_t patch, triangle;
  float z, u, v;  // of the patch
  float x, y, t, lens_u, lens_v;
  bool seen() const { return patch != TileState::kNoPatch; }
  bool drawn_line() const { return seen() && triangle == SurfaceLocation::kLine; }
  bool operator==(const Sample&) const = default;
};
struct Image {
  std::vector<Sample> samples;  // pixel by pixel
  SamplingCounters counters;
};

Image draw(const scene::FrameGeometry& frame, const ProcedureSettings& settings, int tile_width = kWidth,
           int tile_height = kHeight, int width = kWidth, int height = kHeight) {
  const SamplePattern pattern({kSpp, 1, 0});
  const binner::TileGrid grid(width, height, tile_width, tile_height);
  const ParameterMaps maps(frame, grid.region(), settings, kSide, 64);
  const CellLists lists(frame, maps, grid);
  const bool lens = frame.projection.lens_scale != 0;
  Image out;
  out.samples.resize(static_cast<std::size_t>(width * height * kSpp));
  SamplingController controller;
  for (binner::TileIndex t = 0; t < grid.tile_count(); ++t) {
    const IntRect r = grid.pixels(t);
    TileSamples samples;
    samples.fill(pattern, r, static_cast<float>(frame.projection.lens_scale), lens);
    TileState state;
    state.start(samples.count, r.width(), samples.spp);
    draw_cells(controller, {frame, maps, samples, state}, lists.of_tile(t));
    for (std::size_t s = 0; s < samples.count; ++s) {
      const int pixel = static_cast<int>(s) / kSpp, x = r.x0 + pixel % r.width(), y = r.y0 + pixel / r.width();
      out.samples[static_cast<std::size_t>((y * width + x) * kSpp) + s % kSpp] = {state.patch[s],
                                                                                  state.triangle[s],
                                                                                  state.z[s],
                                                                                  state.b1[s],
                                                                                  state.b2[s],
                                                                                  samples.x[s],
                                                                                  samples.y[s],
                                                                                  samples.t(s),
                                                                                  lens ? samples.lens_u[s] : 0.0f,
                                                                                  lens ? samples.lens_v[s] : 0.0f};
    }
  }
  out.counters = controller.take_counters();
  tessera::merge(out.counters, maps.counters());
  return out;
}

// Two procedures before a camera.
TestFrame random_scene(Random& random) {
  TestFrame scene;
  scene::Camera camera;
  camera.near = 0.2f;
  if (random.integer(0, 5) == 0) camera.type = scene::Camera::Type::kOrthographic, camera.x_mag = camera.y_mag = 2;
  test::add_camera(*scene.capture, DVec3(0, 0, 4), camera);
  scene::Material material;
  material.double_sided = random.coin();
  const int number = test::add_material(*scene.capture, material);
  for (int k = 0; k < 2; ++k) {
    const auto id = static_cast<ShapeId>(random.integer(0, test::kShapeCount - 1));
    test::add_procedure(*scene.capture, id, test::random_shape(random, id), DVec3(random.in_box(1)), number);
  }
  scene.pose(kWidth, kHeight);
  return scene;
}

// A sphere of radius 0.5 in focus or not, moving or not.
TestFrame sphere(const scene::Camera& camera, const DVec3& way = DVec3(0.0)) {
  TestFrame scene;
  test::add_camera(*scene.capture, DVec3(0, 0, 4), camera);
  scene::Material material;
  material.double_sided = true;
  shaders::ShapeInput in;
  in.p[0] = 0.5f;
  const int node = test::add_procedure(*scene.capture, ShapeId::kSphere, in, DVec3(0.0),
                                       test::add_material(*scene.capture, material));
  if (way != DVec3(0.0)) test::add_motion(*scene.capture, node, way);
  scene.pose(kWidth, kHeight);
  return scene;
}

// Parameters of the piece, position on screen and depth of the surface that a sample sees, at its time and through
// its point of the lens, in double precision.
struct Seen {
  double u, v, x, y, z;
};
Seen locate(const scene::FrameGeometry& frame, const Sample& s) {
  const scene::ProcedurePatch patch = scene::procedure_patch(frame, s.patch);
  const double u = (patch.column + static_cast<double>(s.u)) / patch.columns,
               v = (patch.row + static_cast<double>(s.v)) / patch.rows, t = static_cast<double>(s.t);
  shaders::ShapePoint<double> p;
  shaders::with_shape(patch.shape,
                      [&](auto shape) { p = shaders::shape_tangents<decltype(shape)>(patch.piece->input, u, v); });
  const auto at = [&](std::size_t key) {
    return DMat4(frame.drawable_of(s.patch).to_raster[key]) * DVec4(p.position.x, p.position.y, p.position.z, 1);
  };
  const DVec4 r = at(0) * (1 - t) + at(1) * t;
  const scene::Projection& projection = frame.projection;
  const double w = projection.orthographic ? 1 : r.z,
               coc = projection.orthographic ? 1 - r.z * projection.inverse_focus : 1 / r.z - projection.inverse_focus;
  return {u, v, r.x / w + static_cast<double>(s.lens_u) * coc, r.y / w + static_cast<double>(s.lens_v) * coc, r.z};
}

double from_line(double parameter) { return std::abs(parameter * kLines - std::round(parameter * kLines)) / kLines; }

// ---- Against the ordinary style ---------------------------------------------------------------------------------

TEST(Lines, LeaveTheSurfaceBitByBitAndLieInFrontOfIt) {
  Random random(1);
  std::size_t drawn_lines = 0, paper = 0;
  for (int n = 0; n < 15; ++n) {
    const TestFrame scene = random_scene(random);
    const Image surface = draw(*scene.frame, kSurfaceStyle), lines = draw(*scene.frame, kLineStyle);
    for (std::size_t s = 0; s < lines.samples.size(); ++s) {
      const Sample &line = lines.samples[s], &plain = surface.samples[s];
      ASSERT_FALSE(plain.drawn_line());
      if (!line.drawn_line()) {
        ASSERT_EQ(line, plain) << "scene " << n << ", sample " << s;
        paper += line.seen() ? 1 : 0;
        continue;
      }
      ASSERT_TRUE(!plain.seen() || line.z < plain.z) << "scene " << n << ", sample " << s;
      ++drawn_lines;
    }
  }
  EXPECT_GT(drawn_lines, 2000u);
  EXPECT_GT(paper, 2000u);
}

TEST(Lines, ThatAreNotThereAreNoticed) {  // the twin of the law above: the two styles are not one
  Random random(1);
  const TestFrame scene = random_scene(random);
  EXPECT_NE(draw(*scene.frame, kSurfaceStyle).samples, draw(*scene.frame, kLineStyle).samples);
}

// ---- Where they are ---------------------------------------------------------------------------------------------

// Samples whose parameters are off every line, or that lie farther from their point than a line reaches.
struct Strays {
  std::size_t off_line = 0, far = 0, at_depth = 0, all = 0;
};
Strays count_strays(const scene::FrameGeometry& frame, const Image& image, bool of_lines, float nearer) {
  Strays out;
  for (const Sample& s : image.samples) {
    if (!s.seen() || s.drawn_line() != of_lines) continue;
    const Seen at = locate(frame, s);
    ++out.all;
    out.off_line += std::min(from_line(at.u), from_line(at.v)) > 1e-6 ? 1 : 0;
    out.far += std::hypot(at.x - static_cast<double>(s.x), at.y - static_cast<double>(s.y)) >
                       std::hypot(kHalfWidth, kHalfStep) + kRounding
                   ? 1
                   : 0;
    out.at_depth += std::abs(static_cast<double>(s.z / nearer) - at.z) < 1e-5 * at.z ? 1 : 0;
  }
  return out;
}

TEST(Lines, EveryStrokeShowsAPointOfAParameterLineNoFartherThanItIsWide) {
  Random random(3);
  Strays drawn_lines, surface;
  const auto add = [](Strays& sum, const Strays& more) {
    sum.off_line += more.off_line, sum.far += more.far, sum.at_depth += more.at_depth, sum.all += more.all;
  };
  for (int n = 0; n < 15; ++n) {
    const TestFrame scene = random_scene(random);
    const Image image = draw(*scene.frame, kLineStyle);
    if (image.counters.rates_clamped > 0) continue;  // steps longer than a sub-pixel
    add(drawn_lines, count_strays(*scene.frame, image, true, 1.0f - 1.0f / 256));
    add(surface, count_strays(*scene.frame, image, false, 1.0f - 1.0f / 256));
  }
  EXPECT_GT(drawn_lines.all, 2000u);
  EXPECT_EQ(drawn_lines.off_line, 0u);
  EXPECT_EQ(drawn_lines.far, 0u);
  EXPECT_EQ(drawn_lines.at_depth, drawn_lines.all);
  // The twin: surfaces are not on lines, nor a 256th nearer than they are.
  EXPECT_GT(surface.off_line, surface.all / 2);
  EXPECT_LT(surface.at_depth, surface.all / 2);
}

// Lines of moving and defocused surfaces lie where the surface is at each sample's time and lens point.
TEST(Lines, MoveWithTheirSurfaceAndAreOutOfFocusWhereItIs) {
  scene::Camera pinhole, lens, orthographic;
  lens.lens = {0.1f, 3.0f};
  orthographic.type = scene::Camera::Type::kOrthographic, orthographic.x_mag = orthographic.y_mag = 1;
  for (const scene::Camera& camera : {pinhole, lens, orthographic})
    for (const DVec3& way : {DVec3(0.0), DVec3(0.5, 0.25, 0.5)}) {
      const TestFrame scene = sphere(camera, way);
      const Image image = draw(*scene.frame, kLineStyle), surface = draw(*scene.frame, kSurfaceStyle);
      ASSERT_EQ(image.counters.rates_clamped, 0u);
      const Strays lines = count_strays(*scene.frame, image, true, 1.0f - 1.0f / 256);
      EXPECT_GT(lines.all, 400u);
      EXPECT_EQ(lines.off_line, 0u);
      EXPECT_EQ(lines.far, 0u);
      EXPECT_EQ(lines.at_depth, lines.all);
      for (std::size_t s = 0; s < image.samples.size(); ++s)
        if (!image.samples[s].drawn_line()) {
          ASSERT_EQ(image.samples[s], surface.samples[s]);
        }
      const Image tiled = draw(*scene.frame, kLineStyle, 16, 8);  // SC1
      EXPECT_EQ(image.samples, tiled.samples);
    }
  // The twin: seen as if the surface stood still, lines of moving surfaces lie elsewhere.
  const TestFrame scene = sphere(pinhole, DVec3(0.5, 0.25, 0.5));
  Image image = draw(*scene.frame, kLineStyle);
  for (Sample& sample : image.samples) sample.t = 0;
  EXPECT_GT(count_strays(*scene.frame, image, true, 1.0f - 1.0f / 256).far, 200u);
}

// Nearly still, or nearly in focus: nearly the same drawing.
TEST(Lines, AreTheSameForNearlyStillAndNearlySharpSurfaces) {
  scene::Camera pinhole, lens;
  lens.lens = {1e-6f, 3.0f};
  const Image still = draw(*sphere(pinhole).frame, kLineStyle);
  for (const Image& other :
       {draw(*sphere(lens).frame, kLineStyle), draw(*sphere(pinhole, DVec3(1e-6, 0, 0)).frame, kLineStyle)}) {
    std::size_t drawn = 0, differ = 0;
    for (std::size_t s = 0; s < still.samples.size(); ++s) {
      drawn += still.samples[s].drawn_line() ? 1 : 0;
      differ += still.samples[s].drawn_line() != other.samples[s].drawn_line() ? 1 : 0;
    }
    EXPECT_GT(drawn, 400u);
    EXPECT_LT(differ, drawn / 50);
  }
}

TEST(Lines, EndWhereTheNearAndTheFarPlaneCutTheSurface) {
  const auto depths = [](float near, float far) {
    scene::Camera camera;
    camera.near = near;
    camera.far = far;
    const TestFrame scene = sphere(camera);
    std::vector<float> z;
    for (const Sample& s : draw(*scene.frame, kLineStyle).samples)
      if (s.drawn_line()) z.push_back(s.z * (256.0f / 255));
    return z;
  };
  for (const float z : depths(0.1f, 3.7f)) ASSERT_LE(z, 3.7f * 1.00001f);
  for (const float z : depths(3.6f, 100)) ASSERT_GE(z, 3.6f * 0.99999f);
  // Without the planes there are lines on either side.
  const std::vector<float> all = depths(0.1f, 100);
  EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](float z) { return z > 3.75f; }));
  EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](float z) { return z < 3.58f; }));
}

// ---- On a flat patch that faces the camera ------------------------------------------------------------------------

// Wide enough for all of its lines to lie apart.
constexpr int kWide = 192, kHigh = 128;

TestFrame flat_patch(float light) {
  TestFrame scene;
  test::add_camera(*scene.capture, DVec3(0.03, 0.02, 3.1), {});  // lines at no particular places of pixels
  const int material = test::add_material(*scene.capture);
  shaders::ShapeInput in;
  in.p = {-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0};
  test::add_procedure(*scene.capture, ShapeId::kBilinearPatch, in, DVec3(0, 0, 0), material);
  scene.pose(kWide, kHigh);
  shaders::Light lamp;
  lamp.type = shaders::Light::Type::kDirectional;
  lamp.direction = glm::normalize(Vec3(0.95f, 0, -0.3f));  // no mirror image of it in the patch: evenly lit
  lamp.color = Vec3(light);
  scene.frame->lights = {std::vector{lamp}, std::vector{lamp}};
  return scene;
}

// Lines of each parameter that have lines: u first.
std::array<std::set<int>, 2> drawn_lines(const scene::FrameGeometry& frame, const Image& image) {
  std::array<std::set<int>, 2> out;
  for (const Sample& s : image.samples) {
    if (!s.drawn_line()) continue;
    const Seen at = locate(frame, s);
    // Steps along a line may fall onto a crossing one, but not all of them do.
    const bool on_u = from_line(at.u) < 1e-6, on_v = from_line(at.v) < 1e-6;
    if (on_u && !on_v) out[0].insert(static_cast<int>(std::lround(at.u * kLines)));
    if (on_v && !on_u) out[1].insert(static_cast<int>(std::lround(at.v * kLines)));
  }
  return out;
}

TEST(Lines, AreLeftOutByHalvesAsLightGrows) {
  std::set<int> spacings;
  int before = 1;
  for (float light = 0; light < 8; light += 0.5f) {
    const TestFrame scene = flat_patch(light);
    const Image image = draw(*scene.frame, kLineStyle, kWide, kHigh, kWide, kHigh);
    for (const std::set<int>& lines : drawn_lines(*scene.frame, image)) {
      ASSERT_TRUE(lines.contains(0) && lines.contains(32)) << "light " << light;
      // The multiples of a power of two, all of them.
      const int spacing = *std::next(lines.begin());
      EXPECT_EQ(spacing & (spacing - 1), 0) << "light " << light;
      EXPECT_GE(spacing, before) << "more light, more lines";
      std::set<int> expected;
      for (int line = 0; line < kLines; line += spacing) expected.insert(line);
      EXPECT_EQ(lines, expected) << "light " << light;
      before = spacing;
      spacings.insert(spacing);
    }
  }
  EXPECT_GE(spacings.size(), 4u);
  EXPECT_EQ(*spacings.rbegin(), 32);
}

// Every sample point of the patch is a line where a line passes within half a line's width, and nowhere else: lines
// have no gaps and no bulges.
std::size_t wrong_samples(const Image& image, const scene::FrameGeometry& frame, int spacing, double half_width) {
  const auto corner = [&](double x, double y) {
    const DVec4 r = DMat4(frame.drawables[0].to_raster[0]) * DVec4(x, y, 0, 1);
    return r / r.z;
  };
  const DVec4 low = corner(-1, -1), high = corner(1, 1);
  std::size_t wrong = 0;
  for (const Sample& s : image.samples) {
    const double u = (static_cast<double>(s.x) - low.x) / (high.x - low.x),
                 v = (static_cast<double>(s.y) - low.y) / (high.y - low.y);
    if (!(u > 0 && u < 1 && v > 0 && v < 1)) continue;
    // Pixels to the nearest line that is drawn; there is none at 1.
    const auto distance = [&](double parameter, double pixels) {
      const double line =
          std::min(std::round(parameter * kLines / spacing) * spacing, static_cast<double>(kLines - spacing));
      return std::abs(parameter - line / kLines) * pixels;
    };
    const double d = std::min(distance(u, std::abs(high.x - low.x)), distance(v, std::abs(high.y - low.y)));
    if (std::abs(d - half_width) < kRounding) continue;
    wrong += s.drawn_line() != (d < half_width) ? 1 : 0;
  }
  return wrong;
}

TEST(Lines, HaveTheirWidthAllAlongAndNoGaps) {
  const TestFrame scene = flat_patch(3);
  const Image image = draw(*scene.frame, kLineStyle, kWide, kHigh, kWide, kHigh);
  const std::set<int> lines = drawn_lines(*scene.frame, image)[0];
  ASSERT_GE(lines.size(), 2u);
  const int spacing = *std::next(lines.begin());
  ASSERT_GE(spacing, 8) << "lines are to lie apart";
  EXPECT_EQ(wrong_samples(image, *scene.frame, spacing, kHalfWidth), 0u);
  EXPECT_GT(wrong_samples(image, *scene.frame, spacing, kHalfWidth * 0.9), 0u);
  EXPECT_GT(wrong_samples(image, *scene.frame, spacing / 2, kHalfWidth), 0u);
}

// ---- Inputs of the lines ----------------------------------------------------------------------------------------

TEST(Lines, FollowFromTheSceneAloneWhateverTheTiles) {  // SC1
  Random random(4);
  for (int n = 0; n < 12; ++n) {
    const TestFrame scene = random_scene(random);
    const Image whole = draw(*scene.frame, kLineStyle);
    for (const auto& [width, height] : {std::pair{8, 8}, {16, 16}, {32, 8}}) {
      const Image tiled = draw(*scene.frame, kLineStyle, width, height);
      const auto differ = std::inner_product(whole.samples.begin(), whole.samples.end(), tiled.samples.begin(),
                                             std::size_t{0}, std::plus<>(), std::not_equal_to<>());
      EXPECT_EQ(differ, 0u) << "scene " << n << ", tiles of " << width << "x" << height;
    }
  }
}

TEST(Lines, HaveTheSameBitsOnEveryInstructionSet) {
  Random random(5);
  for (int n = 0; n < 4; ++n) {
    const TestFrame scene = random_scene(random);
    const Image plain = draw(*scene.frame, kLineStyle);
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      const Image other = draw(*scene.frame, kLineStyle);
      force_simd_target("");
      EXPECT_EQ(other.samples, plain.samples) << target;
      EXPECT_EQ(other.counters.drawn_lines, plain.counters.drawn_lines) << target;
      EXPECT_EQ(other.counters.writes, plain.counters.writes) << target;
    }
  }
}

// ---- Counters ---------------------------------------------------------------------------------------------------

// Steps of a cell times the lines that run through it.
std::uint64_t lines_of(const ParameterCell& cell) {
  std::uint64_t along_u = 0, along_v = 0;
  for (int line = 0; line < kLines; ++line) {
    const float at = static_cast<float>(line) / kLines;
    along_u += at >= cell.v0 && at < cell.v1 ? 1 : 0;
    along_v += at >= cell.u0 && at < cell.u1 ? 1 : 0;
  }
  return along_u * cell.line_steps.u + along_v * cell.line_steps.v;
}

TEST(Lines, EveryStepOfEveryLineOfATilesCellsIsCountedOnce) {
  Random random(6);
  std::uint64_t all = 0;
  for (int n = 0; n < 6; ++n) {
    const TestFrame scene = random_scene(random);
    for (const int side : {kWidth, 16}) {
      const binner::TileGrid grid(kWidth, kHeight, side, side);
      const ParameterMaps maps(*scene.frame, grid.region(), kLineStyle, kSide, 64);
      const CellLists lists(*scene.frame, maps, grid);
      std::uint64_t expected = 0;
      for (binner::TileIndex t = 0; t < grid.tile_count(); ++t)
        for (const binner::ListEntry& entry : lists.of_tile(t))
          expected += lines_of(maps.cells()[ParameterMaps::cell_of(entry.range)]);
      EXPECT_EQ(draw(*scene.frame, kLineStyle, side, side).counters.drawn_lines, expected);
      all += expected;
    }
    EXPECT_EQ(draw(*scene.frame, kSurfaceStyle).counters.drawn_lines, 0u);
  }
  EXPECT_GT(all, 5000u);
}

// The maps have more entries: a tile also needs cells that reach it by their lines alone, which its surfaces leave
// out.
TEST(Lines, CostTheirEvaluationsAndLeaveTheSurfacesCostAlone) {
  Random random(7);
  for (int n = 0; n < 8; ++n) {
    const TestFrame scene = random_scene(random);
    const Image surface = draw(*scene.frame, kSurfaceStyle, 16, 16), lines = draw(*scene.frame, kLineStyle, 16, 16);
    const auto drawn_lines =
        std::count_if(lines.samples.begin(), lines.samples.end(), [](const Sample& s) { return s.drawn_line(); });
    for (const auto& field : kCounterFields<SamplingCounters>) {
      const std::set<std::string_view> of_maps = {"procedures.cells",
                                                  "procedures.cells_outside",
                                                  "procedures.interval_evaluations",
                                                  "procedures.map_entries",
                                                  "procedures.tags",
                                                  "procedures.rates_clamped",
                                                  "procedures.cells_culled_backface",
                                                  "procedures.steps_tested"};
      const std::set<std::string_view> of_lines = {"procedures.strokes", "procedures.writes", "procedures.array_slots",
                                                   "procedures.operations", "procedures.footprint_tests"};
      // A list that has a cell for its lines alone may have it where exact coverage leaves out its surface: steps are
      // evaluated there that reach nothing.
      const std::set<std::string_view> of_nothing = {"procedures.samples", "procedures.samples_outside_tile",
                                                     "procedures.samples_backfacing", "procedures.samples_behind",
                                                     "procedures.samples_not_finite"};
      if (of_lines.contains(field.name) || of_maps.contains(field.name)) continue;
      if (of_nothing.contains(field.name))
        EXPECT_GE(lines.counters.*field.member, surface.counters.*field.member) << field.name;
      else
        EXPECT_EQ(lines.counters.*field.member, surface.counters.*field.member) << field.name;
    }
    const auto reaching = [](const SamplingCounters& c) {
      return c.samples - c.samples_outside_tile - c.samples_backfacing - c.samples_behind - c.samples_not_finite;
    };
    EXPECT_EQ(reaching(lines.counters), reaching(surface.counters));
    EXPECT_GE(lines.counters.map_entries, surface.counters.map_entries);
    // Lanes are issued by the group.
    const std::uint64_t slots = lines.counters.array_slots - surface.counters.array_slots;
    EXPECT_GE(slots, lines.counters.drawn_lines);
    EXPECT_EQ(slots % SamplingController::kArrayLanes, 0u);
    EXPECT_EQ(lines.counters.drawn_lines > 0, lines.counters.operations > surface.counters.operations);
    EXPECT_GE(lines.counters.footprint_tests,
              surface.counters.footprint_tests + static_cast<std::uint64_t>(drawn_lines));
    // Lines are drawn with their piece: hits behind them that come later are not written.
    EXPECT_GE(lines.counters.writes, static_cast<std::uint64_t>(drawn_lines));
  }
}

}  // namespace
}  // namespace tessera::tilecore::sampling_lines_test
