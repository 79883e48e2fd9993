#include "bench/support/llvmpipe.h"

#include "bench/support/osmesa_objects.h"

namespace tessera::bench {
namespace {

constexpr const char* kWriteNumber = R"(#version 450
flat in uint number;
layout(location = 0) out uint color;
void main() { color = number; })";

constexpr const char* kStillVertex = R"(#version 450
layout(location = 0) in vec3 position;
layout(location = 1) in uint patch_number;
flat out uint number;
void main() {
  gl_Position = vec4(position, 1.0);
  number = patch_number;
})";

constexpr const char* kMovingVertex = R"(#version 450
layout(location = 0) in vec3 open;
layout(location = 1) in vec3 close;
layout(location = 2) in uint patch_number;
layout(location = 0) uniform float time;
layout(location = 1) uniform vec2 shift;
layout(location = 2) uniform vec2 depth;
flat out uint number;
void main() {
  vec3 p = mix(open, close, time);
  gl_Position = vec4(p.xy + shift * p.z, depth.x * p.z + depth.y, p.z);
  number = patch_number;
})";

// One triangle that covers the whole image.
constexpr const char* kWholeImage = R"(#version 450
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); })";

constexpr const char* kAccumulate = R"(#version 450
layout(location = 0) uniform int count;
layout(binding = 0) uniform usampler2DArray layers;
layout(location = 0) out vec4 color;
void main() {
  vec4 sum = vec4(0.0);
  for (int k = 0; k < count; ++k) sum += unpackUnorm4x8(texelFetch(layers, ivec3(gl_FragCoord.xy, k), 0).r);
  color = sum / float(count);
})";

constexpr const char* kPick = R"(#version 450
layout(location = 0) uniform int which;
layout(binding = 0) uniform usampler2DMS samples;
layout(location = 0) out uint color;
void main() { color = texelFetch(samples, ivec2(gl_FragCoord.xy), which).r; })";

// Makes a vertex array over one interleaved buffer: vectors of three floats, then a number.
template <class Vertex>
GLuint vertex_array(const std::vector<Vertex>& vertices, GLuint indices, GLuint vectors) {
  static_assert(sizeof(Vertex) % (3 * sizeof(float)) == sizeof(std::uint32_t));
  GLuint array = 0, buffer = 0;
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex)), vertices.data(),
               GL_STATIC_DRAW);
  const auto offset = [](GLuint vector) { return reinterpret_cast<const void*>(vector * 3 * sizeof(float)); };
  for (GLuint v = 0; v < vectors; ++v) {
    glVertexAttribPointer(v, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(v));
    glEnableVertexAttribArray(v);
  }
  glVertexAttribIPointer(vectors, 1, GL_UNSIGNED_INT, sizeof(Vertex), offset(vectors));
  glEnableVertexAttribArray(vectors);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
  return array;
}

void clear() {
  const GLuint nothing[4] = {};
  const GLfloat farthest = 1;
  glClearBufferuiv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
}

}  // namespace

Llvmpipe::Llvmpipe(const TriangleList& triangles, int width, int height, int threads, int layers)
    : context_(threads), width_(width), height_(height) {
  // A little room, so that rounding clips no triangle.
  const float near = 0.9f * triangles.near_depth, far = 1.1f * triangles.far_depth;
  depth_a_ = (far + near) / (far - near);
  depth_b_ = -2 * far * near / (far - near);
  still_program_ = link(kStillVertex, kWriteNumber);
  moving_program_ = link(kMovingVertex, kWriteNumber);
  accumulate_program_ = link(kWholeImage, kAccumulate);
  pick_program_ = link(kWholeImage, kPick);
  make_buffers(triangles);
  make_targets(layers);

  glViewport(0, 0, width, height);
  glDepthFunc(GL_LESS);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CW);  // rows run downwards
  expect_no_error();
}

void Llvmpipe::make_buffers(const TriangleList& triangles) {
  struct Still {
    float x, y, z;
    std::uint32_t number;
  };
  struct Moving {
    float open[3], close[3];
    std::uint32_t number;
  };
  std::vector<Still> still(triangles.patch.size());
  std::vector<Moving> moving(triangles.patch.size());
  for (std::size_t v = 0; v < still.size(); ++v) {
    const std::uint32_t number = triangles.patch[v] + 1;
    moving[v].number = number;
    for (std::size_t key = 0; key < 2; ++key) {
      const TriangleList::Vertex& from = triangles.keys[key][v];
      const double x = 2.0 * static_cast<double>(from.x) / width_ - 1.0,
                   y = 2.0 * static_cast<double>(from.y) / height_ - 1.0, z = static_cast<double>(from.z);
      float* to = key == 0 ? moving[v].open : moving[v].close;
      to[0] = static_cast<float>(x * z), to[1] = static_cast<float>(y * z), to[2] = from.z;
      if (key == 0)
        still[v] = {static_cast<float>(x), static_cast<float>(y),
                    static_cast<float>(static_cast<double>(depth_a_) + static_cast<double>(depth_b_) / z), number};
    }
  }
  GLuint indices = 0;
  glGenBuffers(1, &indices);
  glGenVertexArrays(1, &no_vertices_);
  glBindVertexArray(no_vertices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles.indices.size() * sizeof(std::uint32_t)),
               triangles.indices.data(), GL_STATIC_DRAW);
  index_count_ = static_cast<int>(triangles.indices.size());
  still_vertices_ = vertex_array(still, indices, 1);
  moving_vertices_ = vertex_array(moving, indices, 2);
}

