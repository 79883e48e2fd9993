#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/clusters.h"

namespace tessera::scene {

inline constexpr std::size_t kDgfMaxTriangles = 64;

// How a triangle of a DGF block follows the previous ones (scene/dgf_block.h).
enum class DgfControl : std::uint8_t { kRestart, kEdge1, kEdge2, kBacktrack };

// Adjacency of a cluster's triangles: neighbours share an edge and wind alike. Each edge has at most one neighbour,
// mutually; triangles that have a corner twice have none. `triangles` must outlive this object.
class TriangleAdjacency {
 public:
  static constexpr std::uint8_t kNobody = 0xff;

  explicit TriangleAdjacency(std::span<const LocalTriangle> triangles);

  std::size_t size() const { return triangles_.size(); }
  const LocalTriangle& operator[](std::size_t t) const { return triangles_[t]; }
  // The neighbour across the edge of triangle `t` that begins at corner k, 0 to 2, or kNobody.
  std::uint8_t across(std::size_t t, std::size_t k) const { return across_[t][k]; }

 private:
  void match(std::size_t s, std::size_t k);

  std::span<const LocalTriangle> triangles_;
  std::array<std::array<std::uint8_t, 3>, kMaxClusterTriangles> across_;
};

// Triangles in the order of a generalised strip.
struct DgfStrip {
  std::size_t count = 0, restarts = 0;
  std::array<std::uint8_t, kDgfMaxTriangles> order;     // numbers of the cluster's triangles
  std::array<LocalTriangle, kDgfMaxTriangles> corners;  // per triangle, from the first corner that its control allows
  std::array<DgfControl, kDgfMaxTriangles> controls;    // the first restarts
};

// Builds a strip of the triangles `some` of a cluster, 1 to 64 and each once, that begins at `start`. It goes on at the
// neighbour with the fewest further neighbours, so that a backtrack leaves a single triangle; ties go across the second
// edge, or across the third.
DgfStrip walk_strip(const TriangleAdjacency& triangles, std::span<const std::uint8_t> some, std::uint8_t start,
                    bool third_edge_first);

}  // namespace tessera::scene
