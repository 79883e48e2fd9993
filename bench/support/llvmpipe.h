#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/support/osmesa_context.h"
#include "bench/support/posed_scene.h"

namespace tessera::bench {

// Draws a list of triangles with llvmpipe, Mesa's software rasterizer, offscreen (OSMesa).
//
// The constructor makes vertices, indices and targets; draws use them in place. For each sample an image holds the
// patch number + 1, or 0 where the sample sees no triangle. A fragment shader writes this number and does no other
// work; back faces are culled. Positions are Tessera's snapped ones, so llvmpipe's own snap to 1/256 pixel changes
// nothing at shutter open and close.
//
// Pixel rows run downwards, as in Tessera.
class Llvmpipe {
 public:
  static constexpr int kMultisamples = 4;

  // `layers`: number of single-sample images that exist at once. See OsMesaContext.
  Llvmpipe(const TriangleList& triangles, int width, int height, int threads, int layers);

  const std::string& renderer() const { return context_.renderer(); }

  // Draws return before the image is finished; finish() waits for it.
  void finish();

  // Draws the frame at shutter open with four samples per pixel. A vertex is a position in clip space with w = 1, and a number.
  void draw_multisampled();
  // Positions of those samples inside their pixel.
  struct Offset {
    float x, y;
  };
  std::array<Offset, kMultisamples> multisample_offsets();

  // Draws the frame at `time` in [0, 1] with one sample per pixel, at `offset`, into a layer. A vertex has both
  // motion keys' positions times their depths, which move linearly, and a number; the vertex shader interpolates.
  void draw_single(int layer, Offset offset, float time);
  // Draws depths of the frame at shutter open alone, one sample in the middle of each pixel.
  void draw_depths();
  // Computes the mean over the first `count` layers of a colour made from the number, in half floats.
  void accumulate(int count);

  std::vector<std::uint32_t> read_layer(int layer);
  std::vector<std::uint32_t> read_multisample(int sample);
  std::vector<float> read_accumulated();  // red, green, blue, alpha per pixel

 private:
  void make_buffers(const TriangleList& triangles);
  void make_targets(int layers);

  OsMesaContext context_;
  int width_, height_, index_count_ = 0;
  float depth_a_, depth_b_;  // depth of clip space = a * z + b
  // Names of OpenGL objects.
  unsigned still_program_ = 0, moving_program_ = 0, accumulate_program_ = 0, pick_program_ = 0;
  unsigned still_vertices_ = 0, moving_vertices_ = 0, no_vertices_ = 0;
  unsigned depth_target_ = 0, multisample_target_ = 0, multisample_texture_ = 0, layer_texture_ = 0,
           accumulate_target_ = 0, pick_target_ = 0;
  std::vector<unsigned> layer_targets_;
};

}  // namespace tessera::bench
