#include "base/image_metrics.h"
#include "base/random.h"
#include "tests/support/tests.h"

namespace tessera::image_metrics_test {
namespace {

Image flat(int width, int height, float r, float g, float b) {
  Image image(width, height, 3);
  for (std::size_t i = 0; i < image.values.size(); i += 3)
    image.values[i] = r, image.values[i + 1] = g, image.values[i + 2] = b;
  return image;
}

Image noisy(int width, int height, std::uint32_t seed) {
  Image image(width, height, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<float>(hash32(seed, static_cast<std::uint32_t>(i)) >> 8) * 0x1p-24f;
  return image;
}

TEST(Psnr, IsMinusTwentyLogOfAUniformDifference) {
  EXPECT_NEAR(psnr(flat(8, 8, 0.5f, 0.5f, 0.5f), flat(8, 8, 0.4f, 0.4f, 0.4f)), 20.0, 1e-5);
  EXPECT_NEAR(psnr(flat(8, 8, 0.5f, 0.5f, 0.5f), flat(8, 8, 0.49f, 0.49f, 0.49f)), 40.0, 1e-4);
  EXPECT_TRUE(std::isinf(psnr(noisy(9, 9, 1), noisy(9, 9, 1))));
}

TEST(Psnr, IndependentUniformNoiseHasAMeanSquareErrorOfASixth) {
  // E (a-b)^2 = 1/6 for independent uniform numbers: 7.78 dB, to the spread of 30 000 squares.
  EXPECT_NEAR(psnr(noisy(100, 100, 11), noisy(100, 100, 12)), 10 * std::log10(6.0), 0.1);
}

TEST(Ssim, OfTwoFlatImagesIsTheLuminanceTermAlone) {
  // (2ab + C1) / (a^2 + b^2 + C1): variances vanish.
  const double a = 0.6, b = 0.3, c1 = 1e-4;
  EXPECT_NEAR(mssim(flat(16, 16, 0.6f, 0.6f, 0.6f), flat(16, 16, 0.3f, 0.3f, 0.3f)),
              (2 * a * b + c1) / (a * a + b * b + c1), 1e-6);
}

TEST(Ssim, IsOneForEqualImagesAndNegativeForInvertedOnes) {
  const Image image = noisy(32, 32, 4);
  EXPECT_NEAR(mssim(image, image), 1.0, 1e-12);
  Image inverted = image;
  for (float& v : inverted.values) v = 1.0f - v;
  EXPECT_LT(mssim(image, inverted), 0.0);
}

// Straight from the paper (Wang et al. 2004, equations 13 to 17), pixel by pixel, without separable filters.
double ssim_by_definition(const Image& a, const Image& b) {
  const auto luma = [](const Image& image, int x, int y) {
    const auto p = image.at(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1));
    return 0.2126 * static_cast<double>(p[0]) + 0.7152 * static_cast<double>(p[1]) + 0.0722 * static_cast<double>(p[2]);
  };
  double sum = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      double weights = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
      for (int dy = -5; dy <= 5; ++dy)
        for (int dx = -5; dx <= 5; ++dx) {
          const double w = std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5)), va = luma(a, x + dx, y + dy),
                       vb = luma(b, x + dx, y + dy);
          weights += w, ma += w * va, mb += w * vb, aa += w * va * va, bb += w * vb * vb, ab += w * va * vb;
        }
      ma /= weights, mb /= weights;
      const double sa = aa / weights - ma * ma, sb = bb / weights - mb * mb, covariance = ab / weights - ma * mb,
                   c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
      sum += (2 * ma * mb + c1) * (2 * covariance + c2) / ((ma * ma + mb * mb + c1) * (sa + sb + c2));
    }
  return sum / (a.width * a.height);
}

