#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/configuration.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "scene/frame_geometry.h"
#include "tests/support/machine_visibility.h"

namespace tessera::bench {

// The scene of the visibility benchmarks: a wavy wall of bicubic patches that extends beyond the image, and a crowd of closed
// blobs in front of it. Every object moves by `blur` pixels, each in its own direction; surfaces are opaque and single-sided.
struct SceneSettings {
  double area = 1;    // wanted mean area of a triangle, pixels^2
  double blur = 0;    // motion of every object in pixels
  bool lens = false;  // circle of confusion of 32 pixels on the wall
  int samples_per_pixel = 4;
  bool textured = false;  // base colour, metalness and roughness by images; a sun and a lamp beside the studio's light
  tilecore::Traversal traversal = tilecore::Traversal::kAuto;
};

// The scene posed for one image, and the machine that renders it.
struct PosedScene {
  // Poses three times and corrects the tessellation's edge length until the mean area is the wanted one.
  PosedScene(int width, int height, const SceneSettings& settings);
  PosedScene(const PosedScene&) = delete;
  PosedScene& operator=(const PosedScene&) = delete;

  scene::Capture capture;
  scene::Assembly assembly;
  frontend::PyramidLibrary pyramids;
  gpu::GpuConfiguration gpu;
  tilecore::SamplePattern pattern;
  binner::TileGrid grid;
  test::MachineVisibility machine;
  std::unique_ptr<scene::FrameGeometry> frame;
  std::vector<std::uint32_t> patches;  // kept by the front end, in order
  double mean_area = 0;                // reached mean area at shutter open
};

// The patches that the front end keeps, in order.
std::vector<std::uint32_t> kept_patches(const scene::FrameGeometry& frame, const frontend::PyramidLibrary& pyramids,
                                        const gpu::GpuConfiguration& gpu);

// Frame `number` of a capture, posed for one image as a device of the default machine poses it.
struct PosedCapture {
  PosedCapture(const std::string& file, const gpu::RunSettings& settings, int number, int width, int height);
  PosedCapture(const PosedCapture&) = delete;
  PosedCapture& operator=(const PosedCapture&) = delete;

  // Makes a device that renders the same frames completely.
  gpu::Device device() const;

  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  scene::Capture capture;
  scene::Assembly assembly;
  frontend::PyramidLibrary pyramids;
  std::unique_ptr<scene::FrameGeometry> frame;
  std::vector<std::uint32_t> patches;  // kept by the front end, in order
};

// Triangles of a posed frame for renderers that take vertices: one indexed list, patch by patch.
struct TriangleList {
  struct Vertex {
    float x, y, z;  // position in pixels (on the sub-pixel grid) and depth
  };
  std::array<std::vector<Vertex>, 2> keys;  // shutter open and close; equal for objects at rest
  std::vector<std::uint32_t> patch;         // base patch of each vertex
  std::vector<std::uint32_t> indices;       // three per triangle; a front face is counter-clockwise with y up
  float near_depth = 0, far_depth = 0;      // range of all vertices' depths

  std::size_t triangle_count() const { return indices.size() / 3; }
  // Areas at shutter open in pixels^2.
  double front_area(std::size_t triangle) const;  // negative for back faces
  double mean_area() const;
};

// Tessellates `patches` as a whole. Throws std::runtime_error for content that the list cannot express: a vertex in
// front of the near plane or far beside the image, or a double-sided material.
TriangleList list_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches);

}  // namespace tessera::bench
