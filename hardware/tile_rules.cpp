#include "hardware/tile_rules.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera::hardware {
namespace {

struct MaliProduct {
  std::string_view name;
  unsigned usable_bytes;  // bytes for the colours of one tile
  unsigned max_pixels;
};

constexpr auto kMali = std::to_array<MaliProduct>({
    {"T760", 4096, 16 * 16},  {"G71", 4096, 16 * 16},   {"G72", 8192, 16 * 16},   {"G31", 8192, 16 * 16},
    {"G51", 8192, 16 * 16},   {"G52", 8192, 16 * 16},   {"G57", 8192, 16 * 16},   {"G68", 8192, 16 * 16},
    {"G76", 8192, 16 * 16},   {"G77", 8192, 16 * 16},   {"G78", 8192, 16 * 16},   {"G310", 32768, 32 * 32},
    {"G510", 32768, 32 * 32}, {"G610", 32768, 32 * 32}, {"G615", 32768, 32 * 32}, {"G620", 32768, 32 * 32},
    {"G625", 32768, 32 * 32}, {"G710", 32768, 32 * 32}, {"G715", 32768, 32 * 32}, {"G720", 32768, 64 * 64},
    {"G725", 32768, 64 * 64}, {"G1", 32768, 64 * 64},
});

unsigned pixel_bytes(const PassFormat& format) {
  return static_cast<unsigned>(std::accumulate(format.color_bytes.begin(), format.color_bytes.end(), 0) *
                               format.samples);
}

// Halves a tile `times` times: first its height.
TilePixels halved(TilePixels tile, int times) {
  for (; times > 0; --times) (tile.width == tile.height ? tile.height : tile.width) /= 2;
  return tile;
}

[[noreturn]] void refuse(std::string_view gpu, unsigned bytes) {
  throw UsageError(fmt::format("{}: no tile holds {} bytes of a pixel", gpu, bytes));
}

}  // namespace

TilePixels tile_of(unsigned pixels) {
  const int bits = std::bit_width(pixels) - 1;
  return {1 << (bits + 1) / 2, 1 << bits / 2};
}

TilePixels largest_tile(std::uint64_t bytes_of_pixel, std::uint64_t memory_bytes, std::uint64_t tiles) {
  constexpr unsigned kSmallestTile = 8 * 8, kLargestTile = 64 * 64;
  unsigned pixels = kLargestTile;
  while (pixels > kSmallestTile && tiles * pixels * bytes_of_pixel > memory_bytes) pixels /= 2;
  return tile_of(pixels);
}

std::span<const std::string_view> mali_products() {
  static constexpr auto kNames = [] {
    std::array<std::string_view, kMali.size()> names{};
    for (std::size_t k = 0; k < kMali.size(); ++k) names[k] = kMali[k].name;
    return names;
  }();
  return kNames;
}

TilePixels mali_tile(std::string_view product, const PassFormat& format) {
  const auto found = std::find_if(kMali.begin(), kMali.end(), [&](const auto& row) { return row.name == product; });
  if (found == kMali.end()) throw UsageError(fmt::format("no Mali product '{}'", escape_control(product, 40)));
  constexpr unsigned kLeastPixels = 16;
  const unsigned bytes = std::bit_ceil(std::max(pixel_bytes(format), 1u)),
                 pixels = std::min(found->usable_bytes / bytes, found->max_pixels);
  if (pixels < kLeastPixels) refuse("Mali", pixel_bytes(format));
  return tile_of(pixels);
}

TilePixels apple_tile(const PassFormat& format) {
  constexpr unsigned kTileBytes = 32768, kSampleBytes = 64;
  const unsigned bytes = pixel_bytes(format);
  if (bytes > kSampleBytes * static_cast<unsigned>(format.samples)) refuse("Apple", bytes);
  for (const TilePixels tile : {TilePixels{32, 32}, TilePixels{32, 16}, TilePixels{16, 16}})
    if (static_cast<unsigned>(tile.width * tile.height) * bytes <= kTileBytes) return tile;
  refuse("Apple", bytes);
}

TilePixels v3d_tile(int version, const PassFormat& format) {
  const int widest = *std::max_element(format.color_bytes.begin(), format.color_bytes.end());
  if (widest > 16 || format.samples > 4) refuse("V3D", pixel_bytes(format));
  if (version >= 7) {
    constexpr unsigned kColorBytes = 16384;
    const unsigned bytes = pixel_bytes(format);
    for (unsigned pixels = 64 * 64; pixels >= 8 * 8; pixels /= 2)
      if (pixels * bytes <= kColorBytes) return tile_of(pixels);
    refuse("V3D", bytes);
  }
  const auto attachments = static_cast<int>(format.color_bytes.size());
  const int times = (attachments > 2   ? 2
                     : attachments > 1 ? 1
                                       : 0) +
                    (format.samples > 1 ? 2 : 0) +
                    (widest > 8   ? 2
                     : widest > 4 ? 1
                                  : 0);
  return halved({64, 64}, times);
}

TilePixels powervr_tile() { return {32, 32}; }

}  // namespace tessera::hardware
