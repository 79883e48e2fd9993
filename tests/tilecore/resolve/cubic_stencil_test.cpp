#include <rapidcheck/gtest.h>

#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/resolve/filled_block.h"
#include "tests/tilecore/resolve/window.h"
#include "tilecore/resolve/cubic_weights.h"

namespace tessera::tilecore::cubic_stencil_test {
namespace {

using windows::fill;
using windows::Filled;
using windows::is_set;
using windows::kKernels;
using windows::Random;
using windows::UsableRows;
using windows::Window;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
constexpr BlockMask kPatterns[] = {kSquareOrder[0], kSquareOrder[1], kSquareOrder[2],
                                   kSquareOrder[3], kPairOrder[0],   kPairOrder[1]};
constexpr int kPatternCount = 6;

// ---- The definition, in double precision and in the plainest way ----------------------------------------------------

struct Reference {
  DVec4 color{0.0};
  double denominator = 1;  // sum of weights over sum of magnitudes; 0: nothing in reach
  double margin = 1;       // by how much it is told whether a ramp's weights hold
};

double reference_kernel(Reconstruction kernel, int distance) {
  const double d = std::abs(distance);
  const auto cubic = [](double x, double b, double c) {
    if (x < 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + 6 - 2 * b) / 6;
    if (x < 2)
      return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + 8 * b + 24 * c) / 6;
    return 0.0;
  };
  switch (kernel) {
    case Reconstruction::kNearest:
      return 0;
    case Reconstruction::kBilinear:
      return std::max(0.0, 1 - d / 2);
    case Reconstruction::kCubicUnscaled:
      return cubic(d, 1.0 / 3, 1.0 / 3);
    case Reconstruction::kCubic:
      return cubic(d * 2 / 3, 1.0 / 3, 1.0 / 3);
    case Reconstruction::kCubicInterpolating:
      return cubic(d / 2, 0, 0.5);
  }
  return 0;
}

Reference nearest_reference(const Window& window, const UsableRows& usable, int cx, int cy, bool first_only) {
  std::vector<std::pair<int, DVec4>> by_distance;
  for (int y = 0; y < kWindowSide; ++y)
    for (int x = 0; x < kWindowSide; ++x)
      if (is_set(usable, x, y))
        by_distance.emplace_back((x - cx) * (x - cx) + (y - cy) * (y - cy), DVec4(window.at(x, y)));
  std::stable_sort(by_distance.begin(), by_distance.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::size_t n = 1;
  while (!first_only && n < by_distance.size() && by_distance[n].first == by_distance[0].first) ++n;
  Reference r;
  for (std::size_t i = 0; i < n; ++i) r.color += by_distance[i].second / static_cast<double>(n);
  return r;
}

// Weights of taps (dx, dy, weight) that meet all independent conditions: each condition in turn is made independent
// of those before it, and then met by the least change.
std::vector<double> met(const std::vector<DVec3>& taps, std::vector<std::vector<double>> conditions, double& margin) {
  std::vector<double> weights;
  for (const DVec3& t : taps) weights.push_back(t.z);
  const auto product = [&](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < taps.size(); ++i) sum += std::abs(taps[i].z) * a[i] * b[i];
    return sum;
  };
  std::vector<std::vector<double>> apart;
  for (std::vector<double>& g : conditions) {
    const double length = product(g, g);
    for (const auto& h : apart) {
      const double share = product(g, h) / product(h, h);
      for (std::size_t i = 0; i < g.size(); ++i) g[i] -= share * h[i];
    }
    if (length > 0) margin = std::min(margin, std::abs(product(g, g) / length - 1e-3));
    if (!(product(g, g) > 1e-3 * length)) continue;
    apart.push_back(g);
    double sum = 0;
    for (std::size_t i = 0; i < g.size(); ++i) sum += weights[i] * g[i];
    const double share = sum / product(g, g);
    for (std::size_t i = 0; i < g.size(); ++i) weights[i] -= share * std::abs(taps[i].z) * g[i];
  }
  return weights;
}

// Weights that give ramps back, and on a straight border have its spread; the plain weights where no others hold.
std::vector<double> ramp_weights(const std::vector<DVec3>& taps, double& margin) {
  double plain = 0;
  DVec2 low(0.0), high(0.0);
  std::vector<double> x, y, spread_x, spread_y;
  for (const DVec3& t : taps) {
    plain += t.z;
    low = glm::min(low, DVec2(t)), high = glm::max(high, DVec2(t));
    x.push_back(t.x), y.push_back(t.y);
    spread_x.push_back(t.x * t.x - 0.25), spread_y.push_back(t.y * t.y - 0.25);
  }
  const bool border_x = (low.x < 0) != (high.x > 0), border_y = (low.y < 0) != (high.y > 0);
  std::vector<std::vector<std::vector<double>>> tries = {{x, y}};
  if (border_x != border_y) tries.insert(tries.begin(), {x, y, border_y ? spread_x : spread_y});
  for (const auto& conditions : tries) {
    std::vector<double> weights = met(taps, conditions, margin);
    double sum = 0, magnitude = 0;
    for (const double w : weights) sum += w, magnitude += std::abs(w);
    margin = std::min({margin, std::abs(sum / plain - 0.1), std::abs(sum - 0.5 * magnitude)});
    if (!(sum > 0.1 * plain && sum >= 0.5 * magnitude)) continue;
    for (double& w : weights) w /= sum;
    return weights;
  }
  std::vector<double> weights;
  for (const DVec3& t : taps) weights.push_back(t.z / plain);
  return weights;
}

Reference reference(Reconstruction kernel, const Window& window, const UsableRows& usable, int pixel) {
  const int cx = pixel % 4 + kWindowMargin, cy = pixel / 4 + kWindowMargin;
  Reference r;
  double sum = 0, magnitude = 0;
  std::vector<DVec3> taps;
  std::vector<DVec4> colors;
  for (int y = 0; y < kWindowSide; ++y)
    for (int x = 0; x < kWindowSide; ++x) {
      const double w = reference_kernel(kernel, x - cx) * reference_kernel(kernel, y - cy);
      if (!is_set(usable, x, y) || w == 0) continue;
      sum += w, magnitude += std::abs(w);
      taps.emplace_back(x - cx, y - cy, w);
      colors.emplace_back(window.at(x, y));
    }
  r.denominator = magnitude > 0 ? sum / magnitude : 0;
  if (r.denominator < 0.5) {
    const double denominator = r.denominator;
    r = nearest_reference(window, usable, cx, cy, kernel == Reconstruction::kNearest);
    r.denominator = denominator;
  } else {
    const std::vector<double> weights = ramp_weights(taps, r.margin);
    for (std::size_t i = 0; i < taps.size(); ++i) r.color += weights[i] * colors[i];
  }
  return r;
}

// ---- Tables ---------------------------------------------------------------------------------------------------------

std::vector<Stencil> all_table_stencils(Reconstruction kernel) {
  std::vector<Stencil> all;
  for (const BlockMask pattern : kPatterns)
    for (unsigned border = 0; border < kBorderCases; ++border)
      for (int p = 0; p < 16; ++p)
        if (const auto s = table_stencil(kernel, pattern, border, p)) all.push_back(*s);
  return all;
}

TEST(StencilTables, EveryMissingPixelOfEveryPatternAtEveryBorderHasAStencil) {
  for (const Reconstruction kernel : kKernels)
    for (const BlockMask pattern : kPatterns)
      for (unsigned border = 0; border < kBorderCases; ++border)
        for (int p = 0; p < 16; ++p)
          EXPECT_EQ(table_stencil(kernel, pattern, border, p).has_value(),
                    kernel != Reconstruction::kNearest && !((pattern | border_line(pattern, border)) >> p & 1));
}

TEST(StencilTables, WeightsSumToAPowerOfTwoAndFitEightBits) {
  for (const Reconstruction kernel : kKernels)
    for (const Stencil& s : all_table_stencils(kernel)) {
      EXPECT_TRUE(s.unit() == 64 || s.unit() == 128 || s.unit() == 256) << s.unit();
      EXPECT_GE(s.count, 1u);
      for (std::size_t i = 0; i < s.count; ++i)
        EXPECT_TRUE(s.taps[i].weight >= -128 && s.taps[i].weight <= 127 && s.taps[i].weight != 0);
    }
}

// The exact normalised weight of each offset, by reading the reference's answer to a window that is 1 at one pixel.
double exact_weight(Reconstruction kernel, const UsableRows& usable, int pixel, int dx, int dy) {
  Window window;
  const int x = pixel % 4 + kWindowMargin + dx, y = pixel / 4 + kWindowMargin + dy;
  if (x < 0 || y < 0 || x >= kWindowSide || y >= kWindowSide) return 0;
  window.at(x, y) = Vec4(1.0f);
  return reference(kernel, window, usable, pixel).color.x;
}

struct Deviation {
  double weight = 0, ramp_x = 0, ramp_y = 0;  // in units of the weights' last place
};
Deviation deviation(const Stencil& s, const std::function<double(int, int)>& exact) {
  Deviation d;
  for (int dy = -3; dy <= 3; ++dy)
    for (int dx = -3; dx <= 3; ++dx) {
      double stored = 0;
      for (std::size_t i = 0; i < s.count; ++i)
        if (s.taps[i].dx == dx && s.taps[i].dy == dy) stored += s.taps[i].weight;
      const double e = stored - exact(dx, dy) * s.unit();
      d.weight = std::max(d.weight, std::abs(e));
      d.ramp_x += e * dx, d.ramp_y += e * dy;
    }
  return d;
}

TEST(StencilTables, WeightsAndTheRampTheyReproduceAreWithinAUnitOfDirectEvaluation) {  // CS4
  for (const Reconstruction kernel : {Reconstruction::kBilinear, Reconstruction::kCubicUnscaled, Reconstruction::kCubic,
                                      Reconstruction::kCubicInterpolating})
    for (const BlockMask pattern : kPatterns)
      for (unsigned border = 0; border < kBorderCases; ++border) {
        const UsableRows usable = windows::repeated(pattern, border);
        for (int p = 0; p < 16; ++p) {
          const auto s = table_stencil(kernel, pattern, border, p);
          if (!s) continue;
          const Deviation d = deviation(*s, [&](int dx, int dy) { return exact_weight(kernel, usable, p, dx, dy); });
          EXPECT_LE(d.weight, 1 + 1e-9);
          EXPECT_LE(std::abs(d.ramp_x), 1 + 1e-9)
              << static_cast<int>(kernel) << " " << pattern << " " << border << " " << p;
          EXPECT_LE(std::abs(d.ramp_y), 1 + 1e-9);
          if (border == 0) {
            EXPECT_NEAR(d.ramp_x, 0, 1e-12);  // the reference solves for it
            EXPECT_NEAR(d.ramp_y, 0, 1e-12);
          }
        }
      }
}

// The failing twin of rounding after normalising: weights in 8 bits as the kernel gives them, divided by their sum.
TEST(StencilTables, RoundingBeforeNormalisingLosesStencils) {
  int lost = 0, beyond_a_unit = 0;
  for (unsigned border = 0; border < kBorderCases; ++border) {
    const UsableRows usable = windows::repeated(kSquareOrder[0], border, false);
    for (int p = 0; p < 16; ++p) {
      if (kSquareOrder[0] >> p & 1) continue;
      double rounded = 0, largest = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const int x = p % 4 + kWindowMargin + dx, y = p / 4 + kWindowMargin + dy;
          if (!is_set(usable, x, y)) continue;
          const double w = reference_kernel(Reconstruction::kCubicUnscaled, dx) *
                           reference_kernel(Reconstruction::kCubicUnscaled, dy);
          rounded += std::round(w * 128), largest = std::max(largest, w);
        }
      if (rounded == 0)
        ++lost;
      else
        beyond_a_unit += std::abs(rounded / 128 - 1) > 1.0 / 128;
    }
  }
  EXPECT_GT(lost, 0);
  EXPECT_GT(beyond_a_unit, 0);
}

