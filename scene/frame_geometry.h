#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/shutter_segment.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "scene/pose.h"
#include "scene/shadow_settings.h"
#include "scene/tessellation_pattern.h"
#include "scene/view.h"

namespace tessera::scene {

// Request for one frame: its size, times and options.
struct FrameRequest {
  int width = 1280, height = 720;
  double open_time = 0, close_time = 0;  // seconds; equal: no motion blur
  TessellationSettings tessellation;
  int max_factor = 64;
  int subpixel_bits = 8;               // fraction bits of the grid to which vertices are rounded: 4 to 8
  bool half_attributes = false;        // interpolated attributes reach the pixel shader in half precision
  bool interpolated_surfaces = false;  // pixels of Bezier patches interpolate attributes of the vertices
  bool height_normals =
      false;  // vertices have the normals of the undisplaced surface, pixels add the gradient of the heights
  bool sample_procedures = false;  // the sampling controller samples procedures; the front end skips their patches
  bool draw_lines = false;         // procedures are paper with ink lines, not shaded surfaces
  // Number of straight pieces into which curved motion is cut: 1 to kMaxMotionSegments. 0 takes as many as needed for
  // at most motion_error pixels between a piece and the curve, up to motion_segments_max.
  int motion_segments = 1;
  double motion_error = 0.25;
  int motion_segments_max = 64;
  // Seconds at which materials, visibility and the set of lights are taken; unset: open_time.
  std::optional<double> state_time;
  // The second motion key of a frame without segments has the projection of its own time instead of the one of shutter
  // open.
  bool projection_moves = false;
  // False draws the scene as if the capture did not have the feature.
  bool displacement = true, alpha_test = true, blending = true, procedures = true;
  ShadowCasters shadow_casters = ShadowCasters::kAuto;
  bool procedure_limits = true;  // procedures are tessellated within their own limits

  double state() const { return state_time.value_or(open_time); }

  std::size_t memory_parts = 1;  // this frame may use one such part of the memory that reading the capture left

  bool operator==(const FrameRequest&) const = default;

  float subpixels() const { return static_cast<float>(1 << subpixel_bits); }  // per pixel along its side
};

// A drawable as posed at the two motion keys of the shutter (0 open, 1 close). Vertices of a drawable that does not deform
// are the capture's own, with the positions that the memory holds (Assembly::held_geometry()).
struct PosedDrawable {
  const Drawable* drawable = nullptr;
  const Primitive* primitive = nullptr;
  const Material* material = nullptr;
  // For procedures: the procedure at each motion key; the same object where its numbers do not differ. Their primitive
  // is empty.
  const Procedure *procedure = nullptr, *procedure_close = nullptr;
  bool moving = false;            // anything differs between the keys, camera included
  bool deforming = false;         // the vertices themselves differ
  bool own_vertices = true;       // both keys use the vertices that the memory holds
  bool curved = false;            // moves by the segments of the frame; such a drawable is moving as well
  bool mirrored = false;          // the node's transform turns triangles inside out
  bool visible = true;            // at shutter open (KHR_node_visibility), for all of the shutter
  std::array<Mat4, 2> to_raster;  // object space to (xh, yh, depth, w)
  std::array<Mat4, 2> to_world;
  // Inverse transpose of to_world's linear part, times a factor that both keys share; the cofactors where the inverse
  // has no bounds.
  std::array<Mat3, 2> normal_to_world;
  std::array<std::span<const Vec3>, 2> positions, normals;
  std::array<std::span<const Vec4>, 2> tangents;
};

// The scene of one frame, read by all later units. Immutable once posed.
struct FrameGeometry {
  const Assembly* assembly = nullptr;
  FrameRequest request;
  ShutterSegment part;                    // part of the shutter that is posed here
  Projection projection;                  // at shutter open; of a segment: at its middle
  std::array<Projection, 2> projections;  // at both motion keys
  std::array<View, 2> views;
  // In the order of Assembly::materials where the request leaves something out of them or they are animated, else
  // empty.
  std::vector<Material> materials;
  std::vector<MaterialValue>
      material_values;         // values that animations give to materials; equal values mean equal materials in two
                               // frames
  PosedProcedures procedures;  // at both motion keys
  std::vector<PosedDrawable> drawables;  // as Assembly::drawables
  // In the order of Assembly::drawn, at both motion keys: the target of the drawables' spans when the pose deforms.
  std::vector<std::array<Deformed, 2>> deformed;
  std::vector<TessellationPattern> patterns;  // as Assembly::grid_patches
  std::vector<float>
      displacement_lod;  // as Assembly::grid_patches: level of detail of heights; 0 where nothing displaces
  std::array<std::vector<shaders::Light>, 2> lights;  // in world space, at both motion keys
  std::vector<int> light_nodes;                       // per light: its node
  std::vector<bool> light_casts;                      // per light: whether anything may occlude it
  std::array<Pose, 2> poses;                          // poses of the nodes
  bool any_motion = false;
  bool moving_lights = false;  // some property of a light differs between the keys
  std::uint64_t identity = 0;  // identifies a pose, for caches that depend on it; never 0 once posed; segments share it
  // Where something moves along a curve: consecutive parts of the shutter, each posed at its own ends. Curved drawables
  // move by the segments, other drawables by the frame of the whole shutter.
  std::vector<std::unique_ptr<FrameGeometry>> segments;
  double motion_error = 0;  // pixels: bound of the distance of the segments from the curves; 0 without segments

