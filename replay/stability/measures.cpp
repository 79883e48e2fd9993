#include "replay/stability/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/parallel.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "gpu/device.h"
#include "gpu/view_inputs.h"
#include "reference/reference_renderer.h"
#include "replay/stability/judge.h"
#include "scene/domain_shader.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::replay::stability {
namespace {

using scene::CellRange;
using scene::FrameGeometry;
using scene::PosedDrawable;

// ---- Bounds -----------------------------------------------------------------------------------------------------

constexpr int kTimes = 7, kLensPoints = 8, kSurfacePoints = 9;  // of each sub-patch

// A point of a moving surface at both motion keys, in raster space.
using MovingPoint = std::array<DVec4, 2>;

// d(u, v) in double precision of the control points that the machine has at its motion keys.
DVec4 surface_at_key(const FrameGeometry& frame, std::uint32_t patch, float u, float v, std::size_t key) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  std::array<DVec3, 16> net;
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  for (std::size_t k = 0; k < 16; ++k) net[k] = DVec3(points[k]);
  const double offset = drawable.material->displacement
                            ? static_cast<double>(scene::patch_displacement(frame, drawable, patch).offset(u, v))
                            : 0.0;
  return DMat4(drawable.to_raster[key]) *
         DVec4(displaced(net, static_cast<double>(u), static_cast<double>(v), offset), 1.0);
}

// Sub-patches of a grid: all of it, halves, and some cells.
std::vector<CellRange> ranges_of(const scene::TessellationPattern& pattern) {
  const std::uint8_t nu = pattern.nu, nv = pattern.nv;
  const auto half = static_cast<std::uint8_t>((nu + 1) / 2);
  std::vector<CellRange> ranges = {{0, 0, nu, nv}, {0, 0, half, nv}};
  if (half < nu) ranges.push_back({half, 0, nu, nv});
  for (int k = 0; k < 6; ++k) {
    const auto i = static_cast<std::uint8_t>((k * 7) % nu), j = static_cast<std::uint8_t>((k * 5) % nv);
    ranges.push_back({i, j, static_cast<std::uint8_t>(i + 1), static_cast<std::uint8_t>(j + 1)});
  }
  return ranges;
}

frontend::SubPatchBody broken(BoundFault fault, frontend::SubPatchBody body) {
  if (fault == BoundFault::kNoMotion)
    for (std::size_t k = 0; k < 8; ++k) body.corners[8 + k] = body.corners[k];
  if (fault == BoundFault::kShrunk)
    for (const std::size_t first : {std::size_t{0}, std::size_t{8}}) {
      DVec4 middle(0.0);
      for (std::size_t k = 0; k < 8; ++k) middle += body.corners[first + k] * 0.125;
      for (std::size_t k = 0; k < 8; ++k) body.corners[first + k] = middle + (body.corners[first + k] - middle) * 0.5;
    }
  return body;
}

class OverhangMeter {
 public:
  OverhangMeter(const PosedStage& honest, BoundFault fault)
      : frame_(*honest.frame), pyramids_(honest.assembly), fault_(fault) {
    if (fault != BoundFault::kNoDisplacement) return;
    plain_.emplace(honest.stage);
    scene::FrameRequest request = frame_.request;
    request.displacement = false;
    plain_->frame = scene::pose_frame(plain_->assembly, plain_->camera, request);
    // The same sub-patches.
    plain_->frame->patterns = frame_.patterns;
  }

  double measure() {
    for (std::size_t m = 0; m < kEnumWords<frontend::BoundMethod>.size(); ++m) {
      frontend::SubPatchBounder bounder(plain_ ? *plain_->frame : frame_, pyramids_,
                                        static_cast<frontend::BoundMethod>(m)),
          honest(frame_, pyramids_, static_cast<frontend::BoundMethod>(m));
      for (std::uint32_t patch = 0; patch < frame_.assembly->patch_count(); ++patch) {
        if (frame_.drawable_of(patch).drawable->kind != scene::Primitive::Kind::kBezierPatches) continue;
        bounder.begin(patch);
        honest.begin(patch);
        for (const CellRange& cells : ranges_of(frame_.pattern_of(patch))) {
          const frontend::SubPatchBody body = broken(fault_, bounder.body(cells));
          honest.body(cells);
          check(patch, cells, honest.inner_range(), body);
        }
      }
    }
    return worst_;
  }

