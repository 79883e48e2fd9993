// What desampling saves and what it costs in error, over whole replays.
//
//   tessera_desampling_curves OUT_FOLDER [PART]   PART: headline, thresholds, stencils, drift, pictures; default: all. Prints the tables of
//                                                 docs/resolve.md and writes thresholds.csv, thresholds.svg, drift.csv, drift.svg, pictures
//   tessera_desampling_curves --check             a small replay: are the things that are compared the same things?
//
// The reference of every frame is the same frame with every pixel shaded. Saved: share of the reference's runs of the pixel shader. Errors are
// of what a display shows (PSNR, mean SSIM, mean FLIP), means over frames; frames that are bit-identical count as 60 dB in
// a mean of PSNR, so that they cannot lift it without bound. Resolve: the unit's share of the tile cores' host time.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/color.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "bench/support/line_plot.h"
#include "frontend/capture_reader.h"
#include "replay/frame_renderer.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using replay::FrameRenderer;
using replay::FrameResult;
using Sets = std::vector<std::string>;

constexpr double kIdenticalDecibel = 60;

struct Shot {
  std::string name;
  int first, last;
  int width, height;
};

frontend::Capture read(const std::string& name) { return frontend::read_capture(fs::path(TESSERA_SOURCE_DIR) / "captures" / (name + ".glb")); }

FrameRenderer renderer(const frontend::Capture& capture, const Shot& shot, const Sets& sets, bool auxiliary = false) {
  replay::RunSettings settings;
  hardware::GpuConfiguration gpu;
  for (const std::string& text : sets) replay::apply_setting(text, settings, gpu);
  replay::RenderRequest request;
  request.width = shot.width, request.height = shot.height;
  request.region = {0, 0, shot.width, shot.height};
  request.resolve_auxiliary = request.error = auxiliary;
  return {capture, gpu, settings, request};
}

Image shown(const Image8& display) {
  Image out(display.width, display.height, 3);
  std::transform(display.values.begin(), display.values.end(), out.values.begin(), [](std::uint8_t v) { return static_cast<float>(v) / 255.0f; });
  return out;
}

// The frames with every pixel shaded.
struct Reference {
  std::vector<Image8> display;
  std::vector<Image> linear;  // kept only where asked for
  std::vector<std::uint64_t> invocations;
  double seconds = 0;
};

Reference render_reference(const frontend::Capture& capture, const Shot& shot, bool keep_linear = false) {
  Reference out;
  FrameRenderer r = renderer(capture, shot, {});
  for (int f = shot.first; f < shot.last; ++f) {
    FrameResult frame = r.render(f);
    out.display.push_back(shaders::to_display(frame.targets.color, capture.settings.exposure));
    out.invocations.push_back(frame.counters.shading.pixel_shader_invocations);
    out.seconds += frame.seconds;
    if (keep_linear) out.linear.push_back(std::move(frame.targets.color));
  }
  return out;
}

struct Score {
  double saved = 0, psnr = 0, worst_psnr = std::numeric_limits<double>::infinity(), ssim = 0, flip = 0, resolve_share = 0, seconds = 0;
};

Score score(const frontend::Capture& capture, const Shot& shot, const Sets& sets, const Reference& reference, bool flip = true) {
  Score s;
  FrameRenderer r = renderer(capture, shot, sets);
  double shaded = 0, full = 0, resolve = 0, tiles = 0;
  for (int f = shot.first; f < shot.last; ++f) {
    FrameResult frame = r.render(f);
    const auto i = static_cast<std::size_t>(f - shot.first);
    shaded += static_cast<double>(frame.counters.shading.pixel_shader_invocations);
    full += static_cast<double>(reference.invocations[i]);
    resolve += frame.stage_seconds["resolve_threads"], tiles += frame.stage_seconds["tile_threads"];
    s.seconds += frame.seconds;
    const Image a = shown(reference.display[i]), b = shown(shaders::to_display(frame.targets.color, capture.settings.exposure));
    const double decibel = std::min(kIdenticalDecibel, psnr(a, b));
    s.psnr += decibel;
    s.worst_psnr = std::min(s.worst_psnr, decibel);
    s.ssim += mssim(a, b);
    if (flip) s.flip += mean_value(flip_map(a, b));
  }
  const double n = shot.last - shot.first;
  s.saved = 1 - shaded / full;
  s.psnr /= n, s.ssim /= n, s.flip /= n;
  s.resolve_share = tiles > 0 ? resolve / tiles : 0;
  return s;
}

Sets adaptive(Sets more = {}) {
  more.insert(more.begin(), "resolve.desampling=adaptive");
  return more;
}

void print_row(const std::string& label, const Score& s) {
  fmt::print("| {} | {:.1f} % | {:.2f} dB | {:.2f} dB | {:.4f} | {:.4f} | {:.1f} % |\n", label, 100 * s.saved, s.psnr, s.worst_psnr, s.ssim, s.flip, 100 * s.resolve_share);
}

// ---- Parts ------------------------------------------------------------------------------------------------------

