#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "baselines/block_code.h"

namespace tessera::baselines {

// Remembers for each vertex of the current draw, by its number in the index buffer, whether its position is shaded
// and where the vertex is stored. Memory grows with the largest number, 8 bytes each; starting a draw costs time in
// proportion to the vertices of the one before.
//
// Invariants (cited by the tests):
//   DR1  A vertex is shaded once and stored at one place until the next draw begins.
class DrawVertices {
 public:
  // Begins the next draw: its vertices are neither shaded nor stored.
  void begin() {
    for (const std::uint32_t vertex : shaded_) states_[vertex] = kNotShaded;
    shaded_.clear();
  }
  // Marks a vertex as shaded; returns false if it was shaded before.
  bool shade(std::uint32_t vertex) {
    if (vertex >= states_.size()) states_.resize(std::size_t{vertex} + 1, kNotShaded);
    if (states_[vertex] != kNotShaded) return false;
    states_[vertex] = kNotStored;
    shaded_.push_back(vertex);
    return true;
  }
  // Place of a shaded vertex; empty while it is not stored.
  std::optional<VertexPlace> place(std::uint32_t vertex) const {
    const std::uint64_t state = states_[vertex];
    if (state == kNotStored) return std::nullopt;
    return VertexPlace{state >> kPlaceBits, static_cast<std::uint8_t>(state & (kBlockVertices - 1))};
  }
  void store(std::uint32_t vertex, VertexPlace place) { states_[vertex] = place.middle << kPlaceBits | place.place; }

 private:
  // A middle lies behind a block's head, so no place equals one of these.
  static constexpr std::uint64_t kNotShaded = 0, kNotStored = 1;
  static constexpr unsigned kPlaceBits = 6;
  static_assert(kBlockVertices == 1u << kPlaceBits);

  std::vector<std::uint64_t> states_;
  std::vector<std::uint32_t> shaded_;
};

}  // namespace tessera::baselines
