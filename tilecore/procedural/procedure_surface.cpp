#include "tilecore/procedural/procedure_surface.h"

#include <algorithm>
#include <cmath>

#include "scene/procedure_patch.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;
using scene::ProcedurePatch;

// The place of a texture lookup: (u, v) of the whole procedure.
one_lane::LaneTexcoord<float> procedure_texcoord(const FrameGeometry& frame, const ProcedurePatch& patch,
                                                 Vec2 parameters, const Surface& surface,
                                                 const shaders::TextureTransform& transform) {
  one_lane::LaneSurface<float> lane = one_lane_surface(surface);
  one_lane::set_derivatives(frame.projection.orthographic, lane);
  const scene::Procedure::Piece& piece = *patch.piece;
  const Vec2 at = transform.apply(Vec2(piece.u_first + piece.u_scale * patch.u(parameters.x),
                                       piece.v_first + piece.v_scale * patch.v(parameters.y)));
  const Vec2 by_p = transform.matrix * Vec2(piece.u_scale / static_cast<float>(patch.columns), 0.0f),
             by_q = transform.matrix * Vec2(0.0f, piece.v_scale / static_cast<float>(patch.rows)),
             by_x = by_p * lane.p_by_x + by_q * lane.q_by_x, by_y = by_p * lane.p_by_y + by_q * lane.q_by_y;
  return {at.x, at.y, by_p.x, by_p.y, by_q.x, by_q.y, by_x.x, by_x.y, by_y.x, by_y.y};
}

// The material's textures at one point; white where a slot is empty.
struct ProcedureTextures {
  const FrameGeometry& frame;
  const ProcedurePatch& patch;
  Vec2 parameters;
  const Surface& surface;
  const LookupArrays& lookups;
  std::size_t lane;

  one_lane::LaneTexcoord<float> texcoord(const scene::TextureSlot& slot) const {
    return procedure_texcoord(frame, patch, parameters, surface, slot.transform);
  }
  shaders::ColorOf<float> read(const scene::TextureSlot& slot, scene::MaterialTexture which) const {
    if (slot.texture == nullptr) return {1.0f, 1.0f, 1.0f, 1.0f};
    const one_lane::LaneTexcoord<float> uv = texcoord(slot);
    const shaders::TextureView view = slot.texture->view();
    shaders::LookupTexels<std::int32_t> texels;
    const shaders::ColorOf<float> color = shaders::sample_texture<float, std::int32_t>(
        view, slot.sampler, uv.u, uv.v, one_lane::level_of_detail<float>(view, uv), texels);
    one_lane::store_lookup(lookups, static_cast<std::size_t>(which), texels, lane);
    return color;
  }
};

// The surface's normal as the material's normal map turns it: about tangents that follow u and v.
Vec3 mapped_normal(const ProcedureTextures& textures, const scene::Material& material) {
  const scene::TextureSlot& slot = material.normal_texture;
  const Vec3& normal = textures.surface.normal;
  if (slot.texture == nullptr) return normal;
  const one_lane::TangentFrame<float> frame =
      one_lane::derived_tangents(one_lane_surface(textures.surface), textures.texcoord(slot));
  const shaders::ColorOf<float> texel = textures.read(slot, scene::MaterialTexture::kNormal);
  const Vec3 tangent(frame.tangent.x, frame.tangent.y, frame.tangent.z),
      bitangent(frame.bitangent.x, frame.bitangent.y, frame.bitangent.z);
  const Vec3 mapped = tangent * ((texel.r * 2.0f - 1.0f) * material.normal_scale) +
                      bitangent * ((texel.g * 2.0f - 1.0f) * material.normal_scale) + normal * (texel.b * 2.0f - 1.0f);
  const float length2 = glm::dot(mapped, mapped);
  return frame.known && length2 > 1e-20f ? mapped / std::sqrt(length2) : normal;
}

// Colours of drawings with lines.
constexpr Vec3 kPaper(0.80f, 0.76f, 0.68f), kInk(0.02f, 0.02f, 0.035f);

Vec3 as_glm(const Vector3<float>& a) { return {a.x, a.y, a.z}; }
Vector3<float> as_stage(const Vec3& a) { return {a.x, a.y, a.z}; }

