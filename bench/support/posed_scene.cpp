#include "bench/support/posed_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "base/parallel.h"
#include "base/random.h"
#include "gpu/view_inputs.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/texture.h"
#include "tests/support/captures.h"
#include "tests/support/mesh_triangles.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::bench {
namespace {

gpu::GpuConfiguration machine_for(const SceneSettings& settings) {
  gpu::GpuConfiguration gpu;
  gpu.tilecore.visibility.traversal = settings.traversal;
  return gpu;
}

constexpr double kFocalPixels = 720;  // one unit is one pixel at this depth
constexpr float kWallDepth = 900;
constexpr float kMargin = 160;  // pixels of wall beyond the frame, so that it fills the frame at all times

std::vector<Vec3> wall(int width, int height) {
  constexpr float kPatchPixels = 32, kUnit = kWallDepth / static_cast<float>(kFocalPixels);
  const int columns = static_cast<int>((static_cast<float>(width) + 2 * kMargin) / kPatchPixels),
            rows = static_cast<int>((static_cast<float>(height) + 2 * kMargin) / kPatchPixels) + 1;
  std::vector<Vec3> points;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          const float x = static_cast<float>(3 * column + i) / 3.0f - static_cast<float>(columns) / 2,
                      y = static_cast<float>(3 * row + j) / 3.0f - static_cast<float>(rows) / 2;
          points.push_back(
              {x * kPatchPixels * kUnit, y * kPatchPixels * kUnit, 12.0f * std::sin(1.3f * x) * std::cos(1.1f * y)});
        }
  return points;
}

std::vector<Vec3> blob(float radius) {
  std::vector<Vec3> points = test::closed_patches(scene::kNone).vertices.positions;
  for (Vec3& p : points) p *= radius;
  return points;
}

// An image of blocks that vary smoothly inside, so that small differences in footprint or level of detail hardly matter.
std::shared_ptr<const shaders::Texture> image(std::array<float, 3> low, std::array<float, 3> high,
                                              shaders::ColorSpace space) {
  constexpr int kSize = 512, kBlock = 8;
  Image8 pixels(kSize, kSize, 3);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const std::uint32_t block =
          hash32(static_cast<std::uint32_t>(x / kBlock), static_cast<std::uint32_t>(y / kBlock));
      const float wave =
          0.5f + 0.25f * std::sin(0.09f * static_cast<float>(x)) * std::cos(0.07f * static_cast<float>(y));
      for (std::size_t c = 0; c < 3; ++c) {
        const float share = 0.5f * wave + 0.5f * static_cast<float>(block >> 8 * c & 255) / 255.0f;
        pixels.at(x, y)[c] = static_cast<std::uint8_t>(255.0f * (low[c] + (high[c] - low[c]) * share));
      }
    }
  return std::make_shared<shaders::Texture>(DecodedImage{pixels}, space);
}

// Images, lights and the studio. A patch of the wall is 32 of the image's texels wide.
void add_material(scene::Capture& capture) {
  scene::Material material;
  material.base_color_texture.texture = image({0.2f, 0.15f, 0.1f}, {0.9f, 0.85f, 0.8f}, shaders::ColorSpace::kSrgb);
  material.metallic_roughness_texture.texture = image({0, 0.25f, 0}, {0, 0.9f, 0.8f}, shaders::ColorSpace::kLinear);
  for (scene::TextureSlot* slot : {&material.base_color_texture, &material.metallic_roughness_texture}) {
    slot->shift.scale = Vec2(1.0f / 16);
    slot->transform = slot->shift.transform();
  }
  capture.materials.push_back(material);
  capture.settings.environment = 1.0f;
  const auto add_light = [&](const shaders::Light& light, const DQuat& rotation, const DVec3& position) {
    capture.lights.push_back(light);
    capture.light_parameters.push_back({light.color, 1.0f});
    scene::Node node;
    node.light = static_cast<int>(capture.lights.size()) - 1;
    node.transform.rotation = rotation;
    node.transform.translation = position;
    capture.nodes.push_back(node);
    capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  };
  shaders::Light sun, lamp;
  sun.color = {1.2f, 1.1f, 1.0f};
  lamp.type = shaders::Light::Type::kPoint;
  lamp.color = {2e5f, 3e5f, 4e5f};
  add_light(sun, glm::angleAxis(-0.7, glm::normalize(DVec3(1, 0.5, 0))), DVec3(0));
  add_light(lamp, DQuat(1, 0, 0, 0), {-200, 100, -350});
}

