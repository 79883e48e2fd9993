// Vertices that pixels interpolate: their values, the number of their evaluations, the distance of the surface from
// the patch.
#include "tilecore/shading/vertex_outputs.h"
#include "base/simd_targets.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/scalar_lanes.h"
#include "tilecore/shading/vertex_kernel.h"

namespace tessera::tilecore::one_lane {

#include "tilecore/shading/lane_vertex.inc"

}  // namespace tessera::tilecore::one_lane

namespace tessera::tilecore::vertex_outputs_test {
namespace {

// Grids of `edge` pixels a side, whose pixels interpolate.
struct InterpolatedFrame : TestFrame {
  void pose_interpolated(double edge) {
    assembly = std::make_unique<scene::Assembly>(scene::assemble(*capture));
    scene::FrameRequest request;
    request.width = 192, request.height = 128, request.close_time = 1;
    request.tessellation.target_edge_pixels = edge;
    request.interpolated_surfaces = true;
    frame = scene::pose_frame(*assembly, scene::choose_camera(*capture, 192, 128), request);
  }
};

// A drawable of bent patches, in grids of `edge` pixels a side.
struct BentPatches : InterpolatedFrame {
  explicit BentPatches(std::uint32_t seed, bool displaced = false, bool mapped = false, double edge = 8) {
    Random random(seed);
    scene::Material material;
    if (displaced) {
      std::vector<float> heights(64);
      for (float& h : heights) h = random.uniform(0, 1);
      material.displacement = test::displacement(8, 8, heights, 0.05f, 0);
    }
    if (mapped) {
      Image8 image(1, 1, 4);
      image.values = {128, 128, 255, 255};
      material.normal_texture.texture =
          std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
    }
    scene::Primitive patches = test::closed_patches(test::add_material(*capture, material));
    patches.vertices.texcoords.resize(1);
    for (std::size_t k = 0; k < patches.vertices.count(); ++k) {
      patches.vertices.texcoords[0].emplace_back(static_cast<float>(k % 4) / 3, static_cast<float>(k / 4 % 4) / 3);
      patches.vertices.colors.emplace_back(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), 1);
    }
    const int node = test::add_node(*capture, patches);
    if (seed % 2 == 1) capture->nodes[static_cast<std::size_t>(node)].transform.scale = {-1, 2, 1};
    if (seed % 3 == 1) test::add_motion(*capture, node, {0.3, 0.1, 0});
    test::add_camera(*capture, {0, 0, 4});
    pose_interpolated(edge);
  }
  const scene::PosedDrawable& drawable() const { return frame->drawable_of(0); }
  std::uint32_t patches() const { return drawable().drawable->patch_count; }
};

one_lane::LaneSurface<float> interpolated(const BentPatches& scene, VertexOutputs& outputs, const SurfaceLocation& at) {
  DrawConstants draw = draw_constants(*scene.frame, scene.drawable());
  one_lane::LaneInputs<float> in{};
  const std::array<std::int32_t, 3> corner = outputs.triangle(at.patch, at.triangle);
  std::copy(corner.begin(), corner.end(), in.vertex);
  in.p = at.b1, in.q = at.b2, in.t = at.t;
  outputs.set_mesh(draw);
  return one_lane::lane_surface(draw, in);
}

float distance(const Vector3<float>& a, const Vec3& b) { return glm::length(Vec3(a.x, a.y, a.z) - b); }

// Invariant VO1.
TEST(VertexOutputs, VO1AtAVertexTheSurfaceIsThePatch) {
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const BentPatches scene(seed, seed % 4 >= 2);
    VertexOutputs outputs;
    outputs.begin(*scene.frame, scene.drawable());
    for (std::uint32_t patch = 0; patch < scene.patches(); ++patch) {
      const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
      for (std::uint32_t triangle = 0; triangle < 2u * pattern.nu * pattern.nv; ++triangle)
        for (const Vec2& weights : {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}) {
          const float t = scene.drawable().moving ? 0.25f : 0;
          const SurfaceLocation at{patch, triangle, weights.x, weights.y, t};
          const Surface there = evaluate_surface(*scene.frame, at);
          const one_lane::LaneSurface<float> s = interpolated(scene, outputs, at);
          ASSERT_LT(distance(s.position, there.position), 1e-5f) << seed << " " << patch << " " << triangle;
          ASSERT_LT(distance(s.normal, there.normal), 1e-4f) << seed << " " << patch << " " << triangle;
        }
    }
  }
}

