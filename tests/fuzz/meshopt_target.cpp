// Any bytes as a stream of a compressed buffer view, by itself and inside an otherwise sound capture.
// Input: mode and filter, stride (each a byte), count (two bytes), the stream.
#include "replay/pack/meshopt_encoder.h"
#include "scene/capture_reader.h"
#include "scene/gltf/meshopt_codec.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/sound_capture.h"
#include "tests/support/captures.h"
#include "tests/support/gltf_asset.h"

namespace tessera::fuzz {
namespace {

using nlohmann::json;

constexpr std::size_t kHead = 4;
constexpr const char* kModes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
constexpr const char* kFilters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"};

struct Head {
  int mode, filter, stride, count;
};

Head head_of(Bytes input) { return {input[0] % 3, input[0] / 3 % 5, input[1], input[2] | (input[3] << 8)}; }

// Attributes are positions of the type that fills the stride; indices refer to 300 points.
std::string wrap(const Head& head, Bytes stream) {
  test::GltfAsset asset;
  const int view = asset.add_view(stream);
  json& object = asset.document["bufferViews"][static_cast<std::size_t>(view)];
  json extension = object;
  extension.update({{"byteStride", head.stride},
                    {"count", head.count},
                    {"mode", kModes[head.mode]},
                    {"filter", kFilters[head.filter]}});
  object.update({{"buffer", 1},
                 {"byteOffset", 0},
                 {"byteLength", head.stride * head.count},
                 {"extensions", {{"KHR_meshopt_compression", extension}}}});
  json primitive;
  if (head.mode == 0) {
    object["byteStride"] = head.stride;
    const int type = head.stride >= 12 ? 5126 : head.stride >= 8 ? 5122 : 5120;
    primitive["attributes"]["POSITION"] = asset.add(
        "accessors", {{"bufferView", view}, {"componentType", type}, {"type", "VEC3"}, {"count", head.count}});
  } else {
    primitive["attributes"]["POSITION"] = asset.add_accessor("VEC3", std::vector<float>(900, 1.0f));
    primitive["indices"] = asset.add("accessors", {{"bufferView", view},
                                                   {"componentType", head.stride == 2 ? 5123 : 5125},
                                                   {"type", "SCALAR"},
                                                   {"count", head.count}});
  }
  asset.add("buffers", {{"byteLength", 1 << 24}});
  asset.add("meshes", {{"primitives", json::array({primitive})}});
  asset.add("nodes", {{"mesh", 0}});
  asset.document["extensionsUsed"] = {"KHR_mesh_quantization", "KHR_meshopt_compression"};
  return asset.glb();
}

void run(Bytes input) {
  if (input.size() <= kHead) return;
  static const std::filesystem::path kFile = scratch_folder() / "meshopt.glb";
  const Head head = head_of(input);
  write_scratch(kFile, wrap(head, input.subspan(kHead)));
  scene::CaptureLimits limits;
  limits.max_bytes = kMaxBytes;
  expect_answer([&] { require_sound(scene::read_capture(kFile, limits)); });
}

std::string seed(int mode, int filter, std::size_t stride, const std::vector<std::uint8_t>& stream, std::size_t count) {
  std::string out = {static_cast<char>(mode + 3 * filter), static_cast<char>(stride), static_cast<char>(count & 255),
                     static_cast<char>(count >> 8)};
  return out.append(stream.begin(), stream.end());
}

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (const std::size_t stride : {4u, 8u, 12u, 16u})
    for (const std::size_t count : {1u, 20u, 300u})
      for (int filter = 0; filter < 5; ++filter) {
        std::vector<std::uint8_t> elements(stride * count);
        for (std::size_t i = 0; i < elements.size(); ++i)
          elements[i] = static_cast<std::uint8_t>(filter == 0 ? i / stride * 3 : i % 4 == 2 ? 127 : i / stride % 128);
        all.push_back(seed(0, filter, stride, replay::encode_elements(elements, stride).bytes, count));
      }
  // Version 1: zeros of every way of saying so.
  for (const int controls : {0x00, 0x55, 0xAA, 0xFF}) {
    std::vector<std::uint8_t> stream = {0xA1, static_cast<std::uint8_t>(controls)};
    stream.resize(stream.size() + (controls == 0x00 ? 4 : controls == 0x55 ? 12 : controls == 0xAA ? 0 : 16), 0);
    stream.resize(stream.size() + 24, 0);
    all.push_back(seed(0, 0, 4, stream, controls == 0xFF ? 4 : 16));
    stream.back() = 0x32;
    all.push_back(seed(0, 0, 4, stream, controls == 0xFF ? 4 : 16));
  }
  std::vector<std::uint32_t> indices;
  for (std::uint32_t t = 0; t < 90; ++t) {
    for (const std::uint32_t k : {0u, 1u + t % 2, 2u - t % 2}) indices.push_back(t * (t % 11 == 0 ? 2 : 1) + k);
    if (t % 9 == 0)
      for (const std::size_t bytes : {2u, 4u}) {
        all.push_back(seed(1, 0, bytes, replay::encode_triangles(indices, bytes).bytes, indices.size()));
        all.push_back(seed(2, 0, bytes, replay::encode_indices(indices, bytes).bytes, indices.size()));
      }
  }
  return all;
}

std::size_t mutate(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size > kHead && random() % 8 != 0) return mutate_tail(data, kHead, size, max_size);
  return mutate_bytes(data, size, max_size);
}

}  // namespace

const Target kMeshoptTarget{
    "meshopt", "any bytes as a compressed buffer view inside a sound capture", 4 << 10, run, seeds, mutate};

}  // namespace tessera::fuzz
