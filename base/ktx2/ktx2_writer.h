#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace tessera::ktx2 {

// One mip level to write: width * height texels RGBA8, rows from the top.
struct LevelToWrite {
  int width = 0, height = 0;
  std::span<const std::uint8_t> texels;
};

struct Ktx2Options {
  bool srgb = false;   // else linear: then the primaries are unspecified, as glTF asks for data
  bool alpha = false;  // else alpha is not looked at
  bool etc1s = false;  // BasisLZ/ETC1S; else UASTC, packed by Zstandard
};

// A KTX 2.0 file, as KHR_texture_basisu allows it: the largest level first, each half as wide and high as the one before,
// rounded down. Blocks that reach beyond a level repeat its last column and row.
std::string write_ktx2(std::span<const LevelToWrite> levels, const Ktx2Options& options);

}  // namespace tessera::ktx2