// Invariant VO2: on closed patches of n x m cells, (n + 1)(m + 1) vertices each, whatever triangles are asked for again.
TEST(VertexOutputs, VO2EachVertexIsEvaluatedOnce) {
  const BentPatches scene(0);
  VertexOutputs outputs;
  for (int again = 0; again < 2; ++again) {
    outputs.begin(*scene.frame, scene.drawable());
    std::size_t vertices = 0;
    for (int twice = 0; twice < 2; ++twice)
      for (std::uint32_t patch = 0; patch < scene.patches(); ++patch) {
        const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
        if (twice == 0) vertices += (pattern.nu + 1u) * (pattern.nv + 1u);
        for (std::uint32_t triangle = 0; triangle < 2u * pattern.nu * pattern.nv; ++triangle)
          outputs.triangle(patch, triangle);
      }
    EXPECT_EQ(outputs.count(), vertices);
    EXPECT_GT(vertices, 100u);
  }
}

// Vertices of a scene's patches at random places, lane by lane.
struct VertexLanes {
  static constexpr std::size_t kCount = 37, kLanes = 48;
  VertexLanes(const BentPatches& scene, Random& random) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      // All of one patch, and several mixed.
      const int last = random.integer(0, 1) == 0 ? 0 : static_cast<int>(scene.patches()) - 1;
      at.push_back({static_cast<std::uint32_t>(random.integer(0, last)), SurfaceLocation::kWholePatch,
                    random.uniform(0, 1), random.uniform(0, 1), 0});
      point.push_back(static_cast<std::int32_t>(16 * at[i].patch));
      u.push_back(at[i].b1), v.push_back(at[i].b2);
      lod.push_back(lane_inputs(*scene.frame, scene.drawable(), at[i]).lod);
    }
  }
  VertexArrays arrays() const { return {point.data(), u.data(), v.data(), lod.data()}; }
  std::vector<SurfaceLocation> at;
  std::vector<std::int32_t> point;
  std::vector<float> u, v, lod;
};

// Numbers of a vertex in the order of the kernel's columns.
std::vector<float> on_one_lane(const BentPatches& scene, const DrawConstants& draw, const SurfaceLocation& at,
                               bool base_normals, const scene::TextureSlot& tangents) {
  const scene::PosedDrawable& drawable = scene.drawable();
  const one_lane::LaneInputs<float> in = lane_inputs(*scene.frame, drawable, at);
  const auto point =
      base_normals ? one_lane::patch_point<float, true>(draw, in, 0) : one_lane::patch_point<float, false>(draw, in, 0);
  std::vector<float> out;
  const auto add = [&](const Vector3<float>& a) { out.insert(out.end(), {a.x, a.y, a.z}); };
  add(point.position);
  add(one_lane::unit_in_the_world(drawable.normal_to_world[0], point.normal));
  add(one_lane::unit_in_the_world(drawable.normal_to_world[1], point.normal));
  const auto tangent = one_lane::vertex_tangent(draw, in, point, tangents);
  out.insert(out.end(), {tangent.x, tangent.y, tangent.z, tangent.w});
  const auto s = one_lane::vertex_surface(in);
  const auto uv = one_lane::lane_texcoord(draw, s, 0, shaders::TextureTransform());
  const auto color = one_lane::lane_vertex_color(draw, s);
  out.insert(out.end(), {uv.u, uv.v, color.r, color.g, color.b, color.a});
  return out;
}

