#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace tessera::hardware {

// Colour storage of a pixel while its tile is on chip, as a render pass requests it.
struct PassFormat {
  std::span<const int> color_bytes;  // bytes of a sample, by attachment, as the tile buffer holds it
  int samples = 1;                   // samples of a pixel: 1, 2, 4, 8 or 16
};

struct TilePixels {
  int width = 0, height = 0;
  bool operator==(const TilePixels&) const = default;
};

// A power of two of pixels as a tile that is as wide as high, or twice as wide.
TilePixels tile_of(unsigned pixels);
// The largest such tile, from 8x8 to 64x64 pixels, of which `tiles` fit into a memory; 8x8 where not even these fit.
TilePixels largest_tile(std::uint64_t bytes_of_pixel, std::uint64_t memory_bytes, std::uint64_t tiles);

// The tile sizes that published GPUs choose for a pass: the largest whose pixels fit into their tile buffers.
//
// Tile size of Arm Mali, v4 (T760) to v13 (G1). The colours of a pixel take a power of two of bytes. A tile has the
// largest power of two of pixels that fits into its share of the tile RAM: at least 16, at most 16x16 up to G78,
// 32x32 from v10 on, and 64x64 from v12 on where a pixel has no more than 64 bits. Sources: Mesa, panfrost (tile RAM
// of products, which two tiles share except on v4 and v6); Arm's libGPUCounters (bits of a full tile), which decides
// where the two differ. Throws UsageError for a product that is not in the table, or for colours that no tile holds.
TilePixels mali_tile(std::string_view product, const PassFormat& format);
// Products in the table: "G31", "G71", "G720", ...
std::span<const std::string_view> mali_products();

// Tile size of Apple, A11 and later: 32x32, 32x16 or 16x16 pixels, 32 KiB of tile memory, at most 64 bytes of a
// sample. Source: Metal's feature set tables.
TilePixels apple_tile(const PassFormat& format);

// Tile size of Broadcom V3D 4 (Raspberry Pi 4): 64x64 pixels, halved once each for a second attachment, for two more,
// for 64 bits and for 128 bits of the widest; a quarter with four samples. V3D 7 (Raspberry Pi 5): 16 KiB of colour,
// 64x64 to 8x8 pixels. Source: Mesa, v3d.
TilePixels v3d_tile(int version, const PassFormat& format);

// Tile size of Imagination PowerVR, Series6 and later: 32x32 pixels for every format; bits of a pixel that do not fit
// on chip go to memory. Source: PowerVR documentation, "Tile based architecture".
TilePixels powervr_tile();

}  // namespace tessera::hardware
