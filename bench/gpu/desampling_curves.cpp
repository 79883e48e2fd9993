// Measures the savings of desampling and its error, over whole replays.
//
//   tessera_desampling_curves OUT_FOLDER [PART]   PART: thresholds, captures, stencils, drift, traffic, eyes,
//                                                 shimmer, splits, images, faults; default: all.
//                                                 Prints the tables of docs/resolve.md and writes CSV
//                                                 files, plots and images
//   tessera_desampling_curves OUT_FOLDER score CAPTURE FIRST LAST SETTINGS...
//                                                 one row for each; SETTINGS: "KEY=VALUE,KEY=VALUE", keys of `resolve.`
//   tessera_desampling_curves --check             a small replay: checks that the comparisons compare equal things
//
// The reference of every frame is the same frame with every pixel shaded. Saved: share of the reference's
// pixel-shader invocations. Errors are measured on displayed values: PSNR of every frame, mean SSIM and mean FLIP of
// every sixth frame; figures are means over frames. Resolve: the unit's share of processor time.
#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/atomic_file.h"
#include "base/image_metrics.h"
#include "bench/gpu/desampling_score.h"
#include "bench/support/line_plot.h"
#include "bench/support/program.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using gpu::Device;
using gpu::FrameResult;

const std::string kCheckerboard = "resolve.desampling=checkerboard";

void print_head() {
  fmt::print(
      "\n| capture, frames | saved | PSNR | worst frame | MSSIM | FLIP | resolve, of tile cores | of the frame "
      "|\n|---|---:|---:|---:|---:|---:|---:|---:|\n");
}
void print_row(const std::string& label, const Score& s) {
  fmt::print("| {} | {:.1f} % | {:.2f} dB | {:.2f} dB | {:.4f} | {:.4f} | {:.1f} % | {:.1f} % |\n", label,
             100 * s.saved, s.psnr, s.worst_psnr(), s.ssim, s.flip, 100 * s.resolve_of_tiles, 100 * s.resolve_of_frame);
  std::fflush(stdout);
}

// ---- Parts ------------------------------------------------------------------------------------------------------

void score_settings(const std::string& name, int first, int last, std::span<char* const> settings) {
  const Shot shot{name, first, last, 1280, 720};
  const scene::Capture capture = read_shipped(name);
  const Reference reference = render_reference(capture, shot);
  print_head();
  for (const std::string list : settings) {
    Sets sets = adaptive();
    for (std::size_t at = 0; at < list.size();) {
      const std::size_t end = std::min(list.find(',', at), list.size());
      sets.push_back("resolve." + list.substr(at, end - at));
      at = end + 1;
    }
    print_row(list, score(capture, shot, sets, reference));
  }
}

// From careful to reckless: speeds in pixels per frame at 640x360.
constexpr std::array kThresholds = {
    std::array{0.25, 4.0, 16.0}, std::array{0.5, 4.0, 16.0},  std::array{1.0, 2.0, 8.0},
    std::array{2.0, 2.0, 8.0},   std::array{1.0, 1.0, 3.0},   std::array{0.5, 0.5, 2.0},
    std::array{0.5, 0.5, 1.0},   std::array{0.25, 0.25, 0.5}, std::array{0.01, 0.01, 0.01}};
constexpr const char* kStencils[] = {"cubic", "bilinear", "cubic_interpolating"};

// PSNR at `saved` on the line from point to point, sorted by savings; empty if no two points enclose it.
std::optional<double> decibel_at(std::vector<std::pair<double, double>> points, double saved) {
  std::sort(points.begin(), points.end());
  for (std::size_t i = 1; i < points.size(); ++i) {
    const auto& [low, low_db] = points[i - 1];
    const auto& [high, high_db] = points[i];
    if (low <= saved && saved <= high)
      return high > low ? low_db + (high_db - low_db) * (saved - low) / (high - low) : std::min(low_db, high_db);
  }
  return std::nullopt;
}

