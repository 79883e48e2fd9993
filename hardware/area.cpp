#include "hardware/area.h"

#include <algorithm>

namespace tessera::hardware {

double Area::total_mm2() const {
  double sum = 0;
  for (const auto& [unit, mm2] : by_unit_mm2) sum += mm2;
  return sum;
}

Area machine_area(const Machine& gpu, const OtherParts& others) {
  const Throughputs& rates = gpu.rates;
  const AreaPrices& price = gpu.area;
  const auto cores = static_cast<double>(gpu.cores.count);
  const auto kib = [](std::int64_t bytes) { return static_cast<double>(bytes) / 1024; };

  Area area;
  std::map<std::string, double>& unit = area.by_unit_mm2;
  unit["frontend"] = price.bound_mm2 * rates.bounds_per_clk;
  // Entries are appended behind the tests of tiles; the default's four tiles go with one entry.
  unit["binner"] = price.binned_entry_mm2 * std::max(rates.binned_entries_per_clk, rates.binned_tiles_per_clk / 4);
  if (others.hashes_inputs) unit["binner"] += gpu.signatures.byte_mm2 * gpu.signatures.input_bytes_per_clk;
  // Boxes are built from vertices as they come; a stencil's or an alpha test's lane is an eighth of one that has edges.
  const double tests = rates.triangle_tests_per_clk + rates.box_tests_per_clk +
                       (rates.stencil_tests_per_clk + rates.alpha_tests_per_clk) / 8;
  // Vertices that lanes shade need no unit.
  const double vertices = gpu.shader.domain == DomainShading::kLanes
                              ? rates.transforms_per_clk / 3
                              : std::max(rates.vertices_per_clk, rates.transforms_per_clk / 3);
  const double pixels = rates.resolved_pixels_per_clk + rates.blends_per_clk + rates.resolve_operations_per_clk / 16;
  unit["fixed_units"] =
      cores * (price.core_mm2 + price.vertex_mm2 * vertices + price.test_mm2 * tests + price.pixel_mm2 * pixels +
               (others.hashes_colors ? gpu.signatures.byte_mm2 * gpu.signatures.color_bytes_per_clk : 0));
  unit["lanes"] = cores * price.lane_mm2 * (static_cast<double>(gpu.shader.lanes) + rates.sampling_operations_per_clk);
  unit["texture"] = cores * price.texel_mm2 * rates.texels_per_clk;
  unit["registers"] = cores * price.register_mm2_per_kib * kib(gpu.queues.register_bytes);
  unit["tile_memory"] = cores * price.sram_mm2_per_kib * kib(gpu.cores.memory_bytes);
  unit["texture_cache"] = cores * price.sram_mm2_per_kib * kib(gpu.caches.texture_bytes);
  unit["l2"] = price.sram_mm2_per_kib * kib(gpu.caches.l2_bytes);
  unit["other_memories"] = price.sram_mm2_per_kib * (kib(others.shared_bytes) + cores * kib(others.core_bytes));
  return area;
}

}  // namespace tessera::hardware
