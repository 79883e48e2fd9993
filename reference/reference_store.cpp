#include "reference/reference_store.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <span>

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
#include "base/whole_file.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::reference {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kSeed = 20240607, kOtherSeed = 77, kSliceSeed = 4711;
constexpr std::uint64_t kSeries = 4;  // independent series for the convergence

// A frame posed with the reference's grids.
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
    // Textures in the file's own format: compressed blocks of a target belong to the machine.
    const scene::Assembly& assembly = prepared.scene(scene::kTexturesOfTheFile).assembly;
    const scene::CameraChoice camera = gpu::frame_camera(prepared.capture, settings, width, height);
    // With the machine's own grids all slices use the grids of the whole shutter.
    slices = std::make_unique<ShutterSlices>(
        assembly, camera, request, kSliceSeed,
        wanted.edge_pixels > 0 ? nullptr : scene::pose_frame(assembly, camera, request));
  }
  std::vector<Image> render(const ReferenceRequest& request) const { return render_reference(*slices, request); }
  std::unique_ptr<ShutterSlices> slices;
};

ReferenceRequest request_of(const scene::Capture& capture, const gpu::RunSettings& settings, std::uint64_t seed,
                            std::vector<int> samples, const std::function<void(double)>& finished) {
  ReferenceRequest request;
  request.lighting = gpu::frame_lighting(capture);
  request.background = gpu::frame_background(capture);
  request.shadows = settings.shadows;
  request.seed = seed;
  request.samples = std::move(samples);
  request.finished = finished;
  return request;
}

// Numbers of samples after which a reference may stop, each half of the next. Fewer samples tell too little about its noise.
std::vector<int> halvings(int samples) {
  constexpr int kFewest = 32;
  std::vector<int> numbers = {samples};
  do numbers.insert(numbers.begin(), std::max(1, numbers.front() / 2));
  while (numbers.front() >= 2 * kFewest);
  if (numbers[0] == numbers[1]) numbers.erase(numbers.begin());
  return numbers;
}

// Estimate of the noise in an image of `all` samples, from the difference to its first half.
struct Noise {
  double rms_error;
  double psnr_db;  // on display values; infinity if the halves are equal
};
Noise noise_of(const Image& first_half, int half, const Image& image, int all, float exposure) {
  Image second = first_half;
  const auto count = static_cast<float>(all), first = static_cast<float>(half);
  for (std::size_t i = 0; i < second.values.size(); ++i)
    second.values[i] = (image.values[i] * count - second.values[i] * first) / (count - first);
  // The mean of two halves has half of their difference as its error.
  return {0.5 * rms_difference(first_half, second),
          psnr(display_values(first_half, exposure), display_values(second, exposure)) + 20 * std::log10(2.0)};
}

