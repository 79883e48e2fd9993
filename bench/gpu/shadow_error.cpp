// Compares shadow maps with shadow rays: their error and their cost by size, filter, cascades, times, grids and format.
//
//   tessera_shadow_error CAPTURE WIDTHxHEIGHT FRAME [KEY=VALUE ...]
//   tessera_shadow_error --check     a small image: checks that a larger map has a smaller error
//
// Prints a table. The error is the maps' alone: the reference shades the machine's own samples on the machine's own
// grids, and takes every share of a light from a ray (reference/shadow_rays.h). PSNR is measured on displayed values.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/check.h"
#include "base/error.h"
#include "base/image_metrics.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "memory/ledger.h"
#include "reference/reference_renderer.h"
#include "reference/reference_store.h"
#include "scene/capture_reader.h"

namespace tessera::bench {
namespace {

using Keys = std::vector<std::string>;

struct Place {
  int width = 0, height = 0, frame = 0;
};

// Groups of keys, one row for each; each row also has the keys of the command line.
const std::vector<std::vector<std::string>>& groups() {
  static const std::vector<std::vector<std::string>> kGroups = {
      {"shadows.size=256", "shadows.size=512", "shadows.size=1024", "shadows.size=2048", "shadows.size=4096"},
      {"shadows.filter=nearest", "shadows.filter=2x2", "shadows.filter=3x3"},
      {"shadows.cascades=1", "shadows.cascades=2", "shadows.cascades=3", "shadows.cascades=4"},
      {"shadows.times=1", "shadows.times=2", "shadows.times=4", "shadows.times=8"},
      {"shadows.grids=light", "shadows.grids=camera"},
      {"shadows.format=d16", "shadows.format=d24", "shadows.format=d32f"}};
  return kGroups;
}

struct Machine {
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;

  explicit Machine(const Keys& keys) {
    for (const std::string& key : keys) gpu::apply_setting(key, settings, gpu);
  }
};

Image rays(const scene::Capture& capture, const Keys& keys, const Place& place) {
  const Machine machine(keys);
  return reference::display_values(
      reference::render_machines_samples(scene::assemble(capture), machine.gpu, machine.settings, place.width,
                                         place.height, place.frame),
      capture.settings.exposure);
}

// Prints a row and returns its PSNR.
double row(const std::string& name, const scene::Capture& capture, const Keys& keys, const Place& place,
           const Image& truth) {
  const Machine machine(keys);
  const gpu::FrameResult frame = gpu::Device(capture, machine.gpu, machine.settings,
                                             {place.width, place.height, {0, 0, place.width, place.height}})
                                     .render(place.frame);
  const double db = psnr(truth, reference::display_values(frame.targets.color, capture.settings.exposure)),
               ms = frame.model->timing.cycles / machine.gpu.clock_mhz * 1e-3;
  std::uint64_t bytes = 0;
  for (std::size_t unit = 0; unit < memory::kUnitCount; ++unit) {
    const memory::Traffic& moved =
        frame.counters.ledger.traffic(static_cast<memory::Unit>(unit), memory::Purpose::kShadowMap);
    bytes += moved.read_bytes + moved.written_bytes;
  }
  fmt::print("| `{}` | {:.2f} | {:.3f} | {:.2f} |\n", name, db, ms, static_cast<double>(bytes) * 0x1p-20);
  std::fflush(stdout);
  return db;
}

int check() {
  const scene::Capture capture =
      scene::read_capture(std::filesystem::path(TESSERA_SOURCE_DIR) / "captures" / "city_evening.glb");
  const Place place{96, 54, 0};
  const Image truth = rays(capture, {}, place);
  const double small = row("shadows.size=64", capture, {"shadows.size=64"}, place, truth),
               large = row("shadows.size=512", capture, {"shadows.size=512"}, place, truth);
  TESSERA_CHECK(large > small + 1, "a larger map is closer to rays");
  return 0;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 1 && arguments[0] == "--check") return check();
  if (arguments.size() < 3) throw UsageError("tessera_shadow_error CAPTURE WIDTHxHEIGHT FRAME [KEY=VALUE ...]");
  const scene::Capture capture = scene::read_capture(arguments[0]);
  Place place;
  if (std::sscanf(arguments[1].c_str(), "%dx%d", &place.width, &place.height) != 2 ||
      std::sscanf(arguments[2].c_str(), "%d", &place.frame) != 1)
    throw UsageError("tessera_shadow_error: expected WIDTHxHEIGHT and the number of a frame");
  const Keys keys(arguments.begin() + 3, arguments.end());
  const Image truth = rays(capture, keys, place);
  fmt::print("| keys | PSNR, dB | frame, ms | maps, MiB moved |\n|---|---:|---:|---:|\n");
  row("as given", capture, keys, place, truth);
  for (const auto& group : groups())
    for (const std::string& key : group) {
      Keys all = keys;
      all.push_back(key);
      row(key, capture, all, place, truth);
    }
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) try {
  return tessera::bench::run({argv + 1, argv + argc});
} catch (const std::exception& fault) {
  fmt::print(stderr, "{}\n", fault.what());
  return 1;
}
