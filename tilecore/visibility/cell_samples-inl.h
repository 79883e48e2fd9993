// Samples against the cells of a leaf: SIMD source that all kernels of visibility share. Their files include it once
// per SIMD target.

#include <algorithm>
#include <bit>
#include <type_traits>
#include <vector>

#include "tilecore/visibility/sample_tests.h"

#if defined(TESSERA_TILECORE_VISIBILITY_KERNEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_TILECORE_VISIBILITY_KERNEL_INL_H_
#undef TESSERA_TILECORE_VISIBILITY_KERNEL_INL_H_
#else
#define TESSERA_TILECORE_VISIBILITY_KERNEL_INL_H_
#endif

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace simd = tessera::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;
constexpr std::size_t kMaxLanes = hn::MaxLanes(D());

HWY_INLINE V fma(V a, V b, V c) { return simd::fused_multiply_add(D(), a, b, c); }

// first, first + 1, ...; Highway 1.0's Iota takes its lanes from memory, where it has just written them one by one.
HWY_INLINE VI numbers_from(std::size_t first) {
  alignas(64) static constexpr std::int32_t kLanes[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return hn::Add(hn::Load(DI(), kLanes), hn::Set(DI(), static_cast<std::int32_t>(first)));
}

// One bit per lane, lane 0 the lowest.
template <class Mask>
HWY_INLINE std::uint32_t mask_bits(Mask mask) {
  return simd::mask_bits(hn::CappedTag<float, 16>(), mask);
}

#if HWY_TARGET == HWY_AVX2
// For each mask of eight lanes: the numbers of the set lanes, in order.
struct SetLanes {
  alignas(64) std::uint8_t of[256][8];
};
constexpr SetLanes kSetLanes = [] {
  SetLanes lanes{};
  for (unsigned bits = 0; bits < 256; ++bits)
    for (std::uint8_t lane = 0, count = 0; lane < 8; ++lane)
      if ((bits >> lane & 1) != 0) lanes.of[bits][count++] = lane;
  return lanes;
}();
#endif

// Packs the set lanes at the front; garbage follows them.
template <class Vector, class Tag>
HWY_INLINE Vector compress(Vector v, M mask, Tag tag) {
#if HWY_TARGET == HWY_AVX2
  // Highway 1.0 copies its table to the stack every time.
  const hn::Rebind<std::uint8_t, Tag> bytes;
  return hn::TableLookupLanes(
      v, hn::IndicesFromVec(tag, hn::PromoteTo(DI(), hn::Load(bytes, kSetLanes.of[mask_bits(mask)]))));
#else
  return hn::Compress(v, hn::RebindMask(tag, mask));
#endif
}

// Stores the packed lanes; returns their number. Packs in a register first: compressing into memory is slow.
template <class Vector, class Tag>
HWY_INLINE std::size_t compress_store(Vector v, M mask, Tag tag, hn::TFromD<Tag>* to) {
  hn::StoreU(compress(v, mask, tag), tag, to);
  return hn::CountTrue(D(), mask);
}

// Calls body(lane) for every set lane, in order.
template <class Body>
HWY_INLINE void for_each_lane(M mask, const Body& body) {
  for (std::uint32_t bits = mask_bits(mask); bits != 0; bits &= bits - 1)
    body(static_cast<std::size_t>(std::countr_zero(bits)));
}

// The effects that a kernel is compiled for. Without kDepthMoves no corner changes its depth; the formulas are the
// same, but the divisions that depend on depth alone are done once per cell.
template <bool kMotion_, bool kDepthMoves_, bool kLens_, bool kOrthographic_, class Clock_ = NoStageClock>
struct Effects {
  using Clock = Clock_;
  static constexpr bool kMotion = kMotion_, kDepthMoves = kMotion_ && kDepthMoves_, kLens = kLens_,
                        kOrthographic = kOrthographic_;
};

// ---- Triangles of a cell against samples ------------------------------------------------------------------------

// A corner of a cell, the same in all lanes.
struct CellCorner {
  V x0, y0, z0, d_x, d_y, d_z, z1, scale;
};

template <class E>
HWY_INLINE CellCorner load_corner(const MicroMesh& mesh, std::size_t v) {
  const D d;
  CellCorner c;
  c.x0 = hn::Set(d, mesh.x0[v]);
  c.y0 = hn::Set(d, mesh.y0[v]);
  c.z0 = hn::Set(d, mesh.z0[v]);
  c.scale = hn::Set(d, E::kOrthographic ? 1.0f : 1.0f / mesh.z0[v]);
  c.d_x = E::kMotion ? hn::Set(d, mesh.x1[v] - mesh.x0[v]) : c.x0;
  c.d_y = E::kMotion ? hn::Set(d, mesh.y1[v] - mesh.y0[v]) : c.y0;
  c.d_z = E::kDepthMoves ? hn::Set(d, mesh.z1[v] - mesh.z0[v]) : c.z0;
  c.z1 = E::kDepthMoves ? hn::Set(d, mesh.z1[v]) : c.z0;
  return c;
}

// The cells of the lanes.
struct Cell {
  CellCorner corner[4];
  VI triangle;
  M second;  // lanes with a triangle (a, c, d)
};

// The same cell in all lanes.
template <class E>
HWY_INLINE Cell load_cell(const MicroMesh& mesh, std::size_t cell) {
  const DI di;
  Cell c;
  for (std::size_t k = 0; k < 4; ++k)
    c.corner[k] = load_corner<E>(mesh, static_cast<std::size_t>(mesh.corner[k][cell]));
  c.triangle = hn::Set(di, static_cast<std::int32_t>(mesh.triangle[cell]));
  c.second = hn::RebindMask(D(), hn::Ne(hn::Set(di, mesh.corner[2][cell]), hn::Set(di, mesh.corner[3][cell])));
  return c;
}

// The cells of a leaf as tables from which lanes pick.
struct LeafCells {
  static constexpr std::size_t kX0 = 0, kY0 = 1, kDX = 2, kDY = 3, kScale = 4, kZ0 = 5, kDZ = 6, kZ1 = 7;
  alignas(64) float corner[4][8][kLeafCells];
  alignas(64) std::int32_t triangle[kLeafCells], second[kLeafCells];
};

template <class E>
HWY_INLINE void load_cells(const MicroMesh& mesh, std::size_t first, LeafCells& cells) {
  const hn::CappedTag<float, kLeafCells> d;
  const hn::RebindToSigned<decltype(d)> di;
  for (std::size_t i = 0; i < kLeafCells; i += hn::Lanes(d)) {
    hn::Vec<decltype(di)> number[4];
    for (std::size_t k = 0; k < 4; ++k) {
      number[k] = hn::LoadU(di, mesh.corner[k].data() + first + i);
      const auto put = [&](std::size_t what, hn::Vec<decltype(d)> v)
                           HWY_ATTR { hn::Store(v, d, cells.corner[k][what] + i); };
      const auto x0 = hn::GatherIndex(d, mesh.x0.data(), number[k]), y0 = hn::GatherIndex(d, mesh.y0.data(), number[k]);
      const auto z0 = hn::GatherIndex(d, mesh.z0.data(), number[k]);
      put(LeafCells::kX0, x0);
      put(LeafCells::kY0, y0);
      if constexpr (E::kMotion) {
        put(LeafCells::kDX, hn::Sub(hn::GatherIndex(d, mesh.x1.data(), number[k]), x0));
        put(LeafCells::kDY, hn::Sub(hn::GatherIndex(d, mesh.y1.data(), number[k]), y0));
      }
      if constexpr (E::kDepthMoves) {
        const auto z1 = hn::GatherIndex(d, mesh.z1.data(), number[k]);
        put(LeafCells::kDZ, hn::Sub(z1, z0));
        put(LeafCells::kZ1, z1);
      }
      if constexpr (E::kDepthMoves || E::kOrthographic) put(LeafCells::kZ0, z0);
      if constexpr (!E::kDepthMoves && !E::kOrthographic) put(LeafCells::kScale, hn::Div(hn::Set(d, 1.0f), z0));
    }
    const auto two = hn::VecFromMask(di, hn::Ne(number[2], number[3]));
    hn::Store(two, di, cells.second + i);
  }
  for (std::size_t i = 0; i < kLeafCells; ++i) cells.triangle[i] = static_cast<std::int32_t>(mesh.triangle[first + i]);
}

// Picks entries of a table of a leaf's cells: by a permutation if one register holds the whole table.
HWY_INLINE V pick(const float* table, VI number) {
  if constexpr (kMaxLanes == kLeafCells)
    return hn::TableLookupLanes(hn::LoadU(D(), table), hn::IndicesFromVec(D(), number));
  else
    return hn::GatherIndex(D(), table, number);
}
HWY_INLINE VI pick(const std::int32_t* table, VI number) {
  if constexpr (kMaxLanes == kLeafCells)
    return hn::TableLookupLanes(hn::LoadU(DI(), table), hn::IndicesFromVec(DI(), number));
  else
    return hn::GatherIndex(DI(), table, number);
}

// The same for a table of 32 entries and two registers, aligned to 64 bytes.
constexpr std::size_t kPickable = 32;
HWY_INLINE V pick_of_32(const float* table, VI number) {
#if HWY_TARGET == HWY_AVX3
  // Highway 1.0 has no function for it.
  return V{_mm512_permutex2var_ps(_mm512_load_ps(table), number.raw, _mm512_load_ps(table + 16))};
#else
  return hn::GatherIndex(D(), table, number);
#endif
}
HWY_INLINE VI pick_of_32(const std::int32_t* table, VI number) {
#if HWY_TARGET == HWY_AVX3
  return VI{_mm512_permutex2var_epi32(_mm512_load_si512(table), number.raw, _mm512_load_si512(table + 16))};
#else
  return hn::GatherIndex(DI(), table, number);
#endif
}

// A corner of the lanes' cells; `get` gives its entry of a LeafCells' table.
template <class E, class Get>
HWY_INLINE CellCorner pick_corner(const Get& get) {
  CellCorner v;
  v.x0 = get(LeafCells::kX0);
  v.y0 = get(LeafCells::kY0);
  v.d_x = E::kMotion ? get(LeafCells::kDX) : v.x0;
  v.d_y = E::kMotion ? get(LeafCells::kDY) : v.y0;
  v.z0 = E::kDepthMoves || E::kOrthographic ? get(LeafCells::kZ0) : v.x0;  // else unused
  v.d_z = E::kDepthMoves ? get(LeafCells::kDZ) : v.x0;
  v.z1 = E::kDepthMoves ? get(LeafCells::kZ1) : v.x0;
  v.scale = E::kOrthographic ? hn::Set(D(), 1.0f) : (E::kDepthMoves ? v.x0 : get(LeafCells::kScale));
  return v;
}

// The cells that `number` names in each lane.
template <class E>
HWY_INLINE Cell pick_cells(const LeafCells& from, VI number) {
  Cell c;
  for (std::size_t k = 0; k < 4; ++k)
    c.corner[k] = pick_corner<E>([&](std::size_t what) HWY_ATTR { return pick(from.corner[k][what], number); });
  c.triangle = pick(from.triangle, number);
  c.second = hn::RebindMask(D(), hn::Ne(pick(from.second, number), hn::Zero(DI())));
  return c;
}

// ---- Leaves of a grid -------------------------------------------------------------------------------------------

// The vertices of such a leaf, each once, and tables that find the corners of its cells among them. Row by row: three
// rows from the first entry of a table, two from the entry that begins the second register.
struct LeafVertices {
  static constexpr std::size_t kRows = MicroMesh::kGridColumns + 1, kRowsBefore = 3, kBehind = kPickable / 2, kRow = 8;
  static_assert(kRowsBefore * kRows <= kBehind && (kRows - kRowsBefore) * kRows <= kBehind &&
                kRow <= MicroMesh::kRowPadding);
  // First entry of a row of `length` vertices.
  static constexpr std::size_t row_at(std::size_t row, std::size_t length) {
    return row < kRowsBefore ? row * length : kBehind + (row - kRowsBefore) * length;
  }
  alignas(64) float table[8][kPickable];                        // as LeafCells; entries behind a vertex are not used
  const std::int32_t *first_corner, *fourth_corner, *triangle;  // by cell
};

// By columns of a leaf, less one: entries of corners a and d of each cell in LeafVertices.
struct GridCorners {
  alignas(64) std::int32_t first[MicroMesh::kGridColumns][kLeafCells], fourth[MicroMesh::kGridColumns][kLeafCells];
};
constexpr GridCorners kGridCorners = [] {
  GridCorners corners{};
  for (std::size_t columns = 1; columns <= MicroMesh::kGridColumns; ++columns)
    for (std::size_t cell = 0; cell < columns * MicroMesh::kGridColumns; ++cell) {
      const std::size_t row = cell / columns, column = cell % columns;
      const auto at = [&](std::size_t j) {
        return static_cast<std::int32_t>(LeafVertices::row_at(j, columns + 1) + column);
      };
      corners.first[columns - 1][cell] = at(row);
      corners.fourth[columns - 1][cell] = at(row + 1);
    }
  return corners;
}();

// Calls put(d, at, get) until all vertices of a leaf are covered: `get` makes a vector of tag `d` from an array's
// values for some of them; the vector belongs to the entries from `at` of a table on. Lanes without a vertex are zero.
template <class Put>
HWY_INLINE void for_each_row(const MicroMesh::Leaf& leaf, const Put& put) {
  const auto columns = static_cast<std::size_t>(leaf.grid.columns), length = columns + 1;
  const std::size_t rows = (leaf.cell_count + columns - 1) / columns + 1;
  const auto vertex = [&](std::size_t row) {
    return static_cast<std::size_t>(leaf.grid.first) + row * static_cast<std::size_t>(leaf.grid.stride);
  };
#if HWY_TARGET == HWY_AVX3
  // Rows lie side by side in a register, and each is loaded to its place: masked lanes are not read.
  const D d;
  for (std::size_t first = 0, part = 0; first < LeafVertices::kRows;
       first += LeafVertices::kRowsBefore, part += LeafVertices::kBehind) {
    const std::size_t end = std::min(rows, first + LeafVertices::kRowsBefore);
    put(d, part, [&](const std::vector<float>& from) HWY_ATTR {
      __m512 all = _mm512_setzero_ps();
      for (std::size_t row = first; row < end; ++row) {
        const std::size_t at = (row - first) * length;
        const auto in = static_cast<__mmask16>(((1u << length) - 1) << at);
        all = _mm512_mask_loadu_ps(all, in, from.data() + vertex(row) - at);
      }
      return V{all};
    });
  }
#else
  // Each row overwrites the surplus that the previous one stored behind its own.
  const hn::CappedTag<float, LeafVertices::kRow> d;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t i = 0; i < length; i += hn::Lanes(d))
      put(d, LeafVertices::row_at(row, length) + i, [&](const std::vector<float>& from) HWY_ATTR {
        return hn::IfThenElseZero(hn::FirstN(d, length - i), hn::LoadU(d, from.data() + vertex(row) + i));
      });
#endif
}

