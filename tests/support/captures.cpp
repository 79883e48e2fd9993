#include "tests/support/captures.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tessera::test {

using namespace scene;

void play(Capture& capture, const AnimationChannel& channel) {
  if (capture.animations.empty()) {
    capture.animations.emplace_back();
    capture.played_animations = {0};
  }
  capture.animations[0].channels.push_back(channel);
}

int add_material(Capture& capture, Material material) {
  capture.materials.push_back(std::move(material));
  return static_cast<int>(capture.materials.size()) - 1;
}

int add_node(Capture& capture, Primitive primitive, const DVec3& translation) {
  Mesh mesh;
  mesh.default_weights.resize(primitive.vertices.morph_targets.size(), 0.0f);
  mesh.primitives.push_back(std::move(primitive));
  capture.meshes.push_back(std::move(mesh));
  Node node;
  node.mesh = static_cast<int>(capture.meshes.size()) - 1;
  node.transform.translation = translation;
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture.roots.back();
}

void add_camera(Capture& capture, const DVec3& eye, const Camera& camera) {
  capture.cameras.push_back(camera);
  Node node;
  node.camera = static_cast<int>(capture.cameras.size()) - 1;
  node.transform.translation = eye;
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
}

int material_number(std::string_view pointer) {
  const auto& numbers = scene::material_numbers();
  const auto at = std::find_if(numbers.begin(), numbers.end(), [&](const auto& row) { return row.pointer == pointer; });
  return static_cast<int>(at - numbers.begin());
}

void add_motion(Capture& capture, int node, const DVec3& way) {
  const DVec3 from = capture.nodes[static_cast<std::size_t>(node)].transform.translation, to = from + way;
  AnimationChannel channel;
  channel.node = node;
  channel.path = AnimatedPath::kTranslation;
  channel.times = {0.0f, 1.0f};
  for (const DVec3& p : {from, to})
    for (int c = 0; c < 3; ++c) channel.values.push_back(static_cast<float>(p[c]));
  play(capture, channel);
}

void add_morph(Capture& capture, int node) {
  capture.nodes[static_cast<std::size_t>(node)].weights = {0.0f};
  play(capture, {.node = node, .path = AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
}

void add_turn(Capture& capture, int node, const Vec3& axis, float angle) {
  AnimationChannel channel;
  channel.node = node;
  channel.path = AnimatedPath::kRotation;
  channel.components = 4;
  channel.times = {0.0f, 1.0f};
  const Vec3 end = glm::normalize(axis) * std::sin(0.5f * angle);
  channel.values = {0, 0, 0, 1, end.x, end.y, end.z, std::cos(0.5f * angle)};
  play(capture, channel);
}

Primitive triangles(std::vector<Vec3> positions, std::vector<std::uint32_t> indices, int material) {
  Primitive primitive;
  primitive.vertices.positions = std::move(positions);
  primitive.indices = std::move(indices);
  primitive.material = material;
  return primitive;
}

namespace {

Primitive wires(Primitive::Wire wire, const std::vector<Vec3>& ends, std::size_t copies, int material) {
  Primitive primitive;
  primitive.wire = wire;
  primitive.material = material;
  for (const Vec3& end : ends) primitive.vertices.positions.insert(primitive.vertices.positions.end(), copies, end);
  for (std::uint32_t v = 0; v < primitive.vertices.count(); v += 4)
    primitive.indices.insert(primitive.indices.end(), {v, v + 1, v + 2, v, v + 2, v + 3});
  return primitive;
}

}  // namespace

Primitive wavy_grid(int n, std::uint32_t seed) {
  Random random(seed);
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      positions.emplace_back(static_cast<float>(x), static_cast<float>(y), random.uniform(0, 1));
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (n + 1) + x), row = static_cast<std::uint32_t>(n + 1);
      for (const std::uint32_t i : {a, a + 1, a + row + 1, a, a + row + 1, a + row}) indices.push_back(i);
    }
  return triangles(positions, indices);
}

Primitive points(const std::vector<Vec3>& positions, int material) {
  return wires(Primitive::Wire::kPoints, positions, 4, material);
}
Primitive segments(const std::vector<Vec3>& ends, int material) {
  return wires(Primitive::Wire::kSegments, ends, 2, material);
}

Primitive patches(std::vector<Vec3> control_points, int material) {
  Primitive primitive;
  primitive.kind = Primitive::Kind::kBezierPatches;
  std::vector<Vec2> texcoords;
  for (std::size_t i = 0; i < control_points.size(); ++i)
    texcoords.emplace_back(static_cast<float>(i % 4) / 3.0f, static_cast<float>(i % 16 / 4) / 3.0f);
  primitive.vertices.positions = std::move(control_points);
  primitive.vertices.texcoords = {texcoords};
  primitive.material = material;
  return primitive;
}

std::vector<Vec3> flat_patch(Vec3 origin, Vec3 a, Vec3 b) {
  std::vector<Vec3> points;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      points.push_back(origin + a * (static_cast<float>(i) / 3.0f) + b * (static_cast<float>(j) / 3.0f));
  return points;
}

Primitive closed_patches(int material) {
  std::vector<Vec3> points;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f})
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          // Grid coordinates are exact thirds of integers, so that faces share their edge points bit by bit.
          const float s[4] = {-1.0f, -0.4f, 0.4f, 1.0f};
          Vec3 p;
          p[axis] = side;
          p[(axis + 1) % 3] = side > 0 ? s[i] : s[3 - i];
          p[(axis + 2) % 3] = s[j];
          // Push inner points outwards; edges are bent alike from both faces because the formula is symmetric.
          const float bulge = 1.0f / std::max(1.0f, std::sqrt((p.x * p.x + p.y * p.y) + p.z * p.z) * 0.75f);
          points.push_back(p * bulge);
        }
  return patches(points, material);
}

Displacement displacement(int width, int height, std::vector<float> heights, float scale, float bias) {
  Displacement out;
  out.texture = std::make_shared<shaders::ScalarTexture>(width, height, std::move(heights));
  out.scale = scale;
  out.bias = bias;
  return out;
}

std::filesystem::path shipped_capture(const std::string& name) {
  return std::filesystem::path(TESSERA_SOURCE_DIR) / "captures" / (name + ".glb");
}

std::optional<std::filesystem::path> assets_folder() {
  const char* variable = std::getenv("TESSERA_ASSETS");
  const std::filesystem::path folder =
      variable != nullptr ? variable : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "assets";
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return std::filesystem::canonical(folder);
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace tessera::test
