#pragma once

namespace tessera::bench {

// Tessera's metallic-roughness shader, studio and lights in the GLSL for llvmpipe. A line "#version 450" and macros
// for the features of a material come before: LIGHTS (their number), BASE_IMAGE, METALLIC_ROUGHNESS_IMAGE,
// EMISSIVE_IMAGE, COLORS (of vertices), MASK_ALONE (without shading), BLEND, DOUBLE_SIDED, UNLIT.
inline constexpr const char* kShadedVertex = R"(
layout(location = 0) in vec4 clip;
layout(location = 1) in vec3 position;
layout(location = 2) in vec3 normal;
layout(location = 3) in vec2 texcoord;
layout(location = 4) in vec4 color;
out vec3 world, world_normal;
out vec2 uv;
out vec4 tint;
void main() {
  gl_Position = clip;
  world = position;
  world_normal = normal;
  uv = texcoord;
  tint = color;
})";

// Follows shaders_cpp/studio_light.inc and metallic_roughness.inc, and tilecore/shading/lane_shader.inc.
inline constexpr const char* kShadedFragment = R"(
in vec3 world, world_normal;
in vec2 uv;
in vec4 tint;
layout(location = 0) out vec4 color;
layout(binding = 0) uniform sampler2D base_image;
layout(binding = 1) uniform sampler2D metallic_roughness_image;
layout(binding = 2) uniform sampler2D emissive_image;
layout(location = 0) uniform vec4 base_factor;
layout(location = 1) uniform vec3 emissive_factor;
layout(location = 2) uniform vec3 numbers;  // metallic, roughness, cutoff
// A row of lobes: weights of the horizon; slope and sharpness; narrow, broad, constant, linear, quadratic. Two vectors a
// light: where it is, or against its direction, and 1 or 0; colour and range to the power of -2. One more, for there may
// be none.
layout(std140, binding = 0) uniform Frame {
  vec4 lobes[18 * 7], horizon_widths, ceiling_light, floor_light, box_axis[3], box_amplitude[3], eye, lights[2 * LIGHTS + 1];
};

vec3 studio(vec3 d, int row, int next, float share) {
  vec4 lobe[7];
  for (int k = 0; k < 7; ++k) lobe[k] = mix(lobes[7 * row + k], lobes[7 * next + k], share);
  vec4 t = clamp(0.5 + 0.5 * d.y / horizon_widths, 0.0, 1.0);
  float above = 0.5 + lobe[1].x * d.y + dot(lobe[0], t * t * (3.0 - 2.0 * t) - 0.5);
  vec3 sum = mix(floor_light.rgb, ceiling_light.rgb, above);
  vec3 c = vec3(dot(d, box_axis[0].xyz), dot(d, box_axis[1].xyz), dot(d, box_axis[2].xyz));
  vec3 e = exp(lobe[1].yzw * (c - 1.0));
  vec3 boxes = max(e * (lobe[3].xyz + e * lobe[2].xyz) + lobe[4].xyz + c * (lobe[5].xyz + c * lobe[6].xyz), 0.0);
  return sum + box_amplitude[0].rgb * boxes.x + box_amplitude[1].rgb * boxes.y + box_amplitude[2].rgb * boxes.z;
}

vec3 reflect_light(vec3 base, float metallic, float given_roughness, vec3 n, vec3 v, vec3 l) {
  float towards = dot(n, l), n_l = max(towards, 1e-30), n_v = max(dot(n, v), 1e-4);
  vec3 sum = v + l, h = sum * inversesqrt(max(dot(sum, sum), 1e-12));
  float n_h = clamp(dot(n, h), 0.0, 1.0), v_h = clamp(dot(v, h), 0.0, 1.0);
  float roughness = max(given_roughness, 0.045), alpha = roughness * roughness, alpha2 = alpha * alpha;
  float spread = n_h * n_h * (alpha2 - 1.0) + 1.0;
  float distribution = alpha2 / (3.14159265 * spread * spread);
  float visibility = 0.5 / (n_l * sqrt(n_v * n_v * (1.0 - alpha2) + alpha2) +
                            n_v * sqrt(n_l * n_l * (1.0 - alpha2) + alpha2));
  float grazing = 1.0 - v_h, grazing2 = grazing * grazing;
  vec3 f0 = mix(vec3(0.04), base, metallic), fresnel = f0 + (1.0 - f0) * (grazing2 * grazing2 * grazing);
  vec3 diffuse = (1.0 - fresnel) * (1.0 - metallic) * base * 0.318309886;
  return (diffuse + fresnel * (distribution * visibility)) * (towards > 0.0 ? n_l : 0.0);
}

