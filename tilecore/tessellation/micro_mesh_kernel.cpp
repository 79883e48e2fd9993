#include "tilecore/tessellation/micro_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/tessellation/micro_mesh_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// A vector holds at most the cells of a leaf.
using D = hn::CappedTag<float, kLeafCells>;
constexpr std::size_t kVectors = kLeafCells / hn::MaxLanes(D());
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

HWY_INLINE std::uint32_t mask_bits(M mask) { return tessera::HWY_NAMESPACE::mask_bits(D(), mask); }

HWY_INLINE M lanes_of(std::uint32_t bits) {
  const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8)};
  return hn::LoadMaskBits(D(), bytes);
}

// Corners of a vector of cells.
struct Corners {
  V x0[4], y0[4], z0[4], x1[4], y1[4], z1[4];
  M projected[4];
};

template <bool kMoving>
HWY_INLINE Corners load_corners(const MicroMesh& m, std::size_t slot) {
  const D d;
  const DI di;
  Corners c;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto number = hn::LoadU(di, m.corner[k].data() + slot);
    c.x0[k] = hn::GatherIndex(d, m.x0.data(), number);
    c.y0[k] = hn::GatherIndex(d, m.y0.data(), number);
    c.z0[k] = hn::GatherIndex(d, m.z0.data(), number);
    c.x1[k] = kMoving ? hn::GatherIndex(d, m.x1.data(), number) : c.x0[k];
    c.y1[k] = kMoving ? hn::GatherIndex(d, m.y1.data(), number) : c.y0[k];
    c.z1[k] = kMoving ? hn::GatherIndex(d, m.z1.data(), number) : c.z0[k];
    c.projected[k] = hn::MaskFromVec(hn::Zero(d));
  }
  if (m.all_projected) {
    for (std::size_t k = 0; k < 4; ++k) c.projected[k] = hn::Eq(hn::Zero(d), hn::Zero(d));
    return c;
  }
  alignas(64) float flag[kLeafCells];
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < hn::Lanes(d); ++i)
      flag[i] = m.projected[static_cast<std::size_t>(m.corner[k][slot + i])];
    c.projected[k] = hn::Gt(hn::Load(d, flag), hn::Zero(d));
  }
  return c;
}

// Mask of the cells whose corners i and j coincide.
HWY_INLINE M same_place(const Corners& c, std::size_t i, std::size_t j) {
  const M open = hn::And(hn::And(hn::Eq(c.x0[i], c.x0[j]), hn::Eq(c.y0[i], c.y0[j])), hn::Eq(c.z0[i], c.z0[j]));
  const M close = hn::And(hn::And(hn::Eq(c.x1[i], c.x1[j]), hn::Eq(c.y1[i], c.y1[j])), hn::Eq(c.z1[i], c.z1[j]));
  return hn::AndNot(hn::Xor(c.projected[i], c.projected[j]), hn::And(open, close));
}