scene::Capture make_capture(int width, int height, const SceneSettings& settings) {
  scene::Capture capture;
  if (settings.textured) add_material(capture);
  const int material = settings.textured ? 0 : scene::kNone;
  test::Random random(7);
  const auto add = [&](const std::vector<Vec3>& points, double x_pixels, double y_pixels, double depth) {
    const double unit = depth / kFocalPixels, angle = static_cast<double>(random.uniform(0, 6.2831853f));
    const int node =
        test::add_node(capture, test::patches(points, material), {x_pixels * unit, y_pixels * unit, -depth});
    if (settings.blur > 0)
      test::add_motion(capture, node, DVec3(std::cos(angle), std::sin(angle), 0) * (settings.blur * unit));
  };
  add(wall(width, height), 0, 0, static_cast<double>(kWallDepth));
  for (int y = 50; y < height; y += 100)
    for (int x = 50; x < width; x += 100) {
      const double depth = static_cast<double>(random.uniform(560, 800));
      // Radius in pixels: a quarter of the circle is about 60 pixels, within the largest tessellation factor.
      const auto radius = static_cast<float>(32 * depth / kFocalPixels);
      const double dx = static_cast<double>(random.uniform(-25, 25)), dy = static_cast<double>(random.uniform(-25, 25));
      add(blob(radius), x + dx - width / 2, y + dy - height / 2, depth);
    }
  scene::Camera camera;
  camera.vertical_fov = static_cast<float>(2 * std::atan(height / 2 / kFocalPixels));
  camera.near = 10;
  // Radius of confusion on the wall: focal length * aperture * (1/focus - 1/depth) = 16 pixels.
  if (settings.lens) camera.lens = {40, 600};
  test::add_camera(capture, DVec3(0.0), camera);
  return capture;
}

// One patch of a list, with its own vertex numbers from 0.
struct Piece {
  std::array<std::vector<TriangleList::Vertex>, 2> keys;
  std::vector<std::uint32_t> indices;
};

Piece list_patch(const scene::FrameGeometry& frame, std::uint32_t patch, tilecore::Tessellator& tessellator,
                 tilecore::MicroMesh& mesh) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  if (drawable.material->double_sided) throw std::runtime_error("a list of triangles knows no double-sided material");
  tessellator.tessellate(frame, patch, scene::patch_cells(frame, patch), {drawable.moving, false}, mesh);
  Piece piece;
  for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
    if (!mesh.projected[v]) throw std::runtime_error("a list of triangles holds no vertex that is not projected");
    piece.keys[0].push_back({mesh.x0[v], mesh.y0[v], mesh.z0[v]});
    piece.keys[1].push_back(drawable.moving ? TriangleList::Vertex{mesh.x1[v], mesh.y1[v], mesh.z1[v]}
                                            : piece.keys[0].back());
  }
  test::for_each_triangle(mesh, [&](const std::array<std::int32_t, 3>& corners, std::uint32_t) {
    for (const std::size_t c : {0, 1, 2})
      piece.indices.push_back(static_cast<std::uint32_t>(corners[drawable.mirrored ? 2 - c : c]));
  });
  return piece;
}

}  // namespace

