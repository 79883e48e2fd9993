// tessera pack --meshopt and --webp.
#include "base/error.h"
#include "base/webp_codec.h"
#include "replay/pack/meshopt_encoder.h"
#include "scene/clusters.h"
#include "tests/replay/pack_sources.h"
#include "tests/support/tests.h"

namespace tessera::replay::pack_compression_test {
namespace {

constexpr const char* kMeshopt = "EXT_meshopt_compression";

PackOptions meshopt(QuantizationBits bits = kMeshoptBits) {
  PackOptions options;
  options.method = PackMethod::kMeshopt;
  options.bits = bits;
  return options;
}

std::set<std::string> names_in(const json& document, const char* list) {
  if (!document.contains(list)) return {};
  return document[list].get<std::set<std::string>>();
}

TEST(PackMeshopt, EveryKindOfAttributeSurvivesWithinItsQuantisation) {
  for (const int extra : {0, 2}) {
    QuantizationBits bits = kMeshoptBits;
    bits.position += extra, bits.normal += extra, bits.texcoord += extra, bits.generic += extra;
    const Packed p(dressed_grid(), meshopt(bits));
    const scene::Capture before = p.before(), after = p.after();
    const scene::Vertices &a = vertices_of(before), &b = vertices_of(after);
    ASSERT_EQ(b.count(), a.count());
    const std::vector<std::size_t> number = packed_numbers(b);
    // An octahedron's x and y are off by half a step, its z by both together; then rounding to the components' bits.
    const double step = 1.0 / ((1 << (bits.normal - 1)) - 1), off = std::sqrt(6.0) / 2 * step * std::sqrt(3.0);
    const double rounding = bits.normal <= 8 ? std::sqrt(3.0) / 2 / 127 : 1e-4;
    for (std::size_t v = 0; v < a.count(); ++v) {
      const std::size_t w = number[v];
      ASSERT_LT(w, b.count());
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(b.positions[w][c], a.positions[v][c], half_step(kSide - 1, bits.position));
      EXPECT_GT(glm::dot(b.normals[w], a.normals[v]) / glm::length(b.normals[w]), std::cos(off + rounding));
      EXPECT_GT(glm::dot(Vec3(b.tangents[w]), Vec3(a.tangents[v])) / glm::length(Vec3(b.tangents[w])),
                std::cos(off + rounding));
      EXPECT_EQ(b.tangents[w].w, a.tangents[v].w);
      for (int c = 0; c < 2; ++c) EXPECT_NEAR(b.texcoords[0][w][c], a.texcoords[0][v][c], half_step(4, bits.texcoord));
      EXPECT_EQ(b.colors[w], a.colors[v]);
      EXPECT_EQ(b.influences[w].joints, a.influences[v].joints);
      for (std::size_t k = 0; k < 8; ++k)
        EXPECT_NEAR(b.influences[w].weights[k], a.influences[v].weights[k], 4 * half_step(1, bits.generic));
    }
    EXPECT_EQ(after.skins[0].inverse_bind, before.skins[0].inverse_bind);
    EXPECT_EQ(after.meshes[0].primitives[0].indices.size(), before.meshes[0].primitives[0].indices.size());
    EXPECT_EQ(names_in(p.parts.document, "extensionsRequired"),
              (std::set<std::string>{kMeshopt, "KHR_mesh_quantization"}));
  }
}

TEST(PackMeshopt, FewerBitsMoveVerticesFurtherAndTakeFewerBytes) {
  QuantizationBits few = kMeshoptBits;
  few.position = 6, few.texcoord = 6, few.normal = 4;
  const Packed coarse(dressed_grid(), meshopt(few)), fine(dressed_grid(), meshopt());
  EXPECT_LT(coarse.bytes.size(), fine.bytes.size());
  const scene::Capture before = coarse.before(), after = coarse.after();
  const std::vector<std::size_t> number = packed_numbers(vertices_of(after));
  float worst = 0;
  for (std::size_t v = 0; v < number.size(); ++v)
    worst =
        std::max(worst, glm::length(vertices_of(after).texcoords[0][number[v]] - vertices_of(before).texcoords[0][v]));
  EXPECT_GT(worst, half_step(4, kMeshoptBits.texcoord) * 8);
}

TEST(PackMeshopt, MorphTargetsAnimationsAndOrderStayExact) {
  const Packed p(animated_grid(), meshopt());
  const scene::Capture before = p.before(), after = p.after();
  EXPECT_EQ(after.meshes[0].primitives[0].indices, before.meshes[0].primitives[0].indices);
  ASSERT_EQ(vertices_of(after).morph_targets.size(), vertices_of(before).morph_targets.size());
  for (std::size_t t = 0; t < vertices_of(before).morph_targets.size(); ++t)
    EXPECT_EQ(vertices_of(after).morph_targets[t].positions, vertices_of(before).morph_targets[t].positions);
  for (std::size_t c = 0; c < before.animations[0].channels.size(); ++c) {
    EXPECT_EQ(after.animations[0].channels[c].times, before.animations[0].channels[c].times);
    EXPECT_EQ(after.animations[0].channels[c].values, before.animations[0].channels[c].values);
  }
}

TEST(PackMeshopt, ControlPointsKeepTheirOrderAndSharedEdgesStayBitEqual) {
  const Packed p(bezier(), meshopt());
  const scene::Capture before = p.before(), after = p.after();
  const std::vector<Vec3>&a = vertices_of(before).positions, &b = vertices_of(after).positions;
  ASSERT_EQ(b.size(), a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (a[i] == a[k]) {
        EXPECT_EQ(b[i], b[k]);
      }
    }
}

// Two primitives of one mesh that share an edge, at values that no grid of theirs has.
TEST(PackMeshopt, PrimitivesOfAMeshThatTouchStillTouch) {
  GltfSource s = grid();
  std::vector<Vec3> points = grid_points();
  for (Vec3& v : points) v = Vec3((v.x + 8) * 0.37f, v.y * 0.73f, v.y * 0.1f);
  const int moved = s.positions(points);
  json second = first_primitive(s);
  second["attributes"]["POSITION"] = moved;
  s.document["meshes"][0]["primitives"].push_back(second);
  std::vector<Vec3> first = grid_points();
  for (Vec3& v : first) v = Vec3(v.x * 0.37f, v.y * 0.73f, v.y * 0.1f);
  first_primitive(s)["attributes"]["POSITION"] = s.positions(first);
  const Packed p(s, meshopt());
  const scene::Capture before = p.before(), after = p.after();
  const auto shared = [](const scene::Capture& capture) {
    std::size_t count = 0;
    const auto& primitives = capture.meshes[0].primitives;
    for (const Vec3& a : primitives[0].vertices.positions)
      for (const Vec3& b : primitives[1].vertices.positions) count += a == b ? 1 : 0;
    return count;
  };
  ASSERT_EQ(shared(before), kSide);
  EXPECT_GE(shared(after), shared(before));
}

TEST(PackMeshopt, IsDeterministicAndPackingAgainChangesNothing) {
  for (const GltfSource& source : {dressed_grid(), animated_grid(), bezier()}) {
    const Packed p(source, meshopt()), again(source, meshopt());
    EXPECT_TRUE(p.bytes == again.bytes);
    pack_capture(p.target, p.folder / "twice.glb", meshopt());
    EXPECT_TRUE(read_text(p.folder / "twice.glb") == p.bytes);
  }
}

// A grid of some hundred clusters, its triangles in any order.
GltfSource large_grid() {
  constexpr std::uint32_t kLarge = 100;
  std::vector<Vec3> points;
  for (std::uint32_t n = 0; n < kLarge * kLarge; ++n)
    points.emplace_back(n % kLarge, n / kLarge, std::sin(static_cast<float>(n)));
  std::vector<std::uint16_t> indices;
  for (std::uint32_t j = 0; j + 1 < kLarge; ++j)
    for (std::uint32_t i = 0; i + 1 < kLarge; ++i)
      for (const std::uint32_t corner : {0u, 1u, kLarge + 1, 0u, kLarge + 1, kLarge})
        indices.push_back(static_cast<std::uint16_t>(j * kLarge + i + corner));
  GltfSource s;
  const int positions = s.positions(points), triangles = s.accessor(indices, kUnsignedShortType, "SCALAR");
  s.document["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", triangles}}}}}};
  return s;
}

