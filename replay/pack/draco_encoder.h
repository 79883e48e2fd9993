#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tessera::replay {

// Upper limit on bits. More bits than a float has are useless, and Draco's tables grow with 2^bits: at 30 bits it takes
// seconds and gigabytes.
inline constexpr int kMaxBits = 24;

// Numbers of bits of quantised attributes. [spec] the defaults of gltf-transform and the Draco command line, with two
// bits more for positions.
struct QuantizationBits {
  int position = 16, normal = 10, texcoord = 12, color = 8, generic = 12;
};

// An attribute as a glTF accessor describes it.
struct DracoAttribute {
  std::string name;  // the glTF name, which selects the quantisation
  int components = 3;
  int component_type = 5126;  // glTF's number
  bool normalized = false;
  std::vector<float> values;  // scalars; integers (before normalisation) as their values
  // For floats on a grid: the exponent of its step, a power of two. Other floats are quantised on a grid of their own
  // extent, unless they must stay exact.
  std::optional<int> exponent{};
  bool exact = false;
};

struct DracoInput {
  std::vector<std::uint32_t> indices;  // three per triangle
  std::size_t vertex_count = 0;
  std::vector<DracoAttribute> attributes;
};

struct DracoOutput {
  std::vector<std::uint8_t> bytes;
  std::vector<int> unique_ids;  // ids of the attributes, in the order of the input
};

// Compresses a triangle mesh. Sequential order keeps the numbering of vertices and triangles; edgebreaker packs better
// but renumbers both. Throws SystemError with Draco's message.
DracoOutput encode_draco(const DracoInput& input, const QuantizationBits& bits, bool sequential);

}  // namespace tessera::replay
