#include "replay/compare/image_comparison.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/color.h"
#include "base/error.h"
#include "base/exr_file.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "base/output_file.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "replay/file_kind.h"
#include "replay/frame_files.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

DecodedImage read_image(const fs::path& file) {
  DecodedImage decoded;
  std::string fault;
  if (!decode_image(read_whole_file(file, 1ull << 30, file.string()), {}, decoded, fault))
    throw InputError(file.string(), "", fault);
  return decoded;
}

// An image as it looks on a display: sRGB values in [0, 1], three channels. EXR files are tone mapped.
Image read_display(const fs::path& file) {
  if (file.extension() == ".exr") {
    const Image8 shown = shaders::to_display(read_exr(file), 1.0f);
    Image out(shown.width, shown.height, 3);
    std::transform(shown.values.begin(), shown.values.end(), out.values.begin(),
                   [](std::uint8_t v) { return static_cast<float>(v) / 255.0f; });
    return out;
  }
  const DecodedImage decoded = read_image(file);
  Image out(decoded.width(), decoded.height(), 3);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c)
        out.at(x, y)[static_cast<std::size_t>(c)] = decoded.unorm(x, y, decoded.channels() >= 3 ? c : 0);
  return out;
}

// FLIP error as an image: black through red and yellow to white.
Image8 heat_map(const Image& flip) {
  Image8 out(flip.width, flip.height, 3);
  for (std::size_t i = 0; i < flip.values.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      out.values[3 * i + c] = to_unorm8(std::clamp(3.0f * flip.values[i] - static_cast<float>(c), 0.0f, 1.0f));
  return out;
}

void check_same_size(const Image& image, const fs::path& file, const Image& first, const fs::path& a) {
  if (image.width != first.width || image.height != first.height)
    throw InputError(
        file.string(), "",
        fmt::format("is {}x{} pixels, {} is {}x{}", image.width, image.height, a.string(), first.width, first.height));
}

// 1 where a mask covers a pixel: where its alpha, or of an image without alpha any channel, is above 0.
Image read_mask(const fs::path& file) {
  const DecodedImage decoded = read_image(file);
  const int channels = decoded.channels();
  const bool has_alpha = channels == 2 || channels == 4;
  Image out(decoded.width(), decoded.height(), 1);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = has_alpha ? channels - 1 : 0; c < channels; ++c)
        if (decoded.unorm(x, y, c) > 0) out.at(x, y)[0] = 1;
  if (std::all_of(out.values.begin(), out.values.end(), [](float v) { return v == 0; }))
    throw InputError(file.string(), "", "covers no pixel");
  return out;
}

json measure(const Image& first, const Image& second, const Image* covered, const std::string& map_file) {
  const Image flip = flip_map(first, second);
  if (!map_file.empty()) {
    OutputFile file(map_file);
    file.write(encode_png(heat_map(flip)));
    file.commit();
  }
  const double p = psnr(first, second, covered);
  json row = {{"ssim", mssim(first, second, covered)},
              {"flip", mean_value(flip, covered)},
              {"max_difference", max_difference(first, second, covered)}};
  row["psnr_db"] = std::isinf(p) ? json() : json(p);  // null: identical
  return row;
}

std::string decibel(const json& value) {
  return value.is_null() ? "identical" : fmt::format("{:.2f} dB", value.get<double>());
}

}  // namespace

json compare_images(const fs::path& a, const fs::path& b, const std::string& map_file, const std::string& mask_file) {
  const auto display = [](const fs::path& file) {
    return read_as(FileKind::kImage, file, [&] { return read_display(file); });
  };
  const Image first = display(a), second = display(b);
  check_same_size(second, b, first, a);
  std::optional<Image> mask;
  if (!mask_file.empty()) check_same_size(mask.emplace(read_mask(mask_file)), mask_file, first, a);
  return measure(first, second, mask ? &*mask : nullptr, map_file);
}

json compare_frames(const fs::path& a, const fs::path& b, const std::string& label, const std::vector<int>& frames,
                    std::vector<std::string>& notes) {
  json rows = json::array();
  for (const int frame : frames) {
    const std::string name = frame_name(frame) + ".png";
    std::error_code ignored;
    if (!fs::exists(a / name, ignored) || !fs::exists(b / name, ignored)) continue;
    const Image first = read_display(a / name), second = read_display(b / name);
    if (first.width != second.width || first.height != second.height) {
      notes.push_back(fmt::format("images are not compared: A has {}x{} pixels, {} {}x{}", first.width, first.height,
                                  label, second.width, second.height));
      return json::array();
    }
    json row = measure(first, second, nullptr, "");
    row["frame"] = frame_name(frame);
    row["run"] = label;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string images_head() {
  return fmt::format("{:<14} {:>12} {:>10} {:>10} {:>10}\n", "", "PSNR", "SSIM", "FLIP", "max");
}

std::string images_line(const std::string& label, const json& row) {
  return fmt::format("{:<14} {:>12} {:>10.5f} {:>10.5f} {:>10.5f}\n", label, decibel(row["psnr_db"]),
                     row["ssim"].get<double>(), row["flip"].get<double>(), row["max_difference"].get<double>());
}

std::vector<std::string> broken_by_image(const std::string& label, const json& row,
                                         const std::vector<Threshold>& thresholds) {
  std::vector<std::string> broken;
  for (const Threshold& threshold : thresholds) {
    const bool least = threshold.metric == "psnr" || threshold.metric == "ssim";
    const json& value = row[threshold.metric == "psnr"  ? "psnr_db"
                            : threshold.metric == "max" ? "max_difference"
                                                        : threshold.metric];
    if (value.is_null()) continue;  // identical
    if (least ? value.get<double>() < threshold.limit : value.get<double>() > threshold.limit)
      broken.push_back(fmt::format("{}: {} {:.5g}, at {} {:g} is allowed", label, threshold.metric, value.get<double>(),
                                   least ? "least" : "most", threshold.limit));
  }
  return broken;
}

}  // namespace tessera::replay
