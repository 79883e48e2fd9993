#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/text.h"

namespace tessera::scene {

// Options and limits of reading a capture. Every allocation whose size depends on the file is charged before it is
// made.
struct CaptureLimits {
  std::uint64_t max_bytes = 4ull << 30;       // decoded data of one capture, all together
  std::uint64_t max_file_bytes = 2ull << 30;  // any one file
  ImageLimits image{};
  bool strict = false;  // refuse violations of glTF even where they have one meaning, instead of a note
  bool audit = false;   // also name violations of glTF on which no image depends; `strict` implies it
  // KHR_materials_variants: name of the drawn variant; unset: the materials that the primitives themselves name.
  std::optional<std::string> variant{};
};

// Error of a budget whose limit a charge exceeds. Its message names the file.
class BudgetError : public LimitError {
 public:
  using LimitError::LimitError;
};

// A completed charge.
struct Charge {
  std::uint64_t count, size;
  std::string what;
};

// The memory account of one reading, or of one frame.
//
// Work ahead has its own accounts, on any thread: they draw on a room that they share, and write down their charges, to
// be made again when the work is used. Until then the waiting bytes keep their room here, or until a charge needs it.
//
// Invariants (cited by the tests):
//   MB1  Charges and refusals are the same as in an account without waiting bytes.
//   MB2  The charged and the waiting bytes together never exceed the limit.
class MemoryBudget {
 public:
  // Messages begin with `file`, unless it is empty. `used` bytes are already used, at most max_bytes.
  explicit MemoryBudget(std::uint64_t max_bytes, const std::string& file = "", std::uint64_t used = 0)
      : max_bytes_(max_bytes), used_(used), file_(file.empty() ? "" : escape_control(file) + ": ") {}

  // An account of work ahead: charges are drawn from `room` and written to `charges`.
  MemoryBudget(std::atomic<std::uint64_t>& room, std::vector<Charge>& charges)
      : max_bytes_(std::numeric_limits<std::uint64_t>::max()), used_(0), room_(&room), ahead_(&charges) {}

  // Charges count * size bytes. Throws BudgetError (overflow included) that names the allocation: `what` is a text, a
  // place in the file, or a function that makes the text.
  template <class What>
  void charge(std::uint64_t count, std::uint64_t size, const What& what) {
    if (ahead_ != nullptr) return charge_ahead(count, size, text(what));
    const std::uint64_t left = max_bytes_ - used_;
    if (waiting_ > 0 && size != 0 && count > (left - waiting_) / size) give_way();
    if (size != 0 && count > left / size)
      throw BudgetError(fmt::format(
          "{}{} needs {} elements of {} bytes; the capture may use {} in all (--max-memory, ReadLimits::max_bytes)",
          file_, text(what), count, size, human_bytes(max_bytes_)));
    used_ += count * size;
  }
  std::uint64_t used_bytes() const { return used_; }
  std::uint64_t left_bytes() const { return max_bytes_ - used_; }

  // Marks `bytes` drawn by work ahead as waiting to be charged; at most left_bytes(). `drop` frees all waiting values.
  void keep_waiting(std::uint64_t bytes, std::function<void()> drop) {
    waiting_ = bytes;
    drop_ = std::move(drop);
  }
  // So many bytes are no longer waiting.
  void stop_waiting(std::uint64_t bytes) { waiting_ -= bytes; }

 private:
  void charge_ahead(std::uint64_t count, std::uint64_t size, std::string what) {
    std::uint64_t left = room_->load();
    do {
      if (size != 0 && count > left / size) throw BudgetError(what + " does not fit ahead");
    } while (!room_->compare_exchange_weak(left, left - count * size));
    used_ += count * size;
    ahead_->push_back({count, size, std::move(what)});
  }
  void give_way() {
    waiting_ = 0;
    drop_();
  }

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
  std::uint64_t waiting_ = 0;
  std::function<void()> drop_;
  std::atomic<std::uint64_t>* room_ = nullptr;
  std::vector<Charge>* ahead_ = nullptr;
};

}  // namespace tessera::scene
