#include "scene/gltf/container.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace tessera::scene::gltf {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t little_endian32(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | (std::uint32_t{bytes[at + 1]} << 8) | (std::uint32_t{bytes[at + 2]} << 16) |
         (std::uint32_t{bytes[at + 3]} << 24);
}

// Where the chunk after one of `size` bytes that ends at `end` begins: there, as all readers take it, or at the next
// multiple of 4 where only that holds a chunk's header, or padding up to the file's end.
std::size_t next_chunk(const std::vector<std::uint8_t>& bytes, std::size_t end, std::size_t size, std::size_t length) {
  const std::size_t padded = end + (4 - size % 4) % 4;
  const auto is_chunk = [&](std::size_t at) {
    if (length - at < 8) return false;
    const std::uint32_t type = little_endian32(bytes, at + 4);
    return type == kJsonChunk || type == kBinaryChunk;
  };
  if (length - end < 4) return length;
  return padded <= length && !is_chunk(end) && is_chunk(padded) ? padded : end;
}

Container open_binary(const std::vector<std::uint8_t>& bytes, const std::string& file, Notes& notes) {
  const auto refuse = [&](std::size_t at, const std::string& fault) {
    throw InputError(file, fmt::format("byte {}", at), fault);
  };
  if (bytes.size() < 12) refuse(bytes.size(), "GLB header is cut off");
  if (little_endian32(bytes, 4) != 2) refuse(4, fmt::format("GLB version {} is not 2", little_endian32(bytes, 4)));
  // Bytes after the stated length are not part of the asset and are ignored.
  const std::size_t length = little_endian32(bytes, 8);
  if (length > bytes.size() || length < 12)
    refuse(8, fmt::format("GLB header says {} bytes, the file has {}", length, bytes.size()));

  Container container;
  bool has_json = false;
  std::size_t at = 12;
  while (at < length) {
    if (length - at < 8) refuse(at, "GLB chunk header is cut off");
    const std::size_t size = little_endian32(bytes, at);
    const std::uint32_t type = little_endian32(bytes, at + 4);
    if (size > length - at - 8) refuse(at, fmt::format("GLB chunk of {} bytes reaches past the end of the file", size));
    if (size % 4 != 0)
      notes.violation(Place::byte(file, at), "read to its last byte", "GLB chunk length {} is not a multiple of 4",
                      size);
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8;
    const auto end = begin + static_cast<std::ptrdiff_t>(size);
    if (!has_json) {
      if (type != kJsonChunk) refuse(at + 4, "the first GLB chunk is not JSON");
      container.json.assign(begin, end);
      container.json_offset = at + 8;
      has_json = true;
    } else if (type == kJsonChunk) {
      refuse(at + 4, "a second GLB chunk is JSON");
    } else if (type == kBinaryChunk) {
      if (container.has_binary) refuse(at + 4, "a second GLB chunk is binary");
      container.binary.assign(begin, end);
      container.has_binary = true;
    }  // chunks of other types are to be ignored
    at = size % 4 == 0 ? at + 8 + size : next_chunk(bytes, at + 8 + size, size, length);
  }
  if (!has_json) refuse(at, "GLB holds no JSON chunk");
  return container;
}

}  // namespace

Container open_container(std::vector<std::uint8_t> bytes, const std::string& file) {
  Notes ignored;
  return open_container(std::move(bytes), file, ignored);
}

Container open_container(std::vector<std::uint8_t> bytes, const std::string& file, Notes& notes) {
  if (bytes.size() >= 4 && little_endian32(bytes, 0) == kMagic) return open_binary(bytes, file, notes);
  if (bytes.empty()) throw InputError(file, "byte 0", "the file is empty");
  Container container;
  container.json.assign(bytes.begin(), bytes.end());
  return container;
}

}  // namespace tessera::scene::gltf
