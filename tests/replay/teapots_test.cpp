// Vertices that index-driven vertex shading stores, beside the vertices that a Mali-G72 stored of the same scene: 153
// teapots of KhronosGroup/Vulkan-Samples. The scene is no part of the project: where its folder is missing these
// tests are skipped.
#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::replay::teapots_test {
namespace {

using baselines::BaselineCounters;
using baselines::SchemeId;

constexpr int kWidth = 2960, kHeight = 1440;  // of the sample; a frame takes some seconds
// From counters of the GPU: bytes written with single precision less those with half precision, over 18.
constexpr double kSilicon = 378'555;

// TESSERA_SILICON, else beside the sources.
fs::path silicon() {
  const char* named = std::getenv("TESSERA_SILICON");
  return named != nullptr ? fs::path(named) : fs::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "silicon";
}

// ---- The independent count --------------------------------------------------------------------------------------

using Vector = std::array<double, 3>;

std::string decode_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  unsigned bits = 0, held = 0;
  for (const char c : text) {
    if (c == '=') break;
    held = held << 6 | static_cast<unsigned>(kDigits.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    out.push_back(static_cast<char>(held >> bits & 255u));
  }
  return out;
}

// An accessor's numbers of type T in sequence.
template <class T>
std::vector<T> numbers(const json& file, std::size_t accessor, std::size_t components) {
  const json& a = file["accessors"][accessor];
  const json& view = file["bufferViews"][a["bufferView"].get<std::size_t>()];
  const std::string uri = file["buffers"][view["buffer"].get<std::size_t>()]["uri"];
  const std::string bytes = decode_base64(std::string_view(uri).substr(uri.find(',') + 1));
  std::vector<T> out(a["count"].get<std::size_t>() * components);
  std::memcpy(out.data(), &bytes[view.value("byteOffset", std::size_t{0})], out.size() * sizeof(T));
  return out;
}

// A point of a node: turned by its quaternion, then moved.
Vector placed(const json& node, const Vector& p) {
  const std::array<double, 4> q = node["rotation"];
  const Vector move = node["translation"], axis = {q[0], q[1], q[2]};
  const auto cross = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  Vector t = cross(axis, p);
  for (double& c : t) c *= 2;
  const Vector turn = cross(axis, t);
  Vector out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = p[c] + q[3] * t[c] + turn[c] + move[c];
  return out;
}

// Distinct vertices of the triangles that face the camera and are not wholly beyond one side of the view, over all nodes:
// from the file alone, in double precision.
std::size_t stored_vertices(const fs::path& path) {
  const json file = json::parse(test::read_text(path));
  const json& primitive = file["meshes"][0]["primitives"][0];
  const auto positions = numbers<float>(file, primitive["attributes"]["POSITION"], 3);
  const auto indices = numbers<std::uint16_t>(file, primitive["indices"], 1);
  Vector eye{};
  for (const json& node : file["nodes"])
    if (node.contains("camera")) eye = node["translation"];
  const double top = std::tan(file["cameras"][0]["perspective"]["yfov"].get<double>() / 2),
               right = top * kWidth / kHeight;
  std::size_t count = 0;
  for (const json& node : file["nodes"]) {
    if (!node.contains("mesh")) continue;
    std::vector<Vector> seen(positions.size() / 3);  // from the camera, which looks along -z
    for (std::size_t v = 0; v < seen.size(); ++v) {
      const Vector p = placed(node, {static_cast<double>(positions[3 * v]), static_cast<double>(positions[3 * v + 1]),
                                     static_cast<double>(positions[3 * v + 2])});
      for (std::size_t c = 0; c < 3; ++c) seen[v][c] = p[c] - eye[c];
    }
    std::set<std::uint16_t> kept;
    for (std::size_t t = 0; t < indices.size(); t += 3) {
      const Vector &a = seen[indices[t]], &b = seen[indices[t + 1]], &c = seen[indices[t + 2]];
      // The volume between the triangle and the eye is negative where the corners run counterclockwise as they are seen.
      const double volume =
          a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
      if (volume >= 0) continue;
      const auto all_beyond = [&](std::size_t axis, double sign, double slope) {
        return std::all_of(&indices[t], &indices[t] + 3,
                           [&](std::uint16_t v) { return sign * seen[v][axis] > -seen[v][2] * slope; });
      };
      if (all_beyond(0, 1, right) || all_beyond(0, -1, right) || all_beyond(1, 1, top) || all_beyond(1, -1, top))
        continue;
      kept.insert(&indices[t], &indices[t] + 3);
    }
    count += kept.size();
  }
  return count;
}

// ---- The schemes ------------------------------------------------------------------------------------------------

// `part`: of the sample's width and height.
baselines::BaselineSet measure(const fs::path& scene, tilecore::AttributePrecision attributes, int part = 1) {
  const int width = kWidth / part, height = kHeight / part;
  const scene::Capture capture = scene::read_capture(scene);
  gpu::RunSettings settings;
  settings.sampling.samples_per_pixel = 1;
  settings.shading.attributes = attributes;
  gpu::GpuConfiguration gpu;
  gpu.frame_buffer.compression =
      tilecore::FrameBufferCompression::kNone;  // colours differ, and so do their compressed sizes
  gpu::Device device(capture, gpu, settings, {width, height, {0, 0, width, height}});
  baselines::BaselineObserver schemes;
  device.set_observer(&schemes);
  device.render(0);
  return schemes.last();
}

bool within_5_percent(std::uint64_t vertices, double expected) {
  return std::abs(static_cast<double>(vertices) / expected - 1) <= 0.05;
}

class Teapots : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(silicon() / "make_teapots.py")) GTEST_SKIP() << "no teapots in " << silicon().string();
    const test::ProcessResult made =
        test::run_process({"/bin/sh", "-c", "cd \"$1\" && exec python3 \"$2/make_teapots.py\" \"$2/teapot.gltf\"", "sh",
                           folder_.path().string(), fs::absolute(silicon()).string()});
    ASSERT_EQ(made.status, 0) << made.errors;
  }
  // With colours of vertices the layout equals the sample's: 3 vectors of 3.
  fs::path scene() const { return folder_.path() / "teapots1.gltf"; }
  fs::path plain_scene() const { return folder_.path() / "teapots0.gltf"; }

  test::TemporaryFolder folder_;
};

