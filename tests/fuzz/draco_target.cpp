// Any bytes as a Draco stream, decoded as one of a capture would be.
// Input: a byte of flags, points and triangles that the accessors promise (two bytes each), the stream.
#include <cmath>

#include "replay/pack/draco_encoder.h"
#include "scene/gltf/document.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {
namespace {

constexpr std::size_t kHead = 5;
// Flags: which attributes the capture asks for, by the ids 1, 2, 3 that the seeds give them.
constexpr int kNormals = 1, kTexcoords = 2, kColors = 4, kStrip = 8;

scene::gltf::DracoRequest request(Bytes input) {
  const int flags = input[0];
  const int triangles = input[3] | (input[4] << 8);
  scene::gltf::DracoRequest out;
  out.points = input[1] | static_cast<unsigned>(input[2] << 8);
  out.faces = static_cast<std::uint64_t>((flags & kStrip) != 0 ? triangles + 2 : triangles);
  const auto attribute = [&](const char* name, int components, std::uint32_t id, int component_type) {
    scene::gltf::AccessorLayout layout;
    layout.components = components;
    layout.component_type = component_type;
    layout.normalized = component_type != scene::gltf::kFloat;
    layout.count = out.points;
    out.attributes.push_back({name, id, layout});
  };
  attribute("POSITION", 3, 0, scene::gltf::kFloat);
  if ((flags & kNormals) != 0) attribute("NORMAL", 3, 1, scene::gltf::kFloat);
  if ((flags & kTexcoords) != 0) attribute("TEXCOORD_0", 2, 2, scene::gltf::kFloat);
  if ((flags & kColors) != 0) attribute("COLOR_0", 4, 3, scene::gltf::kUnsignedByte);
  return out;
}

void run(Bytes input) {
  if (input.size() < kHead) return;
  scene::MemoryBudget budget(kMaxBytes);
  expect_answer([&] {
    const scene::gltf::DecodedMesh mesh =
        scene::gltf::decode_draco(input.subspan(kHead), request(input), budget, scene::gltf::Place("stream"));
    for (const std::uint32_t index : mesh.indices) require(index < mesh.vertex_count, "an index points at no vertex");
    for (const auto& [name, values] : mesh.attributes)
      for (const float value : values) require(std::isfinite(value), "a value is not finite");
  });
}

// A grid of n x n points, closed to a tube where asked for, attributes by flags.
std::string seed(int n, int flags, bool sequential, bool tube, replay::QuantizationBits bits) {
  replay::DracoInput input;
  std::vector<float> positions, normals, texcoords, colors;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      positions.insert(positions.end(),
                       {static_cast<float>(i) * 0.37f, static_cast<float>(j), static_cast<float>(i * j % 5)});
      normals.insert(normals.end(), {i % 2 == 0 ? 0.6f : 0.0f, i % 2 == 0 ? 0.0f : -0.6f, 0.8f});
      texcoords.insert(texcoords.end(), {static_cast<float>(i) / static_cast<float>(n), static_cast<float>(j % 3)});
      colors.insert(colors.end(), {static_cast<float>(i * 20 % 256), 0, 255, static_cast<float>(j * 30 % 256)});
    }
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + (tube ? 0 : 1) < n; ++i) {
      const int right = (i + 1) % n;
      for (const int k :
           {j * n + i, j * n + right, (j + 1) * n + i, (j + 1) * n + i, j * n + right, (j + 1) * n + right})
        input.indices.push_back(static_cast<std::uint32_t>(k));
    }
  input.vertex_count = static_cast<std::size_t>(n * n);
  input.attributes.push_back({"POSITION", 3, 5126, false, positions});
  if ((flags & kNormals) != 0) input.attributes.push_back({"NORMAL", 3, 5126, false, normals});
  if ((flags & kTexcoords) != 0) input.attributes.push_back({"TEXCOORD_0", 2, 5126, false, texcoords});
  if ((flags & kColors) != 0) input.attributes.push_back({"COLOR_0", 4, 5121, true, colors});
  const replay::DracoOutput output = replay::encode_draco(input, bits, sequential);
  const std::size_t triangles = input.indices.size() / 3;
  std::string bytes = {static_cast<char>(flags), static_cast<char>(input.vertex_count & 255),
                       static_cast<char>(input.vertex_count >> 8), static_cast<char>(triangles & 255),
                       static_cast<char>(triangles >> 8)};
  return bytes.append(output.bytes.begin(), output.bytes.end());
}

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  for (const bool sequential : {true, false})
    for (const bool tube : {false, true})
      for (const int n : {2, 3, 7})
        for (const int flags : {0, int{kNormals}, kNormals | kTexcoords, kNormals | kTexcoords | kColors}) {
          all.push_back(seed(n, flags, sequential, tube, {}));
          all.push_back(seed(n, flags, sequential, tube, {0, 0, 0, 0, 0}));  // nothing is quantised
        }
  return all;
}

std::size_t mutate(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  // Most changes go to the stream behind its first bytes: method, counts and attributes decide how the rest is read.
  if (size > kHead + 11 && random() % 4 != 0) return mutate_tail(data, kHead + 11, size, max_size);
  if (size > kHead) return mutate_tail(data, kHead, size, max_size);
  return mutate_bytes(data, size, max_size);
}

}  // namespace

const Target kDracoTarget{"draco", "any bytes as a Draco stream of a capture", 4 << 10, run, seeds, mutate};

}  // namespace tessera::fuzz
