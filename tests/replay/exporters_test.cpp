// Files of today's exporters, from sample models, each in every way that they have of compressing it.
#include "base/error.h"
#include "scene/capture_reader.h"
#include "scene/pose.h"
#include "tests/support/tests.h"

namespace tessera::exporters_test {
namespace {

using scene::Capture;

// Measures that no compression may change by much: the place of the surface and its area.
struct Extent {
  DVec3 low{1e300}, high{-1e300}, centroid{0.0};  // centroid by area
  double area = 0;
};

Extent extent_at(const Capture& capture, double time) {
  Extent out;
  const scene::Pose pose = scene::pose_at(capture, time);
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int mesh = capture.nodes[n].mesh;
    if (mesh < 0 || !pose.in_scene[n]) continue;
    for (const scene::Primitive& primitive : capture.meshes[static_cast<std::size_t>(mesh)].primitives) {
      scene::Deformed deformed;
      const int node = static_cast<int>(n);
      if (scene::is_deforming(capture, node, primitive)) scene::deform(capture, node, primitive, pose, deformed);
      const std::vector<Vec3>& positions =
          deformed.positions.empty() ? primitive.vertices.positions : deformed.positions;
      const DMat4 world = scene::object_to_world(capture, node, 0, primitive, pose);
      const auto corner = [&](std::size_t i) {
        return DVec3(world * DVec4(DVec3(positions[primitive.indices[i]]), 1.0));
      };
      for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
        const DVec3 a = corner(i), b = corner(i + 1), c = corner(i + 2);
        const double area = glm::length(glm::cross(b - a, c - a)) / 2;
        out.area += area;
        out.centroid += area * (a + b + c) / 3.0;
        for (const DVec3& p : {a, b, c}) out.low = glm::min(out.low, p), out.high = glm::max(out.high, p);
      }
    }
  }
  out.centroid /= out.area;
  return out;
}

TEST(Exporters, FilesLoadAndHaveTheSameSurface) {
  const auto assets = test::assets_folder();
  if (!assets) GTEST_SKIP() << "no folder of sample models: set TESSERA_ASSETS";
  const fs::path folder = fs::path(TESSERA_BINARY_DIR) / "exporters";
  std::vector<fs::path> models;
  for (const char* name : {"AnimatedMorphCube", "Avocado", "CesiumMilkTruck", "Fox"})
    models.push_back(fs::canonical(*assets) / name / "glTF" / (std::string(name) + ".gltf"));
  std::vector<std::string> command = {"/usr/bin/env", "bash",
                                      std::string(TESSERA_SOURCE_DIR) + "/tests/replay/exporters.sh", folder.string()};
  for (const fs::path& model : models) command.push_back(model.string());
  const test::ProcessResult made = test::run_process(command, {.seconds = 1500});
  if (made.status == 77) GTEST_SKIP() << made.output;
  ASSERT_EQ(made.status, 0) << made.errors;

  for (const fs::path& model : models) {
    const Capture source = scene::read_capture(model);
    int ways = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.path().extension() != ".glb" || !name.starts_with(model.stem().string() + ".")) continue;
      ++ways;
      SCOPED_TRACE(name);
      try {
        const Capture capture = scene::read_capture(entry.path());
        EXPECT_TRUE(capture.notices.empty());
        for (const double time : {0.0, 0.3}) {
          const Extent a = extent_at(source, time), b = extent_at(capture, time);
          const double tolerance = 0.02 * glm::length(a.high - a.low);
          EXPECT_LT(glm::length(a.low - b.low), tolerance) << time;
          EXPECT_LT(glm::length(a.high - b.high), tolerance) << time;
          EXPECT_LT(glm::length(a.centroid - b.centroid), tolerance) << time;
          EXPECT_NEAR(b.area / a.area, 1, 0.05) << time;
        }
      } catch (const std::exception& error) {
        ADD_FAILURE() << error.what();
      }
    }
    EXPECT_EQ(ways, 16) << model;
  }
}

}  // namespace
}  // namespace tessera::exporters_test
