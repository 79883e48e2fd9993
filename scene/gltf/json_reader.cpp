#include "scene/gltf/json_reader.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tiny_gltf.h>

#include "base/error.h"
#include "base/text.h"
#include "scene/capture.h"
#include "scene/gltf/place.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxDepth = 64;
// The limit for extras, which belong to the application; extras deeper than kMaxDepth are dropped.
constexpr std::size_t kMaxExtrasDepth = 100000;

// Counts the values of a text, in the interface of nlohmann::json::sax_parse. Keeps one hash per key of the open
// objects, and nothing else that grows with the text.
class Census {
 public:
  Census(const std::string& file, std::size_t first_byte) : file_(file), first_byte_(first_byte) {}

  bool null() { return value(); }
  bool boolean(bool) { return value(); }
  bool number_integer(std::int64_t) { return value(); }
  bool number_unsigned(std::uint64_t) { return value(); }
  bool number_float(double, const std::string&) { return value(); }
  bool string(std::string& text) {
    strings += 1;
    string_bytes += text.size();
    return value();
  }
  bool binary(std::vector<std::uint8_t>&) { return value(); }
  bool start_object(std::size_t) { return open(true); }
  bool start_array(std::size_t) { return open(false); }
  bool key(std::string& text) {
    keys += 1;
    string_bytes += text.size();
    levels_.back().key_hashes.push_back(std::hash<std::string>{}(text));
    levels_.back().key = text;
    return true;
  }
  bool end_array() { return close(); }
  bool end_object() {
    std::vector<std::size_t>& hashes = levels_.back().key_hashes;
    std::sort(hashes.begin(), hashes.end());
    if (const auto twin = std::adjacent_find(hashes.begin(), hashes.end()); twin != hashes.end()) {
      const std::string where = pointer(levels_.size() - 1);
      throw InputError(file_, where.empty() ? kWholeDocument : where, "has a key twice");
    }
    return close();
  }
  bool parse_error(std::size_t position, const std::string&, const json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 1, column 5: syntax error ..."
    std::string reason = error.what();
    const std::size_t bracket = reason.find("] "), colon = reason.find(": ");
    if (colon != std::string::npos)
      reason = reason.substr(colon + 2);
    else if (bracket != std::string::npos)
      reason = reason.substr(bracket + 2);
    throw InputError(file_, fmt::format("byte {}", first_byte_ + std::max<std::size_t>(position, 1) - 1),
                     "is not JSON: " + reason);
  }

  std::uint64_t values = 0, containers = 0, keys = 0, strings = 0, string_bytes = 0;
  bool deep_extras = false;  // deeper than kMaxDepth

 private:
  struct Level {
    bool object = false;
    std::size_t elements = 0;  // of an array, so far
    std::string key;           // of an object, the latest
    std::vector<std::size_t> key_hashes;
  };

  bool value() {
    values += 1;
    if (!levels_.empty()) levels_.back().elements += 1;
    return true;
  }
  bool open(bool object) {
    containers += 1;
    value();
    const std::size_t most = extras_ ? kMaxExtrasDepth : kMaxDepth;
    if (levels_.size() >= most)
      throw InputError(file_, pointer(3) + "...", fmt::format("JSON nests deeper than {} levels", most));
    if (!extras_ && !levels_.empty() && levels_.back().object && levels_.back().key == "extras")
      extras_ = levels_.size();
    deep_extras = deep_extras || levels_.size() >= kMaxDepth;
    levels_.emplace_back().object = object;
    return true;
  }
  bool close() {
    levels_.pop_back();
    if (extras_ == levels_.size()) extras_.reset();
    return true;
  }
  // JSON pointer of the value inside the first `depth` open levels.
  std::string pointer(std::size_t depth) const {
    Place place(file_);
    for (std::size_t k = 0; k < depth; ++k)
      place = levels_[k].object ? place.at(levels_[k].key) : place.at(levels_[k].elements - 1);
    return place.pointer();
  }

  const std::string& file_;
  std::size_t first_byte_;
  std::vector<Level> levels_;
  std::optional<std::size_t> extras_;  // the level whose container is the value of "extras"
};

