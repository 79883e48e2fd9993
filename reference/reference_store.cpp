#include "reference/reference_store.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/color.h"
#include "base/error.h"
#include "base/exr_file.h"
#include "base/image_metrics.h"
#include "base/json_text.h"
#include "base/sha256.h"
#include "base/thread_clock.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::reference {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kSeed = 20240607, kOtherSeed = 77, kSliceSeed = 4711;

// A frame posed as finely as the reference is wanted.
struct PosedReference {
  PosedReference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                 const gpu::RunSettings& settings, const ReferenceSettings& wanted, int width, int height) {
    scene::FrameRequest request = gpu::frame_request(prepared.capture, gpu, settings, width, height, wanted.frame);
    request.half_attributes = request.interpolated_surfaces = false;
    if (wanted.edge_pixels > 0) {
      request.tessellation.target_edge_pixels = wanted.edge_pixels;
      request.tessellation.displacement_bias = 0;
      request.max_factor = kReferenceMaxFactor;
      request.procedure_limits = false;
    }
    // Textures as the file has them: blocks of a target are the machine's.
    const scene::Assembly& assembly = prepared.scene(scene::kTexturesOfTheFile).assembly;
    const scene::CameraChoice camera = gpu::frame_camera(prepared.capture, settings, width, height);
    // With the machine's own grids all slices have those of the whole shutter.
    slices = std::make_unique<ShutterSlices>(
        assembly, camera, request, kSliceSeed,
        wanted.edge_pixels > 0 ? nullptr : scene::pose_frame(assembly, camera, request));
  }
  std::vector<Image> render(const ReferenceRequest& request) const { return render_reference(*slices, request); }
  std::unique_ptr<ShutterSlices> slices;
};

ReferenceRequest request_of(const scene::Capture& capture, std::uint64_t seed, std::vector<int> samples) {
  ReferenceRequest request;
  request.lighting = gpu::frame_lighting(capture);
  request.background = gpu::frame_background(capture);
  request.seed = seed;
  request.samples = std::move(samples);
  return request;
}

// The error of an image of n samples: the spread of images of n samples that share none. Each of four series of
// independent seeds gives two, its first n and its next n.
Convergence measure_convergence(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                                const gpu::RunSettings& settings, const ReferenceSettings& wanted) {
  Convergence out{std::max(1, wanted.width / 4), std::max(1, wanted.height / 4), {}, {}, {}};
  const PosedReference posed(prepared, gpu, settings, wanted, out.width, out.height);
  std::vector<int>& samples = out.samples;
  for (int n = std::min(16, wanted.samples); n <= wanted.samples; n *= 2) samples.push_back(n);
  std::vector<std::vector<Image>> series;
  for (std::uint64_t k = 0; k < 4; ++k)
    series.push_back(posed.render(request_of(prepared.capture, kOtherSeed + k, samples)));
  std::vector<double>& errors = out.rms_error;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    double squares = 0;
    std::vector<double> of(series.size() * 2);
    for (std::size_t i = 0; i < series[0][n].values.size(); ++i) {
      std::size_t count = 0;
      double mean = 0;
      for (const std::vector<Image>& one : series) {
        const double first = static_cast<double>(one[n].values[i]);
        of[count++] = first;
        if (n + 1 < samples.size()) of[count++] = 2 * static_cast<double>(one[n + 1].values[i]) - first;
      }
      for (std::size_t k = 0; k < count; ++k) mean += of[k] / static_cast<double>(count);
      for (std::size_t k = 0; k < count; ++k)
        squares += (of[k] - mean) * (of[k] - mean) / static_cast<double>(count - 1);
    }
    errors.push_back(std::sqrt(squares / static_cast<double>(series[0][n].values.size())));
  }
  if (samples.size() > 1 && errors.back() > 0) out.slope = convergence_slope(samples, errors);
  return out;
}