TEST(StencilTables, SymmetricStencilsAreKeptOnce) {
  std::size_t pixels = 0, bits_apart = 0;
  for (const Reconstruction kernel : kKernels)
    for (const Stencil& s : all_table_stencils(kernel)) ++pixels, bits_apart += packed_stencil_bits(s.count);
  const StencilTableSize size = stencil_table_size();
  // Three quarters of the pixels are missing in four patterns, half in two; less the pixels that tile_border.h adds.
  std::size_t missing = 0;
  for (const Reconstruction kernel : kKernels)
    for (const BlockMask pattern : kPatterns)
      for (unsigned border = 0; border < kBorderCases && kernel != Reconstruction::kNearest; ++border)
        missing += static_cast<std::size_t>(16 - std::popcount(pattern) - std::popcount(border_line(pattern, border)));
  EXPECT_EQ(pixels, missing);
  EXPECT_LT(size.stencils, 80u);
  EXPECT_LT(size.stencil_bits, bits_apart / 40);
  EXPECT_EQ(size.index_entries, 4u * 16 * 2 * 16);
  RecordProperty("stencils", static_cast<int>(size.stencils));
  RecordProperty("stencil_bytes", static_cast<int>((size.stencil_bits + 7) / 8));
}

RC_GTEST_PROP(PackedStencil, UnpacksToItselfAtAnyBit, (std::uint32_t seed)) {
  Random random(seed);
  Stencil s;
  s.count = static_cast<std::size_t>(1 + windows::below(random, kMaxTaps));
  for (std::size_t i = 0; i < s.count; ++i)
    s.taps[i] = {static_cast<std::int8_t>(windows::below(random, 8) - 4),
                 static_cast<std::int8_t>(windows::below(random, 8) - 4),
                 static_cast<std::int16_t>(windows::below(random, 256) - 128)};
  std::array<std::uint8_t, 64> stream{};
  const auto at = static_cast<std::size_t>(windows::below(random, 200));
  RC_ASSERT(pack_stencil(s, stream, at) == at + 4 + 14 * s.count);
  RC_ASSERT(unpack_stencil(stream, at) == s);
  for (std::size_t bit = 0; bit < 8 * stream.size(); ++bit)
    if (bit < at || bit >= at + packed_stencil_bits(s.count)) RC_ASSERT(read_packed(stream, bit, 1, false) == 0);
}