// Reduces the cells of a leaf to their triangles that are not degenerate. Returns the slots with triangles.
std::uint32_t reduce_cells(MicroMesh& m, const Corners (&corners)[kVectors], std::size_t first,
                           std::uint32_t cell_count, std::uint32_t& clipped) {
  const D d;
  const DI di;
  std::uint32_t first_bits = 0, second_bits = 0;
  clipped = 0;
  for (std::size_t k = 0; k < kLeafCells; k += hn::Lanes(d)) {
    if (k >= cell_count) break;
    const Corners& c = corners[k / hn::Lanes(d)];
    const M ac = same_place(c, 0, 2);
    const M one = hn::RebindMask(
        d, hn::Eq(hn::LoadU(di, m.corner[2].data() + first + k), hn::LoadU(di, m.corner[3].data() + first + k)));
    const M bad_first = hn::Or(hn::Or(same_place(c, 0, 1), same_place(c, 1, 2)), ac);
    const M bad_second = hn::Or(hn::Or(one, ac), hn::Or(same_place(c, 2, 3), same_place(c, 0, 3)));
    const M in_front = hn::And(hn::And(c.projected[0], c.projected[1]), hn::And(c.projected[2], c.projected[3]));
    first_bits |= mask_bits(hn::Not(bad_first)) << k;
    second_bits |= mask_bits(hn::Not(bad_second)) << k;
    clipped |= mask_bits(hn::Not(in_front)) << k;
  }
  const std::uint32_t in_use = (1u << cell_count) - 1;
  first_bits &= in_use;
  second_bits &= in_use;
  const std::uint32_t any = first_bits | second_bits;
  clipped &= any;
  m.triangle_count += static_cast<std::uint64_t>(std::popcount(first_bits) + std::popcount(second_bits));
  // Cells that lose one of two triangles are rare. If the remaining corners move up, the cell has left the grid.
  if (first_bits != second_bits) m.leaves[first / kLeafCells].grid = {};
  for (std::uint32_t bits = first_bits ^ second_bits; bits != 0; bits &= bits - 1) {
    const std::size_t slot = first + static_cast<std::size_t>(std::countr_zero(bits));
    if (first_bits >> (slot - first) & 1) {
      m.corner[3][slot] = m.corner[2][slot];
    } else {
      m.corner[1][slot] = m.corner[2][slot];
      m.corner[2][slot] = m.corner[3][slot];
      ++m.triangle[slot];
    }
  }
  for (std::size_t k = 0; k < kLeafCells; ++k) m.used[first + k] = any >> k & 1;
  return any;
}

HWY_INLINE float lowest(V v) { return hn::GetLane(hn::MinOfLanes(D(), v)); }
HWY_INLINE float highest(V v) { return hn::GetLane(hn::MaxOfLanes(D(), v)); }

// Ranges over the corners of a leaf's projected cells. They are minima and maxima only, so the order does not matter.
struct LeafRange {
  float low_x0, high_x0, low_y0, high_y0, low_x1, high_x1, low_y1, high_y1, low_z, high_z, low_rate, high_rate, travel;
  bool flat;
};

template <bool kMoving>
LeafRange leaf_range(const Corners (&corners)[kVectors], std::uint32_t cells, bool orthographic) {
  const D d;
  const float infinity = std::numeric_limits<float>::infinity();
  V low_x0 = hn::Set(d, infinity), low_y0 = low_x0, low_x1 = low_x0, low_y1 = low_x0, low_z = low_x0, low_rate = low_x0;
  V high_x0 = hn::Neg(low_x0), high_y0 = high_x0, high_x1 = high_x0, high_y1 = high_x0, high_z = high_x0,
    high_rate = hn::Zero(d), travel = hn::Zero(d);
  M same_depth = hn::Eq(hn::Zero(d), hn::Zero(d));
  for (std::size_t k = 0; k < kLeafCells; k += hn::Lanes(d)) {
    const std::uint32_t bits = cells >> k & ((1u << hn::Lanes(d)) - 1);
    if (bits == 0) continue;
    const M in = lanes_of(bits);
    const Corners& c = corners[k / hn::Lanes(d)];
    const auto least = [&](V& to, V v) HWY_ATTR { to = hn::IfThenElse(in, hn::Min(to, v), to); };
    const auto most = [&](V& to, V v) HWY_ATTR { to = hn::IfThenElse(in, hn::Max(to, v), to); };
    for (std::size_t j = 0; j < 4; ++j) {
      least(low_x0, c.x0[j]), most(high_x0, c.x0[j]), least(low_y0, c.y0[j]), most(high_y0, c.y0[j]);
      least(low_z, c.z0[j]), most(high_z, c.z0[j]);
      if (!kMoving) continue;
      least(low_x1, c.x1[j]), most(high_x1, c.x1[j]), least(low_y1, c.y1[j]), most(high_y1, c.y1[j]);
      least(low_z, c.z1[j]), most(high_z, c.z1[j]);
      most(travel, hn::Max(hn::Abs(hn::Sub(c.x1[j], c.x0[j])), hn::Abs(hn::Sub(c.y1[j], c.y0[j]))));
      same_depth = hn::And(same_depth, hn::Or(hn::Not(in), hn::Eq(c.z0[j], c.z1[j])));
      if (orthographic) continue;
      const V rate = hn::Div(c.z1[j], c.z0[j]);
      least(low_rate, rate), most(high_rate, rate);
    }
  }
  LeafRange r{lowest(low_x0),  highest(high_x0),          lowest(low_y0),   highest(high_y0),
              lowest(low_x1),  highest(high_x1),          lowest(low_y1),   highest(high_y1),
              lowest(low_z),   highest(high_z),           lowest(low_rate), highest(high_rate),
              highest(travel), hn::AllTrue(d, same_depth)};
  if (!kMoving || orthographic) r.low_rate = r.high_rate = 1.0f;
  if (!kMoving) r.low_x1 = r.low_x0, r.high_x1 = r.high_x0, r.low_y1 = r.low_y0, r.high_y1 = r.high_y0;
  return r;
}

