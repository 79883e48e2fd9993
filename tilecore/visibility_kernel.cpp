#include "tilecore/visibility_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace simd = tessera::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;
constexpr std::size_t kMaxLanes = hn::MaxLanes(D());

HWY_INLINE V fma(V a, V b, V c) { return simd::fused_multiply_add(D(), a, b, c); }

// One bit per lane, lane 0 the lowest.
HWY_INLINE std::uint32_t mask_bits(M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(D(), mask, bytes);
  return std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8;
}

// Calls body(lane) for every set lane, in order.
template <class Body>
HWY_INLINE void for_each_lane(M mask, const Body& body) {
  for (std::uint32_t bits = mask_bits(mask); bits != 0; bits &= bits - 1) body(static_cast<std::size_t>(std::countr_zero(bits)));
}

// The samples of the lanes.
struct SampleLanes {
  V x, y, t, lens_u, lens_v;
};

// A corner of the lanes' cells: Corner of cell_test.h, lane by lane, and where it is at shutter open.
struct CornerLanes {
  V x, y, scale, z, rest_x, rest_y;
};

struct VertexLanes {
  V x0, y0, z0, x1, y1, z1;  // key 1 unused without motion
};

template <bool kMotion, bool kLens, bool kOrthographic>
HWY_INLINE CornerLanes place_corner(const VertexLanes& v, const SampleLanes& s, V inverse_focus) {
  const D d;
  CornerLanes c;
  c.z = kMotion ? fma(s.t, hn::Sub(v.z1, v.z0), v.z0) : v.z0;
  c.scale = kOrthographic ? hn::Set(d, 1.0f) : hn::Div(hn::Set(d, 1.0f), c.z);
  c.x = hn::Sub(v.x0, s.x);
  c.y = hn::Sub(v.y0, s.y);
  if constexpr (kMotion) {
    const V lambda = kOrthographic ? s.t : hn::Mul(hn::Mul(s.t, v.z1), c.scale);
    c.x = fma(lambda, hn::Sub(v.x1, v.x0), c.x);
    c.y = fma(lambda, hn::Sub(v.y1, v.y0), c.y);
  }
  if constexpr (kLens) {
    const V coc = kOrthographic ? hn::Sub(hn::Set(d, 1.0f), hn::Mul(c.z, inverse_focus)) : hn::Sub(c.scale, inverse_focus);
    c.x = fma(hn::Neg(s.lens_u), coc, c.x);
    c.y = fma(hn::Neg(s.lens_v), coc, c.y);
  }
  c.rest_x = v.x0;
  c.rest_y = v.y0;
  return c;
}

HWY_INLINE V edge(const CornerLanes& a, const CornerLanes& b) { return hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x)); }

