// The alpha of points on patches: its interpolation and its cost.
#include "tilecore/shading/alpha_test.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore::alpha_test_test {
namespace {

// Bent patches whose vertices have an alpha, and whose texture has one that rises from left to right.
struct MaskedPatches : TestFrame {
  explicit MaskedPatches(std::uint32_t seed, bool interpolated = true) {
    Random random(seed);
    scene::Material material;
    material.alpha_mode = scene::AlphaMode::kMask;
    Image8 image(64, 1, 4);
    for (std::size_t x = 0; x < 64; ++x) image.values[4 * x + 3] = static_cast<std::uint8_t>(4 * x);
    material.base_color_texture.texture =
        std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kSrgb);
    material.base_color_texture.sampler.wrap_s = material.base_color_texture.sampler.wrap_t =
        shaders::Wrap::kClampToEdge;
    material.base_color_texture.sampler.mip = shaders::MipFilter::kNone;
    scene::Primitive patches = test::closed_patches(test::add_material(*capture, material));
    patches.vertices.texcoords.resize(1);
    for (std::size_t k = 0; k < patches.vertices.count(); ++k) {
      patches.vertices.texcoords[0].emplace_back(static_cast<float>(k % 4) / 3, static_cast<float>(k / 4 % 4) / 3);
      patches.vertices.colors.emplace_back(1, 1, 1, random.uniform(0.25f, 1));
    }
    const int node = test::add_node(*capture, patches);
    if (seed % 3 == 1) test::add_motion(*capture, node, {0.3, 0.1, 0});
    test::add_camera(*capture, {0, 0, 4});
    assembly = std::make_unique<scene::Assembly>(scene::assemble(*capture));
    scene::FrameRequest request;
    request.width = 192, request.height = 128, request.close_time = 1;
    request.tessellation.target_edge_pixels = 8;
    request.interpolated_surfaces = interpolated;
    frame = scene::pose_frame(*assembly, scene::choose_camera(*capture, 192, 128), request);
  }
  const scene::PosedDrawable& drawable() const { return frame->drawable_of(0); }
  std::vector<SurfaceLocation> locations(Random& random, int each) const {
    std::vector<SurfaceLocation> all;
    for (std::uint32_t patch = 0; patch < drawable().drawable->patch_count; ++patch) {
      const scene::TessellationPattern& pattern = frame->pattern_of(patch);
      for (std::uint32_t triangle = 0; triangle < 2u * pattern.nu * pattern.nv; ++triangle)
        for (int k = 0; k < each; ++k) {
          const float b1 = random.uniform(0, 1), t = drawable().moving ? random.uniform(0, 1) : 0;
          all.push_back({patch, triangle, b1, random.uniform(0, 1 - b1), t});
        }
    }
    return all;
  }
};

// Invariant ALT1. The texture is read at its full size: levels follow from the triangle's plane here, and there from the
// patch's tangents.
TEST(AlphaTests, ALT1InterpolatedAlphaEqualsThePatchsAtItsVertices) {
  double largest_within = 0;
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    const MaskedPatches scene(seed);
    Random random(seed);
    AlphaTest test;
    test.begin(*scene.frame, scene.drawable());
    for (SurfaceLocation at : scene.locations(random, 1)) {
      largest_within = std::max(largest_within,
                                static_cast<double>(std::abs(test.alpha(at, nullptr) - point_alpha(*scene.frame, at))));
      at.b2 = 0;
      for (const float b1 : {0.0f, 1.0f}) {
        at.b1 = b1;
        ASSERT_NEAR(test.alpha(at, nullptr), point_alpha(*scene.frame, at), 1e-4) << seed << " " << at.patch;
      }
    }
  }
  // Between vertices a bilinear coordinate and vertex alpha are linear, within a few cells of a patch.
  EXPECT_GT(largest_within, 0);
  EXPECT_LT(largest_within, 0.1);
}

