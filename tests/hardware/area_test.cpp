// Silicon of a machine.
#include "hardware/area.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::hardware::area_test {
namespace {

const OtherParts kOthers = {256 << 10, 16 << 10, true, true};

TEST(Area, UnitsAddUpAndUnitsOfCoresAreProportionalToThem) {  // AREA1
  Machine gpu = test::coarse_machine();
  const Area one = machine_area(gpu, kOthers);
  double sum = 0;
  for (const auto& [unit, mm2] : one.by_unit_mm2) sum += mm2;
  EXPECT_EQ(sum, one.total_mm2());
  gpu.cores.count *= 3;
  const Area three = machine_area(gpu, kOthers);
  for (const auto& [unit, mm2] : one.by_unit_mm2) {
    const bool shared = unit == "frontend" || unit == "binner" || unit == "l2";
    if (unit != "other_memories") {
      EXPECT_DOUBLE_EQ(three.by_unit_mm2.at(unit), shared ? mm2 : 3 * mm2) << unit;
    }
  }
  EXPECT_DOUBLE_EQ(three.by_unit_mm2.at("other_memories"), gpu.silicon.sram_mm2_per_kib * (256 + 12 * 16));
}

TEST(Area, EqualsItsPartsByHand) {  // AREA1
  Machine gpu = test::coarse_machine();
  gpu.cores.count = 1;
  const Area area = machine_area(gpu, {});
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("frontend"), 0.25);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("binner"), 0.1);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("lanes"), 64 * 0.008);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("registers"), 128 * 0.001);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("tile_memory"), 192 * 0.0005);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("l2"), 256 * 0.0005);
  EXPECT_DOUBLE_EQ(area.by_unit_mm2.at("other_memories"), 0);
}

// Who hashes nothing has no unit for it; vertices that lanes shade have none of their own.
TEST(Area, UnitsThatAMachineLacksTakeNone) {
  Machine gpu = test::coarse_machine();
  gpu.cores.count = 1;
  const auto more = [&](const OtherParts& parts, const char* unit) {
    return machine_area(gpu, parts).by_unit_mm2.at(unit) - machine_area(gpu, {}).by_unit_mm2.at(unit);
  };
  EXPECT_NEAR(more({0, 0, true, false}, "binner"), 32 * 0.0001, 1e-12);
  EXPECT_EQ(more({0, 0, true, false}, "fixed_units"), 0);
  EXPECT_NEAR(more({0, 0, false, true}, "fixed_units"), 32 * 0.0001, 1e-12);
  gpu.rates[Event::kVertices] = 2;
  const double unit = machine_area(gpu, {}).total_mm2();
  gpu.shader.domain = DomainShading::kLanes;
  EXPECT_NEAR(unit - machine_area(gpu, {}).total_mm2(), 0.12, 1e-12) << "transforms are as large as one vertex";
}

// Every rate and every memory of the GPU costs area; energies, external memory and the clock do not.
TEST(Area, MoreOfAnyRateOrMemoryIsNeverSmaller) {  // AREA2
  const std::vector<std::string> larger = {"tilecore.count",
                                           "tilecore.memory_bytes",
                                           "frontend.bounds_per_clk",
                                           "shader.lanes",
                                           "texture.texels_per_clk",
                                           "texture.cache_bytes",
                                           "l2.bytes",
                                           "resolve.pixels_per_clk",
                                           "resolve.signature_bytes_per_clk",
                                           "binner.signature_bytes_per_clk",
                                           "shader.register_bytes",
                                           "tilecore.blends_per_clk",
                                           "tilecore.box_tests_per_clk",
                                           "tilecore.triangle_tests_per_clk",
                                           "procedures.operations_per_clk"};
  std::size_t grown = 0;
  const Machine plain = test::coarse_machine();
  const double before = machine_area(plain, kOthers).total_mm2();
  for (const auto& key : machine_keys()) {
    const std::string name(key.name);
    const KeyValue value = key.get(plain);
    if (std::holds_alternative<std::string>(value) || name.starts_with("area.")) continue;
    Machine gpu = test::coarse_machine();
    if (const auto* whole = std::get_if<std::int64_t>(&value))
      key.set(gpu, *whole * 4);
    else
      key.set(gpu, std::get<double>(value) * 4);
    const double after = machine_area(gpu, kOthers).total_mm2();
    EXPECT_GE(after, before) << name;
    if (name.starts_with("energy.") || name.starts_with("memory.") || name == "clock.mhz") {
      EXPECT_EQ(after, before) << name << " is no silicon of the GPU";
    }
    if (std::find(larger.begin(), larger.end(), name) == larger.end()) continue;
    ++grown;
    EXPECT_GT(after, before) << name;
  }
  EXPECT_EQ(grown, larger.size());
}

}  // namespace
}  // namespace tessera::hardware::area_test