// ---- Against the definition
// -------------------------------------------------------------------------------------------

// Largest difference from the reference, relative to the colours' size; pixels whose stencil is about to give up are
// left out.
double worst_error(Reconstruction kernel, const Window& window, BlockMask missing, const Filled& got) {
  const UsableRows usable = windows::without(window.usable, missing);
  double worst = 0;
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const Reference r = reference(kernel, window, usable, p);
    if (std::abs(r.denominator - 0.5) < 1e-4 || r.margin < 1e-9) continue;
    for (int c = 0; c < 4; ++c)
      worst = std::max(worst, std::abs(r.color[c] - static_cast<double>(got.at(p)[c])) / (c == 2 ? 1000 : 4));
  }
  return worst;
}

bool has_usable(const UsableRows& rows) {
  return std::any_of(rows.begin(), rows.end(), [](std::uint16_t row) { return (row & 0x3ff) != 0; });
}

RC_GTEST_PROP(CubicStencil, DirectEvaluationIsTheDefinition, (std::uint32_t seed)) {
  Random random(seed);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  window.usable = windows::random_usable(random);
  const auto missing = static_cast<BlockMask>(windows::below(random, 2) ? random() : ~random() | random());
  for (const Reconstruction kernel : kKernels) {
    const Filled got = fill(kernel, window.view(), missing);
    if (!has_usable(windows::without(window.usable, missing))) {
      RC_ASSERT(got.unfilled == missing);
      continue;
    }
    RC_ASSERT(got.unfilled == 0);
    RC_ASSERT(got.work.pixels == static_cast<std::uint64_t>(std::popcount(missing)));
    // All pixels of a block are evaluated directly, or none: then a table has its surroundings (the next test).
    if (got.work.direct_pixels > 0) {
      RC_ASSERT(got.work.direct_pixels == got.work.pixels);
      RC_ASSERT(worst_error(kernel, window, missing, got) < 2e-6);
    }
    for (int p = 0; p < 16; ++p) RC_ASSERT((missing >> p & 1) || got.at(p) == Vec4(-77.0f));
  }
}

