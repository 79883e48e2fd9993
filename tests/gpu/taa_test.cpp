// Temporal antialiasing of captures (gpu/taa.cpp, shaders_cpp/taa.cpp, tilecore/resolve/surface_velocities.cpp): the
// filter against its laws, bytes and lookups by closed forms, convergence, reprojection, ghosts, and refusals.
#include "gpu/taa.h"
#include "base/image_metrics.h"
#include "base/parallel.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/frame_stream.h"
#include "gpu/settings.h"
#include "gpu/view_inputs.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/taa.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/tests.h"

namespace tessera::gpu::taa_test {
namespace {

using memory::Traffic;
using memory::Unit;
using scene::Attachment;
using scene::AttachmentFormat;
using scene::DrawFilter;
using scene::Pass;
using scene::PassGraph;
using scene::PassShader;
using scene::StoreAction;
using shaders::TaaImages;
using shaders::TaaSettings;
using test::antialiasing;
using test::attachment;
using test::bursts;
using test::by_way_of;
using test::over_image;
using test::with_graph;
using Keys = std::vector<std::string>;

// ---- The filter --------------------------------------------------------------------------------------------------

Image noise(int width, int height, std::uint32_t seed) {
  test::Random random(seed);
  Image image(width, height, 4);
  for (float& value : image.values) value = random.uniform(0, 1) < 0.1f ? random.uniform(0, 40) : random.uniform(0, 1);
  return image;
}
Image filled(int width, int height, int channels, float value) {
  Image image(width, height, channels);
  std::ranges::fill(image.values, value);
  return image;
}
Vec4 texel(const Image& image, int x, int y) {
  const auto p = image.at(x, y);
  return {p[0], p[1], p[2], p[3]};
}

TEST(TaaFilter, ALookupAtTheMiddleOfATexelIsTheTexel) {  // TAA3
  const Image image = noise(17, 9, 3), plain = filled(17, 9, 4, 0.75f);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 17; ++x) {
      const Vec2 middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      EXPECT_EQ(shaders::taa_lookup(image, middle), texel(image, x, y));
      const Vec4 between = shaders::taa_lookup(plain, middle + Vec2(0.3f, -0.4f));
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(between[c], 0.75f, 1e-6f);
    }
  // The twin: a lookup beside the middle is another colour.
  EXPECT_NE(shaders::taa_lookup(image, {4.6f, 4.5f}), texel(image, 4, 4));
}

// A line of values v(x) = x is a line between its texels, and a parabola stays one: Catmull-Rom is exact for both. The
// five taps leave out the corners, which matter only where the place is between texels along both axes.
TEST(TaaFilter, ALookupAlongAnAxisIsCatmullRom) {
  Image image(16, 16, 4);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      const float v = static_cast<float>(x) + 0.5f;
      image.at(x, y)[0] = v, image.at(x, y)[1] = v * v, image.at(x, y)[2] = static_cast<float>(y) + 0.5f;
    }
  for (float at = 4; at < 12; at += 0.37f) {
    const Vec4 found = shaders::taa_lookup(image, {at, 8.5f});
    EXPECT_NEAR(found.x, at, 1e-4f);
    EXPECT_NEAR(found.y, at * at, 1e-3f);
    EXPECT_NEAR(shaders::taa_lookup(image, {7.5f, at}).z, at, 1e-4f);
  }
}

TEST(TaaFilter, ClippingMovesTowardsTheMiddleOfTheBox) {
  test::Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = random.in_box(1), b = random.in_box(1), low = glm::min(a, b), high = glm::max(a, b),
               color = random.in_box(2), found = shaders::clip_to_box(color, low, high), middle = 0.5f * (low + high);
    const bool inside = glm::all(glm::lessThanEqual(low, color)) && glm::all(glm::lessThanEqual(color, high));
    if (inside) {
      EXPECT_EQ(found, color);
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      EXPECT_GE(found[c], low[c] - 1e-6f);
      EXPECT_LE(found[c], high[c] + 1e-6f);
    }
    EXPECT_LT(glm::length(glm::cross(found - middle, color - middle)), 1e-5f);
    EXPECT_GE(glm::dot(found - middle, color - middle), 0);
  }
  // A box without sides is its point.
  EXPECT_EQ(shaders::clip_to_box({3, 0, 1}, {1, 0, 1}, {1, 0, 1}), Vec3(1, 0, 1));
}

