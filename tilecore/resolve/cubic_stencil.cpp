#include "tilecore/resolve/cubic_stencil.h"

#include <bit>
#include <cstring>

#include "tilecore/resolve/block_pixels.h"
#include "tilecore/resolve/cubic_weights.h"
#include "tilecore/resolve/stencil_kernels.h"
#include "tilecore/resolve/stencil_lookup.h"
#include "tilecore/resolve/tile_border.h"

namespace tessera::tilecore {
namespace {

constexpr unsigned kWindowColumns = (1u << kWindowSide) - 1;

// The pixels that a pattern does not render, by the pattern's corner (see pattern_of()).
constexpr BlockMask left_out_by(unsigned corner) {
  return static_cast<BlockMask>(~(((corner & 3u) * 5u | (corner >> 2) * 0x50u) * 0x101u));
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
  // As pattern_of() wants it, of the four pixels in the block's middle: they have no border's lines.
  unsigned corner() const {
    const auto row = [&](int y) {
      const auto pair = static_cast<unsigned>(middle >> (16 * y + kWindowMargin + 1) & 3u);
      return pair >> 1 | (pair & 1u) << 1;
    };
    return row(2) | row(1) << 2;
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
  // With the columns that border_line() renders besides.
  PatternRows with_lines(unsigned border) const {
    PatternRows lines = *this;
    const unsigned more = border_columns(border);
    if (more & ~(even | odd)) (even != 0 ? lines.even : lines.odd) |= more;
    return lines;
  }
  static unsigned border_columns(unsigned border) {
    return (border & kLeftBorder ? 1u << kWindowMargin : 0u) | (border & kRightBorder ? 8u << kWindowMargin : 0u);
  }
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

// The sides beyond which no pixel is usable; nullopt unless the remaining pixels are the pattern's.
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
  const PatternRows lines = pattern.with_lines(border);
  for (int y = first; y <= last; ++y) {
    unsigned expected = (y + kWindowMargin) & 1 ? lines.odd : lines.even;
    const bool top = y == kWindowMargin && (border & kTopBorder) != 0,
               bottom = y == kWindowMargin + 3 && (border & kBottomBorder) != 0;
    if (top && expected == 0) expected = lines.odd;
    if (bottom && expected == 0) expected = lines.even;
    if (top || bottom) expected |= PatternRows::border_columns(border);
    if ((rows[static_cast<std::size_t>(y)] ^ expected) & within) return std::nullopt;
  }
  return border;
}

FillPlan plan_of(Reconstruction kernel, const UsableRows& usable, unsigned corner) {
  const auto pattern = pattern_of(kernel, corner);
  if (!pattern) return {kernel, std::nullopt};
  const auto border = border_of(usable, PatternRows(corner), kernel_reach(kernel));
  return border ? FillPlan{kernel, pattern, *border} : FillPlan{kernel, std::nullopt};
}

// Fills again, without NaN and infinity in the surroundings, the pixels of `missing` that took such a value from them.
// Returns the pixels that have no other source. Other pixels stay as they are.
BlockMask fill_again(const WindowView& view, const FillPlan& plan, BlockMask missing, Vec4* out16,
                     ReconstructionWork& work) {
  std::array<Vec4, 16> plain;
  ReconstructionWork done_before;
  fill_any(view, plan, missing, plain.data(), done_before);
  UsableRows finite = view.usable;
  bool any = false;
  for (int y = 0; y < kWindowSide; ++y) {
    auto& row = finite[static_cast<std::size_t>(y)];
    for (unsigned left = row; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      if (is_finite(*view.at(x, y))) continue;
      row = static_cast<std::uint16_t>(row & ~(1u << x));
      ++work.non_finite_pixels;
    }
    any = any || row != 0;
  }
  BlockMask spoilt = 0;
  for (unsigned left = missing; left != 0; left &= left - 1)
    if (!is_finite(plain[static_cast<std::size_t>(std::countr_zero(left))]))
      spoilt = static_cast<BlockMask>(spoilt | (left & -left));
  if (!any) return spoilt;
  fill_any({view.window, finite}, {plan.kernel, std::nullopt}, spoilt, out16, work);
  return 0;
}

}  // namespace

BlockMask reconstruct_block(Reconstruction kernel, const BlockWindow& window, BlockMask missing, Vec4* out16,
                            ReconstructionWork& work) {
  const RowWords words(window.usable, missing);
  if (!words.any()) return missing;
  bool finite = true;
  // 1. Most blocks lie amid others of their rate.
  const auto pattern = pattern_of(kernel, words.corner());
  const bool interior = pattern && is_interior(words, PatternRows(words.corner()), kernel_reach(kernel));
  if (interior) {
    const Vec4* first = window.first_pixel + kWindowMargin * window.row_stride + kWindowMargin;
    const InteriorFill fill = fill_interior(
        kernel, {*pattern, missing, missing == left_out_by(words.corner()), first, window.row_stride, out16});
    work.taps += fill.taps;
    finite = fill.finite;
    if (finite) {
      work.pixels += pixel_count(missing);
      return 0;
    }
  }
  // 2. Fills all others, and pixels that took NaN or infinity from their surroundings.
  const UsableRows usable = without_missing(window.usable, missing);
  const WindowView view{window, usable};
  const FillPlan plan = interior ? FillPlan{kernel, pattern, 0} : plan_of(kernel, usable, words.corner());
  if (!interior) finite = fill_any(view, plan, missing, out16, work);
  const BlockMask unfilled = finite ? BlockMask{0} : fill_again(view, plan, missing, out16, work);
  work.pixels += pixel_count(static_cast<BlockMask>(missing & ~unfilled));
  return unfilled;
}

std::optional<Stencil> table_stencil(Reconstruction kernel, BlockMask pattern, unsigned border, int pixel) {
  const auto mirrored = pattern_of(kernel, corner_of(pattern));
  if (!mirrored) return std::nullopt;
  const StencilIndexEntry entry = mirrored_entry(kernel, border, *mirrored, pixel);
  if (entry.stencil == kNoStencil) return std::nullopt;
  return stencil_of(entry);
}

StencilTableSize stencil_table_size() {
  return {generated::kStencils, generated::kStencilBits, std::size(generated::kStencilIndex)};
}

// ---- Checkerboard -----------------------------------------------------------------------------------------------

namespace {

// The up to four neighbours that may be used.
struct Cross {
  std::array<Vec4, 4> color;
  std::size_t count = 0;

