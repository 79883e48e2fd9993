#include "tilecore/resolve/velocity_buffer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "tilecore/resolve/block_pixels.h"
#include "tilecore/shading/vertex_outputs.h"

namespace tessera::tilecore {
namespace {

float statistic_of(std::array<float, 16>& speeds, int count, BlockSpeed statistic) {
  if (count == 0) return 0.0f;
  const auto end = speeds.begin() + count;
  switch (statistic) {
    case BlockSpeed::kMax:
      return *std::max_element(speeds.begin(), end);
    case BlockSpeed::kMin:
      return *std::min_element(speeds.begin(), end);
    case BlockSpeed::kMedian: {
      const auto middle = speeds.begin() + count / 2;
      std::nth_element(speeds.begin(), middle, end);
      return *middle;  // the upper one of two
    }
    case BlockSpeed::kMean:
      break;
  }
  float sum = 0.0f;
  for (auto s = speeds.begin(); s != end; ++s) sum += *s;
  return sum / static_cast<float>(count);
}

// Operations of four channels [by hand]. A rigid point: its matrix and a division. A triangle's: its vertices of both
// frames weighed and projected. A patch's: the same of its sixteen control points. A displaced one's more than that: two
// derivatives of sixteen points, their cross product and its length, the coordinate, two bilinear heights and the step.
constexpr std::uint64_t kRigidOperations = 5, kTriangleOperations = 15, kPatchOperations = 41,
                        kDisplacementOperations = 2 * (32 + 2 + 3 + 16 + 6 + 1);

std::uint64_t patch_operations(const scene::PosedDrawable& drawable) {
  return kPatchOperations + (drawable.material->displacement ? kDisplacementOperations : 0);
}

}  // namespace

void VelocityBuffer::start(const scene::FrameGeometry& frame, const TileSamples& samples, const TileState& state,
                           const PixelSurfaces& surfaces, const MotionField* motion) {
  frame_ = &frame;
  samples_ = &samples;
  state_ = &state;
  surfaces_ = &surfaces;
  motion_ = motion;
  knows_still_ = motion == surfaces.still_in;
  last_patch_ = read_patch_ = TileState::kNoPatch;
  velocity_.assign(surfaces.depth.size(), Vec2(0.0f));
  usable_.assign(surfaces.depth.size(), 0);
  then_depth_.resize(surfaces.depth.size());
  grid_vertices_.clear();
  vertices_.clear();
}

SurfaceLocation VelocityBuffer::location(std::size_t pixel) const {
  const std::size_t s = pixel * static_cast<std::size_t>(surfaces_->spp) + surfaces_->center_sample;
  return {surfaces_->patch[pixel], state_->triangle[s], state_->b1[s], state_->b2[s], 0.0f};
}

std::array<std::int32_t, 3> VelocityBuffer::corners(const SurfaceLocation& at) {
  const SurfaceLocation vertex{at.patch, SurfaceLocation::kWholePatch, 0, 0, 0};
  return grid_vertices_.triangle(frame_->pattern_of(at.patch), at.patch, at.triangle, [&](float u, float v) {
    vertices_.push_back({motion_->places(vertex, {u, v})});
  });
}

void VelocityBuffer::count_vertices(const scene::PosedDrawable& drawable, const SurfaceLocation& at) {
  work_.operations += kTriangleOperations;
  for (const std::int32_t corner : corners(at)) {
    Vertex& vertex = vertices_[static_cast<std::size_t>(corner)];
    if (std::exchange(vertex.counted, true)) continue;
    work_.operations += patch_operations(drawable);
    if (std::exchange(read_patch_, at.patch) != at.patch) work_.vertex_bytes += 16 * sizeof(Vec3);
  }
}

void VelocityBuffer::count_point(std::size_t pixel) {
  const std::uint32_t patch = surfaces_->patch[pixel];
  if (patch == TileState::kNoPatch) return;
  const scene::PosedDrawable& drawable = frame_->drawable_of(patch);
  const auto d = static_cast<std::uint32_t>(frame_->assembly->patch_drawable[patch]);
  if (motion_->kind(d) == MotionField::Kind::kRigid) work_.operations += kRigidOperations;
  if (!is_seen_at_rest(d)) ++work_.places;
  if (motion_->kind(d) != MotionField::Kind::kDeforming) return;
  if (interpolates_surface(*frame_, drawable)) {
    count_vertices(drawable, location(pixel));
    return;
  }
  const bool grid = has_grid(drawable);
  work_.operations += grid ? patch_operations(drawable) : kTriangleOperations;
  const std::uint32_t triangle = grid ? 0 : location(pixel).triangle;
  if (patch == read_patch_ && triangle == read_triangle_) return;
  read_patch_ = patch, read_triangle_ = triangle;
  work_.vertex_bytes += (grid ? 16 : 3) * sizeof(Vec3);
}

MotionField::Step VelocityBuffer::evaluate_pixel(std::size_t pixel) {
  const std::uint32_t patch = surfaces_->patch[pixel];
  if (patch == TileState::kNoPatch) return {Vec2(0.0f), surfaces_->depth[pixel], true};
  // Neighbouring pixels mostly see one patch, so its properties are looked up once.
  if (patch != last_patch_) {
    last_patch_ = patch;
    last_drawable_ = frame_->assembly->patch_drawable[patch];
    last_rests_ = is_seen_at_rest(last_drawable_);
    last_rigid_ = motion_->kind(last_drawable_) == MotionField::Kind::kRigid;
    last_interpolates_ = motion_->kind(last_drawable_) == MotionField::Kind::kDeforming &&
                         interpolates_surface(*frame_, frame_->drawables[last_drawable_]);
  }
  const std::uint32_t drawable = last_drawable_;
  const std::size_t s = pixel * static_cast<std::size_t>(surfaces_->spp) + surfaces_->center_sample;
  // A still pinhole sample sees the surface where it is itself.
  const Vec2 rest = last_rests_ ? Vec2(samples_->x[s], samples_->y[s]) : Vec2(state_->rest_x[s], state_->rest_y[s]);
  if (last_rigid_) return motion_->rigid_step(drawable, rest, surfaces_->depth[pixel]);
  const SurfaceLocation at = location(pixel);
  if (!last_interpolates_) return motion_->step(drawable, rest, surfaces_->depth[pixel], at);
  const std::array<std::int32_t, 3> corner = corners(at);
  const std::array<float, 3> weight{1.0f - at.b1 - at.b2, at.b1, at.b2};
  MotionField::Places mean;
  for (std::size_t k = 0; k < 3; ++k) {
    const MotionField::Places& places = vertices_[static_cast<std::size_t>(corner[k])].places;
    mean.now += places.now * weight[k], mean.then += places.then * weight[k];
  }
  return MotionField::step_between(mean);
}

// All pixels at a time: MotionField::rigid_step() in the same order, element by element.
bool VelocityBuffer::evaluate_rigid(IntRect block, std::array<float, 16>& speeds, std::uint32_t& usable) {
  const std::size_t first = surfaces_->index(block.x0, block.y0),
                    width = static_cast<std::size_t>(surfaces_->pixels.width()),
                    spp = static_cast<std::size_t>(surfaces_->spp);
  const std::uint32_t surface = surfaces_->surface[first];
  if (block.width() != 4 || block.height() != 4 || surface == 0 || (surface & PixelSurfaces::kMixed) != 0) return false;
  const std::uint32_t drawable = surface - 1;
  for (std::size_t j = 0; j < 4; ++j)
    if (!all_are(&surfaces_->surface[first + j * width], surface)) return false;
  if (motion_->kind(drawable) != MotionField::Kind::kRigid) return false;
  const bool rests = is_seen_at_rest(drawable);
  const std::vector<float>&xs = rests ? samples_->x : state_->rest_x, &ys = rests ? samples_->y : state_->rest_y;
  MotionField::RigidPoints points;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t pixel = first + i / 4 * width + i % 4, s = pixel * spp + surfaces_->center_sample;
    points.x[i] = xs[s], points.y[i] = ys[s], points.depth[i] = surfaces_->depth[pixel];
  }
  MotionField::RigidSteps steps;
  motion_->rigid_steps(drawable, points, steps);
  for (std::size_t j = 0; j < 4; ++j) {
    const std::size_t row = first + j * width;
    for (std::size_t i = 0; i < 4; ++i) velocity_[row + i] = {steps.x[4 * j + i], steps.y[4 * j + i]};
    std::copy_n(&steps.depth[4 * j], 4, &then_depth_[row]);
    const std::uint32_t bytes = row_bytes(steps.usable >> (4 * j) & 15u);
    std::memcpy(&usable_[row], &bytes, sizeof bytes);
  }
  speeds = steps.speed, usable = steps.usable;
  return true;
}

