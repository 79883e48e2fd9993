// The pixel shader in warps: the same bits as one invocation alone on every SIMD target, the packing of warps, and
// the requests to the texture unit.
#include "tilecore/shading/pixel_shader.h"
#include "base/simd_targets.h"
#include "scene/light_views.h"
#include "tests/support/environments.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore::pixel_shader_test {
namespace {

std::shared_ptr<const shaders::Texture> random_texture(Random& random, bool srgb) {
  const int width = random.integer(1, 40), height = random.integer(1, 40);
  std::vector<shaders::Texture::Level> levels(1);
  levels[0] = {width, height, {}};
  for (int i = 0; i < 4 * width * height; ++i)
    levels[0].rgba.push_back(static_cast<std::uint8_t>(random.integer(0, 255)));
  constexpr shaders::TexelBlocks kBlocks[] = {{1, 4}, {4, 8}, {5, 16}, {6, 16}, {10, 16}, {12, 16}};
  return std::make_shared<const shaders::Texture>(std::move(levels),
                                                  srgb ? shaders::ColorSpace::kSrgb : shaders::ColorSpace::kLinear,
                                                  kBlocks[static_cast<std::size_t>(random.integer(0, 5))]);
}

scene::TextureSlot random_slot(Random& random, bool srgb) {
  scene::TextureSlot slot;
  if (random.integer(0, 3) == 0) return slot;
  slot.texture = random_texture(random, srgb);
  slot.sampler.wrap_s = static_cast<shaders::Wrap>(random.integer(0, 2));
  slot.sampler.wrap_t = static_cast<shaders::Wrap>(random.integer(0, 2));
  slot.sampler.magnify_linear = random.coin();
  slot.sampler.minify_linear = random.coin();
  slot.sampler.mip = static_cast<shaders::MipFilter>(random.integer(0, 2));
  if (random.coin()) {
    slot.shift = {{random.uniform(-2, 2), random.uniform(-2, 2)}, {random.uniform(-3, 3), 2.0f}, 0.7f};
    slot.transform = slot.shift.transform();
  }
  return slot;
}

// Each layer with an even chance, half of its textures.
void add_layers(Random& random, scene::Material& m) {
  const auto unit = [&] { return random.uniform(0, 1); };
  const auto color = [&] { return Vec3(unit(), unit(), unit()); };
  m.specular_glossiness = {color(), unit(), random_slot(random, true)};
  m.dielectric = {random.uniform(1, 2), unit(), color() * 2.0f, random_slot(random, false), random_slot(random, true)};
  m.clearcoat = {
      unit(), unit(), 1.5f, random_slot(random, false), random_slot(random, false), random_slot(random, false)};
  m.sheen = {color(), unit(), random_slot(random, true), random_slot(random, false)};
  m.anisotropy = {unit(), random.uniform(-4, 4), random_slot(random, false)};
  m.iridescence = {unit(),
                   random.uniform(1, 2),
                   50,
                   random.uniform(100, 900),
                   random_slot(random, false),
                   random_slot(random, false)};
  m.transmission = {unit(), random_slot(random, false)};
  m.volume = {unit(), random.uniform(0.1f, 2), color(), random_slot(random, false)};
  m.dispersion.strength = unit();
  m.diffuse_transmission = {unit(), color(), random_slot(random, false), random_slot(random, true)};
  for (std::size_t effect = 0; effect < scene::kMaterialEffectCount; ++effect) m.effects[effect] = random.coin();
}

scene::Material random_material(Random& random, bool displaced) {
  scene::Material m;
  m.base_color = {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)};
  m.metallic = random.uniform(0, 1), m.roughness = random.uniform(0, 1);
  m.emissive = random.integer(0, 2) == 0 ? random.in_box(1) : Vec3(0.0f);
  m.normal_scale = random.uniform(0, 2), m.occlusion_strength = random.uniform(0, 1);
  m.base_color_texture = random_slot(random, true);
  m.metallic_roughness_texture = random_slot(random, false);
  m.normal_texture = random_slot(random, false);
  m.occlusion_texture = random.coin() ? m.metallic_roughness_texture : random_slot(random, false);
  m.emissive_texture = random_slot(random, true);
  m.alpha_mode = static_cast<scene::AlphaMode>(random.integer(0, 2));
  m.unlit = random.integer(0, 5) == 0;
  m.glows_unlit = m.unlit && random.coin();
  if (!m.unlit && random.coin()) add_layers(random, m);
  if (displaced) {
    std::vector<float> heights(64);
    for (float& h : heights) h = random.uniform(0, 1);
    m.displacement = test::displacement(8, 8, heights, random.uniform(0, 0.3f), -0.1f);
  }
  return m;
}