shaders::ProcedureLights procedure_lights(const FrameGeometry& frame) {
  shaders::ProcedureLights out;
  const DVec4 eye =
      frame.projection.orthographic ? frame.views[0].camera_to_world[2] : frame.views[0].camera_to_world[3];
  const Vec3 position = frame.projection.orthographic ? glm::normalize(Vec3(eye)) : Vec3(eye);
  out.eye = {position.x, position.y, position.z};
  out.orthographic = frame.projection.orthographic;
  out.count = 0;
  for (const shaders::Light& light : frame.lights[0]) {
    if (out.count == shaders::ProcedureLights::kMax) break;
    shaders::ProcedureLight& to = out.light[static_cast<std::size_t>(out.count++)];
    to.directional = light.type == shaders::Light::Type::kDirectional;
    to.direction = {-light.direction.x, -light.direction.y, -light.direction.z};
    to.position = {light.position.x, light.position.y, light.position.z};
    to.color = {light.color.x, light.color.y, light.color.z};
  }
  if (out.count == 0) {
    out.count = 1;
    out.light[0].direction = {-0.485f, 0.661f, 0.573f};  // the key light of the built-in studio
    out.light[0].color = {1.5f, 1.45f, 1.35f};
  }
  return out;
}

// Fills `s` from the points at both motion keys.
void place_point(const ObjectPoint& open, const ObjectPoint& close, float t, Surface& s) {
  const PosedDrawable& drawable = *s.drawable;
  const auto mix = [&](auto&& value) { return value(std::size_t{0}) * (1.0f - t) + value(std::size_t{1}) * t; };
  const auto point = [&](std::size_t key) -> const ObjectPoint& { return key == 0 ? open : close; };
  s.corner_count = 0;
  s.object = open.position;
  s.object_normal = open.normal;
  s.position = mix([&](std::size_t k) { return Vec3(drawable.to_world[k] * Vec4(point(k).position, 1.0f)); });
  s.position_p = mix([&](std::size_t k) { return Mat3(drawable.to_world[k]) * point(k).by_u; });
  s.position_q = mix([&](std::size_t k) { return Mat3(drawable.to_world[k]) * point(k).by_v; });
  const Vec3 turned = mix([&](std::size_t k) { return drawable.normal_to_world[k] * point(k).normal; });
  const float length2 = glm::dot(turned, turned);
  s.normal = length2 > 1e-30f && std::isfinite(length2) ? turned / std::sqrt(length2) : Vec3(0, 0, 1);
  s.geometric_normal = s.normal;
  s.raster = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point(k).position, 1.0f); });
  s.raster_p = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point(k).by_u, 0.0f); });
  s.raster_q = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point(k).by_v, 0.0f); });
}

}  // namespace

ObjectPoint object_point(const ProcedurePatch& at, std::size_t key, float u, float v) {
  ObjectPoint out;
  shaders::with_shape(at.shape, [&](auto shape) {
    using Shape = decltype(shape);
    const shaders::ShapePoint<float> p = shaders::shape_tangents<Shape>(at.input(key), u, v);
    float margin;
    Vector3<float> n = shaders::unit_normal(p.by_u, p.by_v, margin);
    if (!(margin > 0)) {
      const shaders::ShapePoint<float> beside =
          shaders::shape_tangents<Shape>(at.input(key), shaders::towards_middle(u), shaders::towards_middle(v));
      n = shaders::unit_normal(beside.by_u, beside.by_v, margin);
    }
    out = {as_glm(p.position), as_glm(p.by_u) / static_cast<float>(at.columns),
           as_glm(p.by_v) / static_cast<float>(at.rows), as_glm(n)};
  });
  return out;
}

