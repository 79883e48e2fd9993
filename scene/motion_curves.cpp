#include "scene/motion_curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "base/parallel.h"
#include "scene/wires.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::scene {
namespace {

constexpr std::size_t kPoints = 64;      // of a primitive whose vertices move
constexpr std::size_t kPatches = 32;     // of a displaced primitive that deforms
constexpr std::size_t kMaxFlips = 64;    // number of flips that are located exactly
constexpr int kFlipSteps = 20;           // halvings
constexpr std::size_t kCubicPieces = 4;  // of a cubic spline between two keys, at least
constexpr std::size_t kZoomPieces = 2;
constexpr std::size_t kLooks = 5;  // times at which a piece is sampled: its ends and its quarters
constexpr double kBetweenPlaces =
    0.05;  // [assumed] share of an offset by which normals may point beyond the sampled ones

bool moves_on_screen(AnimatedPath path) {
  return path <= AnimatedPath::kWeights || path >= AnimatedPath::kShapeNumbers ||
         (path >= AnimatedPath::kFieldOfView && path <= AnimatedPath::kYMag);
}

double time_at(const FrameRequest& request, double u) {
  return u == 0.0   ? request.open_time
         : u == 1.0 ? request.close_time
                    : request.open_time + (request.close_time - request.open_time) * u;
}

template <class Visit>
void for_each_moving_channel(const Capture& capture, const Visit& visit) {
  for (const int a : capture.played_animations)
    for (const AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels)
      if (moves_on_screen(channel.path)) visit(channel);
}

// ---- Times ------------------------------------------------------------------------------------------------------

std::vector<CurveTime> key_times(const Capture& capture, const FrameRequest& request) {
  const double open = request.open_time, length = request.close_time - open;
  std::vector<CurveTime> times = {{0.0}, {1.0}};
  for_each_moving_channel(capture, [&](const AnimationChannel& channel) {
    const auto first = std::upper_bound(channel.times.begin(), channel.times.end(), open,
                                        [](double t, float key) { return t < static_cast<double>(key); });
    for (auto key = first; key != channel.times.end() && static_cast<double>(*key) < request.close_time; ++key)
      times.push_back(
          {(static_cast<double>(*key) - open) / length, true, channel.interpolation == Interpolation::kStep});
  });
  std::sort(times.begin(), times.end(), [](const CurveTime& a, const CurveTime& b) { return a.at < b.at; });
  std::vector<CurveTime> merged;
  for (const CurveTime& time : times) {
    if (merged.empty() || time.at > merged.back().at)
      merged.push_back(time);
    else
      merged.back().key = merged.back().key || time.key, merged.back().jump = merged.back().jump || time.jump;
  }
  return merged;
}

// Whether a node draws patches that are displaced.
bool displaces(const Capture& capture, int node) {
  const int mesh = node == kNone ? kNone : capture.nodes[static_cast<std::size_t>(node)].mesh;
  if (mesh == kNone) return false;
  return std::ranges::any_of(capture.meshes[static_cast<std::size_t>(mesh)].primitives, [&](const Primitive& one) {
    return one.kind == Primitive::Kind::kBezierPatches && one.material != kNone &&
           capture.materials[static_cast<std::size_t>(one.material)].displacement;
  });
}

// How much rotations turn from `a` to `b`, no key between them, along the chain of nodes that turns most; and whether
// anything follows a cubic spline, or zooms.
struct Activity {
  double turn = 0;
  bool cubic = false, zoom = false;
};
Activity activity(const Capture& capture, int camera_node, double a, double b) {
  Activity out;
  std::vector<double> own(capture.nodes.size(), 0.0);
  for_each_moving_channel(capture, [&](const AnimationChannel& channel) {
    if (channel.times.empty() || b <= static_cast<double>(channel.times.front()) ||
        a >= static_cast<double>(channel.times.back()))
      return;
    // Tips of displaced patches whose normals a morph turns move along curves as well.
    out.cubic = out.cubic || channel.interpolation == Interpolation::kCubicSpline ||
                (channel.path == AnimatedPath::kWeights && displaces(capture, channel.node));
    out.zoom = out.zoom || channel.path >= AnimatedPath::kFieldOfView;
    if (channel.path != AnimatedPath::kRotation || channel.interpolation == Interpolation::kStep) return;
    const std::size_t steps = channel.interpolation == Interpolation::kCubicSpline ? 2 * kCubicPieces : 1;
    std::array<DQuat, 2> q;
    for (std::size_t k = 0; k <= steps; ++k) {
      // Just inside of the interval: the ends may be keys.
      const double share = std::clamp(static_cast<double>(k) / static_cast<double>(steps), 1e-9, 1 - 1e-9);
      const std::vector<double> v = evaluate_channel(channel, a + (b - a) * share);
      q[0] = std::exchange(q[1], glm::normalize(DQuat(v[3], v[0], v[1], v[2])));
      if (k > 0)
        own[static_cast<std::size_t>(channel.node)] += 2 * std::acos(std::min(1.0, std::abs(glm::dot(q[0], q[1]))));
    }
  });
  if (std::ranges::all_of(own, [](double turn) { return turn == 0; })) return out;
  // Down the trees.
  std::vector<int> stack;
  for (std::size_t n = 0; n < own.size(); ++n)
    if (capture.nodes[n].parent == kNone) stack.push_back(static_cast<int>(n));
  while (!stack.empty()) {
    const auto n = static_cast<std::size_t>(stack.back());
    stack.pop_back();
    out.turn = std::max(out.turn, own[n]);
    for (const int child : capture.nodes[n].children) {
      own[static_cast<std::size_t>(child)] += own[n];
      stack.push_back(child);
    }
  }
  if (camera_node != kNone) out.turn += own[static_cast<std::size_t>(camera_node)];
  return out;
}

// ---- Points -----------------------------------------------------------------------------------------------------

// The scene at one time.
struct Instant {
  Pose pose;
  PosedProcedures procedures;
  View view;
  Projection projection;
};

// Sides of a rectangle that is `margin` frames larger than the frame, which a point is beyond: bits.
unsigned beyond(const DVec4& raster, const Projection& p, const FrameRequest& request, double margin) {
  if (!p.orthographic && raster.w < p.near) return 0;
  const double w = p.orthographic ? 1.0 : raster.w, x = raster.x / w, y = raster.y / w, dx = margin * request.width,
               dy = margin * request.height;
  return (x < -dx ? 1u : 0u) | (x > request.width + dx ? 2u : 0u) | (y < -dy ? 4u : 0u) |
         (y > request.height + dy ? 8u : 0u);
}

// Pixels by which a point at `at` is seen elsewhere for a difference in raster space, its circle of confusion included.
double pixels_of(const DVec4& difference, const DVec4& at, const Projection& p) {
  if (p.orthographic)
    return std::hypot(difference.x, difference.y) + p.lens_scale * p.inverse_focus * std::abs(difference.z);
  const double w = std::max(at.w, p.near);
  return std::hypot(difference.x - at.x / w * difference.w, difference.y - at.y / w * difference.w) / w +
         p.lens_scale * std::abs(difference.w) / (w * w);
}

bool in_front(const DVec4& at, const Projection& p) { return p.orthographic || at.w >= p.near; }

// The instants of a piece, in even steps.
using Instants = std::array<const Instant*, kLooks>;

// Points of a drawable in the space that a matrix takes to the world.
using Points = std::vector<DVec4>;

void add_corners(const DVec3& low, const DVec3& high, Points& out) {
  for (int k = 0; k < 8; ++k)
    out.emplace_back((k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y, (k & 4) != 0 ? high.z : low.z, 1.0);
}

// Data that the instances of a primitive share.
struct Body {
  Points corners;     // of the box of its surface: a matrix moves no point of it farther than these
  Primitive sampled;  // where vertices move: some of them
  bool wire = false, deforms = false;
  // Displaced surfaces that deform: corners of the boxes of the vertices that each joint, or the node, moves.
  std::vector<std::pair<int, Points>> parts;  // the joint's number in the skin; kNone: by the node
  // Whole patches of such surfaces, and the lowest and highest offset: where normals turn, tips move along curves
  // whatever the control points do.
  Primitive surfaces;
  std::array<double, 2> offsets{};
};

// The state of a body's primitives at an instant.
struct DeformedBody {
  Deformed sampled, surfaces;
};

// The lowest and highest offset that a displacement's texture has.
std::array<double, 2> extreme_offsets(const Displacement& displacement) {
  const auto offset = [&](float height) {
    return static_cast<double>(height) * static_cast<double>(displacement.scale) +
           static_cast<double>(displacement.bias);
  };
  return {offset(displacement.texture->lowest()), offset(displacement.texture->highest())};
}

// Nine places of a Bezier patch, at both offsets each.
template <class Visit>
void for_each_displaced_place(std::span<const Vec3> control_points, const std::array<double, 2>& offsets,
                              const Visit& visit) {
  shaders::ControlPoints<double> net;
  for (std::size_t k = 0; k < 16; ++k) {
    const DVec3 p(control_points[k]);
    net[k] = {p.x, p.y, p.z};
  }
  for (int k = 0; k < 9; ++k) {
    const double u = 0.5 * (k % 3), v = 0.5 * (k / 3);
    const shaders::SurfacePoint<double> point = shaders::bicubic_point<double>(shaders::bicubic_row(net, v), u);
    const Vector3<double> normal = shaders::bicubic_normal(net, u, v, point);
    for (const double h : offsets) {
      const Vector3<double> p = point.position + normal * h;
      visit(DVec3(p.x, p.y, p.z));
    }
  }
}

class MotionMeter {
 public:
  MotionMeter(const FrameGeometry& frame, const CameraChoice& camera, MotionCurves& out)
      : frame_(frame), capture_(*frame.assembly->capture), camera_(camera), out_(out) {}

  void measure() {
    const Assembly& assembly = *frame_.assembly;
    const std::size_t pieces = out_.times.size() - 1;
    out_.drawables.resize(assembly.drawables.size());
    slopes_.resize(assembly.drawables.size() + 1);
    bodies_.resize(assembly.drawn.size());
    parallel_for(assembly.drawn.size(), [&](std::size_t d) { bodies_[d] = body_of(assembly.drawn[d]); });
    for (Bend& bend : out_.drawables) begin(bend, pieces);
    begin(out_.background, pieces);
    out_.background.off = 0;
    signs_.assign(capture_.nodes.size(), {0, 0.0});
    Instant start = at(0, false);
    watch_winding(start.pose, 0);
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      const CurveTime &from = out_.times[piece], &to = out_.times[piece + 1];
      std::array<Instant, kLooks - 1> looks;
      Instants instants = {&start};
      for (std::size_t k = 1; k < kLooks; ++k) {
        const bool last = k == kLooks - 1;
        const double when = last ? to.at : from.at + (to.at - from.at) * static_cast<double>(k) / (kLooks - 1);
        looks[k - 1] = at(when, last && to.jump);
        watch_winding(looks[k - 1].pose, when);
        instants[k] = &looks[k - 1];
      }
      Instant& end = looks.back();
      parallel_for(assembly.drawn.size(), [&](std::size_t d) { measure_drawn(d, piece, instants); });
      measure_background(piece, instants);
      if (to.jump) {
        Instant next = at(to.at, false);
        const std::array<const Instant*, 2> sides = {&end, &next};
        parallel_for(assembly.drawn.size(), [&](std::size_t d) { measure_jump(d, piece + 1, sides); });
        watch_winding(next.pose, to.at);
        end = std::move(next);
      }
      start = std::move(end);
    }
  }

 private:
  static void begin(Bend& bend, std::size_t pieces) {
    bend.acceleration.assign(pieces, 0.0f);
    bend.kink.assign(pieces + 1, 0.0f);
    bend.jump.assign(pieces + 1, 0.0f);
  }

  // `before`: as it is just before that time.
  Instant at(double u, bool before) const {
    const double when = time_at(frame_.request, u),
                 time = before ? std::nextafter(when, -std::numeric_limits<double>::infinity()) : when;
    Instant out;
    out.pose = pose_at(capture_, time);
    out.procedures = pose_procedures(capture_, time, time);
    out.view = camera_.view(out.pose);
    out.projection = make_projection(camera_.at(capture_, time), frame_.request.width, frame_.request.height);
    return out;
  }

  // ---- Winding

  double determinant(const Pose& pose, std::size_t node) const { return glm::determinant(DMat3(pose.world[node])); }
  void watch_winding(const Pose& pose, double u) {
    for (std::size_t n = 0; n < capture_.nodes.size(); ++n) {
      if (capture_.nodes[n].mesh == kNone && capture_.nodes[n].procedure == kNone) continue;
      const double now = determinant(pose, n);
      if (now == 0) continue;
      auto& [sign, when] = signs_[n];
      const int is = now < 0 ? -1 : 1;
      if (sign != 0 && sign != is && out_.flips.size() < kMaxFlips) {
        double low = when, high = u;
        for (int step = 0; step < kFlipSteps; ++step) {
          const double middle = 0.5 * (low + high),
                       there = determinant(pose_at(capture_, time_at(frame_.request, middle)), n);
          (there == 0 || (there < 0) == (is < 0) ? high : low) = middle;
        }
        out_.flips.push_back({static_cast<int>(n), high});
      }
      sign = is, when = u;
    }
  }

  // ---- Bodies

  Body body_of(const DrawnPrimitive& drawn) const {
    Body body;
    const PosedDrawable& posed = frame_.drawables[drawn.first_drawable];
    if (posed.procedure != nullptr) return body;
    const Drawable& drawable = *posed.drawable;
    const Primitive& primitive = *posed.primitive;
    const Vertices& vertices = primitive.vertices;
    body.wire = primitive.wire != Primitive::Wire::kSurface;
    body.deforms = body.wire || is_deforming(capture_, drawable.node, primitive);
    std::vector<std::uint32_t> drawn_vertices;
    if (primitive.kind == Primitive::Kind::kTriangles && !body.wire) {
      drawn_vertices = frame_.assembly->clusters[drawable.geometry].vertices;
    } else {
      for (std::uint32_t v = 0; v < vertices.count(); ++v) drawn_vertices.push_back(v);
    }
    sample(primitive, drawn_vertices, body.sampled);
    if (!body.deforms) {
      body.corners = primitive.kind == Primitive::Kind::kBezierPatches && posed.material->displacement
                         ? displaced_corners(vertices, *posed.material->displacement)
                         : corners_of(vertices, drawn_vertices, 0, [](std::uint32_t) { return true; });
      // The corners of a box around the camera tell nothing.
      for (const Vec3& p : body.sampled.vertices.positions) body.corners.emplace_back(DVec3(p), 1.0);
      return body;
    }
    const double reach = primitive.kind == Primitive::Kind::kBezierPatches && posed.material->displacement
                             ? displacement_limit(*posed.material->displacement)
                             : 0;
    if (reach == 0) return body;
    sample_patches(primitive, body.surfaces);
    body.offsets = extreme_offsets(*posed.material->displacement);
    const int skin = capture_.nodes[static_cast<std::size_t>(drawable.node)].skin;
    if (skin == kNone || vertices.influences.empty()) {
      body.parts.emplace_back(kNone, corners_of(vertices, drawn_vertices, reach, [](std::uint32_t) { return true; }));
      return body;
    }
    const auto joints = capture_.skins[static_cast<std::size_t>(skin)].joints.size();
    for (std::size_t j = 0; j < joints; ++j) {
      const auto moved = [&](std::uint32_t v) {
        const SkinInfluence& influence = vertices.influences[v];
        for (std::size_t k = 0; k < 8; ++k)
          if (influence.joints[k] == j && influence.weights[k] > 0) return true;
        return false;
      };
      Points corners = corners_of(vertices, drawn_vertices, reach, moved);
      if (!corners.empty()) body.parts.emplace_back(static_cast<int>(j), std::move(corners));
    }
    return body;
  }

  // Corners of the box of patches and of their surfaces at the lowest and the highest offset that the texture has, at
  // places of each.
  static Points displaced_corners(const Vertices& vertices, const Displacement& displacement) {
    const std::array<double, 2> offsets = extreme_offsets(displacement);
    const double slack = kBetweenPlaces * std::max(std::abs(offsets[0]), std::abs(offsets[1]));
    DVec3 low(std::numeric_limits<double>::infinity()), high(-low);
    const auto add = [&](const DVec3& p) { low = glm::min(low, p), high = glm::max(high, p); };
    for (std::size_t first = 0; first + 16 <= vertices.count(); first += 16) {
      const std::span<const Vec3> net = std::span(vertices.positions).subspan(first, 16);
      for (const Vec3& p : net) add(DVec3(p));
      for_each_displaced_place(net, offsets, add);
    }
    Points out;
    if (low.x <= high.x) add_corners(low - slack, high + slack, out);
    return out;
  }

  template <class Counts>
  static Points corners_of(const Vertices& vertices, const std::vector<std::uint32_t>& of, double reach,
                           const Counts& counts) {
    DVec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const std::uint32_t v : of)
      if (counts(v))
        low = glm::min(low, DVec3(vertices.positions[v])), high = glm::max(high, DVec3(vertices.positions[v]));
    Points out;
    if (low.x <= high.x) add_corners(low - reach, high + reach, out);
    return out;
  }

