#include "bench/support/roofline.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <stdexcept>

#include "base/thread_clock.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/support/roofline.cpp"
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
  // AVX-512 compares under a mask at no cost; Highway 1.0 has no function for it.
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

// Sources of vectors: one value in all lanes, or consecutive values.
struct Broadcast {
  std::size_t at;
  HWY_INLINE V operator()(std::span<const float> v) const { return hn::Set(D(), v[at]); }
};
struct Consecutive {
  std::size_t at;
  HWY_INLINE V operator()(std::span<const float> v) const { return hn::Load(D(), v.data() + at); }
};

template <class From>
HWY_INLINE SampleLanes load_samples(const RooflineInput& in, From from) {
  return {from(in.x), from(in.y), from(in.t)};
}
template <class From>
HWY_INLINE BoxLanes load_boxes(const RooflineInput& in, From from) {
  const RooflineInput::Box& b = in.box;
  return {from(b.x_low), from(b.x_d_low), from(b.x_high), from(b.x_d_high),
          from(b.y_low), from(b.y_d_low), from(b.y_high), from(b.y_d_high)};
}
template <class From>
HWY_INLINE std::array<CornerLanes, 4> load_cells(const RooflineInput& in, From from) {
  std::array<CornerLanes, 4> out;
  for (std::size_t k = 0; k < 4; ++k) {
    const RooflineInput::Corner& c = in.corner[k];
    out[k] = {from(c.x), from(c.y), from(c.dx), from(c.dy), from(c.z), from(c.dz), from(c.z1)};
  }
  return out;
}

