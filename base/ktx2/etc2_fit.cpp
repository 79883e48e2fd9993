#include "base/ktx2/etc2_fit.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace tessera::ktx2 {
namespace {

constexpr int kWorst = std::numeric_limits<int>::max();

int square(int value) { return value * value; }

int distance2(const Rgb& a, const Rgb& b) { return square(a[0] - b[0]) + square(a[1] - b[1]) + square(a[2] - b[2]); }

// `sum` over `count` values of 8 bits, rounded to a value of `bits` bits.
int quantised(int sum, int count, int bits) {
  const int top = (1 << bits) - 1, whole = 255 * count;
  return std::clamp((2 * sum * top + whole) / (2 * whole), 0, top);
}

// The nearest of four colours for each texel of `texels`, and the sum of squares; stops beyond `limit`.
int paint(const std::array<Rgb, 4>& colors, std::span<const Rgb> texels, std::span<std::uint8_t> indices, int limit) {
  int error = 0;
  for (std::size_t t = 0; t < texels.size() && error < limit; ++t) {
    int nearest = kWorst;
    for (std::size_t i = 0; i < 4; ++i)
      if (const int d = distance2(colors[i], texels[t]); d < nearest)
        nearest = d, indices[t] = static_cast<std::uint8_t>(i);
    error += nearest;
  }
  return error;
}

// ---- Halves -----------------------------------------------------------------------------------------------------

// Eight texels with a base colour of `bits` bits a channel and a table.
struct Half {
  Rgb base{};
  int table = 0, error = kWorst;
  int steps = 0;  // sum of the texels' steps
};

using HalfTexels = std::array<Rgb, 8>;

std::array<Rgb, 4> half_colors(const Rgb& base, int bits, int table) {
  const auto [small, large] = kEtc1Modifiers[static_cast<std::size_t>(table)];
  const std::array<int, 4> steps = {small, large, -small, -large};
  std::array<Rgb, 4> colors{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t c = 0; c < 3; ++c) colors[i][c] = std::clamp(widen_bits(base[c], bits) + steps[i], 0, 255);
  return colors;
}

// Bases that may be taken, by channel.
struct BaseRange {
  Rgb low, high;
};
constexpr BaseRange whole_range(int bits) {
  const int top = (1 << bits) - 1;
  return {{0, 0, 0}, {top, top, top}};
}

class HalfFit {
 public:
  HalfFit(const HalfTexels& texels, int bits, const BaseRange& range) : texels_(texels), bits_(bits), range_(range) {
    for (std::size_t t = 0; t < 8; ++t)
      for (std::size_t c = 0; c < 3; ++c) {
        sum_[c] += texels[t][c];
        brightness_[t] += texels[t][c];
        squares_ += square(texels[t][c]);
      }
  }

  Half run() {
    for (int table = 0; table < 8; ++table) {
      // Starts at the mean, then takes the mean of the texels less their steps.
      Half trial = at(mean_base(0), table);
      for (int round = 0; round < 2; ++round) {
        const Rgb base = mean_base(trial.steps);
        if (base == trial.base) break;
        const Half again = at(base, table);
        if (again.error >= trial.error) break;
        trial = again;
      }
      if (trial.error < best_.error) best_ = trial;
    }
    while (best_.error > 0 && step())
      ;
    return best_;
  }

 private:
  Half at(const Rgb& base, int table) const {
    Half half;
    half.base = base;
    half.table = table;
    const Rgb wide = {widen_bits(base[0], bits_), widen_bits(base[1], bits_), widen_bits(base[2], bits_)};
    const int large = kEtc1Modifiers[static_cast<std::size_t>(table)][1];
    const auto [low, high] = std::minmax({wide[0], wide[1], wide[2]});
    if (low >= large && high + large <= 255)
      measure_free(wide, half);
    else
      measure_clamped(half);
    return half;
  }

  // Where no colour is clamped, a step m in all channels changes a texel's error by 3mm - 2md, where d is the texel's
  // excess in brightness over the base, summed over the channels.
  void measure_free(const Rgb& wide, Half& half) const {
    const auto [small, large] = kEtc1Modifiers[static_cast<std::size_t>(half.table)];
    const int base_brightness = wide[0] + wide[1] + wide[2];
    int error = squares_;
    for (std::size_t c = 0; c < 3; ++c) error += wide[c] * (8 * wide[c] - 2 * sum_[c]);
    for (const int brightness : brightness_) {
      const int by = brightness - base_brightness, away = std::abs(by);
      const int with_small = small * (3 * small - 2 * away), with_large = large * (3 * large - 2 * away);
      const int step = with_large < with_small ? large : small;
      error += std::min(with_small, with_large);
      half.steps += by < 0 ? -step : step;
    }
    half.error = error;
  }

