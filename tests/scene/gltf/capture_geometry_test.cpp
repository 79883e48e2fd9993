#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::capture_geometry_test {
namespace {

using test::GltfAsset;

// A mesh of one primitive; `more` is merged into it.
Primitive primitive_of(GltfAsset asset, const json& attributes, const json& more = json::object()) {
  json primitive = {{"attributes", attributes}};
  primitive.update(more);
  asset.add("meshes", {{"primitives", json::array({primitive})}});
  return test::read_asset(asset).meshes.at(0).primitives.at(0);
}

std::vector<float> some_positions(int count) {
  std::vector<float> out;
  for (int i = 0; i < 3 * count; ++i) out.push_back(static_cast<float>((i * 7) % 11) - 3.5f);
  return out;
}

void expect_positions(const Primitive& primitive, const std::vector<float>& scalars) {
  ASSERT_EQ(primitive.vertices.count(), scalars.size() / 3);
  for (std::size_t i = 0; i < scalars.size(); ++i)
    EXPECT_EQ(primitive.vertices.positions[i / 3][static_cast<int>(i % 3)], scalars[i]) << i;
}

// ---- Topology ---------------------------------------------------------------------------------------------------

// glTF 2.0 section 3.7.2.1: triangle i of n vertices, as numbers of vertices.
std::vector<std::uint32_t> triangles_by_definition(int mode, std::uint32_t n) {
  std::vector<std::uint32_t> out;
  if (mode == 4)
    for (std::uint32_t i = 0; i + 3 <= n; i += 3) out.insert(out.end(), {i, i + 1, i + 2});
  if (mode == 5)
    for (std::uint32_t i = 0; i + 2 < n; ++i) out.insert(out.end(), {i, i + (1 + i % 2), i + (2 - i % 2)});
  if (mode == 6)
    for (std::uint32_t i = 0; i + 2 < n; ++i) out.insert(out.end(), {i + 1, i + 2, 0});
  return out;
}

// Corners of each triangle turned so that the smallest comes first: which corner begins a triangle is of no account.
std::vector<std::array<std::uint32_t, 3>> turned(const std::vector<std::uint32_t>& indices) {
  std::vector<std::array<std::uint32_t, 3>> out;
  for (std::size_t t = 0; t + 3 <= indices.size(); t += 3) {
    std::array<std::uint32_t, 3> triangle = {indices[t], indices[t + 1], indices[t + 2]};
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    out.push_back(triangle);
  }
  return out;
}

TEST(CaptureTriangles, WindAsTheDefinitionOfListStripAndFanSays) {
  for (const int mode : {4, 5, 6})
    for (const int count : {3, 4, 5, 6, 7, 9}) {
      GltfAsset asset;
      const int p = asset.add_accessor("VEC3", some_positions(count));
      const Primitive primitive = primitive_of(asset, {{"POSITION", p}}, {{"mode", mode}});
      EXPECT_EQ(turned(primitive.indices), turned(triangles_by_definition(mode, static_cast<std::uint32_t>(count))))
          << mode << " " << count;
    }
}

template <class Index>
void expect_indexed_like_definition() {
  for (const int mode : {4, 5, 6}) {
    GltfAsset asset;
    const int p = asset.add_accessor("VEC3", some_positions(6));
    const std::vector<Index> order = {5, 0, 3, 1, 4, 2};
    const int i = asset.add_accessor("SCALAR", order);
    const Primitive primitive = primitive_of(asset, {{"POSITION", p}}, {{"mode", mode}, {"indices", i}});
    std::vector<std::uint32_t> expected = triangles_by_definition(mode, 6);
    for (std::uint32_t& index : expected) index = order[index];
    EXPECT_EQ(turned(primitive.indices), turned(expected)) << mode;
  }
}
TEST(CaptureTriangles, TakeIndicesOfEveryType) {
  expect_indexed_like_definition<std::uint8_t>();
  expect_indexed_like_definition<std::uint16_t>();
  expect_indexed_like_definition<std::uint32_t>();
}

TEST(CaptureTriangles, LeaveOutAnIncompleteOne) {
  GltfAsset asset;
  const int p = asset.add_accessor("VEC3", some_positions(5));
  EXPECT_EQ(primitive_of(asset, {{"POSITION", p}}).indices, (std::vector<std::uint32_t>{0, 1, 2}));
}

// ---- Accessors --------------------------------------------------------------------------------------------------

// glTF 2.0 section 3.6.2.2.
template <class T>
double normalized(T value) {
  return std::max(static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
}

template <class T>
void expect_texcoords_of(bool normalize) {
  GltfAsset asset;
  asset.document["extensionsUsed"] = {"KHR_mesh_quantization"};
  const std::vector<T> values = {0, 1, 5, std::numeric_limits<T>::max(), std::numeric_limits<T>::min(), 100};
  // Two components of small types do not fill four bytes: a stride of four.
  std::vector<T> padded;
  const std::size_t pitch = 4 / sizeof(T);
  for (std::size_t v = 0; v < 3; ++v) {
    padded.insert(padded.end(), {values[2 * v], values[2 * v + 1]});
    padded.resize((v + 1) * pitch, T{77});
  }
  const int view = asset.add_view({reinterpret_cast<const std::uint8_t*>(padded.data()), padded.size() * sizeof(T)},
                                  {{"byteStride", 4}});
  const int p = asset.add_accessor("VEC3", some_positions(3));
  const int component_type = sizeof(T) == 1 ? (std::is_signed_v<T> ? 5120 : 5121) : (std::is_signed_v<T> ? 5122 : 5123);
  const int t = asset.add("accessors", {{"bufferView", view},
                                        {"componentType", component_type},
                                        {"type", "VEC2"},
                                        {"count", 3},
                                        {"normalized", normalize}});
  const Primitive primitive = primitive_of(asset, {{"POSITION", p}, {"TEXCOORD_0", t}});
  for (std::size_t i = 0; i < 6; ++i) {
    const double expected = normalize ? normalized(values[i]) : static_cast<double>(values[i]);
    EXPECT_NEAR(static_cast<double>(primitive.vertices.texcoords.at(0)[i / 2][static_cast<int>(i % 2)]), expected,
                1e-7 * std::max(1.0, std::abs(expected)))
        << i;
  }
}
TEST(CaptureAccessors, MapIntegersAsTheirTypeAndNormalizationSay) {
  for (const bool normalize : {false, true}) {
    expect_texcoords_of<std::int8_t>(normalize);
    expect_texcoords_of<std::uint8_t>(normalize);
    expect_texcoords_of<std::int16_t>(normalize);
    expect_texcoords_of<std::uint16_t>(normalize);
  }
}

TEST(CaptureAccessors, ReadQuantizedPositionsAndNormals) {
  GltfAsset asset;
  asset.document["extensionsUsed"] = {"KHR_mesh_quantization"};
  asset.document["extensionsRequired"] = {"KHR_mesh_quantization"};
  const std::vector<std::uint16_t> positions = {0, 1, 65535, 0, 300, 2, 7, 0, 9, 9, 1, 0};  // fourth: padding
  const std::vector<std::int8_t> normals = {127, 0, 0, 0, -127, -128, 64, 0, 0, 1, 2, 0};
  const int pv = asset.add_view({reinterpret_cast<const std::uint8_t*>(positions.data()), 24}, {{"byteStride", 8}});
  const int nv = asset.add_view({reinterpret_cast<const std::uint8_t*>(normals.data()), 12}, {{"byteStride", 4}});
  const int p = asset.add("accessors", {{"bufferView", pv}, {"componentType", 5123}, {"type", "VEC3"}, {"count", 3}});
  const int n = asset.add(
      "accessors", {{"bufferView", nv}, {"componentType", 5120}, {"type", "VEC3"}, {"count", 3}, {"normalized", true}});
  const Primitive primitive = primitive_of(asset, {{"POSITION", p}, {"NORMAL", n}});
  for (std::size_t v = 0; v < 3; ++v)
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(primitive.vertices.positions[v][static_cast<int>(c)], static_cast<float>(positions[4 * v + c]));
      EXPECT_NEAR(static_cast<double>(primitive.vertices.normals[v][static_cast<int>(c)]),
                  normalized(normals[4 * v + c]), 1e-7);
    }
}

TEST(CaptureAccessors, FindInterleavedElementsByStrideAndOffset) {
  const int count = 4;
  const std::vector<float> positions = some_positions(count);
  for (const std::size_t stride : {24u, 28u, 252u}) {
    std::vector<float> mixed(stride / 4 * count, -99.0f);
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t c = 0; c < 3; ++c) {
        mixed[v * stride / 4 + c] = static_cast<float>(c == 2);
        mixed[v * stride / 4 + 3 + c] = positions[3 * v + c];
      }
    GltfAsset asset;
    const int view = asset.add_view({reinterpret_cast<const std::uint8_t*>(mixed.data()), mixed.size() * 4},
                                    {{"byteStride", stride}});
    const json accessor = {{"bufferView", view}, {"componentType", 5126}, {"type", "VEC3"}, {"count", count}};
    const int n = asset.add("accessors", accessor), p = asset.add("accessors", accessor);
    asset.document["accessors"][static_cast<std::size_t>(p)]["byteOffset"] = 12;
    const Primitive primitive = primitive_of(asset, {{"POSITION", p}, {"NORMAL", n}});
    expect_positions(primitive, positions);
    EXPECT_EQ(primitive.vertices.normals[3], Vec3(0, 0, 1));
  }
}

