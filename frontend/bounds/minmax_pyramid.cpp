#include "frontend/bounds/minmax_pyramid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tessera::frontend {
namespace {

// floor of a number that an integer holds: without SSE4.1 std::floor is a call.
std::int64_t floor_to_integer(double x) {
  const auto truncated = static_cast<std::int64_t>(x);
  return truncated - (static_cast<double>(truncated) > x ? 1 : 0);
}

// Pieces of one axis, in texels of level 0, inclusive; up to two after wrapping.
struct Pieces {
  int count = 0;
  int first[2] = {}, last[2] = {};
  void add(int a, int b) {
    first[count] = a;
    last[count] = b;
    ++count;
  }
};

Pieces wrapped_pieces(shaders::Wrap wrap, double low, double high, int size) {
  Pieces pieces;
  // Also true for NaN and for numbers that no integer holds.
  const bool everything = !(high - low < size) || !(std::abs(low) < 1e15) || !(std::abs(high) < 1e15);
  const auto a = everything ? std::int64_t{0} : floor_to_integer(low);
  const auto b = everything ? std::int64_t{0} : floor_to_integer(high);
  if (!everything && a >= 0 && b < size) {
    pieces.add(static_cast<int>(a), static_cast<int>(b));
    return pieces;
  }
  if (wrap == shaders::Wrap::kClampToEdge && !everything) {
    pieces.add(shaders::wrap_texel(wrap, a, size), shaders::wrap_texel(wrap, b, size));
    return pieces;
  }
  if (everything || b - a + 1 >= size) {
    pieces.add(0, size - 1);
    return pieces;
  }
  if (wrap == shaders::Wrap::kRepeat) {
    // Into the first period, without an integer division.
    std::int64_t start = a - floor_to_integer(low / size) * size;
    if (start < 0) start += size;
    if (start >= size) start -= size;
    const auto first = static_cast<int>(start), last = static_cast<int>(start + (b - a));
    if (last < size) {
      pieces.add(first, last);
    } else {
      pieces.add(first, size - 1);
      pieces.add(0, last - size);
    }
    return pieces;
  }
  const int first = shaders::wrap_texel(wrap, a, size), last = shaders::wrap_texel(wrap, b, size);
  // Mirrored: within one period the footprint turns at most once, at an end of the texture, or lies in one direction.
  const auto period_of = [&](std::int64_t i) { return i >= 0 ? i / size : (i - size + 1) / size; };
  const int low_texel = std::min(first, last), high_texel = std::max(first, last);
  if (period_of(a) == period_of(b)) {
    pieces.add(low_texel, high_texel);
  } else {
    // It turns between two periods: at the high end when leaving an even one.
    const bool at_high_end = (period_of(a) & 1) == 0;
    pieces.add(at_high_end ? low_texel : 0, at_high_end ? size - 1 : high_texel);
  }
  return pieces;
}

// Largest effect of the rounding of a coordinate's own float arithmetic, in texels: a few units in the last place of it
// and of its products.
double coordinate_slack(double from, double to, int size) {
  return 0x1p-20 * size * (1 + std::abs(from) + std::abs(to)) + 0x1p-10;
}

// The common case: all texels that bilinear lookups in [a, b] read, in one piece that does not leave the texture, or
// only after whole periods of a repeating one.
bool inner_texels(shaders::Wrap wrap, float a, float b, int size, int& first, int& last) {
  double from = static_cast<double>(a), to = static_cast<double>(b);
  if (!(std::abs(from) < 1e9 && std::abs(to) < 1e9)) return false;
  const double margin = 0.5 + coordinate_slack(from, to, size);
  if (wrap == shaders::Wrap::kRepeat) {
    const auto period = static_cast<double>(floor_to_integer(from));
    from -= period;
    to -= period;
  }
  const double low = from * size - margin, high = to * size + margin;
  if (!(low >= 0 && high < size)) return false;
  first = static_cast<int>(low);
  last = static_cast<int>(high);
  return true;
}

// Clamps to [0, 1]; NaN and infinities stay.
float clamp_finite(float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : x; }

// A filtered value is a convex combination of texels up to rounding: 4 + 4 products and sums per level and 3 between
// levels at u = 2^-24 stay below 2^-19. The means that make a coarser level round by less than 2^-15 against level 0.
constexpr float kFilterSlack = 0x1p-19f, kMipSlack = 0x1p-15f;

ValueRange widen(const ValueRange& r, float slack) {
  const float grow = std::max(std::abs(r.low), std::abs(r.high)) * slack;
  return {r.low - grow, r.high + grow};
}

// Which texels along an axis of a level the coordinates [a, b] concern: bilinear lookups read from half a texel below
// to `above` texels beyond.
Pieces footprint_pieces(shaders::Wrap wrap, float a, float b, int size, double below, double above) {
  // Coordinates outside a clamped texture read its edge texel.
  if (wrap == shaders::Wrap::kClampToEdge) a = clamp_finite(a), b = clamp_finite(b);
  const double from = static_cast<double>(a), to = static_cast<double>(b);
  const double slack = coordinate_slack(from, to, size);
  const double first = from * size - below - slack, last = std::max(to * size + above + slack, first);
  if (!(std::abs(first) < 1e15 && std::abs(last) < 1e15)) return wrapped_pieces(wrap, -1e300, 1e300, size);
  return wrapped_pieces(wrap, first, last, size);
}

ValueRange over(const WindowTable& table, const Pieces& columns, const Pieces& rows, HeightTableCache* fetches) {
  ValueRange range = table.over(columns.first[0], rows.first[0], columns.last[0], rows.last[0], fetches);
  if (columns.count == 1 && rows.count == 1) return range;
  for (int j = 0; j < rows.count; ++j)
    for (int i = 0; i < columns.count; ++i)
      if (i + j > 0)
        range = range.hull(table.over(columns.first[i], rows.first[j], columns.last[i], rows.last[j], fetches));
  return range;
}

// All texels that bilinear lookups in the box read.
ValueRange lookups(const WindowTable& table, const shaders::Sampler& sampler, Vec2 low, Vec2 high,
                   HeightTableCache* fetches) {
  int x0, x1, y0, y1;
  if (inner_texels(sampler.wrap_s, low.x, high.x, table.width(), x0, x1) &&
      inner_texels(sampler.wrap_t, low.y, high.y, table.height(), y0, y1))
    return table.over(x0, y0, x1, y1, fetches);
  return over(table, footprint_pieces(sampler.wrap_s, low.x, high.x, table.width(), 0.5, 0.5),
              footprint_pieces(sampler.wrap_t, low.y, high.y, table.height(), 0.5, 0.5), fetches);
}

float texel(const shaders::ScalarTexture::Level& level, int x, int y) {
  return level
      .values[static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) + static_cast<std::size_t>(x)];
}

