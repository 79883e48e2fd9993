#include "base/image_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/check.h"
#include "base/color.h"
#include "base/parallel.h"

namespace tessera {
namespace {

constexpr double kPi = 3.14159265358979323846;

// One plane of doubles; reading outside repeats the border.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;

  Plane() = default;
  Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  double& at(int x, int y) {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  double at(int x, int y) const { return const_cast<Plane*>(this)->at(x, y); }
  double clamped(int x, int y) const { return at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1)); }
};

using Kernel = std::vector<double>;  // odd number of weights, centred

// Convolves with `horizontal` along x, then `vertical` along y.
Plane convolve(const Plane& source, const Kernel& horizontal, const Kernel& vertical) {
  Plane middle(source.width, source.height), out(source.width, source.height);
  const int rx = static_cast<int>(horizontal.size() / 2), ry = static_cast<int>(vertical.size() / 2);
  parallel_for(static_cast<std::size_t>(source.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < source.width; ++x) {
      double sum = 0;
      for (int k = -rx; k <= rx; ++k) sum += horizontal[static_cast<std::size_t>(k + rx)] * source.clamped(x + k, y);
      middle.at(x, y) = sum;
    }
  });
  parallel_for(static_cast<std::size_t>(source.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < source.width; ++x) {
      double sum = 0;
      for (int k = -ry; k <= ry; ++k) sum += vertical[static_cast<std::size_t>(k + ry)] * middle.clamped(x, y + k);
      out.at(x, y) = sum;
    }
  });
  return out;
}

template <class F>
Plane map_pixels(int width, int height, F&& value) {
  Plane plane(width, height);
  parallel_for(static_cast<std::size_t>(height), [&](std::size_t row) {
    for (int x = 0; x < width; ++x) plane.at(x, static_cast<int>(row)) = value(x, static_cast<int>(row));
  });
  return plane;
}

void check_shapes(const Image& a, const Image& b) {
  TESSERA_CHECK(a.same_shape(b) && a.channels == 3 && !a.values.empty(), "images to compare have one shape");
}

// Calls `each` with the number of every pixel that counts and returns how many there are.
template <class F>
std::size_t for_covered(const Image& image, const Image* covered, const F& each) {
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (covered != nullptr)
    TESSERA_CHECK(covered->width == image.width && covered->height == image.height && covered->channels == 1,
                  "the mask of covered pixels has the size of the images");
  std::size_t count = 0;
  for (std::size_t i = 0; i < pixels; ++i)
    if (covered == nullptr || covered->values[i] > 0) ++count, each(i);
  TESSERA_CHECK(covered == nullptr || count > 0, "some pixel is covered");
  return count;
}

// ---- Colour spaces of FLIP -------------------------------------------------------------------------------------

using Triple = std::array<double, 3>;

// Linear sRGB to CIE XYZ and the white it implies (the matrix rows' sums).
constexpr double kToXyz[3][3] = {
    {0.41238656, 0.35759149, 0.18045049}, {0.21263682, 0.71518298, 0.07218020}, {0.01933062, 0.11919716, 0.95037259}};

const Triple& white() {
  static const Triple w = {kToXyz[0][0] + kToXyz[0][1] + kToXyz[0][2], kToXyz[1][0] + kToXyz[1][1] + kToXyz[1][2],
                           kToXyz[2][0] + kToXyz[2][1] + kToXyz[2][2]};
  return w;
}

Triple multiply(const double (&m)[3][3], const Triple& v) {
  Triple out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

Triple xyz_to_linear(const Triple& xyz) {
  // Inverse by cofactors, computed once.
  static const auto inverse = [] {
    std::array<std::array<double, 3>, 3> inv{};
    const auto& m = kToXyz;
    const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
        inv[i][j] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / det;
      }
    return inv;
  }();
  Triple out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = inverse[i][0] * xyz[0] + inverse[i][1] * xyz[1] + inverse[i][2] * xyz[2];
  return out;
}

Triple srgb_to_linear3(std::span<const float> srgb) {
  Triple out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<double>(srgb_to_linear(std::clamp(srgb[i], 0.0f, 1.0f)));
  return out;
}

// Linear opponent space: the one in which the contrast sensitivity filters act.
Triple linear_to_ycxcz(const Triple& linear) {
  Triple n = multiply(kToXyz, linear);
  for (std::size_t i = 0; i < 3; ++i) n[i] /= white()[i];
  return {116.0 * n[1] - 16.0, 500.0 * (n[0] - n[1]), 200.0 * (n[1] - n[2])};
}

Triple ycxcz_to_linear(const Triple& c) {
  const double y = (c[0] + 16.0) / 116.0;
  return xyz_to_linear({(y + c[1] / 500.0) * white()[0], y * white()[1], (y - c[2] / 200.0) * white()[2]});
}

