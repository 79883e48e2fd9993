#include "replay/frame_files.h"

#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "base/exr_file.h"
#include "base/image_codec.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {

const std::vector<std::string>& auxiliary_layers() {
  static const std::vector<std::string> kLayers = {"depth",    "normal", "patch",       "invocations", "rate",
                                                   "velocity", "edges",  "discrepancy", "origin",      "error"};
  return kLayers;
}

bool is_resolve_layer(const std::string& layer) {
  return std::find(auxiliary_layers().begin() + 4, auxiliary_layers().end(), layer) != auxiliary_layers().end();
}

std::string frame_name(int frame) { return fmt::format("frame_{:04d}", frame); }

FrameWriter::~FrameWriter() {
  try {
    writing_.wait();
  } catch (const std::exception&) {
    // Whoever did not ask for it with finish() is on the way out for another reason.
  }
}

void FrameWriter::add(int frame, tilecore::FrameTargets targets, const std::string& view) {
  if (view.empty()) finish();
  const auto images = std::make_shared<const tilecore::FrameTargets>(std::move(targets));
  const std::string name = frame_name(frame) + (view.empty() ? "" : "." + view);
  writing_.run([this, images, name] { write_exr_of(*images, name); });
  writing_.run([this, images, name] {
    write_png(settings_.folder / (name + ".png"), shaders::to_display(images->color, settings_.exposure));
  });
}

void FrameWriter::finish() { writing_.wait(); }

void FrameWriter::write_exr_of(const tilecore::FrameTargets& targets, const std::string& name) const {
  const std::vector<std::string>& auxiliary = settings_.auxiliary;
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 4; ++c)
    channels.push_back({std::string(1, "RGBA"[c]), ExrChannel::Type::kHalf, targets.color.values.data() + c, 4});
  const auto wants = [&](const char* layer) {
    return std::find(auxiliary.begin(), auxiliary.end(), layer) != auxiliary.end();
  };
  if (wants("depth")) channels.push_back({"depth.Z", ExrChannel::Type::kFloat, targets.depth.values.data(), 1});
  if (wants("normal"))
    for (std::size_t c = 0; c < 3; ++c)
      channels.push_back(
          {std::string("normal.") + "XYZ"[c], ExrChannel::Type::kHalf, targets.normal.values.data() + c, 3});
  if (wants("patch")) channels.push_back({"patch.id", ExrChannel::Type::kUint, targets.patch.values.data(), 1});
  if (wants("invocations"))
    channels.push_back({"invocations.count", ExrChannel::Type::kHalf, targets.invocations.values.data(), 1});
  if (wants("rate")) channels.push_back({"rate.samples", ExrChannel::Type::kHalf, targets.rate.values.data(), 1});
  if (wants("velocity"))
    for (std::size_t c = 0; c < 2; ++c)
      channels.push_back(
          {std::string("velocity.") + "XY"[c], ExrChannel::Type::kHalf, targets.velocity.values.data() + c, 2});
  if (wants("edges")) channels.push_back({"edges.bit", ExrChannel::Type::kHalf, targets.edges.values.data(), 1});
  if (wants("discrepancy"))
    channels.push_back({"discrepancy.frames", ExrChannel::Type::kHalf, targets.discrepancy.values.data(), 1});
  if (wants("origin")) channels.push_back({"origin.kind", ExrChannel::Type::kHalf, targets.origin.values.data(), 1});
  if (wants("error")) channels.push_back({"error.value", ExrChannel::Type::kFloat, targets.error.values.data(), 1});
  write_exr(settings_.folder / (name + ".exr"), targets.color.width, targets.color.height, channels);
}

}  // namespace tessera::replay