// Invariant VO4. The twin, normals of the other kind, is another vertex.
TEST(VertexOutputs, VO4VerticesOnLanesHaveTheBitsOfOneLane) {
  bool twin_differs = false;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const BentPatches scene(seed, seed % 4 >= 2, true);
    const DrawConstants draw = draw_constants(*scene.frame, scene.drawable());
    const scene::TextureSlot& tangents = scene.drawable().material->normal_texture;
    Random random(seed);
    const VertexLanes lanes(scene, random);
    std::array<std::array<float, VertexLanes::kLanes>, 19> columns{};
    const auto c = [&](std::size_t k) { return columns[k].data(); };
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      for (const bool base : {false, true}) {
        place_vertices(draw, lanes.arrays(), VertexLanes::kCount, 0, base, &tangents,
                       {{c(0), c(1), c(2)}, {c(3), c(4), c(5)}, {c(6), c(7), c(8)}, {c(9), c(10), c(11), c(12)}});
        vertex_texcoords(draw, lanes.arrays(), VertexLanes::kCount, 0, {c(13), c(14)});
        vertex_colors(draw, lanes.arrays(), VertexLanes::kCount, {c(15), c(16), c(17), c(18)});
        for (std::size_t i = 0; i < VertexLanes::kCount; ++i) {
          const std::vector<float> one = on_one_lane(scene, draw, lanes.at[i], base, tangents);
          const bool moves = scene.drawable().moving;
          for (std::size_t k = 0; k < one.size(); ++k)
            if (moves || k < 6 || k > 8) {
              EXPECT_EQ(columns[k][i], one[k]) << target << " column " << k;
            }
          twin_differs = twin_differs || on_one_lane(scene, draw, lanes.at[i], !base, tangents) != one;
        }
      }
    }
    force_simd_target("");
  }
  EXPECT_TRUE(twin_differs);
}

// Means over points of the patches: how far the interpolated surface and its normal are from the patch's own.
std::array<double, 2> errors(double edge) {
  const BentPatches scene(0, false, false, edge);
  VertexOutputs outputs;
  outputs.begin(*scene.frame, scene.drawable());
  Random random(1);
  std::array<double, 2> sum{};
  constexpr int kPoints = 4000;
  for (int k = 0; k < kPoints; ++k) {
    const auto patch = static_cast<std::uint32_t>(random.integer(0, static_cast<int>(scene.patches()) - 1));
    const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
    float b1 = random.uniform(0, 1), b2 = random.uniform(0, 1);
    if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
    const SurfaceLocation at{patch, static_cast<std::uint32_t>(random.integer(0, 2 * pattern.nu * pattern.nv - 1)), b1,
                             b2, 0};
    const Surface there = evaluate_surface(*scene.frame, at);
    const one_lane::LaneSurface<float> s = interpolated(scene, outputs, at);
    sum[0] += static_cast<double>(distance(s.position, there.position)) / kPoints;
    sum[1] += static_cast<double>(distance(s.normal, there.normal)) / kPoints;
  }
  return sum;
}

// Linear interpolation.
TEST(VertexOutputs, TheErrorFallsWithTheSquareOfTheEdge) {
  // Factors are whole: over eight times the edge, 64 times the error, rounding them changes little.
  const std::array<double, 2> coarse = errors(24), fine = errors(3);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_GT(coarse[k] / fine[k], 64 / 1.6) << (k == 0 ? "place" : "normal");
    EXPECT_LT(coarse[k] / fine[k], 64 * 1.6) << (k == 0 ? "place" : "normal");
  }
}

