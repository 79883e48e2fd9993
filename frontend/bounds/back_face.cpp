#include "frontend/bounds/back_face.h"

#include <algorithm>
#include <cmath>

#include "base/real.h"
#include "frontend/bounds/cluster_facing.h"
#include "frontend/bounds/interval.h"
#include "frontend/patch_record.h"

namespace tessera::frontend {
namespace {

// Largest factor by which a matrix lengthens a vector: sqrt of the largest row sum of L^T L; exact if its columns are
// orthogonal.
double largest_stretch(const DMat4& m) {
  const DMat3 l(m), square = glm::transpose(l) * l;
  double largest = 0;
  for (int r = 0; r < 3; ++r)
    largest = std::max(largest, std::abs(square[0][r]) + std::abs(square[1][r]) + std::abs(square[2][r]));
  return std::sqrt(largest);
}

PatchNet transformed(const PatchNet& net, const DMat4& m) {
  PatchNet out;
  for (std::size_t k = 0; k < 16; ++k)
    for (std::size_t r = 0; r < 3; ++r) {
      const int row = static_cast<int>(r);
      out.c[r][k] = m[0][row] * net.c[0][k] + m[1][row] * net.c[1][k] + m[2][row] * net.c[2][k] + m[3][row];
    }
  return out;
}

using Box3 = Vector3<Interval>;

Interval symmetric(double reach) { return {-reach, reach}; }
Interval range_of(const ValueRange& r) { return {static_cast<double>(r.low), static_cast<double>(r.high)}; }
Box3 hull(const Box3& a, const Box3& b) { return {hull(a.x, b.x), hull(a.y, b.y), hull(a.z, b.z)}; }
Box3 operator+(const Box3& a, const Interval& b) { return {a.x + b, a.y + b, a.z + b}; }
Box3 scaled(const Box3& a, const Interval& b) { return {a.x * b, a.y * b, a.z * b}; }
double longest(const Box3& a) {
  return std::sqrt(a.x.magnitude() * a.x.magnitude() + a.y.magnitude() * a.y.magnitude() +
                   a.z.magnitude() * a.z.magnitude());
}

// A matrix applied to a box of vectors given in the frame `from`; the result is a box in the frame `to`.
Box3 carried(const DMat4& m, const Frame& from, const Box3& box, const Frame& to) {
  const DMat3 linear(m);
  const auto along = [&](const DVec3& axis) {
    return box.x * Interval(glm::dot(axis, linear * from[0])) + box.y * Interval(glm::dot(axis, linear * from[1])) +
           box.z * Interval(glm::dot(axis, linear * from[2]));
  };
  return {along(to[0]), along(to[1]), along(to[2])};
}

// Box of the steps from control points to the next: a third of the derivatives by the net's own parameters.
Box3 control_steps(const PatchNet& net, bool along_u, const Frame& axes) {
  std::array<double, 3> low, high;
  low.fill(1e300), high.fill(-1e300);
  for (std::size_t k = 0; k < (along_u ? 16u : 12u); ++k) {
    if (along_u && k % 4 == 3) continue;
    const DVec3 step = net.point(k + (along_u ? 1 : 4)) - net.point(k);
    for (std::size_t a = 0; a < 3; ++a) {
      const double s = glm::dot(step, axes[a]);
      low[a] = std::min(low[a], s), high[a] = std::max(high[a], s);
    }
  }
  const auto side = [&](std::size_t a) { return Interval::rounded(low[a], high[a]); };
  return {side(0), side(1), side(2)};
}

// Change of the height along u and v, per unit of the base patch's parameters, and the error that rounding may add to a
// height.
struct HeightSteps {
  Interval u, v;
  double error;
};
HeightSteps height_steps(const scene::PatchDisplacement& d, const scene::ParameterRange& r,
                         const PyramidLibrary& pyramids, HeightTableCache* fetches) {
  const scene::PatchDisplacement::Footprint f = d.footprint(r);
  const HeightSlopes slopes =
      pyramids.slopes_of(*d.material->texture).query(d.material->sampler, f.low, f.high, d.lod, fetches);
  const auto between = [](Vec2 a, Vec2 b, float at, int axis) {
    return static_cast<double>(a[axis]) * (1 - static_cast<double>(at)) +
           static_cast<double>(b[axis]) * static_cast<double>(at);
  };
  const auto scale = static_cast<double>(d.material->scale);
  // Coordinates along u change by as much as at their v, and the other way round.
  const auto along = [&](Vec2 first, Vec2 last, float low, float high) {
    const auto coordinate = [&](int axis) {
      const double a = between(first, last, low, axis), b = between(first, last, high, axis);
      return Interval::rounded(std::min(a, b), std::max(a, b));
    };
    const Interval heights = coordinate(0) * range_of(slopes.along_s) + coordinate(1) * range_of(slopes.along_t);
    return heights * Interval(scale * (1 - 0x1p-20), scale * (1 + 0x1p-20));
  };
  HeightSteps out;
  out.u = along(d.corner[1] - d.corner[0], d.corner[3] - d.corner[2], r.v0, r.v1);
  out.v = along(d.corner[2] - d.corner[0], d.corner[3] - d.corner[1], r.u0, r.u1);
  // Heights and coordinates round: see MinMaxPyramid for their mip levels.
  const double largest = static_cast<double>(pyramids.of(*d.material->texture).whole().largest());
  const Vec2 farthest = glm::max(glm::abs(f.low), glm::abs(f.high));
  out.error = 0x1p-15 * (std::abs(scale) * largest + std::abs(static_cast<double>(d.material->bias))) +
              0x1p-20 * std::abs(scale) *
                  static_cast<double>(farthest.x * slopes.along_s.largest() + farthest.y * slopes.along_t.largest());
  return out;
}

// Box of the second derivatives by the net's own parameters; `along`: 0 by u alone, 1 by both, 2 by v alone.
Box3 second_derivatives(const PatchNet& net, int along, const Frame& axes) {
  std::array<double, 3> low, high;
  low.fill(1e300), high.fill(-1e300);
  const std::size_t columns = along == 0 ? 2 : along == 1 ? 3 : 4, rows = along == 0 ? 4 : along == 1 ? 3 : 2;
  const std::size_t first = along == 2 ? 4 : 1, second = along == 0 ? 1 : 4;
  const double factor = along == 1 ? 9 : 6;
  for (std::size_t j = 0; j < rows; ++j)
    for (std::size_t i = 0; i < columns; ++i) {
      const std::size_t k = 4 * j + i;
      const DVec3 d = (net.point(k + first + second) - net.point(k + second)) - (net.point(k + first) - net.point(k));
      for (std::size_t a = 0; a < 3; ++a) {
        const double s = factor * glm::dot(d, axes[a]);
        low[a] = std::min(low[a], s), high[a] = std::max(high[a], s);
      }
    }
  const auto side = [&](std::size_t a) { return Interval::rounded(low[a], high[a]); };
  return {side(0), side(1), side(2)};
}

Interval dot_of(const Box3& a, const Box3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Unit normals over a part of a patch, and how they turn: dn/du = u_of_u dp/du + v_of_u dp/dv, likewise dn/dv, by the
// part's own parameters (Weingarten's equations).
struct NormalTurn {
  Box3 normals;
  Interval u_of_u, v_of_u, u_of_v, v_of_v;
  double error;  // of a component in floats
};
std::optional<NormalTurn> normal_turn(const PatchNet& net, const CornerFrame& frame, const TangentCones& tangents,
                                      const NetMeasure& measure, const DerivativeError& rounding) {
  const auto cone = npatch_cone(net, measure, frame, tpatch_cone(tangents, rounding), rounding);
  if (!cone) return std::nullopt;
  const NormalRange range = normal_range(cone);
  const auto side = [&](std::size_t a) { return Interval(range.low[a], range.high[a]); };
  NormalTurn out{{side(0), side(1), side(2)}, {}, {}, {}, {}, cone->error};
  const Interval uu = dot_of(out.normals, second_derivatives(net, 0, frame.axes)),
                 uv = dot_of(out.normals, second_derivatives(net, 1, frame.axes)),
                 vv = dot_of(out.normals, second_derivatives(net, 2, frame.axes));
  const auto squared = [](double low, double high2) { return Interval::rounded(9 * low * low, 9 * high2); };
  const Interval length2_u = squared(tangents.min_length_u, tangents.max_length2_u),
                 length2_v = squared(tangents.min_length_v, tangents.max_length2_v);
  const Interval between = dot_of(scaled(control_steps(net, true, frame.axes), Interval(3.0)),
                                  scaled(control_steps(net, false, frame.axes), Interval(3.0)));
  const Interval sine2(tangents.min_sine * tangents.min_sine * (1 - 1e-12), 1.0);
  const auto solved = [&](const Interval& own, const Interval& other, const Interval& own2, const Interval& other2) {
    return (other * between / other2 - own) / (own2 * sine2);
  };
  out.u_of_u = solved(uu, uv, length2_u, length2_v);
  out.v_of_u = solved(uv, uu, length2_v, length2_u);
  out.u_of_v = solved(uv, vv, length2_u, length2_v);
  out.v_of_v = solved(vv, uv, length2_v, length2_u);
  return out;
}

}  // namespace

// Bounds of the edges of triangles, in a frame of camera space, per unit of the base patch's parameters; the steps of
// the grid are kept apart.
struct BackFaceTest::Chords {
  Frame axes;
  Box3 u, v;    // without steps of heights
  Box3 normal;  // directions along which heights step
  Interval steps_u{0.0}, steps_v{0.0};
  Interval scale_u{1.0}, scale_v{1.0};  // positive, of all of the above in a direction
  double step_u = 1, step_v = 1;        // of the grid
  double longest_u = 0, longest_v = 0;
  double vertex_error = 0;  // of any vertex's place

