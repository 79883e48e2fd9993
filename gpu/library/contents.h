#pragma once

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <tessera/tessera.h>

#include "gpu/configuration.h"
#include "gpu/device.h"
#include "gpu/prepared_capture.h"
#include "gpu/settings.h"
#include "scene/capture.h"
#include "scene/view_choices.h"

#if defined(__GNUC__)
#define TESSERA_LOCAL __attribute__((visibility("hidden")))
#else
#define TESSERA_LOCAL
#endif

// Contents of the public classes of include/tessera.
namespace tessera {

struct TESSERA_LOCAL Scene::Content {
  Content(scene::Capture read, scene::ViewChoices choices) : capture(std::move(read)), view(std::move(choices)) {}

  const scene::Capture capture;
  const scene::ViewChoices view;  // devices, which know the size of frames, handle its camera and lens
  // The data that all devices share; made for the first device.
  std::shared_ptr<const gpu::PreparedCapture> prepared() const {
    std::call_once(once_, [&] { prepared_ = std::make_shared<const gpu::PreparedCapture>(capture); });
    return prepared_;
  }

 private:
  mutable std::once_flag once_;
  mutable std::shared_ptr<const gpu::PreparedCapture> prepared_;
};

struct TESSERA_LOCAL Gpu::Content {
  gpu::GpuConfiguration configuration;
};

struct TESSERA_LOCAL Settings::Content {
  gpu::RunSettings settings;
};

struct TESSERA_LOCAL Frame::Content {
  Content(gpu::FrameResult rendered, const scene::Assembly& assembly, float display_exposure);

  gpu::FrameResult result;
  const float exposure;
  std::map<std::string, std::uint64_t> counters;
  std::vector<TrafficRow> traffic;
  std::vector<FramePass> passes;
  std::optional<FrameTiming> timing;
  std::optional<FrameEnergy> energy;
  std::optional<MachineArea> area;
  std::vector<TileMap> maps;
  std::vector<DrawableCost> drawables;

  const tilecore::FrameTargets& targets(Eye eye) const;
  const Image8& display(Eye eye) const;

 private:
  // Each eye's image, made at the first request.
  mutable std::array<std::once_flag, 2> once_;
  mutable std::array<Image8, 2> display_;
};

}  // namespace tessera