 private:
  void check(std::uint32_t patch, const CellRange& cells, const scene::ParameterRange& inner,
             const frontend::SubPatchBody& body) {
    scene::Projection projection = frame_.projection;
    if (fault_ == BoundFault::kNoLens) projection.lens_scale = 0;
    const auto bounds = fault_ == BoundFault::kNotCut ? uncut(body.corners)
                                                      : frontend::screen_bounds(body.corners, projection, body.margin);
    for (int k = 0; k < kSurfacePoints; ++k) {
      const float u = inner.u0 + (inner.u1 - inner.u0) * 0.5f * static_cast<float>(k % 3),
                  v = inner.v0 + (inner.v1 - inner.v0) * 0.5f * static_cast<float>(k / 3);
      add(bounds, {surface_at_key(frame_, patch, u, v, 0), surface_at_key(frame_, patch, u, v, 1)});
    }
    const PosedDrawable& drawable = frame_.drawable_of(patch);
    for (const int i : {int{cells.i0}, (cells.i0 + cells.i1) / 2, int{cells.i1}})
      for (const int j : {int{cells.j0}, (cells.j0 + cells.j1) / 2, int{cells.j1}}) {
        MovingPoint at;
        for (std::size_t key = 0; key < 2; ++key)
          at[key] =
              DVec4(drawable.to_raster[key] *
                    Vec4(tilecore::Tessellator::vertex_position(frame_, patch, i, j, static_cast<int>(key)), 1.0f));
        add(bounds, at);
      }
  }

  // Bounds that project points behind the camera as if they were in front of it.
  static std::optional<frontend::ScreenBounds> uncut(const frontend::MovingCorners& corners) {
    frontend::ScreenHull hull;
    for (const DVec4& corner : corners) hull.add(corner);
    return frontend::ScreenBounds{static_cast<float>(hull.x0),
                                  static_cast<float>(hull.y0),
                                  static_cast<float>(hull.x1),
                                  static_cast<float>(hull.y1),
                                  0,
                                  0,
                                  1e30f,
                                  false};
  }

  void add(const std::optional<frontend::ScreenBounds>& bounds, const MovingPoint& point) {
    const scene::Projection& p = frame_.projection;
    for (int t = 0; t < kTimes; ++t) {
      const double share = static_cast<double>(t) / (kTimes - 1);
      const DVec4 at = point[0] * (1 - share) + point[1] * share;
      if (!(at.z >= p.near && (p.far == 0 || at.z <= p.far))) continue;
      const double radius = p.lens_scale * (p.orthographic ? 1 - at.z * p.inverse_focus : 1 / at.w - p.inverse_focus);
      for (int k = 0; k < kLensPoints; ++k) {
        const double angle = 2 * std::numbers::pi * k / kLensPoints, x = at.x / at.w - radius * std::cos(angle),
                     y = at.y / at.w - radius * std::sin(angle);
        if (!bounds) {
          worst_ = std::numeric_limits<double>::infinity();
          continue;
        }
        // The distance from a side is at most the frame's width.
        const double out = std::max({static_cast<double>(bounds->x0) - x, x - static_cast<double>(bounds->x1),
                                     static_cast<double>(bounds->y0) - y, y - static_cast<double>(bounds->y1),
                                     -static_cast<double>(frame_.request.width)});
        worst_ = std::max(worst_, out);
      }
    }
  }

  const FrameGeometry& frame_;
  const frontend::PyramidLibrary pyramids_;
  const BoundFault fault_;
  std::optional<PosedStage> plain_;
  double worst_ = -std::numeric_limits<double>::infinity();
};

// ---- Vertices ---------------------------------------------------------------------------------------------------

// A vertex of a mesh at a time of its part of the shutter, in pixels.
DVec2 pixel_of(const tilecore::MicroMesh& mesh, std::size_t v, double t, bool orthographic) {
  const auto at = [&](const std::vector<float>& a, const std::vector<float>& b, double share) {
    return static_cast<double>(a[v]) + (static_cast<double>(b[v]) - static_cast<double>(a[v])) * share;
  };
  if (mesh.projected[v] == 0) {
    const double w = orthographic ? 1 : at(mesh.z0, mesh.z1, t);
    return {at(mesh.x0, mesh.x1, t) / w, at(mesh.y0, mesh.y1, t) / w};
  }
  const auto z0 = static_cast<double>(mesh.z0[v]), z1 = static_cast<double>(mesh.z1[v]);
  const double share = orthographic ? t : t * z1 / ((1 - t) * z0 + t * z1);
  return {at(mesh.x0, mesh.x1, share), at(mesh.y0, mesh.y1, share)};
}

class VertexMeter {
 public:
  VertexMeter(const PosedStage& stage, VertexFault fault) : stage_(stage), fault_(fault) {}

