#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "gpu/configuration.h"
#include "gpu/presets.h"
#include "tests/support/captures.h"
#include "tests/support/temporary_folder.h"

namespace tessera::gpu {

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

TEST(Configuration, AFileChangesWhatItNamesAndKeepsItsPreset) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "gpu.json",
                   R"({"preset": "small", "tile": {"width": 24}, "parameter_buffer": {"full_policy": "spill"}})");
  const GpuConfiguration gpu = load_gpu((folder / "gpu.json").string());
  EXPECT_EQ(gpu.tile.width, 24);
  EXPECT_EQ(gpu.tile.height, load_gpu("small").tile.height);
  EXPECT_EQ(gpu.parameter_buffer.full_policy, binner::FullPolicy::kSpill);
}

TEST(Configuration, WhatAReplayWritesReadsBackAsTheSameMachine) {
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
}  // namespace tessera::gpu
