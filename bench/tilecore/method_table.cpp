// Counts the tests of each visibility method for the same hits, on moving patches of 8x8 quads and on shipped
// captures. It measures counts, not times.
//
//   tessera_method_table OUT_FOLDER    writes method_table.csv, curves.csv, branch_nodes.csv, valid_rate.csv,
//                                      captures.csv and the plots
//   tessera_method_table --check       one row only
//
// Every figure comes from the tile cores' own counters. Each method's hits (for captures: images) are compared with
// the default's, bit by bit.
#include <cmath>
#include <filesystem>
#include <random>
#include <set>
#include <string>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "bench/support/line_plot.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/captures.h"
#include "tilecore/tile_core.h"

namespace tessera::bench {
namespace {

using namespace tessera::tilecore;

constexpr int kFrameSide = 192;  // pixels; one unit of the scene is one pixel
constexpr int kPatches = 24;

struct Scene {
  scene::Capture capture;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
  std::vector<IntRect> pixels;  // bounds of each patch over its whole motion
};

// Flat patches at `corners` (pixels from the frame's lower left corner) with sides of `side`, cut into quads of
// `quad`, that move by (way_x, way_y).
std::unique_ptr<Scene> make_scene(const std::vector<std::pair<double, double>>& corners, double side, double quad,
                                  double way_x, double way_y) {
  auto scene = std::make_unique<Scene>();
  scene::Material material;
  material.double_sided = true;
  const int m = test::add_material(scene->capture, material);
  std::vector<Vec3> points;
  for (const auto& [x, y] : corners) {
    const auto f = [](double v) { return static_cast<float>(v); };
    for (const Vec3& p :
         test::flat_patch({f(x - kFrameSide / 2), f(y - kFrameSide / 2), 0}, {f(side), 0, 0}, {0, f(side), 0}))
      points.push_back(p);
    // Raster space has y down. One pixel more on each side, as vertices are put on the sub-pixel grid.
    const auto pixel = [](double v) { return static_cast<int>(std::floor(v)); };
    scene->pixels.push_back({pixel(x) - 1, pixel(kFrameSide - y - side - way_y) - 1, pixel(x + side + way_x) + 2,
                             pixel(kFrameSide - y) + 2});
  }
  const int node = test::add_node(scene->capture, test::patches(points, m));
  if (way_x != 0 || way_y != 0) test::add_motion(scene->capture, node, {way_x, way_y, 0});
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = camera.y_mag = kFrameSide / 2;
  test::add_camera(scene->capture, {0, 0, 10}, camera);
  scene->assembly = scene::assemble(scene->capture);
  scene::FrameRequest request;
  request.width = request.height = kFrameSide;
  request.close_time = 1;
  request.tessellation.target_edge_pixels = quad * 1.001;  // rounding must not add a quad
  scene->frame =
      scene::pose_frame(scene->assembly, scene::choose_camera(scene->capture, kFrameSide, kFrameSide), request);
  return scene;
}

// Patches of 8x8 quads at random places in the middle of the frame, at any sub-pixel position; motion along the diagonal.
std::unique_ptr<Scene> make_toy(double quad, double motion) {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 8) * 0x1p-24;
  };
  const double way = motion / std::sqrt(2.0), side = 8 * quad, start = kFrameSide / 2 - way / 2 - side / 2;
  std::vector<std::pair<double, double>> corners;
  for (int k = 0; k < kPatches; ++k) {
    const double x = uniform(-16, 16), y = uniform(-16, 16);
    corners.emplace_back(start + x, start + y);
  }
  return make_scene(corners, side, quad, way, way);
}

// Sums up a hash of all hits, so that their order does not matter.
class HashSink final : public HitSink {
 public:
  std::uint64_t hash = 0;
  void take(std::span<const Hit> hits) override {
    for (const Hit& h : hits) {
      std::uint64_t mixed = h.sample;
      for (const std::uint32_t bits : {h.triangle, std::bit_cast<std::uint32_t>(h.z),
                                       std::bit_cast<std::uint32_t>(h.b1), std::bit_cast<std::uint32_t>(h.b2)})
        mixed = (mixed ^ bits) * 0x9E3779B97F4A7C15u, mixed ^= mixed >> 29;
      hash += mixed;
    }
  }
};

struct Result {
  TileCoreCounters core;
  StencilCounters stencil;
  RayCounters rays;
  std::uint64_t hash = 0;

  double efficiency() const { return static_cast<double>(core.sample_hits) / static_cast<double>(core.triangle_tests); }
};

