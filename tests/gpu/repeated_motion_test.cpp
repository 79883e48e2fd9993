// Motion that repeats itself while the shutter is open, or turns several times: the frame is blurred accordingly, for
// any number of repetitions and any moving geometry, against the mean of still frames at random times.
#include <functional>

#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "scene/motion_curves.h"
#include "scene/motion_segments.h"
#include "tests/support/tests.h"

namespace tessera::gpu::repeated_motion_test {
namespace {

using scene::AnimatedPath;
using scene::Capture;

constexpr int kWidth = 96, kHeight = 64;

Capture stage() {
  Capture capture;
  capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  return capture;
}

int white(Capture& capture) {
  scene::Material material;
  material.unlit = material.double_sided = true;
  return test::add_material(capture, material);
}

// One unit a pixel.
void look_flat(Capture& capture, const scene::Lens& lens = {}) {
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = kWidth / 2.0f, camera.y_mag = kHeight / 2.0f;
  camera.near = 0.1f, camera.far = 200;
  camera.lens = lens;
  test::add_camera(capture, {0, 0, 100}, camera);
}

scene::Primitive square(float half, int material) {
  return test::triangles({{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}}, {0, 1, 2, 0, 2, 3},
                         material);
}

// There and back `cycles` times, from `a` to `b` and to `a`.
void zigzag(Capture& capture, int node, AnimatedPath path, const std::vector<float>& a, const std::vector<float>& b,
            int cycles) {
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = path;
  channel.components = static_cast<int>(a.size());
  for (int k = 0; k <= 2 * cycles; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(2 * cycles));
    const std::vector<float>& at = k % 2 == 0 ? a : b;
    channel.values.insert(channel.values.end(), at.begin(), at.end());
  }
  test::play(capture, channel);
}

// So many turns about z, at one speed.
void spin(Capture& capture, int node, double turns) {
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = AnimatedPath::kRotation;
  channel.components = 4;
  const int keys = static_cast<int>(std::ceil(3 * turns));
  for (int k = 0; k <= keys; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(keys));
    const double half = 3.14159265358979 * turns * k / keys;
    for (const double v : {0.0, 0.0, std::sin(half), std::cos(half)}) channel.values.push_back(static_cast<float>(v));
  }
  test::play(capture, channel);
}

// A swing along a smooth curve: a cubic spline with keys at its ends alone.
void swing(Capture& capture, int node, int cycles) {
  scene::AnimationChannel channel;
  channel.node = node;
  channel.path = AnimatedPath::kTranslation;
  channel.interpolation = scene::Interpolation::kCubicSpline;
  const int keys = 2 * cycles;
  for (int k = 0; k <= keys; ++k) {
    channel.times.push_back(static_cast<float>(k) / static_cast<float>(keys));
    const float x = k % 2 == 0 ? -20.0f : 20.0f;
    for (const float v : {0.0f, 0.0f, 0.0f, x, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}) channel.values.push_back(v);
  }
  test::play(capture, channel);
}

struct Motion {
  const char* name;
  std::function<Capture(int)> of;  // so many cycles
  bool keeps_area = false;         // nothing leaves the frame or hides anything
};

