#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/meshopt_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/tests.h"

namespace tessera::test {

fs::path put(const fs::path& folder, const std::string& name, const std::string& contents) {
  write_text(folder / name, contents);
  return folder / name;
}

BrokenCapture damaged(std::string name, std::function<void(GltfAsset&)> damage, std::string place, std::string fault) {
  return {std::move(name),
          [damage = std::move(damage)](const fs::path& folder) {
            GltfAsset asset = everything_asset();
            damage(asset);
            return put(folder, "capture.glb", asset.glb());
          },
          std::move(place), std::move(fault)};
}

BrokenCapture file_of(std::string name, std::string contents, std::string place, std::string fault) {
  return {name, [=](const fs::path& folder) { return put(folder, name, contents); }, std::move(place),
          std::move(fault)};
}

BrokenCapture strictly(BrokenCapture broken) {
  broken.strict = true;
  return broken;
}

namespace {

GltfAsset base_asset(const std::string& name) {
  if (name == "meshopt") return meshopt_asset();
  if (name == "sequential" || name == "edgebreaker") return draco_asset(name == "sequential");
  GltfAsset asset = everything_asset();
  if (name == "passes") asset.document["extensions"]["TESSERA_capture"].update(deferred_passes());
  if (name != "variants") return asset;
  asset.document["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "plain"}}, {{"name", "dressed"}}};
  asset.document["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
      {{"variants", {0}}, {"material", 0}}, {{"variants", {1}}, {"material", 1}}};
  return asset;
}

BrokenCapture broken_row(const json& row) {
  const std::string place = row.contains("place") ? row["place"].get<std::string>() : row["set"].items().begin().key();
  return {row["name"], [row](const fs::path& folder) { return put_row(folder, row); },
          place,       row.value("fault", ""),
          3,           row.value("strict", false)};
}

}  // namespace

json capture_rows(const std::string& file) {
  return json::parse(read_text(fs::path(TESSERA_SOURCE_DIR) / "tests/scene/gltf" / file));
}

fs::path put_row(const fs::path& folder, const json& row) {
  GltfAsset asset = base_asset(row.value("base", "everything"));
  const json set = row.value("set", json::object());
  for (const auto& [pointer, value] : set.items()) asset.document[json::json_pointer(pointer)] = value;
  json removed = row.value("remove", json::array());
  if (removed.is_string()) removed = json::array({removed});
  for (const json& pointer : removed) asset.document.patch_inplace({{{"op", "remove"}, {"path", pointer}}});
  return put(folder, "capture.glb", asset.glb());
}

std::vector<BrokenClass> broken_captures() {
  std::vector<BrokenClass> out;
  const auto captures_of = [&](const std::string& name) -> std::vector<BrokenCapture>& {
    const auto at = std::find_if(out.begin(), out.end(), [&](const BrokenClass& c) { return c.name == name; });
    return (at == out.end() ? out.emplace_back(BrokenClass{name, {}}) : *at).captures;
  };
  const json rows = capture_rows("broken_captures.json");
  for (const auto& [name, captures] : rows.items())
    for (const json& row : captures) captures_of(name).push_back(broken_row(row));
  for (const auto& part : {broken_containers(), broken_contents(), broken_compression()})
    for (const BrokenClass& c : part) {
      std::vector<BrokenCapture>& captures = captures_of(c.name);
      captures.insert(captures.end(), c.captures.begin(), c.captures.end());
    }
  return out;
}

}  // namespace tessera::test
