#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tessera::replay {

// More bits than a float has are of no use, and Draco's tables grow with 2^bits: at 30 bits it takes seconds and
// gigabytes.
inline constexpr int kMaxBits = 24;

// How many bits quantised attributes keep. [spec] the defaults of gltf-transform and the Draco command line, with two
// bits more for positions.
struct QuantizationBits {
  int position = 16, normal = 10, texcoord = 12, color = 8, generic = 12;
};

// An attribute as a glTF accessor describes it.
struct DracoAttribute {
  std::string name;  // glTF's: decides quantisation
  int components = 3;
  int component_type = 5126;  // glTF's number
  bool normalized = false;
  std::vector<float> values;  // scalars; integers (before normalisation) as their values
  // Of floats that lie on a grid: the power of two of its step. Else they are quantised on a grid of their own extent,
  // unless they are to stay exact.
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
  std::vector<int> unique_ids;  // of the attributes, in the order of the input
};

// Compresses a triangle mesh. Sequential order keeps the numbering of vertices and triangles; edgebreaker packs better
// but renumbers both. Throws SystemError with Draco's message.
DracoOutput encode_draco(const DracoInput& input, const QuantizationBits& bits, bool sequential);

}  // namespace tessera::replay
