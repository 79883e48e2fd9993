#include "gpu/configuration.h"
#include "base/error.h"
#include "base/former_keys.h"
#include "gpu/presets.h"
#include "gpu/settings.h"
#include "gpu/tile_memory.h"
#include "gpu/unread_keys.h"
#include "hardware/tile_rules.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::gpu::configuration_test {

namespace {

TEST(Configuration, EveryPresetIsConsistentAndNamesItself) {
  for (const std::string& name : preset_names()) {
    const GpuConfiguration gpu = load_gpu(name);
    EXPECT_EQ(gpu.preset, name);
    EXPECT_NO_THROW(check_gpu(gpu));
  }
  EXPECT_THROW(load_gpu("enormous"), UsageError);
}

TEST(Configuration, PresetsHaveTheirFormerNames) {
  EXPECT_EQ(gpu_json(load_gpu("small")), gpu_json(load_gpu("entry-mobile")));
  EXPECT_EQ(gpu_json(load_gpu("middle")), gpu_json(GpuConfiguration()));
  EXPECT_EQ(load_gpu("large").preset, "high-mobile");
}

// Every number of a preset has a source, and nothing else has.
TEST(Configuration, EveryNumberOfAPresetHasASource) {
  EXPECT_GE(presets().size(), 4u);
  for (const Preset& preset : presets()) {
    EXPECT_GT(preset.description.size(), 20u) << preset.name;
    std::size_t values = 0;
    for (const auto& [unit, keys] : preset.values.items())
      for (const auto& [key, value] : keys.items()) {
        ++values;
        const std::string source = preset.sources.value(unit + "." + key, "");
        EXPECT_TRUE(source.starts_with("[spec] ") || source.starts_with("[assumed]"))
            << preset.name << " " << unit << "." << key;
      }
    EXPECT_EQ(values, preset.sources.size()) << preset.name;
  }
}

TEST(Configuration, AFileHasANameADescriptionAndSources) {
  const GpuConfiguration gpu = parse_gpu(
      R"({"name": "mine", "description": "a test", "sources": {"clock.mhz": "a guess"}, "clock": {"mhz": 400}})", "x");
  EXPECT_EQ(gpu.name, "mine");
  EXPECT_EQ(gpu_json(gpu)["description"], "a test");
  EXPECT_EQ(gpu.clock_mhz, 400);
  EXPECT_THROW(parse_gpu(R"({"name": 3})", "x"), InputError);
  EXPECT_THROW(parse_gpu(R"({"sources": 3})", "x"), InputError);
}

TEST(Configuration, AFileChangesItsKeysAndKeepsItsPreset) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "gpu.json",
                   R"({"preset": "small", "tile": {"width": 24}, "parameter_buffer": {"full_policy": "spill"}})");
  const GpuConfiguration gpu = load_gpu((folder / "gpu.json").string());
  EXPECT_EQ(gpu.tile.width, 24);
  EXPECT_EQ(gpu.tile.height, load_gpu("small").tile.height);
  EXPECT_EQ(gpu.parameter_buffer.full_policy, binner::FullPolicy::kSpill);
}

TEST(Configuration, TheMachineOfAReplayReadsBackAsTheSame) {
  const test::TemporaryFolder folder;
  GpuConfiguration gpu = load_gpu("large");
  gpu.tile.width = 40;
  test::write_text(folder / "gpu.json", gpu_json(gpu).dump());
  EXPECT_EQ(gpu_json(load_gpu((folder / "gpu.json").string())), gpu_json(gpu));
}

