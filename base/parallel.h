#pragma once

#include <algorithm>
#include <cstddef>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

namespace tessera {

// Calls body(i) for every i in [0, count), on any thread and in any order; iterations must not depend on each
// other. The first exception of a body is rethrown here.
template <class Body>
void parallel_for(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, body);
}

// One T for each thread, made when the thread first asks for it.
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

// Calls body(), whose parallel loops use at most `threads` threads, this one among them.
template <class Body>
void with_threads(std::size_t threads, const Body& body) {
  tbb::task_arena(static_cast<int>(threads)).execute(body);
}

// How many threads parallel loops use at most.
inline std::size_t thread_count() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

// Calls body(i) for every i in [0, count), `batch` of them after one another on a thread, batches begun by rising i; and
// after(i) by rising i, one at a time, on any thread, when body(i) is done. The first exception is rethrown here.
template <class Body, class After>
void parallel_in_order(std::size_t count, std::size_t batch, const Body& body, const After& after) {
  struct Part {
    std::size_t first, end;
  };
  constexpr std::size_t kBatchesPerThread = 4;
  std::size_t next = 0;
  const auto begin = [&](tbb::flow_control& flow) {
    const Part part{next, std::min(next + batch, count)};
    next = part.end;
    if (part.first == part.end) flow.stop();
    return part;
  };
  const auto work = [&](const Part& part) {
    for (std::size_t i = part.first; i < part.end; ++i) body(i);
    return part;
  };
  const auto finish = [&](const Part& part) {
    for (std::size_t i = part.first; i < part.end; ++i) after(i);
  };
  tbb::parallel_pipeline(kBatchesPerThread * thread_count(),
                         tbb::make_filter<void, Part>(tbb::filter_mode::serial_in_order, begin) &
                             tbb::make_filter<Part, Part>(tbb::filter_mode::parallel, work) &
                             tbb::make_filter<Part, void>(tbb::filter_mode::serial_in_order, finish));
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
