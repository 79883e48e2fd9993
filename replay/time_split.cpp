#include "replay/time_split.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "replay/frame_costs.h"
#include "timing/attribution.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

json tile_rows(const hardware::Machine& gpu, const timing::FrameWork& work, const gpu::ViewCost& cost,
               const timing::WarmCaches& before) {
  json rows = json::array();
  for (const timing::TileShare& tile : timing::attribute_tiles(gpu, work, cost.schedule, before))
    rows.push_back({{"tile", tile.tile},
                    {"cycles", tile.cycles},
                    {"dram_bytes", tile.dram_bytes},
                    {"energy_nj", tile.energy_nj},
                    {"bound_by", tile.bound_by ? std::string(name(*tile.bound_by)) : ""},
                    {"bound_by_cycles", tile.bound_cycles}});
  return rows;
}

constexpr std::array<std::string_view, 3> kSplitNames = {"drawables", "materials", "tiles"};

}  // namespace

std::string_view name(Split split) { return kSplitNames[static_cast<std::size_t>(split)]; }

Split parse_split(const std::string& option, const std::string& word) {
  const auto at = std::find(kSplitNames.begin(), kSplitNames.end(), word);
  if (at == kSplitNames.end())
    throw UsageError(fmt::format("{}: '{}' is none of drawables, materials, tiles", option, escape_control(word, 80)));
  return static_cast<Split>(at - kSplitNames.begin());
}

std::span<const std::string_view> split_columns() {
  static constexpr std::array<std::string_view, 11> kColumns = {
      "node",       "material", "tile",      "invocations", "tests",          "requested_lines",
      "dram_bytes", "cycles",   "energy_nj", "bound_by",    "bound_by_cycles"};
  return kColumns;
}

json split_rows(Split split, const json& head, const hardware::Machine& gpu, const timing::FrameWork& work,
                const gpu::ViewCost& cost, const timing::WarmCaches& before) {
  if (split == Split::kTiles) return tile_rows(gpu, work, cost, before);
  if (!timing::has_items(work)) throw UsageError("--split: the record has no items; replay again with --record");
  const DrawableNames names(head);
  const bool by_node = split == Split::kDrawables;
  return share_rows(sum_shares(timing::attribute(gpu, work, cost.timing, cost.energy), names, by_node), by_node);
}

void print_split(std::FILE* out, Split split, const json& rows, double cycles) {
  constexpr std::size_t kShown = 20;
  std::vector<json> shown(rows.begin(), rows.end());
  std::stable_sort(shown.begin(), shown.end(), [](const json& a, const json& b) { return a["cycles"] > b["cycles"]; });
  if (shown.size() > kShown) shown.resize(kShown);
  if (split == Split::kTiles)
    fmt::print(out, "\n{:>8} {:>14} {:>12} {:>12}  {:<14} {:>12}\n", "tile", "cycles", "DRAM bytes", "energy mJ",
               "bound by", "saves");
  else
    fmt::print(out, "\n{:<24} {:<24} {:>12} {:>12} {:>12} {:>12} {:>7} {:>10}\n",
               split == Split::kDrawables ? "node" : "", "material", "invocations", "tests", "lines", "DRAM bytes",
               "cycles", "energy mJ");
  for (const json& row : shown) {
    const double share = cycles > 0 ? 100 * row["cycles"].get<double>() / cycles : 0;
    const double mj = row["energy_nj"].get<double>() * 1e-6;
    if (split == Split::kTiles) {
      fmt::print(out, "{:>8} {:>14.0f} {:>12} {:>12.5f}  {:<14} {:>12.0f}\n", row["tile"].get<std::uint32_t>(),
                 row["cycles"].get<double>(), row["dram_bytes"].get<std::uint64_t>(), mj,
                 row["bound_by"].get<std::string>(), row["bound_by_cycles"].get<double>());
      continue;
    }
    const bool none = row.value("material", "").empty() && row.value("node", "").empty();
    fmt::print(out, "{:<24.24} {:<24.24} {:>12} {:>12} {:>12} {:>12} {:>5.1f} % {:>10.4f}\n",
               none ? "(of none)" : row.value("node", ""), row["material"].get<std::string>(),
               row["invocations"].get<std::uint64_t>(), row["tests"].get<std::uint64_t>(),
               row["requested_lines"].get<std::uint64_t>(), row["dram_bytes"].get<std::uint64_t>(), share, mj);
  }
  if (rows.size() > kShown) fmt::print(out, "... {} more (--json)\n", rows.size() - kShown);
}

}  // namespace tessera::replay
