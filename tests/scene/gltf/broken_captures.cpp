#include "tests/scene/gltf/broken_captures.h"
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

std::vector<BrokenClass> broken_captures() {
  std::vector<BrokenClass> out = broken_containers();
  for (const auto& part : {broken_documents(), broken_contents(), broken_compression()})
    out.insert(out.end(), part.begin(), part.end());
  return out;
}

}  // namespace tessera::test
