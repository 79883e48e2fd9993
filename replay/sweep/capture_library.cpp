#include "replay/sweep/capture_library.h"

#include <chrono>

#include "scene/capture_reader.h"

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

}  // namespace tessera::replay
