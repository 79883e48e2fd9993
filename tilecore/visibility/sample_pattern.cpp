#include "tilecore/visibility/sample_pattern.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/random.h"

namespace tessera::tilecore {
namespace {

// Blocks of a small pattern take one of this many lens tables, so that its repetition does not show in bokeh.
constexpr std::uint32_t kLensVariants = 16;

// Square to disc without folding strata.
SamplePattern::LensPoint concentric_disc(float a, float b) {
  const float x = 2.0f * a - 1.0f, y = 2.0f * b - 1.0f;
  if (x == 0.0f && y == 0.0f) return {0.0f, 0.0f};
  constexpr float kQuarterPi = 0.78539816339f;
  float radius, angle;
  if (std::abs(x) > std::abs(y)) {
    radius = x;
    angle = kQuarterPi * (y / x);
  } else {
    radius = y;
    angle = 2.0f * kQuarterPi - kQuarterPi * (x / y);
  }
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// A permutation of 0 .. count-1 by hashes.
std::vector<std::uint32_t> shuffled(std::uint32_t count, std::uint32_t seed) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t ha = hash32(seed, a, 0x0DE7u), hb = hash32(seed, b, 0x0DE7u);
    return ha != hb ? ha < hb : a < b;
  });
  return order;
}

// The coarse stratum that a fine one lies in, both of the whole shutter.
std::uint32_t time_stratum(std::uint32_t fine, std::uint32_t fine_strata, std::uint32_t strata) {
  return static_cast<std::uint32_t>(std::uint64_t{fine} * strata / fine_strata);
}

// The quantum of time at the middle of a stratum. A stratum of an even number of quanta has two in its middle: strata
// alternate between the upper and the lower one. So mirrored strata take mirrored quanta, which keeps their mean at one
// half; the number of strata is even.
std::uint32_t middle_quantum(std::uint32_t stratum, std::uint32_t strata, std::uint32_t quanta) {
  const std::uint64_t middle = std::uint64_t{2 * stratum + 1} * quanta, whole = std::uint64_t{2} * strata;
  const bool between = middle % whole == 0;
  return static_cast<std::uint32_t>(middle / whole) - (between ? stratum & 1u : 0u);
}

// The smallest prime above a number; 1 for 1.
std::uint32_t prime_above(std::uint32_t number) {
  if (number == 1) return 1;
  const auto is_prime = [](std::uint32_t p) {
    for (std::uint32_t d = 2; d * d <= p; ++d)
      if (p % d == 0) return false;
    return true;
  };
  do ++number;
  while (!is_prime(number));
  return number;
}

// Which of a pixel's lens points a sample gets: a linear permutation of its number's bits. Place and lens point come from
// one sequence; the same number for both would tie them together, and a thing whose circle of confusion is about as wide
// as a pixel would be seen at few places only. These have the most even products of place and lens point, first along
// either axis, of all matrices (up to 8 samples) or of thousands of random ones. Row r makes bit r.
std::uint32_t lens_number(std::uint32_t sample, int bits) {
  static constexpr std::array<std::array<std::uint8_t, 6>, 7> kRows = {
      {{}, {1}, {2, 3}, {4, 3, 1}, {8, 6, 5, 15}, {18, 10, 14, 7, 11}, {36, 17, 62, 5, 50, 49}}};
  std::uint32_t number = 0;
  for (int r = 0; r < bits; ++r) {
    const std::uint32_t row = kRows[static_cast<std::size_t>(bits)][static_cast<std::size_t>(r)];
    number |= (static_cast<std::uint32_t>(std::popcount(row & sample)) & 1u) << r;
  }
  return number;
}

// Fills `count` values with the first `period` of them, again and again.
template <class T>
void repeat(T* values, std::size_t period, std::size_t count) {
  for (std::size_t done = period; done < count; done *= 2)
    std::copy_n(values, std::min(done, count - done), values + done);
}

// Energy that each point spreads over the torus: a Gaussian of 1.5 cells.
class Torus {
 public:
  explicit Torus(int n)
      : n_(n), energy_(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0.0), taken_(energy_.size(), false) {}

