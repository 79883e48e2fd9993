#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "baselines/tessellated_patch.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"
#include "memory/lru_cache.h"
#include "tilecore/tile_core.h"

namespace tessera::baselines {

// Addresses of the samples of a frame in the memory of an immediate-mode machine. Each sample has `depth_bytes` of depth, a
// power of two. The surface consists of lines of one burst that hold a rectangle of pixels as square as possible (64 bytes,
// 4 samples: 2x2 pixels). Pixels with more samples than a line holds take several lines. Colours have a line, or several, for
// each line of depths.
class SampleLayout {
 public:
  SampleLayout(IntRect region, int samples_per_pixel, std::uint64_t burst_bytes, std::uint64_t depth_bytes = 4);

  std::uint32_t line_count() const { return line_count_; }
  // Line of a sample; the pixel must be inside the region.
  std::uint32_t line(int x, int y, int sample) const {
    const int column = (x - region_.x0) / width_, row = (y - region_.y0) / height_;
    return static_cast<std::uint32_t>((row * columns_ + column) * lines_per_pixel_ + sample / samples_per_line_);
  }
  // Place of a sample in its line.
  std::uint32_t place(int x, int y, int sample) const {
    const int column = (x - region_.x0) % width_, row = (y - region_.y0) % height_;
    return static_cast<std::uint32_t>((row * width_ + column) * samples_per_pixel_ + sample % samples_per_line_);
  }
  std::uint32_t samples_per_line() const { return static_cast<std::uint32_t>(samples_per_line_); }

 private:
  IntRect region_;
  int samples_per_pixel_;
  int width_ = 1, height_ = 1, columns_, lines_per_pixel_ = 1, samples_per_line_;
  std::uint32_t line_count_;
};

// Data that an immediate-mode machine keeps for a line of depths.
struct LineData {
  std::uint64_t color_bursts = 1;  // of colours, or of a G-buffer; 0: a pass of depths alone
  // Known words of a sample of the G-buffer; further words are raw. 0: draws give colours at once.
  std::size_t gbuffer_words = 0;
  // With a G-buffer: of blended layers, which wait for its light in a surface of their own.
  std::uint64_t layer_bursts = 0;

  std::size_t words() const { return gbuffer_words > 0 ? gbuffer_words : 1; }  // that a draw gives a sample
};

// The data of a job's pass, by its surfaces (surfaces.h).
LineData line_data(const tilecore::TileJob& job);

// The memory of an immediate-mode machine behind a colour and depth cache (LRU, lines of one burst). Depth is read
// before it is tested. Colour is read only to blend, as lines have a mask of changed bytes. A line that was never
// written back is known to be clear and is not read. At the end samples are resolved, which reads all drawn colour, or all of the
// G-buffer, with its depths, and the layers.
//
// Configured by baselines.cache_bytes, memory.burst_bytes.
class ImmediateMemory {
 public:
  // `loads`: colours are in memory from the start.
  ImmediateMemory(std::uint64_t cache_bytes, std::uint64_t burst_bytes, std::uint32_t line_count,
                  const LineData& data = {}, bool loads = false)
      : burst_bytes_(burst_bytes),
        data_(data),
        cache_(cache_bytes),
        in_memory_(std::size_t{kSurfaces} * line_count, false),
        drawn_(line_count, false),
        layered_(line_count, false) {
    for (std::size_t key = kColor; loads && key < in_memory_.size(); key += kSurfaces) in_memory_[key] = true;
  }
  // The depths of these lines are in memory, as a prepass has left them, and no draw changes any.
  void know_depths(const std::vector<bool>& lines) {
    depths_known_ = true;
    for (std::uint32_t line = 0; line < lines.size(); ++line) in_memory_[key_of(line, kDepth)] = lines[line];
  }

  // Draws a triangle on the samples of a line. `passes`: some of them are in front of the depth drawn so far. Blended
  // triangles change no depth.
  void draw(std::uint32_t line, bool passes, bool blends) {
    use(key_of(line, kDepth), true, passes && !blends && !depths_known_);
    if (!passes) return;
    const bool layer = blends && data_.layer_bursts > 0;
    use(key_of(line, layer ? kLayers : kColor), blends, true);
    (layer ? layered_ : drawn_)[line] = true;
  }

