#include "tilecore/shading/pixel_shader.h"

#include <algorithm>
#include <tuple>

#include "base/check.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/pixel_shader_kernel.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::Material;
using scene::TextureSlot;

Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

// Filtered colour of a texture; `textures`, unless null, fetches what that takes.
Vec4 look_up(const shaders::Texture& texture, const shaders::Sampler& sampler, Vec2 uv, float lod,
             TextureUnit* textures) {
  if (textures == nullptr || !textures->active()) return texture.sample(sampler, uv, lod);
  shaders::TexelFootprint footprint;
  const Vec4 color = texture.sample(sampler, uv, lod, &footprint);
  textures->fetch(texture, footprint);
  return color;
}

Vec3 towards_viewer(const FrameGeometry& frame, const Surface& surface, float t) {
  one_lane::LaneInputs<float> in{};
  in.t = t;
  return glm_vector(
      one_lane::towards_viewer<float>(draw_constants(frame, *surface.drawable), in, one_lane_surface(surface)));
}

ShadedPoint shade_procedure_point(const FrameGeometry& frame, const Lighting& lighting, const shaders::Lights& lights,
                                  const SurfaceLocation& at) {
  const Surface surface = evaluate_surface(frame, at);
  return shade_procedure(frame, lighting, lights, at, surface, towards_viewer(frame, surface, at.t));
}

// Which segment of the shutter the lights are in at time t.
int light_segment(const FrameGeometry& shutter, float t) {
  if (!shutter.moving_lights || shutter.segments.empty()) return 0;
  return 1 + part_of_time(t, static_cast<int>(shutter.segments.size()));
}
// Time within it.
float light_time(const FrameGeometry& shutter, int segment, float t) {
  return segment == 0 ? t : shutter.segment(segment).part.local(t);
}

DrawConstants lit_draw(const FrameGeometry& shutter, const FrameGeometry& segment, int lights_in,
                       const scene::PosedDrawable& drawable, const Lighting& lighting, bool quads) {
  DrawConstants draw = draw_constants(segment, drawable);
  draw.quads = quads;
  const FrameGeometry& lit = shutter.segment(lights_in);
  draw.lights.open = lit.lights[0];
  if (shutter.moving_lights) draw.lights.close = lit.lights[1];
  draw.environment = lighting.environment.intensity();
  return draw;
}

}  // namespace

ShadedPoint shade_point(const FrameGeometry& shutter, const Lighting& lighting, const Invocation& invocation) {
  const auto [frame, at] = in_segment(shutter, invocation.at);
  const scene::PosedDrawable& drawable = frame.drawable_of(at.patch);
  if (drawable.procedure != nullptr)
    return shade_procedure_point(frame, lighting, shutter.lights_at(invocation.light_time), at);
  const int lights_in = light_segment(shutter, invocation.light_time);
  const DrawConstants draw = lit_draw(shutter, frame, lights_in, drawable, lighting, invocation.partner_x != 0);
  one_lane::LaneInputs<float> in = lane_inputs(frame, drawable, at);
  in.light_t = light_time(shutter, lights_in, invocation.light_time);
  in.step_x = static_cast<float>(invocation.partner_x), in.step_y = static_cast<float>(invocation.partner_y);
  const one_lane::LaneShaded<float> out = one_lane::shade_lanes<float>(draw, in, LookupArrays(), 0);
  return {glm_vector(out.color), out.alpha, glm_vector(out.normal)};
}

void PixelShader::shade(const FrameGeometry& shutter, const Lighting& lighting, std::span<const Invocation> invocations,
                        std::span<ShadedPoint> points, TextureUnit* textures, std::size_t warp_lanes) {
  TESSERA_CHECK(points.size() == invocations.size() && warp_lanes >= 4 && warp_lanes <= kBatch,
                "a point for each invocation, warps of 4 lanes up to a batch");
  if (textures != nullptr && !textures->active()) textures = nullptr;
  runs_.clear();
  for (std::uint32_t i = 0; i < invocations.size(); ++i) {
    const Invocation& v = invocations[i];
    const auto segment = static_cast<std::uint64_t>(shutter.segment_at(v.at.patch, v.at.t)),
               lights = static_cast<std::uint64_t>(light_segment(shutter, v.light_time));
    const std::uint64_t draw = segment << 48 | lights << 40 | shutter.assembly->patch_drawable[v.at.patch];
    if (!runs_.empty() && runs_.back().draw == draw && runs_.back().patch == v.at.patch)
      ++runs_.back().count;
    else
      runs_.push_back({draw, v.at.patch, i, 1});
  }
  std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) {
    return std::tie(a.draw, a.patch, a.first) < std::tie(b.draw, b.patch, b.first);
  });
  for (std::size_t begin = 0, end = 0; begin < runs_.size(); begin = end) {
    order_.clear();
    for (; end < runs_.size() && runs_[end].draw == runs_[begin].draw; ++end)
      for (std::uint32_t k = 0; k < runs_[end].count; ++k) order_.push_back(runs_[end].first + k);
    shade_draw_of(shutter, lighting, invocations, points, textures, warp_lanes);
  }
}

