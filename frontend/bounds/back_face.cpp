#include "frontend/bounds/back_face.h"

#include <algorithm>
#include <cmath>

namespace tessera::frontend {
namespace {

// Largest factor by which a matrix lengthens: sqrt of the largest row sum of L^T L, exact where its columns are
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

// Largest second derivatives of a net by its own parameters.
struct SecondLengths {
  double uu = 0, uv = 0, vv = 0;
};
SecondLengths second_lengths(const PatchNet& net) {
  SecondLengths out;
  const auto length = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {  // |a - b - c + d|
    return glm::length(net.point(a) - net.point(b) - net.point(c) + net.point(d));
  };
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 2; ++i) {
      out.uu = std::max(out.uu, 6 * length(4 * j + i + 2, 4 * j + i + 1, 4 * j + i + 1, 4 * j + i));
      out.vv = std::max(out.vv, 6 * length(4 * (i + 2) + j, 4 * (i + 1) + j, 4 * (i + 1) + j, 4 * i + j));
    }
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      out.uv = std::max(out.uv, 9 * length(4 * j + i + 5, 4 * j + i + 4, 4 * j + i + 1, 4 * j + i));
  return out;
}

// By how much a parameter's change can change a displacement, per unit of the base patch's parameters.
struct Slopes {
  double u = 0, v = 0;
};
Slopes displacement_slopes(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                           const SubPatchBounder& bounder, std::uint32_t patch) {
  const scene::PatchDisplacement d = patch_displacement(frame, bounder.drawable(), patch);
  const scene::PatchDisplacement::Footprint f = d.footprint(bounder.range());
  const Vec2 texel = pyramids.slopes_of(*d.material->texture).query(d.material->sampler, f.low, f.high, d.lod);
  const auto largest = [](Vec2 a, Vec2 b) { return glm::max(glm::abs(a), glm::abs(b)); };
  const Vec2 along_u = largest(d.corner[1] - d.corner[0], d.corner[3] - d.corner[2]);
  const Vec2 along_v = largest(d.corner[2] - d.corner[0], d.corner[3] - d.corner[1]);
  const double scale = std::abs(static_cast<double>(d.material->scale)) * (1 + 0x1p-20);
  return {scale * static_cast<double>(along_u.x * texel.x + along_u.y * texel.y),
          scale * static_cast<double>(along_v.x * texel.x + along_v.y * texel.y)};
}

// What the filtered heights' rounding (their mip levels' included, see MinMaxPyramid) may move a vertex by.
double height_rounding(const PyramidLibrary& pyramids, const scene::Displacement& d) {
  const ValueRange whole = pyramids.of(*d.texture).whole();
  const double largest = static_cast<double>(std::max(std::abs(whole.low), std::abs(whole.high)));
  return 0x1p-15 * (std::abs(static_cast<double>(d.scale)) * largest + std::abs(static_cast<double>(d.bias)));
}

TangentSpread join(const TangentSpread& a, const TangentSpread& b) {
  return {std::min(a.min_dot, b.min_dot), std::min(a.min_cosine2, b.min_cosine2),
          std::max(a.max_length2, b.max_length2)};
}

}  // namespace

// Cross products of chords over one cell of the grid, in camera space.
struct BackFaceTest::Spread {
  DVec3 axis;
  double sine, cosine;      // of the cone about the axis
  double least;             // length of a cross product
  double chord_u, chord_v;  // longest
};

void BackFaceTest::begin(std::uint32_t patch) {
  patch_ = patch;
  const scene::PosedDrawable& drawable = frame_.drawable_of(patch);
  applies_ = drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches && !drawable.material->double_sided;
  if (!applies_) return;
  for (std::size_t key = 0; key < 2; ++key)
    to_camera_[key] = frame_.views[key].world_to_camera * DMat4(drawable.to_world[key]);
  stretch_ = std::max(largest_stretch(to_camera_[0]), largest_stretch(to_camera_[1]));
}

