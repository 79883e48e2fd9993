// How many boxes and triangles this machine can test at most: the arithmetic of visibility alone, for comparison with
// what the kernels of tilecore/visibility/sample_tests.cpp reach. Data lie in the first cache with unit stride; results are
// masks; nothing is gathered, nothing is done with a hit. The ceiling of a test is the better of its two arrangements.
//
// Rates are per second of a thread's processor time, so that other programs do not lower them; threads:2 says what each
// of two threads reaches while the other runs, and the machine's ceiling is twice that.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "base/simd_targets.h"

namespace tessera::bench {
#ifndef TESSERA_BENCH_ROOFLINE
#define TESSERA_BENCH_ROOFLINE

constexpr std::size_t kPrimitives = 64, kSamples = 256;
static_assert(kPrimitives <= kSamples);

// How lanes are filled: a primitive in registers against samples, or a sample in registers against primitives.
enum class Arrangement { kOnePrimitive, kOneSample };

// Raster-space samples at time t; boxes [low + t d_low, high + t d_high]; cells of four corners at (x, y, z) and, a
// shutter later, (x1, y1, z1).
template <std::size_t kCount>
struct alignas(64) Column : std::array<float, kCount> {};

struct Input {
  Column<kSamples> x, y, t;
  struct Box {
    Column<kPrimitives> x_low, x_d_low, x_high, x_d_high, y_low, y_d_low, y_high, y_d_high;
  } box;
  struct Corner {
    Column<kPrimitives> x, y, dx, dy, z, dz, z1;
  };
  std::array<Corner, 4> corner;
};

// Bits of the tests, lane by lane, vector by vector: for every primitive all samples, or for every sample all
// primitives. Cells have two masks in a row, of their triangles (a, b, c) and (a, c, d).
using Masks = std::vector<std::uint8_t>;

#endif
}  // namespace tessera::bench

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/tilecore/roofline_bench.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace simd = tessera::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

constexpr std::size_t kMaskBytes = (hn::MaxLanes(D()) + 7) / 8;

HWY_INLINE V fma(V a, V b, V c) { return simd::fused_multiply_add(D(), a, b, c); }

// low <= v <= high for lanes of `mask`.
HWY_INLINE hn::Mask<D> within(hn::Mask<D> mask, V low, V v, V high) {
#if HWY_TARGET == HWY_AVX3
  // AVX-512 compares under a mask for nothing; Highway 1.0 has no word for it.
  const auto above = _mm512_mask_cmp_ps_mask(mask.raw, v.raw, low.raw, _CMP_GE_OQ);
  return {_mm512_mask_cmp_ps_mask(above, v.raw, high.raw, _CMP_LE_OQ)};
#else
  return hn::And(mask, hn::And(hn::Ge(v, low), hn::Le(v, high)));
#endif
}

struct SampleLanes {
  V x, y, t;
};
struct BoxLanes {
  V x_low, x_d_low, x_high, x_d_high, y_low, y_d_low, y_high, y_d_high;
};
struct CornerLanes {
  V x, y, dx, dy, z, dz, z1;
};

// Places where vectors come from: a value in all lanes, or values side by side.
struct Broadcast {
  std::size_t at;
  HWY_INLINE V operator()(std::span<const float> v) const { return hn::Set(D(), v[at]); }
};
struct Consecutive {
  std::size_t at;
  HWY_INLINE V operator()(std::span<const float> v) const { return hn::Load(D(), v.data() + at); }
};

template <class From>
HWY_INLINE SampleLanes load_samples(const Input& in, From from) {
  return {from(in.x), from(in.y), from(in.t)};
}
template <class From>
HWY_INLINE BoxLanes load_boxes(const Input& in, From from) {
  const Input::Box& b = in.box;
  return {from(b.x_low), from(b.x_d_low), from(b.x_high), from(b.x_d_high),
          from(b.y_low), from(b.y_d_low), from(b.y_high), from(b.y_d_high)};
}
template <class From>
HWY_INLINE std::array<CornerLanes, 4> load_cells(const Input& in, From from) {
  std::array<CornerLanes, 4> out;
  for (std::size_t k = 0; k < 4; ++k) {
    const Input::Corner& c = in.corner[k];
    out[k] = {from(c.x), from(c.y), from(c.dx), from(c.dy), from(c.z), from(c.dz), from(c.z1)};
  }
  return out;
}

struct BoxTest {
  static constexpr std::size_t kMasks = 1;
  using Lanes = BoxLanes;
  template <class From>
  static HWY_INLINE Lanes load(const Input& in, From from) {
    return load_boxes(in, from);
  }
  static HWY_INLINE void run(const BoxLanes& b, const SampleLanes& s, std::uint8_t* out) {
    const D d;
    const V x_low = fma(s.t, b.x_d_low, b.x_low), x_high = fma(s.t, b.x_d_high, b.x_high);
    const V y_low = fma(s.t, b.y_d_low, b.y_low), y_high = fma(s.t, b.y_d_high, b.y_high);
    const auto all = hn::MaskFromVec(hn::BitCast(d, hn::Set(hn::RebindToSigned<D>(), -1)));
    hn::StoreMaskBits(d, within(within(all, x_low, s.x, x_high), y_low, s.y, y_high), out);
  }
};