// Adaptive desampling at exactly the savings of checkerboard, over all frames and frame by frame.
void print_equal_shading(const std::string& label, const std::vector<Score>& curve, const Score& board) {
  std::vector<std::pair<double, double>> means;
  for (const Score& s : curve) means.emplace_back(s.saved, s.psnr);
  const auto mean = decibel_at(means, board.saved);
  double least = kIdenticalDecibel;
  int frames = 0;
  for (std::size_t f = 0; f < board.frame_psnr.size(); ++f) {
    std::vector<std::pair<double, double>> points;
    for (const Score& s : curve) points.emplace_back(s.frame_saved[f], s.frame_psnr[f]);
    const auto there = decibel_at(points, board.frame_saved[f]);
    if (!there) continue;
    least = std::min(least, *there - board.frame_psnr[f]);
    ++frames;
  }
  const auto decibel = [](const std::optional<double>& v) {
    return v ? fmt::format("{:.2f} dB", *v) : std::string("does not save as much");
  };
  fmt::print("| {} | {:.1f} % | {:.2f} dB | {} | {} | {} | {} of {} |\n", label, 100 * board.saved, board.psnr,
             decibel(mean), decibel(mean ? std::optional(*mean - board.psnr) : std::nullopt),
             decibel(frames > 0 ? std::optional(least) : std::nullopt), frames, board.frame_psnr.size());
}

void thresholds(const fs::path& folder) {
  std::string csv = "capture,setting,saved,psnr_db,worst_frame_db,mssim,flip\n";
  for (const Shot& shot : {Shot{"stroll", 0, 60, 640, 360}, Shot{"serpent", 12, 28, 640, 360}}) {
    const scene::Capture capture = read_shipped(shot.name);
    const Reference reference = render_reference(capture, shot);
    std::vector<Series> plot;
    const auto measure = [&](const std::string& label, const Sets& sets) {
      const Score s = score(capture, shot, sets, reference);
      csv += fmt::format("{},{},{:.4f},{:.3f},{:.3f},{:.5f},{:.5f}\n", shot.name, label, s.saved, s.psnr,
                         s.worst_psnr(), s.ssim, s.flip);
      plot.back().x.push_back(100 * s.saved), plot.back().y.push_back(s.psnr);
      return s;
    };
    std::vector<std::vector<Score>> curves;
    for (const char* stencil : kStencils) {
      plot.push_back({stencil, {}, {}});
      auto& curve = curves.emplace_back();
      for (const auto& [reuse, half, quarter] : kThresholds) {
        Sets sets = adaptive(speeds(reuse, half, quarter));
        sets.push_back(std::string("resolve.reconstruction=") + stencil);
        curve.push_back(measure(fmt::format("{} {} / {} / {}", stencil, reuse, half, quarter), sets));
      }
    }
    plot.push_back({"checkerboard", {}, {}});
    const Score board = measure("checkerboard", {kCheckerboard});
    fmt::print(
        "\n| capture, stencils | saved | checkerboard | adaptive, as much saved | difference | least difference in a "
        "frame | frames |\n|---|---:|---:|---:|---:|---:|---:|\n");
    for (std::size_t k = 0; k < curves.size(); ++k)
      print_equal_shading(fmt::format("{}, {}", shot.name, kStencils[k]), curves[k], board);
    write_line_plot((folder / fmt::format("thresholds_{}.svg", shot.name)).string(),
                    {fmt::format("{}: error against savings, thresholds from careful to reckless", shot.name),
                     "pixel-shader invocations saved, %", "mean PSNR, dB"},
                    plot);
  }
  fmt::print("\n{}", csv);
  write_file_atomically(folder / "thresholds.csv", csv);
}