const std::vector<Motion>& motions() {
  static const std::vector<Motion> all = {
      {"a node there and back",
       [](int cycles) {
         Capture capture = stage();
         zigzag(capture, test::add_node(capture, square(8, white(capture))), AnimatedPath::kTranslation, {-20, 0, 0},
                {20, 4, 0}, cycles);
         look_flat(capture);
         return capture;
       },
       true},
      {"a blade that turns",
       [](int cycles) {
         Capture capture = stage();
         spin(capture,
              test::add_node(capture, test::triangles({{0, -3, 0}, {28, -3, 0}, {28, 3, 0}, {0, 3, 0}},
                                                      {0, 1, 2, 0, 2, 3}, white(capture))),
              cycles);
         look_flat(capture);
         return capture;
       },
       true},
      {"patches on a smooth swing",
       [](int cycles) {
         Capture capture = stage();
         swing(capture,
               test::add_node(capture,
                              test::patches(test::flat_patch({-8, -8, 0}, {16, 0, 0}, {0, 16, 0}), white(capture))),
               cycles);
         look_flat(capture);
         return capture;
       },
       true},
      {"a scale there and back",
       [](int cycles) {
         Capture capture = stage();
         zigzag(capture, test::add_node(capture, square(10, white(capture))), AnimatedPath::kScale, {0.5f, 1, 1},
                {3, 2, 1}, cycles);
         look_flat(capture);
         return capture;
       }},
      {"a morph there and back",
       [](int cycles) {
         Capture capture = stage();
         scene::Primitive shape = square(8, white(capture));
         for (Vec3& p : shape.vertices.positions) p.x -= 18;
         scene::MorphTarget target;
         target.positions.assign(4, Vec3(36, 0, 0));
         shape.vertices.morph_targets.push_back(target);
         zigzag(capture, test::add_node(capture, shape), AnimatedPath::kWeights, {0}, {1}, cycles);
         look_flat(capture);
         return capture;
       },
       true},
      {"a joint that turns",
       [](int cycles) {
         Capture capture = stage();
         scene::Primitive shape =
             test::triangles({{0, -3, 0}, {28, -3, 0}, {28, 3, 0}, {0, 3, 0}}, {0, 1, 2, 0, 2, 3}, white(capture));
         shape.vertices.influences.resize(4);
         for (auto& influence : shape.vertices.influences) influence.weights[0] = 1;
         const int node = test::add_node(capture, shape), joint = node + 1;
         capture.nodes.emplace_back();
         capture.roots.push_back(joint);
         capture.skins.push_back({{joint}, {DMat4(1.0)}});
         capture.nodes[static_cast<std::size_t>(node)].skin = 0;
         spin(capture, joint, cycles);
         look_flat(capture);
         return capture;
       },
       true},
      {"a camera there and back, through a lens",
       [](int cycles) {
         Capture capture = stage();
         test::add_node(capture, square(10, white(capture)), {0, 0, -60});
         scene::Camera camera;
         camera.vertical_fov = 0.9f;
         camera.lens = {1.0f, 50.0f};
         test::add_camera(capture, {0, 0, 0}, camera);
         zigzag(capture, static_cast<int>(capture.nodes.size()) - 1, AnimatedPath::kTranslation, {-15, 0, 0},
                {15, 0, 6}, cycles);
         return capture;
       }},
      {"instances below a node that turns",
       [](int cycles) {
         Capture capture = stage();
         const int node = test::add_node(capture, square(4, white(capture)));
         auto& instances = capture.nodes[static_cast<std::size_t>(node)].instances;
         instances.resize(3);
         for (std::size_t k = 0; k < 3; ++k) instances[k].translation = {9.0f * static_cast<float>(k + 1), 0, 0};
         spin(capture, node, cycles);
         look_flat(capture);
         return capture;
       },
       true},
  };
  return all;
}

Image render(const Capture& capture, const std::vector<std::string>& keys) {
  RunSettings settings;
  GpuConfiguration gpu;
  settings.output.machine_model = false;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  Device device(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  const FrameResult result = device.render(0);
  Image color(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (std::size_t c = 0; c < 3; ++c) color.at(x, y)[c] = result.targets.color.at(x, y)[c];
  return color;
}

// Number of still frames: the noise of their mean is at most the noise of an image of 50 dB.
constexpr int kStills = 512;

// Still frames at a random time in each of `count` equal parts of the shutter.
Image mean_of_stills(const Capture& moving, int count) {
  test::Random random(5);
  Image mean(kWidth, kHeight, 3);
  for (int k = 0; k < count; ++k) {
    Capture still = moving;
    still.settings.shutter_open = still.settings.shutter_close =
        (k + static_cast<double>(random.uniform(0, 1))) / count;
    const Image one = render(still, {"sampling.samples_per_pixel=16"});
    for (std::size_t i = 0; i < mean.values.size(); ++i) mean.values[i] += one.values[i] / static_cast<float>(count);
  }
  return mean;
}

double area(const Image& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.values.size(); i += 3) sum += static_cast<double>(image.values[i]);
  return sum;
}

std::unique_ptr<scene::FrameGeometry> posed(const Capture& capture, const scene::Assembly& assembly,
                                            const std::vector<std::string>& keys) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  return scene::pose_frame(assembly, frame_camera(capture, settings, kWidth, kHeight),
                           frame_request(capture, gpu, settings, kWidth, kHeight, 0));
}