scene::Primitive random_mesh(Random& random, int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int k = 0; k < 36; ++k) {
    // Some triangles are a line or a point.
    positions.push_back(k % 9 == 8 ? positions.back() : random.in_box(1.2f));
    indices.push_back(static_cast<std::uint32_t>(k));
  }
  scene::Primitive p = test::triangles(positions, indices, material);
  scene::Vertices& v = p.vertices;
  v.texcoords.resize(1);
  const bool normals = random.coin(), tangents = normals && random.coin(), colors = random.coin();
  for (std::size_t k = 0; k < positions.size(); ++k) {
    v.texcoords[0].push_back({random.uniform(-2, 2), random.uniform(-2, 2)});
    if (normals) v.normals.push_back(glm::normalize(random.in_box(1) + Vec3(0, 0, 1.5f)));
    if (tangents)
      v.tangents.push_back(Vec4(glm::normalize(random.in_box(1) + Vec3(1.5f, 0, 0)), random.coin() ? 1 : -1));
    if (colors) v.colors.push_back({random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), 1});
  }
  return p;
}

shaders::RadianceImage random_image(Random& random) {
  shaders::RadianceImage image(shaders::RadianceImage::mip_chain({random.integer(1, 60), random.integer(1, 40)}));
  for (int level = 0; level < image.level_count(); ++level)
    for (int y = 0; y < image.height(level); ++y)
      for (int x = 0; x < image.width(level); ++x)
        image.set(level, x, y, {random.uniform(0, 9), random.uniform(0, 9), random.uniform(0, 9)});
  return image;
}

// Drawables of both kinds under lights of all kinds, with everything that moves or does not.
struct ShaderScene : TestFrame {
  std::vector<Invocation> invocations;
  shaders::RadianceImage behind;
  Lighting lighting{shaders::Environment(0.8f)};

  // Results of cast_shadows().
  scene::ShadowSettings shadow_settings;
  std::vector<std::vector<scene::LightView>> light_views;
  std::vector<DepthMaps> maps;
  std::unique_ptr<FrameShadows> shadows;

  static const shaders::EnvironmentImage& sky() {
    static const auto kSky = test::noisy_environment(20, 5);
    return *kSky;
  }

  explicit ShaderScene(std::uint32_t seed, bool quads = false) {
    Random random(seed);
    for (int n = 0; n < 4; ++n) {
      const bool grid = n % 2 == 0;
      const int material = test::add_material(*capture, random_material(random, grid && random.coin()));
      const int node = test::add_node(*capture, grid ? test::closed_patches(material) : random_mesh(random, material),
                                      DVec3(random.in_box(0.8f)));
      if (random.coin()) capture->nodes[static_cast<std::size_t>(node)].transform.scale.x = -1;
      if (random.coin()) test::add_motion(*capture, node, DVec3(random.in_box(1.0f)));
    }
    for (int l = 0; l < 3; ++l) {
      shaders::Light light;
      light.type = static_cast<shaders::Light::Type>(l);
      light.color = Vec3(3.0f);
      light.cos_inner = 0.9f, light.cos_outer = 0.5f;
      light.range = random.coin() ? 4.0f : 0.0f;
      capture->lights.push_back(light);
      scene::Node node;
      node.light = l;
      node.transform.translation = DVec3(random.in_box(2.0f)) + DVec3(0, 0, 2);
      capture->nodes.push_back(node);
      capture->roots.push_back(static_cast<int>(capture->nodes.size()) - 1);
      if (random.coin()) test::add_motion(*capture, static_cast<int>(capture->nodes.size()) - 1, {1, 0, 0});
    }
    scene::Camera camera;
    if (random.integer(0, 3) == 0) camera.type = scene::Camera::Type::kOrthographic;
    test::add_camera(*capture, {0, 0, 4}, camera);
    if (random.coin()) test::add_motion(*capture, static_cast<int>(capture->nodes.size()) - 1, {0.3, 0.1, 0});
    pose();
    frame->request.interpolated_surfaces = seed % 2 == 1;
    for (int k = 0; k < 300; ++k) add_invocation(random, quads);
    if (seed % 4 == 3) return;
    behind = random_image(random);
    if (seed % 5 != 4) lighting.behind = &behind;
    using Kind = shaders::Surroundings::Kind;
    if (seed % 3 == 1) lighting.environment = shaders::Environment({Kind::kImage, 0.8f, &sky()});
    if (seed % 6 == 3) lighting.environment = shaders::Environment({Kind::kUniform, 0.8f, nullptr});
  }

