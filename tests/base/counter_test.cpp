#include "base/counter.h"
#include "tests/support/tests.h"

namespace tessera {

struct SomeCounters {
  std::uint64_t events = 0, most = 0;
};
template <>
inline constexpr auto kCounterFields<SomeCounters> = std::to_array<CounterField<SomeCounters>>({
    {"some.events", &SomeCounters::events, Combine::kSum, "events", "Events.", ""},
    {"some.most", &SomeCounters::most, Combine::kPeak, "things", "Most at a time.", ""},
});
TESSERA_COUNTERS_COVER(SomeCounters);

namespace {

TEST(Counters, UnitsOfOneFrameAddUpAndFramesSumOrKeepThePeak) {
  SomeCounters a{3, 5}, b{4, 2};
  SomeCounters merged = a;
  merge(merged, b);
  EXPECT_EQ(merged.events, 7u);
  EXPECT_EQ(merged.most, 7u);
  SomeCounters total = a;
  accumulate(total, b);
  EXPECT_EQ(total.events, 7u);
  EXPECT_EQ(total.most, 5u);
}

}  // namespace
}  // namespace tessera
