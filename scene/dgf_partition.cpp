// Cuts a cluster's triangles into DGF blocks.
#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <optional>

#include "base/check.h"
#include "scene/dgf_block.h"

namespace tessera::scene {
namespace {

constexpr std::uint8_t kNobody = TriangleAdjacency::kNobody;

// The vertices of a block as it grows, and their box.
struct Growth {
  std::bitset<kMaxClusterVertices> vertices;
  LatticePoint low, high;

  std::size_t vertex_bits() const {
    std::size_t bits = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      bits += std::max<std::size_t>(1, std::bit_width(static_cast<std::uint32_t>(high[axis] - low[axis])));
    return (bits + 3) / 4 * 4;
  }
  std::size_t bits() const { return vertices.count() * vertex_bits(); }
  void add(std::span<const LatticePoint> points, const LocalTriangle& triangle) {
    const bool first = vertices.none();
    if (first) low = high = points[triangle[0]];
    for (const std::uint8_t v : triangle) {
      vertices.set(v);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], points[v][axis]);
        high[axis] = std::max(high[axis], points[v][axis]);
      }
    }
  }
  // The size of a block of so many triangles whose strip restarts so often.
  DgfBlockSize size(std::size_t triangles, std::size_t restarts, std::uint32_t reused_width) const {
    const std::size_t indices = triangles + 2 * restarts;
    return {triangles, vertices.count(), vertex_bits(), indices - std::min(indices, vertices.count()), reused_width};
  }
};

constexpr std::uint32_t kLeastWidth = 3, kMaxWidth = 6;
constexpr std::size_t kTrianglesPerRestart = 3;  // rarely fewer
constexpr std::size_t kRefusals = 4;             // number of triangles that do not fit before a block counts as full

// Grows one block after another. Each begins at a triangle on the rim of the remaining ones and takes the neighbour
// that adds the fewest bits.
class Partition {
 public:
  Partition(const PositionLattice& lattice, std::span<const LatticePoint> points, const TriangleAdjacency& triangles)
      : lattice_(lattice), points_(points), triangles_(triangles) {
    for (std::size_t t = 0; t < triangles.size(); ++t) left_.set(t);
  }

  // Blocks from `seed` on; gives up with none where they would be `limit` or more.
  std::vector<DgfBlock> from(std::uint8_t seed, std::size_t limit) {
    std::vector<DgfBlock> blocks;
    std::uint32_t first = 0;
    for (; seed != kNobody; seed = next_seed()) {
      if (blocks.size() + 1 >= limit) return {};
      blocks.push_back(grow(seed, first));
      first += static_cast<std::uint32_t>(blocks.back().triangles.size());
    }
    return blocks;
  }

 private:
  DgfBlock grow(std::uint8_t seed, std::uint32_t first) {
    std::vector<std::uint8_t> some;
    Growth growth;
    std::optional<DgfBlock> block;
    std::bitset<kMaxClusterTriangles> refused;
    for (std::uint8_t next = seed; next != kNobody; next = best_candidate(growth, some, refused)) {
      Growth larger = growth;
      larger.add(points_, triangles_[next]);
      const std::size_t count = some.size() + 1;
      some.push_back(next);
      // A block far from full is not encoded at each step; the loop below encodes it, and gives triangles back if it must.
      const bool easily = larger.size(count, 1 + count / kTrianglesPerRestart, kMaxWidth).fits();
      std::optional<DgfBlock> found;
      if (!easily && larger.size(count, 1, kLeastWidth).fits())
        found = encode_dgf_block(lattice_, points_, triangles_, some, first);
      if (easily || found) {
        block = std::move(found);
        growth = larger;
        left_.reset(next);
      } else {
        some.pop_back();
        refused.set(next);
        if (refused.count() == kRefusals) break;
      }
    }
    while (!block && !(block = encode_dgf_block(lattice_, points_, triangles_, some, first))) {
      TESSERA_CHECK(some.size() > 1, "one triangle fits into a block");
      left_.set(some.back());
      some.pop_back();
    }
    last_ = growth;
    return *std::move(block);
  }

  std::size_t free_neighbours(std::size_t t) const {
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (const std::uint8_t next = triangles_.across(t, k); next != kNobody && left_[next]) ++count;
    return count;
  }

  // The triangle that adds fewest bits, of the block's neighbours; of all that are left where it has none.
  std::uint8_t best_candidate(const Growth& growth, std::span<const std::uint8_t> some,
                              const std::bitset<kMaxClusterTriangles>& refused) const {
    if (some.size() == kDgfMaxTriangles) return kNobody;
    std::bitset<kMaxClusterTriangles> near;
    for (const std::uint8_t t : some)
      for (std::size_t k = 0; k < 3; ++k)
        if (const std::uint8_t next = triangles_.across(t, k); next != kNobody) near.set(next);
    near &= left_ & ~refused;
    if (near.none()) near = left_ & ~refused;
    return best(near, growth, 8);
  }

  // The triangle with fewest neighbours that are left; on ties the one nearest to the last block.
  std::uint8_t next_seed() const { return best(left_, last_, 4096); }

  // The triangle with the least cost: bits of the block with it, and a penalty for each neighbour that is left.
  std::uint8_t best(const std::bitset<kMaxClusterTriangles>& some, const Growth& growth, std::size_t penalty) const {
    std::uint8_t best = kNobody;
    std::size_t least = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (!some[t]) continue;
      Growth larger = growth;
      larger.add(points_, triangles_[t]);
      const std::size_t cost = larger.bits() + penalty * free_neighbours(t);
      if (best == kNobody || cost < least) best = static_cast<std::uint8_t>(t), least = cost;
    }
    return best;
  }

  const PositionLattice& lattice_;
  std::span<const LatticePoint> points_;
  const TriangleAdjacency& triangles_;
  std::bitset<kMaxClusterTriangles> left_;
  Growth last_;
};

// Triangles to begin at: the outermost ones along each axis, and those with fewest neighbours.
std::vector<std::uint8_t> seeds(std::span<const LatticePoint> points, const TriangleAdjacency& triangles) {
  std::vector<std::uint8_t> out;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) {
      std::uint8_t best = 0;
      const auto middle = [&](std::size_t t) {
        std::int64_t sum = 0;
        for (const std::uint8_t v : triangles[t]) sum += points[v][axis];
        return sum * sign;
      };
      for (std::size_t t = 1; t < triangles.size(); ++t)
        if (middle(t) < middle(best)) best = static_cast<std::uint8_t>(t);
      out.push_back(best);
    }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

std::vector<DgfBlock> encode_dgf_blocks(const PositionLattice& lattice, std::span<const LatticePoint> points,
                                        std::span<const LocalTriangle> triangles) {
  const TriangleAdjacency adjacency(triangles);
  std::vector<DgfBlock> best;
  for (const std::uint8_t seed : seeds(points, adjacency)) {
    std::vector<DgfBlock> blocks =
        Partition(lattice, points, adjacency).from(seed, best.empty() ? triangles.size() + 2 : best.size());
    if (!blocks.empty()) best = std::move(blocks);
    if (best.size() == 1) break;
  }
  return best;
}

}  // namespace tessera::scene