// Eight captures at the same thresholds: seven frames of each that have a history.
void captures(const fs::path& folder) {
  std::string csv = "capture,setting,saved,psnr_db,worst_frame_db,mssim,flip\n";
  std::vector<Series> decibels, similarity, flips;
  for (const Shot& shot :
       {Shot{"stroll", 8, 16, 640, 360}, Shot{"serpent", 12, 20, 640, 360}, Shot{"flyby", 0, 8, 640, 360},
        Shot{"eggs", 10, 18, 640, 360}, Shot{"vases", 0, 8, 640, 360}, Shot{"city", 0, 8, 640, 360},
        Shot{"garden", 0, 8, 640, 360}, Shot{"workshop", 0, 8, 640, 360}}) {
    const scene::Capture capture = read_shipped(shot.name);
    const Reference reference = render_reference(capture, shot);
    for (std::vector<Series>* plot : {&decibels, &similarity, &flips}) plot->push_back({shot.name, {}, {}});
    for (const auto& [reuse, half, quarter] : kThresholds) {
      const Score s = score(capture, shot, adaptive(speeds(reuse, half, quarter)), reference);
      csv += fmt::format("{},{} / {} / {},{:.4f},{:.3f},{:.3f},{:.5f},{:.5f}\n", shot.name, reuse, half, quarter,
                         s.saved, s.psnr, s.worst_psnr(), s.ssim, s.flip);
      for (const auto& [plot, value] : {std::pair(&decibels, s.psnr), {&similarity, s.ssim}, {&flips, s.flip}})
        plot->back().x.push_back(100 * s.saved), plot->back().y.push_back(value);
    }
  }
  fmt::print("\n{}", csv);
  write_file_atomically(folder / "captures.csv", csv);
  for (const auto& [name, label, plot] : {std::tuple("captures_psnr.svg", "mean PSNR, dB (60: equal)", &decibels),
                                          {"captures_mssim.svg", "MSSIM", &similarity},
                                          {"captures_flip.svg", "mean FLIP", &flips}})
    write_line_plot(
        (folder / name).string(),
        {"Error against savings, thresholds from careful to reckless", "pixel-shader invocations saved, %", label},
        *plot);
}

void stencils(const fs::path&) {
  const char* kinds[] = {"nearest", "bilinear", "cubic_unscaled", "cubic", "cubic_interpolating"};
  for (const char* rate : {"fixed_8", "fixed_4"}) {
    fmt::print(
        "\n{}: RMSE of displayed values, x 1000\n\n| capture | nearest | bilinear | cubic, unscaled | cubic | "
        "interpolating | cubic / bilinear | interpolating / bilinear |\n|---|---:|---:|---:|---:|---:|---:|---:|\n",
        rate);
    for (const char* name : {"eggs", "flyby", "serpent", "stroll", "vases", "workshop"}) {
      const scene::Capture capture = read_shipped(name);
      const int first = capture.settings.first_frame;
      const Shot shot{name, first, first + 1, 1280, 720};
      const Image expected = shown(render_reference(capture, shot).display[0]);
      std::vector<double> errors;
      for (const char* kind : kinds) {
        Device r = renderer_of(
            capture, shot, {std::string("resolve.desampling=") + rate, std::string("resolve.reconstruction=") + kind});
        errors.push_back(1000 * rmse(expected, shown(shaders::to_display(r.render(first).targets.color,
                                                                         capture.settings.exposure))));
      }
      fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n", name, errors[0], errors[1],
                 errors[2], errors[3], errors[4], errors[3] / errors[1], errors[4] / errors[1]);
    }
  }
}

// The slow part of the walk, extended: one moving camera for 120 frames.
void drift(const fs::path& folder) {
  scene::Capture capture = read_shipped("stroll");
  capture.settings.frame_rate = 200;  // 0.9 seconds of slow walking last 180 frames
  const Shot shot{"stroll", 1, 122, 640, 360};
  const Reference reference = render_reference(capture, shot, true);
  std::vector<Series> plot;
  std::string csv = "variant,frame,rmse\n";
  for (const auto& [name, sets] : {std::pair<std::string, Sets>{"both", {}},
                                   {"no dither", {"resolve.dither=off"}},
                                   {"no discrepancy", {"resolve.discrepancy=off"}},
                                   {"neither", {"resolve.dither=off", "resolve.discrepancy=off"}}}) {
    Device r = renderer_of(capture, shot, adaptive(sets));
    Series series{name, {}, {}};
    for (int f = shot.first; f < shot.last; ++f) {
      const double error = rmse(r.render(f).targets.color, reference.linear[static_cast<std::size_t>(f - shot.first)]);
      series.x.push_back(f - shot.first), series.y.push_back(error);
      csv += fmt::format("{},{},{:.7f}\n", name, f - shot.first, error);
    }
    fmt::print("drift, {}: frame 10 {:.6f}, frame 120 {:.6f}, ratio {:.3f}\n", name, series.y[10], series.y[120],
               series.y[120] / series.y[10]);
    plot.push_back(series);
  }
  write_file_atomically(folder / "drift.csv", csv);
  write_line_plot((folder / "drift.svg").string(),
                  {"Error of advection over time", "frames of advection", "RMSE, linear light", false, true}, plot);
}