TEST(TaaFilter, AResultLiesAmongTheColorsAround) {  // TAA2
  const Image color = noise(24, 20, 11), history = noise(24, 20, 12), still = filled(24, 20, 2, 0);
  int far = 0;
  for (const bool clips : {true, false})
    for (int y = 1; y < 19; ++y)
      for (int x = 1; x < 23; ++x) {
        Vec3 low(1e9f), high(-1e9f);
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i) {
            const Vec3 c = shaders::to_ycocg(Vec3(texel(color, x + i, y + j)));
            low = glm::min(low, c), high = glm::max(high, c);
          }
        const Vec4 found = shaders::taa_pixel({color, still, nullptr, history}, {0.1f, clips}, x, y);
        const Vec3 mixed = shaders::to_ycocg(Vec3(found));
        bool among = true;
        for (int c = 0; c < 3; ++c) among = among && mixed[c] >= low[c] - 1e-4f && mixed[c] <= high[c] + 1e-4f;
        const bool positive = found.x > 0 && found.y > 0 && found.z > 0;  // the box reaches to negative light
        if (clips) {
          EXPECT_TRUE(among || !positive) << x << " " << y;
        } else {
          far += among ? 0 : 1;
        }
      }
  EXPECT_GT(far, 50) << "the twin without clipping keeps colours that are not around the pixel";
}

TEST(TaaFilter, AShareOfOneAndAPlaceOutsideGiveTheNewColor) {  // TAA1, TAA4
  const Image color = noise(12, 10, 21), history = noise(12, 10, 22), still = filled(12, 10, 2, 0),
              outside = filled(12, 10, 2, 40), unknown = filled(12, 10, 2, std::numeric_limits<float>::infinity());
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 12; ++x) {
      const Vec4 now = texel(color, x, y);
      EXPECT_EQ(shaders::taa_pixel({color, still, nullptr, history}, {1.0f}, x, y), now);
      EXPECT_EQ(shaders::taa_pixel({color, outside, nullptr, history}, {0.1f}, x, y), now);
      EXPECT_EQ(shaders::taa_pixel({color, unknown, nullptr, history}, {0.1f}, x, y), now);
    }
  EXPECT_NE(shaders::taa_pixel({color, still, nullptr, history}, {0.1f}, 5, 5), texel(color, 5, 5));
}

TEST(TaaFilter, ThePixelFollowsTheNearestSurfaceAround) {
  Image velocity = filled(9, 9, 2, 0), depth = filled(9, 9, 1, 10);
  velocity.at(4, 4)[0] = 3, velocity.at(2, 4)[1] = 5;
  depth.at(4, 4)[0] = 2;
  const Image color = noise(9, 9, 31), history = noise(9, 9, 32);
  const TaaImages with{color, velocity, &depth, history}, without{color, velocity, nullptr, history};
  EXPECT_EQ(shaders::nearest_velocity(with, 5, 5), Vec2(3, 0));
  EXPECT_EQ(shaders::nearest_velocity(with, 3, 4), Vec2(3, 0)) << "nearer than the faster one";
  EXPECT_EQ(shaders::nearest_velocity(without, 3, 4), Vec2(0, 5)) << "without depths the longest";
  EXPECT_EQ(shaders::nearest_velocity(with, 0, 0), Vec2(0, 0));
}

// A bright card passes over a dark wall, two pixels a frame. Where it has gone the history is wrong.
TEST(TaaFilter, ClippingRemovesGhosts) {
  constexpr int kWidth = 64, kHeight = 16, kFrames = 12;
  const auto left = [](int frame) { return 4 + 2 * frame; };
  const auto card = [&](int frame, int x) { return x >= left(frame) && x < left(frame) + 12; };
  const auto error = [&](bool clips) {
    Image history;
    double sum = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      Image color(kWidth, kHeight, 4), velocity(kWidth, kHeight, 2);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          for (std::size_t c = 0; c < 4; ++c)
            color.at(x, y)[c] = card(frame, x) ? 2.0f : 0.1f + 0.01f * static_cast<float>(x % 3);
          velocity.at(x, y)[0] = card(frame, x) ? 2 : 0;
        }
      if (frame == 0) {
        history = color;
        continue;
      }
      Image next(kWidth, kHeight, 4);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Vec4 pixel = shaders::taa_pixel({color, velocity, nullptr, history}, {0.1f, clips}, x, y);
          for (std::size_t c = 0; c < 4; ++c) next.at(x, y)[c] = pixel[static_cast<int>(c)];
        }
      history = next;
      if (frame == kFrames - 1)
        for (int x = 0; x < kWidth; ++x)
          sum += std::abs(static_cast<double>(history.at(x, 8)[0]) - static_cast<double>(color.at(x, 8)[0]));
    }
    return sum;
  };
  EXPECT_LT(error(true), 0.5);
  EXPECT_GT(error(false), 8 * error(true)) << "the twin without clipping leaves ghosts";
}

