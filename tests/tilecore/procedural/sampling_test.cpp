#include <complex>

#include "tests/support/tests.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore::sampling_test {
namespace {

// Smallest toroidal distance among the cells whose rank is below `count`.
double closest_pair(const std::vector<std::uint16_t>& ranks, int n, int count) {
  double closest = 1e9;
  for (int a = 0; a < n * n; ++a)
    for (int b = a + 1; b < n * n; ++b) {
      if (ranks[static_cast<std::size_t>(a)] >= count || ranks[static_cast<std::size_t>(b)] >= count) continue;
      const int dx = std::abs(a % n - b % n), dy = std::abs(a / n - b / n);
      closest = std::min(closest, std::hypot(std::min(dx, n - dx), std::min(dy, n - dy)));
    }
  return closest;
}

TEST(TemporalPattern, RanksAreAPermutationAndItsPrefixesAreSpreadOut) {
  for (const int n : {8, 16, 32}) {
    const auto ranks = void_and_cluster_ranks(n);
    EXPECT_EQ(std::set(ranks.begin(), ranks.end()).size(), static_cast<std::size_t>(n * n));
    EXPECT_EQ(*std::max_element(ranks.begin(), ranks.end()), n * n - 1);
    EXPECT_GT(closest_pair(ranks, n, n * n / 16), 2.5);
    // A quarter of the cells of the large pattern cannot all keep apart; it is the small ones that are tight enough.
    if (n < 32) {
      EXPECT_GE(closest_pair(ranks, n, n * n / 4), 1.4);
    }
    // The failing twin: ranks in row order are neighbours.
    std::vector<std::uint16_t> rows(ranks.size());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<std::uint16_t>(i);
    EXPECT_EQ(closest_pair(rows, n, n * n / 4), 1.0);
  }
}

TEST(SamplePattern, OffsetsLieOnTheSubPixelGridAndOnePerStratum) {
  for (int spp = 1; spp <= 64; ++spp) {
    const SamplePattern pattern({spp, 0, 0});
    const int strata = static_cast<int>(std::bit_ceil(static_cast<unsigned>(spp)));
    std::set<int> columns, rows;
    for (int s = 0; s < spp; ++s) {
      const auto [x, y] = pattern.offset(s);
      EXPECT_EQ(x * 256.0f, std::floor(x * 256.0f));
      EXPECT_EQ(y * 256.0f, std::floor(y * 256.0f));
      EXPECT_TRUE(x > 0 && x < 1 && y > 0 && y < 1);
      columns.insert(static_cast<int>(x * static_cast<float>(strata)));
      rows.insert(static_cast<int>(y * static_cast<float>(strata)));
    }
    float sum_x = 0, sum_y = 0;
    for (int s = 0; s < spp; ++s) sum_x += pattern.offset(s).x, sum_y += pattern.offset(s).y;
    EXPECT_NEAR(sum_x / static_cast<float>(spp), 0.5f, 1.0f / 64);
    EXPECT_NEAR(sum_y / static_cast<float>(spp), 0.5f, 1.0f / 64);
    EXPECT_EQ(columns.size(), static_cast<std::size_t>(spp));
    EXPECT_EQ(rows.size(), static_cast<std::size_t>(spp));
  }
}

TEST(SamplePattern, ASingleSampleIsInTheMiddleOfThePixel) {
  const SamplePattern pattern({1, 5, 9});
  EXPECT_EQ(pattern.offset(0).x, 0.5f);
  EXPECT_EQ(pattern.offset(0).y, 0.5f);
}

TEST(SamplePattern, TimesAreStratifiedOverAPixelAndOverABlock) {
  for (const int spp : {1, 2, 3, 4, 8, 16, 64})
    for (const std::uint32_t frame : {0u, 7u}) {
      const SamplePattern pattern({spp, 3, frame});
      std::multiset<int> block;
      for (int y = 16; y < 24; ++y)
        for (int x = 40; x < 48; ++x) {
          std::multiset<int> times;
          for (int s = 0; s < spp; ++s) {
            times.insert(pattern.time(x, y, s) >> 8);
            block.insert(pattern.time(x, y, s) >> 8);
          }
          int stratum = 0;
          for (const int t : times) {
            EXPECT_GE(t, stratum * 256 / spp);
            EXPECT_LE(t, (stratum + 1) * 256 / spp);
            ++stratum;
          }
        }
      // Evenly over the 256 codes: each as often as any other, to one.
      const std::size_t each = static_cast<std::size_t>(64 * spp) / 256;
      for (int code = 0; code < 256; ++code) {
        EXPECT_GE(block.count(code), each);
        EXPECT_LE(block.count(code), each + 1);
      }
    }
}

TEST(SamplePattern, PatternsRepeatEveryEightPixelsAndShiftFromFrameToFrame) {
  const SamplePattern a({4, 0, 0}), b({4, 0, 1});
  int same = 0;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(a.time(x, y, 2), a.time(x + 8, y + 64, 2));
      same += a.time(x, y, 2) == b.time(x, y, 2) ? 1 : 0;
    }
  EXPECT_LT(same, 32);
}

