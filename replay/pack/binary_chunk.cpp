#include "replay/pack/binary_chunk.h"

#include "scene/gltf/accessor_layout.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

constexpr std::uint64_t multiple_of_4(std::uint64_t value) { return (value + 3) / 4 * 4; }

}  // namespace

std::size_t BinaryChunk::add(std::span<const std::uint8_t> bytes) {
  bytes_.resize(multiple_of_4(bytes_.size()));
  views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}});
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return views_.size() - 1;
}

std::size_t BinaryChunk::copy_view(std::size_t source_view) {
  const auto [at, fresh] = copied_views_.try_emplace(source_view, 0);
  if (fresh) at->second = add(source_.resources.buffer_view(source_view));
  return at->second;
}

std::size_t BinaryChunk::copy_elements(const Elements& e) {
  const auto [at, fresh] = copied_elements_.try_emplace(e, 0);
  if (!fresh) return at->second;
  const gltf::Bytes source = source_.resources.buffer_view(e.view);
  const std::uint64_t stride = e.use == AccessorUse::kVertices ? multiple_of_4(e.size) : e.size;
  std::vector<std::uint8_t> packed((e.count - 1) * stride + e.size, 0);
  for (std::uint64_t i = 0; i < e.count; ++i) {
    const auto from = source.begin() + static_cast<std::ptrdiff_t>(e.offset + i * e.stride);
    std::copy(from, from + static_cast<std::ptrdiff_t>(e.size),
              packed.begin() + static_cast<std::ptrdiff_t>(i * stride));
  }
  at->second = add(packed);
  json& view = views_.back();
  if (e.use == AccessorUse::kVertices) view["byteStride"] = stride;
  if (e.use != AccessorUse::kOther)
    view["target"] = e.use == AccessorUse::kVertices ? kArrayBuffer : kElementArrayBuffer;
  return at->second;
}

void BinaryChunk::copy_accessor(json& accessor, AccessorUse use) {
  json alone = {{"accessors", json::array({accessor})}};
  if (accessor.contains("bufferView")) {
    alone["bufferViews"] = json::array({source_.json["bufferViews"][accessor["bufferView"].get<std::size_t>()]});
    alone["accessors"][0]["bufferView"] = 0;
  }
  const gltf::AccessorLayout layout = gltf::accessor_layout(alone, 0);
  if (layout.has_view) {
    accessor["bufferView"] = copy_elements({accessor["bufferView"].get<std::size_t>(), layout.byte_offset, layout.count,
                                            layout.stride, layout.element_bytes, use});
    accessor.erase("byteOffset");
  }
  if (!accessor.contains("sparse")) return;
  // Sparse parts are tightly packed and have neither stride nor target.
  const auto copy_part = [&](json& part, std::uint64_t element_bytes) {
    part["bufferView"] = copy_elements(
        {part["bufferView"].get<std::size_t>(), part.value("byteOffset", std::uint64_t{0}),
         accessor["sparse"]["count"].get<std::uint64_t>(), element_bytes, element_bytes, AccessorUse::kOther});
    part.erase("byteOffset");
  };
  json& sparse = accessor["sparse"];
  copy_part(sparse["indices"], gltf::component_bytes(sparse["indices"]["componentType"].get<int>()));
  copy_part(sparse["values"], layout.element_bytes);
}

}  // namespace tessera::replay
