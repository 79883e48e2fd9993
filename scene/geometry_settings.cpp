#include "scene/geometry_settings.h"

namespace tessera::scene {

Keys<GeometrySettings> geometry_keys() {
  using S = GeometrySettings;
  return {
      {"geometry.encoding", &S::encoding,
       "How the memory holds clusters and Bezier patches whose vertices rest: floats (raw); "
       "positions of geometry.bits on one grid for each mesh (quantised); as many bits as the box "
       "of each record needs, and triangles coded by the edges that they share (meshlet); or "
       "clusters as blocks of 128 bytes of AMD's Dense Geometry Format, and patches as with meshlet "
       "(dgf). The reader of a record decodes it: frontend.decoded_per_clk, "
       "tessellator.decoded_per_clk.",
       "[spec] meshlet: codecs of meshlets as meshoptimizer 1.2 has them, 4.0 to 4.5 bytes a triangle; dgf: "
       "VK_AMDX_dense_geometry_format; [assumed] raw: figures hold for the positions of the file"},
      {"geometry.bits", &S::bits, "bits", 8, 16,
       "With geometry.encoding=quantised, meshlet or dgf: bits of a coordinate along the longest side of a mesh's box; "
       "never finer than floats are there, with dgf than half as fine.",
       "[assumed] 16: an error of 1/131072 of the box"},
  };
}

}  // namespace tessera::scene