  void measure_clamped(Half& half) const {
    std::array<std::uint8_t, 8> indices{};
    half.error = paint(half_colors(half.base, bits_, half.table), texels_, indices, kWorst);
    for (const std::uint8_t index : indices) {
      const int step = kEtc1Modifiers[static_cast<std::size_t>(half.table)][index & 1u];
      half.steps += index < 2 ? step : -step;
    }
  }

  Rgb mean_base(int steps) const {
    Rgb base{};
    for (std::size_t c = 0; c < 3; ++c)
      base[c] = std::clamp(quantised(sum_[c] - steps, 8, bits_), range_.low[c], range_.high[c]);
    return base;
  }

  // Moves the base by one in a channel or in all, with the same or a neighbouring table. False where nothing helps.
  bool step() {
    static constexpr std::array<Rgb, 4> kMoves = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}};
    const Half from = best_;
    for (const Rgb& move : kMoves)
      for (const int by : {-1, 1})
        for (int table = std::max(from.table - 1, 0); table <= std::min(from.table + 1, 7); ++table) {
          Rgb base = from.base;
          bool inside = true;
          for (std::size_t c = 0; c < 3; ++c) {
            base[c] += by * move[c];
            inside = inside && base[c] >= range_.low[c] && base[c] <= range_.high[c];
          }
          if (!inside) continue;
          if (const Half trial = at(base, table); trial.error < best_.error) best_ = trial;
        }
    return best_.error < from.error;
  }

  const HalfTexels& texels_;
  int bits_;
  BaseRange range_;
  Half best_;
  Rgb sum_{};
  std::array<int, 8> brightness_{};
  int squares_ = 0;
};

struct Found {
  int error = kWorst;
  EtcBytes bytes{};

  void offer(int other, const EtcBytes& other_bytes) {
    if (other < error) error = other, bytes = other_bytes;
  }
};

EtcHalves joined(const std::array<Half, 2>& halves, const std::array<HalfTexels, 2>& parts, bool differential,
                 bool flip) {
  EtcHalves out;
  out.differential = differential;
  out.flip = flip;
  std::array<std::array<std::uint8_t, 8>, 2> indices{};
  for (std::size_t half = 0; half < 2; ++half) {
    out.base[half] = halves[half].base;
    out.table[half] = halves[half].table;
    paint(half_colors(halves[half].base, differential ? 5 : 4, halves[half].table), parts[half], indices[half], kWorst);
  }
  std::array<std::size_t, 2> next{};
  for (unsigned texel = 0; texel < 16; ++texel) {
    const unsigned half = etc_half(flip, texel);
    out.indices[texel] = indices[half][next[half]++];
  }
  return out;
}

bool near_enough(const Half& first, const Half& second) {
  for (std::size_t c = 0; c < 3; ++c)
    if (second.base[c] - first.base[c] < -4 || second.base[c] - first.base[c] > 3) return false;
  return true;
}

// Bases of five bits that `other` has from `below` under it to `above` over it.
BaseRange range_around(const Half& other, int below, int above) {
  BaseRange range{};
  for (std::size_t c = 0; c < 3; ++c) {
    range.low[c] = std::max(other.base[c] - below, 0);
    range.high[c] = std::min(other.base[c] + above, 31);
  }
  return range;
}

void try_halves(const std::array<Rgb, 16>& texels, bool flip, Found& found) {
  std::array<HalfTexels, 2> parts{};
  std::array<std::size_t, 2> next{};
  for (unsigned texel = 0; texel < 16; ++texel) {
    const unsigned half = etc_half(flip, texel);
    parts[half][next[half]++] = texels[texel];
  }
  const auto offer = [&](const std::array<Half, 2>& halves, bool differential) {
    const int error = halves[0].error + halves[1].error;
    if (error < found.error) found.offer(error, pack_etc1(joined(halves, parts, differential, flip)));
  };
  std::array<Half, 2> fine{};
  for (std::size_t half = 0; half < 2; ++half) fine[half] = HalfFit(parts[half], 5, whole_range(5)).run();
  if (near_enough(fine[0], fine[1])) {
    offer(fine, true);
  } else {
    // One half as it likes, the other one as near as the difference may be.
    offer({fine[0], HalfFit(parts[1], 5, range_around(fine[0], 4, 3)).run()}, true);
    offer({HalfFit(parts[0], 5, range_around(fine[1], 3, 4)).run(), fine[1]}, true);
    offer({HalfFit(parts[0], 4, whole_range(4)).run(), HalfFit(parts[1], 4, whole_range(4)).run()}, false);
  }
}

