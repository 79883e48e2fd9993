// From a file to its first image, against decoding alone and against other forms of the same mesh in one run: ratios,
// never times.
#include "bench/support/timing.h"
#include "gpu/device.h"
#include "scene/clusters.h"
#include "scene/gltf/document.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/tests.h"

namespace tessera::replay::loading_speed_test {
namespace {

constexpr std::uint32_t kPoints = 500;  // a side: half a million triangles

GltfSource wavy_square() {
  std::vector<Vec3> points;
  std::vector<float> normals, texcoords;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j < kPoints; ++j)
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      const float x = static_cast<float>(i) / (kPoints - 1), y = static_cast<float>(j) / (kPoints - 1);
      points.emplace_back(2 * x - 1, 2 * y - 1, 0.08f * std::sin(9 * x) * std::cos(7 * y));
      normals.insert(normals.end(), {0, 0, 1});
      texcoords.insert(texcoords.end(), {x, y});
      const std::uint32_t a = j * kPoints + i;
      if (i + 1 < kPoints && j + 1 < kPoints)
        indices.insert(indices.end(), {a, a + 1, a + kPoints + 1, a, a + kPoints + 1, a + kPoints});
    }
  GltfSource s;
  const json attributes = {{"POSITION", s.positions(points)},
                           {"NORMAL", s.accessor(normals, kFloatType, "VEC3")},
                           {"TEXCOORD_0", s.accessor(texcoords, kFloatType, "VEC2")}};
  const int triangles = s.accessor(indices, kUnsignedIntType, "SCALAR");
  s.document["meshes"] = {{{"primitives", {{{"attributes", attributes}, {"indices", triangles}}}}}};
  return s;
}

// The least of some runs.
double seconds_of(const std::function<void()>& work) {
  double least = 1e9;
  for (int round = 0; round < 5; ++round) {
    const double begin = bench::now();
    work();
    least = std::min(least, bench::now() - begin);
  }
  return least;
}

// The machine is timed by phases: to time it event by event takes longer than the image, whatever the file.
double first_image_seconds(const fs::path& file) {
  gpu::GpuConfiguration gpu;
  gpu.queues.model = hardware::TimingModel::kPhases;
  return seconds_of([&] {
    const scene::Capture capture = scene::read_capture(file);
    gpu::Device device(capture, gpu, {}, {640, 360, {0, 0, 640, 360}, false});
    ASSERT_GT(device.render(0).counters.shading.samples_visible, 0u);
  });
}

// Clusters alone: bounding them takes as long however they were found.
double cluster_seconds(const fs::path& file) {
  const scene::Capture capture = scene::read_capture(file);
  const scene::Primitive& mesh = capture.meshes.front().primitives.front();
  return seconds_of([&] { ASSERT_GT(scene::build_clusters(mesh).clusters.size(), 0u); });
}

double draco_seconds(const fs::path& file) {
  const GlbParts parts = glb_parts(read_text(file));
  const scene::CaptureLimits limits;
  return seconds_of([&] {
    scene::MemoryBudget budget(limits.max_bytes);
    scene::gltf::Document document(parts.document, file, {parts.binary.begin(), parts.binary.end()}, true, limits,
                                   budget);
    const json& primitive = document.json["meshes"][0]["primitives"][0];
    ASSERT_GT(scene::gltf::read_draco(document, primitive, document.root).vertex_count, 0u);
  });
}

TEST(LoadingSpeed, CuttingClustersTakesAFractionOfFindingThem) {
  PackOptions options;
  options.method = PackMethod::kMeshopt;
  const Packed p(wavy_square(), options);
  const double ratio = cluster_seconds(p.target) / cluster_seconds(p.source);
  RecordProperty("ratio", std::to_string(ratio));
  EXPECT_LT(ratio, 0.15);  // measured: 0.06
}

TEST(LoadingSpeed, APackedMeshHasItsFirstImageBeforeAPlainOne) {
  PackOptions options;
  options.method = PackMethod::kMeshopt;
  const Packed p(wavy_square(), options);
  const double ratio = first_image_seconds(p.target) / first_image_seconds(p.source);
  RecordProperty("ratio", std::to_string(ratio));
  EXPECT_LT(ratio, 0.7);  // measured: 0.48
}

TEST(LoadingSpeed, TheFirstImageOfADracoMeshTakesLittleMoreThanDecodingIt) {
  const Packed p(wavy_square());
  const double ratio = first_image_seconds(p.target) / draco_seconds(p.target);
  RecordProperty("ratio", std::to_string(ratio));
  EXPECT_LT(ratio, 3.0);  // measured: 2.3
}

}  // namespace
}  // namespace tessera::replay::loading_speed_test
