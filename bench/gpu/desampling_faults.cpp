#include "bench/gpu/desampling_faults.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/image_metrics.h"
#include "bench/gpu/desampling_score.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/fault_scenes.h"

namespace tessera::bench {
namespace {

constexpr int kCropWidth = 64, kCropHeight = 48, kScale = 4, kGap = 4;

struct Fault {
  const char* name;
  std::function<scene::Capture()> scene;
  int first, frame;  // rendered from the first on
  Sets before;       // what gives the former behaviour; none: nothing does any more
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

// The crop, on multiples of eight pixels, that has most of something.
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

// Where two images differ most; where they do not, what shows most.
IntRect worst_part(const Image8& a, const Image8& full) {
  if (a.values != full.values)
    return part_with_most(a.width, a.height, [&](int x, int y) { return difference_at(a, full, x, y); });
  return part_with_most(a.width, a.height, [&](int x, int y) {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(full.at(x, y)[c] - full.at(std::max(x, 1) - 1, y)[c]);
    return sum;
  });
}

Image8 difference_of(const Image8& a, const Image8& b) {
  Image8 out(a.width, a.height, 3);
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        out.at(x, y)[c] = static_cast<std::uint8_t>(std::min(255, 16 * std::abs(a.at(x, y)[c] - b.at(x, y)[c])));
  return out;
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

void desampling_faults(const std::filesystem::path& folder) {
  const Fault faults[] = {
      {"normals", test::turning_normals, 3, 7, {}},
      {"cut", test::walk_with_a_cut, 27, 30, {"resolve.cut_speed=0"}},
      {"stop", test::board_that_stops, 6, 11, {}},
      {"sharp", [] { return read_shipped("flyby"); }, 0, 3, {}},
      {"lip", test::bowl_of_brass, 3, 8, {"resolve.depth_tolerance=1", "resolve.discrepancy=off"}},
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
      const Image8 difference = difference_of(after, full);
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