// Bytes over the memory interface, cycles and energy: means over the frames that have a history.
void traffic(const fs::path& folder) {
  std::string csv =
      "capture,setting,frame_buffer_written_kb,history_read_kb,history_written_kb,all_traffic_kb,"
      "pixel_shader_invocations,kcycles,energy_uj,dram_uj\n";
  const auto row = [&](const Shot& shot, const std::string& name, const Sets& sets) {
    const scene::Capture capture = read_shipped(shot.name);
    Device r = renderer_of(capture, shot, sets);
    std::array<double, 8> sum{};
    for (int f = shot.first; f < shot.last; ++f) {
      const FrameResult frame = r.render(f);
      if (f == shot.first) continue;
      const memory::Ledger& ledger = frame.counters.ledger;
      const memory::Traffic &history = ledger.traffic(memory::Unit::kResolve, memory::Purpose::kHistory),
                            &pixels = ledger.traffic(memory::Unit::kResolve, memory::Purpose::kFrameBuffer),
                            all = ledger.total();
      const double bytes = static_cast<double>(all.read_bytes + all.written_bytes);
      const std::array<double, 8> values = {static_cast<double>(pixels.written_bytes) / 1e3,
                                            static_cast<double>(history.read_bytes) / 1e3,
                                            static_cast<double>(history.written_bytes) / 1e3,
                                            bytes / 1e3,
                                            static_cast<double>(frame.counters.shading.pixel_shader_invocations),
                                            frame.model->timing.cycles / 1e3,
                                            frame.model->energy.total_nj() / 1e3,
                                            frame.model->energy.by_unit_nj.at("dram") / 1e3};
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += values[i] / (shot.last - shot.first - 1);
    }
    csv += fmt::format("{},\"{}\",{:.0f}\n", shot.name, name, fmt::join(sum, ","));
  };
  const Shot walk{"stroll", 24, 33, 1280, 720}, still{"vases", 0, 9, 1280, 720};
  const std::string compressed = "frame_buffer.compression=lossless";
  row(walk, "off", {});
  row(walk, "off, " + compressed, {compressed});
  row(walk, "adaptive", adaptive());
  row(walk, "adaptive, " + compressed, adaptive({compressed}));
  for (const char* set : {"resolve.history_colors=apart", "resolve.advection=false"})
    row(walk, std::string("adaptive, ") + set, adaptive({set}));
  row(walk, "checkerboard", {kCheckerboard});
  row(still, "off", {});
  row(still, "adaptive", adaptive());
  fmt::print("\n{}", csv);
  write_file_atomically(folder / "traffic.csv", csv);
}

// Rates and shares of slow blocks, one at a time, against full shading.
void splits(const fs::path& folder) {
  std::string csv = "capture,setting,invocations,psnr_db,worst_frame_db,flip\n";
  for (const Shot& shot : {Shot{"stroll", 0, 60, 640, 360}, Shot{"serpent", 12, 28, 640, 360}}) {
    const scene::Capture capture = read_shipped(shot.name);
    const Reference reference = render_reference(capture, shot);
    for (const auto& [name, sets] : {std::pair<std::string, Sets>{"default", adaptive()},
                                     {"8 of 16 advected", adaptive({"resolve.advected_pixels=8"})},
                                     {"1 / 4 / 16", adaptive(speeds(1, 4, 16))},
                                     {"8 of 16 everywhere", {"resolve.desampling=fixed_8"}},
                                     {"4 of 16 everywhere", {"resolve.desampling=fixed_4"}}}) {
      const Score s = score(capture, shot, sets, reference);
      csv += fmt::format("{},{},{:.4f},{:.3f},{:.3f},{:.5f}\n", shot.name, name, 1 - s.saved, s.psnr, s.worst_psnr(),
                         s.flip);
    }
  }
  fmt::print("\n{}", csv);
  write_file_atomically(folder / "splits.csv", csv);
}

