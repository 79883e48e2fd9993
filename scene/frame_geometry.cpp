#include "scene/frame_geometry.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "scene/animation.h"
#include "scene/light_views.h"
#include "scene/limits.h"
#include "scene/motion_segments.h"
#include "scene/patch_displacement.h"
#include "scene/procedure_patch.h"
#include "scene/view_grids.h"
#include "scene/wires.h"

namespace tessera::scene {
namespace {

// Points the drawable's spans at its deformed vertices, if any, otherwise at the vertices that the memory holds.
void connect_spans(const Assembly& assembly, const std::array<Deformed, 2>& storage, PosedDrawable& posed) {
  const HeldGeometry* held = assembly.held_geometry(*posed.drawable);
  for (std::size_t key = 0; key < 2; ++key) {
    const Deformed& deformed = storage[posed.deforming ? key : 0];
    const Vertices& rest = posed.primitive->vertices;
    const bool own = deformed.positions.empty();
    posed.own_vertices = own && !posed.deforming;
    posed.positions[key] = !own              ? std::span<const Vec3>(deformed.positions)
                           : held != nullptr ? std::span<const Vec3>(held->positions)
                                             : std::span<const Vec3>(rest.positions);
    posed.normals[key] = own ? std::span<const Vec3>(rest.normals) : std::span<const Vec3>(deformed.normals);
    posed.tangents[key] = own ? std::span<const Vec4>(rest.tangents) : std::span<const Vec4>(deformed.tangents);
  }
}

// The materials at shutter open, without the features that the request leaves out; empty when they are the assembly's.
std::vector<Material> frame_materials(const Assembly& assembly, const FrameRequest& request, bool animated) {
  if (request.displacement && request.alpha_test && request.blending && !animated) return {};
  std::vector<Material> materials = assembly.materials;
  if (animated) animate_materials(*assembly.capture, request.state(), assembly.material_source, materials);
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

// Deforms the vertices that a primitive's instances share; returns whether the motion keys differ. Views and poses are
// known.
bool deform_drawn(const FrameGeometry& frame, const Drawable& first, std::array<Deformed, 2>& storage) {
  const Capture& capture = *frame.assembly->capture;
  const Primitive& primitive = primitive_of(capture, first);
  for (std::size_t key = 0; key < 2; ++key) {
    deform(capture, first.node, primitive, frame.poses[key], storage[key]);
    if (primitive.wire != Primitive::Wire::kSurface)
      spread_wires(primitive, object_to_world(capture, first.node, first.instance, primitive, frame.poses[key]),
                   frame.views[key], frame.projections[key], storage[key]);
  }
  return storage[0].positions != storage[1].positions;
}

// Inverse transposes at both motion keys. Where the surface is flat at a key, or turned inside out from one to the other,
// the inverse has no bounds; cofactors are as good for directions, with the sign of the key at which it is not flat.
std::array<Mat3, 2> normals_to_world(const std::array<DMat3, 2>& worlds) {
  constexpr double kFlat = 1e-3;  // [assumed] of the larger determinant: below, lengths no longer mix evenly
  const double a = glm::determinant(worlds[0]), b = glm::determinant(worlds[1]);
  if (a * b > 0 && std::min(std::abs(a), std::abs(b)) >= kFlat * std::max(std::abs(a), std::abs(b)))
    return {Mat3(glm::transpose(glm::inverse(worlds[0]))), Mat3(glm::transpose(glm::inverse(worlds[1])))};
  std::array<DMat3, 2> cofactors;
  double largest = 0;
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat3& m = worlds[key];
    cofactors[key] = {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(cofactors[key][column][row]));
  }
  if (!(largest > 0 && std::isfinite(largest))) return {Mat3(1.0f), Mat3(1.0f)};
  const double scale = ((std::abs(a) > std::abs(b) ? a : b) < 0 ? -1 : 1) / largest;
  return {Mat3(cofactors[0] * scale), Mat3(cofactors[1] * scale)};
}

// `posed.deforming` is known.
void pose_drawable(const FrameGeometry& frame, std::span<const Material> materials,
                   std::span<const std::array<Deformed, 2>> deformed, const Drawable& drawable,
                   const std::array<DMat4, 2>& world_to_raster, PosedDrawable& posed) {
  const Assembly& assembly = *frame.assembly;
  const Capture& capture = *assembly.capture;
  posed.drawable = &drawable;
  if (drawable.kind == Primitive::Kind::kProcedure) {
    posed.procedure = &frame.procedures.at(capture, drawable.geometry, 0);
    posed.procedure_close = &frame.procedures.at(capture, drawable.geometry, 1);
    posed.deforming = posed.deforming || posed.procedure != posed.procedure_close;
  }
  posed.primitive = &primitive_of(capture, drawable);
  posed.material = &materials[static_cast<std::size_t>(drawable.material)];
  posed.visible = frame.poses[0].visible[static_cast<std::size_t>(drawable.node)];
  std::array<DMat3, 2> worlds;
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat4 world = vertices_to_world(capture, drawable.node, drawable.instance, *posed.primitive, frame.poses[key],
                                          frame.views[key]);
    posed.to_world[key] = Mat4(world);
    posed.to_raster[key] = Mat4(world_to_raster[key] * world);
    worlds[key] = DMat3(world);
  }
  const std::array<double, 2> winding = {
      winding_determinant(capture, drawable.node, drawable.instance, frame.poses[0]),
      winding_determinant(capture, drawable.node, drawable.instance, frame.poses[1])};
  // The shutter is cut where the sign changes (motion_segments.h): the time with the other sign is negligible here.
  posed.mirrored = (std::abs(winding[0]) > std::abs(winding[1]) ? winding[0] : winding[1]) < 0;
  posed.normal_to_world = normals_to_world(worlds);
  // Normals of patches follow from their control points, in the sense that these have: a skin that mirrors them, not the
  // node's transform, turns them over.
  if (has_grid(drawable) && posed.mirrored != (glm::determinant(worlds[0]) < 0))
    for (Mat3& normals : posed.normal_to_world) normals *= -1.0f;
  posed.moving = posed.deforming || posed.to_raster[0] != posed.to_raster[1];
  connect_spans(assembly, deformed[drawable.drawn], posed);
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
                                         double time, std::vector<int>& nodes) {
  const Pose& pose = poses[key];
  const std::vector<shaders::Light> unplaced = animate_lights(capture, time);
  std::vector<shaders::Light> lights;
  nodes.clear();
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int light = capture.nodes[n].light;
    if (light == kNone || !poses[0].in_scene[n] || !poses[0].visible[n]) continue;
    shaders::Light placed = unplaced[static_cast<std::size_t>(light)];
    const DMat4& world = pose.world[n];
    placed.position = Vec3(DVec3(world[3]));
    const DVec3 forward = -DVec3(world[2]);
    if (glm::length(forward) > 0) placed.direction = Vec3(glm::normalize(forward));
    lights.push_back(placed);
    nodes.push_back(static_cast<int>(n));
  }
  return lights;
}

