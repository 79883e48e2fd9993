#include "tilecore/shading/grid_vertices.h"

#include <algorithm>
#include <utility>

#include "base/random.h"

namespace tessera::tilecore {

void GridVertices::clear() {
  count_ = used_ = 0;
  numbers_.clear();
  last_name_ = kNoName;
  if (++set_ == 0) blocks_.clear(), ++set_;
}

GridVertices::Block& GridVertices::block_of(std::uint64_t name) {
  const std::size_t last = blocks_.size() - 1;
  std::size_t at = hash32(static_cast<std::uint32_t>(name >> 32), static_cast<std::uint32_t>(name));
  while (blocks_[at & last].set == set_ && blocks_[at & last].name != name) ++at;
  return blocks_[at & last];
}

void GridVertices::grow() {
  std::vector<Block> before(std::max<std::size_t>(256, 2 * blocks_.size()));
  std::swap(before, blocks_);
  for (const Block& block : before)
    if (block.set == set_) block_of(block.name) = block;
}

std::uint32_t GridVertices::first_of(std::uint64_t name) {
  if (2 * (used_ + 1) > blocks_.size()) grow();
  Block& block = block_of(name);
  if (block.set != set_) {
    block = {name, set_, static_cast<std::uint32_t>(numbers_.size())};
    numbers_.resize(numbers_.size() + kSide * kSide, kNone);
    ++used_;
  }
  return block.first;
}

}  // namespace tessera::tilecore
