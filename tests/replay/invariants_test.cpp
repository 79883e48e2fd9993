// The invariants of the whole machine, on shipped captures and on scenes made to break it.
#include "base/simd_targets.h"
#include "gpu/device.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/covering_array.h"
#include "tests/support/image_bytes.h"
#include "tests/support/tests.h"

namespace tessera::replay::invariants_test {
namespace {

using scene::Capture;
using test::image_bytes;

gpu::RenderRequest whole(int width, int height) { return {width, height, {0, 0, width, height}, true}; }

struct Variant {
  std::string name;
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  std::size_t threads = 0;
  std::string simd;
};

using Prepared = std::shared_ptr<const gpu::PreparedCapture>;

gpu::FrameResult render(const Prepared& capture, const Variant& variant, int frame, gpu::RenderRequest request) {
  const ThreadLimit threads(variant.threads);
  force_simd_target(variant.simd);
  gpu::Device renderer(capture, variant.gpu, variant.settings, request);
  gpu::FrameResult result = renderer.render(frame);
  force_simd_target("");
  return result;
}

gpu::FrameResult render(const Capture& capture, const Variant& variant, int frame = 0,
                        gpu::RenderRequest request = whole(160, 90)) {
  return render(std::make_shared<const gpu::PreparedCapture>(capture), variant, frame, request);
}

// The plainest binning, with rectangles, no times and one queue per tile: every other way of binning is compared with
// it.
Variant plainest_binning(Variant v) {
  v.gpu.binner.coverage = binner::CoverageMethod::kRectangle;
  v.gpu.binner.time_intervals = false;
  v.gpu.binner.time_segments = 1;
  v.gpu.binner.queue_levels = 1;
  v.gpu.tilecore.occlusion_culling = false;  // hits must be the same
  return v;
}

// Each way alone and all together, on two sizes of tiles and with a buffer that runs full.
std::vector<Variant> binning_variants() {
  struct Way {
    const char* name;
    binner::CoverageMethod coverage;
    bool intervals;
    int segments, levels, tile;
    std::int64_t buffer;
    binner::FullPolicy policy;
  };
  using enum binner::CoverageMethod;
  using enum binner::FullPolicy;
  constexpr std::int64_t kRoom = 10 << 20;
  std::vector<Variant> variants;
  for (const Way& w : {Way{"exact", kExact, false, 1, 1, 32, kRoom, kSpill},
                       Way{"exact, 8x8 tiles", kExact, false, 1, 1, 8, kRoom, kSpill},
                       Way{"intervals, 8x8 tiles", kRectangle, true, 1, 1, 8, kRoom, kSpill},
                       Way{"3 segments, 8x8 tiles", kRectangle, false, 3, 1, 8, kRoom, kSpill},
                       Way{"chosen segments", kRectangle, false, 0, 1, 8, kRoom, kSpill},
                       Way{"2 levels", kRectangle, false, 1, 2, 16, kRoom, kSpill},
                       Way{"everything", kExact, true, 16, 5, 8, kRoom, kSpill},
                       Way{"everything, partial renders", kExact, true, 16, 5, 16, 6144, kPartialRender},
                       Way{"everything, spilling", kExact, true, 0, 3, 16, 6144, kSpill}}) {
    Variant v{w.name, {}, {}, 0, ""};
    v.gpu.binner.coverage = w.coverage;
    v.gpu.binner.time_intervals = w.intervals;
    v.gpu.binner.time_segments = w.segments;
    v.gpu.binner.queue_levels = w.levels;
    v.gpu.tilecore.occlusion_culling = false;
    v.gpu.tile.width = v.gpu.tile.height = w.tile;
    v.gpu.parameter_buffer.bytes = w.buffer;
    v.gpu.parameter_buffer.full_policy = w.policy;
    variants.push_back(v);
  }
  return variants;
}

// Bins pairs of a sub-patch and a tile of its bounding rectangle, with the variant's tiles.
Variant rectangles_of(const Variant& variant) {
  Variant plain = plainest_binning({});
  plain.gpu.tile.width = variant.gpu.tile.width;
  plain.gpu.tile.height = variant.gpu.tile.height;
  return plain;
}

// Maps of shadows are small, as the frames are.
Capture shipped(const char* name) {
  Capture capture = scene::read_capture(test::shipped_capture(name));
  for (scene::ShadowRequest& shadow : capture.settings.shadows) shadow.size = 128;
  return capture;
}

class ShippedCapture : public testing::TestWithParam<const char*> {
 protected:
  Capture capture = shipped(GetParam());
  int frame = capture.settings.first_frame;
  // Procedures, many small objects and many patches take long; their frames are small.
  bool small =
      std::set<std::string_view>{"workshop", "stroll", "city", "garden", "city_evening", "garden_lamps", "corridor"}
          .contains(GetParam());
  gpu::RenderRequest size = small ? whole(80, 45) : whole(160, 90);
  Prepared prepared = std::make_shared<const gpu::PreparedCapture>(capture);
  gpu::FrameResult shown(const Variant& variant) const { return render(prepared, variant, frame, size); }
};

// Invariant 1: the image is a matter of geometry and samples alone.
TEST_P(ShippedCapture, TilesQueuesAndBuffersNeverChangeTheImage) {  // M1
  const gpu::FrameResult expected = shown({});
  std::vector<Variant> variants;
  for (const int side : {8, 16, 64, 256}) {
    Variant v{"tiles of " + std::to_string(side), {}, {}, 0, ""};
    v.gpu.tile.width = side;
    v.gpu.tile.height = side == 64 ? 24 : side;
    variants.push_back(v);
  }
  for (const int cells : {4, 9, 64}) {
    Variant v{"sub-patches of " + std::to_string(cells), {}, {}, 0, ""};
    v.gpu.tessellator.sub_patch_cells = cells;
    variants.push_back(v);
  }
  for (const binner::FullPolicy policy : {binner::FullPolicy::kPartialRender, binner::FullPolicy::kSpill}) {
    Variant v{"a tiny buffer, " + std::string(word(policy)), {}, {}, 0, ""};
    v.gpu.parameter_buffer.bytes = 4096;
    v.gpu.parameter_buffer.full_policy = policy;
    variants.push_back(v);
  }
  for (const tilecore::TileSequence sequence : {tilecore::TileSequence::kRows, tilecore::TileSequence::kHilbert}) {
    Variant v{"tiles in another order", {}, {}, 0, ""};
    v.gpu.tilecore.tile_order = sequence;
    variants.push_back(v);
  }
  for (const Variant& v : variants) EXPECT_EQ(image_bytes(shown(v).targets), image_bytes(expected.targets)) << v.name;
}

// Also invariant 1: coverage, time intervals, segments and levels of queues leave out only geometry that no sample
// can see.
TEST_P(ShippedCapture, CoverageTimesAndQueueLevelsNeverChangeTheImage) {  // M1
  const gpu::FrameResult expected = shown(plainest_binning({}));
  std::map<int, std::uint64_t> overlaps;  // by the side of a tile
  for (const Variant& v : binning_variants()) {
    const gpu::FrameResult result = shown(v);
    EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets)) << v.name;
    // A search limited by the samples' depth hits more where a partial render comes before nearer geometry.
    if (result.counters.binner.partial_renders == 0) {
      EXPECT_EQ(result.counters.tilecore.sample_hits, expected.counters.tilecore.sample_hits) << v.name;
    }
    const binner::BinnerCounters& b = result.counters.binner;
    const int side = static_cast<int>(v.gpu.tile.width);
    if (!overlaps.contains(side)) overlaps[side] = shown(rectangles_of(v)).counters.binner.tile_overlaps;
    EXPECT_EQ(b.tile_overlaps + b.tiles_dropped, overlaps[side]) << v.name;
  }
}