RC_GTEST_PROP(CubicStencil, WeightsAreTheTablesWhereSurroundingsAreRegularAndTheDefinitionElsewhere,
              (std::uint32_t seed)) {
  Random random(seed);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  const BlockMask pattern = kPatterns[windows::below(random, kPatternCount)];
  const auto border = static_cast<unsigned>(windows::below(random, 2) * windows::below(random, 16));
  window.usable = windows::repeated(pattern, border);
  const auto missing = static_cast<BlockMask>(~(pattern | border_line(pattern, border)) &
                                              (windows::below(random, 2) ? 0xffffu : random()));
  for (const Reconstruction kernel : kKernels) {
    const Filled got = fill(kernel, window.view(), missing);
    RC_ASSERT(got.unfilled == 0);
    if (kernel == Reconstruction::kNearest) {
      RC_ASSERT(worst_error(kernel, window, missing, got) == 0);
      continue;
    }
    RC_ASSERT(got.work.direct_pixels == 0u);
    std::uint64_t taps = 0;
    for (int p = 0; p < 16; ++p) {
      if (!(missing >> p & 1)) continue;
      const Stencil s = *table_stencil(kernel, pattern, border, p);
      DVec4 expected(0.0);
      for (std::size_t i = 0; i < s.count; ++i)
        expected += DVec4(window.at(p % 4 + kWindowMargin + s.taps[i].dx, p / 4 + kWindowMargin + s.taps[i].dy)) *
                    (static_cast<double>(s.taps[i].weight) / s.unit());
      for (int c = 0; c < 4; ++c)
        RC_ASSERT(std::abs(expected[c] - static_cast<double>(got.at(p)[c])) < 2e-6 * (c == 2 ? 1000 : 4));
      taps += s.count;
    }
    RC_ASSERT(got.work.taps == taps);
  }
  // A hole within reach: no table has it.
  const int hole = windows::below(random, 4) + 4 * windows::below(random, 4);
  if (!(pattern >> hole & 1)) return;
  auto& row = window.usable[static_cast<std::size_t>(hole / 4 + kWindowMargin)];
  row = static_cast<std::uint16_t>(row & ~(1u << (hole % 4 + kWindowMargin)));
  const Filled holed = fill(Reconstruction::kCubic, window.view(), missing);
  RC_ASSERT(holed.work.direct_pixels == holed.work.pixels);
  RC_ASSERT(worst_error(Reconstruction::kCubic, window, missing, holed) < 2e-6);
}

