// The public interface of include/tessera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tessera/tessera.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/support/captures.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/pass_assets.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace test = tessera::test;
using testing::HasSubstr;

const char* const kCapture = TESSERA_SOURCE_DIR "/captures/eggs.glb";

tessera::RenderOptions small_frame() {
  tessera::RenderOptions options;
  options.width = 96;
  options.height = 54;
  return options;
}

std::string message_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const tessera::Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Library, EveryKeyTakesAndGivesItsDefault) {
  const auto check = [](auto machine) {
    const std::string before = machine.json();
    for (const tessera::KeyDescription& key : machine.keys()) {
      EXPECT_EQ(machine.get(key.name), key.default_value) << key.name;
      machine.set(key.name, key.default_value);
      EXPECT_FALSE(key.meaning.empty()) << key.name;
    }
    EXPECT_EQ(machine.json(), before);
  };
  check(tessera::Gpu());
  check(tessera::Settings());
}

TEST(Library, AMachineSurvivesItsJson) {
  for (const std::string& preset : tessera::Gpu::presets()) {
    tessera::Gpu gpu(preset);
    gpu.set("tile.width", 48);
    EXPECT_EQ(tessera::Gpu::from_json(gpu.json()).json(), gpu.json()) << preset;
  }
}

TEST(Library, CopiesOfMachinesAreTheirOwn) {
  const tessera::Gpu gpu("small");
  tessera::Gpu copy = gpu;
  copy.set("tile.width", 64);
  EXPECT_EQ(gpu.get("tile.width"), tessera::Value(std::int64_t{16}));
  EXPECT_EQ(copy.get("tile.width"), tessera::Value(std::int64_t{64}));
}

TEST(Library, RefusalsAreExceptionsOfOneHierarchy) {
  EXPECT_THAT(message_of([] { tessera::Gpu().set("tile.widht", 16); }), HasSubstr("did you mean 'tile.width'"));
  EXPECT_THROW(tessera::Gpu().set("tile.width", 1 << 20), tessera::UsageError);
  EXPECT_THROW(tessera::Settings().set("shading.rate", "often"), tessera::UsageError);
  EXPECT_THROW(tessera::Gpu("huge"), tessera::UsageError);
  EXPECT_THROW(tessera::Gpu::from_json("{\"tile\": 3}"), tessera::InputError);
  EXPECT_THROW(tessera::Gpu::from_json("{"), tessera::InputError);
  EXPECT_THROW(tessera::Scene("/missing.glb"), tessera::Error);
  EXPECT_THROW(tessera::Scene(kCapture, {.max_bytes = 1000}), tessera::LimitError);
  const tessera::Scene scene(kCapture);
  tessera::RenderOptions options = small_frame();
  options.region = tessera::Region{90, 0, 10, 10};
  EXPECT_THROW(tessera::Device(scene, tessera::Gpu(), {}, options), tessera::UsageError);
  options.region.reset();
  options.max_image_bytes = 1000;
  EXPECT_THROW(tessera::Device(scene, tessera::Gpu(), {}, options), tessera::LimitError);
  EXPECT_THROW(tessera::Device(scene, tessera::Gpu().set("tile.width", 20), {}, small_frame()), tessera::UsageError);
  tessera::Device device(scene, tessera::Gpu(), {}, small_frame());
  EXPECT_THROW(device.render(-1), tessera::UsageError);
  const tessera::Frame frame = device.render(0);
  EXPECT_THAT(message_of([&] { frame.image("depth"); }), HasSubstr("no layer 'depth'; it has color"));
  EXPECT_THROW(frame.image("color", tessera::Eye::kRight), tessera::UsageError);
  EXPECT_THROW(frame.patches(), tessera::UsageError);
}