TEST(SamplePattern, LensPointsFillTheUnitDiscEvenly) {
  const SamplePattern pattern({16, 1, 0});
  double u = 0, v = 0, r2 = 0;
  int count = 0;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x)
      for (int s = 0; s < 16; ++s, ++count) {
        const auto p = pattern.lens(x, y, s);
        EXPECT_LE(p.u * p.u + p.v * p.v, 1.0f + 1e-6f);
        u += static_cast<double>(p.u);
        v += static_cast<double>(p.v);
        r2 += static_cast<double>(p.u * p.u + p.v * p.v);
      }
  EXPECT_NEAR(u / count, 0, 0.01);
  EXPECT_NEAR(v / count, 0, 0.01);
  EXPECT_NEAR(r2 / count, 0.5, 0.01);
}

TEST(SamplePattern, LensAndTimeAreUncorrelated) {
  const SamplePattern pattern({8, 2, 0});
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      for (int s = 0; s < 8; ++s, ++count)
        sum += (pattern.time(x, y, s) / 65536.0 - 0.5) * static_cast<double>(pattern.lens(x, y, s).u);
  EXPECT_LT(std::abs(sum / count), 0.01);  // each has a deviation of 0.29 and 0.5
}

TEST(SamplePattern, TheLargePatternRepeatsEveryThirtyTwoPixelsAndHasEveryTimeOftenEnough) {
  for (const int spp : {1, 4, 6}) {
    const SamplePattern pattern({spp, 3, 2, 32, 8});
    std::vector<int> count(256);
    int same = 0;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x)
        for (int s = 0; s < spp; ++s) {
          EXPECT_EQ(pattern.time(x, y, s), pattern.time(x + 64, y + 32, s));
          same += pattern.time(x, y, s) == pattern.time(x + 8, y, s) ? 1 : 0;
          ++count[static_cast<std::size_t>(pattern.time(x, y, s) >> 8)];
        }
    EXPECT_LT(same, 1024 * spp / 16) << "no smaller period";
    for (const int c : count) EXPECT_NEAR(c, 4 * spp, 1);
  }
}

TEST(SamplePattern, SixteenBitsOfTimeRefineEight) {
  const SamplePattern coarse({16, 3, 2, 8, 8}), fine({16, 3, 2, 8, 16});
  std::set<int> times;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x)
      for (int s = 0; s < 16; ++s) {
        EXPECT_EQ(coarse.time(x, y, s), fine.time(x, y, s) & 0xFF00);
        times.insert(fine.time(x, y, s));
      }
  EXPECT_EQ(times.size(), 1024u) << "one each";
}

// Twice the sum of the times of a pattern's samples, in quanta: an integer.
std::int64_t time_sum(const SamplePattern& pattern, int spp, int bits) {
  std::int64_t sum = 0;
  for (int y = 0; y < pattern.side(); ++y)
    for (int x = 0; x < pattern.side(); ++x)
      for (int s = 0; s < spp; ++s) sum += 2 * (pattern.time(x, y, s) >> (16 - bits)) + 1;
  return sum;
}

