#include <tessera/scene.h>

#include <utility>

#include "gpu/library/contents.h"
#include "scene/capture_reader.h"

namespace tessera {
namespace {

scene::CaptureLimits reader_limits(const ReadLimits& limits) {
  scene::CaptureLimits out;
  out.max_bytes = limits.max_bytes;
  out.max_file_bytes = limits.max_file_bytes;
  out.strict = limits.strict;
  out.variant = limits.variant;
  return out;
}

}  // namespace

Scene::Scene(const std::filesystem::path& file, const ReadLimits& limits, const View& view) {
  const scene::ViewChoices choices{{view.scene, view.camera, view.animation}, view.orbit, view.lens, view.shutter};
  choices.check();
  scene::Capture capture = scene::read_capture(file, reader_limits(limits), choices.of_file());
  scene::set_shutter(capture, choices);
  content_ = std::make_shared<const Content>(std::move(capture), choices);
}

const std::filesystem::path& Scene::file() const { return content_->capture.file; }
int Scene::width() const { return content_->capture.settings.width; }
int Scene::height() const { return content_->capture.settings.height; }
int Scene::first_frame() const { return content_->capture.settings.first_frame; }
int Scene::frame_count() const { return content_->capture.settings.frame_count; }
double Scene::frame_rate() const { return content_->capture.settings.frame_rate; }
const std::vector<std::string>& Scene::variants() const { return content_->capture.variants; }
std::vector<Shadow> Scene::shadows() const {
  std::vector<Shadow> shadows;
  for (const scene::ShadowRequest& s : content_->capture.settings.shadows)
    shadows.push_back({s.light, s.size, s.cascades, s.distance});
  return shadows;
}
std::vector<std::string> Scene::passes() const {
  std::vector<std::string> names;
  if (content_->capture.settings.graph)
    for (const scene::Pass& pass : content_->capture.settings.graph->passes) names.push_back(pass.name);
  return names;
}
const std::vector<std::string>& Scene::notices() const { return content_->capture.notices; }

}  // namespace tessera
