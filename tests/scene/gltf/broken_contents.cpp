#include <zlib.h>

#include "base/image_codec.h"
#include "captures/sources/jpeg_writer.h"
#include "replay/pack/draco_encoder.h"
#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

using captures::encode_jpeg;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

template <class T>
BrokenCapture poked(std::string name, int accessor, std::size_t scalar, T value, std::string fault,
                    std::string place = "") {
  if (place.empty()) place = "/accessors/" + std::to_string(accessor);
  return damaged(
      std::move(name), [=](GltfAsset& a) { a.poke(accessor, scalar, value); }, std::move(place), std::move(fault));
}

BrokenClass values() {
  return {"BufferValueForbidden",
          {
              poked("position_nan", kPositions, 4, kNaN, "element 1"),
              poked("position_infinite", kPositions, 11, kInfinity, "element 3"),
              poked("normal_nan", kNormals, 0, kNaN, "finite"),
              poked("texcoord_infinite", kTexcoords, 3, -kInfinity, "finite"),
              poked("weight_nan", kWeights, 0, kNaN, "finite"),
              poked("weight_negative", kWeights, 1, -0.5f, "negative", "/meshes/0/primitives/0/attributes/WEIGHTS_0"),
              poked("morph_nan", kMorph, 2, kNaN, "finite"),
              poked("inverse_bind_nan", kInverseBind, 16, kNaN, "finite"),
              poked("inverse_bind_projective", kInverseBind, 3, 1.0f, "last row", "/skins/0/inverseBindMatrices"),
              poked("key_time_nan", kTimes, 1, kNaN, "finite"),
              poked("key_time_infinite", kTimes, 2, kInfinity, "finite"),
              strictly(poked("key_time_negative", kTimes, 0, -0.5f, "negative")),
              strictly(poked("key_times_equal", kTimes, 1, 0.0f, "increase")),
              poked("key_times_decrease", kTimes, 2, 0.25f, "increase"),
              poked("translation_key_nan", kTranslations, 3, kNaN, "finite"),
              poked("spline_tangent_infinite", kSpline, 0, kInfinity, "finite"),
              poked("morph_weight_key_nan", kMorphWeights, 1, kNaN, "finite"),
              damaged(
                  "rotation_key_zero", [](GltfAsset& a) { a.poke(kRotations, 3, 0.0f); },
                  "/accessors/" + std::to_string(kRotations), "rotation"),
              poked("index_out_of_range", kIndices, 3, std::uint16_t{4}, "there are 4 vertices"),
              strictly(poked("index_restarts_strip", kIndices, 5, std::uint16_t{0xFFFF}, "65535")),
              poked("joint_out_of_range", kJoints, 1 + 4, std::uint8_t{2}, "joint 2", "/nodes/1"),
              poked("control_point_nan", kControlPoints, 0, kNaN, "finite"),
              strictly(damaged(
                  "position_nan_that_no_index_names",
                  [](GltfAsset& a) {
                    for (const int index : {0, 1, 2})
                      a.poke(kIndices, static_cast<std::size_t>(index) + 3, std::uint16_t(index));
                    a.poke(kPositions, 9, kNaN);
                  },
                  "/accessors/" + std::to_string(kPositions), "element 3 is not a finite number")),
              damaged(
                  "sparse_value_nan",
                  [](GltfAsset& a) {
                    const int view = a.document["accessors"][kControlPoints]["sparse"]["values"]["bufferView"];
                    std::memcpy(&a.binary[a.first_byte_of_view(view)], &kNaN, 4);
                  },
                  "/accessors/" + std::to_string(kControlPoints), "finite"),
          }};
}

// Strides of views that hold no vertices, and indices of sparse accessors.
BrokenClass strides() {
  return {"ViewOrAccessorOutOfRange",
          {
              strictly(damaged(
                  "stride_not_multiple_of_4",
                  [](GltfAsset& a) {
                    const std::vector<std::uint16_t> pairs(16, 7);
                    const int view =
                        a.add_view({reinterpret_cast<const std::uint8_t*>(pairs.data()), 32}, {{"byteStride", 6}});
                    a.add("accessors", {{"bufferView", view}, {"componentType", 5123}, {"type", "VEC2"}, {"count", 4}});
                  },
                  "/byteStride", "is not a multiple of 4")),
              strictly(damaged(
                  "stride_of_indices_as_they_are",
                  [](GltfAsset& a) {
                    const std::vector<std::uint32_t> list = {0, 1, 2, 2, 1, 3};
                    a.document["meshes"][0]["primitives"][0]["indices"] = a.add_accessor("SCALAR", list);
                    a.document["bufferViews"].back()["byteStride"] = 4;
                  },
                  "/meshes/0/primitives/0/indices", "byteStride")),
          }};
}

