#include "tilecore/resolve/cubic_stencil.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "stencil_tables.h"  // generated
#include "tilecore/resolve/cubic_kernel.h"
#include "tilecore/resolve/packed_stencil.h"

namespace tessera::tilecore {
namespace {

// ---- Four channels ----------------------------------------------------------------------------------------------

// Element-wise arithmetic without fusing: the same bits with any instruction set.
using Channels [[gnu::vector_size(16)]] = float;

Channels load(const Vec4* color) {
  Channels c;
  std::memcpy(&c, &color->x, sizeof c);
  return c;
}
void store(const Channels& c, Vec4* color) { std::memcpy(&color->x, &c, sizeof c); }
Channels lower(const Channels& a, const Channels& b) { return a < b ? a : b; }
Channels upper(const Channels& a, const Channels& b) { return a < b ? b : a; }

// x - x is +0 or NaN.
bool is_finite(const Channels& c) {
  const Channels zero = c - c;
  std::uint64_t bits[2];
  std::memcpy(bits, &zero, sizeof bits);
  return (bits[0] | bits[1]) == 0;
}

// The value before and after clamping: an infinite tap shows in the first, but the second may hide it.
struct Result {
  Channels plain, clamped;
};

// ---- Tables -----------------------------------------------------------------------------------------------------

// Largest weight first: taps of equal weight are neighbours.
constexpr Stencil sorted_by_weight(Stencil s) {
  for (std::size_t i = 1; i < s.count; ++i)
    for (std::size_t k = i; k > 0 && s.taps[k - 1].weight < s.taps[k].weight; --k) std::swap(s.taps[k - 1], s.taps[k]);
  return s;
}

constexpr auto kStencils = [] {
  std::array<Stencil, generated::kStencils> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = sorted_by_weight(unpack_stencil(generated::kPackedStencils, generated::kStencilStart[i]));
  return all;
}();

constexpr bool has_table(Reconstruction kernel) { return kernel != Reconstruction::kNearest; }

constexpr StencilIndexEntry index_entry(Reconstruction kernel, unsigned border, std::size_t table_pattern, int pixel) {
  const std::size_t row = ((static_cast<std::size_t>(kernel) - 1) * kBorderCases + border) * kTablePatterns.size() + table_pattern;
  const std::uint16_t code = generated::kStencilIndex[row * 16 + static_cast<std::size_t>(pixel)];
  if (code == kNoStencil) return {};
  return {static_cast<std::uint16_t>(code / 8), {static_cast<std::uint8_t>(code % 8)}};
}

// A pattern as the mirror image of one that has a table.
struct MirroredPattern {
  std::size_t table_pattern;
  unsigned mirror;  // as mirrored_pixel()
};

// By which of the pixels (0, 0), (1, 0), (0, 1), (1, 1) are rendered, bit 0 first; all patterns repeat every two pixels.
constexpr std::optional<MirroredPattern> pattern_of(unsigned corner) {
  switch (corner) {
    case 1: return MirroredPattern{0, 0};
    case 2: return MirroredPattern{0, 1};
    case 4: return MirroredPattern{0, 2};
    case 8: return MirroredPattern{0, 3};
    case 9: return MirroredPattern{1, 0};
    case 6: return MirroredPattern{1, 1};
    default: return std::nullopt;
  }
}
constexpr unsigned corner_of(BlockMask pattern) { return (pattern & 3u) | (pattern >> 2 & 12u); }

constexpr StencilIndexEntry mirrored_entry(Reconstruction kernel, unsigned border, const MirroredPattern& p, int pixel) {
  StencilIndexEntry entry = index_entry(kernel, mirrored_border(border, p.mirror), p.table_pattern, mirrored_pixel(pixel, p.mirror));
  entry.symmetry.bits = static_cast<std::uint8_t>(entry.symmetry.bits ^ p.mirror << 1);
  return entry;
}

constexpr Stencil stencil_of(const StencilIndexEntry& entry) {
  Stencil s = kStencils[entry.stencil];
  for (std::size_t i = 0; i < s.count; ++i) s.taps[i] = entry.symmetry.apply(s.taps[i]);
  return s;
}

// ---- Regular surroundings: stencils known when this is compiled ---------------------------------------------------

template <Stencil S, std::size_t First, std::size_t Count>
[[gnu::always_inline]] inline Channels sum_of_taps(const Vec4* center, std::ptrdiff_t stride) {
  if constexpr (Count == 1) return load(center + S.taps[First].dy * stride + S.taps[First].dx);
  else return sum_of_taps<S, First, Count / 2>(center, stride) + sum_of_taps<S, First + Count / 2, Count - Count / 2>(center, stride);
}

constexpr std::size_t equal_weights(const Stencil& s, std::size_t first) {
  std::size_t n = 1;
  while (first + n < s.count && s.taps[first + n].weight == s.taps[first].weight) ++n;
  return n;
}

// One product per different weight. Counts are powers of two, so the sums of a flat colour are exact.
template <Stencil S, std::size_t First = 0>
[[gnu::always_inline]] inline Channels weighted_sum(const Vec4* center, std::ptrdiff_t stride) {
  constexpr std::size_t kCount = equal_weights(S, First);
  static_assert(std::has_single_bit(kCount));
  constexpr float kWeight = static_cast<float>(S.taps[First].weight) / static_cast<float>(S.unit());
  const Channels product = sum_of_taps<S, First, kCount>(center, stride) * kWeight;
  if constexpr (First + kCount == S.count) return product;
  else return product + weighted_sum<S, First + kCount>(center, stride);
}

template <Stencil S, bool Clamp>
[[gnu::always_inline]] inline Result apply(const Vec4* center, std::ptrdiff_t stride) {
  Result r;
  r.plain = r.clamped = weighted_sum<S>(center, stride);
  if constexpr (Clamp) {
    Channels low = load(center + S.taps[0].dy * stride + S.taps[0].dx), high = low;
    for (std::size_t i = 1; i < S.count; ++i) {
      const Channels c = load(center + S.taps[i].dy * stride + S.taps[i].dx);
      low = lower(low, c), high = upper(high, c);
    }
    r.clamped = lower(upper(r.plain, low), high);
  }
  return r;
}

// A block on its way: window and results.
struct Fill {
  const Vec4* block;  // pixel (0, 0) of the block
  std::ptrdiff_t stride;
  Vec4* out;
  Channels zeros{};  // stays +0 while all results are finite

