#include "scene/gltf/document.h"

#include <cmath>
#include <cstdint>
#include <utility>

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// What tinygltf gets to see: no buffers and images (it would fetch them), no nodes and meshes (there may be millions,
// and it parses text a second time), no extras (it walks them recursively), and whole numbers written as 4.0 as integers
// (it does not take them for such).
json structure_only(const json& whole) {
  json document = json::object();
  for (const auto& [name, value] : whole.items())
    if (name != "buffers" && name != "images" && name != "extensionsRequired" && name != "nodes" && name != "meshes")
      document[name] = value;
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
                   bool has_binary, const CaptureLimits& limits_in, MemoryBudget& budget_in)
    : json(std::move(checked)),
      resources(json, file, std::move(binary), has_binary, limits_in, budget_in),
      root(file.string()),
      limits(limits_in),
      budget(budget_in) {
  const std::string text = structure_only(json).dump();
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "")) {
    while (!error.empty() && error.back() == '\n') error.pop_back();
    root.refuse("{}", error);
  }
}

const json* find_extension(const json& object, const char* name) {
  const auto extensions = object.find("extensions");
  if (extensions == object.end()) return nullptr;
  const auto found = extensions->find(name);
  return found == extensions->end() ? nullptr : &*found;
}

}  // namespace tessera::scene::gltf
