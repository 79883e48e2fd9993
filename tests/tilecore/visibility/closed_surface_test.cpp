// Hard cases that need whole tile cores: closed surfaces, walls through the camera, coplanar patches, very many
// entries.
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"
#include "tilecore/tile_core.h"

namespace tessera::tilecore::closed_surface_test {
namespace {

using scene::CellRange;

// A frame, its tiles and the entries that each of them renders.
struct Machine {
  TestFrame test;
  SamplePattern pattern;
  std::unique_ptr<binner::TileGrid> grid;
  TileJob job;
  std::vector<binner::ListEntry> entries;

  explicit Machine(const SamplingSettings& sampling) : pattern(sampling) {}

  void look(int width, int height, int tile_side) {
    test.pose(width, height);
    set_tiles(tile_side);
    for (std::uint32_t patch = 0; patch < test.assembly->patch_count(); ++patch)
      add_entry(patch, whole_patch(*test.frame, patch));
  }
  void set_tiles(int tile_side) {
    const scene::FrameRequest& request = test.frame->request;
    grid = std::make_unique<binner::TileGrid>(request.width, request.height, tile_side, tile_side);
    job.frame = test.frame.get();
    job.grid = grid.get();
    job.pattern = &pattern;
  }
  void add_entry(std::uint32_t patch, const CellRange& range) {
    if (range.i0 >= range.i1 || range.j0 >= range.j1) return;
    binner::ListEntry entry;
    entry.base_patch = patch;
    entry.range = range;
    entries.push_back(entry);
  }

