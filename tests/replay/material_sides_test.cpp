// Materials that are seen from behind.
#include "base/exr_file.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/tests.h"

namespace tessera::replay::material_sides_test {
namespace {

// Reflection of a square of brushed metal in the plane z = 0, seen from z = 3, to one side. Its normal is +z or -z,
// its tangent +x.
Image brushed_square(bool faces_camera, float rotation) {
  GltfSource s;
  const float z = faces_camera ? 1.0f : -1.0f;
  const int points = s.positions({{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}});
  std::vector<float> normals, tangents;
  for (int v = 0; v < 4; ++v) {
    normals.insert(normals.end(), {0, 0, z});
    tangents.insert(tangents.end(), {1, 0, 0, 1});
  }
  const std::vector<std::uint16_t> front = {0, 1, 3, 0, 3, 2}, back = {0, 3, 1, 0, 2, 3};
  const int normal = s.accessor(normals, kFloatType, "VEC3"), tangent = s.accessor(tangents, kFloatType, "VEC4"),
            indices = s.accessor(faces_camera ? front : back, kUnsignedShortType, "SCALAR");
  json& d = s.document;
  d["materials"] = {
      {{"doubleSided", true},
       {"pbrMetallicRoughness", {{"metallicFactor", 1}, {"roughnessFactor", 0.3}}},
       {"extensions",
        {{"KHR_materials_anisotropy", {{"anisotropyStrength", 0.8}, {"anisotropyRotation", rotation}}}}}}};
  d["meshes"] = {{{"primitives",
                   {{{"attributes", {{"POSITION", points}, {"NORMAL", normal}, {"TANGENT", tangent}}},
                     {"indices", indices},
                     {"material", 0}}}}}};
  d["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}}}}};
  const double turn = 0.35;  // about y
  d["nodes"] = {{{"mesh", 0}},
                {{"camera", 0},
                 {"rotation", {0, std::sin(turn / 2), 0, std::cos(turn / 2)}},
                 {"translation", {3 * std::sin(turn), 0, 3 * std::cos(turn)}}}};
  d["scenes"] = {{{"nodes", {0, 1}}}};
  d["extensionsUsed"] = {"KHR_materials_anisotropy"};
  const TemporaryFolder folder;
  const ProcessResult r = run_tessera({"replay", s.write(folder.path()).string(), "--size", "48x48", "--quiet",
                                       "--no-report", "--out", (folder / "out").string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  return read_exr(folder / "out" / "frame_0000.exr");
}

float largest_difference(const Image& a, const Image& b) {
  float largest = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) largest = std::max(largest, std::abs(a.values[i] - b.values[i]));
  return largest;
}

// Grooves have one direction in space. Seen from the side that its normal turns away from, a square whose grooves are
// turned by an angle looks like one that faces the viewer with its grooves turned the other way about its own normal.
TEST(DoubleSidedMaterials, GroovesHaveTheSameDirectionFromBothSides) {
  const Image behind = brushed_square(false, -0.6f);
  EXPECT_LT(largest_difference(behind, brushed_square(true, 0.6f)), 2e-3f);
  EXPECT_GT(largest_difference(behind, brushed_square(true, -0.6f)), 0.05f) << "the angle matters";
}

}  // namespace
}  // namespace tessera::replay::material_sides_test