void headline(const fs::path&) {
  fmt::print("\n| capture, frames | saved | PSNR | worst frame | MSSIM | FLIP | resolve |\n|---|---:|---:|---:|---:|---:|---:|\n");
  for (const Shot& shot : {Shot{"stroll", 0, 60, 1280, 720}, Shot{"serpent", 0, 60, 1280, 720}, Shot{"eggs", 0, 12, 1280, 720}}) {
    const frontend::Capture capture = read(shot.name);
    const Reference reference = render_reference(capture, shot);
    print_row(fmt::format("{}, {} frames, adaptive", shot.name, shot.last - shot.first), score(capture, shot, adaptive(), reference));
    print_row(fmt::format("{}, checkerboard", shot.name), score(capture, shot, {"resolve.desampling=checkerboard"}, reference));
  }
}

void thresholds(const fs::path& folder) {
  std::string csv = "capture,setting,saved,psnr_db,mssim,flip\n";
  std::vector<Series> plot;
  for (const Shot& shot : {Shot{"stroll", 14, 54, 640, 360}, Shot{"serpent", 12, 28, 640, 360}}) {
    const frontend::Capture capture = read(shot.name);
    const Reference reference = render_reference(capture, shot);
    Series series{shot.name + ", adaptive", {}, {}}, board{shot.name + ", checkerboard", {}, {}};
    const auto add = [&](const std::string& label, const Sets& sets, Series& to) {
      const Score s = score(capture, shot, sets, reference);
      csv += fmt::format("{},{},{:.4f},{:.3f},{:.5f},{:.5f}\n", shot.name, label, s.saved, s.psnr, s.ssim, s.flip);
      to.x.push_back(100 * s.saved), to.y.push_back(s.psnr);
    };
    // From careful to reckless: speeds in pixels per frame at 640x360.
    for (const auto& [still, fast1, fast2] : {std::array{0.1, 8.0, 32.0}, std::array{0.25, 4.0, 16.0}, std::array{0.5, 4.0, 16.0}, std::array{0.5, 2.0, 8.0}, std::array{1.0, 2.0, 8.0},
                                              std::array{1.0, 1.0, 6.0}, std::array{1.0, 1.0, 3.0}, std::array{0.5, 0.5, 2.0}, std::array{0.25, 0.25, 0.5}, std::array{0.0, 0.0, 0.0}})
      add(fmt::format("{} / {} / {}", still, fast1, fast2), adaptive({fmt::format("resolve.k_stat={}", still), fmt::format("resolve.k_fast1={}", fast1), fmt::format("resolve.k_fast2={}", fast2)}), series);
    add("checkerboard", {"resolve.desampling=checkerboard"}, board);
    plot.push_back(series), plot.push_back(board);
  }
  fmt::print("\n{}", csv);
  write_file_atomically(folder / "thresholds.csv", csv);
  write_line_plot((folder / "thresholds.svg").string(), {"Error against savings, thresholds from careful to reckless", "runs of the pixel shader saved, %", "mean PSNR, dB"}, plot);
}

double rmse(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) sum += (double{a.values[i]} - double{b.values[i]}) * (double{a.values[i]} - double{b.values[i]});
  return std::sqrt(sum / static_cast<double>(a.values.size()));
}

void stencils(const fs::path&) {
  const char* kinds[] = {"nearest", "bilinear", "cubic_unscaled", "cubic", "cubic_interpolating"};
  for (const char* rate : {"fixed_8", "fixed_4"}) {
    fmt::print("\n{}: RMSE of what is shown, x 1000\n\n| capture | nearest | bilinear | cubic, unscaled | cubic | interpolating | cubic / bilinear |\n|---|---:|---:|---:|---:|---:|---:|\n", rate);
    for (const char* name : {"vases", "stroll", "serpent", "eggs", "flyby"}) {
      const frontend::Capture capture = read(name);
      const int first = capture.settings.first_frame;
      const Shot shot{name, first, first + 1, 1280, 720};
      const Image expected = shown(render_reference(capture, shot).display[0]);
      std::vector<double> errors;
      for (const char* kind : kinds) {
        FrameRenderer r = renderer(capture, shot, {std::string("resolve.desampling=") + rate, std::string("resolve.reconstruction=") + kind});
        errors.push_back(1000 * rmse(expected, shown(shaders::to_display(r.render(first).targets.color, capture.settings.exposure))));
      }
      fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n", name, errors[0], errors[1], errors[2], errors[3], errors[4], errors[3] / errors[1]);
    }
  }
}

