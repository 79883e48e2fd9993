#pragma once

#include <cstdint>
#include <string>
#include <type_traits>

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

// What a budget refuses. Its message names the file.
class BudgetError : public LimitError {
 public:
  using LimitError::LimitError;
};

// The account of one reading, or of one frame.
class MemoryBudget {
 public:
  // `file`: what messages begin with, if anything. `used` bytes are used already; must not be more.
  explicit MemoryBudget(std::uint64_t max_bytes, const std::string& file = "", std::uint64_t used = 0)
      : max_bytes_(max_bytes), used_(used), file_(file.empty() ? "" : escape_control(file) + ": ") {}

  // Charges count * size bytes. Throws BudgetError (overflow included), naming what was asked for: a text, a place in
  // the file, or a function that makes the text.
  template <class What>
  void charge(std::uint64_t count, std::uint64_t size, const What& what) {
    const std::uint64_t left = max_bytes_ - used_;
    if (size != 0 && count > left / size)
      throw BudgetError(fmt::format(
          "{}{} needs {} elements of {} bytes; the capture may use {} in all (--max-memory, ReadLimits::max_bytes)",
          file_, text(what), count, size, human_bytes(max_bytes_)));
    used_ += count * size;
  }
  std::uint64_t used_bytes() const { return used_; }

 private:
  template <class What>
  static std::string text(const What& what) {
    if constexpr (std::is_invocable_v<const What&>)
      return what();
    else if constexpr (std::is_convertible_v<const What&, std::string>)
      return what;
    else
      return what.pointer();
  }

  std::uint64_t max_bytes_, used_;
  std::string file_;
};

}  // namespace tessera::scene
