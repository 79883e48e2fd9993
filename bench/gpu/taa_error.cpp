// Compares temporal antialiasing with more samples and with desampling by the resolve unit: error and time.
//
//   tessera_taa_error CAPTURE WIDTHxHEIGHT FRAMES [KEY=VALUE ...]
//   tessera_taa_error --check     a small image: checks that temporal antialiasing has less error than a sample alone
//
// Prints a table. Every row renders frames 0 to FRAMES - 1 one after the other; the second half of them counts. The truth is
// 64 samples a pixel, shaded each on its own. *PSNR*: mean over frames, of displayed values. *Change*: PSNR of the change from
// frame to frame as 1/2 + (b - a) / 2, which flicker and trails lower. Time, energy and bytes are means over these frames.
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
#include "reference/reference_store.h"
#include "scene/capture_reader.h"
#include "tests/support/pass_graphs.h"

namespace tessera::bench {
namespace {

using Keys = std::vector<std::string>;

struct Shot {
  int width = 0, height = 0, frames = 0;
};

struct Frames {
  std::vector<Image> shown;  // the second half
  double ms = 0, mj = 0, mib = 0;
};

Frames render(scene::Capture capture, bool taa, const Keys& keys, const Shot& shot) {
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  for (const std::string& key : keys) gpu::apply_setting(key, settings, gpu);
  capture.settings.graph.reset();
  if (taa) capture.settings.graph = test::antialiasing();
  gpu::Device device(capture, gpu, settings, {shot.width, shot.height, {0, 0, shot.width, shot.height}});
  Frames out;
  for (int frame = 0; frame < shot.frames; ++frame) {
    const gpu::FrameResult result = device.render(frame);
    if (frame < shot.frames / 2) continue;
    out.shown.push_back(reference::display_values(result.targets.color, capture.settings.exposure));
    out.ms += result.model->timing.cycles / gpu.clock_mhz * 1e-3;
    out.mj += result.model->energy.total_nj() * 1e-6;
    const memory::Traffic moved = result.counters.ledger.total();
    out.mib += static_cast<double>(moved.read_bytes + moved.written_bytes) * 0x1p-20;
  }
  for (double* sum : {&out.ms, &out.mj, &out.mib}) *sum /= static_cast<double>(out.shown.size());
  return out;
}

Image change(const Image& before, const Image& after) {
  Image out = after;
  for (std::size_t i = 0; i < out.values.size(); ++i)
    out.values[i] = 0.5f + 0.5f * (after.values[i] - before.values[i]);
  return out;
}

Frames truth_of(const scene::Capture& capture, Keys keys, const Shot& shot) {
  keys.insert(keys.end(), {"sampling.samples_per_pixel=64", "shading.rate=sample", "output.machine_model=true",
                           "tilecore.memory_bytes=4194304"});
  return render(capture, false, keys, shot);
}

// Prints a row and returns its PSNR.
double row(const char* name, const scene::Capture& capture, bool taa, Keys keys, const Keys& more, const Shot& shot,
           const Frames& truth) {
  keys.insert(keys.end(), more.begin(), more.end());
  const Frames found = render(capture, taa, keys, shot);
  double db = 0, changes = 0;
  for (std::size_t f = 0; f < found.shown.size(); ++f) {
    db += psnr(truth.shown[f], found.shown[f]);
    if (f > 0) changes += psnr(change(truth.shown[f - 1], truth.shown[f]), change(found.shown[f - 1], found.shown[f]));
  }
  db /= static_cast<double>(found.shown.size());
  if (found.shown.size() > 1) changes /= static_cast<double>(found.shown.size() - 1);
  fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.2f} | {:.2f} |\n", name, db, changes, found.ms, found.mj, found.mib);
  std::fflush(stdout);
  return db;
}

int check() {
  const scene::Capture capture =
      scene::read_capture(std::filesystem::path(TESSERA_SOURCE_DIR) / "captures" / "city.glb");
  const Shot shot{96, 54, 8};
  const Frames truth = truth_of(capture, {}, shot);
  const Keys one = {"sampling.samples_per_pixel=1"};
  const double alone = row("1 sample", capture, false, {}, one, shot, truth),
               taa = row("1 sample, TAA", capture, true, {}, one, shot, truth);
  TESSERA_CHECK(taa > alone + 1, "temporal antialiasing is closer to many samples than one sample alone");
  return 0;
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 1 && arguments[0] == "--check") return check();
  if (arguments.size() < 3) throw UsageError("tessera_taa_error CAPTURE WIDTHxHEIGHT FRAMES [KEY=VALUE ...]");
  const scene::Capture capture = scene::read_capture(arguments[0]);
  Shot shot;
  if (std::sscanf(arguments[1].c_str(), "%dx%d", &shot.width, &shot.height) != 2 ||
      std::sscanf(arguments[2].c_str(), "%d", &shot.frames) != 1 || shot.frames < 1)
    throw UsageError("tessera_taa_error: expected WIDTHxHEIGHT and a number of frames");
  const Keys keys(arguments.begin() + 3, arguments.end());
  const Frames truth = truth_of(capture, keys, shot);
  const Keys one = {"sampling.samples_per_pixel=1"}, four = {"sampling.samples_per_pixel=4"};
  const auto desampled = [](Keys samples) {
    samples.push_back("resolve.desampling=adaptive");
    return samples;
  };
  fmt::print("| machine | PSNR, dB | change, dB | frame, ms | mJ | MiB moved |\n|---|---:|---:|---:|---:|---:|\n");
  row("1 sample", capture, false, keys, one, shot, truth);
  row("1 sample, TAA", capture, true, keys, one, shot, truth);
  row("1 sample, resolve.desampling=adaptive", capture, false, keys, desampled(one), shot, truth);
  row("4 samples", capture, false, keys, four, shot, truth);
  row("4 samples, resolve.desampling=adaptive", capture, false, keys, desampled(four), shot, truth);
  row("4 samples, TAA", capture, true, keys, four, shot, truth);
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
