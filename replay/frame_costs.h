#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/cost_attribution.h"
#include "timing/attribution.h"

namespace tessera::replay {

struct DrawableName {
  std::string node, material;
  auto operator<=>(const DrawableName&) const = default;
};

// Names of drawables by their number: "drawables" of a record's head (gpu/record_file.h), which is not trusted.
class DrawableNames {
 public:
  explicit DrawableNames(const nlohmann::json& head);

  // `drawable`: SubPatchItem::drawable. The names are empty for 0, which stands for no drawable.
  DrawableName of(std::uint32_t drawable) const;

 private:
  static constexpr std::uint64_t kMaxTurns = 256;
  struct Row {
    std::uint64_t first, stride, count;
    DrawableName name;
  };
  std::vector<Row> rows_;
};

// Shares of drawables summed by name, the ones with most cycles first.
using NamedShares = std::vector<std::pair<DrawableName, timing::DrawableShare>>;
NamedShares sum_shares(const std::map<std::uint32_t, timing::DrawableShare>& shares, const DrawableNames& names,
                       bool by_node);
// One object per row: {"node" (by_node), "material", "invocations", "tests", "requested_lines", "dram_bytes", "cycles",
// "energy_nj"}.
nlohmann::json share_rows(const NamedShares& shares, bool by_node);

// Costs of a frame's drawables, materials and tiles, for the folder of a replay.
//
//   stats.json       "drawables", "materials": share_rows(): the kMaxRows with most cycles, then one row for all others,
//                    whose names are kOthers. Work that no drawable asked for has the names "".
//   tiles_NNNN.json  "costs": {"cycles": [...], "energy_nj": [...], "dram": {purpose: [...]}, "bound_by": [...], "saves":
//                    [...]}: tile by tile; bound_by holds indices into "bounds", or -1 for a tile that nothing bounds;
//                    "bounds", "bound_by" and "saves" are missing where bounds are not known (gpu::CostAttribution).
//                    "lists": tile by tile [row, sub-patches, invocations, row, ...], `row` of the frame's "drawables"; at
//                    most kMaxInList drawables, the ones with most invocations first; "unlisted": number of the others.
class FrameCosts {
 public:
  static constexpr std::size_t kMaxRows = 256, kMaxInList = 32;
  static constexpr const char* kOthers = "(others)";

  FrameCosts(const gpu::CostAttribution& shares, const DrawableNames& names);

  const nlohmann::json& drawables() const { return drawables_; }
  const nlohmann::json& materials() const { return materials_; }
  // Members of tiles_NNNN.json, one line each.
  std::string tile_members() const;
  // Row of drawables() that holds a drawable; none where it has no share of the frame. `drawable`: its number in
  // scene::Assembly, plus one.
  std::optional<std::size_t> row_of(std::uint32_t drawable) const;

 private:
  std::string list_members() const;

  const gpu::CostAttribution& shares_;
  nlohmann::json drawables_, materials_;
  std::map<std::uint32_t, std::size_t> rows_;  // number of a drawable -> row of drawables_
};

}  // namespace tessera::replay
