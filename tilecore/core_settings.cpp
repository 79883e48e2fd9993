#include "tilecore/core_settings.h"

namespace tessera::tilecore {

Keys<CoreSettings> core_keys() {
  Keys<CoreSettings> keys = {
      {"tilecore.tile_order", &CoreSettings::tile_order,
       "Order in which cores are given tiles: row by row; in strips of eight rows, column by column; or along the "
       "curve of Morton (Z) or Hilbert. Along a curve a tile finds shared vertices and textures sooner again.",
       "[assumed] a Z curve; [measured] fewest evaluations"},
      {"tilecore.occlusion_culling", &CoreSettings::occlusion_culling,
       "Whether a tile core drops entries that lie behind the surfaces of all samples of its tile, before it "
       "tessellates them.",
       "[spec] hierarchical depth of every GPU, applied to sub-patches"},
  };
  keys.add(&CoreSettings::visibility, visibility_keys());
  return keys.add(Keys<CoreSettings>{
      {"tilecore.blend_layers", &CoreSettings::blend_layers, "layers", 1, 64,
       "Blended surfaces of one sample that a tile core keeps in order; with more, the two farthest become one.",
       "[assumed] 8; multi-layer alpha blending: Salvi and Vaidyanathan 2014"},
      {"tilecore.weight_bits", &CoreSettings::weight_bits, "bits", 8, 32,
       "Bits of each of the two weights by which a sample in the tile memory names its place in its triangle. From 24 "
       "on weights keep their single precision.",
       "[assumed] 16: a triangle's place to 1/65535 of its edges"},
  });
}

Keys<ShadingCacheSettings> shading_cache_keys() {
  return {
      {"shading_cache.entries", &ShadingCacheSettings::entries, "cells", 1, 1048576,
       "With shading.rate=cache: shaded cells that a tile core keeps on chip, 24 bytes each, in an LRU cache.",
       "[assumed] 24 KiB"},
  };
}

Keys<TessellatorSettings> tessellator_keys() {
  return {
      {"tessellator.max_factor", &TessellatorSettings::max_factor, "cells", 1, 64,
       "Largest number of cells along an edge of a base patch.", "[spec] 64 in Direct3D 11 and Vulkan"},
      {"tessellator.subpixel_bits", &TessellatorSettings::subpixel_bits, "bits", 4, 8,
       "Fractional bits of a vertex's place on screen: projected vertices lie on a grid of 2^-bits pixels. Samples "
       "keep their grid of 1/256.",
       "[spec] 8 in Direct3D 11; 4 in OpenGL ES (GL_SUBPIXEL_BITS)"},
      {"tessellator.sub_patch_cells", &TessellatorSettings::sub_patch_cells, "cells", 4, 64,
       "Largest side of the sub-patches that the front end sends to the binner.", "[assumed]"},
      {"tessellator.cache_bytes", &TessellatorSettings::cache_bytes, "bytes", 0, 1073741824.0,
       "On-chip memory that keeps the vertices of tessellated sub-patches for later tiles.",
       "[assumed] half of a middle Mali's L2 ([spec] 32 to 512 KiB on Mali-G51)"},
  };
}

Keys<FrameBufferSettings> frame_buffer_keys() {
  return {
      {"frame_buffer.format", &FrameBufferSettings::format,
       "Format of finished pixels in memory: sRGB codes of 8 or 10 bits, 4 bytes a pixel, of light times exposure that "
       "the store tone-maps; or half floats of linear light, 8 bytes a pixel. EXR files keep the light from before the "
       "store, PNG files show rgba8.",
       "[spec] render targets of every API; [assumed] rgba8, as phones show"},
      {"frame_buffer.compression", &FrameBufferSettings::compression,
       "Whether tile cores compress finished pixels on their way to memory, in blocks of 256 bytes; saves traffic, not "
       "room. All that passes store for later ones is compressed as well, but for shadow maps and the image behind "
       "surfaces that transmit.",
       "[assumed] lossless, as Arm's AFBC and Qualcomm's UBWC"},
      {"frame_buffer.transaction_elimination", &FrameBufferSettings::transaction_elimination,
       "Whether tile cores leave a tile's pixels unwritten when their signature equals the previous frame's; they read "
       "and write signatures in memory. The first of several frames is written whole. Each attachment that passes "
       "store for later ones has signatures of its own.",
       "[spec] Arm's transaction elimination"},
      {"frame_buffer.signature_bits", &FrameBufferSettings::signature_bits, "bits", 4, 64,
       "Width of a tile's signature, the lowest bits of a CRC-64, in whole bytes of memory. Narrow signatures match "
       "for tiles that differ, and images show it.",
       "[assumed] a wrong match in 2^64"},
  };
}

}  // namespace tessera::tilecore
