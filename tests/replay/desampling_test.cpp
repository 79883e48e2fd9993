// Desampling, advection and reconstruction in whole replays: invariants and hard cases of the resolve unit.
#include "base/error.h"
#include "base/image_codec.h"
#include "base/simd_targets.h"
#include "tests/replay/desampling_replays.h"
#include "tests/support/tests.h"
#include "tilecore/resolve/tile_border.h"

namespace tessera::replay::desampling_test {
namespace {

// ---- Unaffected by desampling -----------------------------------------------------------------------------------

TEST(Desampling, OffLeavesNoTraceInImageOrStatistics) {
  const gpu::FrameResult off = plain().renderer(shipped("serpent")).render(12);
  EXPECT_TRUE(absent(off.counters.desampling));
  EXPECT_FALSE(counters_json(off.counters).contains("resolve.blocks_rate_16"));
  EXPECT_FALSE(off.effects.at("desampling"));
  for (const memory::Purpose purpose : {memory::Purpose::kHistory, memory::Purpose::kNeighbours})
    EXPECT_EQ(off.counters.ledger.traffic(memory::Unit::kResolve, purpose).written_bytes, 0u);
}

// RU3: with thresholds that leave every block at its full rate the unit runs, and changes nothing.
TEST(Desampling, FullRateEverywhereIsThePlainImageBitForBit) {
  for (const char* name : {"eggs", "serpent", "flyby", "vases"}) {
    const Capture capture = shipped(name);
    const int first = capture.settings.first_frame;
    Machine full;
    full.thresholds("0", "1000000", "1000000").set("resolve.advection=false");
    const auto expected = plain().frames(capture, first, first + 2), got = full.frames(capture, first, first + 2);
    for (std::size_t f = 0; f < 2; ++f) {
      EXPECT_EQ(got[f].targets.color.values, expected[f].targets.color.values) << name;
      EXPECT_EQ(got[f].counters.shading.pixel_shader_invocations, expected[f].counters.shading.pixel_shader_invocations)
          << name;
      EXPECT_EQ(got[f].counters.resolve.pixels_shaded, 160u * 90u);
      EXPECT_EQ(counters(got[f]).blocks_rate_4 + counters(got[f]).blocks_rate_8, 0u);
    }
  }
}

TEST(Desampling, ShadedPixelsEqualThePlainImage) {  // RU3
  Machine m;
  m.request.resolve_auxiliary = true;
  for (const char* mode : {"adaptive", "fixed_8", "fixed_4", "checkerboard"}) {
    const Capture capture = shipped("serpent");
    const auto expected = plain().frames(capture, 12, 15),
               got = m.set(std::string("resolve.desampling=") + mode).frames(capture, 12, 15);
    for (std::size_t f = 0; f < 3; ++f) {
      std::size_t shaded = 0, other = 0;
      for (std::size_t p = 0; p < 160 * 90; ++p) {
        if (got[f].targets.origin.values[p] != 0) {
          ++other;
          continue;
        }
        ++shaded;
        for (std::size_t c = 4 * p; c < 4 * p + 4; ++c)
          ASSERT_EQ(got[f].targets.color.values[c], expected[f].targets.color.values[c]) << mode << " pixel " << p;
      }
      EXPECT_EQ(got[f].counters.resolve.pixels_shaded, shaded) << mode;
      EXPECT_EQ(counters(got[f]).pixels_advected + counters(got[f]).pixels_reconstructed, other) << mode;
      if (f > 0) {
        EXPECT_GT(other, 1000u);
      }
    }
  }
}

// DS2 of the shader, skipped samples included.
TEST(Desampling, EverySampleIsShadedSharedOrSkippedAndTheSavingIsAgainstFullShading) {
  for (const char* rate : {"pixel", "sample", "cache"}) {
    const Capture capture = shipped("eggs");
    Machine m;
    m.set(std::string("shading.rate=") + rate).thresholds("0.5", "0.5", "3");
    const auto expected = plain().set(std::string("shading.rate=") + rate).frames(capture, 14, 16),
               got = m.frames(capture, 14, 16);
    const auto& s = got[1].counters.shading;
    EXPECT_GT(counters(got[1]).samples_skipped, 0u) << rate;
    EXPECT_EQ(s.pixel_shader_invocations + s.pixel_shader_invocations_saved + counters(got[1]).samples_skipped,
              s.samples_visible + s.blended_layers)
        << rate;
    EXPECT_EQ(s.samples_visible, expected[1].counters.shading.samples_visible) << rate;
    if (std::string(rate) != "cache") {
      EXPECT_EQ(s.pixel_shader_invocations + counters(got[1]).invocations_saved,
                expected[1].counters.shading.pixel_shader_invocations)
          << rate;
    }
  }
}

TEST(Desampling, ImagesOfTheUnitChangeNeitherTheFrameNorACounter) {
  const Capture capture = shipped("stroll");
  Machine m, images;
  images.request.resolve_auxiliary = images.request.error = true;
  const auto expected = m.frames(capture, 20, 23), got = images.frames(capture, 20, 23);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(got[f].targets.color.values, expected[f].targets.color.values);
    EXPECT_EQ(counters_json(got[f].counters), counters_json(expected[f].counters));
  }
  // Errors are where pixels were not shaded, and nowhere else.
  double most = 0;
  for (std::size_t p = 0; p < 160 * 90; ++p) {
    if (got[2].targets.origin.values[p] == 0) {
      ASSERT_EQ(got[2].targets.error.values[p], 0.0f);
    }
    most = std::max(most, static_cast<double>(got[2].targets.error.values[p]));
  }
  EXPECT_GT(most, 0);
}

// ---- Determinism ------------------------------------------------------------------------------------------------

std::vector<gpu::FrameResult> on_machine(Machine m, const Capture& capture, std::size_t threads,
                                         const std::string& simd) {
  const ThreadLimit limit(threads);
  force_simd_target(simd);
  auto out = m.frames(capture, 20, 24);
  force_simd_target("");
  return out;
}

TEST(Desampling, ThreadsAndInstructionSetsChangeNothing) {
  const Capture capture = shipped("stroll");
  for (const char* reach : {"tile", "neighbours"}) {
    Machine m;
    m.set(std::string("resolve.stencil_reach=") + reach).thresholds("0.5", "0.6", "8").set("resolve.bfecc=true");
    const auto expected = on_machine(m, capture, 0, "");
    for (const auto& [threads, simd] :
         {std::pair<std::size_t, std::string>{1, ""}, {2, simd_target_names().back()}, {4, ""}}) {
      const auto got = on_machine(m, capture, threads, simd);
      for (std::size_t f = 0; f < got.size(); ++f) {
        EXPECT_EQ(got[f].targets.color.values, expected[f].targets.color.values) << reach << " " << threads;
        EXPECT_EQ(counters_json(got[f].counters), counters_json(expected[f].counters)) << reach << " " << threads;
      }
    }
  }
}

std::uint64_t read_across_tiles(const gpu::FrameResult& r) {
  return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kNeighbours).read_bytes;
}

