#include "bench/support/llvmpipe_shaded.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "bench/support/llvmpipe_glsl.h"
#include "bench/support/osmesa_objects.h"
#include "shaders_cpp/environment.h"

namespace tessera::bench {
namespace {

// ---- Images -----------------------------------------------------------------------------------------------------

// All levels of a texture.
GLuint load_texture(const shaders::Texture& from) {
  const GLuint name = texture(GL_TEXTURE_2D);
  const bool srgb = from.color_space() == shaders::ColorSpace::kSrgb;
  glTexStorage2D(GL_TEXTURE_2D, from.level_count(), srgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, from.width(), from.height());
  for (int level = 0; level < from.level_count(); ++level)
    glTexSubImage2D(GL_TEXTURE_2D, level, 0, 0, from.width(level), from.height(level), GL_RGBA, GL_UNSIGNED_BYTE,
                    from.stored_level(level).rgba.data());
  return name;
}

GLuint sampler(const shaders::Sampler& from) {
  const auto wrap = [](shaders::Wrap w) {
    return w == shaders::Wrap::kRepeat           ? GL_REPEAT
           : w == shaders::Wrap::kMirroredRepeat ? GL_MIRRORED_REPEAT
                                                 : GL_CLAMP_TO_EDGE;
  };
  constexpr GLint kMinify[3][2] = {{GL_NEAREST, GL_LINEAR},
                                   {GL_NEAREST_MIPMAP_NEAREST, GL_LINEAR_MIPMAP_NEAREST},
                                   {GL_NEAREST_MIPMAP_LINEAR, GL_LINEAR_MIPMAP_LINEAR}};
  GLuint name = 0;
  glGenSamplers(1, &name);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_S, wrap(from.wrap_s));
  glSamplerParameteri(name, GL_TEXTURE_WRAP_T, wrap(from.wrap_t));
  glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, from.magnify_linear ? GL_LINEAR : GL_NEAREST);
  glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER,
                      kMinify[static_cast<std::size_t>(from.mip)][from.minify_linear ? 1 : 0]);
  return name;
}

float half_value(std::uint16_t half) {
  const int exponent = half >> 10 & 31, fraction = half & 1023;
  const float size = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                   : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
  return half >> 15 != 0 ? -size : size;
}

// ---- Light ------------------------------------------------------------------------------------------------------

// The table of studio.h row by row, with the boxes side by side.
std::vector<Vec4> lobe_vectors() {
  std::vector<Vec4> out;
  for (const shaders::EnvironmentLobes& row : shaders::kEnvironmentLobes) {
    const auto of_boxes = [&](float shaders::LobeFit::*part) {
      return Vec3(row.box[0].*part, row.box[1].*part, row.box[2].*part);
    };
    out.emplace_back(row.horizon[0], row.horizon[1], row.horizon[2], row.horizon[3]);
    out.emplace_back(row.slope, of_boxes(&shaders::LobeFit::sharpness));
    for (const auto part : {&shaders::LobeFit::narrow, &shaders::LobeFit::broad, &shaders::LobeFit::constant,
                            &shaders::LobeFit::linear, &shaders::LobeFit::quadratic})
      out.emplace_back(of_boxes(part), 0.0f);
  }
  return out;
}

}  // namespace

// ---- Set-up before the measurement ------------------------------------------------------------------------------

