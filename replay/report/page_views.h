#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/image.h"

#include "replay/report/page_parts.h"

namespace tessera::replay {

// Images and tiles of a page, which it holds packed and unpacks on demand. The page holds the PNG files unchanged if
// they take at most kPageImageBytes together. Otherwise all become WebP at one quality and size: the best at which they
// fit.
class PageViews {
 public:
  static constexpr std::uint64_t kPageImageBytes = 2u << 20;
  // Images beyond this total are left out, evenly spaced.
  static constexpr std::uint64_t kMaxImageBytes = 64u << 20;
  // The page holds the pixels' surfaces if they take at most this for all views: base patches and sub-patches, or
  // drawables alone, or drawables of a quarter of the pixels, or nothing. The files have all of them.
  static constexpr std::uint64_t kPagePixelBytes = 1280u << 10;
  static constexpr std::size_t kGroup = 8;  // views whose tiles are packed together

  // The view of an image and of its tiles (tiles_NNNN.json), which may be missing: {"image": id, "tiles": [id, index],
  // "size", "region"}, each member if available. Null without an image.
  nlohmann::json add(const std::filesystem::path& image, const std::filesystem::path& tiles, int region_x,
                     int region_y);

  // Adds to the page's data "scales" {map: [least, most] over all views}, "maps" {map: {"unit", "meaning"}},
  // "left_out", "pixel_note" where pixels are reduced, and, where images are, "lossy" and "image_note"; adds the script
  // elements with the packed data to `elements`.
  void finish(nlohmann::json& data, PageElements& elements);

 private:
  struct Rung;
  Rung choose() const;
  void pack_images(nlohmann::json& data, PageElements& elements);
  enum class PixelLevel { kAll, kDrawables, kQuarter, kNone };
  PixelLevel choose_pixels() const;
  nlohmann::json page_tiles(const std::filesystem::path& file, PixelLevel level);
  void note(const std::string& map, const nlohmann::json& values);

  std::vector<std::filesystem::path> images_, tiles_;
  std::map<std::string, std::pair<double, double>> scales_;
  nlohmann::json maps_ = nlohmann::json::object();
};

}  // namespace tessera::replay
