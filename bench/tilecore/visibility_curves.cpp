// Measures the cost of visibility in Tessera alone: against blur, triangle size, samples per pixel and threads.
//
//   tessera_visibility_curves OUT_FOLDER [ROUNDS]  writes curves.csv, curve_goals.csv, curve_blur.svg, curve_tests.svg,
//                                                  curve_size.svg, curve_samples.svg
//   tessera_visibility_curves --check              a small image, no times: checks that the comparisons compare equal
//                                                  things
//
// Scene: bench/support/posed_scene.h at 1280x720, pinhole. Time: front end, binner and tile cores without shading, all
// counters on. The raster path is the normal one for scenes at rest; the ray path is forced there, so that its curve
// begins at blur 0. Rounds interleave all points; figures are medians over the rounds, counts are the same in each.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/parallel.h"
#include "bench/support/line_plot.h"
#include "bench/support/posed_scene.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"

namespace tessera::bench {
namespace {

constexpr int kThreads = 2;

struct Point {
  double quad;  // edge of a cell, pixels: two triangles
  double blur;
  int samples_per_pixel = 4;
  bool rays = true;
  int threads = kThreads;

  bool operator==(const Point&) const = default;
  SceneSettings scene() const {
    return {quad * quad / 2, blur, false, samples_per_pixel, false, tilecore::Traversal::kClass};
  }
};

const double kQuadOfPixel = std::sqrt(2.0);  // triangles of one pixel^2
const std::vector<double> kQuads = {1, 3};
const std::vector<double> kBlurs = {0, 5, 10, 20, 40, 80, 128};
const std::vector<double> kAreas = {0.5, 1, 2, 4, 8, 16};
const std::vector<int> kSampleCounts = {1, 4, 16, 64};
double quad_of(double area) { return area == 1 ? kQuadOfPixel : std::sqrt(2 * area); }

std::vector<Point> all_points() {
  std::vector<Point> points;
  const auto add = [&](const Point& p) {
    if (std::find(points.begin(), points.end(), p) == points.end()) points.push_back(p);
  };
  for (const double quad : kQuads)
    for (const double blur : kBlurs) add({quad, blur});
  for (const double area : kAreas) {
    add({quad_of(area), 0, 4, false});
    for (const double blur : {0.0, 32.0}) add({quad_of(area), blur});
  }
  for (const int samples : kSampleCounts) {
    add({kQuadOfPixel, 0, samples, false});
    add({kQuadOfPixel, 32, samples});
  }
  add({kQuadOfPixel, 0, 4, false, 1});
  add({kQuadOfPixel, 32, 4, true, 1});
  return points;
}

// Triangle tests per hit of a rasterizer that tests all samples of the pixels that a triangle's box touches during
// the shutter: the cost of bounding in space alone.
double brute_tests_per_hit(const TriangleList& list) {
  double pixels = 0, area = 0;
  for (std::size_t i = 0; i < list.indices.size(); i += 3) {
    const auto extent = [&](float TriangleList::Vertex::*axis) {
      float low = list.keys[0][list.indices[i]].*axis, high = low;
      for (std::size_t k = 0; k < 6; ++k) {
        const float v = list.keys[k / 3][list.indices[i + k % 3]].*axis;
        low = std::min(low, v), high = std::max(high, v);
      }
      return static_cast<double>(std::floor(high) - std::floor(low)) + 1;
    };
    pixels += extent(&TriangleList::Vertex::x) * extent(&TriangleList::Vertex::y);
    area += std::max(list.front_area(i / 3), 0.0);
  }
  return pixels / area;
}

struct Measured {
  Point point;
  std::shared_ptr<PosedScene> scene;
  double brute = 0;
  tilecore::TileCoreCounters counters;
  std::uint64_t triangles = 0;
  std::vector<double> bound, bin, tiles, total;

