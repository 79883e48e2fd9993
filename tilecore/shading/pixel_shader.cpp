#include "tilecore/shading/pixel_shader.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "base/check.h"
#include "base/random.h"
#include "base/round_up.h"
#include "scene/drawable_lookup.h"
#include "tilecore/procedural/procedure_costs.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/lit_draws.h"
#include "tilecore/shading/pixel_shader_kernel.h"
#include "tilecore/shading/place_kernel.h"
#include "tilecore/shading/scalar_lanes.h"
#include "tilecore/shading/shader_features.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::Material;
using scene::TextureSlot;

Vec3 shown_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

Vec3 towards_viewer(const FrameGeometry& frame, const Surface& surface, float t) {
  one_lane::LaneInputs<float> in{};
  in.t = t;
  return shown_vector(
      one_lane::towards_viewer<float>(draw_constants(frame, *surface.drawable), in, one_lane_surface(surface)));
}

// Shades the point between the vertices `corner` of `vertices`; without `vertices`, the procedure's own point. Lookups belong to
// lane `lane`.
ShadedPoint shade_procedure_point(const FrameGeometry& shutter, const Lighting& lighting, const Invocation& invocation,
                                  const shaders::ShadowView* shadows, const VertexOutputs* vertices,
                                  const std::array<std::int32_t, 3>& corner, const LookupArrays& lookups,
                                  std::size_t lane) {
  const auto [frame, at] = in_segment(shutter, invocation.at);
  Surface surface;
  if (vertices == nullptr) {
    surface = evaluate_surface(frame, at);
  } else {
    surface.drawable = &frame.drawable_of(at.patch);
    fill_procedure_triangle(frame, at, *vertices, corner, surface);
  }
  return shade_procedure(frame, lighting, shadows, shutter.lights_at(invocation.light_time), at, surface,
                         towards_viewer(frame, surface, at.t), lookups, lane);
}

constexpr std::uint32_t kGradientLookups = 4;  // of heights in one level
constexpr std::uint32_t kFree = 0xFFFFFFFFu;   // no bucket
// Least transmittance of an attenuation colour over its distance; black would give infinities.
constexpr float kLeastTransmittance = 1e-6f;

// The segment of the shutter that the lights are in at time t.
int light_segment(const FrameGeometry& shutter, float t) {
  if (!shutter.moving_lights || shutter.segments.empty()) return 0;
  return shutter.segment_of(t);
}

// Sets the layers of a draw, for a material that has some.
void set_layers(const Material& material, const Mat4& to_world, const Lighting& lighting, DrawConstants& draw) {
  draw.layered = material.effects.any();
  if (!draw.layered) return;
  draw.layers = scene::flags_of(material.effects);
  draw.ior = material.dielectric.ior;
  const float q = (draw.ior - 1.0f) / (draw.ior + 1.0f);
  draw.reflectance = q * q;
  draw.anisotropy_cosine = std::cos(material.anisotropy.rotation);
  draw.anisotropy_sine = std::sin(material.anisotropy.rotation);
  draw.volume_scale = std::cbrt(std::abs(glm::determinant(Mat3(to_world))));
  const scene::Volume& volume = material.volume;
  for (int c = 0; c < 3; ++c)
    draw.layer_constants.absorption[c] =
        std::isfinite(volume.attenuation_distance)
            ? -std::log2(std::max(volume.attenuation_color[c], kLeastTransmittance)) / volume.attenuation_distance
            : 0.0f;
  draw.layer_constants.dispersion = material.dispersion.strength;
  if (!draw.layers.transmission || lighting.behind == nullptr) return;
  draw.behind = lighting.behind->view();
  draw.behind_u = 1.0f / static_cast<float>(lighting.behind->width());
  draw.behind_v = 1.0f / static_cast<float>(lighting.behind->height());
  draw.behind_levels = std::log2(static_cast<float>(lighting.behind->width()));
}

// A view of each light's shares, which begin at shares(light).
template <class Shares>
std::vector<shaders::ShadowView> views_of_shares(const KnownShadows& known, const Shares& shares) {
  std::vector<shaders::ShadowView> views(known.by_light.size());
  for (std::size_t light = 0; light < views.size(); ++light)
    if (!known.by_light[light].empty()) views[light].shares = shares(light);
  return views;
}

// Whether a drawable's pixels loop over the lights of a list: procedures shade with all of them.
bool takes_list(const scene::PosedDrawable& drawable) {
  return drawable.procedure == nullptr && !drawable.material->unlit;
}

}  // namespace

float light_time(const FrameGeometry& shutter, int segment, float t) {
  return segment == 0 ? t : shutter.segment(segment).part.local(t);
}