TEST(TaaJitter, IsBalancedAndStaysInItsPixel) {
  double sum_x = 0, sum_y = 0;
  std::set<std::array<float, 2>> places;
  for (int frame = 0; frame < kJitteredFrames; ++frame) {
    const std::array<float, 2> jitter = taa_jitter(frame);
    EXPECT_EQ(jitter, taa_jitter(frame + 5 * kJitteredFrames));
    sum_x += static_cast<double>(jitter[0]), sum_y += static_cast<double>(jitter[1]);
    places.insert(jitter);
    for (const int samples : {1, 2, 3, 4, 16, 64}) {
      tilecore::SamplingSettings settings;
      settings.samples_per_pixel = samples;
      const tilecore::SamplePattern plain(settings);
      settings.jitter_x = jitter[0], settings.jitter_y = jitter[1];
      const tilecore::SamplePattern moved(settings);
      for (int s = 0; s < samples; ++s) {
        const auto was = plain.offset(s), is = moved.offset(s);
        for (const auto& [from, to, by] : {std::array{was.x, is.x, jitter[0]}, {was.y, is.y, jitter[1]}}) {
          EXPECT_GE(to, 1.0f / 256);
          EXPECT_LT(to, 1.0f);
          EXPECT_EQ(std::round(256 * to), 256 * to);
          const float off = to - from - by;
          EXPECT_NEAR(off, std::round(off), 1.0f / 256 + 1e-6f);
        }
      }
    }
  }
  EXPECT_EQ(sum_x, 0);
  EXPECT_EQ(sum_y, 0);
  EXPECT_EQ(places.size(), static_cast<std::size_t>(kJitteredFrames));
}

// ---- Frames ------------------------------------------------------------------------------------------------------

struct Size {
  int width, height;
};
constexpr Size kSize{96, 64};

// Slanted cards before a wall; `camera` moves by so much in the first second, and `card` the middle card.
scene::Capture cards(const DVec3& camera_way = {}, const DVec3& card_way = {}) {
  scene::Capture capture;
  scene::Material bright, dark, wall;
  bright.emissive = Vec3(0.9f, 0.5f, 0.2f), bright.base_color = Vec4(0, 0, 0, 1);
  dark.base_color = Vec4(0.03f, 0.02f, 0.05f, 1), wall.base_color = Vec4(0.3f, 0.4f, 0.5f, 1);
  for (scene::Material* m : {&bright, &dark, &wall}) m->metallic = 0, m->roughness = 0.9f;
  const int light = test::add_material(capture, bright), black = test::add_material(capture, dark);
  test::add_node(capture, test::patches(test::flat_patch({-9, -6, -1}, {18, 0, 0}, {0, 12, 0}),
                                        test::add_material(capture, wall)));
  for (int i = 0; i < 7; ++i) {
    const double x = 1.1 * (i - 3);
    const int node = test::add_node(
        capture,
        test::patches(test::flat_patch({-0.25, -1.2, 0}, {0.5, 0.13, 0}, {0.37, 2.3, 0}), i % 2 == 0 ? light : black),
        DVec3(x, 0.1 * x, 0.2 * i));
    if (i == 3 && card_way != DVec3(0.0)) test::add_motion(capture, node, card_way);
  }
  capture.settings.environment = 0.5f;
  capture.settings.frame_rate = 30;
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 3, camera.y_mag = 2;
  const int eye = test::add_camera(capture, {0, 0, 7}, camera);
  if (camera_way != DVec3(0.0)) test::add_motion(capture, eye, camera_way);
  return capture;
}

struct Machine {
  RunSettings settings;
  GpuConfiguration gpu;

  explicit Machine(const Keys& keys) {
    for (const char* key : {"sampling.samples_per_pixel=1", "frame_buffer.compression=none"})
      apply_setting(key, settings, gpu);
    for (const std::string& key : keys) apply_setting(key, settings, gpu);
  }
};

std::vector<FrameResult> frames_of(const scene::Capture& capture, std::vector<int> numbers, const Keys& keys = {},
                                   Size size = kSize) {
  const Machine machine(keys);
  Device device(capture, machine.gpu, machine.settings, {size.width, size.height, {0, 0, size.width, size.height}});
  std::vector<FrameResult> frames;
  for (const int frame : numbers) frames.push_back(device.render(frame));
  return frames;
}
std::vector<int> first(int count) {
  std::vector<int> numbers(static_cast<std::size_t>(count));
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

// Displayed values between 0 and 1.
Image shown(const Image& color) {
  const Image8 display = shaders::to_display(color, 1);
  Image out(color.width, color.height, 3);
  for (int y = 0; y < color.height; ++y)
    for (int x = 0; x < color.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) out.at(x, y)[c] = static_cast<float>(display.at(x, y)[c]) / 255;
  return out;
}
// 64 samples of a frame, shaded each on its own.
Image converged(const scene::Capture& capture, int frame) {
  return shown(frames_of(with_graph(capture, {}), {frame}, {"sampling.samples_per_pixel=64", "shading.rate=sample"})[0]
                   .targets.color);
}

Traffic attachments(const FrameCounters& counters) {
  Traffic sum;
  for (std::size_t unit = 0; unit < memory::kUnitCount; ++unit) {
    const Traffic one = counters.ledger.traffic(static_cast<Unit>(unit), memory::Purpose::kAttachment);
    sum.read_bytes += one.read_bytes, sum.written_bytes += one.written_bytes;
  }
  return sum;
}

TEST(Taa, BytesAndLookupsAreClosedForms) {  // TAP1
  for (const Size size : {kSize, {101, 67}})
    for (const bool depths : {true, false})
      for (const char* samples : {"sampling.samples_per_pixel=1", "sampling.samples_per_pixel=4"}) {
        const std::vector<FrameResult> frames =
            frames_of(with_graph(cards(), antialiasing(depths)), {3, 4, 5}, {samples}, size);
        const std::uint64_t pixels = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height),
                            colors = bursts(8 * pixels), fours = bursts(4 * pixels);
        for (std::size_t f = 0; f < 3; ++f) {
          const tilecore::ImagePassCounters& c = frames[f].counters.post;
          EXPECT_EQ(c.texels, pixels);
          EXPECT_EQ(c.lookups, pixels * (f == 0 ? 1 : 9 + 9 + 5 + (depths ? 1 : 0)));
          const Traffic moved = attachments(frames[f].counters);
          EXPECT_EQ(moved.written_bytes, 2 * colors + fours + (depths ? fours : 0));
          EXPECT_EQ(moved.read_bytes, 2 * colors + (f == 0 ? 0 : colors + fours + (depths ? fours : 0)));
          ASSERT_EQ(frames[f].passes.size(), 3u);
          EXPECT_EQ(frames[f].passes[1].name, "taa");
          EXPECT_EQ(attachments(frames[f].passes[1].counters).written_bytes, colors);
          EXPECT_EQ(attachments(frames[f].passes[0].counters).written_bytes, colors + fours + (depths ? fours : 0));
        }
      }
}

