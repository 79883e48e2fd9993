#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"
#include "scene/view_choices.h"

namespace tessera::scene::gltf {

// What a Selection means in a document. kNone, and no list, where it says nothing.
struct Selected {
  int scene = kNone;
  int camera_node = kNone;
  // Those that play, in this order; "all" is none: scene_builder.cpp chooses.
  std::optional<std::vector<int>> animations;
  bool all_animations = false;
};

// `document` passed validate_links(). Throws UsageError, which lists what there is, for what the file does not have.
Selected select(const nlohmann::json& document, const Selection& selection, const Place& root);

// Nodes of the scene that is drawn, in the order of their numbers; `scene`: kNone is the document's own.
std::vector<std::size_t> drawn_nodes(const nlohmann::json& document, int scene);

// Names, and the one that is drawn.
SceneList list_scenes(const nlohmann::json& document);

// KHR_materials_variants: other materials that primitives may have, by the name of a variant. All take documents that
// passed check_schema().

inline constexpr const char* kVariants = "KHR_materials_variants";

// Names of the variants, by number; empty where the file has none.
std::vector<std::string> variant_names(const nlohmann::json& document);

// Checks that no primitive gives one variant two materials. Variants of one name, and a mapping that says the same
// twice, are notes. Throws InputError.
void check_variants(const nlohmann::json& document, const Place& root, Notes& notes);

// Gives every primitive the material that the variant `name` has for it; primitives without one keep theirs. Of several
// variants of that name the first counts. Returns its number; nothing is done, and kNone returned, without a name.
// Throws UsageError, which lists the names, where the file has no such variant.
int choose_variant(nlohmann::json& document, const std::optional<std::string>& name, const Place& root);

}  // namespace tessera::scene::gltf