// Number of clusters and the half diagonals of their boxes, summed.
struct ClusterQuality {
  std::size_t clusters = 0;
  double size = 0;
};
ClusterQuality quality_of(scene::Primitive primitive, bool in_cluster_order) {
  primitive.in_cluster_order = in_cluster_order;
  const scene::MeshClusters found = scene::build_clusters(primitive);
  ClusterQuality out{found.clusters.size(), 0};
  for (const scene::Cluster& cluster : found.clusters) {
    Vec3 low(std::numeric_limits<float>::max()), high(-low);
    for (std::uint32_t v = 0; v < cluster.vertex_count; ++v) {
      const Vec3& p = primitive.vertices.positions[found.vertices[cluster.first_vertex + v]];
      low = glm::min(low, p), high = glm::max(high, p);
    }
    out.size += static_cast<double>(glm::length(high - low)) / 2;
  }
  return out;
}

TEST(PackMeshopt, PackedTrianglesAreCutIntoClustersAsGoodAsBuiltOnes) {
  const Packed p(large_grid(), meshopt());
  const scene::Capture before = p.before(), after = p.after();
  const scene::Primitive &source = before.meshes[0].primitives[0], &packed = after.meshes[0].primitives[0];
  ASSERT_FALSE(source.in_cluster_order);
  ASSERT_TRUE(packed.in_cluster_order);
  EXPECT_TRUE(names_in(p.parts.document, "extensionsUsed").contains("TESSERA_clusters"));
  const ClusterQuality found = quality_of(source, false), cut = quality_of(packed, true);
  EXPECT_LE(static_cast<double>(cut.clusters), 1.02 * static_cast<double>(found.clusters));
  EXPECT_LE(cut.size, 1.1 * found.size);
  // The twin: the source's own order is none of clusters.
  EXPECT_GT(quality_of(source, true).size, 1.5 * found.size);
}