// Differences of every texel to the next along one axis; the last goes on at the first, as repeating textures do
// (mirrored and clamped ones go on level).
WindowTable differences(const shaders::ScalarTexture::Level& level, int step_x, int step_y) {
  return WindowTable(level.width, level.height, [&](int x, int y) {
    const float change = texel(level, (x + step_x) % level.width, (y + step_y) % level.height) - texel(level, x, y);
    return ValueRange{change, change};
  });
}

// The position of a lod between two levels: the finer level, and the weight of the coarser.
struct BetweenLevels {
  std::size_t below;
  float weight;
};
BetweenLevels between_levels(float lod, std::size_t count) {
  const float level = lod > 0.0f ? std::min(lod, static_cast<float>(count - 1)) : 0.0f;
  const auto below = static_cast<std::size_t>(level);
  return {below, level - static_cast<float>(below)};
}

}  // namespace

MinMaxPyramid::MinMaxPyramid(const shaders::ScalarTexture& texture) {
  for (const auto& level : texture.levels())
    levels_.emplace_back(level.width, level.height, [&](int x, int y) {
      const float value = texel(level, x, y);
      return ValueRange{value, value};
    });
}

ValueRange MinMaxPyramid::whole() const { return widen(levels_.front().whole(), kMipSlack); }

ValueRange MinMaxPyramid::query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod,
                                HeightTableCache* fetches) const {
  const auto [below, weight] = between_levels(lod, levels_.size());
  const ValueRange fine = lookups(levels_[below], sampler, low, high, fetches);
  if (weight == 0.0f) return widen(fine, kFilterSlack);
  return between(fine, lookups(levels_[below + 1], sampler, low, high, fetches), weight);
}