// Every bounding method, split criterion, depth and budget, and each way of culling.
std::vector<Variant> front_end_variants() {
  std::vector<Variant> variants;
  const auto add = [&](std::string name) -> gpu::GpuConfiguration& {
    return variants.emplace_back(Variant{std::move(name), {}, {}, 0, ""}).gpu;
  };
  for (const std::string_view method : kEnumWords<frontend::BoundMethod>)
    add("bounded by " + std::string(method)).frontend.bound_method = *from_word<frontend::BoundMethod>(method);
  for (const std::string_view criterion : kEnumWords<frontend::SplitCriterion>) {
    gpu::GpuConfiguration& gpu = add("split by " + std::string(criterion));
    gpu.frontend.split_criterion = *from_word<frontend::SplitCriterion>(criterion);
    gpu.frontend.split_pixels = 4;
  }
  add("no split").frontend.split_depth = 0;
  add("a budget of three").frontend.split_budget = 3;
  add("back faces kept").frontend.backface_culling = false;
  add("hidden entries kept").tilecore.occlusion_culling = false;
  return variants;
}

// Also invariant 1, and zero false culls: dropped geometry could not have been seen.
TEST_P(ShippedCapture, BoundingSplittingAndCullingNeverChangeTheImage) {  // M1
  Variant plain;
  plain.gpu.frontend.bound_method = frontend::BoundMethod::kObb;
  plain.gpu.frontend.split_depth = 0;
  plain.gpu.frontend.backface_culling = plain.gpu.tilecore.occlusion_culling = false;
  const gpu::FrameResult expected = shown(plain);
  for (const Variant& v : front_end_variants())
    EXPECT_EQ(image_bytes(shown(v).targets), image_bytes(expected.targets)) << v.name;
}