// The lanes' cells against the lanes' samples. `valid`: lanes in use; `second`: lanes whose cell has a triangle
// (a, c, d). `sample_of` and `triangle_of` map a lane to its numbers.
template <bool kOrthographic, class SampleOf, class TriangleOf>
HWY_INLINE void test_cells(const CornerLanes (&corner)[4], M valid, M second, const HitLimits& limits, const SampleOf& sample_of,
                           const TriangleOf& triangle_of, HitSink& sink, VisibilityWork& work) {
  const D d;
  const V zero = hn::Zero(d);
  const auto& [a, b, c, e] = corner;
  const V e_ab = edge(a, b), e_bc = edge(b, c), e_ca = edge(c, a), e_cd = edge(c, e), e_da = edge(e, a);
  const V e_ac = hn::Neg(e_ca);  // exactly what edge(a, c) gives

  // Lanes with an edge function of exactly zero are decided one by one.
  const M zero_first = hn::Or(hn::Or(hn::Eq(e_ab, zero), hn::Eq(e_bc, zero)), hn::Eq(e_ca, zero));
  const M zero_second = hn::And(second, hn::Or(hn::Eq(e_cd, zero), hn::Eq(e_da, zero)));
  const M slow = hn::And(valid, hn::Or(zero_first, zero_second));
  const M fast = hn::AndNot(slow, valid);

  const auto emit = [&](M inside, V e0, V e1, V e2, const CornerLanes& p, const CornerLanes& q, const CornerLanes& r, std::uint32_t offset) HWY_ATTR {
    const V b0 = hn::Mul(e0, p.scale), b1 = hn::Mul(e1, q.scale), b2 = hn::Mul(e2, r.scale);
    const V sum = hn::Add(hn::Add(b0, b1), b2);
    const V numerator = kOrthographic ? hn::Add(hn::Add(hn::Mul(b0, p.z), hn::Mul(b1, q.z)), hn::Mul(b2, r.z))
                                      : hn::Add(hn::Add(e0, e1), e2);
    const V z = hn::Div(numerator, sum);
    const M in_range = hn::And(hn::Ge(z, hn::Set(d, limits.near)), hn::Le(z, hn::Set(d, limits.far)));
    const M positive = hn::Gt(e0, zero);
    M facing = inside;
    if (!limits.keep_positive) facing = hn::AndNot(positive, facing);
    if (!limits.keep_negative) facing = hn::And(positive, facing);
    const M hit = hn::And(facing, in_range);
    if (hn::AllFalse(d, hit)) return;
    work.sample_hits += hn::CountTrue(d, hit);
    const V w1 = hn::Div(b1, sum), w2 = hn::Div(b2, sum), w0 = hn::Sub(hn::Sub(hn::Set(d, 1.0f), w1), w2);
    const V rest_x = hn::Add(hn::Add(hn::Mul(w0, p.rest_x), hn::Mul(w1, q.rest_x)), hn::Mul(w2, r.rest_x));
    const V rest_y = hn::Add(hn::Add(hn::Mul(w0, p.rest_y), hn::Mul(w1, q.rest_y)), hn::Mul(w2, r.rest_y));
    alignas(64) float lane_z[kMaxLanes], lane_b1[kMaxLanes], lane_b2[kMaxLanes], lane_x[kMaxLanes], lane_y[kMaxLanes];
    hn::Store(z, d, lane_z);
    hn::Store(w1, d, lane_b1);
    hn::Store(w2, d, lane_b2);
    hn::Store(rest_x, d, lane_x);
    hn::Store(rest_y, d, lane_y);
    for_each_lane(hit, [&](std::size_t lane) {
      sink.add({sample_of(lane), triangle_of(lane) + offset, lane_z[lane], lane_b1[lane], lane_b2[lane], lane_x[lane], lane_y[lane]});
    });
  };
  const auto one_sign = [&](V x, V y, V z) HWY_ATTR {
    const M all_positive = hn::And(hn::And(hn::Gt(x, zero), hn::Gt(y, zero)), hn::Gt(z, zero));
    const M all_negative = hn::And(hn::And(hn::Lt(x, zero), hn::Lt(y, zero)), hn::Lt(z, zero));
    return hn::Or(all_positive, all_negative);
  };
  const M first_inside = hn::And(fast, one_sign(e_ab, e_bc, e_ca));
  if (!hn::AllFalse(d, first_inside)) emit(first_inside, e_bc, e_ca, e_ab, a, b, c, 0);
  const M second_inside = hn::And(hn::And(fast, second), one_sign(e_ac, e_cd, e_da));
  if (!hn::AllFalse(d, second_inside)) emit(second_inside, e_cd, e_da, e_ac, a, c, e, 1);
  work.triangle_tests += hn::CountTrue(d, valid) + hn::CountTrue(d, hn::And(valid, second));
  if (hn::AllFalse(d, slow)) return;

  alignas(64) float store[4][6][kMaxLanes];
  for (std::size_t k = 0; k < 4; ++k) {
    hn::Store(corner[k].x, d, store[k][0]);
    hn::Store(corner[k].y, d, store[k][1]);
    hn::Store(corner[k].scale, d, store[k][2]);
    hn::Store(corner[k].z, d, store[k][3]);
    hn::Store(corner[k].rest_x, d, store[k][4]);
    hn::Store(corner[k].rest_y, d, store[k][5]);
  }
  const std::uint32_t second_bits = mask_bits(second);
  for_each_lane(slow, [&](std::size_t lane) {
    Corner corners[4];
    for (std::size_t k = 0; k < 4; ++k) corners[k] = {store[k][0][lane], store[k][1][lane], store[k][2][lane], store[k][3][lane]};
    const auto test = [&](std::size_t i, std::size_t j, std::size_t k, std::uint32_t offset) {
      TriangleHit hit;
      if (!exact_triangle_test(corners[i], corners[j], corners[k], kOrthographic, hit)) return;
      if (!(hit.z >= limits.near && hit.z <= limits.far) || !(hit.positive ? limits.keep_positive : limits.keep_negative)) return;
      ++work.sample_hits;
      const float w0 = (1.0f - hit.b1) - hit.b2;
      const auto rest = [&](std::size_t axis) {
        return (w0 * store[i][axis][lane] + hit.b1 * store[j][axis][lane]) + hit.b2 * store[k][axis][lane];
      };
      sink.add({sample_of(lane), triangle_of(lane) + offset, hit.z, hit.b1, hit.b2, rest(4), rest(5)});
    };
    test(0, 1, 2, 0);
    if (second_bits >> lane & 1) test(0, 2, 3, 1);
  });
}

