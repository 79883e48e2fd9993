#include "tests/effects/effect_scenes.h"

#include <cmath>

namespace tessera::test {
namespace {

using namespace scene;

std::unique_ptr<Capture> empty_capture() {
  auto capture = std::make_unique<Capture>();
  capture->settings.frame_rate = 1.0;
  capture->settings.shutter_close = 1.0;
  capture->settings.background = Vec3(0.1f, 0.2f, 0.4f);
  return capture;
}

Primitive bent_patches(Random& random, int material) {
  std::vector<Vec3> points;
  for (int k = 0; k < 4; ++k) {
    const Vec3 at(static_cast<float>(k % 2) * 1.2f - 1.2f, static_cast<float>(k / 2) * 1.0f - 1.0f,
                  random.uniform(-0.3f, 0.3f));
    for (Vec3 p : flat_patch(at, {1.1f, 0, random.uniform(-0.1f, 0.1f)}, {0, 0.9f, random.uniform(-0.1f, 0.1f)}))
      points.push_back(p + random.in_box(0.03f));
  }
  return patches(points, material);
}

// A pixel is about 1/150 of the width of the image at a distance of 4: ways from a thousandth of it to a few.
DVec3 small_way(Random& random) {
  const double size = 0.013 * std::pow(2.0, static_cast<double>(random.integer(-10, 2)));
  return DVec3(random.in_box(1)) * size;
}

shaders::Texture alpha_texture(int side, Random& random) {
  Image8 image(side, side, 4);
  std::size_t at = 0;
  const int hole_x = random.integer(0, side - 1), hole_y = random.integer(0, side - 1);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const bool hole = std::abs(x - hole_x) < side / 8 && std::abs(y - hole_y) < side / 8;
      for (int c = 0; c < 3; ++c) image.values[at++] = static_cast<std::uint8_t>(random.integer(60, 255));
      image.values[at++] = static_cast<std::uint8_t>(hole ? random.integer(0, 127) : random.integer(160, 255));
    }
  return shaders::Texture(DecodedImage{image}, shaders::ColorSpace::kSrgb);
}

}  // namespace

std::unique_ptr<Capture> slow_scene(std::uint32_t seed) {
  Random random(seed);
  auto capture = empty_capture();
  Material plain;
  plain.double_sided = true;
  const int material = add_material(*capture, plain);
  for (int k = 0; k < 6; ++k) {
    Primitive primitive = k % 3 == 2 ? closed_patches(material) : bent_patches(random, material);
    if (k == 5)
      primitive = triangles({{-1, -1, 0.1f}, {1, -1, 0}, {1, 1, 0.2f}, {-1, 1, 0}, {0, 0, 0.5f}},
                            {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4}, material);
    const int node = add_node(*capture, primitive, DVec3(random.in_box(1.0f)) + DVec3(0, 0, -0.5 * k));
    capture->nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(0.6);
    if (random.coin()) add_motion(*capture, node, small_way(random));
  }
  Camera camera;
  if (seed % 4 == 1) camera.type = Camera::Type::kOrthographic, camera.x_mag = 1.6f, camera.y_mag = 1.0f;
  if (seed % 2 == 0) {
    camera.lens.aperture_radius =
        random.uniform(1e-6f, 6e-5f);  // so small that parts of the scene are in focus to the last bit
    camera.lens.focus_distance = random.uniform(3.5f, 6.0f);
  }
  add_camera(*capture, {0.1, 0.2, 4}, camera);
  if (seed % 3 == 0) add_motion(*capture, static_cast<int>(capture->nodes.size()) - 1, small_way(random));
  return capture;
}

std::unique_ptr<Capture> partly_displaced_scene(std::uint32_t seed) {
  Random random(seed);
  auto capture = empty_capture();
  for (int k = 0; k < 3; ++k) {
    Material material;
    material.double_sided = true;
    std::vector<float> heights(32 * 32, 0.0f);
    for (int bumps = 0; bumps < k; ++bumps)
      heights[static_cast<std::size_t>(random.integer(0, 1023))] = random.uniform(0.3f, 1.0f);
    material.displacement = displacement(32, 32, heights, random.uniform(0.1f, 0.4f), 0.0f);
    if (seed % 5 == 0 && k == 0) material.displacement->bias = 0.01f;
    const int number = add_material(*capture, material);
    add_node(*capture, bent_patches(random, number), DVec3(random.in_box(0.5f)));
    add_motion(*capture, add_node(*capture, closed_patches(number), DVec3(random.in_box(1.5f))),
               DVec3(random.in_box(0.1f)));
  }
  add_camera(*capture, {0, 0, 5});
  return capture;
}

std::unique_ptr<Capture> masked_scene(std::uint32_t seed) {
  Random random(seed);
  auto capture = empty_capture();
  for (int k = 0; k < 3; ++k) {
    Material material;
    material.double_sided = true;
    material.alpha_mode = AlphaMode::kMask;
    material.alpha_cutoff = 0.5f;
    material.base_color.w = random.coin() ? 1.0f : 0.9f;
    material.base_color_texture.texture = std::make_shared<const shaders::Texture>(alpha_texture(64, random));
    const int number = add_material(*capture, material);
    Primitive primitive = bent_patches(random, number);
    // Each patch reads its own part of the texture, some across its border.
    Vec2 offset(0.0f);
    for (std::size_t v = 0; v < primitive.vertices.texcoords[0].size(); ++v) {
      if (v % 16 == 0) offset = Vec2(random.uniform(-1, 1), random.uniform(-1, 1));
      primitive.vertices.texcoords[0][v] = primitive.vertices.texcoords[0][v] * 0.4f + offset;
    }
    add_node(*capture, primitive, DVec3(random.in_box(0.5f)));
    Primitive mesh = triangles({{-1, -1, 0}, {0, -1, 0}, {0, 0, 0}, {-1, 0, 0}}, {0, 1, 2, 0, 2, 3}, number);
    mesh.vertices.texcoords = {{{0, 0}, {0.25f, 0}, {0.25f, 0.25f}, {0, 0.25f}}};
    for (int copies = 0; copies < 3; ++copies) add_node(*capture, mesh, DVec3(random.in_box(1.0f)));
  }
  add_camera(*capture, {0, 0, 4});
  return capture;
}

std::unique_ptr<Capture> one_moving_ball(const DVec3& ball_way, const DVec3& camera_way) {
  auto capture = empty_capture();
  Material grey;
  grey.double_sided = true;
  const int material = add_material(*capture, grey);
  std::vector<Vec3> wall;
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 8; ++i)
      for (const Vec3& p :
           flat_patch({-4.0f + static_cast<float>(i), -3.0f + static_cast<float>(j), -1}, {1, 0, 0.1f}, {0, 1, 0.05f}))
        wall.push_back(p);
  add_node(*capture, patches(wall, material));
  const int ball = add_node(*capture, closed_patches(material), {-0.5, 0.2, 0.5});
  capture->nodes[static_cast<std::size_t>(ball)].transform.scale = DVec3(0.45);
  add_motion(*capture, ball, ball_way);
  add_camera(*capture, {0, 0, 4});
  if (camera_way != DVec3(0.0)) add_motion(*capture, static_cast<int>(capture->nodes.size()) - 1, camera_way);
  return capture;
}

}  // namespace tessera::test
