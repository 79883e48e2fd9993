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
  // Where a posed vertex is in the world.
  DVec3 placed(const Vec3& p) {
    return DVec3(object_to_world(capture, kJoints, 0, primitive(), pose) * DVec4(DVec3(p), 1.0));
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

// Section 3.7.3.3: the weighted sum of the joints' matrices.
DMat4 blended(Scene& scene, std::size_t vertex) {
  const SkinInfluence& influence = scene.vertices().influences[vertex];
  const Skin& skin = scene.capture.skins[0];
  DMat4 out(0.0);
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t joint = influence.joints[k];
    out += scene.pose.world[joint] * skin.inverse_bind[joint] * static_cast<double>(influence.weights[k]);
  }
  return out;
}
DVec3 skinned(Scene& scene, const DVec4& v, std::size_t vertex) { return DVec3(blended(scene, vertex) * v); }

void expect_near(const DVec3& got, const DVec3& wanted) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], wanted[c], 2e-5);
}
void expect_near(const Vec3& got, const DVec3& wanted) { expect_near(DVec3(got), wanted); }

TEST(Deformation, IsTheWeightedSumOfDifferencesThenOfJoints) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene(seed);
    const Deformed out = scene.deformed();
    ASSERT_EQ(out.positions.size(), kVertices);
    for (std::size_t i = 0; i < kVertices; ++i) {
      expect_near(
          scene.placed(out.positions[i]),
          skinned(scene, DVec4(morphed(scene, DVec3(scene.vertices().positions[i]), i, &MorphTarget::positions), 1.0),
                  i));
      // A normal stays across whatever lies in the surface.
      const DMat3 linear(blended(scene, i));
      const DVec3 normal = morphed(scene, DVec3(scene.vertices().normals[i]), i, &MorphTarget::normals);
      const double size = std::cbrt(std::abs(glm::determinant(linear)));
      const DVec3 wanted = glm::transpose(glm::inverse(linear)) * normal * size;
      expect_near(DVec3(out.normals[i]) / (1 + glm::length(wanted)), wanted / (1 + glm::length(wanted)));
      const DVec3 along = linear * glm::cross(normal, DVec3(0.3, -0.2, 0.9));
      EXPECT_NEAR(glm::dot(glm::normalize(DVec3(out.normals[i])), glm::normalize(along)), 0, 1e-4);
      // The twin: turned as directions are, it does not.
      if (i == 0) {
        EXPECT_GT(std::abs(glm::dot(glm::normalize(linear * normal), glm::normalize(along))), 1e-3);
      }
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
  const DMat4 origin = object_to_world(scene.capture, kJoints, 0, scene.primitive(), scene.pose);
  scene.pose.world[kJoints] = DMat4(7.0);
  EXPECT_EQ(scene.deformed().positions, before.positions);
  EXPECT_EQ(object_to_world(scene.capture, kJoints, 0, scene.primitive(), scene.pose), origin);
  EXPECT_EQ(DMat3(origin), DMat3(1.0)) << "an origin to count from, no more";
}

// Joints as far away as a planet's surface, and turned: vertices are as exact as the vertices of a rigid mesh there.
TEST(Deformation, OfASkinIsAsPreciseFarAway) {
  for (const double far : {0.0, 1e3, 1e6, 4.2e6, 1e9}) {
    Scene scene(26);
    const DVec3 away(far, -1.1 * far, 0.3 * far);
    const std::vector<DMat4> world = scene.pose.world;
    Scene near(26);
    for (DMat4& m : scene.pose.world) m[3] += DVec4(away, 0.0);
    const Deformed out = scene.deformed();
    for (std::size_t i = 0; i < kVertices; ++i) {
      const DVec3 morph = morphed(near, DVec3(near.vertices().positions[i]), i, &MorphTarget::positions);
      // Weights sum to 1 in single precision: the missing part moves with the origin, not with the scene.
      const DVec3 wanted = skinned(near, DVec4(morph, 1.0), i);
      const double doubles = far * 0x1p-50;
      for (int c = 0; c < 3; ++c) EXPECT_NEAR((scene.placed(out.positions[i]) - away)[c], wanted[c], 2e-5 + doubles);
    }
    // The twin: vertices counted from the world's origin.
    if (far > 1e5) {
      EXPECT_GT(glm::distance(DVec3(Vec3(away + DVec3(0.013))), away + DVec3(0.013)), 1e-3);
    }
  }
}

TEST(Deformation, TurnedNormalsAreBoundedWhereTheSurfaceIsFlat) {
  const DMat3 flat(DVec3(0, 0, 0), DVec3(0, 2, 0), DVec3(0, 0, 2));
  EXPECT_EQ(glm::normalize(turn_normals(flat) * DVec3(1, 0, 0)), DVec3(1, 0, 0));
  EXPECT_EQ(turn_normals(DMat3(0.0)), DMat3(1.0));
  // A mirror keeps a normal on its side: across the surface, and outside.
  const DMat3 mirror(DVec3(-1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1));
  EXPECT_EQ(turn_normals(mirror), mirror);
  EXPECT_EQ(turn_normals(DMat3(8.0)), DMat3(1.0)) << "an even scale leaves lengths";
}

TEST(Deformation, WindingFollowsTheNodeAndItsInstance) {
  Scene scene(27);
  scene.pose.world[kJoints] = DMat4(1.0);
  EXPECT_GT(winding_determinant(scene.capture, kJoints, 0, scene.pose), 0);
  scene.pose.world[kJoints][0].x = -1;
  EXPECT_LT(winding_determinant(scene.capture, kJoints, 0, scene.pose), 0) << "skinned or not";
  scene.capture.nodes[kJoints].instances.resize(2);
  scene.capture.nodes[kJoints].instances[1].scale = {1, -3, 1};
  EXPECT_LT(winding_determinant(scene.capture, kJoints, 0, scene.pose), 0);
  EXPECT_GT(winding_determinant(scene.capture, kJoints, 1, scene.pose), 0);
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
  for (std::size_t i = 0; i < kVertices; ++i)
    expect_near(scene.placed(out.positions[i]), DVec3(scene.vertices().positions[i]));
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
