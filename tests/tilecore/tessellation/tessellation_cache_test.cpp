#include "tilecore/tessellation/tessellation_cache.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore::tessellation_cache_test {
namespace {

constexpr std::uint64_t kLine = 64 * TessellationCache::kPositionBytes;
constexpr std::uint64_t kOutline = 4;

// Tiles of 8x8 pixels in a grid of `columns` x `rows`, and a cache in front of them.
struct Machine {
  Machine(int columns, int rows, TileSequence sequence, std::uint64_t capacity_bytes)
      : capacity(capacity_bytes),
        grid(columns * 8, rows * 8, 8, 8),
        order(sequence, grid),
        cache(capacity, grid, order) {}
  std::uint64_t capacity;
  binner::TileGrid grid;
  TileOrder order;
  TessellationCache cache;

  std::uint64_t evaluations() const { return cache.counters().domain_evaluations; }
  // Vertices evaluated for a tile's requests.
  std::uint64_t use(binner::TileIndex tile, const std::vector<TessellationRequest>& requests) {
    const std::uint64_t before = evaluations();
    cache.use(tile, requests);
    EXPECT_LE(cache.bytes_in_use(), capacity);
    return evaluations() - before;
  }
};

VertexGroup group(std::uint16_t number, const IntRect& tiles, std::uint64_t vertices = ~std::uint64_t{0}) {
  return {number, 64, vertices, {tiles.x0 * 8, tiles.y0 * 8, tiles.x1 * 8, tiles.y1 * 8}};
}

TessellationRequest request(std::uint32_t patch, std::vector<VertexGroup> groups, std::uint16_t uses = 1) {
  TessellationRequest r;
  r.patch = patch;
  r.range = {0, 0, 1, 1};
  for (const VertexGroup& g : groups) r.vertices += static_cast<std::uint32_t>(std::popcount(g.vertices));
  r.triangles = 1;
  r.uses = uses;
  r.groups = std::make_shared<const std::vector<VertexGroup>>(std::move(groups));
  return r;
}

constexpr IntRect kAll{0, 0, 4, 2};

TEST(TessellationCache, AmongEqualsTheLeastRecentlyUsedLeavesFirst) {
  Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
  const auto a = request(1, {group(0, kAll)}), b = request(2, {group(0, kAll)}), c = request(3, {group(0, kAll)}, 2);
  EXPECT_EQ(m.use(0, {a, b}), 128u);
  EXPECT_EQ(m.use(1, {c}), 64u);  // a leaves: no list names it or b any more
  EXPECT_EQ(m.use(2, {b}), 0u);
  EXPECT_EQ(m.use(3, {a}), 64u);
  EXPECT_EQ(m.cache.counters().requests - m.cache.counters().sub_patches, 1u);
  EXPECT_EQ(m.cache.counters().compulsory_evaluations, 192u);
}

TEST(TessellationCache, GroupsThatNoListNamesAnyMoreLeaveFirst) {
  for (const bool named : {true, false}) {
    Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
    const auto b = request(2, {group(0, kAll)}, named ? 2 : 1), a = request(1, {group(0, kAll)}, 1),
               c = request(3, {group(0, kAll)}, 1);
    m.use(0, {b, a});
    m.use(1, {c});
    EXPECT_EQ(m.use(2, {b}), named ? 0u : 64u);
  }
}

TEST(TessellationCache, AUseThatTheCoreDroppedIsOverToo) {
  for (const bool told : {true, false}) {
    Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
    const auto b = request(2, {group(0, kAll)}, 2), a = request(1, {group(0, kAll)}, 2),
               c = request(3, {group(0, kAll)}, 2);
    m.use(0, {b, a});
    const SubPatchName hidden = a;
    m.cache.use(1, {}, std::span(&hidden, told ? 1 : 0));
    m.use(2, {c});  // a leaves for it, or it would be the first to leave again
    EXPECT_EQ(m.use(3, {c}), told ? 0u : 64u);
  }
}

TEST(TessellationCache, GroupsThatReturnLastInTileOrderLeaveFirst) {
  // 0 1 2 3    a: 0, 4    b: 0, 1, 2    c: 1, 2
  // 4 5 6 7
  Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
  const auto a = request(1, {group(0, {0, 0, 1, 2})}, 2), b = request(2, {group(0, {0, 0, 3, 1})}, 3),
             c = request(3, {group(0, {1, 0, 3, 1})}, 2);
  m.use(0, {b, a});
  m.use(1, {c});
  EXPECT_EQ(m.use(2, {b}), 0u);
}

TEST(TessellationCache, AGroupThatWouldLeaveFirstIsNotKept) {
  // The third comes back after both others, or never: it passes by.
  for (const bool never : {true, false}) {
    Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
    const auto a = request(1, {group(0, {0, 0, 2, 1})}, 2), b = request(2, {group(0, {0, 0, 3, 1})}, 3),
               c = request(3, {group(0, {0, 0, 1, 2})}, never ? 1 : 2);
    EXPECT_EQ(m.use(0, {a, b, c}), 192u);
    EXPECT_EQ(m.use(1, {a, b}), 0u);
    EXPECT_EQ(m.use(4, {c}), 64u);
  }
}

TEST(TessellationCache, TilesThatBeginAnewAreComparedAgain) {
  // By the order that the first round left, neither a nor b would come back, and a was used longer ago.
  Machine m(4, 2, TileSequence::kRows, 2 * kLine + 3 * kOutline);
  const auto a = request(1, {group(0, {0, 0, 2, 1})}, 9), b = request(2, {group(0, {3, 1, 4, 2})}, 9),
             c = request(3, {group(0, {0, 0, 2, 1})}, 9);
  m.use(0, {a});
  m.use(1, {a});
  m.use(7, {b});
  m.use(0, {c});
  EXPECT_EQ(m.use(1, {a}), 0u);
}

TEST(TessellationCache, SubPatchesThatMeetShareTheirVertices) {
  Machine m(4, 2, TileSequence::kMorton, 1 << 20);
  TessellationRequest left = request(1, {group(0, kAll, 0x0F0F)}), right = request(1, {group(0, kAll, 0xF8F8)});
  right.range = {1, 0, 2, 1};
  EXPECT_EQ(m.use(0, {left, right}), 8u + 8u);  // 10 of the right, 2 of them there
  EXPECT_EQ(m.cache.counters().compulsory_evaluations, 16u);
  EXPECT_EQ(m.cache.bytes_in_use(), kLine + 2 * kOutline);
}

TEST(TessellationCache, ATileNeedsOnlyTheGroupsThatItTouches) {
  // Both groups while nothing is known of them; then the first in tile 1, both in tile 0 alone.
  Machine m(4, 2, TileSequence::kRows, 1 << 20);
  const auto a = request(1, {group(0, {0, 0, 2, 1}), group(1, {0, 0, 1, 1})});
  EXPECT_EQ(m.use(0, {a}), 128u);
  EXPECT_EQ(m.cache.counters().group_tests, 0u);
  EXPECT_EQ(m.use(1, {a}), 0u);
  EXPECT_EQ(m.cache.counters().group_tests, 2u);

  // Room for two groups: groups that a tile does not touch need not come back.
  Machine small(4, 2, TileSequence::kRows, 2 * kLine + 4 * kOutline);
  small.use(0, {a});
  EXPECT_EQ(small.use(0, {request(2, {group(0, kAll)})}), 64u);  // the first group leaves
  EXPECT_EQ(small.use(1, {a}), 64u);
}

TEST(TessellationCache, OutlinesOutliveTheirVertices) {
  // Nothing of the first is left but where it is: a tile that it does not touch evaluates nothing.
  Machine m(4, 2, TileSequence::kRows, kLine + 16 * kOutline);
  const auto a = request(1, {group(0, {0, 0, 1, 1})}, 3);
  m.use(0, {a, request(2, {group(0, kAll)}, 3)});
  EXPECT_EQ(m.use(1, {a}), 0u);
  EXPECT_EQ(m.use(0, {a}), 64u);
}

TEST(TessellationCache, RigidVerticesLieThereOnceAndDeformingOnesOncePerKey) {
  const auto bytes = [](bool moving, bool deforming, std::vector<std::uint8_t> segments) {
    Machine m(4, 2, TileSequence::kRows, 1 << 20);
    for (const std::uint8_t segment : segments) {
      TessellationRequest r = request(1, {group(0, kAll)});
      r.moving = moving;
      r.deforming = deforming;
      r.segment = segment;
      m.use(0, {r});
    }
    return m.cache.bytes_in_use() - segments.size() * kOutline;
  };
  EXPECT_EQ(bytes(false, false, {0}), kLine);
  EXPECT_EQ(bytes(true, false, {0}), kLine);
  EXPECT_EQ(bytes(true, false, {1, 2, 3}), kLine);
  EXPECT_EQ(bytes(true, true, {0}), 2 * kLine);
  EXPECT_EQ(bytes(true, true, {1, 2, 3}), 4 * kLine);  // the key between two segments is theirs together
}

TEST(TessellationCache, RigidVerticesAreTransformedWhenTheyAreRead) {
  Machine m(4, 2, TileSequence::kRows, 1 << 20);
  TessellationRequest rigid = request(1, {group(0, kAll)}), still = request(2, {group(0, kAll)}), soft = still;
  rigid.moving = soft.moving = soft.deforming = true;
  soft.patch = 3;
  m.use(0, {rigid, still, soft});
  EXPECT_EQ(m.cache.counters().vertex_transforms, 0u);
  m.use(1, {rigid, still, soft});
  EXPECT_EQ(m.cache.counters().vertex_transforms, 64u);
}

// ---- Laws -----------------------------------------------------------------------------------------------------------

// Tiles in their order, with their requests: sub-patches of one or two groups, over rectangles of tiles.
struct Scene {
  static constexpr int kColumns = 12, kRows = 10;
  std::vector<std::pair<binner::TileIndex, std::vector<TessellationRequest>>> tiles;
};
Scene generate(Random& random, int sub_patches, bool exact, bool two_groups) {
  const binner::TileGrid grid(Scene::kColumns * 8, Scene::kRows * 8, 8, 8);
  const auto pick = [&](int end) { return static_cast<int>(random.uniform(0, static_cast<float>(end) - 0.01f)); };
  std::map<binner::TileIndex, std::vector<TessellationRequest>> by_tile;
  for (int p = 0; p < sub_patches; ++p) {
    const int x = pick(Scene::kColumns), y = pick(Scene::kRows);
    const IntRect tiles{x, y, std::min(x + 1 + pick(4), Scene::kColumns), std::min(y + 1 + pick(4), Scene::kRows)};
    std::vector<VertexGroup> groups = {group(0, tiles)};
    if (two_groups && pick(2) == 0) groups.push_back(group(1, {tiles.x0, tiles.y0, tiles.x0 + 1, tiles.y1}, 0xFFFF));
    TessellationRequest r = request(static_cast<std::uint32_t>(p), groups);
    std::vector<binner::TileIndex> lists;
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column)
        if (exact || pick(4) != 0) lists.push_back(grid.index(column, row));
    r.uses = static_cast<std::uint16_t>(lists.size());
    for (const binner::TileIndex tile : lists) by_tile[tile].push_back(r);
  }
  Scene scene;
  const TileOrder order(TileSequence::kMorton, grid);
  for (const binner::TileIndex tile : order.tiles())
    if (by_tile.contains(tile)) scene.tiles.emplace_back(tile, by_tile[tile]);
  return scene;
}
TessellationCounters run(const Scene& scene, std::uint64_t capacity) {
  Machine m(Scene::kColumns, Scene::kRows, TileSequence::kMorton, capacity);
  for (const auto& [tile, requests] : scene.tiles) m.use(tile, requests);
  return m.cache.counters();
}