TEST(Library, TellsShadowsAndPassesAndRefusesToRenderPasses) {
  const tessera::Scene plain(kCapture);
  EXPECT_TRUE(plain.shadows().empty());
  EXPECT_TRUE(plain.passes().empty());
  test::GltfAsset asset = test::everything_asset();
  auto& settings = asset.document["extensions"]["TESSERA_capture"];
  settings["shadows"] = {{{"light", 0}, {"size", 256}}};
  const test::TemporaryFolder folder;
  test::write_text(folder / "shadows.glb", asset.glb());
  const tessera::Scene casting(folder / "shadows.glb");
  ASSERT_EQ(casting.shadows().size(), 1u);
  EXPECT_EQ(casting.shadows()[0].light, 0);
  EXPECT_EQ(casting.shadows()[0].size, 256);
  EXPECT_EQ(casting.shadows()[0].cascades, 1);
  EXPECT_EQ(casting.shadows()[0].distance, 0.0);
  settings.update(test::deferred_passes());
  settings["passes"][0]["subpasses"][1]["input"] = {"albedo", "normal", "depth"};
  test::write_text(folder / "passes.glb", asset.glb());
  const tessera::Scene scene(folder / "passes.glb");
  EXPECT_EQ(scene.passes(), (std::vector<std::string>{"main", "bloom", "final"}));
  EXPECT_THROW(tessera::Device(scene, tessera::Gpu(), {}, small_frame()), tessera::InputError);
  EXPECT_THAT(
      message_of([&] { tessera::Device device(scene, tessera::Gpu(), {}, small_frame()); }),
      HasSubstr(
          "/extensions/TESSERA_capture/passes/0/subpasses/1/input: is not the G-buffer and 'depth': light reads all "
          "of it"));
}

TEST(Library, AnUnknownVariantIsWrongUsage) {
  EXPECT_TRUE(tessera::Scene(kCapture).variants().empty());
  tessera::ReadLimits limits;
  limits.variant = "gold";
  EXPECT_THROW(tessera::Scene(kCapture, limits), tessera::UsageError);
  EXPECT_THAT(message_of([&] { tessera::Scene scene(kCapture, limits); }), HasSubstr("no variant 'gold' in "));
}

TEST(Library, AFrameOutlivesItsDeviceAndScene) {
  const tessera::Frame frame =
      tessera::Device(tessera::Scene(kCapture), tessera::Gpu("small"), {}, small_frame()).render(14);
  const tessera::ImageView<float> image = frame.image();
  EXPECT_EQ(image.values.size(), 96u * 54u * 4u);
  EXPECT_EQ(frame.display().values.size(), 96u * 54u * 3u);
  EXPECT_GT(frame.counters().at("tilecore.samples_visible"), 1000u);
}

TEST(Library, TrafficEnergyAndMapsAddUp) {
  const tessera::Frame frame =
      tessera::Device(tessera::Scene(kCapture), tessera::Gpu("small"), {}, small_frame()).render(14);
  std::uint64_t read = 0, written = 0;
  for (const tessera::TrafficRow& row : frame.traffic()) {
    read += row.read_bytes;
    written += row.written_bytes;
  }
  EXPECT_EQ(read, frame.counters().at("dram.read_bytes"));
  EXPECT_EQ(written, frame.counters().at("dram.written_bytes"));
  double energy = 0;
  for (const auto& [unit, nj] : frame.energy()->by_unit_nj) energy += nj;
  EXPECT_EQ(energy, frame.energy()->total_nj);
  const std::set<std::string> no_units = {"latency",  "l2",        "caches",   "tile_memory",
                                          "geometry", "tilecores", "imbalance"};
  EXPECT_TRUE(frame.timing()->busy_cycles.contains(frame.timing()->bound_by) ||
              no_units.contains(frame.timing()->bound_by))
      << frame.timing()->bound_by;
  int maps_of_counters = 0;
  for (const tessera::TileMap& map : frame.tile_maps()) {
    std::uint64_t sum = 0;
    for (int y = 0; y < map.rows; ++y)
      for (int x = 0; x < map.columns; ++x) sum += map.at(x, y);
    if (!frame.counters().contains(map.counter)) continue;
    EXPECT_EQ(sum, frame.counters().at(map.counter)) << map.name;
    ++maps_of_counters;
  }
  EXPECT_GT(maps_of_counters, 5);
}