  double ms() const { return 1e3 * median(total); }
  double tests_per_hit() const {
    return static_cast<double>(counters.triangle_tests) / static_cast<double>(counters.sample_hits);
  }
};

test::MachineVisibility::Result run(const Point& point, PosedScene& scene, bool keep_tiles) {
  const ThreadLimit limit(static_cast<std::size_t>(point.threads));
  return scene.machine.run(*scene.frame, scene.pyramids, keep_tiles, point.rays);
}

// Poses the scenes of points; points with equal scenes share them.
std::vector<Measured> pose_points(const std::vector<Point>& points) {
  std::map<std::tuple<double, double, int>, std::pair<std::shared_ptr<PosedScene>, double>> scenes;
  std::vector<Measured> out;
  for (const Point& p : points) {
    auto& [scene, brute] = scenes[{p.quad, p.blur, p.samples_per_pixel}];
    if (!scene) {
      scene = std::make_shared<PosedScene>(1280, 720, p.scene());
      brute = brute_tests_per_hit(list_triangles(*scene->frame, scene->patches));
    }
    out.push_back({p, scene, brute, {}, 0, {}, {}, {}, {}});
  }
  return out;
}

// ---- Curves -----------------------------------------------------------------------------------------------------

class Curves {
 public:
  Curves(std::filesystem::path folder, std::vector<Measured> measured)
      : folder_(std::move(folder)), measured_(std::move(measured)) {}

  void write() const {
    write_table();
    write_goals();
    const auto ms = [](const Measured& m) { return m.ms(); };
    const auto tests = [](const Measured& m) { return m.tests_per_hit(); };
    plot("curve_blur.svg", {"Ray path, 4 samples per pixel", "blur, pixels", "ms, 2 threads", false, true},
         {blur_series("1-pixel quads", 1, ms), blur_series("3-pixel quads", 3, ms)});
    const auto brute = [](const Measured& m) { return m.brute; };
    plot("curve_tests.svg",
         {"Triangle tests per hit, 4 samples per pixel", "blur, pixels", "tests per hit (log)", true},
         {blur_series("1-pixel quads", 1, tests), blur_series("3-pixel quads", 3, tests),
          blur_series("brute force, 1", 1, brute), blur_series("brute force, 3", 3, brute)});
    plot("curve_size.svg", {"4 samples per pixel", "mean triangle area, pixels^2", "ms (log), 2 threads", true},
         {size_series("at rest, raster path", 0, false), size_series("at rest, ray path", 0, true),
          size_series("32 pixels of blur", 32, true)});
    plot("curve_samples.svg", {"Triangles of 1 pixel^2", "samples per pixel", "ms (log), 2 threads", true},
         {sample_series("at rest, raster path", 0, false), sample_series("32 pixels of blur", 32, true)});
  }

 private:
  const Measured& at(const Point& p) const {
    return *std::find_if(measured_.begin(), measured_.end(), [&](const Measured& m) { return m.point == p; });
  }

  Series blur_series(const char* name, double quad, const std::function<double(const Measured&)>& value) const {
    Series s{name, kBlurs, {}};
    for (const double blur : kBlurs) s.y.push_back(value(at({quad, blur})));
    return s;
  }
  Series size_series(const char* name, double blur, bool rays) const {
    Series s{name, kAreas, {}};
    for (const double area : kAreas) s.y.push_back(at({quad_of(area), blur, 4, rays}).ms());
    return s;
  }
  Series sample_series(const char* name, double blur, bool rays) const {
    Series s{name, {}, {}};
    for (const int samples : kSampleCounts) {
      s.x.push_back(samples);
      s.y.push_back(at({kQuadOfPixel, blur, samples, rays}).ms());
    }
    return s;
  }
  void plot(const char* file, const PlotLabels& labels, const std::vector<Series>& series) const {
    write_line_plot((folder_ / file).string(), labels, series);
  }

  void write_table() const {
    std::string csv =
        "quad,blur,samples_per_pixel,path,threads,mean_area,patches,triangles,box_tests,triangle_tests,sample_hits,"
        "tests_per_hit,brute_tests_per_hit,hit_percent,bound_ms,bin_ms,"
        "tiles_ms,ms,ns_per_sample\n";
    for (const Measured& m : measured_) {
      const auto& c = m.counters;
      csv += fmt::format(
          "{:.3g},{:g},{},{},{},{:.2f},{},{},{},{},{},{:.3f},{:.3f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.2f}\n",
          m.point.quad, m.point.blur, m.point.samples_per_pixel, m.point.rays ? "ray" : "raster", m.point.threads,
          m.scene->mean_area, m.scene->patches.size(), m.triangles, c.box_tests, c.triangle_tests, c.sample_hits,
          m.tests_per_hit(), m.brute, 100 / m.tests_per_hit(), 1e3 * median(m.bound), 1e3 * median(m.bin),
          1e3 * median(m.tiles), m.ms(), 1e6 * m.ms() / (1280.0 * 720.0 * m.point.samples_per_pixel));
    }
    write_file_atomically(folder_ / "curves.csv", csv);
  }

