#include "gpu/counter_list.h"

#include <algorithm>
#include <array>

namespace tessera::gpu {
namespace {

constexpr auto kFormerCounters = std::to_array<FormerCounter>({
    {"baseline.compulsory_evaluations", ""},
    {"binner.group_entries", ""},
    {"binner.interval_codes", ""},
    {"binner.spilled_chunks", ""},
    {"binner.table_bytes_read", ""},
    {"binner.table_bytes_written", ""},
    {"binner.tiles_dropped_exact", "binner.tiles_dropped"},
    {"binner.tiles_dropped_time", "binner.tiles_dropped"},
    {"frontend.cells_culled_previous_depth", ""},
    {"frontend.culled_previous_depth", ""},
    {"frontend.estimated_boxes", ""},
    {"frontend.estimated_entries", ""},
    {"frontend.estimated_list_bytes", ""},
    {"frontend.instance_groups_culled", ""},
    {"frontend.instances_culled_previous_depth", "frontend.groups_culled_previous_depth"},
    {"frontend.patch_groups_culled", ""},
    {"frontend.revived_previous_depth", "frontend.second_pass_visible"},
    {"resolve.advections_outside", ""},
    {"resolve.advections_unusable", ""},
    {"resolve.blocks_blurred", ""},
    {"resolve.blocks_creased", ""},
    {"resolve.blocks_deferred", "dram.resolve.neighbours.read_bytes"},
    {"resolve.blocks_distrusted", "resolve.history_rejected"},
    {"resolve.blocks_empty", ""},
    {"resolve.blocks_patterned", ""},
    {"resolve.blocks_rate_12", ""},
    {"resolve.blocks_signed", "resolve.history_signatures_written / 16"},
    {"resolve.bytes_not_written", ""},
    {"resolve.frame_blocks", ""},
    {"resolve.frame_blocks_raw", ""},
    {"resolve.frame_bytes_compressed", "dram.resolve.frame_buffer.written_bytes"},
    {"resolve.frame_bytes_raw", ""},
    {"resolve.half_pixels_reconstructed", ""},
    {"resolve.pixels_forced", ""},
    {"resolve.pixels_on_borders", ""},
    {"resolve.pixels_shaded_again", ""},
    {"resolve.velocity_evaluations", "resolve.velocity_operations"},
    {"sampling.array_slots", "procedures.array_slots"},
    {"sampling.cells", "procedures.cells"},
    {"sampling.cells_culled_backface", ""},
    {"sampling.cells_culled_occlusion", ""},
    {"sampling.cells_outside", ""},
    {"sampling.footprint_tests", "procedures.footprint_tests"},
    {"sampling.holes_refilled", ""},
    {"sampling.holes_suspected", ""},
    {"sampling.image_misses", ""},
    {"sampling.image_requests", ""},
    {"sampling.interval_evaluations", "procedures.interval_evaluations"},
    {"sampling.layers", ""},
    {"sampling.layers_merged", "procedures.layers_merged"},
    {"sampling.map_entries", "procedures.map_entries"},
    {"sampling.objects", ""},
    {"sampling.operations", "procedures.operations"},
    {"sampling.rates_clamped", "procedures.rates_clamped"},
    {"sampling.samples", "procedures.samples"},
    {"sampling.samples_backfacing", "procedures.samples_backfacing"},
    {"sampling.samples_behind", "procedures.samples_behind"},
    {"sampling.samples_handed", ""},
    {"sampling.samples_lost", ""},
    {"sampling.samples_not_finite", "procedures.samples_not_finite"},
    {"sampling.samples_of_ranges", ""},
    {"sampling.samples_outside_tile", "procedures.samples_outside_tile"},
    {"sampling.sparse_evaluations", "procedures.sparse_evaluations"},
    {"sampling.sparse_operations", "procedures.sparse_operations"},
    {"sampling.steps_tested", ""},
    {"sampling.strokes", "procedures.strokes"},
    {"sampling.tags", "procedures.tags"},
    {"sampling.writes", "procedures.writes"},
    {"tilecore.nodes_built", ""},
    {"tilecore.shading_cache_hits", ""},
    {"tilecore.shading_cache_misses", ""},
    {"tilecore.tessellation_cache_hits", "tilecore.tessellation_requests - tilecore.tessellated_sub_patches"},
});
static_assert(std::ranges::is_sorted(kFormerCounters, {}, &FormerCounter::name));

}  // namespace

std::span<const FormerCounter> former_counters() { return kFormerCounters; }

std::vector<CounterInfo> counter_infos() {
  std::vector<CounterInfo> infos;
  const FrameCounters counters;
  for_each_counter_struct(counters, counters, [&](const auto& unit, const auto&) {
    append_counter_infos<std::decay_t<decltype(unit)>>(infos);
  });
  infos.push_back({"dram.read_bytes", "bytes", Combine::kSum,
                   "Bytes read over the external memory interface, in whole bursts: the sum of the ledger.",
                   "MaliExtBusRdBy; V3D AXI-read-bytes-seen; Adreno Read Total; Apple GPU read bandwidth"});
  infos.push_back({"dram.written_bytes", "bytes", Combine::kSum,
                   "Bytes written over the external memory interface, in whole bursts: the sum of the ledger.",
                   "MaliExtBusWrBy; V3D AXI-write-bytes-seen; Adreno Write Total; Apple GPU write bandwidth"});
  return infos;
}

std::map<std::string_view, std::uint64_t> counter_values(const FrameCounters& counters) {
  std::map<std::string_view, std::uint64_t> values;
  for_each_counter_struct(counters, counters, [&](const auto& unit, const auto&) {
    if (absent(unit)) return;
    for (const auto& field : kCounterFields<std::decay_t<decltype(unit)>>) values[field.name] = unit.*field.member;
  });
  const memory::Traffic total = counters.ledger.total();
  values["dram.read_bytes"] = total.read_bytes;
  values["dram.written_bytes"] = total.written_bytes;
  return values;
}

std::vector<TrafficRow> traffic_rows(const memory::Ledger& ledger) {
  std::vector<TrafficRow> rows;
  for (std::size_t u = 0; u < memory::kUnitCount; ++u)
    for (std::size_t p = 0; p < memory::kPurposeCount; ++p) {
      const auto unit = static_cast<memory::Unit>(u);
      const auto purpose = static_cast<memory::Purpose>(p);
      const memory::Traffic& traffic = ledger.traffic(unit, purpose);
      if (traffic.read_bytes != 0 || traffic.written_bytes != 0) rows.push_back({unit, purpose, traffic});
    }
  return rows;
}

std::map<std::string_view, double> busy_cycles(const timing::FrameTiming& timing) {
  std::map<std::string_view, double> cycles;
  for (std::size_t s = 0; s < timing::kStageCount; ++s) cycles[name(static_cast<timing::Stage>(s))] = timing.busy[s];
  cycles["tilecores"] = timing.cores_busy;
  return cycles;
}

}  // namespace tessera::gpu
