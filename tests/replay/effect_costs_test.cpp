// `tessera tradeoff --effects`: the cost of each effect of a frame; an absent one costs nothing.
#include "replay/tradeoff/effect_costs.h"

#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::replay::effect_costs_test {
namespace {

gpu::FrameResult render_frame(const char* capture_name, const std::vector<std::string>& sets = {}, int before = 0) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture(capture_name));
  gpu::RunSettings settings;
  settings.output.machine_model = false;
  gpu::GpuConfiguration gpu;
  for (const std::string& text : sets) gpu::apply_setting(text, settings, gpu);
  gpu::Device device(capture, gpu, settings, {96, 54, {0, 0, 96, 54}});
  for (int frame = 0; frame < before; ++frame) device.render(capture.settings.first_frame + frame);
  return device.render(capture.settings.first_frame + before);
}

std::uint64_t work_of(const EffectResult& effect) {
  std::uint64_t work = 0;
  for (const auto& [name, value] : effect.counters) work += value;
  return work;
}

// Effects that did not run, and whose work was counted nevertheless.
std::vector<std::string> wrong_counters(const std::vector<EffectResult>& effects) {
  std::vector<std::string> wrong;
  for (const EffectResult& effect : effects)
    if (!effect.ran && work_of(effect) > 0) wrong.push_back(effect.name);
  return wrong;
}

TEST(EffectCosts, EveryReportedEffectHasACase) {  // EFC1
  std::set<std::string> known;
  for (const EffectCase& one : effect_cases()) EXPECT_TRUE(known.insert(one.name).second) << one.name;
  for (const char* name : {"eggs", "workshop", "garden"})
    for (const auto& [effect, ran] : render_frame(name).effects) EXPECT_TRUE(known.contains(effect)) << effect;
  for (const EffectCase& one : effect_cases()) {
    gpu::RunSettings settings;
    gpu::GpuConfiguration gpu;
    EXPECT_NO_THROW(apply(one.without, settings, gpu)) << one.name;
  }
}

TEST(EffectCosts, CountersOfAbsentEffectsAreZero) {  // EFC2
  std::set<std::string> ran;
  const auto check = [&](const char* name, const std::vector<std::string>& sets = {}, int before = 0) {
    std::vector<EffectResult> effects = effects_of(render_frame(name, sets, before));
    EXPECT_THAT(wrong_counters(effects), testing::IsEmpty()) << name;
    for (EffectResult& effect : effects)
      if (effect.ran && work_of(effect) > 0) ran.insert(effect.name);
    // The failing twin: an effect is said not to have run whose work was counted.
    for (EffectResult& effect : effects)
      if (effect.ran && work_of(effect) > 0) {
        effect.ran = false;
        EXPECT_THAT(wrong_counters(effects), testing::ElementsAre(effect.name));
        effect.ran = true;
      }
  };
  for (const char* name : {"eggs", "vases", "stroll", "flyby", "serpent", "city", "garden", "workshop"}) check(name);
  for (const char* name : {"city_evening", "garden_lamps", "corridor"}) check(name, {"shadows.size=128"});
  check("stroll", {"resolve.desampling=adaptive", "resolve.foveation_r1=0.3", "resolve.foveation_r0=0.1"}, 1);
  check("vases", {"stereo.eye_separation=0.06", "frame_buffer.compression=none"});
  for (const char* effect : {"motion", "defocus", "displacement", "alpha_test", "procedures",
                             "frame_buffer_compression", "desampling", "foveation", "stereo", "shadows"})
    EXPECT_TRUE(ran.contains(effect)) << effect << " did no work anywhere, and so nothing was shown of it";
}

class EffectCostsCommand : public testing::Test {
 protected:
  test::ProcessResult run(const std::filesystem::path& capture, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"tradeoff", capture.string(), "--out",    (folder_ / "out").string(),
                                          "--size",   "64x36",          "--rounds", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run_tessera(arguments);
  }
  nlohmann::json result() const { return nlohmann::json::parse(test::read_text(folder_ / "out" / "tradeoff.json")); }
  static nlohmann::json effect(const nlohmann::json& all, const std::string& name) {
    const auto& effects = all["effects"];
    return *std::find_if(effects.begin(), effects.end(), [&](const auto& e) { return e["name"] == name; });
  }
  test::TemporaryFolder folder_;
};

