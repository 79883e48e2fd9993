#include "replay/pack/meshopt_encoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <meshoptimizer.h>

#include "scene/clusters.h"
#include "scene/gltf/accessor_layout.h"

namespace tessera::replay {
namespace {

namespace gltf = scene::gltf;

constexpr int kMantissaBits = 23;  // and a sign

// Elements under construction, each `stride` bytes.
struct Elements {
  std::vector<std::uint8_t> bytes;
  std::size_t stride;

  Elements(std::size_t count, std::size_t stride_in) : bytes(count * stride_in, 0), stride(stride_in) {}
  template <class T>
  void put(std::size_t element, std::size_t component, T value) {
    std::memcpy(&bytes[element * stride + component * sizeof(T)], &value, sizeof value);
  }
};

constexpr std::size_t multiple_of_4(std::size_t value) { return (value + 3) / 4 * 4; }

std::pair<float, float> range_of(const std::vector<float>& values, std::size_t components, std::size_t component) {
  float low = values[component], high = low;
  for (std::size_t i = component; i < values.size(); i += components)
    low = std::min(low, values[i]), high = std::max(high, values[i]);
  return {low, high};
}

// The grid of all components of an attribute: the grid of its largest extent.
int grid_of(const DracoAttribute& attribute, int bits) {
  const auto components = static_cast<std::size_t>(attribute.components);
  float extent = 0, farthest = 0;
  for (std::size_t c = 0; c < components; ++c) {
    const auto [low, high] = range_of(attribute.values, components, c);
    extent = std::max(extent, high - low);
    farthest = std::max({farthest, std::abs(low), std::abs(high)});
  }
  return std::max(grid_exponent(0, extent, bits), grid_exponent(0, farthest, kMantissaBits));
}

// Integers of a sign and 23 bits with a common exponent (filter 3 of KHR_meshopt_compression).
MeshoptAttribute on_grid(const DracoAttribute& attribute, std::size_t count, int exponent) {
  const auto components = static_cast<std::size_t>(attribute.components);
  Elements elements(count, 4 * components);
  MeshoptAttribute out;
  out.decoded.resize(attribute.values.size());
  for (std::size_t i = 0; i < attribute.values.size(); ++i) {
    const auto mantissa = static_cast<std::int32_t>(std::lround(std::ldexp(attribute.values[i], -exponent)));
    const std::uint32_t packed =
        (static_cast<std::uint32_t>(mantissa) & 0xFFFFFFu) | (static_cast<std::uint32_t>(exponent) << 24);
    elements.put(i / components, i % components, packed);
    out.decoded[i] = std::ldexp(static_cast<float>(mantissa), exponent);
  }
  out.stream = encode_elements(elements.bytes, elements.stride, "EXPONENTIAL");
  return out;
}

MeshoptAttribute octahedral(const DracoAttribute& attribute, std::size_t count, int bits) {
  const auto components = static_cast<std::size_t>(attribute.components);
  std::vector<float> vectors(4 * count, 0.0f);
  for (std::size_t i = 0; i < attribute.values.size(); ++i)
    vectors[4 * (i / components) + i % components] = attribute.values[i];
  const std::size_t stride = bits <= 8 ? 4 : 8;
  std::vector<std::uint8_t> bytes(count * stride);
  meshopt_encodeFilterOct(bytes.data(), count, stride, bits, vectors.data());
  return {encode_elements(bytes, stride, "OCTAHEDRAL"), bits <= 8 ? gltf::kByte : gltf::kShort, true, {}};
}

// Values in [0, 1] as normalised integers. `unit_sum`: the integers of an element add up to 1 as the values do.
MeshoptAttribute unorm(const DracoAttribute& attribute, std::size_t count, int bits, bool unit_sum) {
  const auto components = static_cast<std::size_t>(attribute.components);
  const bool bytes = bits <= 8;
  const int max = bytes ? 255 : 65535, levels = (1 << bits) - 1;
  Elements elements(count, multiple_of_4(components * (bytes ? 1 : 2)));
  for (std::size_t e = 0; e < count; ++e) {
    int integers[4] = {}, sum = 0;
    std::size_t largest = 0;
    for (std::size_t c = 0; c < components; ++c) {
      const float v = std::clamp(attribute.values[e * components + c], 0.0f, 1.0f);
      const long level = std::lround(v * static_cast<float>(levels));
      integers[c] = static_cast<int>(std::lround(static_cast<double>(level) * max / static_cast<double>(levels)));
      sum += integers[c];
      if (integers[c] > integers[largest]) largest = c;
    }
    // The largest value takes the rounding error of the sum.
    if (unit_sum && sum > 0) integers[largest] += max - sum;
    for (std::size_t c = 0; c < components; ++c) {
      if (bytes)
        elements.put(e, c, static_cast<std::uint8_t>(integers[c]));
      else
        elements.put(e, c, static_cast<std::uint16_t>(integers[c]));
    }
  }
  return {
      encode_elements(elements.bytes, elements.stride), bytes ? gltf::kUnsignedByte : gltf::kUnsignedShort, true, {}};
}

// Integers, and floats that no rule is for, as they are.
MeshoptAttribute verbatim(const DracoAttribute& attribute, std::size_t count) {
  const auto components = static_cast<std::size_t>(attribute.components);
  const std::size_t size = gltf::component_bytes(attribute.component_type);
  Elements elements(count, multiple_of_4(components * size));
  for (std::size_t i = 0; i < attribute.values.size(); ++i) {
    std::uint8_t* const at = &elements.bytes[i / components * elements.stride + i % components * size];
    if (attribute.component_type == gltf::kFloat) {
      std::memcpy(at, &attribute.values[i], size);
    } else {
      const auto integer = static_cast<std::int64_t>(attribute.values[i]);
      std::memcpy(at, &integer, size);  // little endian, two's complement
    }
  }
  return {encode_elements(elements.bytes, elements.stride), attribute.component_type, attribute.normalized,
          attribute.values};
}

bool inside_unit(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return v >= 0 && v <= 1; });
}

