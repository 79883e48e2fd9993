#include "scene/drawable_box.h"

#include <cmath>

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::scene {

SpaceBox own_box(const PosedDrawable& drawable, std::size_t key) {
  SpaceBox box;
  for (const Vec3& p : drawable.positions[key]) box.add(DVec3(p));
  const Procedure* const procedure = key == 0 ? drawable.procedure : drawable.procedure_close;
  if (procedure == nullptr) return box;
  constexpr int kSteps = 16;
  for (const Procedure::Piece& piece : procedure->pieces)
    for (int k = 0; k < (kSteps + 1) * (kSteps + 1); ++k) {
      const Vector3<double> p =
          shaders::shape_point(procedure->shape, piece.input, static_cast<double>(k % (kSteps + 1)) / kSteps,
                               static_cast<double>(k / (kSteps + 1)) / kSteps);
      box.add({p.x, p.y, p.z});
    }
  const DVec3 slack = 0.2 * box.half();
  box.low -= slack, box.high += slack;
  return box;
}

SpaceBox world_box(const PosedDrawable& drawable, std::size_t key, const SpaceBox& own) {
  if (own.empty()) return {};
  const std::optional<Displacement>& displacement = drawable.material->displacement;
  const DVec3 half = own.half() + DVec3(displacement ? displacement_limit(*displacement) : 0.0);
  const DMat4 world(drawable.to_world[key]);
  const DVec3 middle(world * DVec4(own.middle(), 1.0));
  // Transforms are rounded to single precision.
  const DVec3 reach = glm::abs(DVec3(world[0])) * half.x + glm::abs(DVec3(world[1])) * half.y +
                      glm::abs(DVec3(world[2])) * half.z + 1e-6 * glm::abs(middle);
  const SpaceBox box{middle - reach, middle + reach};
  const DVec3 sum = box.low + box.high;
  return std::isfinite(sum.x + sum.y + sum.z) ? box : SpaceBox();
}

}  // namespace tessera::scene
