#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/counter.h"
#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// The G-buffer cuts shading in two: the fill half of a lit, opaque surface's shader writes material and normal, the light
// half reads them. Both layouts hold them for each sample, in place of its visibility record:
//
//   exact    64 bytes: the visibility record (16), base colour, metalness, roughness, occlusion, emission and normal, in
//            single precision. Place, view and the surface's position in the image follow from the record, as before.
//   packed   16 bytes (gbuffer_packing.h); the place follows from the sample's depth. They also tell which samples share
//            an invocation, as nothing else names the triangle. With gbuffer.bits a sample is wider, as in renderers that
//            keep more than this machine's materials need.
//
// Samples share invocations as their visibility records say, whatever the G-buffer holds. The emulator hands place, view and
// receiver from one half to the other. With `packed` they are the surface's own: depths round far less than the other values.
//
// Invariants (cited by the tests):
//   GB1  With the exact layout images have the same bits on all paths.
//   GB2  The default path has the bytes, counters and bits of a machine without a G-buffer.
//   GB3  Stored raw, the G-buffer of a frame takes width x height x samples x bytes of a sample, and is loaded once.
//   GB4  Every invocation of a lit, opaque surface that is neither layered nor a procedure is filled once and lit once.

// Arrays that the fill half writes and the light half reads, by number.
struct GbufferPlanes {
  static constexpr std::size_t kBaseColor = 0, kMetallic = 3, kRoughness = 4, kOcclusion = 5, kEmissive = 6,
                               kNormal = 9;
  static constexpr std::size_t kMaterial = 12;  // the packed layout rounds the values below
  static constexpr std::size_t kPlace = 12, kView = 15, kPlain = 18;
  // The receiver of shadows: place and derivatives in the image, and the same at both motion keys.
  static constexpr std::size_t kReceiver = 18, kKeys = 27, kAll = 45;
};
using GbufferArrays = std::array<float*, GbufferPlanes::kAll>;

// Runs a half for `count` invocations of a draw, as shade_draw() runs a whole shader. `receivers`: shadows are looked up.
void fill_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
               bool receivers, const GbufferArrays& out);
// Neither the draw's material nor its drawable matters, except for the drawable's motion.
void light_draw(const DrawConstants& draw, const GbufferArrays& in, const float* light_t, std::size_t count,
                const LookupArrays& lookups, const std::array<float*, 3>& color);

// Clocks of a lane to write or read a word of the packed G-buffer. [measured] add/fill/packed of the table of shaders: 72 clocks
// pack four words.
inline constexpr std::uint32_t kGbufferWordClocks = 18;

struct GbufferCounters {
  std::uint64_t filled = 0;
  std::uint64_t samples = 0;
  std::uint64_t light_warps = 0;
  std::uint64_t light_lookups = 0;
  std::uint64_t tile_bytes = 0;
  std::uint64_t stored_bytes = 0, loaded_bytes = 0;
  std::uint64_t depth_bytes = 0;
  std::uint64_t layer_bytes = 0;
  std::uint64_t spilled_bytes = 0;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::GbufferCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::GbufferCounters> =
    std::to_array<CounterField<tilecore::GbufferCounters>>({
        {"gbuffer.filled", &tilecore::GbufferCounters::filled, Combine::kSum, "invocations",
         "Pixel-shader invocations that filled the G-buffer and were lit from it; the others shade forward.", ""},
        {"gbuffer.samples", &tilecore::GbufferCounters::samples, Combine::kSum, "samples",
         "Samples whose part of the G-buffer these invocations wrote.", ""},
        {"gbuffer.light_warps", &tilecore::GbufferCounters::light_warps, Combine::kSum, "warps",
         "Warps of the light half, beside tilecore.warps.", ""},
        {"gbuffer.light_lookups", &tilecore::GbufferCounters::light_lookups, Combine::kSum, "lookups",
         "Bilinear lookups of the light half, in the environment and in shadow maps, among texture.texels.", ""},
        {"gbuffer.tile_bytes", &tilecore::GbufferCounters::tile_bytes, Combine::kSum, "bytes",
         "Bytes of the G-buffer that shaders wrote into the tile memory, for each sample, and read there, for each "
         "invocation.",
         ""},
        {"gbuffer.stored_bytes", &tilecore::GbufferCounters::stored_bytes, Combine::kSum, "bytes",
         "Bytes of the G-buffer that were stored to memory, depths apart.", ""},
        {"gbuffer.loaded_bytes", &tilecore::GbufferCounters::loaded_bytes, Combine::kSum, "bytes",
         "The same, loaded for the light half.", ""},
        {"gbuffer.depth_bytes", &tilecore::GbufferCounters::depth_bytes, Combine::kSum, "bytes",
         "Bytes of depths that were stored beside a G-buffer or by a prepass, and loaded.", ""},
        {"gbuffer.layer_bytes", &tilecore::GbufferCounters::layer_bytes, Combine::kSum, "bytes",
         "Bytes of blended layers, tables of triangles and light lists that waited in memory for the light half, "
         "stored and loaded.",
         ""},
        {"gbuffer.spilled_bytes", &tilecore::GbufferCounters::spilled_bytes, Combine::kSum, "bytes",
         "With tile.fit: bytes of samples that the smallest tile has no room for, written and read back.", ""},
    });
TESSERA_COUNTERS_COVER(tilecore::GbufferCounters);

}  // namespace tessera
