#include "hardware/machine.h"

namespace tessera::hardware {
namespace {

constexpr double kLeast = 1.0 / 1024, kMax = 65536;  // of a throughput

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
       "With machine.timing=events: what a warp takes of the lanes and of the registers, the "
       "constants of shader.operations, shader.surface_operations and shader.registers, or "
       "what LLVM compiles its material's shader to for gfx1030.",
       "[assumed] constant"},
      {"shader.operations", &PixelShader::operations, "operations", 1, 1e6,
       "Operations of one pixel-shader invocation on one lane.",
       "[assumed] a physically based shader with a few lights"},
      {"shader.surface_operations", &PixelShader::surface_operations, "operations", 0, 1e6,
       "Operations of evaluating a patch's surface on one lane, with constant costs: of a pixel-shader invocation, "
       "besides "
       "shader.operations, and of a vertex with tessellator.domain_shading=lanes.",
       "[assumed] as in the tessellator, energy.vertex_pj; compiled: 16 of a mesh, 91 to 163 of a patch, 298 "
       "to 514 of a displaced one",
       KeyEnds{91, 298}},
      {"tessellator.domain_shading", &PixelShader::domain,
       "Where vertices are evaluated: in a unit of the tessellator, at tessellator.vertices_per_clk; or on "
       "the shader's lanes, as warps that go before those of pixels and look heights up in the texture "
       "unit. Vertices that are on chip go through tessellator.transforms_per_clk either way.",
       "[spec] domain shaders run on the shader cores of all GPUs with tessellation; [assumed] unit"},
  };
}