TEST(Taa, TakesTimeAndEnergyInWarpsThatAreCounted) {
  const std::vector<FrameResult> frames = frames_of(with_graph(cards(), antialiasing()), {0, 1}),
                                 plain = frames_of(with_graph(cards(), by_way_of(AttachmentFormat::kRgba16F)), {0, 1});
  for (std::size_t f = 0; f < 2; ++f) {
    EXPECT_GT(frames[f].model->timing.cycles, plain[f].model->timing.cycles);
    EXPECT_GT(frames[f].model->energy.total_nj(), plain[f].model->energy.total_nj());
  }
  EXPECT_GT(frames[1].model->timing.cycles, frames[0].model->timing.cycles);
  std::uint64_t lanes = 0, lookups = 0;
  for (const timing::WorkRound& round : frames[1].model->record.work.rounds)
    for (const timing::TileItems& items : round.items)
      for (const timing::WarpItem& warp : items.warps)
        if (warp.kind == timing::WarpItem::kImage) lanes += warp.lanes, lookups += warp.texels;
  EXPECT_EQ(lanes, frames[1].counters.post.texels);
  EXPECT_EQ(lookups, frames[1].counters.post.lookups);
}

// The places of eight frames are the samples of one image; the history gathers their mean.
TEST(Taa, AStillSceneConverges) {
  const Image truth = converged(cards(), 0);
  const std::vector<FrameResult> frames = frames_of(with_graph(cards(), antialiasing()), first(16)),
                                 jittered = frames_of(with_graph(cards(), antialiasing()), first(8), {"post.taa=1"});
  const auto db = [&](std::size_t f) { return psnr(shown(frames[f].targets.color), truth); };
  EXPECT_GT(db(1), db(0) + 1);
  EXPECT_GT(db(3), db(1) + 1);
  EXPECT_GT(db(7), db(3));
  EXPECT_GT(db(7), db(0) + 6);
  EXPECT_GT(db(15), db(0) + 6);
  Image mean = jittered[0].targets.color;
  for (std::size_t i = 0; i < mean.values.size(); ++i) {
    float sum = 0;
    for (const FrameResult& frame : jittered) sum += frame.targets.color.values[i];
    mean.values[i] = sum / 8;
  }
  EXPECT_GT(psnr(shown(mean), truth), db(0) + 8);
  EXPECT_GT(psnr(shown(frames[7].targets.color), shown(mean)), 32);
  // The twin: a mean of unjittered frames is as coarse as one of them.
  const Image plain =
      shown(frames_of(with_graph(cards(), by_way_of(AttachmentFormat::kRgba16F)), {0})[0].targets.color);
  EXPECT_LT(psnr(plain, truth), db(7) - 6);
}

// The camera passes the cards; the image has less error than without the history.
TEST(Taa, AMovingCameraKeepsTheGain) {                 // SV3
  const scene::Capture moving = cards({4.1, 1.3, 0});  // 2.2 and 0.7 pixels a frame
  const int last = 11;
  const Image truth = converged(moving, last);
  for (const bool depths : {true, false}) {
    const Image with_history =
                    shown(frames_of(with_graph(moving, antialiasing(depths)), first(last + 1)).back().targets.color),
                without = shown(
                    frames_of(with_graph(moving, by_way_of(AttachmentFormat::kRgba16F)), {last})[0].targets.color);
    EXPECT_GT(psnr(with_history, truth), psnr(without, truth) + 3) << depths;
  }
  // The twin: a history that is not reprojected is worse than none, though it is clipped.
  const std::vector<FrameResult> jittered =
      frames_of(with_graph(moving, antialiasing()), first(last + 1), {"post.taa=1"});
  Image history = jittered[0].targets.color;
  const Image still = filled(kSize.width, kSize.height, 2, 0);
  for (std::size_t f = 1; f < jittered.size(); ++f) {
    Image next = history;
    for (int y = 0; y < kSize.height; ++y)
      for (int x = 0; x < kSize.width; ++x) {
        const Vec4 pixel = shaders::taa_pixel({jittered[f].targets.color, still, nullptr, history}, {0.1f, true}, x, y);
        for (std::size_t c = 0; c < 4; ++c) next.at(x, y)[c] = pixel[static_cast<int>(c)];
      }
    history = next;
  }
  const Image right = shown(frames_of(with_graph(moving, antialiasing()), first(last + 1)).back().targets.color);
  EXPECT_LT(psnr(shown(history), truth), psnr(right, truth) - 3);
}