// Patches in the order in which tiles ask for them.
std::vector<std::uint32_t> uses_of(const Scene& scene) {
  std::vector<std::uint32_t> uses;
  for (const auto& [tile, requests] : scene.tiles)
    for (const TessellationRequest& r : requests) uses.push_back(r.patch);
  return uses;
}

// Misses of a memory with room for `lines` groups of one size. After use k, `leaves` picks the patch that leaves from
// the kept patches, the longest unused first.
template <class Leaves>
std::uint64_t misses_of(const std::vector<std::uint32_t>& uses, std::size_t lines, const Leaves& leaves) {
  std::vector<std::uint32_t> kept;
  std::uint64_t misses = 0;
  for (std::size_t k = 0; k < uses.size(); ++k) {
    const auto there = std::find(kept.begin(), kept.end(), uses[k]);
    misses += there == kept.end() ? 1 : 0;
    if (there != kept.end()) kept.erase(there);
    kept.push_back(uses[k]);
    if (kept.size() > lines) kept.erase(leaves(kept, k));
  }
  return misses;
}

// Misses of a cache in which the patch that is used last leaves first or is not kept (Belady).
std::uint64_t optimal_misses(const Scene& scene, std::size_t lines) {
  const std::vector<std::uint32_t> uses = uses_of(scene);
  return misses_of(uses, lines, [&](std::vector<std::uint32_t>& kept, std::size_t k) {
    const auto next = [&](std::uint32_t patch) {
      return std::find(uses.begin() + static_cast<std::ptrdiff_t>(k) + 1, uses.end(), patch) - uses.begin();
    };
    return std::max_element(kept.begin(), kept.end(),
                            [&](std::uint32_t a, std::uint32_t b) { return next(a) < next(b); });
  });
}

