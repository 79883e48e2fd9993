# Made by python/make_stubs.py; do not edit.
import os
from collections.abc import Mapping
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

__version__: str

class Error(RuntimeError): ...
class InputError(Error): ...
class LimitError(Error): ...
class UsageError(Error): ...
class SystemError(Error): ...
class WriteError(SystemError): ...

Value = bool | int | float | str
Eye = Literal["left", "right"]

class GpuKeys(TypedDict, total=False):
    frontend__bound_method: Literal["aabb", "obb", "tpatch", "npatch", "interval"]  # Method that boxes sub-patches: object axes or the patch's own, displaced in every direction (aabb, obb) or along bounded normals (tpatch, npatch), or interval arithmetic.
    frontend__split_criterion: Literal["screen_extent", "frustum", "nearest", "normal_spread", "surface_area"]  # Criterion that chooses the sub-patches that are split further, and their order.
    frontend__split_pixels: float  # 1 to 65536 pixels. Sub-patches no wider than this on screen, at shutter open and close, are not split further.
    frontend__split_depth: int  # 0 to 12 splits. Most splits by the criterion between a base patch and a sub-patch; splits for tessellator.sub_patch_cells do not count.
    frontend__split_budget: int  # 1 to 4096 sub-patches. Most sub-patches that the criterion may make of one base patch.
    frontend__backface_culling: bool  # Whether sub-patches that face away are dropped before binning.
    frontend__previous_depth_culling: bool  # Whether instances and groups of patches that the previous frame's depths hide are deferred, tested again when the tiles are done, and rendered in a second pass if they were visible after all.
    tile__width: int  # 8 to 256 pixels. Width of the on-chip render area of one tile core.
    tile__height: int  # 8 to 256 pixels. Height of the on-chip render area of one tile core.
    tile__rendering_elimination: bool  # Whether a tile is not rendered, and its pixels stay as they are, when all that it would be rendered from has the signature (frame_buffer.signature_bits) of the frame before. Signatures are read and written in memory.
    tile__fit: bool  # Whether tiles have the largest power of two of pixels, from 64 to 4096, whose samples fit twice into tilecore.memory_bytes; tile.width and tile.height are then of no account. Samples that do not fit into a tile of 8x8 pixels are written to memory and read back.
    parameter_buffer__bytes: int  # 256 to 4.29497e+09 bytes. Memory that holds the tile lists and the sub-patch table.
    parameter_buffer__first_chunk_bytes: int  # 16 to 4096 bytes. First chunk of each list, which the number of the list addresses.
    parameter_buffer__chunk_bytes: int  # 32 to 2.09715e+06 bytes. Size of the further chunks in which lists get the parameter buffer.
    parameter_buffer__full_policy: Literal["partial_render", "spill"]  # Reaction to a full parameter buffer: render the sub-patches binned so far and go on, or continue in an overflow area.
    binner__coverage: Literal["rectangle", "exact"]  # Tiles that get an entry: all tiles of the bounding rectangle, or the tiles that the moving box itself may touch.
    binner__time_intervals: bool  # Stores in an entry the times at which the moving box may touch the tile, from the box against the tile's frustum; drops tiles that it touches at no time.
    binner__time_segments: int  # 0 to 16 segments. Pieces into which the shutter is cut, each with its own bounding rectangle; 0: the distance that the box's centre travels on screen, in units of the box's larger side (at least a tile).
    binner__queue_levels: int  # 1 to 5 levels. Levels of lists: single tiles, then groups of 2x2, 4x4, 8x8 and 16x16 tiles; every tile of a group reads the group's entries.
    binner__combining_bursts: int  # 1 to 65536 bursts. Bursts that the binner keeps open on chip to combine writes to lists, their cursors and the sub-patch table.
    tessellator__max_factor: int  # 1 to 64 cells. Largest number of cells along an edge of a base patch.
    tessellator__subpixel_bits: int  # 4 to 8 bits. Fractional bits of a vertex's place on screen: projected vertices lie on a grid of 2^-bits pixels. Samples keep their grid of 1/256.
    tessellator__sub_patch_cells: int  # 4 to 64 cells. Largest side of the sub-patches that the front end sends to the binner.
    tessellator__cache_bytes: int  # 0 to 1.07374e+09 bytes. On-chip memory that keeps the vertices of tessellated sub-patches for later tiles.
    baselines__cache_bytes: int  # 0 to 1.07374e+09 bytes. With --baselines: on-chip memory through which the tile cores of a machine that bins triangles read them; colour and depth cache of an immediate-mode machine.
    immediate__color_compression: bool  # With --baselines: whether an immediate-mode machine compresses colour without loss when that moves fewer bytes.
    visibility_stream__gmem_bytes: int  # 8192 to 1.07374e+09 bytes. With --baselines: tile memory of a machine that bins into visibility streams; its bins are as large as fit.
    tilecore__tile_order: Literal["rows", "strips", "morton", "hilbert"]  # Order in which cores are given tiles: row by row; in strips of eight rows, column by column; or along the curve of Morton (Z) or Hilbert. Along a curve a tile finds shared vertices and textures sooner again.
    tilecore__occlusion_culling: bool  # Whether a tile core drops entries that lie behind the surfaces of all samples of its tile, before it tessellates them.
    tilecore__visibility_method: Literal["patch-bvh", "brute", "segments", "partition", "clusters", "cluster-partition", "interleaved"]  # Method by which a tile core finds the samples of a moving or defocused sub-patch: its motion BVH; the rectangle of each cell's whole motion; a stencil test on time for segments of the shutter, for parts of the rectangle, or for either of whole leaves; a rectangle at each of the few times that samples then have. The image is the same for all but the last, which shows objects at just these times.
    tilecore__stencil_segments: int  # 0 to 256 segments. Segments of the shutter of the methods segments and clusters; 0: the primitive's motion in units of its own size, at most 64.
    tilecore__traversal: Literal["auto", "class", "ray"]  # Search of patch-bvh for samples: per class of the sample pattern (samples of one time, on a grid) from the moving box of a leaf, or each as a ray through the binary tree of the sub-patch's cells; auto: for each sub-patch one of these, or brute, with the least expected work: boxes built, tests of boxes and of triangles.
    tilecore__branch_node: Literal["root", "both_children", "leaf_mask"]  # With rays (tilecore.traversal): start node of the rays of 4x4 pixels: the root; the first node with both children inside their frustum; the lowest node above all leaves inside.
    tilecore__blend_layers: int  # 1 to 64 layers. Blended surfaces of one sample that a tile core keeps in order; with more, the two farthest become one.
    tilecore__weight_bits: int  # 8 to 32 bits. Bits of each of the two weights by which a sample in the tile memory names its place in its triangle. From 24 on weights keep their single precision.
    shading_cache__entries: int  # 1 to 1.04858e+06 cells. With shading.rate=cache: shaded cells that a tile core keeps on chip, 24 bytes each, in an LRU cache.
    memory__burst_bytes: int  # 16 to 256 bytes. Smallest amount the external memory interface moves: 16, 32, 64, 128 or 256.
    frame_buffer__format: Literal["rgba8", "rgb10a2", "rgba16f"]  # Format of finished pixels in memory: sRGB codes of 8 or 10 bits, 4 bytes a pixel, of light times exposure that the store tone-maps; or half floats of linear light, 8 bytes a pixel. EXR files keep the light from before the store, PNG files show rgba8.
    frame_buffer__compression: Literal["none", "lossless"]  # Whether tile cores compress finished pixels on their way to memory, in blocks of 256 bytes; saves traffic, not room. All that passes store for later ones is compressed as well, but for shadow maps and the image behind surfaces that transmit.
    frame_buffer__transaction_elimination: bool  # Whether tile cores leave a tile's pixels unwritten when their signature equals the previous frame's; they read and write signatures in memory. The first of several frames is written whole. Each attachment that passes store for later ones has signatures of its own.
    frame_buffer__signature_bits: int  # 4 to 64 bits. Width of a tile's signature, the lowest bits of a CRC-64, in whole bytes of memory. Narrow signatures match for tiles that differ, and images show it.
    geometry__encoding: Literal["raw", "quantised", "meshlet", "dgf"]  # How the memory holds clusters and Bezier patches whose vertices rest: floats (raw); positions of geometry.bits on one grid for each mesh (quantised); as many bits as the box of each record needs, and triangles coded by the edges that they share (meshlet); or clusters as blocks of 128 bytes of AMD's Dense Geometry Format, and patches as with meshlet (dgf). The reader of a record decodes it: frontend.decoded_per_clk, tessellator.decoded_per_clk.
    geometry__bits: int  # 8 to 16 bits. With geometry.encoding=quantised, meshlet or dgf: bits of a coordinate along the longest side of a mesh's box; never finer than floats are there, with dgf than half as fine.
    clock__mhz: float  # 1 to 10000 MHz. Clock of the whole GPU; cycles everywhere are cycles of this clock.
    voltage__nominal_mhz: float  # 1 to 10000 MHz. Clock that the GPU reaches at 0.8 V, for which energies and leakage are given. Other clocks have other voltages (hardware/voltage.h); energy of an event goes with their square, the memory's stays.
    tilecore__count: int  # 1 to 64 cores. Tile cores, fed by one tile scheduler.
    frontend__reprojected_blocks_per_clk: float  # 0.000976562 to 65536 blocks/clk. Blocks of the previous frame's depths that the front end reprojects into the current view.
    frontend__bounds_per_clk: float  # 0.000976562 to 65536 bounds/clk. Bounding volumes that the front end computes.
    frontend__record_lines_per_clk: float  # 0.000976562 to 65536 lines/clk. Lines of records that the front end reads through the L2.
    frontend__decoded_per_clk: float  # 0.000976562 to 65536 elements/clk. With geometry.encoding: positions of records that the front end's decoder gives.
    frontend__depth_tests_per_clk: float  # 0.000976562 to 65536 blocks/clk. Blocks whose farthest depth the front end compares with the nearest one of a bound.
    triangle_setup__triangles_per_clk: float  # 0.000976562 to 65536 triangles/clk. With --baselines: triangles that each core of a machine that bins or draws triangles culls and sets up after the vertex shader.
    binner__entries_per_clk: float  # 0.000976562 to 65536 entries/clk. Entries of lists that the binner appends.
    binner__tiles_per_clk: float  # 0.000976562 to 65536 tiles/clk. Tiles that the binner tests against a sub-patch.
    binner__signature_bytes_per_clk: float  # 0.000976562 to 65536 bytes/clk. With tile.rendering_elimination: bytes that the binner hashes while it appends and tests.
    tilecore__entries_per_clk: float  # 0.000976562 to 65536 entries/clk. Entries of lists that a core reads, looks up in the sub-patch table and tests for occlusion.
    tilecore__sort_steps_per_clk: float  # 0.000976562 to 65536 steps/clk. Entries that a core's merge sorter passes from one stage to the next, all stages together.
    tessellator__vertices_per_clk: float  # 0.000976562 to 65536 vertices/clk. Vertices that a core's tessellator evaluates, both motion keys together.
    tessellator__transforms_per_clk: float  # 0.000976562 to 65536 vertices/clk. Vertices of moving objects, kept in object space, that a core puts through the transforms of both motion keys.
    tessellator__decoded_per_clk: float  # 0.000976562 to 65536 elements/clk. With geometry.encoding: positions and coded cells of records that a core's decoder gives.
    tilecore__boxes_per_clk: float  # 0.000976562 to 65536 boxes/clk. Boxes of cells and leaves that a core builds.
    tilecore__box_tests_per_clk: float  # 0.000976562 to 65536 tests/clk. Lanes of box tests of a core.
    tilecore__stencil_tests_per_clk: float  # 0.000976562 to 65536 tests/clk. Samples whose time a core's stencil unit tests.
    procedures__operations_per_clk: float  # 0.000976562 to 65536 operations/clk. Operations of the SIMD array that evaluates procedures, in each core; the sparse pass has one array.
    tilecore__triangle_tests_per_clk: float  # 0.000976562 to 65536 tests/clk. Lanes of a core for samples tested against a triangle, 16 at a time.
    tilecore__alpha_tests_per_clk: float  # 0.000976562 to 65536 tests/clk. Alpha tests of a core.
    tilecore__mask_vertices_per_clk: float  # 0.000976562 to 65536 vertices/clk. Vertices whose texture coordinate a core computes for alpha tests to interpolate.
    tilecore__depth_blocks_per_clk: float  # 0.000976562 to 65536 blocks/clk. 8x8 HiZ blocks that a core updates or compares entries with.
    tilecore__compaction_per_clk: float  # 0.000976562 to 65536 samples/clk. Visible samples, blended layers, samples that see the environment and vertices that pixels interpolate, which a core packs into warps.
    texture__texels_per_clk: float  # 0.000976562 to 65536 texels/clk. Bilinear lookups of a core's texture unit; a trilinear one is two.
    tilecore__blends_per_clk: float  # 0.000976562 to 65536 layers/clk. Blended layers of samples that a core composes.
    resolve__pixels_per_clk: float  # 0.000976562 to 65536 pixels/clk. Pixels that a core's resolve unit finishes.
    resolve__operations_per_clk: float  # 0.000976562 to 65536 operations/clk. Operations of desampling: velocities, advected pixels, taps of stencils.
    resolve__signature_bytes_per_clk: float  # 0.000976562 to 65536 bytes/clk. With frame_buffer.transaction_elimination: bytes of stored pixels that a core hashes while it resolves them.
    resolve__coded_per_clk: float  # 0.000976562 to 65536 pixels/clk. Pixels that a core tone-maps and codes for a frame buffer, or an attachment, of rgba8 or rgb10a2, or that desampling decodes.
    resolve__compressed_per_clk: float  # 0.000976562 to 65536 pixels/clk. With frame_buffer.compression: pixels that a core compresses, or that desampling or a load decompresses.
    shader__lanes: int  # 1 to 4096 lanes. Operations of the pixel shader that a core does per clock.
    shader__warp_lanes: int  # 4 to 128 lanes. Invocations of a warp. Warps are whole, each of one draw; the texture unit gets their lookups together.
    shader__costs: Literal["constant", "compiled"]  # With machine.timing=events: source of a warp's time on the lanes and of its registers. constant: shader.operations, shader.surface_operations, shader.background_operations and shader.registers; compiled: the shader of its material as LLVM compiles it for gfx1030.
    shader__operations: float  # 1 to 1e+06 operations. Operations of one pixel-shader invocation on one lane.
    shader__surface_operations: float  # 0 to 1e+06 operations. Operations on one lane that evaluate a patch's surface, with constant costs: for a pixel-shader invocation, besides shader.operations, and for a vertex with tessellator.domain_shading=lanes.
    shader__background_operations: float  # 0 to 1e+06 operations. Operations on one lane for a sample that sees the environment, with constant costs.
    tessellator__domain_shading: Literal["unit", "lanes"]  # Unit that evaluates vertices: a unit of the tessellator, at tessellator.vertices_per_clk; or the shader's lanes, in warps that go before pixel warps and look heights up in the texture unit. Vertices that are on chip go through tessellator.transforms_per_clk either way.
    tilecore__memory_bytes: int  # 1024 to 1.07374e+09 bytes. On-chip tile memory of a core. A core works on as many tiles at once as fit with the data of their samples (it tests the samples of one tile while it shades another). The memory of a preset grows to fit one tile; a smaller value that the user sets is refused.
    texture__cache_bytes: int  # 256 to 1.67772e+07 bytes. Texture cache (L1) of a core.
    l2__bytes: int  # 0 to 1.07374e+09 bytes. L2 that all cores share, for textures, displacement maps and records of base patches; 0: no L2. Data that are written once bypass it.
    l2__ways: int  # 1 to 64 ways. Associativity of the L2.
    memory__model: Literal["fluid", "banks"]  # With machine.timing=events: the external memory as bytes at memory.gb_per_s (fluid), or as channels, banks and rows of memory.type with a controller that sorts requests (banks).
    memory__type: Literal["lpddr4x-4266", "lpddr5-6400", "lpddr5x-8533", "lpddr4-3200"]  # With memory.model=banks: kind of the channels of 16 bits, which have their own clock; memory.gb_per_s, memory.latency_ns and memory.gpu_share are then not used.
    memory__channels: int  # 1 to 16 channels. With memory.model=banks: channels of 16 bits, a power of two.
    memory__gb_per_s: float  # 0.001 to 100000 GB/s. Peak rate of the external memory. memory.bytes_per_clk sets it too, by the clock.mhz of that moment.
    memory__gpu_share: float  # 0.01 to 1. Part of the peak rate that the GPU gets: refresh, turn-around, other users.
    memory__latency_ns: float  # 0 to 100000 ns. Time from a read to its data on an idle memory. memory.latency_clk sets it too, by the clock.mhz of that moment.
    memory__pj_per_bit: float  # 0 to 1000 pJ/bit. Energy of a bit over the external interface, memory, interface and controller together.
    machine__timing: Literal["phases", "events"]  # Timing model of a frame. phases: each phase of a tile is one pipeline; events: every sub-patch, warp and cache line passes separately through queues of these sizes.
    machine__overlap: Literal["none", "passes", "frames"]  # Work that may begin while tiles are rendered. none: no other work; passes: patches and tiles of later passes that do not need those tiles; frames: also patches of the next frame. With frames, cycles count from one frame to the next in a sequence of equal frames, and the latency is twice as long. passes and frames need a second parameter buffer.
    machine__caches: Literal["empty", "warm"]  # With machine.timing=events: content of the L2 and the texture caches when a frame begins: empty, or as the previous frame left it.
    tilecore__queue_items: int  # 1 to 1024 sub-patches. Sub-patches that may wait between one unit of a core and the next.
    tilecore__fetched_lines: int  # 1 to 65536 lines. Lines of records and heights that a core has requested and not yet received.
    frontend__fetched_lines: int  # 1 to 65536 lines. Lines of tables of heights that the front end has requested from the L2 and not yet received.
    resolve__store_bytes: int  # 64 to 1.04858e+06 bytes. Bytes written by a core that may wait for the memory before its resolve unit stops.
    texture__requests: int  # 1 to 4096 lines. Lines that a core's texture cache has requested from the L2 and not yet received.
    texture__latency_clk: float  # 0 to 10000 clk. Time of a lookup that hits the texture cache.
    l2__banks: int  # 1 to 64 banks. Banks of the L2, by the number of the line.
    l2__lines_per_clk: float  # 0.000976562 to 64 lines/clk. Lines that a bank reads or writes per clock.
    l2__latency_clk: float  # 0 to 10000 clk. Time of a request that hits the L2.
    l2__requests: int  # 1 to 65536 lines. Lines that the L2 has requested from the memory and not yet received.
    shader__max_warps: int  # 1 to 4096 warps. Warps that a core holds at once.
    shader__register_bytes: int  # 1024 to 6.71089e+07 bytes. Registers of a core.
    shader__registers: int  # 1 to 1024 registers. Registers of 4 bytes that an invocation takes; with shader.register_bytes they limit the warps in flight.
    machine__target_fps: float  # 0 to 10000 frames/s. Frame rate at which energy.power_w holds, or the rate that the machine reaches if that is lower; 0: the rate that the machine reaches.
    energy__power_gating: Literal["none", "between_frames"]  # When the GPU's supply is cut: never (none), so that it leaks all the time, or between_frames.
    energy__reprojected_block_pj: float  # 0 to 1e+09 pJ. Block of the previous frame's depths reprojected into the current view.
    energy__bound_pj: float  # 0 to 1e+09 pJ. Bounding volume of a sub-patch.
    energy__depth_test_pj: float  # 0 to 1e+09 pJ. Block's farthest depth compared with the nearest one of a bound.
    energy__triangle_setup_pj: float  # 0 to 1e+09 pJ. With --baselines: triangle culled and set up.
    energy__entry_pj: float  # 0 to 1e+09 pJ. Entry appended to a tile list, or read by a core with its record, memory traffic apart.
    energy__signature_byte_pj: float  # 0 to 1e+09 pJ. Byte hashed for a tile's signature.
    energy__sort_step_pj: float  # 0 to 1e+09 pJ. Entry passed on by a stage of the sorter of tile lists.
    energy__vertex_pj: float  # 0 to 1e+09 pJ. Vertex evaluated.
    energy__transform_pj: float  # 0 to 1e+09 pJ. Vertex put through the transforms of both motion keys again.
    energy__decoded_element_pj: float  # 0 to 1e+09 pJ. Position or cell of a record decoded, memory traffic apart.
    energy__box_pj: float  # 0 to 1e+09 pJ. Box of a cell or a leaf built.
    energy__box_test_pj: float  # 0 to 1e+09 pJ. Box test.
    energy__stencil_test_pj: float  # 0 to 1e+09 pJ. Time of a sample tested against a stencil's references.
    energy__sampling_operation_pj: float  # 0 to 1e+09 pJ. Operation of the SIMD array that evaluates procedures.
    energy__triangle_test_pj: float  # 0 to 1e+09 pJ. Sample tested against a triangle.
    energy__hit_pj: float  # 0 to 1e+09 pJ. Hit taken to a tile memory of 192 KiB; goes with the square root of tilecore.memory_bytes.
    energy__alpha_test_pj: float  # 0 to 1e+09 pJ. Alpha test.
    energy__mask_vertex_pj: float  # 0 to 1e+09 pJ. Texture coordinate of a vertex computed.
    energy__depth_block_pj: float  # 0 to 1e+09 pJ. 8x8 HiZ block updated, in a tile memory of 192 KiB; goes with the square root of tilecore.memory_bytes.
    energy__compacted_sample_pj: float  # 0 to 1e+09 pJ. Sample, layer or vertex packed into a warp.
    energy__place_pj: float  # 0 to 1e+09 pJ. Position at shutter open of a surface point that a sample sees at another place, found from its triangle's corners.
    energy__tile_byte_pj: float  # 0 to 1e+09 pJ. Byte of a vertex that pixels interpolate, or of a table of triangles, written to or read from a tile memory of 192 KiB; goes with the square root of tilecore.memory_bytes.
    energy__shader_operation_pj: float  # 0 to 1e+09 pJ. Instruction of a shader on one lane: its arithmetic, its registers, its fetch and its issue.
    energy__texel_pj: float  # 0 to 1e+09 pJ. Bilinear lookup with a texture cache of 16 KiB; a third of it goes with the square root of the capacity.
    energy__decoded_texel_pj: float  # 0 to 1e+09 pJ. Texels of a bilinear lookup decoded from blocks of a compressed texture, beside the lookup.
    energy__l2_line_pj: float  # 0 to 1e+09 pJ. Line read from or filled into an L2 of 256 KiB; goes with the square root of l2.bytes.
    energy__blend_pj: float  # 0 to 1e+09 pJ. Blended layer of a sample composed.
    energy__resolved_pixel_pj: float  # 0 to 1e+09 pJ. Pixel resolved, memory traffic apart.
    energy__resolve_operation_pj: float  # 0 to 1e+09 pJ. Operation of desampling.
    energy__coded_pixel_pj: float  # 0 to 1e+09 pJ. Pixel tone-mapped and coded for a frame buffer of rgba8 or rgb10a2, or decoded.
    energy__compressed_pixel_pj: float  # 0 to 1e+09 pJ. Pixel of the frame buffer or of an attachment compressed or decompressed.
    area__frontend_mm2: float  # 0 to 1e+06 mm2. Front end for each bound in a clock, at 7 nm.
    area__binner_mm2: float  # 0 to 1e+06 mm2. Binner for each entry in a clock, or for four tested tiles if that is more.
    area__tessellator_mm2: float  # 0 to 1e+06 mm2. Tessellator and box builder of a core for each vertex in a clock.
    area__decoder_mm2: float  # 0 to 1e+06 mm2. With geometry.encoding: decoder of records for each position or cell in a clock.
    area__test_mm2: float  # 0 to 1e+06 mm2. Lane of box or triangle tests; of stencil and alpha tests an eighth.
    area__pixel_mm2: float  # 0 to 1e+06 mm2. Resolve and blending for each pixel, layer or 16 operations in a clock.
    area__signature_mm2: float  # 0 to 1e+06 mm2. Hashing units of the eliminations that are on for each byte in a clock.
    area__lane_mm2: float  # 0 to 1e+06 mm2. Lane of the pixel shader or of the sampling array, without registers.
    area__texel_mm2: float  # 0 to 1e+06 mm2. Texture unit for each bilinear lookup in a clock, without its cache.
    area__core_mm2: float  # 0 to 1e+06 mm2. Fixed part of a core, independent of its rates: list fetch, sorter, warp scheduler, compaction, interfaces.
    area__sram_mm2_per_kib: float  # 0 to 1e+06 mm2/KiB. Caches and tile memory.
    area__register_mm2_per_kib: float  # 0 to 1e+06 mm2/KiB. Registers of a core.
    energy__leakage_mw_per_mm2: float  # 0 to 1e+06 mW/mm2. Leakage power of a mm2 at 0.8 V; proportional to the voltage.

