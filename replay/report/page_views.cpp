#include "replay/report/page_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/json_text.h"
#include "base/parallel.h"
#include "base/webp_codec.h"
#include "base/whole_file.h"
#include "replay/report/page_parts.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

bool is_file(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored);
}

std::uint32_t big_endian32(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

// Means of two by two pixels.
Image8 halved(const Image8& image) {
  Image8 out(std::max(1, image.width / 2), std::max(1, image.height / 2), image.channels);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < image.channels; ++c) {
        int sum = 2;
        for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}})
          sum += image.at(std::min(2 * x + dx, image.width - 1),
                          std::min(2 * y + dy, image.height - 1))[static_cast<std::size_t>(c)];
        out.at(x, y)[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(sum / 4);
      }
  return out;
}

// The drawables of every `step`th pixel of every `step`th row of a view's "pixels": {"region", "step", "drawables": runs of
// rows plus one}.
json drawable_runs(const json& pixels, std::size_t step) {
  const json &seen = pixels.at("seen"), &rows = pixels.at("sub_patches").at("row");
  const auto width = pixels.at("region").at(2).get<std::size_t>();
  json values = json::array();
  std::vector<std::uint64_t> lengths;
  std::size_t place = 0;
  for (std::size_t k = 0; k < seen.at("values").size(); ++k) {
    const auto at = seen["values"][k].get<std::size_t>();
    const int row = at == 0 ? 0 : rows.at(at - 1).get<int>() + 1;
    std::uint64_t count = 0;
    for (const std::size_t end = place + seen.at("lengths").at(k).get<std::size_t>(); place < end; ++place)
      count += place / width % step == 0 && place % width % step == 0 ? 1 : 0;
    if (count == 0) continue;
    if (values.empty() || values.back() != row) values.push_back(row), lengths.push_back(0);
    lengths.back() += count;
  }
  return {{"region", pixels.at("region")}, {"step", step}, {"drawables", {{"lengths", lengths}, {"values", values}}}};
}

}  // namespace

struct PageViews::Rung {
  int quality = 0;
  bool as_it_is = false, half = false;

  std::string encode(const fs::path& file) const {
    std::string text = read_whole_text(file);
    DecodedImage decoded;
    std::string fault;
    if (!decode_image(bytes_of(text), {}, decoded, fault))
      throw InputError(file.string(), "", "is not an image: " + fault);
    const auto* image = std::get_if<Image8>(&decoded.pixels);
    if (image == nullptr || image->channels < 3) throw InputError(file.string(), "", "is not an image of a replay");
    if (as_it_is) return text;
    return encode_webp(half ? halved(*image) : *image, quality, false);
  }
};

json PageViews::add(const fs::path& image, const fs::path& tiles, int region_x, int region_y) {
  if (!is_file(image)) return nullptr;
  const std::string bytes = read_whole_text(image);
  if (bytes.size() < 24) return nullptr;
  json view = {{"image", fmt::format("image-{}", images_.size())},
               {"size", {big_endian32(bytes, 16), big_endian32(bytes, 20)}},
               {"region", {region_x, region_y}}};
  images_.push_back(image);
  if (is_file(tiles)) {
    view["tiles"] = {fmt::format("tiles-{}", tiles_.size() / kGroup), tiles_.size() % kGroup};
    tiles_.push_back(tiles);
  }
  return view;
}

PageViews::Rung PageViews::choose() const {
  static constexpr std::array<Rung, 10> kLadder = {{{0, true, false},
                                                    {90, false, false},
                                                    {80, false, false},
                                                    {65, false, false},
                                                    {50, false, false},
                                                    {35, false, false},
                                                    {65, false, true},
                                                    {50, false, true},
                                                    {35, false, true},
                                                    {20, false, true}}};
  constexpr std::size_t kSamples = 4;
  const std::size_t samples = std::min(images_.size(), kSamples);
  for (const Rung& rung : kLadder) {
    if (&rung == &kLadder.back()) return rung;
    std::uint64_t bytes = 0;
    for (std::size_t k = 0; k < samples; ++k) bytes += rung.encode(images_[k * images_.size() / samples]).size();
    if (bytes * images_.size() <= kPageImageBytes * samples) return rung;
  }
  return kLadder.back();
}

void PageViews::pack_images(json& data, PageElements& elements) {
  data["left_out"] = 0;
  if (images_.empty()) return;
  const Rung rung = choose();
  std::vector<std::string> packed(images_.size());
  parallel_for(images_.size(), [&](std::size_t k) { packed[k] = base64(rung.encode(images_[k])); });
  std::uint64_t bytes = 0;
  for (const std::string& image : packed) bytes += image.size();
  const std::uint64_t every = (bytes + kMaxImageBytes - 1) / kMaxImageBytes;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < packed.size(); ++k) {
    if (k % std::max<std::uint64_t>(every, 1) != 0) {
      ++left_out;
      continue;
    }
    append_script(fmt::format("image-{}", k), packed[k], k == 0 ? elements.first : elements.rest);
  }
  data["left_out"] = left_out;
  if (rung.as_it_is) return;
  data["lossy"] = true;
  data["image_note"] =
      fmt::format("Images here are WebP of quality {}{}, to keep this file small; the folder has exact images.",
                  rung.quality, rung.half ? " and half the size" : "");
}