TEST_F(Teapots, PostPositionStoresTheVerticesThatTheSiliconStores) {
  const std::size_t counted = stored_vertices(scene());
  const baselines::BaselineSet single = measure(scene(), tilecore::AttributePrecision::kFloat),
                               half = measure(scene(), tilecore::AttributePrecision::kHalf);
  const BaselineCounters &stored = single[SchemeId::kPostPosition], &halved = half[SchemeId::kPostPosition];
  std::printf("vertices stored %llu, counted %zu, Mali-G72 %.0f\n",
              static_cast<unsigned long long>(stored.vertices_stored), counted, kSilicon);
  EXPECT_TRUE(within_5_percent(stored.vertices_stored, static_cast<double>(counted))) << stored.vertices_stored;
  EXPECT_TRUE(within_5_percent(stored.vertices_stored, kSilicon)) << stored.vertices_stored;
  EXPECT_EQ(halved.vertices_stored, stored.vertices_stored);
  EXPECT_EQ(stored.domain_evaluations, stored.vertices_stored);

  // The other writes shrink a little as well: addresses are smaller.
  const auto saved = [](const BaselineCounters& more, const BaselineCounters& less) {
    return static_cast<double>(more.queue_bytes_written - less.queue_bytes_written) /
           static_cast<double>(more.vertices_stored);
  };
  EXPECT_NEAR(saved(stored, halved), 18, 0.1);
  const double vertex_bytes =
      static_cast<double>(stored.queue_bytes_written) / static_cast<double>(stored.vertices_stored);
  EXPECT_GT(vertex_bytes, 52);
  EXPECT_LT(vertex_bytes, 52 * 1.1) << "lists and indices are little beside vertices";
  EXPECT_LT(halved.queue_bytes_read, stored.queue_bytes_read);
  EXPECT_LT(halved.dram_bytes, stored.dram_bytes);
  EXPECT_LT(halved.energy_nj, stored.energy_nj);
  const BaselineCounters &whole = single[SchemeId::kPostTessellation], &whole_half = half[SchemeId::kPostTessellation];
  EXPECT_NEAR(saved(whole, whole_half), 18, 0.1);
  EXPECT_LT(whole_half.queue_bytes_read, whole.queue_bytes_read);
  // Machines that store no vertex have nothing to halve.
  for (const SchemeId s : {SchemeId::kDeferredVertex, SchemeId::kVisibilityStream, SchemeId::kControlList}) {
    EXPECT_EQ(half[s].queue_bytes_written, single[s].queue_bytes_written);
    EXPECT_EQ(half[s].dram_bytes, single[s].dram_bytes);
  }

  // The twins: a vertex for each block that uses it, and the position of every vertex, are other numbers.
  EXPECT_FALSE(within_5_percent(whole.vertices_stored, static_cast<double>(counted))) << whole.vertices_stored;
  EXPECT_FALSE(within_5_percent(stored.position_evaluations, static_cast<double>(counted)));
}

