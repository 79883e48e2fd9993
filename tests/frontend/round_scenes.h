#pragma once

#include "frontend/patch_splitter.h"
#include "scene/subpixel.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend {

// Objects that turn their back on the camera here and there, and the visibility of their triangles to the machine.

// Nine unequal pieces of one bent patch: neighbours have the same normals and texture coordinates on the edges that they
// share, but read heights at levels of detail of their own.
inline scene::Primitive bent_sheet(int material) {
  std::vector<Vec3> whole;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const float x = static_cast<float>(i) / 1.5f - 1, y = static_cast<float>(j) / 1.5f - 1;
      whole.emplace_back(x, y, 0.25f * (x * x + y * y));
    }
  const PatchNet net = make_net(std::span<const Vec3, 16>(whole.data(), 16));
  constexpr float kCuts[] = {0, 0.2f, 0.7f, 1};
  std::vector<Vec3> points;
  std::vector<Vec2> texcoords;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) {
      const PatchNet piece = restrict_net(net, {kCuts[i], kCuts[j], kCuts[i + 1], kCuts[j + 1]});
      for (std::size_t k = 0; k < 16; ++k) {
        points.push_back(Vec3(piece.point(k)));
        const float s = static_cast<float>(k % 4) / 3, t = static_cast<float>(k / 4) / 3;
        texcoords.emplace_back(kCuts[i] * (1 - s) + kCuts[i + 1] * s, kCuts[j] * (1 - t) + kCuts[j + 1] * t);
      }
    }
  scene::Primitive primitive = test::patches(points, material);
  primitive.vertices.texcoords = {texcoords};
  return primitive;
}

// A ball of 48 * 24 quads with bumps that turn some triangles away from their neighbours.
inline scene::Primitive bumpy_ball(int material, test::Random& random) {
  constexpr int kAround = 48, kUp = 24;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= kUp; ++j)
    for (int i = 0; i < kAround; ++i) {
      const float a = static_cast<float>(i) * 6.2831853f / kAround, b = static_cast<float>(j) * 3.1415927f / kUp;
      const float r = 1.0f + random.uniform(-0.02f, 0.02f);
      positions.push_back(Vec3(std::sin(b) * std::cos(a), -std::cos(b), -std::sin(b) * std::sin(a)) * r);
    }
  const auto at = [](int i, int j) { return static_cast<std::uint32_t>(j * kAround + i % kAround); };
  for (int j = 0; j < kUp; ++j)
    for (int i = 0; i < kAround; ++i)
      for (const std::uint32_t index :
           {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)})
        indices.push_back(index);
  return test::triangles(positions, indices, material);
}

struct RoundScene {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  struct Options {
    float displacement = 0;  // strength of smooth bumps
    bool moving = false, mirrored = false, deforming = false;
    float aperture = 0;
    double target_pixels = 3;
    bool orthographic = false;
    bool sheet = false;
    bool mesh = false;    // triangles in clusters
    float offset = 0.5f;  // how far from the middle of the view
  };