// The area is the machine's; the number of cores multiplies only the area of a core. With overlapping frames, one
// frame takes twice the time from one frame to the next.
TEST(Library, LatencyAndAreaFollowTheMachine) {
  const auto render = [](const std::map<std::string, tessera::Value>& keys) {
    tessera::Gpu gpu("small");
    for (const auto& [key, value] : keys) gpu.set(key, value);
    return tessera::Device(tessera::Scene(kCapture), gpu, {}, small_frame()).render(14);
  };
  const tessera::Frame two = render({{"tilecore.count", std::int64_t{2}}}),
                       four = render({{"tilecore.count", std::int64_t{4}}, {"machine.overlap", "frames"}});
  EXPECT_EQ(two.timing()->latency_cycles, two.timing()->cycles);
  EXPECT_EQ(four.timing()->latency_cycles, 2 * four.timing()->cycles);
  EXPECT_GT(two.timing()->bound_by_cycles, 0);
  EXPECT_LT(two.timing()->bound_by_cycles, two.timing()->cycles);
  double mm2 = 0;
  for (const auto& [unit, area] : two.area()->by_unit_mm2) {
    mm2 += area;
    const bool of_cores = unit != "frontend" && unit != "binner" && unit != "l2" && unit != "other_memories";
    if (unit == "other_memories") continue;
    EXPECT_DOUBLE_EQ(four.area()->by_unit_mm2.at(unit), of_cores ? 2 * area : area) << unit;
  }
  EXPECT_EQ(mm2, two.area()->total_mm2);
  tessera::Settings settings;
  settings.set("output.machine_model", false);
  const tessera::Frame bare =
      tessera::Device(tessera::Scene(kCapture), tessera::Gpu("small"), settings, small_frame()).render(14);
  EXPECT_FALSE(bare.timing() || bare.energy() || bare.area());
}

// Every capture with something that others lack: moving patches, procedures, many objects, blending, two eyes.
TEST(Library, CostsOfDrawablesAddUpToTheFrames) {
  for (const char* name : {"eggs", "workshop", "stroll", "garden"})
    for (const double eyes : {0.0, 0.05}) {
      const tessera::Scene scene(std::string(TESSERA_SOURCE_DIR "/captures/") + name + ".glb");
      const tessera::Frame frame =
          tessera::Device(scene, tessera::Gpu("small"), tessera::Settings().set("stereo.eye_separation", eyes),
                          small_frame())
              .render(scene.first_frame());
      std::uint64_t patches = 0;
      for (const tessera::DrawableCost& drawable : frame.drawables()) patches += drawable.base_patches;
      EXPECT_GT(patches, 0u);
      int compared = 0;
      for (const tessera::DrawableCostDescription& cost : tessera::drawable_cost_descriptions()) {
        if (!frame.counters().contains(cost.counter)) continue;
        std::uint64_t sum = 0;
        for (const tessera::DrawableCost& drawable : frame.drawables()) sum += drawable.costs.at(cost.name);
        EXPECT_EQ(sum, frame.counters().at(cost.counter)) << name << " " << cost.name << " " << eyes;
        ++compared;
      }
      EXPECT_GE(compared, 7) << name;
    }
}