  void put(std::size_t cell, bool present) {
    taken_[cell] = present;
    const int cx = static_cast<int>(cell) % n_, cy = static_cast<int>(cell) / n_;
    for (int y = 0; y < n_; ++y)
      for (int x = 0; x < n_; ++x) {
        const int dx = std::min((x - cx + n_) % n_, (cx - x + n_) % n_),
                  dy = std::min((y - cy + n_) % n_, (cy - y + n_) % n_);
        energy_[static_cast<std::size_t>(y * n_ + x)] +=
            (present ? 1.0 : -1.0) * std::exp(-(dx * dx + dy * dy) / (2.0 * 1.5 * 1.5));
      }
  }
  // The free cell with the least energy, or the taken one with the most; the first of equals.
  std::size_t largest_void() const {
    return pick(false, [](double a, double b) { return a < b - 1e-9; });
  }
  std::size_t tightest_cluster() const {
    return pick(true, [](double a, double b) { return a > b + 1e-9; });
  }

 private:
  template <class Better>
  std::size_t pick(bool taken, const Better& better) const {
    std::size_t best = energy_.size();
    for (std::size_t c = 0; c < energy_.size(); ++c)
      if (taken_[c] == taken && (best == energy_.size() || better(energy_[c], energy_[best]))) best = c;
    return best;
  }

  int n_;
  std::vector<double> energy_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<std::uint16_t> void_and_cluster_ranks(int n) {
  const std::size_t cells = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  std::vector<std::uint16_t> ranks(cells, 0);
  Torus torus(n);
  // Start from a tenth of the cells, moved from clusters to voids until that changes nothing.
  const std::size_t start = std::max<std::size_t>(1, cells / 10);
  for (std::size_t i = 0; i < start; ++i) torus.put(torus.largest_void(), true);
  for (std::size_t guard = 0; guard < 4 * cells; ++guard) {
    const std::size_t from = torus.tightest_cluster();
    torus.put(from, false);
    const std::size_t to = torus.largest_void();
    torus.put(to, true);
    if (to == from) break;
  }
  // The starting points are ranked by taking them away, clusters first; then all others by filling voids.
  Torus rest = torus;
  for (std::size_t r = start; r-- > 0;) {
    const std::size_t cell = rest.tightest_cluster();
    rest.put(cell, false);
    ranks[cell] = static_cast<std::uint16_t>(r);
  }
  for (std::size_t r = start; r < cells; ++r) {
    const std::size_t cell = torus.largest_void();
    torus.put(cell, true);
    ranks[cell] = static_cast<std::uint16_t>(r);
  }
  return ranks;
}

SamplePattern::SamplePattern(const SamplingSettings& settings)
    : settings_(settings),
      power_of_two_(std::bit_ceil(static_cast<std::uint32_t>(settings.samples_per_pixel))),
      variants_(settings.pattern_side == 8 ? kLensVariants : 1) {
  TESSERA_CHECK(settings.pattern_side == 8 || settings.pattern_side == 32, "patterns are 8x8 or 32x32 pixels");
  make_offsets();
  make_times_and_lens();
  std::vector<std::uint32_t> by_time(times_.size());
  std::iota(by_time.begin(), by_time.end(), 0u);
  std::stable_sort(by_time.begin(), by_time.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return times_[a] < times_[b]; });
  for (std::size_t segment = 0; segment <= settings.segments.size(); ++segment)
    classes_.push_back(make_classes(part(static_cast<int>(segment)), by_time));
}

void SamplePattern::make_offsets() {
  for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(settings_.samples_per_pixel); ++s) {
    // Strata centres: 1/(2n) is a multiple of 1/256 for n up to 64.
    const float half = 0.5f / static_cast<float>(power_of_two_);
    const auto digits = [&](std::uint32_t bits) {
      return std::floor(static_cast<float>(bits >> 8) * 0x1p-24f * static_cast<float>(power_of_two_)) /
             static_cast<float>(power_of_two_);
    };
    offsets_.push_back({digits(reverse_bits32(s)) + half, digits(sobol2_32(s)) + half});
  }
  // A part of a net is not in the middle of the pixel: all move by as much, or the image would lie beside its place.
  const auto centre = [&](float Offset::*axis) {
    float sum = 0, low = 1, high = 0;
    for (const Offset& o : offsets_) sum += o.*axis, low = std::min(low, o.*axis), high = std::max(high, o.*axis);
    const float wanted = std::round(256.0f * (0.5f - sum / static_cast<float>(offsets_.size()))) / 256.0f,
                off = std::clamp(wanted, 1.0f / 256 - low, 255.0f / 256 - high);
    for (Offset& o : offsets_) o.*axis += off;
  };
  centre(&Offset::x);
  centre(&Offset::y);
  if (settings_.jitter_x != 0 || settings_.jitter_y != 0) move_offsets();
}

