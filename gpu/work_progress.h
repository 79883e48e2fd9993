#pragma once

#include <atomic>
#include <cstddef>
#include <exception>

namespace tessera::gpu {

// Thrown to end a frame whose result is no longer wanted.
struct Abandoned : std::exception {
  const char* what() const noexcept override { return "the frame was abandoned"; }
};

// Progress of the current view. Written by the threads that render, read by any thread; a view that needs partial
// renders or a second pass goes through its tiles again.
class WorkProgress {
 public:
  void begin(std::size_t tiles) { done_ = 0, tiles_ = tiles; }
  // Throws Abandoned after abandon().
  void tile_done() {
    if (abandoned_.load(std::memory_order_relaxed)) throw Abandoned();
    done_.fetch_add(1, std::memory_order_relaxed);
  }
  void end() { begin(0); }

  std::size_t done() const { return done_; }
  // 0 if no tile is being rendered.
  std::size_t tiles() const { return tiles_; }

  void abandon() { abandoned_ = true; }

 private:
  std::atomic<std::size_t> done_ = 0, tiles_ = 0;
  std::atomic<bool> abandoned_ = false;
};

}  // namespace tessera::gpu