double ratio(std::uint64_t a, std::uint64_t b) {
  return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}

// Tests every patch in every tile that the rectangle of its motion touches, without occlusion. `times`: number of
// times that samples have; 0: all of the pattern's.
Result run(const Scene& scene, const VisibilityMethodSettings& method, int samples_per_pixel = 4, int times = 0) {
  const scene::FrameGeometry& frame = *scene.frame;
  const binner::TileGrid grid(kFrameSide, kFrameSide, 32, 32);
  SamplingSettings sampling{samples_per_pixel, 0, 0};
  sampling.times = times;
  const SamplePattern pattern(sampling);
  TileJob job;
  job.frame = &frame;
  job.grid = &grid;
  job.pattern = &pattern;
  job.core.visibility = method;
  job.forced.motion = true;  // also without motion
  TileCore core;
  Result result;
  HashSink sink;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    core.begin_tile(job, tile);
    for (std::uint32_t patch = 0; patch < scene.assembly.patch_count(); ++patch) {
      if (scene.pixels[patch].intersect(grid.pixels(tile)).empty()) continue;
      binner::ListEntry entry{};
      entry.base_patch = patch;
      entry.range = scene::patch_cells(frame, patch);
      core.find_hits(job, entry, sink);
    }
    result.hash += sink.hash;
  }
  const CoreCounters counted = core.take_result().counters;
  result.core = counted.tilecore;
  result.stencil = counted.stencil;
  result.rays = counted.rays;
  return result;
}

struct NamedMethod {
  const char* name;
  VisibilityMethodSettings settings;
};

std::vector<NamedMethod> methods() {
  using M = VisibilityMethod;
  return {{"patch-bvh", {}},
          {"patch-bvh-classes", {M::kPatchBvh, 0, Traversal::kClass}},
          {"patch-bvh-rays", {M::kPatchBvh, 0, Traversal::kRay}},
          {"brute", {M::kBrute}},
          {"segments", {M::kSegments}},
          {"partition", {M::kPartition}},
          {"clusters", {M::kClusters}},
          {"cluster-partition", {M::kClusterPartition}},
          {"interleaved", {M::kInterleaved}}};
}

Result checked(const Scene& scene, const VisibilityMethodSettings& method, const Result& expected,
               const std::string& name, int samples_per_pixel = 4) {
  // The interleaved method tests at a few times; with the same times, patch-bvh finds the same hits.
  const int times = method.method == VisibilityMethod::kInterleaved ? VisibilityMethodSettings::kInterleavedTimes : 0;
  const Result result = run(scene, method, samples_per_pixel, times);
  const Result same_times = times > 0 ? run(scene, {}, samples_per_pixel, times) : expected;
  if (result.hash != same_times.hash || result.core.sample_hits != same_times.core.sample_hits)
    throw UsageError(name + " finds other hits than patch-bvh");
  return result;
}

constexpr const char* kTableHead =
    "quad_px,motion_px,method,hits,box_tests_per_hit,triangle_tests_per_hit,efficiency_percent,stencil_tests_per_hit,"
    "valid_percent,occupancy_percent,"
    "node_visits_per_ray,ray_hit_percent\n";

// The columns from the method's name on.
std::string counted(const char* name, const Result& r) {
  const std::uint64_t hits = r.core.sample_hits;
  std::string row = fmt::format("{},{},{:.2f},{:.2f},{:.2f}", name, hits, ratio(r.core.box_tests, hits),
                                ratio(r.core.triangle_tests, hits), 100 * r.efficiency());
  // A figure stays empty if the unit that would have counted it did not run.
  const auto add = [&](bool there, double value) { row += there ? fmt::format(",{:.2f}", value) : std::string(","); };
  const bool stencil = r.stencil.tests > 0, rays = r.rays.rays_cast > 0;
  add(stencil, ratio(r.stencil.tests, hits));
  add(stencil, 100 * ratio(r.stencil.hits, r.stencil.kept));
  add(stencil, 100 * ratio(r.stencil.kept, r.stencil.lanes_issued));
  add(rays, ratio(r.rays.node_visits, r.rays.rays_cast));
  add(rays, 100 * ratio(r.rays.rays_hit, r.rays.rays_cast));
  return row + "\n";
}

struct Toy {
  double quad, motion;
};