// Whether the values of every element add up to 1.
bool sums_to_one(const DracoAttribute& attribute) {
  const auto components = static_cast<std::size_t>(attribute.components);
  for (std::size_t i = 0; i < attribute.values.size(); i += components) {
    float sum = 0;
    for (std::size_t c = 0; c < components; ++c) sum += attribute.values[i + c];
    if (std::abs(sum - 1.0f) > 0.002f) return false;
  }
  return true;
}

}  // namespace

bool is_unit(const DracoAttribute& attribute) {
  constexpr float kRounding = 0.01f;
  const auto components = static_cast<std::size_t>(attribute.components);
  for (std::size_t i = 0; i + 2 < attribute.values.size(); i += components) {
    const float* v = &attribute.values[i];
    if (!(std::abs(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) - 1) <= kRounding)) return false;
    if (components == 4 && std::abs(v[3]) != 1) return false;
  }
  return true;
}

MeshoptStream encode_elements(std::span<const std::uint8_t> elements, std::size_t stride, const std::string& filter) {
  const std::size_t count = elements.size() / stride;
  MeshoptStream out;
  out.bytes.resize(meshopt_encodeVertexBufferBound(count, stride));
  meshopt_encodeVertexVersion(0);
  out.bytes.resize(meshopt_encodeVertexBuffer(out.bytes.data(), out.bytes.size(), elements.data(), count, stride));
  out.layout = {{"byteStride", stride}, {"count", count}, {"mode", "ATTRIBUTES"}};
  if (filter != "NONE") out.layout["filter"] = filter;
  return out;
}

MeshoptStream encode_triangles(std::span<const std::uint32_t> indices, std::size_t bytes) {
  const std::uint32_t max = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end());
  MeshoptStream out;
  meshopt_encodeIndexVersion(1);
  out.bytes.resize(meshopt_encodeIndexBufferBound(indices.size(), std::size_t{max} + 1));
  out.bytes.resize(meshopt_encodeIndexBuffer(out.bytes.data(), out.bytes.size(), indices.data(), indices.size()));
  out.layout = {{"byteStride", bytes}, {"count", indices.size()}, {"mode", "TRIANGLES"}};
  return out;
}

MeshoptStream encode_indices(std::span<const std::uint32_t> indices, std::size_t bytes) {
  const std::uint32_t max = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end());
  MeshoptStream out;
  meshopt_encodeIndexVersion(1);
  out.bytes.resize(meshopt_encodeIndexSequenceBound(indices.size(), std::size_t{max} + 1));
  out.bytes.resize(meshopt_encodeIndexSequence(out.bytes.data(), out.bytes.size(), indices.data(), indices.size()));
  out.layout = {{"byteStride", bytes}, {"count", indices.size()}, {"mode", "INDICES"}};
  return out;
}