TEST(Ssim, IsThePapersFormulaOverAWindowOfElevenPixels) {
  Image grey = noisy(23, 17, 3), other = noisy(23, 17, 5);
  for (Image* image : {&grey, &other})
    for (std::size_t i = 0; i < image->values.size(); i += 3)
      image->values[i + 1] = image->values[i + 2] = image->values[i];  // whatever makes luma of colours
  for (std::size_t i = 0; i < other.values.size(); ++i)
    other.values[i] = 0.7f * grey.values[i] + 0.2f * other.values[i];
  EXPECT_NEAR(mssim(grey, other), ssim_by_definition(grey, other), 1e-6);
  EXPECT_LT(ssim_by_definition(grey, other), 0.95) << "the images are far enough apart to tell";
}

TEST(Ssim, GrowsWorseWithMoreNoise) {
  const Image image = noisy(32, 32, 7), other = noisy(32, 32, 8);
  double last = 1.0;
  for (const float share : {0.05f, 0.2f, 0.5f, 1.0f}) {
    Image mixed = image;
    for (std::size_t i = 0; i < mixed.values.size(); ++i)
      mixed.values[i] += share * (other.values[i] - image.values[i]);
    const double value = mssim(image, mixed);
    EXPECT_LT(value, last);
    last = value;
  }
}

TEST(Flip, OfEqualImagesIsZero) { EXPECT_EQ(mean_value(flip_map(noisy(24, 24, 1), noisy(24, 24, 1))), 0.0); }

TEST(Flip, OfBlackAndWhiteFollowsTheColourPipelineAlone) {
  // Flat images have no features and survive the filters; the error is the redistributed HyAB distance of L = 0 and
  // 100 to the power 0.7 (published constants). The largest distance is the one between green and blue.
  const double distance = std::pow(100.0, 0.7);
  // Hunt-adjusted CIELAB of linear green and blue, by hand from the CIE formulas.
  const auto lab = [](double x, double y, double z) {
    const double n[3] = {x / 0.95042846, y / 1.0, z / 1.08890037};
    double f[3];
    for (int i = 0; i < 3; ++i) f[i] = n[i] > 216.0 / 24389.0 ? std::cbrt(n[i]) : n[i] * 841.0 / 108.0 + 4.0 / 29.0;
    const double l = 116 * f[1] - 16;
    return std::array<double, 3>{l, 0.01 * l * 500 * (f[0] - f[1]), 0.01 * l * 200 * (f[1] - f[2])};
  };
  const auto green = lab(0.35759149, 0.71518298, 0.11919716), blue = lab(0.18045049, 0.07218020, 0.95037259);
  const double largest =
      std::pow(std::abs(green[0] - blue[0]) + std::hypot(green[1] - blue[1], green[2] - blue[2]), 0.7);
  const double split = 0.4 * largest;
  const double expected =
      distance < split ? distance * 0.95 / split : 0.95 + (distance - split) / (largest - split) * 0.05;
  EXPECT_NEAR(mean_value(flip_map(flat(8, 8, 0, 0, 0), flat(8, 8, 1, 1, 1))), expected, 1e-4);
}

// Flat images of two greys: no features, no chroma; the redistributed power of the difference in CIE lightness
// (Andersson et al. 2020, sections 4.1 and 4.3, with their constants 0.7, 0.4 and 0.95).
TEST(Flip, OfTwoGreysIsThePowerOfTheirDifferenceInLightness) {
  const auto lightness = [](double srgb) {
    const double y = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
    return y > 216.0 / 24389.0 ? 116 * std::cbrt(y) - 16 : y * 24389.0 / 27.0;
  };
  constexpr double kLargest = 41.2760;  // distance of green and blue to the power 0.7, as computed in the test above
  for (const auto& [a, b] : {std::pair<float, float>{0.2f, 0.25f}, {0.5f, 0.8f}, {0.9f, 0.1f}}) {
    const double distance =
                     std::pow(std::abs(lightness(static_cast<double>(a)) - lightness(static_cast<double>(b))), 0.7),
                 split = 0.4 * kLargest;
    const double expected =
        distance < split ? distance * 0.95 / split : 0.95 + (distance - split) / (kLargest - split) * 0.05;
    EXPECT_NEAR(mean_value(flip_map(flat(8, 8, a, a, a), flat(8, 8, b, b, b))), expected, 1e-3) << a << " " << b;
  }
}

