#include "bench/support/llvmpipe_shaded.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "bench/support/osmesa_objects.h"
#include "shaders_cpp/environment.h"

namespace tessera::bench {
namespace {

constexpr const char* kVertex = R"(#version 450
layout(location = 0) in vec3 projected;  // image times depth, depth
layout(location = 1) in vec3 position;
layout(location = 2) in vec3 normal;
layout(location = 3) in vec2 texcoord;
uniform vec2 depth;
out vec3 world, world_normal;
out vec2 uv;
void main() {
  gl_Position = vec4(projected.xy, depth.x * projected.z + depth.y, projected.z);
  world = position;
  world_normal = normal;
  uv = texcoord;
})";

// After shaders_cpp/studio_light.inc and metallic_roughness.inc, and tilecore/shading/lane_shader.inc.
constexpr const char* kFragment = R"(#version 450
in vec3 world, world_normal;
in vec2 uv;
layout(location = 0) out vec4 color;
layout(binding = 0) uniform sampler2D base_image;
layout(binding = 1) uniform sampler2D metallic_roughness_image;
uniform vec3 eye, sun_color, sun_direction, lamp_color, lamp_position;
uniform float metallic_factor, roughness_factor;
uniform vec3 ceiling_light, floor_light, box_axis[3], box_amplitude[3];
uniform vec4 horizon_widths;
// A row: weights of the horizon; slope and sharpness; narrow, broad, constant, linear, quadratic.
layout(std140, binding = 0) uniform Lobes { vec4 lobes[18 * 7]; };

vec3 studio(vec3 d, int row, int next, float share) {
  vec4 lobe[7];
  for (int k = 0; k < 7; ++k) lobe[k] = mix(lobes[7 * row + k], lobes[7 * next + k], share);
  vec4 t = clamp(0.5 + 0.5 * d.y / horizon_widths, 0.0, 1.0);
  float above = 0.5 + lobe[1].x * d.y + dot(lobe[0], t * t * (3.0 - 2.0 * t) - 0.5);
  vec3 sum = mix(floor_light, ceiling_light, above);
  vec3 c = vec3(dot(d, box_axis[0]), dot(d, box_axis[1]), dot(d, box_axis[2]));
  vec3 e = exp(lobe[1].yzw * (c - 1.0));
  vec3 boxes = max(e * (lobe[3].xyz + e * lobe[2].xyz) + lobe[4].xyz + c * (lobe[5].xyz + c * lobe[6].xyz), 0.0);
  return sum + box_amplitude[0] * boxes.x + box_amplitude[1] * boxes.y + box_amplitude[2] * boxes.z;
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
  vec3 base = texture(base_image, uv).rgb;
  vec2 mr = texture(metallic_roughness_image, uv).bg;
  float metallic = metallic_factor * mr.x, roughness = roughness_factor * mr.y;
  vec3 n = normalize(world_normal), v = normalize(eye - world);
  n = dot(n, v) < 0.0 ? -n : n;
  float facing = dot(n, v);
  if (facing < 1e-3) n = normalize(n + v * (1e-3 - facing));
  vec3 offset = lamp_position - world;
  float distance2 = max(dot(offset, offset), 1e-8);
  color = vec4(shade_by_environment(base, metallic, roughness, n, v) +
                   sun_color * reflect_light(base, metallic, roughness, n, v, -sun_direction) +
                   lamp_color / distance2 *
                       reflect_light(base, metallic, roughness, n, v, offset * inversesqrt(distance2)), 1.0);
})";

// All levels of a texture, bound to a unit.
void load_texture(unsigned unit, const shaders::Texture& from, bool srgb) {
  glActiveTexture(GL_TEXTURE0 + unit);
  texture(GL_TEXTURE_2D);
  glTexStorage2D(GL_TEXTURE_2D, from.level_count(), srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, from.width(), from.height());
  const shaders::TextureView view = from.view();
  for (int level = 0; level < from.level_count(); ++level) {
    const int width = from.width(level), height = from.height(level);
    std::vector<std::int32_t> texels;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)  // squares of 4 x 4 texels
        texels.push_back(
            view.texels[view.first[level] + (y / 4 * view.squares_across[level] + x / 4) * 16 + y % 4 * 4 + x % 4]);
    glTexSubImage2D(GL_TEXTURE_2D, level, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
  }
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
}

// The table of studio.h by row, boxes side by side.
std::vector<float> lobe_vectors() {
  std::vector<float> out;
  for (const shaders::EnvironmentLobes& row : shaders::kEnvironmentLobes) {
    out.insert(out.end(), row.horizon.begin(), row.horizon.end());
    out.push_back(row.slope);
    for (const shaders::LobeFit& box : row.box) out.push_back(box.sharpness);
    for (const auto part : {&shaders::LobeFit::narrow, &shaders::LobeFit::broad, &shaders::LobeFit::constant,
                            &shaders::LobeFit::linear, &shaders::LobeFit::quadratic}) {
      for (const shaders::LobeFit& box : row.box) out.push_back(box.*part);
      out.push_back(0);
    }
  }
  return out;
}

}  // namespace

