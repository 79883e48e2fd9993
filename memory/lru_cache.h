#pragma once

#include <cstdint>
#include <vector>

namespace tessera::memory {

// An on-chip LRU cache with a capacity in bytes. Keys are small numbers, as its host memory grows with the largest one.
//
// Invariants (cited by the tests):
//   LRU1  bytes_in_use() <= capacity; an object larger than the capacity is never kept.
//   LRU2  A changed key is written back exactly once after its last change, when it leaves or at the flush.
//   LRU3  Capacity 0 never hits; unlimited capacity misses each key once.
class LruCache {
 public:
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
  explicit LruCache(std::uint64_t capacity_bytes) : capacity_(capacity_bytes) {}

  // Uses a key that takes `bytes` (always the same for one key). Returns true for a hit. Calls write_back(key) for
  // every changed key that leaves.
  template <class WriteBack>
  bool use(std::uint32_t key, std::uint64_t bytes, bool change, const WriteBack& write_back) {
    if (bytes > capacity_) {
      if (change) write_back(key);
      return false;
    }
    if (key >= nodes_.size()) nodes_.resize(std::size_t{key} + 1);
    Node& node = nodes_[key];
    const bool hit = node.present;
    if (hit) unlink(key);
    while (bytes_ + (hit ? 0 : bytes) > capacity_) drop(oldest_, write_back);
    if (!hit) bytes_ += bytes, node.bytes = bytes, node.changed = false, node.present = true;
    node.changed = node.changed || change;
    link(key);
    return hit;
  }
  bool use(std::uint32_t key, std::uint64_t bytes) {
    return use(key, bytes, false, [](std::uint32_t) {});
  }

  // Empties the cache, the oldest key first.
  template <class WriteBack>
  void flush(const WriteBack& write_back) {
    while (oldest_ != kNone) drop(oldest_, write_back);
  }

  std::uint64_t bytes_in_use() const { return bytes_; }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Node {
    std::uint64_t bytes = 0;
    std::uint32_t newer = kNone, older = kNone;
    bool present = false, changed = false;
  };
  void link(std::uint32_t key) {
    nodes_[key].older = newest_;
    nodes_[key].newer = kNone;
    if (newest_ != kNone) nodes_[newest_].newer = key;
    newest_ = key;
    if (oldest_ == kNone) oldest_ = key;
  }
  void unlink(std::uint32_t key) {
    const Node& node = nodes_[key];
    if (node.older != kNone)
      nodes_[node.older].newer = node.newer;
    else
      oldest_ = node.newer;
    if (node.newer != kNone)
      nodes_[node.newer].older = node.older;
    else
      newest_ = node.older;
  }
  template <class WriteBack>
  void drop(std::uint32_t key, const WriteBack& write_back) {
    unlink(key);
    nodes_[key].present = false;
    bytes_ -= nodes_[key].bytes;
    if (nodes_[key].changed) write_back(key);
  }

  std::uint64_t capacity_, bytes_ = 0;
  std::uint32_t newest_ = kNone, oldest_ = kNone;
  std::vector<Node> nodes_;
};

}  // namespace tessera::memory
