#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/rect.h"
#include "base/shutter_segment.h"

namespace tessera::tilecore {

struct SamplingSettings {
  int samples_per_pixel = 4;  // 1 to 64
  std::uint32_t seed = 0;
  std::uint32_t frame = 0;
  int pattern_side = 8;  // pixels after which the pattern repeats: 8 or 32
  int time_bits = 8;     // 8 or 16: precision of a sample's time
  int times = 0;         // distinct times, up to 256; 0: as many as strata and precision allow
  std::vector<ShutterSegment> segments =
      {};  // of motion: parts of the shutter that samples are looked for in one at a time
  // Moves all samples of a pixel by as much, in pixels from -1 to 1, rounded to 1/256. A sample that would leave its pixel
  // enters it from the other side, at least 1/256 from the border.
  float jitter_x = 0, jitter_y = 0;
};

// Times as stencil values 0..255, the upper eight bits of a sample's time. Empty when first > last.
struct TimeRange {
  int first = 0, last = 255;
  bool empty() const { return first > last; }
  TimeRange intersect(const TimeRange& o) const { return {std::max(first, o.first), std::min(last, o.last)}; }
};

// Samples of one pattern, sorted by time. A *class* is one sample of the pattern; since the pattern repeats, the
// samples of a class lie on a grid as wide as the pattern, all with the same time and nearly the same lens point. So
// the samples that a moving box may touch need no search: per class, the box at the class's time and lens point covers
// a range of that grid. Therefore visibility's cost does not depend on blur (see sample_tests.h).
//
// Arrays are padded, so that vectors may be loaded at any class.
struct SampleClasses {
  static constexpr std::size_t kPadding = 16;

  int side = 8;
  std::uint32_t count = 0;  // side * side * samples per pixel
  std::vector<float> x, y;  // in [0, side)
  std::vector<float> t;
  std::vector<std::int32_t> column, row, sample;  // pixel within the pattern, number within the pixel
  // The unit lens points of the class in all blocks: middle and half extent of their box.
  std::vector<float> lens_u, lens_v, lens_extent_u, lens_extent_v;
  std::array<std::uint32_t, 257> first_at{};  // first class with stencil value >= k
};

// Ranks 0 .. n*n-1 of the cells of an n x n torus, in an order that keeps every prefix evenly spread (void and cluster,
// Ulichney 1993): neighbouring pixels get times far apart, and any run of ranks is blue noise. Row by row.
std::vector<std::uint16_t> void_and_cluster_ranks(int n);

// The place, time and lens point of a sample. They follow from (pixel, sample index, frame, seed): there is no state,
// and any order works.
//   x, y    offset inside the pixel in [0, 1), a multiple of 1/256: a (0,2)-sequence around the middle of the pixel, the
//           same for all pixels
//   time    code 0..65535, the sample is at t = code / 65536 + half a quantum; the upper 8 bits of the code are the
//           stencil value, the lower are zero unless 16 bits are asked for. Stratified over a pixel's samples, and over
//           a pattern of blue-noise ranks that repeats over the frame and is shifted from frame to frame. The samples
//           of a pattern come in pairs at t and 1 - t: their mean is 1/2 for any number of samples and any precision.
//           With more than kFewSegments of motion, which may repeat itself, a pixel's strata are as many as the smallest
//           prime above its number of samples, which take all but a few of them: then a pixel sees as many phases of a
//           repetition as it has samples, unless the prime divides the number of repetitions (67 for 64 samples)
//   u, v    point of the unit disc (concentric map, Shirley and Chiu 1997): the samples of a pattern share out a
//           (0,2)-net, evenly within each pixel; inside its cell of the net a sample moves from block to block
class SamplePattern {
 public:
  explicit SamplePattern(const SamplingSettings& settings);

  int samples_per_pixel() const { return settings_.samples_per_pixel; }
  int side() const { return settings_.pattern_side; }
  std::uint32_t frame() const { return settings_.frame; }

  struct Offset {
    float x, y;
  };
  Offset offset(int sample) const { return offsets_[static_cast<std::size_t>(sample)]; }
  std::uint16_t time(int x, int y, int sample) const { return times_[index(x, y, sample)]; }
  float t(int x, int y, int sample) const { return t_of(time(x, y, sample)); }
  float t_of(std::uint16_t code) const { return static_cast<float>(code) * 0x1p-16f + half_quantum(); }
  // Half a quantum of the time codes: the middle of an interval of times represents it.
  float half_quantum() const { return settings_.time_bits == 8 ? 0x1p-9f : 0x1p-17f; }
  struct LensPoint {
    float u, v;
  };
  LensPoint lens(int x, int y, int sample) const { return lenses(x, y)[sample]; }
  // The lens points of a pixel's samples.
  const LensPoint* lenses(int x, int y) const { return &lens_[lens_variant(x, y) * times_.size() + index(x, y, 0)]; }

