#include "bench/support/line_plot.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/atomic_file.h"

namespace tessera::bench {
namespace {

constexpr double kLeft = 70, kTop = 40, kWidth = 470, kHeight = 300;
constexpr const char* kColors[] = {"#1b6ca8", "#d1495b", "#2e933c", "#8f5fbf", "#c98a10",
                                   "#3b3b3b", "#3aa6a0", "#b5739d", "#8a5a2b"};

struct Range {
  double low = 1e300, high = -1e300;
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
};

// Steps of 1, 2 or 5 times a power of ten, about five of them.
std::vector<double> linear_ticks(const Range& range) {
  const double rough = (range.high - range.low) / 5, power = std::pow(10, std::floor(std::log10(rough))),
               digit = rough / power;
  const double step = power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
  std::vector<double> ticks;
  for (double t = std::ceil(range.low / step - 1e-9) * step; t <= range.high + 1e-9 * step; t += step)
    ticks.push_back(t + 0.0);
  return ticks;
}

}  // namespace

void write_line_plot(const std::string& file, const PlotLabels& labels, const std::vector<Series>& series) {
  const auto mapped = [&](double y) { return labels.logarithmic_y ? std::log10(y) : y; };
  Range xs, ys;
  for (const Series& s : series) {
    for (const double x : s.x) xs.add(x);
    for (const double y : s.y) ys.add(mapped(y));
  }
  if (labels.from_zero) ys.add(0);
  if (ys.high - ys.low < 1e-9) ys.high = ys.low + 1;
  const auto px = [&](double x) { return kLeft + (x - xs.low) / std::max(xs.high - xs.low, 1e-9) * kWidth; };
  const auto py = [&](double y) { return kTop + kHeight - (mapped(y) - ys.low) / (ys.high - ys.low) * kHeight; };

  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 700 400\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"700\" height=\"400\" fill=\"white\"/>\n<text x=\"{}\" y=\"22\" font-size=\"14\">{}</text>\n",
      kLeft, labels.title);
  svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>\n", kLeft,
                     kTop, kWidth, kHeight);
  for (const double t : linear_ticks(xs))
    svg +=
        fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:g}</text>\n", px(t), kTop + kHeight + 18, t);
  std::vector<double> ticks = linear_ticks(ys);
  for (const double t : ticks) {
    const double value = labels.logarithmic_y ? std::pow(10, t) : t;
    const double at = kTop + kHeight - (t - ys.low) / (ys.high - ys.low) * kHeight;
    svg += fmt::format(
        "<line x1=\"{}\" y1=\"{:.1f}\" x2=\"{}\" y2=\"{:.1f}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{}</text>\n",
        kLeft, at, kLeft + kWidth, at, kLeft - 6, at + 4,
        value >= 1000 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value));
  }
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", kLeft + kWidth / 2,
                     kTop + kHeight + 40, labels.x);
  svg += fmt::format("<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     kTop + kHeight / 2, labels.y);
  for (std::size_t s = 0; s < series.size(); ++s) {
    const char* color = kColors[s % std::size(kColors)];
    std::string points;
    for (std::size_t k = 0; k < series[s].x.size(); ++k) {
      const double x = px(series[s].x[k]), y = py(series[s].y[k]);
      points += fmt::format("{:.1f},{:.1f} ", x, y);
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x, y, color);
    }
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", points, color);
    const double y = kTop + 14 + 20 * static_cast<double>(s);
    svg += fmt::format(
        "<rect x=\"{}\" y=\"{:.1f}\" width=\"12\" height=\"4\" fill=\"{}\"/><text x=\"{}\" y=\"{:.1f}\">{}</text>\n",
        kLeft + kWidth + 16, y - 6, color, kLeft + kWidth + 34, y, series[s].name);
  }
  write_file_atomically(file, svg + "</svg>\n");
}

}  // namespace tessera::bench
