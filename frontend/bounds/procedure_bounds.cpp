#include "frontend/bounds/procedure_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/bounds/enclosure_functions.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::frontend {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vector3<Enclosure> enclose(shaders::ShapeId shape, const scene::Procedure::Piece& piece, double u0, double v0,
                           double u1, double v1) {
  return shaders::shape_point(shape, piece.input, Enclosure::first_parameter(u0, u1),
                              Enclosure::second_parameter(v0, v1));
}

// A row of the matrix times the point, as the SIMD array computes it.
Enclosure transformed(const Mat4& m, int row, const Vector3<Enclosure>& p) {
  return (Enclosure(m[0][row]) * p.x + Enclosure(m[1][row]) * p.y) +
         (Enclosure(m[2][row]) * p.z + Enclosure(m[3][row]));
}

// Homogeneous raster coordinates at one key; `z` is the depth and, in perspective, the divisor of x and y.
struct RasterEnclosure {
  Enclosure x, y, z;
};

Interval with_error(const Enclosure& e) { return {e.low(), e.high()}; }

bool is_unknown(const Interval& x) { return std::isnan(x.low()) || std::isnan(x.high()); }

// Hull of the values at both keys. A value that is not a number at one key may be anything: a deforming shape may be
// singular at one key alone.
Interval either(const Interval& a, const Interval& b) {
  return is_unknown(a) || is_unknown(b) ? Interval(-kInfinity, kInfinity) : hull(a, b);
}

// A coordinate on screen: its range, its derivatives, and its value in the middle of the box if that is known.
struct ScreenCoordinate {
  Interval value, by_s, by_t, middle = Interval(-kInfinity, kInfinity);
};

Interval middle_of(const Enclosure& e) { return {e.middle().low() - e.error(), e.middle().high() + e.error()}; }

// If all depths lie in front of the near plane the quotient keeps the joint variation of numerator and depth; otherwise
// only the part in front counts, by ranges alone.
ScreenCoordinate projected(const Enclosure& x, const Enclosure& z, double near) {
  if (z.low() >= near) {
    const Enclosure q = x / z;
    return {with_error(q), q.by_s(), q.by_t(), middle_of(q)};
  }
  const Interval front(near, std::max(z.high(), near)), value = with_error(x) / front;
  return {value, (x.by_s() - value * z.by_s()) / front, (x.by_t() - value * z.by_t()) / front};
}

ScreenCoordinate on_screen(const Enclosure& x, const Enclosure& z, const scene::Projection& p) {
  return p.orthographic ? ScreenCoordinate{with_error(x), x.by_s(), x.by_t(), middle_of(x)} : projected(x, z, p.near);
}

ScreenCoordinate join(const ScreenCoordinate& a, const ScreenCoordinate& b) {
  return {either(a.value, b.value), either(a.by_s, b.by_s), either(a.by_t, b.by_t)};
}

// The same at every time between the keys. A point's position is a mean of its positions at the keys, weighted with its
// depths; its derivative is one of quotients whose parts are linear in time.
ScreenCoordinate moving(const std::array<RasterEnclosure, 2>& r, Enclosure RasterEnclosure::*axis, double near) {
  const Enclosure &x0 = r[0].*axis, &x1 = r[1].*axis, &z0 = r[0].z, &z1 = r[1].z;
  const Interval depth = either(with_error(z0), with_error(z1)),
                 front(std::max(near, depth.low()), std::max(near, depth.high()));
  Interval value = either(with_error(x0), with_error(x1)) / front;
  if (z0.low() >= near && z1.low() >= near)
    value = either(projected(x0, z0, near).value, projected(x1, z1, near).value);
  return {value, (either(x0.by_s(), x1.by_s()) - value * either(z0.by_s(), z1.by_s())) / front,
          (either(x0.by_t(), x1.by_t()) - value * either(z0.by_t(), z1.by_t())) / front};
}

