#pragma once

#include "tests/replay/desampled_comparison.h"
#include "tests/support/tests.h"

// Scenes of patterned boards that move, without a shutter.
namespace tessera::replay {

enum class Pattern { kChecker, kNoise, kStripes };

// A pattern of `side` texels with cells of eight texels.
inline std::shared_ptr<shaders::Texture> pattern_texture(Pattern pattern, int side) {
  Image8 image(side, side, 3);
  test::Random random(7);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (std::size_t k = 0; k < 3; ++k) {
        const int cell = pattern == Pattern::kStripes ? x / 8 : x / 8 + y / 8;
        image.at(x, y)[k] = static_cast<std::uint8_t>(pattern == Pattern::kNoise ? random.integer(80, 220)
                                                                                 : (cell % 2 == 0 ? 60 : 200));
      }
  return std::make_shared<shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kSrgb);
}

// A board across (x0, y0) to (x1, y1) at depth z, with `repeats` of the texture for each unit.
inline int add_board(scene::Capture& capture, Vec2 low, Vec2 high, float z, Pattern pattern, float repeats) {
  scene::Material material;
  material.base_color = Vec4(1.0f);
  material.roughness = 0.7f;
  material.metallic = 0.0f;
  material.double_sided = true;
  material.base_color_texture.texture = pattern_texture(pattern, 64);
  scene::Primitive board =
      test::triangles({{low.x, low.y, z}, {high.x, low.y, z}, {low.x, high.y, z}, {high.x, high.y, z}},
                      {0, 1, 3, 0, 3, 2}, test::add_material(capture, material));
  board.vertices.texcoords = {{{repeats * low.x, repeats * low.y},
                               {repeats * high.x, repeats * low.y},
                               {repeats * low.x, repeats * high.y},
                               {repeats * high.x, repeats * high.y}}};
  return test::add_node(capture, board);
}

// The whole frame: 60 pixels for each unit, so 2 * `way` pixels a frame.
inline scene::Capture sliding_board(Pattern pattern, float repeats, const DVec3& way) {
  scene::Capture capture;
  capture.settings.width = DesampledComparison::kWidth, capture.settings.height = DesampledComparison::kHeight;
  const int node = add_board(capture, {-16, -16}, {16, 16}, 0, pattern, repeats);
  test::add_camera(capture, {0, 0, 6});
  test::add_motion(capture, node, way);
  return capture;
}

}  // namespace tessera::replay
