#include "tests/support/embree_scene.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "tests/support/mesh_triangles.h"
#include "tests/support/tests.h"
#include "tilecore/shading/surface.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::test {
namespace {

using scene::FrameGeometry;
using tilecore::MicroMesh;
using Triangle = std::array<std::int32_t, 3>;

// A vertex at a key in Embree's space.
std::array<float, 3> embree_vertex(const MicroMesh& m, std::size_t v, bool close, const scene::Projection& projection) {
  const double x = static_cast<double>(close ? m.x1[v] : m.x0[v]), y = static_cast<double>(close ? m.y1[v] : m.y0[v]);
  const double z = static_cast<double>(close ? m.z1[v] : m.z0[v]), w = projection.orthographic ? 1.0 : z;
  const double times = m.projected[v] ? w : 1.0;
  return {static_cast<float>((x * times - projection.center_x * w) / projection.scale),
          static_cast<float>((y * times - projection.center_y * w) / projection.scale), static_cast<float>(z)};
}

PerThread<tilecore::Tessellator>& tessellators() {
  static PerThread<tilecore::Tessellator> instance;
  return instance;
}
PerThread<MicroMesh>& meshes() {
  static PerThread<MicroMesh> instance;
  return instance;
}

// Where the mask of a patch is read, by vertex of its mesh.
std::vector<Vec2> mask_coordinates(const FrameGeometry& frame, std::uint32_t number, const MicroMesh& mesh) {
  const scene::PosedDrawable& drawable = frame.drawable_of(number);
  const scene::TextureSlot& slot = drawable.material->base_color_texture;
  std::vector<Vec2> out(mesh.vertex_count, Vec2(0.0f));
  if (slot.texture == nullptr) return out;
  for_each_triangle(mesh, [&](const Triangle& corners, std::uint32_t triangle) {
    for (const std::size_t c : {0, 1, 2}) {
      const tilecore::SurfaceLocation at{number, triangle, c == 1 ? 1.0f : 0.0f, c == 2 ? 1.0f : 0.0f, 0};
      out[static_cast<std::size_t>(corners[c])] =
          tilecore::evaluate_surface(frame, at).texcoord(slot.texcoord, slot.transform).value;
    }
  });
  return out;
}

}  // namespace

EmbreeDevice::EmbreeDevice(const char* configuration) : device_(rtcNewDevice(configuration)) {
  if (device_ == nullptr) throw std::runtime_error("Embree has no device for this configuration");
}
EmbreeDevice::~EmbreeDevice() { rtcReleaseDevice(device_); }

void Agreement::add(const Agreement& o) {
  samples += o.samples, visible += o.visible, ties += o.ties, different_ties += o.different_ties;
  wrong += o.wrong, wrong_depth += o.wrong_depth;
  farthest_edge_pixels = std::max(farthest_edge_pixels, o.farthest_edge_pixels);
}

EmbreeScene::EmbreeScene(const EmbreeDevice& device, const FrameGeometry& frame,
                         const std::vector<std::uint32_t>& patches, const EmbreeOptions& options)
    : frame_(frame),
      scene_(rtcNewScene(device.get())),
      patches_(patches.size()),
      slot_(frame.assembly->patch_count(), Claim::kNothing),
      near_(static_cast<float>(frame.projection.near)),
      far_(frame.projection.far > 0 ? static_cast<float>(frame.projection.far)
                                    : std::numeric_limits<float>::infinity()) {
  if (options.robust) rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    patches_[p].number = patches[p];
    slot_[patches[p]] = static_cast<std::uint32_t>(p);
  }
  parallel_for(patches_.size(), [&](std::size_t p) { fill(device, patches_[p], options); });
  for (const Patch& patch : patches_) triangle_count_ += patch.triangle_count;
}

EmbreeScene::~EmbreeScene() { rtcReleaseScene(scene_); }