// Every visibility method, and every way of tracing rays.
std::vector<Variant> visibility_variants() {
  std::vector<Variant> variants;
  for (const char* method : {"brute", "segments", "partition", "clusters", "cluster-partition", "interleaved"}) {
    variants.push_back({method, {}, {}, 0, ""});
    variants.back().gpu.tilecore.visibility.method = *from_word<tilecore::VisibilityMethod>(method);
    variants.back().settings.sampling.times = 256;  // all that four samples per pixel have
  }
  for (const char* node : {"root", "both_children", "leaf_mask"}) {
    variants.push_back({std::string("rays from ") + node, {}, {}, 0, ""});
    variants.back().gpu.tilecore.visibility.traversal = tilecore::Traversal::kRay;
    variants.back().gpu.tilecore.visibility.branch_node = *from_word<tilecore::BranchNode>(node);
  }
  return variants;
}

// Invariant 2: every visibility method sees the same thing, as the scene is and with motion and lens forced on all of
// it.
TEST_P(ShippedCapture, EveryVisibilityMethodGivesTheSameImage) {  // M2
  const gpu::RenderRequest request = whole(96, 54);
  const gpu::FrameResult expected = render(prepared, {}, frame, request);
  for (Variant v : visibility_variants())
    for (const gpu::EffectMode forced : {gpu::EffectMode::kAuto, gpu::EffectMode::kOn}) {
      v.settings.effects.motion = forced;
      v.settings.effects.defocus = forced;
      const gpu::FrameResult result = render(prepared, v, frame, request);
      EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets)) << v.name << " " << word(forced);
      v.threads = 1;
      EXPECT_EQ(counters_json(render(prepared, v, frame, request).counters), counters_json(result.counters))
          << v.name << " " << word(forced);
      v.threads = 0;
    }
}

// A method, a size of tiles, a number of threads and a width of vectors: a row of choices.
struct Combinations {
  std::vector<Variant> methods = visibility_variants();
  std::vector<int> sides = {16, 32, 64};
  std::vector<std::size_t> threads = {1, 2};
  std::vector<std::string> targets = simd_target_names();

  Combinations() { methods.push_back({"default", {}, {}, 0, ""}); }
  std::vector<std::size_t> levels() const { return {methods.size(), sides.size(), threads.size(), targets.size()}; }
  Variant operator()(const test::Choices& row) const {
    Variant v = methods[row[0]];
    v.gpu.tile.width = v.gpu.tile.height = sides[row[1]];
    v.threads = threads[row[2]];
    v.simd = targets[row[3]];
    v.name += ", tiles of " + std::to_string(sides[row[1]]) + ", " + std::to_string(v.threads) + " threads, " + v.simd;
    return v;
  }
};

// All rows give the image of the machine as it is, and the rows of one method and size of tiles give the same
// counters.
void expect_the_same_bits(const Prepared& capture, int frame, const std::vector<test::Choices>& rows) {
  const gpu::RenderRequest request = whole(80, 45);
  const gpu::FrameResult expected = render(capture, {}, frame, request);
  const Combinations all;
  std::map<std::pair<std::size_t, std::size_t>, nlohmann::json> counters;
  for (const test::Choices& row : rows) {
    const Variant v = all(row);
    const gpu::FrameResult result = render(capture, v, frame, request);
    EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets)) << v.name;
    const nlohmann::json counted = counters_json(result.counters);
    const auto [at, first] = counters.emplace(std::pair(row[0], row[1]), counted);
    if (!first) {
      EXPECT_EQ(counted, at->second) << v.name;
    }
  }
}

