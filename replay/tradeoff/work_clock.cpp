#include "replay/tradeoff/work_clock.h"

#include <algorithm>

namespace tessera::replay {

void WorkClock::expect(WorkKind kind, double work) {
  const std::lock_guard lock(mutex_);
  kinds_[static_cast<std::size_t>(kind)].left += work;
}

void WorkClock::finish(WorkKind kind, double work, double seconds) {
  const std::lock_guard lock(mutex_);
  Kind& of = kinds_[static_cast<std::size_t>(kind)];
  of.left = std::max(0.0, of.left - work);
  of.done += work;
  of.seconds += seconds;
}

double WorkClock::sum(double Kind::*of) const {
  double sum = 0;
  for (const Kind& kind : kinds_) sum += kind.*of;
  return sum;
}

double WorkClock::done() const {
  const std::lock_guard lock(mutex_);
  return sum(&Kind::done);
}

double WorkClock::left() const {
  const std::lock_guard lock(mutex_);
  return sum(&Kind::left);
}

std::optional<double> WorkClock::seconds_left(double more) const {
  const std::lock_guard lock(mutex_);
  const double done = sum(&Kind::done);
  if (done <= 0) return std::nullopt;
  const double mean = sum(&Kind::seconds) / done;
  double seconds = 0;
  for (std::size_t k = 0; k < kWorkKinds; ++k) {
    const Kind& kind = kinds_[k];
    const double left = kind.left + (static_cast<WorkKind>(k) == WorkKind::kRender ? more : 0);
    seconds += left * (kind.done > 0 ? kind.seconds / kind.done : mean);
  }
  return seconds;
}

}  // namespace tessera::replay
