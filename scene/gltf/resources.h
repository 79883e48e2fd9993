#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/notes.h"
#include "scene/gltf/place.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

using Bytes = std::span<const std::uint8_t>;

struct ReadAhead;

// The bytes behind a document: buffers and images, from the binary chunk, data URIs and files. Files must lie inside
// the document's folder (links resolved); there is no network. Each is read once, when first asked for.
class Resources {
 public:
  // `document` must have passed check_schema and outlive this object.
  Resources(const nlohmann::json& document, const std::filesystem::path& file, std::vector<std::uint8_t> binary,
            bool has_binary, const CaptureLimits& limits, MemoryBudget& budget, Notes& notes);

  // The buffer's byteLength bytes. A longer file or chunk is fine, a shorter one is refused.
  Bytes buffer(std::size_t index);
  // Decodes a compressed view; the fallback buffer that it names is not read.
  Bytes buffer_view(std::size_t index);
  // The encoded bytes of an image. Refuses one that has none.
  Bytes image(std::size_t index);
  // The bytes behind a URI that stands at `place`.
  Bytes file(const std::string& uri, const Place& place) { return uri_bytes(uri, place); }

  // Bytes that are available without reading or decoding anything now; nothing otherwise. `range`: a view without
  // compression, or a compression.
  std::optional<Bytes> known_range(const nlohmann::json& range) const;
  std::optional<Bytes> known_view(std::size_t index) const;
  std::optional<Bytes> known_image(std::size_t index) const;
  // Reads the target of a URI of the document, charged to `budget`. Refuses at `place`. May be called on any thread.
  std::vector<std::uint8_t> read_uri(const std::string& uri, MemoryBudget& budget, const Place& place) const;
  // Takes URIs and compressed views from `ahead` where they are ready.
  void use(ReadAhead& ahead) { ahead_ = &ahead; }

  // Bytes read from files and data URIs so far.
  std::uint64_t bytes_read() const { return bytes_read_; }

 private:
  Bytes bytes_of(const nlohmann::json& range, const Place& place);
  const std::vector<std::uint8_t>& uri_bytes(const std::string& uri, const Place& place);

  const nlohmann::json& document_;
  Place root_;
  std::filesystem::path folder_;
  std::vector<std::uint8_t> binary_;
  bool has_binary_;
  const CaptureLimits& limits_;
  MemoryBudget& budget_;
  Notes& notes_;
  std::map<std::string, std::vector<std::uint8_t>> loaded_;   // by URI
  std::map<std::size_t, std::vector<std::uint8_t>> decoded_;  // compressed views
  std::vector<Bytes> views_;                                  // known views; empty until they are known
  std::uint64_t bytes_read_ = 0;
  ReadAhead* ahead_ = nullptr;
};

// The file that a relative URI names, or a refusal: schemes, absolute paths, and paths that leave `folder` (also
// through links) are not followed. Exposed for tests.
std::filesystem::path resolve_uri(const std::string& uri, const std::filesystem::path& folder, const Place& place);

// The path that a URI spells, escapes undone; nothing where it has a scheme, or a broken escape.
std::optional<std::string> uri_path(std::string_view uri);

// Whether a URI holds its data. Schemes are case-insensitive (RFC 3986 section 3.1).
bool is_data_uri(std::string_view uri);

// Bytes of a "data:" URI (base64 or percent-encoded). Refuses other encodings.
std::vector<std::uint8_t> decode_data_uri(const std::string& uri, const Place& place);

}  // namespace tessera::scene::gltf