class SettingsKeys(TypedDict, total=False):
    sampling__samples_per_pixel: int  # 1 to 64 samples. Visibility samples per pixel; the same as --spp.
    sampling__seed: int  # 0 to 4.29497e+09. Chooses among equally good sample patterns; the same as --seed.
    sampling__temporal_pattern: Literal["8x8", "32x32"]  # Pixels after which the pattern of sample times repeats; the larger one shows less of itself and is slower to replay.
    sampling__time_bits: Literal["8", "16"]  # Precision of a sample's time; the stencil unit sees the upper 8 bits. A frame of more than 7 motion segments has 16.
    sampling__times: int  # 0 to 256 times. Distinct times of samples; with few of them a fast object appears at as many places. 0: 16 with tilecore.visibility_method=interleaved, else as many as the pattern and the precision have.
    sampling__motion_segments: int  # 0 to 2048 segments. Straight pieces that approximate the curved motion of a shutter, of surfaces that turn, bend or swing. Each piece is bounded, binned and tessellated separately. 0: as many as sampling.motion_error needs; otherwise at most this number, cut for the least error.
    sampling__motion_error: float  # 0.01 to 100 pixels. Largest distance of a piece of motion from the curve, with sampling.motion_segments=0.
    sampling__motion_segments_max: int  # 2 to 2048 segments. Most pieces that sampling.motion_segments=0 cuts a shutter into; a note appears if they do not reach sampling.motion_error.
    tessellation__target_edge_pixels: float  # 0.25 to 64 pixels. Wanted length on screen of the sides of tessellated cells; smaller is more exact and slower.
    tessellation__displacement_bias: float  # -16 to 16 levels. Added to the level of the height map that vertices and normals are made from; 0 fits it to the tessellated cells, more is smoother, less aliases.
    texture__format: Literal["stored", "etc2", "astc-4x4", "astc-5x5", "astc-6x6", "astc-8x8", "astc-10x10", "astc-12x12"]  # How memory holds textures. stored: PNG, JPEG and WebP images as texels of 4 bytes, KTX2 images as ASTC blocks of 4x4 texels. Else all are encoded to blocks: ETC2 of 4x4 texels (8 bytes, 16 with alpha), ASTC of so many texels (16 bytes). Images show the decoded blocks. Displacement maps stay as they are stored.
    shading__rate: Literal["pixel", "primitive", "sample", "cache"]  # Pixel-shader invocations: once per pixel and primitive (multisampling) with adjacent triangles of a smooth surface merged (pixel) or not (primitive), once per visible sample, or once per cell of the surface about a pixel wide, while the shading cache holds it.
    shading__derivatives: Literal["analytic", "quad"]  # Derivatives of texture coordinates: the surface's own, or differences within quads of 2x2 invocations, which take helper invocations where a surface does not cover all four pixels. With shading.rate=cache analytic.
    shading__cell_pixels: float  # 0.125 to 16 pixels. With shading.rate=cache: wanted width of a shading cell on screen; smaller is sharper and slower.
    shading__surface: Literal["evaluated", "interpolated", "frame"]  # Source of the surface of a Bezier patch in a pixel-shader invocation: it evaluates the patch again; or it interpolates between vertices of the triangle that it sees, which a core evaluates once for each tile that sees them and keeps in the tile memory; or, frame, it does so with normals without the displacement and adds the gradient of the height map, by four lookups, as for a normal map made from the heights. Alpha tests, and cells of shading.rate=cache, do likewise.
    shading__attributes: Literal["float", "half"]  # Precision of interpolated attributes (texture coordinates, colours, normals) on their way to the pixel shader: single, or half as in GLSL's mediump. Baselines that keep vertices in memory store and read 4 or 2 bytes for each component of an attribute; positions stay single.
    shading__light_lists: Literal["off", "ranged", "all"]  # Light lists: tiles find the lights that reach their surfaces, and pixel shaders loop over these alone: never (off), in frames with at least eight point or spot lights that have a range (ranged), or with any such light, whose cones are then tested (all). Images have the same bits.
    shading__path: Literal["visibility", "prepass", "gbuffer", "gbuffer_external"]  # How opaque surfaces come to be shaded: by one shader where visible triangles are known (visibility); likewise, behind a pass that stores depths, which hide sub-patches (prepass); by a shader that leaves material and normal in the tile memory and one that lights them there (gbuffer); or by a pass that stores this G-buffer and another one that loads it (gbuffer_external). Unlit, layered and blended surfaces and procedures have one shader on all paths.
    gbuffer__layout: Literal["exact", "packed"]  # Contents of a sample of the G-buffer: 64 bytes, and images have the bits of shading.path=visibility (exact), or 16 bytes, which round base colour, normal, metalness, roughness, occlusion and emission (packed).
    gbuffer__bits: int  # 96 to 1024 bits. With gbuffer.layout=packed: bits of a sample of the G-buffer, a multiple of 32. Bits beyond 128 are written, kept, moved and read like the others, and light nothing. With 96 it has no emission: surfaces that emit have one shader, as unlit ones do.
    effects__motion: Literal["auto", "on", "off"]  # Motion blur: on request of the capture; with the general kernels everywhere (same image); never.
    effects__defocus: Literal["auto", "on", "off"]  # Defocus blur: on request of the capture's lens; with the general kernels everywhere (same image); never.
    effects__displacement: Literal["auto", "on", "off"]  # Displacement: where the capture's maps are not zero; wherever it has maps (same image); never.
    effects__alpha_test: Literal["auto", "on", "off"]  # Alpha test: where a masked material may be transparent; all over it (same image); never, so that masked surfaces are opaque.
    effects__blending: Literal["auto", "off"]  # Blending: on request of the capture; never, so that blended surfaces are opaque.
    effects__procedures: Literal["auto", "off"]  # Procedures: all of the capture's are drawn; none.
    effects__shadows: Literal["auto", "off", "all"]  # Shadows: of the lights that the capture names; none; or of all lights, with four maps of 1024 texels a side for a directional one, and one map of that size for each direction that another light needs.
    shadows__filter: Literal["nearest", "2x2", "3x3"]  # How a shadow is looked up: one comparison with the nearest texel; four, weighed bilinearly (2x2); or a box of three by three of these, which reads 16 texels (3x3).
    shadows__format: Literal["d16", "d24", "d32f"]  # How maps hold depths, which are linear between the nearest and the farthest caster: 16 bits, 24 bits in 4 bytes, or single precision.
    shadows__size: int  # 0 to 16384 texels. Along the sides of all maps; 0 takes the capture's.
    shadows__cascades: int  # 0 to 8. Maps of a directional light; 0 takes the capture's.
    shadows__fit: Literal["sphere", "frustum", "receivers"]  # How maps of a directional light lie over their parts of the view: over the sphere around the part, in steps of whole texels, so that edges stand still while the camera moves; over the part's own box; or over the box of the shadow receivers in it.
    shadows__faces: Literal["both", "front", "back"]  # Which sides of single-sided surfaces cast.
    shadows__blended: Literal["none", "solid"]  # Whether blended surfaces cast none, or as if they were opaque.
    shadows__grids: Literal["light", "camera"]  # Which view sets the tessellation of patches in a map: the light's own, or the camera's. With the camera's a still surface is the same triangles in both views, and curved or displaced surfaces do not shade themselves.
    shadows__times: int  # 1 to 16. Times of the shutter of which each light has maps, evenly spread, where anything moves. Receivers that move are looked up where they are at the time of a map, in the maps of all times, and the mean is taken.
    shadows__bias: float  # 0 to 64. Factor on the bias of a lookup: half a texel of the receiver's slope, half a step of the depths' format, and the shift by rounding vertices to sub-pixels.
    shadows__offset: float  # 0 to 1e+06 scene units. Is added to the bias of a lookup.
    shadows__max_slope: float  # 0 to 1e+06. The steepest slope, depth over width, that the bias and the texels around a lookup take of a receiver.
    procedures__path: Literal["sampled", "tessellated"]  # Drawing of procedures: by the sampling controller, or as ordinary patches whose vertices the procedure evaluates.
    procedures__mode: Literal["interval", "published"]  # Method of the sampling controller: cells bounded by interval evaluation and samples that cover their footprints; or, as published, one tuple per cell with a padded radius, samples written to the sub-pixel that holds them (unless they move or are out of focus), and geometry images read through the core's texture cache.
    procedures__style: Literal["surface", "lines"]  # Shaded surfaces, or a drawing with lines along the parameters.
    procedures__spacing: float  # 0.125 to 64 sub-pixels. Samples are so dense that no footprint reaches farther than this from its middle; smaller is more exact and slower. In published mode at most 1, between samples.
    procedures__flatness: float  # 0.001 to 64 pixels. Samples are also so dense that a smooth surface leaves the plane of a footprint by no more than this.
    procedures__cell_pixels: float  # 1 to 512 pixels. Interval mode: cells of the parameter domain larger than this on screen are halved.
    procedures__padding: float  # 0 to 16. Published mode: padding of a cell's place on screen, in its radius.
    procedures__sparse_spacing: float  # 0.5 to 256 sub-pixels. Published mode: distance of the tuples of the sparse pass.
    resolve__desampling: Literal["off", "adaptive", "fixed_8", "fixed_4", "checkerboard"]  # Choice of the shaded pixels: all; by motion, edges and history; half or a quarter of every block; half, alternating, filled from four neighbours. The others are advected or reconstructed.
    resolve__reuse_speed: float  # 0 to 64 pixels/frame. Blocks slower than this take pixels from the previous frame (resolve.advected_pixels).
    resolve__half_rate_speed: float  # 0 to 1e+06 pixels/frame. Blocks faster than this are shaded at 8 of 16 pixels.
    resolve__quarter_rate_speed: float  # 0 to 1e+06 pixels/frame. Blocks faster than this are shaded at 4 of 16 pixels.
    resolve__cut_speed: float  # 0 to 1e+06 pixels/frame. A change of the camera's motion from one frame to the next by more than this is a cut: no block then counts as fast. 0: no change is a cut.
    resolve__hysteresis: float  # 0 to 0.5. Share of a threshold by which a speed must pass it before a block changes its regime.
    resolve__pattern_error: float  # 0 to 1. A fast block is shaded at a higher rate if the contrast of the previous frame in its place predicts an error of stencils of more than this, of displayed values between 0 and 1; 0: never.
    resolve__block_speed: Literal["mean", "max", "median", "min"]  # Statistic of its pixels' speeds that a block goes by; max does not overlook a small fast object.
    resolve__edges: Literal["inverse_depth", "depth"]  # Quantity of which the edge detector takes the Laplacian; the Laplacian of 1/z is zero on any plane.
    resolve__edge_threshold: float  # 0 to 10. A pixel whose Laplacian is larger than this share of the value is an edge.
    resolve__edge_angle: float  # 0 to 180 degrees. Normals in a block, which follow from depth, also make an edge if they differ by more than this; 0: never.
    resolve__supersampling: bool  # Blocks with an edge are shaded at 32 instead of 16: the left and the right half of a pixel's samples do not share pixel-shader invocations (shading.rate=pixel).
    resolve__advected_pixels: int  # 8 to 12 of 16 pixels. Number of pixels of a slow block that come from the previous frame, 8 or 12; the others are shaded. Always 8 if several surfaces meet.
    resolve__dither: Literal["counter", "seeded", "off"]  # Change of a block's pattern from frame to frame: in turn, by a hash, not at all.
    resolve__advection: bool  # Slow blocks take pixels from the previous frame.
    resolve__advection_fetch: Literal["bilinear", "bicubic"]  # Interpolation of the previous frame between its pixels.
    resolve__bfecc: bool  # Back and forth error compensation of advection.
    resolve__discrepancy: Literal["rendered", "off"]  # Test whether reprojection went wrong in a block: it compares rendered pixels with their reprojected colours. If they differ the block's reprojected pixels are shaded after all, and blocks around it reuse no pixels in the next frames.
    resolve__discrepancy_tolerance: float  # 0 to 1. A pixel that differs by more than this share was reprojected wrongly.
    resolve__discrepancy_frames: int  # 1 to 15 frames. Number of frames for which the blocks around a wrongly reprojected one are shaded fully.
    resolve__reconstruction: Literal["cubic", "cubic_interpolating", "cubic_unscaled", "bilinear", "nearest"]  # Reconstruction of missing pixels from rendered ones: cubic stencils of 5x5 scaled to the samples, of 7x7 interpolating, unscaled; a tent; the nearest.
    resolve__history_colors: Literal["frame_buffer", "apart"]  # Source of the previous frame's colours: the frame buffer, or a separate copy as shaded, in single precision, 16 bytes a pixel.
    resolve__stencil_reach: Literal["tile", "neighbours"]  # Whether stencils stop at the tile's border, or read neighbouring tiles in a second pass.
    resolve__foveation_r0: float  # 0 to 1e+06 pixels. Foveation: blocks farther than this from the focus get at most 8 samples; 0 is off.
    resolve__foveation_r1: float  # 0 to 1e+06 pixels. Foveation: blocks farther than this get at most 4; at least foveation_r0.
    resolve__focus_x: float  # 0 to 1 frame widths. Focus of the gaze, from the left.
    resolve__focus_y: float  # 0 to 1 frame heights. Focus of the gaze, from the top.
    resolve__focus_node: str  # Name of a node that the focus follows: its origin in the middle of the shutter; focus_x and focus_y if that is behind the camera.
    stereo__eye_separation: float  # 0 to 1e+06 scene units. Renders a second image for a right eye this far to the right of the camera, which is the left eye; 0 is one eye.
    stereo__far_depth: float  # 0 to 1e+09 scene units. With desampling the right eye takes pixels from the left eye if both see farther than this.
    post__bloom: float  # 0 to 1. Share of a pixel's light that the bloom of a capture spreads around it; 0 leaves the passes of the bloom out.
    post__bloom_levels: int  # 0 to 15. Levels of a bloom; 0 takes the number of levels of the capture's attachment.
    post__taa: float  # 0 to 1. Share of the new frame in the temporal antialiasing of a capture. The first frames behind a cut take more of it, as a mean of them all needs; 0 leaves the pass and the velocities out, and frames are not jittered.
    output__machine_model: bool  # Whether texture caches, cycles and energy are modelled; without, their counters and the members timing and energy are absent.
    output__exposure: float  # 0 to 1e+06. Factor on light before the PNG's tone map; 0 takes the capture's.

