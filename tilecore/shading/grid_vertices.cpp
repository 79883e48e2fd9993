#include "tilecore/shading/grid_vertices.h"

#include <algorithm>
#include <utility>

#include "base/random.h"

namespace tessera::tilecore {

void GridVertices::clear() {
  count_ = 0;
  if (++set_ == 0) places_.clear(), ++set_;
}

GridVertices::Place& GridVertices::place_of(std::uint64_t name) {
  const std::size_t last = places_.size() - 1;
  std::size_t at = hash32(static_cast<std::uint32_t>(name >> 32), static_cast<std::uint32_t>(name));
  while (places_[at & last].set == set_ && places_[at & last].name != name) ++at;
  return places_[at & last];
}

void GridVertices::grow() {
  std::vector<Place> before(std::max<std::size_t>(1024, 2 * places_.size()));
  std::swap(before, places_);
  for (const Place& place : before)
    if (place.set == set_) place_of(place.name) = place;
}

GridVertices::Number GridVertices::number_of(std::uint32_t patch, int i, int j) {
  if (2 * (count_ + 1) > places_.size()) grow();
  const std::uint64_t name = std::uint64_t{patch} << 32 | static_cast<std::uint32_t>(j << 16 | i);
  Place& place = place_of(name);
  const bool is_new = place.set != set_;
  if (is_new) place = {name, set_, static_cast<std::int32_t>(count_++)};
  return {place.number, is_new};
}

}  // namespace tessera::tilecore
