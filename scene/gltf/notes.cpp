#include "scene/gltf/notes.h"

#include <algorithm>
#include <cstddef>
#include <map>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "scene/extensions.h"
#include "scene/gltf/json_reader.h"

namespace tessera::scene::gltf {

void Notes::add(const Place& place, std::string_view answer, const std::string& text) {
  const auto same = std::find_if(lines_.begin(), lines_.end(), [&](const Line& line) { return line.answer == answer; });
  if (same != lines_.end())
    ++same->count;
  else
    lines_.push_back(
        {place.pointer().empty() ? text : escape_control(place.pointer()) + ": " + text, std::string(answer)});
}

std::vector<std::string> Notes::lines() const {
  std::vector<std::string> out;
  for (const Line& line : lines_)
    out.push_back(line.text + (line.answer.empty() ? "" : "; " + line.answer) +
                  (line.count > 1 ? fmt::format(" (and {} more)", line.count - 1) : ""));
  return out;
}

namespace {

using nlohmann::json;

// Extension objects by name, then by the document's list that holds them.
using Carriers = std::map<std::string, std::map<std::string, std::size_t>>;

bool is_read(const std::string& name) {
  const auto& known = supported_extensions();
  return std::any_of(known.begin(), known.end(), [&](const Extension& e) { return e.name == name; });
}

std::map<std::string, std::size_t>& lists_of(const std::string& name, MemoryBudget& budget, Carriers& carriers) {
  const auto [found, fresh] = carriers.try_emplace(name);
  if (fresh) budget.charge(512 + 8 * name.size(), 1, "extensions");  // here, in the list of names and in the note
  return found->second;
}

void count_carriers(const json& value, const std::string& list, MemoryBudget& budget, Carriers& carriers) {
  if (value.is_array())
    for (const json& inner : value) count_carriers(inner, list, budget, carriers);
  if (!value.is_object()) return;
  for (const auto& [key, inner] : value.items()) {
    if (key == "extras") continue;
    if (key == "extensions" && inner.is_object())
      for (const auto& [name, extension] : inner.items())
        if (!is_read(name)) ++lists_of(name, budget, carriers)[list];
    count_carriers(inner, list.empty() ? key : list, budget, carriers);
  }
}

// "2 materials", "1 mesh"; an extension of the document itself has no number.
std::string carriers_text(const std::map<std::string, std::size_t>& lists) {
  std::vector<std::string> parts;
  for (const auto& [list, count] : lists) {
    if (list.empty() || list == "extensions") continue;
    std::string name = list;
    if (count == 1 && name.ends_with("s")) name.resize(name.size() - (name.ends_with("shes") ? 2 : 1));
    parts.push_back(fmt::format("{} {}", count, escape_control(name, 60)));
  }
  return parts.empty() ? "" : fmt::format(" ({})", fmt::join(parts, ", "));
}

}  // namespace

std::vector<std::string> find_unread_extensions(const json& document, const Place& root, MemoryBudget& budget,
                                                Notes& notes) {
  Carriers carriers;
  count_carriers(document, "", budget, carriers);
  for (const json& name : list_of(document, "extensionsUsed"))
    if (const auto& text = name.get_ref<const std::string&>(); !is_read(text)) lists_of(text, budget, carriers);
  std::vector<std::string> names, texts;
  for (const auto& [name, lists] : carriers) {
    names.push_back(name);
    texts.push_back(escape_control(name, 60) + carriers_text(lists));
  }
  if (!names.empty()) notes.add(root, "", fmt::format("not read: {}", fmt::join(texts, ", ")));
  return names;
}

}  // namespace tessera::scene::gltf