// Makers publish hardly any throughput of a single unit. What no source gives is a round number marked [assumed];
// conclusions that hang on one of them should be tried with another (`tessera sweep`).
Keys<Machine> speed_keys() {
  Keys<Machine> keys = {
      {"clock.mhz", &Machine::clock_mhz, "MHz", 1, 10000,
       "Clock of the whole GPU; cycles everywhere are cycles of this clock.",
       "[spec] 650 on Mali-G31, 653 and 900 on Adreno 530 and 730; [assumed] 850 between them", KeyEnds{650, 1000}},
      {"voltage.nominal_mhz", &Machine::nominal_mhz, "MHz", 1, 10000,
       "Clock that the GPU reaches at 0.8 V, for which energies and leakage are given. Other clocks have other "
       "voltages "
       "(hardware/voltage.h); energy of an event goes with their square, the memory's stays.",
       "[spec] curve: Mali-G57 in MT8192, 7 nm, 358 MHz at 0.606 V to 866 at 0.8, Linux's operating points; [assumed] "
       "each preset runs at its own",
       KeyEnds{700, 1000}},
  };
  keys.add(&Machine::cores,
           Keys<TileCores>{
               {"tilecore.count", &TileCores::count, "cores", 1, 64, "Tile cores, fed by one tile scheduler.",
                "[spec] 1 on Mali-G31, 1 to 6 on Mali-G51, 10 to 16 on Immortalis-G720"},
           });
  keys.add(
      &Machine::rates,
      Keys<Throughputs>{
          {"frontend.bounds_per_clk", &Throughputs::bounds_per_clk, "bounds/clk", kLeast, kMax,
           "Bounding volumes that the front end computes.",
           "[assumed] 4 clocks for 16 control points at two motion keys"},
          {"binner.entries_per_clk", &Throughputs::binned_entries_per_clk, "entries/clk", kLeast, kMax,
           "Entries of lists that the binner appends.", "[assumed] one append per clock"},
          {"binner.tiles_per_clk", &Throughputs::binned_tiles_per_clk, "tiles/clk", kLeast, kMax,
           "Tiles that the binner tests against a sub-patch.", "[assumed]"},
          {"tilecore.entries_per_clk", &Throughputs::fetched_entries_per_clk, "entries/clk", kLeast, kMax,
           "Entries of lists that a core reads, looks up in the sub-patch table and tests for occlusion.", "[assumed]"},
          {"tilecore.sort_steps_per_clk", &Throughputs::sort_steps_per_clk, "steps/clk", kLeast, kMax,
           "Entries that a core's merge sorter passes from one stage to the next, all stages together.",
           "[assumed] four stages side by side, an entry each"},
          {"tessellator.vertices_per_clk", &Throughputs::vertices_per_clk, "vertices/clk", kLeast, kMax,
           "Vertices that a core's tessellator evaluates, both motion keys together.", "[assumed]"},
          {"tessellator.transforms_per_clk", &Throughputs::transforms_per_clk, "vertices/clk", kLeast, kMax,
           "Vertices of moving objects, kept in object space, that a core puts through the transforms of both motion "
           "keys.",
           "[assumed] 40 operations against 130"},
          {"tilecore.boxes_per_clk", &Throughputs::boxes_per_clk, "boxes/clk", kLeast, kMax,
           "Boxes of cells and leaves that a core builds.", "[assumed] a cell for each vertex"},
          {"tilecore.box_tests_per_clk", &Throughputs::box_tests_per_clk, "tests/clk", kLeast, kMax,
           "Lanes of box tests of a core.", "[assumed] as triangle tests"},
          {"tilecore.stencil_tests_per_clk", &Throughputs::stencil_tests_per_clk, "tests/clk", kLeast, kMax,
           "Samples whose time a core's stencil unit tests.", "[assumed] a group of 32 samples"},
          {"procedures.operations_per_clk", &Throughputs::sampling_operations_per_clk, "operations/clk", kLeast, kMax,
           "Operations of the SIMD array that evaluates procedures, in each core; the sparse pass has one array.",
           "[spec] US 2007/0002066: an array of lanes; [assumed] 32, as the shader"},
          {"tilecore.triangle_tests_per_clk", &Throughputs::triangle_tests_per_clk, "tests/clk", kLeast, kMax,
           "Lanes of a core for samples tested against a triangle, 16 at a time.",
           "[assumed] a quad with 4 samples a pixel"},
          {"tilecore.alpha_tests_per_clk", &Throughputs::alpha_tests_per_clk, "tests/clk", kLeast, kMax,
           "Alpha tests of a core.", "[assumed] a quad"},
          {"tilecore.depth_blocks_per_clk", &Throughputs::depth_blocks_per_clk, "blocks/clk", kLeast, kMax,
           "Blocks of 8x8 pixels whose farthest depth a core finds again.",
           "[assumed] a tree over the samples of a block beside the tile memory"},
          {"tilecore.compaction_per_clk", &Throughputs::compacted_samples_per_clk, "samples/clk", kLeast, kMax,
           "Visible samples and blended layers that a core packs into warps.", "[assumed] a warp"},
      });
  keys.add(&Machine::shader, shader_keys());
  keys.add(&Machine::rates,
           Keys<Throughputs>{
               {"texture.texels_per_clk", &Throughputs::texels_per_clk, "texels/clk", kLeast, kMax,
                "Bilinear lookups of a core's texture unit; a trilinear one is two.", "[assumed]"},
               {"tilecore.blends_per_clk", &Throughputs::blends_per_clk, "layers/clk", kLeast, kMax,
                "Blended layers of samples that a core composes.", "[assumed] a quad"},
               {"resolve.pixels_per_clk", &Throughputs::resolved_pixels_per_clk, "pixels/clk", kLeast, kMax,
                "Pixels that a core's resolve unit finishes.", "[assumed] a quad"},
               {"resolve.operations_per_clk", &Throughputs::resolve_operations_per_clk, "operations/clk", kLeast, kMax,
                "Operations of desampling: velocities, advected pixels, taps of stencils with 8-bit weights; a tap "
                "with float "
                "weights is four.",
                "[assumed] a stencil of 16 taps"},
           });
  return keys;
}

Keys<ReprojectionUnit> reprojection_keys() {
  return {
      {"frontend.reprojected_blocks_per_clk", &ReprojectionUnit::reprojected_blocks_per_clk, "blocks/clk", kLeast, kMax,
       "Blocks of the previous frame's depths that the front end puts where the view at hand has them.",
       "[assumed] four corners of 12 operations, 48 multipliers and adders"},
      {"frontend.depth_tests_per_clk", &ReprojectionUnit::depth_tests_per_clk, "blocks/clk", kLeast, kMax,
       "Blocks whose farthest depth the front end compares with the nearest one of a bound.",
       "[assumed] 8 bytes of a row on chip"},
      {"energy.reprojected_block_pj", &ReprojectionUnit::reprojected_block_pj, "pJ", 0, 1e9,
       "Block of the previous frame's depths put where the view at hand has it.",
       "[assumed] 48 operations of 1.15 pJ, 4 blocks on chip read and written"},
      {"energy.depth_test_pj", &ReprojectionUnit::depth_test_pj, "pJ", 0, 1e9,
       "Block's farthest depth compared with the nearest one of a bound.",
       "[assumed] a comparison of a quarter of an operation, 2 bytes on chip"},
  };
}