template <class E>
HWY_INLINE void load_vertices(const MicroMesh& mesh, std::size_t l, LeafVertices& to) {
  const MicroMesh::Leaf& leaf = mesh.leaves[l];
  const auto columns = static_cast<std::size_t>(leaf.grid.columns);
  to.first_corner = kGridCorners.first[columns - 1];
  to.fourth_corner = kGridCorners.fourth[columns - 1];
  to.triangle = reinterpret_cast<const std::int32_t*>(mesh.triangle.data() + l * kLeafCells);
  for_each_row(leaf, [&](auto d, std::size_t at, const auto& get) HWY_ATTR {
    using Vector = hn::Vec<decltype(d)>;
    const auto put = [&](std::size_t what, Vector values) HWY_ATTR { hn::StoreU(values, d, to.table[what] + at); };
    const Vector x0 = get(mesh.x0), y0 = get(mesh.y0), z0 = get(mesh.z0);
    put(LeafCells::kX0, x0);
    put(LeafCells::kY0, y0);
    if constexpr (E::kMotion) {
      put(LeafCells::kDX, hn::Sub(get(mesh.x1), x0));
      put(LeafCells::kDY, hn::Sub(get(mesh.y1), y0));
    }
    if constexpr (E::kDepthMoves) {
      const Vector z1 = get(mesh.z1);
      put(LeafCells::kDZ, hn::Sub(z1, z0));
      put(LeafCells::kZ1, z1);
    }
    if constexpr (E::kDepthMoves || E::kOrthographic) put(LeafCells::kZ0, z0);
    // Vertices at depth 0 belong to no tested cell.
    const Vector one = hn::Set(d, 1.0f);
    if constexpr (!E::kDepthMoves && !E::kOrthographic)
      put(LeafCells::kScale, hn::Div(one, hn::IfThenElse(hn::Eq(z0, hn::Zero(d)), one, z0)));
  });
}

