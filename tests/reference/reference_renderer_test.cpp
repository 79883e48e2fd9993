// The reference renderer of `tessera tradeoff`: against formulas, against itself without its tree, against the machine.
#include "reference/reference_renderer.h"
#include "base/error.h"
#include "base/exr_file.h"
#include "base/image_metrics.h"
#include "base/parallel.h"
#include "base/simd_targets.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "reference/reference_kernel.h"
#include "reference/reference_store.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::reference::reference_renderer_test {
namespace {

using scene::Capture;

// A capture posed for the reference.
struct Posed {
  Posed(const Capture& capture_in, int width, int height, int number, double edge = 2.0)
      : capture(capture_in), assembly(scene::assemble(capture)) {
    settings.tessellation.target_edge_pixels = edge;
    frame = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, width, height),
                              gpu::frame_request(capture, gpu, settings, width, height, number));
  }
  ReferenceRequest request(std::vector<int> samples, std::uint64_t seed = 1) const {
    ReferenceRequest out;
    out.lighting = gpu::frame_lighting(capture);
    out.background = gpu::frame_background(capture);
    out.samples = std::move(samples);
    out.seed = seed;
    return out;
  }
  const Capture& capture;
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
};

Capture shipped(const char* name) { return scene::read_capture(test::shipped_capture(name)); }

// A white, unlit half-plane over black: everything right of x = `edge` pixels, `depth` away, moving `way` pixels to the
// right while the shutter is open, seen by an orthographic or a perspective camera.
Capture half_plane(bool orthographic, double edge, double way, double depth, const scene::Lens& lens = {}) {
  constexpr int kWidth = 32, kHeight = 8;
  Capture capture;
  scene::Material material;
  material.unlit = material.double_sided = true;
  const int white = test::add_material(capture, material);
  scene::Camera camera;
  camera.type = orthographic ? scene::Camera::Type::kOrthographic : scene::Camera::Type::kPerspective;
  camera.x_mag = kWidth / 2.0f;
  camera.y_mag = kHeight / 2.0f;
  camera.lens = lens;
  test::add_camera(capture, DVec3(0.0), camera);
  // Scene units per pixel at that depth.
  const double unit = orthographic ? 1.0 : depth * std::tan(0.4) / (kHeight / 2.0);
  const float x = static_cast<float>((edge - kWidth / 2.0) * unit), far = static_cast<float>(400 * unit),
              z = static_cast<float>(-depth);
  const int node = test::add_node(
      capture,
      test::triangles({{x, -far, z}, {x + far, -far, z}, {x + far, far, z}, {x, far, z}}, {0, 1, 2, 0, 2, 3}, white));
  if (way != 0) test::add_motion(capture, node, DVec3(way * unit, 0, 0));
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = way != 0 ? 1.0 : 0.0;
  capture.settings.background = Vec3(0.0f);
  return capture;
}

// Mean over the rows of a column.
double column_mean(const Image& image, int x) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) sum += static_cast<double>(image.at(x, y)[0]);
  return sum / image.height;
}

// ---- Formulas ---------------------------------------------------------------------------------------------------

TEST(Reference, AConstantColourFillsEveryPixelExactly) {
  const Capture capture = half_plane(false, -50, 0, 5);
  const Posed posed(capture, 32, 8, 0);
  const ReferenceScene scene(*posed.frame);
  const Image image = render_reference(scene, posed.request({100})).front();
  for (const float value : image.values) EXPECT_FLOAT_EQ(value, 1.0f);
}