class Scene:
    def __init__(
        self, file: str | os.PathLike[str], *, max_bytes: int = 4294967296, max_file_bytes: int = 2147483648,
        strict: bool = False, variant: str | None = None, scene: str | int | None = None,
        camera: str | int | None = None, animation: str | int | None = None, orbit: str | float | None = None,
        lens: str | float | None = None, shutter: str | None = None,
    ) -> None: ...
    @property
    def file(self) -> str: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def frame_rate(self) -> float: ...
    @property
    def frames(self) -> range: ...
    @property
    def variants(self) -> list[str]: ...
    @property
    def shadows(self) -> list[dict[str, Any]]: ...
    @property
    def passes(self) -> list[str]: ...
    @property
    def notices(self) -> list[str]: ...

class Gpu:
    def __init__(self, machine: str | Mapping[str, Any] | Gpu | None = "mid-mobile", **keys: Unpack[GpuKeys]) -> None: ...
    @staticmethod
    def from_json(text: str) -> Gpu: ...
    @staticmethod
    def presets() -> list[str]: ...
    def set(self, key: str, value: Value) -> None: ...
    def get(self, key: str) -> Value: ...
    def __setitem__(self, key: str, value: Value) -> None: ...
    def __getitem__(self, key: str) -> Value: ...
    def json(self) -> str: ...