// Kinds of objects of a document and the bytes of one object: tinygltf's and the capture's, times 3 for vectors that
// grow by doubling (old and new block exist at once).
struct ObjectKind {
  const char* array;
  std::uint64_t bytes;
};
constexpr std::uint64_t kGrowth = 3;
constexpr ObjectKind kKinds[] = {
    {"accessors", sizeof(tinygltf::Accessor)},
    {"animations", sizeof(tinygltf::Animation) + sizeof(Animation)},
    {"bufferViews", sizeof(tinygltf::BufferView)},
    {"cameras", sizeof(tinygltf::Camera) + sizeof(Camera)},
    {"materials", sizeof(tinygltf::Material) + sizeof(Material)},
    {"meshes", sizeof(Mesh)},
    {"nodes", sizeof(Node) + 48},  // and the tables of validation
    {"samplers", sizeof(tinygltf::Sampler)},
    {"scenes", sizeof(tinygltf::Scene)},
    {"skins", sizeof(tinygltf::Skin) + sizeof(Skin)},
    {"textures", sizeof(tinygltf::Texture)},
};

std::uint64_t count_values(const json& value) {
  std::uint64_t count = 1;
  if (value.is_structured())
    for (const json& inner : value) count += count_values(inner);
  return count;
}

// tinygltf copies the values in "extensions" into values of its own.
std::uint64_t count_extension_values(const json& value) {
  std::uint64_t count = 0;
  if (value.is_object()) {
    for (const auto& [key, inner] : value.items())
      count += key == "extensions" ? count_values(inner) : count_extension_values(inner);
  } else if (value.is_array()) {
    for (const json& inner : value) count += count_extension_values(inner);
  }
  return count;
}

}  // namespace

json read_json(const std::string& text, std::size_t first_byte, const std::string& file, MemoryBudget& budget) {
  budget.charge(text.size(), kCensusBytes, "the document");
  Census census(file, first_byte);
  json::sax_parse(text, &census);
  // A value is 16 bytes in a vector that doubles, a container 64 more, a key a map node of 96, a text 48; texts too
  // long to lie inside std::string have a block of their own. Two such trees exist at a time: ours and tinygltf's, or
  // the one that is written as text for it; the text takes up to 24 bytes a number and doubles as it grows. Then
  // tinygltf's lists of numbers, its maps of attributes, and names, which the capture keeps once more.
  constexpr const char* what = "JSON";
  budget.charge(census.values, 2 * 16 * kGrowth + 24 * kGrowth + 8 * kGrowth, what);
  budget.charge(census.containers, 2 * 64 + 64, what);
  budget.charge(census.keys, 2 * 96 + 96 + 3 * 6, what);
  budget.charge(census.strings, 2 * 48, what);
  budget.charge(census.keys + census.strings, 2 * 32, what);
  budget.charge(census.string_bytes, 2, what);
  budget.charge(text.size(), 2 + kGrowth, what);
  if (!census.deep_extras) return json::parse(text);
  // Copies and texts of a document descend by recursion.
  return json::parse(text, [](int, json::parse_event_t event, json& value) {
    return event != json::parse_event_t::key || value != "extras";
  });
}

void charge_objects(const json& document, MemoryBudget& budget) {
  for (const ObjectKind& kind : kKinds)
    if (const auto array = document.find(kind.array); array != document.end())
      budget.charge(array->size(), kGrowth * kind.bytes, kind.array);
  const auto inner_arrays = [&](const char* outer, const char* inner, std::uint64_t bytes) {
    const auto array = document.find(outer);
    for (std::size_t i = 0; array != document.end() && i < array->size(); ++i)
      if (const auto list = (*array)[i].find(inner); list != (*array)[i].end())
        budget.charge(list->size(), kGrowth * bytes, [&] { return fmt::format("/{}/{}/{}", outer, i, inner); });
  };
  inner_arrays("meshes", "primitives", sizeof(Primitive));
  inner_arrays("animations", "channels",
               sizeof(tinygltf::AnimationChannel) + sizeof(AnimationChannel) + 64);  // and sets of moved properties
  inner_arrays("animations", "samplers", sizeof(tinygltf::AnimationSampler));
  inner_arrays("nodes", "children", 2 * sizeof(int));
  inner_arrays("skins", "joints", 2 * sizeof(int) + sizeof(DMat4) + 16);
  inner_arrays("scenes", "nodes", 2 * sizeof(int) + 16);
  if (const json* materials = find(document, "materials"))
    budget.charge(count_values(*materials), sizeof(tinygltf::Parameter) + 128, "/materials");
  std::uint64_t values = 0;
  for (const auto& [name, value] : document.items())
    if (name != "nodes" && name != "meshes")  // tinygltf does not see them
      values += name == "extensions" ? count_values(value) : count_extension_values(value);
  budget.charge(values, 2 * kGrowth * sizeof(tinygltf::Value), "/extensions");
}

