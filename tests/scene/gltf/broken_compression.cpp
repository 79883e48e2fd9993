// Compressed buffer views and WebP images that must be refused.
#include "base/image_codec.h"
#include "base/webp_codec.h"
#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/basis_asset.h"
#include "tests/support/meshopt_asset.h"

namespace tessera::test {
namespace {

using nlohmann::json;

std::string extension_of_view(std::size_t view, const std::string& name = "EXT_meshopt_compression") {
  return "/bufferViews/" + std::to_string(view) + "/extensions/" + name;
}

BrokenCapture meshopt(std::string name, std::function<void(GltfAsset&)> damage, std::string place,
                      std::string fault = "") {
  return {std::move(name),
          [damage = std::move(damage)](const std::filesystem::path& folder) {
            GltfAsset asset = meshopt_asset();
            damage(asset);
            return put(folder, "capture.glb", asset.glb());
          },
          std::move(place), std::move(fault)};
}

// One member of the extension of a view; the message names the member unless `place` is given.
BrokenCapture member(std::string name, std::size_t view, const char* key, json value, std::string fault = "",
                     std::string place = "") {
  if (place.empty()) place = extension_of_view(view) + "/" + key;
  return meshopt(
      std::move(name), [=](GltfAsset& a) { meshopt_member(a, view)[key] = value; }, std::move(place), std::move(fault));
}

constexpr std::size_t kPositionView = 0, kIndexView = 3;

// A byte of a view's stream.
BrokenCapture byte_of_stream(std::string name, std::size_t view, std::size_t byte, std::uint8_t value,
                             std::string fault) {
  return meshopt(
      std::move(name),
      [=](GltfAsset& a) { a.binary[meshopt_member(a, view)["byteOffset"].get<std::size_t>() + byte] = value; },
      extension_of_view(view), std::move(fault));
}

BrokenClass streams() {
  BrokenClass out{"MeshoptStreamBroken",
                  {
                      byte_of_stream("attributes_version_2", kPositionView, 0, 0xA2, "begins with 0xa2"),
                      byte_of_stream("attributes_are_indices", kPositionView, 0, 0xD1, "begins with 0xd1"),
                      byte_of_stream("indices_are_triangles", kIndexView, 0, 0xE1, "begins with 0xe1"),
                      byte_of_stream("header_asks_for_more", kPositionView, 1, 0xFF, "ends before"),
                      member("mode_of_indices_for_attributes", kPositionView, "mode", "INDICES", "",
                             extension_of_view(kPositionView)),
                      meshopt(
                          "index_out_of_range",
                          [](GltfAsset& a) {
                            // The delta of the first index: twice zigzag, twice baseline.
                            a.binary[meshopt_member(a, kIndexView)["byteOffset"].get<std::size_t>() + 1] = 0x7C;
                          },
                          "/accessors/" + std::to_string(kIndices), "there are 4 vertices"),
                      meshopt(
                          "a_byte_too_many",
                          [](GltfAsset& a) {
                            json& e = meshopt_member(a, kPositionView);
                            e["byteLength"] = e["byteLength"].get<int>() + 1;
                          },
                          extension_of_view(kPositionView), "more than"),
                      meshopt(
                          "elements_without_data",
                          [](GltfAsset& a) {
                            meshopt_member(a, kPositionView)["count"] = 1 << 28;
                            a.document["bufferViews"][0]["byteLength"] = 1ull << 30;
                            a.document["buffers"][1]["byteLength"] = 1ull << 31;
                          },
                          extension_of_view(kPositionView), "too few"),
                  }};
  for (const std::size_t view : {kPositionView, kIndexView})
    for (const std::size_t length : {1u, 2u, 5u, 9u})
      out.captures.push_back(member("view_" + std::to_string(view) + "_cut_to_" + std::to_string(length), view,
                                    "byteLength", length, "", extension_of_view(view)));
  return out;
}

BrokenCapture webp(std::string name, std::string bytes, std::string fault = "") {
  return damaged(
      std::move(name), [bytes](GltfAsset& a) { a.document["images"][0]["bufferView"] = a.add_view(bytes_of(bytes)); },
      "/images/0", std::move(fault));
}

BrokenClass images() {
  Image8 frame_image(16, 16, 4);
  for (std::size_t i = 0; i < frame_image.values.size(); ++i)
    frame_image.values[i] = static_cast<std::uint8_t>(i * i % 251);
  const std::string lossy = encode_webp(frame_image, 50, false), lossless = encode_webp(frame_image, 0, true);
  // The same image with another length in its head.
  const auto says = [](std::string bytes, std::uint32_t length) {
    return bytes.replace(4, 4, little_endian32(length));
  };
  std::string animated = "RIFF" + little_endian32(4 + 18 + 14) + "WEBP" + "VP8X" + little_endian32(10) +
                         std::string("\x02\0\0\0\x0F\0\0\x0F\0\0", 10) + "ANIM" + little_endian32(6) +
                         std::string(6, '\0');
  std::string twice = lossless + lossless.substr(12);
  twice = says(twice, static_cast<std::uint32_t>(twice.size() - 8));
  std::string damaged_bits = lossless;
  for (std::size_t i = 26; i < 60; ++i) damaged_bits[i] = '\x7F';
  return {"WebpImageBroken",
          {
              webp("signature_only", lossy.substr(0, 12), "head"),
              webp("lossy_cut", lossy.substr(0, lossy.size() / 2), "the file has"),
              webp("lossless_cut", lossless.substr(0, lossless.size() - 2), "the file has"),
              webp("chunk_longer_than_file", lossless.substr(0, 16) + "\xFF\xFF\xFF\x7F" + lossless.substr(20),
                   "longer than the file"),
              webp("length_of_nothing", says(lossy, 0), "says 0 bytes"),
              webp("no_image", "RIFF" + little_endian32(12) + "WEBPEXIF" + little_endian32(0), "0 images"),
              webp("two_images", twice, "2 images"),
              webp("animated", animated, "animated"),
              webp("bits_damaged", damaged_bits, "cannot be decoded"),
          }};
}

BrokenCapture ktx2(std::string name, const std::string& bytes, std::string fault = "") {
  return damaged(
      std::move(name),
      [bytes](GltfAsset& a) {
        a = basis_texture_asset(bytes);
        a.document["textures"][0].erase("source");
      },
      "/images/1", std::move(fault));
}

BrokenClass basis_images() {
  const std::string etc1s = basis_file("etc1s_disc_mips_64"), uastc = basis_file("uastc_soft_mips_32"),
                    zstandard = basis_file("uastc_zstd_cloud_32");
  const auto with = [](std::string bytes, std::size_t at, char value) {
    bytes[at] = value;
    return bytes;
  };
  std::string damaged_zstandard = zstandard;
  const std::size_t frame = zstandard.rfind("\x28\xB5\x2F\xFD");  // begins with its magic number
  damaged_zstandard.at(frame) = '\x7F';
  return {"Ktx2ImageBroken",
          {
              ktx2("signature_only", etc1s.substr(0, 12)),
              ktx2("etc1s_cut", etc1s.substr(0, etc1s.size() / 2)),
              ktx2("uastc_cut", uastc.substr(0, uastc.size() - 1)),
              ktx2("not_a_basis_format", with(uastc, 12, 37)),
              ktx2("no_width", with(uastc, 20, 0)),
              ktx2("three_dimensional", with(uastc, 28, 2)),
              ktx2("supercompression_unknown", with(uastc, 44, 9)),
              ktx2("zstandard_damaged", damaged_zstandard, "does not unpack"),
              strictly(ktx2("a_png", encode_png(Image8(4, 4, 3)), "is no KTX2 image")),
              strictly(damaged(
                  "named_as_a_plain_source",
                  [etc1s](GltfAsset& a) {
                    a = basis_texture_asset(etc1s);
                    a.document["textures"][0] = {{"source", 1}};
                  },
                  "/images/1", "only KHR_texture_basisu")),
          }};
}

}  // namespace

std::vector<BrokenClass> broken_compression() { return {streams(), images(), basis_images()}; }

}  // namespace tessera::test