DrawConstants lit_draw(const FrameGeometry& shutter, const FrameGeometry& segment, int lights_in,
                       const scene::PosedDrawable& drawable, const Lighting& lighting,
                       const shaders::ShadowView* shadows, bool quads) {
  DrawConstants draw = draw_constants(segment, drawable);
  draw.quads = quads;
  const FrameGeometry& lit = shutter.segment(lights_in);
  draw.lights.open = lit.lights[0];
  if (shutter.moving_lights) draw.lights.close = lit.lights[1];
  draw.surroundings = lighting.environment.surroundings();
  set_layers(*draw.material, drawable.to_world[0], lighting, draw);
  if (shadows != nullptr && !draw.material->unlit) {
    draw.shadows = shadows;
    draw.shadow_times = lighting.shadows != nullptr ? lighting.shadows->times() : 1;
    draw.shadow_keys = lighting.shadows != nullptr;
  }
  return draw;
}

std::uint64_t light_bytes_of(const FrameGeometry& frame) { return kLightRecordBytes * (frame.moving_lights ? 2 : 1); }

bool looks_around(const Lighting& lighting, const Material& material) {
  return lighting.environment.surroundings().kind == shaders::Surroundings::Kind::kImage && !material.unlit;
}

std::uint32_t height_lookups(const scene::PosedDrawable& drawable) {
  if (!has_grid(drawable) || !drawable.material->displacement) return 0;
  return drawable.moving && drawable.deforming ? 16 : 8;
}

hardware::ShaderFeatures pixel_features(const FrameGeometry& frame, const scene::PosedDrawable& drawable, bool quads,
                                        bool evaluates) {
  hardware::ShaderFeatures features = draw_features(frame, drawable, quads, adds_height_normals(frame, drawable));
  using In = hardware::ShaderFeatures::Surface;
  if (!evaluates && features.surface != In::kComputed) features.surface = In::kTriangles;
  if (interpolates_surface(frame, drawable) && features.normals == hardware::ShaderFeatures::Normals::kMapped &&
      has_vertex_tangents(*drawable.material))
    features.normals = hardware::ShaderFeatures::Normals::kMappedAlongTangents;
  return features;
}

timing::WarpItem warp_item(const FrameGeometry& frame, const scene::PosedDrawable& drawable, const Lighting& lighting,
                           bool quads, bool evaluates, const std::span<const std::uint32_t>* listed) {
  evaluates = evaluates && has_grid(drawable) && !interpolates_surface(frame, drawable);
  hardware::ShaderFeatures features = pixel_features(frame, drawable, quads, evaluates);
  features.environment_image = looks_around(lighting, *drawable.material);
  if (listed != nullptr) keep_lights(frame, *listed, features);
  if (lighting.shadows != nullptr) add_shadows(*lighting.shadows, frame, listed, features);
  hardware::ShaderCost cost = hardware::shader_cost(features);
  if (drawable.procedure != nullptr)
    cost.vector_operations +=
        static_cast<std::int32_t>(surface_clocks(frame, drawable) + (evaluates ? geometry_clocks(drawable) : 0));
  timing::WarpItem item;
  item.kind = evaluates ? timing::WarpItem::kEvaluating : timing::WarpItem::kPixels;
  item.clocks = static_cast<std::uint32_t>(hardware::lane_clocks(cost));
  item.registers = static_cast<std::uint32_t>(cost.registers);
  item.drawable = static_cast<std::uint32_t>(&drawable - frame.drawables.data()) + 1;
  return item;
}

timing::WarpItem vertex_warp_item(const FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  const hardware::ShaderCost cost = output_cost(frame, drawable);
  timing::WarpItem item;
  item.kind = timing::WarpItem::kVertices;
  item.clocks = static_cast<std::uint32_t>(hardware::lane_clocks(cost));
  item.registers = static_cast<std::uint32_t>(cost.registers);
  item.drawable = static_cast<std::uint32_t>(&drawable - frame.drawables.data()) + 1;
  return item;
}

timing::WarpItem background_item(bool image, bool turning) {
  using Features = hardware::ShaderFeatures;
  Features features;
  features.stage = Features::Stage::kBackground;
  features.motion = turning ? Features::Motion::kMoving : Features::Motion::kStill;
  features.environment_image = image;
  const hardware::ShaderCost cost = hardware::shader_cost(features);
  timing::WarpItem item;
  item.kind = timing::WarpItem::kBackground;
  item.clocks = static_cast<std::uint32_t>(hardware::lane_clocks(cost));
  item.registers = static_cast<std::uint32_t>(cost.registers);
  return item;
}

