#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "replay/view_options.h"
#include "scene/capture.h"

namespace tessera::replay {

// SHA-256 of a capture: of the file and, for a .gltf, of the files that it names. Reads nothing else and checks
// nothing: the reader refuses bad files later. Throws InputError when the file cannot be read.
std::string capture_fingerprint(const std::filesystem::path& file);

// The captures of a study, read when the first point needs them and shared by all points that do. At most one is in
// memory: a thread that asks for another one waits until all threads have released the current one. Safe for many
// threads; each must release its capture before it asks for the next.
class CaptureLibrary {
 public:
  // `max_bytes` limits the decoded data of a capture. `variant` (scene::CaptureLimits::variant) and `view` apply to all
  // captures, for images of size `size`.
  CaptureLibrary(std::vector<std::filesystem::path> files, std::uint64_t max_bytes, bool strict = false,
                 std::optional<std::string> variant = {}, ViewChoices view = {},
                 std::optional<ImageSize> size = std::nullopt)
      : files_(std::move(files)),
        max_bytes_(max_bytes),
        strict_(strict),
        variant_(std::move(variant)),
        view_(std::move(view)),
        size_(size) {}

  struct Loaded {
    std::shared_ptr<const scene::Capture> capture;  // outlives the data prepared from it
    std::shared_ptr<const gpu::PreparedCapture> prepared;
  };
  // Throws the errors of read_capture().
  Loaded get(std::size_t index);
  // Releases the capture in its destructor.
  class Lease {
   public:
    explicit Lease(CaptureLibrary& library) : library_(library) {}
    ~Lease() { library_.release(); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

   private:
    CaptureLibrary& library_;
  };
  // Releases the capture of get(); the caller must hold no part of it any more.
  void release();

  double load_seconds() const { return load_seconds_; }
  std::size_t loads() const { return loads_; }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};

  std::vector<std::filesystem::path> files_;
  std::uint64_t max_bytes_;
  bool strict_;
  std::optional<std::string> variant_;
  ViewChoices view_;
  std::optional<ImageSize> size_;
  std::mutex mutex_;
  std::condition_variable released_;
  std::size_t current_ = kNone, users_ = 0, loads_ = 0;
  Loaded loaded_;
  double load_seconds_ = 0;
};

}  // namespace tessera::replay