  // Writes back the cache; `resolve` first reads the colour, or the G-buffer with its depths and layers.
  void finish(bool resolve);

  std::uint64_t bytes_read() const { return bytes_read_; }
  std::uint64_t bytes_written() const { return bytes_written_; }

 private:
  static constexpr std::uint32_t kDepth = 0, kColor = 1, kLayers = 2, kSurfaces = 3;
  static std::uint32_t key_of(std::uint32_t line, std::uint32_t surface) { return kSurfaces * line + surface; }
  void use(std::uint32_t key, bool read, bool change) {
    const bool in_memory = in_memory_[key];  // before this use writes it past a cache without room
    const bool hit = cache_.use(key, bytes_of(key), change, [this](std::uint32_t k) { write_back(k); });
    if (!hit && read && in_memory) bytes_read_ += bytes_of(key);
  }
  void write_back(std::uint32_t key) {
    bytes_written_ += bytes_of(key);
    in_memory_[key] = true;
  }
  std::uint64_t bytes_of(std::uint32_t key) const {
    const std::uint32_t surface = key % kSurfaces;
    return burst_bytes_ * (surface == kDepth ? 1 : surface == kColor ? data_.color_bursts : data_.layer_bursts);
  }

  std::uint64_t burst_bytes_;
  LineData data_;
  memory::LruCache cache_;
  std::vector<bool> in_memory_, drawn_, layered_;
  bool depths_known_ = false;
  std::uint64_t bytes_read_ = 0, bytes_written_ = 0;
};

// Samples of a line that take the colour of a pixel-shader invocation.
struct ColorWrite {
  std::uint64_t samples;  // bit k: sample k of the line
  std::uint32_t point;    // index in the tile's colours
};

// A triangle on a line of samples; `passes`: some of them are in front of the depth drawn so far.
struct LineTouch {
  std::uint32_t line;
  bool passes, blends;
  std::uint32_t first_write, write_count;  // range in the tile's writes
};

// The touches of one base patch in one tile.
struct DrawnInTile {
  std::uint32_t patch = 0, tile = 0;
  std::size_t begin = 0, end = 0;  // range in the tile's touches
  std::uint64_t hits = 0;          // samples in its triangles
  std::uint64_t depth_tests = 0;   // samples that hierarchical depth left to test
  std::uint64_t invocations = 0, blended = 0;
  std::uint64_t blocks_scanned = 0;  // blocks whose farthest depth was computed again
  // The patch's work of a core's visibility units, before hierarchical depth drops any of it.
  timing::SubPatchItem tests;
};

// The changes to the samples of one tile when triangles are drawn in submission order, and the triangles visible in the end.
//
//   triangle -> hierarchical depth drops blocks of 8x8 pixels whose samples are all nearer -> samples in front of the depth
//   drawn so far -> one pixel-shader invocation per pixel and triangle
struct TileDrawing {
  std::vector<DrawnInTile> drawn;
  std::vector<LineTouch> touches;
  std::vector<ColorWrite> writes;
  std::vector<std::uint32_t> colors;  // by point: RGBA8, or the known words of the G-buffer (LineData::words())
  std::uint64_t blocks_culled = 0;    // pairs of a triangle and a block
  std::vector<float>
      farthest;  // farthest depth of each block in the end, row by row; infinity if a sample sees the environment
  std::vector<std::uint64_t> visible;  // see VisibleTriangles
  std::vector<float> depths;           // of a prepass: of its samples in the end; infinity: a sample sees no surface
};

// Scratch memory of a thread.
struct TileDrawer {
  tilecore::TileCore core;
  tilecore::PixelShader shader;
};

// Draws one tile. `entries`: entries of the tile, cut and ordered in any way. Hits are exact, also where motion and
// defocus scatter them. A shadow map has no invocations, and a surface that blends casts like an opaque one. `known`: depths that a
// prepass has left of the samples, which opaque surfaces must reach; empty: there was none. With `colors` false no pixel is shaded and
// colours stay empty; `point` still numbers invocations.
TileDrawing draw_tile(const tilecore::TileJob& job, std::uint32_t tile, std::vector<binner::ListEntry> entries,
                      const SampleLayout& layout, std::span<const float> known, bool colors, TileDrawer& drawer,
                      std::uint64_t& invocations);

}  // namespace tessera::baselines