Vec4 look_up(const shaders::Texture& texture, const shaders::Sampler& sampler, Vec2 uv, float lod,
             TextureUnit* textures) {
  if (textures == nullptr || !textures->active()) return texture.sample(sampler, uv, lod);
  shaders::TexelFootprint footprint;
  const Vec4 color = texture.sample(sampler, uv, lod, &footprint);
  textures->fetch(texture, footprint);
  return color;
}

ShadedPoint shade_point(const FrameGeometry& shutter, const Lighting& lighting, const Invocation& invocation) {
  const auto [frame, at] = in_segment(shutter, invocation.at);
  const scene::PosedDrawable& drawable = frame.drawable_of(at.patch);
  const bool interpolates = at.triangle != SurfaceLocation::kWholePatch && interpolates_surface(frame, drawable);
  VertexOutputs outputs;
  std::array<std::int32_t, 3> corner{};
  if (interpolates) {
    outputs.begin(frame, drawable);
    corner = outputs.triangle(at.patch, at.triangle);
  }
  std::vector<shaders::ShadowView> shares;
  const shaders::ShadowView* shadows = lighting.shadows != nullptr ? lighting.shadows->of(frame) : nullptr;
  if (lighting.known_shadows != nullptr) {
    const KnownShadows& known = *lighting.known_shadows;
    shares = views_of_shares(known, [&](std::size_t light) { return known.by_light[light].data(); });
    shadows = shares.data();
  }
  if (drawable.procedure != nullptr)
    return shade_procedure_point(shutter, lighting, invocation, shadows, interpolates ? &outputs : nullptr, corner,
                                 LookupArrays(), 0);
  const int lights_in = light_segment(shutter, invocation.light_time);
  DrawConstants draw = lit_draw(shutter, frame, lights_in, drawable, lighting, shadows, invocation.partner_x != 0);
  one_lane::LaneInputs<float> in = lane_inputs(frame, drawable, at);
  if (interpolates) {
    std::copy(corner.begin(), corner.end(), in.vertex);
    outputs.set_mesh(draw);
  }
  in.light_t = light_time(shutter, lights_in, invocation.light_time);
  in.step_x = static_cast<float>(invocation.partner_x), in.step_y = static_cast<float>(invocation.partner_y);
  const one_lane::LaneShaded<float> out = one_lane::shade_lanes<float>(draw, in, LookupArrays(), 0);
  return {shown_vector(out.color), out.alpha, shown_vector(out.normal)};
}

void PixelShader::shade(const FrameGeometry& shutter, const Lighting& lighting, std::span<const Invocation> invocations,
                        std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes,
                        const Vec3* axis) {
  TESSERA_CHECK(points.size() == invocations.size() && warp_lanes >= 4 && warp_lanes <= kBatch,
                "a point for each invocation, warps of 4 lanes up to a batch");
  if (textures != nullptr && !textures->active()) textures = nullptr;
  begin(shutter, invocations, axis, textures != nullptr, warp_lanes);
  for_each_draw(shutter, invocations, warp_lanes, [&](const Draw& draw) {
    shade_draw_of(shutter, lighting, invocations, draw, points, textures, warp_lanes);
  });
}

void PixelShader::begin(const FrameGeometry& shutter, std::span<const Invocation> invocations, const Vec3* axis,
                        bool heights, std::size_t warp_lanes) {
  sort_invocations(shutter, invocations);
  draws_.clear();
  for (std::size_t begin = 0, end = 0; begin < rank_.size(); begin = end) {
    const Bucket& leader = buckets_[rank_[begin]];
    std::size_t count = 0;
    for (; end < rank_.size() && buckets_[rank_[end]].draw == leader.draw; ++end) count += buckets_[rank_[end]].count;
    draws_.push_back({leader.first, count});
  }
  listed_ = false;
  if (axis != nullptr) list_lights(shutter, invocations, *axis, heights, warp_lanes);
}

std::uint32_t PixelShader::bucket_of(std::uint64_t draw, std::uint32_t patch) {
  if (2 * (buckets_.size() + 1) > table_.size()) {
    table_.assign(std::max<std::size_t>(256, 2 * table_.size()), kFree);
    for (std::uint32_t b = 0; b < buckets_.size(); ++b) {
      std::size_t at = hash32(buckets_[b].patch, static_cast<std::uint32_t>(buckets_[b].draw >> 32));
      while (table_[at % table_.size()] != kFree) ++at;
      table_[at % table_.size()] = b;
    }
  }
  for (std::size_t at = hash32(patch, static_cast<std::uint32_t>(draw >> 32));; ++at) {
    std::uint32_t& slot = table_[at % table_.size()];
    if (slot == kFree) {
      slot = static_cast<std::uint32_t>(buckets_.size());
      buckets_.push_back({draw, patch, 0, 0});
    }
    if (buckets_[slot].patch == patch && buckets_[slot].draw == draw) return slot;
  }
}

