#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/frame_files.h"
#include "replay/report/report.h"
#include "replay/tile_map_files.h"

namespace tessera::replay {

using nlohmann::json;
namespace fs = std::filesystem;

json replay_report(const fs::path& folder, std::string&) {
  const fs::path file = folder / "stats.json";
  const json stats = parse_json(read_whole_text(file), file.string());
  if (stats.value("schema", "") != "tessera.stats/1")
    throw InputError(file.string(), "/schema", "is not tessera.stats/1");
  const json& frames = stats.at("frames");
  if (!frames.is_array() || frames.empty()) throw InputError(file.string(), "/frames", "holds no frame");
  const json& region = stats.at("settings").at("region");
  json views = json::array();
  std::size_t bytes = 0, left_out = 0;
  const std::size_t stride = image_stride(frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const int number = whole_number(frames[f].at("frame"));
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
          {"subtitle", fmt::format("{}x{}, {} frame{}, machine '{}'", whole_number(stats.at("settings").at("width")),
                                   whole_number(stats.at("settings").at("height")), frames.size(),
                                   frames.size() == 1 ? "" : "s", stats.at("gpu").at("preset").get<std::string>())},
          {"stats", stats},
          {"views", views},
          {"left_out", left_out}};
}

}  // namespace tessera::replay
