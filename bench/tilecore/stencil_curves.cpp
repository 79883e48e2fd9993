// Measures the error of reconstructing a smooth image, and its cost: error by wavelength, kernel and rate, taps and time.
//
//   tessera_stencil_curves OUT_FOLDER [ROUNDS]  writes stencil_error.csv, stencil_cost.csv, stencil_error_8.svg,
//                                               stencil_error_4.svg, stencil_cost.svg
//   tessera_stencil_curves --check              no times: checks the orders that the plots show
//
// Kernels are named as in cubic_stencil.h. Error: root mean square over the missing pixels of sinusoids of amplitude
// 1 in 32 directions and 16 phases. All blocks are rendered by one pattern; "rows" is the pair of squares that
// pattern_dither.h does not use.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "bench/support/line_plot.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::bench {
namespace {

using namespace tilecore;

struct Kernel {
  const char* name;
  Reconstruction kernel;
};
constexpr Kernel kKernels[] = {
    {"nearest", Reconstruction::kNearest},
    {"bilinear", Reconstruction::kBilinear},
    {"cubic unscaled", Reconstruction::kCubicUnscaled},
    {"cubic", Reconstruction::kCubic},
    {"interpolating", Reconstruction::kCubicInterpolating},
};
constexpr std::size_t kBilinear = 1, kUnscaled = 2, kCubic = 3, kInterpolating = 4;

struct Lattice {
  const char* name;
  BlockMask pattern;
};
const Lattice kLattices[] = {
    {"8 of 16", kPairOrder[0]},
    {"8 of 16, rows", static_cast<BlockMask>(sparse_square(0, 0) | sparse_square(1, 0))},
    {"4 of 16", kSquareOrder[0]},
};

const std::vector<double> kWavelengths = {4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 48, 64};

// A block and its surroundings.
struct Window {
  std::array<Vec4, 100> color;
  std::array<std::uint16_t, kWindowSide> usable{};