  // The frame itself (0) or one of its segments (1 on).
  const FrameGeometry& segment(int number) const {
    return number == 0 ? *this : *segments[static_cast<std::size_t>(number) - 1];
  }
  std::vector<ShutterSegment> parts() const {
    std::vector<ShutterSegment> all;
    for (const auto& one : segments) all.push_back(one->part);
    return all;
  }
  // The segment that holds time t, in a frame with segments.
  int segment_of(float t) const {
    const int code = ShutterSegment::code_of(t);
    const auto after = std::upper_bound(segments.begin(), segments.end(), code,
                                        [](int at, const auto& segment) { return at < segment->part.first; });
    return static_cast<int>(after - segments.begin());
  }
  // Number of the segment by which a patch moves at time t, 0 for the frame itself.
  int segment_at(std::uint32_t patch, float t) const {
    return segments.empty() || !drawable_of(patch).curved ? 0 : segment_of(t);
  }
  struct Moment {
    const FrameGeometry& frame;
    float t;  // within its part of the shutter
  };
  Moment moment(std::uint32_t patch, float t) const {
    const int number = segment_at(patch, t);
    if (number == 0) return {*this, t};
    return {segment(number), segment(number).part.local(t)};
  }
  // Whether this frame's poses draw a drawable: segments draw curved drawables, the frame of the whole shutter draws
  // the others.
  bool moves_here(const PosedDrawable& drawable) const { return drawable.curved != part.whole(); }

  const PosedDrawable& drawable_of(std::uint32_t patch) const { return drawables[assembly->patch_drawable[patch]]; }
  shaders::Lights lights_at(float t) const {
    if (!moving_lights) return {lights[0], {}, 0.0f};
    if (!segments.empty()) {
      const FrameGeometry& now = segment(segment_of(t));
      return {now.lights[0], now.lights[1], now.part.local(t)};
    }
    return {lights[0], lights[1], t};
  }
  // Index of the grid of a patch that has one.
  std::uint32_t grid_of(std::uint32_t patch) const {
    const Drawable& drawable = assembly->drawable_of(patch);
    return drawable.first_grid + (patch - drawable.first_patch);
  }
  const TessellationPattern& pattern_of(std::uint32_t patch) const {
    static constexpr TessellationPattern kNoGrid;
    return has_grid(assembly->drawable_of(patch)) ? patterns[grid_of(patch)] : kNoGrid;
  }

  // Control points of a Bezier patch at a key, in object space.
  std::span<const Vec3, 16> control_points(const PosedDrawable& drawable, std::uint32_t patch, int key) const {
    return drawable.positions[static_cast<std::size_t>(key)]
        .subspan(std::size_t{16} * (patch - drawable.drawable->first_patch))
        .first<16>();
  }
};

// All cells of a base patch: a Bezier patch's grid, or a cluster's list.
CellRange patch_cells(const FrameGeometry& frame, std::uint32_t patch);

// Poses a frame's scene at one time of its shutter, 0 to 1: with the projection of shutter open, with the grids of the
// frame, and without motion. Runs on all threads.
std::unique_ptr<FrameGeometry> pose_moment(const FrameGeometry& frame, double time);

// Another view of a posed scene.
struct SceneView {
  CameraChoice camera;
  int size = 0;                     // pixels along both sides
  std::vector<Material> materials;  // as Assembly::materials
  bool same_grids = false;          // patches keep the patterns of the scene
};
// Poses a frame's scene at shutter open, without lights, in another view. The result refers to vertices of `scene`,
// which must outlive it. Runs on all threads.
std::unique_ptr<FrameGeometry> pose_view(const FrameGeometry& scene, SceneView view);

// Poses the scene at both motion keys and fixes every patch's tessellation pattern. Runs on all threads.
std::unique_ptr<FrameGeometry> pose_frame(const Assembly& assembly, const CameraChoice& camera,
                                          const FrameRequest& request);

// The same, for a frame that follows `before` (null: none). Returns `before` itself where nothing differs; a drawable
// that does not move keeps its patches' patterns.
//
// Invariant (cited by the tests):
//   FG1  Whatever frame came before, the result equals the result of pose_frame() without it, except for times and identity.
std::shared_ptr<const FrameGeometry> pose_frame(const Assembly& assembly, const CameraChoice& camera,
                                                const FrameRequest& request,
                                                std::shared_ptr<const FrameGeometry> before);

}  // namespace tessera::scene