  // All lights cast, the directional one into two maps, at one time or at two. They hold depths of nothing in particular.
  void cast_shadows(std::uint32_t seed, shaders::ShadowFilter filter) {
    Random random(seed);
    shadow_settings.filter = filter;
    frame->request.shadow_casters = scene::ShadowCasters::kAll;
    shadow_settings.size = 24, shadow_settings.cascades = 2;
    const std::vector<scene::ShadowLight> lights = scene::shadow_lights(*frame, shadow_settings);
    light_views = scene::light_views(*frame, lights, shadow_settings);
    maps.reserve(lights.size());
    std::vector<FrameShadows::Caster> casters;
    for (std::size_t k = 0; k < lights.size(); ++k) {
      const int side = light_views[k].front().size;
      const int times = seed % 4 < 2 ? 1 : 2, layers = static_cast<int>(light_views[k].size());
      maps.emplace_back(side, times * layers, scene::DepthFormat::kD32F, side, side);
      for (int time = 0; time < times; ++time) {
        for (const scene::LightView& view : light_views[k]) {
          std::vector<float> depths(static_cast<std::size_t>(side * side));
          for (float& z : depths) z = random.uniform(view.camera.camera.near, view.camera.camera.far);
          maps.back().store(time * layers + view.layer, {0, 0, side, side}, depths);
        }
        casters.push_back({lights[k].light, light_views[k], &maps[k], time * layers, 0.25 + 0.5 * time});
      }
    }
    shadows = std::make_unique<FrameShadows>(*frame, casters, shadow_settings);
    lighting.shadows = shadows.get();
  }

 private:
  void add_invocation(Random& random, bool quads) {
    const int last = static_cast<int>(assembly->patch_drawable.size()) - 1;
    // Runs of the same patch, as tiles have.
    const std::uint32_t patch = !invocations.empty() && random.integer(0, 3) != 0
                                    ? invocations.back().at.patch
                                    : static_cast<std::uint32_t>(random.integer(0, last));
    const scene::CellRange cells = whole_patch(*frame, patch);
    const int count = 2 * (cells.i1 - cells.i0) * (cells.j1 - cells.j0);
    Invocation v;
    v.at = {patch, static_cast<std::uint32_t>(random.integer(0, count - 1)), random.uniform(0, 0.5f),
            random.uniform(0, 0.5f), 0};
    if (!has_grid(frame->drawable_of(patch))) {
      const auto& clusters = frame->assembly->clusters[frame->drawable_of(patch).drawable->geometry];
      const auto& cluster = clusters.clusters[patch - frame->drawable_of(patch).drawable->first_patch];
      // The second triangle of a cell may not be there.
      const auto& cell = clusters.cells[cluster.first_cell + v.at.triangle / 2];
      if (cell.corner[3] == cell.corner[2] || cell.corner[3] == cell.corner[0]) v.at.triangle &= ~1u;
    }
    const float t = random.uniform(0, 1);
    v.at.t = time_seen(*frame, patch, t);
    v.light_time = t;
    if (quads) v.partner_x = random.coin() ? 1 : -1, v.partner_y = random.coin() ? 1 : -1;
    v.quad = static_cast<std::uint32_t>(invocations.size() / 3);
    invocations.push_back(v);
  }
};

bool same_bits(const ShadedPoint& a, const ShadedPoint& b) {
  const auto bits = [](const ShadedPoint& p) {
    return std::array<float, 7>{p.color.x, p.color.y, p.color.z, p.alpha, p.normal.x, p.normal.y, p.normal.z};
  };
  const auto x = bits(a), y = bits(b);
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isnan(x[k]) && std::isnan(y[k])) continue;
    if (std::memcmp(&x[k], &y[k], sizeof x[k]) != 0) return false;
  }
  return true;
}

void expect_same_points(const ShaderScene& scene, const std::string& name) {
  std::vector<ShadedPoint> expected, found(scene.invocations.size());
  for (const Invocation& v : scene.invocations) expected.push_back(shade_point(*scene.frame, scene.lighting, v));
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    PixelShader shader;
    shader.shade(*scene.frame, scene.lighting, scene.invocations, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_TRUE(same_bits(found[i], expected[i]))
          << name << ", " << target << ", invocation " << i << ", patch " << scene.invocations[i].at.patch << ": "
          << found[i].color.x << " " << expected[i].color.x;
  }
  force_simd_target("");
}

