#pragma once

#include <vector>

#include "bench/support/osmesa_context.h"
#include "bench/support/posed_scene.h"

namespace tessera::bench {

// A textured scene (SceneSettings::textured) shaded by llvmpipe: Tessera's metallic-roughness shader, studio and lights
// written in GLSL after shaders_cpp/*.inc, with 4x MSAA in half floats, at shutter open.
//
// Vertices are there before: projected, their world positions, normals and texture coordinates evaluated on the patches
// and interpolated between. Images have Tessera's texels and levels, filtered linearly in a level and between two.
// Patches come in reverse order, so that what is in front is drawn first.
class ShadedLlvmpipe {
 public:
  // `roughness` multiplies the image's; 1 is what the scene says.
  ShadedLlvmpipe(const PosedScene& scene, const TriangleList& triangles, int threads, float roughness = 1);

  const std::string& renderer() const { return context_.renderer(); }

  // Clears, draws, resolves and reads the frame: red, green, blue, alpha per pixel as half floats, rows as Tessera's.
  const std::vector<std::uint16_t>& render();

 private:
  void make_vertices(const TriangleList& triangles);
  void make_targets();
  void set_uniforms(const PosedScene& scene, float roughness);

  OsMesaContext context_;
  int width_, height_, index_count_ = 0;
  unsigned program_ = 0, vertices_ = 0, multisample_target_ = 0, resolved_target_ = 0;
  std::vector<std::uint16_t> image_;
};

}  // namespace tessera::bench