Keys<Machine> memory_keys() {
  Keys<Machine> keys;
  keys.add(
      &Machine::cores,
      Keys<TileCores>{
          {"tilecore.memory_bytes", &TileCores::memory_bytes, "bytes", 1024, 1073741824.0,
           "On-chip tile memory of a core: as many tiles as fit with what their samples see are in work at once (the "
           "samples "
           "of one tested while another is shaded). A preset's grows to what one tile needs; less of one's own is "
           "refused.",
           "[assumed] two tiles with 4 samples a pixel; [spec] 132 KB to 21 MB of GMEM on Adreno"},
      });
  keys.add(
      &Machine::caches,
      Keys<Caches>{
          {"texture.cache_bytes", &Caches::texture_bytes, "bytes", 256, 16777216, "Texture cache (L1) of a core.",
           "[assumed]"},
          {"l2.bytes", &Caches::l2_bytes, "bytes", 0, 1073741824.0,
           "L2 that all cores share, for textures, displacement maps and records of base patches; 0: none. What is "
           "written once passes by.",
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
           "[assumed] fluid"},
          {"memory.type", &MemoryInterface::type,
           "With memory.model=banks: channels of 16 bits of this kind, with its own clock; memory.gb_per_s, "
           "memory.latency_ns and memory.gpu_share are then of no account.",
           "[spec] JEDEC JESD209-4 and -5, as in memory/dram_spec.cpp"},
          {"memory.channels", &MemoryInterface::channels, "channels", 1, 16,
           "With memory.model=banks: channels of 16 bits, a power of two.", "[spec] x32 has two, x64 four"},
          {"memory.gb_per_s", &MemoryInterface::gb_per_s, "GB/s", 0.001, 100000,
           "Peak rate of the external memory. memory.bytes_per_clk sets it too, by the clock.mhz of that moment.",
           "[spec] LPDDR4-3200 x32 (12.8 GB/s), LPDDR4X-4266 x64 (34.1), LPDDR5X-8533 x64 (68.3)"},
          {"memory.gpu_share", &MemoryInterface::gpu_share, "", 0.01, 1,
           "Part of the peak rate that the GPU gets: refresh, turn-around, other users.", "[assumed]",
           KeyEnds{0.5, 0.9}},
          {"memory.latency_ns", &MemoryInterface::latency_ns, "ns", 0, 100000,
           "Time from a read to its data on an idle memory. memory.latency_clk sets it too, by the clock.mhz of that "
           "moment.",
           "[spec] Arm counts latencies from 128 to 384 cycles, above 256 as trouble; [assumed] the middle, 192 of 850 "
           "MHz",
           KeyEnds{150, 450}},
          {"memory.pj_per_bit", &MemoryInterface::pj_per_bit, "pJ/bit", 0, 1000,
           "Energy of a bit over the external interface, memory, interface and controller together.",
           "[spec] Arm: 100 mW per GB/s is 12.5; [assumed] 8 for LPDDR5X by its makers' claims of better efficiency",
           KeyEnds{8, 16}},
      });
  return keys;
}