void PageViews::note(const std::string& map, const json& values) {
  const auto [at, fresh] = scales_.try_emplace(map, std::numeric_limits<double>::infinity(), 0.0);
  for (const json& value : values) {
    const double number = value.get<double>();
    at->second.first = std::min(at->second.first, number);
    at->second.second = std::max(at->second.second, number);
  }
}

// The part of tiles_NNNN.json that the page shows: without maps of zeros, in whole numbers.
json PageViews::page_tiles(const fs::path& file, PixelLevel level) {
  const json tiles = parse_json(read_whole_text(file), file.string());
  json out = {
      {"origin", tiles.at("origin")}, {"tile", tiles.at("tile")}, {"grid", tiles.at("grid")}, {"maps", json::object()}};
  const auto any = [](const json& values) {
    return std::any_of(values.begin(), values.end(), [](const json& value) { return value.get<double>() != 0; });
  };
  for (const auto& [name, map] : tiles.at("maps").items()) {
    const json& values = map.at("values");
    note(name, values);
    maps_[name] = {{"unit", map.at("unit")}, {"meaning", map.at("meaning")}};
    if (any(values)) out["maps"][name] = {{"values", values}};
  }
  for (const char* member : {"lists", "unlisted", "timeline", "costs"})
    if (tiles.contains(member)) out[member] = tiles[member];
  if (tiles.contains("pixels") && level != PixelLevel::kNone)
    out["pixels"] = level == PixelLevel::kAll ? tiles["pixels"]
                                              : drawable_runs(tiles["pixels"], level == PixelLevel::kDrawables ? 1 : 2);
  if (out.contains("costs")) {
    json& costs = out["costs"];
    for (json& nj : costs.at("energy_nj")) nj = static_cast<std::int64_t>(std::llround(nj.get<double>()));
    for (const char* name : {"cycles", "energy_nj", "saves", "bound_by"})
      if (costs.contains(name)) note(std::string("cost.") + name, costs[name]);
    for (const auto& [purpose, values] : costs.at("dram").items()) note("dram." + purpose, values);
  }
  return out;
}

PageViews::PixelLevel PageViews::choose_pixels() const {
  constexpr std::size_t kSamples = 4;
  const std::size_t samples = std::min(tiles_.size(), kSamples);
  std::array<std::uint64_t, 3>
      bytes{};  // with everything; with drawables alone; with drawables of a quarter of the pixels
  for (std::size_t k = 0; k < samples; ++k) {
    const fs::path& file = tiles_[k * tiles_.size() / samples];
    const json tiles = parse_json(read_whole_text(file), file.string());
    if (!tiles.contains("pixels")) continue;
    const json& pixels = tiles["pixels"];
    try {
      bytes[0] += gzip_base64(pack_documents({pixels})).size();
      for (const std::size_t step : {1, 2})
        bytes[step] += gzip_base64(pack_documents({drawable_runs(pixels, step)})).size();
    } catch (const json::exception& error) {
      throw InputError(file.string(), "/pixels",
                       fmt::format("does not match the output of a replay: {}", error.what()));
    }
  }
  constexpr std::array kLevels = {PixelLevel::kAll, PixelLevel::kDrawables, PixelLevel::kQuarter};
  for (std::size_t level = 0; level < kLevels.size(); ++level)
    if (bytes[level] * tiles_.size() <= kPagePixelBytes * samples) return kLevels[level];
  return PixelLevel::kNone;
}

void PageViews::finish(json& data, PageElements& elements) {
  const PixelLevel level = choose_pixels();
  if (level != PixelLevel::kAll)
    data["pixel_note"] = fmt::format("To keep this file small, its pixels name {}; tiles_NNNN.json has the rest.",
                                     level == PixelLevel::kNone ? "nothing" : "drawables, not patches");
  for (std::size_t first = 0; first < tiles_.size(); first += kGroup) {
    std::vector<json> group;
    for (std::size_t k = first; k < std::min(first + kGroup, tiles_.size()); ++k) {
      try {
        group.push_back(page_tiles(tiles_[k], level));
      } catch (const json::exception& error) {
        throw InputError(tiles_[k].string(), "",
                         fmt::format("does not match the output of a replay: {}", error.what()));
      }
    }
    append_script(fmt::format("tiles-{}", first / kGroup), gzip_base64(pack_documents(group)), elements.rest);
  }
  pack_images(data, elements);
  data["maps"] = maps_;
  data["scales"] = json::object();
  for (const auto& [map, ends] : scales_) data["scales"][map] = {std::min(ends.first, ends.second), ends.second};
}

}  // namespace tessera::replay
