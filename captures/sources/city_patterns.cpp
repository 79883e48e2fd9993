#include "captures/sources/city_patterns.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "captures/sources/patterns.h"

namespace tessera::captures {
namespace {

float fraction(float x) { return x - std::floor(x); }

// Distance to the border of the cell [0, 1)^2, in units in which a cell measures (width, height).
float border(float x, float y, float width, float height) {
  return std::min(std::min(x, 1.0f - x) * width, std::min(y, 1.0f - y) * height);
}

// Courses of stones, each second one shifted by half a stone.
struct Stone {
  float edge;  // distance to the joint in metres
  std::uint32_t number;
};
Stone courses(float u, float v, int along, int rows, float metres) {
  const float y = v * static_cast<float>(rows);
  const auto row = static_cast<std::uint32_t>(y);
  const float x = u * static_cast<float>(along) + (row & 1u ? 0.5f : 0.0f);
  const auto column = static_cast<std::uint32_t>(x) % static_cast<std::uint32_t>(along);
  return {border(fraction(x), fraction(y), metres / static_cast<float>(along), metres / static_cast<float>(rows)),
          hash32(31, row, column)};
}
float unit(std::uint32_t number) { return static_cast<float>(number & 255u) / 255.0f; }

Stone bricks(float u, float v) { return courses(u, v, 8, 26, 2.0f); }
Stone ashlars(float u, float v) { return courses(u, v, 2, 5, 2.0f); }
Stone slabs(float u, float v) { return courses(u, v, 3, 4, 2.4f); }
Stone slates(float u, float v) { return courses(u, v, 8, 10, 2.0f); }

// Content of an atlas of panes at a point of a tile: frame or glass.
struct Pane {
  bool frame;
  float height;
  Vec3 color;
};

Vec3 glass_color(int tile, float x, float y) {
  // A dark room behind a reflection of the sky, which the reflected roofs of the opposite houses cut off.
  const float roofs = smooth_step(0.50f, 0.62f, y + 0.25f * x + 0.05f * static_cast<float>(tile % 3));
  Vec3 color = mix(Vec3(0.34f, 0.42f, 0.50f) * (1.0f - 0.45f * y), Vec3(0.10f, 0.11f, 0.12f), roofs);
  const float fold = 0.82f + 0.18f * std::sin(x * (tile & 1 ? 70.0f : 52.0f));
  const Vec3 cloth = tile < 2    ? Vec3(0.72f, 0.70f, 0.64f)
                     : tile == 2 ? Vec3(0.55f, 0.42f, 0.36f)
                                 : Vec3(0.66f, 0.66f, 0.70f);
  const float open = 0.12f + 0.05f * static_cast<float>(tile) + 0.06f * y;
  if (tile < 3 && (x < open || x > 1.0f - open)) color = cloth * fold * 0.75f;                  // curtains
  if (tile == 3 && y < 0.45f) color = cloth * (0.72f + 0.08f * std::sin(y * 150.0f));           // a blind
  if (tile == 4 && y > 0.82f && std::abs(x - 0.4f) < 0.12f) color = Vec3(0.20f, 0.30f, 0.12f);  // a plant
  return color;
}

Pane window_pane(int tile, float x, float y) {
  // A sash window: two by three panes, the lower sash behind the upper.
  constexpr float kOuter = 0.065f, kBar = 0.018f;
  const bool outer = border(x, y, 1.0f, 1.6f) < kOuter;
  const bool middle = std::abs(y - 0.5f) < 0.022f, upright = std::abs(x - 0.5f) < kBar,
             across = tile % 3 != 1 && (std::abs(y - 0.25f) < 0.012f || std::abs(y - 0.75f) < 0.012f);
  const bool frame = outer || middle || upright || across;
  const Vec3 paint(0.86f, 0.85f, 0.81f);
  return {frame,
          outer || middle ? 1.0f
          : frame         ? 0.7f
                          : 0.3f,
          frame ? paint * (outer ? 0.95f : 1.0f) : glass_color(tile, x, y)};
}

Pane door_pane(float x, float y) {
  const Vec3 paint(0.10f, 0.22f, 0.17f);
  if (border(x, y, 1.0f, 2.2f) < 0.06f && y < 0.99f) return {true, 1.0f, Vec3(0.80f, 0.79f, 0.75f)};
  if (y < 0.22f) return {false, 0.3f, std::abs(x - 0.5f) < 0.02f ? Vec3(0.8f) : Vec3(0.10f, 0.13f, 0.15f)};  // fanlight
  if (y < 0.25f) return {true, 1.0f, Vec3(0.80f, 0.79f, 0.75f)};
  const float px = fraction((x - 0.06f) / 0.44f), py = fraction((y - 0.25f) / 0.245f);
  const float edge = border(px, py, 0.44f, 0.5f);
  if (std::hypot(x - 0.84f, (y - 0.60f) * 2.2f) < 0.03f) return {true, 0.95f, Vec3(0.78f, 0.62f, 0.25f)};  // knob
  return {edge < 0.075f, edge < 0.06f ? 0.75f : edge < 0.09f ? 0.45f : 0.6f, paint * (edge < 0.06f ? 1.0f : 0.85f)};
}

Pane shop_pane(float x, float y) {
  const bool frame = border(x, y, 2.2f, 1.0f) < 0.04f || std::abs(fraction(x * 3.0f) - 0.5f) > 0.49f;
  if (frame) return {true, 1.0f, Vec3(0.16f, 0.17f, 0.19f)};
  // Shelves with goods, warmly lit.
  Vec3 color = mix(Vec3(0.30f, 0.24f, 0.17f), Vec3(0.12f, 0.11f, 0.10f), std::abs(x - 0.5f));
  const float shelf = fraction(y * 3.2f);
  const auto row = static_cast<std::uint32_t>(y * 3.2f), item = static_cast<std::uint32_t>(x * 22.0f);
  const std::uint32_t number = hash32(91, row, item);
  if (shelf > 0.85f && y < 0.94f) color = Vec3(0.36f, 0.28f, 0.20f);
  if (shelf > 0.85f - 0.55f * unit(number) && shelf <= 0.85f && number % 4u != 0 && y < 0.94f)
    color =
        Vec3(0.25f + 0.5f * unit(number >> 8), 0.22f + 0.4f * unit(number >> 16), 0.2f + 0.35f * unit(number >> 24)) *
        (0.7f + 0.3f * std::sin(fraction(x * 22.0f) * 3.14159f));
  return {false, 0.3f, color};
}

Pane pane(float u, float v) {
  const int tile = static_cast<int>(u * 4.0f) + 4 * static_cast<int>(v * 2.0f);
  const float x = fraction(u * 4.0f), y = fraction(v * 2.0f);
  return tile == 6 ? door_pane(x, y) : tile == 7 ? shop_pane(x, y) : window_pane(tile, x, y);
}

// Window of a tower's bay: distance into it, in metres for a bay of three metres.
float tower_window(float u, float v) {
  return std::min(std::min(u - 0.28f, 0.72f - u) * 3.0f, std::min(v - 0.25f, 0.80f - v) * 3.2f);
}

}  // namespace

Image8 brick_colors(bool yellow) {
  return color_image(256, 256, [=](float u, float v) {
    const Stone s = bricks(u, v);
    const Vec3 dark = yellow ? Vec3(0.56f, 0.47f, 0.33f) : Vec3(0.44f, 0.20f, 0.15f),
               light = yellow ? Vec3(0.74f, 0.64f, 0.46f) : Vec3(0.64f, 0.32f, 0.23f);
    const Vec3 brick = mix(dark, light, 0.7f * unit(s.number) + 0.3f * noise(u, v, 32, 2, 3));
    return mix(Vec3(0.62f, 0.58f, 0.52f), brick, smooth_step(0.004f, 0.011f, s.edge)) *
           (0.82f + 0.25f * noise(u, v, 5, 3, 8));
  });
}
Image8 brick_heights() {
  return grey_image(256, 256, [](float u, float v) {
    const Stone s = bricks(u, v);
    return smooth_step(0.002f, 0.013f, s.edge) * (0.7f + 0.15f * unit(s.number >> 8)) + 0.15f * noise(u, v, 64, 2, 4);
  });
}

Image8 stucco_colors() {
  return color_image(256, 256, [](float u, float v) {
    return Vec3(0.90f, 0.85f, 0.74f) * (0.80f + 0.18f * noise(u, v, 4, 4, 13) + 0.06f * noise(u, v, 64, 1, 14));
  });
}
Image8 stucco_heights() {
  return grey_image(128, 128,
                    [](float u, float v) { return 0.6f * noise(u, v, 6, 3, 17) + 0.4f * noise(u, v, 32, 2, 18); });
}

Image8 ashlar_colors() {
  return color_image(256, 256, [](float u, float v) {
    const Stone s = ashlars(u, v);
    const Vec3 stone = mix(Vec3(0.60f, 0.56f, 0.49f), Vec3(0.76f, 0.72f, 0.63f), unit(s.number));
    return stone * (0.55f + 0.45f * smooth_step(0.004f, 0.02f, s.edge)) * (0.84f + 0.22f * noise(u, v, 12, 4, 23));
  });
}
Image8 ashlar_heights() {
  return grey_image(256, 256, [](float u, float v) {
    return 0.85f * smooth_step(0.004f, 0.035f, ashlars(u, v).edge) + 0.15f * noise(u, v, 24, 3, 24);
  });
}

Image8 slate_colors() {
  return color_image(256, 256, [](float u, float v) {
    const Stone s = slates(u, v);
    const Vec3 slate = mix(Vec3(0.23f, 0.25f, 0.29f), Vec3(0.36f, 0.37f, 0.40f), unit(s.number));
    return slate * (0.5f + 0.5f * smooth_step(0.0f, 0.014f, s.edge)) * (0.8f + 0.3f * noise(u, v, 24, 2, 33));
  });
}
Image8 slate_heights() {
  // Each slate lies on the one below: highest at its lower end.
  return grey_image(128, 128, [](float u, float v) {
    return fraction(v * 10.0f) * smooth_step(0.0f, 0.012f, slates(u, v).edge) * 0.9f;
  });
}

Image8 slab_colors() {
  return color_image(256, 256, [](float u, float v) {
    const Stone s = slabs(u, v);
    const Vec3 slab = mix(Vec3(0.52f, 0.50f, 0.47f), Vec3(0.63f, 0.61f, 0.57f), unit(s.number));
    return slab * (0.6f + 0.4f * smooth_step(0.004f, 0.012f, s.edge)) * (0.84f + 0.24f * noise(u, v, 24, 4, 43));
  });
}
Image8 slab_heights() {
  return grey_image(256, 256, [](float u, float v) {
    const Stone s = slabs(u, v);
    return smooth_step(0.003f, 0.018f, s.edge) * (0.75f + 0.15f * unit(s.number >> 8)) + 0.1f * noise(u, v, 48, 2, 44);
  });
}

Image8 asphalt_colors() {
  return color_image(256, 256, [](float u, float v) {
    const float patch = smooth_step(0.56f, 0.60f, noise(u, v, 3, 2, 51));
    return Vec3(0.43f, 0.43f, 0.43f) * (0.72f + 0.22f * noise(u, v, 64, 2, 52) + 0.22f * noise(u, v, 6, 3, 53)) *
           (1.0f - 0.12f * patch);
  });
}
Image8 stone_colors() {
  return color_image(
      128, 128, [](float u, float v) { return Vec3(0.82f, 0.79f, 0.72f) * (0.82f + 0.22f * noise(u, v, 8, 4, 61)); });
}

Image8 pane_colors() {
  return color_image(512, 512, [](float u, float v) { return pane(u, v).color; });
}
Image8 pane_heights() {
  return grey_image(256, 256, [](float u, float v) { return pane(u, v).height; });
}

Image8 tower_colors(bool brick) {
  return color_image(256, 256, [=](float u, float v) {
    const float in = tower_window(u, v);
    if (in > 0.10f) {
      const bool bar = std::abs(u - 0.5f) < 0.014f || std::abs(v - 0.45f) < 0.012f;
      return bar ? Vec3(0.78f) : Vec3(0.10f, 0.13f, 0.17f) * (1.5f - v);
    }
    if (in > 0.0f) return Vec3(0.80f, 0.79f, 0.75f);
    if (v > 0.80f && v < 0.84f && u > 0.25f && u < 0.75f) return Vec3(0.76f, 0.73f, 0.66f);
    if (!brick) return Vec3(0.78f, 0.74f, 0.65f) * (0.84f + 0.2f * noise(u, v, 8, 4, 71));
    const Stone s = courses(u, v, 12, 40, 3.0f);
    return mix(Vec3(0.60f, 0.56f, 0.50f), mix(Vec3(0.46f, 0.27f, 0.20f), Vec3(0.60f, 0.37f, 0.27f), unit(s.number)),
               smooth_step(0.004f, 0.012f, s.edge)) *
           (0.84f + 0.2f * noise(u, v, 6, 3, 72));
  });
}
Image8 tower_heights() {
  return grey_image(128, 128, [](float u, float v) {
    const float in = tower_window(u, v);
    const bool sill = v > 0.80f && v < 0.84f && u > 0.25f && u < 0.75f;
    return sill ? 1.0f : 0.62f - 0.62f * smooth_step(0.0f, 0.12f, in);
  });
}

Image8 awning_colors() {
  return color_image(128, 64, [](float u, float v) {
    const Vec3 stripe = std::abs(fraction(u) - 0.5f) < 0.25f ? Vec3(0.62f, 0.12f, 0.10f) : Vec3(0.90f, 0.86f, 0.76f);
    return stripe * (0.9f + 0.1f * noise(u, v, 16, 2, 81));
  });
}

}  // namespace tessera::captures
