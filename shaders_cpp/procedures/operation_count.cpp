#include "shaders_cpp/procedures/operation_count.h"

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::shaders {
namespace counting {

// Counter of the operations of the current evaluation.
thread_local OperationCount* current = nullptr;

struct Counted {
  float value = 0;
  Counted() = default;
  Counted(float v) : value(v) {}  // NOLINT: constants widen silently
};

Counted operator+(Counted a, Counted b) { return ++current->adds, a.value + b.value; }
Counted operator-(Counted a, Counted b) { return ++current->adds, a.value - b.value; }
Counted operator*(Counted a, Counted b) { return ++current->multiplies, a.value * b.value; }
Counted operator/(Counted a, Counted b) { return ++current->divides, a.value / b.value; }
Counted real_sqrt(Counted a) { return ++current->square_roots, shaders::real_sqrt(a.value); }
Counted real_abs(Counted a) { return ++current->comparisons, shaders::real_abs(a.value); }
Counted real_min(Counted a, Counted b) { return ++current->comparisons, tessera::real_min(a.value, b.value); }
Counted real_max(Counted a, Counted b) { return ++current->comparisons, shaders::real_max(a.value, b.value); }
Counted real_floor(Counted a) { return ++current->comparisons, tessera::real_floor(a.value); }
Counted select_less(Counted a, Counted b, Counted x, Counted y) {
  return ++current->comparisons, tessera::select_less(a.value, b.value, x.value, y.value);
}
Counted power_of_two(Counted n) { return ++current->adds, tessera::power_of_two(n.value); }
void real_sincos_turns(Counted turns, Counted& sine, Counted& cosine) { sincos_by_series(turns, sine, cosine); }

PlaneNoise<Counted> plane_noise_with_slopes(Counted x, Counted y) {
  Counted gradient[4];
  return noise_in_cell<Counted>(x - real_floor(x), y - real_floor(y), gradient, gradient);
}
Counted plane_noise(Counted x, Counted y) { return plane_noise_with_slopes(x, y).value; }
Counted space_noise(Counted x, Counted y, Counted z) {
  Counted corner[8];
  return mix_corners(corner, smooth_step(x - real_floor(x)), smooth_step(y - real_floor(y)),
                     smooth_step(z - real_floor(z)));
}
// Texture hardware interpolates; the array only scales the coordinates.
PlaneNoise<Counted> image_value_with_slopes(const float*, int width, int height, Counted u, Counted v) {
  return {u * Counted(static_cast<float>(width)), v * Counted(static_cast<float>(height)), Counted(0.0f)};
}
Counted image_value(const float* values, int width, int height, Counted u, Counted v) {
  return image_value_with_slopes(values, width, height, u, v).value;
}

// Counts the operations of body().
template <class Body>
OperationCount count(const Body& body) {
  OperationCount out;
  current = &out;
  body();
  current = nullptr;
  return out;
}

}  // namespace counting

OperationCount count_position(ShapeId shape, const ShapeInput& input) {
  return counting::count([&] { shape_point(shape, input, counting::Counted(0.3f), counting::Counted(0.4f)); });
}

OperationCount count_geometry(ShapeId shape, const ShapeInput& input) {
  return counting::count([&] {
    with_shape(shape, [&](auto type) {
      const ShapePoint<counting::Counted> p =
          shape_tangents<decltype(type)>(input, counting::Counted(0.3f), counting::Counted(0.4f));
      counting::Counted margin;
      unit_normal(p.by_u, p.by_v, margin);
    });
  });
}

OperationCount count_surface(const SurfaceProgram& program) {
  return counting::count([&] {
    const Vector3<counting::Counted> point = {0.3f, 0.4f, 0.5f}, normal = {0.0f, 1.0f, 0.0f};
    PointRecord<counting::Counted> record;
    run_surface_stages<counting::Counted>(program, 0.3f, 0.4f, point, normal, 1.0f, record);
  });
}

}  // namespace tessera::shaders
