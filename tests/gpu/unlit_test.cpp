// Unlit colours are light as the material has it, with any lamps, and go through the tone map as all light does.
#include "base/color.h"
#include "gpu/device.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/displayed_image.h"
#include "tests/support/tests.h"

namespace tessera::gpu::unlit_test {
namespace {

TEST(UnlitMaterials, AreLightThatIsToneMappedLikeAnyOther) {
  for (const float base : {1.0f, 0.5f, 0.1f})
    for (const float lamp : {0.0f, 50.0f}) {
      scene::Capture capture;
      scene::Material material;
      material.unlit = material.double_sided = true;
      material.base_color = {base, base, base, 1};
      test::add_node(capture, test::triangles({{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, {0, 1, 2},
                                              test::add_material(capture, material)));
      capture.lights.emplace_back();
      capture.lights.back().color = Vec3(lamp);
      capture.light_parameters.emplace_back();
      scene::Node light;
      light.light = 0;
      capture.nodes.push_back(light);
      capture.roots.push_back(1);
      test::add_camera(capture, DVec3(0, 0, 4));
      RunSettings settings;
      Device device(capture, {}, settings, {16, 16, {0, 0, 16, 16}});
      const Image color = device.render(0).targets.color;
      EXPECT_NEAR(color.at(8, 9)[0], base, 1e-6f);
      Image linear(16, 16, 3);
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x)
          for (std::size_t c = 0; c < 3; ++c) linear.at(x, y)[c] = color.at(x, y)[c];
      EXPECT_NEAR(test::displayed(linear).at(8, 9)[0], linear_to_srgb(shaders::tone_map(Vec3(base)).x), 1.0f / 255);
    }
}

}  // namespace
}  // namespace tessera::gpu::unlit_test
