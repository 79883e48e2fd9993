#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

struct DrawableName {
  std::string node, material;
  auto operator<=>(const DrawableName&) const = default;
};

// Names of drawables by their number: "drawables" of a record's head (gpu/record_file.h), which may say anything.
class DrawableNames {
 public:
  explicit DrawableNames(const nlohmann::json& head);

  // `drawable`: SubPatchItem::drawable. Empty words for 0, which is none.
  DrawableName of(std::uint32_t drawable) const;

 private:
  static constexpr std::uint64_t kMaxTurns = 256;
  struct Row {
    std::uint64_t first, stride, count;
    DrawableName name;
  };
  std::vector<Row> rows_;
};

}  // namespace tessera::replay
