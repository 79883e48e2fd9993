// Layers of blended surfaces, and alpha masks.
#include "base/error.h"
#include "tests/support/tests.h"
#include "tests/tilecore/pixel_scene.h"
#include "tilecore/shading/layer_merge.h"

namespace tessera::tilecore::blending_test {
namespace {

using scene::AlphaMode;

// ---- Merging ----------------------------------------------------------------------------------------------------

BlendedLayer layer(float z, std::uint32_t patch, Vec3 color, float alpha) {
  return {color * alpha, alpha, z, patch, 0};
}

std::vector<BlendedLayer> random_layers(Random& random, int count) {
  std::vector<BlendedLayer> layers;
  for (int k = 0; k < count; ++k)
    layers.push_back(layer(static_cast<float>(random.integer(1, 12)), static_cast<std::uint32_t>(k),
                           Vec3(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)),
                           random.uniform(0, 1)));
  return layers;
}

void sort_far_to_near(std::vector<BlendedLayer>& layers) {
  std::sort(layers.begin(), layers.end(), [](const BlendedLayer& a, const BlendedLayer& b) { return nearer(b, a); });
}

// Colour and coverage over black.
Vec4 compose(const std::vector<BlendedLayer>& far_to_near) {
  Vec4 out(0);
  for (const BlendedLayer& l : far_to_near) out = out * (1.0f - l.alpha) + Vec4(l.color, l.alpha);
  return out;
}

Vec4 merged_over_black(std::vector<BlendedLayer> layers, std::size_t capacity) {
  LayerMerger merger;
  sort_far_to_near(layers);
  merger.merge(layers, capacity);
  EXPECT_LE(layers.size(), capacity);
  return compose(layers);
}

double difference(const Vec4& a, const Vec4& b) {
  const Vec4 d = glm::abs(a - b);
  return static_cast<double>(std::max(std::max(d.x, d.y), std::max(d.z, d.w)));
}

TEST(LayerMerger, WithRoomForAllNothingChanges) {
  Random random(1);
  LayerMerger merger;
  for (int k = 0; k < 500; ++k) {
    std::vector<BlendedLayer> layers = random_layers(random, random.integer(0, 64));
    sort_far_to_near(layers);
    const std::vector<BlendedLayer> before = layers;
    EXPECT_EQ(merger.merge(layers, 64), 0u);
    ASSERT_EQ(layers.size(), before.size());
    EXPECT_EQ(compose(layers), compose(before));
  }
}

TEST(LayerMerger, LayersSubmittedInOrderOfDepthMergeWithoutError) {
  // The nearer over the farther is associative: merging neighbours in depth loses nothing.
  Random random(2);
  for (int k = 0; k < 500; ++k) {
    std::vector<BlendedLayer> layers = random_layers(random, random.integer(1, 30));
    sort_far_to_near(layers);
    if (random.coin()) std::reverse(layers.begin(), layers.end());
    for (std::size_t i = 0; i < layers.size(); ++i)
      layers[i].patch = static_cast<std::uint32_t>(i),
      layers[i].z = std::abs(static_cast<float>(i) - (layers[0].z > layers.back().z ? 100.0f : 0.0f));
    std::vector<BlendedLayer> sorted = layers;
    sort_far_to_near(sorted);
    for (const std::size_t capacity : {1u, 2u, 8u})
      EXPECT_LT(difference(merged_over_black(layers, capacity), compose(sorted)), 1e-5);
  }
}

TEST(LayerMerger, ALayerBetweenMergedLayersIsBehindThem) {
  // Room for two; a to e by depth, submitted as a, e, c, d, b. The third makes (c over e), at c's depth; d lies behind
  // that and makes ((c over e) over d): wrong, d was before e. b makes (b over all that); a is nearest throughout.
  const BlendedLayer a = layer(1, 0, {1, 0, 0}, 0.5f), e = layer(5, 1, {0, 1, 0}, 0.25f),
                     c = layer(3, 2, {0, 0, 1}, 0.5f), d = layer(4, 3, {1, 1, 0}, 0.75f),
                     b = layer(2, 4, {0, 1, 1}, 0.5f);
  const auto over = [](const Vec4& front, const Vec4& back) { return front + back * (1.0f - front.w); };
  const auto whole = [](const BlendedLayer& l) { return Vec4(l.color, l.alpha); };
  const Vec4 expected = over(whole(a), over(whole(b), over(over(whole(c), whole(e)), whole(d))));
  const Vec4 exact = over(whole(a), over(whole(b), over(whole(c), over(whole(d), whole(e)))));
  std::vector<BlendedLayer> layers = {a, b, c, d, e};
  EXPECT_LT(difference(merged_over_black(layers, 2), expected), 1e-6);
  EXPECT_GT(difference(expected, exact), 0.01);
  EXPECT_LT(difference(merged_over_black(layers, 5), exact), 1e-6);
  LayerMerger merger;
  sort_far_to_near(layers);
  EXPECT_EQ(merger.merge(layers, 2), 3u);
}

TEST(LayerMerger, NothingIsDropped) {
  // Whatever the order of merging, light passes through all layers: the transmittances multiply.
  Random random(3);
  for (int k = 0; k < 500; ++k) {
    const std::vector<BlendedLayer> layers = random_layers(random, random.integer(1, 40));
    double through = 1;
    for (const BlendedLayer& l : layers) through *= 1 - static_cast<double>(l.alpha);
    for (const std::size_t capacity : {1u, 3u, 8u})
      EXPECT_NEAR(1 - static_cast<double>(merged_over_black(layers, capacity).w), through, 1e-5);
  }
}

// The same machine, fed in the order in which layers happen to arrive.
Vec4 merged_as_they_come(const std::vector<BlendedLayer>& layers, std::size_t capacity) {
  std::vector<BlendedLayer> renumbered = layers;
  for (std::size_t i = 0; i < renumbered.size(); ++i) renumbered[i].patch = static_cast<std::uint32_t>(i);
  return merged_over_black(renumbered, capacity);
}

TEST(LayerMerger, TheOrderOfArrivalDoesNotMatter) {
  Random random(4);
  double as_they_come = 0;
  for (int k = 0; k < 200; ++k) {
    std::vector<BlendedLayer> layers = random_layers(random, 20);
    for (std::size_t i = 0; i < layers.size(); ++i) layers[i].z = static_cast<float>((i * 7) % 20);  // distinct
    const Vec4 expected = merged_over_black(layers, 3), arrived = merged_as_they_come(layers, 3);
    for (std::size_t i = layers.size() - 1; i > 0; --i)
      std::swap(layers[i], layers[static_cast<std::size_t>(random.integer(0, static_cast<int>(i)))]);
    LayerMerger merger;
    std::vector<BlendedLayer> shuffled = layers;
    merger.merge(shuffled, 3);  // not even sorted
    EXPECT_EQ(compose(shuffled), expected);
    as_they_come = std::max(as_they_come, difference(merged_as_they_come(layers, 3), arrived));
  }
  EXPECT_GT(as_they_come, 0.05);  // a machine that merges in order of arrival is caught
}

// ---- In the tile ------------------------------------------------------------------------------------------------

// Blended quads in several depths, nearest first, before an opaque wall.
PixelScene stack(const std::vector<Vec4>& near_to_far, bool moving) {
  PixelScene scene(16, 16, 4);
  for (std::size_t k = 0; k < near_to_far.size(); ++k) {
    const int node =
        scene.add_quad(-40, -40, 96, 96, -static_cast<float>(k), unlit(near_to_far[k], AlphaMode::kBlend), k % 2 == 0);
    if (moving) test::add_motion(*scene.capture, node, {k % 3 == 0 ? 5.0 : -4.0, 2, 0});
  }
  scene.add_quad(-40, -40, 96, 96, -20, unlit({0.2f, 0.3f, 0.4f, 1}), true);
  scene.add_quad(-40, -40, 96, 96, -30, unlit({1, 1, 1, 0.5f}, AlphaMode::kBlend), true);  // hidden
  scene.look();
  return scene;
}

TEST(Blending, ThreeLayersGiveTheAnalyticColour) {
  const std::vector<Vec4> colors = {{1, 0, 0, 0.5f}, {0, 1, 0, 0.25f}, {0, 0, 1, 0.75f}};
  Vec3 expected(0.2f, 0.3f, 0.4f);
  for (std::size_t k = colors.size(); k-- > 0;)
    expected = expected * (1.0f - colors[k].w) + Vec3(colors[k]) * colors[k].w;
  for (const bool moving : {false, true})
    for (const ShadingRate rate : {ShadingRate::kPixel, ShadingRate::kSample, ShadingRate::kCache}) {
      PixelScene scene = stack(colors, moving);
      scene.job.shading.rate = rate;
      const Rendering r = render(scene);
      EXPECT_EQ(r.counters.blended_layers, 16u * 16 * 4 * 3);
      EXPECT_EQ(r.counters.blend_overflows, 0u);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(r.targets.color.at(5, 9)[c], expected[static_cast<int>(c)], 1e-5f);
    }
}

TEST(Blending, OverflowsMergeAndAreCounted) {
  // The quads are submitted near to far, so that merging is exact; the count equals the count of a machine with room
  // for two.
  const std::vector<Vec4> colors = {
      {1, 0, 0, 0.5f}, {0, 1, 0, 0.25f}, {0, 0, 1, 0.75f}, {1, 1, 0, 0.5f}, {0, 1, 1, 0.5f}};
  PixelScene scene = stack(colors, false);
  const Rendering roomy = render(scene);
  scene.job.core.blend_layers = 2;
  const Rendering tight = render(scene);
  EXPECT_EQ(roomy.counters.blend_overflows, 0u);
  EXPECT_EQ(tight.counters.blend_overflows, 16u * 16 * 4 * 3);
  EXPECT_EQ(tight.counters.pixel_shader_invocations, roomy.counters.pixel_shader_invocations);
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_NEAR(tight.targets.color.at(3, 3)[c], roomy.targets.color.at(3, 3)[c], 1e-5f);
}

TEST(Blending, ShuffledEntriesAndPartialRendersGiveTheSameBits) {  // DS1
  Random random(8);
  PixelScene scene(32, 32, 4);
  for (int k = 0; k < 24; ++k) {
    const Vec4 color(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), random.uniform(0.2f, 0.8f));
    const bool opaque = k % 6 == 0;
    const int node = scene.add_quad(random.uniform(-20, 20), random.uniform(-20, 20), 30, 30, random.uniform(-20, 0),
                                    unlit(color, opaque ? AlphaMode::kOpaque : AlphaMode::kBlend), k % 2 == 0);
    if (k % 3 == 0) test::add_motion(*scene.capture, node, {random.uniform(-9, 9), 3, 0});
  }
  scene.look();
  scene.job.core.blend_layers = 2;
  const Rendering expected = render(scene);
  EXPECT_GT(expected.counters.blend_overflows, 100u);
  scene.tile(8, 8);
  EXPECT_EQ(render(scene).targets.color.values, expected.targets.color.values);
  EXPECT_EQ(render(scene).counters.blend_overflows, expected.counters.blend_overflows);
  scene.tile(32, 32);
  for (const std::size_t passes : {1u, 3u, 7u}) {
    std::vector<binner::ListEntry> entries = scene.entries();
    for (std::size_t i = entries.size() - 1; i > 0; --i)
      std::swap(entries[i], entries[static_cast<std::size_t>(random.integer(0, static_cast<int>(i)))]);
    for (auto& e : entries) e.near_depth = -random.uniform(0, 1);  // any order within a pass
    TileCore core;
    TileState state;
    FrameTargets targets({0, 0, 32, 32}, true);
    for (std::size_t pass = 0; pass < passes; ++pass) {
      std::vector<binner::ListEntry> part;
      for (std::size_t e = pass; e < entries.size(); e += passes) part.push_back(entries[e]);
      core.render_entries(scene.job, 0, part, state);
    }
    core.finish(scene.job, 0, state, targets);
    EXPECT_EQ(targets.color.values, expected.targets.color.values);
    EXPECT_EQ(core.take_result().counters.shading.blend_overflows, expected.counters.blend_overflows);
  }
}