TEST(Taa, AMovingCardLeavesLittleBehind) {
  const scene::Capture moving = cards({}, {0.4, 4, 0});  // clear of the other cards
  const int last = 9;
  const Image truth = converged(moving, last);
  const Image with_history = shown(frames_of(with_graph(moving, antialiasing()), first(last + 1)).back().targets.color),
              without =
                  shown(frames_of(with_graph(moving, by_way_of(AttachmentFormat::kRgba16F)), {last})[0].targets.color);
  EXPECT_GT(psnr(with_history, truth), psnr(without, truth) + 1.5);
}

// A point at an infinite distance moves by the camera's turn alone: f tan(angle) at the middle of the image.
TEST(Taa, TheBackgroundTurnsWithTheCamera) {  // SV2
  scene::Capture capture = cards();
  capture.cameras[0] = {};
  const int eye = test::add_camera(capture, {0, 0, 0});
  capture.settings.camera_node = eye;
  test::add_turn(capture, eye, {0, 1, 0}, 0.6f);
  const scene::Assembly assembly = scene::assemble(capture);
  const auto pose = [&](int frame) {
    const Machine machine({});
    return scene::pose_frame(assembly, scene::choose_camera(capture, 96, 64),
                             frame_request(capture, machine.gpu, machine.settings, 96, 64, frame));
  };
  const auto then = pose(4), now = pose(5);
  const tilecore::MotionField motion(*now, *then);
  tilecore::VelocityAttachment velocities;
  velocities.begin({0, 0, 96, 64}, *now, then.get(), &motion);
  EXPECT_TRUE(velocities.background_turns());
  const Vec2 found = velocities.background({48, 32});
  // Quaternions are interpolated along the great circle: the angle is the same every frame.
  EXPECT_NEAR(std::abs(found.x), now->projection.scale * std::tan(0.6 / 30), 1e-3);
  EXPECT_NEAR(found.y, 0, 1e-4);
  velocities.begin({0, 0, 96, 64}, *now, nullptr, nullptr);
  EXPECT_FALSE(std::isfinite(velocities.background({48, 32}).x));
  const tilecore::MotionField none(*now, *now);
  velocities.begin({0, 0, 96, 64}, *now, now.get(), &none);
  EXPECT_EQ(velocities.background({48, 32}), Vec2(0.0f));
}

// With half of the pixels' velocities wrong by rounding the still frames would blur: a still pixel keeps its bits.
TEST(Taa, NothingMovesWhereNothingMoves) {  // SV1
  scene::Capture plain = cards();
  plain.nodes.clear(), plain.roots.clear();
  scene::Camera camera;
  test::add_camera(plain, {0, 0, 7}, camera);
  plain.settings.background = Vec3(0.25f, 0.5f, 0.75f);
  const std::vector<FrameResult> frames = frames_of(with_graph(plain, antialiasing()), first(4));
  for (std::size_t f = 1; f < 4; ++f) EXPECT_EQ(frames[f].targets.color.values, frames[0].targets.color.values);
}

TEST(Taa, WithoutThePassAFrameIsTheSame) {  // TAP3
  const std::vector<FrameResult> off = frames_of(with_graph(cards(), antialiasing()), {0, 1}, {"post.taa=0"}),
                                 plain = frames_of(with_graph(cards(), by_way_of(AttachmentFormat::kRgba16F)), {0, 1});
  for (std::size_t f = 0; f < 2; ++f) {
    EXPECT_EQ(off[f].targets.color.values, plain[f].targets.color.values);
    EXPECT_EQ(counter_values(off[f].counters), counter_values(plain[f].counters));
    EXPECT_EQ(off[f].counters.ledger.total().read_bytes, plain[f].counters.ledger.total().read_bytes);
    EXPECT_EQ(off[f].counters.ledger.total().written_bytes, plain[f].counters.ledger.total().written_bytes);
    EXPECT_EQ(off[f].model->timing.cycles, plain[f].model->timing.cycles);
    EXPECT_EQ(off[f].passes.size(), 2u);
  }
  const std::vector<FrameResult> on = frames_of(with_graph(cards(), antialiasing()), {0, 1});
  EXPECT_NE(on[1].targets.color.values, plain[1].targets.color.values);
}