double time_of(const FrameRequest& request, double shutter) {
  return shutter == 0.0   ? request.open_time
         : shutter == 1.0 ? request.close_time
                          : request.open_time + (request.close_time - request.open_time) * shutter;
}

// Nodes and camera at both ends of the frame's part of the shutter. Without `close` they are the same.
void set_poses(FrameGeometry& frame, const CameraChoice& camera, Pose open, std::optional<Pose> close) {
  const FrameRequest& request = frame.request;
  frame.poses[0] = std::move(open);
  frame.poses[1] = close ? std::move(*close) : frame.poses[0];
  for (std::size_t key = 0; key < 2; ++key) {
    frame.views[key] = camera.view(frame.poses[key]);
    frame.projections[key] = make_projection(camera.at(*frame.assembly->capture, time_of(request, frame.part.at(key))),
                                             request.width, request.height);
  }
}

std::span<const Material> materials_of(const FrameGeometry& frame) {
  return frame.materials.empty() ? std::span<const Material>(frame.assembly->materials)
                                 : std::span<const Material>(frame.materials);
}

// Places all drawables of a frame whose vertices are deformed as its views see them; in a segment of `whole` only the
// curved ones.
void place_drawables(FrameGeometry& frame, std::span<const Material> materials,
                     std::span<const std::array<Deformed, 2>> deformed, const FrameGeometry* whole) {
  std::array<DMat4, 2> world_to_raster;
  for (std::size_t key = 0; key < 2; ++key)
    world_to_raster[key] = frame.projections[key].matrix() * frame.views[key].world_to_camera;
  const std::vector<Drawable>& drawables = frame.assembly->drawables;
  parallel_for(drawables.size(), [&](std::size_t d) {
    if (whole == nullptr || whole->drawables[d].curved)
      pose_drawable(frame, materials, deformed, drawables[d], world_to_raster, frame.drawables[d]);
  });
}

