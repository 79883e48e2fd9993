#include "base/ktx2/astc_fit.h"

#include <algorithm>
#include <limits>

namespace tessera::ktx2 {
namespace {

constexpr int kNoFit = std::numeric_limits<int>::max();

// The values of a range, sorted by their unquantized numbers.
struct Ladder {
  std::array<std::uint8_t, 256> values{};
  std::array<std::uint8_t, 256> numbers{};
  std::array<std::uint8_t, 256> nearest{};  // rung by number, for endpoints
  int rungs = 0;
};

Ladder sorted_ladder(AstcRange range, int (*number_of)(AstcRange, int)) {
  Ladder ladder;
  ladder.rungs = range.levels();
  const auto count = static_cast<std::size_t>(ladder.rungs);
  for (std::size_t i = 0; i < count; ++i) ladder.values[i] = static_cast<std::uint8_t>(i);
  std::sort(ladder.values.begin(), ladder.values.begin() + ladder.rungs,
            [&](int a, int b) { return number_of(range, a) < number_of(range, b); });
  for (std::size_t i = 0; i < count; ++i)
    ladder.numbers[i] = static_cast<std::uint8_t>(number_of(range, ladder.values[i]));
  std::size_t rung = 0;
  for (int number = 0; number < 256; ++number) {
    while (rung + 1 < count && ladder.numbers[rung + 1] - number < number - ladder.numbers[rung]) ++rung;
    ladder.nearest[static_cast<std::size_t>(number)] = static_cast<std::uint8_t>(rung);
  }
  return ladder;
}

// Ladders of all ranges that fits have, made once.
struct Ladders {
  std::array<Ladder, 21> weights, endpoints;
};
const Ladders& ladders() {
  static const Ladders kLadders = [] {
    Ladders all;
    for (std::size_t i = 0; i < kAstcRanges.size(); ++i) {
      const int levels = kAstcRanges[i].levels();
      if (levels <= 32) all.weights[i] = sorted_ladder(kAstcRanges[i], astc_weight);
      if (levels >= 6) all.endpoints[i] = sorted_ladder(kAstcRanges[i], astc_endpoint);
    }
    return all;
  }();
  return kLadders;
}
const Ladder& ladder_of(const std::array<Ladder, 21>& all, AstcRange range) {
  std::size_t i = 0;
  while (kAstcRanges[i].levels() != range.levels()) ++i;
  return all[i];
}

// A fit in rungs of the two ladders, before they become values.
struct Rungs {
  std::array<std::array<int, 2>, 3> ends{};
  std::array<int, 4> weights{}, errors{};
  int error = kNoFit;
};

class LineFit {
 public:
  LineFit(const std::array<std::array<std::uint8_t, 3>, 4>& colors, unsigned used, std::size_t channels,
          const AstcFitRanges& ranges)
      : colors_(colors),
        channels_(channels),
        weights_(ladder_of(ladders().weights, ranges.weights)),
        ends_(ladder_of(ladders().endpoints, ranges.endpoints)) {
    for (std::size_t s = 0; s < 4; ++s)
      if (((used >> s) & 1u) != 0) used_[count_++] = s;
  }

  AstcFit run() {
    // The outermost colours begin at any of the lower and any of the upper rungs.
    const int top = weights_.rungs - 1, span = count_ > 2 ? top / 3 : 0;
    for (int low = 0; low <= span; ++low)
      for (int high = top - span; high <= top; ++high)
        if (best_.error > 0) try_from(low, high);
    while (best_.error > 0 && step())
      ;
    AstcFit fit;
    for (std::size_t c = 0; c < channels_; ++c)
      for (std::size_t side = 0; side < 2; ++side)
        fit.endpoints[c][side] = ends_.values[static_cast<std::size_t>(best_.ends[c][side])];
    for (std::size_t s = 0; s < 4; ++s) fit.weights[s] = weights_.values[static_cast<std::size_t>(best_.weights[s])];
    fit.errors = best_.errors;
    return fit;
  }

 private:
  int weight(int rung) const { return weights_.numbers[static_cast<std::size_t>(rung)]; }
  int end(int rung) const { return ends_.numbers[static_cast<std::size_t>(rung)]; }

  int brightness(std::size_t selector) const {
    int sum = 0;
    for (std::size_t c = 0; c < channels_; ++c) sum += colors_[selector][c];
    return sum;
  }

