#include "shaders_cpp/environment_image.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/parallel.h"

namespace tessera::shaders {
namespace {

constexpr float kPiFloat = std::numbers::pi_v<float>;

// ---- The source -------------------------------------------------------------------------------------------------

Vec3 pixel(const Image& image, int x, int y) {
  const float* at = &image.values[image.index(x, y)];
  return {at[0], at[1], at[2]};
}

void clean(Image& image) {
  parallel_for(static_cast<std::size_t>(image.height), [&](std::size_t row) {
    for (int x = 0; x < image.width; ++x)
      for (float& v : image.at(x, static_cast<int>(row))) v = v > 0.0f ? std::min(v, RadianceImage::kLargest) : 0.0f;
  });
}

// An image `factor` times smaller, without remainder pixels: each pixel is the mean of the pixels that it covers.
Image reduced(const Image& image, int factor) {
  const int height = image.height / factor;
  Image columns(2 * height, image.height, 3), out(2 * height, height, 3);  // working_bytes()
  // Along one axis: the mean of [i, i + 1) * count / to of `count` numbers.
  const auto mean = [](int i, int count, int to, const auto& number) {
    const std::int64_t begin = std::int64_t{i} * count, end = begin + count;  // times 1 / to
    Vec3 sum(0.0f);
    for (std::int64_t k = begin / to; k * to < end; ++k) {
      const std::int64_t share = std::min((k + 1) * to, end) - std::max(k * to, begin);
      sum += number(static_cast<int>(k)) * (static_cast<float>(share) / static_cast<float>(count));
    }
    return sum;
  };
  const auto put = [](Image& to, int x, int y, const Vec3& v) {
    for (std::size_t c = 0; c < 3; ++c) to.at(x, y)[c] = v[static_cast<int>(c)];
  };
  parallel_for(static_cast<std::size_t>(image.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < columns.width; ++x)
      put(columns, x, y, mean(x, image.width, columns.width, [&](int k) { return pixel(image, k, y); }));
  });
  parallel_for(static_cast<std::size_t>(height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < out.width; ++x)
      put(out, x, y, mean(y, image.height, height, [&](int k) { return pixel(columns, x, k); }));
  });
  return out;
}

// Bilinear lookup by direction; `turned` is added to the direction's angle, as a share of the circle.
Vec3 seen(const Image& image, const Vec3& direction, float turned) {
  const float u = std::atan2(direction.z, direction.x) * (0.5f / kPiFloat) + 0.5f + turned,
              v = 0.5f - std::asin(std::clamp(direction.y, -1.0f, 1.0f)) / kPiFloat;
  const float x = (u - std::floor(u)) * static_cast<float>(image.width) - 0.5f,
              y = v * static_cast<float>(image.height) - 0.5f, left = std::floor(x), top = std::floor(y);
  const int x0 = (static_cast<int>(left) + image.width) % image.width, x1 = (x0 + 1) % image.width,
            y0 = std::clamp(static_cast<int>(top), 0, image.height - 1),
            y1 = std::min(static_cast<int>(top) + 1, image.height - 1);
  const auto mixed = [](const Vec3& a, const Vec3& b, float share) { return a + (b - a) * share; };
  const auto row = [&](int at) { return mixed(pixel(image, x0, at), pixel(image, x1, at), x - left); };
  return mixed(row(y0), row(y1), y - top);
}

// ---- Light on diffuse surfaces ----------------------------------------------------------------------------------

using Harmonics = std::array<DVec3, 9>;

// Integrals over a pixel's angle around the vertical axis: of 1, the cosine, the sine, their product and the cosine of
// twice the angle. Integrals over its solid angle are products with a row's, so they are exact for coarse images as well.
using ColumnIntegrals = std::array<double, 5>;