TEST(CaptureAccessors, ReplaceSparseElementsOfDataOrOfZeros) {
  for (const bool with_view : {true, false}) {
    GltfAsset asset;
    std::vector<float> expected = some_positions(6);
    const int p = asset.add_accessor("VEC3", expected);
    json& accessor = asset.document["accessors"][0];
    if (!with_view) accessor.erase("bufferView"), expected.assign(18, 0.0f);
    const std::vector<std::uint8_t> indices = {9, 9, 1, 4};  // the first two lie before the offset
    const std::vector<float> values = {10, 11, 12, 20, 21, 22};
    const int iv = asset.add_view(indices),
              vv = asset.add_view({reinterpret_cast<const std::uint8_t*>(values.data()), 24});
    asset.document["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", iv}, {"byteOffset", 2}, {"componentType", 5121}}},
        {"values", {{"bufferView", vv}}}};
    for (const std::size_t k : {0u, 1u}) std::copy_n(&values[3 * k], 3, &expected[3 * std::size_t{indices[2 + k]}]);
    expect_positions(primitive_of(asset, {{"POSITION", p}}), expected);
  }
}

TEST(CaptureAccessors, GiveColorsOfThreeComponentsAnAlphaOf1) {
  GltfAsset asset;
  const int p = asset.add_accessor("VEC3", some_positions(3));
  const int rgb = asset.add_accessor<float>("VEC3", {0.25f, 0.5f, 0.75f, 0, 0, 0, 1, 1, 1});
  const int rgba = asset.add_accessor<std::uint8_t>("VEC4", {0, 51, 102, 153, 0, 0, 0, 0, 255, 255, 255, 255},
                                                    {{"normalized", true}});
  EXPECT_EQ(primitive_of(asset, {{"POSITION", p}, {"COLOR_0", rgb}}).vertices.colors[0],
            Vec4(0.25f, 0.5f, 0.75f, 1.0f));
  const Vec4 color = primitive_of(asset, {{"POSITION", p}, {"COLOR_0", rgba}}).vertices.colors[0];
  for (int c = 0; c < 4; ++c) EXPECT_NEAR(static_cast<double>(color[c]), 0.2 * c, 1e-7);
}

