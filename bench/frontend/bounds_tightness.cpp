// How much larger than the truth the boxes of each bounding method are, per split level, as Munkberg et al. 2010 plot
// it; and what the front end's splits buy in tile overlap.
//
//   tessera_bounds_tightness CAPTURE OUT_FOLDER
//
// The truth is "tessellate, then bound": the box of the sub-patch's own vertices in the frame that OBB, TPATCH and
// NPATCH share. Writes tightness.csv and the plots bounds_volume.svg, bounds_area.svg and bounds_extent.svg.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "bench/support/line_plot.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/capture_reader.h"
#include "tilecore/tessellator.h"

namespace tessera::frontend {
namespace {

constexpr int kLevels = 7;

struct Sizes {
  double extent = 0, area = 0, volume = 0;
};
Sizes sizes_of(const std::array<double, 3>& s) { return {s[0] + s[1] + s[2], s[0] * s[1] + s[1] * s[2] + s[2] * s[0], s[0] * s[1] * s[2]}; }

// Sides of the box of all vertices of the cells, along the axes.
std::array<double, 3> truth(const FrameGeometry& frame, std::uint32_t patch, const CellRange& cells, const Frame& axes) {
  std::array<double, 3> low, high;
  low.fill(1e300);
  high.fill(-1e300);
  for (int j = cells.j0; j <= cells.j1; ++j)
    for (int i = cells.i0; i <= cells.i1; ++i) {
      const DVec3 p(tilecore::Tessellator::vertex_position(frame, patch, i, j, 0));
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], glm::dot(p, axes[a]));
        high[a] = std::max(high[a], glm::dot(p, axes[a]));
      }
    }
  return {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
}

// The parts of a grid after `level` halvings, alternating directions; empty when the grid has too few cells.
std::vector<CellRange> parts(const CellRange& whole, int level) {
  const int across = 1 << ((level + 1) / 2), up = 1 << (level / 2);
  if (whole.i1 < across || whole.j1 < up) return {};
  std::vector<CellRange> out;
  for (int j = 0; j < up; ++j)
    for (int i = 0; i < across; ++i)
      out.push_back({static_cast<std::uint8_t>(whole.i1 * i / across), static_cast<std::uint8_t>(whole.j1 * j / up),
                     static_cast<std::uint8_t>(whole.i1 * (i + 1) / across), static_cast<std::uint8_t>(whole.j1 * (j + 1) / up)});
  return out;
}

struct Ratios {
  Sizes sum, sum_truth;  // for ratios of totals
  Sizes mean;            // of single ratios, summed
  std::uint64_t count = 0;
};

void measure(const FrameGeometry& frame, const PyramidLibrary& pyramids, BoundMethod method, int level, Ratios& out) {
  SubPatchBounder bounder(frame, pyramids, method);
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    const PosedDrawable& drawable = frame.drawable_of(patch);
    if (drawable.drawable->kind != Primitive::Kind::kBezierPatches || !drawable.material->displacement) continue;
    bounder.begin(patch);
    for (const CellRange& cells : parts(patch_cells(frame, patch), level)) {
      const MovingBox box = bounder.box(cells);
      const Frame axes = corner_frame(bounder.nets()).axes;
      const Sizes is = sizes_of({box.high[0][0] - box.low[0][0], box.high[0][1] - box.low[0][1], box.high[0][2] - box.low[0][2]});
      const Sizes should = sizes_of(truth(frame, patch, cells, axes));
      if (!(should.volume > 0) || !std::isfinite(is.volume)) continue;
      ++out.count;
      out.mean.extent += is.extent / should.extent;
      out.mean.area += is.area / should.area;
      out.mean.volume += is.volume / should.volume;
    }
  }
}

void run(const std::string& capture_file, const std::filesystem::path& folder) {
  const Capture capture = read_capture(capture_file);
  const Assembly assembly = assemble(capture);
  const PyramidLibrary pyramids(assembly);
  FrameRequest request;
  request.open_time = request.close_time = (capture.settings.first_frame + capture.settings.shutter_open) / capture.settings.frame_rate;
  const auto frame = pose_frame(assembly, choose_camera(capture, request.open_time, request.width, request.height), request);

  std::string csv = "method,level,sub_patches,extent_ratio,area_ratio,volume_ratio\n";
  std::vector<bench::Series> extent, area, volume;
  for (std::size_t m = 0; m < kBoundMethodNames.size(); ++m) {
    const std::string name(kBoundMethodNames[m]);
    extent.push_back({name, {}, {}}), area.push_back({name, {}, {}}), volume.push_back({name, {}, {}});
    for (int level = 0; level < kLevels; ++level) {
      Ratios r;
      measure(*frame, pyramids, static_cast<BoundMethod>(m), level, r);
      if (r.count == 0) continue;
      const double n = static_cast<double>(r.count);
      csv += fmt::format("{},{},{},{:.4f},{:.4f},{:.4f}\n", name, level, r.count, r.mean.extent / n, r.mean.area / n, r.mean.volume / n);
      for (auto* series : {&extent, &area, &volume}) series->back().x.push_back(level);
      extent.back().y.push_back(r.mean.extent / n);
      area.back().y.push_back(r.mean.area / n);
      volume.back().y.push_back(r.mean.volume / n);
    }
  }
  write_file_atomically(folder / "tightness.csv", csv);
  fmt::print("{}", csv);
  bench::write_line_plot((folder / "bounds_extent.svg").string(), {"Sum of sides against the truth's", "split levels", "ratio (log)", true}, extent);
  bench::write_line_plot((folder / "bounds_area.svg").string(), {"Surface of the box against the truth's", "split levels", "ratio (log)", true}, area);
  bench::write_line_plot((folder / "bounds_volume.svg").string(), {"Volume of the box against the truth's", "split levels", "ratio (log)", true}, volume);
}

}  // namespace
}  // namespace tessera::frontend

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: tessera_bounds_tightness CAPTURE OUT_FOLDER\n");
    return 2;
  }
  try {
    tessera::frontend::run(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "tessera_bounds_tightness: {}\n", error.what());
    return 1;
  }
}
