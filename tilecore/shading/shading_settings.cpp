#include "tilecore/shading/shading_settings.h"

namespace tessera::tilecore {

Keys<ShadingSettings> shading_keys() {
  using S = ShadingSettings;
  return {
      {"shading.rate", &S::rate,
       "Pixel-shader invocations: once per pixel and primitive (multisampling) with adjacent triangles of a smooth "
       "surface merged (pixel) or not (primitive), once per visible sample, or once per cell of the surface about a "
       "pixel wide, while the shading cache holds it."},
      {"shading.derivatives", &S::derivatives,
       "Derivatives of texture coordinates: the surface's own, or differences within quads of 2x2 invocations, which "
       "take helper invocations where a surface does not cover all four pixels. With shading.rate=cache analytic."},
      {"shading.cell_pixels", &S::cell_pixels, "pixels", 0.125, 16,
       "With shading.rate=cache: wanted width of a shading cell on screen; smaller is sharper and slower."},
      {"shading.surface", &S::surface,
       "Source of the surface of a Bezier patch in a pixel-shader invocation: it evaluates the patch again; or it "
       "interpolates between vertices of the triangle that it sees, which a core evaluates once for each tile that "
       "sees them and keeps in the tile memory; or, frame, it does so with normals without the displacement and adds "
       "the gradient of the height map, by four lookups, as for a normal map made from the heights. Alpha tests, and "
       "cells of shading.rate=cache, do likewise."},
      {"shading.attributes", &S::attributes,
       "Precision of interpolated attributes (texture coordinates, colours, normals) on their way to the pixel shader: "
       "single, or half as in GLSL's mediump. Baselines that keep vertices in memory store and read 4 or 2 bytes for "
       "each component of an attribute; positions stay single."},
      {"shading.light_lists", &S::light_lists,
       "Light lists: tiles find the lights that reach their surfaces, and pixel shaders loop over these alone: never "
       "(off), in frames with at least eight point or spot lights that have a range (ranged), or with any such light, "
       "whose cones are then tested (all). Images have the same bits."},
      {"shading.path", &S::path,
       "How opaque surfaces come to be shaded: by one shader where visible triangles are known (visibility); likewise, "
       "behind a pass that stores depths, which hide sub-patches (prepass); by a shader that leaves material and "
       "normal in the tile memory and one that lights them there (gbuffer); or by a pass that stores this G-buffer and "
       "another one that loads it (gbuffer_external). Unlit, layered and blended surfaces and procedures have one "
       "shader on all paths."},
      {"gbuffer.layout", &S::layout,
       "Contents of a sample of the G-buffer: 64 bytes, and images have the bits of shading.path=visibility (exact), "
       "or 16 bytes, which round base colour, normal, metalness, roughness, occlusion and emission (packed)."},
      {"gbuffer.bits", &S::gbuffer_bits, "bits", S::kBitsWithoutEmission, 1024,
       "With gbuffer.layout=packed: bits of a sample of the G-buffer, a multiple of 32. Bits beyond 128 are written, "
       "kept, moved and read like the others, and light nothing. With 96 it has no emission: surfaces that emit have "
       "one shader, as unlit ones do."},
  };
}

}  // namespace tessera::tilecore