ShadedLlvmpipe::ShadedLlvmpipe(const ShadedFrame& frame, int threads, float roughness)
    : context_(threads),
      width_(frame.geometry.request.width),
      height_(frame.geometry.request.height),
      roughness_(roughness) {
  const ShadedTriangles triangles = list_shaded_triangles(frame.geometry, frame.patches);
  triangle_count_ = triangles.triangle_count();
  make_vertices(triangles);
  make_targets();
  make_constants(frame);
  make_background(frame);
  for (const ShadedTriangles::Draw& d : triangles.draws)
    draws_.push_back(make_draw(d, frame.geometry.lights[0].size()));
  glViewport(0, 0, width_, height_);
  // The library does not export this function by name.
  reinterpret_cast<PFNGLCLIPCONTROLPROC>(OSMesaGetProcAddress("glClipControl"))(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glFrontFace(GL_CW);  // rows run downwards
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glEnable(GL_DEPTH_TEST);
  image_.resize(4 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  expect_no_error();
}

void ShadedLlvmpipe::make_vertices(const ShadedTriangles& triangles) {
  using Vertex = ShadedTriangles::Vertex;
  glGenVertexArrays(1, &vertices_);
  glBindVertexArray(vertices_);
  GLuint buffers[2];
  glGenBuffers(2, buffers);
  const auto fill = [](GLenum kind, GLuint buffer, const auto& values) {
    glBindBuffer(kind, buffer);
    glBufferData(kind, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])), values.data(), GL_STATIC_DRAW);
  };
  fill(GL_ARRAY_BUFFER, buffers[0], triangles.vertices);
  fill(GL_ELEMENT_ARRAY_BUFFER, buffers[1], triangles.indices);
  GLuint attribute = 0;
  const auto add = [&](int numbers, std::size_t at) {
    glVertexAttribPointer(attribute, numbers, GL_FLOAT, GL_FALSE, sizeof(Vertex), reinterpret_cast<const void*>(at));
    glEnableVertexAttribArray(attribute++);
  };
  add(4, offsetof(Vertex, clip));
  add(3, offsetof(Vertex, position));
  add(3, offsetof(Vertex, normal));
  add(2, offsetof(Vertex, texcoord));
  add(4, offsetof(Vertex, color));
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

// Makes the constant block that all programs share.
void ShadedLlvmpipe::make_constants(const ShadedFrame& frame) {
  if (frame.around.kind != shaders::Surroundings::Kind::kStudio)
    throw std::runtime_error("llvmpipe has the studio alone");
  const float intensity = frame.around.intensity;
  std::vector<Vec4> block = lobe_vectors();
  const auto add = [&](const Vec3& v, float w) { block.push_back({v.x, v.y, v.z, w}); };
  const auto& widths = shaders::kHorizonWidths;
  block.push_back({widths[0], widths[1], widths[2], widths[3]});
  add(shaders::kCeiling * intensity, 0), add(shaders::kFloor * intensity, 0);
  for (const Vec3& axis : shaders::soft_box_axes()) add(axis, 0);
  for (const shaders::SoftBox& box : shaders::kSoftBoxes) add(box.amplitude * intensity, 0);
  add(Vec3(DVec3(frame.geometry.views[0].camera_to_world[3])), 0);
  for (const shaders::Light& light : frame.geometry.lights[0]) {
    if (light.type == shaders::Light::Type::kSpot) throw std::runtime_error("llvmpipe has no spot lights");
    const bool point = light.type == shaders::Light::Type::kPoint;
    add(point ? light.position : -light.direction, point ? 1 : 0);
    add(light.color, point && light.range > 0 ? 1 / (light.range * light.range) : 0);
  }
  add(Vec3(0), 0);
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer);
  glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(block.size() * sizeof(Vec4)), block.data(), GL_STATIC_DRAW);
}

void ShadedLlvmpipe::make_background(const ShadedFrame& frame) {
  clear_color_ = frame.background.value_or(Vec3(0));
  if (frame.background || !frame.studio_is_seen) return;
  background_program_ = link(kBackgroundVertex, kBackgroundFragment);
  glUseProgram(background_program_);
  const scene::Projection& p = frame.geometry.projection;
  // Rows run downwards, and the camera looks along -z.
  const DMat3 ray = DMat3(frame.geometry.views[0].camera_to_world) *
                    DMat3(DVec3(1, 0, 0), DVec3(0, -1, 0), DVec3(-p.center_x, p.center_y, -p.scale));
  const Mat3 numbers(ray);
  glUniformMatrix3fv(0, 1, GL_FALSE, &numbers[0][0]);
  for (const int k : {0, 1}) {
    const auto light = shaders::studio_background(k == 0 ? -1.0f : 1.0f, frame.around.intensity);
    glUniform3f(1 + k, light.x, light.y, light.z);
  }
}