// A flat displaced patch, scaled, turned, mirrored and moving: pixels look up the part of the normal that its
// triangles lack, so that with shading.surface=frame it is exact for edges of any length. Without the gradient, the
// twin, it is far off.
TEST(VertexOutputs, VO1WithFrameFlatPatchesHaveExactNormalsInsideTriangles) {
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    auto capture = std::make_unique<scene::Capture>();
    scene::Material material;
    std::vector<float> heights(64);
    for (float& h : heights) h = random.uniform(0, 1);
    material.displacement = test::displacement(8, 8, heights, 0.05f, 0);
    const Vec3 u(2, random.uniform(-0.3f, 0.3f), 0), v(random.uniform(-0.3f, 0.3f), 2, random.uniform(-0.5f, 0.5f));
    scene::Primitive patch = test::patches(test::flat_patch({-1, -1, 0}, u, v), test::add_material(*capture, material));
    patch.vertices.texcoords.resize(1);
    for (std::size_t k = 0; k < 16; ++k)
      patch.vertices.texcoords[0].emplace_back(static_cast<float>(k % 4) / 3, static_cast<float>(k / 4) / 3);
    const int node = test::add_node(*capture, patch);
    scene::Transform& place = capture->nodes[static_cast<std::size_t>(node)].transform;
    if (seed % 2 == 1) place.scale = {-1, 2, 0.5};
    if (seed % 3 == 1) test::add_motion(*capture, node, {0.3, 0.1, 0});
    test::add_camera(*capture, {0, 0, 4});
    const scene::Assembly assembly = scene::assemble(*capture);
    scene::FrameRequest request;
    request.width = 192, request.height = 128, request.close_time = 1;
    request.tessellation.target_edge_pixels = 32;
    request.tessellation.displacement_bias = -10;  // the finest level, as pixels read
    request.interpolated_surfaces = request.height_normals = true;
    const auto frame = scene::pose_frame(assembly, scene::choose_camera(*capture, 192, 128), request);
    const scene::PosedDrawable& drawable = frame->drawable_of(0);
    ASSERT_TRUE(adds_height_normals(*frame, drawable));
    VertexOutputs outputs;
    outputs.begin(*frame, drawable);
    double without = 0;
    for (int k = 0; k < 500; ++k) {
      const scene::TessellationPattern& pattern = frame->pattern_of(0);
      float b1 = random.uniform(0, 1), b2 = random.uniform(0, 1);
      if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
      const SurfaceLocation at{0, static_cast<std::uint32_t>(random.integer(0, 2 * pattern.nu * pattern.nv - 1)), b1,
                               b2, drawable.moving ? random.uniform(0, 1) : 0};
      DrawConstants draw = draw_constants(*frame, drawable);
      one_lane::LaneInputs<float> in{};
      const std::array<std::int32_t, 3> corner = outputs.triangle(at.patch, at.triangle);
      std::copy(corner.begin(), corner.end(), in.vertex);
      in.p = b1, in.q = b2, in.t = at.t;
      outputs.set_mesh(draw);
      one_lane::LaneSurface<float> s = one_lane::lane_surface(draw, in);
      const Vec3 expected = evaluate_surface(*frame, at).normal;
      without = std::max(without, static_cast<double>(distance(s.normal, expected)));
      one_lane::turn_by_heights(draw, in, s);
      ASSERT_LT(distance(s.normal, expected), 2e-3f) << seed << " " << k;
    }
    EXPECT_GT(without, 0.03);
  }
}

TEST(VertexOutputs, TangentsFollowThePatch) {
  const BentPatches scene(0, false, true);
  EXPECT_TRUE(has_vertex_tangents(*scene.drawable().material));
  VertexOutputs outputs;
  outputs.begin(*scene.frame, scene.drawable());
  const SurfaceLocation at{1, 4, 0, 0, 0};
  const one_lane::LaneSurface<float> s = interpolated(scene, outputs, at);
  DrawConstants patches = draw_constants(*scene.frame, scene.drawable()), mesh = patches;
  outputs.set_mesh(mesh);
  const scene::TextureSlot& slot = scene.drawable().material->normal_texture;
  one_lane::LaneInputs<float> in{};
  one_lane::SlotReader<float> textures{mesh, s, LookupArrays(), 0};
  const auto given = one_lane::tangent_frame(mesh, in, s, textures, slot);
  const Surface there = evaluate_surface(*scene.frame, at);
  const one_lane::LaneSurface<float> own = one_lane_surface(there);
  const auto derived = one_lane::derived_tangents(own, one_lane::lane_texcoord(patches, own, 0, slot.transform));
  EXPECT_LT(distance(given.tangent, {derived.tangent.x, derived.tangent.y, derived.tangent.z}), 1e-4f);
  EXPECT_GT(dot(given.bitangent, derived.bitangent), 0.9f);
}