TEST(SamplePattern, TheMeanTimeIsMidShutterForAnyNumberOfSamplesAndAnyPrecision) {
  for (const int side : {8, 32})
    for (const int bits : {8, 16})
      for (int spp = 1; spp <= 64; spp += side == 8 ? 1 : 21) {
        const SamplePattern pattern({spp, 7, 3, side, bits});
        const std::int64_t samples = std::int64_t{side} * side * spp;
        EXPECT_EQ(time_sum(pattern, spp, bits), samples << bits) << side << " " << bits << " " << spp;
        // Nor are they drawn together: their variance is the shutter's, 1/12.
        double square = 0;
        for (int y = 0; y < side; ++y)
          for (int x = 0; x < side; ++x)
            for (int s = 0; s < spp; ++s) {
              const double off = static_cast<double>(pattern.t(x, y, s)) - 0.5;
              square += off * off;
            }
        EXPECT_NEAR(square / static_cast<double>(samples), 1.0 / 12, 1e-4);
      }
}

// As many segments of equal length as are needed for motion that may repeat itself.
SamplingSettings of_many_segments(int spp, std::uint32_t seed, int side = 8) {
  SamplingSettings settings = {spp, seed, 2, side, 16};
  for (std::size_t k = 0; k <= kFewSegments; ++k) {
    const int length = ShutterSegment::kCodes / static_cast<int>(kFewSegments + 1),
              first = static_cast<int>(k) * length;
    settings.segments.push_back({first, first + length});
  }
  return settings;
}

// |S(q)|^2 of a pixel's samples, S being the mean of exp(2 pi i q t): how unevenly they see phases of q repetitions.
double unevenness(const SamplePattern& pattern, int x, int y, int spp, int q) {
  std::complex<double> sum = 0;
  for (int s = 0; s < spp; ++s)
    sum += std::polar(1.0, 2 * 3.14159265358979 * q * static_cast<double>(pattern.t(x, y, s)));
  return std::norm(sum / static_cast<double>(spp));
}

TEST(SamplePattern, ManySegmentsSampleEveryPhaseOfRepeatedMotion) {
  for (const auto& [spp, prime] : {std::pair{4, 5}, {7, 11}, {16, 17}, {48, 53}, {64, 67}}) {
    // All but prime - spp of the prime's phases have a sample; which these are differs from pixel to pixel.
    const double missing = static_cast<double>(prime - spp) / spp;
    for (int q = 1; q <= 3 * prime; ++q) {
      const double rounding = 2 * 3.14159265358979 * q * 0x1p-17;  // times are multiples of 2^-16
      double mean = 0;
      for (std::uint32_t seed = 0; seed < 4; ++seed) {
        const SamplePattern pattern(of_many_segments(spp, seed));
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 8; ++x) {
            const double one = unevenness(pattern, x, y, spp, q);
            if (q % prime != 0) {
              ASSERT_LE(std::sqrt(one), missing + rounding + 1e-6) << spp << " " << q;
            }
            mean += one / 256;
          }
      }
      if (q % prime == 0) {
        EXPECT_GT(mean, 0.99) << "one phase";
      } else {
        EXPECT_LE(mean, 1.5 * missing / spp) << spp << " " << q;
      }
    }
  }
  // The twin: with few segments, 16 repetitions have 4 phases.
  EXPECT_GT(unevenness(SamplePattern({64, 0, 2}), 3, 4, 64, 64), 0.99);
}

