#include "gpu/presets.h"

#include <algorithm>

#include "gpu/preset_files.h"

namespace tessera::gpu {
namespace {

using nlohmann::json;

Preset read_preset(std::string_view text) {
  json root = json::parse(text);
  Preset preset;
  preset.name = root.at("name").get<std::string>();
  preset.description = root.at("description").get<std::string>();
  preset.aliases = root.at("aliases").get<std::vector<std::string>>();
  preset.sources = root.at("sources");
  for (const char* member : {"name", "description", "aliases", "sources"}) root.erase(member);
  preset.values = std::move(root);
  return preset;
}

}  // namespace

const std::vector<Preset>& presets() {
  static const std::vector<Preset> kPresets = [] {
    std::vector<Preset> all;
    for (const char* file : {"entry-mobile.json", "mid-mobile.json", "high-mobile.json", "v3d.json"})
      all.push_back(read_preset(preset_files().at(file)));
    return all;
  }();
  return kPresets;
}

const Preset* find_preset(const std::string& name) {
  for (const Preset& preset : presets())
    if (preset.name == name || std::ranges::count(preset.aliases, name) > 0) return &preset;
  return nullptr;
}

}  // namespace tessera::gpu
