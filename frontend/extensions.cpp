#include "frontend/extensions.h"

namespace tessera::frontend {

const std::vector<Extension>& supported_extensions() {
  static const std::vector<Extension> kExtensions = {
      {"KHR_draco_mesh_compression", "mesh primitive", "Vertices and indices compressed with Draco.", {}},
      {"KHR_lights_punctual", "root, node", "Directional, point and spot lights.", {}},
      {"KHR_materials_unlit", "material", "Base colour is shown as it is.", {}},
      {"KHR_mesh_quantization", "root", "Vertex attributes of small integer types.", {}},
      {"KHR_texture_transform", "texture info", "Offset, rotation and scale of texture coordinates.", {}},
      {"TESSERA_bezier_patches",
       "mesh primitive",
       "The primitive's vertices are control points of bicubic Bezier patches; its triangles draw the control cage.",
       {{"count", "integer", "patches", "required", "Number of patches. Vertex 16 p + 4 j + i is control point i along u, j along v of patch p."}}},
      {"TESSERA_capture",
       "root",
       "How the asset wants to be replayed.",
       {{"resolution", "integer[2]", "pixels", "[1280, 720]", "Width and height of the picture."},
        {"frameRate", "number", "frames/s", "30", "Frame n is taken at n / frameRate seconds of the animation."},
        {"shutter", "number[2]", "frames", "[0, 0]", "When the shutter opens and closes, as fractions of a frame from its start. Equal: no motion blur."},
        {"frames", "object", "frames", "{first: 0, count: 1}", "Range of frames that a replay renders."},
        {"camera", "integer", "node", "first camera", "Node whose camera takes the picture."},
        {"exposure", "number", "", "1", "Factor on light before the tone map of PNG files; EXR files do not change."},
        {"environment", "number", "", "1, or 0.3 with lights", "Brightness of the built-in studio environment; 0 turns it off."},
        {"background", "number[3]", "linear RGB", "the environment", "Colour behind everything."}}},
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
      {"TESSERA_subdivision",
       "mesh primitive",
       "The primitive is the control mesh of a Catmull-Clark surface, which becomes bicubic Bezier patches.",
       {{"scheme", "string", "", "catmullClark", "Rules of refinement; there is one choice."},
        {"levels", "integer", "steps", "1", "Refinements before every face becomes a patch, 0 to 4; 0 needs a cage of quads only."},
        {"quads", "integer", "faces", "0", "The first 2 quads triangles are pairs (a, b, c), (a, c, d) that stand for the face (a, b, c, d); each further triangle is a face."},
        {"boundary", "string", "", "edgeAndCorner", "edge: the boundary is a smooth curve; edgeAndCorner: points of a single face are sharp besides."},
        {"creases", "object[]", "", "none", "Chains of vertices whose edges are sharp: vertices, sharpness (0 to 10; 10, the default, is infinite)."},
        {"corners", "object[]", "", "none", "Sharp points: vertices, sharpness as for creases."}}},
  };
  return kExtensions;
}

}  // namespace tessera::frontend
