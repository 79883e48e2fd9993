#include "scene/frame_geometry.h"

#include <atomic>

#include "base/parallel.h"
#include "scene/animated_values.h"
#include "scene/patch_displacement.h"
#include "scene/procedure_patch.h"
#include "scene/wires.h"

namespace tessera::scene {
namespace {

// Points the drawable's spans at deformed vertices where there are any, at the capture's otherwise.
void connect_spans(const std::array<Deformed, 2>& storage, PosedDrawable& posed) {
  for (std::size_t key = 0; key < 2; ++key) {
    const Deformed& deformed = storage[posed.deforming ? key : 0];
    const Vertices& rest = posed.primitive->vertices;
    const bool own = deformed.positions.empty();
    posed.positions[key] = own ? std::span<const Vec3>(rest.positions) : std::span<const Vec3>(deformed.positions);
    posed.normals[key] = own ? std::span<const Vec3>(rest.normals) : std::span<const Vec3>(deformed.normals);
    posed.tangents[key] = own ? std::span<const Vec4>(rest.tangents) : std::span<const Vec4>(deformed.tangents);
  }
}

// The materials at shutter open, without what the request leaves out; empty when they are the assembly's.
std::vector<Material> frame_materials(const Assembly& assembly, const FrameRequest& request, bool animated) {
  if (request.displacement && request.alpha_test && request.blending && !animated) return {};
  std::vector<Material> materials = assembly.materials;
  if (animated) animate_materials(*assembly.capture, request.open_time, assembly.material_source, materials);
  for (Material& material : materials) {
    if (!request.displacement) material.displacement.reset();
    if (!request.alpha_test && material.alpha_mode == AlphaMode::kMask) material.alpha_mode = AlphaMode::kOpaque;
    if (!request.blending && material.alpha_mode == AlphaMode::kBlend) material.alpha_mode = AlphaMode::kOpaque;
  }
  return materials;
}

const Primitive& primitive_of(const Capture& capture, const Drawable& drawable) {
  static const Primitive kNoPrimitive = [] {
    Primitive none;
    none.kind = Primitive::Kind::kProcedure;
    return none;
  }();
  if (drawable.kind == Primitive::Kind::kProcedure) return kNoPrimitive;
  return capture.meshes[static_cast<std::size_t>(drawable.mesh)]
      .primitives[static_cast<std::size_t>(drawable.primitive)];
}

// Deforms what a primitive's instances share; whether the motion keys differ. Views and poses are known.
bool deform_drawn(const FrameGeometry& frame, const Drawable& first, std::array<Deformed, 2>& storage) {
  const Capture& capture = *frame.assembly->capture;
  const Primitive& primitive = primitive_of(capture, first);
  for (std::size_t key = 0; key < 2; ++key) {
    deform(capture, first.node, primitive, frame.poses[key], storage[key]);
    if (primitive.wire != Primitive::Wire::kSurface)
      spread_wires(primitive, object_to_world(capture, first.node, first.instance, primitive, frame.poses[key]),
                   frame.views[key], frame.projection, storage[key]);
  }
  return storage[0].positions != storage[1].positions;
}

// `posed.deforming` is known.
void pose_drawable(const FrameGeometry& frame, std::span<const Material> materials, const Drawable& drawable,
                   const std::array<DMat4, 2>& world_to_raster, PosedDrawable& posed) {
  const Assembly& assembly = *frame.assembly;
  const Capture& capture = *assembly.capture;
  posed.drawable = &drawable;
  if (drawable.kind == Primitive::Kind::kProcedure) posed.procedure = &capture.procedures[drawable.geometry];
  posed.primitive = &primitive_of(capture, drawable);
  posed.material = &materials[static_cast<std::size_t>(drawable.material)];
  posed.visible = frame.poses[0].visible[static_cast<std::size_t>(drawable.node)];
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat4 world = vertices_to_world(capture, drawable.node, drawable.instance, *posed.primitive, frame.poses[key],
                                          frame.views[key]);
    posed.to_world[key] = Mat4(world);
    posed.to_raster[key] = Mat4(world_to_raster[key] * world);
    const double determinant = glm::determinant(DMat3(world));
    posed.mirrored = determinant < 0;
    posed.normal_to_world[key] = determinant != 0 ? Mat3(glm::transpose(glm::inverse(DMat3(world)))) : Mat3(1.0f);
  }
  posed.moving = posed.deforming || posed.to_raster[0] != posed.to_raster[1];
  connect_spans(frame.deformed[drawable.drawn], posed);
}

// Factors of a Bezier patch: each edge by its own control points, the grid by the longest of all rows and columns.
TessellationPattern bezier_pattern(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch) {
  std::array<std::array<Vec4, 16>, 2> raster;
  for (std::size_t key = 0; key < 2; ++key) {
    const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
    for (std::size_t i = 0; i < 16; ++i) raster[key][i] = drawable.to_raster[key] * Vec4(points[i], 1.0f);
  }
  const float near_w = frame.projection.orthographic ? 1.0f : static_cast<float>(frame.projection.near);
  const auto factor = [&](std::size_t first, std::size_t step) {
    std::array<std::array<Vec4, 4>, 2> curve;
    for (std::size_t key = 0; key < 2; ++key)
      for (std::size_t k = 0; k < 4; ++k) curve[key][k] = raster[key][first + k * step];
    return curve_factor(curve, near_w, frame.request.tessellation, frame.request.max_factor);
  };
  TessellationPattern pattern;
  pattern.edge = {static_cast<std::uint8_t>(factor(0, 1)), static_cast<std::uint8_t>(factor(12, 1)),
                  static_cast<std::uint8_t>(factor(0, 4)), static_cast<std::uint8_t>(factor(3, 4))};
  pattern.nu =
      static_cast<std::uint8_t>(std::max({int{pattern.edge[0]}, int{pattern.edge[1]}, factor(4, 1), factor(8, 1)}));
  pattern.nv =
      static_cast<std::uint8_t>(std::max({int{pattern.edge[2]}, int{pattern.edge[3]}, factor(1, 4), factor(2, 4)}));
  return pattern;
}

// Lights that are visible at shutter open, where they are at a key, which is at `time`.
std::vector<shaders::Light> place_lights(const Capture& capture, const std::array<Pose, 2>& poses, std::size_t key,
                                         double time) {
  const Pose& pose = poses[key];
  const std::vector<shaders::Light> unplaced = animate_lights(capture, time);
  std::vector<shaders::Light> lights;
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int light = capture.nodes[n].light;
    if (light == kNone || !poses[0].in_scene[n] || !poses[0].visible[n]) continue;
    shaders::Light placed = unplaced[static_cast<std::size_t>(light)];
    const DMat4& world = pose.world[n];
    placed.position = Vec3(DVec3(world[3]));
    const DVec3 forward = -DVec3(world[2]);
    if (glm::length(forward) > 0) placed.direction = Vec3(glm::normalize(forward));
    lights.push_back(placed);
  }
  return lights;
}

}  // namespace