// RU1, RU2. Stencils that stop at the tile's border know it: they are the failing twin.
TEST(Desampling, WithStencilsThatReachNeighboursTilesDoNotShow) {
  const Capture capture = shipped("stroll");
  const auto images = [&](const char* reach, int tile, const char* pattern_error = "0") {
    Machine m;
    m.set(std::string("resolve.stencil_reach=") + reach)
        .thresholds("0.1", "0.1", "8")
        .set(std::string("resolve.pattern_error=") + pattern_error);
    m.gpu.tile.width = m.gpu.tile.height = tile;
    auto frames = m.frames(capture, 40, 43);
    EXPECT_GT(counters(frames[2]).pixels_reconstructed, std::string(pattern_error) == "0" ? 1000u : 500u);
    EXPECT_EQ(read_across_tiles(frames[2]) > 0, std::string(reach) == "neighbours");
    return frames;
  };
  const auto small = images("neighbours", 8), large = images("neighbours", 64);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(small[f].targets.color.values, large[f].targets.color.values);
    EXPECT_EQ(counters(small[f]).blocks_rate_8, counters(large[f]).blocks_rate_8);
    EXPECT_EQ(counters(small[f]).pixels_advected, counters(large[f]).pixels_advected);
  }
  // Nor do they show in decisions by contrast.
  EXPECT_EQ(images("neighbours", 8, "0.008")[2].targets.color.values,
            images("neighbours", 64, "0.008")[2].targets.color.values);
  const auto local_small = images("tile", 8), local_large = images("tile", 64);
  EXPECT_NE(local_small[2].targets.color.values, local_large[2].targets.color.values);
  // Decisions do not know the tile either way.
  EXPECT_EQ(counters(local_small[1]).blocks_rate_8, counters(local_large[1]).blocks_rate_8);
  EXPECT_LT(counters(local_small[1]).pixels_reconstructed,
            counters(large[1]).pixels_reconstructed);  // lines on borders
  EXPECT_GT(read_across_tiles(small[2]), read_across_tiles(large[2]));
}

