#version 450
// The machine's pixel shader as a user of a graphics interface would write it, for a driver's compiler to count: posed
// vertices from buffers by barycentric weights or a bicubic patch, metallic-roughness material, the built-in studio.
// Variants by PATCH, MAPPED, BASE_COLOR, METALLIC_ROUGHNESS, COLORS, UNLIT, DIRECTIONAL and SPOT (numbers of lights).

layout(location = 0) flat in ivec4 place;  // vertices of the triangle; the patch's first point, cells, factors, triangle
layout(location = 1) in vec2 weights;
layout(location = 0) out vec4 result;

struct Light { vec4 color, position, direction, cone; };
layout(set = 0, binding = 0) uniform Draw {
  mat4 to_raster, to_world;
  mat3 normal_to_world, camera;
  vec4 center_scale, base_color, emissive, factors, uv_matrix, uv_offset;  // factors: metallic, roughness, environment, normal scale
  Light lights[4];
} draw;
layout(set = 0, binding = 1, std430) readonly buffer Positions { float position[]; };
layout(set = 0, binding = 2, std430) readonly buffer Normals { float normals[]; };
layout(set = 0, binding = 3, std430) readonly buffer Raster { vec4 raster[]; };
layout(set = 0, binding = 4, std430) readonly buffer Coordinates { vec2 coordinates[]; };
layout(set = 0, binding = 5, std430) readonly buffer Colors { vec4 colors[]; };
layout(set = 0, binding = 6, std430) readonly buffer Lobes { float lobes[]; };
layout(set = 0, binding = 7) uniform sampler2D base_map;
layout(set = 0, binding = 8) uniform sampler2D roughness_map;
layout(set = 0, binding = 9) uniform sampler2D normal_map;

const float PI = 3.14159265;
vec3 vec3_at(int i) { return vec3(position[3 * i], position[3 * i + 1], position[3 * i + 2]); }
vec3 normal_at(int i) { return vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]); }
vec3 unit_or(vec3 v, vec3 other) { float l = dot(v, v); return l > 1e-30 ? v * inversesqrt(l) : other; }

struct Point {
  vec3 position, facing, normal, along_p, along_q;
  vec4 raster;
  int corner[4];
  float share[4];
  vec2 slope[4];  // of the share, along p and q
  int corners;
};

// ---- Surfaces ---------------------------------------------------------------------------------------------------------

#ifdef PATCH
// Where an edge has fewer vertices than the grid, several grid points are one of them.
float grid_coordinate(float i, float fine, float coarse) {
  return floor((2.0 * i * coarse + fine) / (2.0 * fine)) / coarse;
}
vec2 patch_parameters() {
  float nu = float(place.y & 255), nv = float((place.y >> 8) & 255);
  float low_v = float(place.z & 255), high_v = float((place.z >> 8) & 255);
  float low_u = float((place.z >> 16) & 255), high_u = float((place.z >> 24) & 255);
  if (place.w < 0) return weights;
  float cell = float(place.w >> 1), j = floor(cell / nu), i = cell - j * nu;
  float u0 = j == 0.0 ? low_v : nu, u1 = j + 1.0 == nv ? high_v : nu;
  float v0 = i == 0.0 ? low_u : nv, v1 = i + 1.0 == nu ? high_u : nv;
  bool first = (place.w & 1) == 0;
  vec2 a = vec2(grid_coordinate(i, nu, u0), grid_coordinate(j, nv, v0));
  vec2 c = vec2(grid_coordinate(i + 1.0, nu, u1), grid_coordinate(j + 1.0, nv, v1));
  vec2 b = vec2(grid_coordinate(first ? i + 1.0 : i, nu, first ? u0 : u1),
                grid_coordinate(first ? j : j + 1.0, nv, first ? v1 : v0));
  float at_b = first ? weights.x : weights.y, at_c = first ? weights.y : weights.x;
  return a * (1.0 - weights.x - weights.y) + b * at_b + c * at_c;
}
vec4 cubic(float t) { float s = 1.0 - t; return vec4(s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t); }
vec3 quadratic(float t) { float s = 1.0 - t; return vec3(s * s, 2.0 * s * t, t * t); }