// Width by which boxes are padded.
float leaf_pad(const LeafRange& r, const BoxSettings& settings, MicroMesh::Leaf& leaf) {
  // Static boxes seen through a pinhole are exact.
  leaf.rate = 1.0f;
  leaf.drift_x = leaf.drift_y = leaf.lens_factor = 0.0f;
  if (!settings.moving && !settings.lens) return 0.0f;
  leaf.rate = std::sqrt(r.low_rate * r.high_rate);
  if (!(leaf.rate > 0 && leaf.rate < std::numeric_limits<float>::infinity())) leaf.rate = 1.0f;
  leaf.drift_x = 0.5f * ((r.low_x1 - r.low_x0) + (r.high_x1 - r.high_x0));
  leaf.drift_y = 0.5f * ((r.low_y1 - r.low_y0) + (r.high_y1 - r.high_y0));
  // A vertex is at x0 + lambda (x1 - x0). In the rest frame that is x0 + lambda (x1 - drift - x0), between the rest
  // positions of the two motion keys, and (lambda - tau) drift besides. lambda is a logistic function of logit(t) + ln r: two
  // rates r and r' are at most tanh(|ln r'/r| / 4) apart, that is (s - 1) / (s + 1) with s the square root of their
  // ratio.
  const float ratio = std::sqrt(std::max(r.high_rate / leaf.rate, leaf.rate / r.low_rate));
  const float spread = (ratio - 1.0f) / (ratio + 1.0f) + 0x1p-20f;
  const float drift = std::max(std::abs(leaf.drift_x), std::abs(leaf.drift_y));
  float lens = 0.0f;
  if (settings.lens) {
    const auto factor = [&](float z) {
      return settings.orthographic ? 1.0f - z * settings.inverse_focus : 1.0f / z - settings.inverse_focus;
    };
    float a = factor(r.high_z), b = factor(r.low_z);
    // Vertices in focus have a factor of zero.
    if (a <= 2 * settings.sharp_factor && b >= -2 * settings.sharp_factor) a = std::min(a, 0.0f), b = std::max(b, 0.0f);
    leaf.lens_factor = 0.5f * (a + b);
    // Factors are differences that may cancel: 2^-20 of their operands is 16 roundings.
    const float size = settings.orthographic
                           ? 1.0f + std::max(std::abs(r.low_z), std::abs(r.high_z)) * settings.inverse_focus
                           : std::abs(1.0f / r.low_z) + std::abs(1.0f / r.high_z) + settings.inverse_focus;
    lens = settings.lens_scale * (0.5f * std::abs(a - b) + 0x1p-20f * size);
  }
  // Vertices, samples and boxes each round a handful of times at the size of the coordinates: 16 u.
  const float extent = std::max({std::abs(r.low_x0), std::abs(r.high_x0), std::abs(r.low_y0), std::abs(r.high_y0)});
  return spread * drift + lens +
         (extent + 2 * (r.travel + drift) + settings.lens_scale * std::abs(leaf.lens_factor)) * 0x1p-20f;
}

