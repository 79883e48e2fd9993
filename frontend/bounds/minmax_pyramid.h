#pragma once

#include <span>
#include <vector>

#include "base/vec.h"
#include "frontend/bounds/window_table.h"
#include "shaders_cpp/texture.h"

namespace tessera::frontend {

// Tables over the mip levels of a scalar texture. Queries take a box of texture coordinates; a box that is not finite
// stands for the whole texture. `fetches`, unless null, gets every entry that is read.

// One of several lookups that are done together; `fetched`, unless null, gets the addresses of its entries.
struct HeightLookup {
  Vec2 low{0.0f}, high{0.0f};
  float lod = 0;
  std::vector<std::uint64_t>* fetched = nullptr;
  ValueRange heights{};
};

// Smallest and largest value over any footprint. Each mip level of the texture has its own table. A single table over
// level 0 would be valid for every level (coarser texels are means of finer ones), but its bounds would keep the
// extremes that a coarser level averages away.
class MinMaxPyramid {
 public:
  explicit MinMaxPyramid(const shaders::ScalarTexture& texture);

  // Contains every value that ScalarTexture::sample can return for coordinates in the box [low, high] at this lod,
  // rounding included: the box is widened by the filter's footprint, wrap modes respected.
  ValueRange query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod,
                   HeightTableCache* fetches = nullptr) const;
  // The same for several lookups at once, at most kMaxPlaces / 2; their fetches are postponed to each lookup's
  // `fetched`.
  void query(const shaders::Sampler& sampler, std::span<HeightLookup> lookups, HeightTableCache* fetches) const;
  // The same for every lod.
  ValueRange query_all(const shaders::Sampler& sampler, Vec2 low, Vec2 high) const;

  ValueRange whole() const;
  // Records the texels that one lookup of the texture itself fetches.
  void fetch_texels(const shaders::Sampler& sampler, Vec2 at, float lod, HeightTableCache& fetches) const;
  // Places its tables and the texels in memory from `address` on; returns the end.
  std::uint64_t place(std::uint64_t address);

 private:
  // Range of a value mixed from one value of each range.
  static ValueRange between(const ValueRange& fine, const ValueRange& coarse, float weight);

  std::vector<WindowTable> levels_;
  std::vector<std::uint64_t> texels_;  // addresses of the levels
};

// Change of a filtered value per unit of each texture coordinate.
struct HeightSlopes {
  ValueRange along_s, along_t;
};

// Slopes of a scalar texture over any footprint: smallest and largest difference of neighbouring texels, for each mip
// level.
class SlopePyramid {
 public:
  explicit SlopePyramid(const shaders::ScalarTexture& texture);

  // Along any segment inside the box the filtered value changes, at this lod, by the segment's length along s times a
  // value of `along_s` plus its length along t times a value of `along_t`, up to rounding of the values; wrap modes
  // respected.
  HeightSlopes query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod,
                     HeightTableCache* fetches = nullptr) const;
  std::uint64_t place(std::uint64_t address);

 private:
  struct Level {
    WindowTable along_s, along_t;
  };
  static HeightSlopes of_level(const Level& level, const shaders::Sampler& sampler, Vec2 low, Vec2 high,
                               HeightTableCache* fetches);

  std::vector<Level> levels_;
};

// Largest difference of the value at one place between two levels of detail: patches that share an edge read its
// heights at their own levels.
class LevelDifferences {
 public:
  explicit LevelDifferences(const shaders::ScalarTexture& texture);

  // Returns at least |sample(c, lod0) - sample(c, lod1)| for all coordinates c in the box, up to rounding of the
  // values.
  float query(const shaders::Sampler& sampler, Vec2 low, Vec2 high, float lod0, float lod1,
              HeightTableCache* fetches = nullptr) const;
  std::uint64_t place(std::uint64_t address);

 private:
  std::vector<WindowTable> levels_;  // of each level against the next
};

}  // namespace tessera::frontend
