// Blooms and tone maps of captures (gpu/bloom.cpp, gpu/image_passes.cpp): images by the formulas in double precision,
// bytes and lookups as geometric series, and refusals.
#include <cmath>
#include <limits>

#include "gpu/bloom.h"
#include "gpu/counter_list.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "shaders_cpp/bloom.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/tests.h"

namespace tessera::gpu::bloom_test {
namespace {

using memory::Purpose;
using memory::Traffic;
using memory::Unit;
using scene::Attachment;
using scene::AttachmentFormat;
using scene::DrawFilter;
using scene::Pass;
using scene::PassGraph;
using scene::PassShader;
using test::attachment;
using test::bursts;
using test::drawing;
using test::over_image;
using test::with_graph;
using Keys = std::vector<std::string>;

// ---- The filters -------------------------------------------------------------------------------------------------

// The same formulas in double precision, texel by texel.
struct Reference {
  int width, height;
  std::vector<DVec3> texels;

  explicit Reference(const Image& image) : width(image.width), height(image.height) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto p = image.at(x, y);
        DVec3 light;
        for (std::size_t c = 0; c < 3; ++c)
          light[static_cast<int>(c)] = p[c] > 0 ? std::min(static_cast<double>(p[c]), 65504.0) : 0.0;
        texels.push_back(light);
      }
  }
  DVec3 at(int x, int y) const {
    const int i = std::clamp(x, 0, width - 1), j = std::clamp(y, 0, height - 1);
    return texels[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)];
  }
  // (x, y) in texels, their middles at halves.
  DVec3 lookup(double x, double y) const {
    const double left = std::floor(x - 0.5), top = std::floor(y - 0.5), s = x - 0.5 - left, t = y - 0.5 - top;
    const int i = static_cast<int>(left), j = static_cast<int>(top);
    return (at(i, j) * (1 - s) + at(i + 1, j) * s) * (1 - t) + (at(i, j + 1) * (1 - s) + at(i + 1, j + 1) * s) * t;
  }
  DVec3 down(int w, int h, int x, int y) const {
    const double u = (x + 0.5) * width / w, v = (y + 0.5) * height / h;
    return 0.5 * lookup(u, v) +
           0.125 * (lookup(u - 1, v - 1) + lookup(u + 1, v - 1) + lookup(u - 1, v + 1) + lookup(u + 1, v + 1));
  }
  DVec3 up(int w, int h, int x, int y) const {
    const double u = (x + 0.5) * width / w, v = (y + 0.5) * height / h;
    return (lookup(u - 0.5, v - 0.5) + lookup(u + 0.5, v - 0.5) + lookup(u - 0.5, v + 0.5) + lookup(u + 0.5, v + 0.5)) /
               6.0 +
           (lookup(u - 1, v) + lookup(u + 1, v) + lookup(u, v - 1) + lookup(u, v + 1)) / 12.0;
  }
};

Image noise(int width, int height, std::uint32_t seed) {
  test::Random random(seed);
  Image image(width, height, 3);
  for (float& value : image.values) value = random.uniform(0, 1) < 0.1f ? random.uniform(0, 40) : random.uniform(0, 1);
  return image;
}

double largest_error(const Vec3& found, const DVec3& expected, double scale) {
  const DVec3 error = glm::abs(DVec3(found) - expected);
  return std::max({error.x, error.y, error.z}) / scale;
}

TEST(BloomFilters, AreTheFormulasInDoublePrecision) {  // BLM2
  for (const auto& [width, height] : {std::array{64, 48}, {37, 21}, {2, 9}, {1, 1}}) {
    const Image image = noise(width, height, 5);
    const Reference reference(image);
    for (const auto& [w, h] :
         {std::array{std::max(1, width / 2), std::max(1, height / 2)}, {2 * width, 2 * height + 1}})
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
          EXPECT_LT(largest_error(shaders::bloom_down(image, w, h, x, y), reference.down(w, h, x, y), 40), 2e-5);
          EXPECT_LT(largest_error(shaders::bloom_up(image, w, h, x, y), reference.up(w, h, x, y), 40), 2e-5);
        }
  }
  // The twin: a lookup half a texel off is noticed.
  const Image image = noise(64, 48, 5);
  const Reference reference(image);
  EXPECT_GT(largest_error(shaders::bloom_lookup(image, 0.5f, 0.5f), reference.lookup(32.5, 24), 40), 1e-3);
}

TEST(BloomFilters, KeepAnImageOfOneColor) {  // BLM1
  Image image(19, 11, 3);
  for (std::size_t i = 0; i < image.values.size(); ++i) image.values[i] = 0.25f * static_cast<float>(i % 3 + 1);
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 9; ++x)
      for (const Vec3& light : {shaders::bloom_down(image, 9, 5, x, y), shaders::bloom_up(image, 9, 5, x, y)})
        EXPECT_LT(largest_error(light, {0.25, 0.5, 0.75}, 1), 1e-6);
}