// A sphere and a height field drawn as patches, the sphere moving.
struct ProcedurePatches : InterpolatedFrame {
  explicit ProcedurePatches(double edge) {
    scene::Material material;
    material.double_sided = true;
    const int look = test::add_material(*capture, material);
    shaders::ShapeInput sphere, field;
    sphere.p = {0.8f, 0.6f, 0.7f};
    field.p = {2, 2, 0.2f, 2, 2, 0.5f, 3};
    const int node = test::add_procedure(*capture, shaders::ShapeId::kSphere, sphere, {-1, 0, 0}, look);
    capture->nodes[static_cast<std::size_t>(node)].transform.scale = {1, 1.5, -1};
    test::add_motion(*capture, node, {0.3, 0.1, 0});
    test::add_procedure(*capture, shaders::ShapeId::kHeightField, field, {1, 0, 0}, look);
    test::add_camera(*capture, {0, 1, 4});
    pose_interpolated(edge);
  }
};

TEST(VertexOutputs, VO3BetweenVerticesOfAProcedureIsItsTriangle) {
  // Means of how far the place, the normal and the derivative by u are from the procedure's own.
  const auto errors = [](double edge) {
    const ProcedurePatches scene(edge);
    std::array<double, 3> sum{};
    int count = 0;
    test::Random random(4);
    for (const scene::PosedDrawable& drawable : scene.frame->drawables) {
      EXPECT_TRUE(interpolates_surface(*scene.frame, drawable));
      EXPECT_FALSE(adds_height_normals(*scene.frame, drawable));
      EXPECT_EQ(vertex_output_bytes(*scene.frame, drawable), drawable.moving ? 104u : 64u);
      VertexOutputs outputs;
      outputs.begin(*scene.frame, drawable);
      for (std::uint32_t k = 0; k < drawable.drawable->patch_count; ++k) {
        const std::uint32_t patch = drawable.drawable->first_patch + k;
        const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
        for (std::uint32_t triangle = 0; triangle < 2u * pattern.nu * pattern.nv; ++triangle)
          for (int corner = 0; corner < 4; ++corner) {
            SurfaceLocation at{patch, triangle, corner == 1 ? 1.0f : 0.0f, corner == 2 ? 1.0f : 0.0f, 0.25f};
            if (corner == 3) at.b1 = random.uniform(0.1f, 0.5f), at.b2 = random.uniform(0.1f, 0.5f);
            const Surface whole = evaluate_surface(*scene.frame, at);
            Surface s;
            s.drawable = &drawable;
            fill_procedure_triangle(*scene.frame, at, outputs, outputs.triangle(patch, triangle), s);
            if (corner < 3) {
              EXPECT_LT(glm::length(s.position - whole.position), 2e-6f);
              EXPECT_LT(glm::length(s.object - whole.object), 2e-6f);
              EXPECT_LT(glm::length(s.normal - whole.normal), 2e-5f) << triangle;
              EXPECT_LT(glm::length(s.object_normal - whole.object_normal), 2e-5f);
              EXPECT_LT(glm::length(s.raster - whole.raster), 1e-3f);
              continue;
            }
            sum[0] += static_cast<double>(glm::length(s.position - whole.position));
            sum[1] += static_cast<double>(glm::length(s.normal - whole.normal));
            sum[2] += static_cast<double>(glm::length(s.position_p - whole.position_p));
            ++count;
          }
      }
      EXPECT_GT(outputs.count(), 0u);
    }
    for (double& e : sum) e /= count;
    return sum;
  };
  const std::array<double, 3> coarse = errors(16), fine = errors(4);
  EXPECT_LT(fine[0], coarse[0] / 8) << "places: by the square of the edge";
  EXPECT_LT(fine[1], coarse[1] / 5) << "normals nearly so: the height field's have kinks";
  EXPECT_LT(fine[2], coarse[2] / 2.5) << "derivatives of the plane: by the edge";
}