TEST(RepeatedMotion, IsBlurredHoweverOftenItRepeats) {
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64", "shading.rate=sample"};
  for (const Motion& motion : motions()) {
    // However often, it is the same everywhere for as long.
    const Image truth = mean_of_stills(motion.of(1), kStills);
    for (const int cycles : {1, 2, 3}) {
      SCOPED_TRACE(std::string(motion.name) + ", cycles: " + std::to_string(cycles));
      const Capture capture = motion.of(cycles);
      const Image blurred = render(capture, keys);
      EXPECT_GE(psnr(blurred, truth), 40.0);
      EXPECT_NEAR(area(blurred) / area(truth), 1, 0.02);
      if (motion.keeps_area) {
        Capture still = capture;
        still.settings.shutter_close = 0;
        EXPECT_NEAR(area(blurred) / area(render(still, keys)), 1, 0.02);
      }
      // The twin: two motion keys, which see where everything begins and ends.
      EXPECT_LT(psnr(render(capture, {keys[0], "sampling.motion_segments=1"}), truth), 30.0);
    }
  }
}

// Mean squared errors of the frames of several seeds against the truth.
struct Noise {
  double of_one = 0;  // of a frame
  double bias = 0;    // the part that no number of frames averages out
  double random = 0;  // of a frame whose samples have independent times: c (1 - c) / n where a pixel is covered for c
};
Noise noise_of(const Capture& capture, const std::vector<std::string>& keys, const Image& truth, int samples) {
  constexpr int kSeeds = 8;
  std::vector<Image> frames;
  for (int seed = 0; seed < kSeeds; ++seed) {
    std::vector<std::string> seeded = keys;
    seeded.push_back("sampling.seed=" + std::to_string(seed));
    frames.push_back(render(capture, seeded));
  }
  Noise noise;
  const auto values = static_cast<double>(truth.values.size());
  for (std::size_t i = 0; i < truth.values.size(); ++i) {
    const double wanted = static_cast<double>(truth.values[i]);
    double mean = 0, spread = 0;
    for (const Image& frame : frames) mean += static_cast<double>(frame.values[i]) / kSeeds;
    for (const Image& frame : frames) {
      const double v = static_cast<double>(frame.values[i]);
      noise.of_one += (v - wanted) * (v - wanted) / kSeeds / values;
      spread += (v - mean) * (v - mean) / (kSeeds - 1);
    }
    noise.bias += ((mean - wanted) * (mean - wanted) - spread / kSeeds) / values;
    noise.random += std::max(0.0, wanted * (1 - wanted)) / samples / values;
  }
  return noise;
}

// One frame of 64 samples, however often the motion repeats itself: a pixel's samples see nearly as many phases of it.
// Samples lie in 64 of 67 parts of the shutter. So a pixel that is covered for a share c of the time has a variance of
// c (1 - c) 3 / 64^2, which is 3 / 64 of the variance of independent times. A scale whose blur covers a third of the frame has
// 30.3 dB with independent times, so 43.6 dB with these; the places of the samples in the pixel add as much noise (they
// alone leave 41.4 dB where regular times blur two repetitions), and a frame may be half a decibel short of 40 dB.
TEST(RepeatedMotion, OnRequestUpTo2048SegmentsBlurSixtyFourCycles) {
  const std::vector<std::string> keys = {"sampling.samples_per_pixel=64", "shading.rate=sample",
                                         "sampling.motion_segments_max=2048"};
  for (const Motion& motion : motions()) {
    const Image truth = mean_of_stills(motion.of(1), kStills);
    for (const int cycles : {4, 5, 8, 12, 16, 24, 33, 64}) {
      SCOPED_TRACE(std::string(motion.name) + ", cycles: " + std::to_string(cycles));
      const Image blurred = render(motion.of(cycles), keys);
      EXPECT_GE(psnr(blurred, truth), motion.name == std::string_view("a scale there and back") ? 39.5 : 40.0);
      EXPECT_NEAR(area(blurred) / area(truth), 1, 0.02);
    }
  }
}

