#include "replay/stability/judge.h"

#include <cmath>
#include <limits>

#include "gpu/view_inputs.h"
#include "scene/procedure_patch.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::replay::stability {
namespace {

// The cubic Bernstein polynomials and their derivatives at t.
struct Bernstein {
  std::array<double, 4> value, slope;
  explicit Bernstein(double t) {
    const double s = 1 - t;
    value = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    slope = {-3 * s * s, 3 * s * (s - 2 * t), 3 * t * (2 * s - t), 3 * t * t};
  }
};

// Parallel or zero tangents have no normal of their own: the limit's is taken (shaders_cpp/bicubic.inc).
DVec3 limit_of_normal(const std::array<DVec3, 16>& net, double u, double v) {
  shaders::ControlPoints<double> c;
  for (std::size_t k = 0; k < 16; ++k) c[k] = {net[k].x, net[k].y, net[k].z};
  const auto n =
      shaders::bicubic_normal<double>(c, u, v, shaders::bicubic_point<double>(shaders::bicubic_row<double>(c, v), u));
  return {n.x, n.y, n.z};
}

}  // namespace

DVec3 displaced(const std::array<DVec3, 16>& net, double u, double v, double offset) {
  const Bernstein along_u(u), along_v(v);
  DVec3 point(0.0), slope_u(0.0), slope_v(0.0);
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const DVec3& p = net[4 * j + i];
      point += p * (along_u.value[i] * along_v.value[j]);
      slope_u += p * (along_u.slope[i] * along_v.value[j]);
      slope_v += p * (along_u.value[i] * along_v.slope[j]);
    }
  if (offset == 0) return point;
  // Unit tangents first: products of tiny ones would vanish.
  const double size_u = glm::length(slope_u), size_v = glm::length(slope_v);
  if (size_u > 0 && size_v > 0)
    if (const DVec3 n = glm::cross(slope_u / size_u, slope_v / size_v); glm::length(n) > 1e-10)
      return point + glm::normalize(n) * offset;
  return point + limit_of_normal(net, u, v) * offset;
}

PosedStage::PosedStage(const Stage& stage_in) : stage(stage_in) {
  settings.output.machine_model = false;
  for (const std::string& key : stage.keys) gpu::apply_setting(key, settings, gpu);
  assembly = scene::assemble(stage.capture);
  camera = gpu::frame_camera(stage.capture, settings, stage.width, stage.height);
  frame = scene::pose_frame(assembly, camera,
                            gpu::frame_request(stage.capture, gpu, settings, stage.width, stage.height, stage.frame));
}

Judge::Judge(const PosedStage& stage, double time, Arithmetic arithmetic)
    : stage_(stage),
      arithmetic_(arithmetic),
      pose_(scene::pose_at(stage.stage.capture, time)),
      procedures_(scene::pose_procedures(stage.stage.capture, time, time)),
      projection_(
          scene::make_projection(stage.camera.at(stage.stage.capture, time), stage.stage.width, stage.stage.height)),
      world_to_raster_(product(projection_.matrix(), stage.camera.view(pose_).world_to_camera)) {}

DMat4 Judge::product(const DMat4& a, const DMat4& b) const {
  return arithmetic_ == Arithmetic::kSingle ? DMat4(Mat4(a) * Mat4(b)) : a * b;
}

DVec4 Judge::product(const DMat4& a, const DVec3& p) const {
  return arithmetic_ == Arithmetic::kSingle ? DVec4(Mat4(a) * Vec4(Vec3(p), 1.0f)) : a * DVec4(p, 1.0);
}

DVec3 Judge::morphed(const scene::Primitive& primitive, int node, std::size_t vertex) const {
  DVec3 p(primitive.vertices.positions[vertex]);
  if (arithmetic_ == Arithmetic::kNoDenormals)
    for (int c = 0; c < 3; ++c)
      if (std::abs(p[c]) < static_cast<double>(std::numeric_limits<float>::min())) p[c] = 0;
  const std::vector<float>& weights = pose_.weights[static_cast<std::size_t>(node)];
  for (std::size_t t = 0; t < primitive.vertices.morph_targets.size() && t < weights.size(); ++t)
    if (const auto& way = primitive.vertices.morph_targets[t].positions; !way.empty())
      p += DVec3(way[vertex]) * static_cast<double>(weights[t]);
  return p;
}

