#include "tests/fuzz/document_mutator.h"

#include <cmath>
#include <cstring>

#include "tests/support/gltf_asset.h"

namespace tessera::fuzz {
namespace {

using nlohmann::json;

constexpr int kDeepest = 200;  // levels that recursive walks of this file are asked to take

// A value and the object or array that holds it.
struct Spot {
  json* value = nullptr;
  json* parent = nullptr;
  std::string key;        // of an object
  std::size_t index = 0;  // of an array
};

void collect(json& value, std::vector<Spot>& spots) {
  if (value.is_object()) {
    for (auto at = value.begin(); at != value.end(); ++at) {
      spots.push_back({&at.value(), &value, at.key(), 0});
      collect(at.value(), spots);
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      spots.push_back({&value[i], &value, "", i});
      collect(value[i], spots);
    }
  }
}

template <class List>
const auto& pick(const List& list, Generator& random) {
  return list[random() % std::size(list)];
}

json interesting_value(Generator& random) {
  static const std::vector<json> kValues = {0,
                                            -1,
                                            1,
                                            2,
                                            3,
                                            7,
                                            255,
                                            256,
                                            65535,
                                            65536,
                                            2147483647,
                                            2147483648ll,
                                            4294967295ll,
                                            4294967296ll,
                                            9007199254740993ll,
                                            -9223372036854775807ll,
                                            18446744073709551615ull,
                                            0.0,
                                            -0.0,
                                            0.5,
                                            -0.5,
                                            1e-45,
                                            1e-310,
                                            1e-7,
                                            1e7,
                                            1e20,
                                            3.4028234663852886e38,
                                            3.5e38,
                                            1e308,
                                            -1e308,
                                            5120,
                                            5121,
                                            5123,
                                            5125,
                                            5126,
                                            true,
                                            false,
                                            nullptr,
                                            "",
                                            "a",
                                            "../a",
                                            "MASK",
                                            "BLEND",
                                            "SCALAR",
                                            "VEC3",
                                            "MAT4",
                                            "data:;base64,AAAA",
                                            "beside.bin",
                                            "pointer",
                                            "/materials/0/pbrMetallicRoughness/baseColorFactor",
                                            "/nodes/1/translation",
                                            "/cameras/0/perspective/znear",
                                            "16x16",
                                            "0:1",
                                            json::object(),
                                            json::array(),
                                            json::array({0, 0, 0}),
                                            json::array({0, 1, 0, 0})};
  return pick(kValues, random);
}

std::string interesting_name(const std::vector<Spot>& spots, Generator& random) {
  static const std::vector<std::string> kNames = {"extensions",
                                                  "extras",
                                                  "TESSERA_procedure",
                                                  "TESSERA_bezier_patches",
                                                  "TESSERA_subdivision_surface",
                                                  "TESSERA_displacement",
                                                  "TESSERA_lens",
                                                  "TESSERA_capture",
                                                  "KHR_draco_mesh_compression",
                                                  "KHR_texture_transform",
                                                  "KHR_lights_punctual",
                                                  "KHR_materials_unlit",
                                                  "KHR_materials_variants",
                                                  "KHR_animation_pointer",
                                                  "KHR_node_visibility",
                                                  "pointer",
                                                  "mappings",
                                                  "variants",
                                                  "shadows",
                                                  "attachments",
                                                  "passes",
                                                  "subpasses",
                                                  "sample",
                                                  "visible",
                                                  "TEXCOORD_1",
                                                  "sparse",
                                                  "byteStride",
                                                  "normalized",
                                                  "targets",
                                                  "weights",
                                                  "matrix",
                                                  "uri",
                                                  "bufferView",
                                                  "min",
                                                  "max",
                                                  "skin",
                                                  "children",
                                                  "mode",
                                                  "range",
                                                  "factor",
                                                  "step",
                                                  "keys",
                                                  "values"};
  if (!spots.empty() && random() % 2 == 0) {
    const Spot& spot = pick(spots, random);
    if (!spot.key.empty()) return spot.key;
  }
  return pick(kNames, random);
}

// A whole number and another one, wrapping around.
std::int64_t stepped(const json& value, std::uint64_t by) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(value.get<std::int64_t>()) + by);
}

json changed_number(const json& value, Generator& random) {
  const double number = value.get<double>();
  switch (random() % 6) {
    case 0:
      return value.is_number_integer() ? json(stepped(value, 1)) : json(std::nextafter(number, 1e300));
    case 1:
      return value.is_number_integer() ? json(stepped(value, ~std::uint64_t{0})) : json(number - 1);
    case 2:
      return number * 2;
    case 3:
      return -number;
    case 4:
      return random() % 16;
    default:
      return number / 3;
  }
}

std::string changed_text(std::string text) {
  const std::size_t size = text.size();
  text.resize(size + 8);
  text.resize(mutate_bytes(reinterpret_cast<std::uint8_t*>(text.data()), size, text.size()));
  return text;
}

void erase(const Spot& spot) {
  if (spot.parent->is_object())
    spot.parent->erase(spot.key);
  else
    spot.parent->erase(spot.index);
}

