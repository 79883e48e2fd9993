#include "bench/gpu/desampling_images.h"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "base/color.h"
#include "bench/gpu/desampling_score.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::bench {
namespace {

using gpu::Device;
using gpu::FrameResult;
using tilecore::FrameTargets;

Image8 painted(int width, int height, const std::function<Vec3(int x, int y)>& color) {
  Image8 out(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Vec3 c = glm::clamp(color(x, y), Vec3(0.0f), Vec3(1.0f));
      for (int k = 0; k < 3; ++k)
        out.at(x, y)[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(c[k] * 255.0f + 0.5f);
    }
  return out;
}

Vec3 texel(const Image8& image, int x, int y) {
  const auto v = image.at(x, y);
  return Vec3(v[0], v[1], v[2]) / 255.0f;
}

Vec3 color_of_block(const FrameTargets& t, int x, int y) {
  const float rate = t.rate.at(x, y)[0];
  if (rate == 0) return Vec3(0.1f);
  if (t.edges.at(x, y)[0] != 0 && rate >= 16) return Vec3(0.8f, 0.15f, 0.15f);
  if (rate >= 16) return Vec3(0.9f);
  // The others are advected or reconstructed. A block of which advection gave nothing looks reconstructed.
  for (int j = y & ~3; j < std::min((y & ~3) + 4, t.rate.height); ++j)
    for (int i = x & ~3; i < std::min((x & ~3) + 4, t.rate.width); ++i)
      if (t.origin.at(i, j)[0] == 1) return Vec3(0.2f, 0.65f, 0.3f);
  return rate == 4 ? Vec3(0.1f, 0.25f, 0.75f) : Vec3(0.3f, 0.7f, 0.95f);
}

// Half the size: colours of blocks laid over the frame's lightness.
Image8 rate_map(const FrameTargets& t, const Image8& display) {
  return painted(display.width / 2, display.height / 2, [&](int x, int y) {
    const Vec3 c = texel(display, 2 * x, 2 * y);
    return color_of_block(t, 2 * x, 2 * y) * (0.35f + 0.65f * (c.x + c.y + c.z) / 3.0f);
  });
}

// Where pixels come from, each `scale` pixels large.
Image8 origin_map(const FrameTargets& t, IntRect part, int scale) {
  const Vec3 colors[] = {Vec3(0.92f), Vec3(0.2f, 0.65f, 0.3f), Vec3(0.3f, 0.7f, 0.95f)};
  return painted(part.width() * scale, part.height() * scale, [&](int x, int y) {
    return colors[static_cast<std::size_t>(t.origin.at(part.x0 + x / scale, part.y0 + y / scale)[0])];
  });
}

Image8 part_of(const Image8& image, IntRect part) {
  return painted(part.width(), part.height(), [&](int x, int y) { return texel(image, part.x0 + x, part.y0 + y); });
}

// Of what is shown, channel by channel, 16 times.
Image8 difference(const Image8& a, const Image8& b, IntRect part) {
  return painted(part.width(), part.height(), [&](int x, int y) {
    return 16.0f * glm::abs(texel(a, part.x0 + x, part.y0 + y) - texel(b, part.x0 + x, part.y0 + y));
  });
}

struct View {
  const char* name;
  int frame;
  IntRect part;                    // compared at full size; empty: only the rates are shown
  int origin_x = 0, origin_y = 0;  // 160x90 pixels from here are shown one by one
};

void write_view(const std::filesystem::path& folder, const View& view) {
  const scene::Capture capture = read_shipped(view.name);
  const Shot shot{view.name, view.frame - 8, view.frame + 1, 1280, 720};
  Device r = renderer_of(capture, shot, adaptive(), true);
  for (int f = shot.first; f < view.frame; ++f) r.render(f);
  const FrameResult got = r.render(view.frame);
  const FrameTargets& t = got.targets;
  const Image8 after = shaders::to_display(t.color, capture.settings.exposure);
  const Image8 before =
      shaders::to_display(renderer_of(capture, shot, {}).render(view.frame).targets.color, capture.settings.exposure);
  const auto save = [&](const char* what, const Image8& image) {
    write_png(folder / fmt::format("{}_{}_{}.png", view.name, view.frame, what), image);
  };
  save("rate", rate_map(t, after));
  if (view.part.empty()) return;
  save("origin", origin_map(t, IntRect{view.origin_x, view.origin_y, view.origin_x + 160, view.origin_y + 90}, 4));
  save("before", part_of(before, view.part));
  save("after", part_of(after, view.part));
  save("difference", difference(before, after, view.part));
}

}  // namespace

void desampling_images(const std::filesystem::path& folder) {
  for (const View& view :
       {View{"stroll", 10, {}}, View{"stroll", 36, {560, 300, 960, 540}, 640, 340}, View{"serpent", 20, {}}})
    write_view(folder, view);
}

}  // namespace tessera::bench