// ---- Raster path ------------------------------------------------------------------------------------------------

template <bool kOrthographic>
void raster_cell(const MicroMesh& mesh, std::size_t cell, const TileSamples& samples, const VisibilitySettings& settings, IntRect box,
                 HitSink& sink, VisibilityWork& work) {
  const D d;
  VertexLanes vertex[4];
  for (std::size_t k = 0; k < 4; ++k) {
    const auto v = static_cast<std::size_t>(mesh.corner[k][cell]);
    vertex[k].x0 = hn::Set(d, mesh.x0[v]);
    vertex[k].y0 = hn::Set(d, mesh.y0[v]);
    vertex[k].z0 = hn::Set(d, mesh.z0[v]);
    vertex[k].x1 = vertex[k].y1 = vertex[k].z1 = hn::Zero(d);
  }
  const bool has_second = mesh.corner[2][cell] != mesh.corner[3][cell];
  const int width = samples.pixels.width();
  for (int y = box.y0; y < box.y1; ++y) {
    const auto row = static_cast<std::size_t>((y - samples.pixels.y0) * width);
    const std::size_t first = (row + static_cast<std::size_t>(box.x0 - samples.pixels.x0)) * static_cast<std::size_t>(samples.spp);
    const std::size_t last = (row + static_cast<std::size_t>(box.x1 - samples.pixels.x0)) * static_cast<std::size_t>(samples.spp);
    for (std::size_t i = first; i < last; i += hn::Lanes(d)) {
      const M valid = hn::FirstN(d, last - i);
      SampleLanes s;
      s.x = hn::LoadU(d, samples.x.data() + i);
      s.y = hn::LoadU(d, samples.y.data() + i);
      s.t = s.lens_u = s.lens_v = hn::Zero(d);
      CornerLanes corner[4];
      for (std::size_t k = 0; k < 4; ++k) corner[k] = place_corner<false, false, kOrthographic>(vertex[k], s, hn::Zero(d));
      const M second = has_second ? valid : hn::MaskFromVec(hn::Zero(d));
      test_cells<kOrthographic>(
          corner, valid, second, settings.limits, [&](std::size_t lane) { return static_cast<std::uint32_t>(i + lane); },
          [&](std::size_t) { return mesh.triangle[cell]; }, sink, work);
    }
  }
}

// Pixels of the tile that a static box touches.
HWY_INLINE IntRect pixels_of(float x_low, float x_high, float y_low, float y_high, const IntRect& tile) {
  const auto first = [](float low, int begin, int end) { return low > static_cast<float>(begin) ? (low < static_cast<float>(end) ? static_cast<int>(low) : end) : begin; };
  const auto last = [](float high, int begin, int end) { return high >= static_cast<float>(begin) ? (high < static_cast<float>(end) ? static_cast<int>(high) + 1 : end) : begin; };
  return {first(x_low, tile.x0, tile.x1), first(y_low, tile.y0, tile.y1), last(x_high, tile.x0, tile.x1), last(y_high, tile.y0, tile.y1)};
}

void RasterMesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const MicroMesh::Leaf& leaf = mesh.leaves[l];
    ++work.box_tests;
    if (pixels_of(leaf.x_low, leaf.x_high, leaf.y_low, leaf.y_high, samples.pixels).empty()) continue;
    for (std::size_t c = l * kLeafCells; c < l * kLeafCells + leaf.cell_count; ++c) {
      ++work.box_tests;
      const IntRect box = pixels_of(mesh.box_x_low[c], mesh.box_x_high[c], mesh.box_y_low[c], mesh.box_y_high[c], samples.pixels);
      if (box.empty()) continue;
      if (settings.orthographic) raster_cell<true>(mesh, c, samples, settings, box, sink, work);
      else raster_cell<false>(mesh, c, samples, settings, box, sink, work);
    }
  }
}

// ---- Ray path ---------------------------------------------------------------------------------------------------

constexpr std::size_t kPacket = 16;

