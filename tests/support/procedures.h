#pragma once

#include <cmath>

#include "shaders_cpp/procedures/declarations.h"
#include "tests/support/captures.h"

namespace tessera::test {

// A geometry image of a closed tube: 9 x 9 points, the first and last column the same.
inline const shaders::GeometryImage& tube_image() {
  static const shaders::GeometryImage kImage = [] {
    shaders::GeometryImage image{9, 9, {}, {}, {}};
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i) {
        const double angle = 0.7853981633974483 * (i % 8), radius = 0.6 + 0.1 * (j % 3);
        image.x.push_back(static_cast<float>(radius * std::cos(angle)));
        image.y.push_back(static_cast<float>(j) * 0.2f - 0.8f);
        image.z.push_back(static_cast<float>(-radius * std::sin(angle)));
      }
    return image;
  }();
  return kImage;
}

inline constexpr int kShapeCount = 10;

// Parameters of a shape drawn from their sensible ranges; some lengths are zero.
inline shaders::ShapeInput random_shape(Random& random, shaders::ShapeId id) {
  using shaders::ShapeId;
  shaders::ShapeInput in;
  in.image = &tube_image();
  for (float& p : in.p) p = random.uniform(-1.5f, 1.5f);
  const auto length = [&] { return random.integer(0, 19) == 0 ? 0.0f : random.uniform(0.05f, 2.0f); };
  switch (id) {
    case ShapeId::kSphere:
    case ShapeId::kCylinder:
    case ShapeId::kTorus:
      for (std::size_t k = 0; k < 3; ++k) in.p[k] = length();
      break;
    case ShapeId::kRevolution:
      for (std::size_t k = 0; k < 8; k += 2) in.p[k] = length();
      break;
    case ShapeId::kHeightField:
      in.p = {length(),
              length(),
              random.uniform(-0.5f, 0.5f),
              random.uniform(0, 6),
              static_cast<float>(random.integer(1, 5)),
              0.5f,
              random.uniform(0, 9)};
      break;
    case ShapeId::kSpring:
      in.p = {length(), length() * 0.2f, random.uniform(-2, 2), random.uniform(0.1f, 6)};
      break;
    default:
      break;
  }
  return in;
}

// Adds a procedure of one piece and a node that draws it; returns the node.
inline int add_procedure(scene::Capture& capture, shaders::ShapeId shape, const shaders::ShapeInput& input,
                         const DVec3& translation = DVec3(0.0), int material = scene::kNone) {
  scene::Procedure procedure;
  procedure.shape = shape;
  procedure.pieces.resize(1);
  procedure.pieces[0].input = input;
  procedure.material = material;
  scene::Node node;
  node.transform.translation = translation;
  node.procedure = static_cast<int>(capture.procedures.size());
  capture.procedures.push_back(procedure);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()));
  capture.nodes.push_back(node);
  return static_cast<int>(capture.nodes.size()) - 1;
}

}  // namespace tessera::test
