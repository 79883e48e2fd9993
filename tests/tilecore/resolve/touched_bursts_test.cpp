// Bursts of an array that are moved, against a set of burst numbers.
#include "tilecore/resolve/touched_bursts.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::touched_bursts_test {
namespace {

TEST(TouchedBursts, AreMovedOnceEach) {
  test::Random random(3);
  TouchedBursts touched;
  for (int round = 0; round < 500; ++round) {
    const int x0 = random.integer(0, 40), y0 = random.integer(0, 40);
    TouchedBursts::Array array{{x0, y0, x0 + random.integer(1, 90), y0 + random.integer(1, 60)},
                               static_cast<std::uint64_t>(random.integer(1, 130)),
                               static_cast<std::uint64_t>(random.integer(0, 500))};
    const std::uint64_t burst = std::uint64_t{16} << random.integer(0, 3);
    std::vector<IntRect> rects(static_cast<std::size_t>(random.integer(0, 12)));
    std::set<std::uint64_t> expected;
    for (IntRect& rect : rects) {
      const int x = random.integer(array.elements.x0, array.elements.x1),
                y = random.integer(array.elements.y0, array.elements.y1);
      rect = array.elements.intersect({x, y, x + random.integer(0, 6), y + random.integer(0, 6)});
      for (int j = rect.y0; j < rect.y1; ++j)
        for (int i = rect.x0; i < rect.x1; ++i) {
          const std::uint64_t first = array.offset + array.elements.index(i, j) * array.bytes;
          for (std::uint64_t b = first / burst; b * burst < first + array.bytes; ++b) expected.insert(b);
        }
    }
    touched.start(burst);
    for (const IntRect& rect : rects) touched.touch(array, rect);
    memory::Ledger ledger;
    memory::AccessLog log;
    ledger.record_into(&log);
    touched.write(ledger, memory::Unit::kResolve, memory::Purpose::kHistory);
    EXPECT_EQ(ledger.total().written_bytes, expected.size() * burst);
    std::set<std::uint64_t> got;
    for (const memory::Access& access : log.accesses())
      for (std::uint64_t b = access.offset / burst; b * burst < access.offset + access.bytes; ++b) got.insert(b);
    EXPECT_EQ(got, expected);
  }
}

}  // namespace
}  // namespace tessera::tilecore::touched_bursts_test