void PixelShader::sort_invocations(const FrameGeometry& shutter, std::span<const Invocation> invocations) {
  buckets_.clear();
  std::fill(table_.begin(), table_.end(), kFree);
  bucket_.resize(invocations.size());
  const bool parts = !shutter.segments.empty();
  scene::DrawableLookup drawable_of;
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < invocations.size(); ++i) {
    const Invocation& v = invocations[i];
    std::uint64_t draw = drawable_of(*shutter.assembly, v.at.patch);
    if (parts) {
      static_assert(kMaxMotionSegments < 1 << 12, "two segments fit beside a drawable's number");
      draw |= static_cast<std::uint64_t>(shutter.segment_at(v.at.patch, v.at.t)) << 52;
      draw |= static_cast<std::uint64_t>(light_segment(shutter, v.light_time)) << 40;
    }
    if (buckets_.empty() || buckets_[last].patch != v.at.patch || buckets_[last].draw != draw)
      last = bucket_of(draw, v.at.patch);
    ++buckets_[last].count;
    bucket_[i] = last;
  }
  rank_.resize(buckets_.size());
  std::iota(rank_.begin(), rank_.end(), 0u);
  std::sort(rank_.begin(), rank_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(buckets_[a].draw, buckets_[a].patch) < std::tie(buckets_[b].draw, buckets_[b].patch);
  });
  std::uint32_t first = 0;
  for (const std::uint32_t b : rank_) buckets_[b].first = std::exchange(first, first + buckets_[b].count);
  order_.resize(invocations.size());
  for (std::size_t i = 0; i < invocations.size(); ++i)
    order_[buckets_[bucket_[i]].first++] = static_cast<std::uint32_t>(i);
  for (Bucket& b : buckets_) b.first -= b.count;
}

void PixelShader::cut_warps(std::span<const Invocation> invocations, std::span<std::uint32_t> order, bool quads,
                            std::size_t warp_lanes) {
  warp_ends_.clear();
  if (quads) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return invocations[a].quad < invocations[b].quad; });
    std::size_t seen = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool opens = i == 0 || invocations[order[i]].quad != invocations[order[i - 1]].quad;
      if (opens && seen == warp_lanes / 4) warp_ends_.push_back(i), seen = 0;
      seen += opens ? 1 : 0;
    }
  } else {
    for (std::size_t i = warp_lanes; i < order.size(); i += warp_lanes) warp_ends_.push_back(i);
  }
  warp_ends_.push_back(order.size());
}

PixelShader::Draw PixelShader::draw_of(const FrameGeometry& shutter, std::span<const Invocation> invocations,
                                       std::span<std::uint32_t> order, std::size_t number, std::size_t warp_lanes) {
  const Invocation& leader = invocations[order.front()];
  const FrameGeometry& frame = shutter.moment(leader.at.patch, leader.at.t).frame;
  const scene::PosedDrawable& drawable = frame.drawable_of(leader.at.patch);
  const bool quads = leader.partner_x != 0;
  cut_warps(invocations, order, quads, warp_lanes);
  // The reference renderer asks for places of a patch that are of no triangle, for all of a draw.
  const bool interpolates = interpolates_surface(frame, drawable) && leader.at.triangle != SurfaceLocation::kWholePatch;
  while (draw_vertices_.size() <= number) draw_vertices_.emplace_back();
  return {
      frame, drawable, light_segment(shutter, leader.light_time), quads, interpolates, order, draw_vertices_[number]};
}

std::uint32_t PixelShader::count_surface(const Draw& of, bool textured) {
  const bool evaluates = has_grid(of.drawable) && !of.interpolates;
  warps_ += warp_ends_.size();
  if (evaluates) surface_work_.warps += warp_ends_.size(), surface_work_.evaluations += of.order.size();
  const bool turned = of.interpolates && adds_height_normals(of.frame, of.drawable);
  const std::uint32_t heights = !textured ? 0 : evaluates ? height_lookups(of.drawable) : turned ? kGradientLookups : 0;
  surface_work_.height_lookups += of.order.size() * heights;
  return heights;
}