// The share of a pixel and of the shutter that an edge leaves white, to five standard errors of the samples; the twin's
// edge is where it is at shutter open, and far outside of that.
TEST(Reference, CoverageOfAMovingEdgeIsTheMeanOverPixelAndShutter) {
  for (const bool orthographic : {true, false}) {
    const double edge = 9.3, way = 11.0;
    const Capture capture = half_plane(orthographic, edge, way, 5);
    const Posed posed(capture, 32, 8, 0);
    const ReferenceScene scene(*posed.frame);
    const Image image = render_reference(scene, posed.request({1024})).front();
    double worst_twin = 0;
    for (int x = 0; x < 32; ++x) {
      double expected = 0, at_open = 0;
      constexpr int kSteps = 20000;
      for (int k = 0; k < kSteps; ++k)
        expected += std::clamp(x + 1 - (edge + way * (k + 0.5) / kSteps), 0.0, 1.0) / kSteps;
      at_open = std::clamp(x + 1 - edge, 0.0, 1.0);
      const double tolerance = 5 * std::sqrt(std::max(expected * (1 - expected), 1e-9) / (8 * 1024)) + 1e-4;
      EXPECT_NEAR(column_mean(image, x), expected, tolerance) << "column " << x << ", orthographic " << orthographic;
      worst_twin = std::max(worst_twin, (std::abs(column_mean(image, x) - at_open)) / tolerance);
    }
    EXPECT_GT(worst_twin, 10);
  }
}

// A half-plane out of focus: the share of the lens disc from which a point of the image sees it.
TEST(Reference, CoverageOfADefocusedEdgeFollowsTheLensDisc) {
  scene::Lens lens;
  lens.aperture_radius = 0.5f;
  lens.focus_distance = 2.5f;
  const double edge = 16.0, depth = 5;
  const Capture capture = half_plane(false, edge, 0, depth, lens);
  const Posed posed(capture, 32, 8, 0);
  const ReferenceScene scene(*posed.frame);
  const double radius = scene.lens_scale * std::abs(1 / depth - scene.inverse_focus);
  ASSERT_GT(radius, 0.5);
  const Image image = render_reference(scene, posed.request({1024})).front();
  for (int x = 0; x < 32; ++x) {
    double expected = 0;
    constexpr int kSteps = 2000;
    for (int k = 0; k < kSteps; ++k) {
      // Area of a unit disc beyond a chord at distance d from its middle.
      const double d = std::clamp((edge - (x + (k + 0.5) / kSteps)) / radius, -1.0, 1.0);
      expected += (std::acos(d) - d * std::sqrt(1 - d * d)) / std::numbers::pi / kSteps;
    }
    EXPECT_NEAR(column_mean(image, x), expected,
                5 * std::sqrt(std::max(expected * (1 - expected), 1e-9) / (8 * 1024)) + 1e-3)
        << "column " << x;
  }
}

TEST(Reference, ErrorFallsWithTheRootOfTheSamples) {
  const Capture capture = shipped("eggs");
  const Posed posed(capture, 64, 36, 14);
  const ReferenceScene scene(*posed.frame);
  const std::vector<int> samples = {16, 32, 64, 128, 256, 512, 1024};
  const auto a = render_reference(scene, posed.request(samples, 1)),
             b = render_reference(scene, posed.request(samples, 2));
  std::vector<double> errors;
  for (std::size_t k = 0; k < samples.size(); ++k) errors.push_back(rms_difference(a[k], b[k]) / std::sqrt(2.0));
  EXPECT_NEAR(convergence_slope(samples, errors), -0.5, 0.05);
  // The twin: a series with an error that samples do not take away.
  for (double& error : errors) error += errors.front() / 8;
  EXPECT_GT(convergence_slope(samples, errors), -0.45);
}

TEST(Reference, SlopeIsTheExponentOfAPowerLaw) {
  const std::vector<int> samples = {16, 64, 256};
  EXPECT_NEAR(convergence_slope(samples, {0.25, 0.125, 0.0625}), -0.5, 1e-12);
  EXPECT_NEAR(convergence_slope(samples, {1, 0.25, 0.0625}), -1, 1e-12);
}

// ---- The tree (REF1, REF2) ------------------------------------------------------------------------------------------