ColumnIntegrals column_integrals(int column, int width, double turned) {
  const auto angle = [&](int at) { return (static_cast<double>(at) / width - 0.5 - turned) * 2.0 * std::numbers::pi; };
  const double a = angle(column), b = angle(column + 1);
  return {b - a, std::sin(b) - std::sin(a), std::cos(a) - std::cos(b),
          0.5 * (std::pow(std::sin(b), 2) - std::pow(std::sin(a), 2)), 0.5 * (std::sin(2.0 * b) - std::sin(2.0 * a))};
}

// Integrals of radiance times the basis over a row's solid angle.
Harmonics row_harmonics(const Image& image, int row, const std::vector<ColumnIntegrals>& columns) {
  std::array<DVec3, 5> around{};
  for (int x = 0; x < image.width; ++x)
    for (std::size_t k = 0; k < around.size(); ++k)
      around[k] += DVec3(pixel(image, x, row)) * columns[static_cast<std::size_t>(x)][k];
  // Differences of antiderivatives by the angle from the top.
  const double top = row * std::numbers::pi / image.height, bottom = (row + 1) * std::numbers::pi / image.height;
  const auto from_top = [&](const auto& integral) { return integral(bottom) - integral(top); };
  const double sine = from_top([](double t) { return -std::cos(t); }),
               sine2 = from_top([](double t) { return 0.5 * t - 0.25 * std::sin(2.0 * t); }),
               sine3 = from_top([](double t) { return std::pow(std::cos(t), 3) / 3.0 - std::cos(t); }),
               sine_cosine = from_top([](double t) { return 0.5 * std::pow(std::sin(t), 2); }),
               sine2_cosine = from_top([](double t) { return std::pow(std::sin(t), 3) / 3.0; }),
               legendre = from_top([](double t) { return std::cos(t) - std::pow(std::cos(t), 3); });
  return {around[0] * sine,  around[1] * sine2,        around[0] * sine_cosine,
          around[2] * sine2, around[1] * sine2_cosine, around[2] * sine2_cosine,
          around[3] * sine3, around[0] * legendre,     around[4] * sine3};
}

std::array<Vec3, 9> diffuse_factors(const Image& image, double turned) {
  std::vector<Harmonics> rows(static_cast<std::size_t>(image.height));
  std::vector<ColumnIntegrals> columns;
  columns.reserve(static_cast<std::size_t>(image.width));
  for (int x = 0; x < image.width; ++x) columns.push_back(column_integrals(x, image.width, turned));
  parallel_for(rows.size(), [&](std::size_t row) { rows[row] = row_harmonics(image, static_cast<int>(row), columns); });
  Harmonics sum{};
  for (const Harmonics& row : rows)
    for (std::size_t i = 0; i < 9; ++i) sum[i] += row[i];
  // Factor of each band by the cosine's lobe over pi, 1, 2/3 and 1/4, times the square of the basis' norm.
  constexpr std::array<double, 9> kFactors = {1 / 4.0,   1 / 2.0,   1 / 2.0,  1 / 2.0,  15 / 16.0,
                                              15 / 16.0, 15 / 16.0, 5 / 64.0, 15 / 64.0};
  std::array<Vec3, 9> factors;
  for (std::size_t i = 0; i < 9; ++i) factors[i] = Vec3(sum[i] * (kFactors[i] / std::numbers::pi));
  return factors;
}

// ---- The octahedron ---------------------------------------------------------------------------------------------

// The map's square is [-1, 1]^2.
struct SquarePoint {
  float x, z;
};

// The point on the octahedron, |x| + |y| + |z| = 1.
Vec3 on_octahedron(SquarePoint p) {
  const float y = 1.0f - std::abs(p.x) - std::abs(p.z);
  if (y >= 0.0f) return {p.x, y, p.z};
  return {std::copysign(1.0f - std::abs(p.z), p.x), y, std::copysign(1.0f - std::abs(p.x), p.z)};
}

SquarePoint on_square(int x, int y, int side, float dx = 0.5f, float dy = 0.5f) {
  return {(static_cast<float>(x) + dx) * (2.0f / static_cast<float>(side)) - 1.0f,
          (static_cast<float>(y) + dy) * (2.0f / static_cast<float>(side)) - 1.0f};
}

