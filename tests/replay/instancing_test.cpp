// A replay of 10^5 instances of 10^4 triangles.
#include <sys/resource.h>

#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::instancing_test {
namespace {

constexpr int kSide = 317;    // of the field, in instances
constexpr int kSquares = 71;  // of a bumpy square: 10082 triangles
constexpr float kSpacing = 1.5f;

// A field of bumpy squares in random order, turned and scaled, and a camera that looks across from its middle.
test::GltfAsset field() {
  test::Random random(7);
  test::GltfAsset asset;
  std::vector<float> positions, translations, rotations, scales;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= kSquares; ++j)
    for (int i = 0; i <= kSquares; ++i) {
      const float x = static_cast<float>(i) / kSquares - 0.5f, z = static_cast<float>(j) / kSquares - 0.5f;
      positions.insert(positions.end(), {x, 0.2f * std::sin(9 * x) * std::cos(7 * z), z});
      if (i < kSquares && j < kSquares)
        for (const int k : {0, kSquares + 1, 1, 1, kSquares + 1, kSquares + 2})
          indices.push_back(static_cast<std::uint32_t>(j * (kSquares + 1) + i + k));
    }
  std::vector<int> order(kSide * kSide);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t k = order.size(); k > 1; --k)
    std::swap(order[k - 1], order[static_cast<std::size_t>(random.integer(0, static_cast<int>(k) - 1))]);
  for (const int place : order) {
    translations.insert(translations.end(), {kSpacing * static_cast<float>(place % kSide - kSide / 2), 0,
                                             kSpacing * static_cast<float>(place / kSide - kSide / 2)});
    const float angle = random.uniform(0, 3), scale = random.uniform(0.7f, 1.3f);
    rotations.insert(rotations.end(), {0, std::sin(angle), 0, std::cos(angle)});
    scales.insert(scales.end(), {scale, scale, scale});
  }
  const int p = asset.add_accessor("VEC3", positions), i = asset.add_accessor("SCALAR", indices),
            t = asset.add_accessor("VEC3", translations), r = asset.add_accessor("VEC4", rotations),
            s = asset.add_accessor("VEC3", scales);
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", p}}}, {"indices", i}}}}});
  asset.add("nodes",
            {{"mesh", 0},
             {"extensions",
              {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", t}, {"ROTATION", r}, {"SCALE", s}}}}}}}});
  asset.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}, {"zfar", 40}}}});
  asset.add("nodes", {{"camera", 0}, {"translation", {0, 3, 0}}, {"rotation", {-0.05, 0, 0, 0.99875}}});
  asset.document["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  return asset;
}

TEST(InstancedReplay, AHundredThousandTimesTenThousandTrianglesFit) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "field.glb", field().glb());
  const json drawn = json::parse(run_tessera({"inspect", (folder / "field.glb").string(), "--json"}).output)["drawn"];
  EXPECT_EQ(drawn["instances"], kSide * kSide);
  EXPECT_EQ(drawn["triangles"].get<std::uint64_t>(), std::uint64_t{kSide * kSide} * 2 * kSquares * kSquares);
  const test::ProcessResult r = run_tessera({"replay", (folder / "field.glb").string(), "--size", "320x180", "--spp",
                                             "4", "--quiet", "--no-report", "--out", (folder / "out").string()},
                                            {.seconds = 300});
  ASSERT_EQ(r.status, 0) << r.errors;
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  EXPECT_LT(usage.ru_maxrss, 1L << 20) << "KiB, of 4 GiB that are allowed";
  const json counters = json::parse(test::read_text(folder / "out" / "stats.json"))["frames"][0]["counters"];
  const auto value = [&](const char* name) { return counters[name].get<double>(); };
  EXPECT_EQ(value("frontend.instances"), kSide * kSide);
  EXPECT_GT(value("frontend.instances_culled"), 0.98 * value("frontend.instances"));
  EXPECT_LT(value("frontend.instances_tested"), 0.05 * value("frontend.instances"));
  EXPECT_GT(value("tilecore.samples_visible"), 10000);
}

}  // namespace
}  // namespace tessera::replay::instancing_test