TEST(PackMeshopt, TheClaimOfAnOrderGoesWhereTheOrderDoes) {
  const Packed p(large_grid(), meshopt());
  const auto claims = [&](const PackOptions& options) {
    const fs::path target = p.folder / "again.glb";
    pack_capture(p.target, target, options);
    const json document = glb_parts(read_text(target)).document;
    const bool used = names_in(document, "extensionsUsed").contains("TESSERA_clusters");
    EXPECT_EQ(document["meshes"][0]["primitives"][0].value("extensions", json::object()).contains("TESSERA_clusters"),
              used);
    return used;
  };
  EXPECT_TRUE(claims(meshopt()));
  EXPECT_TRUE(claims(with(PackMethod::kNone)));  // the triangles stay where they are
  EXPECT_FALSE(claims(with(PackMethod::kEdgebreaker)));
  PackOptions cages = meshopt();
  cages.surfaces.subdivide = 1;
  EXPECT_FALSE(claims(cages));
}

TEST(PackMeshopt, PrimitivesThatMustKeepTheirOrderClaimNoClusters) {
  for (const GltfSource& source : {animated_grid(), bezier()})
    EXPECT_FALSE(names_in(Packed(source, meshopt()).parts.document, "extensionsUsed").contains("TESSERA_clusters"));
}

TEST(PackMeshopt, IsUnpackedOrRepackedByTheOtherMethods) {
  const Packed p(dressed_grid(), meshopt());
  for (const PackMethod method : {PackMethod::kNone, PackMethod::kAuto}) {
    const fs::path target = p.folder / "other.glb";
    pack_capture(p.target, target, with(method));
    const std::string bytes = read_text(target);
    EXPECT_THAT(glb_faults(bytes), IsEmpty());
    const json document = glb_parts(bytes).document;
    EXPECT_FALSE(names_in(document, "extensionsUsed").contains(kMeshopt));
    EXPECT_EQ(document["buffers"].size(), 1u);
    if (method == PackMethod::kNone) {
      EXPECT_EQ(vertices_of(scene::read_capture(target)).positions, vertices_of(p.after()).positions);
    }
  }
  PackOptions cages = meshopt();
  cages.surfaces.subdivide = 1;
  pack_capture(p.target, p.folder / "cages.glb", cages);
  EXPECT_THAT(glb_faults(read_text(p.folder / "cages.glb")), IsEmpty());
}

