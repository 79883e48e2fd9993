#include "scene/extensions.h"

#include <utility>

namespace tessera::scene {
namespace {

std::vector<Extension> shared_extensions() {
  return {
      {"EXT_mesh_gpu_instancing", "node", "The node's mesh is drawn many times, at a transform each.", {}},
      {"EXT_meshopt_compression",
       "buffer view, buffer",
       "Contents compressed with meshoptimizer; fallback buffers are not read.",
       {}},
      {"EXT_texture_webp",
       "texture",
       "A WebP image, lossy or lossless; where it cannot be read, the texture's source.",
       {}},
      {"KHR_animation_pointer",
       "animation channel target",
       "Animates what a JSON pointer names: a node's transformation, weights and visibility; a material's factors and "
       "texture transformations; cameras and lights; parameters of procedures. Pointers at anything else are skipped.",
       {}},
      {"KHR_draco_mesh_compression", "mesh primitive", "Vertices and indices compressed with Draco.", {}},
      {"KHR_lights_punctual", "root, node", "Directional, point and spot lights.", {}},
      {"KHR_materials_anisotropy", "material", "Highlights that are longer in one direction.", {}},
      {"KHR_materials_clearcoat", "material", "A clear coat with a roughness and a normal map of its own.", {}},
      {"KHR_materials_diffuse_transmission", "material", "Light that comes through a thin surface, spread.", {}},
      {"KHR_materials_dispersion", "material", "Volumes refract red and blue differently.", {}},
      {"KHR_materials_emissive_strength", "material", "A factor on emission.", {}},
      {"KHR_materials_ior", "material", "Index of refraction.", {}},
      {"KHR_materials_iridescence", "material", "A thin film above the base.", {}},
      {"KHR_materials_pbrSpecularGlossiness",
       "material",
       "Colour and gloss of reflections in place of metalness and roughness.",
       {}},
      {"KHR_materials_sheen", "material", "Fibres that scatter light at grazing angles.", {}},
      {"KHR_materials_specular", "material", "Strength and colour of a dielectric's reflections.", {}},
      {"KHR_materials_transmission",
       "material",
       "What is behind the surface is seen through it, tinted and blurred: all that is opaque and does not transmit.",
       {}},
      {"KHR_materials_unlit", "material", "Base colour is shown as it is.", {}},
      {"KHR_materials_variants",
       "root, mesh primitive",
       "Other materials by the name of a variant: --variant chooses it, inspect lists them.",
       {}},
      {"KHR_materials_volume", "material", "What transmits refracts and absorbs by its thickness.", {}},
      {"KHR_mesh_quantization", "root", "Vertex attributes of small integer types.", {}},
      {"KHR_meshopt_compression",
       "buffer view, buffer",
       "As EXT_meshopt_compression, with version 1 of attribute streams and the colour filter.",
       {}},
      {"KHR_node_visibility", "node", "Hides a node and all below it.", {}},
      {"KHR_texture_basisu",
       "texture",
       "A KTX2 image with Basis Universal data (ETC1S, UASTC) and its mip levels; where it cannot be read, the "
       "texture's source. Memory holds ASTC blocks of 4x4 texels, or what texture.format says.",
       {}},
      {"KHR_texture_transform", "texture info", "Offset, rotation and scale of texture coordinates.", {}},
  };
}

// Tessera's own.
std::vector<Extension> own_extensions() {
  return {
      {"TESSERA_bezier_patches",
       "mesh primitive",
       "The primitive's vertices are control points of bicubic Bezier patches; its triangles draw the control cage.",
       {{"count", "integer", "patches", "required",
         "Number of patches. Vertex 16 p + 4 j + i is control point i along u, j along v of patch p."}}},
      {"TESSERA_capture",
       "root",
       "How the asset wants to be replayed.",
       {{"resolution", "integer[2]", "pixels", "[1280, 720]", "Width and height of the image."},
        {"frameRate", "number", "frames/s", "30", "Frame n is taken at n / frameRate seconds of the animation."},
        {"shutter", "number[2]", "frames", "[0, 0]",
         "When the shutter opens and closes, as fractions of a frame from its start. Equal: no motion blur."},
        {"frames", "object", "frames", "{first: 0, count: 1}", "Range of frames that a replay renders."},
        {"camera", "integer", "node", "first camera", "Node whose camera takes the image."},
        {"animations", "integer[]", "animation", "all that move different things",
         "Animations that play; where two move one thing, the later one does."},
        {"exposure", "number", "", "1", "Factor on light before the tone map of PNG files; EXR files do not change."},
        {"environment", "number, string or object", "", "1, or 0.3 with lights",
         "Brightness of the built-in studio; or \"uniform\"; or the URI of an equirectangular EXR or HDR image; or an "
         "object: image, bufferView or uniform, intensity, rotation."},
        {"background", "number[3]", "linear RGB", "the environment", "Colour behind everything."}}},
      {"TESSERA_clusters",
       "mesh primitive",
       "The triangles lie in the order of clusters: a reader with the same limits cuts them off one after the other. A "
       "wrong order gives worse clusters, never another image.",
       {{"maxVertices", "integer", "vertices", "required", "Most vertices of a cluster."},
        {"maxTriangles", "integer", "triangles", "required", "Most triangles of a cluster."},
        {"range", "integer", "triangles", "required",
         "A cluster ends after each so many triangles of the primitive."}}},
      {"TESSERA_displacement",
       "material",
       "Bezier patches of the material are displaced along their unit normal by scale * height + bias.",
       {{"texture", "textureInfo", "", "required", "Heights: the red channel, linear; 8 or 16 bits."},
        {"scale", "number", "object units", "1", "Distance of a full height."},
        {"bias", "number", "object units", "0", "Distance of height zero."}}},
      {"TESSERA_lens",
       "camera",
       "A thin lens, for defocus blur.",
       {{"apertureRadius", "number", "scene units", "required", "Radius of the lens; 0 is a pinhole."},
        {"focusDistance", "number", "scene units", "infinity", "Distance in front of the camera that is sharp."}}},
      {"TESSERA_procedure",
       "node",
       "A surface that stays a formula until it is sampled: docs/procedures.md lists shapes, textures and shading "
       "models.",
       {{"shape", "string", "", "required without a program of one", "Name of the shape."},
        {"program", "string or integer", "", "none",
         "Stages of the user's own, as text or as a number in the list `programs` of the document's "
         "TESSERA_procedure."},
        {"sampling", "object", "", "its defaults", "Parameters of the program's rates, by name."},
        {"parameters", "object", "", "the shape's defaults", "Parameters of the shape, by name."},
        {"texture", "object", "", "{pattern: plain}",
         "pattern: name of a procedural texture; its parameters beside it."},
        {"shading", "object", "", "{model: material}", "model: name of a shading model; its parameters beside it."},
        {"material", "integer", "material", "glTF's default",
         "Factors of the metallic-roughness model, double-sidedness."},
        {"tessellation", "object", "segments", "{min: 1, max: 64}",
         "Along each side of a base patch, where the surface is tessellated."},
        {"image", "object", "", "none",
         "Of the shape geometryImage: positions, an accessor of points row by row, and width."}}},
      {"TESSERA_subdivision",
       "mesh primitive",
       "The primitive is the control mesh of a Catmull-Clark surface, which becomes bicubic Bezier patches.",
       {{"scheme", "string", "", "catmullClark", "Rules of refinement; there is one choice."},
        {"levels", "integer", "steps", "1",
         "Refinements before every face becomes a patch, 0 to 4; 0 needs a cage of quads only."},
        {"quads", "integer", "faces", "0",
         "The first 2 quads triangles are pairs (a, b, c), (a, c, d) that stand for the face (a, b, c, d); each "
         "further triangle is a face."},
        {"boundary", "string", "", "edgeAndCorner",
         "edge: the boundary is a smooth curve; edgeAndCorner: points of a single face are sharp besides."},
        {"creases", "object[]", "", "none",
         "Chains of vertices whose edges are sharp: vertices, sharpness (0 to 10; 10, the default, is infinite)."},
        {"corners", "object[]", "", "none", "Sharp points: vertices, sharpness as for creases."}}},
  };
}

}  // namespace

const std::vector<Extension>& supported_extensions() {
  static const std::vector<Extension> kExtensions = [] {
    std::vector<Extension> all = shared_extensions();
    for (Extension& extension : own_extensions()) all.push_back(std::move(extension));
    return all;
  }();
  return kExtensions;
}

}  // namespace tessera::scene
