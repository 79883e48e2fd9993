#pragma once

#include <atomic>
#include <cstddef>

namespace tessera::gpu {

// How far the view in hand is. Written by the threads that render, read by any; a view that needs partial renders or a
// second pass goes through its tiles again.
class WorkProgress {
 public:
  void begin(std::size_t tiles) { done_ = 0, tiles_ = tiles; }
  void tile_done() { done_.fetch_add(1, std::memory_order_relaxed); }
  void end() { begin(0); }

  std::size_t done() const { return done_; }
  // 0: no tile is being rendered.
  std::size_t tiles() const { return tiles_; }

 private:
  std::atomic<std::size_t> done_ = 0, tiles_ = 0;
};

}  // namespace tessera::gpu