TEST(VertexOutputs, BytesFollowFromTheReadAttributes) {
  const BentPatches still(0), moving(1), mapped(0, false, true);
  EXPECT_EQ(vertex_output_bytes(*still.frame, still.drawable()), 12u + 16 + 12 + 16) << "place, raster, normal, colour";
  ASSERT_TRUE(moving.drawable().moving);
  EXPECT_EQ(vertex_output_bytes(*moving.frame, moving.drawable()), 2u * (12 + 16 + 12) + 16) << "at both keys";
  EXPECT_EQ(vertex_output_bytes(*mapped.frame, mapped.drawable()), 12u + 16 + 12 + 16 + 16 + 8)
      << "tangent, coordinate";
  still.frame->request.half_attributes = true;
  EXPECT_EQ(vertex_output_bytes(*still.frame, still.drawable()), 12u + 16 + (12 + 16) / 2);
}

// The normal map of a coat reads along one coordinate and anisotropy runs along another: pixels derive both frames of
// tangents, anisotropy's frame from coordinates at which no texture is read.
TEST(VertexOutputs, CoordinatesThatPixelsDeriveTangentsFromAreThere) {
  const BentPatches scene(0);
  scene::Material material = *scene.drawable().material;
  Image8 image(1, 1, 4);
  image.values = {128, 128, 255, 255};
  material.clearcoat.normal_texture.texture =
      std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
  material.clearcoat.normal_texture.texcoord = 1;
  material.clearcoat.factor = 1, material.anisotropy.strength = 1;
  for (const auto effect : {scene::MaterialEffect::kClearcoat, scene::MaterialEffect::kAnisotropy})
    material.effects[static_cast<std::size_t>(effect)] = true;
  scene::Primitive primitive = *scene.drawable().primitive;
  primitive.vertices.texcoords.push_back(primitive.vertices.texcoords[0]);
  scene::PosedDrawable& drawable = scene.frame->drawables[0];
  drawable.material = &material, drawable.primitive = &primitive;
  ASSERT_EQ(scene::tangent_slot(material).texcoord, 0);
  ASSERT_FALSE(has_vertex_tangents(material));
  EXPECT_EQ(vertex_output_bytes(*scene.frame, drawable), 12u + 16 + 12 + 16 + 2 * 8) << "both sets of coordinates";
  VertexOutputs outputs;
  outputs.begin(*scene.frame, drawable);
  const SurfaceLocation at{1, 4, 0.25f, 0.5f, 0};
  const one_lane::LaneSurface<float> s = interpolated(scene, outputs, at);
  DrawConstants patches = draw_constants(*scene.frame, drawable), mesh = patches;
  outputs.set_mesh(mesh);
  const one_lane::LaneSurface<float> own = one_lane_surface(evaluate_surface(*scene.frame, at));
  for (const int set : {0, 1}) {
    const auto given = one_lane::lane_texcoord(mesh, s, set, shaders::TextureTransform()),
               there = one_lane::lane_texcoord(patches, own, set, shaders::TextureTransform());
    EXPECT_NEAR(given.u, there.u, 1e-3f) << set;
    EXPECT_NEAR(given.v, there.v, 1e-3f) << set;
  }
}

}  // namespace
}  // namespace tessera::tilecore::vertex_outputs_test