void SamplePattern::move_offsets() {
  const auto moved = [](float place, float by) {
    const float at = std::round(256.0f * (place + by)), inside = at - 256.0f * std::floor(at / 256.0f);
    return std::max(inside, 1.0f) / 256.0f;
  };
  for (Offset& o : offsets_) o = {moved(o.x, settings_.jitter_x), moved(o.y, settings_.jitter_y)};
}

void SamplePattern::make_times_and_lens() {
  const auto n = static_cast<std::uint32_t>(settings_.samples_per_pixel),
             side = static_cast<std::uint32_t>(settings_.pattern_side);
  const std::uint32_t pixels = side * side, mask = side - 1;
  const std::uint32_t shift = hash32(settings_.seed, settings_.frame, 0x7A11u), shift_x = shift & mask,
                      shift_y = shift >> 8 & mask;
  const std::vector<std::uint16_t> ranks = void_and_cluster_ranks(settings_.pattern_side);
  // Which of a pixel's strata of time, and which of its lens points, a sample gets differs from pixel to pixel, or
  // sub-pixel position, time and lens point would be tied together. Every pair of the two orders occurs equally often
  // (exactly, up to eight samples): so time and lens are uncorrelated over a pattern, not only on average.
  const std::vector<std::uint32_t> order = shuffled(pixels, settings_.seed);
  const int digits = (std::bit_width(pixels * power_of_two_) - 1) / 2;  // of u and v that the net fixes
  const std::uint32_t scramble_u = hash32(settings_.seed, settings_.frame, 0x1E45u),
                      scramble_v = mix32(scramble_u ^ 0x9E3779B9u);
  const int bits = std::bit_width(power_of_two_) - 1;  // of a sample's number
  // Motion of many segments may repeat itself m times. Of n equal parts of the shutter, every n / gcd(m, n)-th sees the
  // same phase of it: 64 samples see 4 phases of 16 repetitions. The parts are then as many as a prime number, of which
  // a pixel's samples take all but a few: it sees as many phases as it has samples, unless the prime divides m. Among
  // the missing parts none is preferred, for motion of any number of repetitions: the parts that a pixel's samples take
  // one after the other are a step apart that differs from pixel to pixel. No choice of 64 times is much better: the
  // sum of (1 - q / 128) |S(q)|^2 over 0 < q < 128 is at least 1/2, S being the mean of exp(2 pi i q t), and S(67), which
  // harms no motion of up to 66 repetitions, takes 0.48 of it.
  const bool many = settings_.segments.size() > kFewSegments;
  const std::uint32_t parts = many ? prime_above(n) : n;
  // A rank's share of a part has so many places, one of them for each pixel and frame: otherwise all pixels together
  // would see few phases of a motion that repeats as often as there are ranks.
  const std::uint32_t places = many ? 16 : 1;
  const std::uint32_t finest = parts * pixels * places,
                      strata =
                          settings_.times > 0 ? std::min(static_cast<std::uint32_t>(settings_.times), finest) : finest;
  times_.resize(std::size_t{pixels} * n);
  lens_.resize(times_.size() * variants_);
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t column = (x + shift_x) & mask, row = (y + shift_y) & mask, pixel = row * side + column;
      const std::uint32_t time_order = order[pixel], lens_order = order[pixel] / power_of_two_;
      // With many segments, pixels whose ranks mirror each other have times that do.
      const bool mirrored = many && ranks[pixel] >= pixels / 2;
      const std::uint32_t pair = mirrored ? pixels - 1 - ranks[pixel] : ranks[pixel];
      const std::uint32_t step = many && n > 1 ? 1 + hash32(shift, pair, 0x57E9u) % (parts - 1) : 1,
                          first = many ? hash32(shift, pair, 0xF125u) % parts : 0,
                          place = hash32(shift, pair, 0x91ACu) % places;
      // Another blue-noise order of the pixels: transposed, mirrored, shifted.
      const std::uint32_t lens_rank = ranks[((mask - column + 5) & mask) * side + ((row + 3) & mask)];
      for (std::uint32_t s = 0; s < n; ++s) {
        const std::uint32_t turn = n == power_of_two_ ? s ^ (time_order & (n - 1)) : (s + time_order) % n,
                            part = (step * turn + first) % parts, at_place = (part * pixels + pair) * places + place,
                            fine = mirrored ? finest - 1 - at_place : at_place;
        const std::size_t at = std::size_t{y * side + x} * n + s;
        times_[at] = static_cast<std::uint16_t>(
            middle_quantum(time_stratum(fine, finest, strata), strata, 1u << settings_.time_bits)
            << (16 - settings_.time_bits));
        // Consecutive points of the sequence are stratified: a pixel's samples cover the lens evenly.
        const std::uint32_t point =
            lens_rank * power_of_two_ + (lens_number(s, bits) ^ (lens_order & (power_of_two_ - 1)));
        for (std::uint32_t v = 0; v < variants_; ++v) {
          const std::uint32_t jitter_u = hash32(scramble_u, point, v) >> digits,
                              jitter_v = hash32(scramble_v, point, v) >> digits;
          const std::uint32_t keep = ~(0xFFFFFFFFu >> digits);
          const std::uint32_t a = ((reverse_bits32(point) ^ scramble_u) & keep) | jitter_u,
                              b = ((sobol2_32(point) ^ scramble_v) & keep) | jitter_v;
          lens_[v * times_.size() + at] =
              concentric_disc(static_cast<float>(a >> 8) * 0x1p-24f, static_cast<float>(b >> 8) * 0x1p-24f);
        }
      }
    }
}

