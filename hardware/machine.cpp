#include "hardware/machine.h"

#include <utility>

#include "memory/dram_spec.h"

namespace tessera::hardware {
namespace {

constexpr double kLeast = 1.0 / 1024, kMax = 65536;  // range of a throughput
constexpr double kMaxArea = 1e6;

// Key of a number in one of the machine's arrays.
template <class Array, class Index>
Key<Machine> key_of(Array Machine::*array, Index index, KeyInfo info) {
  return {std::move(info), [array, index](const Machine& gpu) { return KeyValue((gpu.*array)[index]); },
          [array, index](Machine& gpu, const KeyValue& value) { (gpu.*array)[index] = std::get<double>(value); }};
}

// Makers publish hardly any throughput of a single unit. A number without a source is a round one marked [assumed];
// conclusions that depend on it should be tried with another (`tessera sweep`).
Keys<Machine> rate_keys() {
  Keys<Machine> keys;
  for (const Event event : kAllEvents)
    if (const EventRate& rate = kEventTable[event].rate; !rate.key.empty())
      keys.add({key_of(&Machine::rates, event,
                       {rate.key, rate.unit, rate.meaning, rate.source, kLeast, kMax, {}, false, rate.ends})});
  return keys;
}

// 45 nm (Horowitz): addition 0.9 pJ, multiplication 3.7 pJ, 8 bytes from an 8 KiB cache 10 pJ. A quarter of that at 7
// nm is assumed: 1.15 pJ a fused operation, 2.5 pJ for 8 bytes on chip. Published are 1.69 pJ for the operation at 7 nm
// (Jouppi et al. 2021) and 3.2 pJ for the bytes at 14 nm (Dally et al. 2020): half to twice of each energy holds both.
Keys<Machine> energy_keys() {
  Keys<Machine> keys;
  for (const Event event : kAllEvents)
    if (const EventEnergy& energy = kEventTable[event].energy; !energy.key.empty())
      keys.add({key_of(&Machine::energy_pj, event,
                       {energy.key, "pJ", energy.meaning, energy.source, 0, 1e9, {}, false, energy.ends})});
  return keys;
}

// 45 nm: 0.012 mm2 for a fused operation of 32 bits (Horowitz); a 25th of that at 7 nm is assumed: 0.0005. Navi 10 and 14
// (7 nm, 249 mm2 with 2560 lanes, 157 with 1536) bound a lane with its share of all else: 0.09 mm2 at 1.8 GHz.
Keys<Machine> silicon_keys() {
  Keys<Machine> keys;
  for (std::size_t s = 0; s < kSiliconCount; ++s) {
    const SiliconRow& row = kSiliconTable[s];
    keys.add({key_of(&Machine::silicon_mm2, static_cast<Silicon>(s),
                     {row.key, "mm2", row.meaning, row.source, 0, kMaxArea, {}, false, row.ends})});
  }
  return keys;
}

Keys<PixelShader> shader_keys() {
  return {
      {"shader.lanes", &PixelShader::lanes, "lanes", 1, 4096,
       "Operations of the pixel shader that a core does per clock.",
       "[assumed] 8, 32, 128: steps of a factor of 4, as between classes of phones"},
      {"shader.warp_lanes", &PixelShader::warp_lanes, "lanes", 4, 128,
       "Invocations of a warp. Warps are whole, each of one draw; the "
       "texture unit gets their lookups together.",
       "[assumed] 32, as NVIDIA's and AMD's; Arm's and Imagination's have 16 to 128"},
      {"shader.costs", &PixelShader::costs,
       "With machine.timing=events: source of a warp's time on the lanes and of its registers. constant: "
       "shader.operations, shader.surface_operations, shader.background_operations and shader.registers; compiled: the "
       "shader of its material as LLVM compiles it for gfx1030.",
       "[assumed] compiled: the model that docs/validation.md holds against other compilers"},
      {"shader.operations", &PixelShader::operations, "operations", 1, 1e6,
       "Operations of one pixel-shader invocation on one lane.",
       "[assumed] a physically based shader with a few lights"},
      {"shader.surface_operations", &PixelShader::surface_operations, "operations", 0, 1e6,
       "Operations on one lane that evaluate a patch's surface, with constant costs: for a pixel-shader invocation, "
       "besides shader.operations, and for a vertex with tessellator.domain_shading=lanes.",
       "[assumed] as in the tessellator, energy.vertex_pj; compiled: 16 of a mesh, 91 to 163 of a patch, 298 "
       "to 514 of a displaced one",
       PlausibleRange{91, 298}},
      {"shader.background_operations", &PixelShader::background_operations, "operations", 0, 1e6,
       "Operations on one lane for a sample that sees the environment, with constant costs.",
       "[measured] as compiled: 46 to 64 of the built-in environment, 54 to 72 of an image", PlausibleRange{46, 72}},
      {"tessellator.domain_shading", &PixelShader::domain,
       "Unit that evaluates vertices: a unit of the tessellator, at tessellator.vertices_per_clk; or the shader's "
       "lanes, in warps that go before pixel warps and look heights up in the texture unit. Vertices that are on chip "
       "go through tessellator.transforms_per_clk either way.",
       "[spec] lanes: domain shaders run on the shader cores of all GPUs with tessellation"},
  };
}

Keys<Machine> speed_keys() {
  Keys<Machine> keys = {
      {"clock.mhz", &Machine::clock_mhz, "MHz", 1, 10000,
       "Clock of the whole GPU; cycles everywhere are cycles of this clock.",
       "[spec] 650 on Mali-G31, 653 on Adreno 530, 900 on Adreno 730; [assumed] 850 between them",
       PlausibleRange{650, 1000}},
      {"voltage.nominal_mhz", &Machine::nominal_mhz, "MHz", 1, 10000,
       "Clock that the GPU reaches at 0.8 V, for which energies and leakage are given. Other clocks have other "
       "voltages "
       "(hardware/voltage.h); energy of an event goes with their square, the memory's stays.",
       "[spec] curve: Mali-G57 in MT8192, 7 nm, 358 MHz at 0.606 V to 866 at 0.8, Linux's operating points; [assumed] "
       "each preset runs at its own",
       PlausibleRange{700, 1000}},
  };
  keys.add(&Machine::cores,
           Keys<TileCores>{
               {"tilecore.count", &TileCores::count, "cores", 1, 64, "Tile cores, fed by one tile scheduler.",
                "[spec] 1 on Mali-G31, 1 to 6 on Mali-G51, 10 to 16 on Immortalis-G720"},
           });
  keys.add(rate_keys());
  keys.add(&Machine::shader, shader_keys());
  return keys;
}

Keys<Machine> memory_keys() {
  Keys<Machine> keys;
  keys.add(&Machine::cores,
           Keys<TileCores>{
               {"tilecore.memory_bytes", &TileCores::memory_bytes, "bytes", 1024, 1073741824.0,
                "On-chip tile memory of a core. A core works on as many tiles at once as fit with the data of their "
                "samples (it tests the samples of one tile while it shades another). The memory of a preset grows to "
                "fit one tile; a smaller value that the user sets is refused.",
                "[assumed] two tiles with 4 samples a pixel; [spec] 132 KB to 21 MB of GMEM on Adreno"},
           });
  keys.add(&Machine::caches,
           Keys<Caches>{
               {"texture.cache_bytes", &Caches::texture_bytes, "bytes", 256, 16777216, "Texture cache (L1) of a core.",
                "[assumed]"},
               {"l2.bytes", &Caches::l2_bytes, "bytes", 0, 1073741824.0,
                "L2 that all cores share, for textures, displacement maps and records of base patches; 0: no L2. Data "
                "that are written once bypass it.",
                "[spec] 8 to 64 KiB on Mali-G31, 32 to 512 KiB on Mali-G51, up to 1 MiB on Immortalis-G720; [assumed] "
                "the half "
                "that tessellator.cache_bytes leaves"},
               {"l2.ways", &Caches::l2_ways, "ways", 1, 64, "Associativity of the L2.", "[assumed]"},
           });
  keys.add(
      &Machine::memory,
      Keys<MemoryInterface>{
          {"memory.model", &MemoryInterface::model,
           "With machine.timing=events: the external memory as bytes at memory.gb_per_s (fluid), or as channels, "
           "banks and rows of memory.type with a controller that sorts requests (banks).",
           "[assumed] banks: the model that docs/validation.md holds against a DRAM simulator"},
          {"memory.type", &MemoryInterface::type,
           "With memory.model=banks: kind of the channels of 16 bits, which have their own clock; memory.gb_per_s, "
           "memory.latency_ns and memory.gpu_share are then not used.",
           "[spec] JEDEC JESD209-4 (2014) and -5 (2019), as in memory/dram_spec.cpp"},
          {"memory.channels", &MemoryInterface::channels, "channels", 1, 16,
           "With memory.model=banks: channels of 16 bits, a power of two.", "[spec] LPDDR4 x32 has two, x64 four"},
          {"memory.gb_per_s", &MemoryInterface::gb_per_s, "GB/s", 0.001, 100000,
           "Peak rate of the external memory. memory.bytes_per_clk sets it too, by the clock.mhz of that moment.",
           "[spec] LPDDR4-3200 x32 (12.8 GB/s), LPDDR4X-4266 x64 (34.1), LPDDR5X-8533 x64 (68.3)"},
          {"memory.gpu_share", &MemoryInterface::gpu_share, "", 0.01, 1,
           "Part of the peak rate that the GPU gets: refresh, turn-around, other users.", "[assumed]",
           PlausibleRange{0.5, 0.9}},
          {"memory.latency_ns", &MemoryInterface::latency_ns, "ns", 0, 100000,
           "Time from a read to its data on an idle memory. memory.latency_clk sets it too, by the clock.mhz of that "
           "moment.",
           "[spec] Arm counts latencies from 128 to 384 cycles, above 256 as trouble; [assumed] the middle, 192 of 850 "
           "MHz",
           PlausibleRange{150, 450}},
          {"memory.pj_per_bit", &MemoryInterface::pj_per_bit, "pJ/bit", 0, 1000,
           "Energy of a bit over the external interface, memory, interface and controller together.",
           "[spec] Arm: 100 mW per GB/s is 12.5; [assumed] 8 for LPDDR5X by its makers' claims of better efficiency",
           PlausibleRange{8, 16}},
      });
  return keys;
}

Keys<QueueSizes> queue_keys() {
  return {
      {"machine.timing", &QueueSizes::model,
       "Timing model of a frame. phases: each phase of a tile is one pipeline; events: every sub-patch, warp and cache "
       "line passes separately through queues of these sizes.",
       "[assumed] events: the model that docs/validation.md holds against others"},
      {"machine.overlap", &QueueSizes::overlap,
       "Work that may begin while tiles are rendered. none: no other work; passes: patches and tiles of later passes "
       "that do not need those tiles; frames: also patches of the next frame. With frames, cycles count from one frame "
       "to the next in a sequence of equal frames, and the latency is twice as long. passes and frames need a second "
       "parameter buffer.",
       "[assumed] none: cycles are a frame's latency"},
      {"machine.caches", &QueueSizes::caches,
       "With machine.timing=events: content of the L2 and the texture caches when a frame begins: empty, or as the "
       "previous frame left it.",
       "[assumed] empty: frames do not depend on each other"},
      {"tilecore.queue_items", &QueueSizes::items, "sub-patches", 1, 1024,
       "Sub-patches that may wait between one unit of a core and the next.", "[assumed]"},
      {"tilecore.fetched_lines", &QueueSizes::fetched_lines, "lines", 1, 65536,
       "Lines of records and heights that a core has requested and not yet received.", "[assumed]"},
      {"frontend.fetched_lines", &QueueSizes::table_lines, "lines", 1, 65536,
       "Lines of tables of heights that the front end has requested from the L2 and not yet received.",
       "[assumed] as tilecore.fetched_lines"},
      {"resolve.store_bytes", &QueueSizes::store_bytes, "bytes", 64, 1048576,
       "Bytes written by a core that may wait for the memory before its resolve unit stops.", "[assumed]"},
      {"texture.requests", &QueueSizes::texture_requests, "lines", 1, 4096,
       "Lines that a core's texture cache has requested from the L2 and not yet received.", "[assumed]"},
      {"texture.latency_clk", &QueueSizes::texture_latency_clk, "clk", 0, 10000,
       "Time of a lookup that hits the texture cache.", "[assumed] filtering and two pipelines on the way"},
      {"l2.banks", &QueueSizes::l2_banks, "banks", 1, 64, "Banks of the L2, by the number of the line.", "[assumed]"},
      {"l2.lines_per_clk", &QueueSizes::l2_lines_per_clk, "lines/clk", kLeast, 64,
       "Lines that a bank reads or writes per clock.", "[assumed]"},
      {"l2.latency_clk", &QueueSizes::l2_latency_clk, "clk", 0, 10000, "Time of a request that hits the L2.",
       "[assumed]"},
      {"l2.requests", &QueueSizes::l2_requests, "lines", 1, 65536,
       "Lines that the L2 has requested from the memory and not yet received.", "[assumed]"},
      {"shader.max_warps", &QueueSizes::max_warps, "warps", 1, 4096, "Warps that a core holds at once.",
       "[spec] 16 wave32 per SIMD on RDNA2"},
      {"shader.register_bytes", &QueueSizes::register_bytes, "bytes", 1024, 67108864, "Registers of a core.",
       "[spec] 128 KiB per SIMD on RDNA2"},
      {"shader.registers", &QueueSizes::registers, "registers", 1, 1024,
       "Registers of 4 bytes that an invocation takes; with shader.register_bytes they limit the warps in flight.",
       "[assumed]"},
  };
}

Keys<FrameRate> frame_rate_keys() {
  return {
      {"machine.target_fps", &FrameRate::target_fps, "frames/s", 0, 10000,
       "Frame rate at which energy.power_w holds, or the rate that the machine reaches if that is lower; 0: the rate "
       "that the machine reaches.",
       "[spec] 60 on most displays of phones"},
      {"energy.power_gating", &FrameRate::gating,
       "When the GPU's supply is cut: never (none), so that it leaks all the time, or between_frames.",
       "[assumed] none"},
  };
}

Keys<OtherSilicon> other_silicon_keys() {
  return {
      {"area.core_mm2", &OtherSilicon::core_mm2, "mm2", 0, kMaxArea,
       "Fixed part of a core, independent of its rates: list fetch, sorter, warp scheduler, compaction, interfaces.",
       "[assumed]"},
      {"area.sram_mm2_per_kib", &OtherSilicon::sram_mm2_per_kib, "mm2/KiB", 0, kMaxArea, "Caches and tile memory.",
       "[spec] TSMC 2017, 7 nm: cells of 0.027 um2, 0.00022 a KiB; a test chip of 256 Mbit takes 42.64 mm2, 0.0013; "
       "[assumed] between",
       PlausibleRange{0.00022, 0.0013}},
      {"area.register_mm2_per_kib", &OtherSilicon::register_mm2_per_kib, "mm2/KiB", 0, kMaxArea, "Registers of a core.",
       "[assumed] twice area.sram_mm2_per_kib: more ports"},
      {"energy.leakage_mw_per_mm2", &OtherSilicon::leakage_mw_per_mm2, "mW/mm2", 0, 1e6,
       "Leakage power of a mm2 at 0.8 V; proportional to the voltage.",
       "[assumed] 60 mW for four cores in a warm phone", PlausibleRange{3, 30}},
  };
}

}  // namespace

std::vector<std::string> Machine::coarser_models() const {
  if (!times_events()) return {"machine.timing=phases"};
  std::vector<std::string> models;
  if (!has_banks()) models.emplace_back("memory.model=fluid");
  if (!has_compiled_shaders()) models.emplace_back("shader.costs=constant");
  return models;
}

double Machine::peak_gb_per_s() const {
  if (!has_banks()) return memory.gb_per_s;
  // Peak rate of one channel, by type.
  static const auto kPeaks = [] {
    std::array<double, kEnumWords<MemoryType>.size()> peaks{};
    for (std::size_t type = 0; type < peaks.size(); ++type) {
      memory::DramSpec spec = memory::dram_spec(kEnumWords<MemoryType>[type]);
      spec.channels = 1;
      peaks[type] = spec.peak_gb_s();
    }
    return peaks;
  }();
  return kPeaks[static_cast<std::size_t>(memory.type)] * static_cast<double>(memory.channels);
}

double Machine::operations(Event event) const {
  switch (event) {
    case Event::kSurfaceEvaluations:
    case Event::kSurfaceLanes:
    case Event::kVertexOutputs:
    case Event::kVertexOutputLanes:
    case Event::kDomainInvocations:
      return shader.surface_operations;
    case Event::kBackgroundSamples:
    case Event::kBackgroundLanes:
      return shader.background_operations;
    case Event::kLightTests:
    case Event::kLightLanes:
      return PixelShader::kLightOperations;
    case Event::kImageTexels:
    case Event::kImageLanes:
      return PixelShader::kImageOperations;
    case Event::kShaderInvocations:
    case Event::kShaderLanes:
      return shader.operations;
    default:
      return 1;
  }
}

double Machine::per_clk(Event event) const {
  const Event owner = kEventTable[event].timed_as.value_or(event);
  return owner == Event::kShaderClocks ? static_cast<double>(shader.lanes) : rates[owner];
}

double Machine::pj(Event event) const {
  return energy_pj[kEventTable[event].priced_as.value_or(event)] * operations(event);
}

EventCounts placed(const Machine& gpu, EventCounts counts) {
  if (gpu.shades_on_lanes()) {
    counts[Event::kDomainInvocations] = std::exchange(counts[Event::kVertices], 0);
    counts[Event::kTexels] += counts[Event::kDomainTexels];
  }
  counts[Event::kDomainTexels] = 0;
  return counts;
}

Keys<Machine> burst_keys() {
  return Keys<Machine>().add(&Machine::memory,
                             Keys<MemoryInterface>{
                                 {"memory.burst_bytes", &MemoryInterface::burst_bytes, "bytes", 16, 256,
                                  "Smallest amount the external memory interface moves: 16, 32, 64, "
                                  "128 or 256.",
                                  "[spec] LPDDR4 x16, burst length 16 = 32; two channels = 64"},
                             });
}

Keys<Machine> machine_keys() {
  return speed_keys()
      .add(memory_keys())
      .add(&Machine::queues, queue_keys())
      .add(&Machine::rate, frame_rate_keys())
      .add(energy_keys())
      .add(silicon_keys())
      .add(&Machine::silicon, other_silicon_keys())
      // These keys change the counts of units, not only the timing: warp packing, and hits of the caches in emulated order.
      .mark_timing_but({"shader.warp_lanes", "texture.cache_bytes", "l2.bytes", "l2.ways"});
}

}  // namespace tessera::hardware