  void write_goals() const {
    std::string csv = "goal,wanted,reached\n";
    const auto add = [&](const std::string& goal, const char* wanted, double reached) {
      csv += fmt::format("{},{},{:.3f}\n", goal, wanted, reached);
    };
    for (const double quad : kQuads) {
      const std::string quads = fmt::format("{:g}-pixel quads", quad);
      add("time at 128 pixels of blur over blur 0 on the ray path: " + quads, "<= 1.5",
          at({quad, 128}).ms() / at({quad, 0}).ms());
      add("triangle tests per hit at 80 pixels of blur over those at 5: " + quads, "< 1.1",
          at({quad, 80}).tests_per_hit() / at({quad, 5}).tests_per_hit());
    }
    add("time of one thread over two at rest", ">= 1.9",
        at({kQuadOfPixel, 0, 4, false, 1}).ms() / at({kQuadOfPixel, 0, 4, false}).ms());
    add("time of one thread over two with 32 pixels of blur", ">= 1.9",
        at({kQuadOfPixel, 32, 4, true, 1}).ms() / at({kQuadOfPixel, 32}).ms());
    write_file_atomically(folder_ / "curve_goals.csv", csv);
    fmt::print("{}", csv);
  }

  std::filesystem::path folder_;
  std::vector<Measured> measured_;
};

bool same_counts(const tilecore::TileCoreCounters& a, const tilecore::TileCoreCounters& b) {
  return std::tie(a.box_tests, a.triangle_tests, a.sample_hits) ==
         std::tie(b.box_tests, b.triangle_tests, b.sample_hits);
}

void measure_all(const std::filesystem::path& folder, int rounds) {
  std::vector<Measured> measured = pose_points(all_points());
  // The round before the first one warms up.
  for (int round = -1; round < rounds; ++round)
    for (Measured& m : measured) {
      const auto result = run(m.point, *m.scene, false);
      if (round < 0)
        m.counters = result.counters, m.triangles = result.tessellation.triangles;
      else if (!same_counts(m.counters, result.counters))
        throw std::runtime_error("two runs of the same frame count differently");
      if (round < 0) continue;
      m.bound.push_back(result.stages.bound_seconds);
      m.bin.push_back(result.stages.bin_seconds);
      m.tiles.push_back(result.stages.tile_seconds);
      m.total.push_back(result.stages.total());
    }
  Curves(folder, std::move(measured)).write();
}

// At rest both paths see the same; threads change no count; brute force tests more with more blur.
bool check() {
  Laws laws;
  PosedScene still(320, 180, Point{3, 0}.scene()), moving(320, 180, Point{3, 32}.scene());
  const auto raster = run({3, 0, 4, false}, still, true), rays = run({3, 0}, still, true),
             one = run({3, 32, 4, true, 1}, moving, false), two = run({3, 32}, moving, true);
  bool same = true;
  for (std::size_t t = 0; t < raster.tiles.size(); ++t)
    same = same && raster.tiles[t].patch == rays.tiles[t].patch && raster.tiles[t].triangle == rays.tiles[t].triangle &&
           raster.tiles[t].z == rays.tiles[t].z;
  laws.expect("both paths see the same at rest", same);
  bool differ = false;
  for (std::size_t t = 0; t < raster.tiles.size(); ++t) differ = differ || raster.tiles[t].z != two.tiles[t].z;
  laws.expect("a frame that moves is another", differ);
  laws.expect("the ray path is another path", !same_counts(raster.counters, rays.counters));
  laws.expect("one thread counts as two", same_counts(one.counters, two.counters));
  const double brute_still = brute_tests_per_hit(list_triangles(*still.frame, still.patches)),
               brute_moving = brute_tests_per_hit(list_triangles(*moving.frame, moving.patches));
  const auto per_hit = [](const auto& result) {
    return static_cast<double>(result.counters.triangle_tests) / static_cast<double>(result.counters.sample_hits);
  };
  fmt::print("tests per hit: {:.2f} at rest, {:.2f} moving; brute force {:.2f} and {:.2f}\n", per_hit(rays),
             per_hit(two), brute_still, brute_moving);
  laws.expect("brute force tests more where things move, and more than at rest",
              per_hit(rays) < brute_still && brute_moving > 5 * per_hit(two) && brute_moving > 5 * brute_still);
  return laws.all_hold();
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  const tessera::ThreadLimit limit(tessera::bench::kThreads);
  return tessera::bench::run_program(
      {"tessera_visibility_curves", 3, tessera::bench::measure_all, tessera::bench::check}, argc, argv);
}