TEST(Flip, IsSymmetricInRangeAndLargerForLargerShifts) {
  const Image a = flat(24, 24, 0.5f, 0.5f, 0.5f);
  double last = 0.0;
  for (const float shift : {0.02f, 0.1f, 0.3f}) {
    const Image b = flat(24, 24, 0.5f + shift, 0.5f, 0.5f);
    const double value = mean_value(flip_map(a, b));
    EXPECT_GT(value, last);
    EXPECT_LE(value, 1.0);
    EXPECT_NEAR(value, mean_value(flip_map(b, a)), 1e-12);
    last = value;
  }
}

TEST(Flip, AnEdgeThatDisappearsCountsMoreThanItsColourAlone) {
  Image edge = flat(32, 32, 0.45f, 0.45f, 0.45f);
  for (int y = 0; y < 32; ++y)
    for (int x = 16; x < 32; ++x)
      for (std::size_t c = 0; c < 3; ++c) edge.at(x, y)[c] = 0.55f;
  const Image map = flip_map(edge, flat(32, 32, 0.5f, 0.5f, 0.5f));
  // At the edge itself the filtered colours agree; beside it the colour error is amplified by the lost feature.
  float beside = 0;
  for (int x = 12; x < 20; ++x) beside = std::max(beside, map.at(x, 16)[0]);
  EXPECT_GT(beside, 1.1f * map.at(4, 16)[0]);
}

// The figures of the whole follow from the figures of the parts; uncovered pixels change none of them.
TEST(CoveredPixels, AloneCount) {
  const Image a = noisy(24, 16, 21), b = noisy(24, 16, 22), flip = flip_map(a, b);
  Image left(24, 16, 1), right(24, 16, 1), one(24, 16, 1);
  std::size_t count = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x) {
      const bool in = hash32(5, static_cast<std::uint32_t>(24 * y + x)) % 3 == 0;
      (in ? left : right).at(x, y)[0] = 0.01f;
      count += in ? 1 : 0;
    }
  const double share = static_cast<double>(count) / (24 * 16);
  const auto whole = [&](double of_left, double of_right) { return share * of_left + (1 - share) * of_right; };
  const auto square = [](double decibel) { return std::pow(10, -decibel / 10); };
  EXPECT_NEAR(whole(mean_value(flip, &left), mean_value(flip, &right)), mean_value(flip), 1e-12);
  EXPECT_NEAR(whole(mssim(a, b, &left), mssim(a, b, &right)), mssim(a, b), 1e-12);
  EXPECT_NEAR(whole(square(psnr(a, b, &left)), square(psnr(a, b, &right))), square(psnr(a, b)), 1e-12);
  EXPECT_EQ(std::max(max_difference(a, b, &left), max_difference(a, b, &right)), max_difference(a, b));
  EXPECT_NE(mean_value(flip, &left), mean_value(flip));
  one.at(7, 3)[0] = 1;
  EXPECT_EQ(mean_value(flip, &one), static_cast<double>(flip.at(7, 3)[0]));
  EXPECT_EQ(max_difference(a, b, &one), [&] {
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(static_cast<double>(a.at(7, 3)[c]) - static_cast<double>(b.at(7, 3)[c])));
    return largest;
  }());
}

TEST(MaxDifference, FindsTheOneWorstChannel) {
  Image a = flat(4, 4, 0.1f, 0.2f, 0.3f), b = a;
  b.at(2, 1)[1] = 0.95f;
  EXPECT_NEAR(max_difference(a, b), 0.75, 1e-6);
}

}  // namespace
}  // namespace tessera::image_metrics_test
