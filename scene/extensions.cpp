#include "scene/extensions.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

namespace tessera::scene {
namespace {

constexpr std::string_view kRatified = "ratified", kDraft = "in progress", kMulti = "multi-vendor", kVendor = "vendor",
                           kArchived = "archived";

// Extensions that other vendors have registered. Extensions of materials are rows of material_extensions.def.
class Registry {
 public:
  std::vector<Extension> rows;

  Registry() {
    add_read(), add_unread();
#define EXTENSION(name, status, test, meaning, treatment) read(#name, status, test, "material", meaning, treatment);
#define UNREAD_EXTENSION(name, status, lack) unread(#name, status, lack);
#include "scene/material_extensions.def"
    const auto place = [](const Extension& e) {
      constexpr std::array kOrder = {kRatified, kDraft, kMulti, kVendor, kArchived};
      return std::tuple(std::find(kOrder.begin(), kOrder.end(), e.status), e.name);
    };
    std::sort(rows.begin(), rows.end(), [&](const auto& a, const auto& b) { return place(a) < place(b); });
  }

 private:
  void read(std::string_view name, std::string_view status, std::string_view test, std::string_view extends,
            std::string_view meaning, std::string_view treatment) {
    rows.push_back({name, extends, meaning, {}, status, treatment, test});
  }
  void unread(std::string_view name, std::string_view status, std::string_view lack) {
    rows.push_back({name, "", "", {}, status, lack, ""});
  }

  void add_read() {
    read("EXT_mesh_gpu_instancing", kRatified, "InstanceReader", "node",
         "The node's mesh is drawn many times, at a transform each.", "All of it, as true instances.");
    read("EXT_meshopt_compression", kRatified, "MeshoptViews", "buffer view, buffer",
         "Contents compressed with meshoptimizer; fallback buffers are not read.",
         "All of it; fallback buffers are not needed.");
    read("EXT_texture_webp", kRatified, "TextureWebp", "texture",
         "A WebP image, lossy or lossless; where it cannot be read, the texture's source.", "All of it.");
    read("KHR_animation_pointer", kRatified, "AnimationPointer", "animation channel target",
         "Animates the property that a JSON pointer names: a node's transformation, weights and "
         "visibility; a material's factors and texture transformations; cameras and lights; "
         "parameters of procedures. Pointers at anything else are skipped.",
         "Pointers at nodes, materials' factors and texture transforms, cameras and lights.");
    read("KHR_draco_mesh_compression", kRatified, "CaptureDraco", "mesh primitive",
         "Vertices and indices compressed with Draco.", "All of it, streams from 2.2 on.");
    read("KHR_lights_punctual", kRatified, "CaptureScene", "root, node", "Directional, point and spot lights.",
         "All of it.");
    read("KHR_materials_variants", kRatified, "MaterialVariants", "root, mesh primitive",
         "Other materials by the name of a variant: --variant chooses it, inspect lists them.",
         "All of it: --variant chooses.");
    read("KHR_mesh_quantization", kRatified, "CaptureAccessors", "root", "Vertex attributes of small integer types.",
         "All of it.");
    read("KHR_texture_basisu", kRatified, "TextureBasisu", "texture",
         "A KTX2 image with Basis Universal data (ETC1S, UASTC) and its mip levels; where it cannot "
         "be read, the texture's source. Memory holds ASTC blocks of 4x4 texels, or the blocks of "
         "texture.format.",
         "All of it: ETC1S and UASTC, with mip levels.");
    read("KHR_texture_transform", kRatified, "CaptureMaterials", "texture info",
         "Offset, rotation and scale of texture coordinates.", "All of it.");
    read("KHR_meshopt_compression", kDraft, "MeshoptViews", "buffer view, buffer",
         "As EXT_meshopt_compression, with version 1 of attribute streams and the colour filter.",
         "All of it: version 1 of attribute streams, the colour filter.");
    read("KHR_node_visibility", kDraft, "NodeVisibility", "node",
         "Hides a node and all below it. An animated value at shutter open holds for the whole frame.", "All of it.");
  }

