#include "scene/pose.h"
#include "tests/support/tests.h"

namespace tessera::scene::deform_test {
namespace {

constexpr std::size_t kVertices = 40, kJoints = 12, kTargets = 3;

// A mesh with everything that moves: random vertices, targets, influences of up to 8 joints, and joints that turn.
struct Scene {
  Capture capture;
  Pose pose;

  explicit Scene(std::uint32_t seed) {
    test::Random random(seed);
    const auto vectors = [&] {
      std::vector<Vec3> out(kVertices);
      for (Vec3& v : out) v = random.in_box(1);
      return out;
    };
    Primitive primitive;
    Vertices& v = primitive.vertices;
    v.positions = vectors();
    v.normals = vectors();
    for (const Vec3& t : vectors()) v.tangents.emplace_back(t, random.coin() ? 1.0f : -1.0f);
    for (std::size_t t = 0; t < kTargets; ++t) v.morph_targets.push_back({vectors(), vectors(), vectors()});
    for (std::size_t i = 0; i < kVertices; ++i) {
      SkinInfluence influence;
      const int count = 1 + static_cast<int>(i % 8);
      float sum = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
        influence.joints[k] = static_cast<std::uint16_t>(random.integer(0, kJoints - 1));
        sum += influence.weights[k] = random.uniform(0.1f, 1.0f);
      }
      for (float& w : influence.weights) w /= sum;
      v.influences.push_back(influence);
    }
    capture.nodes.resize(kJoints + 1);
    capture.nodes[kJoints].mesh = 0;
    capture.nodes[kJoints].skin = 0;
    capture.meshes.resize(1);
    capture.meshes[0].primitives = {primitive};
    Skin skin;
    for (std::size_t j = 0; j < kJoints; ++j) {
      skin.joints.push_back(static_cast<int>(j));
      skin.inverse_bind.push_back(matrix(random));
      pose.world.push_back(matrix(random));
    }
    capture.skins = {skin};
    pose.world.push_back(matrix(random));
    pose.weights.resize(kJoints + 1);
    for (std::size_t t = 0; t < kTargets; ++t) pose.weights[kJoints].push_back(random.uniform(-1, 1));
  }

  static DMat4 matrix(test::Random& random) {
    DMat4 m(1.0);
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 3; ++r) m[c][r] = static_cast<double>(random.uniform(-1, 1));
    return m;
  }

  Primitive& primitive() { return capture.meshes[0].primitives[0]; }
  const Vertices& vertices() { return primitive().vertices; }
  Deformed deformed() {
    Deformed out;
    deform(capture, kJoints, primitive(), pose, out);
    return out;
  }
};

// glTF 2.0 section 3.7.2.2: base plus the weighted sum of differences.
DVec3 morphed(Scene& scene, const DVec3& base, std::size_t vertex, std::vector<Vec3> MorphTarget::*attribute) {
  DVec3 out = base;
  for (std::size_t t = 0; t < scene.vertices().morph_targets.size(); ++t) {
    const auto& differences = scene.vertices().morph_targets[t].*attribute;
    if (!differences.empty()) out += DVec3(differences[vertex]) * static_cast<double>(scene.pose.weights[kJoints][t]);
  }
  return out;
}

// Section 3.7.3.3: the weighted sum of what each joint makes of the vertex.
DVec3 skinned(Scene& scene, const DVec4& v, std::size_t vertex) {
  const SkinInfluence& influence = scene.vertices().influences[vertex];
  const Skin& skin = scene.capture.skins[0];
  DVec4 out(0.0);
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t joint = influence.joints[k];
    out += scene.pose.world[joint] * (skin.inverse_bind[joint] * v) * static_cast<double>(influence.weights[k]);
  }
  return DVec3(out);
}

void expect_near(const Vec3& got, const DVec3& wanted) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(static_cast<double>(got[c]), wanted[c], 2e-5);
}

