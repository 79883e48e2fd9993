#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
// After the base header.
#include <GL/glext.h>

namespace tessera::bench {

// OpenGL objects, made in the current context and bound. All functions throw std::runtime_error if OpenGL refuses.

// Links a program of two shaders without binding it.
GLuint link(const char* vertex, const char* fragment);
GLuint texture(GLenum kind);
GLuint renderbuffer(int samples, GLenum format, int width, int height);
GLuint framebuffer();
// Checks the bound framebuffer.
void expect_complete(int samples);
void expect_no_error();

}  // namespace tessera::bench