std::uint64_t lru_misses(const Scene& scene, std::size_t lines) {
  return misses_of(uses_of(scene), lines, [](std::vector<std::uint32_t>& kept, std::size_t) { return kept.begin(); });
}

TEST(TessellationCache, TC1TC2TC3NoCapacityEvaluatesMoreThanNoneOrLessThanAll) {
  Random random(11);
  for (int n = 0; n < 20; ++n) {
    const Scene scene = generate(random, 60, false, true);
    std::uint64_t all = 0;
    for (const auto& [tile, requests] : scene.tiles)
      for (const TessellationRequest& r : requests) all += r.vertices;
    const TessellationCounters none = run(scene, 0), unlimited = run(scene, 1 << 30);
    EXPECT_EQ(none.domain_evaluations, all);
    EXPECT_EQ(none.sub_patches, none.requests);
    EXPECT_EQ(unlimited.domain_evaluations, unlimited.compulsory_evaluations);
    for (std::uint64_t lines = 1; lines < 40; lines += 7) {
      const TessellationCounters c = run(scene, lines * 1000);
      EXPECT_LE(c.compulsory_evaluations, c.domain_evaluations);
      EXPECT_LE(c.domain_evaluations, all);
      EXPECT_EQ(c.compulsory_evaluations, unlimited.compulsory_evaluations);
      EXPECT_LE(c.sub_patches, c.requests);
    }
  }
}

