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

// What llvmpipe shades: a frame at shutter open, the patches of it that are drawn, what lights them from all around (the
// studio), and what is behind everything: a colour, or the studio where that is seen at all.
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
// Vertices are there before: projected, homogeneous, so that OpenGL clips what is behind the camera; their world positions,
// normals, texture coordinates and colours evaluated on the patches and interpolated between. Images have Tessera's
// texels, levels and samplers. Draws are those of ShadedTriangles, one a material and run, with a program for what that
// material has. Masks write depths first, by a program that does nothing else but discard, and are shaded then where
// depths are the same, so that what is hidden is not. Materials have their factors and images of base colour, of metalness
// and roughness, and of emission; masks, blending, two sides, and unlit shading. Left out, which makes llvmpipe's work the
// smaller one: normal and occlusion maps, further layers (transmission among them: such surfaces are opaque), and the own
// shading and textures of procedures.
class ShadedLlvmpipe {
 public:
  // `roughness` multiplies the materials'; 1 is what the scene says. Throws std::runtime_error for what is neither left
  // out nor there: orthographic cameras, spot lights, surroundings other than the studio, images at several coordinates.
  ShadedLlvmpipe(const ShadedFrame& frame, int threads, float roughness = 1);

  const std::string& renderer() const { return context_.renderer(); }
  std::size_t triangle_count() const { return triangle_count_; }

  // Clears, draws, resolves and reads the frame: red, green, blue, alpha per pixel as half floats, rows as Tessera's.
  const std::vector<std::uint16_t>& render();

  // The frame that was read last.
  Image image() const;

 private:
  // A draw of ShadedTriangles with OpenGL's names; textures are 0 where the program reads none, mask_program where there
  // is no mask.
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
  // Those of materials of one kind; `masks`: their masks alone.
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
  unsigned background_program_ = 0;  // 0: the studio is not seen
  unsigned vertices_ = 0, multisample_target_ = 0, resolved_target_ = 0;
  std::vector<std::uint16_t> image_;
};

}  // namespace tessera::bench