// CIELAB whose chroma is scaled by lightness (Hunt effect).
Triple linear_to_hunt_lab(const Triple& linear) {
  const Triple xyz = multiply(kToXyz, linear);
  constexpr double kDelta = 6.0 / 29.0;
  Triple f;
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = xyz[i] / white()[i];
    f[i] = t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
  }
  const double lightness = 116.0 * f[1] - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (f[0] - f[1]), 0.01 * lightness * 200.0 * (f[1] - f[2])};
}

double hyab(const Triple& a, const Triple& b) { return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

// ---- FLIP -------------------------------------------------------------------------------------------------------

constexpr double kColorExponent = 0.7, kFeatureExponent = 0.5;
constexpr double kSplitError = 0.4, kSplitValue = 0.95;  // where the error is redistributed
constexpr double kFeatureWidth = 0.082;                  // degrees

// Contrast sensitivity of one channel: a sum of Gaussians a*sqrt(pi/b)*exp(-pi^2 d^2 / b), d in degrees.
struct Sensitivity {
  double a1, b1, a2, b2;
};
constexpr Sensitivity kAchromatic = {1.0, 0.0047, 0.0, 1e-5};
constexpr Sensitivity kRedGreen = {1.0, 0.0053, 0.0, 1e-5};
constexpr Sensitivity kBlueYellow = {34.1, 0.04, 13.5, 0.025};

Plane filter_channel(const Plane& source, const Sensitivity& s, double ppd) {
  const int radius = static_cast<int>(std::ceil(3.0 * std::sqrt(kBlueYellow.b1 / (2.0 * kPi * kPi)) * ppd));
  const auto gaussian = [&](double b) {
    Kernel kernel;
    for (int k = -radius; k <= radius; ++k) kernel.push_back(std::exp(-kPi * kPi * (k / ppd) * (k / ppd) / b));
    return kernel;
  };
  const auto sum = [](const Kernel& kernel) {
    double total = 0;
    for (const double w : kernel) total += w;
    return total;
  };
  const Kernel g1 = gaussian(s.b1), g2 = gaussian(s.b2);
  const double w1 = s.a1 * std::sqrt(kPi / s.b1), w2 = s.a2 * std::sqrt(kPi / s.b2);
  const double total = w1 * sum(g1) * sum(g1) + w2 * sum(g2) * sum(g2);
  Plane out = convolve(source, g1, g1);
  for (double& v : out.values) v *= w1 / total;
  if (w2 > 0) {
    const Plane second = convolve(source, g2, g2);
    for (std::size_t i = 0; i < out.values.size(); ++i) out.values[i] += second.values[i] * w2 / total;
  }
  return out;
}

std::array<Plane, 3> opponent_planes(const Image& image) {
  std::array<Plane, 3> planes;
  for (auto& plane : planes) plane = Plane(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Triple c = linear_to_ycxcz(srgb_to_linear3(image.at(x, y)));
      for (std::size_t i = 0; i < 3; ++i) planes[i].at(x, y) = c[i];
    }
  return planes;
}

// Filtered image in Hunt-adjusted CIELAB.
std::vector<Triple> perceived_colors(const std::array<Plane, 3>& opponent, double ppd) {
  const Plane y = filter_channel(opponent[0], kAchromatic, ppd);
  const Plane cx = filter_channel(opponent[1], kRedGreen, ppd);
  const Plane cz = filter_channel(opponent[2], kBlueYellow, ppd);
  std::vector<Triple> colors(y.values.size());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    Triple linear = ycxcz_to_linear({y.values[i], cx.values[i], cz.values[i]});
    for (double& v : linear) v = std::clamp(v, 0.0, 1.0);
    colors[i] = linear_to_hunt_lab(linear);
  }
  return colors;
}

// Strength of edges (first derivative) or points (second derivative) of the luminance.
struct Features {
  Plane edges, points;
};

Features features(const Plane& opponent_y, double ppd) {
  const double sigma = 0.5 * kFeatureWidth * ppd;
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  Kernel smooth, edge, point;
  for (int k = -radius; k <= radius; ++k) {
    const double g = std::exp(-k * k / (2.0 * sigma * sigma));
    smooth.push_back(g);
    edge.push_back(-k * g);
    point.push_back((k * k / (sigma * sigma) - 1.0) * g);
  }
  // The 2-D kernels are products; their positive and negative weights are each normalised to 1.
  double smooth_sum = 0;
  for (const double w : smooth) smooth_sum += w;
  for (Kernel* kernel : {&edge, &point}) {
    double positive = 0, negative = 0;
    for (const double w : *kernel) (w > 0 ? positive : negative) += w;
    for (double& w : *kernel) w /= w > 0 ? positive : -negative;
  }
  for (double& w : smooth) w /= smooth_sum;

  const Plane luminance = map_pixels(opponent_y.width, opponent_y.height,
                                     [&](int x, int y) { return (opponent_y.at(x, y) + 16.0) / 116.0; });
  const auto magnitude = [&](const Kernel& derivative) {
    const Plane dx = convolve(luminance, derivative, smooth), dy = convolve(luminance, smooth, derivative);
    return map_pixels(luminance.width, luminance.height,
                      [&](int x, int y) { return std::hypot(dx.at(x, y), dy.at(x, y)); });
  };
  return {magnitude(edge), magnitude(point)};
}