void MinMaxPyramid::query(const shaders::Sampler& sampler, std::span<HeightLookup> lookups_of,
                          HeightTableCache* fetches) const {
  WindowPlaces places;
  places.s.repeats = sampler.wrap_s == shaders::Wrap::kRepeat;
  places.t.repeats = sampler.wrap_t == shaders::Wrap::kRepeat;
  // Each lookup takes two places, one for each level; unused lanes of a vector look nothing up.
  std::size_t count = 0;
  const auto add = [&](const HeightLookup& lookup, const WindowTable& level) {
    places.s.low[count] = lookup.low.x, places.s.high[count] = lookup.high.x;
    places.t.low[count] = lookup.low.y, places.t.high[count] = lookup.high.y;
    places.s.size[count] = level.width(), places.t.size[count] = level.height();
    places.steps[count++] = level.step_count();
  };
  for (const HeightLookup& lookup : lookups_of) {
    const auto [below, weight] = between_levels(lookup.lod, levels_.size());
    add(lookup, levels_[below]);
    add(lookup, levels_[below + (weight > 0.0f ? 1 : 0)]);
  }
  const std::size_t used = count;
  while (count % 8 != 0) add({}, levels_.back());
  find_windows(places, used);
  for (std::size_t k = 0; k < lookups_of.size(); ++k) {
    HeightLookup& lookup = lookups_of[k];
    if (fetches != nullptr) fetches->postpone(lookup.fetched);
    const auto [below, weight] = between_levels(lookup.lod, levels_.size());
    const auto found = [&](std::size_t level, std::size_t place) {
      if (places.found[place] != 0) return levels_[level].joined(places, place, fetches);
      return lookups(levels_[level], sampler, lookup.low, lookup.high, fetches);
    };
    const ValueRange fine = found(below, 2 * k);
    lookup.heights = weight == 0.0f ? widen(fine, kFilterSlack) : between(fine, found(below + 1, 2 * k + 1), weight);
  }
  if (fetches != nullptr) fetches->postpone(nullptr);
}

ValueRange MinMaxPyramid::between(const ValueRange& fine, const ValueRange& coarse, float weight) {
  const ValueRange mixed = {fine.low * (1.0f - weight) + coarse.low * weight,
                            fine.high * (1.0f - weight) + coarse.high * weight};
  // Slack by the largest value that enters: the mixed one may have cancelled.
  const ValueRange all = widen(fine.hull(coarse), 2 * kFilterSlack);
  const float grow = std::max(fine.hull(coarse).low - all.low, all.high - fine.hull(coarse).high);
  return {mixed.low - grow, mixed.high + grow};
}

ValueRange MinMaxPyramid::query_all(const shaders::Sampler& sampler, Vec2 low, Vec2 high) const {
  ValueRange all = query(sampler, low, high, 0.0f);
  for (std::size_t level = 1; level < levels_.size(); ++level)
    all = all.hull(query(sampler, low, high, static_cast<float>(level)));
  // Between two levels: mixed once more, see query().
  const ValueRange wider = widen(all, kFilterSlack);
  return wider;
}

std::uint64_t MinMaxPyramid::place(std::uint64_t address) {
  texels_.clear();
  for (WindowTable& level : levels_) {
    texels_.push_back(address);
    address += static_cast<std::uint64_t>(level.width()) * static_cast<std::uint64_t>(level.height()) * sizeof(float);
  }
  for (WindowTable& level : levels_) address = level.place(address);
  return address;
}

void MinMaxPyramid::fetch_texels(const shaders::Sampler& sampler, Vec2 at, float lod, HeightTableCache& fetches) const {
  const auto [below, weight] = between_levels(lod, levels_.size());
  for (std::size_t l = below; l <= below + (weight > 0.0f ? 1 : 0); ++l) {
    const WindowTable& level = levels_[l];
    const auto u = shaders::linear_texels(sampler.wrap_s, at.x, level.width()),
               v = shaders::linear_texels(sampler.wrap_t, at.y, level.height());
    for (const int y : {v.first, v.second})
      for (const int x : {u.first, u.second})
        fetches.fetch(texels_[l] + (static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(level.width()) +
                                    static_cast<std::uint64_t>(x)) *
                                       sizeof(float));
  }
}