void change_one(json& document, Generator& random) {
  std::vector<Spot> spots;
  collect(document, spots);
  if (spots.empty()) {
    document = {{"asset", {{"version", "2.0"}}}};
    return;
  }
  const Spot& spot = pick(spots, random);
  switch (random() % 10) {
    case 0:
    case 1:
      *spot.value = interesting_value(random);
      break;
    case 2:
    case 3:
      if (spot.value->is_number())
        *spot.value = changed_number(*spot.value, random);
      else if (spot.value->is_string())
        *spot.value = changed_text(spot.value->get<std::string>());
      else if (spot.value->is_boolean())
        *spot.value = !spot.value->get<bool>();
      else
        *spot.value = interesting_value(random);
      break;
    case 4:
      erase(spot);
      break;
    case 5: {
      const json copy = *pick(spots, random).value;
      *spot.value = copy;
      break;
    }
    case 6: {
      const json copy = *spot.value;
      if (spot.parent->is_array())
        spot.parent->push_back(copy);
      else
        (*spot.parent)[interesting_name(spots, random)] = copy;
      break;
    }
    case 7:
      if (spot.value->is_object()) {
        const json copy = random() % 2 == 0 ? interesting_value(random) : *pick(spots, random).value;
        (*spot.value)[interesting_name(spots, random)] = copy;
      } else if (spot.value->is_array()) {
        spot.value->push_back(interesting_value(random));
      } else {
        *spot.value = interesting_value(random);
      }
      break;
    case 8: {
      // Indices are most of a glTF document: another object of the same kind, or the first beyond the last.
      if (spot.value->is_number_integer())
        *spot.value = random() % 24;
      else
        *spot.value = interesting_value(random);
      break;
    }
    default: {
      if (spot.value->is_array() && spot.value->size() > 1)
        std::swap((*spot.value)[random() % spot.value->size()], (*spot.value)[random() % spot.value->size()]);
      else if (spot.value->is_number())
        *spot.value = changed_number(*spot.value, random);
      break;
    }
  }
}

std::string text_of(const json& document) { return document.dump(-1, ' ', false, json::error_handler_t::replace); }

std::uint32_t little_endian(Bytes bytes, std::size_t at) {
  return bytes[at] | (std::uint32_t{bytes[at + 1]} << 8) | (std::uint32_t{bytes[at + 2]} << 16) |
         (std::uint32_t{bytes[at + 3]} << 24);
}

}  // namespace

void mutate_document(json& document, Generator& random) {
  for (unsigned left = 1 + random() % 3; left > 0; --left) change_one(document, random);
}

std::optional<json> parse_document(Bytes bytes) {
  int depth = 0;
  for (const std::uint8_t b : bytes) {
    if (b == '{' || b == '[') ++depth;
    if (b == '}' || b == ']') --depth;
    if (depth > kDeepest) return std::nullopt;
  }
  json document = json::parse(bytes.begin(), bytes.end(), nullptr, false);
  if (document.is_discarded()) return std::nullopt;
  return document;
}

std::optional<std::size_t> store(const std::string& text, std::uint8_t* data, std::size_t max_size) {
  if (text.size() > max_size) return std::nullopt;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

std::size_t mutate_tail(std::uint8_t* data, std::size_t first, std::size_t size, std::size_t max_size) {
  return first + mutate_bytes(data + first, size - first, max_size - first);
}

std::size_t mutate_json(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  std::optional<json> document = parse_document({data, size});
  if (!document) return mutate_bytes(data, size, max_size);
  mutate_document(*document, random);
  const std::optional<std::size_t> stored = store(text_of(*document), data, max_size);
  return stored ? *stored : mutate_bytes(data, size, max_size);
}

std::size_t mutate_capture(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  const Bytes bytes(data, size);
  if (size < 20 || std::memcmp(data, "glTF", 4) != 0) return mutate_json(data, size, max_size, random);
  const std::size_t json_bytes = little_endian(bytes, 12);
  if (json_bytes > size - 20) return mutate_bytes(data, size, max_size);
  std::optional<json> document = parse_document(bytes.subspan(20, json_bytes));
  if (!document) return mutate_bytes(data, size, max_size);
  const std::size_t binary_at = std::min(size, 20 + json_bytes + 8);
  std::vector<std::uint8_t> binary(bytes.begin() + static_cast<std::ptrdiff_t>(binary_at), bytes.end());
  if (random() % 3 == 0 && !binary.empty()) {
    const std::size_t room = binary.size() + 64;
    const std::size_t before = binary.size();
    binary.resize(room);
    binary.resize(mutate_bytes(binary.data(), before, room));
    if (random() % 2 == 0 && document->is_object() && document->contains("buffers") &&
        (*document)["buffers"].is_array() && !(*document)["buffers"].empty() && (*document)["buffers"][0].is_object())
      (*document)["buffers"][0]["byteLength"] = binary.size();
  } else {
    mutate_document(*document, random);
  }
  const std::optional<std::size_t> stored = store(test::make_glb(text_of(*document), binary), data, max_size);
  return stored ? *stored : mutate_bytes(data, size, max_size);
}

}  // namespace tessera::fuzz