TEST(Blending, LayersThatAreHiddenTakeNoRoomAndTooManyVisibleOnesAreAnError) {
  TileState state;
  state.max_layers = 100;
  state.start(8, 8, 1);
  for (auto& z : state.z) z = 5;
  const auto put = [&](float z) { state.add_layer({3, 0, 0, z, 0, 0, 0, 0}); };
  for (int k = 0; k < 1000; ++k) put(5.5f);
  EXPECT_TRUE(state.layers.empty());
  for (int k = 0; k < 100; ++k) put(4);
  EXPECT_THROW(put(4), LimitError);
  state.z[3] = 3;  // something opaque arrived in front
  put(2);
  EXPECT_EQ(state.layers.size(), 1u);
}

TEST(Blending, AStoredStateHoldsNoMoreLayersThanTheMachineKeeps) {
  TileState state;
  state.start(4, 4, 1);
  for (std::uint32_t k = 0; k < 10; ++k) state.add_layer({k % 2, k, 0, 1.0f, 0, 0, 0, 0});
  EXPECT_EQ(state.bytes(8), 4u * 12 + 10 * 16);
  EXPECT_EQ(state.bytes(3), 4u * 12 + 6 * 16);
}

// Decals, whichever of the two comes first, still or moving, of triangles or patches.
TEST(Blending, ABlendedSurfaceInThePlaneOfAnOpaqueOneIsSeenOnIt) {
  for (const bool bezier : {false, true})
    for (const bool blended_first : {false, true})
      for (const double way : {0.0, 20.0}) {
        PixelScene scene(16, 16, 4);
        for (const bool blended : {blended_first, !blended_first}) {
          const auto material = blended ? unlit({0, 1, 0, 0.5f}, AlphaMode::kBlend) : unlit({1, 0, 0, 1});
          const int node = scene.add_quad(-40, -40, 96, 96, 0, material, bezier);
          if (way > 0) test::add_motion(*scene.capture, node, {way, 0, 0});
        }
        scene.look();
        const Rendering r = render(scene);
        const auto middle = r.targets.color.at(8, 8);
        EXPECT_NEAR(middle[0], 0.5f, 1e-5f) << bezier << blended_first << way;
        EXPECT_NEAR(middle[1], 0.5f, 1e-5f) << bezier << blended_first << way;
      }
}