// Foveation and stereo: one frame each.
void eyes(const fs::path&) {
  fmt::print("\n| capture, frame | | runs, full | runs | saved | PSNR |\n|---|---|---:|---:|---:|---:|\n");
  const auto row = [](const std::string& label, const char* what, const FrameResult& full, const FrameResult& got,
                      bool right, float exposure) {
    const auto& counters_full = right ? full.right->counters : full.counters;
    const auto& counters = right ? got.right->counters : got.counters;
    const auto display = [&](const FrameResult& r) {
      return shown(shaders::to_display(right ? r.right->targets.color : r.targets.color, exposure));
    };
    const auto all = static_cast<double>(counters_full.shading.pixel_shader_invocations),
               runs = static_cast<double>(counters.shading.pixel_shader_invocations);
    fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.1f} % | {:.2f} dB |\n", label, what, all, runs, 100 * (1 - runs / all),
               std::min(kIdenticalDecibel, psnr(display(full), display(got))));
  };
  const Sets fovea = {"resolve.foveation_r0=150", "resolve.foveation_r1=350"};
  for (const Shot& shot :
       {Shot{"eggs", 14, 15, 1280, 720}, Shot{"vases", 0, 1, 1280, 720}, Shot{"stroll", 36, 37, 1280, 720}}) {
    const scene::Capture capture = read_shipped(shot.name);
    const auto render = [&](const Sets& sets) { return renderer_of(capture, shot, sets).render(shot.first); };
    const std::string label = fmt::format("{}, {}", shot.name, shot.first);
    row(label, "foveation 150, 350 px", render({}), render(adaptive(fovea)), false, capture.settings.exposure);
    const FrameResult both = render({"stereo.eye_separation=0.06"});
    for (const char* depth : {"0", "3", "10"}) {
      const FrameResult got =
          render(adaptive({"stereo.eye_separation=0.06", std::string("stereo.far_depth=") + depth}));
      row(label, fmt::format("right eye from the left beyond {}", depth).c_str(), both, got, true,
          capture.settings.exposure);
    }
  }
}

// ---- Check ------------------------------------------------------------------------------------------------------

int check() {
  Laws laws;
  const Shot shot{"stroll", 20, 28, 160, 90};
  const scene::Capture capture = read_shipped(shot.name);
  const Reference reference = render_reference(capture, shot);
  const Score full = score(capture, shot, {}, reference);
  Sets sets = adaptive(speeds(4, 4, 16));
  sets.push_back("resolve.discrepancy=off");
  const Score half = score(capture, shot, sets, reference);
  laws.expect("every pixel shaded is the reference",
              full.saved == 0 && full.psnr == kIdenticalDecibel && full.ssim > 0.999999 && full.flip == 0);
  laws.expect(fmt::format("adaptive saves and differs ({:.3f}, {:.1f} dB)", half.saved, half.psnr),
              half.saved > 0.2 && half.psnr < kIdenticalDecibel && half.psnr > 30);
  return laws.all_hold() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  const std::string first = argc > 1 ? argv[1] : "", part = argc > 2 ? argv[2] : "all";
  const bool scores = part == "score";
  if (argc < 2 || (scores ? argc < 7 : argc > 3)) {
    fmt::print(
        stderr,
        "usage: tessera_desampling_curves OUT_FOLDER [thresholds|captures|stencils|drift|traffic|eyes|shimmer|splits|"
        "images|faults | score CAPTURE FIRST LAST SETTINGS...] | --check\n");
    return 2;
  }
  try {
    if (first == "--check") return check();
    std::filesystem::create_directories(first);
    if (scores) {
      score_settings(argv[3], std::stoi(argv[4]), std::stoi(argv[5]), {argv + 6, static_cast<std::size_t>(argc - 6)});
      return 0;
    }
    using Part = void (*)(const std::filesystem::path&);
    for (const auto& [name, run] : {std::pair<std::string, Part>{"thresholds", thresholds},
                                    {"captures", captures},
                                    {"stencils", stencils},
                                    {"drift", drift},
                                    {"traffic", traffic},
                                    {"eyes", eyes},
                                    {"shimmer", shimmer},
                                    {"splits", splits},
                                    {"images", desampling_images},
                                    {"faults", desampling_faults}})
      if (part == "all" || part == name) run(first);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "tessera_desampling_curves: {}\n", error.what());
    return 1;
  }
}
