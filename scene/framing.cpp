#include "scene/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "scene/animation.h"
#include "scene/pose.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::scene {
namespace {

constexpr int kTimes = 17;
constexpr double kHeightShare = 0.75, kWidthShare = 0.9;
constexpr double kHalfField = 0.35;  // radians, from the middle of the image to its top
// points of rigid meshes, over all times; beyond this number the meshes' boxes replace them
constexpr std::size_t kMaxPoints = 16u << 20;

// Camera positions that see all added points, for a camera that looks along -back. In the frame of (right, up, back)
// the camera stands at (cx, cy, cz), and a point is inside where |x - cx| <= tan_x (cz - z) and |y - cy| <= tan_y (cz -
// z).
class Extent {
 public:
  Extent(double tan_x, double tan_y, const DVec3& back) : tan_x_(tan_x), tan_y_(tan_y), back_(back) {
    right_ = glm::normalize(glm::cross(DVec3(0, 1, 0), back_));
    up_ = glm::cross(back_, right_);
  }

  void add(const DVec3& p) {
    const double x = glm::dot(p, right_), y = glm::dot(p, up_), z = glm::dot(p, back_);
    if (!std::isfinite(x + y + z)) return;
    right_side_ = std::max(right_side_, x + tan_x_ * z), left_side_ = std::max(left_side_, -x + tan_x_ * z);
    top_side_ = std::max(top_side_, y + tan_y_ * z), bottom_side_ = std::max(bottom_side_, -y + tan_y_ * z);
    nearest_ = std::max(nearest_, z), farthest_ = std::min(farthest_, z);
  }
  bool empty() const { return !(farthest_ <= nearest_); }
  const DVec3& back() const { return back_; }
  // Halfway between the nearest and the farthest point, along back().
  double middle() const { return (nearest_ + farthest_) / 2; }
  // Whether p lies well inside of the added points, so that rounding does not matter.
  bool surrounds(const DVec3& p) const {
    const double x = glm::dot(p, right_), y = glm::dot(p, up_), z = glm::dot(p, back_);
    const double slack = 1e-9 * (std::abs(right_side_) + std::abs(left_side_) + std::abs(top_side_) +
                                 std::abs(bottom_side_) + std::abs(nearest_) + std::abs(farthest_));
    return x + tan_x_ * z < right_side_ - slack && -x + tan_x_ * z < left_side_ - slack &&
           y + tan_y_ * z < top_side_ - slack && -y + tan_y_ * z < bottom_side_ - slack && z < nearest_ - slack &&
           z > farthest_ + slack;
  }