// Poses all drawables; in a segment of `whole` only the curved ones. The segment's others exist but are never drawn.
void pose_drawables(FrameGeometry& frame, std::span<const Material> materials, const FrameGeometry* whole) {
  const Assembly& assembly = *frame.assembly;
  if (whole != nullptr)
    frame.drawables = whole->drawables;
  else
    frame.drawables.resize(assembly.drawables.size());
  frame.deformed.resize(assembly.drawn.size());
  const auto left_out = [&](std::size_t d) { return whole != nullptr && !whole->drawables[d].curved; };
  parallel_for(assembly.drawn.size(), [&](std::size_t d) {
    const DrawnPrimitive& drawn = assembly.drawn[d];
    bool needed = false;
    for (std::uint32_t i = 0; i < drawn.count && !needed; ++i) needed = !left_out(drawn.drawable(i));
    if (!needed) return;
    const bool deforming = deform_drawn(frame, assembly.drawables[drawn.first_drawable], frame.deformed[d]);
    for (std::uint32_t i = 0; i < drawn.count; ++i)
      if (!left_out(drawn.drawable(i))) frame.drawables[drawn.drawable(i)].deforming = deforming;
  });
  place_drawables(frame, materials, frame.deformed, whole);
}

bool same_bits(std::span<const DMat4> a, std::span<const DMat4> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

// Whether two requests are equal except for their times.
bool same_request(const FrameRequest& a, const FrameRequest& b) {
  FrameRequest at_times = b;
  at_times.open_time = a.open_time, at_times.close_time = a.close_time;
  const auto shut = [](const FrameRequest& request) { return request.open_time == request.close_time; };
  return a == at_times && shut(a) == shut(b);
}
bool same_request(const FrameGeometry& a, const FrameGeometry& b) {
  return a.assembly == b.assembly && same_request(a.request, b.request);
}

// Whether a frame without animations equals the camera's view.
bool seen_by(const FrameGeometry& frame, const CameraChoice& camera) {
  const FrameRequest& request = frame.request;
  const Projection projection =
      make_projection(camera.at(*frame.assembly->capture, request.open_time), request.width, request.height);
  const View view = camera.view(frame.poses[0]);
  return projection == frame.projection && same_bits({&view.world_to_camera, 1}, {&frame.views[0].world_to_camera, 1});
}

bool same_pose(const Pose& a, const Pose& b) {
  return same_bits(a.world, b.world) && a.in_scene == b.in_scene && a.visible == b.visible && a.weights == b.weights;
}

// Whether two frames are made from equal data; poses, views, values of materials and lights are known.
bool same_scene(const FrameGeometry& a, const FrameGeometry& b) {
  if (!same_request(a, b) || a.material_values != b.material_values || a.lights != b.lights ||
      a.procedures.values != b.procedures.values)
    return false;
  // Curved motion may leave and come back.
  if (a.request.motion_segments != 1 && !a.assembly->capture->played_animations.empty()) return false;
  for (std::size_t key = 0; key < 2; ++key) {
    if (!same_pose(a.poses[key], b.poses[key]) || a.projections[key] != b.projections[key]) return false;
    if (!same_bits({&a.views[key].world_to_camera, 1}, {&b.views[key].world_to_camera, 1})) return false;
  }
  return a.projection == b.projection;
}

// Whether a drawable's vertices are the memory's own and appear where they did before.
bool rests(const PosedDrawable& drawable, const PosedDrawable& before) {
  return drawable.own_vertices && before.own_vertices && !before.curved && drawable.material == before.material &&
         std::ranges::equal(std::as_bytes(std::span(drawable.to_raster)), std::as_bytes(std::span(before.to_raster)));
}

// `before`: of the same request, or null.
void tessellate(FrameGeometry& frame, const FrameGeometry* before) {
  const Assembly& assembly = *frame.assembly;
  frame.patterns.resize(assembly.grid_patches.size());
  frame.displacement_lod.resize(assembly.grid_patches.size());
  parallel_for(assembly.grid_patches.size(), [&](std::size_t g) {
    const std::uint32_t p = assembly.grid_patches[g];
    const PosedDrawable& drawable = frame.drawable_of(p);
    if (before != nullptr && drawable.procedure == nullptr && rests(drawable, before->drawable_of(p))) {
      frame.patterns[g] = before->patterns[g];
      frame.displacement_lod[g] = before->displacement_lod[g];
      return;
    }
    if (drawable.procedure != nullptr) frame.patterns[g] = procedure_pattern(frame, p);
    if (drawable.drawable->kind != Primitive::Kind::kBezierPatches) return;
    frame.patterns[g] = bezier_pattern(frame, drawable, p);
    if (drawable.material->displacement) frame.displacement_lod[g] = choose_displacement_lod(frame, drawable, p);
  });
}

void place_all_lights(FrameGeometry& frame) {
  for (std::size_t key = 0; key < 2; ++key)
    frame.lights[key] = place_lights(*frame.assembly->capture, frame.poses, key,
                                     time_of(frame.request, frame.part.at(key)), frame.light_nodes);
  frame.moving_lights = frame.lights[0] != frame.lights[1];
  const Capture& capture = *frame.assembly->capture;
  for (const int node : frame.light_nodes) {
    const int light = capture.nodes[static_cast<std::size_t>(node)].light;
    frame.light_casts.push_back(shadow_request(capture, light, frame.request.shadow_casters).has_value());
  }
}

// Throws BudgetError where the poses of all segments need more memory than the capture left.
void charge_segments(const FrameGeometry& frame, const SegmentPlan& plan) {
  const Assembly& assembly = *frame.assembly;
  const Capture& capture = *assembly.capture;
  std::uint64_t bytes = frame.drawables.size() * sizeof(PosedDrawable) +
                        2 * capture.nodes.size() * (sizeof(DMat4) + sizeof(std::vector<float>)) +
                        assembly.grid_patches.size() * (sizeof(TessellationPattern) + sizeof(float));
  for (const auto& keys : frame.procedures.keys)
    if (keys[0] != nullptr) bytes += 2 * (sizeof(Procedure) + keys[0]->pieces.size() * sizeof(Procedure::Piece));
  for (const DrawnPrimitive& drawn : assembly.drawn)
    if (frame.drawables[drawn.first_drawable].deforming)
      bytes += 2 * frame.drawables[drawn.first_drawable].positions[0].size() * (2 * sizeof(Vec3) + sizeof(Vec4));
  const std::uint64_t left = capture.max_bytes - assembly.charged_bytes();
  MemoryBudget budget(capture.max_bytes, capture.file.string(), capture.max_bytes - left / frame.request.memory_parts);
  budget.charge(plan.parts.size(), bytes, "a motion segment (sampling.motion_segments_max)");
}

// Patches keep one grid through all segments, as fine as the finest one needs: triangles keep their numbers.
void share_patterns(FrameGeometry& frame) {
  const auto finer = [](TessellationPattern& into, const TessellationPattern& of) {
    into.nu = std::max(into.nu, of.nu), into.nv = std::max(into.nv, of.nv);
    for (std::size_t e = 0; e < into.edge.size(); ++e) into.edge[e] = std::max(into.edge[e], of.edge[e]);
  };
  for (std::size_t g = 0; g < frame.patterns.size(); ++g) {
    if (!frame.drawable_of(frame.assembly->grid_patches[g]).curved) continue;
    for (const auto& segment : frame.segments) {
      finer(frame.patterns[g], segment->patterns[g]);
      frame.displacement_lod[g] = std::min(frame.displacement_lod[g], segment->displacement_lod[g]);
    }
    for (const auto& segment : frame.segments) {
      segment->patterns[g] = frame.patterns[g];
      segment->displacement_lod[g] = frame.displacement_lod[g];
    }
  }
}

// A drawable that deforms in any segment counts as deforming in all: a patch's record has one size.
void share_deformation(FrameGeometry& frame) {
  std::vector<FrameGeometry*> frames = {&frame};
  for (const auto& segment : frame.segments) frames.push_back(segment.get());
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    if (!frame.drawables[d].curved) continue;
    const bool any = std::any_of(frames.begin(), frames.end(),
                                 [&](const FrameGeometry* posed) { return posed->drawables[d].deforming; });
    if (!any) continue;
    for (FrameGeometry* posed : frames) {
      PosedDrawable& drawable = posed->drawables[d];
      drawable.deforming = drawable.moving = true;
      connect_spans(*posed->assembly, posed->deformed[drawable.drawable->drawn], drawable);
    }
  }
}