  double measure() {
    const FrameGeometry& whole = *stage_.frame;
    measure_part(whole);
    for (const auto& segment : whole.segments) measure_part(*segment);
    return worst_;
  }

 private:
  void measure_part(const FrameGeometry& frame) {
    const scene::FrameRequest& request = stage_.frame->request;
    const double length = request.close_time - request.open_time;
    tilecore::Tessellator tessellator;
    tilecore::MicroMesh mesh;
    std::vector<std::uint32_t> drawn;
    for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch)
      if (frame.moves_here(frame.drawable_of(patch)) && frame.drawable_of(patch).visible) drawn.push_back(patch);
    if (drawn.empty()) return;
    const int looks = length == 0 ? 1 : frame.part.whole() ? 17 : 5;
    for (int k = 0; k < looks; ++k) {
      // At irregular steps, because motion may be periodic.
      const bool inside = k > 0 && k + 1 < looks;
      const double shift = inside ? 0.6180339887498949 * k - std::floor(0.6180339887498949 * k) - 0.5 : 0,
                   local = looks == 1 ? 0 : (k + 0.8 * shift) / (looks - 1),
                   u = frame.part.at(0) + (frame.part.at(1) - frame.part.at(0)) * local;
      // Steps and keys belong to the part that ends there.
      const double time = request.open_time + length * u;
      const double moment = k + 1 == looks && looks > 1 ? std::nextafter(time, -1.0) : time;
      const Judge judge(stage_, moment);
      if (fault_ == VertexFault::kSingleMatrices) other_.emplace(stage_, moment, Arithmetic::kSingle);
      if (fault_ == VertexFault::kNoDenormals) other_.emplace(stage_, moment, Arithmetic::kNoDenormals);
      for (const std::uint32_t patch : drawn) {
        tessellator.tessellate(frame, patch, scene::patch_cells(frame, patch), {true, false}, mesh);
        compare(frame, patch, mesh, local, judge);
      }
    }
  }

  void compare(const FrameGeometry& frame, std::uint32_t patch, const tilecore::MicroMesh& mesh, double local,
               const Judge& judge) {
    const PosedDrawable& drawable = frame.drawable_of(patch);
    if (!scene::has_grid(*drawable.drawable)) {
      const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
      const scene::Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
      for (std::size_t v = 0; v < cluster.vertex_count; ++v)
        add([&](const Judge& by) { return by.vertex(*drawable.drawable, clusters.vertices[cluster.first_vertex + v]); },
            mesh, v, local, judge);
      return;
    }
    const bool bezier = drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches;
    const scene::TessellationPattern& pattern = frame.pattern_of(patch);
    const auto columns = static_cast<std::size_t>(pattern.nu) + 1;
    const int step_i = std::max(1, pattern.nu / 12), step_j = std::max(1, pattern.nv / 12);
    for (int j = 0; j <= pattern.nv; j += step_j)
      for (int i = 0; i <= pattern.nu; i += step_i) {
        scene::OwnedVertex at{patch - drawable.drawable->first_patch, pattern.u(i, j), pattern.v(i, j)};
        if (bezier && (i == 0 || j == 0 || i == pattern.nu || j == pattern.nv))
          at = scene::boundary_vertex(pattern, frame.assembly->neighbours[drawable.drawable->geometry][at.patch], i, j);
        const std::uint32_t owner = drawable.drawable->first_patch + at.patch;
        const auto u = static_cast<double>(at.u), v = static_cast<double>(at.v);
        add([&](const Judge& by) { return bezier ? by.surface(owner, u, v) : by.procedure(patch, u, v); }, mesh,
            static_cast<std::size_t>(j) * columns + static_cast<std::size_t>(i), local, judge);
      }
  }

  template <class Place>
  void add(const Place& place, const tilecore::MicroMesh& mesh, std::size_t v, double local, const Judge& judge) {
    const DVec4 truth = place(judge);
    const scene::Projection& p = judge.projection();
    if (!p.orthographic && truth.w < p.near) return;
    const DVec2 wanted(truth.x / truth.w, truth.y / truth.w);
    const double margin = 0.25 * stage_.stage.width;
    if (wanted.x < -margin || wanted.x > stage_.stage.width + margin || wanted.y < -margin ||
        wanted.y > stage_.stage.height + margin)
      return;
    DVec2 got = pixel_of(mesh, v, local, p.orthographic);
    if (other_) {
      const DVec4 at = place(*other_);
      got = DVec2(at.x / at.w, at.y / at.w);
    }
    const double error = glm::distance(got, wanted);
    worst_ = std::isfinite(error) ? std::max(worst_, error) : std::numeric_limits<double>::infinity();
  }

  const PosedStage& stage_;
  const VertexFault fault_;
  std::optional<Judge> other_;  // instead of the machine, for twins
  double worst_ = 0;
};

}  // namespace

