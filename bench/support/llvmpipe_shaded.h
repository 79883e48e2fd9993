#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/image.h"
#include "bench/support/osmesa_context.h"
#include "bench/support/shaded_triangles.h"
#include "shaders_cpp/surroundings.h"

namespace tessera::bench {

// Input of llvmpipe: the `patches` of a frame at shutter open. The studio lights them from all sides. The background
// is a colour or, where samples see it, the studio.
struct ShadedFrame {
  const scene::FrameGeometry& geometry;
  const std::vector<std::uint32_t>& patches;
  shaders::Surroundings around;
  std::optional<Vec3> background{};
  bool studio_is_seen = false;
};

// A frame shaded by llvmpipe: Tessera's metallic-roughness shader, studio and lights written in GLSL after
// shaders_cpp/*.inc, with 4x MSAA in half floats.
//
// The vertices are computed before the time is taken. They have homogeneous clip coordinates, so that OpenGL clips
// triangles behind the camera, and world positions, normals, texture coordinates and colours, for which the patches
// are evaluated. Textures have Tessera's texels, levels and samplers. Each draw of ShadedTriangles runs a program
// that is compiled for the features of its material. A masked draw first writes depths with a program that only
// discards; a second pass shades it where the depth is equal, so that hidden fragments cost no shading. Materials
// keep factors and textures of base colour, of metalness and roughness, and of emission; alpha masks, blending, two
// sides, and unlit shading. The program leaves out normal and occlusion maps, further layers (a transmissive surface
// is drawn opaque), and procedures' own shading and textures. Each of these makes llvmpipe's work smaller.
class ShadedLlvmpipe {
 public:
  // `roughness` multiplies the roughness of all materials. Throws std::runtime_error for orthographic cameras, spot
  // lights, surroundings other than the studio, and materials that read their textures at several coordinates.
  ShadedLlvmpipe(const ShadedFrame& frame, int threads, float roughness = 1);

  const std::string& renderer() const { return context_.renderer(); }
  std::size_t triangle_count() const { return triangle_count_; }

  // Clears, draws, resolves and reads the frame: red, green, blue, alpha per pixel as half floats, rows as in Tessera.
  const std::vector<std::uint16_t>& render();

  // The image of the last render().
  Image image() const;

 private:
  // A draw of ShadedTriangles with OpenGL's names: 0 for a texture that the program does not read, and for a mask_program
  // without a mask.
  struct Draw {
    const scene::Material* material;
    unsigned program, mask_program, textures[3], samplers[3];
    std::size_t first, count;
  };
  void make_vertices(const ShadedTriangles& triangles);
  void make_targets();
  void make_constants(const ShadedFrame& frame);
  void make_background(const ShadedFrame& frame);
  Draw make_draw(const ShadedTriangles::Draw& from, std::size_t lights);
  unsigned program_of(const std::string& macros);
  unsigned texture_of(const shaders::Texture& from);
  void draw(const Draw& draw, unsigned program) const;
  // Draws all materials of one alpha mode; `masks` draws only their masks, into the depth buffer.
  void draw_all(scene::AlphaMode mode, bool masks) const;
  void draw_background() const;

  OsMesaContext context_;
  int width_, height_;
  float roughness_;
  std::size_t triangle_count_;
  std::vector<Draw> draws_;
  std::map<std::string, unsigned> programs_;  // by their macros
  std::map<const shaders::Texture*, unsigned> textures_;
  Vec3 clear_color_{0.0f};
  unsigned background_program_ = 0;  // 0: the studio is not visible
  unsigned vertices_ = 0, multisample_target_ = 0, resolved_target_ = 0;
  std::vector<std::uint16_t> image_;
};

}  // namespace tessera::bench
