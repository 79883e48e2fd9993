#include "tilecore/resolve/cubic_stencil.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "tilecore/resolve/channels.h"
#include "tilecore/resolve/cubic_weights.h"
#include "tilecore/resolve/interior_stencils.h"
#include "tilecore/resolve/stencil_lookup.h"

namespace tessera::tilecore {
namespace {

// ---- Four channels ----------------------------------------------------------------------------------------------

Channels lower(const Channels& a, const Channels& b) { return a < b ? a : b; }
Channels upper(const Channels& a, const Channels& b) { return a < b ? b : a; }

// The value before and after clamping: an infinite tap shows in the first, but the second may hide it.
struct Result {
  Channels plain, clamped;
};

// ---- Regular surroundings: stencils known when this is compiled ---------------------------------------------------

template <Stencil S, std::size_t First, std::size_t Count>
[[gnu::always_inline]] inline Channels sum_of_taps(const Vec4* center, std::ptrdiff_t stride) {
  if constexpr (Count == 1)
    return load(center + S.taps[First].dy * stride + S.taps[First].dx);
  else
    return sum_of_taps<S, First, Count / 2>(center, stride) +
           sum_of_taps<S, First + Count / 2, Count - Count / 2>(center, stride);
}

// One product per different weight. Counts are powers of two, so the sums of a flat colour are exact.
template <Stencil S, std::size_t First = 0>
[[gnu::always_inline]] inline Channels weighted_sum(const Vec4* center, std::ptrdiff_t stride) {
  constexpr std::size_t kCount = equal_weights(S, First);
  static_assert(std::has_single_bit(kCount));
  constexpr float kWeight = static_cast<float>(S.taps[First].weight) / static_cast<float>(S.unit());
  const Channels product = sum_of_taps<S, First, kCount>(center, stride) * kWeight;
  if constexpr (First + kCount == S.count)
    return product;
  else
    return product + weighted_sum<S, First + kCount>(center, stride);
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

// Without the population count that the oldest x86-64 lacks: there std::popcount is a call.
constexpr std::uint64_t pixel_count(BlockMask pixels) {
  unsigned n = pixels - (pixels >> 1 & 0x5555u);
  n = (n & 0x3333u) + (n >> 2 & 0x3333u);
  n = (n + (n >> 4)) & 0x0f0fu;
  return (n + (n >> 8)) & 31u;
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

// Patterns repeat every two rows, so pixels p and p + 8 have the same stencil: both before anything is stored, since
// they share taps and sums of taps.
template <Stencil S, bool Clamp>
void fill_pixels(BlockMask pixels, Fill& fill, ReconstructionWork& work) {
  work.taps += S.count * pixel_count(pixels);
  Channels zeros = fill.zeros;  // in a register while the block is filled
  const unsigned pairs = pixels & pixels >> 8;
  for (unsigned left = pairs; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const Result above = apply<S, Clamp>(fill.at(p), fill.stride), below = apply<S, Clamp>(fill.at(p + 8), fill.stride);
    zeros += (above.plain - above.plain) + (below.plain - below.plain);
    store(above.clamped, fill.out + p);
    store(below.clamped, fill.out + p + 8);
  }
  for (unsigned left = pixels & ~(pairs | pairs << 8); left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const Result r = apply<S, Clamp>(fill.at(p), fill.stride);
    zeros += r.plain - r.plain;
    store(r.clamped, fill.out + p);
  }
  fill.zeros = zeros;
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
    {fill_interior<Reconstruction::kCubicInterpolating, false>,
     fill_interior<Reconstruction::kCubicInterpolating, true>},
};

// The pixels that a pattern does not render, by its corner (see pattern_of()).
constexpr BlockMask left_out_by(unsigned corner) {
  return static_cast<BlockMask>(~(((corner & 3u) * 5u | (corner >> 2) * 0x50u) * 0x101u));
}

// `whole`: `missing` is all that the pattern leaves out. False: some result is not finite.
bool fill_amid_others(Reconstruction kernel, const MirroredPattern& pattern, bool clamp, BlockMask missing, bool whole,
                      Fill& fill, ReconstructionWork& work) {
  if (whole && !clamp) {
    const WideFill wide = fill_interior_block(kernel, pattern, fill.block, fill.stride, fill.out);
    work.taps += wide.taps;
    if (wide.taps > 0) return wide.finite;
  }
  kInteriorFills[static_cast<std::size_t>(kernel)][clamp](pattern, missing, fill, work);
  return is_finite(fill.zeros);
}

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
    for (std::size_t d = 0; d <= kWindowMargin; ++d)
      k[r][d] = static_cast<float>(kernel_weight(static_cast<Reconstruction>(r), static_cast<int>(d)));
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
    all[static_cast<std::size_t>(i)] = {static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy),
                                        static_cast<std::int16_t>(dx * dx + dy * dy)};
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
    if (x < 0 || y < 0 || x >= kWindowSide || y >= kWindowSide || !(view.usable[static_cast<std::size_t>(y)] >> x & 1))
      continue;
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
  const unsigned within = (1u << (2 * reach + 1)) - 1;
  for (int dy = -reach; dy <= reach; ++dy) {
    const float wy = k[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
    const unsigned row = view.usable[static_cast<std::size_t>(cy + dy)] >> (cx - reach) & within;
    for (unsigned left = row; left != 0; left &= left - 1) {
      const int dx = std::countr_zero(left) - reach;
      const float w = k[static_cast<std::size_t>(dx < 0 ? -dx : dx)] * wy;
      if (w == 0.0f) continue;
      taps.add(view.at(cx + dx, cy + dy), w);
      sum += w;
      magnitude += w < 0 ? -w : w;
    }
  }
  taps.holds = taps.count > 0 && sum >= static_cast<float>(kMinimumDenominator) * magnitude;
  const float scale = 1.0f / sum;
  for (std::size_t i = 0; i < taps.count; ++i) taps.taps[i].weight *= scale;
  return taps;
}

Result fill_directly(const WindowView& view, Reconstruction kernel, bool clamp, int pixel, ReconstructionWork& work) {
  ++work.direct_pixels;
  const bool nearest = kernel == Reconstruction::kNearest;
  const TapList taps = nearest ? TapList() : kernel_taps(view, kernel, pixel);
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

// TapList::sum() without the list: stencils have their largest weight first.
template <bool Clamp>
Result fill_from_table(const WindowView& view, const StencilIndexEntry& entry, int pixel, ReconstructionWork& work) {
  const Stencil& s = kStencils[entry.stencil];
  const float scale = 1.0f / static_cast<float>(s.unit());
  const Vec4* center = view.at(pixel % 4 + kWindowMargin, pixel / 4 + kWindowMargin);
  const auto tap = [&](std::size_t i) {
    const StencilTap t = entry.symmetry.apply(s.taps[i]);
    return load(center + t.dy * view.window.row_stride + t.dx);
  };
  work.taps += s.count;
  const Channels base = tap(0);
  Channels difference{}, low = base, high = base;
  for (std::size_t i = 1; i < s.count; ++i) {
    const Channels c = tap(i);
    difference += (c - base) * (static_cast<float>(s.taps[i].weight) * scale);
    if constexpr (Clamp) low = lower(low, c), high = upper(high, c);
  }
  // A lone tap is copied, -0 too.
  Result r{s.count == 1 ? base : base + difference, {}};
  r.clamped = Clamp ? lower(upper(r.plain, low), high) : r.plain;
  return r;
}

// ---- What surrounds a block ---------------------------------------------------------------------------------------

// The window's rows in words of four, the first in the lowest bits: rows 0-3, 3-6 and 6-9. The pixels to fill are
// cleared in the middle word only; the others are asked for the rows beyond the block.
struct RowWords {
  std::uint64_t top, middle, bottom;

  RowWords(const UsableRows& rows, BlockMask missing) {
    static_assert(std::endian::native == std::endian::little);
    std::memcpy(&top, &rows[0], sizeof top);
    std::memcpy(&middle, &rows[3], sizeof middle);
    std::memcpy(&bottom, &rows[6], sizeof bottom);
    std::uint64_t spread = (missing | std::uint64_t{missing} << 24) & 0x000000ff000000ff;
    spread = (spread | spread << 12) & 0x000f000f000f000f;
    middle &= ~(spread << kWindowMargin);
  }
  bool any() const { return ((top << 16 | middle | bottom >> 16) & kWindowColumns * kEachRow) != 0; }
  // As pattern_of() wants it.
  unsigned corner() const {
    return static_cast<unsigned>((middle >> kWindowMargin & 3u) | (middle >> (16 + kWindowMargin) & 3u) << 2);
  }

  static constexpr std::uint64_t kEachRow = 0x0001000100010001;
};

UsableRows without_missing(const UsableRows& usable, BlockMask missing) {
  UsableRows rows;
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = static_cast<std::uint16_t>(usable[y] & kWindowColumns);
  for (std::size_t y = 0; y < 4; ++y)
    rows[y + kWindowMargin] =
        static_cast<std::uint16_t>(rows[y + kWindowMargin] & ~((missing >> (4 * y) & 15u) << kWindowMargin));
  return rows;
}

// Rows 2k of the block in the low half: which columns of the window the pattern renders.
struct PatternRows {
  unsigned even, odd;
  explicit PatternRows(unsigned corner) : even(columns(corner & 3)), odd(columns(corner >> 2)) {}
  // The block begins at an odd column of the window.
  static unsigned columns(unsigned pair) { return (pair & 1 ? 0x2aau : 0u) | (pair & 2 ? 0x155u : 0u); }
};

bool is_interior(const RowWords& rows, const PatternRows& pattern, int reach) {
  const std::uint64_t within = (((1u << (4 + 2 * reach)) - 1) << (kWindowMargin - reach)) * RowWords::kEachRow;
  const std::uint64_t block = pattern.even | std::uint64_t{pattern.odd} << 16 | std::uint64_t{pattern.even} << 32 |
                              std::uint64_t{pattern.odd} << 48;
  const std::uint64_t around = block << 16 | pattern.odd;  // begins with an odd row
  const std::uint64_t above = ~std::uint64_t{0} >> 16 & ~std::uint64_t{0} << (16 * (kWindowMargin - reach));
  const std::uint64_t below = ~std::uint64_t{0} << 16 & ~std::uint64_t{0} >> (16 * (kWindowMargin - reach));
  return ((((rows.top ^ around) & above) | (rows.middle ^ block) | ((rows.bottom ^ around) & below)) & within) == 0;
}

// The sides beyond which nothing is usable, if what is left is the pattern.
std::optional<unsigned> border_of(const UsableRows& rows, const PatternRows& pattern, int reach) {
  unsigned columns = 0;
  for (const std::uint16_t row : rows) columns |= row;
  const unsigned border = (columns & 0x007 ? 0u : kLeftBorder) | (columns & 0x380 ? 0u : kRightBorder) |
                          (rows[0] | rows[1] | rows[2] ? 0u : kTopBorder) |
                          (rows[7] | rows[8] | rows[9] ? 0u : kBottomBorder);
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

Plan plan_of(Reconstruction kernel, bool packed_weights, const UsableRows& usable, unsigned corner) {
  const auto pattern = packed_weights && has_table(kernel) ? pattern_of(corner) : std::nullopt;
  if (!pattern) return {kernel, std::nullopt};
  const auto border = border_of(usable, PatternRows(corner), kernel_reach(kernel));
  return border ? Plan{kernel, pattern, *border} : Plan{kernel, std::nullopt};
}

void fill_block(const WindowView& view, const Plan& plan, bool clamp, BlockMask missing, Fill& fill,
                ReconstructionWork& work) {
  for (unsigned left = missing; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const StencilIndexEntry entry =
        plan.pattern ? mirrored_entry(plan.kernel, plan.border, *plan.pattern, p) : StencilIndexEntry{};
    fill.put(p, entry.stencil == kNoStencil ? fill_directly(view, plan.kernel, clamp, p, work)
                : clamp                     ? fill_from_table<true>(view, entry, p, work)
                                            : fill_from_table<false>(view, entry, p, work));
  }
}

// Fills those of `missing` again that took NaN or infinity from their surroundings, now without such pixels; returns
// those that have nothing else. The others stay as they are.
BlockMask fill_again(const WindowView& view, const Plan& plan, bool clamp, BlockMask missing, Fill& fill,
                     ReconstructionWork& work) {
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
    if (any)
      fill.put(p, fill_directly({view.window, finite}, plan.kernel, clamp, p, work));
    else
      unfilled = static_cast<BlockMask>(unfilled | 1u << p);
  }
  return unfilled;
}

}  // namespace

BlockMask reconstruct_block(Reconstruction kernel, bool packed_weights, bool clamp, const BlockWindow& window,
                            BlockMask missing, Vec4* out16, ReconstructionWork& work) {
  const RowWords words(window.usable, missing);
  if (!words.any()) return missing;
  Fill fill{window.first_pixel + kWindowMargin * window.row_stride + kWindowMargin, window.row_stride, out16};
  bool finite = true;
  // 1. Most blocks lie amid others of their rate.
  const auto pattern = packed_weights && has_table(kernel) ? pattern_of(words.corner()) : std::nullopt;
  const bool interior = pattern && is_interior(words, PatternRows(words.corner()), kernel_reach(kernel));
  if (interior) {
    finite = fill_amid_others(kernel, *pattern, clamp, missing, missing == left_out_by(words.corner()), fill, work);
    if (finite) {
      work.pixels += pixel_count(missing);
      return 0;
    }
  }
  // 2. Any others, and what took NaN or infinity from its surroundings.
  const UsableRows usable = without_missing(window.usable, missing);
  const WindowView view{window, usable};
  const Plan plan = interior ? Plan{kernel, pattern, 0} : plan_of(kernel, packed_weights, usable, words.corner());
  if (!interior) {
    fill_block(view, plan, clamp, missing, fill, work);
    finite = is_finite(fill.zeros);
  }
  const BlockMask unfilled = finite ? BlockMask{0} : fill_again(view, plan, clamp, missing, fill, work);
  work.pixels += pixel_count(static_cast<BlockMask>(missing & ~unfilled));
  return unfilled;
}

}  // namespace tessera::tilecore
