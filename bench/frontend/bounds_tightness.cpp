// Measures the tightness of each bounding method, as the ratio of its boxes to the true ones by split level (as in
// Munkberg et al. 2010), and the tile overlap by the front end's splits.
//
//   tessera_bounds_tightness CAPTURE OUT_FOLDER
//
// True boxes come from "tessellate, then bound": the box of the sub-patch's own vertices in the frame that OBB, TPATCH
// and NPATCH share. Writes tightness.csv and the plots bounds_volume.svg, bounds_area.svg and bounds_extent.svg.
//
// Overlap is the number of tiles in the lists over the number of tiles that some triangle of the sub-patch touches at
// some time through some lens point, by the front end's limit on a sub-patch's size. Writes overlap.csv and overlap.svg.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "bench/support/line_plot.h"
#include "binner/tile_coverage.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "scene/capture_reader.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::frontend {
namespace {

constexpr int kLevels = 7;

struct Sizes {
  double extent = 0, area = 0, volume = 0;
};
Sizes sizes_of(const std::array<double, 3>& s) {
  return {s[0] + s[1] + s[2], s[0] * s[1] + s[1] * s[2] + s[2] * s[0], s[0] * s[1] * s[2]};
}

// Sides of the box of all vertices of the cells, along the given axes.
std::array<double, 3> truth(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::CellRange& cells,
                            const Frame& axes) {
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
std::vector<scene::CellRange> parts(const scene::CellRange& whole, int level) {
  const int across = 1 << ((level + 1) / 2), up = 1 << (level / 2);
  if (whole.i1 < across || whole.j1 < up) return {};
  std::vector<scene::CellRange> out;
  for (int j = 0; j < up; ++j)
    for (int i = 0; i < across; ++i)
      out.push_back({static_cast<std::uint8_t>(whole.i1 * i / across), static_cast<std::uint8_t>(whole.j1 * j / up),
                     static_cast<std::uint8_t>(whole.i1 * (i + 1) / across),
                     static_cast<std::uint8_t>(whole.j1 * (j + 1) / up)});
  return out;
}

struct Ratios {
  Sizes mean;  // summed
  std::uint64_t count = 0;
};

void measure(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, BoundMethod method, int level,
             Ratios& out) {
  SubPatchBounder bounder(frame, pyramids, method);
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    const scene::PosedDrawable& drawable = frame.drawable_of(patch);
    if (drawable.drawable->kind != scene::Primitive::Kind::kBezierPatches || !drawable.material->displacement) continue;
    bounder.begin(patch);
    for (const scene::CellRange& cells : parts(patch_cells(frame, patch), level)) {
      const MovingBox box = bounder.box(cells);
      const Frame axes = corner_frame(bounder.nets()).axes;
      const Sizes is =
          sizes_of({box.high[0][0] - box.low[0][0], box.high[0][1] - box.low[0][1], box.high[0][2] - box.low[0][2]});
      const Sizes should = sizes_of(truth(frame, patch, cells, axes));
      if (!(should.volume > 0) || !std::isfinite(is.volume)) continue;
      ++out.count;
      out.mean.extent += is.extent / should.extent;
      out.mean.area += is.area / should.area;
      out.mean.volume += is.volume / should.volume;
    }
  }
}

// A vertex on screen at one time, with its circle of confusion.
struct Seen {
  double x, y, radius;
};
Seen seen_at(const DVec4& open, const DVec4& close, double t, const scene::Projection& projection) {
  const DVec4 r = open * (1 - t) + close * t;
  const double w = std::max(r.w, 1e-6);
  return {r.x / w, r.y / w, defocus_radius(projection, std::max(r.z, 1e-6))};
}

// Tiles that the cells of a sub-patch touch at any of 17 times: rectangles around cells of a few pixels.
std::uint64_t touched_tiles(const scene::FrameGeometry& frame, const BoundedSubPatch& piece,
                            const binner::TileGrid& grid) {
  const scene::PosedDrawable& drawable = frame.drawable_of(piece.base_patch);
  const int columns = piece.range.i1 - piece.range.i0 + 1, rows = piece.range.j1 - piece.range.j0 + 1;
  std::array<std::vector<DVec4>, 2> raster;
  for (std::size_t key = 0; key < 2; ++key)
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        raster[key].push_back(DVec4(drawable.to_raster[key] * Vec4(tilecore::Tessellator::vertex_position(
                                                                       frame, piece.base_patch, piece.range.i0 + i,
                                                                       piece.range.j0 + j, static_cast<int>(key)),
                                                                   1.0f)));
  std::set<binner::TileIndex> tiles;
  constexpr int kTimes = 17;
  for (int t = 0; t < (drawable.moving ? kTimes : 1); ++t)
    for (int j = 0; j + 1 < rows; ++j)
      for (int i = 0; i + 1 < columns; ++i) {
        ScreenBounds b{1e30f, 1e30f, -1e30f, -1e30f, 0, 1, 1, false};
        for (const int corner : {0, 1, columns, columns + 1}) {
          const auto k = static_cast<std::size_t>(j * columns + i + corner);
          const Seen s = seen_at(raster[0][k], raster[1][k], static_cast<double>(t) / (kTimes - 1), frame.projection);
          b.x0 = std::min(b.x0, static_cast<float>(s.x - s.radius));
          b.x1 = std::max(b.x1, static_cast<float>(s.x + s.radius));
          b.y0 = std::min(b.y0, static_cast<float>(s.y - s.radius));
          b.y1 = std::max(b.y1, static_cast<float>(s.y + s.radius));
        }
        const IntRect r = grid.covered(b);
        for (int y = r.y0; y < r.y1; ++y)
          for (int x = r.x0; x < r.x1; ++x) tiles.insert(grid.index(x, y));
      }
  return tiles.size();
}

void measure_overlap(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                     const std::filesystem::path& folder) {
  std::string csv = "split_pixels,coverage,sub_patches,overlaps,touched,ratio\n";
  std::vector<bench::Series> series = {{"rectangle", {}, {}}, {"exact", {}, {}}};
  for (const double pixels : {16.0, 24.0, 32.0, 48.0, 64.0, 96.0, 128.0, 192.0})
    for (const binner::CoverageMethod coverage : {binner::CoverageMethod::kRectangle, binner::CoverageMethod::kExact}) {
      gpu::GpuConfiguration gpu;
      gpu.frontend.split_pixels = pixels;
      gpu.frontend.split_budget = 4096;
      gpu.frontend.split_depth = 12;
      gpu.binner.coverage = coverage;
      const binner::TileGrid grid(frame.request.width, frame.request.height, gpu.tile.width, gpu.tile.height);
      binner::TileCoverageUnit unit(gpu.binner);
      std::uint64_t overlaps = 0, touched = 0, pieces = 0;
      for (const BoundedSubPatch& piece : run_front_end(frame, pyramids, gpu.front_end_spec()).sub_patches) {
        const scene::PosedDrawable& drawable = frame.drawable_of(piece.base_patch);
        if (drawable.drawable->kind != scene::Primitive::Kind::kBezierPatches) continue;
        ++pieces;
        overlaps += unit.cover({piece.bounds, piece.corners(frame)}, drawable.moving, grid).covered;
        touched += touched_tiles(frame, piece, grid);
      }
      const double ratio = static_cast<double>(overlaps) / static_cast<double>(touched);
      csv += fmt::format("{},{},{},{},{},{:.4f}\n", pixels, word(coverage), pieces, overlaps, touched, ratio);
      bench::Series& s = series[coverage == binner::CoverageMethod::kExact ? 1 : 0];
      s.x.push_back(pixels);
      s.y.push_back(ratio);
    }
  write_file_atomically(folder / "overlap.csv", csv);
  fmt::print("{}", csv);
  bench::write_line_plot((folder / "overlap.svg").string(),
                         {"Tiles in queues over tiles touched", "frontend.split_pixels", "ratio", false}, series);
}

void run(const std::string& capture_file, const std::filesystem::path& folder) {
  const scene::Capture capture = scene::read_capture(capture_file);
  const scene::Assembly assembly = assemble(capture);
  const PyramidLibrary pyramids(assembly);
  scene::FrameRequest request;
  request.open_time = (capture.settings.first_frame + capture.settings.shutter_open) / capture.settings.frame_rate;
  request.close_time = (capture.settings.first_frame + capture.settings.shutter_close) / capture.settings.frame_rate;
  const auto frame = pose_frame(assembly, choose_camera(capture, request.width, request.height), request);

  std::string csv = "method,level,sub_patches,extent_ratio,area_ratio,volume_ratio\n";
  std::vector<bench::Series> extent, area, volume;
  for (std::size_t m = 0; m < kEnumWords<BoundMethod>.size(); ++m) {
    const std::string name(kEnumWords<BoundMethod>[m]);
    extent.push_back({name, {}, {}}), area.push_back({name, {}, {}}), volume.push_back({name, {}, {}});
    for (int level = 0; level < kLevels; ++level) {
      Ratios r;
      measure(*frame, pyramids, static_cast<BoundMethod>(m), level, r);
      if (r.count == 0) continue;
      const double n = static_cast<double>(r.count);
      csv += fmt::format("{},{},{},{:.4f},{:.4f},{:.4f}\n", name, level, r.count, r.mean.extent / n, r.mean.area / n,
                         r.mean.volume / n);
      for (auto* series : {&extent, &area, &volume}) series->back().x.push_back(level);
      extent.back().y.push_back(r.mean.extent / n);
      area.back().y.push_back(r.mean.area / n);
      volume.back().y.push_back(r.mean.volume / n);
    }
  }
  write_file_atomically(folder / "tightness.csv", csv);
  fmt::print("{}", csv);
  bench::write_line_plot((folder / "bounds_extent.svg").string(),
                         {"Sum of sides against the truth's", "split levels", "ratio (log)", true}, extent);
  bench::write_line_plot((folder / "bounds_area.svg").string(),
                         {"Surface of the box against the truth's", "split levels", "ratio (log)", true}, area);
  bench::write_line_plot((folder / "bounds_volume.svg").string(),
                         {"Volume of the box against the truth's", "split levels", "ratio (log)", true}, volume);
  measure_overlap(*frame, pyramids, folder);
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