BrokenClass sparse_indices() {
  const auto index = [&](const char* name, std::uint16_t first, std::uint16_t second) {
    return damaged(
        name,
        [=](GltfAsset& a) {
          const int view = a.document["accessors"][kControlPoints]["sparse"]["indices"]["bufferView"];
          std::memcpy(&a.binary[a.first_byte_of_view(view)], &first, 2);
          std::memcpy(&a.binary[a.first_byte_of_view(view) + 2], &second, 2);
        },
        "/accessors/" + std::to_string(kControlPoints) + "/sparse/indices");
  };
  return {"SparseAccessorBroken",
          {index("index_out_of_range", 5, 16), index("index_minus_1", 5, 0xFFFF), index("indices_equal", 5, 5),
           index("indices_decrease", 6, 5)}};
}

BrokenClass long_cycles() {
  const auto cycle = [](const char* name, int length) {
    return damaged(
        name,
        [=](GltfAsset& a) {
          for (int i = 0; i < length; ++i) a.add("nodes", {{"children", {8 + (i + 1) % length}}});
        },
        "/nodes/", "ancestor");
  };
  return {"NodeGraphThatIsNoForest", {cycle("cycle_of_many", 1000), cycle("long_chain_into_a_cycle", 100000)}};
}

// ---- Draco ------------------------------------------------------------------------------------------------------

const std::string kExtension = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";

BrokenCapture draco(std::string name, bool sequential, std::function<void(GltfAsset&)> damage, std::string place = "",
                    std::string fault = "") {
  return {std::move(name),
          [=](const std::filesystem::path& folder) {
            GltfAsset asset = draco_asset(sequential);
            damage(asset);
            return put(folder, "capture.glb", asset.glb());
          },
          place.empty() ? kExtension : place, std::move(fault)};
}

// The stream replaced by these bytes.
BrokenCapture draco_stream(std::string name, std::string stream, std::string fault = "") {
  return draco(
      std::move(name), true,
      [stream](GltfAsset& a) {
        a.document["bufferViews"][0] =
            a.document["bufferViews"][static_cast<std::size_t>(a.add_view(bytes_of(stream)))];
      },
      "", std::move(fault));
}

std::string varint(std::uint64_t value) {
  std::string out;
  for (; value > 0x7F; value >>= 7) out.push_back(static_cast<char>((value & 0x7F) | 0x80));
  out.push_back(static_cast<char>(value));
  return out;
}

// Head of a stream of bit-stream version 2.2: type 0 point cloud, 1 mesh; method 0 sequential, 1 edgebreaker.
std::string draco_head(int type, int method, int flags = 0, int minor = 2) {
  std::string head = "DRACO";
  for (const int byte : {2, minor, type, method, flags & 0xFF, flags >> 8}) head.push_back(static_cast<char>(byte));
  return head;
}

BrokenClass truncated_draco() {
  BrokenClass out{"DracoStreamThatIsCutOff", {}};
  for (const bool sequential : {true, false}) {
    const std::size_t size = draco_asset(sequential).binary.size();
    for (std::size_t length = 1; length + 1 < size; length += length < 16 ? 3 : 9)
      out.captures.push_back(draco(std::string(sequential ? "sequential_" : "edgebreaker_") + std::to_string(length),
                                   sequential,
                                   [=](GltfAsset& a) { a.document["bufferViews"][0]["byteLength"] = length; }));
  }
  return out;
}

BrokenClass broken_draco() {
  const std::string huge = varint(0xFFFFFFFFu), zeros(64, '\0');
  const auto poke_byte = [](std::size_t at, std::uint8_t value) { return [=](GltfAsset& a) { a.binary[at] = value; }; };
  return {
      "DracoStreamBroken",
      {
          draco("magic", true, poke_byte(0, 'X')),
          draco(
              "version_1_5", true, [](GltfAsset& a) { a.binary[5] = 1, a.binary[6] = 5; }, "", "2.2"),
          draco("version_2_1", true, poke_byte(6, 1), "", "2.2"),
          draco("version_9", true, poke_byte(5, 9), "", "2.2"),
          draco("point_cloud", true, poke_byte(7, 0), "", "not a Draco mesh"),
          draco("geometry_type_unknown", true, poke_byte(7, 7)),
          draco("method_unknown", true, poke_byte(8, 9)),
          draco("method_of_the_other_kind", true, poke_byte(8, 1)),
          draco(
              "plain_attribute_of_another_count", true,
              [](GltfAsset& a) {
                const int plain = a.add_accessor<float>("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
                for (const int k : {0, 1}) a.document["accessors"][static_cast<std::size_t>(k)]["count"] = 3;
                a.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = plain;
              },
              "/meshes/0/primitives/0/attributes/NORMAL"),
          draco_stream("garbage", std::string(200, 'x')),
          draco_stream("faces_2_to_32", draco_head(1, 0) + huge + varint(3) + zeros),
          draco_stream("points_2_to_32", draco_head(1, 0) + varint(2) + huge + zeros),
          draco_stream("edgebreaker_faces_2_to_32", draco_head(1, 1) + std::string(1, '\0') + varint(4) + huge + zeros),
          draco_stream("edgebreaker_points_2_to_32",
                       draco_head(1, 1) + std::string(1, '\0') + huge + varint(2) + zeros),
          draco_stream("varint_without_end", draco_head(1, 0) + std::string(40, '\xFF')),
          draco_stream("nothing_after_head", draco_head(1, 0)),
          draco_stream("no_faces", draco_head(1, 0) + varint(0) + varint(0) + zeros),
          draco_stream("metadata_huge", draco_head(1, 0, 0x8000) + huge + std::string(64, '\xFF')),
      }};
}

// ---- Images -----------------------------------------------------------------------------------------------------

std::string png_chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto crc =
      static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
  std::string out;
  for (const std::uint32_t value : {static_cast<std::uint32_t>(data.size()), crc}) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<char>((value >> shift) & 0xFF));
  }
  return out.substr(0, 4) + body + out.substr(4);
}