TEST(BloomFilters, NaNIsNoLight) {
  Image image(8, 8, 3);
  const auto bad = image.at(4, 4);
  bad[0] = std::numeric_limits<float>::quiet_NaN(), bad[1] = -7, bad[2] = std::numeric_limits<float>::infinity();
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      const Vec3 light = shaders::bloom_down(image, 4, 4, x, y);
      EXPECT_EQ(light.x, 0);
      EXPECT_EQ(light.y, 0);
      EXPECT_GE(light.z, 0);
      EXPECT_LE(light.z, 65504);
    }
}

TEST(BloomFormats, RoundToTheNearestFloatOfFewBits) {
  using enum AttachmentFormat;
  // 11 bits: 6 of mantissa; 10 bits: 5. Steps of 1/64 and 1/32 between 1 and 2; halves have 1/1024.
  EXPECT_EQ(rounded_to(kR11G11B10F, {1 + 0.49f / 64, 1 + 0.51f / 64, 1 + 0.51f / 32}),
            Vec3(1, 1 + 1.0f / 64, 1 + 1.0f / 32));
  EXPECT_EQ(rounded_to(kRgba16F, {1 + 0.49f / 1024, 3, 1 + 0.51f / 1024}), Vec3(1, 3, 1 + 1.0f / 1024));
  EXPECT_EQ(rounded_to(kR11G11B10F, Vec3(1e9f)), Vec3(65024, 65024, 64512));
  EXPECT_EQ(rounded_to(kRgba16F, Vec3(1e9f)), Vec3(65504));
  EXPECT_EQ(rounded_to(kRgba16F, Vec3(std::ldexp(1.0f, -24), std::ldexp(0.4f, -24), -1)),
            Vec3(std::ldexp(1.0f, -24), 0, 0));
}

// ---- Frames ------------------------------------------------------------------------------------------------------

// Bright cards before a dark wall of patches.
scene::Capture cards() {
  scene::Capture capture;
  scene::Material glow;
  glow.emissive = Vec3(9, 4, 1), glow.metallic = 0;
  const int bright = test::add_material(capture, glow), plain = test::add_material(capture, {});
  test::add_node(capture, test::patches(test::flat_patch({-4, -3, 0}, {8, 0, 0}, {0, 6, 0}), plain));
  for (const double x : {-1.7, 0.2, 1.9})
    test::add_node(capture, test::patches(test::flat_patch({-0.1, -0.4, 0}, {0.2, 0, 0}, {0, 0.8, 0.1}), bright),
                   DVec3(x, 0.3 * x, 0.5));
  capture.settings.environment = 0.2f;
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 3, camera.y_mag = 2;
  test::add_camera(capture, {0, 0, 7}, camera);
  return capture;
}

PassGraph blooming(int levels, AttachmentFormat format = AttachmentFormat::kR11G11B10F) {
  return {{attachment("lit", AttachmentFormat::kRgba16F), attachment("glow", format, 0.5, levels)},
          {drawing("lit"), over_image("bloom", PassShader::kBloom, {"lit"}, "glow"),
           over_image("final", PassShader::kTonemap, {"lit", "glow"}, "frame")}};
}
PassGraph mapping_on_chip() {
  Pass pass = drawing("lit");
  pass.subpasses.push_back({DrawFilter::kNothing, PassShader::kTonemap, {"lit"}, {"frame"}, {}});
  pass.lists_subpasses = true;
  return {{attachment("lit", AttachmentFormat::kRgba16F)}, {pass}};
}

struct Size {
  int width, height;
};

FrameResult frame_of(std::optional<PassGraph> graph, Size size, const Keys& keys = {}, IntRect region = {}) {
  RunSettings settings;
  GpuConfiguration gpu;
  apply_setting("frame_buffer.compression=none", settings, gpu);
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  const scene::Capture capture = with_graph(cards(), std::move(graph));
  if (region.width() == 0) region = {0, 0, size.width, size.height};
  return Device(capture, gpu, settings, {size.width, size.height, region}).render(0);
}

Traffic attachments(const FrameCounters& counters) {
  Traffic sum;
  for (std::size_t unit = 0; unit < memory::kUnitCount; ++unit) {
    const Traffic one = counters.ledger.traffic(static_cast<Unit>(unit), Purpose::kAttachment);
    sum.read_bytes += one.read_bytes, sum.written_bytes += one.written_bytes;
  }
  return sum;
}

