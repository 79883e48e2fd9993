// pack writes back its input unchanged, for every type of every attribute and every codec.
#include "base/png_codec.h"
#include "scene/capture_reader.h"
#include "tests/replay/glb_rules.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::pack_faithful_test {
namespace {

using scene::Capture;
using scene::Primitive;
using test::GltfAsset;

const std::vector<std::vector<std::string>>& codecs() {
  static const std::vector<std::vector<std::string>> kCodecs = {
      {"--method", "edgebreaker"}, {"--method", "sequential"}, {"--meshopt"},        {"--geometry", "quantised"},
      {"--geometry", "meshlet"},   {"--geometry", "dgf"},      {"--method", "none"}, {}};
  return kCodecs;
}

Capture packed(const GltfAsset& asset, const std::vector<std::string>& options) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "in.glb", asset.glb());
  std::vector<std::string> arguments = {"pack", (folder / "in.glb").string(), (folder / "out.glb").string()};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const ProcessResult r = run_tessera(arguments);
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(test::glb_faults(test::read_text(folder / "out.glb")), testing::IsEmpty());
  return scene::read_capture(folder / "out.glb");
}

// ---- Attributes -------------------------------------------------------------------------------------------------

constexpr int kSide = 6;  // vertices along a side of the sheet

// A sheet whose vertices lie at multiples of 1/8: every grid has them, so that they tell vertices apart.
std::vector<float> sheet_positions() {
  std::vector<float> p;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      p.insert(p.end(), {static_cast<float>(x) / 8, static_cast<float>(y) / 8, static_cast<float>((x * y) % 3) / 8});
  return p;
}
std::vector<std::uint16_t> sheet_indices() {
  std::vector<std::uint16_t> out;
  for (int y = 0; y + 1 < kSide; ++y)
    for (int x = 0; x + 1 < kSide; ++x) {
      const auto a = static_cast<std::uint16_t>(y * kSide + x), b = static_cast<std::uint16_t>(a + kSide);
      out.insert(out.end(), {a, static_cast<std::uint16_t>(a + 1), static_cast<std::uint16_t>(b + 1), a,
                             static_cast<std::uint16_t>(b + 1), b});
    }
  return out;
}

