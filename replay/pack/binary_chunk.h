#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/pack/meshopt_encoder.h"
#include "scene/gltf/document.h"

namespace tessera::replay {

// Reader of an accessor; glTF 2.0 section 3.6.2 restricts the accessor's buffer view accordingly.
enum class AccessorUse { kOther, kVertices, kIndices };

// The binary chunk of a .glb under construction and the buffer views that divide it. Data of the source document is
// copied once, however often it is asked for.
//
// Invariants (cited by the tests):
//   BIN1  The bytes that views read (of a compressed view, its stream) start at multiples of four, in the order of the
//         chunk, without overlap; less than four bytes lie between.
//   BIN2  Views of vertex attributes have a byteStride, a multiple of four; other views have none.
//   BIN3  A view holds the bytes that one accessor, sparse part, Draco stream or image reads, and nothing else.
//   BIN4  Compressed views unpack into buffer 1, a fallback without data that is exactly as long as they need.
class BinaryChunk {
 public:
  // `source` must outlive the chunk; its accessors and views must have been validated. `meshopt`: accessors are
  // compressed without loss where that makes them smaller, and compressed ones stay compressed.
  explicit BinaryChunk(scene::gltf::Document& source, bool meshopt = false) : source_(source), meshopt_(meshopt) {}

  // Appends bytes and returns the number of their view.
  std::size_t add(std::span<const std::uint8_t> bytes);

  // Appends a compressed stream and returns the number of its view.
  std::size_t add_stream(const MeshoptStream& stream, AccessorUse use,
                         const std::string& extension = "EXT_meshopt_compression");

  // Copies a whole view of the source (a Draco stream, an image) and returns its new number.
  std::size_t copy_view(std::size_t source_view);

  // Copies the bytes that an accessor of the source reads, sparse parts included, and points it at the copies.
  void copy_accessor(nlohmann::json& accessor, AccessorUse use);

  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  const nlohmann::json& views() const { return views_; }
  // The document's "buffers": the chunk, and the fallback where there are compressed views.
  nlohmann::json buffers() const;
  // Extension names under which views are compressed.
  const std::set<std::string>& extensions() const { return extensions_; }

 private:
  // `count` elements of `size` bytes that lie `stride` apart in a view of the source.
  struct Elements {
    std::size_t view = 0;
    std::uint64_t offset = 0, count = 0, stride = 0, size = 0;
    AccessorUse use = AccessorUse::kOther;
    auto operator<=>(const Elements&) const = default;
  };
  std::size_t copy_elements(const Elements& elements);
  std::size_t copy_stream(std::size_t source_view, AccessorUse use);

  scene::gltf::Document& source_;
  bool meshopt_;
  std::vector<std::uint8_t> bytes_;
  nlohmann::json views_ = nlohmann::json::array();
  std::map<std::size_t, std::size_t> copied_views_;
  std::map<Elements, std::size_t> copied_elements_;
  std::map<std::pair<std::size_t, AccessorUse>, std::size_t> copied_streams_;
  std::uint64_t fallback_bytes_ = 0;
  std::set<std::string> extensions_;
};

}  // namespace tessera::replay
