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

// What the rounding of a coordinate's own float arithmetic may add, in texels: a few units in the last place of it and
// of its products.
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

// To [0, 1], but NaN and infinities stay what they are.
float clamp_finite(float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : x; }

// A filtered value is a convex combination of texels up to rounding: 4 + 4 products and sums per level and 3 between
// levels at u = 2^-24 stay below 2^-19. The means that make a coarser level round by less than 2^-15 against level 0.
constexpr float kFilterSlack = 0x1p-19f, kMipSlack = 0x1p-15f;

ValueRange widen(const ValueRange& r, float slack) {
  const float grow = std::max(std::abs(r.low), std::abs(r.high)) * slack;
  return {r.low - grow, r.high + grow};
}

// Differences of every texel to the next along one axis, by size; the last goes on at the first, as repeating textures
// do (mirrored and clamped ones go on level).
shaders::ScalarTexture differences(const shaders::ScalarTexture& texture, int step_x, int step_y) {
  const auto& base = texture.levels().front();
  std::vector<float> values;
  for (int y = 0; y < base.height; ++y)
    for (int x = 0; x < base.width; ++x) {
      const int next_x = (x + step_x) % base.width, next_y = (y + step_y) % base.height;
      values.push_back(std::abs(base.values[static_cast<std::size_t>(next_y * base.width + next_x)] -
                                base.values[static_cast<std::size_t>(y * base.width + x)]));
    }
  return shaders::ScalarTexture(base.width, base.height, std::move(values));
}

}  // namespace

MinMaxPyramid::MinMaxPyramid(const shaders::ScalarTexture& texture) {
  for (const auto& level : texture.levels()) {
    Steps& steps = levels_.emplace_back();
    steps.push_back({level.width, level.height, {}});
    for (const float value : level.values) steps.back().entries.push_back({value, value});
    while (steps.back().width > 1 || steps.back().height > 1) {
      const Step& last = steps.back();
      Step next{(last.width + 1) / 2, (last.height + 1) / 2, {}};
      for (int y = 0; y < next.height; ++y)
        for (int x = 0; x < next.width; ++x) {
          ValueRange range = last.entries[static_cast<std::size_t>(2 * y * last.width + 2 * x)];
          for (int dy = 0; dy < 2; ++dy)
            for (int dx = 0; dx < 2; ++dx)
              if (2 * x + dx < last.width && 2 * y + dy < last.height)
                range = range.hull(last.entries[static_cast<std::size_t>((2 * y + dy) * last.width + 2 * x + dx)]);
          next.entries.push_back(range);
        }
      steps.push_back(std::move(next));
    }
  }
}

ValueRange MinMaxPyramid::whole() const { return widen(levels_.front().back().entries.front(), kMipSlack); }

ValueRange MinMaxPyramid::texels(const Steps& steps, int x0, int y0, int x1, int y1) {
  // The finest step at which the box touches at most two entries along each axis: log2 of the longer side, or one
  // coarser where it lies across two boundaries. No loop and no branch: they would be mispredicted.
  const auto longer = static_cast<unsigned>(std::max(x1 - x0, y1 - y0)) | 1u;
  std::size_t step = static_cast<std::size_t>(std::bit_width(longer)) - 1;
  step += static_cast<std::size_t>(((x1 >> step) - (x0 >> step) > 1) | ((y1 >> step) - (y0 >> step) > 1));
  const Step& s = steps[step];
  const auto at = [&](int x, int y) {
    return s.entries[static_cast<std::size_t>((y >> step) * s.width + (x >> step))];
  };
  return at(x0, y0).hull(at(x1, y0)).hull(at(x0, y1)).hull(at(x1, y1));
}

ValueRange MinMaxPyramid::footprint(const Steps& steps, const shaders::Sampler& sampler, Vec2 low, Vec2 high, int width,
                                    int height) {
  const Step& all = steps.front();
  int x0, x1, y0, y1;
  if (all.width == width && all.height == height && inner_texels(sampler.wrap_s, low.x, high.x, width, x0, x1) &&
      inner_texels(sampler.wrap_t, low.y, high.y, height, y0, y1))
    return texels(steps, x0, y0, x1, y1);
  // A bilinear lookup at x (in texels) reads texels floor(x - 1/2) and the next.
  const auto pieces = [&](shaders::Wrap wrap, float a, float b, int size, int level_size) {
    // A coordinate outside a clamped texture reads the edge texel of its level, which covers several of level 0.
    if (wrap == shaders::Wrap::kClampToEdge) a = clamp_finite(a), b = clamp_finite(b);
    const double from = static_cast<double>(a), to = static_cast<double>(b),
                 ratio = static_cast<double>(size) / level_size;
    const double slack = coordinate_slack(from, to, level_size);
    const double first = from * level_size - 0.5 - slack, last = to * level_size + 0.5 + slack;
    if (!(std::abs(first) < 1e15 && std::abs(last) < 1e15)) return wrapped_pieces(wrap, -1e300, 1e300, size);
    return wrapped_pieces(wrap, static_cast<double>(floor_to_integer(first)) * ratio,
                          static_cast<double>(floor_to_integer(last) + 1) * ratio - 0x1p-10, size);
  };
  const Pieces columns = pieces(sampler.wrap_s, low.x, high.x, all.width, width);
  const Pieces rows = pieces(sampler.wrap_t, low.y, high.y, all.height, height);
  ValueRange range = texels(steps, columns.first[0], rows.first[0], columns.last[0], rows.last[0]);
  if (columns.count == 1 && rows.count == 1) return range;
  for (int j = 0; j < rows.count; ++j)
    for (int i = 0; i < columns.count; ++i)
      range = range.hull(texels(steps, columns.first[i], rows.first[j], columns.last[i], rows.last[j]));
  return range;
}

ValueRange MinMaxPyramid::query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod) const {
  const float level = lod > 0.0f ? std::min(lod, static_cast<float>(levels_.size() - 1)) : 0.0f;
  const auto below = static_cast<std::size_t>(level);
  const float weight = level - static_cast<float>(below);
  const auto own_footprint = [&](const Steps& steps) {
    return footprint(steps, sampler, low, high, steps.front().width, steps.front().height);
  };
  const ValueRange fine = own_footprint(levels_[below]);
  if (weight == 0.0f) return widen(fine, kFilterSlack);
  const ValueRange coarse = own_footprint(levels_[below + 1]);
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

ValueRange MinMaxPyramid::query_base(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float max_lod) const {
  const auto level =
      static_cast<std::size_t>(std::clamp(std::ceil(max_lod), 0.0f, static_cast<float>(levels_.size() - 1)));
  const Step& coarsest = levels_[level].front();
  return widen(footprint(levels_.front(), sampler, low, high, coarsest.width, coarsest.height), kMipSlack);
}

SlopePyramid::SlopePyramid(const shaders::ScalarTexture& texture)
    : size_(static_cast<float>(texture.levels().front().width), static_cast<float>(texture.levels().front().height)),
      along_s_(differences(texture, 1, 0)),
      along_t_(differences(texture, 0, 1)) {}

Vec2 SlopePyramid::query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float max_lod) const {
  // A difference of a level's texels spans two of its cells: the footprint of one level more holds both. Mirroring
  // turns a texel's difference to its other side, one texel off, which that covers too.
  const float lod = std::ceil(std::max(max_lod, 0.0f)) + 1.0f;
  return size_ *
         Vec2(along_s_.query_base(sampler, low, high, lod).high, along_t_.query_base(sampler, low, high, lod).high);
}

}  // namespace tessera::frontend
