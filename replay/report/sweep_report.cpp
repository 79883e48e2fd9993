#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "replay/report/report.h"
#include "replay/sweep/columns.h"
#include "replay/sweep/sweep_folder.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// "tile.width=16 tile.height=16, frame 3"
std::string row_label(const json& manifest, const SweepRow& row) {
  const json& point = manifest.at("points").at(row.point);
  std::string label =
      manifest.at("captures").size() > 1
          ? manifest.at("captures").at(static_cast<std::size_t>(whole_number(point.at("capture")))).get<std::string>() +
                " "
          : "";
  for (std::size_t k = 0; k < manifest.at("axes").size(); ++k) {
    const json& value = point.at("values").at(k);
    label += fmt::format("{}={} ", manifest.at("axes")[k].get<std::string>(),
                         value.is_string() ? value.get<std::string>() : value.dump());
  }
  return label + fmt::format("frame {}", whole_number(row.frame.at("frame")));
}

json row_cells(const json& columns, const SweepRow& row) {
  json cells = {row.point, row.frame.is_null() ? json(nullptr) : row.frame.at("frame"), row.status};
  const std::map<std::string, json> values =
      row.frame.is_null() ? std::map<std::string, json>{} : frame_values(row.frame);
  for (const json& column : columns) {
    const auto at = values.find(column.get<std::string>());
    cells.push_back(at == values.end() ? json(nullptr) : at->second);
  }
  return cells;
}

json sweep_views(const SweepFolder& folder, const JoinedSweep& sweep, PageViews& views) {
  json shown = json::array();
  for (const SweepRow& row : sweep.rows) {
    if (row.frame.is_null()) continue;
    const std::string hash = sweep.manifest.at("points").at(row.point).at("hash");
    const int frame = whole_number(row.frame.at("frame"));
    json view = views.add(folder.image_file(hash, frame), folder.tiles_file(hash, frame), 0, 0);
    if (view.is_null()) continue;
    view["label"] = row_label(sweep.manifest, row);
    view["point"] = row.point;
    shown.push_back(std::move(view));
  }
  return shown;
}

}  // namespace

json sweep_report(const fs::path& path, PageViews& views, std::string& note) {
  const SweepFolder folder(path);
  const JoinedSweep sweep = join_sweep(folder);
  write_tables(folder, sweep);
  if (!sweep.missing.empty())
    note = fmt::format("{} of {} points are not done yet", sweep.missing.size(), sweep.manifest.at("points").size());
  json data = sweep.manifest;
  const json& columns = sweep.manifest.at("columns");
  const std::size_t most = std::max<std::size_t>(1, kMaxSweepCells / (columns.size() + 3));
  data["rows"] = json::array();
  for (std::size_t r = 0; r < std::min(most, sweep.rows.size()); ++r)
    data["rows"].push_back(row_cells(columns, sweep.rows[r]));
  data["ranking"] = json::array();
  for (const Candidate& candidate : rank_candidates(sweep))
    data["ranking"].push_back({{"point", candidate.point}, {"meets", candidate.meets_limits()}});
  data["rows_left_out"] = sweep.rows.size() - data["rows"].size();
  data["missing"] = sweep.missing;
  json shown = sweep.manifest.at("pictures").get<bool>() ? sweep_views(folder, sweep, views) : json::array();
  const std::string title = sweep.manifest.at("title");
  return {{"title", title.empty() ? "Sweep" : title},
          {"subtitle", fmt::format("A sweep of {} points over {} {}", data.at("points").size(), data.at("axes").size(),
                                   data.at("axes").size() == 1 ? "axis" : "axes")},
          {"sweep", data},
          {"views", std::move(shown)}};
}

}  // namespace tessera::replay