TEST(SamplePattern, ManySegmentsKeepTheMeanTimeAndEveryPartOfTheShutterAsOften) {
  for (const int side : {8, 32})
    for (int spp = 1; spp <= 64; spp += side == 8 ? 1 : 21) {
      const SamplePattern pattern(of_many_segments(spp, 5, side));
      EXPECT_EQ(time_sum(pattern, spp, 16), (std::int64_t{side} * side * spp) << 16) << side << " " << spp;
    }
  // Over frames no part of the shutter is left out more often than another.
  std::array<int, 64> count{};
  for (std::uint32_t seed = 0; seed < 64; ++seed) {
    const SamplePattern pattern(of_many_segments(16, seed));
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x)
        for (int s = 0; s < 16; ++s) ++count[pattern.time(x, y, s) >> 10];
  }
  for (const int each : count) EXPECT_NEAR(each, 1024, 60);
}

TEST(SamplePattern, ThePixelsSamplesCoverTheLensEvenly) {
  const SamplePattern pattern({4, 2, 0});
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) {
      // Four consecutive points of the (0,2)-sequence: one in each quarter of the square, that is of the disc.
      std::set<int> quarters;
      for (int s = 0; s < 4; ++s) {
        const auto p = pattern.lens(x, y, s);
        quarters.insert((p.u > 0 ? 1 : 0) + (p.v > 0 ? 2 : 0));
      }
      EXPECT_EQ(quarters.size(), 4u);
    }
}

TEST(SampleClasses, HoldEverySampleOfThePatternOnceInOrderOfTime) {
  for (const SamplingSettings& settings : {SamplingSettings{6, 0, 3}, SamplingSettings{4, 1, 0, 32, 16}}) {
    const SamplePattern pattern(settings);
    const SampleClasses& classes = pattern.classes();
    ASSERT_EQ(classes.count,
              static_cast<std::uint32_t>(settings.pattern_side * settings.pattern_side * settings.samples_per_pixel));
    std::set<std::tuple<int, int, int>> seen;
    for (std::size_t c = 0; c < classes.count; ++c) {
      const int column = classes.column[c], row = classes.row[c], sample = classes.sample[c];
      EXPECT_TRUE(seen.insert({column, row, sample}).second);
      EXPECT_EQ(classes.x[c], static_cast<float>(column) + pattern.offset(sample).x);
      EXPECT_EQ(classes.y[c], static_cast<float>(row) + pattern.offset(sample).y);
      const int code = pattern.time(column, row, sample);
      EXPECT_EQ(classes.t[c], pattern.t_of(static_cast<std::uint16_t>(code)));
      EXPECT_TRUE(c >= classes.first_at[static_cast<std::size_t>(code >> 8)] &&
                  c < classes.first_at[static_cast<std::size_t>(code >> 8) + 1]);
      if (c > 0) {
        EXPECT_GE(classes.t[c], classes.t[c - 1]);
      }
      // The lens point in every block lies in the class's box.
      for (int block = 0; block < 40; ++block) {
        const auto p =
            pattern.lens(column + settings.pattern_side * (block % 7), row + settings.pattern_side * block, sample);
        EXPECT_LE(std::abs(p.u - classes.lens_u[c]), classes.lens_extent_u[c]);
        EXPECT_LE(std::abs(p.v - classes.lens_v[c]), classes.lens_extent_v[c]);
      }
      EXPECT_LT(classes.lens_extent_u[c], 0.2f);
    }
    EXPECT_EQ(classes.first_at[256], classes.count);
  }
}

TEST(TileSamples, DoNotDependOnTheTileThatAsks) {
  const SamplePattern pattern({4, 9, 2});
  TileSamples large, small;
  large.fill(pattern, {0, 0, 64, 64}, 1.0f, true);
  small.fill(pattern, {24, 40, 32, 48}, 1.0f, true);
  for (int y = 40; y < 48; ++y)
    for (int x = 24; x < 32; ++x)
      for (int s = 0; s < 4; ++s) {
        const auto a = static_cast<std::size_t>((y * 64 + x) * 4 + s),
                   b = static_cast<std::size_t>(((y - 40) * 8 + x - 24) * 4 + s);
        EXPECT_EQ(large.x[a], small.x[b]);
        EXPECT_EQ(large.time[a], small.time[b]);
        EXPECT_EQ(large.lens_u[a], small.lens_u[b]);
      }
}

}  // namespace
}  // namespace tessera::tilecore::sampling_test