// ---- Skins and morph targets ------------------------------------------------------------------------------------

TEST(CaptureInfluences, AreRenormalizedOverBothSets) {
  GltfAsset asset;
  const int p = asset.add_accessor("VEC3", some_positions(3));
  std::vector<std::uint16_t> joints0, joints1;
  std::vector<float> weights0, weights1;
  for (int v = 0; v < 3; ++v)
    for (int k = 0; k < 4; ++k) {
      joints0.push_back(static_cast<std::uint16_t>(k)), joints1.push_back(static_cast<std::uint16_t>(4 + k));
      weights0.push_back(v == 2 ? 0.0f : static_cast<float>(k + 1)), weights1.push_back(v == 0 ? 0.5f : 0.0f);
    }
  const json attributes = {{"POSITION", p},
                           {"JOINTS_0", asset.add_accessor("VEC4", joints0)},
                           {"WEIGHTS_0", asset.add_accessor("VEC4", weights0)},
                           {"JOINTS_1", asset.add_accessor("VEC4", joints1)},
                           {"WEIGHTS_1", asset.add_accessor("VEC4", weights1)}};
  const Primitive primitive = primitive_of(asset, attributes);
  for (std::size_t k = 0; k < 8; ++k) {
    const SkinInfluence& all = primitive.vertices.influences[0];
    EXPECT_EQ(all.joints[k], k);
    EXPECT_NEAR(static_cast<double>(all.weights[k]), (k < 4 ? static_cast<double>(k + 1) : 0.5) / 12.0, 1e-7);
    EXPECT_NEAR(static_cast<double>(primitive.vertices.influences[1].weights[k]),
                k < 4 ? static_cast<double>(k + 1) / 10.0 : 0.0, 1e-7);
    EXPECT_EQ(primitive.vertices.influences[2].weights[k], k == 0 ? 1.0f : 0.0f) << "no weight at all: the first joint";
  }
}

