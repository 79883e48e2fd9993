// Features that procedures share with other surfaces: blending, normal maps, animated shapes, limits; and variants of
// the sampling controller.
#include "base/error.h"
#include "scene/animation.h"
#include "scene/capture_reader.h"
#include "tests/gpu/procedure_images.h"
#include "tests/support/tests.h"

namespace tessera::gpu::procedure_features_test {
namespace {

using scene::AnimatedPath;
using shaders::ShapeId;

scene::Material coloured(const Vec4& color, scene::AlphaMode mode = scene::AlphaMode::kOpaque,
                         bool double_sided = true) {
  scene::Material material;
  material.base_color = color;
  material.metallic = 0;
  material.roughness = 0.6f;
  material.alpha_mode = mode;
  material.double_sided = double_sided;
  return material;
}

// ---- Blending ---------------------------------------------------------------------------------------------------

// A glass sphere and a coil that is seen through itself, before and behind an opaque torus and a triangle.
scene::Capture glass(bool moving) {
  scene::Capture capture;
  test::add_camera(capture, DVec3(0.2, 0.5, 4.5), {});
  const int clear = test::add_material(capture, coloured(Vec4(0.2f, 0.6f, 0.9f, 0.4f), scene::AlphaMode::kBlend)),
            coil = test::add_material(capture, coloured(Vec4(0.9f, 0.7f, 0.1f, 0.6f), scene::AlphaMode::kBlend)),
            solid = test::add_material(capture, coloured(Vec4(0.8f, 0.3f, 0.2f, 1)));
  shaders::ShapeInput sphere, torus, spring;
  sphere.p = {0.9f};
  torus.p = {1.2f, 0.25f};
  spring.p = {0.6f, 0.15f, 1.6f, 4};
  const int node = test::add_procedure(capture, ShapeId::kSphere, sphere, DVec3(-0.5, 0, 0.3), clear);
  test::add_procedure(capture, ShapeId::kTorus, torus, DVec3(0.0), solid);
  test::add_procedure(capture, ShapeId::kSpring, spring, DVec3(1.0, -0.7, 0.2), coil);
  test::add_node(capture, test::triangles({{-2, -1, -0.8f}, {2, -1, -0.8f}, {0, 1.5f, -0.2f}}, {0, 1, 2}, solid));
  if (moving) {
    test::add_motion(capture, node, DVec3(0.5, 0.2, 0.3));
    capture.settings.frame_rate = 1;
    capture.settings.shutter_close = 0.5;
  }
  return capture;
}

TEST(BlendedProcedures, SampledAndTessellatedShowTheSameImage) {  // SC5
  for (const bool moving : {false, true}) {
    const scene::Capture capture = glass(moving);
    const FrameResult sampled = render(capture, {}, 320, 180),
                      tessellated = render(capture, {Settings::Path::kTessellated}, 320, 180);
    EXPECT_GT(decibels(sampled, tessellated), 38) << moving;
    EXPECT_GT(sampled.counters.shading.blended_layers, 0u);
    EXPECT_GT(sampled.counters.sampling.layers_merged, 0u);
    const auto layers = [](const FrameResult& r) { return static_cast<double>(r.counters.shading.blended_layers); };
    EXPECT_NEAR(layers(sampled) / layers(tessellated), 1, 0.02) << moving;
  }
}

// The twins: opaque as before, or with a layer of each footprint.
TEST(BlendedProcedures, AnotherAlphaIsNoticed) {
  scene::Capture capture = glass(false);
  const FrameResult tessellated = render(capture, {Settings::Path::kTessellated}, 320, 180);
  capture.materials[0].base_color.w = capture.materials[1].base_color.w = 1;
  EXPECT_LT(decibels(render(capture, {}, 320, 180), tessellated), 30);
  capture.materials[0].base_color.w = 0.6f;
  capture.materials[1].base_color.w = 0.6f;
  EXPECT_LT(decibels(render(capture, {}, 320, 180), tessellated), 36);
}

TEST(BlendedProcedures, ImagesFollowFromTheSceneAlone) {  // SC1
  for (const bool moving : {false, true}) {
    const scene::Capture capture = glass(moving);
    const FrameResult plain = render(capture, {.spp = 4});
    std::vector<Ways> others = {
        {.tile = 8, .spp = 4}, {.tile = 64, .spp = 4}, {.threads = 1, .spp = 4}, {.spp = 4, .buffer_bytes = 1500}};
    for (const std::string& simd : simd_target_names()) others.push_back({.simd = simd, .spp = 4});
    for (const Ways& ways : others) {
      const FrameResult other = render(capture, ways);
      EXPECT_EQ(plain.targets.color.values, other.targets.color.values)
          << ways.tile << " " << ways.threads << " " << ways.simd << " " << ways.buffer_bytes << moving;
    }
  }
}

// A half-transparent sphere over white, unlit and from one side only, is one layer wherever it is.
TEST(BlendedProcedures, ASurfaceIsOneLayerThickWhateverItsFootprints) {  // SC5
  scene::Capture capture;
  test::add_camera(capture, DVec3(0, 0, 4), {});
  scene::Material half = coloured(Vec4(0, 0, 0, 0.5f), scene::AlphaMode::kBlend, false);
  half.unlit = true;
  const int material = test::add_material(capture, half);
  shaders::ShapeInput in;
  in.p = {1.2f, 0.5f};
  for (const auto& [id, place] : {std::pair{ShapeId::kSphere, DVec3(-1.3, 0, 0)}, {ShapeId::kTorus, DVec3(1.4, 0, 0)}})
    test::add_procedure(capture, id, in, place, material);
  capture.settings.background = Vec3(1.0f);
  const Image image = render(capture, {}, 320, 180).targets.color,
              reference = render(capture, {Settings::Path::kTessellated}, 320, 180).targets.color;
  int inside = 0, wrong = 0;
  for (int y = 1; y < 179; ++y)
    for (int x = 1; x < 160; ++x) {
      bool covered = true;
      for (int k = 0; k < 9; ++k)
        covered = covered && std::abs(reference.at(x + k % 3 - 1, y + k / 3 - 1)[0] - 0.5f) < 1e-4f;
      if (!covered) continue;
      ++inside;
      wrong += std::abs(image.at(x, y)[0] - 0.5f) > 1e-4f ? 1 : 0;
    }
  EXPECT_GT(inside, 1500);
  EXPECT_EQ(wrong, 0);
}

// ---- Normal maps ------------------------------------------------------------------------------------------------

std::shared_ptr<const shaders::Texture> bumps() {
  Image8 image(64, 64, 4);
  for (std::size_t at = 0; at < image.values.size(); at += 4) {
    const double x = static_cast<double>(at / 4 % 64) / 64, y = static_cast<double>(at / 256) / 64, turn = 6.283185307;
    const double nx = 0.5 * std::sin(turn * 4 * x), ny = 0.5 * std::cos(turn * 3 * y),
                 nz = std::sqrt(1 - nx * nx - ny * ny);
    const auto code = [](double n) { return static_cast<std::uint8_t>(std::lround((n + 1) * 127.5)); };
    image.values[at] = code(nx), image.values[at + 1] = code(ny), image.values[at + 2] = code(nz);
    image.values[at + 3] = 255;
  }
  return std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
}

// A flat square and a tilted one, as procedures or as triangles.
scene::Capture bumpy(bool procedure, bool mapped) {
  scene::Capture capture;
  test::add_camera(capture, DVec3(0.3, 0.6, 4), {});
  scene::Material material = coloured(Vec4(0.7f, 0.7f, 0.8f, 1));
  material.metallic = 0.7f;
  material.roughness = 0.3f;
  if (mapped) material.normal_texture.texture = bumps();
  material.normal_texture.transform.matrix = glm::mat2(1.2f, 0.3f, -0.2f, 0.9f);
  const int number = test::add_material(capture, material);
  for (const float tilt : {0.0f, 0.9f}) {
    const float left = tilt > 0 ? 0.1f : -1.9f;
    const std::array<Vec3, 4> corner = {Vec3(left, -1, tilt), Vec3(left + 1.7f, -1, 0), Vec3(left, 1, tilt),
                                        Vec3(left + 1.7f, 1, 0)};
    if (procedure) {
      shaders::ShapeInput square;
      for (std::size_t k = 0; k < 12; ++k) square.p[k] = corner[k / 3][static_cast<int>(k % 3)];
      test::add_procedure(capture, ShapeId::kBilinearPatch, square, DVec3(0.0), number);
    } else {
      scene::Primitive mesh = test::triangles({corner[0], corner[1], corner[3], corner[2]}, {0, 1, 2, 0, 2, 3}, number);
      mesh.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      test::add_node(capture, mesh);
    }
  }
  return capture;
}

TEST(ProcedureNormalMaps, AreOnThemAsOnTriangles) {
  const FrameResult triangles = render(bumpy(false, true), {}, 320, 180);
  EXPECT_GT(decibels(render(bumpy(true, true), {}, 320, 180), triangles), 38);
  EXPECT_GT(decibels(render(bumpy(true, true), {Settings::Path::kTessellated}, 320, 180), triangles), 38);
  EXPECT_LT(decibels(render(bumpy(true, false), {}, 320, 180), triangles), 30) << "the twin: none is noticed";
}

// ---- Animated parameters ----------------------------------------------------------------------------------------

void animate(scene::Capture& capture, int node, AnimatedPath path, int part, int components,
             std::vector<float> values) {
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = path;
  channel.part = part;
  channel.components = components;
  channel.times = {0, 1};
  channel.values = std::move(values);
  test::play(capture, channel);
}

// A torus whose radii grow, over a checker that changes its colour; the shutter is open for half a second.
scene::Capture growing(float minor_from, float minor_to, bool blurred = true) {
  scene::Capture capture;
  test::add_camera(capture, DVec3(0, 1.5, 4.5), {});
  const int material = test::add_material(capture, coloured(Vec4(0.9f, 0.6f, 0.3f, 1)));
  shaders::ShapeInput torus, sphere;
  torus.p = {1, 0.5f};
  sphere.p = {0.4f};
  const int node = test::add_procedure(capture, ShapeId::kTorus, torus, DVec3(0.0), material);
  test::add_procedure(capture, ShapeId::kSphere, sphere, DVec3(0.0), material);
  animate(capture, node, AnimatedPath::kShapeNumbers, 1, 1, {minor_from, minor_to});
  capture.settings.frame_rate = 1;
  if (blurred) capture.settings.shutter_close = 0.5;
  return capture;
}

TEST(AnimatedProcedures, SampledAndTessellatedShowTheSameBlurredImage) {
  const scene::Capture capture = growing(0.15f, 0.9f);
  const FrameResult sampled = render(capture, {}, 320, 180),
                    tessellated = render(capture, {Settings::Path::kTessellated}, 320, 180);
  EXPECT_GT(decibels(sampled, tessellated), 38);
  // The twins: the blurred image is neither key's image.
  EXPECT_LT(decibels(sampled, render(growing(0.15f, 0.15f), {}, 320, 180)), 30);
  EXPECT_LT(decibels(sampled, render(growing(0.15f, 0.9f, false), {}, 320, 180)), 30);
}

TEST(AnimatedProcedures, WithoutChannelsTheyAreTheCapturesOwn) {  // AP2
  const scene::Capture capture = scene::read_capture(test::shipped_capture("workshop"));
  const scene::PosedProcedures posed = scene::pose_procedures(capture, 0, 1);
  EXPECT_TRUE(posed.keys.empty());
  ASSERT_FALSE(capture.procedures.empty());
  for (const std::size_t key : {0u, 1u}) EXPECT_EQ(&posed.at(capture, 0, key), &capture.procedures[0]);
}

TEST(AnimatedProcedures, WithOneValueTheyEqualTheFile) {  // AP1
  scene::Capture still = growing(0.5f, 0.5f);
  const FrameResult animated = render(still, {.spp = 4});
  still.animations.clear();
  still.played_animations.clear();
  const FrameResult plain = render(still, {.spp = 4});
  EXPECT_EQ(animated.targets.color.values, plain.targets.color.values);
  // Their records have room for both keys, and lie elsewhere; all else is the same.
  for (const auto& field : kCounterFields<tilecore::SamplingCounters>)
    EXPECT_EQ(animated.counters.sampling.*field.member, plain.counters.sampling.*field.member) << field.name;
}

TEST(AnimatedProcedures, AFrameHasTheNumbersOfItsTime) {
  scene::Capture capture = growing(0.2f, 0.6f, false);
  capture.settings.first_frame = 1;  // at the last key
  const FrameResult animated = render(capture, {.spp = 4});
  capture.animations.clear();
  capture.played_animations.clear();
  capture.procedures[0].pieces[0].input.p[1] = 0.6f;
  EXPECT_EQ(animated.targets.color.values, render(capture, {.spp = 4}).targets.color.values);
}

TEST(AnimatedProcedures, ImagesFollowFromTheSceneAlone) {  // SC1
  const scene::Capture capture = growing(0.15f, 0.7f);
  const FrameResult plain = render(capture, {.spp = 4});
  std::vector<Ways> others = {{.tile = 8, .spp = 4}, {.tile = 64, .spp = 4}, {.threads = 1, .spp = 4}};
  for (const std::string& simd : simd_target_names()) others.push_back({.simd = simd, .spp = 4});
  for (const Ways& ways : others)
    EXPECT_EQ(plain.targets.color.values, render(capture, ways).targets.color.values)
        << ways.tile << " " << ways.threads << " " << ways.simd;
}

TEST(AnimatedProcedures, AShapeThatDeformsCostsBothKeys) {
  const FrameResult moving = render(growing(0.5f, 0.500001f), {.spp = 4}),
                    still = render(growing(0.5f, 0.5f), {.spp = 4});
  const auto each = [](const FrameResult& r) {
    return static_cast<double>(r.counters.sampling.operations) / static_cast<double>(r.counters.sampling.array_slots);
  };
  EXPECT_GT(each(moving), 1.3 * each(still));
}

// ---- Limits -----------------------------------------------------------------------------------------------------

TEST(ProcedureLimits, BoundTheSegmentsOfThePathThatTessellates) {
  scene::Capture capture = growing(0.5f, 0.5f, false);
  const auto vertices = [&] {
    return render(capture, {.path = Settings::Path::kTessellated, .spp = 4}).counters.tessellation.domain_evaluations;
  };
  const std::uint64_t free = vertices();
  for (scene::Procedure& p : capture.procedures) p.max_segments = 2;
  const std::uint64_t few = vertices();
  for (scene::Procedure& p : capture.procedures) p.min_segments = p.max_segments = 48;
  const std::uint64_t many = vertices();
  EXPECT_LT(few, free / 4);
  EXPECT_GT(many, 4 * free);
  const FrameResult sampled = render(capture, {.spp = 4});
  for (scene::Procedure& p : capture.procedures) p.min_segments = 1, p.max_segments = 64;
  EXPECT_EQ(sampled.targets.color.values, render(capture, {.spp = 4}).targets.color.values) << "samples have no limits";
}

TEST(ProcedureLimits, BeyondTheMachinesAreRefused) {
  scene::Capture capture = growing(0.5f, 0.5f, false);
  capture.procedures[0].min_segments = 32;
  gpu::GpuConfiguration gpu;
  gpu.tessellator.max_factor = 16;
  RunSettings settings;
  settings.procedures.path = Settings::Path::kTessellated;
  Device device(capture, gpu, settings, {32, 32, {0, 0, 32, 32}, true});
  EXPECT_THROW(device.render(0), LimitError);
  settings.procedures.path = Settings::Path::kSampled;
  Device sampled(capture, gpu, settings, {32, 32, {0, 0, 32, 32}, true});
  EXPECT_NO_THROW(sampled.render(0));
}

// ---- Variants of the sampling controller ------------------------------------------------------------------------

scene::Capture shell(bool moving) {
  scene::Capture capture = glass(moving);
  shaders::ShapeInput image;
  image.image = &test::tube_image();
  test::add_procedure(capture, ShapeId::kGeometryImageMesh, image, DVec3(0, -0.3, 1), 2);
  capture.procedures.back().image = std::make_shared<const shaders::GeometryImage>(test::tube_image());
  return capture;
}

Ways with(Settings procedures) { return {.tile = 16, .spp = 4, .procedures = procedures}; }

TEST(PublishedProcedures, ReadAnImagesLinesThroughTheTextureCacheOnceEach) {
  Settings published;
  published.mode = Settings::Mode::kPublished;
  for (const bool moving : {false, true}) {
    const FrameResult interval = render(shell(moving), with({})), p = render(shell(moving), with(published));
    const tilecore::TextureCounters &a = interval.counters.texture, &b = p.counters.texture;
    // Materials look up as much in both modes; the image's lines come on top.
    EXPECT_GT(b.cache_requests - b.cache_misses, a.cache_requests - a.cache_misses);
    EXPECT_GT(b.cache_misses, a.cache_misses);
    EXPECT_GT(p.counters.sampling.sparse_evaluations, 0u);
    EXPECT_EQ(p.counters.sampling.interval_evaluations, 0u);
  }
}

}  // namespace
}  // namespace tessera::gpu::procedure_features_test