class Settings:
    def __init__(self, values: Mapping[str, Any] | Settings | None = None, **keys: Unpack[SettingsKeys]) -> None: ...
    def set(self, key: str, value: Value) -> None: ...
    def get(self, key: str) -> Value: ...
    def __setitem__(self, key: str, value: Value) -> None: ...
    def __getitem__(self, key: str) -> Value: ...
    def json(self) -> str: ...

class Device:
    def __init__(
        self,
        scene: Scene,
        gpu: str | Mapping[str, Any] | Gpu | None = None,
        settings: Mapping[str, Any] | Settings | None = None,
        *,
        width: int = 0,
        height: int = 0,
        region: tuple[int, int, int, int] | None = None,
        auxiliary: bool = False,
        resolve_auxiliary: bool = False,
        max_image_bytes: int = 4294967296,
        **keys: Unpack[SettingsKeys],
    ) -> None: ...
    def render(self, frame: int) -> Frame: ...
    @property
    def automatic_camera(self) -> bool: ...

class FramePass(TypedDict):
    name: str
    begin_cycles: float
    end_cycles: float
    counters: dict[str, int]
    traffic: list[dict[str, Any]]

class FrameTiming(TypedDict):
    cycles: float
    latency_cycles: float
    busy_cycles: dict[str, float]
    bound_by: str
    bound_by_cycles: float

