#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/rect.h"

namespace tessera::tilecore {

// Side of the pixel block that the temporal pattern and the sample packets are built on.
inline constexpr int kBlockSide = 8;
inline constexpr int kBlockPixels = kBlockSide * kBlockSide;

struct SamplingSettings {
  int samples_per_pixel = 4;   // 1 to 64
  std::uint32_t seed = 0;
  std::uint32_t frame = 0;
};

// Where, when and through which point of the lens a sample looks. Everything follows from (pixel, sample index, frame,
// seed): no state, any order.
//   x, y    offset inside the pixel in [0, 1), a multiple of 1/256: a (0,2)-sequence, the same for all pixels
//   time    0..255; the sample is at t = time / 256. Stratified over a pixel's samples, and over the 8x8 pattern of
//           blue-noise ranks that repeats over the frame and is shifted from frame to frame
//   u, v    point of the unit disc; a (0,2)-sequence scrambled per pixel, concentric map (Shirley and Chiu 1997)
class SamplePattern {
 public:
  explicit SamplePattern(const SamplingSettings& settings);

  int samples_per_pixel() const { return settings_.samples_per_pixel; }

  struct Offset {
    float x, y;
  };
  Offset offset(int sample) const { return offsets_[static_cast<std::size_t>(sample)]; }
  std::uint8_t time(int x, int y, int sample) const {
    const int column = (x + shift_x_) & (kBlockSide - 1), row = (y + shift_y_) & (kBlockSide - 1);
    return times_[static_cast<std::size_t>((row * kBlockSide + column) * settings_.samples_per_pixel + sample)];
  }
  struct LensPoint {
    float u, v;
  };
  LensPoint lens(int x, int y, int sample) const;

 private:
  SamplingSettings settings_;
  std::uint32_t power_of_two_;  // smallest that is >= samples per pixel
  int shift_x_, shift_y_;
  std::vector<Offset> offsets_;
  std::vector<std::uint8_t> times_;
};

// Samples of one tile as structure of arrays, in two orders.
//
// Natural order: pixel by pixel, row by row; sample k of pixel (x, y) is (y * width + x) * spp + k, coordinates local
// to the tile. Time order: block by block (8x8 pixels on the frame's grid, cut to the tile), each sorted by time, so
// that an interval of time is a contiguous range; `natural` leads back.
struct TileSamples {
  // Arrays of floats are longer than their samples by this, so that vectors may be loaded anywhere.
  static constexpr std::size_t kPadding = 16;

  IntRect pixels;
  int spp = 0;
  std::vector<float> x, y;                   // natural order, pixels of the frame
  std::vector<std::uint8_t> time;            // natural order
  std::vector<float> lens_u, lens_v;         // natural order; empty for a pinhole

  struct Block {
    IntRect pixels;
    std::uint32_t first, count;              // in the arrays below
    std::array<std::uint32_t, 257> first_at; // first sample with time >= k, relative to `first`
  };
  int block_columns = 0;
  std::vector<Block> blocks;
  // Time order.
  std::vector<float> sorted_x, sorted_y, sorted_t, sorted_lens_u, sorted_lens_v;
  std::vector<std::uint32_t> natural;

  std::size_t count = 0;

  // Fills everything for a tile. `lens_scale` in pixels multiplies the lens points, which are left out without `lens`;
  // `sorted` asks for the time order.
  void fill(const SamplePattern& pattern, IntRect tile, float lens_scale, bool lens, bool sorted);

 private:
  void sort_blocks();
};

// Time-sorted samples [first, last) of a block, relative to the block.
struct SampleRange {
  const TileSamples::Block* block;
  std::uint32_t first, last;
};

}  // namespace tessera::tilecore