// Images are the same for any size of tiles, for either reach, with back and forth error compensation and without.
// Where stencils stop at the tile's border, fast blocks would show it: there all blocks are slow, or fully shaded.
TEST(Desampling, TilesDoNotShowInReprojectedImages) {  // RU1, RU2
  const Capture capture = shipped("stroll");
  for (const char* reach : {"tile", "neighbours"})
    for (const char* bfecc : {"false", "true"}) {
      const bool tile_local = std::string(reach) == "tile";
      const auto images = [&](int tile) {
        Machine m;
        m.set(std::string("resolve.stencil_reach=") + reach).set(std::string("resolve.bfecc=") + bfecc);
        if (tile_local) m.thresholds("2", "1000000", "1000000");
        m.gpu.tile.width = m.gpu.tile.height = tile;
        return m.frames(capture, 10, 13);
      };
      const auto expected = images(64);
      EXPECT_GT(counters(expected[2]).pixels_advected, 1000u);
      if (tile_local) {
        EXPECT_EQ(counters(expected[2]).pixels_reconstructed, 0u);
      }
      for (const int tile : {8, 16, 32}) {
        const auto got = images(tile);
        for (std::size_t f = 0; f < 3; ++f)
          EXPECT_EQ(got[f].targets.color.values, expected[f].targets.color.values)
              << reach << " " << bfecc << " " << tile;
      }
    }
}

TEST(Desampling, PartialRendersAndRevivedTilesChangeNothing) {
  const Capture capture = shipped("serpent");
  const auto expected = Machine().frames(capture, 12, 15);
  Machine tiny, culling;
  tiny.gpu.parameter_buffer.bytes = 3072;
  culling.gpu.frontend.previous_depth_culling = true;
  const auto small = tiny.frames(capture, 12, 15), second_pass = culling.frames(capture, 12, 15);
  EXPECT_GT(small[1].counters.binner.partial_renders, 0u);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(small[f].targets.color.values, expected[f].targets.color.values);
    EXPECT_EQ(second_pass[f].targets.color.values, expected[f].targets.color.values);
  }
}

// ---- Advection --------------------------------------------------------------------------------------------------

TEST(Desampling, AStaticSceneIsExactAndAQuarterOfItIsShaded) {
  const Capture capture = shipped("vases");
  const gpu::FrameResult expected = plain().renderer(capture).render(0);
  const auto got = Machine().frames(capture, 0, 6);
  for (std::size_t f = 0; f < got.size(); ++f) {
    EXPECT_EQ(got[f].targets.color.values, expected.targets.color.values) << f;
    if (f == 0) continue;
    EXPECT_EQ(counters(got[f]).velocity_operations, 0u);
    EXPECT_NEAR(static_cast<double>(got[f].counters.shading.pixel_shader_invocations) /
                    static_cast<double>(expected.counters.shading.pixel_shader_invocations),
                0.25, 0.01);
    EXPECT_EQ(got[f].effect_reasons.at("velocity"), "nothing moved since the last frame: zero without evaluation");
  }
}

// A blurred history that a static scene starts from is gone after k = 4 frames of the counter's dither, and stays
// without dither.
TEST(Desampling, AStaticSceneRecoversFromAnyHistoryWithinTheCountersPeriod) {
  const Capture capture = shipped("vases");
  const Image expected = plain().renderer(capture).render(0).targets.color;
  for (const char* dither : {"counter", "off"}) {
    gpu::Device r = Machine().set(std::string("resolve.dither=") + dither).renderer(capture);
    r.render(0);
    History spoilt = r.history();
    for (Vec4& c : spoilt.color) c *= 1.01f;
    r.set_history(spoilt);
    EXPECT_GT(rmse(r.render(1).targets.color, expected), 0) << dither;
    r.render(2), r.render(3);
    const double later = rmse(r.render(4).targets.color, expected);
    EXPECT_EQ(later == 0, std::string(dither) == "counter");
  }
}

TEST(Desampling, TheFirstFrameAFrameAfterAGapAndAChangedLightHaveNoHistory) {
  const Capture capture = shipped("stroll");
  gpu::Device r = Machine().renderer(capture);
  const gpu::FrameResult first = r.render(10);
  EXPECT_EQ(counters(first).pixels_advected, 0u);
  EXPECT_EQ(first.effect_reasons.at("advection"), "first frame: there is no history");
  EXPECT_FALSE(first.effects.at("advection"));
  EXPECT_GT(counters(r.render(11)).pixels_advected, 0u);
  const gpu::FrameResult gap = r.render(13);
  EXPECT_EQ(counters(gap).pixels_advected, 0u);
  EXPECT_EQ(gap.effect_reasons.at("advection"), "the frame before was not rendered: there is no history");
  const auto eggs = Machine().thresholds("4", "4", "16").frames(shipped("eggs"), 14, 16);  // an ember carries a light
  EXPECT_EQ(eggs[1].effect_reasons.at("advection"),
            "blocks slower than resolve.reuse_speed, out of reach of the lights that changed");
  EXPECT_GT(counters(eggs[1]).light_tests, 0u);
}

