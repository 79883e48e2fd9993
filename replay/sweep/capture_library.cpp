#include "replay/sweep/capture_library.h"

#include <chrono>
#include <span>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/sha256.h"
#include "base/whole_file.h"
#include "scene/capture_reader.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/resources.h"

namespace tessera::replay {

CaptureLibrary::Loaded CaptureLibrary::get(std::size_t index) {
  std::unique_lock lock(mutex_);
  released_.wait(lock, [&] { return current_ == index || users_ == 0; });
  if (current_ != index) {
    const auto start = std::chrono::steady_clock::now();
    current_ = kNone;
    loaded_.prepared.reset();  // refers to the capture
    loaded_.capture.reset();
    scene::CaptureLimits limits;
    limits.max_bytes = max_bytes_;
    limits.strict = strict_;
    limits.variant = variant_;
    loaded_.capture = std::make_shared<const scene::Capture>(read_capture(files_[index], limits, view_, size_));
    loaded_.prepared = std::make_shared<const gpu::PreparedCapture>(*loaded_.capture);
    current_ = index;
    ++loads_;
    load_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  ++users_;
  return loaded_;
}

void CaptureLibrary::release() {
  const std::lock_guard lock(mutex_);
  --users_;
  released_.notify_all();
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using scene::gltf::Place;

void add_file(const fs::path& file, Sha256& hash) {
  const std::vector<std::uint8_t> bytes = read_whole_file(file, scene::CaptureLimits{}.max_file_bytes, file.string());
  const std::uint64_t size = bytes.size();
  hash.add(std::span(reinterpret_cast<const std::uint8_t*>(&size), sizeof size));
  hash.add(bytes);
}

void add_named_files(const json& document, const fs::path& file, Sha256& hash) {
  for (const char* list : {"buffers", "images"}) {
    const auto items = document.find(list);
    if (items == document.end() || !items->is_array()) continue;
    for (const json& item : *items) {
      if (!item.is_object() || !item.contains("uri") || !item["uri"].is_string()) continue;
      const std::string& uri = item["uri"].get_ref<const std::string&>();
      if (!scene::gltf::is_data_uri(uri))
        add_file(scene::gltf::resolve_uri(uri, file.parent_path(), Place(file.string())), hash);
    }
  }
}

}  // namespace

std::string capture_fingerprint(const fs::path& file) {
  Sha256 hash;
  add_file(file, hash);
  try {
    const auto container = scene::gltf::open_container(
        read_whole_file(file, scene::CaptureLimits{}.max_file_bytes, file.string()), file.string());
    const json document = json::parse(container.json, nullptr, false);
    if (document.is_object()) add_named_files(document, file, hash);
  } catch (const InputError&) {
    // The reader says it better, once a point needs the capture.
  }
  return hash.finish();
}

}  // namespace tessera::replay