double redistribute(double error, double max_error) {
  const double split = kSplitError * max_error;
  if (error < split) return error * kSplitValue / split;
  return kSplitValue + (error - split) / (max_error - split) * (1.0 - kSplitValue);
}

}  // namespace

double psnr(const Image& a, const Image& b, const Image* covered) {
  check_shapes(a, b);
  double sum = 0;
  const std::size_t count = for_covered(a, covered, [&](std::size_t pixel) {
    for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
      const double d = static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]);
      sum += d * d;
    }
  });
  if (sum == 0) return std::numeric_limits<double>::infinity();
  return -10.0 * std::log10(sum / static_cast<double>(3 * count));
}

double max_difference(const Image& a, const Image& b, const Image* covered) {
  check_shapes(a, b);
  double largest = 0;
  for_covered(a, covered, [&](std::size_t pixel) {
    for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i)
      largest = std::max(largest, std::abs(static_cast<double>(a.values[i]) - static_cast<double>(b.values[i])));
  });
  return largest;
}

double mssim(const Image& a, const Image& b, const Image* covered) {
  check_shapes(a, b);
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03, kSigma = 1.5;
  Kernel window;
  double total = 0;
  for (int k = -5; k <= 5; ++k) total += window.emplace_back(std::exp(-k * k / (2.0 * kSigma * kSigma)));
  for (double& w : window) w /= total;

  const auto luma = [](const Image& image) {
    return map_pixels(image.width, image.height, [&](int x, int y) {
      const auto c = image.at(x, y);
      return 0.299 * static_cast<double>(c[0]) + 0.587 * static_cast<double>(c[1]) + 0.114 * static_cast<double>(c[2]);
    });
  };
  const auto product = [](const Plane& p, const Plane& q) {
    return map_pixels(p.width, p.height, [&](int x, int y) { return p.at(x, y) * q.at(x, y); });
  };
  const Plane la = luma(a), lb = luma(b);
  const Plane mean_a = convolve(la, window, window), mean_b = convolve(lb, window, window);
  const Plane square_a = convolve(product(la, la), window, window),
              square_b = convolve(product(lb, lb), window, window);
  const Plane cross = convolve(product(la, lb), window, window);
  double sum = 0;
  const std::size_t count = for_covered(a, covered, [&](std::size_t i) {
    const double ma = mean_a.values[i], mb = mean_b.values[i];
    const double va = square_a.values[i] - ma * ma, vb = square_b.values[i] - mb * mb;
    const double covariance = cross.values[i] - ma * mb;
    sum += (2 * ma * mb + kC1) * (2 * covariance + kC2) / ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
  });
  return sum / static_cast<double>(count);
}

Image flip_map(const Image& reference, const Image& test, double pixels_per_degree) {
  check_shapes(reference, test);
  const std::array<Plane, 3> opponent_r = opponent_planes(reference), opponent_t = opponent_planes(test);
  const std::vector<Triple> color_r = perceived_colors(opponent_r, pixels_per_degree);
  const std::vector<Triple> color_t = perceived_colors(opponent_t, pixels_per_degree);
  const Features feature_r = features(opponent_r[0], pixels_per_degree);
  const Features feature_t = features(opponent_t[0], pixels_per_degree);
  const double max_error = std::pow(hyab(linear_to_hunt_lab({0, 1, 0}), linear_to_hunt_lab({0, 0, 1})), kColorExponent);

  Image map(reference.width, reference.height, 1);
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    const double color = redistribute(std::pow(hyab(color_r[i], color_t[i]), kColorExponent), max_error);
    const double feature = std::max(std::abs(feature_r.edges.values[i] - feature_t.edges.values[i]),
                                    std::abs(feature_r.points.values[i] - feature_t.points.values[i]));
    const double feature_error = std::clamp(std::pow(feature / std::sqrt(2.0), kFeatureExponent), 0.0, 1.0);
    map.values[i] = static_cast<float>(std::pow(std::clamp(color, 0.0, 1.0), 1.0 - feature_error));
  }
  return map;
}

double mean_value(const Image& map, const Image* covered) {
  double sum = 0;
  const std::size_t count =
      for_covered(map, covered, [&](std::size_t i) { sum += static_cast<double>(map.values[i]); });
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

}  // namespace tessera