// The texel that lies at (x, y), up to `side` texels beyond the edges.
struct TexelPlace {
  int x, y;
};
TexelPlace folded(int x, int y, int side) {
  if (x < 0 || x >= side) x = x < 0 ? -1 - x : 2 * side - 1 - x, y = side - 1 - y;
  if (y < 0 || y >= side) y = y < 0 ? -1 - y : 2 * side - 1 - y, x = side - 1 - x;
  return {x, y};
}

// A level that halves the one before, within a border of one texel.
struct Mip {
  int side;
  std::vector<Vec3> texels;

  explicit Mip(int side_in)
      : side(side_in), texels(static_cast<std::size_t>(side_in + 2) * static_cast<std::size_t>(side_in + 2)) {}
  Vec3& at(int x, int y) { return texels[static_cast<std::size_t>((y + 1) * (side + 2) + x + 1)]; }
  const Vec3& at(int x, int y) const { return texels[static_cast<std::size_t>((y + 1) * (side + 2) + x + 1)]; }
  void fill_border() {
    for (int i = -1; i <= side; ++i)
      for (const auto& [x, y] : {TexelPlace{i, -1}, TexelPlace{i, side}, TexelPlace{-1, i}, TexelPlace{side, i}}) {
        const TexelPlace from = folded(x, y, side);
        at(x, y) = at(from.x, from.y);
      }
  }
  // Bilinear.
  Vec3 sample(SquarePoint p) const {
    const float half = 0.5f * static_cast<float>(side), x = p.x * half + half + 0.5f, z = p.z * half + half + 0.5f;
    const int column = static_cast<int>(x), row = static_cast<int>(z), across = side + 2;
    const float s = x - static_cast<float>(column), t = z - static_cast<float>(row);
    const Vec3* a = texels.data() + row * across + column;
    const Vec3 top = a[0] + (a[1] - a[0]) * s, bottom = a[across] + (a[across + 1] - a[across]) * s;
    return top + (bottom - top) * t;
  }
};

// Halves a level. Texels are weighted by their solid angles: the area on the square times (|x| + |y| + |z|)^3 of the unit vector.
Mip halved(const Mip& fine) {
  Mip out(fine.side / 2);
  parallel_for(static_cast<std::size_t>(out.side), [&](std::size_t row) {
    for (int x = 0, y = static_cast<int>(row); x < out.side; ++x) {
      Vec3 sum(0.0f);
      float weights = 0.0f;
      for (int k = 0; k < 4; ++k) {
        const int fx = 2 * x + k % 2, fy = 2 * y + k / 2;
        const Vec3 p = on_octahedron(on_square(fx, fy, fine.side));
        const float length2 = glm::dot(p, p), weight = 1.0f / (length2 * std::sqrt(length2));
        sum += fine.at(fx, fy) * weight;
        weights += weight;
      }
      out.at(x, y) = sum / weights;
    }
  });
  out.fill_border();
  return out;
}

// ---- Lobes ------------------------------------------------------------------------------------------------------

// A direction around the lobe's axis, z; its share of the lobe; and the level whose texels are as large as the
// sample's part of the sphere, for a map of side 1 in which all texels are as small as at the poles.
struct LobeSample {
  Vec3 direction;
  float weight, level;
};

