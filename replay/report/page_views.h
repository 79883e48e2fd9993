#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/image.h"

namespace tessera::replay {

// Images and tiles of a page, which it holds packed and unpacks when they are looked at. The page holds the PNG files as
// they are where they take no more than kPageImageBytes together. Else all become WebP at one quality and size: the best
// with which they fit.
class PageViews {
 public:
  static constexpr std::uint64_t kPageImageBytes = 2u << 20;
  // Images beyond these are left out, evenly.
  static constexpr std::uint64_t kMaxImageBytes = 64u << 20;
  // What pixels show is in the page where it takes no more than this for all views: base patches and sub-patches, or
  // drawables alone, or those of a quarter of the pixels, or nothing. The files have all of it.
  static constexpr std::uint64_t kPagePixelBytes = 1280u << 10;
  static constexpr std::size_t kGroup = 8;  // tiles of so many views are packed together

  // The view of an image and of its tiles (tiles_NNNN.json), which may be missing: {"image": id, "tiles": [id, index],
  // "size", "region"}, each where it is there. Null without an image.
  nlohmann::json add(const std::filesystem::path& image, const std::filesystem::path& tiles, int region_x,
                     int region_y);

  // Adds to the page's data "scales" {map: [least, most] over all views}, "maps" {map: {"unit", "meaning"}}, "left_out",
  // "pixel_note" where pixels lose something, and, where images do, "lossy" and "image_note"; the script elements that hold it all to `scripts`.
  void finish(nlohmann::json& data, std::string& scripts);

 private:
  struct Rung;
  Rung choose() const;
  void pack_images(nlohmann::json& data, std::string& scripts);
  enum class PixelLevel { kAll, kDrawables, kQuarter, kNone };
  PixelLevel choose_pixels() const;
  nlohmann::json page_tiles(const std::filesystem::path& file, PixelLevel level);
  void note(const std::string& map, const nlohmann::json& values);

  std::vector<std::filesystem::path> images_, tiles_;
  std::map<std::string, std::pair<double, double>> scales_;
  nlohmann::json maps_ = nlohmann::json::object();
};

}  // namespace tessera::replay