struct BoxTest {
  static constexpr std::size_t kMasks = 1;
  using Lanes = BoxLanes;
  template <class From>
  static HWY_INLINE Lanes load(const RooflineInput& in, From from) {
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

// Tests both triangles of a cell. kPerspective: corners move at the perspective-correct rate, which takes a division each.
template <bool kPerspective>
struct CellTest {
  static constexpr std::size_t kMasks = 2;
  using Lanes = std::array<CornerLanes, 4>;
  template <class From>
  static HWY_INLINE Lanes load(const RooflineInput& in, From from) {
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
void test_all(const RooflineInput& in, Arrangement arrangement, Masks& masks) {
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

void TestBoxes(const RooflineInput& in, Arrangement arrangement, Masks& masks) {
  test_all<BoxTest>(in, arrangement, masks);
}
void TestLinearCells(const RooflineInput& in, Arrangement arrangement, Masks& masks) {
  test_all<CellTest<false>>(in, arrangement, masks);
}
void TestPerspectiveCells(const RooflineInput& in, Arrangement arrangement, Masks& masks) {
  test_all<CellTest<true>>(in, arrangement, masks);
}
std::size_t LaneCount() { return hn::Lanes(D()); }

}  // namespace tessera::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::bench {

HWY_EXPORT(TestBoxes);
HWY_EXPORT(TestLinearCells);
HWY_EXPORT(TestPerspectiveCells);
HWY_EXPORT(LaneCount);

void test_all(RooflineTest test, const RooflineInput& in, Arrangement arrangement, Masks& masks) {
  if (test == RooflineTest::kBoxes)
    HWY_DYNAMIC_DISPATCH(TestBoxes)(in, arrangement, masks);
  else if (test == RooflineTest::kLinearTriangles)
    HWY_DYNAMIC_DISPATCH(TestLinearCells)(in, arrangement, masks);
  else
    HWY_DYNAMIC_DISPATCH(TestPerspectiveCells)(in, arrangement, masks);
}

std::size_t tests_in_pass(RooflineTest test) { return kPrimitives * kSamples * (test == RooflineTest::kBoxes ? 1 : 2); }

RooflineInput make_roofline_input() {
  std::mt19937 engine(1);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(engine() >> 8) * 0x1p-24f;
  };
  RooflineInput in;
  for (std::size_t s = 0; s < kSamples; ++s) in.x[s] = uniform(0, 8), in.y[s] = uniform(0, 8), in.t[s] = uniform(0, 1);
  for (std::size_t p = 0; p < kPrimitives; ++p) {
    const float x = uniform(-2, 8), y = uniform(-2, 8), dx = uniform(-4, 4), dy = uniform(-4, 4);
    in.box.x_low[p] = x, in.box.x_high[p] = x + 2;
    in.box.y_low[p] = y, in.box.y_high[p] = y + 2;
    in.box.x_d_low[p] = dx, in.box.x_d_high[p] = dx + 0.5f;
    in.box.y_d_low[p] = dy, in.box.y_d_high[p] = dy + 0.5f;
    for (std::size_t k = 0; k < 4; ++k) {
      RooflineInput::Corner& c = in.corner[k];
      c.x[p] = x + uniform(0, 1) + (k == 1 || k == 2 ? 2.0f : 0.0f);
      c.y[p] = y + uniform(0, 1) + (k >= 2 ? 2.0f : 0.0f);
      c.dx[p] = dx, c.dy[p] = dy;
      c.z[p] = uniform(3, 4), c.z1[p] = uniform(3, 4), c.dz[p] = c.z1[p] - c.z[p];
    }
  }
  return in;
}

// ---- The obvious scalar tests -----------------------------------------------------------------------------------

namespace {

bool in_box(const RooflineInput& in, std::size_t p, std::size_t s) {
  const RooflineInput::Box& b = in.box;
  const auto face = [&](std::span<const float> at, std::span<const float> d) { return std::fma(in.t[s], d[p], at[p]); };
  return in.x[s] >= face(b.x_low, b.x_d_low) && in.x[s] <= face(b.x_high, b.x_d_high) &&
         in.y[s] >= face(b.y_low, b.y_d_low) && in.y[s] <= face(b.y_high, b.y_d_high);
}

bool in_triangle(const RooflineInput& in, std::size_t p, std::size_t s, bool second, bool perspective) {
  struct Point {
    float x, y;
  };
  const auto corner = [&](std::size_t k) {
    const RooflineInput::Corner& c = in.corner[k];
    const float rate = perspective ? in.t[s] * c.z1[p] / std::fma(in.t[s], c.dz[p], c.z[p]) : in.t[s];
    return Point{std::fma(rate, c.dx[p], c.x[p] - in.x[s]), std::fma(rate, c.dy[p], c.y[p] - in.y[s])};
  };
  const auto negative = [](Point a, Point b) { return std::signbit(a.x * b.y - a.y * b.x); };
  const Point a = corner(0), b = corner(second ? 2 : 1), c = corner(second ? 3 : 2);
  const bool sign = negative(a, b);
  return negative(b, c) == sign && negative(c, a) == sign;
}

// Number of mask bits that differ from the scalar tests; `hits` counts the set bits of the scalar tests.
std::size_t wrong_bits(RooflineTest test, const RooflineInput& in, Arrangement arrangement, const Masks& masks,
                       std::size_t& hits) {
  const std::size_t lanes = HWY_DYNAMIC_DISPATCH(LaneCount)(), mask_bytes = (lanes + 7) / 8,
                    results = test == RooflineTest::kBoxes ? 1 : 2;
  std::size_t wrong = 0;
  for (std::size_t p = 0; p < kPrimitives; ++p)
    for (std::size_t s = 0; s < kSamples; ++s) {
      const std::size_t pair = arrangement == Arrangement::kOnePrimitive ? p * kSamples + s : s * kPrimitives + p;
      for (std::size_t r = 0; r < results; ++r) {
        const bool expected = test == RooflineTest::kBoxes
                                  ? in_box(in, p, s)
                                  : in_triangle(in, p, s, r == 1, test == RooflineTest::kPerspectiveTriangles);
        const std::size_t lane = pair % lanes, byte = (pair / lanes * results + r) * mask_bytes + lane / 8;
        wrong += (masks[byte] >> lane % 8 & 1) != (expected ? 1 : 0);
        hits += expected;
      }
    }
  return wrong;
}

}  // namespace

bool is_verified(RooflineTest test, const RooflineInput& in, Arrangement arrangement, const Masks& masks) {
  std::size_t hits = 0;
  return wrong_bits(test, in, arrangement, masks, hits) == 0 && hits != 0;
}

double roofline(RooflineTest test, double seconds) {
  const RooflineInput in = make_roofline_input();
  const std::size_t tests = tests_in_pass(test);
  Masks masks(tests);
  double best = 0;
  for (const Arrangement arrangement : {Arrangement::kOnePrimitive, Arrangement::kOneSample}) {
    test_all(test, in, arrangement, masks);
    if (!is_verified(test, in, arrangement, masks)) throw std::runtime_error("a mask differs from the scalar test");
    const double start = thread_seconds();
    double end = start;
    std::size_t passes = 0;
    for (; end < start + seconds; end = thread_seconds())
      for (int again = 0; again < 64; ++again, ++passes) test_all(test, in, arrangement, masks);
    best = std::max(best, static_cast<double>(passes * tests) / (end - start));
  }
  return best;
}

}  // namespace tessera::bench
#endif
