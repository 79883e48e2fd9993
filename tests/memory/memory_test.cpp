// Caches, the emulated memory map and the record of transfers.
#include <list>
#include <random>

#include "memory/line_cache.h"
#include "tests/support/tests.h"

namespace tessera::memory::memory_test {
namespace {

// Invariant LC1, said another way: a list of lines per set, the newest in front.
struct PlainCache {
  std::size_t sets, ways;
  std::vector<std::list<std::uint32_t>> lists = std::vector<std::list<std::uint32_t>>(sets);
  bool use(std::uint32_t line) {
    std::list<std::uint32_t>& list = lists[line % sets];
    const auto found = std::find(list.begin(), list.end(), line);
    const bool hit = found != list.end();
    if (hit) list.erase(found);
    list.push_front(line);
    if (list.size() > ways) list.pop_back();
    return hit;
  }
};

// How often two caches disagree about the same random lines.
int disagreements(LineCache& cache, PlainCache plain, std::uint32_t seed) {
  std::mt19937 random(seed);
  int wrong = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t line = random() % 3 == 0 ? random() % 4096 : random() % 64;
    wrong += cache.use(line) != plain.use(line) ? 1 : 0;
  }
  return wrong;
}

TEST(LineCache, KeepsTheLinesOfASetThatWereUsedLast) {  // LC2
  for (const auto& [sets, ways] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 8}, {16, 1}, {16, 4}, {64, 3}}) {
    LineCache cache(static_cast<std::int64_t>(sets * ways * 64), static_cast<std::int64_t>(ways), 64);
    EXPECT_EQ(disagreements(cache, {sets, ways}, 3), 0);
    cache.empty();
    EXPECT_EQ(disagreements(cache, {sets, ways}, 4), 0);
  }
  // One way more or less is noticed.
  LineCache cache(16 * 4 * 64, 4, 64);
  EXPECT_GT(disagreements(cache, {16, 3}, 3), 0);
  LineCache none(0, 4, 64);
  EXPECT_FALSE(none.use(1));
  EXPECT_FALSE(none.use(1));
}

TEST(Ledger, ItsLogHoldsEveryTransferOnce) {
  Ledger ledger;
  ledger.read(Unit::kFrontend, Purpose::kPatchData, 64);  // before: not recorded
  AccessLog log;
  ledger.record_into(&log);
  ledger.read(Unit::kFrontend, Purpose::kPatchData, 128);
  ledger.read(Unit::kFrontend, Purpose::kPatchData, 64);
  ledger.write_at(Unit::kResolve, Purpose::kFrameBuffer, 100, 100, 64);
  ASSERT_EQ(log.accesses().size(), 3u);
  EXPECT_EQ(log.accesses()[1].offset, 128u);  // behind the one before
  EXPECT_EQ(log.accesses()[2].offset, 64u);
  EXPECT_EQ(log.accesses()[2].bytes, 192u);
  EXPECT_TRUE(log.accesses()[2].write);
  EXPECT_EQ(ledger.traffic(Unit::kResolve, Purpose::kFrameBuffer).written_bytes, 192u);
  std::uint64_t recorded = 0;
  for (const Access& access : log.accesses()) recorded += access.bytes;
  EXPECT_EQ(recorded + 64, ledger.total().read_bytes + ledger.total().written_bytes);
  Ledger sum;
  sum += ledger;  // sums only
  EXPECT_EQ(log.accesses().size(), 3u);
}

}  // namespace
}  // namespace tessera::memory::memory_test