// Runs all methods on the toys, appends rows for them to `csv` and points (x of the toy, efficiency) to `series`.
template <class X>
void measure_methods(const std::vector<Toy>& toys, const X& x, std::string& csv, std::vector<Series>& series) {
  for (const NamedMethod& method : methods()) series.push_back({method.name, {}, {}});
  for (const Toy& toy : toys) {
    const auto scene = make_toy(toy.quad, toy.motion);
    for (const scene::TessellationPattern& pattern : scene->frame->patterns)
      if (pattern.nu != 8 || pattern.nv != 8) throw UsageError("a patch is not cut into 8x8 quads");
    const Result expected = run(*scene, {});
    std::size_t k = 0;
    for (const NamedMethod& method : methods()) {
      const Result result = checked(*scene, method.settings, expected, method.name);
      csv += fmt::format("{},{},{}", toy.quad, toy.motion, counted(method.name, result));
      series[k].x.push_back(x(toy));
      series[k++].y.push_back(100 * result.efficiency());
    }
  }
}

void write_method_table(const std::filesystem::path& folder) {
  std::string csv = kTableHead, curves = kTableHead;
  std::vector<Series> ignored, blur, size;
  measure_methods(
      {{1, 0}, {1, 5}, {1, 20}, {1, 80}, {3, 0}, {3, 5}, {3, 20}, {3, 80}}, [](const Toy& t) { return t.motion; }, csv,
      ignored);
  write_file_atomically(folder / "method_table.csv", csv);
  fmt::print("{}", csv);
  measure_methods(
      {{1, 0}, {1, 2}, {1, 5}, {1, 10}, {1, 20}, {1, 40}, {1, 80}}, [](const Toy& t) { return t.motion; }, curves,
      blur);
  measure_methods(
      {{0.5, 20}, {0.75, 20}, {1, 20}, {1.5, 20}, {2, 20}, {3, 20}, {5, 20}}, [](const Toy& t) { return t.quad; },
      curves, size);
  write_file_atomically(folder / "curves.csv", curves);
  write_line_plot((folder / "efficiency_blur.svg").string(),
                  {"Hits over triangle tests, quads of 1 pixel", "motion, pixels", "% (log)", true}, blur);
  write_line_plot((folder / "efficiency_size.svg").string(),
                  {"Hits over triangle tests, 20 pixels of motion", "side of a quad, pixels", "% (log)", true}, size);
}

void write_branch_nodes(const std::filesystem::path& folder) {
  std::string csv =
      "quad_px,motion_px,branch_node,rays_per_hit,frustum_node_tests_per_hit,node_visits_per_hit,ray_hit_percent,"
      "stencil_tests_per_hit,visits_saved_percent,"
      "visits_and_tests_saved_percent\n";
  std::vector<Series> series;
  for (const double quad : {1.0, 3.0})
    for (const char* node : {"both_children", "leaf_mask"})
      series.push_back({fmt::format("{}, {} px", node, quad), {}, {}});
  for (const double quad : {1.0, 3.0})
    for (const double motion : {0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0}) {
      const auto scene = make_toy(quad, motion);
      const Result expected = run(*scene, {});
      Result root;
      std::size_t k = quad == 1.0 ? 0 : 2;
      for (const auto& [name, node] : {std::pair{"root", BranchNode::kRoot},
                                       {"both_children", BranchNode::kBothChildren},
                                       {"leaf_mask", BranchNode::kLeafMask}}) {
        const Result r = checked(*scene, {VisibilityMethod::kPatchBvh, 0, Traversal::kRay, node}, expected, name);
        if (node == BranchNode::kRoot) root = r;
        const double saved = 100 * (1 - ratio(r.rays.node_visits, root.rays.node_visits));
        const double both = 100 * (1 - ratio(r.rays.node_visits + r.rays.frustum_node_tests,
                                             root.rays.node_visits + root.rays.frustum_node_tests));
        csv += fmt::format("{},{},{},{:.2f},{:.2f},{:.2f},{:.1f},{:.2f},{:.1f},{:.1f}\n", quad, motion, name,
                           ratio(r.rays.rays_cast, r.rays.rays_hit), ratio(r.rays.frustum_node_tests, r.rays.rays_hit),
                           ratio(r.rays.node_visits, r.rays.rays_hit), 100 * ratio(r.rays.rays_hit, r.rays.rays_cast),
                           ratio(r.stencil.tests, r.rays.rays_hit), saved, both);
        if (node == BranchNode::kRoot) continue;
        Series& s = series[k++];
        s.x.push_back(motion);
        s.y.push_back(saved);
      }
    }
  write_file_atomically(folder / "branch_nodes.csv", csv);
  fmt::print("{}", csv);
  write_line_plot((folder / "branch_nodes.svg").string(),
                  {"Node visits saved by the branch node", "motion, pixels", "%", false}, series);
}

