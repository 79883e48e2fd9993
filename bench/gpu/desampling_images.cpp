#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/color.h"
#include "base/image_metrics.h"
#include "bench/gpu/desampling_score.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/fault_scenes.h"

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
  // Other blocks are reprojected or reconstructed. A block without a reprojected pixel looks reconstructed.
  for (int j = y & ~3; j < std::min((y & ~3) + 4, t.rate.height); ++j)
    for (int i = x & ~3; i < std::min((x & ~3) + 4, t.rate.width); ++i)
      if (t.origin.at(i, j)[0] == 1) return Vec3(0.2f, 0.65f, 0.3f);
  return rate == 4 ? Vec3(0.1f, 0.25f, 0.75f) : Vec3(0.3f, 0.7f, 0.95f);
}

// Half the size: colours of blocks over the frame's lightness.
Image8 rate_map(const FrameTargets& t, const Image8& display) {
  return painted(display.width / 2, display.height / 2, [&](int x, int y) {
    const Vec3 c = texel(display, 2 * x, 2 * y);
    return color_of_block(t, 2 * x, 2 * y) * (0.35f + 0.65f * (c.x + c.y + c.z) / 3.0f);
  });
}

// Origin of pixels, each `scale` pixels large.
Image8 origin_map(const FrameTargets& t, IntRect part, int scale) {
  const Vec3 colors[] = {Vec3(0.92f), Vec3(0.2f, 0.65f, 0.3f), Vec3(0.3f, 0.7f, 0.95f)};
  return painted(part.width() * scale, part.height() * scale, [&](int x, int y) {
    return colors[static_cast<std::size_t>(t.origin.at(part.x0 + x / scale, part.y0 + y / scale)[0])];
  });
}

Image8 part_of(const Image8& image, IntRect part) {
  return painted(part.width(), part.height(), [&](int x, int y) { return texel(image, part.x0 + x, part.y0 + y); });
}

// Differences of displayed values, channel by channel, times 16.
Image8 difference_of(const Image8& a, const Image8& b, IntRect part) {
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
  save("difference", difference_of(before, after, view.part));
}

// ---- Faults -----------------------------------------------------------------------------------------------------

constexpr int kCropWidth = 64, kCropHeight = 48, kScale = 4, kGap = 4;

struct Fault {
  const char* name;
  std::function<scene::Capture()> scene;
  int first, frame;  // rendered from `first` on
  Sets before;       // settings that show the fault; empty if no setting does
};

Image8 frame_of(const scene::Capture& capture, const Fault& fault, const Sets& sets) {
  gpu::Device device =
      renderer_of(capture, {fault.name, fault.first, fault.frame + 1, test::kFaultWidth, test::kFaultHeight}, sets);
  for (int f = fault.first; f < fault.frame; ++f) device.render(f);
  return shaders::to_display(device.render(fault.frame).targets.color, capture.settings.exposure);
}

int difference_at(const Image8& a, const Image8& b, int x, int y) {
  int sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += std::abs(a.at(x, y)[c] - b.at(x, y)[c]);
  return sum;
}

// The crop, aligned to eight pixels, with the largest amount.
IntRect part_with_most(int width, int height, const std::function<int(int x, int y)>& amount) {
  IntRect best{0, 0, kCropWidth, kCropHeight};
  long most = -1;
  for (int y0 = 0; y0 + kCropHeight <= height; y0 += 8)
    for (int x0 = 0; x0 + kCropWidth <= width; x0 += 8) {
      long sum = 0;
      for (int y = y0; y < y0 + kCropHeight; ++y)
        for (int x = x0; x < x0 + kCropWidth; ++x) sum += amount(x, y);
      if (sum > most) most = sum, best = {x0, y0, x0 + kCropWidth, y0 + kCropHeight};
    }
  return best;
}

// The crop in which two images differ most; if they are equal, the one with most content.
IntRect worst_part(const Image8& a, const Image8& full) {
  if (a.values != full.values)
    return part_with_most(a.width, a.height, [&](int x, int y) { return difference_at(a, full, x, y); });
  return part_with_most(a.width, a.height, [&](int x, int y) {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(full.at(x, y)[c] - full.at(std::max(x, 1) - 1, y)[c]);
    return sum;
  });
}

Image8 side_by_side(const std::vector<const Image8*>& images, IntRect part) {
  const int width = kScale * kCropWidth, count = static_cast<int>(images.size());
  Image8 out(count * width + (count - 1) * kGap, kScale * kCropHeight, 3);
  std::fill(out.values.begin(), out.values.end(), std::uint8_t{255});
  for (int n = 0; n < count; ++n)
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < width; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          out.at(n * (width + kGap) + x, y)[c] =
              images[static_cast<std::size_t>(n)]->at(part.x0 + x / kScale, part.y0 + y / kScale)[c];
  return out;
}

scene::Capture slow_walk() {
  scene::Capture capture = read_shipped("stroll");
  capture.settings.frame_rate = 200;
  return capture;
}

}  // namespace

void desampling_images(const std::filesystem::path& folder) {
  for (const View& view :
       {View{"stroll", 10, {}}, View{"stroll", 36, {560, 300, 960, 540}, 640, 340}, View{"serpent", 20, {}}})
    write_view(folder, view);
}

void desampling_faults(const std::filesystem::path& folder) {
  const Fault faults[] = {
      {"normals", test::turning_normals, 3, 7, {}},
      {"cut", test::walk_with_a_cut, 27, 30, {"resolve.cut_speed=0"}},
      {"stop", test::board_that_stops, 6, 11, {}},
      {"sharp", [] { return read_shipped("flyby"); }, 0, 3, {}},
      {"lip", test::bowl_of_brass, 3, 8, {}},
      {"crease", test::box_with_creases, 3, 7, {"resolve.edge_angle=0"}},
      {"torch", test::moving_torch, 3, 8, {}},
      {"drift", slow_walk, 1, 60, {"resolve.dither=off", "resolve.discrepancy=off"}},
  };
  for (const Fault& fault : faults) {
    const scene::Capture capture = fault.scene();
    const Image8 full = frame_of(capture, fault, {}), after = frame_of(capture, fault, adaptive());
    const double after_db = psnr(shown(full), shown(after));
    const auto file = folder / fmt::format("fault_{}.png", fault.name);
    if (fault.before.empty()) {
      const Image8 difference = difference_of(after, full, {0, 0, full.width, full.height});
      write_png(file, side_by_side({&after, &full, &difference}, worst_part(after, full)));
      fmt::print("{}: after {:.2f} dB\n", fault.name, after_db);
    } else {
      const Image8 before = frame_of(capture, fault, adaptive(fault.before));
      write_png(file, side_by_side({&before, &after, &full}, worst_part(before, full)));
      fmt::print("{}: before {:.2f} dB, after {:.2f} dB\n", fault.name, psnr(shown(full), shown(before)), after_db);
    }
  }
}

}  // namespace tessera::bench