template <class E>
HWY_INLINE Cell pick_cells(const LeafVertices& from, VI number) {
  const DI di;
  const VI a = pick(from.first_corner, number), e = pick(from.fourth_corner, number), one = hn::Set(di, 1);
  const VI vertex[4] = {a, hn::Add(a, one), hn::Add(e, one), e};
  Cell c;
  for (std::size_t k = 0; k < 4; ++k)
    c.corner[k] = pick_corner<E>([&](std::size_t what) HWY_ATTR { return pick_of_32(from.table[what], vertex[k]); });
  c.triangle = pick(from.triangle, number);
  c.second = hn::RebindMask(D(), hn::Eq(a, a));
  return c;
}

// The samples of the lanes; t, u, v only if the effects use them.
struct SampleLanes {
  V x, y, t, lens_u, lens_v;
  VI id;  // natural order
};

// A corner as the lanes' samples see it: Corner of cell_test.h, lane by lane. scale is left out (see corner_scale) if
// it takes a division that only hits need.
struct CornerLanes {
  V x, y, z, scale;
};

template <class E>
HWY_INLINE V corner_scale(const CornerLanes& c) {
  if constexpr (E::kDepthMoves && !E::kLens && !E::kOrthographic)
    return hn::Div(hn::Set(D(), 1.0f), c.z);
  else
    return c.scale;
}