TEST(Configuration, FaultsInAFileNameTheNearestKey) {
  const test::TemporaryFolder folder;
  const auto fault_of = [&](const std::string& text) {
    test::write_text(folder / "gpu.json", text);
    try {
      load_gpu((folder / "gpu.json").string());
    } catch (const InputError& error) {
      return error.fault();
    }
    return std::string("none");
  };
  EXPECT_EQ(fault_of(R"({"tile": {"widht": 8}})"), "unknown key 'tile.widht'; did you mean 'tile.width'?");
  EXPECT_EQ(fault_of(R"({"tile": {"width": "wide"}})"),
            "tile.width: 'wide' is not a whole number from 8 to 256 pixels");
  EXPECT_EQ(fault_of(R"([1])"), "a GPU configuration is a JSON object");
  EXPECT_NE(fault_of(R"({"preset": "nosuch"})"), "none");
  EXPECT_NE(fault_of(R"({"preset": 3})"), "none");
  EXPECT_NE(fault_of("{"), "none");
}

TEST(Configuration, FaultsInAFileNameTheirPlace) {
  const auto place_of = [](const std::string& text) {
    try {
      parse_gpu(text, "gpu.json");
    } catch (const InputError& error) {
      return error.place();
    }
    return std::string("none");
  };
  EXPECT_EQ(place_of(R"({"tile": {"width": "wide"}})"), "/tile/width");
  EXPECT_EQ(place_of(R"({"tile": {"widht": 8}})"), "/tile/widht");
  EXPECT_EQ(place_of(R"({"tile.width": 7})"), "/tile.width");
  EXPECT_EQ(place_of(R"({"preset": 3})"), "/preset");
  EXPECT_EQ(place_of(R"({"tile": {"width": 8, "height": 8, "width": 16}})"), "/tile/width");
  EXPECT_EQ(place_of(R"({"tile": {"width": 8}, "memory": {}, "tile": {"height": 8}})"), "/tile");
  EXPECT_EQ(place_of(R"({"tile": {"width": 8}, "parameter_buffer": {"bytes": 65536}})"), "none");
}

TEST(Configuration, NumbersThatDoNotFitEachOtherAreRefused) {
  GpuConfiguration gpu;
  gpu.tile.width = 20;
  EXPECT_THROW(check_gpu(gpu), UsageError);
  gpu = {};
  gpu.memory.burst_bytes = 48;
  EXPECT_THROW(check_gpu(gpu), UsageError);
  gpu = {};
  gpu.parameter_buffer.chunk_bytes = 96;
  EXPECT_THROW(check_gpu(gpu), UsageError);
  gpu = {};
  gpu.memory.channels = 3;
  EXPECT_THROW(check_gpu(gpu), UsageError);
}

// The memory in clocks of the GPU: of the clock at that moment, in a file of the file's, wherever it stands.
TEST(Configuration, TheMemoryMayBeGivenInClocksOfTheGpu) {
  GpuConfiguration gpu;
  EXPECT_TRUE(set_gpu_key("memory.bytes_per_clk", "20", gpu));
  EXPECT_DOUBLE_EQ(gpu.memory.gb_per_s, 17);
  EXPECT_TRUE(set_gpu_key("clock.mhz", "425", gpu));
  EXPECT_DOUBLE_EQ(gpu.memory.gb_per_s, 17) << "another clock leaves it";
  EXPECT_TRUE(set_gpu_key("memory.bytes_per_clk", 20, gpu));
  EXPECT_DOUBLE_EQ(gpu.memory.gb_per_s, 8.5);
  EXPECT_TRUE(set_gpu_key("memory.latency_clk", 85, gpu));
  EXPECT_DOUBLE_EQ(gpu.memory.latency_ns, 200);
  EXPECT_THROW(set_gpu_key("memory.bytes_per_clk", 0, gpu), UsageError);
  EXPECT_FALSE(set_gpu_key("memory.bytes", 1, gpu));
  const GpuConfiguration file = parse_gpu(R"({"memory": {"bytes_per_clk": 20}, "clock": {"mhz": 425}})", "x");
  EXPECT_DOUBLE_EQ(file.memory.gb_per_s, 8.5);
}

TEST(Configuration, ARemovedKeyNamesItsReplacement) {
  try {
    parse_gpu(R"({"energy": {"leakage_mw": 60}})", "x");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(error.fault().find("energy.leakage_mw_per_mm2"), std::string::npos);
    EXPECT_EQ(error.place(), "/energy/leakage_mw");
  }
}