// Mirrored images under mirrored patterns give mirrored results, but for the order of sums.
RC_GTEST_PROP(CubicStencil, MirroredPatternsShareTheirStencils, (std::uint32_t seed)) {
  Random random(seed);
  Window window, mirrored;
  window.fill([&](int, int) { return windows::random_color(random); });
  mirrored.fill([&](int x, int y) { return window.at(9 - x, y); });
  const auto border = static_cast<unsigned>(windows::below(random, 16));
  for (const BlockMask pattern : {kSquareOrder[0], kPairOrder[0]}) {
    BlockMask other = 0;
    for (int p = 0; p < 16; ++p)
      if (pattern >> p & 1) other = static_cast<BlockMask>(other | 1u << mirrored_pixel(p, 1));
    window.usable = windows::repeated(pattern, border);
    mirrored.usable = windows::repeated(other, mirrored_border(border, 1));
    for (const Reconstruction kernel :
         {Reconstruction::kBilinear, Reconstruction::kCubic, Reconstruction::kCubicInterpolating}) {
      const auto missing = static_cast<BlockMask>(~(pattern | border_line(pattern, border))),
                 other_missing = static_cast<BlockMask>(~(other | border_line(other, mirrored_border(border, 1))));
      const Filled a = fill(kernel, window.view(), missing), b = fill(kernel, mirrored.view(), other_missing);
      for (int p = 0; p < 16; ++p)
        for (int c = 0; c < 4; ++c)
          RC_ASSERT(std::abs(a.at(p)[c] - b.at(mirrored_pixel(p, 1))[c]) <= 1e-6f * (c == 2 ? 1000.0f : 4.0f));
    }
  }
}

// Lines on a tile's border leave no missing pixel outside of the rendered pixels around it: ramps come back, wherever
// a tile ends. Without the lines, quarters are wrong there.
TEST(CubicStencil, ARampComesBackAtEveryBorder) {  // TLB1
  const auto ramp = [](int x, int y) {
    return Vec4(0.5f + 0.03f * static_cast<float>(x) - 0.02f * static_cast<float>(y));
  };
  for (const bool lines : {true, false}) {
    double worst = 0;
    for (const Reconstruction kernel : {Reconstruction::kBilinear, Reconstruction::kCubic})
      for (const BlockMask pattern : kPatterns)
        for (unsigned border = 0; border < kBorderCases; ++border) {
          Window window;
          window.fill(ramp);
          window.usable = windows::repeated(pattern, border, lines);
          const auto missing =
              static_cast<BlockMask>(~(pattern | (lines ? border_line(pattern, border) : BlockMask{0})));
          const Filled got = fill(kernel, window.view(), missing);
          for (int p = 0; p < 16; ++p)
            if (missing >> p & 1)
              worst = std::max(worst, static_cast<double>(std::abs(got.at(p).x - ramp(p % 4 + 3, p / 4 + 3).x)));
        }
    if (lines)
      EXPECT_LT(worst, 0.05 * 2 / 64);  // a unit of the weights
    else
      EXPECT_GT(worst, 0.02);  // the failing twin
  }
}

// ---- Flat colours
// -----------------------------------------------------------------------------------------------------

int units_apart(float a, float b) {
  const auto ordered = [](float f) {
    const auto bits = std::bit_cast<std::int32_t>(f);
    return std::int64_t{bits < 0 ? std::numeric_limits<std::int32_t>::min() - bits : bits};
  };
  return static_cast<int>(std::min<std::int64_t>(std::abs(ordered(a) - ordered(b)), 1000));
}

RC_GTEST_PROP(CubicStencil, AFlatColourComesBackToOneUnitInTheLastPlace, (std::uint32_t seed)) {  // CS1
  Random random(seed);
  const auto any_float = [&] {
    return std::ldexp(windows::uniform(random, 1, 2), windows::below(random, 240) - 120) *
           (windows::below(random, 2) ? 1.0f : -1.0f);
  };
  const Vec4 flat(any_float(), any_float(), any_float(), 1.0f);
  Window window;
  window.fill([&](int, int) { return flat; });
  window.usable = windows::random_usable(random);
  const auto missing = static_cast<BlockMask>(random() | random());
  if (!has_usable(windows::without(window.usable, missing))) return;
  for (const Reconstruction kernel : kKernels) {
    const Filled got = fill(kernel, window.view(), missing);
    for (int p = 0; p < 16; ++p)
      for (int c = 0; c < 4; ++c) RC_ASSERT(!(missing >> p & 1) || units_apart(got.at(p)[c], flat[c]) <= 1);
  }
}