// The shipped layout without colours: a point and a normal, 24 bytes.
TEST_F(Teapots, WithoutColoursHalfPrecisionSaves12Bytes) {
  const baselines::BaselineSet single = measure(plain_scene(), tilecore::AttributePrecision::kFloat, 8),
                               half = measure(plain_scene(), tilecore::AttributePrecision::kHalf, 8);
  const BaselineCounters &stored = single[SchemeId::kPostPosition], &halved = half[SchemeId::kPostPosition];
  EXPECT_NEAR(static_cast<double>(stored.queue_bytes_written - halved.queue_bytes_written) /
                  static_cast<double>(stored.vertices_stored),
              12, 0.1);
}

// Without its index buffer a teapot has a vertex for each corner of each triangle: nothing is shared.
TEST_F(Teapots, ATwinWithoutAnIndexBufferIsFound) {
  json file = json::parse(test::read_text(plain_scene()));
  json& primitive = file["meshes"][0]["primitives"][0];
  const auto indices = numbers<std::uint16_t>(file, primitive["indices"], 1);
  std::string bytes;
  for (const char* name : {"POSITION", "NORMAL"}) {
    const auto from = numbers<float>(file, primitive["attributes"][name], 3);
    json& accessor = file["accessors"][primitive["attributes"][name].get<std::size_t>()];
    accessor["bufferView"] = file["bufferViews"].size();
    accessor["count"] = indices.size();
    file["bufferViews"].push_back(
        {{"buffer", file["buffers"].size()}, {"byteOffset", bytes.size()}, {"byteLength", indices.size() * 12}});
    for (const std::uint16_t v : indices)
      bytes.append(reinterpret_cast<const char*>(&from[std::size_t{3} * v]), 12);  // NOLINT
  }
  primitive.erase("indices");
  test::write_text(folder_.path() / "corners.bin", bytes);
  file["buffers"].push_back({{"byteLength", bytes.size()}, {"uri", "corners.bin"}});
  test::write_text(folder_.path() / "corners.gltf", file.dump());
  const baselines::BaselineSet set = measure(folder_.path() / "corners.gltf", tilecore::AttributePrecision::kFloat, 8);
  const std::uint64_t stored = set[SchemeId::kPostPosition].vertices_stored;
  EXPECT_FALSE(within_5_percent(stored, static_cast<double>(stored_vertices(plain_scene())))) << stored;
  EXPECT_EQ(stored, 3 * set[SchemeId::kPostPosition].primitives);
}

}  // namespace
}  // namespace tessera::replay::teapots_test
