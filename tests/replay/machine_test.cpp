// Cycles, energy and traffic of whole frames.
#include "base/round_up.h"
#include "hardware/external_memory.h"
#include "replay/machine_report.h"
#include "replay/selfcheck.h"
#include "replay/statistics.h"
#include "scene/capture_reader.h"
#include "tests/support/coarse_machine.h"
#include "tests/support/tests.h"

namespace tessera::replay::machine_test {
namespace {

using gpu::GpuConfiguration;
using memory::Purpose;
using memory::Unit;
using scene::Capture;
using timing::Stage;

struct Way {
  GpuConfiguration gpu;
  gpu::RunSettings settings;
  std::size_t threads = 0;
  int frame = 0;
};

gpu::FrameResult render(const Capture& capture, const Way& run, int width = 160, int height = 90) {
  const ThreadLimit threads(run.threads);
  const gpu::RenderRequest request{.width = width,
                                   .height = height,
                                   .region = {0, 0, width, height},
                                   .record_accesses = true,
                                   .keep_transactions = true};
  return gpu::Device(capture, run.gpu, run.settings, request).render(run.frame);
}

std::uint64_t bytes_of(const memory::Traffic& traffic) { return traffic.read_bytes + traffic.written_bytes; }

// Machines whose frames take other ways: buffers that run full, groups of tiles, two passes.
std::map<std::string, Way> ways() {
  std::map<std::string, Way> all;
  all["plain"] = {};
  all["small"].gpu = gpu::load_gpu("small");
  all["large"].gpu = gpu::load_gpu("large");
  all["partial renders"].gpu.parameter_buffer.bytes = 4096;
  all["spilling"].gpu.parameter_buffer.bytes = 4096;
  all["spilling"].gpu.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  all["shading cache"].settings.shading.rate = tilecore::ShadingRate::kCache;
  all["no L2"].gpu.caches.l2_bytes = 0;
  all["long bursts"].gpu.memory.burst_bytes = 256;
  all["rays"].gpu.tilecore.visibility.traversal = tilecore::Traversal::kRay;
  all["segments"].gpu.tilecore.visibility.method = tilecore::VisibilityMethod::kSegments;
  all["published procedures"].settings.procedures.mode = tilecore::ProcedureSettings::Mode::kPublished;
  all["half the pixels"].settings.resolve.desampling = tilecore::Desampling::kFixed8;
  all["stencils across tiles"].settings.resolve.desampling = tilecore::Desampling::kFixed8;
  all["stencils across tiles"].settings.resolve.reach = tilecore::StencilReach::kNeighbours;
  return all;
}

// Maps of shadows are small, as the frames are. Desampling, which is one of the ways, works on frames that passes of
// the capture do not copy; tests/gpu/frame_graph_test.cpp and bloom_test.cpp check the bytes, warps and pixels of
// such passes.
Capture shipped(const char* name) {
  Capture capture = scene::read_capture(test::shipped_capture(name));
  capture.settings.graph.reset();
  for (scene::ShadowRequest& shadow : capture.settings.shadows) shadow.size = 256;
  return capture;
}

class MachineOf : public testing::TestWithParam<const char*> {
 protected:
  Capture capture = shipped(GetParam());
  Way with(Way run) const {
    run.frame = capture.settings.first_frame;
    return run;
  }
};

// Everything that must not depend on the host.
std::string measurements(const gpu::FrameResult& r) {
  nlohmann::json all = {counters_json(r.counters), timing_json(r.model->timing), energy_json(r.model->energy)};
  for (const memory::Burst& burst : r.model->transactions) all.push_back({burst.cycle, burst.address, burst.write});
  return all.dump();
}

TEST_P(MachineOf, CyclesEnergyAndBurstsAreTheSameForAnyNumberOfThreads) {
  Way run = with({});
  run.threads = 1;
  const std::string expected = measurements(render(capture, run));
  for (const std::size_t threads : {2u, 7u}) {
    run.threads = threads;
    EXPECT_EQ(measurements(render(capture, run)), expected) << threads;
  }
}

// Every byte of the ledger is moved in one phase, and the requests to the banks are the bytes that the model counts.
void expect_bytes_in_one_phase_and_in_the_trace(const Way& way, const gpu::FrameResult& r) {
  const memory::Traffic total = r.counters.ledger.total();
  EXPECT_EQ(r.model->record.work.dram_bytes(), bytes_of(total));
  EXPECT_EQ(r.model->record.work.other_bytes, 0u);
  const std::uint64_t bytes = hardware::external_memory(way.gpu).transaction_bytes;
  std::uint64_t read = 0, written = 0, last = 0;
  for (const memory::Burst& b : r.model->transactions) {
    (b.write ? written : read) += bytes;
    EXPECT_EQ(b.address % bytes, 0u);
    EXPECT_LE(last, b.cycle);
    last = b.cycle;
  }
  const timing::MemoryCounts& memory = r.model->timing.events->memory;
  if (way.gpu.memory.burst_bytes == way.gpu.line_bytes()) {
    EXPECT_EQ(read, memory.read_bytes);
    EXPECT_EQ(written, memory.written_bytes);
  } else {  // the last line of a stream is a whole one
    EXPECT_GE(read, memory.read_bytes);
    EXPECT_GE(written, memory.written_bytes);
    EXPECT_LE(static_cast<double>(read + written),
              1.05 * static_cast<double>(memory.read_bytes + memory.written_bytes));
  }
  const double clocks_per_cycle = hardware::external_memory(way.gpu).clock_mhz() / way.gpu.clock_mhz;
  EXPECT_LE(static_cast<double>(last), r.model->schedule.cycles * clocks_per_cycle + 1);
}

void expect_events_of_tiles_add_up(const gpu::FrameResult& r) {
  using hardware::Event;
  timing::TileWork sum;
  timing::GeometryWork geometry;
  for (const timing::WorkRound& round : r.model->record.work.rounds) {
    geometry.events += round.geometry.events;
    for (const timing::TileWork& tile : round.tiles) sum.events += tile.events, sum.sub_patches += tile.sub_patches;
  }
  EXPECT_EQ(geometry.events[Event::kBinnedEntries], r.counters.binner.entries);
  const tilecore::SamplingCounters& sampling = r.counters.sampling;
  EXPECT_EQ(geometry.events[Event::kBounds], r.counters.frontend.bounds_computed + r.counters.groups.groups_tested +
                                                 r.counters.instances.groups_tested +
                                                 r.counters.instances.instances_tested + sampling.interval_evaluations);
  EXPECT_EQ(geometry.events[Event::kSamplingOperations], sampling.sparse_operations);
  EXPECT_EQ(sum.events[Event::kSamplingOperations], sampling.operations);
  EXPECT_EQ(sum.events[Event::kStencilTests], r.counters.stencil.tests);
  const tilecore::DesamplingCounters& desampling = r.counters.desampling;
  EXPECT_EQ(sum.events[Event::kResolveOperations], desampling.velocity_operations + desampling.pixels_advected +
                                                       desampling.stencil_taps + desampling.contrast_operations +
                                                       desampling.highlight_tests);
  EXPECT_EQ(sum.events[Event::kFetchedEntries], r.counters.tilecore.entries_fetched);
  EXPECT_EQ(sum.events[Event::kSortSteps], r.counters.tilecore.sort_steps);
  EXPECT_EQ(sum.sub_patches, r.counters.tessellation.requests);
  EXPECT_EQ(sum.events[Event::kVertices], r.counters.tessellation.domain_evaluations);
  EXPECT_EQ(sum.events[Event::kBoxes], r.counters.tilecore.boxes_built);
  EXPECT_EQ(sum.events[Event::kBoxTests], r.counters.tilecore.box_tests + r.counters.tessellation.group_tests);
  EXPECT_EQ(sum.events[Event::kTriangleTests], r.counters.tilecore.triangle_tests + sampling.footprint_tests);
  EXPECT_EQ(sum.events[Event::kShaderInvocations], r.counters.shading.pixel_shader_invocations);
  EXPECT_EQ(sum.events[Event::kPixels], r.counters.resolve.pixels_shaded + desampling.pixels_advected +
                                            desampling.pixels_reconstructed + r.counters.shadows.texels_stored);
  EXPECT_EQ(sum.events[Event::kBlendedLayers], r.counters.shading.blended_layers);
  EXPECT_EQ(sum.events[Event::kLightTests], r.counters.lights.places + r.counters.lights.tests);
  EXPECT_EQ(sum.events[Event::kL2Lines], r.counters.l2.requests + r.counters.l2.misses);
}

// Bytes that were read although nothing had written them: bytes of lists, of the sub-patch table and of tile states.
// All other reads are reads of the capture.
std::uint64_t read_from_nowhere(const gpu::FrameRecord& record, std::uint64_t burst) {
  std::uint64_t wrong = 0;
  std::set<std::tuple<Purpose, std::uint64_t, std::uint64_t>>
      written;  // states of tiles have a place of their own each
  const auto follow = [&](const std::vector<memory::Access>& accesses, std::uint64_t tile, bool writes) {
    for (const memory::Access& a : accesses) {
      if (a.write != writes || (a.purpose != Purpose::kTileQueue && a.purpose != Purpose::kTileState)) continue;
      for (std::uint64_t at = 0; at < a.bytes; at += burst) {
        const std::tuple key{a.purpose, a.purpose == Purpose::kTileState ? tile : 0, a.offset + at};
        if (writes)
          written.insert(key);
        else if (!written.contains(key))
          wrong += burst;
      }
    }
  };
  for (std::size_t r = 0; r < record.accesses.size(); ++r) {
    follow(record.accesses[r].geometry, 0, true);
    for (std::size_t i = 0; i < record.accesses[r].tiles.size(); ++i) {
      follow(record.accesses[r].tiles[i], record.work.rounds[r].tiles[i].tile, false);
      follow(record.accesses[r].tiles[i], record.work.rounds[r].tiles[i].tile, true);
    }
  }
  return wrong;
}

// Every byte that is read was written, or belongs to the capture.
void expect_bytes_written_before_they_are_read(const Way& way, const gpu::FrameResult& r) {
  const auto burst = static_cast<std::uint64_t>(way.gpu.memory.burst_bytes);
  EXPECT_EQ(read_from_nowhere(r.model->record, burst), 0u);
  // A binner that forgets its writes is caught.
  gpu::FrameRecord forgetful = r.model->record;
  for (auto& round : forgetful.accesses) round.geometry.clear();
  if (r.counters.binner.entries > 0) {
    EXPECT_GT(read_from_nowhere(forgetful, burst), 0u);
  }
}

// No unit is busy longer than the frame, and units of energy add up.
void expect_units_and_energy_add_up(const Way& way, const gpu::FrameResult& r) {
  const nlohmann::json timing = timing_json(r.model->timing), energy = energy_json(r.model->energy);
  EXPECT_GT(timing["cycles"], 0);
  for (const auto& [unit, row] : timing["units"].items()) {
    EXPECT_LE(row["busy_cycles"].get<double>(), timing["cycles"].get<double>()) << unit;
    EXPECT_GE(row["utilisation"].get<double>(), 0) << unit;
    EXPECT_LE(row["utilisation"].get<double>(), 1) << unit;
  }
  const std::string bound_by = timing["bound_by"];
  bool known = false;
  for (std::size_t b = 0; b < timing::kBoundCount; ++b)
    known |= bound_by == timing::name(static_cast<timing::Bound>(b));
  EXPECT_TRUE(known) << bound_by;
  EXPECT_LE(timing["bound_by_cycles"], timing["cycles"]);
  double sum = 0;
  for (const auto& [unit, nj] : energy["by_unit"].items()) sum += nj.get<double>();
  EXPECT_EQ(sum, energy["total_nj"].get<double>());
  const timing::MemoryCounts& memory = r.model->timing.events->memory;
  EXPECT_NEAR(energy["by_unit"]["dram"].get<double>(),
              static_cast<double>(memory.read_bytes + memory.written_bytes) * 8 * way.gpu.memory.pj_per_bit * 1e-3,
              1e-6);
}

// One frame for all laws: on every way through the machine.
TEST_P(MachineOf, BytesEventsTimesAndEnergyAddUpWhateverItDoes) {
  for (const auto& [name, way] : ways()) {
    SCOPED_TRACE(name);
    const gpu::FrameResult r = render(capture, with(way));
    expect_bytes_in_one_phase_and_in_the_trace(way, r);
    expect_events_of_tiles_add_up(r);
    expect_bytes_written_before_they_are_read(way, r);
    expect_units_and_energy_add_up(way, r);
  }
}

TEST_P(MachineOf, TwiceTheCoresAreNotSlowerAndHalfTheBandwidthIsNotFaster) {
  for (const char* preset : {"small", "middle", "large"}) {
    Way run = with({});
    run.gpu = test::coarse_machine(gpu::load_gpu(preset));
    const gpu::FrameRecord record = render(capture, run, 640, 360).model->record;
    const auto cycles = [&](const GpuConfiguration& gpu) { return timing::schedule_frame(gpu, record.work).cycles; };
    GpuConfiguration other = run.gpu;
    other.cores.count *= 2;
    // Where the memory bounds the frame, another order of the tiles at its end may cost a few cycles.
    EXPECT_LE(cycles(other), 1.0005 * cycles(run.gpu)) << preset;
    const bool memory_bound =
        timing::time_frame(run.gpu, record.work, timing::schedule_frame(run.gpu, record.work)).bound_by ==
        timing::bound_of(Stage::kDram);
    if (preset != std::string("large") && !memory_bound) {  // a large one has few tiles for its cores
      EXPECT_LT(cycles(other), 0.9 * cycles(run.gpu)) << preset;
    }
    other = run.gpu;
    other.memory.gb_per_s /= 2;
    EXPECT_GE(cycles(other), cycles(run.gpu));
    other.memory.gb_per_s /= 4096;  // procedures hardly need any
    EXPECT_GT(cycles(other), 2 * cycles(run.gpu)) << preset;
    EXPECT_EQ(timing::time_frame(other, record.work, timing::schedule_frame(other, record.work)).bound_by,
              timing::bound_of(Stage::kDram))
        << preset;
  }
}

INSTANTIATE_TEST_SUITE_P(Captures, MachineOf,
                         testing::Values("eggs", "vases", "serpent", "flyby", "workshop", "city", "garden",
                                         "city_evening", "garden_lamps", "corridor"),
                         [](const auto& p) { return std::string(p.param); });

// Lines of all tiles together, each once.
std::uint64_t distinct_lines(const gpu::FrameRecord& record) {
  std::set<std::uint64_t> lines;
  for (const auto& round : record.accesses)
    for (const auto& tile : round.tiles)
      for (const memory::Access& a : tile)
        if (a.purpose == Purpose::kTexture) lines.insert(a.offset);
  return lines.size();
}

TEST(Textures, AnL2ThatHoldsEverythingFetchesEachLineOnceAndNoneFetchesEveryMiss) {
  const Capture capture = scene::read_capture(test::shipped_capture("vases"));
  Way run;
  run.gpu.caches.l2_bytes = 1 << 28;
  const gpu::FrameResult all = render(capture, run);
  EXPECT_GT(all.counters.l2.misses, 0u);
  const auto read = [](const gpu::FrameResult& r, Purpose purpose) {
    return r.counters.ledger.traffic(Unit::kTilecore, purpose).read_bytes;
  };
  EXPECT_EQ(read(all, Purpose::kTexture), distinct_lines(all.model->record) * 64);
  EXPECT_EQ(read(all, Purpose::kTexture) + read(all, Purpose::kPatchData) + read(all, Purpose::kAttributes),
            all.counters.l2.misses * 64);
  EXPECT_GT(all.counters.l2.requests, all.counters.texture.cache_misses) << "records besides";
  run.gpu.caches.l2_bytes = 0;
  const gpu::FrameResult none = render(capture, run);
  EXPECT_EQ(none.counters.l2.misses, none.counters.l2.requests);
  EXPECT_EQ(none.counters.l2.requests, all.counters.l2.requests);
  EXPECT_EQ(none.counters.texture.cache_misses, all.counters.texture.cache_misses);
  EXPECT_EQ(read(none, Purpose::kTexture), none.counters.texture.cache_misses * 64);
  EXPECT_GT(none.counters.l2.misses, all.counters.l2.misses);
  // A larger cache in front of it asks for less.
  run.gpu.caches.texture_bytes = 1 << 20;
  EXPECT_LT(render(capture, run).counters.texture.cache_misses, none.counters.texture.cache_misses);
}

// The lines of a flat map under a patch, against every vertex's own lookup.
TEST(Textures, ASubPatchAsksForTheHeightsThatItsVerticesLieAmong) {
  Capture capture = scene::read_capture(test::shipped_capture("eggs"));
  // Off the grid that the file keeps coordinates on: on a texel's middle rounding decides whether the next one, which has no
  // weight there, is asked for.
  for (scene::Material& material : capture.materials)
    if (material.displacement) material.displacement->transform.offset += Vec2(0.0137f, 0.0071f);
  const scene::Assembly assembly = scene::assemble(capture);
  scene::FrameRequest request;
  request.width = 320;
  request.height = 180;
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 320, 180), request);
  const gpu::DisplacementMemory memory(capture.materials, 64, 1000);
  std::vector<std::uint32_t> lines;
  std::size_t displaced = 0;
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p) {
    const scene::PosedDrawable& drawable = frame->drawable_of(p);
    memory.lines_of(*frame, p, scene::patch_cells(*frame, p), lines);
    EXPECT_EQ(lines.empty(), !drawable.material->displacement.has_value());
    if (lines.empty()) continue;
    ++displaced;
    const std::set<std::uint32_t> distinct(lines.begin(), lines.end());
    EXPECT_EQ(distinct.size(), lines.size());
    EXPECT_GE(*distinct.begin(), 1000u);
    EXPECT_LT(*distinct.rbegin(), memory.end());
    // Ranges need no more than the whole patch, and together no less.
    const scene::CellRange all = scene::patch_cells(*frame, p);
    std::set<std::uint32_t> parts;
    for (std::uint8_t i = all.i0; i < all.i1; ++i) {
      memory.lines_of(*frame, p, {i, all.j0, static_cast<std::uint8_t>(i + 1), all.j1}, lines);
      parts.insert(lines.begin(), lines.end());
    }
    EXPECT_EQ(parts, distinct) << "patch " << p;
  }
  EXPECT_GT(displaced, 100u);
}