// Invariants 1, 2 and 5 at once: every two of method, tile size, threads and width of vectors meet. Beside each row is
// one with the other number of threads and another width, whose counters are the same.
TEST_P(ShippedCapture, MethodsTileSizesThreadsAndInstructionSetsTogetherGiveTheSameBits) {
  const std::vector<std::size_t> levels = Combinations().levels();
  std::vector<test::Choices> rows = test::covering_array(levels);
  for (std::size_t r = 0, count = rows.size(); r < count; ++r)
    rows.push_back({rows[r][0], rows[r][1], (rows[r][2] + 1) % levels[2], (rows[r][3] + 1) % levels[3]});
  expect_the_same_bits(prepared, frame, rows);
}

// All of them with all others, in `./tessera test --all`, on captures of which a machine renders hundreds of frames in seconds.
class WholeProduct : public ShippedCapture {};
TEST_P(WholeProduct, TheWholeProductOfMethodsTileSizesThreadsAndInstructionSetsGivesTheSameBits) {
  expect_the_same_bits(prepared, frame, test::whole_product(Combinations().levels()));
}

// Invariant 5: counters and images are the same for any number of threads, any instruction set, any run.
TEST_P(ShippedCapture, ThreadsAndInstructionSetsChangeNeitherImageNorCounters) {  // M5
  const gpu::FrameResult expected = shown({});
  std::vector<Variant> variants = {
      {"again", {}, {}, 0, ""}, {"one thread", {}, {}, 1, ""}, {"three threads", {}, {}, 3, ""}};
  for (const std::string& target : simd_target_names()) variants.push_back({target, {}, {}, 0, target});
  for (const Variant& v : variants) {
    const gpu::FrameResult result = shown(v);
    EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets)) << v.name;
    EXPECT_EQ(counters_json(result.counters), counters_json(expected.counters)) << v.name;
  }
}

// Invariant 4: running the general kernels where nothing moves and nothing blurs gives the same image.
TEST_P(ShippedCapture, ForcingTheGeneralKernelsGivesTheSameImage) {  // M4
  const gpu::FrameResult expected = shown({});
  using gpu::EffectMode;
  for (const auto& [motion, defocus] : {std::pair{EffectMode::kOn, EffectMode::kAuto},
                                        {EffectMode::kAuto, EffectMode::kOn},
                                        {EffectMode::kOn, EffectMode::kOn}}) {
    Variant v;
    v.settings.effects.motion = motion;
    v.settings.effects.defocus = defocus;
    EXPECT_EQ(image_bytes(shown(v).targets), image_bytes(expected.targets)) << word(motion) << " " << word(defocus);
  }
}

TEST_P(ShippedCapture, ARegionIsACutOutOfTheFrame) {
  // A bloom brings light from anywhere into the region, so it is refused there.
  Variant no_bloom;
  no_bloom.settings.post.bloom = 0;
  const gpu::FrameResult all = shown(no_bloom);
  gpu::RenderRequest request = size;
  const IntRect region = small ? IntRect{19, 6, 60, 37} : IntRect{37, 11, 120, 71};
  request.region = region;
  const gpu::FrameResult part = render(prepared, no_bloom, frame, request);
  for (int y = region.y0; y < region.y1; ++y)
    for (int x = region.x0; x < region.x1; ++x)
      for (std::size_t c = 0; c < 4; ++c)
        ASSERT_EQ(part.targets.color.at(x - region.x0, y - region.y0)[c], all.targets.color.at(x, y)[c]);
}

TEST_P(ShippedCapture, FramesAreIndependentOfEarlierFrames) {
  gpu::Device fresh(capture, {}, {}, whole(96, 54)), used(capture, {}, {}, whole(96, 54));
  used.render(frame + 2);
  used.render(frame);
  EXPECT_EQ(image_bytes(used.render(frame + 1).targets), image_bytes(fresh.render(frame + 1).targets));
}

