#pragma once

#include <string>

#include "tests/support/captures.h"
#include "tests/support/gltf_asset.h"

namespace tessera::test {

// A KTX2 file of tests/base/data, by name without ending.
inline std::string basis_file(const std::string& name) {
  return read_text(std::filesystem::path(TESSERA_SOURCE_DIR) / "tests" / "base" / "data" / (name + ".ktx2"));
}

// everything_asset() with the file as image 1, which its texture names by KHR_texture_basisu; image 0 is its fallback.
inline GltfAsset basis_texture_asset(const std::string& file) {
  GltfAsset asset = everything_asset();
  const int image = asset.add("images", {{"mimeType", "image/ktx2"}, {"bufferView", asset.add_view(bytes_of(file))}});
  asset.document["textures"][0]["extensions"]["KHR_texture_basisu"]["source"] = image;
  asset.document["extensionsUsed"].push_back("KHR_texture_basisu");
  return asset;
}

}  // namespace tessera::test