shaders::SurfaceProgram surface_program(const FrameGeometry& frame, const PosedDrawable& drawable,
                                        const scene::Procedure::Piece& piece) {
  const scene::Procedure& procedure = *drawable.procedure;
  shaders::SurfaceProgram program;
  program.texture = procedure.texture;
  program.shading = procedure.shading;
  program.texture_numbers = procedure.texture_numbers;
  program.shading_numbers = procedure.shading_numbers;
  program.texture_program = procedure.texture_program.get();
  program.texture_constants = procedure.texture_constants.data();
  program.u_first = piece.u_first, program.u_scale = piece.u_scale;
  program.v_first = piece.v_first, program.v_scale = piece.v_scale;
  program.two_sided = drawable.material->double_sided;
  program.to_world = drawable.to_world[0];
  program.normal_to_world = drawable.normal_to_world[0];
  const float stretch = std::cbrt(std::abs(glm::determinant(Mat3(drawable.to_world[0]))));
  const float pixel = static_cast<float>(1.0 / frame.projection.scale) / (stretch > 0 ? stretch : 1.0f);
  (frame.projection.orthographic ? program.pixel : program.pixel_by_depth) = pixel;
  program.lights = procedure_lights(frame);
  return program;
}

void fill_procedure(const FrameGeometry& frame, std::uint32_t patch, Vec2 parameters, float t, Surface& s) {
  const ProcedurePatch at = scene::procedure_patch(frame, patch);
  const float u = at.u(parameters.x), v = at.v(parameters.y);
  const ObjectPoint open = object_point(at, 0, u, v);
  place_point(open, s.drawable->deforming ? object_point(at, 1, u, v) : open, t, s);
}

void fill_procedure_triangle(const FrameGeometry& frame, const SurfaceLocation& at, const VertexOutputs& vertices,
                             const std::array<std::int32_t, 3>& corner, Surface& s) {
  const scene::TessellationPattern& pattern = frame.pattern_of(at.patch);
  std::array<Vec2, 3> parameters;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [i, j] = scene::grid_corner(pattern, at.triangle, k);
    parameters[k] = {pattern.u(i, j), pattern.v(i, j)};
  }
  const Vec2 along_1 = parameters[1] - parameters[0], along_2 = parameters[2] - parameters[0];
  const float area = along_1.x * along_2.y - along_2.x * along_1.y;
  const std::array<float, 3> weight{1.0f - at.b1 - at.b2, at.b1, at.b2};
  const auto point = [&](std::size_t key) {
    ObjectPoint out;
    out.normal = Vec3(0.0f);
    for (std::size_t k = 0; k < 3; ++k) {
      out.position += vertices.position(key, corner[k]) * weight[k];
      out.normal += vertices.normal(key, corner[k]) * weight[k];
    }
    const float length = glm::length(out.normal);
    out.normal = length > 0.0f ? out.normal / length : vertices.normal(key, corner[0]);
    const Vec3 edge_1 = vertices.position(key, corner[1]) - vertices.position(key, corner[0]),
               edge_2 = vertices.position(key, corner[2]) - vertices.position(key, corner[0]);
    if (area != 0.0f) {
      out.by_u = (edge_1 * along_2.y - edge_2 * along_1.y) / area;
      out.by_v = (edge_2 * along_1.x - edge_1 * along_2.x) / area;
    }
    return out;
  };
  const ObjectPoint open = point(0);
  place_point(open, s.drawable->deforming ? point(1) : open, at.t, s);
}

// The receiver of shadow lookups: the surface in raster space, with its derivatives, at shutter open if the camera
// moves.
one_lane::LaneSurface<float> shadow_receiver(const FrameGeometry& frame, const Surface& surface) {
  const DMat4 to_raster = frame.projections[0].matrix() * frame.views[0].world_to_camera;
  const auto derivative = [&](const Vec3& by) { return Vec4(to_raster * DVec4(DVec3(by), 0.0)); };
  Surface receiver = surface;
  receiver.raster_p = derivative(surface.position_p), receiver.raster_q = derivative(surface.position_q);
  return one_lane_surface(receiver);
}

