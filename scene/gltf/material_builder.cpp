#include <map>
#include <optional>

#include "scene/gltf/builders.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// Decodes every image once per use (colour, data, heights).
class TextureLibrary {
 public:
  explicit TextureLibrary(Document& document) : document_(document) {}

  std::shared_ptr<const shaders::Texture> color(std::size_t texture, shaders::ColorSpace space) {
    const std::optional<std::size_t> source = image_of(texture);
    if (!source) return nullptr;
    const std::size_t image = *source;
    auto& slot = textures_[{image, space}];
    if (slot == nullptr) {
      const DecodedImage decoded = decode(image);
      // RGBA8 and its mip levels.
      document_.budget.charge(
          static_cast<std::uint64_t>(decoded.width()) * static_cast<std::uint64_t>(decoded.height()), 6,
          place(image).pointer());
      slot = std::make_shared<shaders::Texture>(decoded, space);
    }
    return slot;
  }

  std::shared_ptr<const shaders::ScalarTexture> heights(std::size_t texture) {
    const std::optional<std::size_t> source = image_of(texture);
    if (!source) return nullptr;
    const std::size_t image = *source;
    auto& slot = heights_[image];
    if (slot == nullptr) {
      const DecodedImage decoded = decode(image);
      document_.budget.charge(
          static_cast<std::uint64_t>(decoded.width()) * static_cast<std::uint64_t>(decoded.height()), 6,
          place(image).pointer());
      slot = std::make_shared<shaders::ScalarTexture>(decoded);
    }
    return slot;
  }

  shaders::Sampler sampler(std::size_t texture) const {
    shaders::Sampler out;
    const int index = document_.model.textures[texture].sampler;
    if (index < 0) return out;
    const tinygltf::Sampler& s = document_.model.samplers[static_cast<std::size_t>(index)];
    const auto wrap = [](int mode) {
      return mode == 33071   ? shaders::Wrap::kClampToEdge
             : mode == 33648 ? shaders::Wrap::kMirroredRepeat
                             : shaders::Wrap::kRepeat;
    };
    out.wrap_s = wrap(s.wrapS);
    out.wrap_t = wrap(s.wrapT);
    out.magnify_linear = s.magFilter != 9728;
    // 9728 nearest, 9729 linear, 9984..9987: nearest/linear within a level x nearest/linear between levels.
    out.minify_linear = s.minFilter != 9728 && s.minFilter != 9984 && s.minFilter != 9986;
    if (s.minFilter == 9728 || s.minFilter == 9729)
      out.mip = shaders::MipFilter::kNone;
    else if (s.minFilter == 9984 || s.minFilter == 9985)
      out.mip = shaders::MipFilter::kNearest;
    return out;
  }

 private:
  Place place(std::size_t image) const { return document_.root.at("images").at(image); }

  // Nothing where no source is read: the factor stands alone.
  std::optional<std::size_t> image_of(std::size_t texture) {
    const int image = document_.model.textures[texture].source;
    if (image >= 0) return static_cast<std::size_t>(image);
    document_.notes.violation(document_.root.at("textures").at(texture), "materials do without it",
                              "has no source that Tessera reads (PNG or JPEG)");
    return std::nullopt;
  }

  DecodedImage decode(std::size_t image) {
    const Bytes bytes = document_.resources.image(image);
    DecodedImage decoded;
    std::string fault;
    try {
      const auto charge = [&](std::uint64_t count) { document_.budget.charge(count, 1, "image"); };
      if (!decode_image(bytes, document_.limits.image, decoded, fault, charge)) place(image).refuse("{}", fault);
    } catch (const LimitError& error) {
      throw LimitError(fmt::format("{}: {}: {}", document_.root.file(), place(image).pointer(), error.what()));
    }
    return decoded;
  }

  Document& document_;
  std::map<std::pair<std::size_t, shaders::ColorSpace>, std::shared_ptr<shaders::Texture>> textures_;
  std::map<std::size_t, std::shared_ptr<shaders::ScalarTexture>> heights_;
};