SampleClasses SamplePattern::make_classes(const ShutterSegment& part, const std::vector<std::uint32_t>& by_time) const {
  SampleClasses classes;
  const auto n = static_cast<std::size_t>(settings_.samples_per_pixel),
             side = static_cast<std::size_t>(settings_.pattern_side);
  classes.side = settings_.pattern_side;
  const auto from = [&](int code) {
    return std::partition_point(by_time.begin(), by_time.end(), [&](std::uint32_t at) { return code_at(at) < code; });
  };
  const std::vector<std::uint32_t> sorted(from(part.first), from(part.end));
  classes.count = static_cast<std::uint32_t>(sorted.size());
  for (auto* v : {&classes.x, &classes.y, &classes.t, &classes.lens_u, &classes.lens_v, &classes.lens_extent_u,
                  &classes.lens_extent_v})
    v->assign(sorted.size() + SampleClasses::kPadding, 0.0f);
  for (auto* v : {&classes.column, &classes.row, &classes.sample})
    v->assign(sorted.size() + SampleClasses::kPadding, 0);
  for (std::size_t c = 0; c < sorted.size(); ++c) {
    const std::size_t at = sorted[c], sample = at % n, column = at / n % side, row = at / n / side;
    classes.column[c] = static_cast<std::int32_t>(column);
    classes.row[c] = static_cast<std::int32_t>(row);
    classes.sample[c] = static_cast<std::int32_t>(sample);
    classes.x[c] = static_cast<float>(column) + offsets_[sample].x;
    classes.y[c] = static_cast<float>(row) + offsets_[sample].y;
    classes.t[c] = t_of(times_[at]) * part.scale() + part.offset();
    ++classes.first_at[static_cast<std::size_t>(classes.t[c] * 256.0f) + 1];
    float low_u = 1, high_u = -1, low_v = 1, high_v = -1;
    for (std::uint32_t v = 0; v < variants_; ++v) {
      const LensPoint& p = lens_[v * times_.size() + at];
      low_u = std::min(low_u, p.u), high_u = std::max(high_u, p.u);
      low_v = std::min(low_v, p.v), high_v = std::max(high_v, p.v);
    }
    // 2^-20: the middle, the extent and the product with the lens's size each round.
    classes.lens_u[c] = 0.5f * (low_u + high_u), classes.lens_extent_u[c] = 0.5f * (high_u - low_u) + 0x1p-20f;
    classes.lens_v[c] = 0.5f * (low_v + high_v), classes.lens_extent_v[c] = 0.5f * (high_v - low_v) + 0x1p-20f;
  }
  for (std::size_t k = 1; k <= 256; ++k) classes.first_at[k] += classes.first_at[k - 1];
  return classes;
}