TEST(Library, PassesHaveNamesCountersBytesAndTimes) {
  const tessera::Scene scene(TESSERA_SOURCE_DIR "/captures/corridor.glb");
  const tessera::Frame frame =
      tessera::Device(scene, tessera::Gpu("small"), tessera::Settings().set("post.bloom_levels", 2), small_frame())
          .render(scene.first_frame());
  std::vector<std::string> names;
  std::uint64_t read = 0, invocations = 0;
  double end = 0;
  for (const tessera::FramePass& pass : frame.passes()) {
    names.push_back(pass.name);
    for (const tessera::TrafficRow& row : pass.traffic) read += row.read_bytes;
    const auto shaded = pass.counters.find("tilecore.pixel_shader_invocations");
    if (shaded != pass.counters.end()) invocations += shaded->second;
    EXPECT_GE(pass.begin_cycles, end) << pass.name << ": without overlap passes follow each other";
    EXPECT_GT(pass.end_cycles, pass.begin_cycles) << pass.name;
    end = pass.end_cycles;
  }
  EXPECT_THAT(names, testing::ElementsAre("shadow 0.0", "shadow 1.0", "shadow 2.0", "shadow 3.0", "main",
                                          "bloom down 0", "bloom down 1", "bloom up 0", "final"));
  EXPECT_EQ(read, frame.counters().at("dram.read_bytes"));
  EXPECT_EQ(invocations, frame.counters().at("tilecore.pixel_shader_invocations"));
  EXPECT_LE(end, frame.timing()->cycles + 1);
}

// Instances of a node are one row for each primitive of its mesh.
TEST(Library, CostsOfInstancesAreOneRow) {
  const std::string file = testing::TempDir() + "library_instances.gltf";
  // Five instances without data: all in one place.
  std::ofstream(file) << R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0,
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3},
                  {"componentType": 5126, "type": "VEC3", "count": 5}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 0}}]}],
    "nodes": [{"mesh": 0, "name": "many", "extensions":
              {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}]})";
  const tessera::Frame frame =
      tessera::Device(tessera::Scene(file), tessera::Gpu("small"), {}, small_frame()).render(0);
  std::filesystem::remove(file);
  ASSERT_EQ(frame.drawables().size(), 2u);
  std::uint64_t entries = 0;
  for (const tessera::DrawableCost& row : frame.drawables()) {
    EXPECT_EQ(row.instances, 5u);
    EXPECT_EQ(row.base_patches, 5u);
    EXPECT_EQ(row.node_name, "many");
    entries += row.costs.at("entries");
  }
  EXPECT_EQ(entries, frame.counters().at("tilecore.entries_fetched"));
  EXPECT_EQ(frame.counters().at("frontend.instances"), 5u);
}

TEST(Library, ARegionIsThatPartOfTheFrame) {
  const tessera::Scene scene(kCapture);
  tessera::RenderOptions options = small_frame();
  const tessera::Frame whole = tessera::Device(scene, tessera::Gpu(), {}, options).render(14);
  options.region = tessera::Region{40, 16, 24, 20};
  const tessera::Frame part = tessera::Device(scene, tessera::Gpu(), {}, options).render(14);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x)
      for (std::size_t c = 0; c < 4; ++c)
        ASSERT_EQ(part.image().at(x, y)[c], whole.image().at(x + 40, y + 16)[c]) << x << " " << y;
}

TEST(Library, ARightEyeHasImagesOfItsOwn) {
  const tessera::Frame frame = tessera::Device(tessera::Scene(kCapture), tessera::Gpu(),
                                               tessera::Settings().set("stereo.eye_separation", 0.1), small_frame())
                                   .render(14);
  ASSERT_TRUE(frame.has_right_eye());
  const auto left = frame.display().values, right = frame.display(tessera::Eye::kRight).values;
  EXPECT_FALSE(std::equal(left.begin(), left.end(), right.begin()));
}

TEST(Library, EveryCounterOfAFrameIsDescribed) {
  std::set<std::string> known;
  for (const tessera::CounterDescription& counter : tessera::counter_descriptions()) known.insert(counter.name);
  tessera::Settings settings;
  settings.set("resolve.desampling", "adaptive").set("shading.rate", "cache");
  tessera::Device device(tessera::Scene(kCapture), tessera::Gpu(), settings, small_frame());
  const tessera::Frame frame = device.render(14);
  for (const auto& [name, value] : frame.counters()) EXPECT_TRUE(known.contains(name)) << name;
}

TEST(Library, StatesItsVersionAndSimdTarget) {
  EXPECT_EQ(tessera::version().substr(0, 2), "0.");
  EXPECT_FALSE(tessera::simd_target().empty());
}

}  // namespace
