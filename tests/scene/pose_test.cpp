#include "scene/pose.h"
#include "tests/support/tests.h"

namespace tessera::scene::pose_test {
namespace {

AnimationChannel channel_of(Interpolation interpolation, int components, std::vector<float> times,
                            std::vector<float> values) {
  AnimationChannel channel;
  channel.interpolation = interpolation;
  channel.components = components;
  channel.times = std::move(times);
  channel.values = std::move(values);
  return channel;
}

std::vector<float> random_values(test::Random& random, std::size_t count) {
  std::vector<float> out(count);
  for (float& v : out) v = random.uniform(-2, 2);
  return out;
}

const std::vector<float> kTimes = {0.5f, 1.0f, 1.25f, 4.0f};

// Key before `time` and the fraction of its span that has passed.
std::pair<std::size_t, double> span_at(double time) {
  std::size_t key = 0;
  while (key + 2 < kTimes.size() && time >= static_cast<double>(kTimes[key + 1])) ++key;
  const double begin = static_cast<double>(kTimes[key]);
  return {key, (time - begin) / (static_cast<double>(kTimes[key + 1]) - begin)};
}

TEST(AnimationChannels, HoldTheFirstAndTheLastKeyOutsideTheirTimes) {
  test::Random random(1);
  for (const Interpolation interpolation :
       {Interpolation::kStep, Interpolation::kLinear, Interpolation::kCubicSpline}) {
    const std::size_t parts = interpolation == Interpolation::kCubicSpline ? 3 : 1;
    const auto values = random_values(random, 2 * parts * kTimes.size());
    const AnimationChannel channel = channel_of(interpolation, 2, kTimes, values);
    const std::size_t first = 2 * (parts / 2), last = 2 * (parts * (kTimes.size() - 1) + parts / 2);
    for (const double time : {-100.0, 0.0, 0.499, 0.5})
      EXPECT_EQ(evaluate_channel(channel, time), std::vector<double>(&values[first], &values[first] + 2));
    for (const double time : {4.0, 4.001, 1e9})
      EXPECT_EQ(evaluate_channel(channel, time), std::vector<double>(&values[last], &values[last] + 2));
  }
}

TEST(AnimationChannels, MeetEveryKeyExactly) {
  test::Random random(2);
  for (const Interpolation interpolation :
       {Interpolation::kStep, Interpolation::kLinear, Interpolation::kCubicSpline}) {
    const std::size_t parts = interpolation == Interpolation::kCubicSpline ? 3 : 1;
    const auto values = random_values(random, 3 * parts * kTimes.size());
    const AnimationChannel channel = channel_of(interpolation, 3, kTimes, values);
    for (std::size_t key = 0; key < kTimes.size(); ++key) {
      const float* at = &values[3 * (parts * key + parts / 2)];
      EXPECT_EQ(evaluate_channel(channel, static_cast<double>(kTimes[key])), std::vector<double>(at, at + 3));
    }
  }
}

TEST(AnimationChannels, StepKeepsTheKeyUntilTheNext) {
  const AnimationChannel channel = channel_of(Interpolation::kStep, 1, kTimes, {1, 2, 3, 4});
  for (double time = 0.5; time < 4; time += 0.01)
    EXPECT_EQ(evaluate_channel(channel, time)[0], static_cast<double>(span_at(time).first + 1)) << time;
}

TEST(AnimationChannels, SwitchAtTheKeyNotAtItsNearestFloat) {
  const float key = 16777216.0f;  // floats are 2 apart here
  const AnimationChannel channel = channel_of(Interpolation::kStep, 1, {0, key}, {1, 2});
  EXPECT_EQ(evaluate_channel(channel, static_cast<double>(key) - 0.25)[0], 1.0);
  EXPECT_EQ(evaluate_channel(channel, static_cast<double>(key))[0], 2.0);
}

TEST(AnimationChannels, LinearIsTheWeightedMeanOfItsNeighbours) {
  test::Random random(3);
  const auto values = random_values(random, 3 * kTimes.size());
  const AnimationChannel channel = channel_of(Interpolation::kLinear, 3, kTimes, values);
  for (double time = 0.5; time < 4; time += 0.037) {
    const auto [key, s] = span_at(time);
    const std::vector<double> got = evaluate_channel(channel, time);
    for (std::size_t c = 0; c < 3; ++c) {
      const double a = static_cast<double>(values[3 * key + c]), b = static_cast<double>(values[3 * key + 3 + c]);
      EXPECT_NEAR(got[c], a + s * (b - a), 1e-12);
    }
  }
}

// glTF 2.0 appendix C.4, written as the cubic Bezier with the same end points and end derivatives.
double spline(double a, double out_tangent, double in_tangent, double b, double span, double s) {
  const double p[4] = {a, a + span * out_tangent / 3, b - span * in_tangent / 3, b}, r = 1 - s;
  return r * r * r * p[0] + 3 * r * r * s * p[1] + 3 * r * s * s * p[2] + s * s * s * p[3];
}

TEST(AnimationChannels, CubicSplineIsTheHermiteCurveOfValuesAndScaledTangents) {
  test::Random random(4);
  const auto values = random_values(random, 2 * 3 * kTimes.size());
  const AnimationChannel channel = channel_of(Interpolation::kCubicSpline, 2, kTimes, values);
  const auto part = [&](std::size_t key, std::size_t which, std::size_t c) {
    return static_cast<double>(values[2 * (3 * key + which) + c]);
  };
  for (double time = 0.5; time < 4; time += 0.037) {
    const auto [key, s] = span_at(time);
    const double span = static_cast<double>(kTimes[key + 1]) - static_cast<double>(kTimes[key]);
    const std::vector<double> got = evaluate_channel(channel, time);
    for (std::size_t c = 0; c < 2; ++c)
      EXPECT_NEAR(got[c], spline(part(key, 1, c), part(key, 2, c), part(key + 1, 0, c), part(key + 1, 1, c), span, s),
                  1e-12);
  }
}

std::vector<float> about_z(double angle, float sign = 1.0f) {
  return {0, 0, sign * static_cast<float>(std::sin(angle / 2)), sign * static_cast<float>(std::cos(angle / 2))};
}

TEST(AnimationChannels, RotationTurnsEvenlyTheShortWay) {
  // From 10 to 150 degrees; the second quaternion is given with either sign, which is the same rotation.
  const double from = std::numbers::pi / 18, to = 15 * from;
  for (const float sign : {1.0f, -1.0f}) {
    std::vector<float> values = about_z(from);
    const std::vector<float> end = about_z(to, sign);
    values.insert(values.end(), end.begin(), end.end());
    AnimationChannel channel = channel_of(Interpolation::kLinear, 4, {0, 1}, values);
    channel.path = AnimatedPath::kRotation;
    for (double s = 0.0625; s < 1; s += 0.0625) {
      const std::vector<double> q = evaluate_channel(channel, s);
      EXPECT_NEAR(q[0], 0, 1e-7);
      EXPECT_NEAR(q[1], 0, 1e-7);
      EXPECT_NEAR(std::abs(2 * std::atan(q[2] / q[3])), from + s * (to - from), 1e-6);
    }
  }
}

Capture three_nodes() {
  Capture capture;
  capture.nodes.resize(3);
  capture.nodes[0].children = {1};
  capture.nodes[1].parent = 0;
  capture.nodes[1].children = {2};
  capture.nodes[2].parent = 1;
  capture.roots = {0};
  return capture;
}

TEST(Pose, MultipliesTranslationRotationAndScaleDownTheGraph) {
  Capture capture = three_nodes();
  capture.nodes[0].transform.translation = {1, 2, 3};
  capture.nodes[1].transform.rotation = DQuat(std::sqrt(0.5), 0, 0, std::sqrt(0.5));  // a quarter turn about z
  capture.nodes[1].transform.scale = {2, 3, 4};
  DMat4 matrix(1.0);
  matrix[3] = DVec4(5, 6, 7, 1);
  capture.nodes[2].matrix = matrix;
  const Pose pose = pose_at(capture, 0);
  // Point 0 of node 2: moved to (5,6,7), scaled to (10,18,28), turned to (-18,10,28), moved by (1,2,3).
  const DVec4 p = pose.world[2] * DVec4(0, 0, 0, 1);
  EXPECT_NEAR(p.x, -17, 1e-12);
  EXPECT_NEAR(p.y, 12, 1e-12);
  EXPECT_NEAR(p.z, 31, 1e-12);
}

TEST(Pose, ReachesFromTheRootsOnly) {
  Capture capture = three_nodes();
  capture.nodes.emplace_back();
  const Pose pose = pose_at(capture, 0);
  EXPECT_EQ(pose.in_scene, (std::vector<bool>{true, true, true, false}));
}

TEST(Pose, TakesMorphWeightsFromAnimationThenNodeThenMesh) {
  Capture capture;
  capture.nodes.resize(1);
  capture.roots = {0};
  capture.meshes.resize(1);
  capture.meshes[0].default_weights = {0.25f, 0.5f};
  capture.nodes[0].mesh = 0;
  EXPECT_EQ(pose_at(capture, 0).weights[0], (std::vector<float>{0.25f, 0.5f}));
  capture.nodes[0].weights = {0.75f, 1.0f};
  EXPECT_EQ(pose_at(capture, 0).weights[0], (std::vector<float>{0.75f, 1.0f}));
  AnimationChannel channel = channel_of(Interpolation::kLinear, 2, {0, 1}, {0, 1, 1, 3});
  channel.node = 0;
  channel.path = AnimatedPath::kWeights;
  capture.animations.resize(1);
  capture.animations[0].channels = {channel};
  EXPECT_EQ(pose_at(capture, 0.5).weights[0], (std::vector<float>{0.75f, 1.0f})) << "an animation that is not played";
  capture.played_animations = {0};
  EXPECT_EQ(pose_at(capture, 0.5).weights[0], (std::vector<float>{0.5f, 2.0f}));
}

}  // namespace
}  // namespace tessera::scene::pose_test