void EmbreeScene::fill(const EmbreeDevice& device, Patch& patch, const EmbreeOptions& options) {
  const scene::PosedDrawable& drawable = frame_.drawable_of(patch.number);
  const bool bezier = drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches;
  MicroMesh& mesh = meshes().local();
  const scene::CellRange cells = scene::patch_cells(frame_, patch.number);
  patch.moving = drawable.moving;
  tessellators().local().tessellate(frame_, patch.number, cells, {patch.moving, false}, mesh);

  // ---- Vertices: two motion keys when the patch moves. Grids run backwards along u, so that Embree cuts their cells along
  // the same diagonal as Tessera. ----
  if (options.masks && drawable.material->alpha_mode == scene::AlphaMode::kMask) {
    patch.mask = drawable.material;
    patch.texcoords = mask_coordinates(frame_, patch.number, mesh);
  }
  patch.grid = bezier && options.geometry == EmbreeOptions::Geometry::kGrids && patch.mask == nullptr;
  patch.columns = static_cast<std::uint32_t>(cells.i1 - cells.i0);
  patch.rows = static_cast<std::uint32_t>(cells.j1 - cells.j0);
  const RTCGeometry geometry =
      rtcNewGeometry(device.get(), patch.grid ? RTC_GEOMETRY_TYPE_GRID : RTC_GEOMETRY_TYPE_TRIANGLE);
  const unsigned keys = patch.moving ? 2 : 1;
  rtcSetGeometryTimeStepCount(geometry, keys);
  for (unsigned key = 0; key < keys; ++key) {
    auto* to = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, key, RTC_FORMAT_FLOAT3,
                                                           3 * sizeof(float), mesh.vertex_count));
    for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
      const std::size_t column = v % (patch.columns + 1);
      const std::size_t place = patch.grid ? v - column + (patch.columns - column) : v;
      const auto p = embree_vertex(mesh, v, key == 1, frame_.projection);
      std::copy(p.begin(), p.end(), to + 3 * place);
    }
    patch.vertices[key] = to;
  }

  // ---- Primitives ----
  patch.triangle_count = mesh.triangle_count;
  if (patch.grid) {
    auto* grid = static_cast<RTCGrid*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
    *grid = {0, patch.columns + 1, static_cast<std::uint16_t>(patch.columns + 1),
             static_cast<std::uint16_t>(patch.rows + 1)};
  } else {
    fill_index(geometry, mesh, patch, options);
  }
  patch.facing = options.obey_facing && !drawable.material->double_sided;
  if (patch.facing) {
    patch.keep_positive = drawable.mirrored;
    patch.keep_negative = !drawable.mirrored;
  }
  if (patch.facing || patch.mask != nullptr) {
    rtcSetGeometryUserData(geometry, &patch);
    rtcSetGeometryIntersectFilterFunction(geometry, filter);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene_, geometry, slot_[patch.number]);
  rtcReleaseGeometry(geometry);
}

void EmbreeScene::fill_index(RTCGeometry geometry, const MicroMesh& mesh, Patch& patch, const EmbreeOptions& options) {
  // A patch that is degenerate as a whole keeps one triangle without area: Embree wants a buffer.
  const std::size_t count = std::max<std::size_t>(mesh.triangle_count, 1);
  auto* index = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), count));
  std::fill(index, index + 3, 0u);
  patch.index = index;
  patch.triangle.reserve(count);
  std::uint32_t* to = index;
  for_each_triangle(mesh, [&](const Triangle& corners, std::uint32_t number) {
    for (const std::int32_t c : corners) *to++ = static_cast<std::uint32_t>(c);
    patch.triangle.push_back(number);
  });
  if (patch.triangle.empty()) patch.triangle.push_back(Claim::kNothing);
  if (patch.number != options.missing_patch) return;
  patch.own_index.assign(index, index + 3 * count);
  patch.index = patch.own_index.data();
  for (std::size_t k = 0; k < count; ++k)
    if (patch.triangle[k] == options.missing_triangle) std::fill(index + 3 * k, index + 3 * k + 3, 0u);
}

// The raster-space area of a triangle seen from the origin has the sign of normal * direction.
void EmbreeScene::filter(const RTCFilterFunctionNArguments* arguments) {
  const auto& patch = *static_cast<const Patch*>(arguments->geometryUserPtr);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != -1) continue;
    if (patch.mask != nullptr) {
      const std::uint32_t* const corner =
          patch.index + 3 * std::size_t{RTCHitN_primID(arguments->hit, arguments->N, i)};
      const float u = RTCHitN_u(arguments->hit, arguments->N, i), v = RTCHitN_v(arguments->hit, arguments->N, i);
      const Vec2 at =
          patch.texcoords[corner[0]] * (1.0f - u - v) + patch.texcoords[corner[1]] * u + patch.texcoords[corner[2]] * v;
      const scene::TextureSlot& slot = patch.mask->base_color_texture;
      const float texel = slot.texture == nullptr ? 1.0f : slot.texture->sample(slot.sampler, at, 0.0f).w;
      if (patch.mask->base_color.w * texel < patch.mask->alpha_cutoff) {
        arguments->valid[i] = 0;
        continue;
      }
    }
    if (!patch.facing) continue;
    const float facing =
        RTCHitN_Ng_x(arguments->hit, arguments->N, i) * RTCRayN_dir_x(arguments->ray, arguments->N, i) +
        RTCHitN_Ng_y(arguments->hit, arguments->N, i) * RTCRayN_dir_y(arguments->ray, arguments->N, i) +
        RTCHitN_Ng_z(arguments->hit, arguments->N, i) * RTCRayN_dir_z(arguments->ray, arguments->N, i);
    const bool positive = (facing > 0) != patch.grid;  // mirrored grids wind the other way
    if (!(positive ? patch.keep_positive : patch.keep_negative)) arguments->valid[i] = 0;
  }
}

