#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <embree3/rtcore.h>

#include "scene/frame_geometry.h"
#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::test {

// Tessera's triangles as triangles of Embree.
//
// Space: camera space (x right, y down, depth), but with every projected vertex at its snapped raster position: (X z,
// Y z, z) over the focal length, (0,0) in the middle of the image. Orthographic: (X, Y, z) over the pixels per unit.
// In it
//   EMB1  Tessera's moving triangle *is* Embree's: X(t) = X0 + lambda(t) (X1 - X0) with lambda = t z1 / z(t) means X(t)
//         z(t) = (1-t) X0 z0 + t X1 z1, which is linear in t. Two time steps say it all; no snap is left to tolerate.
//   EMB2  a sample (x, y, t, u, v) is one ray of unit depth per unit of its parameter, from the lens point (u, v, 0).
// So the two may differ by the rounding of single precision alone.

// Embree's device with a configuration string; see Embree's rtcNewDevice.
class EmbreeDevice {
 public:
  explicit EmbreeDevice(const char* configuration);
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;
  ~EmbreeDevice();
  RTCDevice get() const { return device_; }

 private:
  RTCDevice device_;
};

struct EmbreeOptions {
  enum class Geometry { kTriangles, kGrids };  // kGrids: Bezier patches only, one grid each
  Geometry geometry = Geometry::kTriangles;
  bool robust = true;       // Embree's watertight intersectors
  bool obey_facing = true;  // single-sided materials are seen from their front only (costs a callback per hit)
  // Hits where a mask cuts a surface out do not count (a callback and a bilinear lookup of the finest level per hit
  // of such a material, whose patches are triangles also with kGrids). Colours of vertices are ignored.
  bool masks = false;
  // For broken twins: the number of a triangle that Embree does not get.
  std::uint32_t missing_patch = 0xFFFFFFFFu, missing_triangle = 0xFFFFFFFFu;
};

// A sample's ray in Embree's space.
struct EmbreeRay {
  float origin_x, origin_y, direction_x, direction_y;  // origin z = 0, direction z = 1
  float time;
};

// Surface that a sample sees according to Tessera or Embree.
struct Claim {
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFu;
  std::uint32_t patch = kNothing, triangle = kNothing;
  float z = 0;
  bool operator==(const Claim& o) const { return patch == o.patch && triangle == o.triangle; }
};

// Ties: two claims may differ where the sample lies within `edge_pixels` of an edge of a claimed triangle, or where
// the two surfaces, or a surface and the near or far plane, have the same depth: up to `relative_depth`, plus the
// change of the surface's depth over `edge_pixels`.
struct Tolerance {
  double edge_pixels = 0x1p-14;
  double relative_depth = 2e-6;
};

struct Agreement {
  std::uint64_t samples = 0, visible = 0;
  std::uint64_t ties = 0;            // samples that the tolerance excludes, whether the claims agree or not
  std::uint64_t different_ties = 0;  // of these, claims that differ
  std::uint64_t wrong = 0;           // claims that differ outside the tolerance
  std::uint64_t wrong_depth = 0;     // same triangle, but depths further apart than the tolerance
  double farthest_edge_pixels =
      0;  // largest distance from an edge at which claims differed, other than by their depths alone
  void add(const Agreement& other);
};

class EmbreeScene {
 public:
  // Tessellates `patches` whole, in parallel, into Embree's buffers. `frame` must outlive the scene.
  EmbreeScene(const EmbreeDevice& device, const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches,
              const EmbreeOptions& options);
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene();

  // Builds the acceleration structure.
  void commit() { rtcCommitScene(scene_); }

  std::uint64_t triangle_count() const { return triangle_count_; }

  EmbreeRay ray(const tilecore::TileSamples& samples, std::size_t sample) const;
  RTCScene scene() const { return scene_; }
  float near() const { return near_; }
  float far() const { return far_; }

  Claim trace(const EmbreeRay& ray) const;
  // Claim in Tessera's numbers for a hit of Embree's.
  Claim claim(std::uint32_t geometry, std::uint32_t primitive, float u, float v, float z) const;

  // Judges one sample; index_triangles() comes first.
  void index_triangles();
  void compare(const EmbreeRay& ray, const Claim& tessera, const Claim& embree, const Tolerance& tolerance,
               Agreement& agreement) const;

 private:
  struct Patch {
    std::uint32_t number = 0;
    bool moving = false, grid = false;
    std::uint64_t triangle_count = 0;
    bool keep_positive = true, keep_negative = true;
    std::array<const float*, 2> vertices{};  // Embree's buffers, xyz
    const std::uint32_t* index = nullptr;    // three per triangle; Embree's buffer, or `own_index`
    std::vector<std::uint32_t> own_index;
    std::vector<std::uint32_t> triangle;  // Tessera's number of each
    std::vector<std::uint32_t> place;     // by Tessera's number: place in `triangle`; see index_triangles
    std::uint32_t columns = 0, rows = 0;  // cells of the grid
    const scene::Material* mask = nullptr;
    std::vector<Vec2> texcoords;  // of its vertices, where the mask is read
    bool facing = false;          // hits on the side that is not kept do not count
  };
  void fill(const EmbreeDevice& device, Patch& patch, const EmbreeOptions& options);
  static void fill_index(RTCGeometry geometry, const tilecore::MicroMesh& mesh, Patch& patch,
                         const EmbreeOptions& options);
  static void index_grid(Patch& patch);
  // A claimed triangle as the ray passes it: distance from its nearest edge, and change of depth per pixel. Infinite
  // and zero when Embree has no such triangle.
  struct Passage {
    double edge_pixels, slope;
  };
  Passage passage(const EmbreeRay& ray, const Claim& claim) const;
  static void filter(const RTCFilterFunctionNArguments* arguments);

  const scene::FrameGeometry& frame_;
  RTCScene scene_;
  std::vector<Patch> patches_;
  std::vector<std::uint32_t> slot_;  // by patch number: place in patches_
  std::uint64_t triangle_count_ = 0;
  float near_, far_;
};

}  // namespace tessera::test