// The same for the patterns themselves, on many mantissas, and the failing twin: the sum of products over the sum of
// weights, one after the other.
TEST(CubicStencil, AFlatColourUnderThePatternsIsExactToAUnitAndAPlainQuotientIsNot) {
  Random random(1);
  int worst = 0, worst_plain = 0;
  for (int i = 0; i < 2000; ++i) {
    const float value = windows::uniform(random, 1, 2);
    Window window;
    window.fill([&](int, int) { return Vec4(value); });
    for (const BlockMask pattern : kPatterns) {
      window.usable = windows::repeated(pattern);
      for (const Reconstruction kernel : kKernels) {
        const Filled got = fill(kernel, window.view(), static_cast<BlockMask>(~pattern));
        for (int p = 0; p < 16; ++p)
          if (!(pattern >> p & 1)) worst = std::max(worst, units_apart(got.at(p).x, value));
      }
    }
    float sum = 0, weights = 0;
    for (int dy = -2; dy <= 2; ++dy)
      for (int dx = -2; dx <= 2; ++dx) {
        if (((dx + dy) & 1) == 0) continue;
        const auto w =
            static_cast<float>(kernel_weight(Reconstruction::kCubic, dx) * kernel_weight(Reconstruction::kCubic, dy));
        sum += w * value, weights += w;
      }
    worst_plain = std::max(worst_plain, units_apart(sum / weights, value));
  }
  EXPECT_LE(worst, 1);
  EXPECT_GT(worst_plain, 1);
}

// ---- Unusable pixels
// -----------------------------------------------------------------------------------------------

TEST(CubicStencil, PixelsThatAreNotUsableAreNotEvenRead) {  // CS2
  // Sixteen pixels on the heap and nothing around them.
  const auto block = std::make_unique<Vec4[]>(16);
  for (int i = 0; i < 16; ++i) block[static_cast<std::size_t>(i)] = Vec4(static_cast<float>(i % 4));
  for (const BlockMask pattern : kPatterns) {
    const BlockWindow window{block.get() - kWindowMargin * 4 - kWindowMargin, 4, windows::repeated(pattern, 15)};
    for (const Reconstruction kernel : kKernels)
      EXPECT_EQ(fill(kernel, window, static_cast<BlockMask>(~pattern)).unfilled, 0);
  }
}

RC_GTEST_PROP(CubicStencil, UnusablePixelsHaveNoInfluence, (std::uint32_t seed)) {  // CS2
  Random random(seed);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  window.usable = windows::random_usable(random);
  const auto missing = static_cast<BlockMask>(random() | random());
  Window poisoned = window;
  const UsableRows usable = windows::without(window.usable, missing);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x)
      if (!is_set(usable, x, y)) poisoned.at(x, y) = Vec4(windows::below(random, 2) ? kNan : kInfinity);
    poisoned.usable[static_cast<std::size_t>(y)] |= 0xfc00;  // no pixels of the window
  }
  for (const Reconstruction kernel : kKernels) {
    const Filled a = fill(kernel, window.view(), missing), b = fill(kernel, poisoned.view(), missing);
    RC_ASSERT(a.color == b.color && a.unfilled == b.unfilled && b.work.non_finite_pixels == 0u);
  }
}

RC_GTEST_PROP(CubicStencil, NonFiniteNeighboursAreAsIfNotUsable, (std::uint32_t seed)) {  // CS2, CS3
  Random random(seed);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  window.usable = windows::random_usable(random);
  const auto missing = static_cast<BlockMask>(random() | random());
  Window without_bad = window;
  const UsableRows usable = windows::without(window.usable, missing);
  constexpr float kBad[] = {kNan, kInfinity, -kInfinity};
  std::uint64_t bad = 0;
  for (int i = 0; i < 1 + windows::below(random, 12); ++i) {
    const int x = windows::below(random, 10), y = windows::below(random, 10);
    if (!is_set(usable, x, y) || !is_set(without_bad.usable, x, y)) continue;
    window.at(x, y)[windows::below(random, 4)] = kBad[windows::below(random, 3)];
    auto& row = without_bad.usable[static_cast<std::size_t>(y)];
    row = static_cast<std::uint16_t>(row & ~(1u << x));
    ++bad;
  }
  if (!has_usable(usable)) return;
  for (const Reconstruction kernel : kKernels) {
    const Filled a = fill(kernel, window.view(), missing), b = fill(kernel, without_bad.view(), missing);
    RC_ASSERT(a.unfilled == b.unfilled);
    RC_ASSERT(a.work.non_finite_pixels == 0u || a.work.non_finite_pixels == bad);
    // Tables have surroundings with such pixels, and not those without.
    if (a.work.direct_pixels >= static_cast<std::uint64_t>(std::popcount(missing)))
      RC_ASSERT(a.color == b.color || a.unfilled != 0);
    for (int p = 0; p < 16; ++p)
      for (int c = 0; c < 4; ++c) RC_ASSERT(a.unfilled || std::isfinite(a.at(p)[c]));
  }
}

