#include "tilecore/shading/pixel_shader.h"

#include <algorithm>
#include <cmath>

#include "shaders_cpp/metallic_roughness.h"
#include "tilecore/procedural/procedure_surface.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::Material;
using scene::TextureSlot;

// Filtered colour of a texture; `textures`, unless null, fetches what that takes.
Vec4 look_up(const shaders::Texture& texture, const shaders::Sampler& sampler, Vec2 uv, float lod,
             TextureUnit* textures) {
  if (textures == nullptr || !textures->active()) return texture.sample(sampler, uv, lod);
  shaders::TexelFootprint footprint;
  const Vec4 color = texture.sample(sampler, uv, lod, &footprint);
  textures->fetch(texture, footprint);
  return color;
}

// Texels per pixel along the longer axis of the footprint, as a level of detail.
float level_of_detail(const shaders::Texture& texture, const Surface::Texcoord& uv) {
  const Vec2 size(static_cast<float>(texture.width()), static_cast<float>(texture.height()));
  const Vec2 dx = uv.by_x * size, dy = uv.by_y * size;
  const float footprint2 = std::max(glm::dot(dx, dx), glm::dot(dy, dy));
  return footprint2 > 0.0f && std::isfinite(footprint2) ? 0.5f * std::log2(footprint2) : 0.0f;
}

// Filtered texture value at a surface point, white where the slot is empty.
Vec4 sample_slot(const TextureSlot& slot, const Surface& surface, TextureUnit* textures) {
  if (slot.texture == nullptr) return Vec4(1.0f);
  const Surface::Texcoord uv = surface.texcoord(slot.texcoord, slot.transform);
  return look_up(*slot.texture, slot.sampler, uv.value, level_of_detail(*slot.texture, uv), textures);
}

// Tangent frame of a texture coordinate set: the TANGENT attribute where the mesh has it, else from the coordinate's
// derivatives. False where there is none.
bool tangent_frame(const Surface& s, const TextureSlot& slot, float t, Vec3& tangent, Vec3& bitangent) {
  const auto& drawable = *s.drawable;
  if (!drawable.tangents[0].empty() && drawable.drawable->kind == scene::Primitive::Kind::kTriangles) {
    Vec3 sum(0.0f);
    float handedness = 1.0f;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec4 &open = drawable.tangents[0][s.vertex[k]], &close = drawable.tangents[1][s.vertex[k]];
      sum += (Mat3(drawable.to_world[0]) * Vec3(open) * (1.0f - t) + Mat3(drawable.to_world[1]) * Vec3(close) * t) *
             s.weight[k];
      handedness = open.w;
    }
    tangent = sum - s.normal * glm::dot(s.normal, sum);
    if (!(glm::dot(tangent, tangent) > 1e-20f)) return false;
    tangent = glm::normalize(tangent);
    bitangent = glm::cross(s.normal, tangent) * (drawable.mirrored ? -handedness : handedness);
    return true;
  }
  const Surface::Texcoord uv = s.texcoord(slot.texcoord, slot.transform);
  const float det = uv.by_p.x * uv.by_q.y - uv.by_p.y * uv.by_q.x;
  if (!(std::abs(det) > 0.0f)) return false;
  // Unnormalised directions of growing u and v; dividing by det only matters for its sign.
  const float sign = det > 0.0f ? 1.0f : -1.0f;
  Vec3 along_u = (s.position_p * uv.by_q.y - s.position_q * uv.by_p.y) * sign;
  Vec3 along_v = (s.position_q * uv.by_p.x - s.position_p * uv.by_q.x) * sign;
  along_u -= s.normal * glm::dot(s.normal, along_u);
  along_v -= s.normal * glm::dot(s.normal, along_v);
  if (!(glm::dot(along_u, along_u) > 1e-30f) || !(glm::dot(along_v, along_v) > 1e-30f)) return false;
  tangent = glm::normalize(along_u);
  // glTF's normal maps have +y up while v grows downwards: the bitangent runs against v.
  bitangent = -glm::normalize(along_v);
  return true;
}

Vec3 mapped_normal(const Surface& s, const Material& material, float t, TextureUnit* textures) {
  if (material.normal_texture.texture == nullptr) return s.normal;
  Vec3 tangent, bitangent;
  if (!tangent_frame(s, material.normal_texture, t, tangent, bitangent)) return s.normal;
  const Vec4 texel = sample_slot(material.normal_texture, s, textures);
  const Vec3 n((texel.x * 2.0f - 1.0f) * material.normal_scale, (texel.y * 2.0f - 1.0f) * material.normal_scale,
               texel.z * 2.0f - 1.0f);
  const Vec3 mapped = tangent * n.x + bitangent * n.y + s.normal * n.z;
  const float length2 = glm::dot(mapped, mapped);
  return length2 > 1e-20f ? mapped / std::sqrt(length2) : s.normal;
}