// The error of an image of n samples: the spread of images of n samples that share none. Each of four series of
// independent seeds gives two images, one of its first n samples and one of its next n.
Convergence measure_convergence(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                                const gpu::RunSettings& settings, const ReferenceSettings& wanted, int most,
                                const std::function<void(double)>& finished) {
  Convergence out{std::max(1, wanted.width / 4), std::max(1, wanted.height / 4), {}, {}, {}};
  const PosedReference posed(prepared, gpu, settings, wanted, out.width, out.height);
  std::vector<int>& samples = out.samples;
  for (int n = std::min(16, most); n <= most; n *= 2) samples.push_back(n);
  std::vector<std::vector<Image>> series;
  for (std::uint64_t k = 0; k < kSeries; ++k)
    series.push_back(posed.render(request_of(prepared.capture, settings, kOtherSeed + k, samples, finished)));
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
                         const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                         ReferenceProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const double processor = process_seconds();
  const PosedReference posed(prepared, gpu, settings, wanted, wanted.width, wanted.height);
  const auto finished = [&progress](double samples) { progress.done += samples; };
  const double images = shows_what_is_behind(posed.slices->common()) ? 2 : 1;
  // Samples of the convergence's series, whose images are a quarter as wide and as high.
  const double own_pixels = static_cast<double>(wanted.width) * wanted.height * images,
               series_pixels =
                   kSeries * std::max(1.0, wanted.width / 4.0) * std::max(1.0, wanted.height / 4.0) * images;
  progress.done = 0;
  progress.all = wanted.enough_db > 0 ? 0 : (own_pixels + series_pixels) * wanted.samples;
  const float exposure =
      settings.output.exposure > 0 ? static_cast<float>(settings.output.exposure) : prepared.capture.settings.exposure;
  const std::vector<int> numbers = halvings(wanted.samples);
  const auto noise = [&](std::span<const Image> made) {
    const std::size_t last = made.size() - 1;
    return noise_of(made[last - 1], numbers[last - 1], made[last], numbers[last], exposure);
  };
  ReferenceRequest request = request_of(prepared.capture, settings, kSeed, numbers, finished);
  if (wanted.enough_db > 0)
    request.enough = [&](std::span<const Image> made) {
      if (made.size() < 2) return false;
      const double psnr_db = noise(made).psnr_db;
      progress.all =
          (own_pixels + series_pixels) * expected_samples(numbers, numbers[made.size() - 1], psnr_db, wanted.enough_db);
      return psnr_db >= wanted.enough_db;
    };
  std::vector<Image> made = posed.render(request);
  Reference reference;
  ReferenceInfo& info = reference.info;
  info.samples = numbers[made.size() - 1];
  info.asked_samples = wanted.samples;
  if (wanted.enough_db > 0) info.enough_db = wanted.enough_db;
  info.edge_pixels = wanted.edge_pixels;
  info.triangles = ReferenceScene(posed.slices->common(), {.region = {}, .count_only = true}).triangle_count;
  if (made.size() > 1) {
    const Noise left = noise(made);
    info.rms_error = left.rms_error;
    if (std::isfinite(left.psnr_db)) info.psnr_db = left.psnr_db;
  }
  reference.color = std::move(made.back());
  const double own = process_seconds() - processor,
               seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  progress.all = progress.done + series_pixels * info.samples;
  info.convergence = measure_convergence(prepared, gpu, settings, wanted, info.samples, finished);
  info.host = {seconds, own, process_seconds() - processor - own};
  return reference;
}

// The settings that a reference depends on.
json settings_key(const scene::Capture& capture, const gpu::GpuConfiguration& gpu, const gpu::RunSettings& settings,
                  const ReferenceSettings& wanted) {
  json key = {
      {"width", wanted.width},
      {"height", wanted.height},
      {"frame", wanted.frame},
      {"shutter", "true curve at random times"},
      {"samples", wanted.samples},
      {"enough_db", wanted.enough_db},
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
  // References of scenes without casting lights keep the names that they had before there were shadows.
  const scene::ShadowCasters casters = settings.effects.shadows;
  const bool cast = casters == scene::ShadowCasters::kAll    ? !capture.lights.empty()
                    : casters == scene::ShadowCasters::kAuto ? !capture.settings.shadows.empty()
                                                             : false;
  if (cast)
    key["shadows"] = {{"casters", word(casters)},
                      {"faces", word(settings.shadows.faces)},
                      {"blended", word(settings.shadows.blended)}};
  return key;
}

Image read_image(const fs::path& file, const ReferenceSettings& wanted) {
  Image image = read_exr(file);
  if (image.width != wanted.width || image.height != wanted.height)
    throw InputError(file.string(), "", "is not the image that its name identifies");
  return image;
}

void write_image(const fs::path& file, const Image& image, ExrChannel::Type type) {
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 3; ++c)
    channels.push_back(
        {std::string(1, "RGB"[c]), type, image.values.data() + c, static_cast<std::size_t>(image.channels)});
  write_exr(file, image.width, image.height, channels);
}