// Pairs of a sample (slot of the time order) and a cell, waiting for their triangle tests.
struct Pairs {
  static constexpr std::size_t kCapacity = 256;
  std::size_t count = 0;
  alignas(64) std::int32_t sample[kCapacity + kMaxLanes];
  alignas(64) std::int32_t cell[kCapacity + kMaxLanes];
};

template <bool kMotion, bool kLens, bool kOrthographic>
void test_pairs(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, Pairs& pairs, HitSink& sink,
                VisibilityWork& work) {
  const D d;
  const hn::RebindToSigned<D> di;
  // Lanes past the end repeat the last pair; they are masked.
  for (std::size_t k = pairs.count; k < pairs.count + hn::Lanes(d); ++k) {
    pairs.sample[k] = pairs.sample[pairs.count - 1];
    pairs.cell[k] = pairs.cell[pairs.count - 1];
  }
  for (std::size_t i = 0; i < pairs.count; i += hn::Lanes(d)) {
    const auto slot = hn::LoadU(di, pairs.sample + i), cell = hn::LoadU(di, pairs.cell + i);
    SampleLanes s;
    s.x = hn::GatherIndex(d, samples.sorted_x.data(), slot);
    s.y = hn::GatherIndex(d, samples.sorted_y.data(), slot);
    s.t = kMotion ? hn::GatherIndex(d, samples.sorted_t.data(), slot) : hn::Zero(d);
    s.lens_u = kLens ? hn::GatherIndex(d, samples.sorted_lens_u.data(), slot) : hn::Zero(d);
    s.lens_v = kLens ? hn::GatherIndex(d, samples.sorted_lens_v.data(), slot) : hn::Zero(d);
    CornerLanes corner[4];
    hn::Vec<decltype(di)> number[4];
    for (std::size_t k = 0; k < 4; ++k) {
      number[k] = hn::GatherIndex(di, mesh.corner[k].data(), cell);
      VertexLanes v;
      v.x0 = hn::GatherIndex(d, mesh.x0.data(), number[k]);
      v.y0 = hn::GatherIndex(d, mesh.y0.data(), number[k]);
      v.z0 = hn::GatherIndex(d, mesh.z0.data(), number[k]);
      v.x1 = kMotion ? hn::GatherIndex(d, mesh.x1.data(), number[k]) : hn::Zero(d);
      v.y1 = kMotion ? hn::GatherIndex(d, mesh.y1.data(), number[k]) : hn::Zero(d);
      v.z1 = kMotion ? hn::GatherIndex(d, mesh.z1.data(), number[k]) : hn::Zero(d);
      corner[k] = place_corner<kMotion, kLens, kOrthographic>(v, s, hn::Set(d, settings.inverse_focus));
    }
    const M valid = hn::FirstN(d, pairs.count - i);
    const M second = hn::And(valid, hn::RebindMask(d, hn::Ne(number[2], number[3])));
    test_cells<kOrthographic>(
        corner, valid, second, settings.limits,
        [&](std::size_t lane) { return samples.natural[static_cast<std::size_t>(pairs.sample[i + lane])]; },
        [&](std::size_t lane) { return mesh.triangle[static_cast<std::size_t>(pairs.cell[i + lane])]; }, sink, work);
  }
  pairs.count = 0;
}

// Rate-corrected time of the lanes (see MicroMesh): tau = t r / ((1-t) + t r).
HWY_INLINE V leaf_time(V t, float rate) {
  const D d;
  const V tr = hn::Mul(t, hn::Set(d, rate));
  return hn::Div(tr, hn::Add(hn::Sub(hn::Set(d, 1.0f), t), tr));
}

// Interval of positions that a sample at `at` with lens coordinate `lens` may meet over the leaf's lens factors.
struct Reach {
  V low, high;
};
template <bool kLens>
HWY_INLINE Reach lens_reach(V at, V lens, const MicroMesh::Leaf& leaf) {
  const D d;
  if constexpr (!kLens) return {at, at};
  const V a = hn::Mul(lens, hn::Set(d, leaf.coc_low)), b = hn::Mul(lens, hn::Set(d, leaf.coc_high));
  return {hn::Add(at, hn::Min(a, b)), hn::Add(at, hn::Max(a, b))};
}

