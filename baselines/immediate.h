#pragma once

#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "gpu/configuration.h"
#include "memory/lru_cache.h"

namespace tessera::baselines {

// Where the samples of a frame are in the memory of an immediate-mode machine: 4 bytes of depth and 4 of colour each,
// in surfaces of lines of one burst that hold a rectangle of pixels as square as may be (64 bytes, 4 samples: 2x2
// pixels). Pixels with more samples than a line holds have several.
class SampleLayout {
 public:
  SampleLayout(IntRect region, int samples_per_pixel, std::uint64_t burst_bytes);

  std::uint32_t line_count() const { return line_count_; }
  // Pixels of the frame, inside the region.
  std::uint32_t line(int x, int y, int sample) const {
    const int column = (x - region_.x0) / width_, row = (y - region_.y0) / height_;
    return static_cast<std::uint32_t>((row * columns_ + column) * lines_per_pixel_ + sample / samples_per_line_);
  }
  // Where in its line a sample is.
  std::uint32_t place(int x, int y, int sample) const {
    const int column = (x - region_.x0) % width_, row = (y - region_.y0) % height_;
    return static_cast<std::uint32_t>((row * width_ + column) * samples_per_pixel_ + sample % samples_per_line_);
  }
  std::uint32_t samples_per_line() const { return static_cast<std::uint32_t>(samples_per_line_); }

 private:
  IntRect region_;
  int samples_per_pixel_;
  int width_ = 1, height_ = 1, columns_, lines_per_pixel_ = 1, samples_per_line_;
  std::uint32_t line_count_;
};

// The memory of an immediate-mode machine behind a colour and depth cache (LRU, lines of one burst). Depth is read
// before it is tested; colour is read only to blend, as lines have a mask of the bytes that changed; a line that was
// never written back is known to be clear and is not read. At the end samples are resolved, which reads all colour that
// was drawn.
//
// Configured by baselines.cache_bytes, memory.burst_bytes.
class ImmediateMemory {
 public:
  ImmediateMemory(std::uint64_t cache_bytes, std::uint64_t burst_bytes, std::uint32_t line_count)
      : burst_bytes_(burst_bytes),
        cache_(cache_bytes),
        in_memory_(std::size_t{2} * line_count, false),
        drawn_(line_count, false) {}

  // A triangle touches samples of a line; `passes`: some are in front of what was drawn before. Blended ones change no
  // depth.
  void draw(std::uint32_t line, bool passes, bool blends) {
    use(2 * line, true, passes && !blends);
    if (!passes) return;
    use(2 * line + 1, blends, true);
    drawn_[line] = true;
  }

  // Writes back what is on chip; `resolve` reads the colour first.
  void finish(bool resolve);

  std::uint64_t bytes_read() const { return bytes_read_; }
  std::uint64_t bytes_written() const { return bytes_written_; }

 private:
  void use(std::uint32_t key, bool read, bool change) {
    const bool in_memory = in_memory_[key];  // before this use writes it past a cache without room
    const bool hit = cache_.use(key, burst_bytes_, change, [this](std::uint32_t k) { write_back(k); });
    if (!hit && read && in_memory) bytes_read_ += burst_bytes_;
  }
  void write_back(std::uint32_t key) {
    bytes_written_ += burst_bytes_;
    in_memory_[key] = true;
  }

  std::uint64_t burst_bytes_;
  memory::LruCache cache_;
  std::vector<bool> in_memory_, drawn_;
  std::uint64_t bytes_read_ = 0, bytes_written_ = 0;
};

}  // namespace tessera::baselines