double overhang(const Stage& stage, BoundFault fault) {
  const PosedStage posed(stage);
  return OverhangMeter(posed, fault).measure();
}

double vertex_error(const Stage& stage, VertexFault fault) {
  const PosedStage posed(stage);
  return VertexMeter(posed, fault).measure();
}

// ---- Images -----------------------------------------------------------------------------------------------------

Image render(const Stage& stage) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  settings.output.machine_model = false;
  for (const std::string& key : stage.keys) gpu::apply_setting(key, settings, gpu);
  gpu::Device device(stage.capture, gpu, settings, {stage.width, stage.height, {0, 0, stage.width, stage.height}});
  Image color;
  // The frames before the last one make its history.
  for (int frame = 0; frame <= stage.frame; ++frame) color = device.render(frame).targets.color;
  return color;
}

double wrong_samples(const Stage& machine, const Stage& truth) {
  const PosedStage posed(truth);
  const Image wanted = reference::render_machines_samples(posed.assembly, posed.gpu, posed.settings, truth.width,
                                                          truth.height, truth.frame),
              got = render(machine);
  const double samples = posed.settings.sampling.samples_per_pixel;
  double wrong = 0;
  for (int y = 0; y < truth.height; ++y)
    for (int x = 0; x < truth.width; ++x) {
      double most = 0;
      for (std::size_t c = 0; c < 3; ++c)
        most = std::max(most, std::abs(static_cast<double>(wanted.at(x, y)[c]) - static_cast<double>(got.at(x, y)[c])));
      wrong += std::round(most * samples);
    }
  return wrong / (samples * truth.width * truth.height) * 1e6;
}

double samples_unlike(const Stage& stage, float value) {
  const PosedStage posed(stage);
  const double samples = posed.settings.sampling.samples_per_pixel;
  const Image image = render(stage);
  double wrong = 0;
  for (int y = 0; y < stage.height; ++y)
    for (int x = 0; x < stage.width; ++x)
      wrong += std::ceil(std::max(0.0, std::abs(static_cast<double>(image.at(x, y)[0] - value)) - 1e-4) * samples);
  return wrong;
}

double different_pixels(const Image& a, const Image& b) {
  if (!a.same_shape(b)) return std::numeric_limits<double>::infinity();
  double count = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) count += std::ranges::equal(a.at(x, y), b.at(x, y)) ? 0 : 1;
  return count;
}

double steps_from(const Image& image, const Vec3& color, double share) {
  const int dx = static_cast<int>(0.5 * (1 - share) * image.width),
            dy = static_cast<int>(0.5 * (1 - share) * image.height);
  double worst = 0;
  for (int y = dy; y < image.height - dy; ++y)
    for (int x = dx; x < image.width - dx; ++x)
      for (int c = 0; c < 3; ++c) {
        const auto wanted = static_cast<double>(color[c]);
        const double error = std::abs(static_cast<double>(image.at(x, y)[static_cast<std::size_t>(c)]) - wanted);
        worst = std::isfinite(error) ? std::max(worst, error / std::max(wanted, 0x1p-24) * 0x1p24)
                                     : std::numeric_limits<double>::infinity();
      }
  return worst;
}

double rms_of_stills(const Stage& stage, int stills) {
  std::vector<Image> frames(static_cast<std::size_t>(stills));
  FixedRandom random(5);
  std::vector<double> times;
  times.reserve(frames.size());
  for (int k = 0; k < stills; ++k) times.push_back((k + static_cast<double>(random.uniform(0, 1))) / stills);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    Stage still = stage;
    still.capture.settings.shutter_open = still.capture.settings.shutter_close = times[k];
    frames[k] = render(still);
  }
  Image mean(stage.width, stage.height, 4);
  for (std::size_t i = 0; i < mean.values.size(); ++i) {
    double sum = 0;
    for (const Image& frame : frames) sum += static_cast<double>(frame.values[i]);
    mean.values[i] = static_cast<float>(sum / stills);
  }
  const Image got = render(stage);
  double sum = 0;
  for (int y = 0; y < stage.height; ++y)
    for (int x = 0; x < stage.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        const double difference = static_cast<double>(got.at(x, y)[c]) - static_cast<double>(mean.at(x, y)[c]);
        sum += difference * difference;
      }
  return std::sqrt(sum / (3.0 * stage.width * stage.height)) * 255;
}

}  // namespace tessera::replay::stability