template <bool kMotion, bool kLens, bool kOrthographic>
void trace(const MicroMesh& mesh, std::size_t l, const TileSamples& samples, std::span<const SampleRange> ranges,
           const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  const D d;
  const MicroMesh::Leaf& leaf = mesh.leaves[l];
  const std::size_t first_cell = l * kLeafCells;
  const auto face = [&](V tau, V low, V d_low) HWY_ATTR { return kMotion ? fma(tau, d_low, low) : low; };
  const hn::RebindToSigned<D> di;
  Pairs pairs;
  alignas(64) float tau[kPacket], reach[4][kPacket];
  for (const SampleRange& range : ranges) {
    for (std::size_t packet = range.first; packet < range.last; packet += kPacket) {
      const std::size_t count = std::min<std::size_t>(kPacket, range.last - packet);
      const std::size_t slot = range.block->first + packet;
      work.box_tests += count;
      // The packet against the leaf's box.
      std::uint32_t alive = 0;
      for (std::size_t k = 0; k < kPacket; k += hn::Lanes(d)) {
        // Slots past the range hold other samples of the block or padding; they are masked.
        if (k >= count) break;
        const V time = kMotion ? leaf_time(hn::LoadU(d, samples.sorted_t.data() + slot + k), leaf.rate) : hn::Zero(d);
        const V lens_u = kLens ? hn::LoadU(d, samples.sorted_lens_u.data() + slot + k) : hn::Zero(d);
        const V lens_v = kLens ? hn::LoadU(d, samples.sorted_lens_v.data() + slot + k) : hn::Zero(d);
        const Reach x = lens_reach<kLens>(hn::LoadU(d, samples.sorted_x.data() + slot + k), lens_u, leaf);
        const Reach y = lens_reach<kLens>(hn::LoadU(d, samples.sorted_y.data() + slot + k), lens_v, leaf);
        hn::Store(time, d, tau + k);
        hn::Store(x.low, d, reach[0] + k);
        hn::Store(x.high, d, reach[1] + k);
        hn::Store(y.low, d, reach[2] + k);
        hn::Store(y.high, d, reach[3] + k);
        const M in_x = hn::And(hn::Ge(x.high, face(time, hn::Set(d, leaf.x_low), hn::Set(d, leaf.x_d_low))),
                               hn::Le(x.low, face(time, hn::Set(d, leaf.x_high), hn::Set(d, leaf.x_d_high))));
        const M in_y = hn::And(hn::Ge(y.high, face(time, hn::Set(d, leaf.y_low), hn::Set(d, leaf.y_d_low))),
                               hn::Le(y.low, face(time, hn::Set(d, leaf.y_high), hn::Set(d, leaf.y_d_high))));
        const M inside = hn::And(hn::And(in_x, in_y), hn::FirstN(d, count - k));
        alive |= mask_bits(inside) << k;
      }
      // Each sample that is left against all cells of the leaf.
      for (; alive != 0; alive &= alive - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(alive));
        work.box_tests += leaf.cell_count;
        const V time = hn::Set(d, tau[k]);
        const V x_low = hn::Set(d, reach[0][k]), x_high = hn::Set(d, reach[1][k]);
        const V y_low = hn::Set(d, reach[2][k]), y_high = hn::Set(d, reach[3][k]);
        for (std::size_t c = 0; c < leaf.cell_count; c += hn::Lanes(d)) {
          const std::size_t cell = first_cell + c;
          const auto load = [&](const std::vector<float>& v) HWY_ATTR { return hn::LoadU(d, v.data() + cell); };
          const M in_x = hn::And(hn::Ge(x_high, face(time, load(mesh.box_x_low), load(mesh.box_x_d_low))),
                                 hn::Le(x_low, face(time, load(mesh.box_x_high), load(mesh.box_x_d_high))));
          const M in_y = hn::And(hn::Ge(y_high, face(time, load(mesh.box_y_low), load(mesh.box_y_d_low))),
                                 hn::Le(y_low, face(time, load(mesh.box_y_high), load(mesh.box_y_d_high))));
          hn::StoreU(hn::Set(di, static_cast<std::int32_t>(slot + k)), di, pairs.sample + pairs.count);
          pairs.count += hn::CompressStore(hn::Iota(di, static_cast<std::int32_t>(cell)), hn::RebindMask(di, hn::And(in_x, in_y)), di, pairs.cell + pairs.count);
        }
        if (pairs.count + kLeafCells > Pairs::kCapacity)
          test_pairs<kMotion, kLens, kOrthographic>(mesh, samples, settings, pairs, sink, work);
      }
    }
  }
  if (pairs.count > 0) test_pairs<kMotion, kLens, kOrthographic>(mesh, samples, settings, pairs, sink, work);
}

void TraceLeaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, std::span<const SampleRange> ranges, RayEffects effects,
               const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  const auto run = [&](auto motion, auto lens) {
    if (settings.orthographic) trace<motion(), lens(), true>(mesh, leaf, samples, ranges, settings, sink, work);
    else trace<motion(), lens(), false>(mesh, leaf, samples, ranges, settings, sink, work);
  };
  if (effects.motion && effects.lens) run(std::true_type(), std::true_type());
  else if (effects.motion) run(std::true_type(), std::false_type());
  else if (effects.lens) run(std::false_type(), std::true_type());
  else run(std::false_type(), std::false_type());
}

// ---- One cell, chosen samples -----------------------------------------------------------------------------------

template <bool kMotion, bool kLens, bool kOrthographic>
void cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> chosen, const TileSamples& samples, const VisibilitySettings& settings,
                  HitSink& sink, VisibilityWork& work) {
  const D d;
  VertexLanes vertex[4];
  for (std::size_t k = 0; k < 4; ++k) {
    const auto v = static_cast<std::size_t>(mesh.corner[k][cell]);
    vertex[k].x0 = hn::Set(d, mesh.x0[v]);
    vertex[k].y0 = hn::Set(d, mesh.y0[v]);
    vertex[k].z0 = hn::Set(d, mesh.z0[v]);
    vertex[k].x1 = hn::Set(d, kMotion ? mesh.x1[v] : 0.0f);
    vertex[k].y1 = hn::Set(d, kMotion ? mesh.y1[v] : 0.0f);
    vertex[k].z1 = hn::Set(d, kMotion ? mesh.z1[v] : 0.0f);
  }
  const bool has_second = mesh.corner[2][cell] != mesh.corner[3][cell];
  alignas(64) float lane[5][kMaxLanes] = {};
  for (std::size_t i = 0; i < chosen.size(); i += hn::Lanes(d)) {
    const std::size_t count = std::min(hn::Lanes(d), chosen.size() - i);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t s = chosen[i + k];
      lane[0][k] = samples.x[s];
      lane[1][k] = samples.y[s];
      if constexpr (kMotion) lane[2][k] = static_cast<float>(samples.time[s]) * 0x1p-8f;
      if constexpr (kLens) lane[3][k] = samples.lens_u[s], lane[4][k] = samples.lens_v[s];
    }
    const SampleLanes s{hn::Load(d, lane[0]), hn::Load(d, lane[1]), hn::Load(d, lane[2]), hn::Load(d, lane[3]), hn::Load(d, lane[4])};
    CornerLanes corner[4];
    for (std::size_t k = 0; k < 4; ++k) corner[k] = place_corner<kMotion, kLens, kOrthographic>(vertex[k], s, hn::Set(d, settings.inverse_focus));
    const M valid = hn::FirstN(d, count);
    test_cells<kOrthographic>(
        corner, valid, has_second ? valid : hn::MaskFromVec(hn::Zero(d)), settings.limits, [&](std::size_t k) { return chosen[i + k]; },
        [&](std::size_t) { return mesh.triangle[cell]; }, sink, work);
  }
}

void TestCellSamples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> chosen, const TileSamples& samples, RayEffects effects,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  const auto run = [&](auto motion, auto lens) {
    if (settings.orthographic) cell_samples<motion(), lens(), true>(mesh, cell, chosen, samples, settings, sink, work);
    else cell_samples<motion(), lens(), false>(mesh, cell, chosen, samples, settings, sink, work);
  };
  if (effects.motion && effects.lens) run(std::true_type(), std::true_type());
  else if (effects.motion) run(std::true_type(), std::false_type());
  else if (effects.lens) run(std::false_type(), std::true_type());
  else run(std::false_type(), std::false_type());
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(RasterMesh);
HWY_EXPORT(TraceLeaf);
HWY_EXPORT(TestCellSamples);

void raster_mesh(const MicroMesh& mesh, const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  HWY_DYNAMIC_DISPATCH(RasterMesh)(mesh, samples, settings, sink, work);
}
void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, std::span<const SampleRange> ranges, RayEffects effects,
                const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  HWY_DYNAMIC_DISPATCH(TraceLeaf)(mesh, leaf, samples, ranges, effects, settings, sink, work);
}
void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> samples, const TileSamples& tile, RayEffects effects,
                       const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  HWY_DYNAMIC_DISPATCH(TestCellSamples)(mesh, cell, samples, tile, effects, settings, sink, work);
}

}  // namespace tessera::tilecore
#endif
