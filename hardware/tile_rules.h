#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace tessera::hardware {

// The colours that a render pass keeps of each pixel while its tile is on chip.
struct PassFormat {
  std::span<const int> color_bytes;  // of a sample, by attachment, as the tile buffer holds it
  int samples = 1;                   // of a pixel: 1, 2, 4, 8 or 16
};

struct TilePixels {
  int width = 0, height = 0;
  bool operator==(const TilePixels&) const = default;
};

// A power of two of pixels as a tile that is as wide as high, or twice as wide.
TilePixels tile_of(unsigned pixels);
// The largest such tile, from 8x8 to 64x64 pixels, of which `tiles` fit into a memory; 8x8 where not even these fit.
TilePixels largest_tile(std::uint64_t pixel_bytes, std::uint64_t memory_bytes, std::uint64_t tiles);

// The tiles that published GPUs choose for a pass: the largest whose pixels fit their tile buffers.
//
// Arm Mali, v4 (T760) to v13 (G1). The colours of a pixel take a power of two of bytes; a tile has as many pixels, a power
// of two, as fit into what one tile may use of the tile RAM: 16 at least, 16x16 at most up to G78, 32x32 from v10 on, and on
// v12 and later 64x64 where a pixel has no more than 64 bits. Sources: Mesa, panfrost (tile RAM of products, and that two
// tiles share it but on v4 and v6); Arm's libGPUCounters (bits of a full tile), which decides where the two differ.
// Throws UsageError for a product that is not in the table, or for colours that no tile holds.
TilePixels mali_tile(std::string_view product, const PassFormat& format);
// Products in the table: "G31", "G71", "G720", ...
std::span<const std::string_view> mali_products();

// Apple, A11 and later: 32x32, 32x16 or 16x16 pixels, 32 KiB of tile memory, 64 bytes of a sample at most. Source: Metal's
// feature set tables.
TilePixels apple_tile(const PassFormat& format);

// Broadcom V3D 4 (Raspberry Pi 4): 64x64 pixels, halved for each of: a second attachment, two more, 64 bits, 128 bits of
// the widest; a quarter with four samples. V3D 7 (Raspberry Pi 5): what 16 KiB of colour hold, 64x64 to 8x8. Source: Mesa, v3d.
TilePixels v3d_tile(int version, const PassFormat& format);

// Imagination PowerVR, Series6 and later: 32x32 pixels, whatever they hold; bits of a pixel beyond those on chip go to
// memory. Source: PowerVR documentation, "Tile based architecture".
TilePixels powervr_tile();

}  // namespace tessera::hardware
