// Points and lines: how they are read, and how their vertices are moved apart in the image.
#include "scene/wires.h"
#include "scene/assembly.h"
#include "scene/frame_geometry.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::wires_test {
namespace {

using testing::ElementsAre;

// ---- Reading ----------------------------------------------------------------------------------------------------

// The primitives of a mesh whose one has four points at x = 0, 1, 2, 3 with a colour and a morph target each.
std::vector<Primitive> read_primitives(int mode, const std::vector<std::uint16_t>& indices,
                                       const json& extensions = json()) {
  test::GltfAsset asset;
  const int positions = asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0});
  auto& range = asset.document["accessors"][static_cast<std::size_t>(positions)];
  range["min"] = {0, 0, 0}, range["max"] = {3, 0, 0};
  const int colors = asset.add_accessor<float>("VEC3", {0, 0, 0, 0.25f, 0, 0, 0.5f, 0, 0, 0.75f, 0, 0});
  const int texcoords = asset.add_accessor<float>("VEC2", {0, 0, 1, 0, 2, 0, 3, 0});
  json primitive = {{"mode", mode},
                    {"attributes", {{"POSITION", positions}, {"COLOR_0", colors}, {"TEXCOORD_0", texcoords}}},
                    {"targets", {{{"POSITION", positions}}}}};
  if (!indices.empty()) primitive["indices"] = asset.add_accessor("SCALAR", indices);
  if (!extensions.is_null()) primitive["extensions"] = extensions;
  asset.add("meshes", {{"primitives", {primitive}}});
  asset.add("nodes", {{"mesh", 0}});
  return test::read_asset(asset, {.strict = true}).meshes.at(0).primitives;
}
Primitive read_primitive(int mode, const std::vector<std::uint16_t>& indices, const json& extensions = json()) {
  return read_primitives(mode, indices, extensions).at(0);
}

// The x of the ends of each segment, of each point.
std::vector<float> ends_of(const Primitive& primitive) {
  std::vector<float> out;
  const std::size_t step = primitive.wire == Primitive::Wire::kPoints ? 4 : 2;
  const Vertices& v = primitive.vertices;
  EXPECT_EQ(v.count() % 4, 0u);
  EXPECT_EQ(primitive.indices.size(), v.count() / 4 * 6);
  for (std::size_t k = 0; k < v.count(); ++k) {
    EXPECT_EQ(v.positions[k], v.positions[k / step * step]);
    EXPECT_EQ(v.colors[k].x, v.positions[k].x / 4);
    EXPECT_EQ(v.texcoords[0][k].x, v.positions[k].x);
    EXPECT_EQ(v.morph_targets[0].positions[k], v.positions[k]);
    if (k % step == 0) out.push_back(v.positions[k].x);
  }
  return out;
}

TEST(Wires, AreReadInEveryMode) {
  EXPECT_EQ(read_primitive(0, {}).wire, Primitive::Wire::kPoints);
  EXPECT_EQ(read_primitive(1, {}).wire, Primitive::Wire::kSegments);
  EXPECT_THAT(ends_of(read_primitive(0, {})), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(ends_of(read_primitive(0, {2, 0})), ElementsAre(2, 0));
  EXPECT_THAT(ends_of(read_primitive(1, {})), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(ends_of(read_primitive(1, {3, 1, 2})), ElementsAre(3, 1));
  EXPECT_THAT(ends_of(read_primitive(2, {0, 1, 3})), ElementsAre(0, 1, 1, 3, 3, 0));
  EXPECT_THAT(ends_of(read_primitive(3, {0, 1, 3})), ElementsAre(0, 1, 1, 3));
  for (const int mode : {1, 2, 3}) EXPECT_TRUE(read_primitives(mode, {2}).empty()) << mode;
}

TEST(Wires, AreNoSurfaces) {
  for (const int mode : {0, 1, 2, 3})
    for (const json& extensions :
         {json{{"TESSERA_bezier_patches", {{"count", 1}}}}, json{{"TESSERA_subdivision", json::object()}}})
      EXPECT_THROW(read_primitive(mode, {}, extensions), InputError) << mode << extensions;
}

TEST(Wires, WithoutNormalsAreUnlitAndGlow) {
  Capture capture;
  Material red;
  red.base_color = Vec4(1, 0, 0, 1);
  const int material = test::add_material(capture, red);
  Primitive lit = test::points({{0, 0, 0}}, material);
  lit.vertices.normals.assign(4, Vec3(0, 0, 1));
  test::add_node(capture, lit);
  test::add_node(capture, test::points({{0, 0, 0}}, material));
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}, material));
  const Assembly assembly = assemble(capture);
  const auto of = [&](std::size_t d) {
    return assembly.materials[static_cast<std::size_t>(assembly.drawables[d].material)];
  };
  EXPECT_TRUE(of(0).double_sided && !of(0).unlit);
  EXPECT_TRUE(of(1).double_sided && of(1).unlit && of(1).glows_unlit);
  EXPECT_FALSE(of(2).double_sided || of(2).unlit);
  for (std::size_t d = 0; d < 3; ++d) EXPECT_EQ(of(d).base_color, red.base_color);
}