template <class E>
HWY_INLINE CornerLanes place_corner(const CellCorner& v, const SampleLanes& s, V inverse_focus, V sharp_factor) {
  const D d;
  CornerLanes c;
  c.z = E::kDepthMoves ? fma(s.t, v.d_z, v.z0) : v.z0;
  c.scale = v.scale;
  if constexpr (E::kDepthMoves && E::kLens && !E::kOrthographic) c.scale = hn::Div(hn::Set(d, 1.0f), c.z);
  c.x = hn::Sub(v.x0, s.x);
  c.y = hn::Sub(v.y0, s.y);
  if constexpr (E::kMotion) {
    // z1 / z is exactly 1 if the depth does not change.
    V lambda = s.t;
    if constexpr (E::kDepthMoves && !E::kOrthographic) lambda = hn::Mul(s.t, hn::Div(v.z1, c.z));
    c.x = fma(lambda, v.d_x, c.x);
    c.y = fma(lambda, v.d_y, c.y);
  }
  if constexpr (E::kLens) {
    V factor =
        E::kOrthographic ? hn::Sub(hn::Set(d, 1.0f), hn::Mul(c.z, inverse_focus)) : hn::Sub(c.scale, inverse_focus);
    factor = hn::IfThenZeroElse(hn::Le(hn::Abs(factor), sharp_factor), factor);
    c.x = fma(hn::Neg(s.lens_u), factor, c.x);
    c.y = fma(hn::Neg(s.lens_v), factor, c.y);
  }
  return c;
}

