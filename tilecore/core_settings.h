#pragma once

#include <cstdint>

#include "base/key_table.h"
#include "tilecore/resolve/frame_format.h"
#include "tilecore/tile_order.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// Keys tilecore.* except for numbers of cores, memories and throughputs, which belong to the machine.
struct CoreSettings {
  TileSequence tile_order = TileSequence::kMorton;
  bool occlusion_culling = true;
  VisibilityMethodSettings visibility;
  int blend_layers = 8;
  int weight_bits = 16;
};
Keys<CoreSettings> core_keys();

// Keys shading_cache.*.
struct ShadingCacheSettings {
  std::int64_t entries = 1024;
};
Keys<ShadingCacheSettings> shading_cache_keys();

// Keys tessellator.* except for its throughput.
struct TessellatorSettings {
  int max_factor = 64;
  int subpixel_bits = 8;
  int sub_patch_cells = 16;  // cells a side of the largest sub-patch a core takes at once
  std::int64_t cache_bytes = 256 << 10;
};
Keys<TessellatorSettings> tessellator_keys();

// Compression of finished pixels before they go to memory.
enum class FrameBufferCompression : std::uint8_t { kNone, kLossless };

// Keys frame_buffer.*.
struct FrameBufferSettings {
  FrameFormat format = FrameFormat::kRgba8;
  FrameBufferCompression compression = FrameBufferCompression::kLossless;
  bool transaction_elimination = false;
  int signature_bits = 64;  // bits of a tile's signature
};
Keys<FrameBufferSettings> frame_buffer_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::FrameBufferCompression> = std::to_array<std::string_view>({"none",
                                                                                                      "lossless"});

}  // namespace tessera