// ---- Posing -----------------------------------------------------------------------------------------------------

struct Seen {
  Assembly assembly;
  std::unique_ptr<FrameGeometry> frame;

  Vec4 raster(std::size_t vertex, std::size_t key = 0) const {
    const PosedDrawable& drawable = frame->drawables[0];
    return drawable.to_raster[key] * Vec4(drawable.positions[key][vertex], 1.0f);
  }
  DVec3 pixel(std::size_t vertex, std::size_t key = 0) const {
    const DVec4 r(raster(vertex, key));
    return DVec3(r) / r.w;
  }
};

Seen pose(const Capture& capture, double open = 0, double close = 0) {
  Seen seen{assemble(capture), nullptr};
  FrameRequest request;
  request.width = 200;
  request.height = 100;
  request.open_time = open;
  request.close_time = close;
  seen.frame = pose_frame(seen.assembly, choose_camera(capture, 200, 100), request);
  return seen;
}

Camera orthographic() {
  Camera camera;
  camera.type = Camera::Type::kOrthographic;
  camera.x_mag = camera.y_mag = 1;
  return camera;
}

TEST(Wires, VerticesMoveByHalfAPixelAcrossTheLineAndKeepTheirDepth) {  // WI1
  test::Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    Capture capture, plain;
    const Vec3 a = random.in_box(1), b = random.in_box(1);
    const bool far_away = random.coin();
    const DVec3 offset = far_away ? DVec3(1e6, 3e5, -1e6) : DVec3(0.0);
    const int node = test::add_node(capture, test::segments({a, b}), offset);
    capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(1, random.uniform(0.1f, 2), 0);
    test::add_camera(capture, DVec3(0, 0, 4) + offset, random.coin() ? orthographic() : Camera{});
    const Seen seen = pose(capture);
    const DMat4 to_raster = seen.frame->projection.matrix() * seen.frame->views[0].world_to_camera *
                            pose_at(capture, 0).world[static_cast<std::size_t>(node)];
    const DVec4 ra = to_raster * DVec4(DVec3(a), 1), rb = to_raster * DVec4(DVec3(b), 1);
    const DVec3 pa = DVec3(ra) / ra.w, pb = DVec3(rb) / rb.w;
    const glm::dvec2 along = glm::normalize(glm::dvec2(pb - pa));
    for (std::size_t v = 0; v < 4; ++v) {
      const DVec3 moved = seen.pixel(v) - (v < 2 ? pa : pb);
      EXPECT_NEAR(moved.x * along.x + moved.y * along.y, 0, 2e-3);
      EXPECT_NEAR(std::hypot(moved.x, moved.y), 0.5, 2e-3);
      EXPECT_NEAR(static_cast<double>(seen.raster(v).z), (v < 2 ? ra : rb).z, 1e-4);
      EXPECT_NEAR(static_cast<double>(seen.raster(v).w), (v < 2 ? ra : rb).w, 1e-4);
    }
    EXPECT_GT(glm::distance(glm::dvec2(seen.pixel(0)), glm::dvec2(seen.pixel(1))), 0.99);
    EXPECT_LT(glm::distance(seen.pixel(1) - seen.pixel(0), seen.pixel(2) - seen.pixel(3)), 5e-3);
  }
}