GltfAsset sheet() {
  GltfAsset asset;
  const int positions =
      asset.add_accessor("VEC3", sheet_positions(), {{"min", {0, 0, 0}}, {"max", {0.625, 0.625, 0.25}}});
  const int indices = asset.add_accessor("SCALAR", sheet_indices());
  asset.document["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}}};
  asset.document["nodes"] = {{{"mesh", 0}}};
  asset.document["scenes"] = {{{"nodes", {0}}}};
  asset.document["scene"] = 0;
  asset.document["extensionsUsed"] = {"KHR_mesh_quantization"};
  asset.document["extensionsRequired"] = {"KHR_mesh_quantization"};
  return asset;
}

// Scalars of a vertex's attribute as the renderer has them.
std::vector<float> attribute_of(const scene::Vertices& v, const std::string& name, std::size_t i) {
  const auto list = [](const auto& value, int n) {
    std::vector<float> out;
    for (int c = 0; c < n; ++c) out.push_back(value[c]);
    return out;
  };
  if (name == "NORMAL") return list(v.normals.at(i), 3);
  if (name == "TANGENT") return list(v.tangents.at(i), 4);
  if (name == "COLOR_0") return list(v.colors.at(i), 4);
  if (name.starts_with("TEXCOORD_")) return list(v.texcoords.at(static_cast<std::size_t>(name.back() - '0')).at(i), 2);
  std::vector<float> out(4, 0.0f);  // by joint
  for (std::size_t k = 0; k < 8; ++k) out[v.influences.at(i).joints[k] % 4u] += v.influences[i].weights[k];
  return out;
}

std::map<std::array<float, 3>, std::vector<float>> by_position(const Capture& capture, const std::string& name) {
  std::map<std::array<float, 3>, std::vector<float>> out;
  const scene::Vertices& v = capture.meshes.at(0).primitives.at(0).vertices;
  for (std::size_t i = 0; i < v.count(); ++i)
    out[{v.positions[i].x, v.positions[i].y, v.positions[i].z}] = attribute_of(v, name, i);
  return out;
}

struct Row {
  const char *name, *type;
  int component_type;
  bool normalized;
  double error;  // that the default bits allow
};

template <class T>
std::vector<T> values_of(const Row& row, Random& random, int unit) {
  const std::size_t components = row.type[3] == '2' ? 2 : row.type[3] == '3' ? 3 : 4;
  std::vector<T> out;
  for (int v = 0; v < kSide * kSide; ++v) {
    std::array<double, 4> x{};
    for (double& c : x) c = static_cast<double>(random.uniform(0.1f, 1.0f));
    if (row.name[0] == 'N' || (row.name[0] == 'T' && row.name[1] == 'A')) {
      const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      for (int c = 0; c < 3; ++c) x[static_cast<std::size_t>(c)] *= (random.coin() ? 1 : -1) / length;
      x[3] = random.coin() ? 1 : -1;
    }
    if (row.name[0] == 'J') x = {0, 1, 2, 3};
    if (row.name[0] == 'W') {
      const double sum = x[0] + x[1] + x[2] + x[3];
      for (double& c : x) c /= sum;
    }
    for (std::size_t c = 0; c < components; ++c)
      out.push_back(static_cast<T>(unit == 1 || row.name[0] == 'J' ? x[c] : std::lround(x[c] * unit)));
    // Weights of a vertex are one together.
    if (row.name[0] == 'W' && unit != 1)
      out[out.size() - 4] = static_cast<T>(unit - out[out.size() - 3] - out[out.size() - 2] - out.back());
  }
  return out;
}

int add_values(GltfAsset& asset, const Row& row, Random& random) {
  const json more = row.normalized ? json{{"normalized", true}} : json::object();
  // Vertex attributes lie at multiples of four bytes.
  const auto add = [&]<class T>(T, int unit) {
    const std::vector<T> values = values_of<T>(row, random, unit);
    const std::size_t components = values.size() / (kSide * kSide), stride = (components * sizeof(T) + 3) / 4 * 4;
    std::vector<std::uint8_t> bytes(stride * kSide * kSide, 0);
    for (std::size_t i = 0; i < values.size(); ++i)
      std::memcpy(&bytes[i / components * stride + i % components * sizeof(T)], &values[i], sizeof(T));
    const int view = asset.add_view(bytes, {{"byteStride", stride}, {"target", 34962}});
    return asset.add_accessor(row.type, row.component_type, values.size(), view, more);
  };
  switch (row.component_type) {
    case 5120:
      return add(std::int8_t{}, row.normalized ? 127 : 100);
    case 5121:
      return add(std::uint8_t{}, row.normalized ? 255 : 200);
    case 5122:
      return add(std::int16_t{}, row.normalized ? 32767 : 30000);
    case 5123:
      return add(std::uint16_t{}, row.normalized ? 65535 : 60000);
    default:
      return add(float{}, 1);
  }
}

const std::vector<Row>& rows() {
  static const std::vector<Row> kRows = {
      {"NORMAL", "VEC3", 5126, false, 0.02},       {"NORMAL", "VEC3", 5120, true, 0},
      {"NORMAL", "VEC3", 5122, true, 0},           {"TANGENT", "VEC4", 5126, false, 0.02},
      {"TANGENT", "VEC4", 5120, true, 0},          {"TANGENT", "VEC4", 5122, true, 0},
      {"TEXCOORD_0", "VEC2", 5126, false, 0.0005}, {"TEXCOORD_0", "VEC2", 5121, true, 0},
      {"TEXCOORD_0", "VEC2", 5123, true, 0},       {"TEXCOORD_0", "VEC2", 5120, true, 0},
      {"TEXCOORD_0", "VEC2", 5122, true, 0},       {"TEXCOORD_0", "VEC2", 5120, false, 0},
      {"TEXCOORD_0", "VEC2", 5121, false, 0},      {"TEXCOORD_0", "VEC2", 5122, false, 0},
      {"TEXCOORD_0", "VEC2", 5123, false, 0},      {"TEXCOORD_1", "VEC2", 5123, true, 0},
      {"COLOR_0", "VEC3", 5126, false, 0.004},     {"COLOR_0", "VEC4", 5126, false, 0.004},
      {"COLOR_0", "VEC3", 5121, true, 0},          {"COLOR_0", "VEC4", 5121, true, 0},
      {"COLOR_0", "VEC3", 5123, true, 0},          {"COLOR_0", "VEC4", 5123, true, 0},
      {"WEIGHTS_0", "VEC4", 5126, false, 0.006},   {"WEIGHTS_0", "VEC4", 5121, true, 1e-6},
      {"WEIGHTS_0", "VEC4", 5123, true, 1e-6},
  };
  return kRows;
}

GltfAsset sheet_with(const Row& row, Random& random) {
  GltfAsset asset = sheet();
  json& attributes = asset.document["meshes"][0]["primitives"][0]["attributes"];
  attributes[row.name] = add_values(asset, row, random);
  if (std::string_view(row.name) == "TEXCOORD_1") attributes["TEXCOORD_0"] = attributes[row.name];
  if (row.name[0] == 'W') {
    attributes["JOINTS_0"] = add_values(asset, {"JOINTS_0", "VEC4", 5121, false, 0}, random);
    asset.document["nodes"] = {
        {{"mesh", 0}, {"skin", 0}}, {{"children", {2, 3, 4}}}, json::object(), json::object(), json::object()};
    asset.document["skins"] = {{{"joints", {1, 2, 3, 4}}}};
    asset.document["scenes"][0]["nodes"] = {0, 1};
  }
  return asset;
}

TEST(PackFaithful, EveryTypeOfEveryAttributeComesBackFromEveryCodec) {
  Random random(7);
  for (const Row& row : rows())
    for (const auto& codec : codecs()) {
      SCOPED_TRACE(fmt::format("{} {} {}{} {}", row.name, row.type, row.component_type,
                               row.normalized ? " normalized" : "", codec.empty() ? "" : codec.back()));
      const GltfAsset asset = sheet_with(row, random);
      const test::TemporaryFolder folder;
      test::write_text(folder / "in.glb", asset.glb());
      const auto wanted = by_position(scene::read_capture(folder / "in.glb"), row.name),
                 got = by_position(packed(asset, codec), row.name);
      ASSERT_EQ(got.size(), wanted.size());
      const double error = codec.empty() || codec.back() != "none" ? row.error : 0;
      for (const auto& [position, values] : wanted) {
        ASSERT_TRUE(got.contains(position));
        for (std::size_t c = 0; c < values.size(); ++c)
          ASSERT_NEAR(got.at(position)[c], values[c], error + 1e-7) << "component " << c;
      }
    }
}

// Normalised positions, as exporters quantise them, and plain ones of few bits.
TEST(PackFaithful, QuantisedPositionsStayWhereTheyAre) {
  for (const auto& [component, normalized] : {std::pair{5122, true}, {5120, true}, {5122, false}, {5120, false}})
    for (const auto& codec : codecs()) {
      SCOPED_TRACE(fmt::format("{} {} {}", component, normalized, codec.empty() ? "" : codec.back()));
      GltfAsset asset = sheet();
      const double unit = !normalized ? 8 : component == 5122 ? 32767 : 127;
      const std::size_t stride = component == 5122 ? 8 : 4;
      std::vector<std::uint8_t> bytes(stride * kSide * kSide, 0);
      std::vector<std::int64_t> low(3, 1 << 20), high(3, -(1 << 20));
      const std::vector<float> positions = sheet_positions();
      for (std::size_t i = 0; i < positions.size(); ++i) {
        const std::int64_t value = std::lround(static_cast<double>(positions[i]) * unit);
        std::memcpy(&bytes[i / 3 * stride + i % 3 * (stride / 4)], &value, stride / 4);
        low[i % 3] = std::min(low[i % 3], value), high[i % 3] = std::max(high[i % 3], value);
      }
      const int view = asset.add_view(bytes, {{"byteStride", stride}, {"target", 34962}});
      json more = {{"min", low}, {"max", high}};
      if (normalized) more["normalized"] = true;
      asset.document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
          asset.add_accessor("VEC3", component, positions.size(), view, more);
      const test::TemporaryFolder folder;
      test::write_text(folder / "in.glb", asset.glb());
      const auto places = [](const Capture& capture) {
        std::set<std::array<float, 3>> out;
        for (const Vec3& p : capture.meshes.at(0).primitives.at(0).vertices.positions) out.insert({p.x, p.y, p.z});
        return out;
      };
      EXPECT_EQ(places(packed(asset, codec)), places(scene::read_capture(folder / "in.glb")));
    }
}

// ---- Normals that are no unit vectors ---------------------------------------------------------------------------

TEST(PackFaithful, NormalsAndTangentsWithoutALengthStayAsTheyAre) {
  for (const char* name : {"NORMAL", "TANGENT"})
    for (const auto& codec : codecs()) {
      SCOPED_TRACE(std::string(name) + (codec.empty() ? "" : " " + codec.back()));
      GltfAsset asset = sheet();
      const std::size_t n = name[0] == 'N' ? 3 : 4;
      std::vector<float> values;
      for (std::size_t v = 0; v < kSide * kSide; ++v) {
        values.insert(values.end(), {0, 0, v % 3 == 0 ? 0.0f : v % 3 == 1 ? 1.0f : 0.25f});
        if (n == 4) values.push_back(v % 2 == 0 ? 1.0f : -1.0f);
      }
      asset.document["meshes"][0]["primitives"][0]["attributes"][name] =
          asset.add_accessor(n == 3 ? "VEC3" : "VEC4", values);
      for (const auto& [position, got] : by_position(packed(asset, codec), name)) {
        const std::size_t v =
            static_cast<std::size_t>(std::lround(position[1] * 8) * kSide + std::lround(position[0] * 8));
        for (std::size_t c = 0; c < n; ++c) EXPECT_EQ(got[c], values[n * v + c]) << "vertex " << v;
      }
    }
}

// ---- Grids ------------------------------------------------------------------------------------------------------

// Triangles with these corners, a mesh of one primitive each or primitives of one mesh; `places` moves the meshes.
GltfAsset pieces(const std::vector<std::vector<Vec3>>& parts, bool one_mesh, const std::vector<Vec3>& places = {}) {
  GltfAsset asset;
  asset.document["scenes"] = {{{"nodes", json::array()}}};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::vector<float> p;
    Vec3 low = parts[k][0], high = low;
    for (const Vec3& v : parts[k]) p.insert(p.end(), {v.x, v.y, v.z}), low = glm::min(low, v), high = glm::max(high, v);
    const json primitive = {
        {"attributes",
         {{"POSITION",
           asset.add_accessor("VEC3", p, {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}})}}}};
    if (one_mesh && k > 0) {
      asset.document["meshes"][0]["primitives"].push_back(primitive);
      continue;
    }
    asset.document["meshes"].push_back({{"primitives", {primitive}}});
    json node = {{"mesh", k}};
    if (!places.empty()) node["translation"] = {places[k].x, places[k].y, places[k].z};
    asset.document["nodes"].push_back(node);
    asset.document["scenes"][0]["nodes"].push_back(k);
  }
  return asset;
}

