#include "tilecore/resolve/advection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cmath>
#include <cstring>
#include <optional>
#include <type_traits>

#include "tilecore/resolve/channels.h"

namespace tessera::tilecore {
namespace {

// Motion beyond this leaves every frame, and whole pixels of it still fit an int.
constexpr float kLongestMotion = 1 << 20;

// A place near pixel (x, y): the texel to its upper left and the fractions towards the next ones, in [0, 1).
struct Place {
  int x, y;
  float fx, fy;
};

// Of what fits an int; the oldest x86-64 has no instruction for it, and std::floor is a call there.
float floor_of(float v) {
  const auto whole = static_cast<float>(static_cast<int>(v));
  return whole > v ? whole - 1.0f : whole;
}

// The whole part is taken from the offset, not from the position: the same bits anywhere in the frame.
std::optional<Place> place_at(int x, int y, Vec2 offset) {
  if (!(std::abs(offset.x) < kLongestMotion && std::abs(offset.y) < kLongestMotion)) return std::nullopt;
  Vec2 whole(floor_of(offset.x), floor_of(offset.y));
  Vec2 f = offset - whole;
  // An offset just below a whole number rounds up to it.
  for (int c = 0; c < 2; ++c)
    if (f[c] >= 1.0f) f[c] = 0.0f, whole[c] += 1.0f;
  return Place{x + static_cast<int>(whole.x), y + static_cast<int>(whole.y), f.x, f.y};
}

// v between pixels; nothing where a pixel with a weight is unusable or outside.
std::optional<Vec2> velocity_at(const Place& p, const VelocityView& view, AdvectionWork& work) {
  Vec2 sum(0.0f);
  const bool whole = p.fx == 0.0f && p.fy == 0.0f;
  for (int j = 0; j < (whole ? 1 : 2); ++j)
    for (int i = 0; i < (whole ? 1 : 2); ++i) {
      const float w = (i == 0 ? 1.0f - p.fx : p.fx) * (j == 0 ? 1.0f - p.fy : p.fy);
      if (w == 0.0f) continue;
      if (!view.region.contains(p.x + i, p.y + j)) return std::nullopt;
      ++work.velocity_texels;
      const std::ptrdiff_t at = (p.y + j - view.region.y0) * view.row_stride + (p.x + i - view.region.x0);
      const Vec2 v = view.velocity[at];
      if (view.usable[at] == 0 || !std::isfinite(v.x) || !std::isfinite(v.y)) return std::nullopt;
      sum += w * v;
    }
  return sum;
}

// One frame's texels, as a pixel that shows `patch` at `depth` sees them.
struct StoredImage {
  const HistoryView& history;
  float depth, tolerance;
  std::uint32_t patch;

  Advection verdict(int x, int y, AdvectionWork& work) const {
    if (!history.region.contains(x, y)) return Advection::kOutsideFrame;
    ++work.history_texels;
    const std::ptrdiff_t at = index(x, y);
    if (history.patch[at] != patch) return Advection::kOtherPatch;
    const float there = history.depth[at];
    // Equal infinities agree; otherwise infinity and NaN do with nothing.
    const float apart = std::abs(there - depth);
    if (there != depth && !(std::isfinite(apart) && apart <= tolerance * std::abs(depth)))
      return Advection::kDisoccluded;
    const Vec4& c = history.color[at];
    return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z) && std::isfinite(c.w) ? Advection::kTaken
                                                                                                : Advection::kNonFinite;
  }
  const Vec4& color(int x, int y) const { return history.color[index(x, y)]; }

 private:
  std::ptrdiff_t index(int x, int y) const {
    return (y - history.region.y0) * history.row_stride + (x - history.region.x0);
  }
};

using Weights = std::array<float, 4>;  // of the texels -1, 0, 1, 2 along an axis

// Catmull and Rom 1974.
Weights catmull_rom_weights(float f) {
  const float f2 = f * f, f3 = f2 * f;
  return {0.5f * (2 * f2 - f3 - f), 0.5f * (3 * f3 - 5 * f2 + 2), 0.5f * (4 * f2 - 3 * f3 + f), 0.5f * (f3 - f2)};
}

constexpr bool is_inner(int i) { return i == 1 || i == 2; }

// Sum over the texels with a weight as differences from the first inner one, so that a flat colour is exact. The
// outcome is that of the first texel that disagrees; inner ones come first.
Advection fetch(const StoredImage& surface, const Place& p, const Weights& wx, const Weights& wy, bool clamp, Vec4& out,
                AdvectionWork& work) {
  const Vec4* base = nullptr;
  Vec4 sum(0.0f), low, high;
  for (const bool inner : {true, false})
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const float w = wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)];
        if ((is_inner(i) && is_inner(j)) != inner || w == 0.0f) continue;
        const int x = p.x + i - 1, y = p.y + j - 1;
        if (const Advection verdict = surface.verdict(x, y, work); verdict != Advection::kTaken) return verdict;
        const Vec4& color = surface.color(x, y);
        if (base == nullptr)
          base = &color, low = high = color;
        else
          sum += w * (color - *base);
        if (inner) low = glm::min(low, color), high = glm::max(high, color);
      }
  // Not even 0 is added to a lone texel: -0 stays.
  out = wx[1] * wy[1] == 1.0f ? *base : *base + sum;
  if (clamp) out = glm::clamp(out, low, high);
  return Advection::kTaken;
}