TEST(Model, WithoutItTheImageIsTheSameAndItsMembersAreAbsent) {
  const Capture capture = scene::read_capture(test::shipped_capture("vases"));
  Way run;
  const gpu::FrameResult with = render(capture, run);
  run.settings.output.machine_model = false;
  const gpu::FrameResult without = render(capture, run);
  EXPECT_EQ(with.targets.color.values, without.targets.color.values);
  EXPECT_FALSE(without.model);
  const nlohmann::json on = counters_json(with.counters), off = counters_json(without.counters);
  EXPECT_TRUE(on.contains("texture.texels"));
  for (const auto& [name, value] : on.items()) {
    // The L2 has records of base patches still.
    const bool of_model = name.starts_with("texture.");
    EXPECT_EQ(off.contains(name), !of_model) << name;
    if (!of_model && !name.starts_with("l2.") && name != "dram.read_bytes") {
      EXPECT_EQ(off.at(name), value) << name;
    }
  }
  Statistics statistics(capture, run.gpu, run.settings, {.width = 160, .height = 90, .region = {0, 0, 160, 90}});
  statistics.add(without);
  EXPECT_FALSE(statistics.json()["frames"][0].contains("timing"));
  EXPECT_FALSE(statistics.json()["total"].contains("energy"));
}