// Invariant ALT2: alone, or after all others, in another order.
TEST(AlphaTests, ALT2AlphaDependsOnTheLocationAlone) {
  const MaskedPatches scene(1);
  Random random(9);
  const std::vector<SurfaceLocation> locations = scene.locations(random, 2);
  AlphaTest forward, backward;
  forward.begin(*scene.frame, scene.drawable());
  std::vector<float> alpha;
  for (const SurfaceLocation& at : locations) alpha.push_back(forward.alpha(at, nullptr));
  backward.begin(*scene.frame, scene.drawable());
  for (std::size_t k = locations.size(); k-- > 0;) ASSERT_EQ(backward.alpha(locations[k], nullptr), alpha[k]) << k;
  for (std::size_t k = 0; k < locations.size(); k += 7) {
    AlphaTest alone;
    alone.begin(*scene.frame, scene.drawable());
    ASSERT_EQ(alone.alpha(locations[k], nullptr), alpha[k]) << k;
  }
}

// Invariant ALT3: a batch, and one after the other; an evaluated surface has a scalar twin.
TEST(AlphaTests, ALT3ABatchHasTheBitsAndTheLookupsOfEachPointAlone) {
  for (const bool interpolated : {false, true})
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
      const MaskedPatches scene(seed, interpolated);
      Random random(seed);
      const std::vector<SurfaceLocation> all = scene.locations(random, 3);
      const TextureMemory memory(std::span(scene.drawable().material, 1), 64);
      TextureUnit together, apart;
      for (TextureUnit* textures : {&together, &apart}) {
        textures->begin_tile({&memory, 1024, 4, 64});
        textures->keep_requests(true);
      }
      AlphaTest batches, alone;
      batches.begin(*scene.frame, scene.drawable()), alone.begin(*scene.frame, scene.drawable());
      std::array<float, AlphaTest::kBatch> alpha;
      for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
        const auto most = static_cast<std::size_t>(random.integer(1, static_cast<int>(AlphaTest::kBatch)));
        while (end < all.size() && end - first < most && all[end].patch == all[first].patch) ++end;
        batches.alphas(std::span(all).subspan(first, end - first), &together, alpha);
        for (std::size_t i = first; i < end; ++i) {
          ASSERT_EQ(alpha[i - first], alone.alpha(all[i], &apart)) << seed << " " << i;
          if (!interpolated) {
            ASSERT_EQ(alpha[i - first], point_alpha(*scene.frame, all[i])) << seed << " " << i;
          }
        }
      }
      EXPECT_EQ(together.take_requests(), apart.take_requests());
      EXPECT_EQ(together.counters().texels, apart.counters().texels);
      EXPECT_GT(together.counters().texels, 0u);
      const AlphaTest::Work a = batches.take_work(), b = alone.take_work();
      EXPECT_EQ(a.vertices, b.vertices);
      EXPECT_EQ(a.bytes, b.bytes);
    }
}

// Each vertex is made once for the sub-patch, and again for the next; an evaluated surface has none.
TEST(AlphaTests, WorkCountsEachVertexOnce) {
  const MaskedPatches scene(1);
  Random random(3);
  AlphaTest test;
  test.begin(*scene.frame, scene.drawable());
  const std::vector<SurfaceLocation> locations = scene.locations(random, 3);
  for (const SurfaceLocation& at : locations) (void)test.alpha(at, nullptr);
  std::uint64_t vertices = 0;
  for (std::uint32_t patch = 0; patch < scene.drawable().drawable->patch_count; ++patch) {
    const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
    vertices += (pattern.nu + 1u) * (pattern.nv + 1u);
  }
  const AlphaTest::Work work = test.take_work();
  EXPECT_EQ(work.vertices, vertices);
  EXPECT_EQ(work.bytes, (vertices + 3 * locations.size()) * AlphaTest::kMaskVertexBytes);
  test.begin(*scene.frame, scene.drawable());
  (void)test.alpha(locations[0], nullptr);
  EXPECT_EQ(test.take_work().vertices, 3u);

  const MaskedPatches evaluated(1, false);
  test.begin(*evaluated.frame, evaluated.drawable());
  for (const SurfaceLocation& at : locations) ASSERT_EQ(test.alpha(at, nullptr), point_alpha(*evaluated.frame, at));
  EXPECT_EQ(test.take_work().vertices, 0u);
}

}  // namespace
}  // namespace tessera::tilecore::alpha_test_test