EmbreeRay EmbreeScene::ray(const tilecore::TileSamples& samples, std::size_t s) const {
  const scene::Projection& p = frame_.projection;
  const bool lens = !samples.lens_u.empty();
  const double u = lens ? static_cast<double>(samples.lens_u[s]) : 0.0,
               v = lens ? static_cast<double>(samples.lens_v[s]) : 0.0;
  const double x = static_cast<double>(samples.x[s]) - p.center_x, y = static_cast<double>(samples.y[s]) - p.center_y;
  const float time = samples.t(s);
  // The point seen at depth z is at x z + u (1 - z / focus), orthographic x + u (1 - z / focus).
  const double still = p.orthographic ? 1.0 : 0.0, turning = 1.0 - still;
  return {static_cast<float>((still * x + u) / p.scale), static_cast<float>((still * y + v) / p.scale),
          static_cast<float>((turning * x - u * p.inverse_focus) / p.scale),
          static_cast<float>((turning * y - v * p.inverse_focus) / p.scale), time};
}

Claim EmbreeScene::claim(std::uint32_t geometry, std::uint32_t primitive, float u, float v, float z) const {
  if (geometry == RTC_INVALID_GEOMETRY_ID) return {};
  const Patch& patch = patches_[geometry];
  if (!patch.grid) return {patch.number, patch.triangle[primitive], z};
  // Embree's cell (0,0), (1,0), (1,1), (0,1) is Tessera's b, a, d, c; it cuts from (1,0) to (0,1), which is a to c.
  const float fu = u * static_cast<float>(patch.columns), fv = v * static_cast<float>(patch.rows);
  const auto column = std::min(static_cast<std::uint32_t>(std::max(fu, 0.0f)), patch.columns - 1),
             row = std::min(static_cast<std::uint32_t>(std::max(fv, 0.0f)), patch.rows - 1);
  const bool first = (fu - static_cast<float>(column)) + (fv - static_cast<float>(row)) < 1.0f;
  return {patch.number, 2 * (row * patch.columns + (patch.columns - 1 - column)) + (first ? 0u : 1u), z};
}

Claim EmbreeScene::trace(const EmbreeRay& r) const {
  RTCRayHit hit{};
  hit.ray.org_x = r.origin_x, hit.ray.org_y = r.origin_y, hit.ray.org_z = 0;
  hit.ray.dir_x = r.direction_x, hit.ray.dir_y = r.direction_y, hit.ray.dir_z = 1;
  hit.ray.tnear = near_, hit.ray.tfar = far_, hit.ray.time = r.time, hit.ray.mask = ~0u;
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_, &context, &hit);
  return claim(hit.hit.geomID, hit.hit.primID, hit.hit.u, hit.hit.v, hit.ray.tfar);
}

// All triangles of a grid's cells, degenerate ones too: no claim names those.
void EmbreeScene::index_grid(Patch& patch) {
  patch.triangle.clear();
  patch.own_index.clear();
  for (std::uint32_t row = 0; row < patch.rows; ++row)
    for (std::uint32_t column = 0; column < patch.columns; ++column) {
      const std::uint32_t a = row * (patch.columns + 1) + (patch.columns - column), below = patch.columns + 1;
      for (const std::uint32_t v : {a, a - 1, a - 1 + below, a, a - 1 + below, a + below}) patch.own_index.push_back(v);
      for (const std::uint32_t half : {0u, 1u}) patch.triangle.push_back(2 * (row * patch.columns + column) + half);
    }
  patch.index = patch.own_index.data();
}