INSTANTIATE_TEST_SUITE_P(Captures, ShippedCapture,
                         testing::Values("eggs", "vases", "serpent", "flyby", "workshop", "stroll", "city", "garden",
                                         "city_evening", "garden_lamps", "corridor"),
                         [](const auto& param_info) { return std::string(param_info.param); });
INSTANTIATE_TEST_SUITE_P(Captures, WholeProduct,
                         testing::Values("eggs", "vases", "serpent", "flyby", "workshop", "stroll", "corridor"),
                         [](const auto& param_info) { return std::string(param_info.param); });

TEST(PartialRender, IsCountedAndLosesNothing) {  // M6
  const Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  Variant tiny;
  tiny.gpu.parameter_buffer.bytes = 1536;
  const gpu::FrameResult partial = render(capture, tiny, 14), whole_frame = render(capture, {}, 14);
  EXPECT_GT(partial.counters.binner.partial_renders, 2u);
  EXPECT_LE(partial.counters.binner.queue_bytes_peak, 1536u);
  EXPECT_EQ(partial.counters.binner.entries, whole_frame.counters.binner.entries);
  EXPECT_EQ(partial.counters.tilecore.entries_fetched, whole_frame.counters.binner.entries);
  const auto& state = partial.counters.ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kTileState);
  EXPECT_GT(state.written_bytes, 0u);
  EXPECT_EQ(state.written_bytes, state.read_bytes);  // the stored state was loaded again
  tiny.gpu.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  const gpu::FrameResult spilled = render(capture, tiny, 14);
  EXPECT_EQ(spilled.counters.binner.partial_renders, 0u);
  EXPECT_GT(spilled.counters.binner.spilled_bytes, 0u);
}

TEST(Ledger, EveryByteReadFromTheQueuesWasWrittenBefore) {
  const Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  Variant apart;  // no burst belongs to two lists, and the cache of records holds them all
  apart.gpu.parameter_buffer.first_chunk_bytes = 64;
  apart.gpu.frame_buffer.compression = tilecore::FrameBufferCompression::kNone;
  const gpu::FrameResult r = render(capture, apart, 14);
  ASSERT_LE(16 * r.counters.binner.table_records, static_cast<std::uint64_t>(binner::RecordCache::kBytes));
  EXPECT_LE(r.counters.ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kTileQueue).read_bytes,
            r.counters.ledger.traffic(memory::Unit::kBinner, memory::Purpose::kTileQueue).written_bytes);
  // RGBA8: every row of every tile in whole bursts of 64 bytes; 160 x 4 bytes is 10 bursts a row.
  EXPECT_EQ(r.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kFrameBuffer).written_bytes,
            160u * 90u * 4u);
}

// ---- Watertightness ---------------------------------------------------------------------------------------------

// From inside a closed surface every sample must see it: static, moving, displaced, defocused, and when the surface
// passes through the near plane.
struct ClosedCase {
  const char* name;
  bool bezier, displaced, moving, lens;
};

class ClosedSurface : public testing::TestWithParam<ClosedCase> {};