// Packets of rays of neighbouring samples, as the renderer makes them, all over the image.
std::vector<RayPacket> packets_over(const ReferenceScene& scene, int count, std::uint32_t seed) {
  test::Random random(seed);
  std::vector<RayPacket> packets(static_cast<std::size_t>(count));
  for (RayPacket& packet : packets) {
    const double x0 = static_cast<double>(random.uniform(0, static_cast<float>(2 * scene.center_x))),
                 y0 = static_cast<double>(random.uniform(0, static_cast<float>(2 * scene.center_y)));
    for (std::size_t r = 0; r < RayPacket::kRays; ++r) {
      const auto unit = [&] { return static_cast<double>(random.uniform(0, 1)); };
      const double u = (unit() - 0.5) * scene.lens_scale, v = (unit() - 0.5) * scene.lens_scale;
      packet.t[r] = unit();
      packet.origin_x[r] = u;
      packet.origin_y[r] = v;
      packet.direction_x[r] = x0 + unit() - scene.center_x - u * scene.inverse_focus;
      packet.direction_y[r] = y0 + unit() - scene.center_y - v * scene.inverse_focus;
    }
  }
  return packets;
}

int differences(const ReferenceScene& scene, std::vector<RayPacket> packets) {
  int different = 0;
  for (RayPacket& packet : packets) {
    RayPacket all = packet;
    trace_packet(scene, packet);
    trace_packet_without_tree(scene, all);
    for (std::size_t r = 0; r < RayPacket::kRays; ++r)
      different +=
          packet.triangle[r] != all.triangle[r] || (packet.triangle[r] >= 0 && packet.depth[r] != all.depth[r]) ? 1 : 0;
  }
  return different;
}

TEST(ReferenceTree, EqualsASearchOfAllTriangles) {  // REF2
  for (const auto& [name, number] : {std::pair<const char*, int>{"eggs", 14}, {"flyby", 0}, {"serpent", 12}}) {
    const Capture capture = shipped(name);
    const Posed posed(capture, 64, 36, number, 8.0);
    ReferenceScene scene(*posed.frame);
    const std::vector<RayPacket> packets = packets_over(scene, 60, 5);
    EXPECT_EQ(differences(scene, packets), 0) << name;
    // The twin: boxes that contain only a part of their children.
    for (ReferenceScene::Node& node : scene.nodes)
      for (ReferenceScene::Box& box : node.box) box.high[0] = 0.5f * (box.low[0] + box.high[0]);
    EXPECT_GT(differences(scene, packets), 0) << name;
  }
}

TEST(ReferenceTree, BoxesHoldTheirTrianglesAtEveryTime) {  // REF1
  const Capture capture = shipped("flyby");
  const Posed posed(capture, 64, 36, 0, 8.0);
  const ReferenceScene scene(*posed.frame);
  std::size_t moving = 0;
  for (const ReferenceScene::Node& node : scene.nodes) {
    if (node.left >= 0) continue;
    const ReferenceScene::Leaf& leaf = scene.leaves[static_cast<std::size_t>(node.right)];
    moving += leaf.moving ? 1 : 0;
    for (std::size_t v = leaf.first_vertex; v < std::size_t{leaf.first_vertex} + leaf.vertex_count; ++v)
      for (const double t : {0.0, 0.3, 1.0})
        for (std::size_t a = 0; a < 3; ++a) {
          const double at = (1 - t) * scene.vertices[v][a] + t * scene.vertices[v][3 + a];
          ASSERT_GE(at,
                    (1 - t) * static_cast<double>(node.box[0].low[a]) + t * static_cast<double>(node.box[1].low[a]));
          ASSERT_LE(at,
                    (1 - t) * static_cast<double>(node.box[0].high[a]) + t * static_cast<double>(node.box[1].high[a]));
        }
  }
  EXPECT_GT(moving, 0u);
}

TEST(Reference, GivesTheSameBitsForAnyThreadsAndInstructionSet) {
  const Capture capture = shipped("eggs");
  const Posed posed(capture, 48, 27, 14, 4.0);
  const ReferenceScene scene(*posed.frame);
  const Image expected = render_reference(scene, posed.request({20})).front();
  {
    const ThreadLimit one(1);
    EXPECT_EQ(render_reference(scene, posed.request({20})).front().values, expected.values);
  }
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    EXPECT_EQ(render_reference(scene, posed.request({20})).front().values, expected.values) << target;
  }
  force_simd_target("");
  EXPECT_NE(render_reference(scene, posed.request({20}, 9)).front().values, expected.values) << "another seed";
}

// ---- The machine ------------------------------------------------------------------------------------------------