TEST(Model, StatisticsHoldTimingAndEnergyOfEveryFrameAndTheirSum) {
  const Capture capture = scene::read_capture(test::shipped_capture("flyby"));
  const gpu::RenderRequest request{.width = 96, .height = 54, .region = {0, 0, 96, 54}};
  gpu::Device renderer(capture, {}, {}, request);
  Statistics statistics(capture, {}, {}, request);
  for (const int frame : {0, 1}) statistics.add(renderer.render(frame));
  const nlohmann::json stats = statistics.json();
  double nj = 0;
  std::uint64_t cycles = 0;
  for (const nlohmann::json& frame : stats["frames"]) {
    cycles += frame["timing"]["cycles"].get<std::uint64_t>();
    nj += frame["energy"]["total_nj"].get<double>();
  }
  EXPECT_NEAR(stats["total"]["timing"]["cycles"].get<double>(), static_cast<double>(cycles), 2);
  EXPECT_NEAR(stats["total"]["energy"]["total_nj"].get<double>(), nj, 1e-9 * nj);
  // A column for each number, in every row.
  const std::string csv = statistics.csv();
  const auto columns = [&](std::size_t line) {
    std::size_t at = 0;
    for (std::size_t l = 0; l < line; ++l) at = csv.find('\n', at) + 1;
    const std::string text = csv.substr(at, csv.find('\n', at) - at);
    return std::count(text.begin(), text.end(), ',');
  };
  EXPECT_EQ(columns(1), columns(0));
  EXPECT_EQ(columns(2), columns(0));
  EXPECT_NE(csv.find(",timing.cycles,timing.time_ms,timing.frames_per_second,timing.latency_cycles,timing.bound_by"),
            std::string::npos);
  EXPECT_NE(csv.find(",energy.total_nj,energy.power_w"), std::string::npos);
}