std::size_t SamplePattern::lens_variant(int x, int y) const {
  if (variants_ == 1) return 0;
  const auto block = [&](int v) { return static_cast<std::uint32_t>(v / settings_.pattern_side); };
  return hash32(settings_.seed ^ 0xB10Cu, block(x), block(y), settings_.frame) % variants_;
}

void TileSamples::fill(const SamplePattern& pattern, IntRect tile, float lens_scale_in, bool lens) {
  pixels = tile;
  spp = pattern.samples_per_pixel();
  classes = &pattern.classes();
  half_quantum = pattern.half_quantum();
  half_code = static_cast<int>(half_quantum * static_cast<float>(ShutterSegment::kCodes));
  part = ShutterSegment();
  time_scale = 1, time_offset = 0;
  lens_scale = lens ? lens_scale_in : 0.0f;
  const auto n = static_cast<std::size_t>(spp);
  count = static_cast<std::size_t>(tile.width()) * static_cast<std::size_t>(tile.height()) * n;
  x.resize(count + kPadding);
  y.resize(count + kPadding);
  time.resize(count);
  lens_u.resize(lens ? count + kPadding : 0);
  lens_v.resize(lens ? count + kPadding : 0);
  const std::size_t row_samples = static_cast<std::size_t>(tile.width()) * n;
  std::size_t row = 0;
  for (int py = tile.y0; py < tile.y1; ++py, row += row_samples) {
    // All rows have the places of the first across, all pixels of a row its places down.
    if (row == 0)
      for (std::size_t i = 0; i < row_samples; ++i)
        x[i] = static_cast<float>(tile.x0 + static_cast<int>(i / n)) + pattern.offsets_[i % n].x;
    else
      std::copy_n(&x[0], row_samples, &x[row]);
    for (std::size_t s = 0; s < n; ++s) y[row + s] = static_cast<float>(py) + pattern.offsets_[s].y;
    repeat(&y[row], n, row_samples);
    // The pattern's row, from the tile's first column on.
    const auto side = static_cast<std::size_t>(pattern.side()), column = static_cast<std::size_t>(tile.x0) % side,
               first = std::min(row_samples, (side - column) * n);
    const std::uint16_t* times = &pattern.times_[pattern.index(0, py, 0)];
    std::copy_n(times + column * n, first, &time[row]);
    const std::size_t wrapped = std::min(row_samples - first, column * n);
    std::copy_n(times, wrapped, &time[row + first]);
    if (row_samples > side * n) repeat(&time[row], side * n, row_samples);
  }
  if (lens) fill_lens(pattern, lens_scale_in);
}

void TileSamples::fill_lens(const SamplePattern& pattern, float scale) {
  lens_scale = scale;
  const auto n = static_cast<std::size_t>(spp);
  std::size_t i = 0;
  for (int py = pixels.y0; py < pixels.y1; ++py)
    for (int px = pixels.x0; px < pixels.x1; ++px, i += n) {
      const SamplePattern::LensPoint* points = pattern.lenses(px, py);
      for (std::size_t s = 0; s < n; ++s) {
        lens_u[i + s] = points[s].u * scale;
        lens_v[i + s] = points[s].v * scale;
      }
    }
}

void TileSamples::enter(const SamplePattern& pattern, int segment, float lens_scale_in) {
  classes = &pattern.classes(segment);
  part = pattern.part(segment);
  time_scale = part.scale(), time_offset = part.offset();
  // A camera that zooms has a lens of another size in each segment.
  if (!lens_u.empty() && lens_scale_in != lens_scale) fill_lens(pattern, lens_scale_in);
}

}  // namespace tessera::tilecore