  RoundScene(const Options& options, test::Random& random) {
    scene::Material material;
    if (options.displacement != 0) {
      std::vector<float> heights(32 * 32);
      for (std::size_t i = 0; i < heights.size(); ++i)
        heights[i] = std::sin(static_cast<float>(i % 32) * 0.3927f) * std::cos(static_cast<float>(i / 32) * 0.3927f);
      material.displacement = test::displacement(32, 32, heights, options.displacement, 0.01f);
    }
    const int number = test::add_material(capture, material);
    scene::Primitive primitive = options.mesh    ? bumpy_ball(number, random)
                                 : options.sheet ? bent_sheet(number)
                                                 : test::closed_patches(number);
    if (options.deforming) {
      scene::MorphTarget target;
      for (const Vec3& p : primitive.vertices.positions) target.positions.push_back(p * 0.3f + Vec3(0.1f * p.y, 0, 0));
      primitive.vertices.morph_targets.push_back(target);
    }
    const int node = test::add_node(capture, primitive, DVec3(random.in_box(options.offset)));
    scene::Node& placed = capture.nodes[static_cast<std::size_t>(node)];
    placed.transform.rotation = glm::normalize(DQuat(1, DVec3(random.in_box(1))));
    placed.transform.scale = DVec3(options.mirrored ? -1 : 1, static_cast<double>(random.uniform(0.6f, 1.4f)), 1);
    if (options.moving) test::add_motion(capture, node, DVec3(random.in_box(2)));
    if (options.deforming) {
      if (capture.animations.empty()) capture.animations.emplace_back();
      capture.animations[0].channels.push_back(
          {.node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
      capture.played_animations = {0};
    }
    scene::Camera camera;
    camera.near = 0.05f;
    if (options.orthographic) {
      camera.type = scene::Camera::Type::kOrthographic;
      camera.x_mag = camera.y_mag = 1.6f;
    }
    camera.lens = {options.aperture, 3.0f};
    test::add_camera(capture, DVec3(0, 0, 4), camera);
    assembly = assemble(capture);
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    scene::FrameRequest request;
    request.width = 320;
    request.height = 240;
    request.open_time = 0.25;
    request.close_time = 0.5;
    request.tessellation.target_edge_pixels = options.target_pixels;
    frame = pose_frame(assembly, choose_camera(capture, 320, 240), request);
  }
};

// A vertex as the machine projects it: single precision, snapped, at both motion keys; and in raster space.
struct RasterVertex {
  std::array<glm::dvec2, 2> at;
  std::array<double, 2> depth;
  std::array<DVec4, 2> raster;
};
inline RasterVertex raster_vertex(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                  const std::array<Vec3, 2>& points) {
  RasterVertex out;
  for (std::size_t key = 0; key < 2; ++key) {
    const Vec4 r = drawable.to_raster[key] * Vec4(points[key], 1.0f);
    const float w = frame.projection.orthographic ? 1.0f : r.w;
    const auto snap = [](float x) {
      return static_cast<double>(std::nearbyint(x * scene::kSubpixels) / scene::kSubpixels);
    };
    out.at[key] = {snap(r.x / w), snap(r.y / w)};
    out.depth[key] = static_cast<double>(r.z);
    out.raster[key] = DVec4(r);
  }
  return out;
}

// Projects vertex (i, j) of a patch's grid.
inline RasterVertex project(const scene::FrameGeometry& frame, std::uint32_t patch, int i, int j) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  scene::OwnedVertex vertex{patch, pattern.u(i, j), pattern.v(i, j)};
  if (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv)
    vertex = boundary_vertex(pattern, frame.assembly->neighbours[0][patch], i, j);
  return raster_vertex(frame, drawable,
                       {domain_point(frame, drawable, vertex.patch, vertex.u, vertex.v, 0),
                        domain_point(frame, drawable, vertex.patch, vertex.u, vertex.v, 1)});
}

// The corners of a cell, of a grid or of a cluster's list; its triangles are 0 1 2 and 0 2 3.
inline std::array<RasterVertex, 4> cell_corners(const scene::FrameGeometry& frame, std::uint32_t patch, int x, int y) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  if (has_grid(*drawable.drawable))
    return {project(frame, patch, x, y), project(frame, patch, x + 1, y), project(frame, patch, x + 1, y + 1),
            project(frame, patch, x, y + 1)};
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  const scene::ClusterCell& cell = clusters.cells[cluster.first_cell + static_cast<std::uint32_t>(x)];
  std::array<RasterVertex, 4> out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t vertex = clusters.vertices[cluster.first_vertex + cell.corner[k]];
    out[k] = raster_vertex(frame, drawable, {drawable.positions[0][vertex], drawable.positions[1][vertex]});
  }
  return out;
}

// Place on screen at time t through a lens point: screen positions move at the rate of perspective.
inline glm::dvec2 seen_at(const RasterVertex& v, const scene::Projection& p, double t, glm::dvec2 lens) {
  const double depth = v.depth[0] * (1 - t) + v.depth[1] * t;
  const double rate = p.orthographic ? t : t * v.depth[1] / depth;
  const double coc = p.orthographic ? 1 - depth * p.inverse_focus : 1 / depth - p.inverse_focus;
  return v.at[0] + (v.at[1] - v.at[0]) * rate - lens * (p.lens_scale * coc);
}

// Twice a triangle's area on screen, negative where it faces the camera.
inline double facing_area(const scene::FrameGeometry& frame, bool mirrored, const RasterVertex& p,
                          const RasterVertex& q, const RasterVertex& r, double t, glm::dvec2 lens) {
  const glm::dvec2 a = seen_at(p, frame.projection, t, lens), b = seen_at(q, frame.projection, t, lens),
                   c = seen_at(r, frame.projection, t, lens);
  const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  return mirrored ? -area : area;  // counter-clockwise with y down is negative
}

// Number of times that one of a cell's two triangles faces the camera, over four times and lens points.
inline std::uint64_t front_facing(const scene::FrameGeometry& frame, std::uint32_t patch, int x, int y,
                                  test::Random& random) {
  std::uint64_t count = 0;
  const std::array<RasterVertex, 4> corner = cell_corners(frame, patch, x, y);
  const bool mirrored = frame.drawable_of(patch).mirrored;
  for (int s = 0; s < 4; ++s) {
    const double t = s < 2 ? s : static_cast<double>(random.uniform(0, 1)),
                 angle = static_cast<double>(random.uniform(0, 6.2831f));
    const glm::dvec2 lens(std::cos(angle), std::sin(angle));
    for (const std::size_t k : {std::size_t{1}, std::size_t{2}})
      if (facing_area(frame, mirrored, corner[0], corner[k], corner[k + 1], t, lens) < -1e-9) ++count;
  }
  return count;
}

}  // namespace tessera::frontend