CellRange patch_cells(const FrameGeometry& frame, std::uint32_t patch) {
  const Drawable& drawable = *frame.drawable_of(patch).drawable;
  if (has_grid(drawable)) return {0, 0, frame.pattern_of(patch).nu, frame.pattern_of(patch).nv};
  const Cluster& cluster = frame.assembly->clusters[drawable.geometry].clusters[patch - drawable.first_patch];
  return {0, 0, static_cast<std::uint8_t>(cluster.cell_count), 1};
}

std::unique_ptr<FrameGeometry> pose_frame(const Assembly& assembly, const CameraChoice& camera,
                                          const FrameRequest& request) {
  static std::atomic<std::uint64_t> last_identity = 0;
  auto frame = std::make_unique<FrameGeometry>();
  frame->identity = ++last_identity;
  frame->assembly = &assembly;
  frame->request = request;
  frame->projection = make_projection(camera.at(*assembly.capture, request.open_time), request.width, request.height);
  std::array<Pose, 2>& poses = frame->poses;
  poses[0] = pose_at(*assembly.capture, request.open_time);
  poses[1] = request.close_time == request.open_time ? poses[0] : pose_at(*assembly.capture, request.close_time);
  std::array<DMat4, 2> world_to_raster;
  for (std::size_t key = 0; key < 2; ++key) {
    frame->views[key] = camera.view(poses[key]);
    world_to_raster[key] = frame->projection.matrix() * frame->views[key].world_to_camera;
  }
  frame->drawables.resize(assembly.drawables.size());
  frame->deformed.resize(assembly.drawn.size());
  frame->material_values = animated_material_values(*assembly.capture, request.open_time);
  frame->materials = frame_materials(assembly, request, !frame->material_values.empty());
  const std::span<const Material> materials = frame->materials.empty() ? std::span<const Material>(assembly.materials)
                                                                       : std::span<const Material>(frame->materials);
  parallel_for(assembly.drawn.size(), [&](std::size_t d) {
    const DrawnPrimitive& drawn = assembly.drawn[d];
    const bool deforming = deform_drawn(*frame, assembly.drawables[drawn.first_drawable], frame->deformed[d]);
    for (std::uint32_t i = 0; i < drawn.count; ++i) frame->drawables[drawn.drawable(i)].deforming = deforming;
  });
  parallel_for(assembly.drawables.size(), [&](std::size_t d) {
    pose_drawable(*frame, materials, assembly.drawables[d], world_to_raster, frame->drawables[d]);
  });
  for (const PosedDrawable& drawable : frame->drawables) frame->any_motion = frame->any_motion || drawable.moving;
  frame->patterns.resize(assembly.grid_patches.size());
  frame->displacement_lod.resize(assembly.grid_patches.size());
  parallel_for(assembly.grid_patches.size(), [&](std::size_t g) {
    const std::uint32_t p = assembly.grid_patches[g];
    const PosedDrawable& drawable = frame->drawable_of(p);
    if (drawable.procedure != nullptr) frame->patterns[g] = procedure_pattern(*frame, p);
    if (drawable.drawable->kind != Primitive::Kind::kBezierPatches) return;
    frame->patterns[g] = bezier_pattern(*frame, drawable, p);
    if (drawable.material->displacement) frame->displacement_lod[g] = choose_displacement_lod(*frame, drawable, p);
  });
  frame->lights = {place_lights(*assembly.capture, poses, 0, request.open_time),
                   place_lights(*assembly.capture, poses, 1, request.close_time)};
  frame->moving_lights = frame->lights[0] != frame->lights[1];
  return frame;
}

}  // namespace tessera::scene