TEST(Deformation, IsTheWeightedSumOfDifferencesThenOfJoints) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene(seed);
    const Deformed out = scene.deformed();
    ASSERT_EQ(out.positions.size(), kVertices);
    for (std::size_t i = 0; i < kVertices; ++i) {
      expect_near(
          out.positions[i],
          skinned(scene, DVec4(morphed(scene, DVec3(scene.vertices().positions[i]), i, &MorphTarget::positions), 1.0),
                  i));
      expect_near(
          out.normals[i],
          skinned(scene, DVec4(morphed(scene, DVec3(scene.vertices().normals[i]), i, &MorphTarget::normals), 0.0), i));
      expect_near(
          Vec3(out.tangents[i]),
          skinned(scene,
                  DVec4(morphed(scene, DVec3(Vec3(scene.vertices().tangents[i])), i, &MorphTarget::tangents), 0.0), i));
      EXPECT_EQ(out.tangents[i].w, scene.vertices().tangents[i].w);
    }
  }
}

TEST(Deformation, OfAnUnskinnedMeshStaysInItsNodesSpace) {
  Scene scene(20);
  scene.capture.nodes[kJoints].skin = kNone;
  const Deformed out = scene.deformed();
  for (std::size_t i = 0; i < kVertices; ++i)
    expect_near(out.positions[i], morphed(scene, DVec3(scene.vertices().positions[i]), i, &MorphTarget::positions));
  EXPECT_EQ(object_to_world(scene.capture, kJoints, 0, scene.primitive(), scene.pose), scene.pose.world[kJoints]);
}

TEST(Deformation, OfASkinnedMeshIgnoresItsNode) {
  Scene scene(21);
  const Deformed before = scene.deformed();
  scene.pose.world[kJoints] = DMat4(7.0);
  EXPECT_EQ(scene.deformed().positions, before.positions);
  EXPECT_EQ(object_to_world(scene.capture, kJoints, 0, scene.primitive(), scene.pose), DMat4(1.0));
}

TEST(Deformation, WithZeroWeightsKeepsTheVerticesBitForBit) {
  Scene scene(22);
  scene.capture.nodes[kJoints].skin = kNone;
  scene.pose.weights[kJoints].assign(kTargets, 0.0f);
  const Deformed out = scene.deformed();
  EXPECT_EQ(out.positions, scene.vertices().positions);
  EXPECT_EQ(out.normals, scene.vertices().normals);
  EXPECT_EQ(out.tangents, scene.vertices().tangents);
}

TEST(Deformation, ByJointsAtTheirBindPoseKeepsTheVertices) {
  Scene scene(23);
  scene.primitive().vertices.morph_targets.clear();
  for (std::size_t j = 0; j < kJoints; ++j)
    scene.capture.skins[0].inverse_bind[j] =
        glm::inverse(scene.pose.world[j] = DMat4(1.0) * static_cast<double>(j + 1));
  const Deformed out = scene.deformed();
  for (std::size_t i = 0; i < kVertices; ++i) expect_near(out.positions[i], DVec3(scene.vertices().positions[i]));
}

TEST(Deformation, LeavesAttributesAloneThatNoTargetMoves) {
  Scene scene(24);
  scene.capture.nodes[kJoints].skin = kNone;
  for (MorphTarget& target : scene.primitive().vertices.morph_targets) target.normals.clear(), target.tangents.clear();
  const Deformed out = scene.deformed();
  EXPECT_EQ(out.normals, scene.vertices().normals);
  EXPECT_EQ(out.tangents, scene.vertices().tangents);
}

TEST(Deformation, IsNothingForARigidMesh) {
  Scene scene(25);
  scene.primitive().vertices.morph_targets.clear();
  scene.primitive().vertices.influences.clear();
  EXPECT_FALSE(is_deforming(scene.capture, kJoints, scene.primitive()));
  EXPECT_TRUE(scene.deformed().positions.empty());
}

}  // namespace
}  // namespace tessera::scene::deform_test