TEST(Taa, AGapOrACutBeginsAgain) {  // TAP2
  const scene::Capture capture = with_graph(cards({0.9, 0, 0}), antialiasing());
  const std::vector<FrameResult> gap = frames_of(capture, {0, 1, 6, 7}), fresh = frames_of(capture, {6, 7});
  EXPECT_EQ(gap[2].targets.color.values, fresh[0].targets.color.values);
  EXPECT_EQ(gap[3].targets.color.values, fresh[1].targets.color.values);
  EXPECT_NE(frames_of(capture, {5, 6, 7})[2].targets.color.values, fresh[1].targets.color.values);
  // 133 pixels a frame: every frame is a cut.
  const scene::Capture jumps = with_graph(cards({250, 0, 0}), antialiasing());
  const std::vector<FrameResult> cut = frames_of(jumps, {0, 1}), after = frames_of(jumps, {1});
  EXPECT_EQ(cut[1].targets.color.values, after[0].targets.color.values);
  EXPECT_EQ(cut[1].counters.post.lookups, after[0].counters.post.lookups);
  // Another size is another device.
  EXPECT_EQ(frames_of(capture, {7}, {}, {48, 32})[0].counters.post.lookups, 48u * 32);
}

TEST(Taa, DoesNotHangOnTilesBuffersAndThreads) {
  const scene::Capture capture = with_graph(cards({1.1, 0.4, 0}, {2, 0, 0}), antialiasing());
  const std::vector<FrameResult> expected = frames_of(capture, first(3));
  for (const Keys& keys :
       {Keys{"tile.width=8", "tile.height=8"}, Keys{"parameter_buffer.bytes=2048"},
        Keys{"frame_buffer.transaction_elimination=true"}, Keys{"machine.overlap=passes"}, Keys{"shading.path=prepass"},
        Keys{"shading.path=gbuffer"}, Keys{"frontend.previous_depth_culling=true"}})
    EXPECT_EQ(frames_of(capture, first(3), keys)[2].targets.color.values, expected[2].targets.color.values) << keys[0];
  std::vector<FrameResult> alone;
  with_threads(1, [&] { alone = frames_of(capture, first(3)); });
  EXPECT_EQ(alone[2].targets.color.values, expected[2].targets.color.values);
  EXPECT_EQ(counter_values(alone[2].counters), counter_values(expected[2].counters));
  EXPECT_EQ(alone[2].model->timing.cycles, expected[2].model->timing.cycles);
  // Frames that depend on each other are not rendered at once.
  const Machine machine({}), off({"post.taa=0"});
  const RenderRequest request{kSize.width, kSize.height, {0, 0, kSize.width, kSize.height}};
  EXPECT_FALSE(frames_are_independent(capture, machine.gpu, machine.settings, request));
  EXPECT_TRUE(frames_are_independent(capture, off.gpu, off.settings, request));
}

// Both eyes have a history of their own.
TEST(Taa, EyesKeepTheirHistoriesApart) {
  const scene::Capture capture = with_graph(cards({1.1, 0.4, 0}), antialiasing());
  const std::vector<FrameResult> one = frames_of(capture, first(3)),
                                 two = frames_of(capture, first(3), {"stereo.eye_separation=0.4"});
  EXPECT_EQ(two[2].targets.color.values, one[2].targets.color.values);
  scene::Capture other = cards({1.1, 0.4, 0});
  for (scene::Node& node : other.nodes)
    if (node.camera != scene::kNone) node.transform.translation.x += 0.4;
  for (scene::Animation& animation : other.animations)
    for (scene::AnimationChannel& channel : animation.channels)
      for (std::size_t i = 0; i < channel.values.size(); i += 3) channel.values[i] += 0.4f;
  const std::vector<FrameResult> right = frames_of(with_graph(other, antialiasing()), first(3));
  EXPECT_GT(psnr(shown(two[2].right->targets.color), shown(right[2].targets.color)), 45);
}

TEST(Taa, BloomAndToneMapReadTheHistory) {
  PassGraph graph = antialiasing();
  graph.attachments.push_back(attachment("glow", AttachmentFormat::kR11G11B10F));
  graph.attachments.back().scale = 0.5, graph.attachments.back().levels = 3;
  graph.passes.insert(graph.passes.begin() + 2, over_image("bloom", PassShader::kBloom, {"history"}, "glow"));
  graph.passes[3] = over_image("final", PassShader::kTonemap, {"history", "glow"}, "frame");
  const std::vector<FrameResult> both = frames_of(with_graph(cards(), graph), first(3)),
                                 one = frames_of(with_graph(cards(), antialiasing()), first(3)),
                                 none = frames_of(with_graph(cards(), graph), first(3), {"post.bloom=0"});
  EXPECT_EQ(none[2].targets.color.values, one[2].targets.color.values);
  EXPECT_NE(both[2].targets.color.values, one[2].targets.color.values);
  EXPECT_EQ(both[2].passes[1].name, "taa");
  EXPECT_EQ(both[2].passes[2].name, "bloom down 0");
}

