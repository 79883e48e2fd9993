#include "replay/pack/image_packer.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "base/image_codec.h"
#include "base/ktx2/ktx2.h"
#include "base/webp_codec.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
namespace gltf = scene::gltf;

constexpr const char* kWebp = "EXT_texture_webp";
constexpr int kMaxWebpSide = 16383;

// Images that displace surfaces: a loss that is invisible in a photograph is a dent in a surface.
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

// The converted images' textures name them by EXT_texture_webp, and nothing else.
void name_by_extension(json& d, const std::set<std::size_t>& converted) {
  if (!d.contains("textures")) return;
  for (json& texture : d["textures"]) {
    if (!texture.contains("source") || !converted.contains(texture["source"].get<std::size_t>())) continue;
    // A WebP image that is there already stays the texture's.
    if (gltf::find_extension(texture, kWebp) == nullptr) texture["extensions"][kWebp]["source"] = texture["source"];
    texture.erase("source");
  }
}

std::vector<std::uint8_t> white_pixel() {
  Image8 pixel(1, 1, 3);
  std::fill(pixel.values.begin(), pixel.values.end(), std::uint8_t{255});
  const std::string png = encode_png(pixel, PngEffort::kFast);
  return {png.begin(), png.end()};
}

const char* mime_type_of(gltf::Bytes bytes) {
  return ktx2::is_ktx2(bytes) ? "image/ktx2" : mime_type(image_format(bytes));
}

}  // namespace

std::size_t move_images(gltf::Document& document, json& d, BinaryChunk& chunk, const std::optional<WebpOptions>& webp,
                        std::vector<std::string>& notices) {
  if (!d.contains("images")) return 0;
  const std::set<std::size_t> heights = height_images(d);
  std::set<std::size_t> converted;
  std::map<std::string, std::size_t> view_of_uri;
  for (std::size_t i = 0; i < d["images"].size(); ++i) {
    json& image = d["images"][i];
    gltf::Bytes bytes;
    try {
      bytes = document.resources.image(i);
      if (std::string(mime_type_of(bytes)).empty())
        document.root.at("images").at(i).refuse("is no image that is known");
    } catch (const InputError& error) {
      // The reader has accepted the asset, so no texture samples this image.
      notices.push_back(
          fmt::format("{}: {}; nothing samples it, a white pixel stands for it", error.place(), error.fault()));
      image["mimeType"] = "image/png";
      image["bufferView"] = chunk.add(white_pixel());
      image.erase("uri");
      continue;
    }
    const std::string type = mime_type_of(bytes);
    std::string packed;
    if (webp && !heights.contains(i)) packed = as_webp(bytes, *webp);
    image["mimeType"] = type;
    if (!packed.empty()) {
      converted.insert(i);
      const auto* first = reinterpret_cast<const std::uint8_t*>(packed.data());
      image["mimeType"] = mime_type(ImageFormat::kWebp);
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
  name_by_extension(d, converted);
  return converted.size();
}

}  // namespace tessera::replay