TEST(CubicStencil, ANonFinitePixelLeavesPixelsBeyondItsReachAsTheyWere) {
  Random random(3);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  window.usable = windows::repeated(kPairOrder[0]);
  const auto missing = static_cast<BlockMask>(~kPairOrder[0]);
  const Filled before = fill(Reconstruction::kBilinear, window.view(), missing);
  window.at(3, 3).y = -kInfinity;  // the block's pixel (0, 0)
  const Filled after = fill(Reconstruction::kBilinear, window.view(), missing);
  EXPECT_EQ(after.work.non_finite_pixels, 1u);
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const bool beside = p == 1 || p == 4;
    EXPECT_EQ(after.at(p) == before.at(p), !beside) << p;
    EXPECT_TRUE(std::isfinite(after.at(p).y));
  }
  // The failing twin: the plain sum takes it over.
  EXPECT_FALSE(std::isfinite(0.25f * (window.at(3, 3).y + window.at(5, 3).y + window.at(4, 2).y + window.at(4, 4).y)));
}

// CS6. Blocks amid others of their rate take another way where registers hold two pixels; a hole, a pixel that is not
// finite and colours whose sum is infinite lead back from it.
TEST(CubicStencil, EveryInstructionSetGivesTheSameBits) {
  Random random(17);
  enum Kind { kPlain, kHole, kNotFinite, kHuge, kKinds };
  for (const Reconstruction kernel : kKernels)
    for (const BlockMask pattern : kPatterns)
      for (int kind = 0; kind < kKinds; ++kind) {
        Window window;
        const float scale = kind == kHuge ? 0x1p124f : 1.0f;
        window.fill([&](int, int) { return kind == kHuge ? Vec4(scale) : windows::random_color(random); });
        window.usable = windows::repeated(pattern);
        const int x = 3 + std::countr_zero(static_cast<unsigned>(pattern)) % 4,
                  y = 3 + std::countr_zero(static_cast<unsigned>(pattern)) / 4;
        if (kind == kHole)
          window.usable[static_cast<std::size_t>(y)] =
              static_cast<std::uint16_t>(window.usable[static_cast<std::size_t>(y)] & ~(1u << x));
        if (kind == kNotFinite) window.at(x, y).y = kNan;
        for (const bool whole : {true, false}) {
          const auto missing = static_cast<BlockMask>(~pattern & (whole ? 0xffffu : random()));
          std::optional<Filled> expected;
          for (const std::string& target : simd_target_names()) {
            force_simd_target(target);
            const Filled got = fill(kernel, window.view(), missing);
            if (!expected) expected = got;
            EXPECT_EQ(std::memcmp(got.color.data(), expected->color.data(), sizeof got.color), 0)
                << target << " kernel " << static_cast<int>(kernel) << " pattern " << pattern << " kind " << kind
                << (whole ? "" : ", some pixels");
            EXPECT_EQ(got.work.taps, expected->work.taps) << target;
            EXPECT_EQ(got.work.direct_pixels, expected->work.direct_pixels) << target;
            EXPECT_EQ(got.work.pixels, expected->work.pixels) << target;
          }
          force_simd_target("");
          EXPECT_EQ(expected->work.taps > 0, missing != 0);
        }
      }
}

TEST(CubicStencil, AWindowWithNothingUsableIsReportedAndNothingIsWritten) {
  Window window;
  window.fill([](int, int) { return Vec4(1.0f); });
  for (const bool all_bad : {false, true}) {
    if (all_bad) {
      window.fill([](int, int) { return Vec4(kNan); });
      window.usable = windows::repeated(kSquareOrder[1]);
    }
    for (const Reconstruction kernel : kKernels) {
      const auto missing = static_cast<BlockMask>(~kSquareOrder[1]);
      const Filled got = fill(kernel, window.view(), missing);
      EXPECT_EQ(got.unfilled, missing);
      EXPECT_EQ(got.work.pixels, 0u);
      for (int p = 0; p < 16; ++p) EXPECT_TRUE(all_bad || got.at(p) == Vec4(-77.0f));
    }
  }
}

// ---- Lopsided surroundings
// ----------------------------------------------------------------------------------------------