void PixelShader::shade_draw_of(const FrameGeometry& shutter, const Lighting& lighting,
                                std::span<const Invocation> invocations, const Draw& of, std::span<ShadedPoint> points,
                                TextureUnit* textures, std::size_t warp_lanes) {
  const FrameGeometry& frame = of.frame;
  const scene::PosedDrawable& drawable = of.drawable;
  const int lights_in = of.lights_in;
  const bool quads = of.quads, interpolates = of.interpolates;
  const std::span<std::uint32_t> order = of.order;
  const std::uint32_t heights = count_surface(of, textures != nullptr);
  const bool listed = listed_ && takes_list(drawable);
  const std::span<const std::uint32_t> numbers = light_list_.numbers();
  timing::WarpItem item =
      keep_warps_ ? warp_item(frame, drawable, lighting, quads, true, listed ? &numbers : nullptr) : timing::WarpItem();
  item.texels = heights;  // of a lane
  if (listed) light_counters_.tile_bytes += warp_ends_.size() * numbers.size() * light_bytes_of(shutter);
  if (interpolates && !listed) take_vertices(invocations, of, textures != nullptr, warp_lanes);
  const shaders::ShadowView* shadows = shadows_of(lighting, frame);
  if (drawable.procedure != nullptr) {
    LookupArrays lookups;
    if (textures != nullptr && looks_around(lighting, *drawable.material))
      tell(slot_of(ImageLookup::kMirrored),
           textures->memory()->layout(lighting.environment.surroundings().image->radiance), lookups);
    if (textures != nullptr) tell_procedure_textures(*drawable.material, *textures, lookups);
    if (textures != nullptr && lighting.shadows != nullptr && !drawable.material->unlit)
      tell_shadows(lighting.shadows->of(frame), *lighting.shadows, false, *textures, lookups);
    shade_batches(order.size(), item, lookups, textures, [&](std::size_t first, std::size_t count) {
      // Not every model of shading looks anything up.
      for (std::size_t slot = 0; slot < kLookupSlots; ++slot)
        if (lookups.layout[slot] != nullptr)
          for (auto& lines : lines_[slot]) std::fill_n(lines.begin(), count, -1);
      forget_shadows(lookups, count);
      if (lighting.known_shadows != nullptr) take_shares(*lighting.known_shadows, order.subspan(first, count));
      for (std::size_t lane = 0; lane < count; ++lane) {
        const std::uint32_t i = order[first + lane];
        const std::array<std::int32_t, 3> corner =
            interpolates ? of.vertices.corners[first + lane] : std::array<std::int32_t, 3>{};
        points[i] = shade_procedure_point(shutter, lighting, invocations[i], shadows,
                                          interpolates ? &of.vertices.outputs : nullptr, corner, lookups, lane);
      }
    });
    return;
  }

  DrawConstants draw = lit_draw(shutter, frame, lights_in, drawable, lighting, shadows, quads);
  if (interpolates) of.vertices.outputs.set_mesh(draw);
  if (listed) take_listed(draw);
  const LaneArrays in = lane_arrays();
  ShadedArrays out;
  for (std::size_t c = 0; c < 3; ++c) out.color[c] = output_[c].data(), out.normal[c] = output_[3 + c].data();
  out.alpha = output_[6].data();
  LookupArrays lookups;
  if (textures != nullptr)
    tell_material(draw, *textures, lookups), tell_light(draw, lighting, listed, *textures, lookups);
  shade_batches(order.size(), item, lookups, textures, [&](std::size_t first, std::size_t count) {
    fill_lanes(shutter, invocations, of, first, count);
    forget_shadows(lookups, count);
    if (lighting.known_shadows != nullptr) take_shares(*lighting.known_shadows, order.subspan(first, count));
    shade_draw(draw, in, count, lookups, out);
    for (std::size_t lane = 0; lane < count; ++lane) {
      ShadedPoint& point = points[order[first + lane]];
      point.color = {output_[0][lane], output_[1][lane], output_[2][lane]};
      point.normal = {output_[3][lane], output_[4][lane], output_[5][lane]};
      point.alpha = output_[6][lane];
    }
  });
}

LaneArrays PixelShader::lane_arrays() const {
  LaneArrays in;
  for (std::size_t k = 0; k < 3; ++k) in.vertex[k] = vertex_[k].data();
  in.triangle = vertex_[3].data();
  in.p = input_[0].data(), in.q = input_[1].data(), in.t = input_[2].data(), in.light_t = input_[3].data();
  in.lod = input_[4].data(), in.step_x = input_[5].data(), in.step_y = input_[6].data();
  return in;
}