TEST(CaptureMorphTargets, KeepTheDifferencesOfEachAttribute) {
  const Capture capture = test::read_asset(test::everything_asset());
  const Mesh& mesh = capture.meshes.at(0);
  EXPECT_EQ(mesh.default_weights, std::vector<float>{0.5f});
  const MorphTarget& target = mesh.primitives.at(0).vertices.morph_targets.at(0);
  EXPECT_EQ(target.positions, (std::vector<Vec3>{{0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}));
  EXPECT_TRUE(target.normals.empty());
}

TEST(CapturePatches, KeepTheOrderOfTheirControlPoints) {
  const Capture capture = test::read_asset(test::everything_asset());
  const Primitive& patch = capture.meshes.at(1).primitives.at(0);
  EXPECT_EQ(patch.kind, Primitive::Kind::kBezierPatches);
  for (std::size_t n = 0; n < 16; ++n) {
    const Vec3 grid(static_cast<float>(n % 4) / 3.0f, static_cast<float>(n / 4) / 3.0f, 0.0f);
    const Vec3 expected = n == 5   ? Vec3(0.3f, 0.3f, 0.5f)
                          : n == 6 ? Vec3(0.6f, 0.3f, 0.5f)
                                   : grid;  // sparse replaces two
    EXPECT_EQ(patch.vertices.positions[n], expected) << n;
  }
}

// ---- Draco ------------------------------------------------------------------------------------------------------

// Triangles as positions and texture coordinates, sorted: the same surface however it is numbered.
std::vector<std::vector<double>> soup(const Primitive& primitive) {
  std::vector<std::vector<double>> out;
  for (const auto& triangle : turned(primitive.indices)) {
    std::vector<std::vector<double>> corners;
    for (const std::uint32_t i : triangle) {
      const Vec3 p = primitive.vertices.positions[i];
      const Vec2 t = primitive.vertices.texcoords.at(0)[i];
      corners.push_back({});
      for (const float v : {p.x, p.y, p.z, t.x, t.y})
        corners.back().push_back(std::round(static_cast<double>(v) * 1000.0) / 1000.0 + 0.0);
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    out.emplace_back();
    for (const auto& corner : corners) out.back().insert(out.back().end(), corner.begin(), corner.end());
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(CaptureDraco, DecodesToTheSurfaceThatWasCompressed) {
  GltfAsset plain;
  const json attributes = {{"POSITION", plain.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})},
                           {"TEXCOORD_0", plain.add_accessor<float>("VEC2", {0, 0, 1, 0, 0, 1, 1, 1})}};
  const int indices = plain.add_accessor<std::uint16_t>("SCALAR", {0, 1, 2, 2, 1, 3});
  const auto expected = soup(primitive_of(plain, attributes, {{"indices", indices}}));
  for (const bool sequential : {true, false})
    EXPECT_EQ(soup(test::read_asset(test::draco_asset(sequential)).meshes.at(0).primitives.at(0)), expected);
}

TEST(CaptureDraco, KeepsTheNumberingOfSequentialStreams) {
  const Capture capture = test::read_asset(test::draco_asset(true));
  EXPECT_EQ(capture.meshes.at(0).primitives.at(0).indices, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3}));
}

}  // namespace
}  // namespace tessera::scene::capture_geometry_test