// A G-buffer on chip, or depths first, with velocities beside the colours.
TEST(Taa, AntialiasesEveryPathThatACaptureNames) {
  PassGraph gbuffer = antialiasing(), prepass = antialiasing();
  for (const char* name : {"a", "b"}) gbuffer.attachments.push_back(attachment(name, AttachmentFormat::kRgba16F));
  Pass& draw = gbuffer.passes[0];
  draw.lists_subpasses = true;
  draw.subpasses = {{DrawFilter::kAll, PassShader::kGbuffer, {}, {"a", "b", "velocity"}, {}},
                    {DrawFilter::kNothing, PassShader::kLight, {"a", "b", "depth"}, {"lit"}, {}}};
  Pass depths;
  depths.name = "depths";
  depths.subpasses = {{DrawFilter::kAll, PassShader::kDepth, {}, {}, {}}};
  prepass.passes[0].load = {{"depth", scene::LoadAction::kLoad}};
  prepass.passes.insert(prepass.passes.begin(), depths);
  const scene::Capture moving = cards({0.3, 0, 0});
  for (const auto& [graph, path] : {std::pair{gbuffer, "shading.path=gbuffer"}, {prepass, "shading.path=prepass"}}) {
    const FrameResult
        named = std::move(frames_of(with_graph(moving, graph), first(3)).back()),
        chosen =
            std::move(frames_of(with_graph(moving, antialiasing()), first(3), {"gbuffer.layout=packed", path}).back());
    EXPECT_EQ(named.targets.color.values, chosen.targets.color.values) << path;
    EXPECT_EQ(attachments(named.counters).written_bytes, attachments(chosen.counters).written_bytes) << path;
    EXPECT_EQ(named.model->timing.cycles, chosen.model->timing.cycles) << path;
  }
}

// ---- Refusals ----------------------------------------------------------------------------------------------------

struct Refused {
  const char* name;
  std::function<void(PassGraph&)> change;
  const char* says;
};

const std::vector<Refused> kRefused = {
    {"NoVelocity",
     [](PassGraph& g) {
       g.passes[0].subpasses[0].write = {"lit"}, g.passes[1].subpasses[0].sample = {"lit", "history"};
     },
     "/passes/1/sample: has no velocities: an attachment with rg16f that the pass that draws writes"},
    {"NoColors",
     [](PassGraph& g) {
       g.passes[1].subpasses[0].sample = {"velocity", "history"};
     },
     "/passes/1/sample: is not 'lit', where the pass before left its colours"},
    {"AnotherTarget",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("more", AttachmentFormat::kRgba16F));
       g.passes[1].subpasses[0].write = {"more"}, g.passes[2].subpasses[0].sample = {"more"};
       g.passes.push_back(over_image("keep", PassShader::kCopy, {"more"}, "history"));
     },
     "/passes/1/write: is 'more', which is not the history that the pass samples"},
    {"Format", [](PassGraph& g) { g.attachments[2].format = AttachmentFormat::kRgba8; },
     "/passes/1/write: is 'history' with rgba8: a history is rgba16f"},
    {"Size", [](PassGraph& g) { g.attachments[2].scale = 0.5; },
     "/passes/1/write: is 'history', which has another size than the frame"},
    {"Twice",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("second", AttachmentFormat::kRgba16F));
       g.attachments.back().life = scene::AttachmentLife::kPersistent;
       g.passes.insert(g.passes.begin() + 2,
                       over_image("again", PassShader::kTaa, {"history", "velocity", "second"}, "second"));
       g.passes[3].subpasses[0].sample = {"second"};
     },
     "/passes/2: is a second temporal antialiasing: this machine runs one"},
    {"BehindACopy",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("more", AttachmentFormat::kRgba16F));
       g.passes.insert(g.passes.begin() + 1, over_image("copy", PassShader::kCopy, {"lit"}, "more"));
       g.passes[2].subpasses[0].sample = {"more", "velocity", "history"};
     },
     "/passes/2: runs behind a copy: this machine antialiases the colours of the pass that draws"},
    {"BehindABloom",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("glow", AttachmentFormat::kRgba16F));
       g.passes.insert(g.passes.begin() + 1, over_image("bloom", PassShader::kBloom, {"lit"}, "glow"));
     },
     "/passes/2: runs behind a bloom: this machine antialiases the colours of the pass that draws"},
    {"Samples",
     [](PassGraph& g) {
       g.passes[0].store = {{"lit", StoreAction::kStore}};
     },
     "/passes/1/sample: is 'lit', which keeps 4 samples a pixel: temporal antialiasing reads resolved colours"},
    {"VelocitiesOfSamples",
     [](PassGraph& g) {
       g.passes[0].store = {{"velocity", StoreAction::kStore}};
     },
     "/passes/0/store/velocity: keeps the velocities of 4 samples a pixel: a pixel has one"},
    {"DepthsOfSamples",
     [](PassGraph& g) {
       g.passes[0].store = {{"depth", StoreAction::kStore}};
     },
     "/passes/0/store/depth: keeps the depths of 4 samples a pixel: temporal antialiasing reads one"},
    {"LoadedVelocities",
     [](PassGraph& g) {
       g.passes[0].load = {{"velocity", scene::LoadAction::kLoad}};
     },
     "/passes/0/load/velocity: loads velocities, which the pass writes in every pixel"},
    {"VelocitiesThatNobodyReads",
     [](PassGraph& g) {
       g.attachments.push_back(attachment("more", AttachmentFormat::kRg16F)),
           g.passes[0].subpasses[0].write.push_back("more");
     },
     "/passes/0/write: are several colours: this machine renders one"},
    {"Override",
     [](PassGraph& g) {
       g.passes[1].load = {{"history", scene::LoadAction::kLoad}};
     },
     "/passes/1: overrides the loads and stores of temporal antialiasing"},
};