// Poses the segments of the shutter where motion is curved.
void cut_shutter(FrameGeometry& frame, const CameraChoice& camera) {
  const SegmentPlan plan = plan_segments(frame, camera);
  if (plan.parts.empty()) return;
  const Assembly& assembly = *frame.assembly;
  charge_segments(frame, plan);
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    PosedDrawable& drawable = frame.drawables[d];
    drawable.curved = plan.curved[d];
    // It may be back where it was.
    drawable.moving = drawable.moving || drawable.curved;
    frame.any_motion = frame.any_motion || drawable.curved;
  }
  frame.motion_error = plan.error;
  for (std::size_t s = 0; s < plan.parts.size(); ++s) {
    frame.segments.push_back(std::make_unique<FrameGeometry>());
    FrameGeometry& segment = *frame.segments.back();
    segment.identity = frame.identity;
    segment.assembly = &assembly;
    segment.request = frame.request;
    segment.part = plan.parts[s];
    // At a jump, the segment that ends takes its pose just before it, and the segment that begins takes its pose just
    // after it.
    const auto pose = [&](std::size_t key) {
      const double shift = (key == 0 ? 0.5 : -0.5) / ShutterSegment::kCodes;
      const bool jump = key == 0 ? plan.jumps[s] : s + 1 < plan.parts.size() && plan.jumps[s + 1];
      return pose_at(*assembly.capture, time_of(frame.request, segment.part.at(key) + (jump ? shift : 0.0)));
    };
    set_poses(segment, camera,
              s == 0          ? frame.poses[0]
              : plan.jumps[s] ? pose(0)
                              : frame.segments[s - 1]->poses[1],
              pose(1));
    const double middle = 0.5 * (segment.part.at(0) + segment.part.at(1));
    segment.projection = make_projection(camera.at(*assembly.capture, time_of(frame.request, middle)),
                                         frame.request.width, frame.request.height);
    segment.procedures = pose_procedures(*assembly.capture, time_of(frame.request, segment.part.at(0)),
                                         time_of(frame.request, segment.part.at(1)));
    // Visibility at shutter open holds for the whole shutter.
    segment.poses[0].visible = segment.poses[1].visible = frame.poses[0].visible;
    pose_drawables(segment, materials_of(frame), &frame);
    for (PosedDrawable& drawable : segment.drawables)
      if (drawable.curved) segment.any_motion = true;
    tessellate(segment, nullptr);
    place_all_lights(segment);
    frame.moving_lights = frame.moving_lights || segment.lights[0] != segment.lights[1];
  }
  share_deformation(frame);
  share_patterns(frame);
}