  void put(int pixel, const Result& r) {
    zeros += r.plain - r.plain;
    store(r.clamped, out + pixel);
  }
  const Vec4* at(int pixel) const { return block + (pixel / 4) * stride + pixel % 4; }
};

template <Stencil S, bool Clamp>
void fill_pixels(BlockMask pixels, Fill& fill, ReconstructionWork& work) {
  work.taps += S.count * static_cast<std::uint64_t>(std::popcount(pixels));
  for (unsigned left = pixels; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    fill.put(p, apply<S, Clamp>(fill.at(p), fill.stride));
  }
}

template <Reconstruction K, bool Clamp>
void fill_interior(const MirroredPattern& p, BlockMask missing, Fill& fill, ReconstructionWork& work) {
  if (p.table_pattern == 1) return fill_pixels<stencil_of(index_entry(K, 0, 1, 1)), Clamp>(missing, fill, work);
  const int x = p.mirror & 1, y = p.mirror >> 1;
  const auto among = [&](int dx, int dy) { return static_cast<BlockMask>(missing & sparse_square(x ^ dx, y ^ dy)); };
  fill_pixels<stencil_of(index_entry(K, 0, 0, 1)), Clamp>(among(1, 0), fill, work);
  fill_pixels<stencil_of(index_entry(K, 0, 0, 4)), Clamp>(among(0, 1), fill, work);
  fill_pixels<stencil_of(index_entry(K, 0, 0, 5)), Clamp>(among(1, 1), fill, work);
}

using InteriorFill = void (*)(const MirroredPattern&, BlockMask, Fill&, ReconstructionWork&);
constexpr InteriorFill kInteriorFills[kReconstructionCount][2] = {
    {nullptr, nullptr},
    {fill_interior<Reconstruction::kBilinear, false>, fill_interior<Reconstruction::kBilinear, true>},
    {fill_interior<Reconstruction::kCubicUnscaled, false>, fill_interior<Reconstruction::kCubicUnscaled, true>},
    {fill_interior<Reconstruction::kCubic, false>, fill_interior<Reconstruction::kCubic, true>},
    {fill_interior<Reconstruction::kCubicInterpolating, false>, fill_interior<Reconstruction::kCubicInterpolating, true>},
};

// ---- Any surroundings ---------------------------------------------------------------------------------------------

struct WeightedTap {
  const Vec4* color;
  float weight;
};

constexpr std::size_t kMostDirectTaps = 49;  // 7x7

// Largest weight first. Sums differences from it, so that a flat colour is exact whatever the weights.
struct TapList {
  std::array<WeightedTap, kMostDirectTaps> taps;
  std::size_t count = 0;
  bool holds = false;  // a kernel's: there are taps, and their weights do not cancel