// Both triangles of a cell. kPerspective: corners move at the perspective-correct rate, which costs a division each.
template <bool kPerspective>
struct CellTest {
  static constexpr std::size_t kMasks = 2;
  using Lanes = std::array<CornerLanes, 4>;
  template <class From>
  static HWY_INLINE Lanes load(const Input& in, From from) {
    return load_cells(in, from);
  }
  static HWY_INLINE void run(const Lanes& corner, const SampleLanes& s, std::uint8_t* out) {
    const D d;
    V x[4], y[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const CornerLanes& c = corner[k];
      const V rate = kPerspective ? hn::Div(hn::Mul(s.t, c.z1), fma(s.t, c.dz, c.z)) : s.t;
      x[k] = fma(rate, c.dx, hn::Sub(c.x, s.x));
      y[k] = fma(rate, c.dy, hn::Sub(c.y, s.y));
    }
    const auto edge = [&](std::size_t a, std::size_t b)
                          HWY_ATTR { return hn::Sub(hn::Mul(x[a], y[b]), hn::Mul(y[a], x[b])); };
    // Inside: all three signs are the same.
    const auto store = [&](V e0, V e1, V e2, std::uint8_t* to) HWY_ATTR {
      const hn::RebindToSigned<D> di;
      const auto differ = hn::BitCast(di, hn::Or(hn::Xor(e0, e1), hn::Xor(e1, e2)));
      hn::StoreMaskBits(d, hn::RebindMask(d, hn::Gt(differ, hn::Set(di, -1))), to);
    };
    const V ab = edge(0, 1), bc = edge(1, 2), ca = edge(2, 0), cd = edge(2, 3), da = edge(3, 0);
    store(ab, bc, ca, out);
    store(hn::Neg(ca), cd, da, out + kMaskBytes);
  }
};

template <class Test>
void test_all(const Input& in, Arrangement arrangement, Masks& masks) {
  const std::size_t lanes = hn::Lanes(D());
  std::uint8_t* out = masks.data();
  if (arrangement == Arrangement::kOnePrimitive) {
    for (std::size_t p = 0; p < kPrimitives; ++p) {
      const typename Test::Lanes primitive = Test::load(in, Broadcast{p});
      for (std::size_t s = 0; s < kSamples; s += lanes, out += Test::kMasks * kMaskBytes)
        Test::run(primitive, load_samples(in, Consecutive{s}), out);
    }
  } else {
    for (std::size_t s = 0; s < kSamples; ++s) {
      const SampleLanes sample = load_samples(in, Broadcast{s});
      for (std::size_t p = 0; p < kPrimitives; p += lanes, out += Test::kMasks * kMaskBytes)
        Test::run(Test::load(in, Consecutive{p}), sample, out);
    }
  }
}

void TestBoxes(const Input& in, Arrangement arrangement, Masks& masks) { test_all<BoxTest>(in, arrangement, masks); }
void TestLinearCells(const Input& in, Arrangement arrangement, Masks& masks) {
  test_all<CellTest<false>>(in, arrangement, masks);
}
void TestPerspectiveCells(const Input& in, Arrangement arrangement, Masks& masks) {
  test_all<CellTest<true>>(in, arrangement, masks);
}
std::size_t LaneCount() { return hn::Lanes(D()); }

}  // namespace tessera::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::bench {
namespace {

HWY_EXPORT(TestBoxes);
HWY_EXPORT(TestLinearCells);
HWY_EXPORT(TestPerspectiveCells);
HWY_EXPORT(LaneCount);

enum class Test { kBoxes, kLinearTriangles, kPerspectiveTriangles };

void test_all(Test test, const Input& in, Arrangement arrangement, Masks& masks) {
  if (test == Test::kBoxes)
    HWY_DYNAMIC_DISPATCH(TestBoxes)(in, arrangement, masks);
  else if (test == Test::kLinearTriangles)
    HWY_DYNAMIC_DISPATCH(TestLinearCells)(in, arrangement, masks);
  else
    HWY_DYNAMIC_DISPATCH(TestPerspectiveCells)(in, arrangement, masks);
}

// Primitives of about a pixel in an 8x8 block, which move by up to four pixels.
Input make_input() {
  std::mt19937 engine(1);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(engine() >> 8) * 0x1p-24f;
  };
  Input in;
  for (std::size_t s = 0; s < kSamples; ++s) in.x[s] = uniform(0, 8), in.y[s] = uniform(0, 8), in.t[s] = uniform(0, 1);
  for (std::size_t p = 0; p < kPrimitives; ++p) {
    const float x = uniform(-2, 8), y = uniform(-2, 8), dx = uniform(-4, 4), dy = uniform(-4, 4);
    in.box.x_low[p] = x, in.box.x_high[p] = x + 2;
    in.box.y_low[p] = y, in.box.y_high[p] = y + 2;
    in.box.x_d_low[p] = dx, in.box.x_d_high[p] = dx + 0.5f;
    in.box.y_d_low[p] = dy, in.box.y_d_high[p] = dy + 0.5f;
    for (std::size_t k = 0; k < 4; ++k) {
      Input::Corner& c = in.corner[k];
      c.x[p] = x + uniform(0, 1) + (k == 1 || k == 2 ? 2.0f : 0.0f);
      c.y[p] = y + uniform(0, 1) + (k >= 2 ? 2.0f : 0.0f);
      c.dx[p] = dx, c.dy[p] = dy;
      c.z[p] = uniform(3, 4), c.z1[p] = uniform(3, 4), c.dz[p] = c.z1[p] - c.z[p];
    }
  }
  return in;
}