// Adds the lens: a shift by up to lens_scale * |coc(z)|, and its derivative.
void add_lens(const scene::Projection& p, const Interval& depth, const std::array<RasterEnclosure, 2>& r,
              ScreenCoordinate& c) {
  if (p.lens_scale == 0) return;
  const Interval z(std::max(depth.low(), p.near), std::max(depth.high(), p.near)), focus(p.inverse_focus), one(1.0),
      lens(-p.lens_scale, p.lens_scale);
  const Interval coc = p.orthographic ? one - z * focus : one / z - focus,
                 slope = p.orthographic ? focus : one / (z * z);
  c.value = c.value + lens * coc;
  c.by_s = c.by_s + lens * slope * either(r[0].z.by_s(), r[1].z.by_s());
  c.by_t = c.by_t + lens * slope * either(r[0].z.by_t(), r[1].z.by_t());
}

ProcedureCellBounds::Image image_of(const std::array<ScreenCoordinate, 2>& c) {
  const auto middle = [](const Interval& x) { return (x.low() + x.high()) / 2; };
  const auto off = [](const Interval& x) { return (x.high() - x.low()) / 2; };
  const auto larger = [&](Interval ScreenCoordinate::*member) {
    return std::max(off(c[0].*member), off(c[1].*member));
  };
  ProcedureCellBounds::Image image{middle(c[0].middle), middle(c[1].middle), middle(c[0].by_s),
                                   middle(c[1].by_s),   middle(c[0].by_t),   middle(c[1].by_t)};
  image.off = larger(&ScreenCoordinate::middle);
  image.off_u = larger(&ScreenCoordinate::by_s), image.off_v = larger(&ScreenCoordinate::by_t);
  // NaN anywhere: nothing is known.
  if (!std::isfinite(image.x + image.y + image.x_u + image.y_u + image.x_v + image.y_v + image.off + image.off_u +
                     image.off_v))
    image = {};
  return image;
}

// Rounding of a projection in front of the near plane.
double rounding_of_projection(const RasterEnclosure& r, const ScreenCoordinate& x, const ScreenCoordinate& y,
                              const scene::Projection& p) {
  if (p.orthographic) return std::max(r.x.error(), r.y.error());
  return (std::max(r.x.error(), r.y.error()) + std::max(x.value.magnitude(), y.value.magnitude()) * r.z.error()) /
         std::max(p.near, r.z.low());
}

double known(double value) { return std::isnan(value) ? kInfinity : value; }

// The box of the points at both motion keys.
MovingBox box_of(const Vector3<Enclosure>& open, const Vector3<Enclosure>& close) {
  MovingBox box;
  box.axes = {DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
  for (std::size_t key = 0; key < 2; ++key) {
    const Vector3<Enclosure>& p = key == 0 ? open : close;
    box.low[key] = {p.x.low(), p.y.low(), p.z.low()};
    box.high[key] = {p.x.high(), p.y.high(), p.z.high()};
  }
  // Known at one key alone is unknown.
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (std::isnan(box.low[1 - key][axis]) || std::isnan(box.high[1 - key][axis]))
        box.low[key][axis] = box.high[key][axis] = std::numeric_limits<double>::quiet_NaN();
  return box;
}

}  // namespace

MovingBox procedure_box(const scene::ProcedurePatch& patch, const scene::ParameterRange& range) {
  const auto points = [&](const scene::Procedure::Piece& piece) {
    return enclose(patch.shape, piece, static_cast<double>(patch.u(range.u0)), static_cast<double>(patch.v(range.v0)),
                   static_cast<double>(patch.u(range.u1)), static_cast<double>(patch.v(range.v1)));
  };
  const Vector3<Enclosure> open = points(*patch.piece);
  return box_of(open, patch.piece == patch.piece_close ? open : points(*patch.piece_close));
}

