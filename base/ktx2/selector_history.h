#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tessera::ktx2 {

// Selectors used last, the often used ones in front: a use moves one to half its place, a new one replaces one of the
// rear half, all of them in their order. Readers and writers of slices keep the same.
class SelectorHistory {
 public:
  explicit SelectorHistory(std::uint32_t size) : values_(size), next_(size / 2) {}

  void add(std::uint16_t value) {
    if (values_.empty()) return;
    values_[next_++] = value;
    if (next_ == values_.size()) next_ = values_.size() / 2;
  }
  std::uint16_t use(std::size_t index) {
    const std::uint16_t value = values_[index];
    std::swap(values_[index / 2], values_[index]);
    return value;
  }
  // The first place of a value, or the size where it is not there.
  std::size_t find(std::uint16_t value) const {
    std::size_t index = 0;
    while (index < values_.size() && values_[index] != value) ++index;
    return index;
  }
  std::size_t size() const { return values_.size(); }

 private:
  std::vector<std::uint16_t> values_;
  std::size_t next_;
};

}  // namespace tessera::ktx2
