#pragma once

#include <string>
#include <vector>

namespace tessera::bench {

// A line plot as an SVG file: axes with ticks, one polyline with markers per series, a legend.
struct Series {
  std::string name;
  std::vector<double> x, y;
};
struct PlotLabels {
  std::string title, x, y;
  bool logarithmic_y = false;
  bool from_zero = false;  // the y axis begins at zero, so that heights compare
};
// Throws SystemError when the file cannot be written.
void write_line_plot(const std::string& file, const PlotLabels& labels, const std::vector<Series>& series);

}  // namespace tessera::bench
