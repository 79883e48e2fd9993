#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/vec.h"
#include "scene/material.h"
#include "scene/pass_graph.h"
#include "shaders_cpp/metallic_roughness.h"
#include "shaders_cpp/procedures/program.h"
#include "shaders_cpp/surroundings.h"

namespace tessera::shaders {
class EnvironmentImage;
}

namespace tessera::scene {

// A capture as the front end keeps it: everything decoded, checked and in the units of glTF (metres, seconds,
// radians, right-handed, +y up). Indices refer to the vectors of Capture; -1 means "none". Immutable once read.

inline constexpr int kNone = -1;

// ---- Geometry ---------------------------------------------------------------------------------------------------

struct MorphTarget {
  std::vector<Vec3> positions, normals, tangents;  // differences; empty when the target moves none of them
};

// Joints of a vertex, at most 8 (JOINTS_0 and JOINTS_1); weights are renormalised to sum 1.
struct SkinInfluence {
  std::array<std::uint16_t, 8> joints{};
  std::array<float, 8> weights{};
};

// Vertex attributes, one vector each; all that are present have the same length.
struct Vertices {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;                 // may be empty: flat
  std::vector<Vec4> tangents;                // may be empty; w = handedness
  std::vector<std::vector<Vec2>> texcoords;  // by set number; a set that the file lacks is empty
  std::vector<Vec4> colors;                  // may be empty: white
  std::vector<SkinInfluence> influences;     // may be empty: not skinned
  std::vector<MorphTarget> morph_targets;

  std::size_t count() const { return positions.size(); }
};

struct Primitive {
  enum class Kind : std::uint8_t {
    kTriangles,      // indices: three per triangle
    kBezierPatches,  // 16 vertices per patch, in order: vertex 16*p + 4*j + i is control point i along u, j along v
    kProcedure,      // no vertices: a Procedure's pieces
  };
  // Points and lines are triangles whose vertices are moved apart in the image when they are posed (wires.h). A point
  // has four vertices at its place; a segment has two at its begin and two at its end.
  enum class Wire : std::uint8_t { kSurface, kPoints, kSegments };
  Kind kind = Kind::kTriangles;
  Wire wire = Wire::kSurface;
  bool in_cluster_order = false;  // kTriangles: TESSERA_clusters claims cluster order, which may be wrong
  // Triangles of each cluster of kTriangles that TESSERA_clusters has encoded, within the limits of scene/clusters.h.
  std::vector<std::uint8_t> triangles_of_cluster;
  Vertices vertices;
  std::vector<std::uint32_t> indices;
  int material = kNone;  // kNone: the default material
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
  std::vector<float> default_weights;  // of the morph targets
};

// ---- Textures of KTX2 files -------------------------------------------------------------------------------------

// A KTX2 image, and the textures that materials made of it. scene/held_textures.h makes the blocks in the emulated
// memory from the file.
struct BasisImage {
  std::vector<std::uint8_t> file;
  std::shared_ptr<const shaders::Texture> texture;        // plain RGBA8; may be null
  std::shared_ptr<const shaders::ScalarTexture> heights;  // plain 8-bit heights; may be null
};

// ---- Procedures -------------------------------------------------------------------------------------------------

// TESSERA_procedure: a surface that stays a formula until it is sampled. A shape whose parameters are chains of curves
// has a piece for each pair of curves; any other shape has one piece.
struct Procedure {
  struct Piece {
    shaders::ShapeInput input;
    float u_first = 0, u_scale = 1, v_first = 0,
          v_scale = 1;  // (u, v) of the whole surface = first + scale * (u, v) of the piece
  };
  shaders::ShapeId shape = shaders::ShapeId::kSphere;
  // The user's own stages, if any: kProgram of `shape` and `texture`, and rates for the sampling controller. The
  // constants of the shape's pieces are stored back to back; the pieces' inputs point at them.
  std::shared_ptr<const shaders::Program> shape_program, texture_program, rates_program;
  std::shared_ptr<const std::vector<float>> shape_constants;
  std::vector<float> texture_constants, rates_constants;
  std::vector<Piece> pieces;
  shaders::TextureId texture = shaders::TextureId::kPlain;
  std::array<float, 12> texture_numbers{1, 1, 1};
  shaders::ShadingId shading = shaders::ShadingId::kMaterial;
  std::array<float, 8> shading_numbers{};
  int material = kNone;
  std::shared_ptr<const shaders::GeometryImage> image;  // target of the pointers in the pieces' inputs
  // Limits of its tessellation: segments of each side of a base patch.
  int min_segments = 1, max_segments = kMaxSegments;
  static constexpr int kMaxSegments = 64;

