// Materials' extensions as files have them.
#include "base/error.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::material_effects_test {
namespace {

using test::GltfAsset;

GltfAsset with_extensions(const json& extensions) {
  GltfAsset asset = test::everything_asset();
  asset.document["materials"][0]["extensions"] = extensions;
  return asset;
}
Material material_with(const json& extensions) { return test::read_asset(with_extensions(extensions)).materials.at(0); }

std::set<MaterialEffect> effects_of(const Material& material) {
  std::set<MaterialEffect> effects;
  for (std::size_t e = 0; e < kMaterialEffectCount; ++e)
    if (material.effects[e]) effects.insert(static_cast<MaterialEffect>(e));
  return effects;
}
using Effects = std::set<MaterialEffect>;

TEST(MaterialEffects, AMaterialWithoutExtensionsHasNone) {
  EXPECT_EQ(effects_of(material_with(json::object())), Effects{});
  EXPECT_EQ(effects_in_force(Material()), MaterialEffects());
}

TEST(MaterialEffects, FactorsAreRead) {
  const json texture = {{"index", 0}};
  const Material m = material_with({
      {"KHR_materials_ior", {{"ior", 1.33}}},
      {"KHR_materials_specular", {{"specularFactor", 0.5}, {"specularColorFactor", {2, 0.5, 0}}}},
      {"KHR_materials_clearcoat",
       {{"clearcoatFactor", 0.75},
        {"clearcoatRoughnessFactor", 0.25},
        {"clearcoatNormalTexture", {{"index", 0}, {"scale", 2}}}}},
      {"KHR_materials_sheen", {{"sheenColorFactor", {0.1, 0.2, 0.3}}, {"sheenRoughnessFactor", 0.4}}},
      {"KHR_materials_anisotropy", {{"anisotropyStrength", 0.6}, {"anisotropyRotation", 1.5}}},
      {"KHR_materials_iridescence",
       {{"iridescenceFactor", 0.9},
        {"iridescenceIor", 1.8},
        {"iridescenceThicknessMinimum", 50},
        {"iridescenceThicknessMaximum", 500},
        {"iridescenceThicknessTexture", texture}}},
      {"KHR_materials_transmission", {{"transmissionFactor", 0.8}, {"transmissionTexture", texture}}},
      {"KHR_materials_volume",
       {{"thicknessFactor", 0.2}, {"attenuationDistance", 3}, {"attenuationColor", {1, 0.5, 0.25}}}},
      {"KHR_materials_dispersion", {{"dispersion", 0.3}}},
      {"KHR_materials_diffuse_transmission",
       {{"diffuseTransmissionFactor", 0.35}, {"diffuseTransmissionColorFactor", {0.5, 1, 0}}}},
      {"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}},
  });
  EXPECT_EQ(m.dielectric.ior, 1.33f);
  EXPECT_EQ(m.dielectric.specular, 0.5f);
  EXPECT_EQ(m.dielectric.specular_color, Vec3(2, 0.5f, 0));
  EXPECT_EQ(m.clearcoat.factor, 0.75f);
  EXPECT_EQ(m.clearcoat.roughness, 0.25f);
  EXPECT_EQ(m.clearcoat.normal_scale, 2.0f);
  EXPECT_NE(m.clearcoat.normal_texture.texture, nullptr);
  EXPECT_EQ(m.sheen.color, Vec3(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(m.sheen.roughness, 0.4f);
  EXPECT_EQ(m.anisotropy.strength, 0.6f);
  EXPECT_EQ(m.anisotropy.rotation, 1.5f);
  EXPECT_EQ(m.iridescence.factor, 0.9f);
  EXPECT_EQ(m.iridescence.ior, 1.8f);
  EXPECT_EQ(m.iridescence.min_thickness, 50.0f);
  EXPECT_EQ(m.iridescence.max_thickness, 500.0f);
  EXPECT_NE(m.iridescence.thickness_texture.texture, nullptr);
  EXPECT_EQ(m.transmission.factor, 0.8f);
  EXPECT_NE(m.transmission.texture.texture, nullptr);
  EXPECT_EQ(m.volume.thickness, 0.2f);
  EXPECT_EQ(m.volume.attenuation_distance, 3.0f);
  EXPECT_EQ(m.volume.attenuation_color, Vec3(1, 0.5f, 0.25f));
  EXPECT_EQ(m.dispersion.strength, 0.3f);
  EXPECT_EQ(m.diffuse_transmission.factor, 0.35f);
  EXPECT_EQ(m.diffuse_transmission.color, Vec3(0.5f, 1, 0));
  EXPECT_EQ(m.emissive, m.emissive_factor * 5.0f);
  EXPECT_EQ(effects_of(m).size(), kMaterialEffectCount - 1) << "all but specular-glossiness";
}

TEST(MaterialEffects, DefaultsFollowTheExtensions) {
  Effects all;
  const Material m = material_with({{"KHR_materials_ior", json::object()},
                                    {"KHR_materials_specular", json::object()},
                                    {"KHR_materials_clearcoat", json::object()},
                                    {"KHR_materials_sheen", json::object()},
                                    {"KHR_materials_anisotropy", json::object()},
                                    {"KHR_materials_iridescence", json::object()},
                                    {"KHR_materials_transmission", json::object()},
                                    {"KHR_materials_volume", json::object()},
                                    {"KHR_materials_dispersion", json::object()},
                                    {"KHR_materials_diffuse_transmission", json::object()},
                                    {"KHR_materials_emissive_strength", json::object()}});
  EXPECT_EQ(effects_of(m), Effects{}) << "all are without effect";
  EXPECT_EQ(m.dielectric.ior, 1.5f);
  EXPECT_EQ(m.iridescence.ior, 1.3f);
  EXPECT_EQ(m.iridescence.min_thickness, 100.0f);
  EXPECT_EQ(m.iridescence.max_thickness, 400.0f);
  EXPECT_EQ(m.volume.attenuation_distance, std::numeric_limits<float>::infinity());
  EXPECT_EQ(m.emissive, m.emissive_factor);
}

TEST(MaterialEffects, EachIsThereOnlyWhereItChangesSomething) {
  using Effect = MaterialEffect;
  const json transmission = {{"transmissionFactor", 1}}, thick = {{"thicknessFactor", 1}}, none = json::object();
  const std::vector<std::pair<json, Effects>> cases = {
      {{{"KHR_materials_clearcoat", {{"clearcoatFactor", 0}, {"clearcoatTexture", {{"index", 0}}}}}}, {}},
      {{{"KHR_materials_volume", thick}}, {}},
      {{{"KHR_materials_transmission", transmission}, {"KHR_materials_volume", none}}, {Effect::kTransmission}},
      {{{"KHR_materials_transmission", transmission}, {"KHR_materials_dispersion", {{"dispersion", 1}}}},
       {Effect::kTransmission}},
      {{{"KHR_materials_transmission", transmission},
        {"KHR_materials_volume", thick},
        {"KHR_materials_dispersion", {{"dispersion", 1}}}},
       {Effect::kTransmission, Effect::kVolume, Effect::kDispersion}},
      {{{"KHR_materials_specular", {{"specularTexture", {{"index", 0}}}}}}, {Effect::kDielectric}},
      {{{"KHR_materials_ior", {{"ior", 0}}}}, {Effect::kDielectric}},
      {{{"KHR_materials_unlit", none}, {"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}}}, {}},
  };
  for (const auto& [extensions, effects] : cases)
    EXPECT_EQ(effects_of(material_with(extensions)), effects) << extensions;
}

TEST(MaterialEffects, AbsentEffectsHaveNoTextures) {
  const Material m =
      material_with({{"KHR_materials_clearcoat", {{"clearcoatFactor", 0}, {"clearcoatTexture", {{"index", 0}}}}}});
  EXPECT_EQ(m.clearcoat.texture.texture, nullptr);
}

TEST(MaterialEffects, SpecularGlossinessReplacesTheCore) {
  GltfAsset asset = with_extensions({{"KHR_materials_pbrSpecularGlossiness",
                                      {{"diffuseFactor", {0.1, 0.2, 0.3, 0.5}},
                                       {"specularFactor", {0.4, 0.5, 0.6}},
                                       {"glossinessFactor", 0.7},
                                       {"specularGlossinessTexture", {{"index", 0}}}}}});
  asset.document["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
  const Material m = test::read_asset(asset).materials.at(0);
  EXPECT_EQ(effects_of(m), Effects{MaterialEffect::kSpecularGlossiness});
  EXPECT_EQ(m.base_color, Vec4(0.1f, 0.2f, 0.3f, 0.5f));
  EXPECT_EQ(m.specular_glossiness.specular, Vec3(0.4f, 0.5f, 0.6f));
  EXPECT_EQ(m.specular_glossiness.glossiness, 0.7f);
  EXPECT_NE(m.specular_glossiness.texture.texture, nullptr);
  EXPECT_EQ(m.metallic_roughness_texture.texture, nullptr);
  EXPECT_EQ(m.base_color_texture.texture, nullptr);
}

TEST(MaterialEffects, ForbiddenValuesAreRefused) {
  const std::vector<json> refused = {
      {{"KHR_materials_ior", {{"ior", 0.5}}}},
      {{"KHR_materials_ior", {{"ior", -1}}}},
      {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1.5}}}},
      {{"KHR_materials_clearcoat", {{"clearcoatTexture", {{"index", 99}}}}}},
      {{"KHR_materials_sheen", {{"sheenColorFactor", {1, 1}}}}},
      {{"KHR_materials_iridescence", {{"iridescenceIor", 0.9}}}},
      {{"KHR_materials_iridescence", {{"iridescenceThicknessMaximum", -1}}}},
      {{"KHR_materials_volume", {{"attenuationDistance", 0}}}},
      {{"KHR_materials_volume", {{"thicknessFactor", "thick"}}}},
      {{"KHR_materials_dispersion", {{"dispersion", -0.1}}}},
      {{"KHR_materials_emissive_strength", {{"emissiveStrength", -1}}}},
      {{"KHR_materials_transmission", {{"transmissionFactor", json::array()}}}},
      {{"KHR_materials_diffuse_transmission", {{"diffuseTransmissionColorFactor", {-1, 0, 0}}}}},
      {{"KHR_materials_pbrSpecularGlossiness", {{"glossinessFactor", 2}}}},
      {{"KHR_materials_anisotropy", 7}},
  };
  for (const json& extensions : refused) EXPECT_THROW(material_with(extensions), InputError) << extensions;
}

// ---- Animations -------------------------------------------------------------------------------------------------

// Moves a factor of material 0 from 0.25 to 0.75.
GltfAsset animated(const std::string& pointer, int components, const json& extensions) {
  GltfAsset asset = with_extensions(extensions);
  std::vector<float> values(static_cast<std::size_t>(2 * components), 0.25f);
  for (std::size_t k = values.size() / 2; k < values.size(); ++k) values[k] = 0.75f;
  const int times = asset.add_accessor<float>("SCALAR", {0, 1});
  const json sampler = {{"input", times}, {"output", asset.add_accessor(components == 1 ? "SCALAR" : "VEC3", values)}};
  const json target = {{"path", "pointer"},
                       {"extensions", {{"KHR_animation_pointer", {{"pointer", "/materials/0" + pointer}}}}}};
  asset.add("animations", {{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {sampler}}});
  return asset;
}

TEST(MaterialEffects, EveryFactorMoves) {
  for (const MaterialNumber& number : material_numbers()) {
    const std::string& pointer = number.pointer;
    if (!number.effect || !number.animated) continue;
    const std::string extension = pointer.substr(12, pointer.find('/', 12) - 12);
    json owner = json::object();
    if (pointer.ends_with("/scale")) owner["clearcoatNormalTexture"] = {{"index", 0}};
    json extensions = {{extension, owner}};
    if (number.effect == MaterialEffect::kVolume || number.effect == MaterialEffect::kDispersion)
      extensions["KHR_materials_transmission"] = {{"transmissionFactor", 1}};
    if (number.effect == MaterialEffect::kDispersion) extensions["KHR_materials_volume"] = {{"thicknessFactor", 1}};
    const Capture capture = test::read_asset(animated(pointer, number.components, extensions));
    EXPECT_TRUE(capture.materials[0].has(*number.effect)) << pointer << " is there from the first frame on";
    std::vector<Material> materials = {capture.materials[0]};
    animate_materials(capture, 0.5, std::vector<int>{0}, materials);
    for (int c = 0; c < number.components; ++c)
      EXPECT_EQ(number.of(materials[0])[c], number.range.low > 0.5 ? static_cast<float>(number.range.low) : 0.5f)
          << pointer;
  }
}

TEST(MaterialEffects, StrengthAndFactorOfEmissionMoveApart) {
  const Capture capture = test::read_asset(animated("/extensions/KHR_materials_emissive_strength/emissiveStrength", 1,
                                                    {{"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}}}));
  std::vector<Material> materials = {capture.materials[0]};
  animate_materials(capture, 0.5, std::vector<int>{0}, materials);
  EXPECT_EQ(materials[0].emissive, capture.materials[0].emissive_factor * 0.5f);
}

// ---- Assembly ---------------------------------------------------------------------------------------------------

// Without tangents and texture coordinates a surface has no direction of roughness.
TEST(MaterialEffects, AnisotropyNeedsADirection) {
  for (const bool coordinates : {false, true}) {
    Capture capture;
    Material material;
    material.anisotropy.strength = 1;
    material.effects = effects_in_force(material);
    const int number = test::add_material(capture, material);
    Primitive primitive = test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}, number);
    if (coordinates) primitive.vertices.texcoords = {{{0, 0}, {1, 0}, {0, 1}}};
    test::add_node(capture, primitive, DVec3(0.0));
    const Assembly assembly = assemble(capture);
    const auto drawn = static_cast<std::size_t>(assembly.drawables.at(0).material);
    EXPECT_EQ(assembly.materials[drawn].has(MaterialEffect::kAnisotropy), coordinates);
  }
}

}  // namespace
}  // namespace tessera::scene::material_effects_test