  TapList() { taps[0] = {nullptr, 0.0f}; }  // the rest need not be cleared
  void add(const Vec4* color, float weight) {
    taps[count] = {color, weight};
    if (count > 0 && weight > taps[0].weight) std::swap(taps[0], taps[count]);
    ++count;
  }
  Result sum(bool clamp) const {
    const Channels base = load(taps[0].color);
    Channels difference{}, low = base, high = base;
    for (std::size_t i = 1; i < count; ++i) {
      const Channels c = load(taps[i].color);
      difference += (c - base) * taps[i].weight;
      low = lower(low, c), high = upper(high, c);
    }
    // A lone tap is copied, -0 too.
    Result r{base + difference, {}};
    if (count == 1) r.plain = base;
    r.clamped = clamp ? lower(upper(r.plain, low), high) : r.plain;
    return r;
  }
};

using UsableRows = std::array<std::uint16_t, kWindowSide>;
constexpr unsigned kWindowColumns = (1u << kWindowSide) - 1;

constexpr auto kKernelWeights = [] {
  std::array<std::array<float, kWindowMargin + 1>, kReconstructionCount> k{};
  for (std::size_t r = 0; r < kReconstructionCount; ++r)
    for (std::size_t d = 0; d <= kWindowMargin; ++d) k[r][d] = static_cast<float>(kernel_weight(static_cast<Reconstruction>(r), static_cast<int>(d)));
  return k;
}();

// Offsets within a window as seen from a pixel of its block, nearest first, equally near ones in raster order.
struct NearOffset {
  std::int8_t dx, dy;
  std::int16_t square;
};
constexpr int kFarthest = kWindowMargin + 3;
constexpr auto kNearOffsets = [] {
  constexpr int kSide = 2 * kFarthest + 1;
  std::array<NearOffset, static_cast<std::size_t>(kSide * kSide)> all{};
  for (int i = 0; i < kSide * kSide; ++i) {
    const int dx = i % kSide - kFarthest, dy = i / kSide - kFarthest;
    all[static_cast<std::size_t>(i)] = {static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy), static_cast<std::int16_t>(dx * dx + dy * dy)};
  }
  std::sort(all.begin(), all.end(), [](const NearOffset& a, const NearOffset& b) {
    return a.square != b.square ? a.square < b.square : a.dy != b.dy ? a.dy < b.dy : a.dx < b.dx;
  });
  return all;
}();

struct WindowView {
  const BlockWindow& window;
  const UsableRows& usable;

