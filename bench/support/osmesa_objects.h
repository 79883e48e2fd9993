#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
// After the base header.
#include <GL/glext.h>

namespace tessera::bench {

// OpenGL's objects, made in the context in force and bound. All throw std::runtime_error where OpenGL refuses.

// A program of two shaders, not bound.
GLuint link(const char* vertex, const char* fragment);
GLuint texture(GLenum kind);
GLuint renderbuffer(int samples, GLenum format, int width, int height);
GLuint framebuffer();
// Of the framebuffer that is bound.
void expect_complete(int samples);
void expect_no_error();

}  // namespace tessera::bench