ProcedureCellBounds bound_procedure_cell(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                         std::size_t piece, const ParameterBox& box) {
  const scene::Projection& projection = frame.projection;
  const auto points = [&](const scene::Procedure& procedure) {
    return enclose(procedure.shape, procedure.pieces[piece], box.u0, box.v0, box.u1, box.v1);
  };
  std::array<Vector3<Enclosure>, 2> points_at;
  points_at[0] = points(*drawable.procedure);
  points_at[1] = drawable.deforming ? points(*drawable.procedure_close) : points_at[0];
  std::array<RasterEnclosure, 2> r;
  for (std::size_t key = 0; key < 2; ++key) {
    const Vector3<Enclosure>& p = points_at[key];
    if (key == 1 && !drawable.moving)
      r[1] = r[0];
    else
      r[key] = {transformed(drawable.to_raster[key], 0, p), transformed(drawable.to_raster[key], 1, p),
                transformed(drawable.to_raster[key], 2, p)};
  }
  ProcedureCellBounds out;
  const Interval depth = either(with_error(r[0].z), with_error(r[1].z));
  // NaN is unknown, not outside.
  if (depth.high() < projection.near || (projection.far > 0 && depth.low() > projection.far)) {
    out.outside = true;
    return out;
  }
  out.crosses_near = !(depth.low() >= projection.near);
  std::array<ScreenCoordinate, 2> c;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto member = axis == 0 ? &RasterEnclosure::x : &RasterEnclosure::y;
    if (projection.orthographic) {
      c[axis] = join(on_screen(r[0].*member, r[0].z, projection), on_screen(r[1].*member, r[1].z, projection));
    } else {
      c[axis] = drawable.moving ? moving(r, member, projection.near) : on_screen(r[0].*member, r[0].z, projection);
    }
  }
  if (!drawable.moving && projection.lens_scale == 0 && !drawable.material->double_sided) {
    const Interval area = c[0].by_s * c[1].by_t - c[1].by_s * c[0].by_t;
    // Fronts have negative area where y points down, as glTF's wind counter-clockwise.
    out.faces_away = drawable.mirrored ? area.high() < 0 : area.low() > 0;
  }
  out.box = box_of(points_at[0], points_at[1]);
  for (std::size_t key = 0; key < 2; ++key)
    out.rounding = std::max(out.rounding, known(rounding_of_projection(r[key], c[0], c[1], projection)));
  if (!drawable.moving && projection.lens_scale == 0) out.image = image_of(c);
  for (ScreenCoordinate& coordinate : c) add_lens(projection, depth, r, coordinate);
  // A sample's own roundings after these; far less than a hundredth of a pixel where anything is drawn.
  const auto margin = [](double x) { return 0x1p-8 + 0x1p-20 * std::abs(x); };
  const auto low = [&](const Interval& x) { return -known(-(x.low() - margin(x.low()))); };
  const auto high = [&](const Interval& x) { return known(x.high() + margin(x.high())); };
  out.x0 = low(c[0].value), out.x1 = high(c[0].value);
  out.y0 = low(c[1].value), out.y1 = high(c[1].value);
  out.near_z = std::isnan(depth.low()) ? projection.near : std::max(projection.near, depth.low());
  out.far_z = known(depth.high());
  out.reach_x_u = known(c[0].by_s.magnitude()), out.reach_y_u = known(c[1].by_s.magnitude());
  out.reach_x_v = known(c[0].by_t.magnitude()), out.reach_y_v = known(c[1].by_t.magnitude());
  out.reach_u = std::max(out.reach_x_u, out.reach_y_u);
  out.reach_v = std::max(out.reach_x_v, out.reach_y_v);
  const auto width = [](const Interval& x) { return known(x.high() - x.low()); };
  for (std::size_t key = 0; key < (drawable.moving ? 2u : 1u); ++key)
    for (const auto member : {&RasterEnclosure::x, &RasterEnclosure::y}) {
      const ScreenCoordinate at_key = on_screen(r[key].*member, r[key].z, projection);
      out.bend_u = std::max(out.bend_u, width(at_key.by_s));
      out.bend_v = std::max(out.bend_v, width(at_key.by_t));
    }
  return out;
}

}  // namespace tessera::frontend