// ---- Alpha masks ------------------------------------------------------------------------------------------------

TEST(AlphaMask, AHoleShowsTheBackgroundWhereItIsAtTheTimeOfTheSample) {
  // Red, with alpha 0 in its left half, over green; the edge starts at pixel 20 and moves by `way` during the shutter.
  Image8 image(2, 1, 4);
  image.values = {255, 255, 255, 0, 255, 255, 255, 255};
  scene::Material mask = unlit({1, 0, 0, 1}, AlphaMode::kMask);
  mask.base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kLinear);
  mask.base_color_texture.sampler.magnify_linear = false;
  for (const bool bezier : {false, true})
    for (const double way : {0.0, 30.0}) {
      PixelScene scene(64, 16, 16);
      const int node = scene.add_quad(-180, -40, 400, 96, 0, mask, bezier);
      if (way > 0) test::add_motion(*scene.capture, node, {way, 0, 0});
      scene.add_quad(-10, -10, 100, 50, -1, unlit({0, 1, 0, 1}), true);
      scene.look();
      const Rendering r = render(scene);
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 64; ++x) {
          // Samples right of the edge see red; those within a tenth of a pixel of it may see either.
          int least = 0, most = 0;
          for (int k = 0; k < 16; ++k) {
            const double edge = 20 + way * static_cast<double>(scene.pattern.t(x, y, k)),
                         at = x + static_cast<double>(scene.pattern.offset(k).x);
            least += at > edge + 0.1;
            most += at > edge - 0.1;
          }
          const float red = r.targets.color.at(x, y)[0] * 16, green = r.targets.color.at(x, y)[1] * 16;
          EXPECT_GE(red, static_cast<float>(least) - 0.01f) << x << " " << y;
          EXPECT_LE(red, static_cast<float>(most) + 0.01f) << x << " " << y;
          EXPECT_NEAR(red + green, 16, 0.01);
        }
      if (way > 0) {
        EXPECT_NEAR(r.targets.color.at(35, 8)[0], 0.5f, 0.15f);
      }
    }
}

}  // namespace
}  // namespace tessera::tilecore::blending_test