  // A primitive of some of the patches.
  static void sample_patches(const Primitive& from, Primitive& to) {
    const std::size_t patches = from.vertices.count() / 16, step = (patches + kPatches - 1) / kPatches;
    to.kind = from.kind;
    to.vertices.morph_targets.resize(from.vertices.morph_targets.size());
    for (std::size_t first = 0; first < 16 * patches; first += 16 * step)
      for (std::size_t v = first; v < first + 16; ++v) copy_vertex(from, v, to);
  }

  static void copy_vertex(const Primitive& from, std::size_t v, Primitive& to) {
    to.vertices.positions.push_back(from.vertices.positions[v]);
    if (!from.vertices.influences.empty()) to.vertices.influences.push_back(from.vertices.influences[v]);
    for (std::size_t t = 0; t < to.vertices.morph_targets.size(); ++t)
      if (const auto& differences = from.vertices.morph_targets[t].positions; !differences.empty())
        to.vertices.morph_targets[t].positions.push_back(differences[v]);
  }

  // A primitive of some of the vertices, four by four where it is a wire.
  static void sample(const Primitive& from, const std::vector<std::uint32_t>& of, Primitive& to) {
    const std::size_t group = from.wire == Primitive::Wire::kSurface ? 1 : 4;
    const std::size_t groups = of.size() / group, step = std::max<std::size_t>(1, groups * group / kPoints);
    to.kind = from.kind, to.wire = from.wire;
    to.vertices.morph_targets.resize(from.vertices.morph_targets.size());
    std::vector<std::size_t> wanted;
    for (std::size_t g = 0; g < groups; g += step) wanted.push_back(g);
    // Tips move farthest: the tips along eight diagonals and six axes are among the wanted ones.
    for (int direction = 0; direction < 27 && groups > 0; ++direction) {
      const Vec3 along(static_cast<float>(direction % 3 - 1), static_cast<float>(direction / 3 % 3 - 1),
                       static_cast<float>(direction / 9 - 1));
      if (const float size = glm::dot(along, along); size == 0.0f || size == 2.0f) continue;
      std::size_t tip = 0;
      for (std::size_t g = 1; g < groups; ++g)
        if (glm::dot(from.vertices.positions[of[g * group]], along) >
            glm::dot(from.vertices.positions[of[tip * group]], along))
          tip = g;
      wanted.push_back(tip);
    }
    for (const std::size_t g : wanted)
      for (std::size_t k = 0; k < group; ++k) copy_vertex(from, of[g * group + k], to);
  }