// `count` directions on a spiral. More of them lie outside than the light's share: half vectors are distributed as
// the microfacets' projected area, of which (1 - v)^2 lies beyond the share v of all samples.
std::vector<LobeSample> lobe_samples(double roughness, int count) {
  const double alpha2 = roughness * roughness * roughness * roughness;
  std::vector<LobeSample> samples;
  double sum = 0.0;
  std::vector<double> weights;
  for (int i = 0; i < count; ++i) {
    const double v = 1.0 - (i + 0.5) / count, u = 1.0 - v * v, share = 2.0 * v / count;
    const double half2 = (1.0 - u) / (1.0 + (alpha2 - 1.0) * u), y = 2.0 * half2 - 1.0;
    if (y <= 0.0) continue;
    const double spread = half2 * (alpha2 - 1.0) + 1.0, density = alpha2 / (4.0 * std::numbers::pi * spread * spread);
    // Shadowing (Smith, height-correlated) of the light; a surface seen head-on has no masking.
    weights.push_back(share * 2.0 * y / (y + std::sqrt(y * y * (1.0 - alpha2) + alpha2)));
    sum += weights.back();
    const double angle = 2.0 * std::numbers::pi * (i * std::numbers::phi - std::floor(i * std::numbers::phi)),
                 out = std::sqrt(std::max(1.0 - y * y, 0.0));
    samples.push_back({Vec3(out * std::cos(angle), out * std::sin(angle), y), 0.0f,
                       static_cast<float>(0.5 * std::log2(share / density / 4.0))});
  }
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i].weight = static_cast<float>(weights[i] / sum);
  return samples;
}

// Radiance around a unit direction through the lobe.
Vec3 through_lobe(const std::vector<Mip>& mips, std::span<const LobeSample> samples, const Vec3& axis) {
  // Duff et al. 2017, "Building an orthonormal basis, revisited".
  const float sign = std::copysign(1.0f, axis.z), a = -1.0f / (sign + axis.z), b = axis.x * axis.y * a;
  const Vec3 first(1.0f + sign * axis.x * axis.x * a, sign * b, -sign * axis.x),
      second(b, sign + axis.y * axis.y * a, -axis.y);
  // The nearest level.
  const float level0 = std::log2(static_cast<float>(mips[0].side)) + 0.5f, last = static_cast<float>(mips.size() - 1);
  Vec3 sum(0.0f);
  for (const LobeSample& s : samples) {
    const Vec3 d = first * s.direction.x + second * s.direction.y + axis * s.direction.z;
    const float size = std::abs(d.x) + std::abs(d.y) + std::abs(d.z), scale = 1.0f / size;
    SquarePoint p{d.x * scale, d.z * scale};
    if (d.y < 0.0f) p = {std::copysign(1.0f - std::abs(p.z), p.x), std::copysign(1.0f - std::abs(p.x), p.z)};
    // About 3/2 log2 of the size.
    const float level = std::clamp(level0 + s.level - 1.62f * (size - 1.0f), 0.0f, last);
    sum += mips[static_cast<std::size_t>(level)].sample(p) * s.weight;
  }
  return sum;
}

// ---- Levels -----------------------------------------------------------------------------------------------------

int side_of_first(int source_height) {
  const auto wanted =
      static_cast<unsigned>(std::clamp(source_height, EnvironmentImage::kMinSide, EnvironmentImage::kMaxSide));
  return static_cast<int>(std::bit_ceil(wanted));
}

// Largest side without the border, and samples of a texel's lobe. [measured] For a step between 0 and 1 the first two
// levels are within 0.05 of the integral, the others within 0.03.
struct LevelPlan {
  int max_side, samples;
};
constexpr std::array<LevelPlan, kMapLevels> kPlan = {{{EnvironmentImage::kMaxSide, 1},
                                                      {512, 64},
                                                      {256, 96},
                                                      {256, 128},
                                                      {128, 256},
                                                      {64, 512},
                                                      {32, 2048},
                                                      {32, 2048},
                                                      {32, 2048}}};
const LevelPlan& plan_of(int level) { return kPlan[static_cast<std::size_t>(level)]; }

int side_of(int level, int first) { return std::min(first, plan_of(level).max_side); }
int border_of(int side) { return side / 32; }

std::vector<RadianceImage::Size> level_sizes(int first) {
  std::vector<RadianceImage::Size> sizes;
  for (int level = 0; level < kMapLevels; ++level) {
    const int side = side_of(level, first), whole = side + 2 * border_of(side);
    sizes.push_back({whole, whole});
  }
  return sizes;
}