// ---- The obvious scalar tests -----------------------------------------------------------------------------------

bool in_box(const Input& in, std::size_t p, std::size_t s) {
  const Input::Box& b = in.box;
  const auto face = [&](std::span<const float> at, std::span<const float> d) { return std::fma(in.t[s], d[p], at[p]); };
  return in.x[s] >= face(b.x_low, b.x_d_low) && in.x[s] <= face(b.x_high, b.x_d_high) &&
         in.y[s] >= face(b.y_low, b.y_d_low) && in.y[s] <= face(b.y_high, b.y_d_high);
}

bool in_triangle(const Input& in, std::size_t p, std::size_t s, bool second, bool perspective) {
  struct Point {
    float x, y;
  };
  const auto corner = [&](std::size_t k) {
    const Input::Corner& c = in.corner[k];
    const float rate = perspective ? in.t[s] * c.z1[p] / std::fma(in.t[s], c.dz[p], c.z[p]) : in.t[s];
    return Point{std::fma(rate, c.dx[p], c.x[p] - in.x[s]), std::fma(rate, c.dy[p], c.y[p] - in.y[s])};
  };
  const auto negative = [](Point a, Point b) { return std::signbit(a.x * b.y - a.y * b.x); };
  const Point a = corner(0), b = corner(second ? 2 : 1), c = corner(second ? 3 : 2);
  const bool sign = negative(a, b);
  return negative(b, c) == sign && negative(c, a) == sign;
}

// Number of masks' bits that are not what the scalar tests say; `hits` counts theirs.
std::size_t wrong_bits(Test test, const Input& in, Arrangement arrangement, const Masks& masks, std::size_t& hits) {
  const std::size_t lanes = HWY_DYNAMIC_DISPATCH(LaneCount)(), mask_bytes = (lanes + 7) / 8,
                    results = test == Test::kBoxes ? 1 : 2;
  std::size_t wrong = 0;
  for (std::size_t p = 0; p < kPrimitives; ++p)
    for (std::size_t s = 0; s < kSamples; ++s) {
      const std::size_t pair = arrangement == Arrangement::kOnePrimitive ? p * kSamples + s : s * kPrimitives + p;
      for (std::size_t r = 0; r < results; ++r) {
        const bool expected = test == Test::kBoxes ? in_box(in, p, s)
                                                   : in_triangle(in, p, s, r == 1, test == Test::kPerspectiveTriangles);
        const std::size_t lane = pair % lanes, byte = (pair / lanes * results + r) * mask_bytes + lane / 8;
        wrong += (masks[byte] >> lane % 8 & 1) != (expected ? 1 : 0);
        hits += expected;
      }
    }
  return wrong;
}

void Ceiling(benchmark::State& state, Test test, Arrangement arrangement, const std::string& target) {
  // Threads of one benchmark have the same target.
  if (state.thread_index() == 0) force_simd_target(target);
  const Input in = make_input();
  const std::size_t tests = kPrimitives * kSamples * (test == Test::kBoxes ? 1 : 2);
  Masks masks(tests);
  if (state.thread_index() == 0) {
    std::size_t hits = 0;
    test_all(test, in, arrangement, masks);
    if (wrong_bits(test, in, arrangement, masks, hits) != 0 || hits == 0)
      state.SkipWithError("a mask is not what the scalar test says");
  }
  for (auto _ : state) {
    test_all(test, in, arrangement, masks);
    benchmark::DoNotOptimize(masks.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(tests));
  state.SetLabel(target);
}

const bool kRegistered = [] {
  constexpr const char* kTests[] = {"Boxes", "LinearTriangles", "PerspectiveTriangles"};
  constexpr const char* kArrangements[] = {"OnePrimitive", "OneSample"};
  for (const std::string& target : simd_target_names())
    for (const Test test : {Test::kBoxes, Test::kLinearTriangles, Test::kPerspectiveTriangles})
      for (const Arrangement arrangement : {Arrangement::kOnePrimitive, Arrangement::kOneSample}) {
        const std::string name = std::string("Ceiling") + kTests[static_cast<int>(test)] + "/" +
                                 kArrangements[static_cast<int>(arrangement)] + "/" + target;
        auto* b = benchmark::RegisterBenchmark(name.c_str(),
                                               [=](benchmark::State& s) { Ceiling(s, test, arrangement, target); });
        b->Threads(1);
        if (target == simd_target_names().front()) b->Threads(2);
      }
  return true;
}();

}  // namespace
}  // namespace tessera::bench
#endif
