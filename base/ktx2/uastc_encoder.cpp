#include "base/ktx2/uastc_encoder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/ktx2/etc2_block.h"
#include "base/ktx2/uastc_modes.h"

namespace tessera::ktx2 {
namespace {

using SquaredError = std::int64_t;

// ---- Bits ----------------------------------------------------------------------------------------------------------

class BlockWriter {
 public:
  void put(unsigned count, std::uint32_t value) { put_bits(bytes_, (at_ += count) - count, count, value); }
  void put_at(unsigned at) { at_ = at; }
  const AstcBytes& bytes() const { return bytes_; }

 private:
  AstcBytes bytes_{};
  unsigned at_ = 0;
};

// As read_uastc() reads them: up to five digits of base 3 in 8 bits, up to three of base 5 in 7 bits, fewer in fewer.
void put_digits(BlockWriter& bits, AstcRange range, std::span<const std::uint8_t> values) {
  static constexpr std::array<unsigned, 6> kTritBits = {0, 2, 4, 5, 7, 8};
  static constexpr std::array<unsigned, 4> kQuintBits = {0, 3, 5, 7};
  const std::size_t group = range.base == 3 ? 5 : 3;
  for (std::size_t first = 0; first < values.size(); first += group) {
    const std::size_t count = std::min(group, values.size() - first);
    std::uint32_t packed = 0;
    for (std::size_t i = count; i-- > 0;)
      packed = packed * static_cast<std::uint32_t>(range.base) + (std::uint32_t{values[first + i]} >> range.bits);
    bits.put(range.base == 3 ? kTritBits[count] : kQuintBits[count], packed);
  }
}

// ---- Hints for transcoders -----------------------------------------------------------------------------------------

// What an ETC1 block starts from. Its base colours are the means of its halves.
struct Etc1Hint {
  bool flip = false, differential = false;
  std::array<std::uint32_t, 2> table{};
};

int etc1_number(int value, bool differential) {
  return differential ? (value << 3) | (value >> 2) : (value << 4) | value;
}

SquaredError etc1_error(const TexelBlock& texels, bool flip, unsigned half, const std::array<int, 3>& base,
                        std::size_t table) {
  SquaredError sum = 0;
  for (unsigned t = 0; t < 16; ++t) {
    if (etc_half(flip, t) != half) continue;
    SquaredError best = std::numeric_limits<SquaredError>::max();
    for (const int sign : {-1, 1})
      for (const int step : kEtc1Modifiers[table]) {
        SquaredError error = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const int off = std::clamp(base[c] + sign * step, 0, 255) - texels[t][c];
          error += off * off;
        }
        best = std::min(best, error);
      }
    sum += best;
  }
  return sum;
}

Etc1Hint etc1_hint(const TexelBlock& texels) {
  Etc1Hint best;
  SquaredError least = std::numeric_limits<SquaredError>::max();
  for (const bool flip : {false, true}) {
    std::array<std::array<int, 3>, 2> sums{};
    for (unsigned t = 0; t < 16; ++t)
      for (std::size_t c = 0; c < 3; ++c) sums[etc_half(flip, t)][c] += texels[t][c];
    for (const bool differential : {true, false}) {
      const int limit = differential ? 31 : 15;
      std::array<std::array<int, 3>, 2> base{};
      for (std::size_t half = 0; half < 2; ++half)
        for (std::size_t c = 0; c < 3; ++c) base[half][c] = (sums[half][c] * limit + 1020) / 2040;
      if (differential)
        for (std::size_t c = 0; c < 3; ++c) base[1][c] = std::clamp(base[1][c], base[0][c] - 4, base[0][c] + 3);
      Etc1Hint hint{flip, differential, {}};
      SquaredError error = 0;
      for (std::size_t half = 0; half < 2; ++half) {
        for (int& value : base[half]) value = etc1_number(value, differential);
        SquaredError of_half = std::numeric_limits<SquaredError>::max();
        for (std::size_t table = 0; table < 8; ++table) {
          const SquaredError e = etc1_error(texels, flip, static_cast<unsigned>(half), base[half], table);
          if (e < of_half) of_half = e, hint.table[half] = static_cast<std::uint32_t>(table);
        }
        error += of_half;
      }
      if (error < least) least = error, best = hint;
    }
  }
  return best;
}

// Multiplier and table of an EAC block whose base puts the table's ends upon the extremes.
std::uint32_t eac_hint(const TexelBlock& texels) {
  int low = 255, high = 0;
  for (const auto& texel : texels) low = std::min<int>(low, texel[3]), high = std::max<int>(high, texel[3]);
  std::uint32_t best = 0x1D;
  SquaredError least = std::numeric_limits<SquaredError>::max();
  for (int table = 0; table < 16; ++table) {
    const auto& steps = kEacModifiers[static_cast<std::size_t>(table)];
    const int span = steps[7] - steps[3], near = (high - low + span / 2) / span;
    for (int multiplier = std::max(1, near - 1); multiplier <= std::min(15, near + 1); ++multiplier) {
      const float along = static_cast<float>(-steps[3]) / static_cast<float>(span);
      const float centre = static_cast<float>(low) + static_cast<float>(high - low) * along;
      const int base = static_cast<int>(centre + 0.5f);
      SquaredError error = 0;
      for (const auto& texel : texels) {
        int off = 255;
        for (const int step : steps)
          off = std::min(off, std::abs(std::clamp(base + multiplier * step, 0, 255) - texel[3]));
        error += off * off;
      }
      if (error < least) least = error, best = static_cast<std::uint32_t>(multiplier << 4 | table);
    }
  }
  return best;
}

// ---- Solid blocks --------------------------------------------------------------------------------------------------

AstcBytes pack_solid(const std::array<std::uint8_t, 4>& color) {
  // The ETC1 block of one colour that is nearest: base, table, and which of its four steps.
  std::uint32_t table_of_best = 0, step_of_best = 0;
  std::array<std::uint32_t, 3> best_base{};
  SquaredError least = std::numeric_limits<SquaredError>::max();
  for (std::uint32_t table = 0; table < 8; ++table)
    for (std::uint32_t step = 0; step < 4; ++step) {  // from the darkest
      const int size = kEtc1Modifiers[table][step == 0 || step == 3 ? 1 : 0], moved = step < 2 ? -size : size;
      SquaredError error = 0;
      std::array<std::uint32_t, 3> base{};
      for (std::size_t c = 0; c < 3; ++c) {
        int off = 1 << 20;
        for (int value = 0; value < 32; ++value) {
          const int e = std::abs(std::clamp(etc1_number(value, true) + moved, 0, 255) - color[c]);
          if (e < off) off = e, base[c] = static_cast<std::uint32_t>(value);
        }
        error += off * off;
      }
      if (error < least) least = error, best_base = base, table_of_best = table, step_of_best = step;
    }
  BlockWriter bits;
  bits.put(kModes[kSolidMode].code_bits, kModes[kSolidMode].code);
  for (const std::uint8_t channel : color) bits.put(8, channel);
  bits.put(1, 1);
  bits.put(3, table_of_best);
  bits.put(2, step_of_best);
  for (const std::uint32_t value : best_base) bits.put(5, value);
  return bits.bytes();
}

// ---- Lines of colours ----------------------------------------------------------------------------------------------

using Line = std::array<std::array<float, 4>, 2>;  // two ends, by channel

// What channels share weights.
struct Channels {
  std::size_t first, count;
};

Line principal_line(const TexelBlock& texels, Channels channels) {
  std::array<float, 4> mean{};
  for (const auto& texel : texels)
    for (std::size_t c = 0; c < channels.count; ++c) mean[c] += static_cast<float>(texel[channels.first + c]) / 16.0f;
  std::array<std::array<float, 4>, 4> covariance{};
  for (const auto& texel : texels)
    for (std::size_t a = 0; a < channels.count; ++a)
      for (std::size_t b = 0; b < channels.count; ++b)
        covariance[a][b] += (static_cast<float>(texel[channels.first + a]) - mean[a]) *
                            (static_cast<float>(texel[channels.first + b]) - mean[b]);
  // From the channel that varies most, whose row is not orthogonal to the axis.
  std::size_t widest = 0;
  for (std::size_t c = 1; c < channels.count; ++c)
    if (covariance[c][c] > covariance[widest][widest]) widest = c;
  std::array<float, 4> axis = covariance[widest];
  for (int round = 0; round < 8; ++round) {
    float longest = 0;
    for (const float a : axis) longest = std::max(longest, std::abs(a));
    if (longest == 0) break;
    std::array<float, 4> next{};
    for (std::size_t a = 0; a < channels.count; ++a)
      for (std::size_t b = 0; b < channels.count; ++b) next[a] += covariance[a][b] * (axis[b] / longest);
    axis = next;
  }
  float squares = 0;
  for (const float a : axis) squares += a * a;
  float low = 0, high = 0;
  if (squares > 0)
    for (const auto& texel : texels) {
      float along = 0;
      for (std::size_t c = 0; c < channels.count; ++c)
        along += (static_cast<float>(texel[channels.first + c]) - mean[c]) * axis[c];
      low = std::min(low, along / squares);
      high = std::max(high, along / squares);
    }
  Line line{};
  for (std::size_t c = 0; c < channels.count; ++c) {
    line[0][c] = mean[c] + axis[c] * low;
    line[1][c] = mean[c] + axis[c] * high;
  }
  return line;
}

// Quantised ends and weights of a plane.
struct PlaneFit {
  std::array<std::array<std::uint8_t, 2>, 4> ends{};  // by channel of the plane
  std::array<std::uint8_t, 16> weights{};
  SquaredError error = std::numeric_limits<SquaredError>::max();
};

int interpolated(int low, int high, int weight) { return (low * 257 * (64 - weight) + high * 257 * weight + 32) >> 14; }

PlaneFit quantised_plane(const TexelBlock& texels, Channels channels, const Line& line, AstcRange ends,
                         AstcRange weights) {
  PlaneFit fit;
  std::array<std::array<int, 2>, 4> numbers{};
  float squares = 0;
  for (std::size_t c = 0; c < channels.count; ++c) {
    for (std::size_t side = 0; side < 2; ++side) {
      const int wanted = static_cast<int>(std::clamp(line[side][c], 0.0f, 255.0f) + 0.5f);
      fit.ends[c][side] = static_cast<std::uint8_t>(nearest_astc_endpoint(ends, wanted));
      numbers[c][side] = astc_endpoint(ends, fit.ends[c][side]);
    }
    squares += static_cast<float>((numbers[c][1] - numbers[c][0]) * (numbers[c][1] - numbers[c][0]));
  }
  const int last = weights.levels() - 1;
  fit.error = 0;
  for (std::size_t t = 0; t < 16; ++t) {
    float along = 0;
    for (std::size_t c = 0; c < channels.count; ++c)
      along += static_cast<float>((texels[t][channels.first + c] - numbers[c][0]) * (numbers[c][1] - numbers[c][0]));
    const int near =
        squares > 0 ? static_cast<int>(std::clamp(along / squares, 0.0f, 1.0f) * static_cast<float>(last) + 0.5f) : 0;
    SquaredError best = std::numeric_limits<SquaredError>::max();
    for (int w = std::max(0, near - 1); w <= std::min(last, near + 1); ++w) {
      const int weight = astc_weight(weights, w);
      SquaredError error = 0;
      for (std::size_t c = 0; c < channels.count; ++c) {
        const int off = interpolated(numbers[c][0], numbers[c][1], weight) - texels[t][channels.first + c];
        error += off * off;
      }
      if (error < best) best = error, fit.weights[t] = static_cast<std::uint8_t>(w);
    }
    fit.error += best;
  }
  return fit;
}

// The ends of least squared error for these weights; false where they do not determine them.
bool refine(const TexelBlock& texels, Channels channels, const PlaneFit& fit, AstcRange weights, Line& line) {
  float aa = 0, ab = 0, bb = 0;
  std::array<float, 4> at{}, bt{};
  for (std::size_t t = 0; t < 16; ++t) {
    const float b = static_cast<float>(astc_weight(weights, fit.weights[t])) / 64.0f, a = 1.0f - b;
    aa += a * a, ab += a * b, bb += b * b;
    for (std::size_t c = 0; c < channels.count; ++c) {
      const auto value = static_cast<float>(texels[t][channels.first + c]);
      at[c] += a * value, bt[c] += b * value;
    }
  }
  const float determinant = aa * bb - ab * ab;
  if (determinant < 1e-3f) return false;
  for (std::size_t c = 0; c < channels.count; ++c) {
    line[0][c] = (at[c] * bb - bt[c] * ab) / determinant;
    line[1][c] = (bt[c] * aa - at[c] * ab) / determinant;
  }
  return true;
}

PlaneFit fit_plane(const TexelBlock& texels, Channels channels, AstcRange ends, AstcRange weights) {
  constexpr int kRounds = 4;  // the error seldom falls in a fifth
  Line line = principal_line(texels, channels);
  PlaneFit best;
  for (int round = 0; round < kRounds; ++round) {
    const PlaneFit fit = quantised_plane(texels, channels, line, ends, weights);
    if (fit.error < best.error) best = fit;
    if (!refine(texels, channels, fit, weights, line)) break;
  }
  return best;
}

// ---- Blocks --------------------------------------------------------------------------------------------------------

// Hints go from the code to `start`: two for BC1 or one, those for ETC1 with a bias or none, those for EAC.
void put_hints(BlockWriter& bits, const UastcMode& mode, const TexelBlock& texels) {
  constexpr unsigned kEtc1Bits = 8, kBiasBits = 5, kEacBits = 8;
  constexpr std::uint32_t kNoBias = 13;  // moves no channel
  const bool alpha = mode.components != 3;
  const unsigned all = mode.start - mode.code_bits, rest = all - kEtc1Bits - (alpha ? kEacBits : 0);
  const bool bias = rest > kBiasBits;
  bits.put(rest - (bias ? kBiasBits : 0), 0);
  const Etc1Hint etc1 = etc1_hint(texels);
  bits.put(1, etc1.flip ? 1 : 0);
  bits.put(1, etc1.differential ? 1 : 0);
  bits.put(3, etc1.table[0]);
  bits.put(3, etc1.table[1]);
  if (bias) bits.put(kBiasBits, kNoBias);
  if (alpha) bits.put(kEacBits, eac_hint(texels));
}

// A block of one subset, its planes' fits in order.
struct Candidate {
  std::size_t mode = 0;
  std::array<PlaneFit, 2> planes;
  SquaredError error = std::numeric_limits<SquaredError>::max();
};

AstcBytes pack_line(Candidate candidate, const TexelBlock& texels) {
  const UastcMode& mode = kModes[candidate.mode];
  const auto planes = static_cast<std::size_t>(mode.planes);
  const int levels = mode.weight_levels;
  std::array<std::uint8_t, 8> ends{};
  for (std::size_t plane = 0, channel = 0; plane < planes; ++plane) {
    PlaneFit& fit = candidate.planes[plane];
    // The first weight has no high bit.
    const bool mirrored = 2 * fit.weights[0] >= levels;
    const std::size_t count = planes == 1 ? static_cast<std::size_t>(mode.components) : plane == 0 ? 3 : 1;
    for (std::size_t c = 0; c < count; ++c, ++channel)
      for (std::size_t side = 0; side < 2; ++side) ends[2 * channel + side] = fit.ends[c][mirrored ? 1 - side : side];
    if (mirrored)
      for (std::uint8_t& weight : fit.weights) weight = static_cast<std::uint8_t>(levels - 1 - weight);
  }
  BlockWriter bits;
  bits.put(mode.code_bits, mode.code);
  put_hints(bits, mode, texels);
  if (planes == 2) bits.put(2, 3);  // alpha has its own weights
  const AstcRange range = astc_range(mode.endpoint_levels);
  const std::span<const std::uint8_t> values(ends.data(), static_cast<std::size_t>(2 * mode.components));
  if (range.base > 1) put_digits(bits, range, values);
  for (const std::uint8_t value : values) bits.put(static_cast<unsigned>(range.bits), value & ((1u << range.bits) - 1));
  const auto weight_bits = static_cast<unsigned>(astc_range(levels).bits);
  for (std::size_t t = 0; t < 16; ++t)
    for (std::size_t plane = 0; plane < planes; ++plane)
      bits.put(weight_bits - (t == 0 ? 1 : 0), candidate.planes[plane].weights[t]);
  return bits.bytes();
}

}  // namespace

