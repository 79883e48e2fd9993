#pragma once

#include "frontend/bounds/screen_bounds.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/domain_shader.h"
#include "tests/support/tests.h"

namespace tessera::frontend {

// Scenes that are hard to bound, and the places of their points on screen.

struct SampledPoint {
  double x, y, z;
  bool drawn;
};
// Place on screen of a raster-space point through lens point (lu, lv) of the unit disc.
inline SampledPoint see(const DVec4& r, const scene::Projection& p, double lu, double lv) {
  const double coc = p.orthographic ? 1 - r.z * p.inverse_focus : 1 / r.w - p.inverse_focus;
  return {r.x / r.w - p.lens_scale * lu * coc, r.y / r.w - p.lens_scale * lv * coc, r.z,
          r.z >= p.near && (p.far == 0 || r.z <= p.far)};
}

inline bool inside(const ScreenBounds& b, const SampledPoint& s) {
  return s.x >= static_cast<double>(b.x0) && s.x <= static_cast<double>(b.x1) && s.y >= static_cast<double>(b.y0) &&
         s.y <= static_cast<double>(b.y1) && s.z >= static_cast<double>(b.near_z) &&
         s.z <= static_cast<double>(b.far_z);
}

enum class Hard {
  kRandom,
  kPole,
  kPoint,
  kFolded,
  kParallel,
  kHuge,
  kTiny,
  kFarAway,
  kFlatTexture,
  kCrossing,
  kInside,
  kBigDisplacement,
  kNoMotion,
  kWholeScreenMotion,
  kOpposite,
  kZeroScale,
  kCount
};

inline std::vector<Vec3> hard_net(Hard kind, test::Random& random) {
  std::vector<Vec3> c = test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  for (Vec3& p : c) p += random.in_box(0.4f);
  switch (kind) {
    case Hard::kPole:
      for (std::size_t i = 12; i < 16; ++i) c[i] = c[12];
      break;
    case Hard::kPoint:
      std::fill(c.begin(), c.end(), c[0]);
      break;
    case Hard::kFolded:
      std::swap(c[5], c[10]);
      break;
    case Hard::kParallel:  // both tangents run along x, an angle of 1e-4 apart
      for (Vec3& p : c) p = Vec3(p.x + p.y, 1e-4f * p.y, 0.02f * p.z);
      break;
    case Hard::kHuge:
      for (Vec3& p : c) p *= 1e6f;
      break;
    case Hard::kTiny:
      for (Vec3& p : c) p *= 1e-6f;
      break;
    case Hard::kFarAway:
      for (Vec3& p : c) p = p * 1e-2f + Vec3(1e4f, -2e4f, 5e3f);
      break;
    default:
      break;
  }
  return c;
}

// A capture of two neighbouring patches of a kind, displaced, moving and seen through a lens.
struct Scene {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;

  Scene(Hard kind, test::Random& random) {
    scene::Material material;
    material.double_sided = true;
    const float scale = kind == Hard::kHuge      ? 1e6f
                        : kind == Hard::kTiny    ? 1e-6f
                        : kind == Hard::kFarAway ? 1e-2f
                                                 : 1.0f;
    std::vector<float> heights(64);
    for (float& h : heights) h = kind == Hard::kFlatTexture ? 0.5f : random.uniform(-1, 1);
    const float strength = kind == Hard::kBigDisplacement ? -5.0f : random.uniform(-0.5f, 0.5f);
    material.displacement = test::displacement(8, 8, heights, strength * scale, 0.1f * scale);
    std::vector<Vec3> points = hard_net(kind, random);
    // The neighbour shares the edge u = 1.
    std::vector<Vec3> second = hard_net(kind, random);
    for (std::size_t j = 0; j < 4; ++j) second[4 * j] = points[4 * j + 3];
    points.insert(points.end(), second.begin(), second.end());
    scene::Primitive primitive = test::patches(points, test::add_material(capture, material));
    scene::MorphTarget target;  // deforms as well as moves
    for (std::size_t i = 0; i < points.size(); ++i) target.positions.push_back(random.in_box(0.2f * scale));
    if (kind == Hard::kOpposite) {
      target.positions[0] = Vec3(2, 0, 0);
      target.positions[15] = Vec3(-2, 0, 0);
    }
    for (std::size_t j = 0; j < 4; ++j) target.positions[16 + 4 * j] = target.positions[4 * j + 3];
    primitive.vertices.morph_targets.push_back(target);
    const int node = test::add_node(capture, primitive);
    if (kind == Hard::kZeroScale) capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(1, 0, 1);
    if (kind != Hard::kNoMotion) {
      const double reach = kind == Hard::kWholeScreenMotion ? 40.0 : 1.5;
      test::add_motion(capture, node, DVec3(random.in_box(1)) * reach * static_cast<double>(scale));
      scene::AnimationChannel weights{
          .node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}};
      capture.animations[0].channels.push_back(weights);
    }
    scene::Camera camera;
    camera.near = 0.05f * scale;
    camera.lens = {0.03f * scale, 3.0f * scale};
    const Vec3 middle = points[5];
    const double distance = kind == Hard::kInside ? 0.1 : kind == Hard::kCrossing ? 0.5 : 4.0;
    test::add_camera(capture, DVec3(middle) + DVec3(0.1, 0.2, distance) * static_cast<double>(scale), camera);
    assembly = assemble(capture);
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    scene::FrameRequest request;
    request.width = 320;
    request.height = 240;
    request.open_time = 0.25;
    request.close_time = 0.75;
    frame = pose_frame(assembly, choose_camera(capture, 320, 240), request);
  }
};

// d(u,v) of a patch in double precision, in raster space at a key. Heights are read as the machine reads them.
inline DVec4 displaced_point(const scene::FrameGeometry& frame, std::uint32_t patch, float u, float v,
                             std::size_t key) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  shaders::ControlPoints<double> c;
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  for (std::size_t i = 0; i < 16; ++i)
    c[i] = {static_cast<double>(points[i].x), static_cast<double>(points[i].y), static_cast<double>(points[i].z)};
  const double du = static_cast<double>(u), dv = static_cast<double>(v);
  const auto p = shaders::bicubic_point<double>(shaders::bicubic_row(c, dv), du);
  const auto n = shaders::bicubic_normal(c, du, dv, p);
  const auto d = p.position + n * static_cast<double>(patch_displacement(frame, drawable, patch).offset(u, v));
  return DMat4(drawable.to_raster[key]) * DVec4(d.x, d.y, d.z, 1);
}

inline constexpr const char* kHardNames[] = {"Random",
                                             "Pole",
                                             "AllPointsEqual",
                                             "Folded",
                                             "NearlyParallelTangents",
                                             "HugeCoordinates",
                                             "TinyCoordinates",
                                             "FarFromTheOrigin",
                                             "FlatTexture",
                                             "CrossingTheCameraPlane",
                                             "CameraInside",
                                             "DisplacementLargerThanThePatch",
                                             "NoMotion",
                                             "MotionLargerThanTheScreen",
                                             "OppositeMotionAtTwoCorners",
                                             "ZeroScale"};

}  // namespace tessera::frontend