Mip first_mip(const Image& source, int side, float turned) {
  Mip mip(side);
  // Samples of a texel along each axis.
  const int samples = source.height > side ? 3 : 2;
  parallel_for(static_cast<std::size_t>(side), [&](std::size_t row) {
    for (int x = 0, y = static_cast<int>(row); x < side; ++x) {
      Vec3 sum(0.0f);
      for (int k = 0; k < samples * samples; ++k) {
        const float dx = (static_cast<float>(k % samples) + 0.5f) / static_cast<float>(samples),
                    dy = (static_cast<float>(k / samples) + 0.5f) / static_cast<float>(samples);
        sum += seen(source, glm::normalize(on_octahedron(on_square(x, y, side, dx, dy))), turned);
      }
      mip.at(x, y) = sum / static_cast<float>(samples * samples);
    }
  });
  mip.fill_border();
  return mip;
}

}  // namespace

std::uint64_t EnvironmentImage::working_bytes(int source_height) {
  const int first = side_of_first(source_height);
  std::uint64_t texels = 0;
  for (const RadianceImage::Size& size : level_sizes(first))
    texels += static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  for (int side = first; side > 1; side /= 2)
    texels += static_cast<std::uint64_t>(side + 2) * static_cast<std::uint64_t>(side + 2);
  if (source_height >= 2 * first) {
    const auto height = static_cast<std::uint64_t>(source_height / (source_height / first));
    texels += 2 * height * (static_cast<std::uint64_t>(source_height) + height);
  }
  return texels * sizeof(Vec3);
}

EnvironmentImage::EnvironmentImage(Image image, double rotation) : source_width_(image.width) {
  TESSERA_CHECK(image.width == 2 * image.height && image.height > 0 && image.channels >= 3,
                "an equirectangular image is twice as wide as high");
  clean(image);
  const double turns = rotation * (0.5 / std::numbers::pi), turned = turns - std::floor(turns);
  diffuse = diffuse_factors(image, turned);
  const int first = side_of_first(image.height);
  if (image.height >= 2 * first) image = reduced(image, image.height / first);
  std::vector<Mip> mips;
  mips.push_back(first_mip(image, first, static_cast<float>(turned)));
  image = Image();
  while (mips.back().side > 2) mips.push_back(halved(mips.back()));

  const std::vector<RadianceImage::Size> sizes = level_sizes(first);
  levels_ = RadianceImage(sizes);
  // All rows of all levels run at once, as rough levels have few.
  std::vector<std::vector<LobeSample>> lobes(sizes.size());
  std::vector<std::pair<int, int>> rows;  // level, row
  for (int level = 0; level < kMapLevels; ++level) {
    if (level > 0)
      lobes[static_cast<std::size_t>(level)] =
          lobe_samples(std::exp2(0.5 * (level - (kMapLevels - 1))), plan_of(level).samples);
    for (int row = 0; row < side_of(level, first); ++row) rows.emplace_back(level, row);
  }
  parallel_for(rows.size(), [&](std::size_t i) {
    const auto [level, y] = rows[i];
    const int side = side_of(level, first), border = border_of(side);
    for (int x = 0; x < side; ++x)
      levels_.set(level, border + x, border + y,
                  level == 0 ? mips[0].at(x, y)
                             : through_lobe(mips, lobes[static_cast<std::size_t>(level)],
                                            glm::normalize(on_octahedron(on_square(x, y, side)))));
  });
  for (int level = 0; level < kMapLevels; ++level) {
    const int side = side_of(level, first), border = border_of(side);
    for (int y = -border; y < side + border; ++y)
      for (int x = -border; x < side + border; ++x) {
        const TexelPlace from = folded(x, y, side);
        levels_.set(level, border + x, border + y, levels_.texel(level, border + from.x, border + from.y));
      }
  }
  radiance = levels_.view();
}

}  // namespace tessera::shaders