Keys<QueueSizes> queue_keys() {
  return {
      {"machine.timing", &QueueSizes::model,
       "How a frame's work is timed: phases, each of a tile as one pipeline; or events, every sub-patch, warp and "
       "cache line by itself through queues of these sizes.",
       "[assumed] phases"},
      {"machine.overlap", &QueueSizes::overlap,
       "Whether a frame's patches are bounded and binned while the tiles of the frame before are rendered (frames): "
       "cycles are then those from one frame to the next, as frames like this one follow each other, and its latency "
       "is "
       "twice as long. Needs a second parameter buffer.",
       "[assumed] none: cycles are a frame's latency"},
      {"machine.caches", &QueueSizes::caches,
       "With machine.timing=events: what L2 and texture caches hold when a frame begins, nothing or what the frame "
       "before left.",
       "[assumed] empty: frames do not hang on each other"},
      {"tilecore.queue_items", &QueueSizes::items, "sub-patches", 1, 1024,
       "Sub-patches that may wait between one unit of a core and the next.", "[assumed]"},
      {"tilecore.fetched_lines", &QueueSizes::fetched_lines, "lines", 1, 65536,
       "Lines of records and heights that a core has asked for and not yet got.", "[assumed]"},
      {"frontend.fetched_lines", &QueueSizes::table_lines, "lines", 1, 65536,
       "Lines of tables of heights that the front end has asked the L2 for and not yet got.",
       "[assumed] as tilecore.fetched_lines"},
      {"resolve.store_bytes", &QueueSizes::store_bytes, "bytes", 64, 1048576,
       "Written bytes of a core that wait for the memory before its resolve unit does.", "[assumed]"},
      {"texture.requests", &QueueSizes::texture_requests, "lines", 1, 4096,
       "Lines that a core's texture cache has asked the L2 for and not yet got.", "[assumed]"},
      {"texture.latency_clk", &QueueSizes::texture_latency_clk, "clk", 0, 10000,
       "Time of a lookup that hits the texture cache.", "[assumed] filtering and two pipelines on the way"},
      {"l2.banks", &QueueSizes::l2_banks, "banks", 1, 64, "Banks of the L2, by the number of the line.", "[assumed]"},
      {"l2.lines_per_clk", &QueueSizes::l2_lines_per_clk, "lines/clk", kLeast, 64, "Lines that a bank gives or takes.",
       "[assumed]"},
      {"l2.latency_clk", &QueueSizes::l2_latency_clk, "clk", 0, 10000, "Time of a request that hits the L2.",
       "[assumed]"},
      {"l2.requests", &QueueSizes::l2_requests, "lines", 1, 65536,
       "Lines that the L2 has asked the memory for and not yet got.", "[assumed]"},
      {"shader.max_warps", &QueueSizes::max_warps, "warps", 1, 4096, "Warps that a core keeps apart.",
       "[spec] 16 wave32 per SIMD on RDNA2"},
      {"shader.register_bytes", &QueueSizes::register_bytes, "bytes", 1024, 67108864, "Registers of a core.",
       "[spec] 128 KiB per SIMD on RDNA2"},
      {"shader.registers", &QueueSizes::registers, "registers", 1, 1024,
       "Registers of 4 bytes that an invocation takes; with shader.register_bytes they limit the warps in flight.",
       "[assumed]"},
  };
}

// 45 nm (Horowitz): addition 0.9 pJ, multiplication 3.7 pJ, 8 bytes from an 8 KiB cache 10 pJ. A quarter of that at 7
// nm is assumed: 1.15 pJ a fused operation, 2.5 pJ for 8 bytes on chip.
Keys<GeometryPrices> geometry_energy_keys() {
  return {
      {"energy.bound_pj", &GeometryPrices::bound_pj, "pJ", 0, 1e9, "Bounding volume of a sub-patch.",
       "[assumed] 900 operations of 1.15 pJ"},
      {"energy.entry_pj", &GeometryPrices::entry_pj, "pJ", 0, 1e9,
       "Entry appended to a tile list, or read by a core with its record, memory traffic apart.",
       "[assumed] entry, cursor and a share of the record, 32 bytes twice on chip"},
      {"energy.sort_step_pj", &GeometryPrices::sort_step_pj, "pJ", 0, 1e9,
       "Entry passed on by a stage of the sorter of tile lists.",
       "[assumed] a comparison of a quarter of an operation, 8 bytes on chip"},
      {"energy.transform_pj", &GeometryPrices::transform_pj, "pJ", 0, 1e9,
       "Vertex put through the transforms of both motion keys again.", "[assumed] 40 operations of 1.15 pJ"},
      {"energy.vertex_pj", &GeometryPrices::vertex_pj, "pJ", 0, 1e9, "Vertex evaluated.",
       "[assumed] 130 operations of 1.15 pJ"},
      {"energy.box_pj", &GeometryPrices::box_pj, "pJ", 0, 1e9, "Box of a cell or a leaf built.", "[assumed]"},
      {"energy.box_test_pj", &GeometryPrices::box_test_pj, "pJ", 0, 1e9, "Box test.",
       "[assumed] 4 comparisons of a quarter of an operation, one read of 2 bytes"},
      {"energy.stencil_test_pj", &GeometryPrices::stencil_test_pj, "pJ", 0, 1e9,
       "Time of a sample tested against a stencil's references.",
       "[assumed] two comparisons of 8 bits, one read of a byte"},
      {"energy.sampling_operation_pj", &GeometryPrices::sampling_operation_pj, "pJ", 0, 1e9,
       "Operation of the SIMD array that evaluates procedures.", "[assumed] as the pixel shader's"},
      {"energy.triangle_test_pj", &GeometryPrices::triangle_test_pj, "pJ", 0, 1e9, "Sample tested against a triangle.",
       "[assumed] 7 operations of 1.15 pJ"},
      {"energy.alpha_test_pj", &GeometryPrices::alpha_test_pj, "pJ", 0, 1e9, "Alpha test.",
       "[assumed] a bilinear lookup and what it compares"},
      {"energy.depth_block_pj", &GeometryPrices::depth_block_pj, "pJ", 0, 1e9,
       "Block of 8x8 pixels whose farthest depth is found again, in a tile memory of 192 KiB; goes with the square "
       "root "
       "of tilecore.memory_bytes.",
       "[assumed] 4 samples a pixel: 256 depths, 2.5 pJ for 8 bytes"},
      {"energy.hit_pj", &GeometryPrices::hit_pj, "pJ", 0, 1e9,
       "Hit taken to a tile memory of 192 KiB; goes with the square root of tilecore.memory_bytes.",
       "[assumed] depth read, what a sample sees written"},
  };
}

