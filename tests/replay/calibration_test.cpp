// Every number of every preset has a row on the page of calibration: value, range, source, date.
#include "replay/calibration.h"
#include "gpu/configuration.h"
#include "gpu/presets.h"
#include "tests/support/tests.h"

namespace tessera::replay::calibration_test {
namespace {

const json* row_of(const json& rows, const std::string& key, const std::string& preset) {
  const auto found = std::find_if(rows.begin(), rows.end(),
                                  [&](const json& row) { return row["key"] == key && row["preset"] == preset; });
  return found == rows.end() ? nullptr : &*found;
}

TEST(Calibration, HasARowForEachNumberOfEachPreset) {
  const json rows = calibration_rows();
  std::size_t expected = 0;
  for (const gpu::Preset& preset : gpu::presets()) {
    const gpu::GpuConfiguration machine = gpu::load_gpu(preset.name), usual;
    for (const auto& key : gpu::gpu_keys().keys()) {
      const KeyValue value = key.get(machine);
      if (value.index() > 1) continue;
      const std::string name(key.name);
      const json* row = row_of(rows, name, preset.name);
      // Another value than the default's has a row of its own.
      if (preset.name != "mid-mobile" && !row) {
        EXPECT_EQ(value, key.get(usual)) << preset.name << " " << name;
        continue;
      }
      ASSERT_NE(row, nullptr) << preset.name << " " << name;
      ++expected;
      EXPECT_EQ((*row)["value"], std::visit([](const auto& v) { return json(v); }, value))
          << preset.name << " " << name;
      EXPECT_EQ((*row)["source"], preset.sources.value(name, std::string(key.source))) << preset.name << " " << name;
    }
  }
  EXPECT_EQ(rows.size(), expected);
  EXPECT_GT(expected, 150u);
}

TEST(Calibration, EveryRowHasADateAndRangesHoldTheirValues) {
  for (const json& row : calibration_rows()) {
    const auto date = row["date"].get<std::string>();
    EXPECT_TRUE(!date.empty() && date >= "1980" && date.substr(date.size() - 4) <= std::to_string(kYearRead))
        << row["key"] << ": " << date;
    const auto source = row["source"].get<std::string>();
    if (row["preset"] == "mid-mobile" && source.find("[assumed]") != std::string::npos) {
      ASSERT_TRUE(row.contains("low")) << row["key"];
    }
    if (!row.contains("low")) continue;
    EXPECT_LE(row["low"].get<double>(), row["value"].get<double>()) << row["key"];
    EXPECT_GE(row["high"].get<double>(), row["value"].get<double>()) << row["key"];
  }
}

TEST(Calibration, DatesBelongToTheNamedSources) {
  EXPECT_EQ(source_years("[spec] Munkberg et al. 2010 for obb"), (std::set<int>{2010}));
  EXPECT_EQ(source_years("[spec] 1 on Mali-G31, 10 to 16 on Immortalis-G720"), (std::set<int>{2018, 2023}));
  EXPECT_EQ(source_years("[spec] US 2007/0002066: an array of lanes; [assumed] 32"), (std::set<int>{2007, kYearRead}));
  EXPECT_EQ(source_years("[assumed] 2 MiB"), (std::set<int>{kYearRead}));
  EXPECT_EQ(source_years("[measured] docs/bounds_and_binning.md: 2400 frames"), (std::set<int>{kYearRead}));
  EXPECT_EQ(source_years("[spec] PowerVR's driver starts at 2 MiB"), (std::set<int>{kYearRead}));
}

// "as tile.width": the other number's date.
TEST(Calibration, ASourceThatRefersToAnotherKeyHasItsDate) {
  const json rows = calibration_rows();
  const json* height = row_of(rows, "tile.height", "entry-mobile");
  ASSERT_NE(height, nullptr);
  EXPECT_EQ((*height)["source"], "[spec] as tile.width");
  EXPECT_THAT((*height)["date"].get<std::string>(), HasSubstr("2018"));
}

}  // namespace
}  // namespace tessera::replay::calibration_test