void PixelShader::fill_lanes(const FrameGeometry& shutter, std::span<const Invocation> invocations, const Draw& of,
                             std::size_t first, std::size_t count) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    const Invocation& v = invocations[of.order[first + lane]];
    SurfaceLocation at = v.at;
    if (&of.frame != &shutter) at.t = of.frame.part.local(at.t);
    one_lane::LaneInputs<float> at_lane{};
    if (of.interpolates)
      at_lane.p = at.b1, at_lane.q = at.b2;
    else
      at_lane = lane_inputs(of.frame, of.drawable, at);
    for (std::size_t k = 0; k < 3; ++k)
      vertex_[k][lane] = of.interpolates ? of.vertices.corners[first + lane][k] : at_lane.vertex[k];
    vertex_[3][lane] = at_lane.triangle;
    input_[0][lane] = at_lane.p, input_[1][lane] = at_lane.q, input_[2][lane] = at.t;
    input_[3][lane] = light_time(shutter, of.lights_in, v.light_time);
    input_[4][lane] = at_lane.lod;
    input_[5][lane] = static_cast<float>(v.partner_x), input_[6][lane] = static_cast<float>(v.partner_y);
  }
  // Lanes up to the next multiple of the widest vector.
  for (std::size_t lane = count; lane % 16 != 0; ++lane) {
    for (auto& values : vertex_) values[lane] = values[count - 1];
    for (auto& values : input_) values[lane] = values[count - 1];
  }
}

void PixelShader::add_places(const FrameGeometry& shutter, std::span<const Invocation> invocations, const Draw& of) {
  DrawConstants draw = draw_constants(of.frame, of.drawable);
  draw.quads = of.quads;
  if (of.interpolates) of.vertices.outputs.set_mesh(draw);
  const std::array<float*, 3> place{output_[0].data(), output_[1].data(), output_[2].data()};
  for (std::size_t first = 0; first < of.order.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, of.order.size() - first);
    fill_lanes(shutter, invocations, of, first, count);
    place_draw(draw, lane_arrays(), count, place);
    for (std::size_t lane = 0; lane < count; ++lane)
      light_list_.add({output_[0][lane], output_[1][lane], output_[2][lane]});
  }
  // If invocations evaluate their patch again, so do the warps of places.
  timing::WarpItem item = place_warp(of.drawable.moving);
  item.drawable = static_cast<std::uint32_t>(&of.drawable - of.frame.drawables.data()) + 1;
  if (has_grid(of.drawable) && !of.interpolates)
    item.clocks += static_cast<std::uint32_t>(hardware::lane_clocks(place_cost(of.drawable)));
  light_counters_.tile_bytes += of.order.size() * 3 * sizeof(Vec3) * (of.drawable.moving ? 2 : 1);
  keep_light_warps(item, of.order.size(), warp_ends_.size());
}

void PixelShader::keep_light_warps(timing::WarpItem item, std::uint64_t lanes, std::size_t warps) {
  light_counters_.warps += warps;
  if (!keep_warps_) return;
  for (std::size_t w = 0; w < warps; ++w) {
    item.lanes = static_cast<std::uint32_t>(lanes * (w + 1) / warps - lanes * w / warps);
    warp_items_.push_back(item);
  }
}

void PixelShader::list_lights(const FrameGeometry& shutter, std::span<const Invocation> invocations, const Vec3& axis,
                              bool heights, std::size_t warp_lanes) {
  light_list_.begin(axis);
  // Vertices of all draws come first, then places between them.
  for (const bool places : {false, true})
    for (std::size_t d = 0; d < draws_.size(); ++d) {
      const Draw draw =
          draw_of(shutter, invocations, std::span(order_).subspan(draws_[d].first, draws_[d].count), d, warp_lanes);
      if (!takes_list(draw.drawable)) continue;
      if (places)
        add_places(shutter, invocations, draw);
      else if (draw.interpolates)
        take_vertices(invocations, draw, heights, warp_lanes);
    }
  if (light_list_.places() == 0) return;
  listed_ = true;
  light_list_.find(shutter);
  const std::size_t lights = shutter.lights[0].size(), listed = light_list_.numbers().size();
  ++light_counters_.lists;
  light_counters_.places += light_list_.places();
  light_counters_.tests += lights;
  light_counters_.listed += listed;
  light_counters_.tile_bytes += listed * light_bytes_of(shutter);
  surface_work_.vertex_bytes += listed * light_bytes_of(shutter);
  keep_light_warps(light_test_warp(), lights, (lights + warp_lanes - 1) / warp_lanes);
}

void PixelShader::take_listed(DrawConstants& draw) {
  listed_open_.clear(), listed_close_.clear(), listed_views_.clear();
  const auto times = static_cast<std::size_t>(draw.shadow_times);
  for (const std::uint32_t number : light_list_.numbers()) {
    listed_open_.push_back(draw.lights.open[number]);
    if (!draw.lights.close.empty()) listed_close_.push_back(draw.lights.close[number]);
    if (draw.shadows == nullptr) continue;
    const shaders::ShadowView* views = draw.shadows + number * times;
    listed_views_.insert(listed_views_.end(), views, views + times);
  }
  draw.lights.open = listed_open_, draw.lights.close = listed_close_;
  if (draw.shadows != nullptr) draw.shadows = listed_views_.data();
}

