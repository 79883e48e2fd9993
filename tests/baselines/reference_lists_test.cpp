// Machines whose lists hold references: lists decoded back to triangles, and the cost of shading them again.
#include <list>

#include "baselines/control_list.h"
#include "baselines/deferred_vertex.h"
#include "baselines/visibility_stream.h"
#include "gpu/configuration.h"
#include "tests/baselines/baseline_decoders.h"
#include "tests/baselines/patch_scenes.h"
#include "tests/support/tests.h"

namespace tessera::baselines::reference_lists_test {
namespace {

using test::Binned;
using test::flat_grid;
using test::kHeight;
using test::kWidth;
using test::mixed_scene;
using test::projection;
using test::Triangle;
using test::triangle_of;

using Tiles = std::map<binner::TileIndex, std::multiset<Triangle>>;

std::vector<std::uint8_t> list_of(const ReferenceLists& lists, binner::TileIndex tile) {
  memory::Ledger ledger;
  std::uint64_t ignored = 0;
  return lists.buffer().read_list(tile, ledger, ignored);
}

template <class DecodeList>
Tiles decode_tiles(const ReferenceLists& lists, binner::TileIndex tile_count, const DecodeList& decode) {
  Tiles out;
  for (binner::TileIndex tile = 0; tile < tile_count; ++tile)
    for (const Triangle& triangle : decode(list_of(lists, tile))) out[tile].insert(triangle);
  return out;
}

// ---- Decoders from the descriptions of the formats ----------------------------------------------------------------

std::vector<Triangle> decode_deferred(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
  std::vector<Triangle> out;
  std::uint64_t number = 0, group = 0;
  for (std::size_t at = 0; at < list.size();) {
    const std::uint64_t step = test::decode_number(list, at);
    number += step;
    const auto patch = std::find_if(scene.begin(), scene.end(), [&](const auto& p) { return p.number == number; });
    if (patch == scene.end()) return {};
    if (step > 0) group = 0;
    if (patch->group_ends.size() > 1) group += test::decode_number(list, at);
    const std::size_t begins = group == 0 ? 0 : patch->group_ends[group - 1];
    std::size_t taken = 0;
    const auto set = test::decode_triangle_set(list.subspan(at), patch->group_ends[group] - begins, taken);
    at += taken;
    for (std::size_t t = begins; t < patch->group_ends[group]; ++t)
      if (set[t - begins]) out.push_back(triangle_of(*patch, patch->triangles[t]));
  }
  return out;
}

std::vector<Triangle> decode_stream(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
  std::vector<Triangle> all, out;
  for (const TessellatedPatch& patch : scene)
    for (const auto& vertex : patch.triangles) all.push_back(triangle_of(patch, vertex));
  std::size_t next = 0;
  for (std::size_t at = 0; at < list.size();) {
    next += test::decode_number(list, at);
    for (std::uint64_t run = test::decode_number(list, at); run > 0; --run) out.push_back(all.at(next++));
  }
  return out;
}

std::vector<Triangle> decode_control(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
  struct Vertex {
    const TessellatedPatch* patch;
    std::uint32_t number;
  };
  std::vector<Vertex> buffer;
  for (const TessellatedPatch& patch : scene)
    for (std::uint32_t v = 0; v < patch.x0.size(); ++v) buffer.push_back({&patch, v});
  std::vector<Triangle> out;
  std::array<std::int64_t, 3> p{};
  std::uint32_t state = 0xFFFFFFFF;
  for (std::size_t at = 0; at < list.size();) {
    const unsigned head = list[at++], k = head % 4;
    if (k == 3 && head / 4 % 2 == 1) {
      state = list[at] + list[at + 1] * 256u + list[at + 2] * 65536u + list[at + 3] * 16777216u;
      at += 4;
      continue;
    }
    const std::int64_t away = head / 8 == 31 ? test::decode_signed(list, at) : static_cast<std::int64_t>(head / 8) - 15;
    if (k == 3) {
      p[0] = p[2] + away;
      p[1] = p[0] + test::decode_signed(list, at);
      p[2] = p[0] + test::decode_signed(list, at);
    } else {
      const std::int64_t from = p[(k + 1) % 3], to = p[k];
      p = {from, to, (head / 4 % 2 == 1 ? to : from) + away};
    }
    std::array<std::uint32_t, 3> numbers{};
    const TessellatedPatch* patch = buffer.at(static_cast<std::size_t>(p[0])).patch;
    if (patch->state != state) return {};
    for (std::size_t c = 0; c < 3; ++c) {
      if (buffer.at(static_cast<std::size_t>(p[c])).patch != patch) return {};
      numbers[c] = buffer[static_cast<std::size_t>(p[c])].number;
    }
    out.push_back(triangle_of(*patch, numbers));
  }
  return out;
}

// ---- All three ----------------------------------------------------------------------------------------------------

// A machine, its grid and how its lists are read.
struct Deferred {
  static constexpr int kSide = 32;
  DeferredVertexBinner binner;
  Deferred(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid) : binner(gpu, grid) {}
  static std::vector<Triangle> decode(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
    return decode_deferred(scene, list);
  }
};
struct Stream {
  static constexpr int kSide = 96;
  VisibilityStreamBinner binner;
  Stream(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid) : binner(gpu, grid) {}
  static std::vector<Triangle> decode(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
    return decode_stream(scene, list);
  }
};
struct Control {
  static constexpr int kSide = 32;
  ControlListBinner binner;
  Control(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid) : binner(gpu, grid) {}
  static std::vector<Triangle> decode(const std::vector<TessellatedPatch>& scene, std::span<const std::uint8_t> list) {
    return decode_control(scene, list);
  }
};

template <class Machine>
class ReferenceMachines : public testing::Test {
 protected:
  Binned draw(Machine& machine, const std::vector<TessellatedPatch>& scene) {
    const TriangleSetup setup(grid, p);
    Binned out = test::bin(setup, scene, [&](const auto& patch, const auto& list) { machine.binner.add(patch, list); });
    machine.binner.finish();
    return out;
  }
  Tiles decoded(const Machine& machine, const std::vector<TessellatedPatch>& scene) {
    return decode_tiles(machine.binner.lists(), grid.tile_count(),
                        [&](std::span<const std::uint8_t> list) { return Machine::decode(scene, list); });
  }

