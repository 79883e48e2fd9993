#include "replay/drawable_names.h"

#include <algorithm>

#include <fmt/format.h>

namespace tessera::replay {

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
