#include "scene/gltf/document.h"

#include <cmath>
#include <cstdint>
#include <utility>

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// The part of a document that tinygltf parses: no buffers and images (it would fetch them), no nodes and meshes (there
// may be millions, and it parses a text a second time), no bounds of accessors, strides and targets of views (it
// refuses some), no extras (it walks them recursively), and whole numbers written as 4.0 converted to integers (it does
// not recognize them).
json structure_only(const json& whole) {
  json document = json::object();
  for (const auto& [name, value] : whole.items())
    if (name != "buffers" && name != "images" && name != "extensionsRequired" && name != "nodes" && name != "meshes")
      document[name] = value;
  if (const auto accessors = document.find("accessors"); accessors != document.end())
    for (json& accessor : *accessors) accessor.erase("min"), accessor.erase("max");
  if (const auto views = document.find("bufferViews"); views != document.end())
    for (json& view : *views) view.erase("byteStride"), view.erase("target");
  if (const json::json_pointer lights("/extensions/KHR_lights_punctual/lights"); document.contains(lights))
    for (json& light : document[lights])
      if (light["type"] == "spot" && !light.contains("spot")) light["spot"] = json::object();
  const auto simplify = [](auto& self, json& value) -> void {
    constexpr double kExact = 9007199254740992.0;
    if (value.is_number_float())
      if (const double v = value.get<double>(); std::abs(v) <= kExact && v == std::floor(v))
        value = static_cast<std::int64_t>(v);
    if (value.is_object()) value.erase("extras");
    if (value.is_structured())
      for (json& inner : value) self(self, inner);
  };
  simplify(simplify, document);
  return document;
}

}  // namespace

Document::Document(nlohmann::json checked, const std::filesystem::path& file, std::vector<std::uint8_t> binary,
                   bool has_binary, const CaptureLimits& limits_in, MemoryBudget& budget_in, Notes notes_in)
    : json(std::move(checked)),
      notes(std::move(notes_in)),
      resources(json, file, std::move(binary), has_binary, limits_in, budget_in, notes),
      root(file.string()),
      limits(limits_in),
      budget(budget_in) {
  const std::size_t accessors = list_of(json, "accessors").size();
  budget.charge(accessors, sizeof(AccessorLayout), "/accessors");
  layouts.reserve(accessors);
  for (std::size_t a = 0; a < accessors; ++a) layouts.push_back(accessor_layout(json, a));
  const std::string text = structure_only(json).dump();
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "")) {
    while (!error.empty() && error.back() == '\n') error.pop_back();
    root.refuse("{}", error);
  }
}

}  // namespace tessera::scene::gltf