constexpr int kProbeWidth = 32, kProbeHeight = 18;

// The fingerprint of a small image of the frame: a change that affects the reference should change it as well.
std::string probe_of(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                     const gpu::RunSettings& settings, const ReferenceSettings& wanted) {
  const PosedReference posed(prepared, gpu, settings, wanted, kProbeWidth, kProbeHeight);
  const Image image = posed.render(request_of(prepared.capture, settings, kSeed, {1}, {})).front();
  Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(image.values.data()), image.values.size() * sizeof(float)});
  return hash.finish();
}

constexpr std::uint64_t kMaxKeptBytes = 1u << 20;  // [assumed] a thousand times a written file

}  // namespace

int expected_samples(std::span<const int> numbers, int made, double psnr_db, double enough_db) {
  const double needed = made * std::pow(10.0, 0.1 * (enough_db - psnr_db));
  const auto found = std::find_if(numbers.begin(), numbers.end(), [&](int n) { return n >= made && n >= needed; });
  return found == numbers.end() ? numbers.back() : *found;
}

Reference get_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                        const gpu::RunSettings& settings, const ReferenceSettings& wanted, const fs::path& folder,
                        const std::string& inputs, ReferenceProgress* progress) {
  json key = settings_key(prepared.capture, gpu, settings, wanted);
  key["inputs"] = inputs;
  const std::string hash = sha256_name(json_text(key));
  const fs::path image = folder / "reference" / (hash + ".exr"), info = folder / "reference" / (hash + ".json");
  std::error_code ignored;
  Reference reference;
  if (fs::is_regular_file(info, ignored) && fs::is_regular_file(image, ignored)) {
    reference.info = read_reference_info(info);
    reference.color = read_image(image, wanted);
    return reference;
  }
  ReferenceProgress unread;
  reference = make_reference(prepared, gpu, settings, wanted, progress != nullptr ? *progress : unread);
  write_image(image, reference.color, ExrChannel::Type::kFloat);
  write_file_atomically(info, json_text(reference_info_json(reference.info), 1) +
                                  "\n");  // written last, so that an existing file is complete
  return reference;
}

Reference get_kept_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                             const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                             const KeptReference& kept, std::string& note, ReferenceProgress* progress) {
  const std::string stem =
      fmt::format("{}_{}_{}x{}_{}", kept.name, wanted.frame, wanted.width, wanted.height,
                  sha256_name(json_text(settings_key(prepared.capture, gpu, settings, wanted))).substr(0, 8));
  const fs::path image = kept.folder / (stem + ".exr"), info = kept.folder / (stem + ".json");
  const std::string probe = probe_of(prepared, gpu, settings, wanted);
  std::error_code ignored;
  Reference reference;
  if (fs::is_regular_file(info, ignored) && fs::is_regular_file(image, ignored)) {
    const json document = parse_json(read_whole_text(info, kMaxKeptBytes), info.string());
    const JsonValue root(document, info.string());
    const bool same_scene = root.member("scene").text() == kept.scene,
               same_probe = root.member("probe").text() == probe;
    if (same_scene && same_probe) {
      reference.info = read_reference_info(info);
      reference.color = read_image(image, wanted);
      return reference;
    }
    note = fmt::format("{} is old: {}; it is rendered anew", image.string(),
                       same_scene   ? "the scene is the same, a shader or the renderer draws it otherwise"
                       : same_probe ? "the capture's file is another one"
                                    : "the capture changed");
  }
  ReferenceProgress unread;
  reference = make_reference(prepared, gpu, settings, wanted, progress != nullptr ? *progress : unread);
  fs::create_directories(kept.folder);
  json document = reference_info_json(reference.info);
  document["scene"] = kept.scene;
  document["probe"] = probe;
  write_image(image, reference.color, ExrChannel::Type::kHalf);
  write_file_atomically(info, json_text(document, 1) + "\n");
  reference.color = read_image(image, wanted);
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