// With few samples, too, frames of many seeds have no bias, and each has less noise than independent times; where the
// prime (17 for 16 samples) divides the number of repetitions, a pixel sees one phase and has the noise of one sample.
TEST(RepeatedMotion, IsUnbiasedAndLessNoisyThanIndependentTimes) {
  for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
    const Image truth = mean_of_stills(motions()[k].of(1), kStills);
    for (const auto& [samples, prime] : {std::pair{4, 5}, {16, 17}, {64, 67}})
      for (const int cycles : {4, 16, 64, prime}) {
        SCOPED_TRACE(std::string(motions()[k].name) + ", cycles: " + std::to_string(cycles) +
                     ", samples: " + std::to_string(samples));
        const std::vector<std::string> keys = {"sampling.samples_per_pixel=" + std::to_string(samples),
                                               "shading.rate=sample", "sampling.motion_segments_max=2048"};
        const Noise noise = noise_of(motions()[k].of(cycles), keys, truth, samples);
        if (cycles != prime) {
          EXPECT_LE(noise.bias, std::pow(10, -3.8));  // 38 dB
          EXPECT_LE(noise.of_one, noise.random * (samples == 4 ? 0.8 : 0.3));
        } else {
          EXPECT_GE(noise.of_one, 0.5 * noise.random * samples);
        }
      }
  }
}

// Motions of which no part is an arc or a parabola.
std::vector<Motion> mixed_motions() {
  std::vector<Motion> all = motions();
  all.push_back({"a blade that turns and grows", [](int cycles) {
                   Capture capture = stage();
                   const int node = test::add_node(capture, square(9, white(capture)));
                   spin(capture, node, cycles);
                   zigzag(capture, node, AnimatedPath::kScale, {0.3f, 1, 1}, {3, 1, 1}, 1);
                   zigzag(capture, node, AnimatedPath::kTranslation, {-15, 0, 0}, {15, 9, 0}, 1);
                   look_flat(capture);
                   return capture;
                 }});
  all.push_back({"a blade that turns a little and grows much", [](int cycles) {
                   Capture capture = stage();
                   const int node = test::add_node(capture, square(9, white(capture)));
                   spin(capture, node, 0.07 * cycles);
                   zigzag(capture, node, AnimatedPath::kScale, {0.1f, 1, 1}, {4, 1, 1}, 1);
                   look_flat(capture);
                   return capture;
                 }});
  all.push_back({"a camera that turns as it passes", [](int cycles) {
                   Capture capture = stage();
                   test::add_node(capture, square(10, white(capture)), {0, 0, -40});
                   scene::Camera camera;
                   camera.vertical_fov = 0.9f;
                   test::add_camera(capture, {0, 0, 0}, camera);
                   const int node = static_cast<int>(capture.nodes.size()) - 1;
                   zigzag(capture, node, AnimatedPath::kTranslation, {-9, 0, 0}, {9, 0, -25}, cycles);
                   test::add_turn(capture, node, {0, 1, 0}, -0.5f);
                   return capture;
                 }});
  return all;
}