  explicit Window(BlockMask pattern) {
    for (int y = 0; y < kWindowSide; ++y)
      for (int x = 0; x < kWindowSide; ++x)
        if (pattern >> (4 * ((y + 1) & 3) + ((x + 1) & 3)) & 1)
          usable[static_cast<std::size_t>(y)] |= static_cast<std::uint16_t>(1u << x);
  }
  BlockWindow view() const { return {color.data(), 10, usable}; }
};

double root_mean_square_error(const Kernel& kernel, BlockMask pattern, double wavelength) {
  Window window(pattern);
  const auto missing = static_cast<BlockMask>(~pattern);
  double sum = 0;
  int count = 0;
  for (int direction = 0; direction < 32; ++direction)
    for (int phase = 0; phase < 16; ++phase) {
      const double angle = direction * M_PI / 32, k = 2 * M_PI / wavelength;
      const auto truth = [&](int x, int y) {
        return std::sin(k * (x * std::cos(angle) + y * std::sin(angle)) + phase * M_PI / 8);
      };
      for (int i = 0; i < 100; ++i)
        window.color[static_cast<std::size_t>(i)] = Vec4(static_cast<float>(truth(i % 10, i / 10)));
      std::array<Vec4, 16> out;
      ReconstructionWork work;
      if (reconstruct_block(kernel.kernel, window.view(), missing, out.data(), work) != 0)
        throw std::runtime_error("a block was not filled");
      for (int p = 0; p < 16; ++p) {
        if (!(missing >> p & 1)) continue;
        const double e = static_cast<double>(out[static_cast<std::size_t>(p)].x) -
                         truth(p % 4 + kWindowMargin, p / 4 + kWindowMargin);
        sum += e * e, ++count;
      }
    }
  return std::sqrt(sum / count);
}

struct Cost {
  double taps_per_pixel = 0, ns_per_pixel = 0;
};

// Measures on blocks that lie in the cache; rounds interleave all kernels and are short, so that few are interrupted.
std::vector<std::vector<Cost>> measure_costs(int rounds) {
  constexpr int kBlocks = 256;
  std::vector<std::vector<Cost>> costs(std::size(kLattices), std::vector<Cost>(std::size(kKernels)));
  std::vector<std::vector<std::vector<double>>> times(costs.size(),
                                                      std::vector<std::vector<double>>(std::size(kKernels)));
  for (int round = -1; round < rounds; ++round)
    for (std::size_t l = 0; l < costs.size(); ++l)
      for (std::size_t k = 0; k < std::size(kKernels); ++k) {
        Window window(kLattices[l].pattern);
        window.color.fill(Vec4(0.5f));
        std::array<Vec4, 16> out;
        ReconstructionWork work;
        BlockMask unfilled = 0;
        const double begin = now();
        for (int b = 0; b < kBlocks; ++b)
          unfilled |= reconstruct_block(kKernels[k].kernel, window.view(),
                                        static_cast<BlockMask>(~kLattices[l].pattern), out.data(), work);
        const double seconds = now() - begin;
        if (unfilled != 0) throw std::runtime_error("a block was not filled");
        costs[l][k].taps_per_pixel = static_cast<double>(work.taps) / static_cast<double>(work.pixels);
        if (round >= 0) times[l][k].push_back(1e9 * seconds / static_cast<double>(work.pixels));
      }
  for (std::size_t l = 0; l < costs.size(); ++l)
    for (std::size_t k = 0; k < std::size(kKernels); ++k) costs[l][k].ns_per_pixel = median(times[l][k]);
  return costs;
}

// error[lattice][kernel][wavelength]
using Errors = std::vector<std::vector<std::vector<double>>>;
Errors measure_errors() {
  Errors errors;
  for (const Lattice& lattice : kLattices) {
    auto& of_lattice = errors.emplace_back();
    for (const Kernel& kernel : kKernels) {
      auto& of_kernel = of_lattice.emplace_back();
      for (const double wavelength : kWavelengths)
        of_kernel.push_back(root_mean_square_error(kernel, lattice.pattern, wavelength));
    }
  }
  return errors;
}

void write_tables(const std::filesystem::path& folder, const Errors& errors,
                  const std::vector<std::vector<Cost>>& costs) {
  std::string error_csv = "lattice,kernel,wavelength,rmse,over_bilinear\n",
              cost_csv =
                  "lattice,kernel,rmse_at_8_pixels,over_bilinear,taps_per_pixel,ns_per_pixel,time_over_bilinear\n";
  const auto at_8 =
      static_cast<std::size_t>(std::find(kWavelengths.begin(), kWavelengths.end(), 8.0) - kWavelengths.begin());
  for (std::size_t l = 0; l < errors.size(); ++l)
    for (std::size_t k = 0; k < errors[l].size(); ++k) {
      const auto& e = errors[l][k];
      for (std::size_t w = 0; w < e.size(); ++w)
        error_csv += fmt::format("\"{}\",\"{}\",{:g},{:.6f},{:.3f}\n", kLattices[l].name, kKernels[k].name,
                                 kWavelengths[w], e[w], e[w] / errors[l][kBilinear][w]);
      const Cost& c = costs[l][k];
      cost_csv += fmt::format("\"{}\",\"{}\",{:.5f},{:.3f},{:.2f},{:.2f},{:.2f}\n", kLattices[l].name, kKernels[k].name,
                              e[at_8], e[at_8] / errors[l][kBilinear][at_8], c.taps_per_pixel, c.ns_per_pixel,
                              c.ns_per_pixel / costs[l][kBilinear].ns_per_pixel);
    }
  write_file_atomically(folder / "stencil_error.csv", error_csv);
  write_file_atomically(folder / "stencil_cost.csv", cost_csv);
  fmt::print("{}", cost_csv);
}

void write_plots(const std::filesystem::path& folder, const Errors& errors,
                 const std::vector<std::vector<Cost>>& costs) {
  for (const std::size_t l : {std::size_t{0}, std::size_t{2}}) {
    std::vector<Series> series;
    for (std::size_t k = 0; k < std::size(kKernels); ++k)
      series.push_back({kKernels[k].name, kWavelengths, errors[l][k]});
    write_line_plot((folder / (l == 0 ? "stencil_error_8.svg" : "stencil_error_4.svg")).string(),
                    {fmt::format("Error of missing pixels, {} rendered", kLattices[l].name), "wavelength, pixels",
                     "root mean square error (log)"},
                    series);
  }
  // Per kernel a line from half rate to quarter rate.
  const auto at_8 =
      static_cast<std::size_t>(std::find(kWavelengths.begin(), kWavelengths.end(), 8.0) - kWavelengths.begin());
  std::vector<Series> series;
  for (std::size_t k = 0; k < std::size(kKernels); ++k)
    series.push_back({kKernels[k].name,
                      {costs[0][k].taps_per_pixel, costs[2][k].taps_per_pixel},
                      {errors[0][k][at_8], errors[2][k][at_8]}});
  write_line_plot((folder / "stencil_cost.svg").string(),
                  {"Error at 8 pixels of wavelength; lower ends: 8 of 16 rendered, upper: 4", "taps per missing pixel",
                   "root mean square error (log)"},
                  series);
}

void measure_all(const std::filesystem::path& folder, int rounds) {
  const Errors errors = measure_errors();
  const std::vector<std::vector<Cost>> costs = measure_costs(rounds);
  write_tables(folder, errors, costs);
  write_plots(folder, errors, costs);
}

bool check() {
  Laws laws;
  const Errors errors = measure_errors();
  const std::vector<std::vector<Cost>> costs = measure_costs(1);
  bool cubic = true, interpolating = true, unscaled = true, rows = true;
  for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
    if (kWavelengths[w] < 6) continue;
    const auto& half = errors[0];
    cubic = cubic && half[kCubic][w] <= 0.75 * half[kBilinear][w];
    interpolating = interpolating && half[kInterpolating][w] < half[kCubic][w] &&
                    errors[2][kInterpolating][w] < errors[2][kBilinear][w];
    unscaled =
        unscaled && half[kUnscaled][w] == half[kBilinear][w] && errors[2][kUnscaled][w] == errors[2][kBilinear][w];
    rows = rows && errors[1][kCubic][w] > half[kCubic][w];
  }
  laws.expect("at half rate and 6 pixels or more the 5x5 cubic leaves at most three quarters of bilinear's error",
              cubic);
  laws.expect("the interpolating cubic leaves less than the 5x5 one at half rate and than bilinear at a quarter",
              interpolating);
  laws.expect("the unscaled cubic is bilinear", unscaled);
  laws.expect("rows leave more error than diagonal pairs", rows);
  laws.expect("taps are 4, 12 and 8 at half rate", costs[0][kBilinear].taps_per_pixel == 4 &&
                                                       costs[0][kCubic].taps_per_pixel == 12 &&
                                                       costs[0][kInterpolating].taps_per_pixel == 8);
  return laws.all_hold();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run_program(
      {"tessera_stencil_curves", 101, tessera::bench::measure_all, tessera::bench::check}, argc, argv);
}
