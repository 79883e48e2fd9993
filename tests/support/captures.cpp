#include "tests/support/captures.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tessera::test {

using namespace scene;

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
