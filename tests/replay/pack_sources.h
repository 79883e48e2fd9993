#pragma once

// Assets for the tests of tessera pack, and their packed captures.
#include "replay/pack/packer.h"
#include "scene/capture_reader.h"
#include "tests/replay/glb_rules.h"
#include "tests/replay/gltf_source.h"
#include "tests/support/tests.h"

namespace tessera::replay {

using namespace test;
using testing::IsEmpty;

inline json& first_primitive(GltfSource& source) { return source.document["meshes"][0]["primitives"][0]; }

// ---- Sources ----------------------------------------------------------------------------------------------------

inline constexpr std::uint32_t kSide = 9;

// Vertices of a bent grid; vertex number n has x = n % 9 and y = n / 9, so that it can be told after renumbering.
inline std::vector<Vec3> grid_points() {
  std::vector<Vec3> points;
  for (std::uint32_t n = 0; n < kSide * kSide; ++n)
    points.emplace_back(n % kSide, n / kSide, 0.25f * static_cast<float>(n % 5));
  return points;
}

inline std::vector<std::uint16_t> grid_indices() {
  std::vector<std::uint16_t> indices;
  for (std::uint32_t j = 0; j + 1 < kSide; ++j)
    for (std::uint32_t i = 0; i + 1 < kSide; ++i)
      for (const std::uint32_t corner : {0u, 1u, kSide + 1, 0u, kSide + 1, kSide})
        indices.push_back(static_cast<std::uint16_t>(j * kSide + i + corner));
  return indices;
}

inline GltfSource grid() {
  GltfSource s;
  const int positions = s.positions(grid_points()), indices = s.accessor(grid_indices(), kUnsignedShortType, "SCALAR");
  s.document["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}}};
  return s;
}

inline std::vector<float> floats(std::uint32_t seed, std::size_t count, float low, float high) {
  Random random(seed);
  std::vector<float> out(count);
  for (float& v : out) v = random.uniform(low, high);
  return out;
}

// Every kind of attribute that glTF has, on a skinned grid.
inline GltfSource dressed_grid() {
  GltfSource s = grid();
  constexpr std::size_t kCount = kSide * kSide;
  std::vector<float> normals, tangents, weights;
  Random random(11);
  for (std::size_t v = 0; v < kCount; ++v) {
    const Vec3 n = glm::normalize(random.in_box(1.0f) + Vec3(0, 0, 2)),
               t = glm::normalize(glm::cross(n, Vec3(0, 1, 0)));
    normals.insert(normals.end(), {n.x, n.y, n.z});
    tangents.insert(tangents.end(), {t.x, t.y, t.z, v % 2 == 0 ? 1.0f : -1.0f});
    const float w = random.uniform(0.1f, 0.9f);
    weights.insert(weights.end(), {w, 1.0f - w, 0.0f, 0.0f});
  }
  std::vector<std::uint8_t> colors, joints;
  for (std::size_t i = 0; i < 4 * kCount; ++i) {
    colors.push_back(static_cast<std::uint8_t>(random.integer(0, 255)));
    joints.push_back(i % 4 < 2 ? static_cast<std::uint8_t>(random.integer(0, 1)) : std::uint8_t{0});
  }
  json& attributes = first_primitive(s)["attributes"];
  attributes["NORMAL"] = s.accessor(normals, kFloatType, "VEC3");
  attributes["TANGENT"] = s.accessor(tangents, kFloatType, "VEC4");
  attributes["TEXCOORD_0"] = s.accessor(floats(12, 2 * kCount, -1.0f, 3.0f), kFloatType, "VEC2");
  attributes["TEXCOORD_1"] = s.accessor(floats(13, 2 * kCount, 0.0f, 1.0f), kFloatType, "VEC2");
  attributes["COLOR_0"] = s.accessor(colors, kUnsignedByteType, "VEC4", {{"normalized", true}});
  attributes["JOINTS_0"] = s.accessor(joints, kUnsignedByteType, "VEC4");
  attributes["WEIGHTS_0"] = s.accessor(weights, kFloatType, "VEC4");
  std::vector<float> matrices(32, 0.0f);
  for (const std::size_t diagonal : {0, 5, 10, 15, 16, 21, 26, 31}) matrices[diagonal] = 1.0f;
  matrices[12] = -3.25f;
  s.document["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", s.accessor(matrices, kFloatType, "MAT4")}}};
  s.document["nodes"] = {{{"mesh", 0}, {"skin", 0}},
                         {{"name", "joint 0"}, {"children", {2}}},
                         {{"name", "joint 1"}, {"translation", {0, 1, 0}}}};
  s.document["scenes"][0]["nodes"] = {0, 1};
  return s;
}