HWY_INLINE V edge(const CornerLanes& a, const CornerLanes& b) { return hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x)); }

// Data that all tests of a mesh share.
struct Context {
  const MicroMesh& mesh;
  const TileSamples& samples;
  const VisibilitySettings& settings;
  HitSink& sink;
  VisibilityWork& work;
};

// Triangles of the lanes: edge functions, corners and their places at shutter open, in the order of the weights.
struct TriangleLanes {
  V e[3];
  CornerLanes p[3];
  V x0[3], y0[3];
  VI number;
};

// Emits the hits of the `inside` lanes.
template <class E>
HWY_INLINE void emit(const Context& to, M inside, const TriangleLanes& of, VI id) {
  const D d;
  const HitLimits& limits = to.settings.limits;
  const auto& [e, p, x0, y0, triangle] = of;
  const V b0 = hn::Mul(e[0], corner_scale<E>(p[0])), b1 = hn::Mul(e[1], corner_scale<E>(p[1])),
          b2 = hn::Mul(e[2], corner_scale<E>(p[2]));
  const V sum = hn::Add(hn::Add(b0, b1), b2);
  const V numerator = E::kOrthographic ? hn::Add(hn::Add(hn::Mul(b0, p[0].z), hn::Mul(b1, p[1].z)), hn::Mul(b2, p[2].z))
                                       : hn::Add(hn::Add(e[0], e[1]), e[2]);
  const V z = hn::Div(numerator, sum);
  const M in_range = hn::And(hn::Ge(z, hn::Set(d, limits.near)), hn::Le(z, hn::Set(d, limits.far)));
  const M positive = hn::Gt(e[0], hn::Zero(d));
  if (!limits.keep_positive) inside = hn::AndNot(positive, inside);
  if (!limits.keep_negative) inside = hn::And(positive, inside);
  M hit = hn::And(inside, in_range);
  if (hn::AllFalse(d, hit)) return;
  to.work.sample_hits += hn::CountTrue(d, hit);
  if (to.settings.depth != nullptr) {
    const VI safe = hn::IfThenElseZero(hn::RebindMask(DI(), hit), id);
    hit = hn::And(hit, hn::Le(z, hn::GatherIndex(d, to.settings.depth, safe)));
    if (hn::AllFalse(d, hit)) return;
  }
  const V one = hn::Set(d, 1.0f);
  V w1 = hn::Div(b1, sum), w2 = hn::Div(b2, sum);
  if (to.settings.weight_steps != 0) {
    const V steps = hn::Set(d, to.settings.weight_steps);
    w1 = hn::Div(hn::Round(hn::Mul(w1, steps)), steps);
    w2 = hn::Min(hn::Div(hn::Round(hn::Mul(w2, steps)), steps), hn::Sub(one, w1));
  }
  const V w0 = hn::Sub(hn::Sub(one, w1), w2);
  const V rest_x = hn::Add(hn::Add(hn::Mul(w0, x0[0]), hn::Mul(w1, x0[1])), hn::Mul(w2, x0[2]));
  const V rest_y = hn::Add(hn::Add(hn::Mul(w0, y0[0]), hn::Mul(w1, y0[1])), hn::Mul(w2, y0[2]));
  alignas(64) float lane_z[kMaxLanes], lane_b1[kMaxLanes], lane_b2[kMaxLanes], lane_x[kMaxLanes], lane_y[kMaxLanes];
  alignas(64) std::int32_t lane_id[kMaxLanes], lane_triangle[kMaxLanes];
  hn::Store(triangle, DI(), lane_triangle);
  hn::Store(z, d, lane_z);
  hn::Store(w1, d, lane_b1);
  hn::Store(w2, d, lane_b2);
  hn::Store(rest_x, d, lane_x);
  hn::Store(rest_y, d, lane_y);
  hn::Store(id, DI(), lane_id);
  const std::uint32_t positive_bits = mask_bits(positive);
  for_each_lane(hit, [&](std::size_t lane) {
    to.sink.add({static_cast<std::uint32_t>(lane_id[lane]), static_cast<std::uint32_t>(lane_triangle[lane]),
                 lane_z[lane], lane_b1[lane], lane_b2[lane], lane_x[lane], lane_y[lane],
                 (positive_bits >> lane & 1) != 0});
  });
}

