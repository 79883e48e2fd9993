// Why one run is slower than another: single changes to scenes, settings and machines are planted, and named.
#include "replay/compare/causes.h"

#include <regex>

#include "gpu/device.h"
#include "gpu/record_file.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/tests.h"

namespace tessera::replay::causes_test {
namespace {

using scene::Capture;
using testing::HasSubstr;

struct Rendering {
  Capture capture;
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  gpu::RenderRequest request{160, 90, {0, 0, 160, 90}};

  void set(const std::string& key_and_value) { gpu::apply_setting(key_and_value, settings, gpu); }
  void resize(int width, int height) {
    request.width = width, request.height = height;
    request.region = {0, 0, width, height};
  }
};

// A change, and the words by which the first named cause has to name it.
struct Planted {
  const char* capture;
  std::function<void(Rendering&)> plant;
  const char* named;
};

scene::Node& node_of(Capture& capture, const char* name) {
  for (scene::Node& node : capture.nodes)
    if (node.name == name) return node;
  throw std::runtime_error(name);
}

// Writes stats.json of frame 5, as a replay does.
void write_run(Rendering& setup, const fs::path& folder) {
  fs::create_directories(folder);
  setup.request.attribute = true;
  gpu::Device device(setup.capture, setup.gpu, setup.settings, setup.request);
  const gpu::FrameResult result = device.render(5);
  Statistics statistics(setup.capture, setup.gpu, setup.settings, setup.request);
  const DrawableNames names(
      gpu::record_head("", device.assembly(), setup.gpu, setup.settings, setup.request.width, setup.request.height));
  const FrameCosts costs(*result.shares, names);
  statistics.add(result, nullptr, &costs);
  statistics.write(folder);
}

Comparison compare_planted(const Planted& planted, const test::TemporaryFolder& out) {
  Rendering before, after;
  before.capture = after.capture = scene::read_capture(test::shipped_capture(planted.capture));
  planted.plant(after);
  write_run(before, out / "a");
  write_run(after, out / "b");
  return compare_runs({out / "a", out / "b"});
}

const std::vector<Planted>& planted_causes() {
  const auto key = [](const char* text) { return [text](Rendering& s) { s.set(text); }; };
  static const std::vector<Planted> kCauses = {
      // Settings and machines.
      {"eggs", key("shader.lanes=16"), "shader.lanes 32 -> 16"},
      {"eggs", key("memory.channels=1"), "memory.channels 4 -> 1"},
      {"eggs", key("clock.mhz=400"), "clock.mhz"},
      {"eggs", key("tilecore.count=2"), "tilecore.count 4 -> 2"},
      {"eggs", key("sampling.samples_per_pixel=8"), "sampling.samples_per_pixel 4 -> 8"},
      {"eggs", key("tessellation.target_edge_pixels=1"), "tessellation.target_edge_pixels"},
      {"eggs", key("tile.width=64"), "tile.width 32 -> 64"},
      {"eggs", key("l2.bytes=32768"), "l2.bytes"},
      {"eggs", key("effects.motion=off"), "effects.motion auto -> off"},
      // Changes of the drawn image and scene.
      {"eggs", [](Rendering& s) { s.resize(320, 180); }, "size of the image: 160x90 -> 320x180"},
      {"eggs", [](Rendering& s) { node_of(s.capture, "ground").mesh = scene::kNone; }, "ground / cobbles is not drawn"},
      {"vases", [](Rendering& s) { s.capture.nodes[1].instances.assign(2, {}); }, "base patches"},
      // How it moves and is seen.
      {"eggs", [](Rendering& s) { s.capture.played_animations.clear(); }, "motion does not run"},
      {"eggs",
       [](Rendering& s) {
         for (scene::Camera& camera : s.capture.cameras) camera.lens.aperture_radius = 0;
       },
       "defocus does not run"},
      {"eggs",
       [](Rendering& s) {
         for (scene::Camera& camera : s.capture.cameras) camera.vertical_fov *= 1.6f;
       },
       "surfaces cover"},
      // Materials and lights.
      {"eggs",
       [](Rendering& s) {
         for (scene::Material& material : s.capture.materials) material.displacement.reset();
       },
       "displacement does not run"},
      {"eggs",
       [](Rendering& s) {
         for (scene::Material& material : s.capture.materials) {
           material.clearcoat.factor = 1;
           material.effects = scene::effects_in_force(material);
         }
       },
       "clearcoat runs"},
      {"eggs",
       [](Rendering& s) {
         for (scene::Material& material : s.capture.materials) {
           material.alpha_mode = scene::AlphaMode::kBlend;
           material.base_color.a = 0.5f;
         }
       },
       "blending runs"},
      {"city_evening", [](Rendering& s) { s.capture.settings.shadows.clear(); }, "shadows does not run"},
      {"serpent", [](Rendering& s) { s.capture.settings.shutter_close = s.capture.settings.shutter_open; },
       "motion does not run"},
  };
  return kCauses;
}

// WHY1. The goal is 18 of 20.
TEST(Causes, PlantedOnesAreNamedFirst) {
  ASSERT_EQ(planted_causes().size(), 20u);
  int named = 0;
  for (const Planted& planted : planted_causes()) {
    const test::TemporaryFolder out;
    const Cause why = causes_of(compare_planted(planted, out), 1);
    ASSERT_EQ(why.parts[0].text, "what changed");
    const std::string first = why.parts[0].parts[0].text;
    if (first.find(planted.named) != std::string::npos)
      ++named;
    else
      ADD_FAILURE() << planted.capture << ": " << planted.named << " is named as\n" << cause_text(why);
  }
  EXPECT_GE(named, 18);
}

// "+12.3 k" of a line's end.
double cycles_at_end(const std::string& line) {
  static const std::regex kCount(R"(([+-][0-9.]+)( [kM])?$)");
  std::smatch found;
  if (!std::regex_search(line, found, kCount)) return 0;
  const std::string scale = found[2];
  return std::stod(found[1]) * (scale == " k" ? 1e3 : scale == " M" ? 1e6 : 1);
}

// WHY2, as far as the digits that are printed say.
TEST(Causes, CyclesOfALevelAddUpToTheDifference) {
  for (const std::size_t index : {std::size_t{0}, std::size_t{9}, std::size_t{14}}) {
    const test::TemporaryFolder out;
    const Comparison comparison = compare_planted(planted_causes()[index], out);
    const double difference = comparison.figures[1].value(Section::kSummary, kCyclesRow).value() -
                              comparison.figures[0].value(Section::kSummary, kCyclesRow).value();
    std::size_t levels = 0;
    for (const Cause& level : causes_of(comparison, 1).parts) {
      if (!level.text.starts_with("cycles by drawable") && !level.text.starts_with("cycles by unit")) continue;
      ++levels;
      double sum = 0, most = 0;
      for (const Cause& part : level.parts) {
        sum += cycles_at_end(part.text);
        most = std::max(most, std::abs(cycles_at_end(part.text)));
      }
      EXPECT_NEAR(sum, difference, 3 + 0.01 * std::max(most, std::abs(difference))) << level.text;
    }
    EXPECT_EQ(levels, 2u);
  }
}

TEST(Causes, EqualRunsHaveNone) {
  const test::TemporaryFolder out;
  const Cause why = causes_of(compare_planted({"eggs", [](Rendering&) {}, ""}, out), 1);
  EXPECT_THAT(why.text, HasSubstr("B takes as long as A"));
  ASSERT_EQ(why.parts[0].parts.size(), 1u);
  EXPECT_THAT(why.parts[0].parts[0].text, HasSubstr("nothing"));
}

// The failing twin: a counter that grew does not stand before a part that is new.
TEST(Causes, NewPartsStandBeforeGrownCounters) {
  const test::TemporaryFolder out;
  const Planted both = {"eggs",
                        [](Rendering& s) {
                          for (scene::Camera& camera : s.capture.cameras) camera.vertical_fov *= 1.6f;
                          s.capture.settings.shutter_close = s.capture.settings.shutter_open;
                        },
                        ""};
  const Cause why = causes_of(compare_planted(both, out), 1);
  ASSERT_GE(why.parts[0].parts.size(), 2u);
  EXPECT_THAT(why.parts[0].parts[0].text, HasSubstr("motion does not run"));
}

// For two captures the report names the figures that tell them apart, then the places of cycles and bytes, as for two
// runs of one capture.
TEST(Causes, TwoCapturesAreToldApartByTheirFigures) {
  const test::TemporaryFolder out;
  Rendering vases, garden;
  vases.capture = scene::read_capture(test::shipped_capture("vases"));
  garden.capture = scene::read_capture(test::shipped_capture("garden_lamps"));
  garden.resize(96, 54);
  write_run(vases, out / "a");
  write_run(garden, out / "b");
  const Cause why = causes_of(compare_runs({out / "a", out / "b"}), 1);
  const std::string text = cause_text(why);
  const json a = json::parse(test::read_text(out / "a" / "stats.json")),
             b = json::parse(test::read_text(out / "b" / "stats.json"));
  ASSERT_EQ(why.parts[0].text, "what changed");
  EXPECT_EQ(why.parts[0].parts[0].text, "another capture: vases.glb -> garden_lamps.glb");
  EXPECT_EQ(why.parts[0].parts[1].text, "size of the image: 160x90 -> 96x54");
  for (const auto& [what, counter] :
       {std::pair("base patches", "frontend.base_patches"), std::pair("sub-patches", "frontend.sub_patches"),
        std::pair("triangles", "tilecore.triangles"),
        std::pair("pixel-shader invocations", "tilecore.pixel_shader_invocations")}) {
    const auto of = [&, name = counter](const json& stats) {
      return stats["frames"][0]["counters"][name].get<std::uint64_t>();
    };
    EXPECT_THAT(text, HasSubstr(fmt::format("    {}: {} -> {}\n", what, of(a), of(b))));
  }
  for (const char* count : {"lights", "textures"})
    EXPECT_THAT(text, HasSubstr(fmt::format("    {}: {} -> {}\n", count, a["capture"][count].get<int>(),
                                            b["capture"][count].get<int>())));
  EXPECT_EQ(b["capture"]["lights"], garden.capture.lights.size());
  EXPECT_THAT(text, HasSubstr(fmt::format("passes: 1 -> {}\n", b["frames"][0]["timing"]["passes"].size())));
  // Hits of shadow passes are no layers of the image.
  const auto main = [](const json& stats) {
    const json& passes = stats["frames"][0]["passes"];
    return passes.size() == 1 ? stats["frames"][0]["counters"] : passes.back()["counters"];
  };
  const auto layers = [&](const json& stats) {
    return main(stats)["tilecore.sample_hits"].get<double>() / main(stats)["tilecore.samples_visible"].get<double>();
  };
  EXPECT_THAT(text, HasSubstr(fmt::format("    layers of a sample that sees a surface: {:.2f} -> {:.2f}\n", layers(a),
                                          layers(b))));
  EXPECT_THAT(text, HasSubstr("effects that A does not run: "));
  EXPECT_THAT(text, HasSubstr("  cycles by unit, on the critical path\n"));
  EXPECT_THAT(text, HasSubstr("  bytes\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("is drawn"))) << "nothing of one is in the other";
}

TEST(Causes, TwoFramesOfAReplayAreCompared) {
  const test::TemporaryFolder out;
  ASSERT_EQ(test::run_tessera({"replay", test::shipped_capture("eggs").string(), "--size", "96x54", "--frames", "4:7",
                               "--no-report", "--quiet", "--out", out.path().string()})
                .status,
            0);
  const test::ProcessResult r =
      test::run_tessera({"compare", out.path().string(), "--frame", "4", "--frame", "6", "--json"});
  ASSERT_EQ(r.status, 0) << r.errors;
  const json report = json::parse(r.output), stats = json::parse(test::read_text(out / "stats.json"));
  EXPECT_EQ(report["summary"][1]["a"], stats["frames"][0]["timing"]["cycles"]);
  EXPECT_EQ(report["summary"][1]["b"], stats["frames"][2]["timing"]["cycles"]);
  EXPECT_EQ(report["why"]["b"]["parts"][0]["text"], "what changed");
  const auto refused = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "compare");
    return test::run_tessera(arguments).status;
  };
  EXPECT_EQ(refused({out.path().string()}), 2);
  EXPECT_EQ(refused({out.path().string(), "--frame", "4"}), 2);
  EXPECT_EQ(refused({out.path().string(), "--frame", "4", "--frame", "99"}), 3);
  EXPECT_EQ(refused({out.path().string(), out.path().string(), "--frame", "4", "--frame", "5", "--frame", "6"}), 2);
}

}  // namespace
}  // namespace tessera::replay::causes_test