Capture closed_capture(const ClosedCase& c, Random& random) {
  Capture capture;
  scene::Material material;
  material.double_sided = true;
  if (c.displaced) {
    std::vector<float> heights(64);
    for (float& h : heights) h = random.uniform(0, 1);
    material.displacement = test::displacement(8, 8, heights, 0.3f, -0.1f);
  }
  const int m = test::add_material(capture, material);
  scene::Primitive primitive = test::closed_patches(m);
  if (!c.bezier) {
    // A cube of many triangles.
    std::vector<Vec3> positions;
    std::vector<std::uint32_t> indices;
    const int n = 7;
    for (int axis = 0; axis < 3; ++axis)
      for (const float side : {-1.0f, 1.0f}) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (int j = 0; j <= n; ++j)
          for (int i = 0; i <= n; ++i) {
            Vec3 p;
            p[axis] = side;
            p[(axis + 1) % 3] = -1.0f + 2.0f * static_cast<float>(i) / n;
            p[(axis + 2) % 3] = -1.0f + 2.0f * static_cast<float>(j) / n;
            positions.push_back(p);
          }
        for (std::uint32_t j = 0; j < n; ++j)
          for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = first + j * (n + 1) + i;
            indices.insert(indices.end(), {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1});
          }
      }
    primitive = test::triangles(positions, indices, m);
  }
  const int node = test::add_node(capture, primitive);
  const glm::dquat turn = glm::angleAxis(0.6, glm::normalize(DVec3(1, 2, 3)));
  capture.nodes[static_cast<std::size_t>(node)].transform.rotation = turn;
  if (c.moving) {
    test::add_motion(capture, node, {0.25, -0.2, 0.3});
    scene::AnimationChannel spin;
    spin.node = node;
    spin.path = scene::AnimatedPath::kRotation;
    spin.components = 4;
    spin.times = {0, 1};
    const glm::dquat end = glm::angleAxis(0.25, DVec3(0, 0, 1)) * turn;
    for (const glm::dquat& q : {turn, end})
      for (const double v : {q.x, q.y, q.z, q.w}) spin.values.push_back(static_cast<float>(v));
    capture.animations[0].channels.push_back(spin);
    capture.settings.shutter_close = 30;  // one second at 30 frames per second
  }
  scene::Camera camera;
  camera.vertical_fov = 1.6f;
  camera.near = 0.03f;
  if (c.lens) camera.lens = {0.02f, 0.6f};
  test::add_camera(capture, {0.1, 0.15, 0.2}, camera);
  capture.settings.background = Vec3(1, 0, 0);
  return capture;
}

TEST_P(ClosedSurface, NeverShowsTheBackgroundFromInside) {
  Random random(3);
  const Capture capture = closed_capture(GetParam(), random);
  Variant v;
  v.settings.sampling.samples_per_pixel = 8;
  v.settings.tessellation.target_edge_pixels = 5;
  const gpu::FrameResult result = render(capture, v, 0, whole(192, 128));
  std::size_t open = 0;
  for (std::size_t i = 3; i < result.targets.color.values.size(); i += 4)
    open += result.targets.color.values[i] < 1.0f ? 1 : 0;
  EXPECT_EQ(open, 0u);
  EXPECT_EQ(result.counters.shading.samples_visible, 192u * 128u * 8u);
}

TEST_P(ClosedSurface, LooksTheSameHoweverItIsBinned) {
  Random random(3);
  const Capture capture = closed_capture(GetParam(), random);
  const gpu::FrameResult expected = render(capture, plainest_binning({}), 0);
  for (const Variant& v : binning_variants())
    EXPECT_EQ(image_bytes(render(capture, v, 0).targets), image_bytes(expected.targets)) << v.name;
}

TEST_P(ClosedSurface, LooksTheSameByEveryVisibilityMethod) {
  Random random(3);
  const Capture capture = closed_capture(GetParam(), random);
  const gpu::FrameResult expected = render(capture, {}, 0, whole(64, 36));
  for (const Variant& v : visibility_variants())
    EXPECT_EQ(image_bytes(render(capture, v, 0, whole(64, 36)).targets), image_bytes(expected.targets)) << v.name;
}