void Llvmpipe::make_targets(int layers) {
  multisample_target_ = framebuffer();
  multisample_texture_ = texture(GL_TEXTURE_2D_MULTISAMPLE);
  glTexStorage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, kMultisamples, GL_R32UI, width_, height_, GL_TRUE);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D_MULTISAMPLE, multisample_texture_, 0);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                            renderbuffer(kMultisamples, GL_DEPTH_COMPONENT32F, width_, height_));
  expect_complete(kMultisamples);

  layer_texture_ = texture(GL_TEXTURE_2D_ARRAY);
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_R32UI, width_, height_, layers);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D_ARRAY, filter, GL_NEAREST);
  const GLuint depth = renderbuffer(0, GL_DEPTH_COMPONENT32F, width_, height_);
  for (int layer = 0; layer < layers; ++layer) {
    layer_targets_.push_back(framebuffer());
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, layer_texture_, 0, layer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    expect_complete(0);
  }

  depth_target_ = framebuffer();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                            renderbuffer(0, GL_DEPTH_COMPONENT32F, width_, height_));
  glDrawBuffer(GL_NONE);
  expect_complete(0);

  accumulate_target_ = framebuffer();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                            renderbuffer(0, GL_RGBA16F, width_, height_));
  expect_complete(0);
  pick_target_ = framebuffer();
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                            renderbuffer(0, GL_R32UI, width_, height_));
  expect_complete(0);
}

void Llvmpipe::finish() {
  glFinish();
  expect_no_error();
}

void Llvmpipe::draw_multisampled() {
  glBindFramebuffer(GL_FRAMEBUFFER, multisample_target_);
  glUseProgram(still_program_);
  glBindVertexArray(still_vertices_);
  glEnable(GL_DEPTH_TEST);
  clear();
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

void Llvmpipe::draw_depths() {
  const GLfloat farthest = 1;
  glBindFramebuffer(GL_FRAMEBUFFER, depth_target_);
  glUseProgram(still_program_);
  glBindVertexArray(still_vertices_);
  glEnable(GL_DEPTH_TEST);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

std::array<Llvmpipe::Offset, Llvmpipe::kMultisamples> Llvmpipe::multisample_offsets() {
  std::array<Offset, kMultisamples> offsets;
  glBindFramebuffer(GL_FRAMEBUFFER, multisample_target_);
  for (GLuint k = 0; k < offsets.size(); ++k) {
    GLfloat at[2];
    glGetMultisamplefv(GL_SAMPLE_POSITION, k, at);
    offsets[k] = {at[0], at[1]};
  }
  return offsets;
}

void Llvmpipe::draw_single(int layer, Offset offset, float time) {
  glBindFramebuffer(GL_FRAMEBUFFER, layer_targets_[static_cast<std::size_t>(layer)]);
  glUseProgram(moving_program_);
  glBindVertexArray(moving_vertices_);
  glEnable(GL_DEPTH_TEST);
  glUniform1f(0, time);
  // llvmpipe's sample is in the middle of the pixel, so the scene moves instead.
  glUniform2f(1, (1 - 2 * offset.x) / static_cast<float>(width_), (1 - 2 * offset.y) / static_cast<float>(height_));
  glUniform2f(2, depth_a_, depth_b_);
  clear();
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

void Llvmpipe::accumulate(int count) {
  glBindFramebuffer(GL_FRAMEBUFFER, accumulate_target_);
  glUseProgram(accumulate_program_);
  glBindVertexArray(no_vertices_);
  glDisable(GL_DEPTH_TEST);
  glBindTexture(GL_TEXTURE_2D_ARRAY, layer_texture_);
  glUniform1i(0, count);
  glFrontFace(GL_CCW);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glFrontFace(GL_CW);
}

std::vector<std::uint32_t> Llvmpipe::read_layer(int layer) {
  std::vector<std::uint32_t> image(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_FRAMEBUFFER, layer_targets_[static_cast<std::size_t>(layer)]);
  glReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_INT, image.data());
  expect_no_error();
  return image;
}

std::vector<std::uint32_t> Llvmpipe::read_multisample(int sample) {
  glBindFramebuffer(GL_FRAMEBUFFER, pick_target_);
  glUseProgram(pick_program_);
  glBindVertexArray(no_vertices_);
  glDisable(GL_DEPTH_TEST);
  glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, multisample_texture_);
  glUniform1i(0, sample);
  glFrontFace(GL_CCW);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glFrontFace(GL_CW);
  std::vector<std::uint32_t> image(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  glReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_INT, image.data());
  expect_no_error();
  return image;
}

std::vector<float> Llvmpipe::read_accumulated() {
  std::vector<float> image(4 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_FRAMEBUFFER, accumulate_target_);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, image.data());
  expect_no_error();
  return image;
}

}  // namespace tessera::bench