  // Differences from the first: a flat colour is exact.
  Vec4 mean() const {
    Vec4 sum(0.0f);
    for (std::size_t i = 1; i < count; ++i) sum += color[i] - color[0];
    return color[0] + sum / static_cast<float>(count);
  }
};

bool is_usable(const BlockWindow& window, BlockMask missing, int x, int y) {
  const int bx = x - kWindowMargin, by = y - kWindowMargin;
  if (bx >= 0 && bx < 4 && by >= 0 && by < 4 && (missing >> (4 * by + bx) & 1)) return false;
  return window.usable[static_cast<std::size_t>(y)] >> x & 1;
}

Cross gather(const BlockWindow& window, BlockMask missing, int x, int y, ReconstructionWork& work) {
  constexpr int kSteps[4][2] = {{0, -1}, {-1, 0}, {1, 0}, {0, 1}};
  Cross cross;
  for (const auto& step : kSteps) {
    const int nx = x + step[0], ny = y + step[1];
    if (!is_usable(window, missing, nx, ny)) continue;
    ++work.taps;
    const Vec4& color = window.first_pixel[ny * window.row_stride + nx];
    if (is_finite(color))
      cross.color[cross.count++] = color;
    else
      ++work.non_finite_pixels;
  }
  return cross;
}

}  // namespace

BlockMask reconstruct_checkerboard(const BlockWindow& window, BlockMask missing, Vec4* out16,
                                   ReconstructionWork& work) {
  BlockMask unfilled = 0;
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const Cross cross = gather(window, missing, p % 4 + kWindowMargin, p / 4 + kWindowMargin, work);
    if (cross.count == 0) {
      unfilled = static_cast<BlockMask>(unfilled | 1u << p);
      continue;
    }
    ++work.pixels;
    out16[p] = cross.mean();
  }
  return unfilled;
}

}  // namespace tessera::tilecore
