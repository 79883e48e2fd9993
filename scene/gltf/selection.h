#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"
#include "scene/view_choices.h"

namespace tessera::scene::gltf {

// A Selection resolved in a document. Members are kNone or unset where the selection does not say.
struct Selected {
  int scene = kNone;
  int camera_node = kNone;
  // The played animations, in this order; "all" leaves it unset: scene_builder.cpp chooses.
  std::optional<std::vector<int>> animations;
  bool all_animations = false;
};

// Resolves a selection in a document that passed validate_links(). Throws UsageError, which lists the choices, for
// names that the file does not have.
Selected select(const nlohmann::json& document, const Selection& selection, const Place& root);

// Nodes of the drawn scene, in the order of their numbers; kNone for `scene` is the document's default.
std::vector<std::size_t> drawn_nodes(const nlohmann::json& document, int scene);

// Names of the scenes, and the drawn one.
SceneList list_scenes(const nlohmann::json& document);

// KHR_materials_variants: other materials that primitives may have, by the name of a variant. All take documents that
// passed check_schema().

inline constexpr const char* kVariants = "KHR_materials_variants";

// Names of the variants, by number; empty where the file has none.
std::vector<std::string> variant_names(const nlohmann::json& document);

// Checks that no primitive gives one variant two materials. Variants with equal names, and repeated mappings, are
// notes. Throws InputError.
void check_variants(const nlohmann::json& document, const Place& root, Notes& notes);

// Gives every primitive the material that the variant `name` has for it; primitives without one keep theirs. The first
// of several variants with that name counts. Returns its number; without a name it does nothing and returns kNone.
// Throws UsageError, which lists the names, where the file has no such variant.
int choose_variant(nlohmann::json& document, const std::optional<std::string>& name, const Place& root);

}  // namespace tessera::scene::gltf
