#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tessera/error.h>

namespace tessera {

// What reading a file may cost; more is refused with a LimitError before it is allocated.
struct ReadLimits {
  std::uint64_t max_bytes = 4ull << 30;       // decoded data of one scene, all together
  std::uint64_t max_file_bytes = 2ull << 30;  // any one file
  // What glTF forbids is an InputError also where its meaning is clear; else it is one of Scene::notices().
  bool strict = false;
};

// A capture: what is drawn, and how its file wants it to be drawn. Immutable; copies share one content, and any number
// of devices on any threads may render it.
class TESSERA_API Scene {
 public:
  // Reads any glTF 2.0 asset (.gltf or .glb). The file is not trusted.
  // Throws InputError for what glTF forbids, LimitError, SystemError.
  explicit Scene(const std::filesystem::path& file, const ReadLimits& limits = {});

  const std::filesystem::path& file() const;
  // Of the image that the file asks for, in pixels; 1280x720 if it does not.
  int width() const;
  int height() const;
  // The frames that the file asks for are first_frame() to first_frame() + frame_count() - 1; any other renders as well.
  int first_frame() const;
  int frame_count() const;
  double frame_rate() const;  // per second
  // What the reader skipped or assumed, for people; one line each.
  const std::vector<std::string>& notices() const;

  struct Content;

 private:
  friend class Device;
  std::shared_ptr<const Content> content_;
};

}  // namespace tessera