// Tests lanes with an edge function of exactly zero, one by one.
template <class E>
HWY_NOINLINE void test_ties(const Context& to, const Cell& cell, const CornerLanes (&corner)[4], M ties, VI id) {
  const D d;
  alignas(64) float store[4][6][kMaxLanes];
  alignas(64) std::int32_t lane_id[kMaxLanes], lane_triangle[kMaxLanes];
  hn::Store(id, DI(), lane_id);
  hn::Store(cell.triangle, DI(), lane_triangle);
  for (std::size_t k = 0; k < 4; ++k) {
    hn::Store(corner[k].x, d, store[k][0]);
    hn::Store(corner[k].y, d, store[k][1]);
    hn::Store(corner_scale<E>(corner[k]), d, store[k][2]);
    hn::Store(corner[k].z, d, store[k][3]);
    hn::Store(cell.corner[k].x0, d, store[k][4]);
    hn::Store(cell.corner[k].y0, d, store[k][5]);
  }
  const std::uint32_t second = mask_bits(cell.second);
  const HitLimits& limits = to.settings.limits;
  for_each_lane(ties, [&](std::size_t lane) {
    Corner c[4];
    for (std::size_t k = 0; k < 4; ++k)
      c[k] = {store[k][0][lane], store[k][1][lane], store[k][2][lane], store[k][3][lane]};
    const auto test = [&](std::size_t i, std::size_t j, std::size_t k, std::uint32_t offset) {
      TriangleHit hit;
      if (!exact_triangle_test(c[i], c[j], c[k], E::kOrthographic, hit)) return;
      if (!(hit.z >= limits.near && hit.z <= limits.far) ||
          !(hit.positive ? limits.keep_positive : limits.keep_negative))
        return;
      ++to.work.sample_hits;
      round_weights(to.settings.weight_steps, hit.b1, hit.b2);
      const float w0 = (1.0f - hit.b1) - hit.b2;
      const auto rest = [&](std::size_t axis) {
        return (w0 * store[i][axis][lane] + hit.b1 * store[j][axis][lane]) + hit.b2 * store[k][axis][lane];
      };
      to.sink.add({static_cast<std::uint32_t>(lane_id[lane]), static_cast<std::uint32_t>(lane_triangle[lane]) + offset,
                   hit.z, hit.b1, hit.b2, rest(4), rest(5), hit.positive});
    };
    test(0, 1, 2, 0);
    if (second >> lane & 1) test(0, 2, 3, 1);
  });
}

