// Procedures through the whole machine: sampled and tessellated, alone and beside ordinary geometry, still and moving.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/image_metrics.h"
#include "base/simd_targets.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/programs.h"

namespace tessera::gpu {
namespace {

using shaders::ShapeId;

using Settings = tilecore::ProcedureSettings;

struct Ways {
  Settings::Path path = Settings::Path::kSampled;
  int tile = 32;
  std::size_t threads = 0;
  std::string simd = "";
  int spp = 16;
  bool motion = true;
  Settings::Style style = Settings::Style::kSurface;
};

FrameResult render(const scene::Capture& capture, const Ways& ways, int width = 160, int height = 90) {
  const ThreadLimit threads(ways.threads);
  force_simd_target(ways.simd);
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = ways.tile;
  RunSettings settings;
  settings.procedures.path = ways.path;
  settings.procedures.style = ways.style;
  settings.sampling.samples_per_pixel = ways.spp;
  settings.tessellation.target_edge_pixels = 1.5;
  if (!ways.motion) settings.effects.motion = gpu::EffectMode::kOff;
  Device renderer(capture, gpu, settings, {width, height, {0, 0, width, height}, true});
  FrameResult result = renderer.render(capture.settings.first_frame);
  force_simd_target("");
  return result;
}

Image display(const Image& linear) {
  const Image8 shown = shaders::to_display(linear, 1.0f);
  Image out(shown.width, shown.height, 3);
  for (int y = 0; y < shown.height; ++y)
    for (int x = 0; x < shown.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) out.at(x, y)[c] = static_cast<float>(shown.at(x, y)[c]) / 255.0f;
  return out;
}

double decibels(const FrameResult& a, const FrameResult& b) {
  return psnr(display(a.targets.color), display(b.targets.color));
}

// A torus through a triangle and around a sphere: all three hide each other in part.
scene::Capture mixed_scene(bool moving) {
  scene::Capture capture;
  scene::Camera camera;
  test::add_camera(capture, DVec3(0, 0.6, 5), camera);
  scene::Material material;
  material.metallic = 0;
  material.roughness = 0.5f;
  material.base_color = Vec4(0.9f, 0.5f, 0.2f, 1.0f);
  const int orange = test::add_material(capture, material);
  material.base_color = Vec4(0.2f, 0.4f, 0.8f, 1.0f);
  material.double_sided = true;
  const int blue = test::add_material(capture, material);
  shaders::ShapeInput torus, sphere;
  torus.p = {1.2f, 0.35f};
  sphere.p = {0.8f};
  const int node = test::add_procedure(capture, ShapeId::kTorus, torus, DVec3(0.0), orange);
  test::add_procedure(capture, ShapeId::kSphere, sphere, DVec3(-0.6, 0.2, 0), orange);
  test::add_node(capture, test::triangles({{-2, -1, -0.5f}, {2, -1, -0.5f}, {0, 1.5f, 0.8f}}, {0, 1, 2}, blue));
  if (moving) {
    test::add_motion(capture, node, DVec3(0.8, 0.3, 0.5));
    capture.settings.frame_rate = 1;
    capture.settings.shutter_close = 0.5;
  }
  return capture;
}

TEST(Procedures, SampledAndTessellatedShowTheSameImage) {
  for (const bool moving : {false, true}) {
    const scene::Capture capture = mixed_scene(moving);
    const FrameResult sampled = render(capture, {}), tessellated = render(capture, {Settings::Path::kTessellated});
    EXPECT_GT(decibels(sampled, tessellated), 38) << (moving ? "moving" : "still");
    EXPECT_GT(sampled.counters.sampling.samples, 0u);
    EXPECT_EQ(tessellated.counters.sampling.samples, 0u);
    EXPECT_EQ(sampled.counters.tessellation.domain_evaluations, 3u);  // the triangle
  }
}

TEST(Procedures, AnotherProcedureIsAnotherImage) {  // the twin of the law above
  scene::Capture capture = mixed_scene(false);
  const FrameResult sampled = render(capture, {});
  capture.procedures[0].pieces[0].input.p[1] = 0.3f;
  EXPECT_LT(decibels(sampled, render(capture, {Settings::Path::kTessellated})), 38);
}

TEST(Procedures, ImagesFollowFromTheSceneAlone) {  // SC1
  for (const bool moving : {false, true}) {
    const scene::Capture capture = mixed_scene(moving);
    const FrameResult plain = render(capture, {.spp = 4});
    std::vector<Ways> others = {{.tile = 8, .spp = 4}, {.tile = 64, .spp = 4}, {.threads = 1, .spp = 4}};
    for (const std::string& simd : simd_target_names()) others.push_back({.simd = simd, .spp = 4});
    for (const Ways& ways : others) {
      const FrameResult other = render(capture, ways);
      EXPECT_EQ(plain.targets.color.values, other.targets.color.values)
          << ways.tile << " " << ways.threads << " " << ways.simd << (moving ? " moving" : "");
      EXPECT_EQ(plain.targets.depth.values, other.targets.depth.values);
    }
  }
}

TEST(Procedures, CountersDoNotDependOnThreadsOrInstructionSet) {
  const scene::Capture capture = mixed_scene(true);
  const FrameResult plain = render(capture, {.spp = 4});
  for (const Ways& ways : {Ways{.threads = 1, .spp = 4}, Ways{.simd = simd_target_names().back(), .spp = 4}}) {
    const FrameResult other = render(capture, ways);
    for (const auto& field : kCounterFields<tilecore::SamplingCounters>)
      EXPECT_EQ(plain.counters.sampling.*field.member, other.counters.sampling.*field.member) << field.name;
    EXPECT_EQ(plain.counters.ledger.total().read_bytes, other.counters.ledger.total().read_bytes);
  }
}

// ---- Drawn with lines -------------------------------------------------------------------------------------------

TEST(Procedures, ADrawingFollowsFromTheSceneAlone) {  // SC1
  const scene::Capture capture = mixed_scene(false);
  const FrameResult plain = render(capture, {.spp = 4, .style = Settings::Style::kLines});
  EXPECT_GT(plain.counters.sampling.drawn_lines, 0u);
  EXPECT_NE(plain.targets.color.values, render(capture, {.spp = 4}).targets.color.values)
      << "the twin: another style is another image";
  std::vector<Ways> others = {{.tile = 8, .spp = 4}, {.tile = 64, .spp = 4}, {.threads = 1, .spp = 4}};
  for (const std::string& simd : simd_target_names()) others.push_back({.simd = simd, .spp = 4});
  for (Ways& ways : others) {
    ways.style = Settings::Style::kLines;
    const FrameResult other = render(capture, ways);
    EXPECT_EQ(plain.targets.color.values, other.targets.color.values)
        << ways.tile << " " << ways.threads << " " << ways.simd;
    EXPECT_EQ(plain.targets.depth.values, other.targets.depth.values)
        << ways.tile << " " << ways.threads << " " << ways.simd;
    if (ways.tile != 32) continue;
    for (const auto& field : kCounterFields<tilecore::SamplingCounters>)
      EXPECT_EQ(plain.counters.sampling.*field.member, other.counters.sampling.*field.member)
          << field.name << " " << ways.threads << " " << ways.simd;
  }
}

// Covered pixels that are no mixture of ink and paper.
std::size_t other_colors(const Image& color, float& least_ink, float& max_ink) {
  const Vec3 paper(0.80f, 0.76f, 0.68f), ink(0.02f, 0.02f, 0.035f);
  std::size_t others = 0;
  least_ink = 1, max_ink = 0;
  for (int y = 0; y < color.height; ++y)
    for (int x = 0; x < color.width; ++x) {
      const std::span<const float> c = color.at(x, y);
      if (c[3] != 1.0f) continue;
      const float share = (paper.x - c[0]) / (paper.x - ink.x);
      bool mixed = share > -1e-4f && share < 1.0001f;
      for (int k = 1; k < 3; ++k)
        mixed = mixed && std::abs(paper[k] + share * (ink[k] - paper[k]) - c[static_cast<std::size_t>(k)]) < 1e-4f;
      others += mixed ? 0 : 1;
      least_ink = std::min(least_ink, share), max_ink = std::max(max_ink, share);
    }
  return others;
}

TEST(Procedures, ADrawingIsInkOnPaper) {
  scene::Capture capture = mixed_scene(false);
  capture.nodes.back().mesh = scene::kNone;  // the triangle is shaded as ever
  float least, most;
  EXPECT_EQ(other_colors(render(capture, {.spp = 4, .style = Settings::Style::kLines}).targets.color, least, most), 0u);
  EXPECT_EQ(least, 0.0f);
  EXPECT_NEAR(most, 1.0f, 1e-4f);
  EXPECT_GT(other_colors(render(capture, {.spp = 4}).targets.color, least, most), 1000u);
}

// ---- Programs ---------------------------------------------------------------------------------------------------

// Replaces all built-in shapes and textures of a capture by programs of the same names and numbers.
scene::Capture with_programs(scene::Capture capture, const std::string& rates = "") {
  for (scene::Procedure& p : capture.procedures) {
    const std::string_view texture = shaders::texture_declarations()[static_cast<std::size_t>(p.texture)].name;
    const auto program = test::builtin(p.declaration().name).shape;
    p.texture_program = test::builtin(texture).texture;
    p.texture_constants = p.texture_program->bind(p.texture_numbers);
    p.texture = shaders::TextureId::kProgram;
    std::vector<float> constants;
    for (const scene::Procedure::Piece& piece : p.pieces) {
      const std::vector<float> own = program->bind(piece.input.p);
      constants.insert(constants.end(), own.begin(), own.end());
    }
    p.shape = ShapeId::kProgram;
    p.shape_program = program;
    p.shape_constants = std::make_shared<const std::vector<float>>(std::move(constants));
    for (std::size_t k = 0; k < p.pieces.size(); ++k) {
      p.pieces[k].input.program = program.get();
      p.pieces[k].input.constants = p.shape_constants->data() + k * program->constants.size();
    }
    if (rates.empty()) continue;
    p.rates_program = shaders::compile_programs(rates).programs.rates;
    p.rates_constants = p.rates_program->bind({});
  }
  return capture;
}

// As the capture of built-in stages: image, counters and bytes (PGM1).
TEST(Programs, DrawTheFrameOfTheBuiltInStages) {
  const std::string rates(shaders::builtin_programs().at("rates.txt"));
  for (const bool shipped : {false, true}) {
    const scene::Capture capture = shipped ? scene::read_capture(test::shipped_capture("workshop")) : mixed_scene(true);
    for (const Settings::Path path : {Settings::Path::kSampled, Settings::Path::kTessellated})
      for (const Settings::Style style : {Settings::Style::kSurface, Settings::Style::kLines}) {
        const Ways ways{.path = path, .spp = 4, .style = style};
        const FrameResult a = render(capture, ways), b = render(with_programs(capture, rates), ways);
        EXPECT_TRUE(a.targets.color.values == b.targets.color.values);
        EXPECT_EQ(counter_values(a.counters), counter_values(b.counters));
      }
  }
}

TEST(Programs, RatesChangeTheSamples) {
  const scene::Capture capture = mixed_scene(false);
  const FrameResult plain = render(with_programs(capture), {.spp = 4}),
                    fine =
                        render(with_programs(capture, "rates r { return vec2(4, 2) * reach / spacing; }"), {.spp = 4});
  EXPECT_NEAR(static_cast<double>(fine.counters.sampling.samples),
              2.0 * static_cast<double>(plain.counters.sampling.samples),
              0.2 * static_cast<double>(plain.counters.sampling.samples));
}

// ---- Closed surfaces --------------------------------------------------------------------------------------------

// No sample of the background shows through a closed surface: over a white background each sample of a black, unlit
// sphere that the tessellated twin has well inside its outline is dark.
TEST(Procedures, NoHoleInAClosedSurfaceOverAContrastingBackground) {
  for (const ShapeId id : {ShapeId::kSphere, ShapeId::kTorus, ShapeId::kGeometryImageMesh}) {  // the last has kinks
    scene::Capture capture;
    test::add_camera(capture, DVec3(0, 1.5, 4), {});
    scene::Material black;
    black.base_color = Vec4(0, 0, 0, 1);
    black.unlit = true;
    const int material = test::add_material(capture, black);
    shaders::ShapeInput in;
    in.p = {1.2f, 0.5f};
    in.image = &test::tube_image();
    test::add_procedure(capture, id, in, DVec3(0, 1.2, 0), material);
    capture.settings.background = Vec3(1.0f);
    const Image sampled = render(capture, {}, 320, 180).targets.color,
                reference = render(capture, {Settings::Path::kTessellated}, 320, 180).targets.color;
    int inside = 0;
    for (int y = 1; y < 179; ++y)
      for (int x = 1; x < 319; ++x) {
        bool covered = true;
        for (int k = 0; k < 9; ++k) covered = covered && reference.at(x + k % 3 - 1, y + k / 3 - 1)[3] == 1.0f;
        if (!covered) continue;
        ++inside;
        ASSERT_EQ(sampled.at(x, y)[3], 1.0f) << x << " " << y;
        ASSERT_EQ(sampled.at(x, y)[0], 0.0f) << x << " " << y;
      }
    EXPECT_GT(inside, 2000);
  }
}

TEST(Procedures, TheShippedCaptureIsTheSameSampledAndTessellated) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("workshop"));
  const FrameResult sampled = render(capture, {}, 640, 360),
                    tessellated = render(capture, {Settings::Path::kTessellated}, 640, 360);
  EXPECT_GT(decibels(sampled, tessellated), 38);
  EXPECT_EQ(sampled.counters.sampling.samples_not_finite, 0u);
}

}  // namespace
}  // namespace tessera::gpu