PosedScene::PosedScene(int width, int height, const SceneSettings& settings)
    : capture(make_capture(width, height, settings)),
      assembly(scene::assemble(capture)),
      pyramids(assembly),
      gpu(machine_for(settings)),
      pattern({settings.samples_per_pixel, 0, 0}),
      grid(width, height, gpu.tile.width, gpu.tile.height),
      machine(gpu, pattern, grid) {
  scene::FrameRequest request;
  request.width = width;
  request.height = height;
  request.close_time = settings.blur > 0 ? 1 : 0;
  // Cells are near squares of two triangles.
  request.tessellation.target_edge_pixels = std::sqrt(2 * settings.area);
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (attempt > 0) request.tessellation.target_edge_pixels *= std::sqrt(settings.area / mean_area);
    frame = scene::pose_frame(assembly, scene::choose_camera(capture, width, height), request);
    patches = kept_patches(*frame, pyramids, gpu);
    mean_area = list_triangles(*frame, patches).mean_area();
  }
}

std::vector<std::uint32_t> kept_patches(const scene::FrameGeometry& frame, const frontend::PyramidLibrary& pyramids,
                                        const gpu::GpuConfiguration& gpu) {
  std::set<std::uint32_t> kept;
  for (const auto& piece : frontend::run_front_end(frame, pyramids, gpu.front_end_spec()).sub_patches)
    kept.insert(piece.base_patch);
  return {kept.begin(), kept.end()};
}

PosedCapture::PosedCapture(const std::string& file, const gpu::RunSettings& run_settings, int number, int width,
                           int height)
    : settings(run_settings),
      capture(scene::read_capture(file)),
      assembly(scene::assemble(capture)),
      pyramids(assembly),
      frame(scene::pose_frame(assembly, gpu::frame_camera(capture, settings, width, height),
                              gpu::frame_request(capture, gpu, settings, width, height, number))),
      patches(kept_patches(*frame, pyramids, gpu)) {}

gpu::Device PosedCapture::device() const {
  const int width = frame->request.width, height = frame->request.height;
  return {capture, gpu, settings, {width, height, {0, 0, width, height}, false}};
}

double TriangleList::front_area(std::size_t triangle) const {
  const Vertex &a = keys[0][indices[3 * triangle]], &b = keys[0][indices[3 * triangle + 1]],
               &c = keys[0][indices[3 * triangle + 2]];
  const auto difference = [](float p, float q) { return static_cast<double>(p) - static_cast<double>(q); };
  // Rows run downwards, so a triangle that is counter-clockwise with y up has a negative determinant.
  return 0.5 * (difference(b.y, a.y) * difference(c.x, a.x) - difference(b.x, a.x) * difference(c.y, a.y));
}

double TriangleList::mean_area() const {
  double area = 0;
  for (std::size_t t = 0; t < triangle_count(); ++t) area += std::abs(front_area(t));
  return area / static_cast<double>(std::max<std::size_t>(triangle_count(), 1));
}

TriangleList list_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches) {
  std::vector<Piece> pieces(patches.size());
  PerThread<tilecore::Tessellator> tessellators;
  PerThread<tilecore::MicroMesh> meshes;
  parallel_for(patches.size(),
               [&](std::size_t p) { pieces[p] = list_patch(frame, patches[p], tessellators.local(), meshes.local()); });

  TriangleList list;
  list.near_depth = std::numeric_limits<float>::infinity();
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const auto first = static_cast<std::uint32_t>(list.patch.size());
    for (const std::uint32_t i : pieces[p].indices) list.indices.push_back(first + i);
    list.patch.resize(list.patch.size() + pieces[p].keys[0].size(), patches[p]);
    for (std::size_t key = 0; key < 2; ++key)
      for (const TriangleList::Vertex& v : pieces[p].keys[key]) {
        list.keys[key].push_back(v);
        list.near_depth = std::min(list.near_depth, v.z);
        list.far_depth = std::max(list.far_depth, v.z);
      }
  }
  return list;
}

}  // namespace tessera::bench