// Patches over a square that share their edges, as the extension's page describes them.
inline GltfSource bezier(int nx = 2, int ny = 2) {
  GltfSource s;
  std::vector<Vec3> points;
  std::vector<std::uint16_t> cage;
  for (int py = 0; py < ny; ++py)
    for (int px = 0; px < nx; ++px) {
      const auto first = static_cast<std::uint16_t>(points.size());
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          const int x = 3 * px + i, y = 3 * py + j;
          points.emplace_back(static_cast<float>(x) / 7.0f, static_cast<float>(y) / 7.0f,
                              std::sin(static_cast<float>(3 * x + 5 * y)) / 9.0f);
        }
      for (std::uint16_t j = 0; j < 3; ++j)
        for (std::uint16_t i = 0; i < 3; ++i)
          for (const int corner : {0, 1, 5, 0, 5, 4})
            cage.push_back(static_cast<std::uint16_t>(first + 4 * j + i + corner));
    }
  const int positions = s.positions(points), indices = s.accessor(cage, kUnsignedShortType, "SCALAR");
  s.document["meshes"] = {{{"primitives",
                            {{{"attributes", {{"POSITION", positions}}},
                              {"indices", indices},
                              {"extensions", {{"TESSERA_bezier_patches", {{"count", nx * ny}}}}}}}}}};
  s.document["extensionsUsed"] = {"TESSERA_bezier_patches"};
  return s;
}

// A morphed, animated grid with a camera, a light and things that Tessera does not know.
inline GltfSource animated_grid(std::size_t stride = 0) {
  GltfSource s = grid();
  constexpr std::size_t kCount = kSide * kSide;
  std::vector<Vec3> offsets(kCount);
  for (std::size_t v = 0; v < kCount; ++v) offsets[v] = {0, 0, 0.01f * static_cast<float>(v)};
  first_primitive(s)["targets"] = {{{"POSITION", s.positions(offsets, stride == 0 ? 0 : 16)}}};
  const int times = s.accessor(std::vector<float>{0.0f, 0.5f, 1.0f}, kFloatType, "SCALAR",
                               {{"min", {0.0f}}, {"max", {1.0f}}}, stride);
  const int weights = s.accessor(std::vector<float>{0.0f, 1.0f, 0.3f}, kFloatType, "SCALAR", {}, stride);
  const int places =
      s.accessor(std::vector<float>{0, 0, 0, 1, 2, 3, 4, 5, 6}, kFloatType, "VEC3", {}, stride == 0 ? 0 : 2 * stride);
  s.document["animations"] = {
      {{"name", "move"},
       {"channels",
        {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}},
         {{"sampler", 1}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
       {"samplers",
        {{{"input", times}, {"output", weights}}, {{"input", times}, {"output", places}, {"interpolation", "STEP"}}}}}};
  s.document["meshes"][0]["weights"] = {0.25};
  s.document["meshes"][0]["extras"] = {{"targetNames", {"raise"}}};
  s.document["cameras"] = {
      {{"type", "perspective"}, {"name", "eye"}, {"perspective", {{"yfov", 0.75}, {"znear", 0.125}}}}};
  s.document["nodes"].push_back({{"camera", 0}, {"translation", {4, 4, 20}}, {"extras", {{"note", "keep"}}}});
  s.document["nodes"].push_back(
      {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}, {"VENDOR_thing", {{"answer", 42}}}}}});
  s.document["scenes"][0]["nodes"] = {0, 1, 2};
  s.document["extensions"] = {{"KHR_lights_punctual", {{"lights", {{{"type", "point"}, {"intensity", 30.5}}}}}}};
  s.document["extensionsUsed"] = {"KHR_lights_punctual", "VENDOR_thing"};
  s.document["materials"] = {
      {{"name", "red"},
       {"pbrMetallicRoughness", {{"baseColorFactor", {0.75, 0.125, 0.0625, 1}}, {"metallicFactor", 0}}},
       {"doubleSided", true}}};
  first_primitive(s)["material"] = 0;
  return s;
}

// ---- Packing ----------------------------------------------------------------------------------------------------

struct Packed {
  TemporaryFolder folder;
  fs::path source, target = folder / "packed.glb";
  PackReport report;
  std::string bytes;
  GlbParts parts;

  explicit Packed(const GltfSource& asset, const PackOptions& options = {}) : source(asset.write(folder.path())) {
    report = pack_capture(source, target, options);
    bytes = read_text(target);
    parts = glb_parts(bytes);
    EXPECT_THAT(glb_faults(bytes), IsEmpty());
  }
  scene::Capture before() const { return scene::read_capture(source); }
  scene::Capture after() const { return scene::read_capture(target); }
};

inline PackOptions with(PackMethod method) {
  PackOptions options;
  options.method = method;
  return options;
}

inline const scene::Vertices& vertices_of(const scene::Capture& capture) {
  return capture.meshes.at(0).primitives.at(0).vertices;
}

// For each vertex of the source its number in the packed grid, told from x and y.
inline std::vector<std::size_t> packed_numbers(const scene::Vertices& packed) {
  std::vector<std::size_t> number(kSide * kSide, SIZE_MAX);
  for (std::size_t v = 0; v < packed.count(); ++v)
    number.at(static_cast<std::size_t>(std::lround(packed.positions[v].y)) * kSide +
              static_cast<std::size_t>(std::lround(packed.positions[v].x))) = v;
  return number;
}

inline double half_step(double range, int bits) { return 0.5 * range / (std::exp2(bits) - 1) + 2e-6; }

}  // namespace tessera::replay