ShadedLlvmpipe::ShadedLlvmpipe(const PosedScene& scene, const TriangleList& triangles, int threads, float roughness)
    : context_(threads), width_(scene.frame->request.width), height_(scene.frame->request.height) {
  program_ = link(kVertex, kFragment);
  glUseProgram(program_);
  make_vertices(triangles);
  make_targets();
  set_uniforms(scene, roughness);
  // A little room, so that nothing is clipped by rounding.
  const float near = 0.9f * triangles.near_depth, far = 1.1f * triangles.far_depth;
  glUniform2f(glGetUniformLocation(program_, "depth"), (far + near) / (far - near), -2 * far * near / (far - near));
  glViewport(0, 0, width_, height_);
  glDepthFunc(GL_LESS);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CW);  // rows run downwards
  image_.resize(4 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  expect_no_error();
}

void ShadedLlvmpipe::make_vertices(const TriangleList& triangles) {
  if (triangles.attributes.size() != triangles.patch.size()) throw std::runtime_error("vertices have no attributes");
  struct Vertex {
    float projected[3];
    TriangleList::Attributes attributes;
  };
  static_assert(sizeof(Vertex) == 11 * sizeof(float));
  std::vector<Vertex> vertices(triangles.patch.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const TriangleList::Vertex& from = triangles.keys[0][v];
    const double x = 2.0 * static_cast<double>(from.x) / width_ - 1.0,
                 y = 2.0 * static_cast<double>(from.y) / height_ - 1.0, z = static_cast<double>(from.z);
    vertices[v] = {{static_cast<float>(x * z), static_cast<float>(y * z), from.z}, triangles.attributes[v]};
  }
  std::vector<std::uint32_t> indices = triangles.indices;
  std::reverse(indices.begin(), indices.end());
  // Of each triangle backwards again.
  for (std::size_t t = 0; t < indices.size(); t += 3) std::swap(indices[t], indices[t + 2]);
  index_count_ = static_cast<int>(indices.size());

  glGenVertexArrays(1, &vertices_);
  glBindVertexArray(vertices_);
  GLuint buffers[2];
  glGenBuffers(2, buffers);
  glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex)), vertices.data(),
               GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(),
               GL_STATIC_DRAW);
  std::size_t at = 0;
  for (GLuint attribute = 0; attribute < 4; ++attribute) {
    const int numbers = attribute < 3 ? 3 : 2;
    glVertexAttribPointer(attribute, numbers, GL_FLOAT, GL_FALSE, sizeof(Vertex), reinterpret_cast<const void*>(at));
    glEnableVertexAttribArray(attribute);
    at += static_cast<std::size_t>(numbers) * sizeof(float);
  }
}

void ShadedLlvmpipe::make_targets() {
  resolved_target_ = framebuffer();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                            renderbuffer(0, GL_RGBA16F, width_, height_));
  expect_complete(0);
  multisample_target_ = framebuffer();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                            renderbuffer(4, GL_RGBA16F, width_, height_));
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                            renderbuffer(4, GL_DEPTH_COMPONENT32F, width_, height_));
  expect_complete(4);
}

void ShadedLlvmpipe::set_uniforms(const PosedScene& scene, float roughness) {
  const auto set = [&](const std::string& name, const Vec3& v) {
    glUniform3f(glGetUniformLocation(program_, name.c_str()), v.x, v.y, v.z);
  };
  const scene::Material& material = scene.capture.materials.at(0);
  load_texture(0, *material.base_color_texture.texture, true);
  load_texture(1, *material.metallic_roughness_texture.texture, false);
  glUniform1f(glGetUniformLocation(program_, "metallic_factor"), material.metallic);
  glUniform1f(glGetUniformLocation(program_, "roughness_factor"), roughness * material.roughness);
  set("eye", Vec3(DVec3(scene.frame->views[0].camera_to_world[3])));
  for (const shaders::Light& light : scene.frame->lights[0]) {
    const bool sun = light.type == shaders::Light::Type::kDirectional;
    set(sun ? "sun_color" : "lamp_color", light.color);
    set(sun ? "sun_direction" : "lamp_position", sun ? light.direction : light.position);
  }
  set("ceiling_light", shaders::kCeiling), set("floor_light", shaders::kFloor);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string at = "[" + std::to_string(k) + "]";
    set("box_axis" + at, shaders::soft_box_axes()[k]);
    set("box_amplitude" + at, shaders::kSoftBoxes[k].amplitude);
  }
  glUniform4fv(glGetUniformLocation(program_, "horizon_widths"), 1, shaders::kHorizonWidths.data());
  const std::vector<float> lobes = lobe_vectors();
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer);
  glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(lobes.size() * sizeof(float)), lobes.data(), GL_STATIC_DRAW);
}

const std::vector<std::uint16_t>& ShadedLlvmpipe::render() {
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, multisample_target_);
  const GLfloat nothing[4] = {}, farthest = 1;
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, multisample_target_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_target_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_target_);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_HALF_FLOAT, image_.data());
  expect_no_error();
  return image_;
}

}  // namespace tessera::bench