// Where the vertices of each part lie in the world.
std::vector<std::set<std::array<double, 3>>> world_of(const Capture& capture, bool one_mesh) {
  std::vector<std::set<std::array<double, 3>>> out;
  for (std::size_t m = 0; m < capture.meshes.size(); ++m)
    for (const Primitive& primitive : capture.meshes[m].primitives) {
      out.emplace_back();
      const DVec3 place = capture.nodes[one_mesh ? 0 : m].transform.translation;
      for (const Vec3& p : primitive.vertices.positions) {
        const DVec3 w = place + DVec3(p);
        out.back().insert({w.x, w.y, w.z});
      }
    }
  return out;
}

std::size_t shared(const std::set<std::array<double, 3>>& a, const std::set<std::array<double, 3>>& b) {
  return static_cast<std::size_t>(std::count_if(a.begin(), a.end(), [&](const auto& p) { return b.contains(p); }));
}

TEST(PackFaithful, TouchingVerticesStillTouch) {  // LT2
  Random random(3);
  const auto on_edge = [&] { return Vec3(0.3f, random.uniform(-1, 1), random.uniform(-0.1f, 0.1f)); };
  for (const bool one_mesh : {true, false})
    for (const Vec3& place : {Vec3(0.0f), Vec3(2, 0, 0), Vec3(0.3f, 0.7f, 0)}) {
      if (one_mesh && place != Vec3(0.0f)) continue;
      std::vector<std::vector<Vec3>> parts(2);
      for (int t = 0; t < 40; ++t) {
        const Vec3 a = on_edge(), b = on_edge();
        parts[0].insert(parts[0].end(), {a, b, Vec3(random.uniform(-9, 0), random.uniform(-9, 9), 0)});
        parts[1].insert(parts[1].end(), {b, a, Vec3(random.uniform(0.4f, 0.6f), random.uniform(-1, 1), 0)});
      }
      // The second part lies elsewhere and is moved to where it touches.
      for (Vec3& p : parts[1]) p -= place;
      const GltfAsset asset = pieces(parts, one_mesh, {Vec3(0.0f), place});
      const test::TemporaryFolder folder;
      test::write_text(folder / "in.glb", asset.glb());
      const auto before = world_of(scene::read_capture(folder / "in.glb"), one_mesh);
      for (const auto& codec : codecs()) {
        SCOPED_TRACE(fmt::format("{} {} {}", one_mesh, place.x, codec.empty() ? "" : codec.back()));
        const auto after = world_of(packed(asset, codec), one_mesh);
        EXPECT_GE(shared(after[0], after[1]), shared(before[0], before[1]));
      }
    }
}