TEST(SelfChecks, TheMemoryMovesTheBytesOfItsStandard) {
  const std::vector<SelfCheck> checks = check_memory_rates();
  EXPECT_EQ(checks.size(), 3u);
  for (const SelfCheck& check : checks) EXPECT_TRUE(check.passed) << check.name << ": " << check.got;
}

TEST(SelfChecks, KnownDeviationsAreNoFailures) {
  SelfCheck held, known, unknown;
  held.passed = true;
  known.reason = "it is known";
  EXPECT_EQ(failures({held, known}), 0u);
  EXPECT_EQ(failures({held, known, unknown, unknown}), 2u);
}

// Two tiles, one after the other on two cores: one line that both ask for, and one of each.
TEST(SharedLines, AreLinesThatTwoCoresAskFor) {
  timing::FrameWork work;
  timing::WorkRound& round = work.rounds.emplace_back();
  for (std::uint32_t tile = 0; tile < 2; ++tile) {
    timing::TileWork& of = round.tiles.emplace_back();
    of.tile = tile;
    of.events[hardware::Event::kShaderInvocations] = of.events[hardware::Event::kShaderLanes] = 64;
    timing::TileItems& items = round.items.emplace_back();
    items.texel_lines = {7, 10 + tile, 20 + tile};
    items.warps.resize(2);
    items.warps[0].texel_lines = 2;
    items.warps[1].texel_lines = 1;
  }
  hardware::Machine gpu;
  gpu.cores.count = 2;
  const SharedLines by_tile = shared_lines(gpu, work, WarpOwner::kCoreOfTile);
  EXPECT_EQ(by_tile.lines, 5u);
  EXPECT_EQ(by_tile.shared, 1u);
  // Dealt out, the first warps of both tiles are the first core's.
  const SharedLines in_turn = shared_lines(gpu, work, WarpOwner::kCoresInTurn);
  EXPECT_EQ(in_turn.lines, 5u);
  EXPECT_EQ(in_turn.shared, 0u);
  gpu.cores.count = 1;
  EXPECT_EQ(shared_lines(gpu, work, WarpOwner::kCoreOfTile).shared, 0u);
}

}  // namespace
}  // namespace tessera::replay::machine_test
