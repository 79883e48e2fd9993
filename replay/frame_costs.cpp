#include "replay/frame_costs.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "memory/ledger.h"
#include "timing/bound.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using timing::DrawableShare;

// The first kMaxRows, and the sum of all others.
NamedShares with_others(NamedShares shares) {
  if (shares.size() <= FrameCosts::kMaxRows) return shares;
  DrawableShare others;
  for (std::size_t k = FrameCosts::kMaxRows; k < shares.size(); ++k) others += shares[k].second;
  shares.resize(FrameCosts::kMaxRows);
  shares.push_back({{FrameCosts::kOthers, FrameCosts::kOthers}, others});
  return shares;
}

template <class Of>
std::string list(std::size_t count, const Of& of) {
  std::string text = "[";
  for (std::size_t k = 0; k < count; ++k) text += fmt::format("{}{}", k == 0 ? "" : ",", of(k));
  return text + "]";
}

std::string whole(const std::vector<timing::TileShare>& tiles, double timing::TileShare::*member) {
  return list(tiles.size(), [&](std::size_t t) { return static_cast<std::uint64_t>(std::ceil(tiles[t].*member)); });
}

std::string bound_members(const std::vector<timing::TileShare>& tiles, bool estimated) {
  const std::string names = list(
      timing::kBoundCount, [](std::size_t b) { return fmt::format("\"{}\"", name(static_cast<timing::Bound>(b))); });
  const std::string by = list(tiles.size(), [&](std::size_t t) {
    return tiles[t].bound_by ? static_cast<int>(index(*tiles[t].bound_by)) : -1;
  });
  return fmt::format("  \"bounds\": {},\n  \"bound_by\": {},\n  \"estimated\": {},\n  \"saves\": {},\n", names, by,
                     estimated, whole(tiles, &timing::TileShare::bound_cycles));
}

}  // namespace

NamedShares sum_shares(const std::map<std::uint32_t, DrawableShare>& shares, const DrawableNames& names, bool by_node) {
  std::map<DrawableName, DrawableShare> sums;
  for (const auto& [drawable, share] : shares) {
    DrawableName name = names.of(drawable);
    if (!by_node) name.node.clear();
    sums[name] += share;
  }
  NamedShares sorted(sums.begin(), sums.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second.cycles > b.second.cycles; });
  return sorted;
}

json share_rows(const NamedShares& shares, bool by_node) {
  json rows = json::array();
  for (const auto& [name, share] : shares) {
    json row;
    for_each_part(share, share, [&](const char* part, const auto& value, const auto&) { row[part] = value; });
    if (by_node) row["node"] = name.node;
    row["material"] = name.material;
    rows.push_back(std::move(row));
  }
  return rows;
}

FrameCosts::FrameCosts(const gpu::CostAttribution& shares, const DrawableNames& names) : shares_(shares) {
  const NamedShares by_node = sum_shares(shares.drawables, names, true);
  std::map<DrawableName, std::size_t> row_of;
  for (std::size_t row = 0; row < by_node.size(); ++row) row_of[by_node[row].first] = std::min(row, kMaxRows);
  for (const auto& [drawable, share] : shares.drawables) rows_[drawable] = row_of.at(names.of(drawable));
  drawables_ = share_rows(with_others(by_node), true);
  materials_ = share_rows(with_others(sum_shares(shares.drawables, names, false)), false);
}

std::optional<std::size_t> FrameCosts::row_of(std::uint32_t drawable) const {
  const auto found = rows_.find(drawable);
  return found == rows_.end() ? std::nullopt : std::optional(found->second);
}

std::string FrameCosts::tile_members() const {
  const std::size_t tiles = shares_.traffic.size();
  std::vector<timing::TileShare> by_number(tiles);
  for (const timing::TileShare& tile : shares_.tiles) by_number[tile.tile] = tile;
  std::string text = fmt::format(" \"costs\": {{\n  \"cycles\": {},\n", whole(by_number, &timing::TileShare::cycles));
  text += fmt::format("  \"energy_nj\": {},\n",
                      list(tiles, [&](std::size_t t) { return fmt::format("{:.1f}", by_number[t].energy_nj); }));
  if (shares_.bounds != timing::TileBounds::kNone)
    text += bound_members(by_number, shares_.bounds == timing::TileBounds::kEstimated);
  text += "  \"dram\": {";
  const char* between = "\n";
  for (std::size_t p = 0; p < memory::kPurposeCount; ++p) {
    const auto bytes = [&](std::size_t t) {
      return shares_.traffic[t][p].read_bytes + shares_.traffic[t][p].written_bytes;
    };
    bool any = false;
    for (std::size_t t = 0; t < tiles; ++t) any = any || bytes(t) > 0;
    if (any)
      text += fmt::format("{}   \"{}\": {}", std::exchange(between, ",\n"), name(static_cast<memory::Purpose>(p)),
                          list(tiles, bytes));
  }
  return text + "}},\n" + list_members();
}

std::string FrameCosts::list_members() const {
  const std::size_t tiles = shares_.lists.size();
  std::string text = " \"lists\": ";
  std::vector<std::size_t> unlisted(tiles);
  text += list(tiles, [&](std::size_t t) {
    std::map<std::size_t, std::pair<std::uint64_t, std::uint64_t>> sums;  // by row: invocations, sub-patches
    for (const gpu::DrawableInTile& drawn : shares_.lists[t]) {
      auto& [invocations, sub_patches] = sums[rows_.at(drawn.drawable)];
      invocations += drawn.invocations, sub_patches += drawn.sub_patches;
    }
    std::vector<std::pair<std::size_t, std::pair<std::uint64_t, std::uint64_t>>> sorted(sums.begin(), sums.end());
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    unlisted[t] = sorted.size() - std::min(sorted.size(), kMaxInList);
    return list(std::min(sorted.size(), kMaxInList), [&](std::size_t k) {
      return fmt::format("{},{},{}", sorted[k].first, sorted[k].second.second, sorted[k].second.first);
    });
  });
  return text + fmt::format(",\n \"unlisted\": {},\n", list(tiles, [&](std::size_t t) { return unlisted[t]; }));
}

using nlohmann::json;

DrawableNames::DrawableNames(const json& head) {
  const json rows = head.value("drawables", json::array());
  if (!rows.is_array()) return;
  for (const json& row : rows) {
    if (!row.is_object()) continue;
    const auto number = [&](const char* key) {
      const auto found = row.find(key);
      return found != row.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
    };
    const auto word = [&](const char* key) {
      const auto found = row.find(key);
      return found != row.end() && found->is_string() ? found->get<std::string>() : std::string();
    };
    rows_.push_back({number("first"),
                     std::max<std::uint64_t>(number("stride"), 1),
                     number("count"),
                     {word("node"), word("material")}});
  }
  std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) { return a.first < b.first; });
}

DrawableName DrawableNames::of(std::uint32_t drawable) const {
  if (drawable == 0) return {};
  const std::uint64_t number = drawable - 1;
  // Primitives of an instanced node take turns: the row is one of the last `stride` that begin before.
  auto row =
      std::upper_bound(rows_.begin(), rows_.end(), number, [](std::uint64_t d, const Row& r) { return d < r.first; });
  for (std::uint64_t back = 0; row != rows_.begin() && back < kMaxTurns; ++back) {
    --row;
    if ((number - row->first) % row->stride == 0 && (number - row->first) / row->stride < row->count) return row->name;
  }
  return {fmt::format("drawable {}", number), ""};
}

}  // namespace tessera::replay
