#include "scene/capture_reader.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <fstream>
#include <utility>

#include "base/text.h"
#include "base/whole_file.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/audit.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/notes.h"
#include "scene/gltf/read_ahead.h"
#include "scene/gltf/selection.h"
#include "scene/gltf/validation.h"

namespace tessera::scene {
namespace {

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Refuses a file unread if its size and its first bytes show that reading will charge more than the limit. `budget` is
// a copy: nothing is charged yet.
void check_size(const std::filesystem::path& file, MemoryBudget budget) {
  std::error_code unknown;
  const std::uint64_t size = std::filesystem::file_size(file, unknown);
  if (unknown) return;
  std::ifstream stream(file, std::ios::binary);
  std::array<unsigned char, 20> head{};
  stream.read(reinterpret_cast<char*>(head.data()), head.size());
  const bool container = stream.gcount() == 20 && std::memcmp(head.data(), "glTF", 4) == 0;
  std::uint64_t json = 0;
  for (std::size_t k = 0; k < 4; ++k) json |= std::uint64_t{head[12 + k]} << (8 * k);
  budget.charge(size, 2, "the file");
  budget.charge(container ? std::min(json, size) : size, gltf::kCensusBytes, "the document");
}

// Keys of accessors without data are zeros that the file does not store: their room is checked before it is allocated.
void check_claims(const nlohmann::json& json, MemoryBudget budget) {
  for (const nlohmann::json& animation : gltf::list_of(json, "animations"))
    for (const nlohmann::json& sampler : animation["samplers"])
      for (const char* side : {"input", "output"}) {
        const auto accessor = sampler[side].get<std::size_t>();
        if (json["accessors"][accessor].contains("bufferView")) continue;
        const gltf::AccessorLayout layout = gltf::accessor_layout(json, accessor);
        budget.charge(layout.count * static_cast<std::uint64_t>(layout.components), sizeof(float),
                      "/accessors/" + std::to_string(accessor));
      }
}

}  // namespace

Capture read_capture(const std::filesystem::path& file, const CaptureLimits& limits, const Selection& selection,
                     SceneList* scenes) {
  const double begin = seconds_now();
  const std::string name = file.string();
  MemoryBudget budget(limits.max_bytes, name);
  check_size(file, budget);
  std::vector<std::uint8_t> bytes = read_whole_file(file, limits.max_file_bytes, name,
                                                    [&](std::uint64_t size) { budget.charge(size, 1, "the file"); });
  const std::uint64_t file_bytes = bytes.size();
  budget.charge(file_bytes, 1, "the file");  // taken apart into chunks
  gltf::Notes notes(limits.strict);
  gltf::Container container = gltf::open_container(std::move(bytes), name, notes);

  nlohmann::json json = gltf::read_json(container.json, container.json_offset, name, budget);
  const gltf::Place root(name);
  gltf::check_schema(json, root, notes);
  gltf::charge_objects(json, budget);
  const int variant = gltf::choose_variant(json, limits.variant, root);
  gltf::validate_links(json, root, notes);
  check_claims(json, budget);
  const bool audit = limits.audit || limits.strict;
  if (audit) gltf::audit_document(json, root, notes);
  const gltf::Selected selected = gltf::select(json, selection, root);
  if (selected.scene != kNone) json["scene"] = selected.scene;
  if (scenes != nullptr) *scenes = gltf::list_scenes(json);

  const std::vector<std::string> unread = gltf::find_unread_extensions(json, root, budget, notes);
  gltf::Document document(std::move(json), file, std::move(container.binary), container.has_binary, limits, budget,
                          std::move(notes));
  const double loaded = seconds_now();
  gltf::read_ahead(document);
  Capture capture;
  capture.file = file;
  capture.variants = gltf::variant_names(document.json);
  capture.variant = variant;
  gltf::build_materials(document, capture);
  capture.meshes = gltf::build_meshes(document);
  gltf::build_scene(document, selected, capture);
  if (audit) gltf::audit_contents(document, file);
  capture.extensions_used = document.model.extensionsUsed;
  capture.extensions_unread = unread;
  capture.notices = document.notes.lines();
  capture.load_seconds = loaded - begin;
  capture.decode_seconds = seconds_now() - loaded;
  capture.charged_bytes = budget.used_bytes();
  capture.max_bytes = limits.max_bytes;
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
