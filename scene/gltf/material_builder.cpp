#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <type_traits>
#include <utility>

#include "scene/basis_textures.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/image_reader.h"
#include "scene/gltf/read_ahead.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// Decodes every image once per use (colour, data, heights); KTX2 images once for colour and data, as their transfer
// function is theirs.
class TextureLibrary {
 public:
  TextureLibrary(Document& document, std::vector<BasisImage>& basis_images)
      : document_(document), basis_images_(basis_images) {}

  ColorImage color(std::size_t texture, shaders::ColorSpace space) {
    return of_first_readable(texture, [&](const Source& from) {
      if (from.basis) return basis_color(from.image, space);
      ColorImage& slot = textures_[{from.image, space}];
      if (slot.texture == nullptr) {
        const Bytes bytes = document_.resources.image(from.image);
        slot = taken_or(&ReadAhead::colors, {from.image, space},
                        [&] { return read_color_image(bytes, space, account(from.image)); });
      }
      return slot;
    });
  }

  HeightImage heights(std::size_t texture) {
    return of_first_readable(texture, [&](const Source& from) {
      HeightImage& slot = heights_[from.image];
      if (slot.texture != nullptr) return slot;
      if (from.basis) {
        const UnpackedBasis unpacked = unpack(from.image, &ReadAhead::basis_heights);
        slot = {basis_heights(unpacked.texture), unpacked.source};
        basis_image(from.image).heights = slot.texture;
      } else {
        const Bytes bytes = document_.resources.image(from.image);
        slot = taken_or(&ReadAhead::heights, from.image, [&] { return read_height_image(bytes, account(from.image)); });
      }
      return slot;
    });
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

  // An image that a texture offers.
  struct Source {
    std::size_t image;
    bool basis;  // KTX2, by KHR_texture_basisu
  };

  // All of them, the one to be preferred first; none where Tessera reads none: the factor stands alone.
  std::vector<Source> sources(std::size_t texture) {
    const json& object = document_.json["textures"][texture];
    std::vector<Source> images;
    for (const char* name : {"KHR_texture_basisu", "EXT_texture_webp"}) {
      const json* extension = find_extension(object, name);
      if (extension != nullptr && extension->contains("source"))
        images.push_back({(*extension)["source"].get<std::size_t>(), name[0] == 'K'});
    }
    if (object.contains("source")) images.push_back({object["source"].get<std::size_t>(), false});
    if (images.empty() && without_source_.insert(texture).second)
      document_.notes.violation(document_.root.at("textures").at(texture), "materials do without it",
                                "has no source that Tessera reads (PNG, JPEG, WebP or KTX2)");
    return images;
  }

  // An image that cannot be read gives way to the next source with a note; the last one's fault is the texture's.
  template <class Make>
  std::invoke_result_t<Make, const Source&> of_first_readable(std::size_t texture, const Make& make) {
    const std::vector<Source> images = sources(texture);
    if (images.empty()) return {};
    for (std::size_t k = 0; k + 1 < images.size(); ++k) {
      const std::size_t image = images[k].image;
      if (unreadable_.contains(image)) continue;
      try {
        return make(images[k]);
      } catch (const InputError& error) {
        document_.notes.add(place(image), "its textures show their next source", error.fault());
        unreadable_.insert(image);
      }
    }
    return make(images.back());
  }

  // Takes what was decoded ahead off its shelf, or decodes now.
  template <class Key, class Value, class Decode>
  Value taken_or(Shelf<Key, Value> ReadAhead::*shelf, const Key& key, const Decode& decode) {
    if (document_.ahead != nullptr)
      if (std::optional<Value> ready = ((*document_.ahead).*shelf).take(key, document_.budget))
        return std::move(*ready);
    return decode();
  }
  ImageAccount account(std::size_t image) { return {document_.limits.image, document_.budget, place(image)}; }

  UnpackedBasis unpack(std::size_t image, Shelf<std::size_t, UnpackedBasis> ReadAhead::*shelf) {
    const Bytes bytes = document_.resources.image(image);
    return taken_or(shelf, image, [&] { return unpack_basis_image(bytes, account(image)); });
  }

  BasisImage& basis_image(std::size_t image) {
    const auto [found, fresh] = basis_numbers_.try_emplace(image, basis_images_.size());
    if (fresh) {
      const Bytes bytes = document_.resources.image(image);
      document_.budget.charge(bytes.size(), 1, place(image));
      basis_images_.emplace_back().file.assign(bytes.begin(), bytes.end());
    }
    return basis_images_[found->second];
  }

  ColorImage basis_color(std::size_t image, shaders::ColorSpace space) {
    Basis& slot = basis_[image];
    if (slot.color.texture == nullptr) {
      UnpackedBasis unpacked = unpack(image, &ReadAhead::basis_colors);
      slot.space = unpacked.texture.srgb ? shaders::ColorSpace::kSrgb : shaders::ColorSpace::kLinear;
      slot.color = {basis_texture(std::move(unpacked.texture)), unpacked.source};
      basis_image(image).texture = slot.color.texture;
    }
    if (slot.space != space && !std::exchange(slot.noted, true))
      document_.notes.add(place(image), "",
                          fmt::format("is {} as it says, though it is used for {}",
                                      slot.space == shaders::ColorSpace::kSrgb ? "sRGB" : "linear",
                                      space == shaders::ColorSpace::kSrgb ? "colours" : "data"));
    return slot.color;
  }

  struct Basis {
    ColorImage color;
    shaders::ColorSpace space = shaders::ColorSpace::kSrgb;
    bool noted = false;
  };

  Document& document_;
  std::vector<BasisImage>& basis_images_;
  std::map<std::pair<std::size_t, shaders::ColorSpace>, ColorImage> textures_;
  std::map<std::size_t, HeightImage> heights_;
  std::map<std::size_t, Basis> basis_;
  std::map<std::size_t, std::size_t> basis_numbers_;  // image to basis_images_
  std::set<std::size_t> unreadable_;                  // images
  std::set<std::size_t> without_source_;              // textures that a note has named
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
  ColorImage color = library.color(texture, space);
  slot.texture = std::move(color.texture);
  slot.source = color.source;
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
  HeightImage heights = library.heights(texture);
  out.texture = std::move(heights.texture);
  out.source = heights.source;
  out.sampler = library.sampler(texture);
  out.texcoord = info.value("texCoord", 0);
  out.transform = texture_shift(info, out.texcoord).transform();
  out.scale = extension.value("scale", 1.0f);
  out.bias = extension.value("bias", 0.0f);
  return out;
}

// The factor of an extension if it is there; how it changes the material's look is for effects_in_force() to say.
Vec3 color_of(const json& extension, const char* name) {
  const auto found = extension.find(name);
  return found == extension.end() ? Vec3(1.0f) : Vec3((*found)[0], (*found)[1], (*found)[2]);
}

void read_specular_glossiness(TextureLibrary& library, const json& e, Material& out) {
  using shaders::ColorSpace;
  out.base_color = Vec4(1.0f);
  if (const auto factor = e.find("diffuseFactor"); factor != e.end())
    out.base_color = {(*factor)[0], (*factor)[1], (*factor)[2], (*factor)[3]};
  out.base_color_texture = texture_slot(library, e, "diffuseTexture", ColorSpace::kSrgb);
  out.metallic_roughness_texture = {};
  SpecularGlossiness& to = out.specular_glossiness;
  to.specular = color_of(e, "specularFactor");
  to.glossiness = e.value("glossinessFactor", 1.0f);
  to.texture = texture_slot(library, e, "specularGlossinessTexture", ColorSpace::kSrgb);
}

void read_coats(TextureLibrary& library, const json& material, Material& out) {
  using shaders::ColorSpace;
  const auto slot = [&](const json& e, const char* name, ColorSpace space = ColorSpace::kLinear) {
    return texture_slot(library, e, name, space);
  };
  if (const json* e = find_extension(material, "KHR_materials_clearcoat")) {
    const auto normal = e->find("clearcoatNormalTexture");
    out.clearcoat = {e->value("clearcoatFactor", 0.0f),
                     e->value("clearcoatRoughnessFactor", 0.0f),
                     normal == e->end() ? 1.0f : normal->value("scale", 1.0f),
                     slot(*e, "clearcoatTexture"),
                     slot(*e, "clearcoatRoughnessTexture"),
                     slot(*e, "clearcoatNormalTexture")};
  }
  if (const json* e = find_extension(material, "KHR_materials_sheen"))
    out.sheen = {e->contains("sheenColorFactor") ? color_of(*e, "sheenColorFactor") : Vec3(0.0f),
                 e->value("sheenRoughnessFactor", 0.0f), slot(*e, "sheenColorTexture", ColorSpace::kSrgb),
                 slot(*e, "sheenRoughnessTexture")};
  if (const json* e = find_extension(material, "KHR_materials_anisotropy"))
    out.anisotropy = {e->value("anisotropyStrength", 0.0f), e->value("anisotropyRotation", 0.0f),
                      slot(*e, "anisotropyTexture")};
  if (const json* e = find_extension(material, "KHR_materials_iridescence"))
    out.iridescence = {e->value("iridescenceFactor", 0.0f),
                       e->value("iridescenceIor", 1.3f),
                       e->value("iridescenceThicknessMinimum", 100.0f),
                       e->value("iridescenceThicknessMaximum", 400.0f),
                       slot(*e, "iridescenceTexture"),
                       slot(*e, "iridescenceThicknessTexture")};
}

void read_transmission(TextureLibrary& library, const json& material, Material& out) {
  using shaders::ColorSpace;
  const auto slot = [&](const json& e, const char* name, ColorSpace space = ColorSpace::kLinear) {
    return texture_slot(library, e, name, space);
  };
  if (const json* e = find_extension(material, "KHR_materials_transmission"))
    out.transmission = {e->value("transmissionFactor", 0.0f), slot(*e, "transmissionTexture")};
  if (const json* e = find_extension(material, "KHR_materials_volume")) {
    out.volume.thickness = e->value("thicknessFactor", 0.0f);
    out.volume.attenuation_distance = e->value("attenuationDistance", std::numeric_limits<float>::infinity());
    out.volume.attenuation_color = color_of(*e, "attenuationColor");
    out.volume.thickness_texture = slot(*e, "thicknessTexture");
  }
  if (const json* e = find_extension(material, "KHR_materials_dispersion"))
    out.volume.dispersion = e->value("dispersion", 0.0f);
  if (const json* e = find_extension(material, "KHR_materials_diffuse_transmission"))
    out.diffuse_transmission = {e->value("diffuseTransmissionFactor", 0.0f),
                                color_of(*e, "diffuseTransmissionColorFactor"), slot(*e, "diffuseTransmissionTexture"),
                                slot(*e, "diffuseTransmissionColorTexture", ColorSpace::kSrgb)};
}

void add_effects(TextureLibrary& library, const json& material, Material& out) {
  if (const json* e = find_extension(material, "KHR_materials_pbrSpecularGlossiness")) {
    read_specular_glossiness(library, *e, out);
    out.effects.set(static_cast<std::size_t>(MaterialEffect::kSpecularGlossiness));
  }
  if (const json* e = find_extension(material, "KHR_materials_ior")) out.dielectric.ior = e->value("ior", 1.5f);
  if (const json* e = find_extension(material, "KHR_materials_specular")) {
    out.dielectric.specular = e->value("specularFactor", 1.0f);
    out.dielectric.specular_color = color_of(*e, "specularColorFactor");
    out.dielectric.texture = texture_slot(library, *e, "specularTexture", shaders::ColorSpace::kLinear);
    out.dielectric.color_texture = texture_slot(library, *e, "specularColorTexture", shaders::ColorSpace::kSrgb);
  }
  read_coats(library, material, out);
  read_transmission(library, material, out);
  out.effects |= effects_in_force(out);
  // It says itself how much a dielectric reflects.
  if (out.has(MaterialEffect::kSpecularGlossiness))
    out.effects.reset(static_cast<std::size_t>(MaterialEffect::kDielectric));
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
  out.emissive_factor = {model.emissiveFactor[0], model.emissiveFactor[1], model.emissiveFactor[2]};
  if (const json* extension = find_extension(material, "KHR_materials_emissive_strength"))
    out.emissive_strength = extension->value("emissiveStrength", 1.0f);
  out.emissive = out.emissive_factor * out.emissive_strength;
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
  if (!out.unlit) add_effects(library, material, out);
  if (const json* extension = find_extension(material, "TESSERA_displacement"))
    if (Displacement heights = displacement(library, *extension); heights.texture != nullptr)
      out.displacement = std::move(heights);
  return out;
}

}  // namespace

void build_materials(Document& document, Capture& capture) {
  TextureLibrary library(document, capture.basis_images);
  for (std::size_t m = 0; m < document.model.materials.size(); ++m)
    capture.materials.push_back(build_material(library, document.model.materials[m], document.json["materials"][m]));
}

}  // namespace tessera::scene::gltf