TEST(GlbRules, RulesOfCompressedViewsFindBrokenFiles) {  // BIN1, BIN4
  const Packed p(dressed_grid(), meshopt());
  const auto expect_fault = [&](const char* fault, const std::function<void(json&)>& change) {
    GlbParts parts = p.parts;
    change(parts.document);
    EXPECT_THAT(glb_faults(parts), testing::Contains(HasSubstr(fault)));
  };
  const auto extension = [](json& d, std::size_t view) -> json& {
    return d["bufferViews"][view]["extensions"][kMeshopt];
  };
  ASSERT_TRUE(p.parts.document["bufferViews"][1].contains("extensions"));
  expect_fault("does not follow",
               [&](json& d) { extension(d, 1)["byteOffset"] = extension(d, 1)["byteOffset"].get<int>() + 4; });
  expect_fault("in the fallback", [&](json& d) { d["bufferViews"][1]["byteOffset"] = 0; });
  expect_fault("the fallback has", [](json& d) { d["buffers"][1]["byteLength"] = 4; });
  expect_fault("has a uri", [](json& d) { d["buffers"][1]["uri"] = "x.bin"; });
  expect_fault("does not say so", [](json& d) { d["buffers"][1].erase("extensions"); });
  expect_fault("another length", [&](json& d) { extension(d, 0)["count"] = 1; });
  expect_fault("not of the fallback", [](json& d) { d["bufferViews"][1]["buffer"] = 0; });
  expect_fault("or used without being required", [](json& d) { d["extensionsRequired"] = {"KHR_mesh_quantization"}; });
}

// ---- WebP -------------------------------------------------------------------------------------------------------

// Two materials: colour from an 8-bit image, heights from one of 16 bits and from one of 8.
GltfSource textured_grid() {
  GltfSource s = dressed_grid();
  Image8 color(32, 16, 3), grey(16, 16, 1);
  Image16 deep(8, 8, 1);
  for (std::size_t i = 0; i < color.values.size(); ++i) color.values[i] = static_cast<std::uint8_t>(i / 3 % 32 * 8);
  for (std::size_t i = 0; i < grey.values.size(); ++i) grey.values[i] = static_cast<std::uint8_t>(i);
  for (std::size_t i = 0; i < deep.values.size(); ++i) deep.values[i] = static_cast<std::uint16_t>(i * 999);
  for (const std::string& png : {encode_png(color), encode_png(grey), encode_png(deep), encode_png(grey)}) {
    s.document["images"].push_back({{"bufferView", s.view(png)}, {"mimeType", "image/png"}});
    s.document["textures"].push_back({{"source", s.document["images"].size() - 1}});
  }
  s.document["materials"] = {
      {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}}},
       {"emissiveTexture", {{"index", 2}}},
       {"extensions", {{"TESSERA_displacement", {{"texture", {{"index", 3}}}}}}}}};
  s.document["extensionsUsed"] = {"TESSERA_displacement"};
  first_primitive(s)["material"] = 0;
  return s;
}

TEST(PackWebp, ColourImagesBecomeWebpAndHeightsStay) {
  for (const bool lossless : {true, false}) {
    PackOptions options = with(PackMethod::kNone);
    options.webp.emplace();
    if (lossless) options.webp->quality.reset();
    const Packed p(textured_grid(), options);
    EXPECT_EQ(p.report.webp_images, 2u);
    const json& d = p.parts.document;
    const char* const wanted[] = {"image/webp", "image/webp", "image/png", "image/png"};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(d["images"][i]["mimeType"], wanted[i]);
      EXPECT_EQ(d["textures"][i].contains("source"), i >= 2);
      if (i < 2) {
        EXPECT_EQ(d["textures"][i]["extensions"]["EXT_texture_webp"]["source"], i);
      }
    }
    EXPECT_TRUE(names_in(d, "extensionsRequired").contains("EXT_texture_webp"));
    const scene::Material before = p.before().materials[0], after = p.after().materials[0];
    EXPECT_TRUE(std::ranges::equal(after.displacement->texture->levels()[0].values,
                                   before.displacement->texture->levels()[0].values));
    // Packing again finds nothing to convert.
    EXPECT_EQ(pack_capture(p.target, p.folder / "again.glb", options).webp_images, 0u);
    EXPECT_TRUE(read_text(p.folder / "again.glb") == p.bytes);
  }
}

TEST(PackWebp, LowerQualityTakesFewerBytes) {
  PackOptions low = with(PackMethod::kNone), high = low;
  low.webp.emplace().quality = 5;
  high.webp.emplace().quality = 100;
  EXPECT_LT(Packed(textured_grid(), low).bytes.size(), Packed(textured_grid(), high).bytes.size());
}

}  // namespace
}  // namespace tessera::replay::pack_compression_test
