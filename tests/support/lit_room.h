#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "scene/made_capture.h"
#include "tests/support/captures.h"

namespace tessera::test {

inline int add_lamp(scene::Capture& capture, const shaders::Light& light, const DVec3& place,
                    const DVec3& direction = DVec3(0, -1, 0)) {
  const int number = static_cast<int>(capture.lights.size());
  capture.lights.push_back(light);
  capture.light_parameters.emplace_back();
  capture.light_parameters.back().color = light.color;
  scene::Node node;
  node.light = number;
  node.transform.translation = place;
  node.transform.rotation = scene::made::looking(direction);
  capture.nodes.push_back(node);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  return capture.roots.back();
}

inline shaders::Light lamp(shaders::Light::Type type, float range, float strength) {
  shaders::Light light;
  light.type = type, light.range = range, light.color = Vec3(strength, 0.8f * strength, 0.6f * strength);
  light.cos_inner = 0.9f, light.cos_outer = 0.6f;
  return light;
}

inline std::shared_ptr<const shaders::Texture> noise(std::uint32_t seed, shaders::ColorSpace space) {
  Random random(seed);
  Image8 texels(16, 16, 4);
  for (std::uint8_t& value : texels.values) value = static_cast<std::uint8_t>(random.integer(0, 255));
  return std::make_shared<const shaders::Texture>(DecodedImage{std::move(texels)}, space);
}

// A textured, a glowing, an unlit and a coated surface and two panes of glass, with ten ranged lamps and a sun.
struct Room {
  scene::Capture capture;
  int camera = 0, ball = 0, first_lamp = 0, shiny = 0;

  Room() {
    scene::Material textured;
    textured.double_sided = true;
    textured.base_color_texture.texture = noise(1, shaders::ColorSpace::kSrgb);
    textured.metallic_roughness_texture.texture = noise(2, shaders::ColorSpace::kLinear);
    textured.occlusion_texture.texture = noise(3, shaders::ColorSpace::kLinear);
    textured.normal_texture.texture = noise(4, shaders::ColorSpace::kLinear);
    textured.normal_scale = 0.3f;
    add_node(capture, patches(flat_patch({-4, -1, 2}, {8, 0, 0}, {0, 0, -10}), add_material(capture, textured)));
    scene::Material glowing;
    glowing.metallic = 0, glowing.roughness = 0.3f, glowing.emissive = {0.4f, 2.5f, 0.1f};
    ball = add_node(capture, closed_patches(add_material(capture, glowing)), {-1, 0, -1});
    scene::Material plain;
    plain.base_color = {0.7f, 0.2f, 0.1f, 1}, plain.roughness = 0.2f;
    scene::Primitive waves = wavy_grid(6, 5);
    waves.material = add_material(capture, plain);
    shiny = add_node(capture, waves, {-2, -0.6, -3});
    scene::Material unlit;
    unlit.unlit = true, unlit.base_color = {0.1f, 0.3f, 0.9f, 1};
    add_node(capture, closed_patches(add_material(capture, unlit)), {2.2, 0.5, -3});
    scene::Material coated;
    coated.clearcoat.factor = 0.8f, coated.effects[static_cast<std::size_t>(scene::MaterialEffect::kClearcoat)] = true;
    add_node(capture, closed_patches(add_material(capture, coated)), {1.2, 0, -2});
    scene::Material glass;
    glass.alpha_mode = scene::AlphaMode::kBlend, glass.base_color = {0.3f, 0.7f, 0.6f, 0.4f}, glass.double_sided = true;
    const int pane = add_material(capture, glass);
    for (const double z : {0.2, -1.9})
      add_node(capture, patches(flat_patch({-1.5, -1, 0}, {3, 0, 0}, {0, 1.5, 0}), pane), {0, 0, z});
    camera = add_camera(capture, {0.2, 0.6, 4});
    Random random(9);
    for (int k = 0; k < 10; ++k) {
      const Vec3 at = random.in_box(2.0f);
      const int node = add_lamp(capture,
                                lamp(k % 3 == 0 ? shaders::Light::Type::kSpot : shaders::Light::Type::kPoint,
                                     random.uniform(1.0f, 4.0f), random.uniform(0.5f, 4.0f)),
                                DVec3(at) + DVec3(0, 1.2, -2));
      if (k == 0) first_lamp = node;
    }
    add_lamp(capture, lamp(shaders::Light::Type::kDirectional, 0, 1.0f), {0, 4, 0}, {0.4, -1, -0.3});
    capture.settings.environment = 0.2f;
    capture.settings.frame_rate = 1;
  }
};

}  // namespace tessera::test
