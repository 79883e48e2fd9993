#include "tilecore/resolve/half_pixel_stencil.h"

#include <bit>

#include "base/check.h"
#include "tilecore/resolve/cubic_weights.h"

namespace tessera::tilecore {
namespace {

constexpr int kReach = 2;
constexpr double kScale = 0.9428090415820634;  // sqrt(8) / 3

// Which of the places (0, 0), (1, 0), (0, 1), (1, 1) are rendered, bit 0 first, repeated over the block.
constexpr HalfMask repeated(unsigned corner) {
  const std::uint32_t even = (corner & 3u) * 0x55u, odd = (corner >> 2) * 0x55u;
  return even | odd << 8 | even << 16 | odd << 24;
}
constexpr std::array<HalfMask, 2> kHalf = {repeated(9), repeated(6)};
constexpr std::array<HalfMask, 4> kThreeQuarters = {repeated(14), repeated(7), repeated(13), repeated(11)};
constexpr std::array<HalfMask, 6> kPatterns = {kHalf[0],          kHalf[1],          kThreeQuarters[0],
                                               kThreeQuarters[1], kThreeQuarters[2], kThreeQuarters[3]};

constexpr double weight_of(int dx, int dy) {
  return mitchell_netravali(0.5 * kScale * dx, 1.0 / 3, 1.0 / 3) * mitchell_netravali(kScale * dy, 1.0 / 3, 1.0 / 3);
}
constexpr auto kWeights = [] {
  std::array<std::array<double, 2 * kReach + 1>, 2 * kReach + 1> w{};
  for (int dy = -kReach; dy <= kReach; ++dy)
    for (int dx = -kReach; dx <= kReach; ++dx)
      w[static_cast<std::size_t>(dy + kReach)][static_cast<std::size_t>(dx + kReach)] = weight_of(dx, dy);
  return w;
}();

// Calls visit(dx, dy, weight) for each of `places` within reach of `place`.
template <class Visit>
constexpr void for_each_tap(HalfMask places, int place, const Visit& visit) {
  const int x = place % 8, y = place / 8;
  for (int dy = -kReach; dy <= kReach; ++dy)
    for (int dx = -kReach; dx <= kReach; ++dx) {
      if (x + dx < 0 || x + dx > 7 || y + dy < 0 || y + dy > 3 || !(places >> (place + 8 * dy + dx) & 1)) continue;
      visit(dx, dy, kWeights[static_cast<std::size_t>(dy + kReach)][static_cast<std::size_t>(dx + kReach)]);
    }
}

// The largest power of two for which all weights fit 8 bits; what rounding down leaves goes to the largest remainders.
constexpr Stencil quantized(const std::array<double, kMaxTaps>& weights, Stencil s) {
  int unit = 256;
  for (std::size_t i = 0; i < s.count; ++i)
    while (weights[i] * unit > 126) unit /= 2;
  std::array<double, kMaxTaps> rest{};
  int left = unit;
  for (std::size_t i = 0; i < s.count; ++i) {
    const double exact = weights[i] * unit;
    int code = static_cast<int>(exact);
    if (code > exact) --code;
    s.taps[i].weight = static_cast<std::int16_t>(code);
    rest[i] = exact - code;
    left -= code;
  }
  for (; left > 0; --left) {
    std::size_t most = 0;
    for (std::size_t i = 1; i < s.count; ++i)
      if (rest[i] > rest[most] + 1e-9) most = i;
    ++s.taps[most].weight;
    rest[most] = -1;
  }
  return s;
}

constexpr Stencil make_stencil(HalfMask pattern, int place) {
  Stencil s;
  std::array<double, kMaxTaps> weights{};
  double sum = 0;
  for_each_tap(pattern, place, [&](int dx, int dy, double w) {
    s.taps[s.count] = {static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy), 0};
    weights[s.count++] = w;
    sum += w;
  });
  for (std::size_t i = 0; i < s.count; ++i) weights[i] /= sum;
  return quantized(weights, s);
}

constexpr auto kStencilsOfPatterns = [] {
  std::array<std::array<Stencil, 32>, kPatterns.size()> all{};
  for (std::size_t p = 0; p < kPatterns.size(); ++p)
    for (int place = 0; place < 32; ++place)
      if (!(kPatterns[p] >> place & 1)) all[p][static_cast<std::size_t>(place)] = make_stencil(kPatterns[p], place);
  return all;
}();

const Stencil* find_stencil(HalfMask pattern, int place) {
  for (std::size_t p = 0; p < kPatterns.size(); ++p)
    if (kPatterns[p] == pattern) return &kStencilsOfPatterns[p][static_cast<std::size_t>(place)];
  return nullptr;
}

bool all_usable(const Stencil& s, HalfMask usable, int place) {
  for (std::size_t i = 0; i < s.count; ++i)
    if (!(usable >> (place + 8 * s.taps[i].dy + s.taps[i].dx) & 1)) return false;
  return true;
}

}  // namespace

HalfMask half_pattern(int groups, std::uint32_t frame) {
  TESSERA_CHECK(groups == 16 || groups == 24 || groups == 32,
                "a supersampled block is rendered at 16, 24 or 32 places");
  return groups == 32 ? kAllHalves : groups == 16 ? kHalf[frame % 2] : kThreeQuarters[frame % 4];
}

std::optional<Stencil> half_stencil(HalfMask pattern, int place) {
  const Stencil* found = find_stencil(pattern, place);
  if (found == nullptr || found->count == 0) return std::nullopt;
  return *found;
}

bool half_is_reconstructible(HalfMask usable, int place) {
  double sum = 0, magnitude = 0;
  for_each_tap(usable, place, [&](int, int, double w) { sum += w, magnitude += w < 0 ? -w : w; });
  return magnitude > 0 && sum >= kMinimumDenominator * magnitude;
}

Vec3 reconstruct_half(HalfMask pattern, HalfMask usable, int place, const Vec3* colors32, std::uint64_t& taps) {
  std::array<float, 32> weight{};
  HalfMask places = 0;
  if (const Stencil* s = find_stencil(pattern, place); s != nullptr && s->count > 0 && all_usable(*s, usable, place)) {
    const float share = 1.0f / static_cast<float>(s->unit());
    for (std::size_t i = 0; i < s->count; ++i) {
      const int at = place + 8 * s->taps[i].dy + s->taps[i].dx;
      weight[static_cast<std::size_t>(at)] = static_cast<float>(s->taps[i].weight) * share;
      places |= 1u << at;
    }
  } else {
    double sum = 0;
    for_each_tap(usable, place, [&](int, int, double w) { sum += w; });
    for_each_tap(usable, place, [&](int dx, int dy, double w) {
      weight[static_cast<std::size_t>(place + 8 * dy + dx)] = static_cast<float>(w / sum);
      places |= 1u << (place + 8 * dy + dx);
    });
  }
  // Differences from one of them, so that a flat colour is exact whatever the weights.
  const Vec3 base = colors32[std::countr_zero(places)];
  Vec3 difference(0.0f);
  for (HalfMask left = places; left != 0; left &= left - 1, ++taps) {
    const auto at = static_cast<std::size_t>(std::countr_zero(left));
    difference += (colors32[at] - base) * weight[at];
  }
  return base + difference;
}

}  // namespace tessera::tilecore