INSTANTIATE_TEST_SUITE_P(Cases, ClosedSurface,
                         testing::Values(ClosedCase{"StaticPatches", true, false, false, false},
                                         ClosedCase{"DisplacedPatches", true, true, false, false},
                                         ClosedCase{"MovingDisplacedPatches", true, true, true, false},
                                         ClosedCase{"DefocusedDisplacedPatches", true, true, false, true},
                                         ClosedCase{"MovingDefocusedDisplacedPatches", true, true, true, true},
                                         ClosedCase{"StaticTriangles", false, false, false, false},
                                         ClosedCase{"MovingDefocusedTriangles", false, false, true, true}),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

TEST(ClosedSurfaceTwin, ASurfaceWithMissingTrianglesShowsTheBackground) {
  Random random(3);
  Capture capture = closed_capture({"", false, false, true, true}, random);
  auto& indices = capture.meshes[0].primitives[0].indices;
  std::vector<std::uint32_t> rest;
  for (std::size_t t = 0; t < indices.size(); t += 3)
    if (t / 3 % 16 != 5)
      rest.insert(rest.end(), indices.begin() + static_cast<std::ptrdiff_t>(t),
                  indices.begin() + static_cast<std::ptrdiff_t>(t) + 3);
  indices = rest;
  const gpu::FrameResult result = render(capture, {}, 0, whole(192, 128));
  EXPECT_LT(result.counters.shading.samples_visible, 192u * 128u * 4u);
}

// ---- Scenes with much that cannot be seen -------------------------------------------------------------------------

// A wall of single-sided displaced balls on all sides of the camera, in several layers, one of them moving.
Capture crowd(bool moving, float aperture) {
  Capture capture;
  scene::Material material;
  std::vector<float> heights(16 * 16);
  for (std::size_t i = 0; i < heights.size(); ++i)
    heights[i] = std::sin(static_cast<float>(i % 16) * 0.7854f) * std::sin(static_cast<float>(i / 16) * 0.7854f);
  material.displacement = test::displacement(16, 16, heights, 0.01f, 0.0f);
  const int m = test::add_material(capture, material);
  capture.meshes.push_back({"ball", {test::closed_patches(m)}, {}});
  for (const double z : {-4.0, -6.5, -9.0, 4.0})
    for (int y = -2; y <= 2; ++y)
      for (int x = -3; x <= 3; ++x) {
        scene::Node node;
        node.mesh = 0;
        node.transform.translation = DVec3(1.7 * x, 1.7 * y, z);
        capture.nodes.push_back(node);
        capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
      }
  if (moving) test::add_motion(capture, 17, DVec3(4, 1, 2));
  scene::Camera camera;
  camera.lens = {aperture, 4.0f};
  test::add_camera(capture, DVec3(0, 0, 0), camera);
  return capture;
}

TEST(Crowd, MostDomainEvaluationsAreAvoidedAndNothingSeenIsLost) {
  for (const auto& [moving, aperture] : {std::pair{false, 0.0f}, {true, 0.0f}, {true, 0.02f}}) {
    const Capture capture = crowd(moving, aperture);
    Variant culling, plain;
    culling.settings.tessellation.target_edge_pixels = plain.settings.tessellation.target_edge_pixels = 1.5;
    plain.gpu.frontend.split_depth = 0;
    plain.gpu.frontend.backface_culling = plain.gpu.tilecore.occlusion_culling = false;
    const gpu::FrameResult expected = render(capture, plain, 0, whole(320, 180)),
                           result = render(capture, culling, 0, whole(320, 180));
    EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets));
    const frontend::FrontendCounters& f = result.counters.frontend;
    EXPECT_GT(static_cast<double>(f.cells) / static_cast<double>(f.base_patches), 16.0 * 16.0)
        << "factors of 16 and more";
    EXPECT_GT(f.cells_culled_frustum, f.cells / 4);
    EXPECT_GT(f.cells_culled_backface, f.cells / 100);
    EXPECT_GT(result.counters.tilecore.culled_occlusion, result.counters.tilecore.culled_blocks);
    EXPECT_GT(result.counters.tilecore.culled_blocks, 0u);
    // A conventional machine evaluates every vertex of every grid, at least one per cell.
    EXPECT_LT(result.counters.tessellation.domain_evaluations, f.cells / 5)
        << "several tiles' repeated evaluations included";
  }
}

// Many small triangles, in groups of clusters.
scene::Primitive fine_sheet() {
  constexpr std::uint32_t kPoints = 256;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  const auto at = [](std::uint32_t k) { return (static_cast<float>(k) / (kPoints - 1) - 0.5f) * 16; };
  for (std::uint32_t j = 0; j < kPoints; ++j)
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      positions.emplace_back(at(i), at(j), 0.0f);
      const std::uint32_t a = j * kPoints + i;
      if (i + 1 < kPoints && j + 1 < kPoints)
        indices.insert(indices.end(), {a, a + 1, a + kPoints + 1, a, a + kPoints + 1, a + kPoints});
    }
  return test::triangles(positions, indices, scene::kNone);
}