Keys<EnergyPrices> energy_keys() {
  return {
      {"energy.compacted_sample_pj", &EnergyPrices::compacted_sample_pj, "pJ", 0, 1e9,
       "Visible sample or blended layer packed into a warp.", "[assumed] a few bytes moved on chip"},
      {"energy.shader_operation_pj", &EnergyPrices::shader_operation_pj, "pJ", 0, 1e9,
       "Operation of the pixel shader with its registers.", "[assumed] 1.15 pJ and a third more"},
      {"energy.texel_pj", &EnergyPrices::texel_pj, "pJ", 0, 1e9,
       "Bilinear lookup with a texture cache of 16 KiB; a third of it goes with the square root of the capacity.",
       "[assumed] 16 bytes on chip, 8 operations"},
      {"energy.l2_line_pj", &EnergyPrices::l2_line_pj, "pJ", 0, 1e9,
       "Line read from or filled into an L2 of 256 KiB; goes with the square root of l2.bytes.",
       "[assumed] ten times the small cache, 64 bytes"},
      {"energy.blend_pj", &EnergyPrices::blend_pj, "pJ", 0, 1e9, "Blended layer of a sample composed.",
       "[assumed] 4 operations of 1.15 pJ"},
      {"energy.resolved_pixel_pj", &EnergyPrices::resolved_pixel_pj, "pJ", 0, 1e9,
       "Pixel resolved, memory traffic apart.", "[assumed] 4 samples of 4 operations"},
      {"energy.resolve_operation_pj", &EnergyPrices::resolve_operation_pj, "pJ", 0, 1e9, "Operation of desampling.",
       "[assumed] a multiplication by 8 bits and an addition for four channels"},
      {"energy.leakage_mw_per_mm2", &EnergyPrices::leakage_mw_per_mm2, "mW/mm2", 0, 1e6,
       "Power of a mm2 that does nothing, at 0.8 V; goes with the voltage.",
       "[assumed] 60 mW for four cores in a warm phone", KeyEnds{3, 30}},
  };
}

// 45 nm: 0.012 mm2 for a fused operation of 32 bits (Horowitz); a 25th of that at 7 nm is assumed: 0.0005. Navi 10 and 14
// (7 nm, 249 mm2 with 2560 lanes, 157 with 1536) bound a lane with its share of all else: 0.09 mm2 at 1.8 GHz.
Keys<AreaPrices> area_keys() {
  constexpr double kMaxArea = 1e6;
  return {
      {"area.frontend_mm2", &AreaPrices::bound_mm2, "mm2", 0, kMaxArea, "Front end for each bound in a clock, at 7 nm.",
       "[assumed] 900 operations of 0.0005 mm2, twice with what stores them"},
      {"area.binner_mm2", &AreaPrices::binned_entry_mm2, "mm2", 0, kMaxArea,
       "Binner for each entry in a clock, or for four tested tiles if that is more.", "[assumed]"},
      {"area.core_mm2", &AreaPrices::core_mm2, "mm2", 0, kMaxArea,
       "What a core has whatever its rates: list fetch, sorter, warp scheduler, compaction, interfaces.", "[assumed]"},
      {"area.tessellator_mm2", &AreaPrices::vertex_mm2, "mm2", 0, kMaxArea,
       "Tessellator and box builder of a core for each vertex in a clock.",
       "[assumed] 130 operations of 0.0005 mm2, nearly twice with what stores them"},
      {"area.test_mm2", &AreaPrices::test_mm2, "mm2", 0, kMaxArea,
       "Lane of box or triangle tests; of stencil and alpha tests an eighth.",
       "[assumed] 7 operations of less than 32 bits"},
      {"area.lane_mm2", &AreaPrices::lane_mm2, "mm2", 0, kMaxArea,
       "Lane of the pixel shader or of the sampling array, without registers.",
       "[assumed] a fused operation of 0.0005 mm2, conversions, transcendentals, operands, issue"},
      {"area.texel_mm2", &AreaPrices::texel_mm2, "mm2", 0, kMaxArea,
       "Texture unit for each bilinear lookup in a clock, without its cache.", "[assumed] ten lanes"},
      {"area.pixel_mm2", &AreaPrices::pixel_mm2, "mm2", 0, kMaxArea,
       "Resolve and blending for each pixel, layer or 16 operations in a clock.", "[assumed] a lane"},
      {"area.sram_mm2_per_kib", &AreaPrices::sram_mm2_per_kib, "mm2/KiB", 0, kMaxArea, "Caches and tile memory.",
       "[spec] TSMC, 7 nm: cells of 0.027 um2, 0.00022 a KiB; a test chip of 256 Mbit takes 42.64 mm2, 0.0013; "
       "[assumed] "
       "between",
       KeyEnds{0.00022, 0.0013}},
      {"area.register_mm2_per_kib", &AreaPrices::register_mm2_per_kib, "mm2/KiB", 0, kMaxArea, "Registers of a core.",
       "[assumed] twice area.sram_mm2_per_kib: more ports"},
  };
}