// ---- T and H ----------------------------------------------------------------------------------------------------

// Two groups of texels, each texel in the group with the nearer mean: sums and numbers of texels.
struct Groups {
  std::array<Rgb, 2> sum{};
  std::array<int, 2> count{};
};

Groups two_groups(const std::array<Rgb, 16>& texels) {
  // Begin with the texel farthest from the first one, and the one farthest from that.
  const auto farthest = [&](const Rgb& from) {
    return *std::max_element(texels.begin(), texels.end(),
                             [&](const Rgb& a, const Rgb& b) { return distance2(a, from) < distance2(b, from); });
  };
  std::array<Rgb, 2> middle{};
  middle[0] = farthest(texels[0]);
  middle[1] = farthest(middle[0]);
  Groups groups;
  for (int round = 0; round < 4; ++round) {
    groups = Groups{};
    for (const Rgb& texel : texels) {
      const std::size_t g = distance2(texel, middle[1]) < distance2(texel, middle[0]) ? 1 : 0;
      ++groups.count[g];
      for (std::size_t c = 0; c < 3; ++c) groups.sum[g][c] += texel[c];
    }
    for (std::size_t g = 0; g < 2; ++g)
      for (std::size_t c = 0; c < 3 && groups.count[g] > 0; ++c) middle[g][c] = groups.sum[g][c] / groups.count[g];
  }
  return groups;
}

class PaintFit {
 public:
  PaintFit(const std::array<Rgb, 16>& texels, bool h) : texels_(texels), h_(h) {}

  void run(const std::array<Rgb, 2>& colors, Found& found) {
    for (int distance = 0; distance < 8; ++distance) offer(colors, distance);
    // Moves seldom take away more than half of an error.
    while (error_ > 0 && error_ / 2 < found.error && step())
      ;
    if (error_ < found.error) found.offer(error_, h_ ? pack_etc2_h(best_) : pack_etc2_t(best_));
  }

 private:
  void offer(const std::array<Rgb, 2>& colors, int distance) {
    // Equal colours of H have odd distances only; T can do all that they can.
    if (h_ && colors[0] == colors[1]) return;
    EtcPaint trial{colors, distance, {}};
    const int error = paint(h_ ? etc2_h_colors(trial) : etc2_t_colors(trial), texels_, trial.indices, error_);
    if (error < error_) error_ = error, best_ = trial;
  }

  bool step() {
    const EtcPaint from = best_;
    const int before = error_;
    for (std::size_t which = 0; which < 2; ++which)
      for (std::size_t c = 0; c < 3; ++c)
        for (const int by : {-1, 1}) {
          std::array<Rgb, 2> colors = from.color;
          colors[which][c] += by;
          if (colors[which][c] < 0 || colors[which][c] > 15) continue;
          for (int distance = std::max(from.distance - 1, 0); distance <= std::min(from.distance + 1, 7); ++distance)
            offer(colors, distance);
        }
    return error_ < before;
  }

  const std::array<Rgb, 16>& texels_;
  bool h_;
  EtcPaint best_;
  int error_ = kWorst;
};

void try_paint(const std::array<Rgb, 16>& texels, Found& found) {
  const Groups groups = two_groups(texels);
  if (groups.count[0] == 0 || groups.count[1] == 0) return;
  std::array<Rgb, 2> colors{};
  for (std::size_t g = 0; g < 2; ++g)
    for (std::size_t c = 0; c < 3; ++c) colors[g][c] = quantised(groups.sum[g][c], groups.count[g], 4);
  PaintFit(texels, true).run(colors, found);
  PaintFit(texels, false).run(colors, found);
  PaintFit(texels, false).run({colors[1], colors[0]}, found);
}

// ---- Planar -----------------------------------------------------------------------------------------------------

int plane_error(const std::array<Rgb, 16>& texels, const EtcPlane& plane, std::size_t channel) {
  int error = 0;
  for (std::size_t texel = 0; texel < 16; ++texel)
    error += square(etc2_plane_value(plane, channel, static_cast<int>(texel % 4), static_cast<int>(texel / 4)) -
                    texels[texel][channel]);
  return error;
}