// ---- Slopes -----------------------------------------------------------------------------------------------------

SlopePyramid::SlopePyramid(const shaders::ScalarTexture& texture) {
  for (const auto& level : texture.levels()) levels_.push_back({differences(level, 1, 0), differences(level, 0, 1)});
}

std::uint64_t SlopePyramid::place(std::uint64_t address) {
  for (Level& level : levels_) address = level.along_t.place(level.along_s.place(address));
  return address;
}

HeightSlopes SlopePyramid::of_level(const Level& level, const shaders::Sampler& sampler, Vec2 low, Vec2 high,
                                    HeightTableCache* fetches) {
  // A lookup lies between a texel and the next; the first texel's entry holds their difference. Mirroring turns
  // differences round, to the texel on their other side. Beyond the edge of a clamped texture, and at the edge of a
  // mirrored one, the slope is zero.
  const auto pieces = [](shaders::Wrap wrap, float a, float b, int size, bool along) {
    const double above = along && wrap == shaders::Wrap::kRepeat ? -0.5 : 0.5;
    return footprint_pieces(wrap, a, b, size, 0.5, above);
  };
  const auto query = [&](const WindowTable& table, bool along_s) {
    const shaders::Wrap wrap = along_s ? sampler.wrap_s : sampler.wrap_t;
    ValueRange range = over(table, pieces(sampler.wrap_s, low.x, high.x, table.width(), along_s),
                            pieces(sampler.wrap_t, low.y, high.y, table.height(), !along_s), fetches);
    if (wrap == shaders::Wrap::kClampToEdge) range = range.hull({0, 0});
    if (wrap == shaders::Wrap::kMirroredRepeat) range = {-range.largest(), range.largest()};
    const float grow = range.largest() * kFilterSlack,
                size = static_cast<float>(along_s ? table.width() : table.height());
    return ValueRange{(range.low - grow) * size, (range.high + grow) * size};
  };
  return {query(level.along_s, true), query(level.along_t, false)};
}

HeightSlopes SlopePyramid::query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod,
                                 HeightTableCache* fetches) const {
  const auto [below, weight] = between_levels(lod, levels_.size());
  const HeightSlopes fine = of_level(levels_[below], sampler, low, high, fetches);
  if (weight == 0.0f) return fine;
  const HeightSlopes coarse = of_level(levels_[below + 1], sampler, low, high, fetches);
  const float part = weight;  // Clang 14 captures no structured bindings
  const auto mix = [part](const ValueRange& a, const ValueRange& b) {
    const ValueRange mixed = {a.low * (1.0f - part) + b.low * part, a.high * (1.0f - part) + b.high * part};
    const float grow = a.hull(b).largest() * kFilterSlack;
    return ValueRange{mixed.low - grow, mixed.high + grow};
  };
  return {mix(fine.along_s, coarse.along_s), mix(fine.along_t, coarse.along_t)};
}

// ---- Differences of levels --------------------------------------------------------------------------------------

