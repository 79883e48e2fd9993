#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/image_metrics.h"
#include "bench/gpu/desampling_score.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::bench {
namespace {

using gpu::Device;
using gpu::FrameResult;

// Half of the change from one image to the next, about a middle grey.
Image change_of(const Image& before, const Image& after) {
  Image out(before.width, before.height, 3);
  for (std::size_t i = 0; i < out.values.size(); ++i)
    out.values[i] = 0.5f + 0.5f * (after.values[i] - before.values[i]);
  return out;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i)
    sum += std::abs(static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]));
  return sum / static_cast<double>(a.values.size());
}

struct Flicker {
  double saved = 0, psnr = 0, flip = 0, difference = 0;
};

Flicker flicker_of(const scene::Capture& capture, const Shot& shot, const Sets& sets, const Reference& reference) {
  Flicker out;
  Device device = renderer_of(capture, shot, sets);
  double shaded = 0, full = 0;
  Image last, last_expected;
  for (int f = shot.first; f < shot.last; ++f) {
    const auto i = static_cast<std::size_t>(f - shot.first);
    const FrameResult frame = device.render(f);
    shaded += static_cast<double>(frame.counters.shading.pixel_shader_invocations);
    full += static_cast<double>(reference.invocations[i]);
    Image now = shown(shaders::to_display(frame.targets.color, capture.settings.exposure)),
          expected = shown(reference.display[i]);
    out.psnr += std::min(kIdenticalDecibel, psnr(expected, now));
    if (i > 0) {
      const Image change = change_of(last, now), wanted = change_of(last_expected, expected);
      out.flip += mean_value(flip_map(wanted, change));
      out.difference += 2 * mean_difference(wanted, change);
    }
    last = std::move(now), last_expected = std::move(expected);
  }
  const double frames = shot.last - shot.first;
  out.saved = 1 - shaded / full;
  out.psnr /= frames, out.flip /= frames - 1, out.difference /= frames - 1;
  return out;
}

struct Variant {
  std::string name;
  Sets sets;
};

// The values at `saved` on the line between the neighbouring points; below 0 if `saved` lies outside.
std::pair<double, double> at_savings(std::vector<Flicker> points, double saved) {
  std::sort(points.begin(), points.end(), [](const Flicker& a, const Flicker& b) { return a.saved < b.saved; });
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Flicker &a = points[i - 1], &b = points[i];
    if (!(a.saved <= saved && saved <= b.saved)) continue;
    const double share = b.saved > a.saved ? (saved - a.saved) / (b.saved - a.saved) : 0;
    return {a.flip + share * (b.flip - a.flip), a.difference + share * (b.difference - a.difference)};
  }
  return {-1, -1};
}

}  // namespace

void shimmer(const std::filesystem::path& folder) {
  std::string csv = "capture,setting,saved,psnr_db,shimmer_flip,shimmer_l1\n";
  for (const Shot& shot : {Shot{"stroll", 0, 60, 640, 360}, Shot{"serpent", 0, 60, 640, 360}}) {
    const scene::Capture capture = read_shipped(shot.name);
    const Reference reference = render_reference(capture, shot);
    const auto measure = [&](const Variant& variant) {
      const Flicker f = flicker_of(capture, shot, variant.sets, reference);
      csv += fmt::format("{},{},{:.4f},{:.3f},{:.6f},{:.6f}\n", shot.name, variant.name, f.saved, f.psnr, f.flip,
                         f.difference);
      fmt::print("{}, {}: {:.1f} % saved, {:.2f} dB, shimmer FLIP {:.5f}, L1 {:.5f}\n", shot.name, variant.name,
                 100 * f.saved, f.psnr, f.flip, f.difference);
      std::fflush(stdout);
      return f;
    };
    const Flicker plain = measure({"adaptive", adaptive()});
    const std::vector<Flicker> by_thresholds = {plain,
                                                measure({"0.25 / 0.25 / 0.5", adaptive(speeds(0.25, 0.25, 0.5))}),
                                                measure({"0.01 / 0.01 / 0.01", adaptive(speeds(0.01, 0.01, 0.01))})},
                               by_tolerance = {
                                   plain, measure({"tolerance 0.05", adaptive({"resolve.discrepancy_tolerance=0.05"})}),
                                   measure({"tolerance 0.1", adaptive({"resolve.discrepancy_tolerance=0.1"})})};
    const Flicker board = measure({"checkerboard", {"resolve.desampling=checkerboard"}});
    for (const auto& [how, curve] :
         {std::pair("thresholds", &by_thresholds), {"tolerance of discrepancies", &by_tolerance}}) {
      const auto [flip, difference] = at_savings(*curve, board.saved);
      if (flip < 0)
        fmt::print("{}, {}: nothing saves as much as checkerboard\n", shot.name, how);
      else
        fmt::print("{}, {}: at checkerboard's {:.1f} % saved, shimmer FLIP is {:.3f} of its, L1 {:.3f}\n", shot.name,
                   how, 100 * board.saved, flip / board.flip, difference / board.difference);
    }
  }
  write_file_atomically(folder / "shimmer.csv", csv);
}

}  // namespace tessera::bench
