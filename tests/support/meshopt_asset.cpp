#include "tests/support/meshopt_asset.h"
#include "replay/pack/meshopt_encoder.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

// Views of triangle indices, with the size of one.
std::map<std::size_t, std::size_t> index_views(const json& document) {
  std::map<std::size_t, std::size_t> bytes_of_index;
  for (const json& mesh : document["meshes"])
    for (const json& primitive : mesh["primitives"]) {
      const json& accessor = document["accessors"][primitive["indices"].get<std::size_t>()];
      const int type = accessor["componentType"];
      if (type == 5123 || type == 5125) bytes_of_index[accessor["bufferView"]] = type == 5123 ? 2 : 4;
    }
  return bytes_of_index;
}

replay::MeshoptStream encode(std::vector<std::uint8_t> bytes, std::size_t index_bytes) {
  if (index_bytes == 0) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    return replay::encode_elements(bytes, 4);
  }
  std::vector<std::uint32_t> indices(bytes.size() / index_bytes);
  for (std::size_t i = 0; i < indices.size(); ++i) std::memcpy(&indices[i], &bytes[i * index_bytes], index_bytes);
  return replay::encode_indices(indices, index_bytes);
}

}  // namespace

void compress_views(GltfAsset& asset, const std::string& extension) {
  const std::map<std::size_t, std::size_t> indices = index_views(asset.document);
  const std::vector<std::uint8_t> plain = std::move(asset.binary);
  asset.binary.clear();
  std::size_t fallback = 0;
  for (std::size_t v = 0; v < asset.document["bufferViews"].size(); ++v) {
    json& view = asset.document["bufferViews"][v];
    const auto first = plain.begin() + view.value("byteOffset", std::ptrdiff_t{0});
    const auto index_bytes = indices.find(v);
    const replay::MeshoptStream stream = encode({first, first + view["byteLength"].get<std::ptrdiff_t>()},
                                                index_bytes == indices.end() ? 0 : index_bytes->second);
    asset.binary.resize((asset.binary.size() + 3) / 4 * 4);
    json compressed = stream.layout;
    compressed.update({{"buffer", 0}, {"byteOffset", asset.binary.size()}, {"byteLength", stream.bytes.size()}});
    asset.binary.insert(asset.binary.end(), stream.bytes.begin(), stream.bytes.end());
    const std::size_t length =
        stream.layout["count"].get<std::size_t>() * stream.layout["byteStride"].get<std::size_t>();
    view.update({{"buffer", 1},
                 {"byteOffset", fallback},
                 {"byteLength", length},
                 {"extensions", {{extension, std::move(compressed)}}}});
    fallback += (length + 3) / 4 * 4;
  }
  asset.document["buffers"] = {{{"byteLength", asset.binary.size()}},
                               {{"byteLength", fallback}, {"extensions", {{extension, {{"fallback", true}}}}}}};
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) asset.document[list].push_back(extension);
}

GltfAsset meshopt_asset(const std::string& extension) {
  GltfAsset asset = everything_asset();
  compress_views(asset, extension);
  return asset;
}

json& meshopt_member(GltfAsset& asset, std::size_t view) {
  return asset.document["bufferViews"][view]["extensions"].front();
}

}  // namespace tessera::test