// Known answer 6: of sides that are powers of two, levels are a geometric series with the ratio 1/4.
TEST(Bloom, BytesAndLookupsAreAGeometricSeries) {  // BLP1, BLP2
  constexpr Size kSize{256, 128};
  constexpr std::uint64_t kPixels = 256 * 128, kFirst = kPixels / 4;
  for (const auto& [format, bytes] : {std::pair{AttachmentFormat::kR11G11B10F, 4}, {AttachmentFormat::kRgba16F, 8}})
    for (int levels = 1; levels <= 5; ++levels) {
      const auto b = static_cast<std::uint64_t>(bytes);
      const FrameResult frame = frame_of(blooming(levels, format), kSize);
      // Texels of the first n levels.
      const auto series = [&](int n) { return (kFirst * 4 - (kFirst * 4 >> 2 * n)) / 3; };
      const std::uint64_t all = series(levels), above = series(levels - 1), below = all - kFirst;
      const tilecore::ImagePassCounters& c = frame.counters.post;
      EXPECT_EQ(c.texels, all + above + kPixels) << levels;
      EXPECT_EQ(c.lookups, 5 * all + 8 * above + kPixels);
      const Traffic moved = attachments(frame.counters);
      // The colours go out once and are read twice, by the first step and by the tone map. Down, all levels are written and
      // all but the last read; up, all but the last are read and written, and all but the first read.
      EXPECT_EQ(moved.written_bytes, 8 * kPixels + b * (all + above));
      EXPECT_EQ(moved.read_bytes, 2 * 8 * kPixels + b * (above + above + below + kFirst));
      EXPECT_EQ(frame.passes.size(), 2u + 2 * static_cast<std::size_t>(levels) - 1);
      EXPECT_EQ(frame.passes[1].name, "bloom down 0");
      EXPECT_EQ(frame.passes.back().name, "final");
    }
}

TEST(Bloom, HasTheTexelsOfEveryTileOnceAtOddSides) {
  constexpr Size kSize{101, 67};
  const FrameResult frame = frame_of(blooming(4), kSize);
  // 50x33, 25x16, 12x8, 6x4.
  const std::uint64_t sizes[] = {50 * 33, 25 * 16, 12 * 8, 6 * 4};
  std::uint64_t texels = 101 * 67, written = bursts(8 * 101 * 67);
  for (std::size_t level = 0; level < 4; ++level) {
    texels += sizes[level] * (level < 3 ? 2 : 1);
    written += bursts(4 * sizes[level]) * (level < 3 ? 2 : 1);
  }
  EXPECT_EQ(frame.counters.post.texels, texels);
  EXPECT_EQ(attachments(frame.counters).written_bytes, written);
}

// Compressed colours go out once and are read twice, as they are stored: by the first step and by the last pass, which
// also reads the largest level.
TEST(Bloom, ReadsColorsAsTheyAreStored) {  // AST2
  constexpr Size kSize{101, 67};
  const FrameResult raw = frame_of(blooming(3), kSize),
                    packed = frame_of(blooming(3), kSize, {"frame_buffer.compression=lossless"});
  EXPECT_EQ(packed.targets.color.values, raw.targets.color.values);
  const Traffic before = attachments(raw.counters), after = attachments(packed.counters);
  EXPECT_LT(after.written_bytes, before.written_bytes);
  EXPECT_LT(after.read_bytes, before.read_bytes);
  const auto of_pass = [&](std::size_t number) { return attachments(packed.passes[number].counters); };
  const std::size_t last = packed.passes.size() - 1;
  EXPECT_EQ(of_pass(1).read_bytes, of_pass(0).written_bytes);
  EXPECT_EQ(of_pass(last).read_bytes, of_pass(0).written_bytes + of_pass(last - 1).written_bytes);
}

// The image is the formulas in double precision, of the colours that a copy of them shows.
TEST(Bloom, SpreadsLightAsTheFormulasSay) {  // BLM2
  constexpr Size kSize{96, 64};
  PassGraph copies = blooming(3, AttachmentFormat::kRgba16F);
  const FrameResult found = frame_of(copies, kSize), plain = frame_of(copies, kSize, {"post.bloom=0"});
  EXPECT_EQ(plain.counters.post.texels, 0u);
  EXPECT_EQ(plain.passes.size(), 2u);
  Image color(kSize.width, kSize.height, 3);
  for (int y = 0; y < kSize.height; ++y)
    for (int x = 0; x < kSize.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) color.at(x, y)[c] = plain.targets.color.at(x, y)[c];
  std::vector<Reference> levels{Reference(color)};
  for (int level = 0; level < 3; ++level) {
    Reference next = levels.back();
    next.width /= 2, next.height /= 2, next.texels.clear();
    for (int y = 0; y < next.height; ++y)
      for (int x = 0; x < next.width; ++x) next.texels.push_back(levels.back().down(next.width, next.height, x, y));
    levels.push_back(next);
  }
  for (std::size_t level = 2; level >= 1; --level) {
    Reference& to = levels[level];
    const double below = static_cast<double>(3 - level);
    for (int y = 0; y < to.height; ++y)
      for (int x = 0; x < to.width; ++x) {
        DVec3& texel = to.texels[static_cast<std::size_t>(y * to.width + x)];
        texel = (texel + below * levels[level + 1].up(to.width, to.height, x, y)) / (below + 1);
      }
  }
  double worst = 0, spread = 0;
  for (int y = 0; y < kSize.height; ++y)
    for (int x = 0; x < kSize.width; ++x) {
      const DVec3 was = levels[0].at(x, y), bloom = levels[1].lookup((x + 0.5) / 2, (y + 0.5) / 2);
      const auto p = found.targets.color.at(x, y);
      worst = std::max(worst, largest_error({p[0], p[1], p[2]}, was * 0.85 + bloom * 0.15, 10));
      spread = std::max(spread, glm::length(bloom - was));
    }
  EXPECT_LT(worst, 1e-3) << "half floats have 11 bits";
  EXPECT_GT(spread, 1) << "without a bloom the test would see it";
}

