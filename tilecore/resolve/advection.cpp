#include "tilecore/resolve/advection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tilecore/resolve/block_pixels.h"

namespace tessera::tilecore {
namespace {

// A place near pixel (x, y): the texel to its upper left and the fractions towards the next ones, in [0, 1).
struct Place {
  int x, y;
  float fx, fy;
};

// For values that fit an int; the oldest x86-64 has no instruction for it, and std::floor is a call there.
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
      const std::ptrdiff_t at = view.index(p.x + i, p.y + j);
      const Vec2 v = view.velocity[at];
      if (view.usable[at] == 0 || !std::isfinite(v.x) || !std::isfinite(v.y)) return std::nullopt;
      sum += w * v;
    }
  return sum;
}

// One frame's texels, as a pixel that shows `patch` at `depth` sees them.
struct StoredImage {
  const HistoryView& history;
  float depth, limit;  // how far a texel's may be from it
  std::uint32_t patch;

  Advection verdict(int x, int y, AdvectionWork& work) const {
    if (!history.region.contains(x, y)) return Advection::kOutsideFrame;
    ++work.history_texels;
    const std::ptrdiff_t at = history.index(x, y);
    if (history.patch[at] != patch) return Advection::kOtherPatch;
    const float there = history.depth[at];
    // Equal infinities agree; otherwise infinity and NaN do with nothing.
    const float apart = std::abs(there - depth);
    if (there != depth && !(std::isfinite(apart) && apart <= limit)) return Advection::kDisoccluded;
    return is_finite(history.color[at]) ? Advection::kTaken : Advection::kNonFinite;
  }
  const Vec4& color(int x, int y) const { return history.color[history.index(x, y)]; }
};

using Weights = std::array<float, 4>;  // of the texels -1, 0, 1, 2 along an axis

// Catmull and Rom 1974.
Weights catmull_rom_weights(float f) {
  const float f2 = f * f, f3 = f2 * f;
  return {0.5f * (2 * f2 - f3 - f), 0.5f * (3 * f3 - 5 * f2 + 2), 0.5f * (4 * f2 - 3 * f3 + f), 0.5f * (f3 - f2)};
}

constexpr bool is_inner(int i) { return i == 1 || i == 2; }

// Sums the texels that have a weight, as differences from the first inner one, so that a flat colour is exact. The
// outcome is the outcome of the first texel that disagrees; inner ones come first.
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
  if (!std::isfinite(surface.limit) || !fetch_agreeing_texels(history, {history.index(p.x, p.y), w1, w2, w3},
                                                              surface.patch, surface.depth, surface.limit, &out))
    return false;
  work.history_texels += 4;
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
                           const VelocityView& velocity, const AdvectionSettings& settings, float slope,
                           AdvectionWork& work) {
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
  const StoredImage surface{history, depth, depth_limit(depth, slope), patch};
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

}  // namespace tessera::tilecore