// The camera jumps across the scene between two frames: hardly a pixel is where it was, and the image is the new one.
TEST(Desampling, ACutTakesNothingOverThatIsNotThere) {
  Capture capture = shipped("stroll");
  for (auto& animation : capture.animations)
    for (auto& channel : animation.channels) {
      channel.interpolation = scene::Interpolation::kStep;
      channel.times = {0.0f, 1.0f};
      const auto n = static_cast<std::size_t>(channel.components);
      std::vector<float> ends(channel.values.begin(), channel.values.begin() + static_cast<std::ptrdiff_t>(n));
      ends.insert(ends.end(), channel.values.end() - static_cast<std::ptrdiff_t>(n), channel.values.end());
      channel.values = ends;
    }
  Machine m;
  m.thresholds("4", "4", "16");
  m.request.resolve_auxiliary = true;
  const auto expected = plain().frames(capture, 28, 33), got = m.frames(capture, 28, 33);
  EXPECT_GT(rmse(expected[1].targets.color, expected[2].targets.color), 0.05);
  EXPECT_LT(counters(got[2]).pixels_advected, 160u * 90u / 50u);
  EXPECT_LT(rmse(got[2].targets.color, expected[2].targets.color), 0.05);
  EXPECT_LT(rmse(got[4].targets.color, expected[4].targets.color), 0.01);
}

// An unlit quad with a texture that slides across the frame, in and out of it.
struct Slide {
  Capture capture;
  explicit Slide(double pixels_per_frame, int texture = 64, bool plane = false, double alpha = 1) {
    scene::Material material;
    if (alpha < 1) material.alpha_mode = scene::AlphaMode::kBlend, material.base_color.w = static_cast<float>(alpha);
    material.unlit = true;
    material.double_sided = true;
    material.base_color_texture.texture =
        std::make_shared<shaders::Texture>(DecodedImage{checks(texture)}, shaders::ColorSpace::kSrgb);
    const int m = test::add_material(capture, material);
    scene::Primitive quad = test::triangles({{-8, -8, 0}, {8, -8, 0}, {8, 8, 0}, {-8, 8, 0}}, {0, 1, 2, 0, 2, 3}, m);
    const float repeat = plane ? 1.0f : 2.0f;
    quad.vertices.texcoords = {{{0, 0}, {repeat, 0}, {repeat, repeat}, {0, repeat}}};
    const int node = test::add_node(capture, quad, {plane ? 0.0 : -9.0, 0.0, 0.0});
    scene::Camera camera;
    camera.type = scene::Camera::Type::kOrthographic;
    camera.x_mag = 8, camera.y_mag = 4.5f;
    test::add_camera(capture, {0, 0, 10}, camera);
    // 160 pixels are 16 units; a thirtieth of a second per frame, for the four seconds of the test.
    test::add_motion(capture, node, {pixels_per_frame * 0.1 * 30.0, pixels_per_frame * 0.037 * 30.0, 0});
    auto& channel = capture.animations[0].channels[0];
    channel.times = {0.0f, 5.0f};
    for (std::size_t c = 3; c < 6; ++c)
      channel.values[c] = channel.values[c - 3] + 5.0f * (channel.values[c] - channel.values[c - 3]);
    capture.settings.background = Vec3(0.1f, 0.2f, 0.3f);
  }
  static Image8 checks(int side) {
    Image8 image(side, side, 3);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const bool on = (x / 8 + y / 8) % 2 == 0;
        const auto level = static_cast<std::uint8_t>(on ? 200 - (x % 8) * 8 : 60 + (y % 8) * 8);
        image.at(x, y)[0] = level, image.at(x, y)[1] = static_cast<std::uint8_t>(255 - level), image.at(x, y)[2] = 90;
      }
    return image;
  }
};

TEST(Desampling, ObjectsEnterAndLeaveTheFrameWithoutTrails) {
  const Slide slide(3.3);
  Machine m;
  m.thresholds("8", "8", "8");
  const auto expected = plain().frames(slide.capture, 0, 60), got = m.frames(slide.capture, 0, 60);
  std::uint64_t disoccluded = 0;
  for (std::size_t f = 0; f < got.size(); ++f) {
    disoccluded += counters(got[f]).advections_disoccluded;
    EXPECT_LT(rmse(got[f].targets.color, expected[f].targets.color), 0.02) << f;
    // Background that it left is background again.
    for (std::size_t p = 0; p < 160 * 90; ++p)
      if (expected[f].targets.color.values[4 * p + 3] == 0.0f) {
        ASSERT_EQ(got[f].targets.color.values[4 * p], expected[f].targets.color.values[4 * p]) << f;
      }
  }
  EXPECT_GT(disoccluded, 0u);
}