  std::vector<TileState> render() const {
    TileCore core;
    std::vector<TileState> states(grid->tile_count());
    for (binner::TileIndex tile = 0; tile < grid->tile_count(); ++tile)
      core.render_entries(job, tile, entries, states[tile]);
    return states;
  }
};

std::size_t uncovered(const std::vector<TileState>& states) {
  std::size_t samples = 0;
  for (const TileState& state : states) samples += state.uncovered;
  return samples;
}

// The default and every other method.
std::vector<NamedMethod> all_methods() {
  std::vector<NamedMethod> methods = methods_of_units();
  methods.push_back({"patch-bvh", {}});
  return methods;
}

// ---- Closed surfaces --------------------------------------------------------------------------------------------

// A displaced ball around the camera that moves, turns and is out of focus; `seed` decides how.
std::unique_ptr<Machine> inside_a_ball(std::uint32_t seed) {
  Random random(seed);
  auto machine =
      std::make_unique<Machine>(SamplingSettings{4, seed, 0, seed % 3 == 0 ? 32 : 8, seed % 2 == 0 ? 8 : 16});
  TestFrame& test = machine->test;
  scene::Material material;
  material.double_sided = true;
  std::vector<float> heights(64);
  for (float& h : heights) h = random.uniform(0, 1);
  material.displacement = test::displacement(8, 8, heights, 0.3f, -0.1f);
  const int node = test::add_node(*test.capture, test::closed_patches(test::add_material(*test.capture, material)));
  const auto axis = [&] { return glm::normalize(DVec3(random.in_box(1)) + DVec3(0, 0, 1.5)); };
  const glm::dquat turn = glm::angleAxis(static_cast<double>(random.uniform(0, 6)), axis());
  const glm::dquat end = glm::angleAxis(static_cast<double>(random.uniform(-0.8f, 0.8f)), axis()) * turn;
  test.capture->nodes[static_cast<std::size_t>(node)].transform.rotation = turn;
  test::add_motion(*test.capture, node, DVec3(random.in_box(random.coin() ? 0.05f : 0.35f)));
  scene::AnimationChannel spin;
  spin.node = node;
  spin.path = scene::AnimatedPath::kRotation;
  spin.components = 4;
  spin.times = {0, 1};
  for (const glm::dquat& q : {turn, end})
    for (const double v : {q.x, q.y, q.z, q.w}) spin.values.push_back(static_cast<float>(v));
  test.capture->animations[0].channels.push_back(spin);
  scene::Camera camera;
  camera.vertical_fov = 1.6f;
  camera.near = 0.03f;
  camera.lens = {random.uniform(0.002f, 0.06f), random.uniform(0.3f, 2.5f)};
  test::add_camera(*test.capture, {0.1, 0.15, 0.1}, camera);
  machine->look(48, 32, std::array{8, 16, 32}[seed % 3]);
  return machine;
}

TEST(ClosedSurface, MovingAndDefocusedItNeverShowsTheBackgroundWhateverTheMethod) {
  const std::vector<NamedMethod> methods = all_methods();
  for (std::uint32_t seed = 0; seed < 24; ++seed) {
    const auto machine = inside_a_ball(seed);
    EXPECT_EQ(uncovered(machine->render()), 0u) << "seed " << seed;
    const NamedMethod& method = methods[seed % methods.size()];
    machine->job.core.visibility = method.settings;
    EXPECT_EQ(uncovered(machine->render()), 0u) << "seed " << seed << ", " << method.name;
  }
}

TEST(ClosedSurface, ACellLeftOutIsCaught) {
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    const auto machine = inside_a_ball(seed);
    const std::vector<TileState> whole = machine->render();
    // The cell that a sample in the middle of the frame sees.
    const TileState& tile = whole[whole.size() / 2];
    const std::uint32_t patch = tile.patch[0], cell = tile.triangle[0] / 2;
    const scene::TessellationPattern& grid = machine->test.frame->pattern_of(patch);
    const auto i = static_cast<std::uint8_t>(cell % grid.nu), j = static_cast<std::uint8_t>(cell / grid.nu);
    const auto after_i = static_cast<std::uint8_t>(i + 1), after_j = static_cast<std::uint8_t>(j + 1);
    std::erase_if(machine->entries, [&](const binner::ListEntry& e) { return e.base_patch == patch; });
    machine->add_entry(patch, {0, 0, grid.nu, j});
    machine->add_entry(patch, {0, j, i, after_j});
    machine->add_entry(patch, {after_i, j, grid.nu, after_j});
    machine->add_entry(patch, {0, after_j, grid.nu, grid.nv});
    EXPECT_GT(uncovered(machine->render()), 0u) << "seed " << seed;
    // With the cell it is closed again.
    machine->add_entry(patch, {i, j, after_i, after_j});
    EXPECT_EQ(uncovered(machine->render()), 0u) << "seed " << seed;
  }
}

// ---- Through the camera -----------------------------------------------------------------------------------------

// Depths of the hits on the samples of a single tile, by sample.
class DepthSink final : public HitSink {
 public:
  std::multimap<std::uint32_t, float> depths;
  void take(std::span<const Hit> hits) override {
    for (const Hit& h : hits) depths.emplace(h.sample, h.z);
  }
};

TEST(CameraPlane, AWallThatPassesThroughItIsSeenExactlyUntilItReachesTheNearPlane) {
  constexpr double kNear = 0.1;
  for (const bool bezier : {false, true})
    for (const double slope : {0.0, 0.4})
      for (const bool lens : {false, true}) {
        if (lens && slope != 0) continue;  // depth would depend on the lens point
        Machine machine({8, 2, 0, 8, 16});
        TestFrame& test = machine.test;
        scene::Material material;
        material.double_sided = true;
        const int m = test::add_material(*test.capture, material);
        // The plane z = -2 + slope x, far wider than the view, that comes closer by 4 during the shutter.
        constexpr float kHalf = 24;
        const auto tilt = static_cast<float>(slope) * kHalf;
        const int node =
            bezier ? test::add_node(*test.capture,
                                    test::patches(test::flat_patch({-kHalf, -kHalf, -2 - tilt},
                                                                   {2 * kHalf, 0, 2 * tilt}, {0, 2 * kHalf, 0}),
                                                  m))
                   : test::add_node(*test.capture, test::triangles({{-kHalf, -kHalf, -2 - tilt},
                                                                    {kHalf, -kHalf, -2 + tilt},
                                                                    {kHalf, kHalf, -2 + tilt},
                                                                    {-kHalf, kHalf, -2 - tilt}},
                                                                   {0, 1, 2, 0, 2, 3}, m));
        test::add_motion(*test.capture, node, {0, 0, 4});
        scene::Camera camera;
        camera.near = static_cast<float>(kNear);
        if (lens) camera.lens = {0.05f, 1.5f};
        test::add_camera(*test.capture, {0, 0, 0}, camera);
        machine.look(32, 24, 32);
        const scene::FrameGeometry& frame = *test.frame;
        TileSamples samples;
        samples.fill(machine.pattern, {0, 0, 32, 24}, static_cast<float>(frame.projection.lens_scale), lens);
        for (const NamedMethod& method : all_methods()) {
          machine.job.core.visibility = method.settings;
          TileCore core;
          DepthSink sink;
          core.begin_tile(machine.job, 0);
          for (const binner::ListEntry& entry : machine.entries) core.find_hits(machine.job, entry, sink);
          int seen = 0, missed = 0, wrong = 0;
          for (std::uint32_t s = 0; s < samples.count; ++s) {
            // The ray (dx, dy, -1) z meets z' = -2 + slope x + 4t.
            const double dx = (static_cast<double>(samples.x[s]) - 16) / frame.projection.scale,
                         t = static_cast<double>(samples.t(s));
            const double z = (2 - 4 * t) / (1 + slope * dx);
            const std::size_t hits = sink.depths.count(s);
            if (std::abs(z - kNear) < 1e-3) continue;
            const std::size_t expected = z > kNear ? 1 : 0;
            wrong += hits != expected ||
                             (hits == 1 && std::abs(static_cast<double>(sink.depths.find(s)->second) - z) > 2e-3 * z)
                         ? 1
                         : 0;
            seen += hits > 0 ? 1 : 0;
            missed += hits == 0 ? 1 : 0;
          }
          EXPECT_EQ(wrong, 0) << method.name << " " << bezier << " " << slope << " " << lens;
          EXPECT_GT(seen, 1000);
          EXPECT_GT(missed, 1000);
        }
      }
}

// ---- Coplanar patches -------------------------------------------------------------------------------------------

TEST(CoplanarPatches, WhereTwoMoveTogetherTheLowerNumberIsSeenWhateverTheOrderAndMethod) {
  Machine machine({4, 1, 0});
  TestFrame& test = machine.test;
  scene::Material material;
  material.double_sided = true;
  const int m = test::add_material(*test.capture, material);
  // In a plane of depth 4: its inverse is exact, and so is the depth of every hit.
  for (const float at : {-1.4f, -0.9f}) {
    const int node = test::add_node(*test.capture,
                                    test::patches(test::flat_patch({at, at, 0}, {1.9f, 0.3f, 0}, {-0.2f, 2.1f, 0}), m));
    test::add_motion(*test.capture, node, {0.7, 0.4, 0});
  }
  test::add_camera(*test.capture, {0, 0, 4});
  machine.look(48, 32, 16);
  ASSERT_EQ(machine.entries.size(), 2u);
  const auto alone = [&](std::size_t entry) {
    Machine& all = machine;
    const std::vector<binner::ListEntry> both = all.entries;
    all.entries = {both[entry]};
    const auto states = all.render();
    all.entries = both;
    return states;
  };
  const auto first = alone(0), second = alone(1);
  for (const NamedMethod& method : all_methods())
    for (const bool second_first : {false, true}) {
      machine.job.core.visibility = method.settings;
      for (std::size_t e = 0; e < 2; ++e) machine.entries[e].near_depth = second_first == (e == 0) ? 1.0f : 0.0f;
      const auto states = machine.render();
      int shared = 0;
      for (std::size_t tile = 0; tile < states.size(); ++tile)
        for (std::size_t s = 0; s < states[tile].patch.size(); ++s) {
          const bool in_first = first[tile].patch[s] == 0, in_second = second[tile].patch[s] == 1;
          shared += in_first && in_second ? 1 : 0;
          if (in_first && in_second) {
            ASSERT_EQ(first[tile].z[s], second[tile].z[s]);
          }
          ASSERT_EQ(states[tile].patch[s], in_first ? 0u : in_second ? 1u : TileState::kNoPatch) << method.name;
        }
      EXPECT_GT(shared, 200);
    }
}

// ---- Few and many -----------------------------------------------------------------------------------------------

TEST(TileCore, TilesOfOneSampleEqualOneTile) {
  const auto machine = inside_a_ball(1);
  machine->test.pose(6, 4);
  machine->pattern = SamplePattern({1, 5, 0});
  machine->entries.clear();
  for (std::uint32_t patch = 0; patch < machine->test.assembly->patch_count(); ++patch)
    machine->add_entry(patch, whole_patch(*machine->test.frame, patch));
  machine->set_tiles(8);
  const TileState whole = machine->render()[0];
  machine->set_tiles(1);
  for (const NamedMethod& method : all_methods()) {
    machine->job.core.visibility = method.settings;
    const std::vector<TileState> single = machine->render();
    ASSERT_EQ(single.size(), whole.z.size());
    for (std::size_t s = 0; s < single.size(); ++s) {
      ASSERT_EQ(single[s].z[0], whole.z[s]) << method.name;
      ASSERT_EQ(single[s].triangle[0], whole.triangle[s]) << method.name;
    }
  }
}

TEST(TileCore, AHundredThousandEntriesOfOneCellAreTheFewPatchesThatTheyAreCutFrom) {
  // 5x5 patches of 64x64 cells in one tile, moving; nothing is culled.
  Machine machine({4, 0, 0});
  TestFrame& test = machine.test;
  scene::Material material;
  material.double_sided = true;
  const int m = test::add_material(*test.capture, material);
  std::vector<Vec3> points;
  Random random(1);
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i)
      for (Vec3 p : test::flat_patch({-1.0f + 0.4f * static_cast<float>(i), -1.0f + 0.4f * static_cast<float>(j), 0},
                                     {0.4f, 0, 0}, {0, 0.4f, 0}))
        points.push_back(p + random.in_box(0.05f));
  test::add_motion(*test.capture, test::add_node(*test.capture, test::patches(points, m)), {0.2, 0.1, 0.3});
  test::add_camera(*test.capture, {0, 0, 2.2});
  test.assembly = std::make_unique<scene::Assembly>(scene::assemble(*test.capture));
  scene::FrameRequest request;
  request.width = request.height = 32;
  request.close_time = 1;
  request.tessellation.target_edge_pixels = 0.01;
  test.frame = scene::pose_frame(*test.assembly, scene::choose_camera(*test.capture, 32, 32), request);
  machine.set_tiles(32);
  for (std::uint32_t patch = 0; patch < test.assembly->patch_count(); ++patch)
    machine.add_entry(patch, whole_patch(*test.frame, patch));
  const TileState expected = machine.render()[0];
  EXPECT_LT(expected.uncovered, expected.z.size() / 2);
  std::vector<binner::ListEntry> whole = std::move(machine.entries);
  machine.entries.clear();
  for (const binner::ListEntry& e : whole)
    for (int j = e.range.j0; j < e.range.j1; ++j)
      for (int i = e.range.i0; i < e.range.i1; ++i)
        machine.add_entry(e.base_patch, {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
                                         static_cast<std::uint8_t>(i + 1), static_cast<std::uint8_t>(j + 1)});
  ASSERT_GE(machine.entries.size(), 100000u);
  const TileState cut = machine.render()[0];
  EXPECT_EQ(cut.z, expected.z);
  EXPECT_EQ(cut.patch, expected.patch);
  EXPECT_EQ(cut.triangle, expected.triangle);
  EXPECT_EQ(cut.b1, expected.b1);
  // The twin: one of them missing, that some sample sees.
  const auto seen =
      static_cast<std::size_t>(std::find_if(expected.patch.begin(), expected.patch.end(),
                                            [](std::uint32_t patch) { return patch != TileState::kNoPatch; }) -
                               expected.patch.begin());
  std::erase_if(machine.entries, [&](const binner::ListEntry& e) {
    return e.base_patch == expected.patch[seen] && e.range.j0 * 64u + e.range.i0 == expected.triangle[seen] / 2;
  });
  EXPECT_NE(machine.render()[0].triangle, expected.triangle);
}

}  // namespace
}  // namespace tessera::tilecore::closed_surface_test