Image machine_image(const Capture& capture, int width, int height, int frame, std::int64_t samples,
                    std::int64_t seed = 0, double edge = 3.0) {
  gpu::RunSettings settings;
  settings.sampling.samples_per_pixel = samples;
  settings.shading.rate = tilecore::ShadingRate::kSample;
  settings.shading.surface = tilecore::ShadingSurface::kEvaluated;  // as the reference
  settings.sampling.seed = seed;
  settings.output.machine_model = false;
  settings.tessellation.target_edge_pixels = edge;
  gpu::Device renderer(capture, {}, settings, {width, height, {0, 0, width, height}});
  return renderer.render(frame).targets.color;
}

double shown_psnr(const Image& a, const Image& b) { return psnr(display_values(a, 1.0f), display_values(b, 1.0f)); }

// At the same samples only arithmetic differs: single precision and the grid of 1/256 pixel.
TEST(Reference, WithTheMachinesSamplesDiffersByItsArithmeticAlone) {
  for (const auto& [name, number] : {std::pair<const char*, int>{"eggs", 14},
                                     {"flyby", 0},
                                     {"serpent", 12},
                                     {"stroll", 3},
                                     {"workshop", 0},
                                     {"city", 5},
                                     {"garden", 5}}) {
    const Capture capture = shipped(name);
    const Posed posed(capture, 96, 54, number, 3.0);
    const auto render = [&, frame = static_cast<std::uint32_t>(number)](std::uint32_t seed) {
      tilecore::SamplingSettings sampling;
      sampling.seed = seed;
      sampling.frame = frame;
      const tilecore::SamplePattern pattern(sampling);
      ReferenceRequest request = posed.request({});
      request.pattern = &pattern;
      return render_reference(*posed.frame, request).front();  // segment by segment, as the machine
    };
    const Image machine = machine_image(capture, 96, 54, number, 4), same = render(0);
    // Procedures are sampled by footprints in the machine, tessellated here.
    EXPECT_GT(shown_psnr(same, machine), std::string(name) == "workshop" ? 25 : 38) << name;
    // The twin: other samples at the same places of the scene.
    if (posed.frame->any_motion) {
      EXPECT_LT(shown_psnr(render(1), machine), shown_psnr(same, machine) - 3) << name;
    }
  }
}

// A ball of glass before a board of two colours: the same image of the board, within half precision.
TEST(Reference, ShowsTheBackgroundOfGlassAsTheMachineDoes) {
  for (const float roughness : {0.0f, 0.5f}) {
    Capture capture;
    scene::Material red, blue, glass;
    red.unlit = blue.unlit = true;
    red.base_color = {0.9f, 0.1f, 0.1f, 1}, blue.base_color = {0.1f, 0.2f, 0.9f, 1};
    glass.metallic = 0, glass.roughness = roughness;
    glass.transmission.factor = 1, glass.volume.thickness = 0.7f;
    for (const auto effect : {scene::MaterialEffect::kTransmission, scene::MaterialEffect::kVolume})
      glass.effects[static_cast<std::size_t>(effect)] = true;
    for (const auto& [x, material] : {std::pair{-2.0f, &red}, {0.0f, &blue}})
      test::add_node(capture, test::patches(test::flat_patch({x, -2, 0}, {2, 0, 0}, {0, 4, 0}),
                                            test::add_material(capture, *material)));
    const int ball =
        test::add_node(capture, test::closed_patches(test::add_material(capture, glass)), DVec3(-0.2, 0.1, 1.5));
    test::add_motion(capture, ball, {2, 0, 0});
    test::add_camera(capture, {0, 0, 6});
    capture.settings.frame_rate = 8;
    const Posed posed(capture, 96, 54, 0, 3.0);
    const tilecore::SamplePattern pattern(tilecore::SamplingSettings{});
    ReferenceRequest request = posed.request({});
    request.pattern = &pattern;
    const Image machine = machine_image(capture, 96, 54, 0, 4), same = render_reference(*posed.frame, request).front();
    EXPECT_GT(shown_psnr(same, machine), 38) << roughness;
    // The twin: glass that shows the environment.
    EXPECT_LT(shown_psnr(render_reference(ReferenceScene(*posed.frame), request).front(), machine), 30) << roughness;
  }
}

