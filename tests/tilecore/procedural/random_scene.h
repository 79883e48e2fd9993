#pragma once

#include "tests/support/procedures.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore {

// Moves parameters within the shutter from the shape's own to other ones.
inline void animate_numbers(test::Random& random, scene::Capture& capture, int node) {
  const int number = capture.nodes[static_cast<std::size_t>(node)].procedure;
  const scene::Procedure& procedure = capture.procedures[static_cast<std::size_t>(number)];
  const shaders::ShapeInput other = test::random_shape(random, procedure.shape);
  std::size_t first = 0;
  const auto& parameters = procedure.declaration().parameters;
  for (std::size_t part = 0; part < parameters.size(); ++part) {
    const auto size = static_cast<std::size_t>(parameters[part].size);
    scene::AnimationChannel channel;
    channel.node = node;
    channel.path = scene::AnimatedPath::kShapeNumbers;
    channel.part = static_cast<int>(part);
    channel.components = static_cast<int>(size);
    channel.times = {0, 1};
    for (const shaders::ShapeInput* from : {&procedure.pieces[0].input, &other})
      channel.values.insert(channel.values.end(), from->p.begin() + static_cast<std::ptrdiff_t>(first),
                            from->p.begin() + static_cast<std::ptrdiff_t>(first + size));
    test::play(capture, channel);
    first += size;
  }
}

// A procedure before a camera, sometimes close, behind, moving, through a lens or from an orthographic camera.
struct RandomScene {
  TestFrame scene;
  RandomScene(test::Random& random, shaders::ShapeId id, bool general, bool deforms = false, int width = 96,
              int height = 64) {
    scene::Camera camera;
    camera.near = 0.2f;
    if (random.integer(0, 5) == 0) camera.type = scene::Camera::Type::kOrthographic, camera.x_mag = camera.y_mag = 2;
    if (general && random.integer(0, 3) == 0) camera.lens = {0.1f, 3.0f};
    test::add_camera(*scene.capture, DVec3(0, 0, random.integer(0, 4) == 0 ? 0.5 : 4.0), camera);
    scene::Material material;
    material.double_sided = random.coin();
    const int number = test::add_material(*scene.capture, material);
    const DVec3 place(random.in_box(2));
    const int node = test::add_procedure(*scene.capture, id, test::random_shape(random, id), place, number);
    if (general && random.coin()) test::add_motion(*scene.capture, node, DVec3(random.in_box(3)));
    if (deforms) animate_numbers(random, *scene.capture, node);
    scene.pose(width, height);
  }
};

}  // namespace tessera::tilecore