  // Bounds of all triangles' cross products, for one cell of the grid, up to factors of 1 and more.
  Box3 cross_products() const {
    const Box3 product = cross(u, v) + scaled(cross(u, normal), steps_v) + scaled(cross(normal, v), steps_u);
    return scaled(product, Interval(step_u * scale_u.low()) * Interval(step_v * scale_v.low()));
  }
};

// Corners of a box in camera space; the nearest and farthest bound every vertex's depth and distance.
struct BackFaceTest::Corners {
  std::array<DVec3, 16> at;
  double near_w = 1e300, far_w = 0, longest = 0;
  bool in_front = true;
};

void BackFaceTest::begin(std::uint32_t patch) {
  patch_ = patch;
  const scene::PosedDrawable& drawable = frame_.drawable_of(patch);
  cluster_ = drawable.material->double_sided ? nullptr : resting_bound(frame_, patch);
  applies_ = drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches && !drawable.material->double_sided;
  if (!applies_) return;
  for (std::size_t key = 0; key < 2; ++key)
    to_camera_[key] = frame_.views[key].world_to_camera * DMat4(drawable.to_world[key]);
  stretch_ = std::max(largest_stretch(to_camera_[0]), largest_stretch(to_camera_[1]));
}

BackFaceTest::Corners BackFaceTest::look(const MovingCorners& corners) const {
  const scene::Projection& p = frame_.projection;
  Corners out;
  for (std::size_t k = 0; k < 16; ++k) {
    const DVec4& r = corners[k];
    if (!(r.z >= p.near)) out.in_front = false;
    out.at[k] = p.orthographic ? DVec3(0, 0, -1)
                               : DVec3((r.x - p.center_x * r.z) / p.scale, (p.center_y * r.z - r.y) / p.scale, -r.z);
    out.near_w = std::min(out.near_w, r.w);
    out.far_w = std::max(out.far_w, r.w);
    out.longest = std::max(out.longest, glm::length(out.at[k]));
  }
  return out;
}

// Most sub-patches face the camera: this is looked at before anything is proved.
bool BackFaceTest::faces_away_at_middle(const SubPatchBounder& bounder, const Corners& corners) const {
  const DVec3 middle = (corners.at[0] + corners.at[7]) * 0.5;
  const DMat3 turn(to_camera_[0]);
  const CornerFrame guess = corner_frame(bounder.nets().first(1));
  const double turned = bounder.drawable().mirrored ? -1 : 1;
  return turned * glm::dot(glm::cross(turn * guess.tangent_u, turn * guess.tangent_v), middle) > 0;
}

// Adds the effect of displacement to the chords.
bool BackFaceTest::displace(const SubPatchBounder& bounder, const PyramidLibrary& pyramids,
                            const scene::CellRange& cells, Chords& chords) const {
  const auto object = bounder.nets();
  const scene::ParameterRange& r = bounder.range();
  const double du = static_cast<double>(r.u1) - static_cast<double>(r.u0),
               dv = static_cast<double>(r.v1) - static_cast<double>(r.v0);
  const CornerFrame frame = corner_frame(object);
  std::array<TangentCones, 2> tangents;
  std::array<NormalTurn, 2> turns;
  double normal_error = 0;
  for (std::size_t key = 0; key < object.size(); ++key) {
    const NetMeasure measure = measure_net(object[key], frame.axes, frame.tangent_u, frame.tangent_v);
    const auto cones = tangent_cones(measure, frame);
    const DerivativeError rounding{derivative_rounding(object[key]) + chords.vertex_error, du, dv};
    const auto turn = cones ? normal_turn(object[key], frame, *cones, measure, rounding) : std::nullopt;
    if (!turn) return false;
    tangents[key] = *cones;
    turns[key] = *turn;
    normal_error = std::max(normal_error, turn->error);
  }
  const auto foreign = bounder.foreign_error(cells, std::span(tangents).first(object.size()));
  if (!foreign) return false;

  const HeightSteps heights = height_steps(bounder.displacement(), r, pyramids, fetches_);
  const Interval reach = range_of(bounder.offsets()) + symmetric(foreign->along_normal);
  const Interval grid = Interval(du) / Interval(dv);  // of derivatives by the part's parameters, to the base patch's
  Interval of_other_u, of_other_v;
  for (std::size_t key = 0; key < 2; ++key) {
    const NormalTurn& turn = turns[std::min(key, object.size() - 1)];
    const Box3 normal = carried(to_camera_[key], frame.axes, turn.normals, chords.axes);
    // At a height h the chords along u are the patch's chords times 1 + h u_of_u, plus a share of the chords along v.
    const Interval scale_u = Interval(1.0) + reach * turn.u_of_u, scale_v = Interval(1.0) + reach * turn.v_of_v;
    const Interval other_u = reach * turn.v_of_u / grid, other_v = reach * turn.u_of_v * grid;
    const auto join = [&](Interval& to, const Interval& from) { to = key == 0 ? from : hull(to, from); };
    chords.normal = key == 0 ? normal : hull(chords.normal, normal);
    join(chords.scale_u, scale_u), join(chords.scale_v, scale_v);
    join(of_other_u, other_u), join(of_other_v, other_v);
  }
  if (!(chords.scale_u.low() > 0.1 && chords.scale_v.low() > 0.1)) return false;
  const Box3 u = chords.u, v = chords.v;
  chords.u = u + scaled(v, of_other_u / chords.scale_u);
  chords.v = v + scaled(u, of_other_v / chords.scale_v);
  const double off = 2 * (heights.error + foreign->along_normal);
  chords.steps_u = (heights.u + symmetric(off / chords.step_u)) / chords.scale_u;
  chords.steps_v = (heights.v + symmetric(off / chords.step_v)) / chords.scale_v;
  chords.vertex_error += reach.magnitude() * (normal_error + 0x1p-20) + foreign->besides;
  return true;
}

// A stitched vertex is off its place in the grid: chords that end there hold a piece of one in the other direction, and
// chords along the edge are longer by up to both ends' way.
void BackFaceTest::stitch(const scene::CellRange& cells, Chords& chords) const {
  const scene::TessellationPattern& pattern = frame_.pattern_of(patch_);
  const auto stitched = [](bool touches, int factor, int n, int first, int last) {
    double shift = 0;
    if (touches && factor != n)
      for (int i = first; i <= last; ++i)
        shift = std::max(shift,
                         std::abs(scene::TessellationPattern::edge_vertex(i, n, factor) / static_cast<double>(factor) -
                                  i / static_cast<double>(n)));
    return shift * (1 + 0x1p-20);
  };
  const double shift_u = std::max(stitched(cells.j0 == 0, pattern.edge[0], pattern.nu, cells.i0, cells.i1),
                                  stitched(cells.j1 == pattern.nv, pattern.edge[1], pattern.nu, cells.i0, cells.i1));
  const double shift_v = std::max(stitched(cells.i0 == 0, pattern.edge[2], pattern.nv, cells.j0, cells.j1),
                                  stitched(cells.i1 == pattern.nu, pattern.edge[3], pattern.nv, cells.j0, cells.j1));
  const double normal = longest(chords.normal);
  chords.longest_u =
      (longest(chords.u) + normal * chords.steps_u.magnitude()) * (chords.step_u + 2 * shift_u) * chords.scale_u.high();
  chords.longest_v =
      (longest(chords.v) + normal * chords.steps_v.magnitude()) * (chords.step_v + 2 * shift_v) * chords.scale_v.high();
  const Chords straight = chords;
  const Interval part_u = symmetric(shift_u / chords.step_v) * chords.scale_u / chords.scale_v,
                 part_v = symmetric(shift_v / chords.step_u) * chords.scale_v / chords.scale_u;
  if (shift_u > 0) {
    chords.v = chords.v + scaled(straight.u, part_u);
    chords.steps_v = chords.steps_v + straight.steps_u * part_u;
  }
  if (shift_v > 0) {
    chords.u = chords.u + scaled(straight.v, part_v);
    chords.steps_u = chords.steps_u + straight.steps_v * part_v;
  }
}

std::optional<BackFaceTest::Chords> BackFaceTest::chords(const SubPatchBounder& bounder, const PyramidLibrary& pyramids,
                                                         const scene::CellRange& cells) const {
  const auto object = bounder.nets();
  std::array<PatchNet, 2> nets;
  for (std::size_t key = 0; key < 2; ++key)
    nets[key] = transformed(object[std::min(key, object.size() - 1)], to_camera_[key]);
  const CornerFrame frame = corner_frame(nets);
  if (!frame.regular) return std::nullopt;
  const scene::ParameterRange& r = bounder.range();
  const scene::TessellationPattern& pattern = frame_.pattern_of(patch_);
  const double du = static_cast<double>(r.u1) - static_cast<double>(r.u0),
               dv = static_cast<double>(r.v1) - static_cast<double>(r.v0);
  Chords out{};
  out.axes = frame.axes;
  out.step_u = 1.0 / pattern.nu, out.step_v = 1.0 / pattern.nv;
  out.u =
      scaled(hull(control_steps(nets[0], true, out.axes), control_steps(nets[1], true, out.axes)), Interval(3 / du));
  out.v =
      scaled(hull(control_steps(nets[0], false, out.axes), control_steps(nets[1], false, out.axes)), Interval(3 / dv));
  // A vertex is off by fewer than 72 roundings of the largest coordinate; a displaced one also by the error of its
  // normal and of its height.
  out.vertex_error = 72 * 0x1p-24 * std::sqrt(3.0) * bounder.largest_coordinate();
  if (bounder.displaced() && !displace(bounder, pyramids, cells, out)) return std::nullopt;
  const double off = 2 * stretch_ * out.vertex_error;
  out.u = out.u + symmetric(off / (out.step_u * out.scale_u.low()));
  out.v = out.v + symmetric(off / (out.step_v * out.scale_v.low()));
  stitch(cells, out);
  return out;
}

bool BackFaceTest::culls(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
                         const MovingCorners& corners) const {
  if (cluster_ != nullptr) return cluster_faces_away(frame_, frame_.drawable_of(patch_), *cluster_, corners);
  if (!applies_) return false;
  const Corners camera = look(corners);
  if (!camera.in_front || !faces_away_at_middle(bounder, camera)) return false;
  const auto chords = this->chords(bounder, pyramids, cells);
  if (!chords) return false;

  const scene::Projection& p = frame_.projection;
  const double turned = bounder.drawable().mirrored ? -1 : 1;
  const double aperture = p.lens_scale / p.scale * (p.orthographic ? p.inverse_focus : 1.0);
  const Box3 product = chords->cross_products();
  double least = 1e300;  // product of a vertex's place and a triangle's cross product
  for (const DVec3& c : camera.at) {
    const auto component = [&](const DVec3& axis) { return Interval(turned * glm::dot(c, axis)); };
    const Interval along = component(chords->axes[0]) * product.x + component(chords->axes[1]) * product.y +
                           component(chords->axes[2]) * product.z;
    least = std::min(least, along.low());
  }
  // The vertex itself may lie off by its error, and the eye may be any point of the lens.
  const double shift = longest(product) * (aperture + stretch_ * chords->vertex_error + 1e-12 * camera.longest);
  least -= shift;
  if (!(least > 0)) return false;
  // Compares twice a triangle's area on screen with the change that snapping (half a sub-pixel and diagonal) and the
  // float rounding of screen positions can cause, together below two sub-pixels a vertex. Projection divides by the
  // depth of each vertex.
  const double snap = 2.0 / static_cast<double>(frame_.request.subpixels());
  const double area = p.scale * p.scale * least / (camera.far_w * camera.far_w * camera.far_w);
  const double edges =
      2 * p.scale * camera.longest * (chords->longest_u + chords->longest_v) / (camera.near_w * camera.near_w);
  return area > 2 * snap * edges + 4 * snap * snap;
}

}  // namespace tessera::frontend
