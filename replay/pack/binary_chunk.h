#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/document.h"

namespace tessera::replay {

// What reads an accessor; glTF 2.0 section 3.6.2 says how its buffer view must look.
enum class AccessorUse { kOther, kVertices, kIndices };

// The binary chunk of a .glb under construction and the buffer views that divide it. What it takes from the source
// document it takes once, however often it is asked for.
//
// Invariants (cited by the tests):
//   BIN1  Views start at multiples of four, in the order of the chunk, without overlap; less than four bytes lie
//         between.
//   BIN2  Views of vertex attributes have a byteStride, a multiple of four; no others have.
//   BIN3  A view holds what one accessor, sparse part, Draco stream or image reads and nothing else.
class BinaryChunk {
 public:
  // `source` must outlive the chunk; its accessors and views must have been validated.
  explicit BinaryChunk(scene::gltf::Document& source) : source_(source) {}

  // Appends bytes and returns the number of their view.
  std::size_t add(std::span<const std::uint8_t> bytes);

  // Copies a whole view of the source (a Draco stream, an image) and returns its new number.
  std::size_t copy_view(std::size_t source_view);

  // Copies what an accessor of the source reads, sparse parts included, and points it at the copies.
  void copy_accessor(nlohmann::json& accessor, AccessorUse use);

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  const nlohmann::json& views() const { return views_; }

 private:
  // `count` elements of `size` bytes that lie `stride` apart in a view of the source.
  struct Elements {
    std::size_t view = 0;
    std::uint64_t offset = 0, count = 0, stride = 0, size = 0;
    AccessorUse use = AccessorUse::kOther;
    auto operator<=>(const Elements&) const = default;
  };
  std::size_t copy_elements(const Elements& elements);

  scene::gltf::Document& source_;
  std::vector<std::uint8_t> bytes_;
  nlohmann::json views_ = nlohmann::json::array();
  std::map<std::size_t, std::size_t> copied_views_;
  std::map<Elements, std::size_t> copied_elements_;
};

}  // namespace tessera::replay