  void add_unread() {
    constexpr const char *kData = "Nothing: it is not drawn.", *kNoMedia = "The medium; the rest is drawn.";
    unread("KHR_xmp_json_ld", kRatified, kData);
    unread("EXT_mesh_features", kDraft, kData);
    unread("EXT_mesh_primitive_restart", kDraft, "Restarts of strips; files that need them are refused.");
    unread("EXT_structural_metadata", kDraft, kData);
    unread("EXT_texture_avif", kDraft, "AVIF images; the texture's source is shown.");
    unread("EXT_texture_procedurals_mx_1_39", kDraft, "The textures; factors stand alone.");
    unread("KHR_accessor_float64", kDraft, "Its accessors; files that need them are refused.");
    unread("KHR_audio_graph", kDraft, kData);
    unread("KHR_collision_shapes", kDraft, kData);
    unread("KHR_gaussian_splatting", kDraft, "The splats; their centres are points.");
    unread("KHR_interactivity", kDraft, "Behaviour; the scene is drawn as it begins.");
    unread("KHR_node_hoverability", kDraft, kData);
    unread("KHR_node_selectability", kDraft, kData);
    unread("KHR_physics_rigid_bodies", kDraft, "Motion that physics would give.");
    unread("KHR_texture_procedurals", kDraft, "The textures; factors stand alone.");
    unread("KHR_texture_video", kDraft, "The video; the texture's source is shown.");
    unread("EXT_lights_ies", kMulti, "The profile; the light shines alike in all directions.");
    unread("EXT_lights_image_based", kMulti, "The environment; the built-in studio lights the scene.");
    unread("EXT_mesh_manifold", kMulti, kData);
    unread("AGI_articulations", kVendor, "Articulations; the scene is drawn as it rests.");
    unread("AGI_stk_metadata", kVendor, kData);
    unread("CESIUM_primitive_outline", kVendor, "The outlines.");
    unread("FB_geometry_metadata", kVendor, kData);
    unread("GODOT_single_root", kVendor, kData);
    unread("GRIFFEL_bim_data", kVendor, kData);
    unread("MPEG_accessor_timed", kVendor, kNoMedia);
    unread("MPEG_animation_timing", kVendor, kNoMedia);
    unread("MPEG_audio_spatial", kVendor, kData);
    unread("MPEG_buffer_circular", kVendor, kNoMedia);
    unread("MPEG_media", kVendor, kNoMedia);
    unread("MPEG_mesh_linking", kVendor, kNoMedia);
    unread("MPEG_scene_dynamic", kVendor, kNoMedia);
    unread("MPEG_texture_video", kVendor, "The video; the texture's source is shown.");
    unread("MPEG_viewport_recommended", kVendor, kData);
    unread("MSFT_lod", kVendor, "Lower levels; the highest is drawn.");
    unread("MSFT_texture_dds", kVendor, "DDS images; the texture's source is shown.");
    unread("KHR_xmp", kArchived, kData);
  }
};

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
        {"background", "number[3]", "linear RGB", "the environment", "Colour behind everything."},
        {"shadows", "object[]", "", "none",
         "Lights that cast shadows: light (a light of KHR_lights_punctual, required), size (texels along a map's side, "
         "default 1024); of a directional light cascades (maps, 1 to 8, default 1) and distance (scene units from the "
         "camera that they reach, default 0: as far as the scene)."},
        {"attachments", "object", "", "none",
         "Images that passes write, by name, beside frame and depth, which always exist: format, size or scale, "
         "samples, layers, levels, life."},
        {"passes", "object[]", "", "the passes that shadows and materials need",
         "Passes of a frame: name, view, load, store and subpasses, or the members of the only one: draw, shader, "
         "input, write, sample. They are read and checked, but not rendered."}}},
      {"TESSERA_clusters",
       "mesh primitive",
       "The triangles lie in the order of clusters: a reader with the same limits cuts them off one after the other. A "
       "wrong order gives worse clusters, never another image. With an encoding (version 2) positions and triangles "
       "are "
       "in a buffer view, cluster by cluster, and the accessors of POSITION and of the indices have no data of their "
       "own.",
       {{"maxVertices", "integer", "vertices", "required", "Most vertices of a cluster."},
        {"maxTriangles", "integer", "triangles", "required", "Most triangles of a cluster."},
        {"range", "integer", "triangles", "required", "A cluster ends after each so many triangles of the primitive."},
        {"encoding", "string", "", "none", "How clusters are encoded: quantised, meshlet or dgf."},
        {"bits", "integer", "", "with an encoding", "Bits of a quantised position along an axis, 1 to 24."},
        {"clusters", "integer", "clusters", "with an encoding", "How many the buffer view has."},
        {"bufferView", "integer", "", "with an encoding", "Their bytes."}}},
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

const std::vector<Extension>& extension_registry() {
  static const std::vector<Extension> kRegistry = Registry().rows;
  return kRegistry;
}

const std::vector<Extension>& supported_extensions() {
  static const std::vector<Extension> kExtensions = [] {
    std::vector<Extension> all = own_extensions();
    for (const Extension& extension : extension_registry())
      if (extension.read()) all.push_back(extension);
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return all;
  }();
  return kExtensions;
}

}  // namespace tessera::scene