Point surface_point() {
  vec2 uv = patch_parameters();
  vec4 bu = cubic(uv.x), bv = cubic(uv.y);
  vec3 du = quadratic(uv.x), dv = quadratic(uv.y);
  vec3 at[4], across[4];
  for (int i = 0; i < 4; ++i) {
    vec3 c0 = vec3_at(place.x + i), c1 = vec3_at(place.x + 4 + i), c2 = vec3_at(place.x + 8 + i),
         c3 = vec3_at(place.x + 12 + i);
    at[i] = c0 * bv.x + c1 * bv.y + c2 * bv.z + c3 * bv.w;
    across[i] = ((c1 - c0) * dv.x + (c2 - c1) * dv.y + (c3 - c2) * dv.z) * 3.0;
  }
  vec3 p = at[0] * bu.x + at[1] * bu.y + at[2] * bu.z + at[3] * bu.w;
  vec3 by_u = ((at[1] - at[0]) * du.x + (at[2] - at[1]) * du.y + (at[3] - at[2]) * du.z) * 3.0;
  vec3 by_v = across[0] * bu.x + across[1] * bu.y + across[2] * bu.z + across[3] * bu.w;
  vec3 su = by_u / max(max(abs(by_u.x), abs(by_u.y)), abs(by_u.z));
  vec3 sv = by_v / max(max(abs(by_v.x), abs(by_v.y)), abs(by_v.z));
  vec3 n = normalize(cross(su, sv));
  Point o;
  o.position = (draw.to_world * vec4(p, 1.0)).xyz;
  o.along_p = mat3(draw.to_world) * by_u;
  o.along_q = mat3(draw.to_world) * by_v;
  o.raster = draw.to_raster * vec4(p, 1.0);
  o.normal = unit_or(draw.normal_to_world * n, vec3(0, 0, 1));
  o.facing = o.normal;
  o.corners = 4;
  o.corner = int[4](place.x, place.x + 3, place.x + 12, place.x + 15);
  vec2 r = 1.0 - uv;
  o.share = float[4](r.x * r.y, uv.x * r.y, r.x * uv.y, uv.x * uv.y);
  o.slope = vec2[4](vec2(-r.y, -r.x), vec2(r.y, -uv.x), vec2(-uv.y, r.x), vec2(uv.y, uv.x));
  return o;
}
#else
Point surface_point() {
  Point o;
  o.corners = 3;
  o.corner = int[4](place.x, place.y, place.z, 0);
  o.share = float[4](1.0 - weights.x - weights.y, weights.x, weights.y, 0.0);
  o.slope = vec2[4](vec2(-1, -1), vec2(1, 0), vec2(0, 1), vec2(0));
  vec3 a = vec3_at(place.x), b = vec3_at(place.y), c = vec3_at(place.z);
  o.along_p = b - a;
  o.along_q = c - a;
  o.position = a * o.share[0] + b * o.share[1] + c * o.share[2];
  o.facing = unit_or(cross(o.along_p, o.along_q), vec3(0, 0, 1));
  vec3 n = normal_at(place.x) * o.share[0] + normal_at(place.y) * o.share[1] + normal_at(place.z) * o.share[2];
  o.normal = unit_or(n, o.facing);
  o.raster = raster[place.x] * o.share[0] + raster[place.y] * o.share[1] + raster[place.z] * o.share[2];
  return o;
}
#endif

// A texture coordinate and its slopes along p and q.
void coordinate(Point o, out vec2 at, out vec2 by_p, out vec2 by_q) {
  at = by_p = by_q = vec2(0);
  for (int k = 0; k < o.corners; ++k) {
    vec2 t = coordinates[o.corner[k]];
    at += t * o.share[k];
    by_p += t * o.slope[k].x;
    by_q += t * o.slope[k].y;
  }
  mat2 m = mat2(draw.uv_matrix.xy, draw.uv_matrix.zw);
  at = m * at + draw.uv_offset.xy;
  by_p = m * by_p;
  by_q = m * by_q;
}

#ifdef MAPPED
vec3 mapped(Point o, vec2 at, vec2 by_p, vec2 by_q) {
  float turn = by_p.x * by_q.y - by_p.y * by_q.x, s = turn > 0.0 ? 1.0 : -1.0;
  vec3 t = (o.along_p * by_q.y - o.along_q * by_p.y) * s, b = (o.along_q * by_p.x - o.along_p * by_q.x) * s;
  t -= o.normal * dot(o.normal, t);
  b -= o.normal * dot(o.normal, b);
  float lt = dot(t, t), lb = dot(b, b);
  bool known = abs(turn) > 0.0 && lt > 1e-30 && lb > 1e-30;
  vec3 texel = texture(normal_map, at).xyz * 2.0 - 1.0;
  vec3 n = t * inversesqrt(lt) * (texel.x * draw.factors.w) - b * inversesqrt(lb) * (texel.y * draw.factors.w) +
           o.normal * texel.z;
  float l = dot(n, n);
  return known && l > 1e-20 ? n * inversesqrt(l) : o.normal;
}
#endif