Reference make_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                         const gpu::RunSettings& settings, const ReferenceSettings& wanted) {
  const auto start = std::chrono::steady_clock::now();
  const double processor = process_seconds();
  const PosedReference posed(prepared, gpu, settings, wanted, wanted.width, wanted.height);
  const int half = std::max(1, wanted.samples / 2);
  std::vector<Image> images = posed.render(
      request_of(prepared.capture, kSeed,
                 half < wanted.samples ? std::vector<int>{half, wanted.samples} : std::vector<int>{wanted.samples}));
  Reference reference;
  reference.color = std::move(images.back());
  reference.info.samples = wanted.samples;
  reference.info.edge_pixels = wanted.edge_pixels;
  reference.info.triangles = ReferenceScene(posed.slices->common()).triangles.size();
  if (images.size() > 1) {
    Image second = images.front();
    const float all = static_cast<float>(wanted.samples), first = static_cast<float>(half);
    for (std::size_t i = 0; i < second.values.size(); ++i)
      second.values[i] = (reference.color.values[i] * all - second.values[i] * first) / (all - first);
    // The mean of two halves errs by half of their difference.
    reference.info.rms_error = 0.5 * rms_difference(images.front(), second);
    const float exposure = settings.output.exposure > 0 ? static_cast<float>(settings.output.exposure)
                                                        : prepared.capture.settings.exposure;
    const double db =
        psnr(display_values(images.front(), exposure), display_values(second, exposure)) + 20 * std::log10(2.0);
    if (std::isfinite(db)) reference.info.psnr_db = db;
  }
  const double own = process_seconds() - processor,
               seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  reference.info.convergence = measure_convergence(prepared, gpu, settings, wanted);
  reference.info.host = {seconds, own, process_seconds() - processor - own};
  return reference;
}

}  // namespace

Reference get_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                        const gpu::RunSettings& settings, const ReferenceSettings& wanted, const fs::path& folder,
                        const std::string& inputs) {
  const json key = {
      {"inputs", inputs},
      {"width", wanted.width},
      {"height", wanted.height},
      {"frame", wanted.frame},
      {"shutter", "true curve at random times"},
      {"samples", wanted.samples},
      {"edge", wanted.edge_pixels},
      {"grids", wanted.edge_pixels > 0 ? json()
                                       : json({settings.tessellation.target_edge_pixels,
                                               settings.tessellation.displacement_bias, gpu.tessellator.max_factor})},
      {"motion", settings.effects.motion == gpu::EffectMode::kOff},
      {"defocus", settings.effects.defocus == gpu::EffectMode::kOff},
      {"displacement", settings.effects.displacement == gpu::EffectMode::kOff},
      {"alpha_test", settings.effects.alpha_test == gpu::EffectMode::kOff},
      {"blending", settings.effects.blending == gpu::EffectSwitch::kOff},
      {"procedures", settings.effects.procedures == gpu::EffectSwitch::kOff},
      {"exposure", settings.output.exposure}};
  const std::string hash = sha256_name(json_text(key));
  const fs::path image = folder / "reference" / (hash + ".exr"), info = folder / "reference" / (hash + ".json");
  std::error_code ignored;
  Reference reference;
  if (fs::is_regular_file(info, ignored) && fs::is_regular_file(image, ignored)) {
    reference.info = read_reference_info(info);
    reference.color = read_exr(image);
    if (reference.color.width != wanted.width || reference.color.height != wanted.height)
      throw InputError(image.string(), "", "is not the image that its name stands for");
    return reference;
  }
  reference = make_reference(prepared, gpu, settings, wanted);
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 3; ++c)
    channels.push_back({std::string(1, "RGB"[c]), ExrChannel::Type::kFloat, reference.color.values.data() + c,
                        static_cast<std::size_t>(reference.color.channels)});
  write_exr(image, wanted.width, wanted.height, channels);
  write_file_atomically(info,
                        json_text(reference_info_json(reference.info), 1) + "\n");  // last: what is there is complete
  return reference;
}

Image display_values(const Image& linear, float exposure) {
  Image out(linear.width, linear.height, 3);
  for (int y = 0; y < linear.height; ++y)
    for (int x = 0; x < linear.width; ++x) {
      const auto from = linear.at(x, y);
      const Vec3 shown = shaders::tone_map(Vec3(from[0], from[1], from[2]) * exposure);
      for (int c = 0; c < 3; ++c) out.at(x, y)[static_cast<std::size_t>(c)] = linear_to_srgb(shown[c]);
    }
  return out;
}

}  // namespace tessera::reference
