// TESSERA_capture.attachments and .passes: from the JSON to scene::PassGraph.
#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/validation.h"
#include "scene/pass_graph.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// The value of an enumeration whose names check_schema() has found in `names`.
template <class Enum, std::size_t kCount>
Enum value_of(const json& word, const std::array<std::string_view, kCount>& names) {
  const auto found = std::find(names.begin(), names.end(), word.get_ref<const std::string&>());
  return static_cast<Enum>(found - names.begin());
}

std::vector<std::string> names_in(const json& object, std::string_view list) {
  return list_of(object, list).get<std::vector<std::string>>();
}

Attachment read_attachment(const std::string& name, const json& object) {
  Attachment a;
  a.name = name;
  a.format = value_of<AttachmentFormat>(object["format"], kAttachmentFormatNames);
  if (const json* size = find(object, "size")) a.size = {(*size)[0].get<int>(), (*size)[1].get<int>()};
  a.scale = object.value("scale", a.scale);
  a.samples = object.value("samples", a.samples);
  a.layers = object.value("layers", a.layers);
  a.levels = object.value("levels", a.levels);
  if (const json* life = find(object, "life")) a.life = value_of<AttachmentLife>(*life, kAttachmentLifeNames);
  return a;
}

Subpass read_subpass(const json& object) {
  Subpass subpass;
  if (const json* draw = find(object, "draw")) subpass.draw = value_of<DrawFilter>(*draw, kDrawFilterNames);
  subpass.shader = value_of<PassShader>(object["shader"], kPassShaderNames);
  subpass.input = names_in(object, "input");
  subpass.write = names_in(object, "write");
  subpass.sample = names_in(object, "sample");
  return subpass;
}

Pass read_pass(const json& object) {
  Pass pass;
  pass.name = object["name"].get<std::string>();
  if (const json* view = find(object, "view")) pass.view = value_of<PassView>(*view, kPassViewNames);
  if (const json* subpasses = find(object, "subpasses")) {
    pass.lists_subpasses = true;
    for (const json& subpass : *subpasses) pass.subpasses.push_back(read_subpass(subpass));
  } else {
    pass.subpasses.push_back(read_subpass(object));
  }
  if (const json* load = find(object, "load"))
    for (const auto& [name, action] : load->items())
      pass.load.emplace_back(name, value_of<LoadAction>(action, kLoadActionNames));
  if (const json* store = find(object, "store"))
    for (const auto& [name, action] : store->items())
      pass.store.emplace_back(name, value_of<StoreAction>(action, kStoreActionNames));
  return pass;
}

}  // namespace

std::optional<PassGraph> read_passes(const json& settings) {
  const json* passes = find(settings, "passes");
  if (passes == nullptr) return std::nullopt;
  PassGraph graph;
  if (const json* attachments = find(settings, "attachments"))
    for (const auto& [name, object] : attachments->items()) graph.attachments.push_back(read_attachment(name, object));
  for (const json& pass : *passes) graph.passes.push_back(read_pass(pass));
  return graph;
}

namespace validation {

void check_passes(const json& settings, const Place& place) {
  if (settings.contains("attachments") && !settings.contains("passes"))
    place.at("attachments").refuse("need passes that write them");
  const std::optional<PassGraph> graph = read_passes(settings);
  if (!graph) return;
  if (const std::optional<GraphFault> fault = find_fault(*graph))
    throw InputError(place.file(), place.pointer() + fault->pointer, fault->text);
}

}  // namespace validation
}  // namespace tessera::scene::gltf