class RefusedTaa : public testing::TestWithParam<Refused> {};

TEST_P(RefusedTaa, IsOneLineWithItsPlace) {
  scene::Capture capture = cards();
  capture.file = "some.glb";
  capture.settings.graph = antialiasing();
  GetParam().change(*capture.settings.graph);
  const std::optional<scene::GraphFault> fault = find_fault(*capture.settings.graph);
  ASSERT_FALSE(fault) << fault->pointer << " " << fault->text;
  const Machine machine({"sampling.samples_per_pixel=4"});
  try {
    const FrameGraph graph(capture, machine.gpu, machine.settings, {0, 0, 96, 64}, {96, 64});
    FAIL() << "not refused";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_THAT(text, testing::StartsWith(std::string("some.glb: /extensions/TESSERA_capture") + GetParam().says));
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}
INSTANTIATE_TEST_SUITE_P(All, RefusedTaa, testing::ValuesIn(kRefused),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(Taa, SettingsThatDoNotFitAreRefused) {
  const scene::Capture capture = with_graph(cards(), antialiasing());
  const auto refusal = [&](const Keys& keys, IntRect region = {0, 0, 96, 64}) {
    const Machine machine(keys);
    try {
      const FrameGraph graph(capture, machine.gpu, machine.settings, region, {96, 64});
    } catch (const UsageError& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos);
      return text;
    }
    return std::string("none");
  };
  EXPECT_THAT(refusal({}, {0, 0, 32, 32}), HasSubstr("a region of the frame"));
  EXPECT_THAT(refusal({"tile.rendering_elimination=true"}), HasSubstr("tile.rendering_elimination=false"));
  EXPECT_THAT(refusal({"shading.path=gbuffer_external"}), HasSubstr("shading.path=gbuffer_external"));
  EXPECT_THAT(refusal({"resolve.desampling=adaptive"}), HasSubstr("resolve.desampling=off"));
  EXPECT_EQ(refusal({}), "none");
  EXPECT_EQ(refusal({"post.taa=0"}, {0, 0, 32, 32}), "none");
  EXPECT_EQ(refusal({"post.taa=0", "tile.rendering_elimination=true"}), "none");
  EXPECT_EQ(refusal({"post.taa=0", "shading.path=gbuffer_external"}), "none");
}

// A file's graph is the graph of the tests above, and renders as it does.
TEST(Taa, ReadsItsPassesFromAFile) {
  test::GltfAsset asset;
  const std::vector<float> corners = {-1, -0.7f, 0, 1, -0.5f, 0, 0.2f, 0.9f, 0};
  const int positions = asset.add_accessor("VEC3", corners, {{"min", {-1, -0.7, 0}}, {"max", {1, 0.9, 0}}});
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.add("scenes", {{"nodes", {0}}});
  asset.document["scene"] = 0;
  asset.document["extensionsUsed"] = {"TESSERA_capture"};
  const json passes = json::parse(R"({
    "attachments": {"lit": {"format": "rgba16f"}, "velocity": {"format": "rg16f"},
                    "history": {"format": "rgba16f", "life": "persistent"}},
    "passes": [{"name": "draw", "draw": "all", "shader": "forward", "write": ["lit", "velocity"]},
               {"name": "taa", "shader": "taa", "sample": ["lit", "velocity", "history", "depth"], "write": ["history"]},
               {"name": "final", "shader": "copy", "sample": ["history"], "write": ["frame"]}]})");
  asset.document["extensions"]["TESSERA_capture"] = passes;
  const test::TemporaryFolder folder;
  test::write_text(folder / "read.gltf", asset.gltf());
  const scene::Capture read = scene::read_capture(folder / "read.gltf");
  scene::Capture made = read;
  made.settings.graph = antialiasing();
  EXPECT_EQ(frames_of(read, first(3))[2].targets.color.values, frames_of(made, first(3))[2].targets.color.values);
  asset.document["extensions"]["TESSERA_capture"]["passes"][1]["sample"] = {"lit", "velocity"};
  test::write_text(folder / "fault.gltf", asset.gltf());
  try {
    scene::read_capture(folder / "fault.gltf");
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/extensions/TESSERA_capture/passes/1/shader: is taa, which needs a persistent "
                                        "attachment to sample: its history"));
  }
}

}  // namespace
}  // namespace tessera::gpu::taa_test