  const shaders::StageDeclaration& declaration() const {
    return shape_program ? shape_program->declaration : shaders::shape_declarations()[static_cast<std::size_t>(shape)];
  }
};

// ---- Scene ------------------------------------------------------------------------------------------------------

struct Transform {
  DVec3 translation{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
};

// EXT_mesh_gpu_instancing: the place of a further copy of a node's mesh. Applied before the node's own transform; the
// rotation (x, y, z, w) is normalised when it is used.
struct InstanceTransform {
  std::array<float, 3> translation{0, 0, 0};
  std::array<float, 4> rotation{0, 0, 0, 1};
  std::array<float, 3> scale{1, 1, 1};
};

struct Node {
  std::string name;
  int parent = kNone;
  std::vector<int> children;
  Transform transform;  // used unless `matrix` is set
  std::optional<DMat4> matrix;
  int mesh = kNone, skin = kNone, camera = kNone, light = kNone, procedure = kNone;
  std::vector<float> weights;                // overrides the mesh's default weights when not empty
  std::vector<InstanceTransform> instances;  // not empty: the mesh is drawn once for each of them, and nowhere else
  bool visible = true;                       // KHR_node_visibility: false hides the node and everything below it
};

struct Skin {
  std::vector<int> joints;          // nodes
  std::vector<DMat4> inverse_bind;  // one per joint
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };
// The property that a channel moves. All but the first four need KHR_animation_pointer.
enum class AnimatedPath : std::uint8_t {
  kTranslation,
  kRotation,
  kScale,
  kWeights,
  kVisible,         // of a node
  kMaterialNumber,  // of a material: one of material_numbers()
  kTextureOffset,
  kTextureRotation,
  kTextureScale,  // of one of a material's textures
  kFieldOfView,
  kXMag,
  kYMag,
  kNear,
  kFar,  // of a camera
  kLightColor,
  kLightIntensity,
  kLightRange,
  kInnerCone,
  kOuterCone,  // of a light
  kShapeNumbers,
  kTextureNumbers,
  kShadingNumbers,
  kRatesNumbers,  // of a node's procedure: one parameter of a stage
};
inline bool moves_node(AnimatedPath path) {
  return path <= AnimatedPath::kVisible || path >= AnimatedPath::kShapeNumbers;
}

struct AnimationChannel {
  int node = kNone;    // for paths of nodes
  int object = kNone;  // for the other paths: the material, camera or light
  int part = 0;  // of a material: its MaterialTexture, or index into material_numbers(); of a stage: its parameter
  AnimatedPath path = AnimatedPath::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  int components = 3;         // floats per value: 3, 4, or the number of morph targets or of the parameter's numbers
  std::vector<float> times;   // strictly increasing seconds
  std::vector<float> values;  // cubic spline: in-tangent, value, out-tangent per key
};

struct Animation {
  std::string name;
  std::vector<AnimationChannel> channels;
  float duration() const;  // last key time of any channel
};

// TESSERA_lens: thin lens of a camera. Radius 0 is a pinhole.
struct Lens {
  float aperture_radius = 0.0f;  // scene units
  float focus_distance = 0.0f;   // scene units in front of the camera; infinity allowed
};

struct Camera {
  enum class Type : std::uint8_t { kPerspective, kOrthographic };
  std::string name;
  Type type = Type::kPerspective;
  float vertical_fov = 0.8f;         // radians, perspective
  float x_mag = 1.0f, y_mag = 1.0f;  // half extents, orthographic
  float near = 0.1f;
  float far = 0.0f;  // 0: unlimited
  Lens lens;
};

// The inner cone of a spot light is smaller than the outer cone by at least this share of it.
inline constexpr double kSharpestCone = 1e-3;

// A light's parameters as in the file; Capture::lights holds the shader's light made from them.
struct LightParameters {
  Vec3 color{1.0f};
  float intensity = 1.0f;
  double inner_cone = 0.0, outer_cone = 0.7853981633974483;  // radians