TEST(Configuration, AFormerKeySetsItsSuccessor) {
  for (const FormerKey& former : former_keys()) {
    SCOPED_TRACE(former.name);
    const std::string name(former.name);
    GpuConfiguration gpu;
    RunSettings settings;
    const auto known = [&](const std::string& key) {
      return std::ranges::find(known_keys(), key) != known_keys().end();
    };
    EXPECT_FALSE(known(name));
    if (former.now.empty()) {
      EXPECT_FALSE(former.reason.empty());
      try {
        const std::size_t equals = name.find('=');  // a word of a key
        apply_setting(equals == std::string::npos ? name + "=1" : name, settings, gpu);
        ADD_FAILURE();
      } catch (const UsageError& error) {
        EXPECT_NE(std::string(error.what()).find(former.reason), std::string::npos) << error.what();
      }
    } else {
      ASSERT_TRUE(known(std::string(former.now)));
      EXPECT_EQ(current_key(name), former.now);
      const auto value = [&] {
        const auto* key = gpu_keys().find(former.now);
        return key != nullptr ? gpu_keys().value(gpu, *key)
                              : settings_keys().value(settings, *settings_keys().find(former.now));
      };
      set_key(name, key_value_json(value()), settings, gpu);
      EXPECT_EQ(gpu.key_notes, std::vector{former_key_note(former)});
    }
  }
}

// Presets that say so have the tiles of their vendors' rules, for four samples.
TEST(Configuration, TilesOfPresetsFollowTheRulesOfTheirVendors) {
  constexpr std::array kHalf = {8},
                       kBytes = {4};  // rgba16f, as frame_buffer.format; rgba8, which V3D's rule is quoted for
  const auto tile = [](const char* preset) {
    const GpuConfiguration gpu = load_gpu(preset);
    return hardware::TilePixels{gpu.tile.width, gpu.tile.height};
  };
  EXPECT_EQ(tile("entry-mobile"), hardware::mali_tile("G31", {kHalf, 4}));
  EXPECT_EQ(tile("high-mobile"), hardware::mali_tile("G720", {kHalf, 4}));
  EXPECT_EQ(tile("v3d"), hardware::v3d_tile(4, {kBytes, 4}));
}

