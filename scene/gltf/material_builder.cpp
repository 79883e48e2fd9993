#include <algorithm>
#include <cstdlib>
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
#include "scene/gltf/selection.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

bool has_specular_glossiness(const json& material) {
  return find_extension(material, "KHR_materials_pbrSpecularGlossiness") != nullptr;
}

// Decodes every image once per use (colour, data, heights); KTX2 images once for colour and data, because the file sets
// their transfer function.
class TextureLibrary {
 public:
  TextureLibrary(Document& document, std::vector<BasisImage>& basis_images)
      : document_(document), basis_images_(basis_images) {}

  // `sampled`: whether some material reads the texture; an unread texture may be missing or broken.
  ColorImage color(std::size_t texture, shaders::ColorSpace space, bool sampled) {
    return of_first_readable(texture, sampled, [&](const TextureImage& from) {
      const Bytes bytes = document_.resources.image(from.image);
      if (is_basis(from, bytes)) return basis_color(from.image, space);
      ColorImage& slot = textures_[{from.image, space}];
      if (slot.texture == nullptr) {
        slot = taken_or(&ReadAhead::colors, {from.image, space},
                        [&] { return read_color_image(bytes, space, account(from.image)); });
      }
      return slot;
    });
  }

  HeightImage heights(std::size_t texture, bool sampled) {
    return of_first_readable(texture, sampled, [&](const TextureImage& from) {
      HeightImage& slot = heights_[from.image];
      if (slot.texture != nullptr) return slot;
      const Bytes bytes = document_.resources.image(from.image);
      if (is_basis(from, bytes)) {
        const UnpackedBasis unpacked = unpack(from.image, &ReadAhead::basis_heights);
        slot = {basis_heights(unpacked.texture), unpacked.source};
        basis_image(from.image).heights = slot.texture;
      } else {
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

  // The images that a texture offers; none where Tessera reads none: the factor stands alone.
  std::vector<TextureImage> sources(std::size_t texture) {
    std::vector<TextureImage> images = images_of(document_.json["textures"][texture]);
    if (images.empty() && without_source_.insert(texture).second)
      document_.notes.violation(document_.root.at("textures").at(texture), "materials do without it",
                                "has no source that Tessera reads (PNG, JPEG, WebP or KTX2)");
    return images;
  }

  // Whether an image is KTX2: its bytes decide, even against the texture's extension.
  bool is_basis(const TextureImage& from, Bytes bytes) {
    const bool basis = ktx2::is_ktx2(bytes);
    if (basis == from.basis || (from.basis && image_format(bytes) == ImageFormat::kUnknown)) return from.basis;
    if (noted_.insert(from.image).second)
      document_.notes.violation(place(from.image), "images are read by their own format", "{}",
                                basis ? "is KTX2, which only KHR_texture_basisu may name"
                                      : "is no KTX2 image, which KHR_texture_basisu names");
    return basis;
  }

  // An image that cannot be read gives way to the next source with a note; the last one's fault is the texture's.
  template <class Make>
  std::invoke_result_t<Make, const TextureImage&> of_first_readable(std::size_t texture, bool sampled,
                                                                    const Make& make) {
    const std::vector<TextureImage> images = sources(texture);
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
    if (sampled) return make(images.back());
    try {
      return make(images.back());
    } catch (const InputError& error) {
      document_.notes.violation(place(images.back().image), "nothing samples it", "{}", error.fault());
      return {};
    }
  }

  // Takes a value that was decoded ahead off its shelf, or decodes it now.
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
  std::set<std::size_t> noted_;                       // images that are not what their texture says
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

TextureSlot texture_slot(TextureLibrary& library, const json& owner, const char* name, shaders::ColorSpace space,
                         bool sampled) {
  TextureSlot slot;
  const json* info = find(owner, name);
  if (info == nullptr) return slot;
  const auto texture = (*info)["index"].get<std::size_t>();
  ColorImage color = library.color(texture, space, sampled);
  slot.texture = std::move(color.texture);
  slot.source = color.source;
  slot.sampler = library.sampler(texture);
  slot.texcoord = info->value("texCoord", 0);
  slot.shift = texture_shift(*info, slot.texcoord);
  slot.transform = slot.shift.transform();
  return slot;
}

Displacement displacement(TextureLibrary& library, const json& extension, bool sampled) {
  Displacement out;
  const json& info = extension["texture"];
  const auto texture = info["index"].get<std::size_t>();
  HeightImage heights = library.heights(texture, sampled);
  out.texture = std::move(heights.texture);
  out.source = heights.source;
  out.sampler = library.sampler(texture);
  out.texcoord = info.value("texCoord", 0);
  out.transform = texture_shift(info, out.texcoord).transform();
  out.scale = extension.value("scale", 1.0f);
  out.bias = extension.value("bias", 0.0f);
  return out;
}

// Reads a number of an extension that the material has; tinygltf reads the core's numbers.
void read_number(const MaterialNumber& number, const json& material, Material& out) {
  const std::string_view pointer = number.pointer, object = pointer.substr(0, pointer.rfind('/'));
  if (!object.starts_with("/extensions/") || find_at(material, object) == nullptr) return;
  const json* value = find_at(material, pointer);
  float* to = number.of(out);
  for (int c = 0; c < number.components; ++c)
    to[c] = value == nullptr ? number.value
                             : (number.components == 1 ? *value : (*value)[static_cast<std::size_t>(c)]).get<float>();
}

// The texture-coordinate sets that the drawn surfaces of a material have.
struct DrawnCoordinates {
  bool any = false;  // a procedure has any set
  std::set<int> sets;

  bool has(const json& info) const {
    int set = info.value("texCoord", 0);
    texture_shift(info, set);
    return any || sets.contains(set);
  }
};

// Nodes that stay hidden: KHR_node_visibility of the node or of an ancestor hides them, and no animation changes it.
std::vector<bool> hidden_nodes(const json& document) {
  const json& nodes = list_of(document, "nodes");
  std::set<std::string> animated;  // pointers
  for (const json& animation : list_of(document, "animations"))
    for (const json& channel : animation["channels"])
      if (const json* extension = find_extension(channel["target"], "KHR_animation_pointer"))
        animated.insert(extension->value("pointer", ""));
  std::vector<std::size_t> waiting;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (const json* visibility = find_extension(nodes[n], "KHR_node_visibility");
        visibility != nullptr && !visibility->value("visible", true) &&
        !animated.contains("/nodes/" + std::to_string(n) + "/extensions/KHR_node_visibility/visible"))
      waiting.push_back(n);
  std::vector<bool> hidden(nodes.size(), false);
  while (!waiting.empty()) {
    const std::size_t n = waiting.back();
    waiting.pop_back();
    if (hidden[n]) continue;
    hidden[n] = true;
    for (const json& child : list_of(nodes[n], "children")) waiting.push_back(child.get<std::size_t>());
  }
  return hidden;
}

// By material, for the nodes of the drawn scene.
std::map<std::size_t, DrawnCoordinates> drawn_coordinates(const json& document) {
  std::map<std::size_t, DrawnCoordinates> drawn;
  const json &nodes = list_of(document, "nodes"), &meshes = list_of(document, "meshes");
  const std::vector<bool> hidden = hidden_nodes(document);
  for (const std::size_t n : drawn_nodes(document, kNone)) {
    if (hidden[n]) continue;
    if (const json* procedure = find_extension(nodes[n], "TESSERA_procedure"))
      if (const json* material = find(*procedure, "material")) drawn[material->get<std::size_t>()].any = true;
    const json* mesh = find(nodes[n], "mesh");
    if (mesh == nullptr) continue;
    for (const json& primitive : meshes[mesh->get<std::size_t>()]["primitives"]) {
      const json* material = find(primitive, "material");
      if (material == nullptr || !primitive["attributes"].contains("POSITION")) continue;
      DrawnCoordinates& coordinates = drawn[material->get<std::size_t>()];
      for (const auto& [name, accessor] : primitive["attributes"].items())
        if (name.starts_with("TEXCOORD_")) coordinates.sets.insert(std::atoi(name.c_str() + 9));
      // Patches have coordinates of their own where the file gives none.
      coordinates.any |= find_extension(primitive, "TESSERA_bezier_patches") != nullptr;
    }
  }
  return drawn;
}

Material build_material(TextureLibrary& library, const tinygltf::Material& model, const json& material,
                        const DrawnCoordinates& drawn) {
  Material out;
  out.name = model.name;
  const tinygltf::PbrMetallicRoughness& pbr = model.pbrMetallicRoughness;
  const auto &color = pbr.baseColorFactor, &emissive = model.emissiveFactor;
  out.base_color = {color[0], color[1], color[2], color[3]};
  out.metallic = static_cast<float>(pbr.metallicFactor);
  out.roughness = static_cast<float>(pbr.roughnessFactor);
  out.emissive_factor = {emissive[0], emissive[1], emissive[2]};
  out.normal_scale = static_cast<float>(model.normalTexture.scale);
  out.occlusion_strength = static_cast<float>(model.occlusionTexture.strength);
  out.alpha_mode = model.alphaMode == "MASK"    ? AlphaMode::kMask
                   : model.alphaMode == "BLEND" ? AlphaMode::kBlend
                                                : AlphaMode::kOpaque;
  out.alpha_cutoff = static_cast<float>(model.alphaCutoff);
  out.double_sided = model.doubleSided;
  out.unlit = find_extension(material, "KHR_materials_unlit") != nullptr;
  for (const MaterialNumber& number : material_numbers())
    if (!number.effect || !out.unlit) read_number(number, material, out);
  out.emissive = out.emissive_factor * out.emissive_strength;
  for (const MaterialTextureRow& row : material_textures())
    if (const json* owner = find_at(material, row.object); owner != nullptr && is_used(row, material)) {
      const json* info = find(*owner, row.name);
      const bool sampled =
          info != nullptr && drawn.has(*info) && (!out.unlit || row.slot == MaterialTexture::kBaseColor);
      *out.slots()[static_cast<std::size_t>(row.slot)] =
          texture_slot(library, *owner, row.name.c_str(), row.space, sampled);
    }
  if (!out.unlit) {
    out.effects.set(static_cast<std::size_t>(MaterialEffect::kSpecularGlossiness), has_specular_glossiness(material));
    out.effects = effects_in_force(out);
  }
  if (const json* extension = find_extension(material, "TESSERA_displacement"))
    if (Displacement heights = displacement(library, *extension, drawn.has((*extension)["texture"]));
        heights.texture != nullptr)
      out.displacement = std::move(heights);
  return out;
}

}  // namespace

std::vector<TextureImage> images_of(const json& texture) {
  std::vector<TextureImage> images;
  for (const char* name : {"KHR_texture_basisu", "EXT_texture_webp"}) {
    const json* extension = find_extension(texture, name);
    if (extension != nullptr && extension->contains("source"))
      images.push_back({(*extension)["source"].get<std::size_t>(), name[0] == 'K'});
  }
  if (const json* source = find(texture, "source")) images.push_back({source->get<std::size_t>(), false});
  return images;
}

bool is_used(const MaterialTextureRow& row, const json& material) {
  const bool unlit = find_extension(material, "KHR_materials_unlit") != nullptr;
  return row.of_extension ? !unlit : unlit || row.object.empty() || !has_specular_glossiness(material);
}

void build_materials(Document& document, Capture& capture) {
  TextureLibrary library(document, capture.basis_images);
  const std::map<std::size_t, DrawnCoordinates> drawn = drawn_coordinates(document.json);
  for (std::size_t m = 0; m < document.model.materials.size(); ++m)
    capture.materials.push_back(build_material(library, document.model.materials[m], document.json["materials"][m],
                                               drawn.contains(m) ? drawn.at(m) : DrawnCoordinates{}));
}

}  // namespace tessera::scene::gltf