  binner::TileGrid grid{kWidth, kHeight, Machine::kSide, Machine::kSide};
  scene::Projection p = projection(12);
};
using Machines = testing::Types<Deferred, Stream, Control>;
TYPED_TEST_SUITE(ReferenceMachines, Machines);

TYPED_TEST(ReferenceMachines, DV1VS1CL1EveryListDecodesToTheTrianglesOfItsTile) {
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    const std::vector<TessellatedPatch> scene = mixed_scene(seed);
    TypeParam machine({}, this->grid);
    const Binned binned = this->draw(machine, scene);
    EXPECT_EQ(this->decoded(machine, scene), binned.expected);
  }
}

TYPED_TEST(ReferenceMachines, TwinATriangleForgottenInOneTileIsCaught) {
  const std::vector<TessellatedPatch> scene = mixed_scene(2);
  const TriangleSetup setup(this->grid, this->p);
  TypeParam machine({}, this->grid);
  const Binned binned = test::bin(setup, scene, [&](const TessellatedPatch& patch, TriangleList list) {
    if (patch.number == 100) {
      list.triangles.pop_back();
      list.group_ends.back() -= 1;
    }
    machine.binner.add(patch, list);
  });
  machine.binner.finish();
  EXPECT_NE(this->decoded(machine, scene), binned.expected);
}

TYPED_TEST(ReferenceMachines, DV2VS2CL2EachTileShadesItsVerticesOnceAndAnUnlimitedCacheEachOnceInAll) {
  const std::vector<TessellatedPatch> scene = mixed_scene(4);
  gpu::GpuConfiguration none, all;
  none.tessellator.cache_bytes = none.caches.l2_bytes = 0;
  all.tessellator.cache_bytes = 1 << 30;
  TypeParam without(none, this->grid), with(all, this->grid);
  const Binned binned = this->draw(without, scene);
  this->draw(with, scene);
  std::uint64_t of_tiles = 0, bytes = 0;
  std::set<std::array<std::uint64_t, 2>> distinct;
  for (const auto& [tile, vertices] : binned.vertices) {
    of_tiles += vertices.size();
    distinct.insert(vertices.begin(), vertices.end());
    std::set<std::uint64_t> here;
    for (const auto& vertex : vertices) here.insert(vertex[0]);
    for (const std::uint64_t number : here) bytes += scene[number / 100].patch_bytes;
  }
  const BaselineCounters &a = without.binner.lists().counters(), &b = with.binner.lists().counters();
  EXPECT_EQ(a.domain_evaluations, of_tiles);
  EXPECT_EQ(a.domain_evaluations_cached, of_tiles);
  EXPECT_EQ(b.domain_evaluations, of_tiles);
  EXPECT_EQ(b.domain_evaluations_cached, distinct.size());
  EXPECT_EQ(a.patch_bytes, bytes);
  EXPECT_EQ(a.patch_bytes_cached, bytes);
  EXPECT_LT(b.patch_bytes_cached, bytes);
}

TYPED_TEST(ReferenceMachines, ALimitedCacheIsAListInOrderOfUse) {
  const std::vector<TessellatedPatch> scene = {flat_grid(20, 5, 5, 120)};
  gpu::GpuConfiguration gpu;
  gpu.tessellator.cache_bytes = 12 * 100;
  TypeParam machine(gpu, this->grid);
  const TriangleSetup setup(this->grid, this->p);
  BaselineCounters counters;
  const TriangleList list = setup.run(scene[0], counters);
  machine.binner.add(scene[0], list);
  machine.binner.finish();
  std::list<std::uint32_t> recent;
  std::uint64_t missed = 0;
  const tilecore::TileOrder order(gpu.tilecore.tile_order, this->grid);
  for (const binner::TileIndex tile : order.tiles()) {
    std::set<std::uint32_t> here;
    for (std::size_t t = 0; t < list.triangles.size(); ++t) {
      if (!test::tiles_of(list, t).contains(tile)) continue;
      for (const std::uint32_t v : list.triangles[t].vertex) {
        if (!here.insert(v).second) continue;
        const auto found = std::find(recent.begin(), recent.end(), v);
        if (found == recent.end())
          ++missed;
        else
          recent.erase(found);
        recent.push_front(v);
        if (recent.size() > 100) recent.pop_back();
      }
    }
  }
  EXPECT_EQ(machine.binner.lists().counters().domain_evaluations_cached, missed);
  EXPECT_LE(missed, machine.binner.lists().counters().domain_evaluations);
}

// ---- Sizes ----------------------------------------------------------------------------------------------------------

TEST(DeferredVertex, AGridThatOneTileHoldsTakesTwoOrThreeBytesAGroup) {
  const binner::TileGrid grid(200, 200, 200, 200);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  for (const int n : {7, 14}) {
    TessellatedPatch patch = flat_grid(n, 5, 5, 100);
    patch.number = 9;
    DeferredVertexBinner binner({}, grid);
    BaselineCounters counters;
    binner.add(patch, setup.run(patch, counters));
    binner.finish();
    // An entry names patch 9 and all of its triangles; with several groups it also names the group, and later entries
    // say "the same patch".
    const std::size_t bytes = n == 7 ? 2 : 4 * 3;
    EXPECT_EQ(list_of(binner.lists(), 0).size(), bytes);
    EXPECT_EQ(binner.lists().counters().queue_bytes_written, 1 + 8 + bytes + 1) << "bits, cursor, end";
    EXPECT_EQ(binner.lists().counters().entries, n == 7 ? 1u : 4u);
  }
}

TEST(ControlList, AStripTakesAByteATriangleAndBlocksHave64Bytes) {
  const binner::TileGrid grid(200, 200, 200, 200);
  const scene::Projection p = projection(0);
  const TriangleSetup setup(grid, p);
  const TessellatedPatch patch = flat_grid(7, 5, 5, 100);
  ControlListBinner binner({}, grid);
  BaselineCounters counters;
  binner.add(patch, setup.run(patch, counters));
  binner.finish();
  // State (5); 7 rows begin with three vertices (head and two numbers), of which those in further rows lie near; the
  // other 13 triangles of each take a byte.
  const std::size_t bytes = 5 + 7 * 3 + 7 * 13;
  EXPECT_EQ(list_of(binner.lists(), 0).size(), bytes);
  const std::size_t blocks = (bytes + 59) / 60;
  EXPECT_EQ(binner.lists().counters().queue_bytes_peak, 2 * 64 + blocks * 64);
  EXPECT_EQ(binner.lists().counters().queue_bytes_written, 1 + 8 + bytes + 1 + (blocks - 1) * 4);
}

TEST(VisibilityStream, BinsAreAsFewAsTileMemoryAllows) {
  const IntRect frame = {0, 0, 1280, 720};
  for (const std::uint64_t gmem : {std::uint64_t{8192}, std::uint64_t{132} << 10, std::uint64_t{1} << 20,
                                   std::uint64_t{2} << 20, std::uint64_t{1} << 30}) {
    const BinSize bin = bin_size(frame, 4, gmem);
    EXPECT_EQ(bin.width % 32, 0);
    EXPECT_EQ(bin.height % 32, 0);
    EXPECT_TRUE(gmem < 32 * 32 * 32 || static_cast<std::uint64_t>(bin.width * bin.height) * 4 * 8 <= gmem);
    // No other size that fits makes fewer.
    const auto count = [&](int w, int h) { return ((1280 + w - 1) / w) * ((720 + h - 1) / h); };
    for (int w = 32; w <= 1280; w += 32)
      for (int h = 32; h <= 736; h += 32)
        EXPECT_TRUE(static_cast<std::uint64_t>(w * h) * 4 * 8 > gmem || count(w, h) >= count(bin.width, bin.height));
  }
  const BinSize whole = bin_size(frame, 1, std::uint64_t{1} << 30);
  EXPECT_EQ(whole.width, 1280);
  EXPECT_EQ(whole.height, 736);
}

// ---- A smaller buffer -----------------------------------------------------------------------------------------------

TEST(BufferPressure, ATileStoresItsStateOnceInEveryRoundThatIsNotTheLast) {
  const std::vector<std::uint64_t> state = {10, 100, 1000};
  // Heads 64, then 400 bytes; rounds of 100: growth at 64..164, 165..264, 265..364, and the last.
  const std::vector<Growth> growth = {{100, 0}, {164, 0}, {164, 1}, {165, 0}, {300, 2}, {364, 2}, {365, 1}, {464, 0}};
  EXPECT_EQ(partial_render_bytes(growth, 64, 464, 164, state), 2u * (10 + 100 + 10 + 1000));
  EXPECT_EQ(partial_render_bytes(growth, 64, 464, 264, state), 2u * (10 + 100)) << "two rounds";
  EXPECT_EQ(partial_render_bytes(growth, 64, 464, 464, state), 0u);
}

TEST(BufferPressure, SpillsAreTheBytesBeyondHalfTheRoom) {
  gpu::GpuConfiguration gpu;
  gpu.parameter_buffer.chunk_bytes = 128;
  TriangleBuffer buffer(gpu, 2);  // bits, cursors and first chunks: a burst each
  const std::vector<std::uint8_t> block(64, 1);
  std::vector<std::uint64_t> addresses;
  for (int n = 0; n < 10; ++n) addresses.push_back(buffer.store_block(block));
  buffer.append(0, std::vector<std::uint8_t>(28 + 5, 7));
  buffer.finish();
  EXPECT_EQ(buffer.bytes_in_use(), 192u + 10 * 64 + 128);
  BurstBytes reads(64);
  memory::Ledger ledger;
  std::uint64_t ignored = 0;
  buffer.read_list(0, ledger, ignored, &reads);
  for (const std::uint64_t address : addresses) reads.add(address, 64);
  const std::vector<std::uint64_t> state = {800, 800};
  const BufferPressure pressure = buffer.pressure(reads, state);
  EXPECT_EQ(pressure.needed_bytes, 960u);
  // Half the room ends behind 6 blocks: 4 blocks, 5 bytes of a list that are written and, with its end, read.
  EXPECT_EQ(pressure.spill_bytes, 4u * 64 * 2 + 5 + (5 + 1));
  EXPECT_EQ(pressure.partial_render_bytes, 0u) << "the one tile got its first entry in the last round";
}

TEST(BufferPressure, FollowsTheBufferThatHoldsThePatchLists) {
  gpu::GpuConfiguration gpu;  // first chunks of 32 bytes, further ones of 64
  gpu::ObservedWork record;
  record.entries.resize(4);
  for (std::uint32_t n = 0; n < 36; ++n) {
    binner::ListEntry entry{};
    entry.base_patch = entry.record = n;
    record.entries[0].push_back(entry);
    if (n >= 20) record.entries[3].push_back(entry);
  }
  const std::vector<std::uint64_t> state = {64, 64, 64, 64};
  const BufferPressure pressure = queue_pressure(record, gpu, state);
  // Bits, cursors, first chunks; 9 bursts of records, and a chunk for the last 8 entries of the first list.
  EXPECT_EQ(pressure.needed_bytes, 64u + 64 + 128 + 9 * 64 + 64);
  // Half the room: 5 bursts, 20 records. The rest spills: records, 8 entries; the link to them is in the first chunk.
  EXPECT_EQ(pressure.spill_bytes, 2u * (16 * 16 + 8));
  // The first 20 sub-patches are in one tile.
  EXPECT_EQ(pressure.partial_render_bytes, 2u * 64);
}

TEST(BufferPressureTwin, TilesOfASecondPassDoNotCountTwice) {
  gpu::GpuConfiguration gpu;
  gpu::ObservedWork record;
  record.entries.resize(2);
  for (const std::uint32_t n : {0u, 1u, 2u, 0u, 1u, 2u, 3u}) {
    binner::ListEntry entry{};
    entry.record = n;
    record.entries[1].push_back(entry);
  }
  const std::vector<std::uint64_t> state = {64, 64};
  gpu::ObservedWork once = record;
  once.entries[1].erase(once.entries[1].begin(), once.entries[1].begin() + 3);
  EXPECT_EQ(queue_pressure(record, gpu, state).needed_bytes, queue_pressure(once, gpu, state).needed_bytes);
  once.entries[1].back().record = 4;  // a fifth sub-patch of which nothing is in a list takes no room
  EXPECT_EQ(queue_pressure(record, gpu, state).needed_bytes, queue_pressure(once, gpu, state).needed_bytes);
  once.entries[1].push_back(once.entries[1].back());
  once.entries[1].back().record = 5;
  EXPECT_LT(queue_pressure(record, gpu, state).needed_bytes, queue_pressure(once, gpu, state).needed_bytes);
}

}  // namespace
}  // namespace tessera::baselines::reference_lists_test