TEST(Reference, DrawsPointsLinesAndHiddenNodesAsTheMachineDoes) {
  Capture capture;
  test::Random random(9);
  std::vector<Vec3> points, ends;
  for (int k = 0; k < 60; ++k) points.push_back(random.in_box(1)), ends.push_back(random.in_box(3));
  test::add_node(capture, test::points(points), DVec3(1000, 0, 0));
  test::add_node(capture, test::segments(ends), DVec3(1000, 0, 0));
  const int hidden = test::add_node(capture, test::closed_patches(scene::kNone), DVec3(1000, 0, 0));
  test::add_camera(capture, DVec3(1000, 0, 3));
  test::add_motion(capture, 3, DVec3(0.1, 0, -0.2));
  capture.settings.frame_rate = 1;
  capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  // At the same samples, as above.
  const auto difference = [&](const Capture& machine_capture) {
    const Posed posed(capture, 96, 54, 0, 3.0);
    const ReferenceScene scene(*posed.frame);
    const tilecore::SamplePattern pattern(tilecore::SamplingSettings{});
    ReferenceRequest request = posed.request({});
    request.pattern = &pattern;
    return shown_psnr(render_reference(scene, request).front(), machine_image(machine_capture, 96, 54, 0, 4));
  };
  for (const int node : {hidden, 0}) {
    const Capture before = capture;
    capture.nodes[static_cast<std::size_t>(node)].visible = false;
    EXPECT_GT(difference(capture), 34) << node;
    EXPECT_LT(difference(before), 30) << "the twin: the part hidden here is not hidden in the machine";
  }
}

TEST(Reference, IsWhereTheMachineGoesWithMoreSamples) {
  const Capture capture = shipped("serpent");
  const Posed posed(capture, 96, 54, 12, 3.0);
  const ReferenceScene scene(*posed.frame);
  const Image reference = render_reference(scene, posed.request({512})).front();
  double last = 0;
  for (const std::int64_t samples : {1, 4, 16, 64}) {
    const double db = shown_psnr(reference, machine_image(capture, 96, 54, 12, samples));
    EXPECT_GT(db, last) << samples;
    last = db;
  }
  EXPECT_GT(last, 38);
  EXPECT_LT(shown_psnr(reference, machine_image(capture, 96, 54, 20, 64)), 30) << "another frame";
}

// ---- The store --------------------------------------------------------------------------------------------------

Reference stored(const Capture& capture, const gpu::RunSettings& settings, const std::filesystem::path& folder) {
  return get_reference(gpu::PreparedCapture(capture), {}, settings,
                       {.width = 48, .height = 27, .frame = 14, .samples = 4, .edge_pixels = 0}, folder, "inputs");
}

TEST(ReferenceStore, GivesBackTheVeryImageAndItsInformation) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("eggs");
  const Reference made = stored(capture, {}, folder.path()), again = stored(capture, {}, folder.path());
  EXPECT_EQ(again.color.channels, 3);
  for (int y = 0; y < 27; ++y)
    for (int x = 0; x < 48; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_EQ(again.color.at(x, y)[c], made.color.at(x, y)[c]) << x << ' ' << y << ' ' << c;
  EXPECT_EQ(again.info, made.info);  // host times, too: it was not rendered again
}

TEST(ReferenceStore, AnEffectThatIsTurnedOffIsAnotherReference) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("eggs");
  const Reference all = stored(capture, {}, folder.path());
  gpu::RunSettings smooth;
  smooth.effects.displacement = gpu::EffectMode::kOff;
  EXPECT_GT(rms_difference(stored(capture, smooth, folder.path()).color, all.color), 1e-4);
  for (const auto member : {&gpu::EffectSettings::motion, &gpu::EffectSettings::defocus,
                            &gpu::EffectSettings::displacement, &gpu::EffectSettings::alpha_test}) {
    gpu::RunSettings settings;
    settings.effects.*member = gpu::EffectMode::kOff;
    EXPECT_NE(stored(capture, settings, folder.path()).info.host, all.info.host);
    settings.effects.*member = gpu::EffectMode::kOn;  // draws the same image
    EXPECT_EQ(stored(capture, settings, folder.path()).info, all.info);
  }
  for (const auto member : {&gpu::EffectSettings::blending, &gpu::EffectSettings::procedures}) {
    gpu::RunSettings settings;
    settings.effects.*member = gpu::EffectSwitch::kOff;
    EXPECT_NE(stored(capture, settings, folder.path()).info.host, all.info.host);
  }
}

