#include "scene/capture_reader.h"

#include <utility>

#include "base/text.h"
#include "base/whole_file.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/container.h"
#include "scene/gltf/extension_census.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/schema.h"
#include "scene/gltf/validation.h"

namespace tessera::scene {

Capture read_capture(const std::filesystem::path& file, const CaptureLimits& limits) {
  const std::string name = file.string();
  MemoryBudget budget(limits.max_bytes);
  std::vector<std::uint8_t> bytes = read_whole_file(
      file, limits.max_file_bytes, name, [&](std::uint64_t size) { budget.charge(size, 1, escape_control(name)); });
  const std::uint64_t file_bytes = bytes.size();
  budget.charge(file_bytes, 1, name);  // taken apart into chunks
  gltf::Notes notes(limits.strict);
  gltf::Container container = gltf::open_container(std::move(bytes), name, notes);

  nlohmann::json json = gltf::read_json(container.json, container.json_offset, name, budget);
  const gltf::Place root(name);
  gltf::check_schema(json, root);
  gltf::charge_objects(json, name, budget);
  gltf::validate_links(json, root, notes);

  const std::vector<std::string> unread = gltf::find_unread_extensions(json, root, budget, notes);
  gltf::Document document(std::move(json), file, std::move(container.binary), container.has_binary, limits, budget,
                          std::move(notes));
  Capture capture;
  capture.file = file;
  capture.materials = gltf::build_materials(document);
  capture.meshes = gltf::build_meshes(document);
  gltf::build_scene(document, capture);
  capture.extensions_used = document.model.extensionsUsed;
  capture.extensions_unread = unread;
  capture.notices = document.notes.lines();
  capture.charged_bytes = budget.used_bytes();
  capture.file_bytes = file_bytes + document.resources.bytes_read();
  return capture;
}

float Animation::duration() const {
  float last = 0;
  for (const AnimationChannel& channel : channels)
    if (!channel.times.empty()) last = std::max(last, channel.times.back());
  return last;
}

}  // namespace tessera::scene