template <bool kMoving>
void box_leaf(MicroMesh& m, const Corners (&corners)[kVectors], std::size_t first, const BoxSettings& settings,
              MicroMesh::Leaf& leaf) {
  const D d;
  const float infinity = std::numeric_limits<float>::infinity();
  leaf.x_low = leaf.y_low = infinity;
  leaf.x_high = leaf.y_high = -infinity;
  const LeafRange range = leaf_range<kMoving>(corners, leaf.cells, settings.orthographic);
  leaf.flat = range.flat;
  leaf.near = range.low_z - std::abs(range.low_z) * 0x1p-20f;
  const V pad = hn::Set(d, leaf_pad(range, settings, leaf)), drift_x = hn::Set(d, leaf.drift_x),
          drift_y = hn::Set(d, leaf.drift_y);
  const V empty_low = hn::Set(d, infinity), empty_high = hn::Neg(empty_low);
  for (std::size_t k = 0; k < kLeafCells; k += hn::Lanes(d)) {
    const M in = lanes_of(leaf.cells >> k & ((1u << hn::Lanes(d)) - 1));
    const Corners& c = corners[k / hn::Lanes(d)];
    V low_x = c.x0[0], high_x = c.x0[0], low_y = c.y0[0], high_y = c.y0[0];
    for (std::size_t j = 1; j < 4; ++j) {
      low_x = hn::Min(low_x, c.x0[j]), high_x = hn::Max(high_x, c.x0[j]);
      low_y = hn::Min(low_y, c.y0[j]), high_y = hn::Max(high_y, c.y0[j]);
    }
    for (std::size_t j = 0; j < 4 && kMoving; ++j) {
      const V x = hn::Sub(c.x1[j], drift_x), y = hn::Sub(c.y1[j], drift_y);
      low_x = hn::Min(low_x, x), high_x = hn::Max(high_x, x);
      low_y = hn::Min(low_y, y), high_y = hn::Max(high_y, y);
    }
    low_x = hn::IfThenElse(in, hn::Sub(low_x, pad), empty_low);
    low_y = hn::IfThenElse(in, hn::Sub(low_y, pad), empty_low);
    high_x = hn::IfThenElse(in, hn::Add(high_x, pad), empty_high);
    high_y = hn::IfThenElse(in, hn::Add(high_y, pad), empty_high);
    hn::StoreU(low_x, d, m.box_x_low.data() + first + k);
    hn::StoreU(high_x, d, m.box_x_high.data() + first + k);
    hn::StoreU(low_y, d, m.box_y_low.data() + first + k);
    hn::StoreU(high_y, d, m.box_y_high.data() + first + k);
    leaf.x_low = std::min(leaf.x_low, lowest(low_x)), leaf.x_high = std::max(leaf.x_high, highest(high_x));
    leaf.y_low = std::min(leaf.y_low, lowest(low_y)), leaf.y_high = std::max(leaf.y_high, highest(high_y));
  }
}

template <bool kMoving>
void build(MicroMesh& m, const BoxSettings& settings) {
  const std::size_t slots = m.leaves.size() * kLeafCells;
  for (auto* v : {&m.box_x_low, &m.box_x_high, &m.box_y_low, &m.box_y_high}) v->resize(slots);
  m.used.resize(slots);
  m.clipped_cells.clear();
  m.triangle_count = 0;
  for (std::size_t l = 0; l < m.leaves.size(); ++l) {
    MicroMesh::Leaf& leaf = m.leaves[l];
    const std::size_t first = l * kLeafCells;
    Corners corners[kVectors];
    for (std::size_t k = 0; k < kVectors; ++k) corners[k] = load_corners<kMoving>(m, first + k * hn::Lanes(D()));
    std::uint32_t clipped = 0;
    leaf.cells = reduce_cells(m, corners, first, leaf.cell_count, clipped);
    for (std::uint32_t bits = clipped; bits != 0; bits &= bits - 1)
      m.clipped_cells.push_back(static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(std::countr_zero(bits)));
    leaf.cells &= ~clipped;
    box_leaf<kMoving>(m, corners, first, settings, leaf);
  }
}

void BuildCells(MicroMesh& m, const BoxSettings& settings) {
  if (settings.moving)
    build<true>(m, settings);
  else
    build<false>(m, settings);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(BuildCells);

void build_cells(MicroMesh& mesh, const BoxSettings& settings) { HWY_DYNAMIC_DISPATCH(BuildCells)(mesh, settings); }

}  // namespace tessera::tilecore
#endif