// Invariant WARP1.
TEST(PixelShader, WARP1EachLaneShadesAsAnInvocationAlone) {
  for (std::uint32_t seed = 0; seed < 60; ++seed)
    expect_same_points(ShaderScene(seed, seed % 3 == 0), "seed " + std::to_string(seed));
}

// Invariant WARP1, where receivers stand still or move, in maps of one time or of several.
TEST(PixelShader, WARP1HoldsUnderLightsThatCastShadows) {
  int shadowed = 0, points = 0, receivers[2] = {0, 0};  // still, moving
  for (std::uint32_t seed = 0; seed < 36; ++seed) {
    ShaderScene scene(seed, seed % 4 == 0);
    const ShaderScene lit(seed, seed % 4 == 0);
    scene.cast_shadows(seed, static_cast<shaders::ShadowFilter>(seed % 3));
    expect_same_points(scene, "seed " + std::to_string(seed));
    for (const Invocation& v : scene.invocations) {
      ++points;
      ++receivers[scene.frame->drawable_of(v.at.patch).moving ? 1 : 0];
      shadowed += !same_bits(shade_point(*scene.frame, scene.lighting, v), shade_point(*lit.frame, lit.lighting, v));
    }
  }
  EXPECT_GT(shadowed, points / 5);
  EXPECT_GT(receivers[0], points / 10);
  EXPECT_GT(receivers[1], points / 10);
}

// The check sees one invocation in the place of its neighbour.
TEST(PixelShader, WARP1SeesLanesThatChangePlaces) {
  const ShaderScene scene(1);
  int differ = 0;
  for (std::size_t i = 1; i < scene.invocations.size(); ++i)
    differ += !same_bits(shade_point(*scene.frame, scene.lighting, scene.invocations[i]),
                         shade_point(*scene.frame, scene.lighting, scene.invocations[i - 1]));
  EXPECT_GT(differ, 250);
}

// Invariant WARP2.
TEST(PixelShader, WARP2DrawsTakeAsManyWarpsAsTheirInvocationsFill) {
  for (const bool quads : {false, true}) {
    const ShaderScene scene(5, quads);
    for (const std::size_t lanes : {4u, 16u, 32u, 128u}) {
      std::map<std::uint32_t, std::set<std::uint32_t>> draws;
      for (std::uint32_t i = 0; i < scene.invocations.size(); ++i)
        draws[scene.assembly->patch_drawable[scene.invocations[i].at.patch]].insert(quads ? scene.invocations[i].quad
                                                                                          : i);
      std::uint64_t expected = 0;
      for (const auto& [draw, members] : draws) expected += (members.size() * (quads ? 4 : 1) + lanes - 1) / lanes;
      PixelShader shader;
      std::vector<ShadedPoint> points(scene.invocations.size());
      shader.shade(*scene.frame, scene.lighting, scene.invocations, points, nullptr, lanes);
      EXPECT_EQ(shader.take_warps(), expected) << lanes << (quads ? " quads" : "");
    }
  }
}

// Invariant TX1: every line that lanes ask for alone, their warp asks for, each once in a slot and level.
TEST(PixelShader, TX1AWarpAsksForTheLinesOfItsLanesOnce) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const ShaderScene scene(seed);
    const shaders::RadianceImage* const images[] = {&scene.behind, &ShaderScene::sky().levels()};
    const TextureMemory memory(scene.capture->materials, 64, images);
    const TextureUnit::Settings settings{&memory, 1 << 20, 16, 64};
    PixelShader shader;
    std::vector<ShadedPoint> points(scene.invocations.size());
    TextureUnit together, alone;
    together.begin_tile(settings);
    alone.begin_tile(settings);
    shader.shade(*scene.frame, scene.lighting, scene.invocations, points, &together, 128);
    // Warps of one invocation: quads of one, in a batch of their own.
    for (const Invocation& v : scene.invocations)
      shader.shade(*scene.frame, scene.lighting, std::span(&v, 1), std::span(points).first(1), &alone, 4);
    const auto distinct = [](TextureUnit& unit) {
      const std::vector<std::uint32_t> misses = unit.take_misses();
      return std::set<std::uint32_t>(misses.begin(), misses.end());
    };
    EXPECT_EQ(distinct(together), distinct(alone)) << seed;
    const TextureCounters whole = together.take_counters(), parts = alone.take_counters();
    EXPECT_EQ(whole.texels, parts.texels) << seed;
    if (parts.texels > 0) {
      EXPECT_LT(whole.cache_requests, parts.cache_requests) << seed;
    }
  }
}

}  // namespace
}  // namespace tessera::tilecore::pixel_shader_test
