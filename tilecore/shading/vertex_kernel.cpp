#include "tilecore/shading/vertex_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/vertex_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/lane_names.inc"

#include "tilecore/shading/lane_shader.inc"

#include "tilecore/shading/lane_vertex.inc"

LaneInputs<FloatLanes> vertex_lanes(const VertexArrays& in, std::size_t i) {
  LaneInputs<FloatLanes> lanes;
  lanes.vertex[0] = IntLanes::load(in.point + i);
  lanes.one_patch = all(lanes.vertex[0] == IntLanes(first_lane(lanes.vertex[0])));
  lanes.p = FloatLanes::load(in.u + i), lanes.q = FloatLanes::load(in.v + i);
  lanes.lod = FloatLanes::load(in.lod + i);
  return lanes;
}

void store_vector(const Vector3<FloatLanes>& a, const std::array<float*, 3>& out, std::size_t i) {
  a.x.store(out[0] + i), a.y.store(out[1] + i), a.z.store(out[2] + i);
}

__attribute__((flatten)) void PlaceVertices(const DrawConstants& draw, const VertexArrays& in, std::size_t count,
                                            std::size_t key, bool base_normals, const scene::TextureSlot* tangents,
                                            const VertexPlaces& out) {
  const scene::PosedDrawable& drawable = *draw.drawable;
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    const LaneInputs<FloatLanes> lanes = vertex_lanes(in, i);
    const PatchPoint<FloatLanes> point = base_normals ? patch_point<FloatLanes, true>(draw, lanes, key)
                                                      : patch_point<FloatLanes, false>(draw, lanes, key);
    store_vector(point.position, out.position, i);
    store_vector(unit_in_the_world(drawable.normal_to_world[key], point.normal), out.normal, i);
    if (drawable.moving && !drawable.deforming)
      store_vector(unit_in_the_world(drawable.normal_to_world[1], point.normal), out.normal_at_close, i);
    if (tangents == nullptr) continue;
    const Point4<FloatLanes> tangent = vertex_tangent(draw, lanes, point, *tangents);
    tangent.x.store(out.tangent[0] + i), tangent.y.store(out.tangent[1] + i);
    tangent.z.store(out.tangent[2] + i), tangent.w.store(out.tangent[3] + i);
  }
}

void VertexTexcoords(const DrawConstants& draw, const VertexArrays& in, std::size_t count, int set,
                     const std::array<float*, 2>& out) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    const auto at = lane_texcoord(draw, vertex_surface(vertex_lanes(in, i)), set, shaders::TextureTransform());
    at.u.store(out[0] + i), at.v.store(out[1] + i);
  }
}

void VertexColors(const DrawConstants& draw, const VertexArrays& in, std::size_t count,
                  const std::array<float*, 4>& out) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    const auto color = lane_vertex_color(draw, vertex_surface(vertex_lanes(in, i)));
    color.r.store(out[0] + i), color.g.store(out[1] + i), color.b.store(out[2] + i), color.a.store(out[3] + i);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(PlaceVertices);
HWY_EXPORT(VertexTexcoords);
HWY_EXPORT(VertexColors);

void place_vertices(const DrawConstants& draw, const VertexArrays& in, std::size_t count, std::size_t key,
                    bool base_normals, const scene::TextureSlot* tangents, const VertexPlaces& out) {
  HWY_DYNAMIC_DISPATCH(PlaceVertices)(draw, in, count, key, base_normals, tangents, out);
}

void vertex_texcoords(const DrawConstants& draw, const VertexArrays& in, std::size_t count, int set,
                      const std::array<float*, 2>& out) {
  HWY_DYNAMIC_DISPATCH(VertexTexcoords)(draw, in, count, set, out);
}

void vertex_colors(const DrawConstants& draw, const VertexArrays& in, std::size_t count,
                   const std::array<float*, 4>& out) {
  HWY_DYNAMIC_DISPATCH(VertexColors)(draw, in, count, out);
}

}  // namespace tessera::tilecore
#endif