void PixelShader::take_vertices(std::span<const Invocation> invocations, const Draw& of, bool heights,
                                std::size_t warp_lanes) {
  const FrameGeometry& frame = of.frame;
  const scene::PosedDrawable& drawable = of.drawable;
  const std::span<const std::uint32_t> order = of.order;
  DrawVertices& made = of.vertices;
  made.outputs.begin(frame, drawable);
  made.corners.clear();
  for (const std::uint32_t i : order)
    made.corners.push_back(made.outputs.triangle(invocations[i].at.patch, invocations[i].at.triangle));
  const std::uint64_t vertices = made.outputs.count(), bytes = vertex_output_bytes(frame, drawable);
  surface_work_.vertices += vertices;
  surface_work_.vertex_warps += (vertices + warp_lanes - 1) / warp_lanes;
  surface_work_.vertex_bytes += vertices * bytes;
  surface_work_.vertex_bytes_moved += (vertices + 3 * order.size()) * bytes;
  const std::uint32_t lookups = heights ? height_lookups(drawable) : 0;
  surface_work_.height_lookups += vertices * lookups;
  if (!keep_warps_) return;
  timing::WarpItem item = vertex_warp_item(frame, drawable);
  for (std::uint64_t left = vertices; left > 0; left -= item.lanes) {
    item.lanes = static_cast<std::uint32_t>(std::min<std::uint64_t>(left, warp_lanes));
    item.texels = item.lanes * lookups;
    warp_items_.push_back(item);
  }
}

void PixelShader::tell(std::size_t slot, const TextureLayoutView& layout, LookupArrays& lookups) {
  lookups.layout[slot] = &layout;
  for (std::size_t line = 0; line < kLookupLines; ++line) lookups.line[slot][line] = lines_[slot][line].data();
}

const shaders::ShadowView* PixelShader::shadows_of(const Lighting& lighting, const FrameGeometry& segment) {
  if (lighting.known_shadows == nullptr) return lighting.shadows != nullptr ? lighting.shadows->of(segment) : nullptr;
  shares_.resize(lighting.known_shadows->by_light.size());
  share_views_ = views_of_shares(*lighting.known_shadows, [&](std::size_t light) { return shares_[light].data(); });
  return share_views_.data();
}

void PixelShader::take_shares(const KnownShadows& known, std::span<const std::uint32_t> invocations) {
  for (std::size_t light = 0; light < known.by_light.size(); ++light) {
    const std::vector<float>& from = known.by_light[light];
    if (from.empty()) continue;
    std::array<float, kBatch>& to = shares_[light];
    for (std::size_t lane = 0; lane < invocations.size(); ++lane) to[lane] = from[invocations[lane]];
    std::fill(to.begin() + static_cast<std::ptrdiff_t>(invocations.size()),
              to.begin() + static_cast<std::ptrdiff_t>(round_up(invocations.size(), std::size_t{16})), 1.0f);
  }
}

void PixelShader::tell_shadows(const shaders::ShadowView* views, const FrameShadows& shadows, bool listed,
                               const TextureUnit& textures, LookupArrays& lookups) {
  const std::size_t count = listed ? listed_views_.size() : shadows.views(),
                    times = static_cast<std::size_t>(shadows.times());
  shadow_lines_.resize(std::max(shadow_lines_.size(), count));
  shadow_lookups_.assign(count, {});
  for (std::size_t k = 0; k < count; ++k) {
    if (!views[k].casts()) continue;
    ShadowLookups& told = shadow_lookups_[k];
    const std::size_t of_frame = listed ? light_list_.numbers()[k / times] * times + k % times : k;
    told.layout = &textures.memory()->layout(*shadows.maps(of_frame));
    told.texels = views[k].filter == shaders::ShadowFilter::k3x3 ? 4 : 1;
    for (std::size_t line = 0; line < kShadowLines; ++line) told.line[line] = shadow_lines_[k][line].data();
  }
  lookups.shadows = shadow_lookups_;
}

void PixelShader::forget_shadows(const LookupArrays& lookups, std::size_t count) {
  for (const ShadowLookups& told : lookups.shadows)
    if (told.layout != nullptr)
      for (std::int32_t* lines : told.line) std::fill_n(lines, round_up(count, std::size_t{16}), -1);
}