TextureShift texture_shift(const json& info, int& texcoord) {
  TextureShift out;
  const json* extension = find_extension(info, "KHR_texture_transform");
  if (extension == nullptr) return out;
  texcoord = extension->value("texCoord", texcoord);
  out.rotation = extension->value("rotation", 0.0f);
  const auto scale = extension->value("scale", std::vector<float>{1.0f, 1.0f});
  const auto offset = extension->value("offset", std::vector<float>{0.0f, 0.0f});
  out.scale = {scale[0], scale[1]};
  out.offset = {offset[0], offset[1]};
  return out;
}

TextureSlot texture_slot(TextureLibrary& library, const json& owner, const char* name, shaders::ColorSpace space) {
  TextureSlot slot;
  const auto info = owner.find(name);
  if (info == owner.end()) return slot;
  const auto texture = (*info)["index"].get<std::size_t>();
  slot.texture = library.color(texture, space);
  slot.sampler = library.sampler(texture);
  slot.texcoord = info->value("texCoord", 0);
  slot.shift = texture_shift(*info, slot.texcoord);
  slot.transform = slot.shift.transform();
  return slot;
}

Displacement displacement(TextureLibrary& library, const json& extension) {
  Displacement out;
  const json& info = extension["texture"];
  const auto texture = info["index"].get<std::size_t>();
  out.texture = library.heights(texture);
  out.sampler = library.sampler(texture);
  out.texcoord = info.value("texCoord", 0);
  out.transform = texture_shift(info, out.texcoord).transform();
  out.scale = extension.value("scale", 1.0f);
  out.bias = extension.value("bias", 0.0f);
  return out;
}

Material build_material(TextureLibrary& library, const tinygltf::Material& model, const json& material) {
  static const json kNothing = json::object();
  const json& pbr = material.contains("pbrMetallicRoughness") ? material["pbrMetallicRoughness"] : kNothing;
  Material out;
  out.name = model.name;
  const auto& factor = model.pbrMetallicRoughness.baseColorFactor;
  out.base_color = {factor[0], factor[1], factor[2], factor[3]};
  out.metallic = static_cast<float>(model.pbrMetallicRoughness.metallicFactor);
  out.roughness = static_cast<float>(model.pbrMetallicRoughness.roughnessFactor);
  out.emissive = {model.emissiveFactor[0], model.emissiveFactor[1], model.emissiveFactor[2]};
  out.normal_scale = static_cast<float>(model.normalTexture.scale);
  out.occlusion_strength = static_cast<float>(model.occlusionTexture.strength);
  out.base_color_texture = texture_slot(library, pbr, "baseColorTexture", shaders::ColorSpace::kSrgb);
  out.metallic_roughness_texture = texture_slot(library, pbr, "metallicRoughnessTexture", shaders::ColorSpace::kLinear);
  out.normal_texture = texture_slot(library, material, "normalTexture", shaders::ColorSpace::kLinear);
  out.occlusion_texture = texture_slot(library, material, "occlusionTexture", shaders::ColorSpace::kLinear);
  out.emissive_texture = texture_slot(library, material, "emissiveTexture", shaders::ColorSpace::kSrgb);
  out.alpha_mode = model.alphaMode == "MASK"    ? AlphaMode::kMask
                   : model.alphaMode == "BLEND" ? AlphaMode::kBlend
                                                : AlphaMode::kOpaque;
  out.alpha_cutoff = static_cast<float>(model.alphaCutoff);
  out.double_sided = model.doubleSided;
  out.unlit = find_extension(material, "KHR_materials_unlit") != nullptr;
  if (const json* extension = find_extension(material, "TESSERA_displacement"))
    if (Displacement heights = displacement(library, *extension); heights.texture != nullptr)
      out.displacement = std::move(heights);
  return out;
}

}  // namespace

std::vector<Material> build_materials(Document& document) {
  TextureLibrary library(document);
  std::vector<Material> materials;
  for (std::size_t m = 0; m < document.model.materials.size(); ++m)
    materials.push_back(build_material(library, document.model.materials[m], document.json["materials"][m]));
  return materials;
}

}  // namespace tessera::scene::gltf
