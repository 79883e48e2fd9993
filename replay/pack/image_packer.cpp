#include "replay/pack/image_packer.h"

#include <array>
#include <map>
#include <vector>

#include "base/color.h"
#include "base/image_codec.h"
#include "base/ktx2/ktx2.h"
#include "base/ktx2/ktx2_writer.h"
#include "base/webp_codec.h"
#include "shaders_cpp/texture.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr const char *kWebp = "EXT_texture_webp", *kBasis = "KHR_texture_basisu";
constexpr int kMaxWebpSide = 16383;

// Images that displace surfaces: what a photograph may lose is a dent in a surface.
std::set<std::size_t> height_images(const json& d) {
  std::set<std::size_t> images;
  if (!d.contains("materials")) return images;
  for (const json& material : d["materials"])
    if (const json* extension = gltf::find_extension(material, "TESSERA_displacement")) {
      const json& texture = d["textures"][(*extension)["texture"]["index"].get<std::size_t>()];
      if (texture.contains("source")) images.insert(texture["source"].get<std::size_t>());
    }
  return images;
}

// Grey becomes colour; grey and alpha, colour and alpha.
Image8 as_color(const Image8& image) {
  if (image.channels >= 3) return image;
  const bool alpha = image.channels == 2;
  Image8 out(image.width, image.height, alpha ? 4 : 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto from = image.at(x, y);
      auto to = out.at(x, y);
      to[0] = to[1] = to[2] = from[0];
      if (alpha) to[3] = from[1];
    }
  return out;
}

// The WebP bytes of an image, or nothing where it has to stay as it is.
std::string as_webp(gltf::Bytes bytes, const WebpOptions& options) {
  DecodedImage decoded;
  std::string fault;
  if (image_format(bytes) == ImageFormat::kWebp || !decode_image(bytes, ImageLimits{}, decoded, fault)) return "";
  const auto* image = std::get_if<Image8>(&decoded.pixels);
  if (image == nullptr || image->width > kMaxWebpSide || image->height > kMaxWebpSide) return "";
  std::string webp = encode_webp(as_color(*image), options.quality.value_or(0), !options.quality);
  return webp.size() < bytes.size() ? webp : "";
}

// What materials use an image for that no KTX2 image goes before.
struct Uses {
  bool color = false, data = false;
};

std::map<std::size_t, Uses> uses_of_images(const json& d) {
  std::map<std::size_t, Uses> uses;
  if (!d.contains("materials")) return uses;
  const auto note = [&](const json& owner, const char* name, bool Uses::*use) {
    if (!owner.contains(name)) return;
    const json& texture = d["textures"][owner[name]["index"].get<std::size_t>()];
    if (texture.contains("source") && gltf::find_extension(texture, kBasis) == nullptr)
      uses[texture["source"].get<std::size_t>()].*use = true;
  };
  for (const json& material : d["materials"]) {
    if (material.contains("pbrMetallicRoughness")) {
      note(material["pbrMetallicRoughness"], "baseColorTexture", &Uses::color);
      note(material["pbrMetallicRoughness"], "metallicRoughnessTexture", &Uses::data);
    }
    note(material, "emissiveTexture", &Uses::color);
    note(material, "normalTexture", &Uses::data);
    note(material, "occlusionTexture", &Uses::data);
  }
  return uses;
}

// RGBA8 of a level, as stored.
std::vector<std::uint8_t> codes_of(const shaders::Texture& texture, int level, bool srgb) {
  std::vector<std::uint8_t> codes;
  for (int y = 0; y < texture.height(level); ++y)
    for (int x = 0; x < texture.width(level); ++x) {
      const Vec4 texel = texture.texel(level, x, y);
      for (int c = 0; c < 4; ++c) codes.push_back(to_unorm8(srgb && c < 3 ? linear_to_srgb(texel[c]) : texel[c]));
    }
  return codes;
}

// The KTX2 bytes of an image, or nothing where it has to stay as it is.
std::string as_ktx2(gltf::Bytes bytes, const Uses& uses, Ktx2Format format) {
  DecodedImage decoded;
  std::string fault;
  if (uses.color == uses.data || !decode_image(bytes, ImageLimits{}, decoded, fault)) return "";
  if (!std::holds_alternative<Image8>(decoded.pixels) || decoded.width() % 4 != 0 || decoded.height() % 4 != 0)
    return "";
  const shaders::Texture texture(decoded, uses.color ? shaders::ColorSpace::kSrgb : shaders::ColorSpace::kLinear);
  std::vector<std::vector<std::uint8_t>> texels;
  std::vector<ktx2::LevelToWrite> levels;
  for (int level = 0; level < texture.level_count(); ++level) {
    texels.push_back(codes_of(texture, level, uses.color));
    levels.push_back({texture.width(level), texture.height(level), texels.back()});
  }
  return ktx2::write_ktx2(levels, {uses.color, !texture.opaque(), format == Ktx2Format::kEtc1s});
}

// The converted images' textures name them by the extension, and nothing else.
void name_by_extension(json& d, const std::set<std::size_t>& converted, const char* extension) {
  if (!d.contains("textures")) return;
  for (json& texture : d["textures"]) {
    if (!texture.contains("source") || !converted.contains(texture["source"].get<std::size_t>())) continue;
    // An image of the kind that is there already stays the texture's.
    if (gltf::find_extension(texture, extension) == nullptr)
      texture["extensions"][extension]["source"] = texture["source"];
    texture.erase("source");
  }
}

const char* mime_type_of(gltf::Bytes bytes) {
  return ktx2::is_ktx2(bytes) ? "image/ktx2" : mime_type(image_format(bytes));
}

}  // namespace

ImageReport move_images(gltf::Document& document, json& d, BinaryChunk& chunk, const ImageOptions& options) {
  if (!d.contains("images")) return {};
  const std::set<std::size_t> heights = height_images(d);
  const std::map<std::size_t, Uses> uses = uses_of_images(d);
  std::set<std::size_t> converted;
  std::map<std::string, std::size_t> view_of_uri;
  for (std::size_t i = 0; i < d["images"].size(); ++i) {
    json& image = d["images"][i];
    const gltf::Bytes bytes = document.resources.image(i);
    const std::string type = mime_type_of(bytes);
    if (type.empty()) document.root.at("images").at(i).refuse("is neither PNG, JPEG, WebP nor KTX2");
    std::string packed;
    if (options.webp && !heights.contains(i)) packed = as_webp(bytes, *options.webp);
    if (options.ktx2 != Ktx2Format::kNone && !heights.contains(i) && uses.contains(i))
      packed = as_ktx2(bytes, uses.at(i), options.ktx2);
    image["mimeType"] = type;
    if (!packed.empty()) {
      converted.insert(i);
      const auto* first = reinterpret_cast<const std::uint8_t*>(packed.data());
      image["mimeType"] = mime_type_of({first, packed.size()});
      image["bufferView"] = chunk.add({first, packed.size()});
      image.erase("uri");
      continue;
    }
    if (image.contains("bufferView")) {
      image["bufferView"] = chunk.copy_view(image["bufferView"].get<std::size_t>());
      continue;
    }
    const auto [at, fresh] = view_of_uri.try_emplace(image["uri"].get<std::string>(), 0);
    if (fresh) at->second = chunk.add(bytes);
    image["bufferView"] = at->second;
    image.erase("uri");
  }
  const bool ktx2 = options.ktx2 != Ktx2Format::kNone;
  name_by_extension(d, converted, ktx2 ? kBasis : kWebp);
  return ktx2 ? ImageReport{0, converted.size()} : ImageReport{converted.size(), 0};
}

}  // namespace tessera::replay