TEST(RepeatedMotion, ThePlanKeepsItsPromiseOfTheError) {
  for (const Motion& motion : mixed_motions())
    for (const int cycles : {1, 3, 8}) {
      SCOPED_TRACE(motion.name);
      const Capture capture = motion.of(cycles);
      const scene::Assembly assembly = scene::assemble(capture);
      const auto frame = posed(capture, assembly, {"sampling.motion_segments_max=2048"});
      ASSERT_FALSE(frame->segments.empty());
      EXPECT_LE(frame->motion_error, 0.25 * (1 + 1e-6));
      EXPECT_EQ(frame->segments.front()->part.first, 0);
      EXPECT_EQ(frame->segments.back()->part.end, ShutterSegment::kCodes);
      test::Random random(3);
      double worst = 0;
      for (std::size_t s = 0; s < frame->segments.size(); ++s) {
        const scene::FrameGeometry& segment = *frame->segments[s];
        if (s > 0) {
          EXPECT_EQ(segment.part.first, frame->segments[s - 1]->part.end);
        }
        // Against still frames at any time in it.
        for (int look = 0; look < 4; ++look) {
          Capture still = capture;
          const double local = static_cast<double>(random.uniform(0, 1));
          still.settings.shutter_open = still.settings.shutter_close =
              segment.part.at(0) + (segment.part.at(1) - segment.part.at(0)) * local;
          const auto truth = posed(still, assembly, {});
          for (std::size_t d = 0; d < segment.drawables.size(); ++d) {
            const scene::PosedDrawable &line = segment.drawables[d], &there = truth->drawables[d];
            for (std::size_t v = 0; v < line.positions[0].size(); ++v) {
              const DVec4 a = DMat4(line.to_raster[0]) * DVec4(DVec3(line.positions[0][v]), 1.0),
                          b = DMat4(line.to_raster[1]) * DVec4(DVec3(line.positions[line.moving ? 1 : 0][v]), 1.0),
                          at = a * (1 - local) + b * local,
                          wanted = DMat4(there.to_raster[0]) * DVec4(DVec3(there.positions[0][v]), 1.0);
              worst = std::max(worst, glm::distance(DVec2(at.x, at.y) / at.w, DVec2(wanted.x, wanted.y) / wanted.w));
            }
          }
        }
      }
      EXPECT_LE(worst, 0.25 * (1 + 1e-3)) << cycles << " cycles, bound " << frame->motion_error;
    }
}

TEST(RepeatedMotion, WhereSegmentsAreTooFewTheyAreUnevenAndANoteSaysSo) {
  const Capture capture = motions()[0].of(64);  // two motions for each segment
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = posed(capture, assembly, {});
  EXPECT_EQ(frame->segments.size(), 64u);
  EXPECT_GT(frame->motion_error, 1.0);
  std::vector<int> lengths;
  for (const auto& segment : frame->segments) lengths.push_back(segment->part.end - segment->part.first);
  std::sort(lengths.begin(), lengths.end());
  EXPECT_GT(lengths[48], lengths[16] * 5 / 4);
  RunSettings settings;
  settings.output.machine_model = false;
  Device device(capture, {}, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  const FrameResult result = device.render(0);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_NE(result.notes[0].find("sampling.motion_segments_max"), std::string::npos);
  Capture still = capture;
  still.settings.shutter_close = 0;
  EXPECT_LT(psnr(render(capture, {}), render(still, {})), 25.0) << "it is not sharp";
}

TEST(MotionCurves, TimesHoldEveryKeyAndTurnsAreBounded) {  // MCU1 MCU2
  for (const double turns : {0.2, 1.0, 7.0, 40.0}) {
    Capture capture = stage();
    const int node = test::add_node(capture, square(4, white(capture)));
    spin(capture, node, turns);
    zigzag(capture, node, AnimatedPath::kTranslation, {0, 0, 0}, {1, 0, 0}, 5);
    look_flat(capture);
    const scene::Assembly assembly = scene::assemble(capture);
    const auto frame = posed(capture, assembly, {"sampling.motion_segments=1"});
    const auto times = scene::curve_times(*frame, scene::kNone);
    for (const scene::AnimationChannel& channel : capture.animations[0].channels)
      for (const float key : channel.times)
        EXPECT_TRUE(std::ranges::any_of(times, [&](const auto& t) { return t.at == static_cast<double>(key); })) << key;
    for (std::size_t k = 0; k + 1 < times.size(); ++k)
      EXPECT_LE((times[k + 1].at - times[k].at) * turns * 2 * 3.14159265358979, scene::kPieceTurn * 1.001);
  }
}

}  // namespace
}  // namespace tessera::gpu::repeated_motion_test
