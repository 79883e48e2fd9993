#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/color.h"
#include "base/error.h"
#include "base/exr_file.h"
#include "base/image_codec.h"
#include "base/image_metrics.h"
#include "base/json_text.h"
#include "base/output_file.h"
#include "base/whole_file.h"
#include "replay/commands.h"
#include "replay/progress.h"
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

json compare_images(const fs::path& a, const fs::path& b, const std::string& map_file, const std::string& mask_file) {
  const Image first = read_display(a), second = read_display(b);
  check_same_size(second, b, first, a);
  std::optional<Image> mask;
  if (!mask_file.empty()) check_same_size(mask.emplace(read_mask(mask_file)), mask_file, first, a);
  const Image* const covered = mask ? &*mask : nullptr;
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

// Counters of all frames together, by name.
json read_total_counters(const fs::path& folder) {
  const std::string file = (folder / "stats.json").string();
  const json stats = parse_json(read_whole_text(file), file);
  if (!stats.is_object() || stats.value("schema", json()) != "tessera.stats/1")
    throw InputError(file, "/schema", "is not tessera.stats/1");
  static const json::json_pointer kCounters("/total/counters");
  if (!stats.contains(kCounters) || !stats[kCounters].is_object())
    throw InputError(file, kCounters.to_string(), "is not an object of counters");
  return stats[kCounters];
}

json compare_folders(const fs::path& a, const fs::path& b) {
  json out = {{"frames", json::array()}, {"counters", json::array()}};
  std::set<fs::path> names;
  for (const auto& entry : fs::directory_iterator(a))
    if (entry.path().extension() == ".png" && entry.path().filename().string().starts_with("frame_"))
      names.insert(entry.path().filename());
  for (const fs::path& name : names) {
    if (!fs::exists(b / name)) continue;
    json row = compare_images(a / name, b / name, "", "");
    row["frame"] = name.stem().string();
    out["frames"].push_back(row);
  }
  if (out["frames"].empty())
    throw InputError(b.string(), "", fmt::format("has no frame in common with {}", a.string()));
  const json first = read_total_counters(a), second = read_total_counters(b);
  std::set<std::string> counters;
  for (const json* side : {&first, &second})
    for (const auto& [name, value] : side->items()) counters.insert(name);
  for (const std::string& name : counters)
    out["counters"].push_back({{"name", name}, {"a", first.value(name, json())}, {"b", second.value(name, json())}});
  return out;
}

std::string decibel(const json& value) {
  return value.is_null() ? "identical" : fmt::format("{:.2f} dB", value.get<double>());
}

void print_images(const std::string& label, const json& row) {
  fmt::print("{:<14} {:>12} {:>10.5f} {:>10.5f} {:>10.5f}\n", label, decibel(row["psnr_db"]), row["ssim"].get<double>(),
             row["flip"].get<double>(), row["max_difference"].get<double>());
}

void print_folders(const json& report) {
  for (const json& row : report["frames"]) print_images(row["frame"].get<std::string>(), row);
  fmt::print("\n{:<36} {:>16} {:>16} {:>8}\n", "counter", "A", "B", "B/A");
  for (const json& row : report["counters"]) {
    const auto text = [](const json& v) { return v.is_null() ? std::string("-") : v.dump(); };
    std::string ratio = "-";
    if (row["a"].is_number() && row["b"].is_number() && row["a"].get<double>() > 0)
      ratio = fmt::format("{:.3f}", row["b"].get<double>() / row["a"].get<double>());
    fmt::print("{:<36} {:>16} {:>16} {:>8}\n", row["name"].get<std::string>(), text(row["a"]), text(row["b"]), ratio);
  }
}

class CompareCommand final : public Command {
 public:
  explicit CompareCommand(CLI::App& app) {
    app.add_option("A", a_, "The reference: an image (.png, .jpg, .exr) or the folder of a replay")
        ->required()
        ->type_name("A");
    app.add_option("B", b_, "What is compared with it")->required()->type_name("B");
    app.add_flag("--json", json_, "As JSON");
    app.add_option("--flip-map", map_, "Write the FLIP error of two images as a heat map")->type_name("FILE.png");
    app.add_option("--mask", mask_,
                   "Measure only the pixels of two images that this one covers: those with an alpha above 0, without "
                   "alpha those that are not black")
        ->type_name("FILE");
    app.footer(
        "PSNR, mean SSIM and mean FLIP of what a display shows (EXR files are tone mapped first); max is the largest "
        "difference of any channel in [0, 1].\n"
        "FLIP assumes 67 pixels per degree of visual angle.");
  }
  void run() override {
    const bool folders = fs::is_directory(a_);
    if (folders != fs::is_directory(b_)) throw UsageError("compare: give two images or two folders");
    if (folders && !map_.empty()) throw UsageError("--flip-map: is for two images");
    if (folders && !mask_.empty()) throw UsageError("--mask: is for two images");
    if (!map_.empty()) check_output_file(map_);
    if (beside_outputs({map_}) != stdout) throw UsageError("--flip-map: standard output is for the figures");
    json report;
    {
      const LongStep step("comparing", LongStep::quiet_without_terminal());
      report = folders ? compare_folders(a_, b_) : compare_images(a_, b_, map_, mask_);
    }
    if (json_) {
      fmt::print("{}\n", json_text(report, 2));
      return;
    }
    fmt::print("{:<14} {:>12} {:>10} {:>10} {:>10}\n", "", "PSNR", "SSIM", "FLIP", "max");
    if (folders)
      print_folders(report);
    else
      print_images("pictures", report);
  }

 private:
  std::string a_, b_, map_, mask_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> make_compare_command(CLI::App& app) { return std::make_unique<CompareCommand>(app); }

}  // namespace tessera::replay
