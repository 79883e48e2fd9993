#pragma once

#include <cstdint>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/text.h"

namespace tessera::scene {

// What reading a capture may cost. Every allocation whose size a file decides is charged before it is made.
struct CaptureLimits {
  std::uint64_t max_bytes = 4ull << 30;       // decoded data of one capture, all together
  std::uint64_t max_file_bytes = 2ull << 30;  // any one file
  ImageLimits image{};
  bool strict = false;  // refuse what glTF forbids also where it has one meaning, instead of a note
};

// The account of one reading.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  // Charges count * size bytes. Throws LimitError (overflow included), naming what was asked for.
  void charge(std::uint64_t count, std::uint64_t size, const std::string& what) {
    const std::uint64_t left = max_bytes_ - used_;
    if (size != 0 && count > left / size)
      throw LimitError(fmt::format(
          "{} needs {} elements of {} bytes; the capture may use {} in all (--max-memory, ReadLimits::max_bytes)", what,
          count, size, human_bytes(max_bytes_)));
    used_ += count * size;
  }
  std::uint64_t used_bytes() const { return used_; }

 private:
  std::uint64_t max_bytes_, used_ = 0;
};

}  // namespace tessera::scene