bool VelocityBuffer::rests(IntRect block) const {
  for (int y = block.y0; y < block.y1; ++y) {
    const std::uint8_t* row = &surfaces_->still[surfaces_->index(block.x0, y)];
    if (!std::all_of(row, row + block.width(),
                     [](std::uint8_t still) { return (still & PixelSurfaces::kAtRest) != 0; }))
      return false;
  }
  return true;
}

VelocityBuffer::Block VelocityBuffer::evaluate(IntRect block, BlockSpeed statistic, bool counted) {
  Block out;
  if (motion_ == nullptr) {
    out.usable = false;
    return out;
  }
  out.still = knows_still_ && rests(block);
  std::array<float, 16> speeds;
  int count = 0;
  if (std::uint32_t usable = 0; !out.still && evaluate_rigid(block, speeds, usable)) {
    if (counted) {
      work_.operations += 16 * kRigidOperations;
      if (!is_seen_at_rest(surfaces_->surface[surfaces_->index(block.x0, block.y0)] - 1)) work_.places += 16;
    }
    out.usable = usable == 0xffffu;
    out.speed = statistic_of(speeds, 16, statistic);
    return out;
  }
  for (int y = block.y0; y < block.y1; ++y)
    for (int x = block.x0; x < block.x1; ++x) {
      const std::size_t pixel = surfaces_->index(x, y);
      if (out.still) {
        then_depth_[pixel] = surfaces_->depth[pixel];
        usable_[pixel] = 1;
        continue;
      }
      const MotionField::Step step = evaluate_pixel(pixel);
      if (counted) count_point(pixel);
      velocity_[pixel] = step.velocity;
      then_depth_[pixel] = step.depth;
      // A colour with blended surfaces moves with them, not with the surface behind. Their rest between two frames
      // tells nothing about two eyes.
      const bool nothing_behind = surfaces_->patch[pixel] == TileState::kNoPatch && surfaces_->surface[pixel] != 0;
      usable_[pixel] = step.usable && ((surfaces_->layered[pixel] == 0 && !nothing_behind) ||
                                       (knows_still_ && (surfaces_->still[pixel] & PixelSurfaces::kAtRest) != 0));
      if (surfaces_->surface[pixel] == 0) continue;
      out.usable = out.usable && usable_[pixel] != 0;
      speeds[static_cast<std::size_t>(count++)] =
          std::sqrt(step.velocity.x * step.velocity.x + step.velocity.y * step.velocity.y);
    }
  out.speed = statistic_of(speeds, count, statistic);
  return out;
}

}  // namespace tessera::tilecore