// ---- Parts of a document ----------------------------------------------------------------------------------------

const json* find(const json& object, std::string_view name) {
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

const json* find_at(const json& object, std::string_view pointer) {
  const json* at = &object;
  while (at != nullptr && !pointer.empty()) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    at = find(*at, pointer.substr(1, end - 1));
    pointer.remove_prefix(end);
  }
  return at;
}

const json* find_extension(const json& object, std::string_view name) {
  const json* extensions = find(object, "extensions");
  return extensions == nullptr ? nullptr : find(*extensions, name);
}

const json& list_of(const json& object, std::string_view name) {
  static const json kEmpty = json::array();
  const json* list = find(object, name);
  return list == nullptr ? kEmpty : *list;
}

namespace {

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t little_endian32(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | (std::uint32_t{bytes[at + 1]} << 8) | (std::uint32_t{bytes[at + 2]} << 16) |
         (std::uint32_t{bytes[at + 3]} << 24);
}

// Offset of the chunk after one of `size` bytes that ends at `end`: `end` itself, as all readers take it, or the next
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

void note_byte_order_mark(const Container& container, const std::string& file, Notes& notes) {
  if (container.json.starts_with("\xEF\xBB\xBF"))
    notes.violation(Place::byte(file, container.json_offset), "it is skipped", "is a byte-order mark before the JSON");
}

Container open_binary(const std::vector<std::uint8_t>& bytes, const std::string& file, Notes& notes) {
  const auto refuse = [&](std::size_t at, const std::string& fault) {
    throw InputError(file, fmt::format("byte {}", at), fault);
  };
  if (bytes.size() < 12) refuse(bytes.size(), "GLB header is cut off");
  if (little_endian32(bytes, 4) == 1)
    refuse(4,
           "GLB version 1 holds glTF 1.0, which is not read; convert it to glTF 2.0, for example with gltf-pipeline");
  if (little_endian32(bytes, 4) != 2) refuse(4, fmt::format("GLB version {} is not 2", little_endian32(bytes, 4)));
  // Bytes after the stated length are not part of the asset and are ignored.
  const std::size_t length = little_endian32(bytes, 8);
  if (length > bytes.size() || length < 12)
    refuse(8, fmt::format("GLB header says {} bytes, the file has {}", length, bytes.size()));
  if (length < bytes.size())
    notes.violation(Place::byte(file, length), "they are not read",
                    "the file has {} bytes more than its GLB header says", bytes.size() - length);

  Container container;
  bool has_json = false;
  std::size_t at = 12, chunks = 0;
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
      note_byte_order_mark(container, file, notes);
      has_json = true;
    } else if (type == kJsonChunk) {
      refuse(at + 4, "a second GLB chunk is JSON");
    } else if (type == kBinaryChunk) {
      if (container.has_binary) refuse(at + 4, "a second GLB chunk is binary");
      if (chunks != 1)
        notes.violation(Place::byte(file, at + 4), "read all the same", "the binary GLB chunk is not the second one");
      container.binary.assign(begin, end);
      container.has_binary = true;
    }  // chunks of other types are to be ignored
    ++chunks;
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
  note_byte_order_mark(container, file, notes);
  return container;
}

}  // namespace tessera::scene::gltf