// ---- The studio -------------------------------------------------------------------------------------------------------

const vec3 CEILING = vec3(0.62, 0.66, 0.72), FLOOR = vec3(0.20, 0.185, 0.17);
const vec3 AXIS[3] = vec3[3](vec3(-0.48479, 0.66108, 0.57293), vec3(0.87919, 0.31030, 0.36202), vec3(0.31498, 0.49498, -0.80995));
const vec3 GLOW[3] = vec3[3](vec3(6.0, 5.7, 5.2), vec3(1.3, 1.45, 1.7), vec3(3.2, 3.3, 3.6));
const float WIDTH[4] = float[4](0.15, 0.3, 0.6, 1.2);
const float DIFFUSE[23] = float[23](-0.00001, 0.00001, 0.00001, -0.00006, 0.49778, 2.5, -0.07248, 0.11635, 0.00780,
                                    0.04128, 0.03612, 2.5, -0.07688, 0.12363, 0.01653, 0.06335, 0.04976, 2.5, -0.06549,
                                    0.10500, 0.00409, 0.02988, 0.02811);

vec3 studio(vec3 d, float row[23]) {
  float up = 0.5 + row[4] * d.y;
  for (int k = 0; k < 4; ++k) {
    float t = clamp(0.5 + d.y * (0.5 / WIDTH[k]), 0.0, 1.0);
    up += row[k] * (t * t * (3.0 - 2.0 * t) - 0.5);
  }
  vec3 sum = FLOOR * (1.0 - up) + CEILING * up;
  for (int k = 0; k < 3; ++k) {
    int f = 5 + 6 * k;
    float c = dot(d, AXIS[k]), e = exp(row[f] * (c - 1.0));
    float share = e * (row[f + 2] + e * row[f + 1]) + row[f + 3] + c * (row[f + 4] + c * row[f + 5]);
    sum += GLOW[k] * max(share, 0.0);
  }
  return sum;
}

vec3 studio_around(vec3 d, float roughness) {
  float at = clamp(roughness, 0.0, 1.0) * 16.0, low = floor(at), share = at - low;
  int first = int(low), next = low < 16.0 ? first + 1 : first;
  float row[23];
  for (int i = 0; i < 23; ++i) row[i] = mix(lobes[first * 23 + i], lobes[next * 23 + i], share);
  return studio(d, row);
}

// ---- The material -----------------------------------------------------------------------------------------------------

struct Material { vec3 color; float metallic, roughness, occlusion; vec3 emissive; };

vec2 reflectance(float r, float m) {
  float mm = m * m, rr = r * r, mr = m * r;
  float a = (1.116464 - 6.831859 * r + 24.478816 * rr - 6.443647 * rr * r + 24.041413 * m - 11.348127 * mr -
             23.488263 * mr * r - 3.610450 * mm + 10.800048 * mm * r - 2.912097 * mm * m) /
            (1.0 - 4.382400 * r + 16.758996 * rr + 24.428288 * m - 11.459734 * mr - 5.802704 * mm);
  float g = (0.939250 - 0.334970 * r - 0.162989 * rr - 2.130829 * m + 0.633539 * mr + 1.142693 * mm) /
            (1.0 - 0.595692 * r + 13.782813 * rr + 1.118732 * m - 10.554743 * mr + 13.333790 * mm);
  a = clamp(a, 0.0, 1.0);
  return vec2(a, min(clamp(g, 0.0, 1.0), a));
}

// Of an environment, by a surface of this reflectance at normal incidence: after one reflection, after several.
vec2 shares(vec2 r, float f0) {
  float single = f0 * (r.x - r.y) + r.y, mean = f0 + (1.0 - f0) * (1.0 / 21.0), lost = 1.0 - r.x;
  return vec2(single, single * mean * lost / (1.0 - mean * lost));
}