// Tests both triangles of a cell against the `valid` lanes.
template <class E>
HWY_INLINE void test_cell(const Context& to, const Cell& cell, const SampleLanes& s, M valid) {
  const D d;
  const V zero = hn::Zero(d), inverse_focus = hn::Set(d, to.settings.inverse_focus),
          sharp_factor = hn::Set(d, to.settings.sharp_factor);
  CornerLanes corner[4];
  for (std::size_t k = 0; k < 4; ++k) corner[k] = place_corner<E>(cell.corner[k], s, inverse_focus, sharp_factor);
  const auto& [a, b, c, e] = corner;
  const V e_ab = edge(a, b), e_bc = edge(b, c), e_ca = edge(c, a);
  const auto one_sign = [&](V x, V y, V z) HWY_ATTR {
    const M all_positive = hn::Gt(hn::Min(hn::Min(x, y), z), zero),
            all_negative = hn::Lt(hn::Max(hn::Max(x, y), z), zero);
    return hn::Or(all_positive, all_negative);
  };
  M ties = hn::Or(hn::Or(hn::Eq(e_ab, zero), hn::Eq(e_bc, zero)), hn::Eq(e_ca, zero));
  M first = hn::And(valid, one_sign(e_ab, e_bc, e_ca));
  const M two = hn::And(valid, cell.second);
  const std::uint64_t triangle_tests = hn::CountTrue(d, valid) + hn::CountTrue(d, two);
  to.work.triangle_tests += triangle_tests;
  E::Clock::count(RayStage::kTriangles, triangle_tests);
  const V e_cd = edge(c, e), e_da = edge(e, a), e_ac = hn::Neg(e_ca);  // bit for bit edge(a, c)
  ties = hn::Or(ties, hn::And(cell.second, hn::Or(hn::Eq(e_cd, zero), hn::Eq(e_da, zero))));
  const M second = hn::AndNot(ties, hn::And(two, one_sign(e_ac, e_cd, e_da)));
  ties = hn::And(valid, ties);
  first = hn::AndNot(ties, first);
  E::Clock::enter(RayStage::kHits);
  // In a cell that is not folded a sample is in one of the triangles: the hits of both are emitted at once.
  const auto emit_both = [&](M of_second, M inside) HWY_ATTR {
    const auto either = [&](V x, V y) HWY_ATTR { return hn::IfThenElse(of_second, y, x); };
    const auto corners = [&](const CornerLanes& x, const CornerLanes& y) HWY_ATTR {
      return CornerLanes{x.x, x.y, either(x.z, y.z), either(x.scale, y.scale)};
    };
    const CellCorner(&v)[4] = cell.corner;
    const VI offset = hn::IfThenElseZero(hn::RebindMask(DI(), of_second), hn::Set(DI(), 1));
    emit<E>(to, inside,
            {{either(e_bc, e_cd), either(e_ca, e_da), either(e_ab, e_ac)},
             {corner[0], corners(corner[1], corner[2]), corners(corner[2], corner[3])},
             {v[0].x0, either(v[1].x0, v[2].x0), either(v[2].x0, v[3].x0)},
             {v[0].y0, either(v[1].y0, v[2].y0), either(v[2].y0, v[3].y0)},
             hn::Add(cell.triangle, offset)},
            s.id);
  };
  const M any = hn::Or(first, second), both = hn::And(first, second);
  if (!hn::AllFalse(d, any)) emit_both(hn::AndNot(first, second), any);
  if (!hn::AllFalse(d, both)) emit_both(both, both);
  if (!hn::AllFalse(d, ties)) test_ties<E>(to, cell, corner, ties, s.id);
  E::Clock::enter(RayStage::kTriangles);
}

// ---- Pairs of a sample and a cell -------------------------------------------------------------------------------

// Samples inside a leaf's box, waiting for the boxes of its cells.
struct Survivors {
  static constexpr std::size_t kCapacity = 512;
  std::size_t count = 0;
  alignas(64) float x[kCapacity + kMaxLanes], y[kCapacity + kMaxLanes];
  alignas(64) float rest_x[kCapacity + kMaxLanes], rest_y[kCapacity + kMaxLanes];  // in the leaf's rest frame
  alignas(64) float t[kCapacity + kMaxLanes], lens_u[kCapacity + kMaxLanes], lens_v[kCapacity + kMaxLanes];
  alignas(64) std::int32_t id[kCapacity + kMaxLanes];
};

// Survivors inside the boxes of cells: kLeafCells times the survivor's place, plus the cell; in this order.
struct Pairs {
  static constexpr std::size_t kCapacity = 256;
  std::size_t count = 0;
  alignas(64) std::int32_t number[kCapacity + 2 * kLeafCells];
};

HWY_INLINE M in_box(V x, V x_low, V x_high, V y, V y_low, V y_high) {
#if HWY_TARGET == HWY_AVX3
  // AVX-512 compares under a mask for free; Highway 1.0 has no function for it.
  const auto above_x = _mm512_cmp_ps_mask(x.raw, x_low.raw, _CMP_GE_OQ),
             in_x = _mm512_mask_cmp_ps_mask(above_x, x.raw, x_high.raw, _CMP_LE_OQ),
             above_y = _mm512_mask_cmp_ps_mask(in_x, y.raw, y_low.raw, _CMP_GE_OQ);
  return M{_mm512_mask_cmp_ps_mask(above_y, y.raw, y_high.raw, _CMP_LE_OQ)};
#else
  return hn::And(hn::And(hn::Ge(x, x_low), hn::Le(x, x_high)), hn::And(hn::Ge(y, y_low), hn::Le(y, y_high)));
#endif
}

