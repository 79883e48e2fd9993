#include "bench/support/vector_rates.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/random.h"
#include "base/thread_clock.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/support/vector_rates.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

// Independent chains: more than a latency times the number of ports, and as many as registers hold.
constexpr std::size_t kChains = 12;

// `step(k, v)` returns the next number of chain k after v.
template <class Step>
HWY_INLINE float run_chains(std::size_t rounds, const float* start, Step step) {
  const D d;
  V chain[kChains];
  for (std::size_t k = 0; k < kChains; ++k) chain[k] = hn::Set(d, start[k]);
  for (std::size_t r = 0; r < rounds; ++r)
    for (std::size_t k = 0; k < kChains; ++k) chain[k] = step(k, chain[k]);
  V sum = chain[0];
  for (std::size_t k = 1; k < kChains; ++k) sum = hn::Add(sum, chain[k]);
  return hn::GetLane(sum);
}

float MultiplyAdds(std::size_t rounds, const float* numbers) {
  const V factor = hn::Set(D(), numbers[0]), term = hn::Set(D(), numbers[1]);
  return run_chains(rounds, numbers, [=](std::size_t, V v) HWY_ATTR { return hn::MulAdd(v, factor, term); });
}
float SumsAndProducts(std::size_t rounds, const float* numbers) {
  const V factor = hn::Set(D(), numbers[0]), term = hn::Set(D(), numbers[1]);
  return run_chains(rounds, numbers,
                    [=](std::size_t k, V v) HWY_ATTR { return k % 2 == 0 ? hn::Mul(v, factor) : hn::Add(v, term); });
}
float Divisions(std::size_t rounds, const float* numbers) {
  const V dividend = hn::Set(D(), numbers[1]);
  return run_chains(rounds, numbers, [=](std::size_t, V v) HWY_ATTR { return hn::Div(dividend, v); });
}
// The sums keep the numbers from converging to 1, and run beside the roots.
float Roots(std::size_t rounds, const float* numbers) {
  const V term = hn::Set(D(), numbers[1]);
  return run_chains(rounds, numbers, [=](std::size_t, V v) HWY_ATTR { return hn::Sqrt(hn::Add(v, term)); });
}
float Gathers(std::size_t rounds, const float* numbers, const std::int32_t* places) {
  const hn::RebindToSigned<D> di;
  return run_chains(rounds, numbers, [=](std::size_t k, V v) HWY_ATTR {
    return hn::Add(v, hn::GatherIndex(D(), numbers, hn::LoadU(di, places + k * hn::Lanes(D()))));
  });
}
std::size_t RateLanes() { return hn::Lanes(D()); }

}  // namespace tessera::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::bench {
namespace {

HWY_EXPORT(MultiplyAdds);
HWY_EXPORT(SumsAndProducts);
HWY_EXPORT(Divisions);
HWY_EXPORT(Roots);
HWY_EXPORT(Gathers);
HWY_EXPORT(RateLanes);

constexpr std::size_t kNumbers = 4096, kRounds = 20000, kInstructions = 12 * kRounds;

// The best of several runs: disturbances only make a run slower.
template <class Function>
double seconds_each(const Function& function) {
  static volatile float sink;
  double best = 1e300;
  for (int again = 0; again < 5; ++again) {
    const double start = thread_seconds();
    sink = function(kRounds);
    best = std::min(best, thread_seconds() - start);
  }
  (void)sink;
  return best / static_cast<double>(kInstructions);
}

}  // namespace

VectorTimes measure_vector_times() {
  std::array<float, kNumbers> numbers;
  std::array<std::int32_t, 12 * 64> places;
  for (std::size_t i = 0; i < kNumbers; ++i) numbers[i] = 1 + static_cast<float>(i) * 0x1p-20f;
  for (std::uint32_t i = 0; i < places.size(); ++i)
    places[i] = static_cast<std::int32_t>(hash32(i, 1) % static_cast<std::uint32_t>(kNumbers));
  const float* from = numbers.data();
  VectorTimes out;
  out.lanes = HWY_DYNAMIC_DISPATCH(RateLanes)();
  out.arithmetic =
      std::min(seconds_each([=](std::size_t n) { return HWY_DYNAMIC_DISPATCH(MultiplyAdds)(n, from); }),
               seconds_each([=](std::size_t n) { return HWY_DYNAMIC_DISPATCH(SumsAndProducts)(n, from); }));
  out.division = seconds_each([=](std::size_t n) { return HWY_DYNAMIC_DISPATCH(Divisions)(n, from); });
  out.root = seconds_each([=](std::size_t n) { return HWY_DYNAMIC_DISPATCH(Roots)(n, from); });
  out.gather = seconds_each([&](std::size_t n) { return HWY_DYNAMIC_DISPATCH(Gathers)(n, from, places.data()); });
  return out;
}

}  // namespace tessera::bench
#endif