Vec3 towards_viewer(const FrameGeometry& frame, const Surface& surface, float t) {
  const scene::Projection& p = frame.projection;
  if (p.orthographic) return glm::normalize(Vec3(DVec3(frame.views[0].camera_to_world[2])));
  const DMat4 &open = frame.views[0].camera_to_world, &close = frame.views[1].camera_to_world;
  Vec3 offset;
  if (open == close) {
    // From where it is in the image: far from the world's origin, world positions are coarse.
    const Vec4& r = surface.raster;
    const auto centre_x = static_cast<float>(p.center_x), centre_y = static_cast<float>(p.center_y),
               scale = static_cast<float>(p.scale);
    offset = Mat3(DMat3(open)) * Vec3((centre_x * r.w - r.x) / scale, (r.y - centre_y * r.w) / scale, r.z);
  } else {
    offset = Vec3(DVec3(open[3])) * (1.0f - t) + Vec3(DVec3(close[3])) * t - surface.position;
  }
  const float length2 = glm::dot(offset, offset);
  return length2 > 0.0f ? offset / std::sqrt(length2) : Vec3(0, 0, 1);
}

Vector3<float> plain(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

ShadedPoint shade_point(const FrameGeometry& shutter, const Lighting& lighting, const Invocation& invocation,
                        TextureUnit* textures) {
  const auto [frame, at] = in_segment(shutter, invocation.at);
  Surface surface = evaluate_surface(frame, at);
  const shaders::Lights lights = shutter.lights_at(invocation.light_time);
  if (surface.drawable->procedure != nullptr)
    return shade_procedure(frame, lighting, lights, at, surface, towards_viewer(frame, surface, at.t));
  if (invocation.partner_x != 0)
    take_quad_differences(surface, invocation.partner_x, invocation.partner_y, frame.projection.orthographic);
  const Material& material = *surface.drawable->material;
  const Vec4 base = material.base_color * surface.color() * sample_slot(material.base_color_texture, surface, textures);
  ShadedPoint out;
  out.alpha = material.alpha_mode == scene::AlphaMode::kBlend ? std::clamp(base.w, 0.0f, 1.0f) : 1.0f;

  const Vec3 view = towards_viewer(frame, surface, at.t);
  const float side = glm::dot(surface.geometric_normal, view) < 0.0f ? -1.0f : 1.0f;
  Vec3 normal = mapped_normal(surface, material, at.t, textures) * side;
  // Interpolated normals may point away from the viewer near silhouettes; bend them back to the horizon.
  const float facing = glm::dot(normal, view);
  if (facing < 1e-3f) normal = glm::normalize(normal + view * (1e-3f - facing));
  out.normal = normal;
  if (material.unlit) {
    out.color = Vec3(base);
    if (material.glows_unlit)
      out.color += material.emissive * Vec3(sample_slot(material.emissive_texture, surface, textures));
    return out;
  }
  const Vec4 metallic_roughness = sample_slot(material.metallic_roughness_texture, surface, textures);
  const float occlusion = sample_slot(material.occlusion_texture, surface, textures).x;
  shaders::MaterialPoint<float> point;
  point.base_color = plain(Vec3(base));
  point.metallic = material.metallic * metallic_roughness.z;
  point.roughness = material.roughness * metallic_roughness.y;
  point.occlusion = 1.0f + material.occlusion_strength * (occlusion - 1.0f);
  point.emissive = plain(material.emissive * Vec3(sample_slot(material.emissive_texture, surface, textures)));
  out.color = shaders::shade_metallic_roughness(point, surface.position, normal, view, lights, lighting.environment);
  return out;
}

float point_alpha(const FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures) {
  const scene::PosedDrawable& drawable = frame.drawable_of(at.patch);
  const Material& material = *drawable.material;
  float alpha = material.base_color.w;
  if (!drawable.primitive->vertices.colors.empty()) alpha *= surface_alpha(frame, at);
  const TextureSlot& slot = material.base_color_texture;
  if (slot.texture != nullptr && !slot.texture->opaque()) {
    const Surface::Texcoord uv = surface_texcoord(frame, at, slot.texcoord, slot.transform);
    alpha *= look_up(*slot.texture, slot.sampler, uv.value, level_of_detail(*slot.texture, uv), textures).w;
  }
  return alpha;
}

}  // namespace tessera::tilecore