AstcBytes encode_uastc(const TexelBlock& texels) {
  if (std::all_of(texels.begin(), texels.end(), [&](const auto& texel) { return texel == texels[0]; }))
    return pack_solid(texels[0]);
  const bool opaque = std::all_of(texels.begin(), texels.end(), [](const auto& texel) { return texel[3] == 255; });
  Candidate best;
  const auto try_mode = [&](std::size_t number) {
    const UastcMode& mode = kModes[number];
    const AstcRange ends = astc_range(mode.endpoint_levels), weights = astc_range(mode.weight_levels);
    Candidate candidate{number, {}, 0};
    if (mode.planes == 1) {
      candidate.planes[0] = fit_plane(texels, {0, static_cast<std::size_t>(mode.components)}, ends, weights);
    } else {
      candidate.planes[0] = fit_plane(texels, {0, 3}, ends, weights);
      candidate.planes[1] = fit_plane(texels, {3, 1}, ends, weights);
      candidate.error += candidate.planes[1].error;
    }
    candidate.error += candidate.planes[0].error;
    if (candidate.error < best.error) best = candidate;
  };
  if (opaque)
    for (const std::size_t mode : {0, 18, 5, 1}) try_mode(mode);
  else
    for (const std::size_t mode : {10, 12, 14, 11, 13}) try_mode(mode);
  return pack_line(best, texels);
}

}  // namespace tessera::ktx2