// Known: a tone map as the last subpass moves nothing; as a pass of its own it moves the colours out and in.
TEST(ToneMap, OnChipIsFreeAndAPassOfItsOwnIsCharged) {  // GRA4
  constexpr Size kSize{100, 70};
  const FrameResult plain = frame_of({}, kSize), on_chip = frame_of(mapping_on_chip(), kSize);
  EXPECT_EQ(on_chip.targets.color.values, plain.targets.color.values);
  EXPECT_EQ(counter_values(on_chip.counters), counter_values(plain.counters));
  EXPECT_EQ(on_chip.counters.ledger.total().read_bytes, plain.counters.ledger.total().read_bytes);
  EXPECT_EQ(on_chip.counters.ledger.total().written_bytes, plain.counters.ledger.total().written_bytes);
  EXPECT_EQ(on_chip.model->timing.cycles, plain.model->timing.cycles);
  PassGraph apart = blooming(1);
  apart.passes.erase(apart.passes.begin() + 1);
  apart.attachments.pop_back();
  apart.passes.back().subpasses[0].sample = {"lit"};
  const FrameResult own = frame_of(apart, kSize);
  const std::uint64_t bytes = bursts(8 * 100 * 70);
  EXPECT_EQ(attachments(own.counters).written_bytes, bytes);
  EXPECT_EQ(attachments(own.counters).read_bytes, bytes);
  EXPECT_GT(own.model->timing.cycles, plain.model->timing.cycles);
}

// Steps take time one after the other; smaller strength takes no less, none takes none.
TEST(Bloom, TakesTimeInWarpsThatAreCounted) {
  constexpr Size kSize{256, 128};
  const FrameResult with = frame_of(blooming(4), kSize), without = frame_of(blooming(4), kSize, {"post.bloom=0"});
  EXPECT_GT(with.model->timing.cycles, without.model->timing.cycles);
  std::uint64_t lanes = 0, lookups = 0;
  for (const timing::WorkRound& round : with.model->record.work.rounds)
    for (const timing::TileItems& items : round.items)
      for (const timing::WarpItem& warp : items.warps)
        if (warp.kind == timing::WarpItem::kImage) lanes += warp.lanes, lookups += warp.texels;
  EXPECT_EQ(lanes, with.counters.post.texels);
  EXPECT_EQ(lookups, with.counters.post.lookups);
  EXPECT_EQ(frame_of(blooming(4), kSize, {"post.bloom_levels=2"}).passes.size(), 2u + 3);
}

// Tiles, lists and threads are no part of the image.
TEST(Bloom, DoesNotHangOnTilesAndBuffers) {
  constexpr Size kSize{100, 70};
  const FrameResult expected = frame_of(blooming(4), kSize);
  for (const Keys& keys : {Keys{"tile.width=8", "tile.height=8"}, Keys{"parameter_buffer.bytes=2048"},
                           Keys{"frame_buffer.transaction_elimination=true"}, Keys{"machine.overlap=passes"}})
    EXPECT_EQ(frame_of(blooming(4), kSize, keys).targets.color.values, expected.targets.color.values) << keys[0];
}

TEST(Bloom, RegionsAndEliminationAreRefused) {
  constexpr Size kSize{96, 64};
  EXPECT_THROW(frame_of(blooming(2), kSize, {}, {0, 0, 32, 32}), UsageError);
  EXPECT_THROW(frame_of(blooming(2), kSize, {"tile.rendering_elimination=true"}), UsageError);
  EXPECT_NO_THROW(frame_of(blooming(2), kSize, {"post.bloom=0"}, {0, 0, 32, 32}));
  EXPECT_NO_THROW(frame_of(blooming(2), kSize, {"post.bloom=0", "tile.rendering_elimination=true"}));
}

}  // namespace
}  // namespace tessera::gpu::bloom_test