// RU4, RU5. A quarter of the pixels is rendered whatever they see; an outline is narrower than the distance between them.
TEST(Desampling, PixelsThatSeeNothingOrHaveNoRenderedPixelOfTheirSurfaceBesideThemAreShaded) {
  const Slide slide(3.3);
  Machine m;
  m.set("resolve.desampling=fixed_4");
  m.request.resolve_auxiliary = true;
  const auto expected = plain().frames(slide.capture, 8, 14), got = m.frames(slide.capture, 8, 14);
  // A quarter, and lines that go on to the border of a tile.
  const auto pattern = [](int f, int x, int y) {
    const IntRect frame{0, 0, 160, 90}, tile{x & ~31, y & ~31, (x & ~31) + 32, (y & ~31) + 32},
        block{x & ~3, y & ~3, (x & ~3) + 4, (y & ~3) + 4}, inside = block.intersect(frame);
    const tilecore::BlockMask quarter = tilecore::dither_mask(4, static_cast<std::uint32_t>(8 + f), {});
    return quarter | tilecore::border_line(quarter, tilecore::tile_borders(tile.intersect(frame), inside), 0, 0, 4,
                                           inside.height());
  };
  std::uint64_t empty = 0, seen = 0, quarter = 0;
  for (std::size_t f = 0; f < got.size(); ++f) {
    const auto alpha = [&](int x, int y) { return expected[f].targets.color.at(x, y)[3]; };
    const auto shaded = [&](int x, int y) { return got[f].targets.origin.at(x, y)[0] == 0.0f; };
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 160; ++x) {
        if (alpha(x, y) == 0.0f) {
          ++empty;
          ASSERT_TRUE(shaded(x, y)) << x << " " << y;
        } else {
          seen += shaded(x, y);
          quarter += (pattern(static_cast<int>(f), x, y) >> (4 * (y & 3) + (x & 3)) & 1) != 0;
        }
        if (shaded(x, y)) continue;
        bool source = false;  // a rendered pixel of the same surface in the block
        for (int j = y & ~3; j < std::min(90, (y & ~3) + 4); ++j)
          for (int i = x & ~3; i < (x & ~3) + 4; ++i) source = source || (shaded(i, j) && alpha(i, j) == alpha(x, y));
        ASSERT_TRUE(source) << x << " " << y;
      }
  }
  EXPECT_GT(empty, 10000u);
  EXPECT_GT(seen, quarter);  // some are shaded that the pattern leaves out
}

// ---- Long runs --------------------------------------------------------------------------------------------------

double error_at(const Slide& slide, const Machine& machine, const std::vector<int>& wanted,
                std::vector<double>& errors) {
  gpu::Device full = plain().renderer(slide.capture), r = machine.renderer(slide.capture);
  for (int f = 0; f <= wanted.back(); ++f) {
    const gpu::FrameResult got = r.render(f);
    if (std::find(wanted.begin(), wanted.end(), f) != wanted.end())
      errors.push_back(rmse(got.targets.color, full.render(f).targets.color));
  }
  return errors.back();
}

TEST(Desampling, ErrorsOfAdvectionDoNotGrowOver120Frames) {
  // Slow: an advected pixel's source is mostly that pixel itself.
  const Slide slide(0.03, 64, true);
  Machine kept, loose;
  for (Machine* m : {&kept, &loose}) m->thresholds("1", "2", "8");
  loose.set("resolve.dither=off").set("resolve.discrepancy=off");
  std::vector<double> with, without;
  error_at(slide, kept, {8, 9, 10, 11, 117, 118, 119, 120}, with);
  error_at(slide, loose, {8, 9, 10, 11, 117, 118, 119, 120}, without);
  const auto mean = [](const std::vector<double>& v, std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += v[i];
    return sum / static_cast<double>(to - from);
  };
  RecordProperty("error_10", std::to_string(mean(with, 0, 4)));
  RecordProperty("error_120", std::to_string(mean(with, 4, 8)));
  EXPECT_GT(mean(with, 0, 4), 0);
  EXPECT_LE(mean(with, 4, 8), 1.1 * mean(with, 0, 4));
  // The failing twin: nothing renews the pixels that are always advected, nothing notices.
  EXPECT_GT(mean(without, 4, 8), 1.3 * mean(without, 0, 4));
  EXPECT_GT(mean(without, 4, 8), 2 * mean(with, 4, 8));
}

