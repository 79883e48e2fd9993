#pragma once

#include <string>

#include "tests/support/gltf_asset.h"

namespace tessera::test {

// Replaces every buffer view by a compressed one without loss, buffer 0 by the streams, and adds buffer 1, a fallback
// without data. Views whose length is no multiple of 4 are padded. Encoded by meshoptimizer: version 0 of attributes.
void compress_views(GltfAsset& asset, const std::string& extension = "EXT_meshopt_compression");

// everything_asset() after compress_views().
GltfAsset meshopt_asset(const std::string& extension = "EXT_meshopt_compression");

// The extension object of a view.
nlohmann::json& meshopt_member(GltfAsset& asset, std::size_t view);

}  // namespace tessera::test
