// Procedures through the whole machine: sampled and tessellated, alone and beside ordinary geometry, still and moving.
#include "base/simd_targets.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/gpu/procedure_images.h"
#include "tests/support/programs.h"
#include "tests/support/tests.h"

namespace tessera::gpu::procedures_test {
namespace {

using shaders::ShapeId;

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

// ---- Among geometry ---------------------------------------------------------------------------------------------

// The workshop behind a wall that stands before its camera, from the left edge of the view to `right`: 0 is its middle.
scene::Capture behind_a_wall(float right) {
  scene::Capture capture = scene::read_capture(test::shipped_capture("workshop"));
  const scene::Transform eye = capture.nodes[static_cast<std::size_t>(capture.settings.camera_node)].transform;
  scene::Material grey;
  grey.double_sided = true;
  const int wall =
      test::add_node(capture, test::triangles({{-1, -1, -0.3f}, {right, -1, -0.3f}, {right, 1, -0.3f}, {-1, 1, -0.3f}},
                                              {0, 1, 2, 0, 2, 3}, test::add_material(capture, grey)));
  capture.nodes[static_cast<std::size_t>(wall)].transform = eye;
  return capture;
}

TEST(Procedures, BehindAWallAreHardlyEvaluated) {
  const FrameResult free = render(behind_a_wall(-0.9f), {.spp = 4}, 320, 180),
                    hidden = render(behind_a_wall(1), {.spp = 4}, 320, 180),
                    half = render(behind_a_wall(0), {.spp = 4}, 320, 180);
  ASSERT_GT(free.counters.sampling.samples, 10000u);
  EXPECT_LE(hidden.counters.sampling.samples * 20, free.counters.sampling.samples);
  EXPECT_GT(hidden.counters.tilecore.culled_occlusion, 0u);
  EXPECT_LT(half.counters.sampling.samples, free.counters.sampling.samples * 3 / 4);
  EXPECT_GT(half.counters.sampling.samples, free.counters.sampling.samples / 4);
}

// A sphere before a wall of procedures, in another order of the lists: geometry that a cell hides is culled as well.
TEST(Procedures, AreEntriesOfTheCommonLists) {
  const scene::Capture capture = mixed_scene(true);
  const FrameResult drawn = render(capture, {.spp = 4});
  const tilecore::SamplingCounters& sampling = drawn.counters.sampling;
  EXPECT_GT(sampling.map_entries, sampling.cells);
  EXPECT_GT(drawn.counters.binner.entries, sampling.map_entries);  // the triangle's, too
  EXPECT_GE(drawn.counters.binner.table_records, sampling.cells);  // some may be in no list
}

// A parameter buffer that is too small leads to partial renders, or to a spill, and to the same image.
TEST(Procedures, AFullParameterBufferChangesNoImage) {
  const scene::Capture capture = mixed_scene(true);
  const FrameResult plain = render(capture, {.spp = 4});
  for (const binner::FullPolicy policy : {binner::FullPolicy::kPartialRender, binner::FullPolicy::kSpill}) {
    const FrameResult small = render(capture, {.spp = 4, .buffer_bytes = 1500, .full_policy = policy});
    const bool partial = policy == binner::FullPolicy::kPartialRender;
    EXPECT_EQ(small.counters.binner.partial_renders > 0, partial);
    EXPECT_EQ(small.counters.binner.spilled_bytes > 0, !partial);
    EXPECT_EQ(small.targets.color.values, plain.targets.color.values);
    EXPECT_EQ(small.targets.depth.values, plain.targets.depth.values);
  }
}

// ---- Images on procedures -----------------------------------------------------------------------------------------

// A square with an image before a sphere: as a procedure, or as two triangles.
scene::Capture square_with_image(bool procedure, scene::AlphaMode mode, bool moving) {
  scene::Capture capture;
  scene::Camera camera;
  test::add_camera(capture, DVec3(0.4, 0.3, 4), camera);
  scene::Material material;
  material.double_sided = true;
  material.metallic = 0.5f;
  material.roughness = 0.8f;
  material.alpha_mode = mode;
  material.alpha_cutoff = 0.5f;
  material.base_color_texture.texture = material.emissive_texture.texture =
      material.metallic_roughness_texture.texture = material.occlusion_texture.texture = stripes();
  material.emissive = Vec3(0.3f, 0.1f, 0.2f);
  material.occlusion_strength = 0.5f;
  material.base_color_texture.transform.matrix = glm::mat2(1.5f, 0.2f, -0.1f, 1.0f);
  material.base_color_texture.transform.offset = Vec2(0.1f, 0.3f);
  const int striped = test::add_material(capture, material), plain = test::add_material(capture);
  shaders::ShapeInput sphere, square;
  sphere.p[0] = 0.8f;
  test::add_procedure(capture, ShapeId::kSphere, sphere, DVec3(0, 0, -1), plain);
  const std::array<Vec3, 4> corner = {Vec3(-1, -1, 0), Vec3(1, -1, 0.3f), Vec3(-1, 1, -0.3f), Vec3(1, 1, 0)};
  int node;
  if (procedure) {
    for (std::size_t k = 0; k < 12; ++k) square.p[k] = corner[k / 3][static_cast<int>(k % 3)];
    node = test::add_procedure(capture, ShapeId::kBilinearPatch, square, DVec3(0.0), striped);
  } else {
    scene::Primitive mesh = test::triangles({corner[0], corner[1], corner[3], corner[2]}, {0, 1, 2, 0, 2, 3}, striped);
    mesh.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    node = test::add_node(capture, mesh);
  }
  if (moving) {
    test::add_motion(capture, node, DVec3(0.4, 0.2, 0));
    capture.settings.frame_rate = 1;
    capture.settings.shutter_close = 0.5;
  }
  return capture;
}

TEST(Procedures, ImagesAreOnThemAsOnTriangles) {
  for (const bool moving : {false, true})
    for (const scene::AlphaMode mode : {scene::AlphaMode::kOpaque, scene::AlphaMode::kMask}) {
      const FrameResult triangles = render(square_with_image(false, mode, moving), {}),
                        sampled = render(square_with_image(true, mode, moving), {}),
                        tessellated = render(square_with_image(true, mode, moving), {Settings::Path::kTessellated});
      EXPECT_GT(decibels(sampled, triangles), 36) << moving << " " << static_cast<int>(mode);
      EXPECT_GT(decibels(tessellated, triangles), 36) << moving << " " << static_cast<int>(mode);
      const bool masked = mode == scene::AlphaMode::kMask;
      EXPECT_EQ(sampled.counters.tilecore.alpha_tests > 0, masked);
      EXPECT_GT(sampled.counters.texture.texels, 0u);
    }
}

TEST(Procedures, AHoleOrAnImageThatIsLeftOutIsNoticed) {  // the twin of the law above
  const FrameResult masked = render(square_with_image(false, scene::AlphaMode::kMask, false), {});
  EXPECT_LT(decibels(render(square_with_image(true, scene::AlphaMode::kOpaque, false), {}), masked), 30);
  scene::Capture other = square_with_image(true, scene::AlphaMode::kMask, false);
  other.materials[0].base_color_texture.transform.offset.x += 0.05f;
  EXPECT_LT(decibels(render(other, {}), masked), 30);
}

TEST(Procedures, HolesAreWhereTheyAreWhateverTheTiles) {  // SC1
  for (const bool moving : {false, true}) {
    const scene::Capture capture = square_with_image(true, scene::AlphaMode::kMask, moving);
    const FrameResult plain = render(capture, {.spp = 4});
    for (const Ways& ways : {Ways{.tile = 8, .spp = 4}, Ways{.threads = 1, .spp = 4}})
      EXPECT_EQ(render(capture, ways).targets.color.values, plain.targets.color.values);
  }
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
  for (const bool shipped : {false, true}) {
    const scene::Capture capture = shipped ? scene::read_capture(test::shipped_capture("workshop")) : mixed_scene(true);
    for (const Settings::Path path : {Settings::Path::kSampled, Settings::Path::kTessellated})
      for (const Settings::Style style : {Settings::Style::kSurface, Settings::Style::kLines}) {
        const Ways ways{.path = path, .spp = 4, .style = style};
        const FrameResult a = render(capture, ways), b = render(with_programs(capture), ways);
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
}  // namespace tessera::gpu::procedures_test