  // The nearest place from which all points are inside.
  CameraChoice camera() const {
    const double z_for_x = (right_side_ + left_side_) / (2 * tan_x_),
                 z_for_y = (top_side_ + bottom_side_) / (2 * tan_y_);
    // A single point, or an empty scene, has no size; the camera stands in front of all points in any case.
    const double depth = nearest_ - farthest_, size = std::max({depth, std::abs(nearest_) * 1e-6, 1e-9});
    const double cx = (right_side_ - left_side_) / 2, cy = (top_side_ - bottom_side_) / 2,
                 cz = std::max({z_for_x, z_for_y, nearest_ + 0.01 * size});
    CameraChoice choice;
    choice.camera.vertical_fov = static_cast<float>(2 * kHalfField);
    choice.camera.near = static_cast<float>(std::max((cz - nearest_) * 0.5, (cz - farthest_) * 0.001));
    // Columns: right, up, back, position.
    choice.fixed_world =
        DMat4(DVec4(right_, 0), DVec4(up_, 0), DVec4(back_, 0), DVec4(right_ * cx + up_ * cy + back_ * cz, 1));
    return choice;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double tan_x_, tan_y_;
  DVec3 back_, right_, up_;
  double right_side_ = -kInfinity, left_side_ = -kInfinity, top_side_ = -kInfinity, bottom_side_ = -kInfinity;
  double nearest_ = -kInfinity, farthest_ = kInfinity;
};

// Direction from the scene to the camera.
DVec3 way_back(const std::optional<Orbit>& orbit) {
  const DVec3 usual = glm::normalize(DVec3(0.55, 0.35, 1.0));
  if (!orbit) return usual;
  const double turn = glm::radians(orbit->azimuth), c = std::cos(turn), s = std::sin(turn);
  DVec3 back(c * usual.x + s * usual.z, usual.y, c * usual.z - s * usual.x);
  if (orbit->elevation) {
    const double rise = glm::radians(*orbit->elevation);
    const DVec3 level = glm::normalize(DVec3(back.x, 0, back.z));
    back = level * std::cos(rise) + DVec3(0, std::sin(rise), 0);
  }
  return back;
}

// A grid of points is enough to frame an image.
void add_procedure(const Procedure& procedure, const DMat4& world, Extent& extent) {
  constexpr int kSteps = 16;
  for (const Procedure::Piece& piece : procedure.pieces)
    for (int k = 0; k < (kSteps + 1) * (kSteps + 1); ++k) {
      const Vector3<double> p =
          shaders::shape_point(procedure.shape, piece.input, static_cast<double>(k % (kSteps + 1)) / kSteps,
                               static_cast<double>(k / (kSteps + 1)) / kSteps);
      extent.add(DVec3(world * DVec4(p.x, p.y, p.z, 1.0)));
    }
}

// Whether a transform leaves surfaces an area: a node that is scaled to a point or a line is invisible.
bool keeps_area(const DMat4& to_world) {
  const DMat3 m(to_world);
  return glm::cross(m[1], m[2]) != DVec3(0.0) || glm::cross(m[2], m[0]) != DVec3(0.0) ||
         glm::cross(m[0], m[1]) != DVec3(0.0);
}

// Whether control points lie on one line, within `share` of its length.
bool on_one_line(std::span<const Vec3, 16> points, double share) {
  DVec3 along(0.0);
  double across = 0;
  for (const Vec3& p : points)
    if (const DVec3 d = DVec3(p) - DVec3(points[0]); glm::dot(d, d) > glm::dot(along, along)) along = d;
  for (const Vec3& p : points) across = std::max(across, glm::length(glm::cross(DVec3(p) - DVec3(points[0]), along)));
  return !(across > share * glm::dot(along, along));
}

// The posed vertices of visible geometry: triangles without an area and vertices without a triangle do not count.
std::vector<Vec3> drawn_points(const Primitive& primitive, const std::vector<Vec3>& positions) {
  constexpr double kSliver = 1e-7;  // height over longest edge of a triangle whose area is only rounding
  std::vector<bool> drawn(positions.size(), false);
  if (primitive.kind == Primitive::Kind::kBezierPatches)
    for (std::size_t first = 0; first + 16 <= positions.size(); first += 16)
      std::fill_n(drawn.begin() + static_cast<std::ptrdiff_t>(first), 16,
                  !on_one_line(std::span(positions).subspan(first).first<16>(), kSliver));
  const bool wire = primitive.wire != Primitive::Wire::kSurface;  // its triangles get their area on screen
  for (std::size_t t = 0; t + 3 <= primitive.indices.size(); t += 3) {
    const std::uint32_t* const corner = &primitive.indices[t];
    const DVec3 a(positions[corner[0]]), b = DVec3(positions[corner[1]]) - a, c = DVec3(positions[corner[2]]) - a;
    const double longest = std::max({glm::dot(b, b), glm::dot(c, c), glm::dot(c - b, c - b)});
    if (!wire && !(glm::length(glm::cross(b, c)) > kSliver * longest)) continue;
    for (std::size_t k = 0; k < 3; ++k) drawn[corner[k]] = true;
  }
  std::vector<Vec3> points;
  for (std::size_t v = 0; v < positions.size(); ++v)
    if (drawn[v]) points.push_back(positions[v]);
  return points;
}

// Corners of the box of a primitive's vertices.
std::vector<Vec3> box_corners(const std::vector<Vec3>& positions) {
  Vec3 low(std::numeric_limits<float>::infinity()), high(-std::numeric_limits<float>::infinity());
  for (const Vec3& p : positions) low = glm::min(low, p), high = glm::max(high, p);
  std::vector<Vec3> corners;
  for (int k = 0; k < 8 && !positions.empty(); ++k)
    corners.emplace_back((k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y, (k & 4) != 0 ? high.z : low.z);
  return corners;
}

// Adds the points of one instance. A box inside the present extent adds nothing, so few of many instances are visited
// point by point.
void add_points(const std::vector<Vec3>& points, const std::vector<Vec3>& corners, const DMat4& to_world,
                Extent& extent) {
  const auto placed = [&](const Vec3& p) { return DVec3(to_world * DVec4(DVec3(p), 1.0)); };
  if (std::all_of(corners.begin(), corners.end(), [&](const Vec3& p) { return extent.surrounds(placed(p)); })) return;
  for (const Vec3& p : points) extent.add(placed(p));
}

// Points of rigid meshes, over all instances that draw them.
std::size_t rigid_points(const Capture& capture) {
  std::size_t points = 0;
  for (const Node& node : capture.nodes)
    if (node.mesh != kNone)
      for (const Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives)
        points += primitive.vertices.count() * std::max<std::size_t>(node.instances.size(), 1);
  return points;
}

// Adds the visible surfaces of the scene at these times; surfaces without area are left out.
void add_scene(const Capture& capture, const std::vector<double>& times, Extent& extent) {
  const bool by_boxes = rigid_points(capture) > kMaxPoints / times.size();
  struct Points {
    const std::vector<Vec3>* all = nullptr;
    std::vector<Vec3> drawn, corners;  // drawn: where not all are
  };
  std::map<const Primitive*, Points> at_rest;
  for (const double time : times) {
    const Pose pose = pose_at(capture, time);
    const PosedProcedures procedures = pose_procedures(capture, time, time);
    for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
      const Node& node = capture.nodes[n];
      if (!pose.in_scene[n] || !pose.visible[n]) continue;
      if (node.procedure != kNone && keeps_area(pose.world[n]))
        add_procedure(procedures.at(capture, static_cast<std::size_t>(node.procedure), 0), pose.world[n], extent);
      if (node.mesh == kNone) continue;
      for (const Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        Deformed deformed;
        deform(capture, static_cast<int>(n), primitive, pose, deformed);
        const bool rigid = deformed.positions.empty();
        Points posed;
        Points& points = rigid ? at_rest[&primitive] : posed;
        if (points.all == nullptr) {
          const std::vector<Vec3>& positions = rigid ? primitive.vertices.positions : deformed.positions;
          points.drawn = drawn_points(primitive, positions);
          points.all = &points.drawn;
          if (points.drawn.size() == positions.size()) points.all = &positions, points.drawn = {};
          points.corners = box_corners(*points.all);
        }
        for (std::size_t i = 0; i < std::max<std::size_t>(node.instances.size(), 1); ++i) {
          const DMat4 to_world = object_to_world(capture, static_cast<int>(n), i, primitive, pose);
          if (keeps_area(to_world))
            add_points(rigid && by_boxes ? points.corners : *points.all, points.corners, to_world, extent);
        }
      }
    }
  }
}

}  // namespace

double played_seconds(const Capture& capture) {
  double end = 0;
  for (const int a : capture.played_animations)
    end = std::max(end, static_cast<double>(capture.animations[static_cast<std::size_t>(a)].duration()));
  return end;
}

int frames_to_see(const Capture& capture) {
  const CaptureSettings& settings = capture.settings;
  constexpr double kMost = 1e6;
  const double last =
      std::floor(std::min(played_seconds(capture) * settings.frame_rate - settings.shutter_open, kMost));
  return std::max(settings.frame_count, static_cast<int>(last) + 1 - settings.first_frame);
}

std::vector<double> framed_times(const Capture& capture) {
  const CaptureSettings& settings = capture.settings;
  double first = settings.first_frame / settings.frame_rate;
  double last = (settings.first_frame + settings.frame_count - 1) / settings.frame_rate;
  if (!settings.declared) {
    first = last = 0;
    last = played_seconds(capture);
  }
  if (capture.played_animations.empty() || !(last > first)) return {first};
  std::vector<double> times(kTimes);
  for (int k = 0; k < kTimes; ++k) times[static_cast<std::size_t>(k)] = first + (last - first) * k / (kTimes - 1);
  return times;
}

CameraChoice frame_scene(const Capture& capture, int width, int height, const std::optional<Orbit>& orbit) {
  const double tan_y = std::tan(kHalfField), tan_x = tan_y * width / height;
  Extent extent(kWidthShare * tan_x, kHeightShare * tan_y, way_back(orbit));
  add_scene(capture, framed_times(capture), extent);
  if (extent.empty())
    for (const double side : {-1.0, 1.0}) extent.add(DVec3(side));
  return extent.camera();
}

double middle_distance(const Capture& capture, const DMat4& camera_world, double time) {
  const DVec3 back(camera_world[2]), eye(camera_world[3]);
  Extent extent(1, 1, std::abs(back.y) < 0.999 ? back : glm::normalize(back + DVec3(0.05, 0, 0.05)));
  add_scene(capture, {time}, extent);
  return extent.empty() ? 1 : glm::dot(eye, extent.back()) - extent.middle();
}

}  // namespace tessera::scene