TEST(CubicStencil, WhereNegativeLobesEatTheSumTheNearestPixelsStandIn) {  // CS5
  Window window;
  Random random(5);
  window.fill([&](int, int) { return Vec4(windows::uniform(random, 0.9f, 1.1f)); });
  // One pixel diagonally beside (1, 1), and those three away in one direction and one in the other: weights 81, and -9
  // each, of 256.
  const auto set = [&](int dx, int dy) {
    window.usable[static_cast<std::size_t>(4 + dy)] |= static_cast<std::uint16_t>(1u << (4 + dx));
  };
  set(-1, -1);
  for (const auto& [dx, dy] : {std::pair{-1, 3}, {1, 3}, {-3, 1}, {3, 1}, {3, -1}, {-3, -1}, {-1, -3}, {1, -3}})
    set(dx, dy);
  const auto missing = static_cast<BlockMask>(1u << 5);
  const Filled got = fill(Reconstruction::kCubicInterpolating, window.view(), missing);
  EXPECT_EQ(got.work.fallbacks, 1u);
  EXPECT_EQ(got.at(5), window.at(3, 3));
  // The failing twin: the quotient lies far outside the range of its inputs.
  double sum = 0, weights = 0;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x) {
      const double w = is_set(window.usable, x, y) ? reference_kernel(Reconstruction::kCubicInterpolating, x - 4) *
                                                         reference_kernel(Reconstruction::kCubicInterpolating, y - 4)
                                                   : 0;
      sum += w * static_cast<double>(window.at(x, y).x), weights += w;
    }
  EXPECT_NEAR(weights, 9.0 / 256, 1e-12);
  EXPECT_TRUE(sum / weights < 0.7 || sum / weights > 1.3) << sum / weights;
}

TEST(CubicStencil, OnlyNegativeWeightsOrNoneInReachFallBackToo) {
  Window window;
  window.fill([](int x, int y) { return Vec4(static_cast<float>(x + 10 * y)); });
  window.usable[3] = 1u << 9;  // six to the right of pixel (0, 0)
  const Filled far = fill(Reconstruction::kBilinear, window.view(), 1);
  EXPECT_EQ(far.at(0).x, 39.0f);
  EXPECT_EQ(far.work.fallbacks, 1u);
  window.usable[3] = 0;
  window.usable[4] = 1u << 5;  // (2, 1) from pixel (0, 0): negative
  const Filled negative = fill(Reconstruction::kCubic, window.view(), 1);
  EXPECT_EQ(negative.at(0).x, 45.0f);
  EXPECT_EQ(negative.work.fallbacks, 1u);
  // Equally near ones: their mean; kNearest takes the first.
  window.usable[4] = 0, window.usable[3] = (1u << 9);
  window.usable[9] = 1u << 3;
  EXPECT_EQ(fill(Reconstruction::kCubic, window.view(), 1).at(0).x, (39.0f + 93.0f) / 2);
  EXPECT_EQ(fill(Reconstruction::kNearest, window.view(), 1).at(0).x, 39.0f);
  EXPECT_EQ(fill(Reconstruction::kNearest, window.view(), 1).work.fallbacks, 0u);
}

// The resolve unit shows black there (Desampling.BesideHighlightsNothingIsDarkerThanBlack).
TEST(CubicStencil, BesideAFireflyLightTurnsNegative) {
  Window window;
  window.fill([](int, int) { return Vec4(0.1f); });
  window.at(5, 4) = Vec4(1000.0f);
  window.usable = windows::repeated(kPairOrder[1]);
  const auto missing = static_cast<BlockMask>(~kPairOrder[1]);
  const Filled got = fill(Reconstruction::kCubic, window.view(), missing);
  EXPECT_TRUE(std::any_of(got.color.begin(), got.color.end(), [](const Vec4& c) { return c.x < 0 && c.x != -77.0f; }));
}

TEST(CubicStencil, TheUnscaledCubicIsBilinearOnTheLatticesOfFourAndEight) {
  Random random(9);
  Window window;
  window.fill([&](int, int) { return windows::random_color(random); });
  for (const BlockMask pattern : kPatterns) {
    window.usable = windows::repeated(pattern);
    const auto missing = static_cast<BlockMask>(~pattern);
    EXPECT_EQ(fill(Reconstruction::kCubicUnscaled, window.view(), missing).color,
              fill(Reconstruction::kBilinear, window.view(), missing).color);
  }
  // The failing twin: rows are no such lattice.
  const auto rows = static_cast<BlockMask>(kSquareOrder[0] | kSquareOrder[2]);
  window.usable = windows::repeated(rows);
  EXPECT_NE(fill(Reconstruction::kCubicUnscaled, window.view(), static_cast<BlockMask>(~rows)).color,
            fill(Reconstruction::kBilinear, window.view(), static_cast<BlockMask>(~rows)).color);
}

}  // namespace
}  // namespace tessera::tilecore::cubic_stencil_test
