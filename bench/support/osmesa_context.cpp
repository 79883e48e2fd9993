#include "bench/support/osmesa_context.h"

#include <cstdlib>
#include <stdexcept>

#include <fmt/format.h>

#include "bench/support/osmesa_objects.h"

namespace tessera::bench {
namespace {

GLuint compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint done = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
  if (done != 0) return shader;
  char log[1000] = {};
  glGetShaderInfoLog(shader, sizeof(log) - 1, nullptr, log);
  throw std::runtime_error(fmt::format("a shader does not compile: {}", log));
}

}  // namespace

OsMesaContext::OsMesaContext(int threads) {
  // Mesa reads these when it makes its first context. A driver that the user has set stays, and is refused below.
  setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
  setenv("GALLIUM_DRIVER", "llvmpipe", 0);
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            0,
                            OSMESA_STENCIL_BITS,
                            0,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            4,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            5,
                            0};
  const OSMesaContext context = OSMesaCreateContextAttribs(attributes, nullptr);
  if (context == nullptr || OSMesaMakeCurrent(context, front_buffer_.data(), GL_UNSIGNED_BYTE, 1, 1) == GL_FALSE)
    throw std::runtime_error(
        "OSMesa gives no context of OpenGL 4.5 (GALLIUM_DRIVER must not name another driver than llvmpipe)");
  context_ = context;
  renderer_ = fmt::format("{}, {}", reinterpret_cast<const char*>(glGetString(GL_RENDERER)),
                          reinterpret_cast<const char*>(glGetString(GL_VERSION)));
  if (renderer_.find("llvmpipe") == std::string::npos)
    throw std::runtime_error(fmt::format("the renderer is not llvmpipe: {}", renderer_));
}

OsMesaContext::~OsMesaContext() { OSMesaDestroyContext(static_cast<OSMesaContext>(context_)); }

GLuint link(const char* vertex, const char* fragment) {
  const GLuint program = glCreateProgram();
  for (const GLuint shader : {compile(GL_VERTEX_SHADER, vertex), compile(GL_FRAGMENT_SHADER, fragment)}) {
    glAttachShader(program, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(program);
  GLint done = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &done);
  if (done == 0) throw std::runtime_error("a program of shaders does not link");
  return program;
}

GLuint texture(GLenum kind) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(kind, name);
  return name;
}

GLuint renderbuffer(int samples, GLenum format, int width, int height) {
  GLuint name = 0;
  glGenRenderbuffers(1, &name);
  glBindRenderbuffer(GL_RENDERBUFFER, name);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
  return name;
}

GLuint framebuffer() {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  glBindFramebuffer(GL_FRAMEBUFFER, name);
  return name;
}

void expect_complete(int samples) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw std::runtime_error("llvmpipe refuses a render target");
  GLint got = 0;
  glGetIntegerv(GL_SAMPLES, &got);
  if (got != samples) throw std::runtime_error(fmt::format("llvmpipe gives {} samples instead of {}", got, samples));
}

void expect_no_error() {
  if (const GLenum error = glGetError(); error != GL_NO_ERROR)
    throw std::runtime_error(fmt::format("OpenGL error {:#x}", error));
}

}  // namespace tessera::bench