  // Weights by where colours lie between the outermost ones; then ends by least squares and the nearest weights, twice.
  void try_from(int low, int high) {
    Rungs trial;
    const int dark = brightness(used_[0]), range = std::max(brightness(used_[count_ - 1]) - dark, 1);
    for (std::size_t i = 0; i < count_; ++i) {
      const int wanted = weight(low) + (weight(high) - weight(low)) * (brightness(used_[i]) - dark) / range;
      int rung = low;
      while (rung < high && wanted - weight(rung) > weight(rung + 1) - wanted) ++rung;
      trial.weights[used_[i]] = rung;
    }
    for (int round = 0; round < 2; ++round) {
      fit_ends(trial);
      choose_weights(trial);
      if (trial.error < best_.error) best_ = trial;
    }
  }

  // Ends of least squared error for the weights. With v = 64 - w: [vv vw; vw ww] (low, high) = (vc, wc) / 64.
  void fit_ends(Rungs& trial) const {
    int vv = 0, vw = 0, ww = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const int w = weight(trial.weights[used_[i]]), v = 64 - w;
      vv += v * v, vw += v * w, ww += w * w;
    }
    const int determinant = vv * ww - vw * vw;
    for (std::size_t c = 0; c < channels_; ++c) {
      int vc = 0, wc = 0;
      for (std::size_t i = 0; i < count_; ++i) {
        const int w = weight(trial.weights[used_[i]]), color = colors_[used_[i]][c];
        vc += 64 * (64 - w) * color, wc += 64 * w * color;
      }
      for (std::size_t side = 0; side < 2; ++side) {
        std::int64_t number = colors_[used_[0]][c];
        if (determinant > 0) {
          const std::int64_t top =
              side == 0 ? std::int64_t{ww} * vc - std::int64_t{vw} * wc : std::int64_t{vv} * wc - std::int64_t{vw} * vc;
          number = (2 * top + determinant) / (2 * std::int64_t{determinant});
        }
        trial.ends[c][side] = ends_.nearest[static_cast<std::size_t>(std::clamp<std::int64_t>(number, 0, 255))];
      }
    }
  }

  // The best weight of each colour for the ends, and the error of all.
  void choose_weights(Rungs& trial) const {
    trial.error = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      int nearest = kNoFit;
      for (int rung = 0; rung < weights_.rungs; ++rung) {
        const int w = weight(rung);
        int error = 0;
        for (std::size_t c = 0; c < channels_; ++c) {
          // The specification's 16-bit blend of 8-bit ends.
          const int low = end(trial.ends[c][0]) * 257, high = end(trial.ends[c][1]) * 257;
          const int off = ((low * (64 - w) + high * w + 32) >> 14) - colors_[used_[i]][c];
          error += off * off;
        }
        if (error < nearest) nearest = error, trial.weights[used_[i]] = rung;
      }
      trial.errors[used_[i]] = nearest;
      trial.error += nearest;
    }
  }

  // Moves both ends of a channel by up to two rungs. False where nothing helps.
  bool step() {
    const Rungs from = best_;
    const auto inside = [&](int rung) { return rung >= 0 && rung < ends_.rungs; };
    for (std::size_t c = 0; c < channels_; ++c)
      for (int low = from.ends[c][0] - 2; low <= from.ends[c][0] + 2; ++low)
        for (int high = from.ends[c][1] - 2; high <= from.ends[c][1] + 2; ++high) {
          if (!inside(low) || !inside(high)) continue;
          Rungs trial = from;
          trial.ends[c] = {low, high};
          choose_weights(trial);
          if (trial.error < best_.error) best_ = trial;
        }
    return best_.error < from.error;
  }

  const std::array<std::array<std::uint8_t, 3>, 4>& colors_;
  std::size_t channels_, count_ = 0;
  std::array<std::size_t, 4> used_{};
  const Ladder& weights_;
  const Ladder& ends_;
  Rungs best_;
};

}  // namespace

AstcFit fit_astc(const std::array<std::array<std::uint8_t, 3>, 4>& colors, unsigned used, std::size_t channels,
                 const AstcFitRanges& ranges) {
  return LineFit(colors, used, channels, ranges).run();
}

}  // namespace tessera::ktx2