// Keys that a model does not read: refused where they are set by name, noted where a file has them.
TEST(Configuration, KeysThatTheChosenModelsDoNotReadAreRefused) {
  struct Case {
    const char *key, *unread, *read;
  };
  const std::string finest =
      "machine.timing=events memory.model=banks shader.costs=compiled tessellator.domain_shading=lanes";
  const auto checked = [](const std::string& models, const std::string& setting) -> std::string {
    auto gpu = test::coarse_machine<GpuConfiguration>();
    RunSettings settings;
    std::istringstream words(models);
    try {
      for (std::string word; words >> word;) apply_setting(word, settings, gpu);
      apply_setting(setting, settings, gpu);
      check_gpu(gpu);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  for (const Case& c : {Case{"memory.gb_per_s=20", "machine.timing=events memory.model=banks", "machine.timing=events"},
                        Case{"memory.bytes_per_clk=20", "machine.timing=events memory.model=banks", ""},
                        Case{"memory.type=lpddr4-3200", "", "machine.timing=events memory.model=banks"},
                        Case{"memory.channels=2", "machine.timing=events", "machine.timing=events memory.model=banks"},
                        Case{"shader.costs=compiled", "", "machine.timing=events"},
                        Case{"l2.latency_clk=50", "", "machine.timing=events"},
                        Case{"shader.operations=200", "machine.timing=events shader.costs=compiled", ""},
                        Case{"energy.vertex_pj=9", "tessellator.domain_shading=lanes", ""}}) {
    const std::string key = std::string(c.key).substr(0, std::string(c.key).find('='));
    EXPECT_EQ(checked(c.unread, c.key).substr(0, key.size() + 2), key + ": ") << c.key;
    EXPECT_NE(checked(c.unread, c.key).find("set "), std::string::npos) << "the message names the key to set instead";
    EXPECT_EQ(checked(c.read, c.key), "") << c.key;
  }
  EXPECT_EQ(checked(finest, "shader.lanes=16"), "");
  const GpuConfiguration file =
      parse_gpu(R"({"memory": {"model": "fluid", "type": "lpddr4-3200", "gb_per_s": 34.085}})", "file");
  EXPECT_NO_THROW(check_gpu(file));
  ASSERT_EQ(configuration_notes(file).size(), 1u) << "of the key that differs from the preset's";
  EXPECT_TRUE(configuration_notes(file)[0].starts_with("memory.type: "));
}

TEST(Configuration, AClockBeyondTheProcessIsRefused) {
  GpuConfiguration gpu;
  gpu.clock_mhz = 1200;
  EXPECT_NO_THROW(check_gpu(gpu));
  gpu.clock_mhz = 1300;
  EXPECT_THROW(check_gpu(gpu), UsageError);
  gpu.nominal_mhz = 1300;
  EXPECT_NO_THROW(check_gpu(gpu));
}

TEST(Configuration, RegistersForLessThanAWarpAreRefused) {
  auto gpu = test::coarse_machine<GpuConfiguration>();
  gpu.queues.registers = 1024;
  EXPECT_NO_THROW(check_gpu(gpu)) << "one warp of 32 fills the 128 KiB";
  gpu.shader.warp_lanes = 64;
  EXPECT_THROW(check_gpu(gpu), UsageError);
  gpu.queues.register_bytes *= 2;
  EXPECT_NO_THROW(check_gpu(gpu));
}

// A preset runs with any number of samples, on the memory that it then needs; a size of one's own is held to.
TEST(Configuration, TileMemoryHoldsTheSamplesOfATile) {
  for (const std::string& name : preset_names()) {
    GpuConfiguration gpu = load_gpu(name);
    RunSettings settings;
    EXPECT_EQ(fit_tile_memory(gpu, settings, false), "") << name;
    EXPECT_EQ(fit_tile_memory(gpu, settings, true), "") << name;
    EXPECT_EQ(gpu.cores.memory_bytes, load_gpu(name).cores.memory_bytes);
    const double before = gpu.area().total_mm2();
    settings.sampling.samples_per_pixel = 32;
    EXPECT_EQ(tile_sample_bytes(gpu, settings), static_cast<std::uint64_t>(gpu.tile.width * gpu.tile.height * 32 * 12));
    EXPECT_THROW(check_tile_memory(gpu, settings), UsageError) << name;
    EXPECT_NE(fit_tile_memory(gpu, settings, false), "") << name;
    EXPECT_NO_THROW(check_tile_memory(gpu, settings)) << name;
    EXPECT_GT(gpu.area().total_mm2(), before) << name;
  }
}

TEST(Configuration, AreaGrowsFromPresetToPreset) {
  const double entry = load_gpu("entry-mobile").area().total_mm2(), mid = load_gpu("mid-mobile").area().total_mm2(),
               high = load_gpu("high-mobile").area().total_mm2();
  EXPECT_GT(entry, 0.5);
  EXPECT_GT(mid, 3 * entry);
  EXPECT_GT(high, 4 * mid);
  EXPECT_LT(high, 60);
  GpuConfiguration more;
  more.tessellator.cache_bytes *= 2;
  EXPECT_GT(more.area().total_mm2(), mid);
}

TEST(Configuration, EveryKeySaysWhereItsNumberComesFrom) {
  for (const auto& key : gpu_keys().keys()) {
    const bool marked = key.source.find("[spec]") != std::string_view::npos ||
                        key.source.find("[assumed]") != std::string_view::npos ||
                        key.source.find("[measured]") != std::string_view::npos;
    EXPECT_TRUE(marked) << key.name;
  }
}

}  // namespace
}  // namespace tessera::gpu::configuration_test