TEST(PackFaithful, AMirroredTwinTouchesToo) {  // LT2
  // The same sheet at 0 and at its width beside it.
  for (const float width : {1.0f, 0.3f}) {
    GltfAsset asset =
        pieces({{{0, 0, 0}, {width, 0.1f, 0}, {width, 0.7f, 0}, {0, 0.1f, 0}, {0, 0.7f, 0}, {0.1f, 0, 0}}}, true);
    asset.document["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {width, 0, 0}}}};
    asset.document["scenes"][0]["nodes"] = {0, 1};
    for (const auto& codec : codecs()) {
      const Capture capture = packed(asset, codec);
      std::set<double> xs;
      for (const Vec3& p : capture.meshes[0].primitives[0].vertices.positions) xs.insert(static_cast<double>(p.x));
      EXPECT_EQ(*xs.rbegin(), static_cast<double>(width)) << width;
    }
  }
}

TEST(PackFaithful, UndrawnVerticesMakeNoGridCoarser) {  // LT3
  const std::vector<float> sound = sheet_positions();
  for (const bool named : {false, true})
    for (const auto& codec : codecs()) {
      SCOPED_TRACE(fmt::format("{} {}", named, codec.empty() ? "" : codec.back()));
      GltfAsset asset = sheet();
      std::vector<float> positions = sound;
      for (float& v : positions) v *= 1.1f;
      const Vec3 far(1e7f, -1e7f, 1e7f);
      positions.insert(positions.end(), {far.x, far.y, far.z});
      std::vector<std::uint16_t> indices = sheet_indices();
      // A triangle without area.
      if (named) indices.insert(indices.end(), {36, 36, 0});
      json& primitive = asset.document["meshes"][0]["primitives"][0];
      primitive["attributes"]["POSITION"] = asset.add_accessor("VEC3", positions);
      primitive["indices"] = asset.add_accessor("SCALAR", indices);
      const Capture capture = packed(asset, codec);
      const Primitive& got = capture.meshes[0].primitives[0];
      double farthest = 0;
      for (const std::uint32_t index : got.indices) {
        const Vec3 p = got.vertices.positions[index];
        if (std::abs(p.x) > 10) continue;
        double nearest = 1e9;
        for (std::size_t i = 0; i < sound.size(); i += 3)
          nearest = std::min(nearest,
                             static_cast<double>(glm::length(p - 1.1f * Vec3(sound[i], sound[i + 1], sound[i + 2]))));
        farthest = std::max(farthest, nearest);
      }
      EXPECT_LT(farthest, 1e-4);
      EXPECT_GE(got.indices.size(), sheet_indices().size());
    }
}

// ---- Whole files ------------------------------------------------------------------------------------------------

TEST(PackFaithful, RangesOfPositionsAndKeyTimesAreThereThoughTheAssetLacksThem) {
  const GltfAsset asset = test::everything_asset();
  for (std::vector<std::string> options :
       {std::vector<std::string>{}, {"--meshopt"}, {"--method", "none"}, {"--subdivide"}}) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "in.glb", asset.glb());
    std::vector<std::string> arguments = {"pack", (folder / "in.glb").string(), (folder / "out.glb").string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProcessResult r = run_tessera(arguments);
    ASSERT_EQ(r.status, 0) << r.errors;
    const json d = test::glb_parts(test::read_text(folder / "out.glb")).document;
    const auto ranged = [&](const json& index) {
      const json& accessor = d["accessors"][index.get<std::size_t>()];
      return accessor.contains("min") && accessor.contains("max");
    };
    for (const json& mesh : d["meshes"])
      for (const json& primitive : mesh["primitives"]) {
        EXPECT_TRUE(ranged(primitive["attributes"]["POSITION"]));
        for (const json& target : primitive.value("targets", json::array()))
          if (target.contains("POSITION")) {
            EXPECT_TRUE(ranged(target["POSITION"]));
          }
      }
    for (const json& sampler : d["animations"][0]["samplers"]) {
      EXPECT_TRUE(ranged(sampler["input"]));
    }
  }
}