// What displacement and rounding add to a chord, per unit of the base patch's parameter, in object space.
std::optional<BackFaceTest::Extra> BackFaceTest::extra(const SubPatchBounder& bounder,
                                                       const PyramidLibrary& pyramids) const {
  const scene::ParameterRange& r = bounder.range();
  const double du = static_cast<double>(r.u1) - static_cast<double>(r.u0),
               dv = static_cast<double>(r.v1) - static_cast<double>(r.v0);
  // A vertex is off by fewer than 72 roundings of the largest coordinate; a displaced one also by the error of its
  // normal and of its height.
  Extra out{0, 0, 72 * 0x1p-24 * std::sqrt(3.0) * bounder.largest_coordinate()};
  if (!bounder.displaced()) return out;
  const double reach = std::max(std::abs(static_cast<double>(bounder.offsets().low)),
                                std::abs(static_cast<double>(bounder.offsets().high)));
  const auto object = bounder.nets();
  const CornerFrame frame = corner_frame(object);
  double turn_u = 0, turn_v = 0, normal_error = 0;  // turn of the normal
  for (const PatchNet& net : object) {
    const auto cones = tangent_cones(measure_net(net, frame.axes, frame.tangent_u, frame.tangent_v), frame);
    if (!cones) return std::nullopt;
    const auto cone = tpatch_cone(*cones, {derivative_rounding(net) + out.vertex_error, du, dv});
    if (!cone) return std::nullopt;
    normal_error = std::max(normal_error, cone->error);
    const SecondLengths second = second_lengths(net);
    const double longest_u = 3 * std::sqrt(cones->max_length2_u), longest_v = 3 * std::sqrt(cones->max_length2_v);
    const double area = 9 * cones->min_length_u * cones->min_length_v * cones->min_sine;
    turn_u = std::max(turn_u, (second.uu * longest_v + longest_u * second.uv) / area / du);
    turn_v = std::max(turn_v, (second.uv * longest_v + longest_u * second.vv) / area / dv);
  }
  const Slopes slope = displacement_slopes(frame_, pyramids, bounder, patch_);
  out.u = slope.u + reach * turn_u;
  out.v = slope.v + reach * turn_v;
  out.vertex_error +=
      reach * (normal_error + 0x1p-20) + height_rounding(pyramids, *bounder.drawable().material->displacement);
  return out;
}

bool BackFaceTest::spread(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
                          Spread& out) const {
  const auto object = bounder.nets();
  std::array<PatchNet, 2> nets;
  for (std::size_t key = 0; key < 2; ++key)
    nets[key] = transformed(object[std::min(key, object.size() - 1)], to_camera_[key]);
  const CornerFrame frame = corner_frame(nets);
  const NetMeasure m0 = measure_net(nets[0], frame.axes, frame.tangent_u, frame.tangent_v),
                   m1 = measure_net(nets[1], frame.axes, frame.tangent_u, frame.tangent_v);
  const auto tangents = tangent_cones({m0.extents, join(m0.u, m1.u), join(m0.v, m1.v)}, frame);
  const auto extra = this->extra(bounder, pyramids);
  if (!tangents || !extra) return false;

  // Chords per unit of the base patch's parameters, and steps of the grid.
  const scene::ParameterRange& r = bounder.range();
  const scene::TessellationPattern& pattern = frame_.pattern_of(patch_);
  const double du = static_cast<double>(r.u1) - static_cast<double>(r.u0),
               dv = static_cast<double>(r.v1) - static_cast<double>(r.v0);
  const double step_u = 1.0 / pattern.nu, step_v = 1.0 / pattern.nv;
  const double least_u = 3 * tangents->min_length_u / du, least_v = 3 * tangents->min_length_v / dv;
  const double max_u = 3 * std::sqrt(tangents->max_length2_u) / du, max_v = 3 * std::sqrt(tangents->max_length2_v) / dv;
  const double extra_u = stretch_ * (extra->u + 2 * extra->vertex_error / step_u),
               extra_v = stretch_ * (extra->v + 2 * extra->vertex_error / step_v);

  // Sizes of what tilts a cross product, relative to the least one.
  double tilt = extra_u / least_u + extra_v / least_v + extra_u * extra_v / (least_u * least_v);
  // A stitched vertex is at most half an edge's step off its place in the grid.
  const auto stitched = [&](bool touches, int factor, int n) { return touches && factor != n ? 0.5 / factor : 0.0; };
  const double shift_u = std::max(stitched(cells.j0 == 0, pattern.edge[0], pattern.nu),
                                  stitched(cells.j1 == pattern.nv, pattern.edge[1], pattern.nu));
  const double shift_v = std::max(stitched(cells.i0 == 0, pattern.edge[2], pattern.nv),
                                  stitched(cells.i1 == pattern.nu, pattern.edge[3], pattern.nv));
  tilt += shift_u * (2 * tangents->sine_u * max_u + 2 * extra_u) / (step_v * least_v);
  tilt += shift_v * (2 * tangents->sine_v * max_v + 2 * extra_v) / (step_u * least_u);
  tilt /= tangents->min_sine;
  const double sine = tpatch_sine(*tangents);
  if (!(tilt < 0.99 && sine < 1)) return false;

  const double cosine = std::sqrt(1 - sine * sine), tilt_cosine = std::sqrt(1 - tilt * tilt);
  out.axis = frame.axes[2];
  out.sine = sine * tilt_cosine + cosine * tilt;
  out.cosine = cosine * tilt_cosine - sine * tilt;
  out.least = least_u * step_u * least_v * step_v * tangents->min_sine * (1 - tilt);
  out.chord_u = (max_u + extra_u) * (step_u + shift_u);
  out.chord_v = (max_v + extra_v) * (step_v + shift_v);
  return out.cosine > 0;
}

