// tessera pack --geometry: clusters in the encodings of the emulated memory, and scene/gltf/clusters_reader.cpp, which reads them.
#include "base/error.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "replay/pack/meshopt_encoder.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/tests.h"

namespace tessera::replay::pack_geometry_test {
namespace {

using scene::GeometryEncoding;

constexpr std::array kEncodings{GeometryEncoding::kQuantised, GeometryEncoding::kMeshlet, GeometryEncoding::kDgf};

PackOptions plain() {
  PackOptions options;
  options.method = PackMethod::kMeshopt;
  options.bits = kMeshoptBits;
  return options;
}
PackOptions encoded(GeometryEncoding encoding) {
  PackOptions options = plain();
  options.geometry = encoding;
  return options;
}

json& clusters_of(json& document) { return document["meshes"][0]["primitives"][0]["extensions"]["TESSERA_clusters"]; }

// Corners of all triangles with all that vertices have, each triangle from its least corner on.
using Corner = std::vector<float>;
std::multiset<std::array<Corner, 3>> soup(const scene::Primitive& primitive) {
  const scene::Vertices& v = primitive.vertices;
  const auto corner = [&](std::uint32_t k) {
    Corner out;
    const auto add = [&](const auto& vector, int count) {
      for (int c = 0; c < count; ++c) out.push_back(vector[c] + 0.0f);
    };
    add(v.positions[k], 3);
    if (!v.normals.empty()) add(v.normals[k], 3);
    if (!v.tangents.empty()) add(v.tangents[k], 4);
    if (!v.colors.empty()) add(v.colors[k], 4);
    for (const auto& set : v.texcoords)
      if (!set.empty()) add(set[k], 2);
    if (!v.influences.empty()) out.insert(out.end(), v.influences[k].weights.begin(), v.influences[k].weights.end());
    return out;
  };
  std::multiset<std::array<Corner, 3>> out;
  for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
    const Corner a = corner(primitive.indices[i]), b = corner(primitive.indices[i + 1]),
                 c = corner(primitive.indices[i + 2]);
    out.insert(std::min({std::array{a, b, c}, std::array{b, c, a}, std::array{c, a, b}}));
  }
  return out;
}

TEST(PackGeometry, HasTheVerticesAndTrianglesThatMeshoptHas) {
  for (const GltfSource& source : {dressed_grid(), grid()}) {
    const Packed without(source, plain());
    const auto wanted = soup(without.after().meshes[0].primitives[0]);
    for (const GeometryEncoding encoding : kEncodings) {
      const Packed p(source, encoded(encoding));
      json document = p.parts.document;
      EXPECT_EQ(p.report.in_clusters, 1u);
      ASSERT_EQ(clusters_of(document)["encoding"], word(encoding));
      for (const char* list : {"extensionsUsed", "extensionsRequired"})
        EXPECT_TRUE(document[list].get<std::set<std::string>>().contains("TESSERA_clusters"));
      const scene::Capture after = p.after();
      EXPECT_TRUE(after.notices.empty());
      const scene::Primitive& read = after.meshes[0].primitives[0];
      EXPECT_EQ(read.triangles_of_cluster.size(), clusters_of(document)["clusters"]);
      EXPECT_EQ(soup(read), wanted);
    }
  }
}

TEST(PackGeometry, IsDeterministicAndPackingAgainByAnyMethodKeepsIt) {
  for (const GeometryEncoding encoding : kEncodings) {
    const Packed p(dressed_grid(), encoded(encoding)), again(dressed_grid(), encoded(encoding));
    EXPECT_TRUE(p.bytes == again.bytes);
    EXPECT_THAT(glb_faults(p.bytes), IsEmpty());
    for (const PackOptions& options : {encoded(encoding), plain(), encoded(GeometryEncoding::kMeshlet)}) {
      pack_capture(p.target, p.folder / "twice.glb", options);
      EXPECT_TRUE(read_text(p.folder / "twice.glb") == p.bytes);
    }
    for (const PackMethod method : {PackMethod::kNone, PackMethod::kAuto}) {
      pack_capture(p.target, p.folder / "other.glb", with(method));
      EXPECT_EQ(soup(scene::read_capture(p.folder / "other.glb").meshes[0].primitives[0]),
                soup(p.after().meshes[0].primitives[0]));
    }
  }
}

TEST(PackGeometry, CagesAndOtherSurfacesMayBeMadeOfIt) {
  const Packed p(dressed_grid(), encoded(GeometryEncoding::kMeshlet));
  PackOptions cages = plain();
  cages.surfaces.subdivide = 1;
  pack_capture(p.target, p.folder / "cages.glb", cages);
  const json document = glb_parts(read_text(p.folder / "cages.glb")).document;
  EXPECT_FALSE(document["extensionsUsed"].get<std::set<std::string>>().contains("TESSERA_clusters"));
  EXPECT_EQ(document.value("extensionsRequired", json::array()).dump().find("TESSERA_clusters"), std::string::npos);
}

TEST(PackGeometry, PrimitivesThatMustKeepTheirOrderStay) {
  for (const GltfSource& source : {animated_grid(), bezier()}) {
    const Packed p(source, encoded(GeometryEncoding::kDgf)), without(source, plain());
    EXPECT_TRUE(p.bytes == without.bytes);
  }
}

Image rendered(const scene::Capture& capture, const char* encoding) {
  gpu::GpuConfiguration configuration;
  gpu::RunSettings run;
  gpu::apply_setting(encoding, run, configuration);
  return gpu::Device(capture, configuration, run, {64, 48, {0, 0, 64, 48}}).render(0).targets.color;
}

TEST(PackGeometry, TheMemoryThatHoldsTheSameEncodingShowsTheSameImage) {
  for (const GeometryEncoding encoding : kEncodings) {
    const Packed p(grid(), encoded(encoding));
    const std::string key = "geometry.encoding=" + std::string(word(encoding));
    const Image raw = rendered(p.after(), "geometry.encoding=raw"), held = rendered(p.after(), key.c_str());
    double worst = 0;
    for (std::size_t k = 0; k < raw.values.size(); ++k)
      worst = std::max(worst, std::abs(static_cast<double>(raw.values[k]) - static_cast<double>(held.values[k])));
    EXPECT_LT(worst, 1e-5) << key;
  }
}

// A .glb of these parts, read; throws as the reader does.
void read_parts(const Packed& p, const GlbParts& parts) {
  test::GltfAsset asset;
  asset.document = parts.document;
  asset.binary.assign(parts.binary.begin(), parts.binary.end());
  const fs::path file = p.folder / "changed.glb";
  write_text(file, asset.glb());
  scene::read_capture(file);
}

TEST(PackGeometry, MalformedStreamsAreRefusedWithTheReason) {
  const Packed p(dressed_grid(), encoded(GeometryEncoding::kMeshlet));
  EXPECT_NO_THROW(read_parts(p, p.parts));
  const auto refused = [&](const char* reason, const std::function<void(json&)>& change) {
    GlbParts parts = p.parts;
    change(parts.document);
    try {
      read_parts(p, parts);
      ADD_FAILURE() << reason;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(reason));
    }
  };
  refused("without bits", [](json& d) { clusters_of(d).erase("bits"); });
  refused("without bufferView", [](json& d) { clusters_of(d).erase("bufferView"); });
  refused("glTF does not define here", [](json& d) { clusters_of(d)["encoding"] = "raw"; });
  refused("too many for", [](json& d) { clusters_of(d)["clusters"] = 1u << 30; });
  refused("clusters are triangles", [](json& d) { d["meshes"][0]["primitives"][0]["mode"] = 5; });
  refused("without POSITION and indices", [](json& d) { d["meshes"][0]["primitives"][0].erase("indices"); });
  refused("the accessors say", [](json& d) {
    json& accessor = d["accessors"][d["meshes"][0]["primitives"][0]["indices"].get<std::size_t>()];
    accessor["count"] = accessor["count"].get<int>() + 3;
  });
}

}  // namespace
}  // namespace tessera::replay::pack_geometry_test