TEST(PackFaithful, AnImageThatNothingSamplesIsAPixelWithANotice) {
  GltfAsset asset = test::everything_asset();
  asset.document["images"].push_back({{"uri", "missing.png"}});
  const test::TemporaryFolder folder;
  test::write_text(folder / "in.glb", asset.glb());
  const ProcessResult r = run_tessera({"pack", (folder / "in.glb").string(), (folder / "out.glb").string()});
  EXPECT_EQ(r.status, 0) << r.errors;
  EXPECT_THAT(r.output, HasSubstr("missing.png: no such file; nothing samples it, a white pixel stands for it"));
  EXPECT_EQ(run_tessera({"inspect", "--strict", (folder / "out.glb").string()}).status, 0);
}

// ---- The Khronos validator --------------------------------------------------------------------------------------

// Errors of the validator in these files: file, code, pointer and message.
std::vector<std::string> validator_errors(const fs::path& folder, const std::vector<fs::path>& files,
                                          std::string& why_not) {
  std::vector<std::string> command = {"/usr/bin/env", "bash",
                                      std::string(TESSERA_SOURCE_DIR) + "/tests/replay/validate.sh", folder.string()};
  for (const fs::path& file : files) command.push_back(file.string());
  const ProcessResult made = test::run_process(command, {.seconds = 1500});
  if (made.status == 77) {
    why_not = made.output;
    return {};
  }
  EXPECT_EQ(made.status, 0) << made.errors;
  std::vector<std::string> lines;
  std::istringstream in(made.output);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Sample models, single material extensions, exporters' files and the shipped captures.
std::vector<fs::path> files_to_pack() {
  std::vector<fs::path> files;
  const auto add = [&](const fs::path& folder, const auto& wanted) {
    if (!fs::is_directory(folder)) return;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (wanted(entry.path())) files.push_back(entry.path());
  };
  add(fs::path(TESSERA_SOURCE_DIR) / "captures", [](const fs::path& file) { return file.extension() == ".glb"; });
  if (const auto assets = test::assets_folder()) {
    add(*assets, [](const fs::path& file) { return file.extension() == ".gltf"; });
    add(*assets / ".." / "materials", [](const fs::path& file) { return file.extension() == ".glb"; });
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(PackFaithful, TheValidatorFindsNoErrorInPackedFiles) {
  const fs::path tools = fs::path(TESSERA_BINARY_DIR) / "validator";
  const test::TemporaryFolder folder;
  std::vector<fs::path> written;
  const auto pack = [&](const fs::path& in, const std::vector<std::string>& codec) {
    const fs::path out = folder / fmt::format("{}.glb", written.size());
    std::vector<std::string> arguments = {"pack", in.string(), out.string()};
    arguments.insert(arguments.end(), codec.begin(), codec.end());
    const ProcessResult r = run_tessera(arguments, {.seconds = 300});
    EXPECT_EQ(r.status, 0) << in << ": " << r.errors;
    if (r.status == 0) written.push_back(out);
  };
  std::map<std::string, std::string> origin;  // of an output
  const auto pack_all = [&](const fs::path& in, const std::string& name, bool any_order) {
    for (const auto& codec : codecs()) {
      if (!any_order && !codec.empty() && codec.back() == "edgebreaker") continue;
      const std::size_t before = written.size();
      pack(in, codec);
      if (written.size() > before)
        origin[written.back().string()] = fmt::format("{} {}", name, codec.empty() ? "" : codec.back());
    }
  };
  Random random(8);
  std::vector<fs::path> inputs = files_to_pack();
  for (const fs::path& file : inputs) pack_all(file, file.filename().string(), false);
  for (const Row& row : rows()) {
    const fs::path in = folder / "in.glb";
    test::write_text(in, sheet_with(row, random).glb());
    pack_all(in, fmt::format("{} {} {}", row.name, row.type, row.component_type), true);
  }
  std::string why_not;
  std::set<std::string> of_inputs;  // file and code
  for (const std::string& line : validator_errors(tools, inputs, why_not))
    of_inputs.insert(fs::path(line.substr(0, line.find('\t'))).filename().string() + " " +
                     line.substr(line.find('\t') + 1, line.find('\t', line.find('\t') + 1) - line.find('\t') - 1));
  const std::vector<std::string> errors = validator_errors(tools, written, why_not);
  if (!why_not.empty()) GTEST_SKIP() << why_not;
  std::printf("%zu files\n", written.size());
  for (const std::string& line : errors) {
    const std::size_t tab = line.find('\t');
    const std::string from = origin[line.substr(0, tab)],
                      code = line.substr(tab + 1, line.find('\t', tab + 1) - tab - 1);
    if (!of_inputs.contains(from.substr(0, from.find(' ')) + " " + code)) ADD_FAILURE() << from << ": " << line;
  }

  // The failing twin: a count beyond its view is an error.
  GltfAsset broken = sheet();
  broken.document["accessors"][0]["count"] = 1000;
  test::write_text(folder / "broken.glb", broken.glb());
  EXPECT_FALSE(validator_errors(tools, {folder / "broken.glb"}, why_not).empty());
}

}  // namespace
}  // namespace tessera::replay::pack_faithful_test