std::unique_ptr<FrameGeometry> new_frame(const Assembly& assembly, const FrameRequest& request) {
  static std::atomic<std::uint64_t> last_identity = 0;
  auto frame = std::make_unique<FrameGeometry>();
  frame->identity = ++last_identity;
  frame->assembly = &assembly;
  frame->request = request;
  return frame;
}

// Nodes, camera, lights and materials of a frame, from which all else is computed.
std::unique_ptr<FrameGeometry> begin_frame(const Assembly& assembly, const CameraChoice& camera,
                                           const FrameRequest& request) {
  std::unique_ptr<FrameGeometry> frame = new_frame(assembly, request);
  set_poses(
      *frame, camera, pose_at(*assembly.capture, request.open_time),
      request.close_time == request.open_time ? std::optional<Pose>() : pose_at(*assembly.capture, request.close_time));
  // One segment keeps the projection of shutter open.
  frame->projection = frame->projections[0];
  if (!request.projection_moves) frame->projections[1] = frame->projection;
  // State that a frame has only once is taken at shutter open.
  if (request.state_time) {
    const Pose state = pose_at(*assembly.capture, request.state());
    frame->poses[0].visible = frame->poses[1].visible = state.visible;
  }
  frame->material_values = animated_material_values(*assembly.capture, request.state());
  frame->materials = frame_materials(assembly, request, !frame->material_values.empty());
  frame->procedures = pose_procedures(*assembly.capture, request.open_time, request.close_time);
  place_all_lights(*frame);
  return frame;
}