TEST(Wires, APointIsASquareOfOnePixel) {  // WI1
  Capture capture;
  test::add_node(capture, test::points({{0.25f, 0.5f, 0}}));
  test::add_camera(capture, DVec3(0, 0, 1), orthographic());
  const Seen seen = pose(capture);  // 50 pixels a unit
  const DVec3 middle(100 + 12.5, 50 - 25, 1);
  for (std::size_t v = 0; v < 4; ++v) {
    const DVec3 moved = seen.pixel(v) - middle;
    EXPECT_NEAR(moved.x, v < 2 ? -0.5 : 0.5, 1e-4);
    EXPECT_NEAR(moved.y, v == 0 || v == 3 ? -0.5 : 0.5, 1e-4);
  }
}

// A segment from before the camera to behind it: its part before the camera is as wide as if the segment ended there.
TEST(Wires, BothEndsMoveTheSameWayAlsoBehindTheCamera) {  // WI2
  test::Random random(4);
  for (int trial = 0; trial < 100; ++trial) {
    Capture capture;
    const Vec3 a = random.in_box(1) - Vec3(0, 0, 3), b = random.in_box(1) + Vec3(0, 0, 2);
    test::add_node(capture, test::segments({a, b}));
    test::add_camera(capture, DVec3(0.0));
    const Seen seen = pose(capture);
    // Where both sides of the strip have the depth 0.5.
    const auto side = [&](std::size_t from, std::size_t to) {
      const DVec4 p(seen.raster(from)), q(seen.raster(to));
      const DVec4 r = p + (q - p) * ((0.5 - p.w) / (q.w - p.w));
      return glm::dvec2(r.x, r.y) / r.w;
    };
    EXPECT_NEAR(glm::distance(side(0, 3), side(1, 2)), 1, 1e-3);
  }
}

TEST(Wires, ASegmentThatPointsAtTheEyeIsFinite) {
  for (const Camera& camera : {Camera{}, orthographic()}) {
    Capture capture;
    test::add_node(capture, test::segments({{0, 0, -1}, {0, 0, -2}, {0, 0, 0}, {0, 0, 0}, {0, 0, -1}, {0, 0, -1}}));
    test::add_camera(capture, DVec3(0.0), camera);
    const Seen seen = pose(capture);
    for (std::size_t v = 0; v < 12; ++v)
      for (int c = 0; c < 4; ++c) EXPECT_TRUE(std::isfinite(seen.raster(v)[c]));
  }
}

TEST(Wires, AreMovedApartAtEachMotionKey) {
  Capture capture;
  test::add_node(capture, test::segments({{-1, 0, 0}, {1, 0.3f, 0}}));
  test::add_camera(capture, DVec3(0, 0, 4));
  test::add_motion(capture, 1, DVec3(0.5, 0, 0.5));
  const Seen seen = pose(capture, 0, 1);
  EXPECT_TRUE(seen.frame->drawables[0].moving);
  for (std::size_t key = 0; key < 2; ++key)
    EXPECT_NEAR(glm::distance(seen.pixel(0, key), seen.pixel(1, key)), 1, 1e-3) << key;
  EXPECT_FALSE(pose(capture, 0.5, 0.5).frame->drawables[0].moving);
}

TEST(Wires, NormalsAndTangentsAreInTheWorld) {
  Capture capture;
  Primitive primitive = test::points({{0, 0, 0}});
  primitive.vertices.normals.assign(4, Vec3(1, 0, 0));
  primitive.vertices.tangents.assign(4, Vec4(0, 1, 0, -1));
  const int node = test::add_node(capture, primitive);
  capture.nodes[static_cast<std::size_t>(node)].transform.rotation = glm::angleAxis(1.5707963267948966, DVec3(0, 0, 1));
  test::add_camera(capture, DVec3(0, 0, 4));
  const Seen seen = pose(capture);
  const PosedDrawable& drawable = seen.frame->drawables[0];
  const Vec3 normal = drawable.normal_to_world[0] * drawable.normals[0][0];
  EXPECT_NEAR(static_cast<double>(normal.y), 1, 1e-6);
  EXPECT_NEAR(static_cast<double>(drawable.tangents[0][0].x), -1, 1e-6);
  EXPECT_EQ(drawable.tangents[0][0].w, -1.0f);
}

}  // namespace
}  // namespace tessera::scene::wires_test