// ---- Shapes and colours -----------------------------------------------------------------------------------------

TEST(Desampling, FramesAndRegionsThatCutBlocksAreWhole) {
  const Capture capture = shipped("stroll");
  for (const IntRect region :
       {IntRect{0, 0, 97, 53}, IntRect{5, 3, 94, 51}, IntRect{1, 1, 3, 2}, IntRect{40, 20, 41, 21}})
    for (const char* mode : {"adaptive", "fixed_8", "fixed_4", "checkerboard"})
      for (const char* reach : {"tile", "neighbours"}) {
        Machine m, p = plain();
        m.set(std::string("resolve.desampling=") + mode)
            .set(std::string("resolve.stencil_reach=") + reach)
            .thresholds("0.5", "0.5", "8");
        m.request = p.request = {97, 53, region};
        const auto got = m.frames(capture, 38, 40), expected = p.frames(capture, 38, 40);
        for (std::size_t f = 0; f < 2; ++f) {
          for (const float v : got[f].targets.color.values) ASSERT_TRUE(std::isfinite(v));
          EXPECT_LT(rmse(got[f].targets.color, expected[f].targets.color), 0.1) << mode << " " << region.x0;
          EXPECT_EQ(got[f].counters.resolve.pixels_shaded + counters(got[f]).pixels_advected +
                        counters(got[f]).pixels_reconstructed,
                    static_cast<std::uint64_t>(region.width()) * static_cast<std::uint64_t>(region.height()));
        }
      }
}

TEST(Desampling, ColoursThatAreNotFiniteStayWhereTheShaderMadeThem) {
  const Capture capture = shipped("vases");
  gpu::Device r = Machine().renderer(capture);
  r.render(0);
  History spoilt = r.history();
  for (std::size_t i = 0; i < spoilt.color.size(); i += 3)
    spoilt.color[i] =
        Vec4(i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity());
  r.set_history(spoilt);
  const gpu::FrameResult got = r.render(1);
  EXPECT_EQ(got.targets.color.values, plain().renderer(capture).render(1).targets.color.values);
  EXPECT_GT(counters(got).advections_disoccluded, 0u);
}

// Negative lobes of stencils would fall below it (CubicStencil.BesideAFireflyLightTurnsNegative).
TEST(Desampling, BesideHighlightsNothingIsDarkerThanBlack) {
  Slide slide(0, 64, true);
  Image8 dots(64, 64, 3);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (std::size_t c = 0; c < 3; ++c) dots.at(x, y)[c] = x % 7 == 3 && y % 5 == 2 ? 255 : 20;
  slide.capture.materials.back().base_color_texture.texture =
      std::make_shared<shaders::Texture>(DecodedImage{dots}, shaders::ColorSpace::kSrgb);
  const Image full = plain().renderer(slide.capture).render(0).targets.color,
              got = Machine().set("resolve.desampling=fixed_8").renderer(slide.capture).render(0).targets.color;
  std::size_t black = 0;
  for (std::size_t i = 0; i < got.values.size(); ++i) {
    ASSERT_GE(got.values[i], 0.0f);
    black += got.values[i] == 0.0f && full.values[i] > 0.0f;
  }
  EXPECT_GT(black, 100u);
}

TEST(Desampling, SupersamplingShadesEdgesTwice) {
  Capture capture = shipped("stroll");
  const auto once = Machine().frames(capture, 30, 32),
             twice = Machine().set("resolve.supersampling=true").frames(capture, 30, 32);
  EXPECT_EQ(counters(once[1]).blocks_rate_32, 0u);
  EXPECT_GT(counters(twice[1]).blocks_rate_32, 0u);
  EXPECT_GT(twice[1].counters.shading.pixel_shader_invocations, once[1].counters.shading.pixel_shader_invocations);
  // The image is closer to one invocation per sample, which it approximates.
  const gpu::FrameResult samples = plain().set("shading.rate=sample").renderer(capture).render(30);
  EXPECT_LT(rmse(twice[0].targets.color, samples.targets.color), rmse(once[0].targets.color, samples.targets.color));
}

