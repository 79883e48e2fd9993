#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "timing/events/memory_path.h"

namespace tessera::timing {

// The texture unit of a core with its cache, which stays warm from tile to tile. It takes one request after another, each for as long
// as its lookups take, and at least a clock for each line. It asks the L2 for missing lines, at most texture.requests at a time.
class TexturePath {
 public:
  TexturePath(const hardware::Machine& gpu, std::uint32_t core, EventQueue& events, MemoryPath& memory);

  // Adds a request. `lines` must stay. The event (kind, core, what) comes when all texels have arrived.
  void submit(const std::uint32_t* lines, std::uint32_t count, double cycles, EventKind kind, std::uint32_t what);

  void fill(std::uint32_t request, double now);
  void free_again(double now);

  RequestCache& cache() { return cache_; }
  double busy() const { return busy_; }
  std::uint64_t requests() const { return requested_; }
  std::uint64_t misses() const { return misses_; }

 private:
  struct Job {
    const std::uint32_t* lines;
    std::uint32_t count, next;
    double cycles;
    EventKind kind;
    std::uint32_t what, group;
  };
  struct Request {
    std::uint32_t line = 0;
    std::vector<std::uint32_t> groups;
  };

  void start(double now);
  // Goes through the lines of the first job until all are requested or no request is free.
  void look_up(double now);

  std::uint32_t core_;
  EventQueue& events_;
  MemoryPath& memory_;
  double latency_;
  RequestCache cache_;
  std::vector<Request> requests_;
  std::vector<std::uint32_t> free_requests_;
  std::deque<Job> queue_;
  double started_ = 0;
  bool blocked_ = false;
  double busy_ = 0;
  std::uint64_t requested_ = 0, misses_ = 0;
};

}  // namespace tessera::timing