TEST(TessellationCache, LosesLessThanHalfAsMuchAsLruAgainstTheOptimum) {
  // All groups are as large, all outlines fit beside them.
  constexpr int kSubPatches = 40;
  Random random(12);
  std::uint64_t optimum = 0, lru = 0, next_use = 0;
  for (int n = 0; n < 40; ++n) {
    const Scene scene = generate(random, kSubPatches, n % 2 == 0, false);
    for (const std::uint64_t lines : {6u, 9u, 14u}) {
      const std::uint64_t misses = run(scene, lines * kLine + kSubPatches * kOutline).sub_patches,
                          best = optimal_misses(scene, lines);
      EXPECT_GE(misses, best);
      optimum += best;
      lru += lru_misses(scene, lines);
      next_use += misses;
    }
  }
  EXPECT_LT(2 * (next_use - optimum), lru - optimum);
}

TEST(TessellationCache, TwinARoomTooManyBeatsTheOptimum) {
  Random random(13);
  bool beaten = false;
  for (int n = 0; n < 10; ++n) {
    const Scene scene = generate(random, 40, true, false);
    beaten = beaten || run(scene, 12 * kLine + 40 * kOutline).sub_patches < optimal_misses(scene, 6);
  }
  EXPECT_TRUE(beaten);
}

}  // namespace
}  // namespace tessera::tilecore::tessellation_cache_test