DMat4 Judge::to_raster(const scene::Drawable& drawable) const {
  const scene::Node& node = stage_.stage.capture.nodes[static_cast<std::size_t>(drawable.node)];
  if (node.skin != scene::kNone) return world_to_raster_;
  DMat4 world = pose_.world[static_cast<std::size_t>(drawable.node)];
  if (drawable.instanced) world = product(world, scene::instance_to_node(node.instances[drawable.instance]));
  return product(world_to_raster_, world);
}

DVec3 Judge::placed(const scene::Drawable& drawable, const scene::Primitive& primitive, std::size_t vertex) const {
  const scene::Capture& capture = stage_.stage.capture;
  const DVec3 p = morphed(primitive, drawable.node, vertex);
  const int skin = capture.nodes[static_cast<std::size_t>(drawable.node)].skin;
  if (skin == scene::kNone) return p;
  const scene::Skin& of = capture.skins[static_cast<std::size_t>(skin)];
  const scene::SkinInfluence& influence = primitive.vertices.influences[vertex];
  DVec3 sum(0.0);
  double weights = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const auto weight = static_cast<double>(influence.weights[k]);
    if (weight == 0) continue;
    const std::size_t joint = influence.joints[k];
    const DMat4 carried = product(pose_.world[static_cast<std::size_t>(of.joints[joint])], of.inverse_bind[joint]);
    sum += DVec3(product(carried, p)) * weight;
    weights += weight;
  }
  return sum / weights;
}

DVec4 Judge::vertex(const scene::Drawable& drawable, std::uint32_t vertex) const {
  const scene::Primitive& primitive = stage_.stage.capture.meshes[static_cast<std::size_t>(drawable.mesh)]
                                          .primitives[static_cast<std::size_t>(drawable.primitive)];
  return product(to_raster(drawable), placed(drawable, primitive, vertex));
}

DVec4 Judge::surface(std::uint32_t patch, double u, double v) const {
  const scene::FrameGeometry& frame = *stage_.frame;
  const scene::PosedDrawable& posed = frame.drawable_of(patch);
  const scene::Drawable& drawable = *posed.drawable;
  const scene::Primitive& primitive = stage_.stage.capture.meshes[static_cast<std::size_t>(drawable.mesh)]
                                          .primitives[static_cast<std::size_t>(drawable.primitive)];
  std::array<DVec3, 16> net;
  const std::size_t first = std::size_t{16} * (patch - drawable.first_patch);
  for (std::size_t k = 0; k < 16; ++k) net[k] = placed(drawable, primitive, first + k);
  double offset = 0;
  if (posed.material->displacement)
    offset = static_cast<double>(
        scene::patch_displacement(frame, posed, patch).offset(static_cast<float>(u), static_cast<float>(v)));
  return product(to_raster(drawable), displaced(net, u, v, offset));
}

DVec4 Judge::procedure(std::uint32_t patch, double u, double v) const {
  const scene::ProcedurePatch at = scene::procedure_patch(*stage_.frame, patch);
  const scene::Drawable& drawable = *stage_.frame->drawable_of(patch).drawable;
  const scene::Procedure& shape = procedures_.at(stage_.stage.capture, drawable.geometry, 0);
  const auto piece = static_cast<std::size_t>(
      at.piece - stage_.frame->procedures.at(stage_.stage.capture, drawable.geometry, 0).pieces.data());
  const auto p = shaders::shape_point(shape.shape, shape.pieces[piece].input, (at.column + u) / at.columns,
                                      (at.row + v) / at.rows);
  return product(to_raster(drawable), DVec3(p.x, p.y, p.z));
}

}  // namespace tessera::replay::stability
