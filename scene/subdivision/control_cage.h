#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "scene/capture.h"
#include "scene/limits.h"

namespace tessera::scene::subdivision {

inline constexpr int kMaxLevels = 4;              // [assumed] 256 patches for each quad of the cage
inline constexpr int kDefaultLevels = 1;          // the first step after which every face has four sides
inline constexpr float kInfinitelySharp = 10.0f;  // [spec] OpenSubdiv, Sdc::Crease::SHARPNESS_INFINITE
inline constexpr std::size_t kMaxValence = 1024;  // [assumed] number of edges that may meet in a point

// Vertices of the primitive and the sharpness of the surface there. As edges: each vertex with the next one.
struct SharpFeature {
  std::vector<std::uint32_t> vertices;
  float sharpness = kInfinitelySharp;
};

enum class BoundaryRule : std::uint8_t {
  kEdge,           // the boundary is a smooth curve
  kEdgeAndCorner,  // and points with a single face are sharp corners
};

// Contents of a primitive's TESSERA_subdivision extension.
struct CageRules {
  int levels = kDefaultLevels;  // steps of refinement before faces become patches
  BoundaryRule boundary = BoundaryRule::kEdgeAndCorner;
  // The first 2 * quads triangles are pairs (a, b, c), (a, c, d) that stand for the face (a, b, c, d); each other
  // triangle is a face of its own.
  std::size_t quads = 0;
  std::vector<SharpFeature> creases, corners;
};

// A cage that cannot be refined; the message says where, in vertices of the primitive.
class CageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The topology of a control mesh.
//
// Invariants (cited by the tests):
//   CAGE1  Vertices of the primitive that are one point (weld_points) are one point here, whatever their texture
//          coordinates and normals.
//   CAGE2  Every edge has one face, or two that run through it in opposite directions; the faces around a point form
//          one fan. Points at which a primitive's faces form several fans are split, one point for each, and made
//          infinitely sharp, so that the fans keep meeting there.
//   CAGE3  Faces have three or four different points. Sides without length are left out, and so are faces without area.
struct ControlCage {
  std::vector<std::uint32_t> point_vertex;  // per point: a vertex of the primitive that carries its data
  std::vector<int> face_sizes;
  std::vector<int> face_points;  // the faces' corners, one face after the other
  std::vector<std::uint32_t>
      corner_vertex;               // per corner: the primitive's vertex, for unshared data (texture coordinates)
  std::vector<int> crease_points;  // two per crease edge
  std::vector<float> crease_sharpness;
  std::vector<int> corner_points;
  std::vector<float> corner_sharpness;
  std::size_t split_points = 0;  // points added because of CAGE2
};

// Throws CageError for a quad whose triangles do not fit together, an edge with faces that CAGE2 cannot separate, a
// sharp edge that is no edge of the cage, more than kMaxValence edges at a point, or a cage whose faces all have no
// area.
ControlCage build_cage(const Primitive& primitive, const CageRules& rules);

// Turns a Catmull-Clark control mesh into bicubic Bezier patches: refines the cage rules.levels times (OpenSubdiv) and
// gives every face of the last level a patch (limit_masks.h defines the patches and says where they are exact).
//
// `cage` is a primitive of triangles. The result has its material and the same number of morph targets. Positions and
// their morph differences are weighted sums of the cage's; influences are blended with the same weights, the eight
// largest kept and renormalised; texture coordinates and colours are bilinear within each face of the cage. Normals and
// tangents are dropped: a patch has its own.
//
// Memory is charged to `budget` before it is taken, naming `what`. Throws CageError, LimitError.
Primitive convert(const Primitive& cage, const CageRules& rules, MemoryBudget& budget, const std::string& what);

}  // namespace tessera::scene::subdivision