  // ---- Places

  DMat4 to_raster(const PosedDrawable& posed, const Primitive& primitive, const Instant& now) const {
    return now.projection.matrix() * now.view.world_to_camera *
           vertices_to_world(capture_, posed.drawable->node, posed.drawable->instance, primitive, now.pose, now.view);
  }

  // Places the points of a drawable on the raster; moving vertices are taken at that time.
  void place(const PosedDrawable& posed, const Body& body, const DeformedBody& deformed, const Instant& now,
             Points& out) const {
    out.clear();
    if (posed.procedure != nullptr) return place_procedure(posed, now, out);
    if (!body.deforms) {
      const DMat4 m = to_raster(posed, *posed.primitive, now);
      for (const DVec4& p : body.corners) out.push_back(m * p);
      return;
    }
    const DMat4 m = to_raster(posed, body.sampled, now);
    for (const Vec3& p : deformed.sampled.positions) out.push_back(m * DVec4(DVec3(p), 1.0));
    const DMat4 world_to_raster = now.projection.matrix() * now.view.world_to_camera;
    for (const auto& [joint, corners] : body.parts) {
      DMat4 world = now.pose.world[static_cast<std::size_t>(posed.drawable->node)];
      if (joint == kNone) {
        world = object_to_world(capture_, posed.drawable->node, posed.drawable->instance, *posed.primitive, now.pose);
      } else {
        const Skin& skin =
            capture_
                .skins[static_cast<std::size_t>(capture_.nodes[static_cast<std::size_t>(posed.drawable->node)].skin)];
        world = now.pose.world[static_cast<std::size_t>(skin.joints[static_cast<std::size_t>(joint)])] *
                skin.inverse_bind[static_cast<std::size_t>(joint)];
      }
      for (const DVec4& p : corners) out.push_back(world_to_raster * (world * p));
    }
    place_surfaces(posed, body, deformed, now, out);
  }