TEST(Desampling, FoveationSavesOutsideAndKeepsTheFocus) {
  const Capture capture = shipped("stroll");
  Machine m;
  m.set("resolve.foveation_r0=25").set("resolve.foveation_r1=60").set("resolve.focus_x=0.5").set("resolve.focus_y=0.6");
  m.request.resolve_auxiliary = true;
  const gpu::FrameResult full = plain().renderer(capture).render(30), got = m.renderer(capture).render(30);
  EXPECT_LT(got.counters.shading.pixel_shader_invocations * 3, full.counters.shading.pixel_shader_invocations * 2);
  EXPECT_TRUE(got.effects.at("foveation"));
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 160; ++x) {
      const Vec2 d = Vec2(static_cast<float>((x & ~3) + 2), static_cast<float>((y & ~3) + 2)) - Vec2(80, 54);
      const float distance = glm::length(d), rate = got.targets.rate.at(x, y)[0];
      EXPECT_LE(rate, distance <= 25 ? 16 : distance <= 60 ? 8 : 4);
      for (std::size_t c = 0; c < 3 && distance <= 25; ++c)
        EXPECT_EQ(got.targets.color.at(x, y)[c], full.targets.color.at(x, y)[c]);
    }
}

// Glass before the background has no depth; it is reconstructed from its neighbours all the same.
TEST(Desampling, GlassBeforeNothingIsReconstructed) {
  const Slide glass(0.0, 64, true, 0.5);
  Machine m;
  m.set("resolve.foveation_r0=1").set("resolve.foveation_r1=100");
  const gpu::FrameResult full = plain().renderer(glass.capture).render(0), got = m.renderer(glass.capture).render(0);
  EXPECT_GT(counters(got).pixels_reconstructed, 6000u);
  EXPECT_LT(rmse(got.targets.color, full.targets.color), 0.05);
}

TEST(Desampling, TheRightEyeTakesFarPixelsFromTheLeft) {
  const Capture capture = shipped("vases");
  const auto stereo = [&](const char* desampling, const char* depth) {
    return Machine()
        .set(std::string("resolve.desampling=") + desampling)
        .set("stereo.eye_separation=0.06")
        .set(std::string("stereo.far_depth=") + depth)
        .renderer(capture)
        .render(0);
  };
  const gpu::FrameResult full = stereo("off", "0"), far = stereo("adaptive", "0"), none = stereo("adaptive", "1000000");
  ASSERT_TRUE(full.right);
  // The left eye is the camera's; the right one is another image.
  EXPECT_EQ(full.targets.color.values, plain().renderer(capture).render(0).targets.color.values);
  EXPECT_GT(rmse(full.right->targets.color, full.targets.color), 0.02);
  // Nothing is that far: the first frame of the right eye is rendered fully.
  EXPECT_EQ(none.right->targets.color.values, full.right->targets.color.values);
  // Everything is: a good part of it comes from the left, and looks as it should.
  EXPECT_GT(far.right->counters.desampling.pixels_advected, 2000u);
  EXPECT_LT(far.right->counters.shading.pixel_shader_invocations,
            0.75 * static_cast<double>(full.right->counters.shading.pixel_shader_invocations));
  EXPECT_LT(rmse(far.right->targets.color, full.right->targets.color),
            0.25 * rmse(full.right->targets.color, full.targets.color));
  EXPECT_EQ(far.targets.color.values, full.targets.color.values);
}

// After a change of a light, blocks at rest may be copied neither from the right eye's own history nor from the left
// eye without its parallax.
TEST(Desampling, TheRightEyeSeesALightThatChanged) {
  Capture capture = shipped("vases");
  for (std::size_t n = 0; n < capture.nodes.size(); ++n)
    if (capture.nodes[n].light >= 0) test::add_motion(capture, static_cast<int>(n), {0, 0, 0});
  auto& turn = capture.animations.at(0).channels.at(0);
  turn.path = scene::AnimatedPath::kRotation;
  turn.components = 4;
  turn.interpolation = scene::Interpolation::kStep;
  turn.times = {0.0f, 0.02f};
  turn.values = {-0.35f, -0.32f, -0.13f, 0.87f, -0.35f, 0.32f, 0.13f, 0.87f};
  const auto stereo = [&](const char* desampling) {
    return Machine()
        .set(std::string("resolve.desampling=") + desampling)
        .set("stereo.eye_separation=0.06")
        .set("stereo.far_depth=0")
        .frames(capture, 0, 2);
  };
  const auto full = stereo("off"), got = stereo("adaptive");
  EXPECT_GT(rmse(full[0].right->targets.color, full[1].right->targets.color), 0.02);
  EXPECT_GT(got[0].right->counters.desampling.pixels_advected, 2000u);
  EXPECT_EQ(got[1].right->targets.color.values, full[1].right->targets.color.values);
}