  void apply(shaders::Light& light) const {
    light.color = color * intensity;
    light.cos_inner = static_cast<float>(std::cos(inner_cone));
    light.cos_outer = static_cast<float>(std::cos(outer_cone));
  }
};

// A light that casts shadows (TESSERA_capture.shadows), and the maps that hold them.
struct ShadowRequest {
  static constexpr std::size_t kMaxLights = 16;  // lights of a capture that cast shadows
  static constexpr int kMaxSize = 16384, kMaxCascades = 8;

  int light = kNone;    // index into Capture::lights: every node with this light casts shadows
  int size = 1024;      // texels along a map's side
  int cascades = 1;     // maps of a directional light
  double distance = 0;  // reach of the maps from the camera, in scene units; 0: to the end of the scene
};

// TESSERA_capture: the replay settings in the file.
struct CaptureSettings {
  int width = 1280, height = 720;
  double frame_rate = 30.0;
  double shutter_open = 0.0, shutter_close = 0.0;  // fractions of a frame, open <= close; equal: no motion blur
  int first_frame = 0, frame_count = 1;
  int camera_node = kNone;  // kNone: the first camera in the scene, or automatic framing
  float exposure = 1.0f;
  shaders::Surroundings::Kind environment_kind = shaders::Surroundings::Kind::kStudio;
  std::optional<float> environment;  // intensity; unset: 1, or 0.3 of the studio's intensity when the file has lights
  std::optional<Vec3> background;    // linear colour; unset: the environment
  std::vector<ShadowRequest> shadows{};  // none: lights shine through everything
  std::optional<PassGraph> graph{};      // unset: passes follow from shadows, materials and settings
  bool declared = false;                 // false: the file has no TESSERA_capture, and these are defaults
};

struct Capture {
  std::filesystem::path file;
  std::uint64_t file_bytes = 0;     // bytes of the file and of its buffers and images
  std::uint64_t charged_bytes = 0;  // part of CaptureLimits::max_bytes that reading used
  // CaptureLimits::max_bytes: each drawn frame may use the bytes that reading left.
  std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
  // Host time of reading: first the file, its JSON and its checks; then decoding of buffers and images.
  double load_seconds = 0, decode_seconds = 0;
  std::vector<Node> nodes;
  std::vector<int> roots;  // root nodes of the drawn scene
  std::vector<Mesh> meshes;
  std::vector<Procedure> procedures;
  std::vector<Material> materials;
  std::vector<BasisImage> basis_images;
  std::vector<Skin> skins;
  std::vector<Animation> animations;
  std::vector<int>
      played_animations;  // animations played together: the first one, and every further one that moves none of the same
                          // properties
  std::vector<Camera> cameras;
  std::vector<shaders::Light> lights;             // colour, cone and range; placed by their nodes
  std::vector<LightParameters> light_parameters;  // of each light
  std::vector<std::string> variants;              // KHR_materials_variants: names of the variants
  int variant = kNone;  // index into `variants`: the variant whose materials the primitives have
  CaptureSettings settings;
  std::shared_ptr<const shaders::EnvironmentImage> environment_image;  // set if the environment is an image
  std::vector<std::string> extensions_used,
      extensions_unread;             // as the file lists them; the extensions that the reader ignores
  std::vector<std::string> notices;  // parts that the reader skipped, or its assumptions, as texts for people
};

}  // namespace tessera::scene