Keys<SignatureUnits> signature_keys() {
  return {
      {"binner.signature_bytes_per_clk", &SignatureUnits::input_bytes_per_clk, "bytes/clk", kLeast, kMax,
       "With tile.rendering_elimination: bytes that the binner hashes, beside what it appends and tests.",
       "[assumed] as memory.gb_per_s brings records, 28 bytes a clock", KeyEnds{8, 64}},
      {"resolve.signature_bytes_per_clk", &SignatureUnits::color_bytes_per_clk, "bytes/clk", kLeast, kMax,
       "With frame_buffer.transaction_elimination: bytes of stored colours that a core hashes, beside resolving them.",
       "[assumed] four pixels of rgba16f, as resolve.pixels_per_clk", KeyEnds{8, 64}},
      {"energy.signature_byte_pj", &SignatureUnits::byte_pj, "pJ", 0, 1e9, "Byte hashed for a tile's signature.",
       "[assumed] 2.5 pJ for 8 bytes on chip; CRC-64 of a byte: 256 exclusive ors, as an addition", KeyEnds{0.1, 1}},
      {"area.signature_mm2", &SignatureUnits::byte_mm2, "mm2", 0, 1e6,
       "Hashing units of the eliminations that are on for each byte in a clock.",
       "[assumed] 256 exclusive ors and their share of a register, a fifth of a fused operation", KeyEnds{3e-5, 5e-4}},
  };
}

Keys<TriangleUnit> triangle_keys() {
  return {
      {"triangle_setup.triangles_per_clk", &TriangleUnit::triangles_per_clk, "triangles/clk", kLeast, kMax,
       "With --baselines: triangles that a machine which bins or draws them culls and sets up behind its vertex "
       "shader.",
       "[spec] 1 primitive per clock on Adreno"},
      {"energy.triangle_setup_pj", &TriangleUnit::triangle_pj, "pJ", 0, 1e9, "The same for one triangle.",
       "[assumed] 20 operations of 1.15 pJ, 8 bytes on chip"},
  };
}

}  // namespace

Keys<Machine> burst_keys() {
  return Keys<Machine>().add(&Machine::memory, Keys<MemoryInterface>{
                                                   {"memory.burst_bytes", &MemoryInterface::burst_bytes, "bytes", 16,
                                                    256, "Smallest amount the external memory interface moves.",
                                                    "[spec] LPDDR4 x16, burst length 16 = 32; two channels = 64"},
                                               });
}

Keys<Machine> machine_keys() {
  return speed_keys()
      .add(memory_keys())
      .add(&Machine::queues, queue_keys())
      .add(&Machine::geometry_energy, geometry_energy_keys())
      .add(&Machine::energy, energy_keys())
      .add(&Machine::area, area_keys())
      .add(&Machine::reprojection, reprojection_keys())
      .add(&Machine::signatures, signature_keys())
      .add(&Machine::triangles, triangle_keys())
      // What units do hangs on these: how warps are packed, and what the caches of the emulated order hold.
      .mark_timing_but({"shader.warp_lanes", "texture.cache_bytes", "l2.bytes", "l2.ways"});
}

}  // namespace tessera::hardware