  void place_surfaces(const PosedDrawable& posed, const Body& body, const DeformedBody& deformed, const Instant& now,
                      Points& out) const {
    const std::vector<Vec3>& points = deformed.surfaces.positions;
    if (points.empty()) return;
    const DMat4 m = to_raster(posed, body.surfaces, now);
    for (std::size_t first = 0; first < points.size(); first += 16)
      for_each_displaced_place(std::span(points).subspan(first, 16), body.offsets,
                               [&](const DVec3& p) { out.push_back(m * DVec4(p, 1.0)); });
  }

  // Points of each piece, and corners of the box of all: no point of a formula between them moves farther when the box
  // is turned.
  void place_procedure(const PosedDrawable& posed, const Instant& now, Points& out) const {
    const DMat4 m = to_raster(posed, *posed.primitive, now);
    const Procedure& shape = now.procedures.at(capture_, posed.drawable->geometry, 0);
    DVec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const Procedure::Piece& piece : shape.pieces)
      for (int k = 0; k < 25; ++k) {
        const auto p = shaders::shape_point(shape.shape, piece.input, 0.25 * (k % 5), 0.25 * (k / 5));
        low = glm::min(low, DVec3(p.x, p.y, p.z)), high = glm::max(high, DVec3(p.x, p.y, p.z));
        out.push_back(m * DVec4(p.x, p.y, p.z, 1.0));
      }
    Points corners;
    if (low.x <= high.x) add_corners(low, high, corners);
    for (const DVec4& p : corners) out.push_back(m * p);
  }

  void pose_vertices(const DrawnPrimitive& drawn, const Body& body, const Instant& now, DeformedBody& out) const {
    if (!body.deforms) return;
    const Drawable& drawable = *frame_.drawables[drawn.first_drawable].drawable;
    deform(capture_, drawable.node, body.sampled, now.pose, out.sampled);
    if (body.surfaces.vertices.count() > 0) deform(capture_, drawable.node, body.surfaces, now.pose, out.surfaces);
    if (body.wire)
      spread_wires(body.sampled, object_to_world(capture_, drawable.node, drawable.instance, body.sampled, now.pose),
                   now.view, now.projection, out.sampled);
  }

  void measure_drawn(std::size_t d, std::size_t piece, const Instants& instants) {
    const DrawnPrimitive& drawn = frame_.assembly->drawn[d];
    const Body& body = bodies_[d];
    std::array<DeformedBody, kLooks> deformed;
    for (std::size_t k = 0; k < kLooks; ++k) pose_vertices(drawn, body, *instants[k], deformed[k]);
    std::array<Points, kLooks> places;
    for (std::uint32_t i = 0; i < drawn.count; ++i) {
      const std::size_t number = drawn.drawable(i);
      const PosedDrawable& posed = frame_.drawables[number];
      if (!posed.visible) continue;
      for (std::size_t k = 0; k < kLooks; ++k) place(posed, body, deformed[k], *instants[k], places[k]);
      add_piece(number, piece, instants, places, out_.drawables[number]);
    }
  }

  // The image's corners and middle, infinitely far away, as they turn with the camera.
  void measure_background(std::size_t piece, const Instants& instants) {
    if (frame_.projection.orthographic) return;
    const FrameRequest& request = frame_.request;
    std::array<Points, kLooks> places;
    for (int k = 0; k < 9; ++k) {
      const DVec3 along((0.5 * (k % 3) * request.width - frame_.projection.center_x) / frame_.projection.scale,
                        -(0.5 * (k / 3) * request.height - frame_.projection.center_y) / frame_.projection.scale, -1);
      const DVec4 far(DMat3(frame_.views[0].camera_to_world) * along, 0.0);
      for (std::size_t t = 0; t < kLooks; ++t)
        places[t].push_back(instants[t]->projection.matrix() * (instants[t]->view.world_to_camera * far));
    }
    add_piece(out_.drawables.size(), piece, instants, places, out_.background);
  }

  void add_piece(std::size_t number, std::size_t piece, const Instants& instants,
                 const std::array<Points, kLooks>& places, Bend& bend) {
    const double step = (out_.times[piece + 1].at - out_.times[piece].at) / (kLooks - 1);
    unsigned off = 15, far_off = 15;
    for (std::size_t k = 0; k < kLooks; ++k)
      for (const DVec4& p : places[k]) {
        off &= beyond(p, instants[k]->projection, frame_.request, 0);
        far_off &= beyond(p, instants[k]->projection, frame_.request, 1);
      }
    bend.off &= off;
    double acceleration = 0, kink = 0, zoom = 0;
    std::vector<DVec4>& slopes = slopes_[number];
    const bool known = slopes.size() == places[0].size() && out_.times[piece].key;
    slopes.resize(places[0].size(), DVec4(0.0));
    const Projection &first = instants.front()->projection, &last = instants.back()->projection;
    const bool zooms = last != frame_.projection;
    for (std::size_t i = 0; i < places[0].size(); ++i) {
      std::array<DVec4, kLooks> p;
      bool seen = false;
      for (std::size_t k = 0; k < kLooks; ++k)
        p[k] = places[k][i], seen = seen || in_front(p[k], instants[k]->projection);
      if (seen && far_off == 0) {
        acceleration = std::max(acceleration, max_acceleration(p, instants) / (step * step));
        if (known) kink = std::max(kink, pixels_of(first_difference(p) / step - slopes[i], p[0], first));
        if (zooms && in_front(p.back(), last)) {
          const DVec4& b = p.back();
          const DVec4 unzoomed = frame_.projection.matrix() * (last.unprojection() * DVec4(b.x, b.y, b.z, 1.0));
          zoom = std::max(zoom, pixels_of(unzoomed - b, b, last));
        }
      }
      slopes[i] = first_difference({p[4], p[3], p[2], p[1], p[0]}) / -step;
    }
    bend.acceleration[piece] = static_cast<float>(acceleration);
    bend.kink[piece] = std::max(bend.kink[piece], static_cast<float>(kink));
    bend.zoom = std::max(bend.zoom, static_cast<float>(zoom));
  }

  // The slope at the first of five places, a step apart: exact for polynomials of degree 4.
  static DVec4 first_difference(const std::array<DVec4, kLooks>& p) {
    return (p[1] * 48.0 - p[0] * 25.0 - p[2] * 36.0 + p[3] * 16.0 - p[4] * 3.0) / 12.0;
  }

  // The largest second difference along a piece, in pixels. It is treated as linear, which it is for cubic splines: its
  // values at the ends of the piece are extrapolated from the values at the quarters. Each is projected at its own
  // place.
  static double max_acceleration(const std::array<DVec4, kLooks>& p, const Instants& instants) {
    const auto second = [&](std::size_t k) { return p[k - 1] - p[k] * 2.0 + p[k + 1]; };
    const DVec4 change = (second(3) - second(1)) * 0.5;
    const std::array<DVec4, kLooks> all = {second(1) - change, second(1), second(2), second(3), second(3) + change};
    double most = 0;
    for (std::size_t k = 0; k < kLooks; ++k)
      if (k == 2 || in_front(p[k], instants[k]->projection))
        most = std::max(most, pixels_of(all[k], p[k], instants[k]->projection));
    return most;
  }

  void measure_jump(std::size_t d, std::size_t time, const std::array<const Instant*, 2>& sides) {
    const DrawnPrimitive& drawn = frame_.assembly->drawn[d];
    const Body& body = bodies_[d];
    std::array<DeformedBody, 2> deformed;
    for (std::size_t k = 0; k < 2; ++k) pose_vertices(drawn, body, *sides[k], deformed[k]);
    std::array<Points, 2> places;
    for (std::uint32_t i = 0; i < drawn.count; ++i) {
      const std::size_t number = drawn.drawable(i);
      const PosedDrawable& posed = frame_.drawables[number];
      if (!posed.visible) continue;
      double most = 0;
      for (std::size_t k = 0; k < 2; ++k) place(posed, body, deformed[k], *sides[k], places[k]);
      for (std::size_t p = 0; p < places[0].size(); ++p)
        most = std::max(most, pixels_of(places[1][p] - places[0][p], places[0][p], sides[0]->projection));
      out_.drawables[number].jump[time] = static_cast<float>(most);
    }
  }

  const FrameGeometry& frame_;
  const Capture& capture_;
  const CameraChoice& camera_;
  MotionCurves& out_;
  std::vector<Body> bodies_;                   // as Assembly::drawn
  std::vector<std::vector<DVec4>> slopes_;     // at the end of the piece before, per drawable; the background's last
  std::vector<std::pair<int, double>> signs_;  // per node: of its determinant, and when it was seen
};

}  // namespace

