#pragma once

#include <cstddef>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace tessera {

// Calls body(i) for every i in [0, count), on any thread and in any order; iterations must not depend on each
// other. The first exception of a body is rethrown here.
template <class Body>
void parallel_for(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

// One T for each thread that asks, made when it first does.
template <class T>
class PerThread {
 public:
  T& local() { return values_.local(); }
  // All of them, in no fixed order: only for sums that do not depend on it.
  template <class Visit>
  void for_each(const Visit& visit) {
    for (T& value : values_) visit(value);
  }

 private:
  tbb::enumerable_thread_specific<T> values_;
};

// How many threads parallel loops use at most.
inline std::size_t thread_count() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

// Calls body(), whose parallel loops use at most `threads` threads, this one among them.
template <class Body>
void with_threads(std::size_t threads, const Body& body) {
  tbb::task_arena(static_cast<int>(threads)).execute(body);
}

// While it lives, parallel loops use at most `threads` threads (0: all that the machine has).
class ThreadLimit {
 public:
  explicit ThreadLimit(std::size_t threads)
      : control_(
            tbb::global_control::max_allowed_parallelism,
            threads == 0 ? tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) : threads) {}

 private:
  tbb::global_control control_;
};

}  // namespace tessera