namespace {

// Along an axis, where lookups at the two ends of a texel of the finer level and at its middle read in a level with `ratio`
// times as many texels, continued beyond the edge as repeating or as other textures do: texels, and the second one's share.
struct HalfTexels {
  HalfTexels(int texel, double ratio, int size, bool repeat) {
    const shaders::Wrap wrap = repeat ? shaders::Wrap::kRepeat : shaders::Wrap::kClampToEdge;
    for (int k = 0; k < 3; ++k) {
      const double at = (texel + 0.5 * k) * ratio - 0.5;
      const std::int64_t below = floor_to_integer(at);
      first[k] = shaders::wrap_texel(wrap, below, size), second[k] = shaders::wrap_texel(wrap, below + 1, size);
      share[k] = at - static_cast<double>(below);
    }
  }
  int first[3], second[3];
  double share[3];
};

double bilinear(const shaders::ScalarTexture::Level& level, const HalfTexels& x, int i, const HalfTexels& y, int j) {
  const auto at = [&](int column, int row) { return static_cast<double>(texel(level, column, row)); };
  const double s = x.share[i], t = y.share[j];
  return (at(x.first[i], y.first[j]) * (1 - s) + at(x.second[i], y.first[j]) * s) * (1 - t) +
         (at(x.first[i], y.second[j]) * (1 - s) + at(x.second[i], y.second[j]) * s) * t;
}

// Over one texel of the finer level. Halved exactly, both levels are bilinear between half texels of the finer one, so
// that the difference is largest at nine of them. An odd side has no such common grid: then the ranges' difference.
ValueRange level_difference(const shaders::ScalarTexture::Level& fine, const shaders::ScalarTexture::Level& coarse,
                            int x, int y) {
  const double ratio_x = static_cast<double>(coarse.width) / fine.width,
               ratio_y = static_cast<double>(coarse.height) / fine.height;
  const auto exact = [](int of_fine, int of_coarse) { return of_fine == 2 * of_coarse || of_fine == 1; };
  const bool edge = x == 0 || y == 0 || x == fine.width - 1 || y == fine.height - 1;
  ValueRange range{1e30f, -1e30f};
  if (exact(fine.width, coarse.width) && exact(fine.height, coarse.height)) {
    for (int repeat = edge ? 0 : 1; repeat < 2; ++repeat) {
      const HalfTexels fine_x(x, 1, fine.width, repeat != 0), fine_y(y, 1, fine.height, repeat != 0),
          coarse_x(x, ratio_x, coarse.width, repeat != 0), coarse_y(y, ratio_y, coarse.height, repeat != 0);
      for (int j = 0; j <= 2; ++j)
        for (int i = 0; i <= 2; ++i) {
          const auto difference =
              static_cast<float>(bilinear(fine, fine_x, i, fine_y, j) - bilinear(coarse, coarse_x, i, coarse_y, j));
          range = range.hull({difference, difference});
        }
    }
    return range;
  }
  const auto values = [&](const shaders::ScalarTexture::Level& level, double from_x, double from_y, double to_x,
                          double to_y) {
    ValueRange found{1e30f, -1e30f};
    for (std::int64_t j = floor_to_integer(from_y - 0.5); static_cast<double>(j) <= to_y + 0.5; ++j)
      for (std::int64_t i = floor_to_integer(from_x - 0.5); static_cast<double>(i) <= to_x + 0.5; ++i)
        for (const shaders::Wrap wrap : {shaders::Wrap::kRepeat, shaders::Wrap::kClampToEdge}) {
          const float value =
              texel(level, shaders::wrap_texel(wrap, i, level.width), shaders::wrap_texel(wrap, j, level.height));
          found = found.hull({value, value});
        }
    return found;
  };
  const ValueRange a = values(fine, x, y, x + 1, y + 1),
                   b = values(coarse, x * ratio_x, y * ratio_y, (x + 1) * ratio_x, (y + 1) * ratio_y);
  return {a.low - b.high, a.high - b.low};
}

}  // namespace

LevelDifferences::LevelDifferences(const shaders::ScalarTexture& texture) {
  for (std::size_t l = 0; l + 1 < texture.levels().size(); ++l) {
    const auto &fine = texture.levels()[l], &coarse = texture.levels()[l + 1];
    levels_.emplace_back(fine.width, fine.height, [&](int x, int y) { return level_difference(fine, coarse, x, y); });
  }
}

std::uint64_t LevelDifferences::place(std::uint64_t address) {
  for (WindowTable& level : levels_) address = level.place(address);
  return address;
}

float LevelDifferences::query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod0, float lod1,
                              HeightTableCache* fetches) const {
  const auto last = static_cast<float>(levels_.size());
  const float from = std::clamp(std::min(lod0, lod1), 0.0f, last), to = std::clamp(std::max(lod0, lod1), 0.0f, last);
  float sum = 0;
  for (auto l = static_cast<std::size_t>(from); l < levels_.size() && static_cast<float>(l) < to; ++l) {
    const float part = std::min(to, static_cast<float>(l + 1)) - std::max(from, static_cast<float>(l));
    const WindowTable& table = levels_[l];
    const ValueRange range = over(table, footprint_pieces(sampler.wrap_s, low.x, high.x, table.width(), 0, 0),
                                  footprint_pieces(sampler.wrap_t, low.y, high.y, table.height(), 0, 0), fetches);
    sum += part * range.largest() * (1 + 0x1p-18f);
  }
  return sum;
}

}  // namespace tessera::frontend