// fetch_bilinear() where four texels have a weight, all agree and all are finite; false: it has to look one by one.
bool fetch_agreeing(const StoredImage& surface, const Place& p, Vec4& out, AdvectionWork& work) {
  const HistoryView& history = surface.history;
  const float w1 = p.fx * (1.0f - p.fy), w2 = (1.0f - p.fx) * p.fy, w3 = p.fx * p.fy;
  if (!history.region.contains(p.x, p.y) || !history.region.contains(p.x + 1, p.y + 1) || w1 == 0.0f || w2 == 0.0f ||
      w3 == 0.0f)
    return false;
  const std::ptrdiff_t above = (p.y - history.region.y0) * history.row_stride + (p.x - history.region.x0),
                       below = above + history.row_stride;
  const std::uint32_t *a = history.patch + above, *b = history.patch + below;
  if (((a[0] ^ surface.patch) | (a[1] ^ surface.patch) | (b[0] ^ surface.patch) | (b[1] ^ surface.patch)) != 0)
    return false;
  const float *da = history.depth + above, *db = history.depth + below;
  const float limit = surface.tolerance * std::abs(surface.depth);
  const auto near = [&](float there) { return std::abs(there - surface.depth) <= limit; };
  if (!(std::isfinite(limit) && near(da[0]) && near(da[1]) && near(db[0]) && near(db[1]))) return false;
  const Channels base = load(&history.color[above]), c1 = load(&history.color[above + 1]),
                 c2 = load(&history.color[below]), c3 = load(&history.color[below + 1]);
  if (!is_finite(((base - base) + (c1 - c1)) + ((c2 - c2) + (c3 - c3)))) return false;
  work.history_texels += 4;
  store(base + ((w1 * (c1 - base) + w2 * (c2 - base)) + w3 * (c3 - base)), &out);
  return true;
}

// The same as fetch() with the weights of a tent on the inner four texels, not clamped.
Advection fetch_bilinear(const StoredImage& surface, const Place& p, Vec4& out, AdvectionWork& work) {
  if (fetch_agreeing(surface, p, out, work)) return Advection::kTaken;
  const Vec4* base = nullptr;
  Vec4 sum(0.0f);
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const float w = (i == 0 ? 1.0f - p.fx : p.fx) * (j == 0 ? 1.0f - p.fy : p.fy);
      if (w == 0.0f) continue;
      if (const Advection verdict = surface.verdict(p.x + i, p.y + j, work); verdict != Advection::kTaken)
        return verdict;
      const Vec4& color = surface.color(p.x + i, p.y + j);
      if (base == nullptr)
        base = &color;
      else
        sum += w * (color - *base);
    }
  out = p.fx == 0.0f && p.fy == 0.0f ? *base : *base + sum;
  return Advection::kTaken;
}

}  // namespace

AdvectedPixel advect_pixel(int x, int y, float depth, std::uint32_t patch, const HistoryView& history,
                           const VelocityView& velocity, const AdvectionSettings& settings, AdvectionWork& work) {
  const auto v = velocity_at({x, y, 0, 0}, velocity, work);
  if (!v) return {Advection::kUnusableVelocity, {}};
  Vec2 offset = -*v;
  if (settings.bfecc) {
    const auto x1 = place_at(x, y, offset);
    const auto v1 = x1 ? velocity_at(*x1, velocity, work) : std::nullopt;
    if (v1)
      offset -= 0.5f * (*v1 - *v);  // x2 - x = v(x1) - v(x)
    else
      ++work.uncorrected;
  }
  const auto place = place_at(x, y, offset);
  if (!place) return {Advection::kOutsideFrame, {}};
  ++work.fetches;
  const StoredImage surface{history, depth, settings.depth_tolerance, patch};
  AdvectedPixel result{Advection::kTaken, {}};
  if (settings.fetch == Fetch::kBicubic) {
    result.outcome = fetch(surface, *place, catmull_rom_weights(place->fx), catmull_rom_weights(place->fy),
                           settings.clamp_to_range, result.color, work);
    if (result.outcome == Advection::kTaken) return result;
  }
  // After a bicubic fetch the inner texels have been read and charged.
  AdvectionWork charged;
  const bool bicubic = settings.fetch == Fetch::kBicubic;
  result.outcome = fetch_bilinear(surface, *place, result.color, bicubic ? charged : work);
  work.bilinear_fallbacks += bicubic && result.outcome == Advection::kTaken;
  return result;
}

// ---- Whole blocks -----------------------------------------------------------------------------------------------

namespace {

// Where four pixels of a row come from: place_at(), for all at once.
struct RowPlaces {
  alignas(16) std::int32_t x[4], y[4];    // upper left texels
  alignas(16) float w1[4], w2[4], w3[4];  // weights of the other three
  unsigned plain = 0;                     // bit i: all four texels have a weight and are in the region