class FrameEnergy(TypedDict):
    total_nj: float
    by_unit_nj: dict[str, float]

class MachineArea(TypedDict):
    total_mm2: float
    by_unit_mm2: dict[str, float]

class Frame:
    @property
    def number(self) -> int: ...
    @property
    def has_right_eye(self) -> bool: ...
    @property
    def layers(self) -> list[str]: ...
    def image(self, layer: str = "color", eye: Eye = "left") -> NDArray[np.float32]: ...
    def display(self, eye: Eye = "left") -> NDArray[np.uint8]: ...
    def patches(self, eye: Eye = "left") -> NDArray[np.uint32]: ...
    @property
    def counters(self) -> dict[str, int]: ...
    @property
    def traffic(self) -> list[dict[str, Any]]: ...
    @property
    def passes(self) -> list[FramePass]: ...
    @property
    def timing(self) -> FrameTiming | None: ...
    @property
    def energy(self) -> FrameEnergy | None: ...
    @property
    def area(self) -> MachineArea | None: ...
    @property
    def tile_maps(self) -> dict[str, NDArray[np.uint64]]: ...
    @property
    def tile_map_descriptions(self) -> list[dict[str, str]]: ...
    @property
    def tiles(self) -> list[dict[str, int]]: ...
    @property
    def drawables(self) -> list[dict[str, Any]]: ...
    @property
    def effects(self) -> dict[str, bool]: ...
    @property
    def host_seconds(self) -> float: ...
    @property
    def stage_seconds(self) -> dict[str, float]: ...

def gpu_keys() -> list[dict[str, Any]]: ...
def settings_keys() -> list[dict[str, Any]]: ...
def counter_descriptions() -> list[dict[str, str]]: ...
def simd_target() -> str: ...
