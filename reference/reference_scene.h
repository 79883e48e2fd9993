#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "reference/sample_region.h"
#include "scene/frame_geometry.h"
#include "scene/limits.h"
#include "scene/shadow_settings.h"
#include "tilecore/shading/surface.h"

namespace tessera::reference {

// The scene of one frame as the reference renderer sees it: triangles in double precision and a tree of moving boxes
// above them. It shares with the machine what a scene *means* (posing, the domain shader's formula, parametric grids,
// pixel shader) and nothing of how the machine finds what is visible: no sub-pixel grid, no tiles, no bounds, no rest
// frames, no single precision.
//
// Space: a vertex is (x, y, depth), x and y being raster coordinates from the middle of the image times w (w = depth;
// 1 if the projection is orthographic). That is linear in the point of the scene, so a vertex moves on a straight line
// at constant speed between the keys, and what a sample looks along is the line
//   perspective    x = u L + depth (sx - u L / f)
//   orthographic   x = sx + u L - depth u L / f
// with sx from the middle of the image, L: lens_scale, f: focus distance;
// that is (x, y) = origin + depth * direction: the one parameter is the depth, and nothing needs clipping.
//
// Invariants (cited by the tests):
//   REF1  A box holds its triangles at every time, rounding included.
//   REF2  What a ray hits does not depend on the tree: it is the same as without one.
// Leaves that no sample sees are left out before their vertices are computed (SampleRegion, SRG1).
struct ReferenceScene {
  // Four by four vertices at most: cells of 3 x 3, or a handful of a cluster's triangles.
  static constexpr std::size_t kLeafVertices = 24;

  struct Triangle {
    std::uint32_t patch, triangle;              // as SurfaceLocation has them
    std::array<std::uint8_t, 3> corner;         // of the leaf
    bool keep_positive : 1, keep_negative : 1;  // facing, as the machine's HitLimits
    bool opaque : 1;                            // else alpha decides, or it is a layer
    std::uint8_t step_bits : 4;                 // log2 of the cells of its grid along its sides
  };
  struct Leaf {
    std::uint32_t first_vertex, first_triangle;
    std::uint16_t vertex_count, triangle_count;
    bool moving;
  };
  // Interval of every axis at both motion keys; in between it is interpolated. Single precision, rounded outwards.
  struct Box {
    std::array<float, 3> low{}, high{};
  };
  struct Node {
    std::array<Box, 2> box;
    std::int32_t left = -1, right = -1;  // children; leaves have left < 0 and their number in `right`
    bool moving = false;
  };

  struct Options {
    // A frame with motion segments has a scene for each of them (1 on): what moves by segments moves by that one, what
    // does not is cut off at its ends.
    int segment = 0;
    bool behind = false;  // only what is seen behind surfaces that transmit, which is neither these nor what blends
    // Only what casts shadows, by these settings, wherever it is: what shadow rays go through (shadow_rays.h). Parts of
    // grids that no sample of the region sees are no finer than 16 cells a side.
    const scene::ShadowSettings* casters = nullptr;
    std::optional<SampleRegion> region;     // what is to be seen; unset: the whole image
    scene::MemoryBudget* budget = nullptr;  // nullptr: what the capture has left of its limit
    bool count_only = false;                // triangle_count alone
  };

  // `frame_in` must outlive it, and is posed with grids as fine as the reference is wanted. Throws BudgetError before it
  // takes memory that is not there. Runs on all threads.
  explicit ReferenceScene(const scene::FrameGeometry& frame_in) : ReferenceScene(frame_in, Options()) {}
  ReferenceScene(const scene::FrameGeometry& frame_in, const Options& options);

  const scene::FrameGeometry& frame;  // of the whole shutter
  const scene::FrameGeometry& posed;  // of the segment: camera, and what is curved
  int segment;
  std::optional<scene::ShadowSettings> casters;
  double center_x, center_y;
  double near, far;  // far: infinity where unlimited
  bool orthographic;
  double lens_scale, inverse_focus;
  SampleRegion region;
  // (u, v) of a point of a grid's triangle, from its corners' own.
  struct Parameters {
    double u, v;
  };
  Parameters grid_parameters(const Triangle& triangle, double b1, double b2) const;
  // A point of a triangle as shading asks for it. `t`: of the whole shutter.
  tilecore::SurfaceLocation location(std::int64_t triangle, double b1, double b2, double t) const;

  std::vector<std::array<double, 6>> vertices;  // at open, at close; leaf by leaf
  std::vector<Triangle> triangles;
  std::vector<Leaf> leaves;
  std::vector<Node> nodes;  // the root first; empty without triangles
  std::uint64_t triangle_count = 0;
  double mean_travel_pixels = 0;     // of leaves on screen, from open to close
  double mean_confusion_pixels = 0;  // radius of the circle of confusion

 private:
  // Vertices, triangles and leaves of a patch, or where a patch's begin.
  struct Amount {
    std::uint64_t vertices = 0, triangles = 0, leaves = 0;
  };
  // Scratch memory of a thread that goes from patch to patch.
  struct PatchWork;

  void find_reach();
  void place_drawables(const scene::FrameGeometry& by);
  void add_patches(const Options& options, scene::MemoryBudget& budget);
  static void charge(const Amount& amount, const scene::FrameGeometry& frame, scene::MemoryBudget& budget);
  bool left_out(std::uint32_t patch, bool behind) const;
  // Which leaves of a patch are seen, and how much they are.
  Amount find_seen(std::uint32_t patch, PatchWork& work) const;
  void find_seen_of_grid(std::uint32_t patch, PatchWork& work) const;
  void find_seen_of_cluster(std::uint32_t patch, PatchWork& work) const;
  void begin_grid(std::uint32_t patch, PatchWork& work) const;
  const std::array<double, 6>& grid_vertex(std::uint32_t patch, int i, int j, PatchWork& work) const;
  void fill_grid(std::uint32_t patch, Amount at, PatchWork& work);
  void fill_cluster(std::uint32_t patch, Amount at, PatchWork& work);
  // By the frame that a drawable moves by.
  const scene::PosedDrawable& posed_drawable(std::uint32_t patch) const;
  // At the ends of the segment, of what moves by the whole shutter's keys.
  void cut_off(std::array<double, 6>& vertex, const scene::PosedDrawable& drawable) const;
  std::array<double, 6> cluster_vertex(std::uint32_t patch, std::uint32_t vertex) const;
  static Leaf leaf_between(const Amount& begin, const Amount& end, bool moving);
  Triangle triangle_of(std::uint32_t patch) const;

  // The tree over all leaves.
  void build_tree();
  void build(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end, std::size_t number);
  std::size_t choose_split(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) const;
  std::array<Box, 2> leaf_boxes(const Leaf& leaf) const;
  void measure_blur();

  std::vector<std::array<DMat4, 2>> drawable_to_raster_;  // per drawable, centred
  std::vector<double> reach_;                             // per drawable: the farthest that displacement moves a vertex
  std::vector<std::array<Box, 2>> leaf_boxes_;            // while it is built
};

}  // namespace tessera::reference