// Tests survivors from `s` on against the boxes of all cells, until all are tested or the list is full. Returns the
// first untested one.
HWY_INLINE std::size_t find_pairs(const MicroMesh& mesh, std::size_t first, const Survivors& from, std::size_t s,
                                  Pairs& pairs) {
  const D d;
  const DI di;
  static_assert(kLeafCells % kMaxLanes == 0);
  constexpr std::size_t kParts = kLeafCells / kMaxLanes;
  V x_low[kParts], x_high[kParts], y_low[kParts], y_high[kParts];
  VI number[kParts];
  for (std::size_t part = 0; part < kParts; ++part) {
    const auto at = [&](const std::vector<float>& v)
                        HWY_ATTR { return hn::LoadU(d, v.data() + first + part * kMaxLanes); };
    x_low[part] = at(mesh.box_x_low);
    x_high[part] = at(mesh.box_x_high);
    y_low[part] = at(mesh.box_y_low);
    y_high[part] = at(mesh.box_y_high);
    number[part] = numbers_from(kLeafCells * s + part * kMaxLanes);
  }
  const VI next = hn::Set(di, static_cast<std::int32_t>(kLeafCells));
  std::size_t count = pairs.count;
  for (; s < from.count && count < Pairs::kCapacity; ++s) {
    const V x = hn::Set(d, from.rest_x[s]), y = hn::Set(d, from.rest_y[s]);
    for (std::size_t part = 0; part < kParts; ++part) {
      const M inside = in_box(x, x_low[part], x_high[part], y, y_low[part], y_high[part]);
      count += compress_store(number[part], inside, di, pairs.number + count);
      number[part] = hn::Add(number[part], next);
    }
  }
  pairs.count = count;
  return s;
}

// `get` returns a vector of an array's elements.
template <class E, class Get>
HWY_INLINE SampleLanes sample_lanes(const Survivors& from, const Get& get) {
  const V none = hn::Zero(D());
  SampleLanes s;
  s.x = get(from.x);
  s.y = get(from.y);
  s.t = E::kMotion ? get(from.t) : none;
  s.lens_u = E::kLens ? get(from.lens_u) : none;
  s.lens_v = E::kLens ? get(from.lens_v) : none;
  s.id = get(from.id);
  return s;
}

// The survivors with numbers `at`.
template <class E>
HWY_INLINE SampleLanes pick_samples(const Survivors& from, VI at) {
  if (from.count <= kPickable) return sample_lanes<E>(from, [&](const auto* v) HWY_ATTR { return pick_of_32(v, at); });
  return sample_lanes<E>(from, [&](const auto* v) HWY_ATTR {
    return hn::GatherIndex(hn::ScalableTag<std::remove_cvref_t<decltype(*v)>>(), v, at);
  });
}

// Tests the pairs with a leaf's `cells`, a vector of pairs with both triangles at once. Empties the list.
template <class E, class Cells>
HWY_INLINE void test_pairs(const Context& to, const Cells& cells, const Survivors& from, Pairs& pairs) {
  const D d;
  const DI di;
  hn::StoreU(hn::Zero(di), di, pairs.number + pairs.count);  // lanes behind the last pair name a valid one
  to.work.pairs += pairs.count;
  for (std::size_t i = 0; i < pairs.count; i += hn::Lanes(d)) {
    const M valid = hn::FirstN(d, pairs.count - i);
    const VI pair = hn::Load(di, pairs.number + i);
    const VI cell = hn::And(pair, hn::Set(di, static_cast<std::int32_t>(kLeafCells - 1)));
    test_cell<E>(to, pick_cells<E>(cells, cell),
                 pick_samples<E>(from, hn::ShiftRight<std::countr_zero(kLeafCells)>(pair)), valid);
  }
  pairs.count = 0;
}

// Tests survivors against a leaf's cells: all boxes first; then the remaining pairs of a survivor and a cell. Empties
// the list.
template <class E>
void test_survivors(const Context& to, std::size_t l, Survivors& from) {
  const MicroMesh& mesh = to.mesh;
  const std::uint64_t box_tests = from.count * static_cast<std::uint64_t>(std::popcount(mesh.leaves[l].cells));
  to.work.box_tests += box_tests;
  to.work.box_lanes += from.count * kLeafCells;
  E::Clock::count(RayStage::kBoxes, box_tests);
  // Cells are fetched first, as boxes do not depend on them.
  E::Clock::enter(RayStage::kTriangles);
  const auto test_all = [&](const auto& cells) HWY_ATTR {
    Pairs pairs;
    for (std::size_t s = 0; s < from.count;) {
      E::Clock::enter(RayStage::kBoxes);
      s = find_pairs(mesh, l * kLeafCells, from, s, pairs);
      E::Clock::enter(RayStage::kTriangles);
      test_pairs<E>(to, cells, from, pairs);
    }
  };
  if (mesh.leaves[l].grid.columns != 0) {
    LeafVertices vertices;
    load_vertices<E>(mesh, l, vertices);
    test_all(vertices);
  } else {
    LeafCells cells;
    load_cells<E>(mesh, l * kLeafCells, cells);
    test_all(cells);
  }
  from.count = 0;
  E::Clock::enter(RayStage::kClasses);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
