#include <tessera/device.h>

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/simd_targets.h"
#include "gpu/image_bytes.h"
#include "gpu/library/contents.h"

namespace tessera {
namespace {

constexpr int kMaxSide = 16384;

gpu::RenderRequest render_request(const scene::Capture& capture, const scene::ViewChoices& view,
                                  const gpu::RunSettings& settings, const gpu::GpuConfiguration& gpu,
                                  const RenderOptions& options) {
  gpu::RenderRequest request;
  request.width = options.width == 0 ? capture.settings.width : options.width;
  request.height = options.height == 0 ? capture.settings.height : options.height;
  if (request.width < 1 || request.width > kMaxSide || request.height < 1 || request.height > kMaxSide)
    throw UsageError(fmt::format("frames of {}x{} pixels: sides are 1 to {}", request.width, request.height, kMaxSide));
  request.region = {0, 0, request.width, request.height};
  if (options.region) {
    const Region& r = *options.region;
    if (r.x < 0 || r.y < 0 || r.width < 1 || r.height < 1 || r.x > request.width - r.width ||
        r.y > request.height - r.height)
      throw UsageError(fmt::format("region {},{},{},{} is not inside the frame of {}x{}", r.x, r.y, r.width, r.height,
                                   request.width, request.height));
    request.region = {r.x, r.y, r.x + r.width, r.y + r.height};
  }
  request.auxiliary = options.auxiliary;
  request.resolve_auxiliary = request.error = options.resolve_auxiliary;
  if (options.resolve_auxiliary && settings.resolve.desampling == tilecore::Desampling::kOff)
    throw UsageError("resolve_auxiliary needs resolve.desampling to be another than off");
  const std::uint64_t bytes = gpu::image_bytes(request, settings, gpu, capture);
  if (bytes > options.max_image_bytes)
    throw LimitError(fmt::format("images of {}x{} need {} bytes, max_image_bytes allows {}", request.region.width(),
                                 request.region.height(), bytes, options.max_image_bytes));
  request.camera = scene::choose_camera(capture, view, request.width, request.height);
  return request;
}

}  // namespace

struct TESSERA_LOCAL Device::Content {
  Content(const Scene& drawn, const gpu::GpuConfiguration& configuration, const gpu::RunSettings& settings,
          const RenderOptions& options)
      : scene(drawn),
        device(scene.content_->prepared(), configuration, settings,
               render_request(scene.content_->capture, scene.content_->view, settings, configuration, options)),
        exposure(static_cast<float>(settings.output.exposure)) {
    if (!(exposure > 0)) exposure = scene.content_->capture.settings.exposure;
  }

  const Scene scene;
  gpu::Device device;
  float exposure;
};

Device::Device(const Scene& scene, const Gpu& gpu, const Settings& settings, const RenderOptions& options) {
  simd_target();
  check_gpu(gpu.content_->configuration);
  content_ = std::make_unique<Content>(scene, gpu.content_->configuration, settings.content_->settings, options);
}
Device::Device(Device&& other) noexcept = default;
Device& Device::operator=(Device&& other) noexcept = default;
Device::~Device() = default;

Frame Device::render(int frame) {
  if (frame < 0) throw UsageError(fmt::format("frame {}: frames count from 0", frame));
  return Frame(std::make_shared<const Frame::Content>(content_->device.render(frame), content_->device.assembly(),
                                                      content_->exposure));
}

bool Device::automatic_camera() const { return content_->device.automatic_camera(); }

std::string version() { return TESSERA_VERSION; }

std::string simd_target() {
  static const std::string kName = simd_target_name();
  return kName;
}

}  // namespace tessera