  RowPlaces(int px, int py, const Vec2* velocity, const IntRect& region) {
    const Channels ab = load(&velocity[0].x), cd = load(&velocity[2].x);
    Channels ox = -__builtin_shufflevector(ab, cd, 0, 2, 4, 6), oy = -__builtin_shufflevector(ab, cd, 1, 3, 5, 7);
    ChannelMask ok = (magnitude(ox) < kLongestMotion) & (magnitude(oy) < kLongestMotion);
    ox = (Channels)((ChannelMask)ox & ok), oy = (Channels)((ChannelMask)oy & ok);  // no longer too long for an int
    const auto [wx, fx] = split(ox);
    const auto [wy, fy] = split(oy);
    const Channels weight1 = fx * (1.0f - fy), weight2 = (1.0f - fx) * fy, weight3 = fx * fy;
    const ChannelMask tx = wx + ChannelMask{px, px + 1, px + 2, px + 3}, ty = wy + py;
    ok &= (fx < 1.0f) & (fy < 1.0f) & (weight1 != 0.0f) & (weight2 != 0.0f) & (weight3 != 0.0f);
    ok &= (tx >= region.x0) & (tx < region.x1 - 1) & (ty >= region.y0) & (ty < region.y1 - 1);
    std::memcpy(x, &tx, sizeof x), std::memcpy(y, &ty, sizeof y);
    std::memcpy(w1, &weight1, sizeof w1), std::memcpy(w2, &weight2, sizeof w2), std::memcpy(w3, &weight3, sizeof w3);
    const ChannelMask bits = ok & ChannelMask{1, 2, 4, 8};
    plain = static_cast<unsigned>(bits[0] | bits[1] | bits[2] | bits[3]);
  }

 private:
  struct Split {
    ChannelMask whole;
    Channels fraction;
  };
  static Split split(const Channels& offset) {
    ChannelMask whole = __builtin_convertvector(offset, ChannelMask);
    whole += __builtin_convertvector(whole, Channels) > offset;  // true is -1
    return {whole, offset - __builtin_convertvector(whole, Channels)};
  }
};

// Two texels side by side, and the two below them.
template <class T>
auto four_texels(const T* above, const T* below) {
  T four[4];
  std::memcpy(four, above, 2 * sizeof(T)), std::memcpy(four + 2, below, 2 * sizeof(T));
  std::conditional_t<std::is_same_v<T, float>, Channels, ChannelMask> out;
  std::memcpy(&out, four, sizeof out);
  return out;
}

}  // namespace

PlainAdvection advect_plain_pixels(const BlockOfPixels& block, std::uint16_t wanted, const HistoryView& history,
                                   float depth_tolerance, Vec4* out, std::ptrdiff_t out_stride, AdvectionWork& work) {
  PlainAdvection result;
  int left = INT_MAX, top = INT_MAX, right = INT_MIN, bottom = INT_MIN;
  for (int j = 0; j < 4; ++j) {
    const std::ptrdiff_t row = j * block.row_stride;
    unsigned pixels = wanted >> (4 * j) & 15u;
    if (pixels == 0) continue;
    const RowPlaces places(block.x, block.y + j, block.velocity + row, history.region);
    for (pixels &= places.plain; pixels != 0; pixels &= pixels - 1) {
      const int i = std::countr_zero(pixels);
      const float depth = block.depth[row + i], limit = depth_tolerance * std::abs(depth);
      if (block.usable[row + i] == 0 || !std::isfinite(limit)) continue;
      const std::ptrdiff_t above = (places.y[i] - history.region.y0) * history.row_stride +
                                   (places.x[i] - history.region.x0),
                           below = above + history.row_stride;
      const ChannelMask others =
          four_texels(history.patch + above, history.patch + below) ^ static_cast<std::int32_t>(block.patch[row + i]);
      const ChannelMask near = magnitude(four_texels(history.depth + above, history.depth + below) - depth) <= limit;
      if (!none(others | ~near)) continue;
      const Channels base = load(&history.color[above]), c1 = load(&history.color[above + 1]),
                     c2 = load(&history.color[below]), c3 = load(&history.color[below + 1]);
      if (!is_finite(((base - base) + (c1 - c1)) + ((c2 - c2) + (c3 - c3)))) continue;
      store(base + ((places.w1[i] * (c1 - base) + places.w2[i] * (c2 - base)) + places.w3[i] * (c3 - base)),
            &out[j * out_stride + i]);
      result.taken = static_cast<std::uint16_t>(result.taken | 1u << (4 * j + i));
      left = std::min(left, places.x[i]), right = std::max(right, places.x[i]);
      top = std::min(top, places.y[i]), bottom = std::max(bottom, places.y[i]);
    }
  }
  const auto count = static_cast<std::uint64_t>(std::popcount(result.taken));
  work.fetches += count, work.velocity_texels += count, work.history_texels += 4 * count;
  if (count > 0) result.texels = {left, top, right + 2, bottom + 2};
  return result;
}

}  // namespace tessera::tilecore
