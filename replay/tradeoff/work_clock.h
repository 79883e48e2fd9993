#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

namespace tessera::replay {

// Kinds of work that take times of their own: frames that the machine renders, frames in double precision, frames that are
// rendered into a record, and timings of a record.
enum class WorkKind : std::uint8_t { kRender, kInDouble, kRecord, kTiming };
inline constexpr std::size_t kWorkKinds = 4;

// Estimates the time left from the time that finished work took. Weights compare work of one kind well, and work of two
// kinds roughly: each kind continues at its own measured rate, and at the mean rate of all kinds until it has one.
// Threads may call it at once.
//
// Invariants (cited by the tests):
//   TIL1  Where each kind takes the same time for the same weight, the time left is exact once every kind was measured.
class WorkClock {
 public:
  void expect(WorkKind kind, double work);
  void finish(WorkKind kind, double work, double seconds);

  double done() const;  // the weight of all finished work
  double left() const;  // the weight of work that is expected and not finished
  // Nothing before any work is finished. `more`: weight of frames that may or may not follow.
  std::optional<double> seconds_left(double more = 0) const;

 private:
  struct Kind {
    double left = 0, done = 0, seconds = 0;
  };
  double sum(double Kind::*of) const;  // with mutex_ held

  mutable std::mutex mutex_;
  std::array<Kind, kWorkKinds> kinds_{};
};

}  // namespace tessera::replay