// A far wall of strips, every other one sliding along itself, behind a pane of striped glass that is near and at rest.
Capture strips_behind_glass(bool glass) {
  Capture capture;
  const auto material = [&](double alpha) {
    scene::Material m;
    m.unlit = m.double_sided = true;
    if (alpha < 1) m.alpha_mode = scene::AlphaMode::kBlend, m.base_color.w = static_cast<float>(alpha);
    m.base_color_texture.texture =
        std::make_shared<shaders::Texture>(DecodedImage{Slide::checks(64)}, shaders::ColorSpace::kSrgb);
    return test::add_material(capture, m);
  };
  const auto quad = [](Vec3 low, Vec3 high, int m) {
    scene::Primitive q =
        test::triangles({low, {high.x, low.y, low.z}, high, {low.x, high.y, low.z}}, {0, 1, 2, 0, 2, 3}, m);
    q.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    return q;
  };
  const int opaque = material(1);
  for (int i = 0; i < 12; ++i) {
    const float left = -30.0f + 5.0f * static_cast<float>(i);
    const int node = test::add_node(capture, quad({left, -40, -30}, {left + 5.0f, 40, -30}, opaque));
    if (i % 2 == 1) test::add_motion(capture, node, {0, 3, 0});
  }
  if (glass) test::add_node(capture, quad({-6, -4, 4}, {6, 4, 4}, material(0.6)));
  test::add_camera(capture, {0, 0, 10});
  return capture;
}

// The pane has a parallax of its own; that it rests for the right eye says nothing of where the left one sees it.
TEST(Desampling, BlendedSurfacesAtRestDoNotComeFromTheOtherEyeWithTheBackgroundsMotion) {
  const auto second_frame = [](const Capture& capture, const char* desampling) {
    Machine m;
    m.set(std::string("resolve.desampling=") + desampling).set("stereo.eye_separation=0.4").set("stereo.far_depth=20");
    return std::move(m.frames(capture, 0, 2)[1]);
  };
  const Capture glass = strips_behind_glass(true);
  const gpu::FrameResult full = second_frame(glass, "off"), got = second_frame(glass, "adaptive");
  EXPECT_GT(got.right->counters.desampling.blocks_advected, 20u);  // but for their pixels behind the glass
  EXPECT_EQ(got.right->targets.color.values, full.right->targets.color.values);
  // The twin: without the pane the same blocks do come from the left eye.
  const gpu::FrameResult bare = second_frame(strips_behind_glass(false), "adaptive");
  EXPECT_GT(bare.right->counters.desampling.pixels_advected, got.right->counters.desampling.pixels_advected + 500);
}

TEST(Desampling, CompressionChangesTrafficNotImages) {
  const Capture capture = shipped("vases");
  const gpu::FrameResult raw = plain().set("frame_buffer.compression=none").renderer(capture).render(0),
                         packed = plain().renderer(capture).render(0);
  EXPECT_EQ(raw.targets.color.values, packed.targets.color.values);
  const auto bytes = [](const gpu::FrameResult& r) {
    return r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kFrameBuffer).written_bytes;
  };
  EXPECT_LT(bytes(packed), bytes(raw));
}

// ---- Against baselines ---------------------------------------------------------------------------------------------

TEST(Desampling, ScaledCubicStencilsBeatBilinearOnEveryShippedCaptureAtHalfRate) {
  for (const char* name :
       {"eggs", "vases", "serpent", "flyby", "stroll", "workshop", "city", "garden", "city_evening", "garden_lamps"}) {
    const Capture capture = shipped(name);
    const int frame = capture.settings.first_frame;
    Machine p = plain().set("shadows.size=256");
    p.request = {320, 180, {0, 0, 320, 180}};
    const Image expected = p.renderer(capture).render(frame).targets.color;
    const auto error = [&](const char* reconstruction) {
      Machine m;
      m.request = p.request;
      m.set("shadows.size=256")
          .set("resolve.desampling=fixed_8")
          .set(std::string("resolve.reconstruction=") + reconstruction);
      return rmse(m.renderer(capture).render(frame).targets.color, expected);
    };
    EXPECT_LT(error("cubic"), error("bilinear")) << name;
  }
}

TEST(Desampling, AdaptiveIsFarAboveCheckerboardAtEqualOrFewerRuns) {
  const Capture capture = shipped("serpent");
  const auto expected = plain().frames(capture, 44, 52), adaptive = Machine().frames(capture, 44, 52),
             board = Machine().set("resolve.desampling=checkerboard").frames(capture, 44, 52);
  double a = 0, b = 0;
  for (std::size_t f = 1; f < expected.size(); ++f) {
    a += rmse(adaptive[f].targets.color, expected[f].targets.color);
    b += rmse(board[f].targets.color, expected[f].targets.color);
  }
  EXPECT_LT(a * 1.4125, b);  // 3 dB
}

}  // namespace
}  // namespace tessera::replay::desampling_test