// A wall leaves the crowd and a fine sheet, which hides half of it: geometry that it hid in one frame is seen in the
// next.
TEST(Crowd, ThePreviousFramesDepthCullsWithoutChangingAImage) {
  for (const bool tiny_buffer : {false, true}) {
    Capture capture = crowd(false, 0.0f);
    const int wall = test::add_node(
        capture, test::triangles({{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}}, {0, 1, 2, 0, 2, 3}, scene::kNone),
        {-2.5, 0, -2});
    test::add_motion(capture, wall, DVec3(-4, 0, 0));
    test::add_node(capture, fine_sheet(), {0, 8.2, -3.1});
    capture.settings.frame_rate = 8;
    gpu::GpuConfiguration gpu;
    if (tiny_buffer) gpu.parameter_buffer.bytes = 4096;
    gpu::RunSettings settings;
    settings.tessellation.target_edge_pixels = 2;
    gpu::GpuConfiguration guessing = gpu;
    guessing.frontend.previous_depth_culling = true;
    gpu::Device plain(capture, gpu, settings, whole(320, 180)), guess(capture, guessing, settings, whole(320, 180));
    std::uint64_t culled = 0, second_pass = 0, entries = 0, plain_entries = 0;
    for (int frame = 0; frame < 6; ++frame) {
      const gpu::FrameResult expected = plain.render(frame), result = guess.render(frame);
      EXPECT_EQ(image_bytes(result.targets), image_bytes(expected.targets)) << "frame " << frame;
      const frontend::FrontendCounters& f = result.counters.frontend;
      if (frame == 0) {
        EXPECT_EQ(result.counters.previous_depth.patches_culled + f.second_pass_visible, 0u)
            << "there is no frame before";
      }
      culled += result.counters.previous_depth.patches_culled;
      second_pass += f.second_pass_visible;
      entries += result.counters.binner.entries;
      plain_entries += expected.counters.binner.entries;
    }
    EXPECT_GT(culled, 100u);
    EXPECT_GT(second_pass, 0u);
    if (!tiny_buffer) {
      EXPECT_LT(entries, plain_entries);
    }
  }
}

// ---- Odd frames -------------------------------------------------------------------------------------------------

TEST(OddFrames, OnePixelAndSizesThatNoTileDividesWork) {
  const Capture capture = scene::read_capture(test::shipped_capture("vases"));
  for (const auto& [width, height] : {std::pair{1, 1}, {33, 1}, {1, 65}, {37, 41}}) {
    const gpu::FrameResult result = render(capture, {}, 0, whole(width, height));
    EXPECT_EQ(result.counters.resolve.pixels_shaded, static_cast<std::uint64_t>(width * height));
    for (const float v : result.targets.color.values) ASSERT_TRUE(std::isfinite(v));
  }
}

TEST(OddFrames, AnEmptySceneIsAllBackground) {
  Capture capture;
  capture.settings.background = Vec3(0.25f, 0.5f, 0.75f);
  const gpu::FrameResult result = render(capture, {}, 0, whole(20, 20));
  EXPECT_EQ(result.counters.frontend.base_patches, 0u);
  EXPECT_EQ(result.targets.color.at(7, 7)[1], 0.5f);
  EXPECT_EQ(result.targets.color.at(7, 7)[3], 0.0f);
}

TEST(OddFrames, DegenerateTransformsAndPatchesDrawNothingAndBreakNothing) {
  Capture capture;
  const int flat = test::add_node(capture, test::closed_patches(scene::kNone));
  capture.nodes[static_cast<std::size_t>(flat)].transform.scale = DVec3(0.0);
  test::add_node(capture, test::patches(std::vector<Vec3>(16, Vec3(0.3f))));
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {0, 1, 2, 0, 0, 0}));
  test::add_camera(capture, {0, 0, 4});
  const gpu::FrameResult result = render(capture, {}, 0, whole(40, 30));
  EXPECT_EQ(result.counters.shading.samples_visible, 0u);
}

TEST(OddFrames, CoordinatesUpToAMillionKeepTheirImage) {
  // The node moves far out and the camera with it: matrices are multiplied in double precision.
  const auto image = [](double offset) {
    Capture capture;
    test::add_node(capture, test::closed_patches(scene::kNone), DVec3(offset, -offset, offset * 0.5));
    test::add_camera(capture, DVec3(offset, -offset, offset * 0.5) + DVec3(0.2, 0.3, 4));
    return render(capture, {}, 0, whole(96, 64));
  };
  const gpu::FrameResult near = image(0), far = image(1e6);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < near.targets.patch.values.size(); ++i)
    differing += near.targets.patch.values[i] != far.targets.patch.values[i] ? 1 : 0;
  EXPECT_LT(differing, near.targets.patch.values.size() / 500);
}

}  // namespace
}  // namespace tessera::replay::invariants_test
