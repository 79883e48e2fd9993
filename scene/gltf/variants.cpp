#include "scene/gltf/variants.h"

#include <algorithm>
#include <cstddef>
#include <map>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"
#include "scene/capture.h"
#include "scene/gltf/validation_parts.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// A primitive's mappings, or null.
const json* mappings_of(const json& primitive) {
  const json* variants = find_extension(primitive, kVariants);
  return variants == nullptr ? nullptr : &(*variants)["mappings"];
}

void check_mappings(const json& mappings, const Place& place, Notes& notes) {
  std::map<std::size_t, std::size_t> material_of;  // by variant
  for (std::size_t m = 0; m < mappings.size(); ++m) {
    const auto material = mappings[m]["material"].get<std::size_t>();
    const json& variants = mappings[m]["variants"];
    for (std::size_t v = 0; v < variants.size(); ++v) {
      const auto [found, fresh] = material_of.try_emplace(variants[v].get<std::size_t>(), material);
      if (fresh) continue;
      const Place at = place.at(m).at("variants").at(v);
      if (found->second != material)
        at.refuse("gives variant {} material {}, a mapping before gives it material {}", found->first, material,
                  found->second);
      notes.violation(at, "they agree", "is variant {}, which has a mapping already", found->first);
    }
  }
}

// Names for people; a file may have any number.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMaxListed = 20;
  std::vector<std::string> parts;
  for (std::size_t v = 0; v < std::min(names.size(), kMaxListed); ++v)
    parts.push_back(fmt::format("'{}'", escape_control(names[v], 60)));
  const std::string rest = names.size() > kMaxListed ? fmt::format(" and {} more", names.size() - kMaxListed) : "";
  return fmt::format("{}{}", fmt::join(parts, ", "), rest);
}

}  // namespace

std::vector<std::string> variant_names(const json& document) {
  std::vector<std::string> names;
  if (const json* variants = find_extension(document, kVariants))
    for (const json& variant : (*variants)["variants"]) names.push_back(variant["name"].get<std::string>());
  return names;
}

void check_variants(const json& document, const Place& root, Notes& notes) {
  const std::vector<std::string> names = variant_names(document);
  std::map<std::string, std::size_t> first_of;
  for (std::size_t v = 0; v < names.size(); ++v) {
    const auto [found, fresh] = first_of.try_emplace(names[v], v);
    if (!fresh)
      notes.add(root.at("extensions").at(kVariants).at("variants").at(v), "the name chooses the first",
                fmt::format("is called '{}', as variant {} is", escape_control(names[v], 60), found->second));
  }
  const json& meshes = list_of(document, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const json& primitives = meshes[m]["primitives"];
    for (std::size_t p = 0; p < primitives.size(); ++p)
      if (const json* mappings = mappings_of(primitives[p]))
        check_mappings(*mappings,
                       root.at("meshes").at(m).at("primitives").at(p).at("extensions").at(kVariants).at("mappings"),
                       notes);
  }
}

int choose_variant(json& document, const std::optional<std::string>& name, const Place& root) {
  if (!name) return kNone;
  const std::vector<std::string> names = variant_names(document);
  const auto found = std::find(names.begin(), names.end(), *name);
  if (found == names.end())
    throw UsageError(fmt::format("no variant '{}' in {}, which has {}", escape_control(*name, 80),
                                 escape_control(root.file()), names.empty() ? "none" : listed(names)));
  const auto variant = static_cast<std::size_t>(found - names.begin());
  if (const auto meshes = document.find("meshes"); meshes != document.end())
    for (json& mesh : *meshes)
      for (json& primitive : mesh["primitives"]) {
        const json* mappings = mappings_of(primitive);
        if (mappings == nullptr) continue;
        const auto mapping = std::find_if(mappings->begin(), mappings->end(), [&](const json& m) {
          const json& of = m["variants"];
          return std::any_of(of.begin(), of.end(), [&](const json& v) { return v.get<std::size_t>() == variant; });
        });
        if (mapping != mappings->end()) primitive["material"] = json((*mapping)["material"]);
      }
  return static_cast<int>(variant);
}

}  // namespace tessera::scene::gltf