void write_valid_rate(const std::filesystem::path& folder) {
  // A square of one quad that moves along x. A sub-pixel smaller than 8 pixels, so that its rectangles are whole
  // pixels.
  constexpr double kSide = 8, kWay = 64, kEdge = 1.0 / 128;
  const auto scene = make_scene({{32 + kEdge, 64 + kEdge}}, kSide - 2 * kEdge, kSide, kWay, 0);
  // Enough samples that a 64th of the shutter has some in every pixel.
  constexpr int kSamplesPerPixel = 64;
  const Result expected = run(*scene, {}, kSamplesPerPixel);
  std::string csv =
      "segments,stencil_tests,tests_against_one_segment,valid_percent,formula_percent,occupancy_percent\n";
  std::vector<Series> series = {{"measured", {}, {}}, {"s / (s + L/k)", {}, {}}};
  std::uint64_t one = 0;
  for (const int k : {1, 2, 4, 8, 16, 32, 64}) {
    const Result r = checked(*scene, {VisibilityMethod::kSegments, k}, expected, "segments", kSamplesPerPixel);
    if (k == 1) one = r.stencil.tests;
    const double valid = 100 * ratio(r.stencil.hits, r.stencil.kept), formula = 100 * kSide / (kSide + kWay / k);
    csv += fmt::format("{},{},{:.2f},{:.1f},{:.1f},{:.1f}\n", k, r.stencil.tests, ratio(r.stencil.tests, one), valid,
                       formula, 100 * ratio(r.stencil.kept, r.stencil.lanes_issued));
    series[0].x.push_back(k), series[1].x.push_back(k);
    series[0].y.push_back(valid), series[1].y.push_back(formula);
  }
  write_file_atomically(folder / "valid_rate.csv", csv);
  fmt::print("{}", csv);
  write_line_plot((folder / "valid_rate.svg").string(),
                  {"Valid rate of a square of 8 pixels that moves 64", "segments", "%", false}, series);
}

// Renders frames of shipped captures with the whole machine, occlusion included.
void write_captures(const std::filesystem::path& folder) {
  std::string csv =
      "capture,frame,method,hits,box_tests_per_hit,triangle_tests_per_hit,efficiency_percent,stencil_tests_per_hit,"
      "valid_percent,occupancy_percent,"
      "node_visits_per_ray,ray_hit_percent\n";
  for (const auto& [name, number] : {std::pair{"eggs", 14}, {"flyby", 0}, {"serpent", 12}}) {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(name));
    std::vector<float> image;
    for (const NamedMethod& method : methods()) {
      gpu::GpuConfiguration gpu;
      gpu.tilecore.visibility = method.settings;
      // The interleaved method tests at a few times; with the same times, patch-bvh shows the same.
      gpu::RunSettings settings;
      const bool interleaved = method.settings.method == VisibilityMethod::kInterleaved;
      if (interleaved) settings.sampling.times = VisibilityMethodSettings::kInterleavedTimes;
      const auto frame_of = [&, n = number](const gpu::GpuConfiguration& machine) {
        return gpu::Device(capture, machine, settings, {640, 360, {0, 0, 640, 360}}).render(n);
      };
      const gpu::FrameResult frame = frame_of(gpu);
      if (image.empty()) image = frame.targets.color.values;
      if ((interleaved ? frame_of({}).targets.color.values : image) != frame.targets.color.values)
        throw UsageError(std::string(method.name) + " renders another image than patch-bvh");
      csv +=
          fmt::format("{},{},{}", name, number,
                      counted(method.name, {frame.counters.tilecore, frame.counters.stencil, frame.counters.rays, 0}));
    }
  }
  write_file_atomically(folder / "captures.csv", csv);
  fmt::print("{}", csv);
}

void check() {
  std::string csv;
  std::vector<Series> series;
  measure_methods(
      {{1, 20}}, [](const Toy& t) { return t.motion; }, csv, series);
  fmt::print("{}{}", kTableHead, csv);
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: tessera_method_table OUT_FOLDER | --check\n");
    return 2;
  }
  try {
    if (std::string(argv[1]) == "--check") {
      tessera::bench::check();
      return 0;
    }
    tessera::bench::write_method_table(argv[1]);
    tessera::bench::write_branch_nodes(argv[1]);
    tessera::bench::write_valid_rate(argv[1]);
    tessera::bench::write_captures(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "tessera_method_table: {}\n", error.what());
    return 1;
  }
}