// Drawables and their patterns.
void complete_frame(FrameGeometry& frame, const CameraChoice& camera, const FrameGeometry* before) {
  pose_drawables(frame, materials_of(frame), nullptr);
  for (const PosedDrawable& drawable : frame.drawables) frame.any_motion = frame.any_motion || drawable.moving;
  tessellate(frame, before);
  cut_shutter(frame, camera);
}

}  // namespace

CellRange patch_cells(const FrameGeometry& frame, std::uint32_t patch) {
  const Drawable& drawable = *frame.drawable_of(patch).drawable;
  if (has_grid(drawable)) return {0, 0, frame.pattern_of(patch).nu, frame.pattern_of(patch).nv};
  const Cluster& cluster = frame.assembly->clusters[drawable.geometry].clusters[patch - drawable.first_patch];
  return {0, 0, static_cast<std::uint8_t>(cluster.cell_count), 1};
}

std::unique_ptr<FrameGeometry> pose_moment(const FrameGeometry& frame, double time) {
  FrameRequest request = frame.request;
  request.state_time = request.state();
  request.open_time = request.close_time = time_of(frame.request, time);
  request.motion_segments = 1;
  std::unique_ptr<FrameGeometry> moment = new_frame(*frame.assembly, request);
  moment->poses[0] = pose_at(*frame.assembly->capture, request.open_time);
  moment->poses[0].visible = frame.poses[0].visible;
  moment->poses[1] = moment->poses[0];
  moment->views = {frame.views[0], frame.views[0]};
  moment->projections = {frame.projections[0], frame.projections[0]};
  moment->projection = frame.projections[0];
  moment->materials = frame.materials;
  moment->procedures = pose_procedures(*frame.assembly->capture, request.open_time, request.open_time);
  place_all_lights(*moment);
  pose_drawables(*moment, materials_of(*moment), nullptr);
  moment->patterns = frame.patterns;
  moment->displacement_lod = frame.displacement_lod;
  return moment;
}

std::unique_ptr<FrameGeometry> pose_view(const FrameGeometry& scene, SceneView view) {
  FrameRequest request = scene.request;
  request.width = request.height = view.size;
  request.state_time = request.state();
  request.close_time = request.open_time;
  request.motion_segments = 1;
  request.sample_procedures = request.draw_lines = false;
  std::unique_ptr<FrameGeometry> frame = new_frame(*scene.assembly, request);
  set_poses(*frame, view.camera, scene.poses[0], std::nullopt);
  frame->projection = frame->projections[0];
  frame->materials = std::move(view.materials);
  frame->procedures = pose_procedures(*scene.assembly->capture, request.open_time, request.open_time);
  frame->drawables.resize(scene.drawables.size());
  place_drawables(*frame, materials_of(*frame), scene.deformed, nullptr);
  tessellate(*frame, nullptr);
  if (view.same_grids) keep_grids(scene, *frame);
  return frame;
}

std::unique_ptr<FrameGeometry> pose_frame(const Assembly& assembly, const CameraChoice& camera,
                                          const FrameRequest& request) {
  std::unique_ptr<FrameGeometry> frame = begin_frame(assembly, camera, request);
  complete_frame(*frame, camera, nullptr);
  return frame;
}

std::shared_ptr<const FrameGeometry> pose_frame(const Assembly& assembly, const CameraChoice& camera,
                                                const FrameRequest& request,
                                                std::shared_ptr<const FrameGeometry> before) {
  // Where nothing is animated the time does not matter: not even nodes are posed.
  if (before != nullptr && before->assembly == &assembly && assembly.capture->played_animations.empty() &&
      same_request(request, before->request) && seen_by(*before, camera))
    return before;
  std::unique_ptr<FrameGeometry> frame = begin_frame(assembly, camera, request);
  if (before != nullptr && same_scene(*frame, *before)) return before;
  const bool comparable = before != nullptr && same_request(*frame, *before) &&
                          frame->projection == before->projection && frame->materials.empty();
  complete_frame(*frame, camera, comparable ? before.get() : nullptr);
  return frame;
}

}  // namespace tessera::scene