TEST(ReferenceStore, EndsWhereItsNoiseIsSmallEnough) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("eggs");
  const auto made = [&](int samples, double enough_db) {
    return get_reference(
        gpu::PreparedCapture(capture), {}, {},
        {.width = 48, .height = 27, .frame = 14, .samples = samples, .edge_pixels = 0, .enough_db = enough_db},
        folder.path(), "inputs");
  };
  const Reference all = made(512, 0);
  EXPECT_EQ(all.info.samples, 512);
  EXPECT_EQ(all.info.enough_db, std::nullopt);
  ASSERT_TRUE(all.info.psnr_db);
  // A quarter of the samples has 6 dB less.
  const double enough = *all.info.psnr_db - 5;
  const Reference ended = made(512, enough);
  EXPECT_EQ(ended.info.asked_samples, 512);
  EXPECT_EQ(ended.info.enough_db, enough);
  EXPECT_LT(ended.info.samples, 512);
  EXPECT_GE(ended.info.samples, 64);
  EXPECT_GE(ended.info.psnr_db.value(), enough);
  EXPECT_EQ(ended.color.values, made(ended.info.samples, 0).color.values) << "the first samples of the same";
  // The twin: noise that it never comes down to.
  EXPECT_EQ(made(512, 200).info.samples, 512);
  EXPECT_EQ(made(512, 200).color.values, all.color.values);
}

// The noise that was measured says how many samples it takes, not how many it may take.
TEST(ReferenceStore, ExpectsTheSamplesThatItsNoiseNeeds) {
  const std::vector<int> numbers = {32, 64, 128, 256, 512, 1024};
  EXPECT_EQ(expected_samples(numbers, 64, 61, 60), 64);
  EXPECT_EQ(expected_samples(numbers, 64, 57.5, 60), 128) << "1.8 times as many";
  EXPECT_EQ(expected_samples(numbers, 64, 54.5, 60), 256) << "3.5 times as many";
  EXPECT_EQ(expected_samples(numbers, 64, 30, 60), 1024) << "it takes no more than all";
  EXPECT_EQ(expected_samples(numbers, 64, std::numeric_limits<double>::infinity(), 60), 64);
}

TEST(ReferenceStore, SaysHowFarItIs) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("eggs");
  ReferenceProgress progress;
  get_reference(gpu::PreparedCapture(capture), {}, {},
                {.width = 48, .height = 28, .frame = 14, .samples = 4, .edge_pixels = 0}, folder.path(), "inputs",
                &progress);
  EXPECT_NEAR(progress.done, 48 * 28 * 4 * (1 + 4.0 / 16), 1e-6);
  EXPECT_NEAR(progress.share(), 1, 1e-9);
}

TEST(ReferenceStore, RefusesAnImageOfAnotherSize) {
  const test::TemporaryFolder folder;
  const Capture capture = shipped("eggs");
  stored(capture, {}, folder.path());
  for (const auto& file : std::filesystem::directory_iterator(folder.path() / "reference"))
    if (file.path().extension() == ".exr") {
      const std::vector<float> black(3, 0.0f);
      write_exr(file.path(), 1, 1,
                {{"R", ExrChannel::Type::kFloat, black.data(), 3},
                 {"G", ExrChannel::Type::kFloat, black.data() + 1, 3},
                 {"B", ExrChannel::Type::kFloat, black.data() + 2, 3}});
    }
  EXPECT_THROW(stored(capture, {}, folder.path()), InputError);
}

}  // namespace
}  // namespace tessera::reference::reference_renderer_test
