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
  std::vector<Vec3> positions, normals, tangents;  // differences; empty when the target does not move them
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
  std::vector<std::vector<Vec2>> texcoords;  // by set number; one that the file does not have is empty
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
  // is four vertices where it is; a segment two where it begins and two where it ends.
  enum class Wire : std::uint8_t { kSurface, kPoints, kSegments };
  Kind kind = Kind::kTriangles;
  Wire wire = Wire::kSurface;
  bool in_cluster_order = false;  // kTriangles: as TESSERA_clusters says, which may be wrong
  // kTriangles that TESSERA_clusters has encoded: triangles of each cluster, within the limits of scene/clusters.h.
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

// A KTX2 image, and what the materials have of it; scene/held_textures.h makes the blocks that the emulated memory holds
// from the file.
struct BasisImage {
  std::vector<std::uint8_t> file;
  std::shared_ptr<const shaders::Texture> texture;        // plain RGBA8; may be null
  std::shared_ptr<const shaders::ScalarTexture> heights;  // the same; may be null
};

// ---- Procedures -------------------------------------------------------------------------------------------------

// TESSERA_procedure: a surface that stays a formula until it is sampled. A shape whose parameters are chains of curves
// has a piece for each pair of curves; all others have one.
struct Procedure {
  struct Piece {
    shaders::ShapeInput input;
    float u_first = 0, u_scale = 1, v_first = 0,
          v_scale = 1;  // (u, v) of the whole = first + scale * (u, v) of the piece
  };
  shaders::ShapeId shape = shaders::ShapeId::kSphere;
  // The user's own stages, where there are such: kProgram of `shape` and `texture`, and rates for the sampling
  // controller. Constants of the shape's pieces lie one behind the other; their inputs point at them.
  std::shared_ptr<const shaders::Program> shape_program, texture_program, rates_program;
  std::shared_ptr<const std::vector<float>> shape_constants;
  std::vector<float> texture_constants, rates_constants;
  std::vector<Piece> pieces;
  shaders::TextureId texture = shaders::TextureId::kPlain;
  std::array<float, 12> texture_numbers{1, 1, 1};
  shaders::ShadingId shading = shaders::ShadingId::kMaterial;
  std::array<float, 8> shading_numbers{};
  int material = kNone;
  std::shared_ptr<const shaders::GeometryImage> image;  // what the pieces' inputs point at
  // Where it is tessellated: segments of each side of a base patch.
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

// EXT_mesh_gpu_instancing: where a node draws its mesh once more. Applied before the node's own transform; the rotation
// (x, y, z, w) is normalised when it is used.
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
  std::vector<InstanceTransform> instances;  // not empty: the mesh is drawn at each of them, and only there
  bool visible = true;                       // KHR_node_visibility: false hides what is below, too
};

struct Skin {
  std::vector<int> joints;          // nodes
  std::vector<DMat4> inverse_bind;  // one per joint
};

enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };
// What a channel moves; all but the first four by KHR_animation_pointer alone.
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
  int node = kNone;    // of the paths of nodes
  int object = kNone;  // the material, camera or light of the others
  int part = 0;        // of a material: its MaterialTexture, or one of material_numbers(); of a stage: its parameter
  AnimatedPath path = AnimatedPath::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  int components = 3;         // floats per value: 3, 4, the number of morph targets or of a parameter's numbers
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

// The inner cone of a spot light is smaller than the outer one by this share of it, at least.
inline constexpr double kSharpestCone = 1e-3;

// A light's parameters as the file has them; Capture::lights holds what is made from them.
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
  static constexpr std::size_t kMaxLights = 16;  // of a capture that cast
  static constexpr int kMaxSize = 16384, kMaxCascades = 8;

  int light = kNone;    // of Capture::lights: every node that has it casts
  int size = 1024;      // texels along a map's side
  int cascades = 1;     // maps of a directional light
  double distance = 0;  // scene units from the camera that they reach; 0: as far as the scene does
};

// TESSERA_capture: how the file wants to be replayed.
struct CaptureSettings {
  int width = 1280, height = 720;
  double frame_rate = 30.0;
  double shutter_open = 0.0, shutter_close = 0.0;  // fractions of a frame, open <= close; equal: no motion blur
  int first_frame = 0, frame_count = 1;
  int camera_node = kNone;  // kNone: the first camera in the scene, or automatic framing
  float exposure = 1.0f;
  shaders::Surroundings::Kind environment_kind = shaders::Surroundings::Kind::kStudio;
  std::optional<float> environment;      // intensity; unset: 1, or 0.3 of the studio's when the file has lights
  std::optional<Vec3> background;        // linear colour; unset: the environment
  std::vector<ShadowRequest> shadows{};  // none: lights shine through everything
  std::optional<PassGraph> graph{};      // unset: passes follow from shadows, materials and settings
  bool declared = false;                 // false: the file says nothing, these are defaults
};

struct Capture {
  std::filesystem::path file;
  std::uint64_t file_bytes = 0;     // of the file and its buffers and images
  std::uint64_t charged_bytes = 0;  // of CaptureLimits::max_bytes, by reading it
  // CaptureLimits::max_bytes: what is left of them is for each frame that is drawn.
  std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
  // Host time of reading it: of the file, its JSON and its checks; then of what its buffers and images hold.
  double load_seconds = 0, decode_seconds = 0;
  std::vector<Node> nodes;
  std::vector<int> roots;  // nodes of the scene that is drawn
  std::vector<Mesh> meshes;
  std::vector<Procedure> procedures;
  std::vector<Material> materials;
  std::vector<BasisImage> basis_images;
  std::vector<Skin> skins;
  std::vector<Animation> animations;
  std::vector<int> played_animations;  // played together: the first, and every further one that does not fight it
  std::vector<Camera> cameras;
  std::vector<shaders::Light> lights;             // colour, cone and range; placed by their nodes
  std::vector<LightParameters> light_parameters;  // of each light
  std::vector<std::string> variants;              // KHR_materials_variants: their names
  int variant = kNone;                            // the one whose materials the primitives have, of `variants`
  CaptureSettings settings;
  std::shared_ptr<const shaders::EnvironmentImage> environment_image;  // of an environment that is one
  std::vector<std::string> extensions_used, extensions_unread;  // as the file says; all that the reader passes over
  std::vector<std::string> notices;                             // what the reader skipped or assumed, for people
};

}  // namespace tessera::scene