// All of order_, which are of one draw.
void PixelShader::shade_draw_of(const FrameGeometry& shutter, const Lighting& lighting,
                                std::span<const Invocation> invocations, std::span<ShadedPoint> points,
                                TextureUnit* textures, std::size_t warp_lanes) {
  const Invocation& leader = invocations[order_.front()];
  const FrameGeometry& frame = shutter.moment(leader.at.patch, leader.at.t).frame;
  const scene::PosedDrawable& drawable = frame.drawable_of(leader.at.patch);
  const int lights_in = light_segment(shutter, leader.light_time);
  const bool quads = leader.partner_x != 0;
  // Where each warp ends.
  warp_ends_.clear();
  if (quads) {
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return invocations[a].quad < invocations[b].quad; });
    std::size_t seen = 0;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const bool opens = i == 0 || invocations[order_[i]].quad != invocations[order_[i - 1]].quad;
      if (opens && seen == warp_lanes / 4) warp_ends_.push_back(i), seen = 0;
      seen += opens ? 1 : 0;
    }
  } else {
    for (std::size_t i = warp_lanes; i < order_.size(); i += warp_lanes) warp_ends_.push_back(i);
  }
  warp_ends_.push_back(order_.size());
  warps_ += warp_ends_.size();
  if (drawable.procedure != nullptr) {
    for (const std::uint32_t i : order_) points[i] = shade_point(shutter, lighting, invocations[i]);
    return;
  }

  const DrawConstants draw = lit_draw(shutter, frame, lights_in, drawable, lighting, quads);
  LaneArrays in;
  for (std::size_t k = 0; k < 3; ++k) in.vertex[k] = vertex_[k].data();
  in.p = input_[0].data(), in.q = input_[1].data(), in.t = input_[2].data(), in.light_t = input_[3].data();
  in.lod = input_[4].data(), in.step_x = input_[5].data(), in.step_y = input_[6].data();
  ShadedArrays out;
  for (std::size_t c = 0; c < 3; ++c) out.color[c] = output_[c].data(), out.normal[c] = output_[3 + c].data();
  out.alpha = output_[6].data();
  LookupArrays lookups;
  if (textures != nullptr) {
    const auto slots = draw.material->slots();
    for (std::size_t slot = 0; slot < kTextureSlots; ++slot) {
      if (slots[slot]->texture == nullptr ||
          !one_lane::is_read(*draw.material, static_cast<scene::MaterialTexture>(slot)))
        continue;
      lookups.layout[slot] = &textures->memory()->layout(slots[slot]->texture.get());
      for (std::size_t line = 0; line < kLookupLines; ++line) lookups.line[slot][line] = lines_[slot][line].data();
    }
  }
  std::size_t warp = 0;
  for (std::size_t first = 0; first < order_.size();) {
    const std::size_t first_warp = warp;
    while (warp < warp_ends_.size() && warp_ends_[warp] - first <= kBatch) ++warp;
    const std::size_t count = warp_ends_[warp - 1] - first;
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Invocation& v = invocations[order_[first + lane]];
      const float t = &frame == &shutter ? v.at.t : frame.part.local(v.at.t);
      load_lane(frame, drawable, v, t, light_time(shutter, lights_in, v.light_time), lane);
    }
    // Lanes up to the next multiple of the widest vector.
    for (std::size_t lane = count; lane % 16 != 0; ++lane) {
      for (auto& values : vertex_) values[lane] = values[count - 1];
      for (auto& values : input_) values[lane] = values[count - 1];
    }
    shade_draw(draw, in, count, lookups, out);
    for (std::size_t lane = 0; lane < count; ++lane) {
      ShadedPoint& point = points[order_[first + lane]];
      point.color = {output_[0][lane], output_[1][lane], output_[2][lane]};
      point.normal = {output_[3][lane], output_[4][lane], output_[5][lane]};
      point.alpha = output_[6][lane];
    }
    if (textures != nullptr)
      for (std::size_t w = first_warp, begin = 0; w < warp; begin = warp_ends_[w++] - first)
        for (std::size_t slot = 0; slot < kTextureSlots; ++slot)
          if (lookups.layout[slot] != nullptr)
            textures->fetch_warp(lookups.line[slot], begin, warp_ends_[w] - first - begin);
    first += count;
  }
}

void PixelShader::load_lane(const FrameGeometry& frame, const scene::PosedDrawable& drawable, const Invocation& v,
                            float t, float light_t, std::size_t lane) {
  SurfaceLocation at = v.at;
  at.t = t;
  const one_lane::LaneInputs<float> in = lane_inputs(frame, drawable, at);
  for (std::size_t k = 0; k < 3; ++k) vertex_[k][lane] = in.vertex[k];
  const std::array<float, 7> values = {
      in.p, in.q, t, light_t, in.lod, static_cast<float>(v.partner_x), static_cast<float>(v.partner_y)};
  for (std::size_t k = 0; k < values.size(); ++k) input_[k][lane] = values[k];
}

float point_alpha(const FrameGeometry& shutter, const SurfaceLocation& seen, TextureUnit* textures) {
  const auto [frame, at] = in_segment(shutter, seen);
  const scene::PosedDrawable& drawable = frame.drawable_of(at.patch);
  const Material& material = *drawable.material;
  float alpha = material.base_color.w;
  if (!drawable.primitive->vertices.colors.empty()) alpha *= surface_alpha(frame, at);
  const TextureSlot& slot = material.base_color_texture;
  if (slot.texture != nullptr && !slot.texture->opaque()) {
    const one_lane::LaneTexcoord<float> uv = alpha_texcoord(frame, drawable, at, slot);
    alpha *= look_up(*slot.texture, slot.sampler, {uv.u, uv.v},
                     one_lane::level_of_detail<float>(slot.texture->view(), uv), textures)
                 .w;
  }
  return alpha;
}

}  // namespace tessera::tilecore
