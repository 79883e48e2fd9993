#include "replay/pack/binary_chunk.h"

#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/meshopt_reader.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

constexpr std::uint64_t multiple_of_4(std::uint64_t value) { return (value + 3) / 4 * 4; }

void describe_use(json& view, AccessorUse use, std::uint64_t stride) {
  if (use == AccessorUse::kVertices) view["byteStride"] = stride;
  if (use != AccessorUse::kOther) view["target"] = use == AccessorUse::kVertices ? kArrayBuffer : kElementArrayBuffer;
}

// Elements `stride` bytes apart as a stream without loss, or one without bytes where the codec cannot hold them.
MeshoptStream lossless(std::span<const std::uint8_t> elements, std::uint64_t stride, AccessorUse use) {
  if (use != AccessorUse::kIndices)
    return stride % 4 == 0 && stride <= 256 ? encode_elements(elements, stride) : MeshoptStream{};
  if (stride != 2 && stride != 4) return {};
  std::vector<std::uint32_t> indices(elements.size() / stride);
  for (std::size_t i = 0; i < indices.size(); ++i)
    for (std::uint64_t k = 0; k < stride; ++k) indices[i] |= std::uint32_t{elements[i * stride + k]} << (8 * k);
  return encode_indices(indices, stride);
}

}  // namespace

std::size_t BinaryChunk::add(std::span<const std::uint8_t> bytes) {
  bytes_.resize(multiple_of_4(bytes_.size()));
  views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}});
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return views_.size() - 1;
}

std::size_t BinaryChunk::add_stream(const MeshoptStream& stream, AccessorUse use, const std::string& extension) {
  const std::size_t number = add(stream.bytes);
  json& view = views_.back();
  json compressed = stream.layout;
  compressed.update(view);  // buffer, byteOffset and byteLength of the stream
  const auto stride = stream.layout["byteStride"].get<std::uint64_t>(),
             length = stream.layout["count"].get<std::uint64_t>() * stride;
  view = {{"buffer", 1},
          {"byteOffset", fallback_bytes_},
          {"byteLength", length},
          {"extensions", {{extension, std::move(compressed)}}}};
  describe_use(view, use, stride);
  fallback_bytes_ = multiple_of_4(fallback_bytes_ + length);
  extensions_.insert(extension);
  return number;
}

json BinaryChunk::buffers() const {
  json list = json::array({{{"byteLength", bytes_.size()}}});
  if (extensions_.empty()) return list;
  json tags = json::object();
  tags[*extensions_.begin()] = {{"fallback", true}};
  list.push_back({{"byteLength", fallback_bytes_}, {"extensions", std::move(tags)}});
  return list;
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
  std::vector<std::uint8_t> packed(e.count * stride, 0);
  for (std::uint64_t i = 0; i < e.count; ++i) {
    const auto from = source.begin() + static_cast<std::ptrdiff_t>(e.offset + i * e.stride);
    std::copy(from, from + static_cast<std::ptrdiff_t>(e.size),
              packed.begin() + static_cast<std::ptrdiff_t>(i * stride));
  }
  const MeshoptStream stream = meshopt_ ? lossless(packed, stride, e.use) : MeshoptStream{};
  if (!stream.bytes.empty() && stream.bytes.size() < packed.size()) return at->second = add_stream(stream, e.use);
  packed.resize((e.count - 1) * stride + e.size);  // nothing after the last element
  at->second = add(packed);
  describe_use(views_.back(), e.use, stride);
  return at->second;
}

// A compressed view of the source as it is.
std::size_t BinaryChunk::copy_stream(std::size_t source_view, AccessorUse use) {
  const auto [at, fresh] = copied_streams_.try_emplace({source_view, use}, 0);
  if (!fresh) return at->second;
  const char* name = nullptr;
  const json& compressed = *gltf::find_meshopt(source_.json["bufferViews"][source_view], &name);
  const gltf::Bytes buffer = source_.resources.buffer(compressed["buffer"].get<std::size_t>());
  const gltf::Bytes bytes =
      buffer.subspan(compressed.value("byteOffset", std::size_t{0}), compressed["byteLength"].get<std::size_t>());
  MeshoptStream stream{{bytes.begin(), bytes.end()}, json::object()};
  for (const char* member : {"byteStride", "count", "mode", "filter"})
    if (compressed.contains(member)) stream.layout[member] = compressed[member];
  return at->second = add_stream(stream, use, name);
}

void BinaryChunk::copy_accessor(json& accessor, AccessorUse use) {
  json alone = {{"accessors", json::array({accessor})}};
  if (accessor.contains("bufferView")) {
    alone["bufferViews"] = json::array({source_.json["bufferViews"][accessor["bufferView"].get<std::size_t>()]});
    alone["accessors"][0]["bufferView"] = 0;
  }
  const gltf::AccessorLayout layout = gltf::accessor_layout(alone, 0);
  // A stream that holds this accessor alone needs no second encoding, which would not know its filter.
  const json* compressed = meshopt_ && layout.has_view ? gltf::find_meshopt(alone["bufferViews"][0]) : nullptr;
  if (compressed != nullptr && layout.byte_offset == 0 && layout.count == (*compressed)["count"] &&
      layout.stride == (*compressed)["byteStride"]) {
    accessor["bufferView"] = copy_stream(accessor["bufferView"].get<std::size_t>(), use);
    accessor.erase("byteOffset");
  } else if (layout.has_view) {
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