  // The classes of the whole shutter (0), or of one segment of motion (1 on): the classes whose times lie in it, with
  // times and stencil values that count from its beginning to its end.
  const SampleClasses& classes(int segment = 0) const { return classes_[static_cast<std::size_t>(segment)]; }
  ShutterSegment part(int segment) const {
    return segment == 0 ? ShutterSegment() : settings_.segments[static_cast<std::size_t>(segment) - 1];
  }

 private:
  // Index of a sample within the pattern: row by row, pixel by pixel.
  std::size_t index(int x, int y, int sample) const {
    const int mask = settings_.pattern_side - 1;
    return static_cast<std::size_t>(((y & mask) * settings_.pattern_side + (x & mask)) * settings_.samples_per_pixel +
                                    sample);
  }
  // The lens table that the block of a pixel uses.
  std::size_t lens_variant(int x, int y) const;
  void make_offsets();
  void move_offsets();
  void make_times_and_lens();
  // `by_time`: all samples of the pattern, sorted.
  SampleClasses make_classes(const ShutterSegment& part, const std::vector<std::uint32_t>& by_time) const;
  // A sample's time in the 65536 codes that measure parts of the shutter.
  int code_at(std::size_t at) const { return times_[at] + (settings_.time_bits == 8 ? 128 : 0); }

  SamplingSettings settings_;
  std::uint32_t power_of_two_;  // smallest that is >= samples per pixel
  std::uint32_t variants_;
  std::vector<Offset> offsets_;
  std::vector<std::uint16_t> times_;
  std::vector<LensPoint> lens_;  // variant by variant
  std::vector<SampleClasses> classes_;

  friend struct TileSamples;
};
// Fewer than eight segments are at most three repetitions, there and back, and regular strata blur them best. With more
// segments times have 16 bits, because the phase of a repeated motion is finer than a stencil value.
inline constexpr std::size_t kFewSegments = 7;

// Samples of one tile as structure of arrays in natural order: pixel by pixel, row by row; sample k of pixel (x, y) is
// (y * width + x) * spp + k, coordinates local to the tile.
struct TileSamples {
  // Arrays of floats are longer than their samples by this, so that vectors may be loaded anywhere.
  static constexpr std::size_t kPadding = 16;

  IntRect pixels;
  int spp = 0;
  std::size_t count = 0;
  std::vector<float> x, y;          // pixels of the frame
  std::vector<std::uint16_t> time;  // code: t = time / 65536 + half_quantum
  float half_quantum = 0;
  int half_code = 0;                       // the same in codes, rounded down
  ShutterSegment part;                     // the current part of the shutter
  float time_scale = 1, time_offset = 0;   // convert to the time within the part
  std::vector<float> lens_u, lens_v;       // in lens_scale; empty for a pinhole
  float lens_scale = 0;                    // largest |(u, v)|
  const SampleClasses* classes = nullptr;  // the pattern's

  static constexpr int kNever = 256;  // stencil value of samples outside the part: no reference keeps it

  float t(std::size_t sample) const {
    return (static_cast<float>(time[sample]) * 0x1p-16f + half_quantum) * time_scale + time_offset;
  }
  int stencil(std::size_t sample) const {
    if (part.whole()) return time[sample] >> 8;
    const int code = time[sample] + half_code;
    return code < part.first || code >= part.end ? kNever : static_cast<int>(t(sample) * 256.0f);
  }

  // Restricts the samples to one segment of motion, or (0) widens them again to the whole shutter. `lens_scale`: the
  // segment's.
  void enter(const SamplePattern& pattern, int segment, float lens_scale_in);

  // Fills everything for a tile. `lens_scale` in pixels multiplies the lens points, which are left out without `lens`.
  // Refers to the pattern's classes.
  void fill(const SamplePattern& pattern, IntRect tile, float lens_scale_in, bool lens);
  void fill(SamplePattern&& pattern, IntRect tile, float lens_scale_in, bool lens) = delete;

 private:
  void fill_lens(const SamplePattern& pattern, float scale);
};

}  // namespace tessera::tilecore
