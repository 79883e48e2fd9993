#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::test {

using namespace scene;

InstanceTransform random_instance(Random& random, float half) {
  InstanceTransform t;
  const Vec3 p = random.in_box(half);
  t.translation = {p.x, p.y, p.z};
  for (float& c : t.rotation) c = random.uniform(-1, 1);  // of any length
  for (float& s : t.scale) s = random.uniform(0.5f, 1.5f);
  if (random.integer(0, 3) == 0) t.scale[0] = -t.scale[0];
  return t;
}

Capture with_node_per_instance(const Capture& capture) {
  Capture out = capture;
  out.nodes.clear();
  std::vector<int> number;  // number of each node in `out`
  int next = 0;
  for (const Node& node : capture.nodes) {
    number.push_back(next);
    next += 1 + static_cast<int>(node.instances.size());
  }
  const auto renumber = [&](int& node) {
    if (node != kNone) node = number[static_cast<std::size_t>(node)];
  };
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    Node parent = capture.nodes[n];
    renumber(parent.parent);
    for (int& child : parent.children) renumber(child);
    std::vector<Node> children;
    for (const InstanceTransform& instance : parent.instances) {
      Node& child = children.emplace_back();
      child.parent = number[n];
      child.mesh = parent.mesh;
      child.weights = parent.weights;
      const auto& [t, r, s] = instance;
      child.transform = {DVec3(t[0], t[1], t[2]), glm::normalize(DQuat(glm::quat(r[3], r[0], r[1], r[2]))),
                         DVec3(s[0], s[1], s[2])};
      parent.children.push_back(number[n] + static_cast<int>(children.size()));
    }
    if (!children.empty()) parent.mesh = kNone;
    parent.instances.clear();
    out.nodes.push_back(parent);
    out.nodes.insert(out.nodes.end(), children.begin(), children.end());
  }
  for (int& root : out.roots) renumber(root);
  for (Skin& skin : out.skins)
    for (int& joint : skin.joints) renumber(joint);
  renumber(out.settings.camera_node);
  for (Animation& animation : out.animations) {
    std::vector<AnimationChannel> channels;
    for (AnimationChannel channel : std::exchange(animation.channels, {})) {
      const std::size_t instances = capture.nodes[static_cast<std::size_t>(channel.node)].instances.size();
      renumber(channel.node);
      if (channel.path != AnimatedPath::kWeights || instances == 0) {
        channels.push_back(channel);
        continue;
      }
      for (std::size_t i = 0; i < instances; ++i) {
        ++channel.node;
        channels.push_back(channel);
      }
    }
    animation.channels = std::move(channels);
  }
  return out;
}

namespace {

Primitive random_triangles(Random& random, int count, int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int t = 0; t < count; ++t) {
    const Vec3 at = random.in_box(0.4f);
    for (int c = 0; c < 3; ++c) {
      indices.push_back(static_cast<std::uint32_t>(positions.size()));
      positions.push_back(at + random.in_box(0.15f));
    }
  }
  return triangles(std::move(positions), std::move(indices), material);
}

Primitive random_patches(Random& random, int material) {
  Primitive primitive = closed_patches(material);
  for (Vec3& p : primitive.vertices.positions) p *= random.coin() ? 0.3f : 0.30001f;
  return primitive;
}

MorphTarget random_target(Random& random, const Primitive& primitive) {
  MorphTarget target;
  const Vec3 way = random.in_box(1.5f);
  for (std::size_t i = 0; i < primitive.vertices.count(); ++i) target.positions.push_back(way + random.in_box(0.05f));
  return target;
}

}  // namespace

Capture random_instanced_scene(Random& random, int instances, float half) {
  Capture capture;
  Material plain;
  plain.base_color = {random.uniform(0.2f, 1), random.uniform(0.2f, 1), random.uniform(0.2f, 1), 1};
  plain.double_sided = random.coin();
  Material bumpy = plain;
  std::vector<float> heights(16);
  for (float& h : heights) h = random.uniform(-1, 1);
  bumpy.displacement = displacement(4, 4, heights, random.uniform(-0.3f, 0.3f), 0.1f);
  Material clear = plain;
  clear.alpha_mode = AlphaMode::kBlend;
  clear.base_color.w = 0.5f;
  const int materials[] = {add_material(capture, plain), add_material(capture, bumpy), add_material(capture, clear)};

  capture.animations.emplace_back();
  capture.played_animations = {0};
  for (int m = 0; m < 2; ++m) {
    const bool deforms = m == 0;
    std::vector<Primitive> primitives = {random_triangles(random, 20, materials[0]),
                                         random_patches(random, materials[1]),
                                         random_triangles(random, 5, materials[2])};
    for (Primitive& primitive : primitives)
      if (deforms) primitive.vertices.morph_targets.push_back(random_target(random, primitive));
    const int node = add_node(capture, primitives[0], DVec3(random.in_box(0.2f)));
    Mesh& mesh = capture.meshes.back();
    mesh.primitives = primitives;
    Node& drawn = capture.nodes[static_cast<std::size_t>(node)];
    for (int i = 0; i < instances; ++i) drawn.instances.push_back(random_instance(random, half));
    if (deforms)
      capture.animations[0].channels.push_back(
          {.node = node, .path = AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
    if (random.coin()) add_motion(capture, node, DVec3(random.in_box(0.5f)));
    if (random.coin())
      capture.animations[0].channels.push_back({.node = node,
                                                .path = AnimatedPath::kRotation,
                                                .components = 4,
                                                .times = {0, 1},
                                                .values = {0, 0, 0, 1, 0.2f, random.uniform(-0.3f, 0.3f), 0, 0.9f}});
    // A node without instances between nodes with instances.
    add_node(capture, random_triangles(random, 4, materials[0]), DVec3(random.in_box(0.5f)));
  }
  Camera camera;
  camera.near = 0.2f;
  camera.lens = {random.coin() ? 0.03f : 0.0f, 3.0f};
  add_camera(capture, {0, 0, 4}, camera);
  capture.settings.frame_rate = 1;
  capture.settings.shutter_open = 0.25;
  capture.settings.shutter_close = random.coin() ? 0.75 : 0.25;
  return capture;
}

}  // namespace tessera::test