// Albedo and grazing share.
vec2 environment_reflectance(float r, float m) {
  float mm = m * m, rr = r * r, mr = m * r;
  float albedo = (1.116464 - 6.831859 * r + 24.478816 * rr - 6.443647 * rr * r + 24.041413 * m - 11.348127 * mr -
                  23.488263 * mr * r - 3.610450 * mm + 10.800048 * mm * r - 2.912097 * mm * m) /
                 (1.0 - 4.382400 * r + 16.758996 * rr + 24.428288 * m - 11.459734 * mr - 5.802704 * mm);
  float grazing = (0.939250 - 0.334970 * r - 0.162989 * rr - 2.130829 * m + 0.633539 * mr + 1.142693 * mm) /
                  (1.0 - 0.595692 * r + 13.782813 * rr + 1.118732 * m - 10.554743 * mr + 13.333790 * mm);
  float all = clamp(albedo, 0.0, 1.0);
  return vec2(all, min(clamp(grazing, 0.0, 1.0), all));
}

// Single and multiple reflection.
void environment_shares(vec2 r, vec3 f0, out vec3 single, out vec3 multiple) {
  single = f0 * (r.x - r.y) + r.y;
  vec3 mean = f0 + (1.0 - f0) * (1.0 / 21.0);
  float lost = 1.0 - r.x;
  multiple = single * mean * lost / (1.0 - mean * lost);
}

vec3 shade_by_environment(vec3 base, float metallic, float roughness, vec3 n, vec3 v) {
  float n_v = max(dot(n, v), 1e-4), plain = 1.0 - metallic;
  vec2 reflectance = environment_reflectance(roughness, n_v);
  vec3 coat_single, coat_multiple, single, multiple;
  environment_shares(reflectance, vec3(0.04), coat_single, coat_multiple);
  float under = plain * (1.0 - coat_single.x - coat_multiple.x);
  vec3 mirror = n * (2.0 * dot(n, v)) - v, bent = mirror + (n - mirror) * (roughness * roughness * roughness);
  float length2 = dot(bent, bent), at = clamp(roughness, 0.0, 1.0) * 16.0, row = floor(at);
  vec3 around = studio(length2 > 1e-12 ? bent * inversesqrt(length2) : n, int(row), min(int(row) + 1, 16), at - row);
  vec3 diffuse = studio(n, 17, 17, 0.0);
  environment_shares(reflectance, 0.04 * plain + base * metallic, single, multiple);
  return single * around + (multiple + base * under) * diffuse;
}

void main() {
  vec4 base = base_factor;
#ifdef BASE_IMAGE
  base *= texture(base_image, uv);
#endif
#ifdef COLORS
  base *= tint;
#endif
  color = vec4(base.rgb, 1.0);
#ifdef MASK_ALONE
  if (base.a < numbers.z) discard;
#elif !defined(UNLIT)
  float metallic = numbers.x, roughness = numbers.y;
#ifdef METALLIC_ROUGHNESS_IMAGE
  vec2 mr = texture(metallic_roughness_image, uv).bg;
  metallic *= mr.x, roughness *= mr.y;
#endif
  vec3 n = normalize(world_normal), v = normalize(eye.xyz - world);
#ifdef DOUBLE_SIDED
  n = gl_FrontFacing ? n : -n;
#endif
  float facing = dot(n, v);
  if (facing < 1e-3) n = normalize(n + v * (1e-3 - facing));
  color.rgb = shade_by_environment(base.rgb, metallic, roughness, n, v);
#ifdef EMISSIVE_IMAGE
  color.rgb += emissive_factor * texture(emissive_image, uv).rgb;
#else
  color.rgb += emissive_factor;
#endif
  for (int k = 0; k < LIGHTS; ++k) {
    vec4 place = lights[2 * k], light = lights[2 * k + 1];
    vec3 offset = place.xyz - place.w * world;
    float distance2 = max(dot(offset, offset), 1e-8), ratio2 = distance2 * light.w;
    color.rgb += light.rgb / distance2 * clamp(1.0 - ratio2 * ratio2, 0.0, 1.0) *
                 reflect_light(base.rgb, metallic, roughness, n, v, offset * inversesqrt(distance2));
  }
#endif
#ifdef BLEND
  color.a = clamp(base.a, 0.0, 1.0);
#endif
})";

// Draws the studio behind all surfaces, over the whole image at the far plane.
inline constexpr const char* kBackgroundVertex = R"(#version 450
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); })";
inline constexpr const char* kBackgroundFragment = R"(#version 450
layout(location = 0) uniform mat3 ray;  // to world directions, from pixels and 1
layout(location = 1) uniform vec3 floor_light;
layout(location = 2) uniform vec3 ceiling_light;
layout(location = 0) out vec4 color;
void main() {
  float t = clamp(0.5 + 0.5 * normalize(ray * vec3(gl_FragCoord.xy, 1.0)).y / 0.9, 0.0, 1.0);
  color = vec4(mix(floor_light, ceiling_light, t * t * (3.0 - 2.0 * t)), 1.0);
})";

}  // namespace tessera::bench