ShadedLlvmpipe::Draw ShadedLlvmpipe::make_draw(const ShadedTriangles::Draw& from, std::size_t lights) {
  const scene::Material& m = *from.material;
  const bool masked = m.alpha_mode == scene::AlphaMode::kMask;
  Draw out{&m, 0, 0, {}, {}, from.first, from.count};
  std::string macros = "#version 450\n#define LIGHTS " + std::to_string(lights) + "\n";
  const auto define = [&](bool wanted, const char* name) {
    if (wanted) macros += std::string("#define ") + name + "\n";
  };
  define(m.alpha_mode == scene::AlphaMode::kBlend, "BLEND");
  define(m.double_sided, "DOUBLE_SIDED");
  define(m.unlit, "UNLIT");
  define(from.colored, "COLORS");
  const std::pair<const scene::TextureSlot*, const char*> images[] = {
      {&m.base_color_texture, "BASE_IMAGE"},
      {&m.metallic_roughness_texture, "METALLIC_ROUGHNESS_IMAGE"},
      {&m.emissive_texture, "EMISSIVE_IMAGE"}};
  for (std::size_t unit = 0; unit < 3; ++unit) {
    const auto& [slot, name] = images[unit];
    const bool read = slot->texture != nullptr && (unit == 0 || !m.unlit);
    define(read, name);
    if (read) out.textures[unit] = texture_of(*slot->texture), out.samplers[unit] = sampler(slot->sampler);
  }
  out.program = program_of(macros);
  define(masked, "MASK_ALONE");
  if (masked) out.mask_program = program_of(macros);
  return out;
}

unsigned ShadedLlvmpipe::program_of(const std::string& macros) {
  unsigned& program = programs_[macros];
  if (program == 0) program = link((macros + kShadedVertex).c_str(), (macros + kShadedFragment).c_str());
  return program;
}

unsigned ShadedLlvmpipe::texture_of(const shaders::Texture& from) {
  unsigned& name = textures_[&from];
  if (name == 0) name = load_texture(from);
  return name;
}

// ---- The frame --------------------------------------------------------------------------------------------------

void ShadedLlvmpipe::draw(const Draw& draw, unsigned program) const {
  const scene::Material& m = *draw.material;
  (m.double_sided ? glDisable : glEnable)(GL_CULL_FACE);
  glUseProgram(program);
  glUniform4f(0, m.base_color.x, m.base_color.y, m.base_color.z, m.base_color.w);
  glUniform3f(1, m.emissive.x, m.emissive.y, m.emissive.z);
  glUniform3f(2, m.metallic, roughness_ * m.roughness, m.alpha_cutoff);
  for (GLuint unit = 0; unit < 3; ++unit)
    if (draw.textures[unit] != 0) {
      glActiveTexture(GL_TEXTURE0 + unit);
      glBindTexture(GL_TEXTURE_2D, draw.textures[unit]);
      glBindSampler(unit, draw.samplers[unit]);
    }
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(draw.count), GL_UNSIGNED_INT,
                 reinterpret_cast<const void*>(draw.first * sizeof(std::uint32_t)));
}

void ShadedLlvmpipe::draw_all(scene::AlphaMode mode, bool masks) const {
  const bool blended = mode == scene::AlphaMode::kBlend, again = mode == scene::AlphaMode::kMask && !masks;
  (blended ? glEnable : glDisable)(GL_BLEND);
  glColorMask(!masks, !masks, !masks, !masks);
  glDepthMask(!blended && !again);
  glDepthFunc(again ? GL_EQUAL : GL_GREATER);
  for (const Draw& d : draws_)
    if (d.material->alpha_mode == mode) draw(d, masks ? d.mask_program : d.program);
}

// Draws where no surface has been drawn.
void ShadedLlvmpipe::draw_background() const {
  if (background_program_ == 0) return;
  glDisable(GL_CULL_FACE);
  glDepthFunc(GL_EQUAL);
  glUseProgram(background_program_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

const std::vector<std::uint16_t>& ShadedLlvmpipe::render() {
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, multisample_target_);
  const GLfloat clear[4] = {clear_color_.x, clear_color_.y, clear_color_.z, 1}, farthest = 0;
  glDepthMask(GL_TRUE);
  glClearBufferfv(GL_COLOR, 0, clear);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  draw_all(scene::AlphaMode::kOpaque, false);
  draw_all(scene::AlphaMode::kMask, true);
  draw_all(scene::AlphaMode::kMask, false);
  draw_background();
  draw_all(scene::AlphaMode::kBlend, false);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, multisample_target_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_target_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_target_);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_HALF_FLOAT, image_.data());
  expect_no_error();
  return image_;
}

Image ShadedLlvmpipe::image() const {
  Image out(width_, height_, 4);
  std::transform(image_.begin(), image_.end(), out.values.begin(), half_value);
  return out;
}

}  // namespace tessera::bench
