#include "scene/gltf/document.h"

#include <utility>

namespace tessera::scene::gltf {
Document::Document(nlohmann::json checked, const std::filesystem::path& file, std::vector<std::uint8_t> binary,
                   bool has_binary, const CaptureLimits& limits_in, MemoryBudget& budget_in, Notes notes_in)
    : json(std::move(checked)),
      notes(std::move(notes_in)),
      resources(json, file, std::move(binary), has_binary, limits_in, budget_in, notes),
      root(file.string()),
      limits(limits_in),
      budget(budget_in) {
  if (const auto accessors = json.find("accessors"); accessors != json.end()) {
    budget.charge(accessors->size(), sizeof(AccessorLayout), "/accessors");
    layouts.reserve(accessors->size());
    for (std::size_t a = 0; a < accessors->size(); ++a) layouts.push_back(accessor_layout(json, a));
  }
}

}  // namespace tessera::scene::gltf
