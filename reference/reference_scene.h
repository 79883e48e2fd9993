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
// above them. It shares the meaning of a scene with the machine (posing, the domain shader's formula, parametric
// grids, pixel shader), but none of the machine's ways to find visible surfaces: no sub-pixel grid, no tiles, no
// bounds, no rest frames, no single precision.
//
// Space: a vertex is (x, y, depth), x and y being raster coordinates from the middle of the image times w (w = depth; 1 if the
// projection is orthographic). These are linear in the point of the scene, so a vertex moves on a straight line at constant
// speed between the keys, and the ray of a sample is the line
//   perspective    x = u L + depth (sx - u L / f)
//   orthographic   x = sx + u L - depth u L / f
// with sx from the middle of the image, L: lens_scale, f: focus distance.
// So (x, y) = origin + depth * direction: depth is the only parameter, and nothing needs clipping.
//
// Invariants (cited by the tests):
//   REF1  A box holds its triangles at every time, rounding included.
//   REF2  The hit of a ray does not depend on the tree: it is the same as without one.
// Leaves that no sample sees are left out before their vertices are computed (SampleRegion, SRG1).
struct ReferenceScene {
  // At most four by four vertices: cells of 3 x 3, or a handful of a cluster's triangles.
  static constexpr std::size_t kLeafVertices = 24;

  struct Triangle {
    std::uint32_t patch, triangle;              // see SurfaceLocation
    std::array<std::uint8_t, 3> corner;         // indices in the leaf
    bool keep_positive : 1, keep_negative : 1;  // facing, as in the machine's HitLimits
    bool opaque : 1;                            // otherwise alpha decides, or it is a layer
    std::uint8_t step_bits : 4;                 // log2 of the number of its grid's cells along a side
  };
  struct Leaf {
    std::uint32_t first_vertex, first_triangle;
    std::uint16_t vertex_count, triangle_count;
    bool moving;
  };
  // Interval of every axis at both motion keys, interpolated in between. Single precision, rounded outwards.
  struct Box {
    std::array<float, 3> low{}, high{};
  };
  struct Node {
    std::array<Box, 2> box;
    std::int32_t left = -1, right = -1;  // children; leaves have left < 0 and their number in `right`
    bool moving = false;
  };

  struct Options {
    // Number of a motion segment, 1 on; a frame with segments has a scene for each. Drawables that move by segments
    // move by this one; the motion of others is cut off at its ends.
    int segment = 0;
    bool behind = false;  // only the background of transmitting surfaces: neither these nor blended surfaces
    // Settings of shadows: the scene then holds only casters, wherever they are, for shadow rays (shadow_rays.h).
    // Parts of grids that no sample of the region sees are no finer than 16 cells a side.
    const scene::ShadowSettings* casters = nullptr;
    std::optional<SampleRegion> region;     // region that samples see; unset: the whole image
    scene::MemoryBudget* budget = nullptr;  // nullptr: the rest of the capture's limit
    bool count_only = false;                // computes triangle_count alone
  };

  // `frame_in` must outlive the scene, and is posed with the reference's grids. Throws BudgetError before it takes
  // memory beyond the budget. Runs on all threads.
  explicit ReferenceScene(const scene::FrameGeometry& frame_in) : ReferenceScene(frame_in, Options()) {}
  ReferenceScene(const scene::FrameGeometry& frame_in, const Options& options);

  const scene::FrameGeometry& frame;  // frame of the whole shutter
  const scene::FrameGeometry& posed;  // frame of the segment: its camera and its curved motion
  int segment;
  std::optional<scene::ShadowSettings> casters;
  double center_x, center_y;
  double near, far;  // far: infinity where unlimited
  bool orthographic;
  double lens_scale, inverse_focus;
  SampleRegion region;
  // (u, v) of a point of a grid's triangle, from the parameters of its corners.
  struct Parameters {
    double u, v;
  };
  Parameters grid_parameters(const Triangle& triangle, double b1, double b2) const;
  // A point of a triangle in the form that shading needs. `t`: time of the whole shutter.
  tilecore::SurfaceLocation location(std::int64_t triangle, double b1, double b2, double t) const;

  std::vector<std::array<double, 6>> vertices;  // at open, at close; leaf by leaf
  std::vector<Triangle> triangles;
  std::vector<Leaf> leaves;
  std::vector<Node> nodes;  // the root first; empty without triangles
  std::uint64_t triangle_count = 0;
  double mean_travel_pixels = 0;     // mean over leaves on screen, from open to close
  double mean_confusion_pixels = 0;  // mean radius of the circle of confusion

 private:
  // Numbers of vertices, triangles and leaves of a patch, or the positions at which they begin.
  struct Amount {
    std::uint64_t vertices = 0, triangles = 0, leaves = 0;
  };
  // Scratch memory of a thread, reused from patch to patch.
  struct PatchWork;

  void find_reach();
  void place_drawables(const scene::FrameGeometry& by);
  void add_patches(const Options& options, scene::MemoryBudget& budget);
  static void charge(const Amount& amount, const scene::FrameGeometry& frame, scene::MemoryBudget& budget);
  bool left_out(std::uint32_t patch, bool behind) const;
  // Finds the visible leaves of a patch, and counts their content.
  Amount find_seen(std::uint32_t patch, PatchWork& work) const;
  void find_seen_of_grid(std::uint32_t patch, PatchWork& work) const;
  void find_seen_of_cluster(std::uint32_t patch, PatchWork& work) const;
  void begin_grid(std::uint32_t patch, PatchWork& work) const;
  const std::array<double, 6>& grid_vertex(std::uint32_t patch, int i, int j, PatchWork& work) const;
  void fill_grid(std::uint32_t patch, Amount at, PatchWork& work);
  void fill_cluster(std::uint32_t patch, Amount at, PatchWork& work);
  // The drawable as posed by the frame that it moves by.
  const scene::PosedDrawable& posed_drawable(std::uint32_t patch) const;
  // Cuts the motion of a vertex by the whole shutter's keys off at the ends of the segment.
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

  std::vector<std::array<DMat4, 2>> drawable_to_raster_;  // by drawable, centred
  std::vector<double> reach_;                   // by drawable: the farthest distance that displacement moves a vertex
  std::vector<std::array<Box, 2>> leaf_boxes_;  // only while the tree is built
};

}  // namespace tessera::reference