std::vector<CurveTime> curve_times(const FrameGeometry& frame, int camera_node) {
  const Capture& capture = *frame.assembly->capture;
  const std::vector<CurveTime> keys = key_times(capture, frame.request);
  std::vector<std::size_t> pieces;
  std::size_t all = 0;
  for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
    const Activity active =
        activity(capture, camera_node, time_at(frame.request, keys[k].at), time_at(frame.request, keys[k + 1].at));
    std::size_t wanted =
        static_cast<std::size_t>(std::clamp(std::ceil(active.turn / kPieceTurn), 1.0, 1.0 * kMaxPieces));
    if (active.cubic) wanted = std::max(wanted, kCubicPieces);
    if (active.zoom) wanted = std::max(wanted, kZoomPieces);
    pieces.push_back(wanted);
    all += wanted;
  }
  const std::size_t limit =
      std::min(kMaxPieces, std::max<std::size_t>(4, kMaxBends / std::max<std::size_t>(1, frame.drawables.size())));
  const double share = all > limit ? static_cast<double>(limit) / static_cast<double>(all) : 1.0;
  std::vector<CurveTime> times;
  for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
    times.push_back(keys[k]);
    const auto parts = std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(pieces[k]) * share));
    for (std::size_t p = 1; p < parts; ++p)
      times.push_back(
          {keys[k].at + (keys[k + 1].at - keys[k].at) * static_cast<double>(p) / static_cast<double>(parts)});
  }
  times.push_back(keys.back());
  return times;
}

MotionCurves measure_motion(const FrameGeometry& frame, const CameraChoice& camera) {
  MotionCurves out;
  out.times = curve_times(frame, camera.node);
  MotionMeter(frame, camera, out).measure();
  return out;
}

}  // namespace tessera::scene