bool BackFaceTest::culls(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
                         const MovingCorners& corners) const {
  if (!applies_ || (bounder.displaced() && bounder.foreign_boundary())) return false;
  const scene::Projection& p = frame_.projection;
  const double turned = bounder.drawable().mirrored ? -1 : 1;
  // Corners in camera space; the nearest and farthest bound every vertex's depth and distance.
  std::array<DVec3, 16> at;
  double near_w = 1e300, far_w = 0, longest = 0;
  for (std::size_t k = 0; k < 16; ++k) {
    const DVec4& r = corners[k];
    if (!(r.z >= p.near)) return false;
    at[k] = p.orthographic ? DVec3(0, 0, -1)
                           : DVec3((r.x - p.center_x * r.z) / p.scale, (p.center_y * r.z - r.y) / p.scale, -r.z);
    near_w = std::min(near_w, r.w);
    far_w = std::max(far_w, r.w);
    longest = std::max(longest, glm::length(at[k]));
  }
  const double aperture = p.lens_scale / p.scale * (p.orthographic ? p.inverse_focus : 1.0);

  // Most sub-patches face the camera: look at the middle before anything is proved.
  const DVec3 middle = (at[0] + at[7]) * 0.5;
  const DMat3 turn(to_camera_[0]);
  const CornerFrame guess = corner_frame(bounder.nets().first(1));
  if (turned * glm::dot(glm::cross(turn * guess.tangent_u, turn * guess.tangent_v), middle) <= 0) return false;

  Spread s;
  if (!spread(bounder, pyramids, cells, s)) return false;
  double least_incidence = 1e300;  // over distance
  for (const DVec3& c : at) {
    const double along = turned * glm::dot(c, s.axis), side = glm::length(c - s.axis * glm::dot(c, s.axis));
    least_incidence =
        std::min(least_incidence, ((along - aperture) * s.cosine - (side + aperture) * s.sine) * (1 - 1e-12));
  }
  if (!(least_incidence > 0)) return false;
  // Twice a triangle's area on screen against what snapping (half a sub-pixel and diagonal) and the float rounding of
  // screen positions, together below two sub-pixels a vertex, can change it by. Projection divides by the depth of each
  // vertex.
  const double snap = 2.0 / static_cast<double>(frame_.request.subpixels());
  const double area = p.scale * p.scale * s.least * least_incidence / (far_w * far_w * far_w);
  const double edges = 2 * p.scale * longest * (s.chord_u + s.chord_v) / (near_w * near_w);
  return area > 2 * snap * edges + 4 * snap * snap;
}

}  // namespace tessera::frontend