// The slow part of the walk, played on and on: one moving camera for 120 frames.
void drift(const fs::path& folder) {
  frontend::Capture capture = read("stroll");
  capture.settings.frame_rate = 200;  // 0.9 seconds of slow walking last 180 frames
  const Shot shot{"stroll", 1, 122, 640, 360};
  const Reference reference = render_reference(capture, shot, true);
  std::vector<Series> plot;
  std::string csv = "variant,frame,rmse\n";
  for (const auto& [name, sets] : {std::pair<std::string, Sets>{"dither and discrepancy", {}}, {"no dither", {"resolve.dither=off"}}, {"no discrepancy", {"resolve.discrepancy=off"}},
                                   {"neither", {"resolve.dither=off", "resolve.discrepancy=off"}}}) {
    FrameRenderer r = renderer(capture, shot, adaptive(sets));
    Series series{name, {}, {}};
    for (int f = shot.first; f < shot.last; ++f) {
      const double error = rmse(r.render(f).targets.color, reference.linear[static_cast<std::size_t>(f - shot.first)]);
      series.x.push_back(f - shot.first), series.y.push_back(error);
      csv += fmt::format("{},{},{:.7f}\n", name, f - shot.first, error);
    }
    fmt::print("drift, {}: frame 10 {:.6f}, frame 120 {:.6f}, ratio {:.3f}\n", name, series.y[10], series.y[120], series.y[120] / series.y[10]);
    plot.push_back(series);
  }
  write_file_atomically(folder / "drift.csv", csv);
  write_line_plot((folder / "drift.svg").string(), {"Error of advection over time", "frames of advection", "RMSE, linear light", false, true}, plot);
}

// ---- Pictures ---------------------------------------------------------------------------------------------------

Image8 painted(const Image& values, const std::function<Vec3(std::span<const float>)>& color) {
  Image8 out(values.width, values.height, 3);
  for (int y = 0; y < values.height; ++y)
    for (int x = 0; x < values.width; ++x) {
      const Vec3 c = color(values.at(x, y));
      for (int k = 0; k < 3; ++k) out.at(x, y)[static_cast<std::size_t>(k)] = to_unorm8(c[k]);
    }
  return out;
}

void pictures(const fs::path& folder) {
  for (const auto& [name, frame] : {std::pair{"stroll", 36}, std::pair{"serpent", 20}}) {
    const frontend::Capture capture = read(name);
    const Shot shot{name, frame - 4, frame + 1, 1280, 720};
    FrameRenderer r = renderer(capture, shot, adaptive(), true);
    for (int f = shot.first; f < frame; ++f) r.render(f);
    const FrameResult got = r.render(frame);
    const tilecore::FrameTargets& t = got.targets;
    const auto save = [&](const char* what, const Image8& image) { write_png(folder / fmt::format("resolve_{}_{}.png", name, what), image); };
    save("after", shaders::to_display(t.color, capture.settings.exposure));
    save("before", shaders::to_display(renderer(capture, shot, {}).render(frame).targets.color, capture.settings.exposure));
    save("origin", painted(t.origin, [](auto v) { return v[0] == 0 ? Vec3(0.15f) : v[0] == 1 ? Vec3(0.2f, 0.65f, 0.3f) : Vec3(0.95f, 0.65f, 0.15f); }));
    Image both(t.rate.width, t.rate.height, 2);
    for (std::size_t i = 0; i < t.rate.values.size(); ++i) both.values[2 * i] = t.rate.values[i], both.values[2 * i + 1] = t.edges.values[i];
    save("rate", painted(both, [](auto v) { return v[1] != 0 && v[0] >= 16 ? Vec3(0.85f, 0.2f, 0.2f) : v[0] == 0 ? Vec3(0.05f) : v[0] == 4 ? Vec3(0.1f, 0.3f, 0.7f) : v[0] == 8 ? Vec3(0.25f, 0.6f, 0.85f) : Vec3(0.9f); }));
    save("velocity", painted(t.velocity, [](auto v) { return Vec3(0.5f) + Vec3(v[0], v[1], 0) * (1.0f / 32.0f); }));
    save("difference", painted(t.error, [](auto v) { return Vec3(std::min(1.0f, 16.0f * v[0])); }));
  }
}

// ---- Check ------------------------------------------------------------------------------------------------------

int check() {
  int bad = 0;
  const auto expect = [&](const char* law, bool holds) {
    fmt::print("{}: {}\n", law, holds ? "yes" : "NO");
    bad += !holds;
  };
  const Shot shot{"stroll", 20, 28, 160, 90};
  const frontend::Capture capture = read(shot.name);
  const Reference reference = render_reference(capture, shot);
  const Score full = score(capture, shot, {}, reference, false), half = score(capture, shot, adaptive({"resolve.k_stat=4"}), reference, false);
  expect("every pixel shaded is the reference", full.saved == 0 && full.psnr == kIdenticalDecibel && full.ssim > 0.999999);
  expect("adaptive saves and differs", half.saved > 0.2 && half.psnr < kIdenticalDecibel && half.psnr > 30);
  return bad > 0 ? 1 : 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  const std::string first = argc > 1 ? argv[1] : "", part = argc > 2 ? argv[2] : "all";
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "usage: tessera_desampling_curves OUT_FOLDER [headline|thresholds|stencils|drift|pictures] | --check\n");
    return 2;
  }
  try {
    if (first == "--check") return check();
    std::filesystem::create_directories(first);
    for (const auto& [name, run] : {std::pair<std::string, void (*)(const std::filesystem::path&)>{"headline", headline}, {"thresholds", thresholds}, {"stencils", stencils}, {"drift", drift}, {"pictures", pictures}})
      if (part == "all" || part == name) run(first);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "tessera_desampling_curves: {}\n", error.what());
    return 1;
  }
}
