#include <fstream>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "replay/frame_files.h"
#include "replay/report/report.h"
#include "replay/tile_map_files.h"

namespace tessera::replay {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

// The statistics of a replay, with no more than kMaxFrames of its frames: memory does not grow with them.
struct ReplayStatistics {
  json stats;
  std::vector<int> numbers;  // of all frames
  std::size_t stride = 1;    // frames 0, stride, 2 stride, ... are in `stats`
};

// A power of two, known when all frames have been seen: what was kept before it grew is thinned out in the end.
ReplayStatistics read_statistics(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string(), "", "cannot be opened");
  ReplayStatistics out;
  std::vector<std::size_t> kept;
  bool sound = true;
  out.stats = parse_json_array(stream, file.string(), "frames", [&](const json& frame) {
    const std::size_t index = out.numbers.size();
    const auto number = frame.find("frame");
    sound = sound && number != frame.end() && number->is_number_integer();
    out.numbers.push_back(sound ? whole_number(*number) : 0);
    while (index >= kMaxFrames * out.stride) out.stride *= 2;
    if (index % out.stride != 0) return false;
    kept.push_back(index);
    return true;
  });
  if (out.stats.value("schema", "") != "tessera.stats/1")
    throw InputError(file.string(), "/schema", "is not tessera.stats/1");
  json& frames = out.stats.at("frames");
  if (!frames.is_array() || frames.empty()) throw InputError(file.string(), "/frames", "holds no frame");
  if (!sound || frames.size() != kept.size()) throw InputError(file.string(), "/frames", "holds what is no frame");
  json thinned = json::array();
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (kept[k] % out.stride == 0) thinned.push_back(std::move(frames.at(k)));
  frames = std::move(thinned);
  return out;
}

}  // namespace

json replay_report(const fs::path& folder, std::string&) {
  const ReplayStatistics statistics = read_statistics(folder / "stats.json");
  const json& stats = statistics.stats;
  const std::vector<int>& numbers = statistics.numbers;
  const json& region = stats.at("settings").at("region");
  json views = json::array();
  std::size_t bytes = 0, left_out = 0;
  const std::size_t stride =
      (image_stride(numbers.size()) + statistics.stride - 1) / statistics.stride * statistics.stride;
  for (std::size_t f = 0; f < numbers.size(); ++f) {
    const int number = numbers[f];
    const fs::path image = folder / (frame_name(number) + ".png");
    std::error_code missing;
    const std::uintmax_t size = fs::file_size(image, missing);
    if (missing) continue;
    if (f % stride != 0 || bytes + size > kMaxImageBytes) {
      ++left_out;
      continue;
    }
    json view = image_view(fmt::format("frame {}", number), image, folder / tile_maps_name(number),
                           whole_number(region.at(0)), whole_number(region.at(1)));
    if (view.is_null()) continue;
    bytes += size;
    view["frame"] = number;
    views.push_back(std::move(view));
  }
  const std::string capture = stats.at("capture").at("file");
  return {{"title", capture + ": replay"},
          {"subtitle",
           fmt::format("{}x{}, {} frame{}{}, machine '{}'", whole_number(stats.at("settings").at("width")),
                       whole_number(stats.at("settings").at("height")), numbers.size(), numbers.size() == 1 ? "" : "s",
                       statistics.stride == 1 ? "" : fmt::format(" (every {}th shown)", statistics.stride),
                       stats.at("gpu").at("preset").get<std::string>())},
          {"stats", stats},
          {"views", std::move(views)},
          {"left_out", left_out}};
}

}  // namespace tessera::replay