// The frame without an effect is the frame that a replay draws without it.
TEST_F(EffectCostsCommand, WithoutAnEffectTheFrameEqualsAReplayWithoutIt) {  // EFC3
  const std::filesystem::path eggs = test::shipped_capture("eggs");
  const test::ProcessResult r = run(eggs, {"--effects"});
  ASSERT_EQ(r.status, 0) << r.errors;
  EXPECT_LE(std::count(r.output.begin(), r.output.end(), '\n'), 15);
  EXPECT_THAT(r.output, testing::HasSubstr("counters of their work: 0"));
  const nlohmann::json all = result();
  EXPECT_TRUE(all["reference"].is_null());
  const nlohmann::json settings = all["knobs"][0]["settings"];
  EXPECT_TRUE(settings[0]["error"]["psnr_db"].is_null()) << "images are compared with this one";
  for (const char* name : {"motion", "defocus", "displacement"}) {
    const nlohmann::json one = effect(all, name), without = settings[one["setting"].get<std::size_t>()];
    EXPECT_TRUE(one["ran"].get<bool>());
    EXPECT_LT(without["error"]["psnr_db"], 60) << "the image changes";
    std::vector<std::string> replay = {
        "replay",   eggs.string(),
        "--size",   "64x36",
        "--quiet",  "--no-report",
        "--frames", std::to_string(all["frame"].get<int>()) + ":" + std::to_string(all["frame"].get<int>() + 1),
        "--out",    (folder_ / name).string()};
    std::istringstream words(without["arguments"].get<std::string>());
    for (std::string word; words >> word;) replay.push_back(word);
    ASSERT_EQ(test::run_tessera(replay).status, 0);
    const auto stats = nlohmann::json::parse(test::read_text(folder_ / name / "stats.json"));
    EXPECT_EQ(stats["frames"][0]["timing"]["cycles"], without["cycles"]) << name;
    EXPECT_FALSE(stats["frames"][0]["effects"][name].get<bool>());
  }
  const nlohmann::json absent = effect(all, "procedures");
  EXPECT_FALSE(absent["ran"].get<bool>());
  EXPECT_TRUE(absent["setting"].is_null());
  EXPECT_EQ(run(eggs, {"--effects", "--knobs", "samples"}).status, 2);
}

// Layers of materials are left out of the scene, and with a layer all layers that need it.
TEST_F(EffectCostsCommand, LayersAreLeftOutOfTheMaterials) {
  test::GltfAsset asset;
  const std::vector<float> positions = {-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0};
  const std::vector<float> normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::vector<std::uint32_t> indices = {0, 1, 2, 2, 1, 3};
  const int position = asset.add_accessor("VEC3", positions), normal = asset.add_accessor("VEC3", normals),
            index = asset.add_accessor("SCALAR", indices);
  asset.document["extensionsUsed"] = {"KHR_materials_clearcoat", "KHR_materials_transmission", "KHR_materials_volume"};
  asset.add("materials",
            {{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.2, 0.1, 1.0}}, {"metallicFactor", 0.0}}},
             {"extensions",
              {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1.0}}},
               {"KHR_materials_transmission", {{"transmissionFactor", 0.5}}},
               {"KHR_materials_volume",
                {{"thicknessFactor", 0.5}, {"attenuationDistance", 0.2}, {"attenuationColor", {0.2, 0.9, 0.2}}}}}}});
  asset.add("meshes",
            {{"primitives",
              {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"indices", index}, {"material", 0}}}}});
  asset.add("nodes", {{"mesh", 0}});
  const std::filesystem::path plain = folder_ / "layers.glb";
  test::write_text(plain, asset.glb());
  const test::ProcessResult r = run(plain, {"--effects"});
  ASSERT_EQ(r.status, 0) << r.errors;
  const nlohmann::json all = result(), settings = all["knobs"][0]["settings"];
  for (const char* name : {"clearcoat", "transmission", "volume"}) {
    const nlohmann::json one = effect(all, name);
    EXPECT_TRUE(one["ran"].get<bool>()) << name;
    EXPECT_EQ(one["stays"], "") << name;
    ASSERT_FALSE(one["setting"].is_null()) << name;
    const nlohmann::json without = settings[one["setting"].get<std::size_t>()];
    EXPECT_NE(without["picture"], settings[0]["picture"]) << name;
    EXPECT_LT(without["cycles"], settings[0]["cycles"]) << name;
  }
  EXPECT_FALSE(effect(all, "sheen")["ran"].get<bool>());
}

}  // namespace
}  // namespace tessera::replay::effect_costs_test
