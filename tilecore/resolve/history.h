#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "base/rect.h"
#include "base/vec.h"

namespace tessera::tilecore {

// Displacement, in pixels, of some places of a frame since the previous frame (motion_field.h).
struct CameraMotion {
  bool known = false;
  std::array<Vec2, 9> pixels{};
  bool operator==(const CameraMotion&) const = default;
};

// The state that one frame leaves to the next: everything that the resolve unit carries between frames. With it and the
// capture a replay can continue at any frame. (The previous places of vertices follow from the frame's number.)
//
// Arrays of pixels hold a value per pixel of the region, row by row; arrays of blocks one per block of 4x4 pixels.
// Blocks lie on multiples of four pixels of the whole frame, whatever the region.
//
// The emulated machine keeps `color` as the frame buffer, in its format, and beside it the surfaces: for each block one
// surface and its plane, or, if a block sees several surfaces or one that is not plane enough, a record of each pixel
// (packed_records.h). `depth` holds the depths of these records. Reads between pixels use `rounded`; a copied pixel has
// the same code either way, and the emulator keeps its shaded colour.
//
// There are two frame buffers, with their records: one is read while the other is written. `stay` tells for which
// blocks the machine knows the signature, and whether the other buffer holds the same content (unchanged_blocks.h).
struct History {
  static constexpr std::uint64_t kSurfaceBytes = 8;  // depth and surface of a pixel
  // The record of a block holds a surface, 1/z, its gradient in 24 bits each, and the mask of reconstructed pixels.
  static constexpr std::uint64_t kPlaneBytes = 16;
  // Regime, whether any surface is seen, and the number of rejecting frames, or, for a block without any, `stay`.
  static constexpr std::uint64_t kBlockBytes = 1;
  static constexpr std::uint64_t kContrastBytes = 1;  // of a block
  static constexpr float kPlaneError = 1.0f / 4096;   // share of its depth by which a plane may miss a pixel
  static constexpr std::uint8_t kRegime = 63, kNothingSeen = 64;  // in `memory`

  IntRect region;
  std::int64_t frame = kNone;  // number of the frame that filled it
  std::vector<Vec4> color;     // linear RGB and coverage, as resolved
  // The depth of the sample nearest to the pixel's middle; infinity if there is none. A negative depth marks a colour
  // that was reconstructed from other pixels.
  std::vector<float> depth;
  std::vector<std::uint32_t> surface;  // as PixelSurfaces::surface

  CameraMotion camera;                 // since the frame before; unknown after the first
  std::vector<std::uint8_t> memory;    // per block: BlockDecision::memory() in kRegime, kNothingSeen
  std::vector<std::uint8_t> reject;    // per block: number of frames that advect no pixel here
  std::vector<std::uint8_t> contrast;  // per block: block_contrast.h
  enum Stay : std::uint8_t { kUnknown, kSigned, kSettled };  // kSettled: signed, and equal to the previous frame
  std::vector<std::uint8_t> stay;                            // per block
  // Bytes of blocks of the compressed frame buffer (stored_block()) and of cells of packed records; empty if there are
  // none.
  std::vector<std::uint16_t> payload, cells;

  // `color` in the precision of the frame buffer; empty if it is equal. It follows from `color`, and is not saved.
  std::vector<Vec4> rounded;
  const Vec4* between_pixels() const { return rounded.empty() ? color.data() : rounded.data(); }

  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();

  History() = default;
  explicit History(IntRect region_in);

  bool empty() const { return frame == kNone; }
  int block_columns() const { return (region.x1 + 3) / 4 - region.x0 / 4; }
  int block_rows() const { return (region.y1 + 3) / 4 - region.y0 / 4; }
  std::size_t pixel(int x, int y) const { return region.index(x, y); }
  // Block that pixel (x, y) lies in.
  std::size_t block(int x, int y) const {
    return static_cast<std::size_t>(y / 4 - region.y0 / 4) * static_cast<std::size_t>(block_columns()) +
           static_cast<std::size_t>(x / 4 - region.x0 / 4);
  }
  // Whether the block of (x, y) or a block around it is rejected.
  bool rejected_around(int x, int y) const;

  // Whether block `b` is known to see no surface.
  bool empty_block(std::size_t b) const { return (memory[b] & kNothingSeen) != 0; }

  // All of it, in the host's byte order; save() writes a file completely or not at all. Throws WriteError.
  std::string bytes() const;
  void save(const std::filesystem::path& file) const;
  // Throws InputError for a file of another kind or a damaged one, LimitError when its region has more than
  // `max_pixels`.
  static History restore(const std::filesystem::path& file, std::uint64_t max_pixels);

  bool operator==(const History&) const = default;
};

}  // namespace tessera::tilecore