int grid_exponent(float low, float high, int bits) {
  const double step = (static_cast<double>(high) - static_cast<double>(low)) / (std::exp2(bits) - 1);
  // Values without an extent get the least exponent of the filter.
  const int by_extent = step > 0 ? static_cast<int>(std::floor(std::log2(step))) : -100;
  const double farthest = std::max(std::abs(static_cast<double>(low)), std::abs(static_cast<double>(high)));
  const int by_mantissa =
      farthest > 0 ? static_cast<int>(std::ceil(std::log2(farthest / (std::exp2(kMantissaBits) - 1)))) : -100;
  return std::clamp(std::max(by_extent, by_mantissa), -100, 100);
}

MeshoptAttribute encode_attribute(const DracoAttribute& attribute, const QuantizationBits& bits) {
  const std::size_t count = attribute.values.size() / static_cast<std::size_t>(attribute.components);
  const std::string& name = attribute.name;
  if (attribute.component_type != gltf::kFloat || attribute.exact) return verbatim(attribute, count);
  if (name == "NORMAL" || name == "TANGENT")
    return is_unit(attribute) ? octahedral(attribute, count, std::max(bits.normal, 2)) : verbatim(attribute, count);
  if (name == "POSITION" || name.starts_with("TEXCOORD_"))
    return on_grid(attribute, count,
                   attribute.exponent ? *attribute.exponent
                                      : grid_of(attribute, name == "POSITION" ? bits.position : bits.texcoord));
  if (name.starts_with("COLOR_") && inside_unit(attribute.values)) return unorm(attribute, count, bits.color, false);
  if (name.starts_with("WEIGHTS_") && inside_unit(attribute.values))
    return unorm(attribute, count, bits.generic, sums_to_one(attribute));
  return verbatim(attribute, count);
}

void renumber_vertices(DracoInput& mesh, const std::vector<std::uint32_t>& place, std::size_t used) {
  for (DracoAttribute& attribute : mesh.attributes) {
    const auto components = static_cast<std::size_t>(attribute.components);
    std::vector<float> moved(used * components);
    for (std::size_t v = 0; v < mesh.vertex_count; ++v)
      if (place[v] != ~0u) std::copy_n(&attribute.values[v * components], components, &moved[place[v] * components]);
    attribute.values = std::move(moved);
  }
  for (std::uint32_t& index : mesh.indices) index = place[index];
  mesh.vertex_count = used;
}

std::vector<Vec3> positions_of(const DracoInput& mesh) {
  std::vector<Vec3> positions;
  for (const DracoAttribute& attribute : mesh.attributes) {
    if (attribute.name != "POSITION") continue;
    for (std::size_t i = 0; i + 2 < attribute.values.size(); i += 3)
      positions.emplace_back(attribute.values[i], attribute.values[i + 1], attribute.values[i + 2]);
  }
  return positions;
}

void order_for_meshopt(DracoInput& mesh) {
  constexpr std::size_t kMaxStreams = 16;  // that the library compares
  std::vector<meshopt_Stream> streams;
  for (const DracoAttribute& attribute : mesh.attributes) {
    const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(attribute.components);
    streams.push_back({attribute.values.data(), bytes, bytes});
  }
  std::vector<std::uint32_t> place(mesh.vertex_count);
  if (streams.size() <= kMaxStreams)
    renumber_vertices(mesh, place,
                      meshopt_generateVertexRemapMulti(place.data(), mesh.indices.data(), mesh.indices.size(),
                                                       mesh.vertex_count, streams.data(), streams.size()));
  std::vector<std::uint32_t> ordered(mesh.indices.size());
  meshopt_optimizeVertexCacheStrip(ordered.data(), mesh.indices.data(), mesh.indices.size(), mesh.vertex_count);
  scene::Primitive primitive;
  primitive.vertices.positions = positions_of(mesh);
  primitive.indices = std::move(ordered);
  mesh.indices = scene::cluster_order(primitive);
  place.resize(mesh.vertex_count);
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(place.data(), mesh.indices.data(), mesh.indices.size(), mesh.vertex_count);
  renumber_vertices(mesh, place, used);
}

}  // namespace tessera::replay
