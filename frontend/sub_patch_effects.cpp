#include "frontend/sub_patch_effects.h"

#include <algorithm>
#include <cmath>

#include "scene/subpixel.h"

namespace tessera::frontend {
namespace {

constexpr std::size_t kBodyCorners = 8;

bool same_points(const scene::PosedDrawable& drawable, std::size_t first, std::size_t count) {
  const auto open = drawable.positions[0].subspan(first, count), close = drawable.positions[1].subspan(first, count);
  return std::equal(open.begin(), open.end(), close.begin());
}

// A margin is 72 roundings of the largest sum of terms; a transformed vertex takes three of them, so a 24th is enough
// for the transformation of a vertex that is the same float at both motion keys.
constexpr double kTransformShare = 1.0 / 24;

}  // namespace

float sharp_factor(const scene::Projection& projection) {
  return projection.lens_scale == 0
             ? 0.0f
             : static_cast<float>(static_cast<double>(scene::kSharpPixels) / projection.lens_scale);
}

bool certainly_projected(const SubPatchBody& body, const scene::Projection& projection) {
  for (const DVec4& r : body.corners) {
    const double w = r.w - body.margin.w;
    if (!(r.z - body.margin.depth > projection.near) || !(w > 0)) return false;
    const double reach = std::max(std::abs(r.x), std::abs(r.y)) + body.margin.position;
    if (!(reach / w + 1 < static_cast<double>(scene::kGuardBandPixels))) return false;
  }
  return true;
}

// With X = xh / w, a point moves by X1 - X0 = (dxh - X0 dw) / w1. Both differences are linear in the point, so for any
// X0 the numerator is largest at a corner, and for any corner at an end of the range of X0. Depth moves linearly as
// well.
bool stays_still(const SubPatchBody& body, const scene::Projection& projection, double still_pixels,
                 double still_depth) {
  if (!certainly_projected(body, projection)) return false;
  double least_w = body.corners[0].w, least_depth = body.corners[0].z;
  for (const DVec4& r : body.corners) {
    least_w = std::min(least_w, r.w);
    least_depth = std::min(least_depth, r.z);
  }
  const double position_error = body.margin.position * kTransformShare, w_error = body.margin.w * kTransformShare,
               depth_error = body.margin.depth * kTransformShare;
  least_w -= body.margin.w;
  for (int axis = 0; axis < 2; ++axis) {
    double low = 0, high = 0, farthest = 0, way = 0;
    for (std::size_t k = 0; k < 2 * kBodyCorners; ++k) {
      const double x = body.corners[k][axis] / body.corners[k].w;
      if (k == 0) low = high = x;
      if (k < kBodyCorners) low = std::min(low, x), high = std::max(high, x);
      farthest = std::max(farthest, std::abs(x));
    }
    // The vertices may lie outside of the body by their own rounding.
    const double outside = (body.margin.position + farthest * body.margin.w) / least_w;
    low -= outside;
    high += outside;
    for (std::size_t k = 0; k < kBodyCorners; ++k) {
      const DVec4 d = body.corners[k + kBodyCorners] - body.corners[k];
      way = std::max({way, std::abs(d[axis] - low * d.w), std::abs(d[axis] - high * d.w)});
    }
    // The pixels of both motion keys are off by the rounding of the transformation and of a quotient.
    const double error = (position_error + farthest * w_error) / least_w + farthest * 0x1p-23;
    way += body.motion_margin.position + (farthest + outside) * body.motion_margin.w;
    if (!(way / least_w + 2 * error < still_pixels)) return false;
  }
  for (std::size_t k = 0; k < kBodyCorners; ++k) {
    const double way = std::abs(body.corners[k + kBodyCorners].z - body.corners[k].z);
    if (!(way + body.motion_margin.depth + 3 * depth_error < still_depth * (least_depth - depth_error))) return false;
  }
  return true;
}

bool stays_sharp(const ScreenBounds& bounds, const scene::Projection& projection, double sharp_pixels) {
  const double near = static_cast<double>(bounds.near_z), far = static_cast<double>(bounds.far_z);
  const double radius = std::max(defocus_radius(projection, near), defocus_radius(projection, far));
  // The kernels' factor is a difference of two rounded numbers.
  const double size = projection.orthographic ? 1 + std::max(std::abs(near), std::abs(far)) * projection.inverse_focus
                                              : 1 / near + projection.inverse_focus;
  return radius + projection.lens_scale * size * 0x1p-20 < sharp_pixels;
}

bool EffectSelector::deforms(std::uint32_t patch) const {
  const scene::Drawable& drawable = *drawable_->drawable;
  if (!drawable_->deforming) return false;
  if (drawable_->procedure != nullptr) return true;
  if (drawable.kind != scene::Primitive::Kind::kBezierPatches) {
    const scene::MeshClusters& clusters = frame_.assembly->clusters[drawable.geometry];
    const scene::Cluster& cluster = clusters.clusters[patch - drawable.first_patch];
    for (std::uint32_t v = cluster.first_vertex; v < cluster.first_vertex + cluster.vertex_count; ++v)
      if (drawable_->positions[0][clusters.vertices[v]] != drawable_->positions[1][clusters.vertices[v]]) return true;
    return false;
  }
  const std::uint32_t own = patch - drawable.first_patch;
  const scene::PatchNeighbours& neighbours = frame_.assembly->neighbours[drawable.geometry][own];
  if (!same_points(*drawable_, std::size_t{16} * own, 16)) return true;
  for (const scene::PatchNeighbours::EdgeOwner& edge : neighbours.edges)
    if (!same_points(*drawable_, std::size_t{16} * edge.patch, 16)) return true;
  for (const scene::PatchNeighbours::CornerOwner& corner : neighbours.corners)
    if (!same_points(*drawable_, std::size_t{16} * corner.patch, 16)) return true;
  return false;
}

void EffectSelector::begin(std::uint32_t patch) {
  patch_ = patch;
  drawable_ = &frame_.drawable_of(patch);
  deforms_ = deforms(patch);
  if (drawable_->material->alpha_mode != scene::AlphaMode::kMask || drawable_->procedure != nullptr) return;
  // Vertices that attributes are interpolated from: a patch's corners, a cluster's vertices.
  const scene::Vertices& vertices = drawable_->primitive->vertices;
  const scene::TextureSlot& slot = drawable_->material->base_color_texture;
  bool first = true;
  least_vertex_alpha_ = 1;
  const auto add = [&](std::size_t v) {
    if (!vertices.colors.empty())
      least_vertex_alpha_ = first ? vertices.colors[v].w : std::min(least_vertex_alpha_, vertices.colors[v].w);
    if (slot.texture != nullptr) {
      const Vec2 at = slot.transform.apply(vertices.texcoords[static_cast<std::size_t>(slot.texcoord)][v]);
      texcoord_low_ = first ? at : glm::min(texcoord_low_, at);
      texcoord_high_ = first ? at : glm::max(texcoord_high_, at);
    }
    first = false;
  };
  if (drawable_->drawable->kind == scene::Primitive::Kind::kBezierPatches) {
    const std::size_t base = std::size_t{16} * (patch - drawable_->drawable->first_patch);
    for (const std::size_t corner : {std::size_t{0}, std::size_t{3}, std::size_t{12}, std::size_t{15}})
      add(base + corner);
  } else {
    const scene::MeshClusters& clusters = frame_.assembly->clusters[drawable_->drawable->geometry];
    const scene::Cluster& cluster = clusters.clusters[patch - drawable_->drawable->first_patch];
    for (std::uint32_t v = cluster.first_vertex; v < cluster.first_vertex + cluster.vertex_count; ++v)
      add(clusters.vertices[v]);
  }
}

bool EffectSelector::moves(const SubPatchBody& body) const {
  if (!drawable_->moving) return false;
  return deforms_ || !stays_still(body, frame_.projection, static_cast<double>(scene::kStillPixels),
                                  static_cast<double>(scene::kStillDepth));
}

bool EffectSelector::may_fail_alpha(const SubPatchBounder& bounder) const {
  const scene::Material& material = *drawable_->material;
  if (drawable_->procedure != nullptr || !(least_vertex_alpha_ >= 0) || !(material.base_color.w >= 0)) return true;
  float least = material.base_color.w * least_vertex_alpha_;
  const scene::TextureSlot& slot = material.base_color_texture;
  if (slot.texture != nullptr && !slot.texture->opaque()) {
    const MinMaxPyramid* pyramid = pyramids_.alpha_of(*slot.texture);
    if (pyramid == nullptr) return true;
    Vec2 low = texcoord_low_, high = texcoord_high_;
    if (drawable_->drawable->kind == scene::Primitive::Kind::kBezierPatches) {
      // Coordinates are bilinear between the corners, as for displacement: the box of a range is the box of its
      // corners.
      const std::vector<Vec2>& texcoords =
          drawable_->primitive->vertices.texcoords[static_cast<std::size_t>(slot.texcoord)];
      const std::size_t first = std::size_t{16} * (patch_ - drawable_->drawable->first_patch);
      scene::PatchDisplacement coordinates;
      constexpr std::array<std::size_t, 4> kCorners = {0, 3, 12, 15};
      for (std::size_t c = 0; c < 4; ++c) coordinates.corner[c] = slot.transform.apply(texcoords[first + kCorners[c]]);
      const scene::PatchDisplacement::Footprint footprint = coordinates.footprint(bounder.range());
      low = footprint.low;
      high = footprint.high;
    }
    // Weights of a hit may round to a little outside of their triangle.
    const Vec2 slack = (glm::max(glm::abs(low), glm::abs(high)) + Vec2(1.0f)) * 0x1p-16f;
    least *= std::max(0.0f, pyramid->query_all(slot.sampler, low - slack, high + slack).low);
  }
  // Interpolated alphas and their products round; 2^-18 is 32 roundings.
  return !(least * (1.0f - 0x1p-18f) >= material.alpha_cutoff);
}

std::uint8_t EffectSelector::select(const SubPatchBounder& bounder, const SubPatchBody& body,
                                    const ScreenBounds& bounds) const {
  std::uint8_t effects = 0;
  if (moves(body)) effects |= kEffectMotion;
  if (frame_.projection.lens_scale != 0 &&
      !(certainly_projected(body, frame_.projection) &&
        stays_sharp(bounds, frame_.projection, static_cast<double>(scene::kSharpPixels))))
    effects |= kEffectDefocus;
  if (bounder.displaced() && !bounder.offsets_vanish()) effects |= kEffectDisplacement;
  if (drawable_->material->alpha_mode == scene::AlphaMode::kMask && may_fail_alpha(bounder))
    effects |= kEffectAlphaTest;
  if (drawable_->material->alpha_mode == scene::AlphaMode::kBlend) effects |= kEffectBlending;
  return effects;
}

}  // namespace tessera::frontend