// A channel's origin and ends by least squares over the 4x4 texels, in 1/80 of 8 bits; then moved by steps.
int fit_plane_channel(const std::array<Rgb, 16>& texels, std::size_t c, EtcPlane& plane) {
  int sum = 0, along_x = 0, along_y = 0;
  for (int texel = 0; texel < 16; ++texel) {
    const int value = texels[static_cast<std::size_t>(texel)][c];
    sum += value;
    along_x += (2 * (texel % 4) - 3) * value;
    along_y += (2 * (texel / 4) - 3) * value;
  }
  const int origin = 5 * sum - 3 * (along_x + along_y);
  const int bits = c == 1 ? 7 : 6, top = (1 << bits) - 1;
  const std::array<std::pair<Rgb*, int>, 3> corners = {
      {{&plane.origin, origin}, {&plane.horizontal, origin + 8 * along_x}, {&plane.vertical, origin + 8 * along_y}}};
  for (const auto& [corner, value] : corners) (*corner)[c] = quantised(std::max(value, 0), 80, bits);

  int error = plane_error(texels, plane, c);
  for (bool helped = true; helped && error > 0;) {
    helped = false;
    for (const auto& [corner, value] : corners)
      for (const int by : {-1, 1}) {
        const int before = (*corner)[c];
        if (before + by < 0 || before + by > top) continue;
        (*corner)[c] = before + by;
        if (const int trial = plane_error(texels, plane, c); trial < error)
          error = trial, helped = true;
        else
          (*corner)[c] = before;
      }
  }
  return error;
}

void try_plane(const std::array<Rgb, 16>& texels, Found& found) {
  EtcPlane plane;
  int error = 0;
  for (std::size_t c = 0; c < 3; ++c) error += fit_plane_channel(texels, c, plane);
  if (error < found.error) found.offer(error, pack_etc2_plane(plane));
}

// ---- EAC --------------------------------------------------------------------------------------------------------

int eac_error(EacValues& block, std::span<const std::uint8_t> values, int limit) {
  std::array<int, 8> levels{};
  for (unsigned i = 0; i < 8; ++i) levels[i] = eac_value(block, i);
  int error = 0;
  for (std::size_t t = 0; t < values.size() && error < limit; ++t) {
    int nearest = kWorst;
    for (unsigned i = 0; i < 8; ++i)
      if (const int d = square(levels[i] - values[t]); d < nearest)
        nearest = d, block.indices[t] = static_cast<std::uint8_t>(i);
    error += nearest;
  }
  return error;
}

}  // namespace

EtcBytes fit_etc2_rgb(const TexelBlock& block) {
  std::array<Rgb, 16> texels{};
  for (std::size_t t = 0; t < 16; ++t) texels[t] = {block[t][0], block[t][1], block[t][2]};
  Found found;
  try_plane(texels, found);
  for (const bool flip : {false, true})
    if (found.error > 0) try_halves(texels, flip, found);
  if (found.error > 0) try_paint(texels, found);
  return found.bytes;
}

EacValues fit_eac(std::span<const std::uint8_t, 16> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*low == *high) {
    // Table 13 has a step of 0 at index 4.
    EacValues block{*low, 1, 13, {}};
    block.indices.fill(4);
    return block;
  }
  EacValues best;
  int best_error = kWorst;
  const auto offer = [&](EacValues trial) {
    if (trial.base < 0 || trial.base > 255) return;
    if (const int error = eac_error(trial, values, best_error); error < best_error) best = trial, best_error = error;
  };
  for (int table = 0; table < 16; ++table) {
    const auto& steps = kEacModifiers[static_cast<std::size_t>(table)];
    const int reach = steps[7] - steps[3], about = (*high - *low) / reach;
    for (int multiplier = std::max(about, 1); multiplier <= std::min(about + 2, 15); ++multiplier) {
      // The lowest value at the lowest step, the highest at the highest, and between.
      const int from_low = *low - multiplier * steps[3], from_high = *high - multiplier * steps[7];
      const int first = std::min(from_low, from_high), last = std::max(from_low, from_high);
      const int by = std::max((last - first) / 2, 1);
      for (int base = first; base <= last; base += by) offer({base, multiplier, table, {}});
    }
  }
  for (int before = kWorst; best_error > 0 && best_error < before;) {
    before = best_error;
    for (const int by : {-2, -1, 1, 2}) offer({best.base + by, best.multiplier, best.table, {}});
  }
  return best;
}

void encode_etc2(const TexelBlock& wanted, std::span<std::uint8_t> bytes, TexelBlock& texels) {
  if (bytes.size() == 16) {
    std::array<std::uint8_t, 16> alpha{};
    for (std::size_t t = 0; t < 16; ++t) alpha[t] = wanted[t][3];
    const EtcBytes packed = pack_eac(fit_eac(alpha));
    std::copy(packed.begin(), packed.end(), bytes.begin());
    decode_eac_alpha(packed, texels);
  }
  const EtcBytes packed = fit_etc2_rgb(wanted);
  std::copy(packed.begin(), packed.end(), bytes.end() - 8);
  decode_etc2_rgb(packed, texels);
}

}  // namespace tessera::ktx2