vec3 by_environment(Material m, vec3 n, vec3 v) {
  float n_v = max(dot(n, v), 1e-4), plain = 1.0 - m.metallic;
  vec2 r = reflectance(m.roughness, n_v);
  vec2 coat = shares(r, 0.04);
  float under = plain * (1.0 - coat.x - coat.y);
  vec3 mirror = n * (2.0 * dot(n, v)) - v;
  vec3 bent = mirror + (n - mirror) * (m.roughness * m.roughness * m.roughness);
  float l = dot(bent, bent);
  vec3 around = studio_around(l > 1e-12 ? bent * inversesqrt(l) : n, m.roughness) * draw.factors.z;
  vec3 diffuse = studio(n, DIFFUSE) * draw.factors.z;
  vec2 x = shares(r, 0.04 * plain + m.color.x * m.metallic), y = shares(r, 0.04 * plain + m.color.y * m.metallic),
       z = shares(r, 0.04 * plain + m.color.z * m.metallic);
  vec3 single = vec3(x.x, y.x, z.x), several = vec3(x.y, y.y, z.y);
  return m.emissive + (single * around + (several + m.color * under) * diffuse) * m.occlusion;
}

vec3 reflected(Material m, vec3 n, vec3 v, vec3 l) {
  float towards = dot(n, l), n_l = max(towards, 1e-30), n_v = max(dot(n, v), 1e-4);
  vec3 sum = v + l, h = sum * inversesqrt(max(dot(sum, sum), 1e-12));
  float n_h = clamp(dot(n, h), 0.0, 1.0), v_h = clamp(dot(v, h), 0.0, 1.0);
  float r = max(m.roughness, 0.045), a = r * r, a2 = a * a;
  float spread = n_h * n_h * (a2 - 1.0) + 1.0, ggx = a2 / (PI * spread * spread);
  float smith = 0.5 / (n_l * sqrt(n_v * n_v * (1.0 - a2) + a2) + n_v * sqrt(n_l * n_l * (1.0 - a2) + a2));
  float g = 1.0 - v_h, g2 = g * g;
  vec3 f0 = 0.04 * (1.0 - m.metallic) + m.color * m.metallic, f = f0 + (1.0 - f0) * (g2 * g2 * g);
  vec3 body = (1.0 - f) * (1.0 - m.metallic) * m.color * (1.0 / PI);
  return (body + f * (ggx * smith)) * (towards > 0.0 ? n_l : 0.0);
}

vec3 lit_by_spot(Light light, Material m, vec3 p, vec3 n, vec3 v) {
  vec3 offset = light.position.xyz - p;
  float d2 = max(dot(offset, offset), 1e-8);
  vec3 l = offset * inversesqrt(d2);
  float window = clamp((-dot(light.direction.xyz, l) - light.cone.y) / max(light.cone.x - light.cone.y, 1e-4), 0.0, 1.0);
  return light.color.xyz * (window * window / d2) * reflected(m, n, v, l);
}

void main() {
  Point o = surface_point();
  vec2 at, by_p, by_q;
  coordinate(o, at, by_p, by_q);
  vec4 base = draw.base_color;
#ifdef COLORS
  vec4 tint = vec4(0);
  for (int k = 0; k < o.corners; ++k) tint += colors[o.corner[k]] * o.share[k];
  base *= tint;
#endif
#ifdef BASE_COLOR
  base *= texture(base_map, at);
#endif
#ifdef UNLIT
  result = vec4(base.rgb, clamp(base.a, 0.0, 1.0));
#else
  vec2 image = vec2(draw.center_scale.x * o.raster.w - o.raster.x, o.raster.y - draw.center_scale.y * o.raster.w) *
               draw.center_scale.z;
  vec3 v = unit_or(draw.camera * vec3(image, o.raster.z), vec3(0, 0, 1));
  vec3 n = o.normal;
#ifdef MAPPED
  n = mapped(o, at, by_p, by_q);
#endif
  n *= dot(o.facing, v) < 0.0 ? -1.0 : 1.0;
  float facing = dot(n, v);
  vec3 bent = n + v * (1e-3 - facing);
  n = facing < 1e-3 ? normalize(bent) : n;
  Material m;
  m.color = base.rgb;
  m.metallic = draw.factors.x;
  m.roughness = draw.factors.y;
  m.occlusion = 1.0;
  m.emissive = draw.emissive.rgb;
#ifdef METALLIC_ROUGHNESS
  vec4 mr = texture(roughness_map, at);
  m.metallic *= mr.b;
  m.roughness *= mr.g;
#endif
  vec3 sum = by_environment(m, n, v);
#ifdef DIRECTIONAL
  for (int i = 0; i < DIRECTIONAL; ++i)
    sum += draw.lights[i].color.xyz * reflected(m, n, v, -draw.lights[i].direction.xyz);
#endif
#ifdef SPOT
  for (int i = 0; i < SPOT; ++i) sum += lit_by_spot(draw.lights[i], m, o.position, n, v);
#endif
  result = vec4(sum, clamp(base.a, 0.0, 1.0));
#endif
}