void EmbreeScene::index_triangles() {
  for (Patch& patch : patches_) {
    if (patch.grid) index_grid(patch);
    patch.place.clear();
    for (std::size_t k = 0; k < patch.triangle.size(); ++k) {
      if (patch.triangle[k] == Claim::kNothing) continue;
      if (patch.triangle[k] >= patch.place.size()) patch.place.resize(patch.triangle[k] + 1, Claim::kNothing);
      patch.place[patch.triangle[k]] = static_cast<std::uint32_t>(k);
    }
  }
}

EmbreeScene::Passage EmbreeScene::passage(const EmbreeRay& r, const Claim& claim) const {
  Passage out{std::numeric_limits<double>::infinity(), 0};
  if (slot_[claim.patch] == Claim::kNothing) return out;
  const Patch& patch = patches_[slot_[claim.patch]];
  if (claim.triangle >= patch.place.size() || patch.place[claim.triangle] == Claim::kNothing) return out;
  const std::size_t first = std::size_t{3} * patch.place[claim.triangle];
  const double t = static_cast<double>(r.time), dx = static_cast<double>(r.direction_x),
               dy = static_cast<double>(r.direction_y);
  const double scale = frame_.projection.scale;
  // Corners, and the corners relative to the ray: homogeneous, in pixels.
  std::array<DVec3, 3> at, relative;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t place = 3 * patch.index[first + c] + a;
      const double open = static_cast<double>(patch.vertices[0][place]);
      at[c][static_cast<int>(a)] =
          patch.moving ? (1 - t) * open + t * static_cast<double>(patch.vertices[1][place]) : open;
    }
    relative[c] = {(at[c].x - static_cast<double>(r.origin_x) - at[c].z * dx) * scale,
                   (at[c].y - static_cast<double>(r.origin_y) - at[c].z * dy) * scale,
                   frame_.projection.orthographic ? 1.0 : at[c].z};
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const DVec3 line = glm::cross(relative[c], relative[(c + 1) % 3]);
    const double length = std::hypot(line.x, line.y);
    out.edge_pixels = std::min(out.edge_pixels, length > 0 ? std::abs(line.z) / length : 0.0);
  }
  // A pixel to the side turns the ray by 1 / scale, or shifts it.
  const DVec3 normal = glm::cross(at[1] - at[0], at[2] - at[0]);
  const double along = std::abs(normal.x * dx + normal.y * dy + normal.z),
               z = frame_.projection.orthographic ? 1.0 : static_cast<double>(claim.z);
  out.slope = along > 0 ? z * std::hypot(normal.x, normal.y) / (along * scale) : 0.0;
  return out;
}

void EmbreeScene::compare(const EmbreeRay& r, const Claim& tessera, const Claim& embree, const Tolerance& tolerance,
                          Agreement& agreement) const {
  ++agreement.samples;
  if (tessera.patch != Claim::kNothing) ++agreement.visible;
  const bool agree = tessera == embree;
  Passage nearest{std::numeric_limits<double>::infinity(), 0};
  for (const Claim* claim : {&tessera, &embree}) {
    if (claim->patch == Claim::kNothing || (agree && claim == &embree)) continue;
    const Passage p = passage(r, *claim);
    nearest = {std::min(nearest.edge_pixels, p.edge_pixels), std::max(nearest.slope, p.slope)};
  }
  const auto same_depth = [&](float a, float b) {
    const double distance = std::abs(static_cast<double>(a) - static_cast<double>(b));
    return distance <=
           tolerance.relative_depth * std::abs(static_cast<double>(b)) + tolerance.edge_pixels * nearest.slope;
  };
  bool depth_tie =
      !agree && tessera.patch != Claim::kNothing && embree.patch != Claim::kNothing && same_depth(tessera.z, embree.z);
  for (const Claim* claim : {&tessera, &embree})
    if (claim->patch != Claim::kNothing)
      depth_tie = depth_tie || same_depth(claim->z, near_) || (std::isfinite(far_) && same_depth(claim->z, far_));
  const bool tie = depth_tie || nearest.edge_pixels <= tolerance.edge_pixels;
  if (tie) ++agreement.ties;
  if (!agree && (!depth_tie || nearest.edge_pixels <= tolerance.edge_pixels))
    agreement.farthest_edge_pixels = std::max(agreement.farthest_edge_pixels, nearest.edge_pixels);
  if (!agree)
    ++(tie ? agreement.different_ties : agreement.wrong);
  else if (tessera.patch != Claim::kNothing && !tie && !same_depth(tessera.z, embree.z))
    ++agreement.wrong_depth;
}

}  // namespace tessera::test
