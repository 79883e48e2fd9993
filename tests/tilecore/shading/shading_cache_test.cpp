// Shading cells, the shading cache, and shading through them.
#include <deque>

#include "base/image_metrics.h"
#include "tests/support/tests.h"
#include "tests/tilecore/pixel_scene.h"
#include "tilecore/shading/shading_cache.h"
#include "tilecore/shading/shading_cells.h"

namespace tessera::tilecore::shading_cache_test {
namespace {

// ---- Cells ------------------------------------------------------------------------------------------------------

// Bent, displaced, moving patches and large and small triangles, in perspective.
struct MixedScene : TestFrame {
  explicit MixedScene(bool interpolated = false) {
    Random random(3);
    scene::Material rough;
    rough.double_sided = true;
    rough.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.3f, 0);
    const int m = test::add_material(*capture, rough);
    for (int k = 0; k < 6; ++k) {
      auto points = test::flat_patch(random.in_box(1.5f), random.in_box(1.5f), random.in_box(1.5f));
      for (Vec3& p : points) p += random.in_box(0.1f);
      test::add_motion(*capture, test::add_node(*capture, test::patches(points, m)), DVec3(random.in_box(0.5f)));
      std::vector<Vec3> corners;
      std::vector<std::uint32_t> indices;
      for (std::uint32_t v = 0; v < 24; ++v) {
        corners.push_back(random.in_box(v < 12 ? 1.5f : 0.02f));
        indices.push_back(v);
      }
      test::add_motion(*capture, test::add_node(*capture, test::triangles(corners, indices, m)),
                       DVec3(random.in_box(0.5f)));
    }
    test::add_camera(*capture, {0, 0, 4});
    pose(320, 240);
    frame->request.interpolated_surfaces = interpolated;
  }
};

SurfaceLocation random_location(const MixedScene& scene, Random& random) {
  SurfaceLocation at;
  at.patch = static_cast<std::uint32_t>(random.integer(0, static_cast<int>(scene.assembly->patch_count()) - 1));
  const bool bezier = has_grid(scene.frame->drawable_of(at.patch));
  const auto& pattern = scene.frame->pattern_of(at.patch);
  at.triangle = static_cast<std::uint32_t>(random.integer(0, bezier ? 2 * pattern.nu * pattern.nv - 1 : 7));
  if (!bezier) at.triangle *= 2;  // cells of one triangle each, as no two share an edge
  at.b1 = random.uniform(0, 1);
  at.b2 = random.uniform(0, 1.0f - at.b1);
  at.t = random.uniform(0, 1);
  return at;
}

TEST(ShadingCells, CELL1ACellDependsNeitherOnTheTimeNorOnEarlierMeasurements) {
  const MixedScene scene;
  ShadingCells warm;
  warm.start(*scene.frame);
  Random random(4);
  for (int k = 0; k < 20000; ++k) {
    SurfaceLocation at = random_location(scene, random);
    const ShadingCell cell = warm.cell_of(at);
    at.t = 1.0f - at.t;
    EXPECT_EQ(warm.cell_of(at), cell);
    if (k % 200 != 0) continue;
    ShadingCells cold;
    cold.start(*scene.frame);
    EXPECT_EQ(cold.cell_of(at), cell);
  }
}

class CanonicalPoints : public testing::TestWithParam<bool> {};

TEST_P(CanonicalPoints, CELL2LieInTheirCellsAndOnTheSurface) {
  const MixedScene scene(GetParam());
  ShadingCells cells;
  cells.start(*scene.frame);
  Random random(5);
  for (int k = 0; k < 20000; ++k) {
    const ShadingCell cell = cells.cell_of(random_location(scene, random));
    const bool of_patch = has_grid(scene.frame->drawable_of(cell.patch));
    const SurfaceLocation point = ShadingCells::canonical_point(*scene.frame, cell);
    EXPECT_EQ(cells.cell_of(point), cell);
    EXPECT_EQ(point.triangle == SurfaceLocation::kWholePatch, of_patch && !GetParam());
    EXPECT_EQ(point.t, ShadingCells::kTime);
    EXPECT_GE(std::min(point.b1, point.b2), 0.0f);
    if (point.triangle != SurfaceLocation::kWholePatch) {
      EXPECT_LE(point.b1 + point.b2, 1.0f);
    } else {
      EXPECT_LE(std::max(point.b1, point.b2), 1.0f);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Surfaces, CanonicalPoints, testing::Bool(), [](const auto& interpolated) {
  return std::string(interpolated.param ? "Interpolated" : "Evaluated");
});

TEST(ShadingCells, AreAboutAPixelWideWhateverTheSizeOfTheSurface) {
  for (const bool bezier : {false, true})
    for (const float side : {3.0f, 20.0f, 77.0f, 150.0f, 400.0f}) {
      PixelScene scene(416, 416, 1);
      scene.add_quad(8, 8, side, side * 0.6f, 0, unlit(Vec4(1)), bezier);
      scene.look();
      for (const float wanted : {0.5f, 1.0f, 2.5f}) {
        ShadingCells cells;
        cells.start(*scene.frame, wanted);
        // Distinct cells along a row of the surface; the triangles' corners at the quad's own are right angles.
        std::map<std::tuple<std::uint32_t, std::uint32_t>, int> seen;
        constexpr int kSteps = 4000;
        for (int k = 0; k < kSteps; ++k) {
          const float p = (static_cast<float>(k) + 0.5f) / kSteps;
          const ShadingCell cell =
              cells.cell_of({0, bezier ? SurfaceLocation::kWholePatch : 0u, p, bezier ? 0.3f : 0.0f, 0});
          if (!bezier) {
            EXPECT_EQ(cell.origin, 1);  // of (0, 1, 2): below right
          }
          ++seen[{cell.part, bezier ? cell.i : cell.j}];
        }
        const double pixels = static_cast<double>(side) / static_cast<double>(seen.size());
        EXPECT_GT(pixels / static_cast<double>(wanted), 0.70) << side << (bezier ? " patch" : " triangles");
        EXPECT_LT(pixels / static_cast<double>(wanted), 1.42) << side << (bezier ? " patch" : " triangles");
      }
    }
}

// ---- Cache ------------------------------------------------------------------------------------------------------

ShadingCell numbered(std::uint32_t n) {
  ShadingCell cell;
  cell.patch = n % 3;
  cell.part = n / 3 % 5;
  cell.i = static_cast<std::uint16_t>(n / 15);
  return cell;
}

// Hits of a stream of lookups in a list that is searched from the front; `refresh` moves a found entry to the front.
std::vector<bool> hits_in_list(const std::vector<std::uint32_t>& stream, std::size_t capacity, bool refresh) {
  std::deque<std::uint32_t> list;
  std::vector<bool> hits;
  for (const std::uint32_t n : stream) {
    const auto found = std::find(list.begin(), list.end(), n);
    hits.push_back(found != list.end());
    if (hits.back() && !refresh) continue;
    if (hits.back()) list.erase(found);
    list.push_front(n);
    if (list.size() > capacity) list.pop_back();
  }
  return hits;
}

TEST(ShadingCache, SHC1SHC2FindsTheLastUsedCellsAndNothingElse) {
  Random random(6);
  ShadingCache cache;
  for (const std::size_t capacity : {1u, 2u, 7u, 100u, 3000u, 1000000u}) {
    cache.empty(capacity);
    std::vector<std::uint32_t> stream;
    std::vector<bool> hits;
    for (int k = 0; k < 20000; ++k) {
      const auto n = static_cast<std::uint32_t>(random.coin() ? random.integer(0, 40) : random.integer(0, 4000));
      stream.push_back(n);
      const std::uint32_t found = cache.find(numbered(n));
      hits.push_back(found != ShadingCache::kNone);
      if (found != ShadingCache::kNone)
        ASSERT_EQ(found, 3 * n);
      else
        cache.insert(numbered(n), 3 * n);
      ASSERT_LE(cache.size(), capacity);
    }
    EXPECT_EQ(hits, hits_in_list(stream, capacity, true)) << capacity;
    // The same check notices a cache that replaces the oldest entry instead.
    if (capacity > 1 && capacity < 4000) {
      EXPECT_NE(hits, hits_in_list(stream, capacity, false)) << capacity;
    }
  }
}

// ---- Shading through the cache ----------------------------------------------------------------------------------

// A textured patch and textured triangles that move over a textured wall, and a blended quad in front.
PixelScene busy_scene() {
  PixelScene scene(64, 64, 8);
  Image8 image(16, 16, 4);
  Random random(9);
  for (std::uint8_t& v : image.values) v = static_cast<std::uint8_t>(random.integer(40, 255));
  const auto texture = std::make_shared<shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
  const auto textured = [&](Vec4 color, scene::AlphaMode mode) {
    scene::Material material = unlit(color, mode);
    material.base_color_texture.texture = texture;
    return material;
  };
  scene.add_quad(-4, -4, 72, 72, 0, textured({1, 1, 1, 1}, scene::AlphaMode::kOpaque), true);
  test::add_motion(*scene.capture,
                   scene.add_quad(4, 6, 30, 30, 1, textured({1, 0.5f, 0, 1}, scene::AlphaMode::kOpaque), true),
                   {17, 5, 0});
  test::add_motion(*scene.capture,
                   scene.add_quad(30, 30, 25, 25, 2, textured({0, 1, 0.7f, 1}, scene::AlphaMode::kOpaque), false),
                   {-15, 9, 0});
  test::add_motion(*scene.capture,
                   scene.add_quad(10, 20, 40, 22, 3, textured({0.3f, 0.3f, 1, 0.5f}, scene::AlphaMode::kBlend), true),
                   {8, 0, 0});
  scene.look();
  scene.job.shading.rate = ShadingRate::kCache;
  return scene;
}

TEST(ShadingRateCache, TheImageDependsNeitherOnTheCapacityNorOnTheTiles) {  // DS1
  PixelScene scene = busy_scene();
  const Rendering expected = render(scene);
  EXPECT_GT(expected.counters.blended_layers, 0u);
  std::uint64_t invocations = expected.counters.samples_visible + expected.counters.blended_layers;
  for (const std::size_t entries : {1u, 16u, 1024u, 1000000u}) {
    scene.job.shading_cache.entries = entries;
    for (const int side : {8, 16, 32, 64}) {
      scene.tile(side, side);
      const Rendering r = render(scene);
      EXPECT_EQ(r.targets.color.values, expected.targets.color.values) << entries << " entries, tiles of " << side;
      EXPECT_EQ(r.targets.normal.values, expected.targets.normal.values) << entries << " entries, tiles of " << side;
      // DS2
      EXPECT_EQ(r.counters.pixel_shader_invocations + r.counters.pixel_shader_invocations_saved,
                r.counters.samples_visible + r.counters.blended_layers);
      if (side != 64) continue;
      EXPECT_LE(r.counters.pixel_shader_invocations, invocations) << entries;  // LRU: more room never costs a hit
      invocations = r.counters.pixel_shader_invocations;
    }
  }
}

TEST(ShadingRateCache, RunsAndRunsSavedAddUpAtEveryRate) {
  PixelScene scene = busy_scene();
  for (const ShadingRate rate :
       {ShadingRate::kPixel, ShadingRate::kPrimitive, ShadingRate::kSample, ShadingRate::kCache}) {
    scene.job.shading.rate = rate;
    const ShadingCounters c = render(scene).counters;
    EXPECT_EQ(c.pixel_shader_invocations + c.pixel_shader_invocations_saved, c.samples_visible + c.blended_layers);
    EXPECT_EQ(c.pixel_shader_invocations_saved == 0, rate == ShadingRate::kSample);
  }
}

// Opaque image of a scene of one tile, every sample coloured by `color`.
Image image_by(const PixelScene& scene, const std::function<Vec3(const SurfaceLocation&)>& color) {
  TileCore core;
  TileState state;
  core.render_entries(scene.job, 0, scene.entries(), state);
  const int spp = scene.pattern.samples_per_pixel();
  Image out(scene.width, scene.height, 3);
  for (std::size_t s = 0; s < state.z.size(); ++s) {
    if (state.patch[s] == TileState::kNoPatch) continue;
    const Vec3 c = color({state.patch[s], state.triangle[s], state.b1[s], state.b2[s], 0}) / static_cast<float>(spp);
    for (std::size_t k = 0; k < 3; ++k) out.values[s / static_cast<std::size_t>(spp) * 3 + k] += c[static_cast<int>(k)];
  }
  return out;
}

Image three_channels(const Image& color) {
  Image out(color.width, color.height, 3);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (std::size_t k = 0; k < 3; ++k) out.at(x, y)[k] = color.at(x, y)[k];
  return out;
}

// Samples coloured from cells that are shaded once and kept in a map under `name`.
template <class Name>
Image image_from_map(const PixelScene& scene, const Name& name) {
  ShadingCells cells;
  cells.start(*scene.frame);
  std::map<decltype(name(ShadingCell())), Vec3> shaded;
  return image_by(scene, [&](const SurfaceLocation& at) {
    const ShadingCell cell = cells.cell_of(at);
    const auto [found, fresh] = shaded.try_emplace(name(cell));
    if (fresh)
      found->second =
          shade_point(*scene.frame, scene.job.lighting, {ShadingCells::canonical_point(*scene.frame, cell)}).color;
    return found->second;
  });
}

TEST(ShadingRateCache, IsShadingOfEveryCellAtItsCanonicalPoint) {
  PixelScene scene = busy_scene();
  scene.capture->meshes.back().primitives[0].material = 0;  // nothing blends
  scene.look();
  scene.job.shading.rate = ShadingRate::kCache;
  const Image expected = three_channels(render(scene).targets.color);
  const Image by_cell =
      image_from_map(scene, [](const ShadingCell& c) { return std::tuple(c.patch, c.part, c.i, c.j); });
  const Image without_patch = image_from_map(scene, [](const ShadingCell& c) { return std::tuple(c.part, c.i, c.j); });
  const Image without_part = image_from_map(scene, [](const ShadingCell& c) { return std::tuple(c.patch, c.i, c.j); });
  EXPECT_LT(max_difference(by_cell, expected), 1e-5);
  // Names that leave out a member mix up cells, and the check sees it.
  EXPECT_GT(max_difference(without_patch, expected), 0.1);
  EXPECT_GT(max_difference(without_part, expected), 0.1);
}

// A wall with waves of 32 pixels, 0.5 +- 0.25 bright in both directions.
constexpr double kWave = 32, kAmplitude = 0.25;
scene::Material waves(int texels) {
  Image8 image(texels, texels, 4);
  for (int y = 0; y < texels; ++y)
    for (int x = 0; x < texels; ++x) {
      const auto wave = [](int i) { return 0.5 + kAmplitude * std::sin(2 * std::numbers::pi * (i + 0.5) / kWave); };
      const double value[4] = {wave(x), wave(y), 0.5 * (wave(x) + wave(y)), 1};
      for (std::size_t c = 0; c < 4; ++c) image.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(value[c] * 255));
    }
  scene::Material material = unlit(Vec4(1));
  material.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
  return material;
}

TEST(ShadingRateCache, ComesCloseToShadingPerPixelOnATexturedWall) {
  // Per pixel, one colour stands for the pixel; its point lies within half a pixel of the middle in x and y. Through
  // the cache, a sample has the colour of its cell's middle, evenly spread within half a cell, which is at most
  // sqrt(2) pixels: along an axis rms 0.5 / sqrt(3) = 0.29 and 0.71 / sqrt(3) = 0.41 pixels. A sine of amplitude a
  // and wave length w changes by at most 2 pi a / (w sqrt(2)) rms a pixel; texels of 8 bits add less than 0.003.
  // Averaging only helps.
  const double slope = 2 * std::numbers::pi * kAmplitude / (kWave * std::numbers::sqrt2),
               bound = slope * (0.29 + 0.41) + 0.003;
  const double least_psnr = -20 * std::log10(bound);
  for (const bool bezier : {false, true}) {
    PixelScene scene(128, 128, 4);
    scene.add_quad(0, 0, 128, 128, 0, waves(128), bezier);
    scene.look();
    const Image per_pixel = three_channels(render(scene).targets.color);
    scene.job.shading.rate = ShadingRate::kCache;
    const Rendering cached = render(scene);
    EXPECT_GT(psnr(per_pixel, three_channels(cached.targets.color)), least_psnr);
    EXPECT_LT(cached.counters.pixel_shader_invocations, 128u * 128u * 5 / 4);
    // Cells eight times as wide do not pass.
    const auto coarse = [&](const SurfaceLocation& at) {
      ShadingCells cells;
      cells.start(*scene.frame);
      ShadingCell cell = cells.cell_of(at);
      cell.i &= ~7;
      cell.j &= ~7;
      return shade_point(*scene.frame, scene.job.lighting, {ShadingCells::canonical_point(*scene.frame, cell)}).color;
    };
    PixelScene part(32, 32, 1);
    part.add_quad(0, 0, 128, 128, 0, waves(128), bezier);
    part.look();
    const Image fine = three_channels(render(part).targets.color);
    EXPECT_LT(psnr(fine, image_by(part, [&](const SurfaceLocation& at) { return coarse(at); })), least_psnr);
  }
}

TEST(ShadingRateCache, CostDoesNotGrowWithMotionBlur) {
  for (const bool bezier : {false, true}) {
    std::map<ShadingRate, double> still;
    for (const double blur : {0.0, 8.0, 24.0, 64.0}) {
      PixelScene scene(192, 96, 32);
      test::add_motion(*scene.capture, scene.add_quad(40, 10, 64, 64, 0, waves(64), bezier), {blur, 0, 0});
      scene.look();
      for (const ShadingRate rate :
           {ShadingRate::kPixel, ShadingRate::kPrimitive, ShadingRate::kSample, ShadingRate::kCache}) {
        scene.job.shading.rate = rate;
        const ShadingCounters counters = render(scene).counters;
        const auto runs = static_cast<double>(counters.pixel_shader_invocations);
        // The same share of the samples sees the quad, however it moves.
        EXPECT_NEAR(static_cast<double>(counters.samples_visible), 64 * 64 * 32, 64 * 64 * 32 * 0.01);
        if (blur == 0) still[rate] = runs;
        if (rate == ShadingRate::kCache) {
          EXPECT_NEAR(runs / still[rate], 1, 0.15) << blur;
          EXPECT_LT(runs, 64 * 64 * 1.25) << blur;
        } else if (rate == ShadingRate::kPixel && blur >= 24) {
          EXPECT_GT(runs / still[rate], 6) << blur;  // most samples of a pixel see different pieces of the quad
        }
      }
    }
  }
}

TEST(ShadingRateCache, TilesShadeAgainCellsThatBlurCarriesIntoThem) {
  // A wall that moves by L pixels along rows of tiles of side T: each tile sees T + L columns of cells.
  PixelScene scene(128, 32, 64);
  test::add_motion(*scene.capture, scene.add_quad(-128, -16, 512, 64, 0, waves(64), true), {48, 0, 0});
  scene.look();
  scene.job.shading.rate = ShadingRate::kCache;
  scene.job.shading_cache.entries = 1000000;
  for (const int side : {16, 32}) {
    scene.tile(side, 32);
    const auto runs = static_cast<double>(render(scene).counters.pixel_shader_invocations);
    EXPECT_NEAR(runs / (128 * 32), 1 + 48.0 / side, 0.15 * (1 + 48.0 / side)) << side;
  }
}

}  // namespace
}  // namespace tessera::tilecore::shading_cache_test