ShadedPoint shade_procedure(const FrameGeometry& frame, const Lighting& lighting, const shaders::ShadowView* shadowed,
                            const shaders::Lights& lights, const SurfaceLocation& at, const Surface& surface,
                            const Vec3& view, const LookupArrays& lookups, std::size_t lane) {
  const scene::Material& material = *surface.drawable->material;
  if (frame.request.draw_lines) return {at.triangle == SurfaceLocation::kLine ? kInk : kPaper, 1.0f, surface.normal};
  const ProcedurePatch patch = scene::procedure_patch(frame, at.patch);
  const Vec2 parameters = surface_parameters(frame, at);
  const shaders::SurfaceProgram program = surface_program(frame, *surface.drawable, *patch.piece);
  shaders::PointRecord<float> record;
  const Vector3<float> color = shaders::run_surface_stages<float>(
      program, patch.u(parameters.x), patch.v(parameters.y), as_stage(surface.object), as_stage(surface.object_normal),
      surface.raster.z, record);
  using Which = scene::MaterialTexture;
  const ProcedureTextures textures{frame, patch, parameters, surface, lookups, lane};
  const bool blends = material.alpha_mode == scene::AlphaMode::kBlend,
             by_material = program.shading == shaders::ShadingId::kMaterial;
  ShadedPoint out;
  const float side = material.double_sided && glm::dot(surface.normal, view) < 0.0f ? -1.0f : 1.0f;
  Vec3 normal = (by_material && !material.unlit ? mapped_normal(textures, material) : surface.normal) * side;
  const float facing = glm::dot(normal, view);
  if (facing < 1e-3f) normal = glm::normalize(normal + view * (1e-3f - facing));
  out.normal = normal;
  out.color = as_glm(color);
  shaders::ColorOf<float> texel{1.0f, 1.0f, 1.0f, 1.0f};
  if (blends || by_material) texel = textures.read(material.base_color_texture, Which::kBaseColor);
  if (blends) out.alpha = std::clamp(material.base_color.w * texel.a, 0.0f, 1.0f);
  if (!by_material) return out;
  const auto color_of = [&](const scene::TextureSlot& slot, Which which) {
    const shaders::ColorOf<float> c = textures.read(slot, which);
    return Vec3(c.r, c.g, c.b);
  };
  const Vec3 base = as_glm(record.color) * Vec3(material.base_color) * Vec3(texel.r, texel.g, texel.b);
  if (material.unlit) {
    out.color = base;
    return out;
  }
  shaders::MaterialPoint<float> point;
  point.base_color = as_stage(base);
  const shaders::ColorOf<float> metal = textures.read(material.metallic_roughness_texture, Which::kMetallicRoughness);
  point.metallic = material.metallic * metal.b;
  point.roughness = material.roughness * metal.g;
  point.occlusion =
      1.0f + material.occlusion_strength * (textures.read(material.occlusion_texture, Which::kOcclusion).r - 1.0f);
  point.emissive = as_stage(material.emissive * color_of(material.emissive_texture, Which::kEmissive));
  const one_lane::LaneSurroundings<float> around{lighting.environment.surroundings(), lookups, lane};
  DrawConstants draw;
  one_lane::LaneSurface<float> receiver;
  if (shadowed != nullptr) {
    draw.drawable = surface.drawable;
    draw.shadows = shadowed;
    draw.shadow_times = lighting.shadows != nullptr ? lighting.shadows->times() : 1;
    receiver = shadow_receiver(frame, surface);
  }
  const one_lane::LaneShadows<float> shadows{draw, receiver, lookups, lane};
  out.color = as_glm(shaders::shade_material(point, as_stage(surface.position), as_stage(normal), as_stage(view),
                                             lights, lights.t, around, shadows));
  return out;
}

float procedure_alpha(const FrameGeometry& frame, const SurfaceLocation& at, TextureUnit* textures) {
  const PosedDrawable& drawable = frame.drawable_of(at.patch);
  const scene::TextureSlot& slot = drawable.material->base_color_texture;
  const float alpha = drawable.material->base_color.w;
  if (slot.texture == nullptr || slot.texture->opaque()) return alpha;
  const ProcedurePatch patch = scene::procedure_patch(frame, at.patch);
  const Vec2 parameters = surface_parameters(frame, at);
  Surface surface;
  surface.drawable = &drawable;
  fill_procedure(frame, at.patch, parameters, at.t, surface);
  const one_lane::LaneTexcoord<float> uv = procedure_texcoord(frame, patch, parameters, surface, slot.transform);
  return alpha * look_up(*slot.texture, slot.sampler, {uv.u, uv.v},
                         one_lane::level_of_detail<float>(slot.texture->view(), uv), textures)
                     .w;
}

}  // namespace tessera::tilecore