  const Vec4* at(int x, int y) const { return window.first_pixel + y * window.row_stride + x; }
};

// The nearest usable pixels, or the first of them: never none, as the caller knows that there is a usable one.
TapList nearest_taps(const WindowView& view, int pixel, bool only_one) {
  const int cx = pixel % 4 + kWindowMargin, cy = pixel / 4 + kWindowMargin;
  TapList taps;
  int square = -1;
  for (const NearOffset& o : kNearOffsets) {
    if (square >= 0 && (o.square != square || only_one)) break;
    const int x = cx + o.dx, y = cy + o.dy;
    if (x < 0 || y < 0 || x >= kWindowSide || y >= kWindowSide || !(view.usable[static_cast<std::size_t>(y)] >> x & 1)) continue;
    square = o.square;
    taps.add(view.at(x, y), 1.0f);
  }
  const float share = 1.0f / static_cast<float>(taps.count);
  for (std::size_t i = 0; i < taps.count; ++i) taps.taps[i].weight = share;
  return taps;
}

TapList kernel_taps(const WindowView& view, Reconstruction kernel, int pixel) {
  const auto& k = kKernelWeights[static_cast<std::size_t>(kernel)];
  const int reach = kernel_reach(kernel), cx = pixel % 4 + kWindowMargin, cy = pixel / 4 + kWindowMargin;
  TapList taps;
  float sum = 0, magnitude = 0;
  for (int dy = -reach; dy <= reach; ++dy) {
    const unsigned row = view.usable[static_cast<std::size_t>(cy + dy)] >> (cx - reach);
    for (int dx = -reach; dx <= reach; ++dx) {
      const float w = k[static_cast<std::size_t>(dx < 0 ? -dx : dx)] * k[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
      if (!(row >> (dx + reach) & 1) || w == 0.0f) continue;
      taps.add(view.at(cx + dx, cy + dy), w);
      sum += w;
      magnitude += w < 0 ? -w : w;
    }
  }
  taps.holds = taps.count > 0 && sum >= static_cast<float>(kMinimumDenominator) * magnitude;
  for (std::size_t i = 0; i < taps.count; ++i) taps.taps[i].weight /= sum;
  return taps;
}

Result fill_directly(const WindowView& view, Reconstruction kernel, bool clamp, int pixel, ReconstructionWork& work) {
  ++work.direct_pixels;
  const bool nearest = kernel == Reconstruction::kNearest;
  TapList taps;
  if (!nearest) taps = kernel_taps(view, kernel, pixel);
  if (taps.holds) {
    work.taps += taps.count;
    return taps.sum(clamp);
  }
  work.fallbacks += !nearest;
  const TapList near = nearest_taps(view, pixel, nearest);
  work.taps += near.count;
  Result r = near.sum(clamp);
  // Without a tap that is not finite the stencil might hold: let the result tell of it.
  for (std::size_t i = 0; i < taps.count; ++i) r.plain += load(taps.taps[i].color) - load(taps.taps[i].color);
  if (!clamp) r.clamped = r.plain;
  return r;
}

Result fill_from_table(const WindowView& view, const StencilIndexEntry& entry, bool clamp, int pixel, ReconstructionWork& work) {
  const Stencil& s = kStencils[entry.stencil];
  const float scale = 1.0f / static_cast<float>(s.unit());
  TapList taps;
  for (std::size_t i = 0; i < s.count; ++i) {
    const StencilTap t = entry.symmetry.apply(s.taps[i]);
    taps.add(view.at(pixel % 4 + kWindowMargin + t.dx, pixel / 4 + kWindowMargin + t.dy), static_cast<float>(t.weight) * scale);
  }
  work.taps += taps.count;
  return taps.sum(clamp);
}

// ---- What surrounds a block ---------------------------------------------------------------------------------------

// Four rows of a window in one word, the first in the lowest bits.
std::uint64_t four_rows(const UsableRows& rows, std::size_t first) {
  return rows[first] | std::uint64_t{rows[first + 1]} << 16 | std::uint64_t{rows[first + 2]} << 32 | std::uint64_t{rows[first + 3]} << 48;
}
constexpr std::uint64_t kEachRow = 0x0001000100010001;

UsableRows without_missing(const UsableRows& usable, BlockMask missing) {
  UsableRows rows;
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = static_cast<std::uint16_t>(usable[y] & kWindowColumns);
  for (std::size_t y = 0; y < 4; ++y) rows[y + kWindowMargin] = static_cast<std::uint16_t>(rows[y + kWindowMargin] & ~((missing >> (4 * y) & 15u) << kWindowMargin));
  return rows;
}

// Rows 2k of the block in the low half: which columns of the window the pattern renders.
struct PatternRows {
  unsigned even, odd;
  explicit PatternRows(unsigned corner) : even(columns(corner & 3)), odd(columns(corner >> 2)) {}
  // The block begins at an odd column of the window.
  static unsigned columns(unsigned pair) { return (pair & 1 ? 0x2aau : 0u) | (pair & 2 ? 0x155u : 0u); }
};

bool is_interior(const UsableRows& rows, const PatternRows& pattern, int reach) {
  const std::uint64_t within = ((1u << (4 + 2 * reach)) - 1) << (kWindowMargin - reach);
  const std::uint64_t block = pattern.even | std::uint64_t{pattern.odd} << 16 | std::uint64_t{pattern.even} << 32 | std::uint64_t{pattern.odd} << 48;
  const std::uint64_t around = block << 16 | pattern.odd;  // begins with an odd row
  const std::uint64_t above = ~std::uint64_t{0} << (16 * (kWindowMargin - reach)), below = ~std::uint64_t{0} >> (16 * (kWindowMargin - reach));
  const std::uint64_t difference = (four_rows(rows, 3) ^ block) | ((four_rows(rows, 0) ^ around) & above) | ((four_rows(rows, 6) ^ around) & below);
  return (difference & within * kEachRow) == 0;
}

// The sides beyond which nothing is usable, if what is left is the pattern.
std::optional<unsigned> border_of(const UsableRows& rows, const PatternRows& pattern, int reach) {
  unsigned columns = 0;
  for (const std::uint16_t row : rows) columns |= row;
  const unsigned border = (columns & 0x007 ? 0u : kLeftBorder) | (columns & 0x380 ? 0u : kRightBorder) |
                          (rows[0] | rows[1] | rows[2] ? 0u : kTopBorder) | (rows[7] | rows[8] | rows[9] ? 0u : kBottomBorder);
  unsigned within = ((1u << (4 + 2 * reach)) - 1) << (kWindowMargin - reach);
  if (border & kLeftBorder) within &= ~7u;
  if (border & kRightBorder) within &= 0x7fu;
  const int first = border & kTopBorder ? kWindowMargin : kWindowMargin - reach;
  const int last = border & kBottomBorder ? kWindowMargin + 3 : kWindowMargin + 3 + reach;
  for (int y = first; y <= last; ++y) {
    const unsigned expected = (y + kWindowMargin) & 1 ? pattern.odd : pattern.even;
    if ((rows[static_cast<std::size_t>(y)] ^ expected) & within) return std::nullopt;
  }
  return border;
}

// What a block's pixels are filled with.
struct Plan {
  Reconstruction kernel;
  std::optional<MirroredPattern> pattern;  // set: the tables hold for `border`
  unsigned border = 0;
};

Plan plan_of(Reconstruction kernel, bool packed_weights, const UsableRows& usable) {
  Plan plan{kernel, std::nullopt};
  if (!packed_weights || !has_table(kernel)) return plan;
  const unsigned corner = (usable[kWindowMargin] >> kWindowMargin & 3u) | (usable[kWindowMargin + 1] >> kWindowMargin & 3u) << 2;
  const auto pattern = pattern_of(corner);
  if (!pattern) return plan;
  const PatternRows rows(corner);
  if (is_interior(usable, rows, kernel_reach(kernel))) plan.pattern = pattern;
  else if (const auto border = border_of(usable, rows, kernel_reach(kernel))) plan.pattern = pattern, plan.border = *border;
  return plan;
}

void fill_block(const WindowView& view, const Plan& plan, bool clamp, BlockMask missing, Fill& fill, ReconstructionWork& work) {
  if (plan.pattern && plan.border == 0) return kInteriorFills[static_cast<std::size_t>(plan.kernel)][clamp](*plan.pattern, missing, fill, work);
  for (unsigned left = missing; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const StencilIndexEntry entry = plan.pattern ? mirrored_entry(plan.kernel, plan.border, *plan.pattern, p) : StencilIndexEntry{};
    fill.put(p, entry.stencil == kNoStencil ? fill_directly(view, plan.kernel, clamp, p, work) : fill_from_table(view, entry, clamp, p, work));
  }
}

// Fills those of `missing` again that took NaN or infinity from their surroundings, now without such pixels; returns those
// that have nothing else. The others stay as they are.
BlockMask fill_again(const WindowView& view, const Plan& plan, bool clamp, BlockMask missing, Fill& fill, ReconstructionWork& work) {
  std::array<Vec4, 16> plain;
  Fill again{fill.block, fill.stride, plain.data()};
  ReconstructionWork done_before;
  fill_block(view, plan, false, missing, again, done_before);
  UsableRows finite = view.usable;
  bool any = false;
  for (int y = 0; y < kWindowSide; ++y) {
    auto& row = finite[static_cast<std::size_t>(y)];
    for (unsigned left = row; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      if (is_finite(load(view.at(x, y)))) continue;
      row = static_cast<std::uint16_t>(row & ~(1u << x));
      ++work.non_finite_pixels;
    }
    any = any || row != 0;
  }
  BlockMask unfilled = 0;
  for (unsigned left = missing; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    if (is_finite(load(&plain[static_cast<std::size_t>(p)]))) continue;
    if (any) fill.put(p, fill_directly({view.window, finite}, plan.kernel, clamp, p, work));
    else unfilled = static_cast<BlockMask>(unfilled | 1u << p);
  }
  return unfilled;
}

}  // namespace

BlockMask reconstruct_block(Reconstruction kernel, bool packed_weights, bool clamp, const BlockWindow& window, BlockMask missing, Vec4* out16, ReconstructionWork& work) {
  const UsableRows usable = without_missing(window.usable, missing);
  if (std::all_of(usable.begin(), usable.end(), [](std::uint16_t row) { return row == 0; })) return missing;
  const WindowView view{window, usable};
  const Plan plan = plan_of(kernel, packed_weights, usable);
  Fill fill{view.at(kWindowMargin, kWindowMargin), window.row_stride, out16};
  fill_block(view, plan, clamp, missing, fill, work);
  const BlockMask unfilled = is_finite(fill.zeros) ? BlockMask{0} : fill_again(view, plan, clamp, missing, fill, work);
  work.pixels += static_cast<std::uint64_t>(std::popcount(static_cast<BlockMask>(missing & ~unfilled)));
  return unfilled;
}

std::optional<Stencil> table_stencil(Reconstruction kernel, BlockMask pattern, unsigned border, int pixel) {
  const auto mirrored = pattern_of(corner_of(pattern));
  if (!has_table(kernel) || !mirrored) return std::nullopt;
  const StencilIndexEntry entry = mirrored_entry(kernel, border, *mirrored, pixel);
  if (entry.stencil == kNoStencil) return std::nullopt;
  return stencil_of(entry);
}

StencilTableSize stencil_table_size() { return {generated::kStencils, generated::kStencilBits, std::size(generated::kStencilIndex)}; }

}  // namespace tessera::tilecore
