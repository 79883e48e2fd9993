// Measures cost and gain of motion along curves by its number of segments.
//
//   tessera_motion_segments FOLDER [ROUNDS]   writes FOLDER/segments.csv
//   tessera_motion_segments --check           small images, once
//
// Scenes: a rotor of bent patches that turns by 2.6 radians while the shutter is open, and captures/serpent.glb with
// a shutter of four frames. The truth is the mean of 64 frames with a closed shutter. Seconds are processor time, the
// least of all rounds; settings take turns.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/check.h"
#include "base/image_metrics.h"
#include "base/thread_clock.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/captures.h"

namespace tessera::bench {
namespace {

using scene::Capture;

// A sheet of patches that turns around its end, 300 by 60 pixels of 640x360, facing the camera.
Capture rotor() {
  Capture capture;
  capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.0f);
  scene::Material white;
  white.unlit = white.double_sided = true;
  std::vector<Vec3> points;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 16; ++i)
      for (const Vec3& p : test::flat_patch({10.0f * static_cast<float>(i), -20.0f + 10.0f * static_cast<float>(j), 0},
                                            {10, 0, 0}, {0, 10, 0}))
        points.push_back(p + Vec3(0, 0, std::sin(0.2f * p.x)));
  const int node = test::add_node(capture, test::patches(points, test::add_material(capture, white)));
  test::add_turn(capture, node, {0, 0, 1}, 2.6f);
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 320, camera.y_mag = 180;
  test::add_camera(capture, {0, 0, 50}, camera);
  return capture;
}
constexpr double kRotorArea = 160 * 40;

struct Shot {
  Image color{0, 0, 3};
  gpu::FrameCounters counters;
  double cycles = 0, seconds = 0;
};

Shot render(const Capture& capture, int frame, int width, int height, int segments) {
  gpu::RunSettings settings;
  settings.sampling.motion_segments = segments;
  settings.sampling.samples_per_pixel = 16;
  gpu::Device device(capture, {}, settings, {width, height, {0, 0, width, height}, false});
  const double start = process_seconds();
  const gpu::FrameResult result = device.render(frame);
  Shot shot;
  shot.seconds = process_seconds() - start;
  shot.counters = result.counters;
  shot.cycles = static_cast<double>(result.model->timing.cycles);
  shot.color = Image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (std::size_t c = 0; c < 3; ++c) shot.color.at(x, y)[c] = result.targets.color.at(x, y)[c];
  return shot;
}

std::string measure(const char* name, const Capture& capture, int frame, int width, int height, int rounds,
                    double area) {
  constexpr int kStills = 64;
  Image truth(width, height, 3);
  const double open = capture.settings.shutter_open, close = capture.settings.shutter_close;
  for (int k = 0; k < kStills; ++k) {
    Capture still = capture;
    still.settings.shutter_open = still.settings.shutter_close = open + (close - open) * (k + 0.5) / kStills;
    const Image one = render(still, frame, width, height, 1).color;
    for (std::size_t i = 0; i < truth.values.size(); ++i) truth.values[i] += one.values[i] / kStills;
  }
  const std::vector<int> numbers = {1, 2, 4, 8, 16, 0};
  std::vector<Shot> shots(numbers.size());
  for (Shot& shot : shots) shot.seconds = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round)
    for (std::size_t n = 0; n < numbers.size(); ++n) {
      Shot shot = render(capture, frame, width, height, numbers[n]);
      shot.seconds = std::min(shot.seconds, shots[n].seconds);
      shots[n] = std::move(shot);
    }
  std::string rows;
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const Shot& shot = shots[n];
    double covered = 0;
    for (std::size_t i = 0; i < shot.color.values.size(); i += 3) covered += static_cast<double>(shot.color.values[i]);
    rows += fmt::format("{},{},{},{:.1f},{:.0f},{},{},{:.2f},{:.2f}\n", name,
                        numbers[n] == 0 ? "automatic" : std::to_string(numbers[n]),
                        area > 0 ? fmt::format("{:.1f}", 100 * covered / area) : "", psnr(shot.color, truth),
                        shot.cycles, shot.counters.binner.entries, shot.counters.tessellation.domain_evaluations,
                        shot.cycles / shots[0].cycles, shot.seconds / shots[0].seconds);
  }
  return rows;
}

int run(const std::string& folder, int rounds, int width, int height) {
  Capture serpent = scene::read_capture(test::shipped_capture("serpent"));
  serpent.settings.shutter_close = serpent.settings.shutter_open + 4;
  const double scale = static_cast<double>(width) / 640;
  const std::string text =
      "scene,segments,area_percent,psnr_db,cycles,tile_list_entries,domain_evaluations,cycles_of_one,cpu_time_of_"
      "one\n" +
      measure("rotor", rotor(), 0, width, height, rounds, kRotorArea * scale * scale) +
      measure("serpent", serpent, 12, width, height, rounds, 0);
  if (folder.empty())
    TESSERA_CHECK(text.find("rotor,1,38") != std::string::npos, "one segment is the chord: 38 % of the area");
  else
    write_file_atomically(std::filesystem::path(folder) / "segments.csv", text);
  fmt::print("{}", text);
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--check") return tessera::bench::run("", 1, 160, 90);
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "usage: tessera_motion_segments FOLDER [ROUNDS] | --check\n");
    return 2;
  }
  return tessera::bench::run(argv[1], argc == 3 ? std::max(1, std::atoi(argv[2])) : 5, 640, 360);
}