void PixelShader::tell_procedure_textures(const Material& material, const TextureUnit& textures,
                                          LookupArrays& lookups) {
  using Which = scene::MaterialTexture;
  const auto slots = material.slots();
  for (const Which which :
       {Which::kBaseColor, Which::kNormal, Which::kMetallicRoughness, Which::kOcclusion, Which::kEmissive}) {
    const auto slot = static_cast<std::size_t>(which);
    if (slots[slot]->texture != nullptr) tell(slot, textures.memory()->layout(slots[slot]->texture.get()), lookups);
  }
}

void PixelShader::tell_material(const DrawConstants& draw, const TextureUnit& textures, LookupArrays& lookups) {
  const auto slots = draw.material->slots();
  for (std::size_t slot = 0; slot < kTextureSlots; ++slot)
    if (slots[slot]->texture != nullptr && scene::is_read(*draw.material, static_cast<scene::MaterialTexture>(slot)))
      tell(slot, textures.memory()->layout(slots[slot]->texture.get()), lookups);
}

void PixelShader::tell_light(const DrawConstants& draw, const Lighting& lighting, bool listed,
                             const TextureUnit& textures, LookupArrays& lookups) {
  const auto tell_behind = [&](const shaders::RadianceView& image) {
    for (std::size_t color = 0; color < (draw.layers.dispersion ? 3u : 1u); ++color)
      tell(slot_of(ImageLookup::kBehind) + color, textures.memory()->layout(image), lookups);
  };
  if (draw.behind.levels > 0) tell_behind(draw.behind);
  if (draw.shadows != nullptr && lighting.shadows != nullptr)
    tell_shadows(draw.shadows, *lighting.shadows, listed, textures, lookups);
  if (!looks_around(lighting, *draw.material)) return;
  const shaders::RadianceView& around = draw.surroundings.image->radiance;
  tell(slot_of(ImageLookup::kMirrored), textures.memory()->layout(around), lookups);
  if (draw.layers.clearcoat) tell(slot_of(ImageLookup::kCoat), textures.memory()->layout(around), lookups);
  if (draw.layers.transmission && draw.behind.levels == 0) tell_behind(around);
}

void PixelShader::finish_warps(std::size_t first_warp, std::size_t end, std::size_t first,
                               const timing::WarpItem& of_draw, const LookupArrays& lookups, TextureUnit* textures) {
  for (std::size_t w = first_warp, begin = first; w < end; begin = warp_ends_[w++]) {
    const std::size_t lines = textures != nullptr ? textures->request_count() : 0;
    const std::uint64_t texels = textures != nullptr ? textures->counters().texels : 0;
    if (textures != nullptr)
      for (std::size_t slot = 0; slot < kLookupSlots; ++slot)
        if (lookups.layout[slot] != nullptr)
          textures->fetch_warp(*lookups.layout[slot], lookups.line[slot], begin - first, warp_ends_[w] - begin);
    for (const ShadowLookups& told : lookups.shadows)
      if (told.layout != nullptr)
        textures->fetch_depths(*told.layout, told.line, begin - first, warp_ends_[w] - begin, told.texels);
    if (!keep_warps_) continue;
    timing::WarpItem& item = warp_items_.emplace_back(of_draw);
    item.lanes = static_cast<std::uint32_t>(warp_ends_[w] - begin);
    if (textures == nullptr) continue;
    item.texels = item.lanes * of_draw.texels + static_cast<std::uint32_t>(textures->counters().texels - texels);
    item.texel_lines = static_cast<std::uint32_t>(textures->request_count() - lines);
  }
}

std::uint64_t PixelShader::pack_background(std::size_t count, const timing::WarpItem& item, const LookupArrays& lookups,
                                           TextureUnit& textures, std::size_t warp_lanes) {
  constexpr std::size_t kSlot = slot_of(ImageLookup::kMirrored);
  std::uint64_t warps = 0;
  for (std::size_t first = 0; first < count; first += warp_lanes, ++warps) {
    const std::size_t lines = textures.request_count(), lanes = std::min(warp_lanes, count - first);
    const std::uint64_t texels = textures.counters().texels;
    if (lookups.layout[kSlot] != nullptr)
      textures.fetch_warp(*lookups.layout[kSlot], lookups.line[kSlot], first, lanes);
    if (!keep_warps_) continue;
    timing::WarpItem& warp = warp_items_.emplace_back(item);
    warp.lanes = static_cast<std::uint32_t>(lanes);
    warp.texels = static_cast<std::uint32_t>(textures.counters().texels - texels);
    warp.texel_lines = static_cast<std::uint32_t>(textures.request_count() - lines);
  }
  return warps;
}

}  // namespace tessera::tilecore