// A grey PNG of this size, of which `raw_bytes` zeros are stored.
std::string grey_png(std::uint32_t side, std::size_t raw_bytes) {
  std::string head;
  for (int k = 0; k < 2; ++k)
    for (int shift = 24; shift >= 0; shift -= 8) head.push_back(static_cast<char>((side >> shift) & 0xFF));
  head += std::string("\x08\0\0\0\0", 5);
  const std::string raw(raw_bytes, '\0');
  std::string packed(compressBound(static_cast<uLong>(raw.size())), '\0');
  uLongf size = packed.size();
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()),
            static_cast<uLong>(raw.size()), 9);
  packed.resize(size);
  return "\x89PNG\r\n\x1A\n" + png_chunk("IHDR", head) + png_chunk("IDAT", packed) + png_chunk("IEND", "");
}

// `bytes` makes the image when the capture is written: some unpack to hundreds of megabytes.
BrokenCapture image_from(std::string name, std::function<std::string()> bytes, std::string fault, int status = 3) {
  BrokenCapture out = damaged(
      std::move(name), [bytes](GltfAsset& a) { a.document["images"][0]["bufferView"] = a.add_view(bytes_of(bytes())); },
      "/images/0", std::move(fault));
  out.status = status;
  return out;
}
BrokenCapture image(std::string name, std::string bytes, std::string fault = "") {
  return image_from(
      std::move(name), [bytes] { return bytes; }, std::move(fault));
}

BrokenClass images_and_textures() {
  const Image8 frame_image(16, 16, 3);
  const std::string png = encode_png(frame_image), jpeg = encode_jpeg(frame_image, 90);
  std::string bad_crc = png, bad_pixels = grey_png(16, 16 * 17);
  bad_crc[40] = static_cast<char>(bad_crc[40] ^ 1);
  std::string stored = "\x78\x9C" + std::string(20, '\xFF');
  bad_pixels = bad_pixels.substr(0, 33) + png_chunk("IDAT", stored) + png_chunk("IEND", "");
  return {"ImageBroken",
          {
              image("not_an_image", "GIF89a, and more text", "neither PNG"),
              image("png_signature_only", png.substr(0, 8)),
              image("png_header_cut", png.substr(0, 20)),
              image("png_pixels_cut", png.substr(0, png.size() / 2)),
              image("png_end_missing", png.substr(0, png.size() - 12)),
              image("png_checksum", bad_crc, "checksum"),
              image("png_pixels_not_deflated", bad_pixels),
              image("png_too_few_pixels", grey_png(16, 100)),
              image("png_says_65535_a_side", grey_png(65535, 1000)),
              image("png_of_size_zero", grey_png(0, 10)),
              image_from(
                  "png_inflates_beyond_its_size", [] { return grey_png(1, 256 << 20); }, "more"),
              image_from(
                  "png_really_20000_a_side", [] { return grey_png(20000, 20000ull * 20001ull); }, "limit", 4),
              image("jpeg_header_only", jpeg.substr(0, 4)),
              image("jpeg_segments_cut", jpeg.substr(0, 100)),
              image("jpeg_pixels_cut", jpeg.substr(0, jpeg.size() - 20)),
              image("jpeg_end_missing", jpeg.substr(0, jpeg.size() - 2)),
          }};
}

}  // namespace

std::vector<BrokenClass> broken_contents() {
  return {values(),          strides(),      sparse_indices(),     long_cycles(),
          truncated_draco(), broken_draco(), images_and_textures()};
}

}  // namespace tessera::test
