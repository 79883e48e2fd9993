#pragma once

#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/tile_core.h"

namespace tessera::tilecore {

// A scene seen by an orthographic camera whose unit is a pixel: world (x, y) is pixel (x, height - y), z = 0 is 10 in
// front of the camera.
struct PixelScene : TestFrame {
  int width, height;
  SamplePattern pattern;
  std::unique_ptr<binner::TileGrid> grid;
  TileJob job;

  PixelScene(int width_in, int height_in, int spp) : width(width_in), height(height_in), pattern({spp, 0, 0}) {}

  // Quad [x, x + w] x [y, y + h] of pixels as a Bezier patch or as two triangles; returns its node.
  int add_quad(float x, float y, float w, float h, float z, const scene::Material& material, bool bezier) {
    const int m = test::add_material(*capture, material);
    const auto bottom = static_cast<float>(height) - y - h;
    if (bezier)
      return test::add_node(*capture, test::patches(test::flat_patch({x, bottom, z}, {w, 0, 0}, {0, h, 0}), m));
    scene::Primitive quad = test::triangles(
        {{x, bottom, z}, {x + w, bottom, z}, {x + w, bottom + h, z}, {x, bottom + h, z}}, {0, 1, 2, 0, 2, 3}, m);
    quad.vertices.texcoords = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    return test::add_node(*capture, quad);
  }

  // Poses the scene; called once all quads are added.
  void look(int tile_width = 0, int tile_height = 0) {
    scene::Camera camera;
    camera.type = scene::Camera::Type::kOrthographic;
    camera.x_mag = static_cast<float>(width) * 0.5f;
    camera.y_mag = static_cast<float>(height) * 0.5f;
    if (capture->cameras.empty()) test::add_camera(*capture, {width * 0.5, height * 0.5, 10}, camera);
    pose(width, height);
    tile(tile_width > 0 ? tile_width : width, tile_height > 0 ? tile_height : height);
  }
  void tile(int tile_width, int tile_height) {
    grid = std::make_unique<binner::TileGrid>(width, height, tile_width, tile_height);
    job.frame = frame.get();
    job.grid = grid.get();
    job.pattern = &pattern;
    job.background = Vec3(0.0f);
  }

  std::vector<binner::ListEntry> entries() const {
    std::vector<binner::ListEntry> out(assembly->patch_count());
    for (std::uint32_t p = 0; p < out.size(); ++p) out[p].base_patch = p, out[p].range = whole_patch(*frame, p);
    return out;
  }
};

struct Rendering {
  FrameTargets targets;
  ShadingCounters counters;
};

inline Rendering render(const PixelScene& scene) {
  Rendering out{FrameTargets({0, 0, scene.width, scene.height}, true), {}};
  TileCore core;
  for (binner::TileIndex t = 0; t < scene.grid->tile_count(); ++t) {
    TileState state;
    core.render_entries(scene.job, t, scene.entries(), state);
    core.finish(scene.job, t, state, out.targets);
  }
  out.counters = core.take_result().counters.shading;
  return out;
}

inline scene::Material unlit(Vec4 color, scene::AlphaMode mode = scene::AlphaMode::kOpaque) {
  scene::Material material;
  material.unlit = true;
  material.double_sided = true;
  material.base_color = color;
  material.alpha_mode = mode;
  return material;
}

}  // namespace tessera::tilecore
