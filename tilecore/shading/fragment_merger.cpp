#include "tilecore/shading/fragment_merger.h"

#include <cmath>
#include <limits>

#include "tilecore/shading/surface.h"

namespace tessera::tilecore {
namespace {

// Whether attributes continue smoothly across the edges of a drawable's triangles that share vertices.
bool is_smooth(const scene::PosedDrawable& drawable) {
  return has_grid(drawable) || !drawable.normals[0].empty() || drawable.material->unlit;
}

// floor() for values that fit an int, except for the sign of 0; std::floor() is a call if the target has no instruction
// for it.
float floor_of_place(float v) {
  if (!(std::abs(v) < 1e9f)) return std::floor(v);
  const auto whole = static_cast<float>(static_cast<int>(v));
  return whole > v ? whole - 1.0f : whole;
}

bool share_edge(const std::array<std::uint64_t, 3>& a, const std::array<std::uint64_t, 3>& b) {
  int shared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool again = (i > 0 && a[i] == a[0]) || (i > 1 && a[i] == a[1]);  // collapsed corners count once
    if (!again && (a[i] == b[0] || a[i] == b[1] || a[i] == b[2])) ++shared;
  }
  return shared >= 2;
}

}  // namespace

bool is_at_rest(const scene::FrameGeometry& frame, std::uint32_t patch) {
  return !frame.drawable_of(patch).moving && frame.projection.lens_scale == 0;
}

void FragmentMerger::group(const TileJob& job, const TileSamples& samples, const TileState& state,
                           std::span<const std::size_t> pixels, std::span<const bool> split) {
  spp_ = static_cast<std::size_t>(samples.spp);
  visible_ = merged_ = quads_ = places_ = 0;
  fragments_.clear();
  vertices_.clear();
  runs_.clear();
  if (pixels.size() == 1 && !split[0] && group_alike(job, samples, state, pixels[0] * spp_)) return;
  run_of_.assign(pixels.size() * spp_, kNoRun);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    const std::size_t first_of_pixel = fragments_.size(), first = pixels[p] * spp_;
    for (std::size_t k = 0; k < spp_; ++k)
      if (state.patch[first + k] != TileState::kNoPatch)
        add_sample(job, samples, state, p, k, first + k, split[p], first_of_pixel);
  }
  if (fragments_.size() == 1) {
    // Samples have its number, which is its run's, too.
    const Fragment& f = fragments_.front();
    runs_.push_back({f.sample, f.time_sum / static_cast<float>(f.samples), f.pixel, f.rests, f.moves, 0});
    quads_ = 1;
    return;
  }
  if (fragments_.empty()) return;
  merge_all(job);
  make_runs();
}

void FragmentMerger::know(const TileJob& job, std::uint32_t patch) {
  const scene::FrameGeometry& frame = *job.frame;
  if (frame.identity != known_frame_) drawable_of_.forget();
  const std::uint32_t number = drawable_of_(*frame.assembly, patch);
  if (number == known_drawable_ && frame.identity == known_frame_) return;
  const scene::PosedDrawable& drawable = frame.drawables[number];
  known_drawable_ = number, known_frame_ = frame.identity;
  known_rests_ = is_at_rest(frame, patch);
  known_moves_ = drawable.moving;
  known_curved_ = drawable.curved && !frame.segments.empty();
}

bool FragmentMerger::group_alike(const TileJob& job, const TileSamples& samples, const TileState& state,
                                 std::size_t first) {
  const std::uint32_t patch = state.patch[first], triangle = state.triangle[first];
  if (patch == TileState::kNoPatch || job.shading.rate == ShadingRate::kSample) return false;
  for (std::size_t s = first + 1; s < first + spp_; ++s)
    if (state.triangle[s] != triangle || state.patch[s] != patch || state.positive[s] != state.positive[first])
      return false;
  know(job, patch);
  if (!known_rests_) return false;
  Run run{first, 0.0f, 0, true, known_moves_, 0};
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t s = first; s < first + spp_; ++s) {
    const float dx = samples.x[s] - floor_of_place(samples.x[s]) - 0.5f,
                dy = samples.y[s] - floor_of_place(samples.y[s]) - 0.5f;
    if (const float distance2 = dx * dx + dy * dy; distance2 < least) run.sample = s, least = distance2;
    run.light_time += samples.t(s);
  }
  run.light_time /= static_cast<float>(spp_);
  runs_.push_back(run);
  run_of_.assign(spp_, 0);
  visible_ = spp_, quads_ = 1;
  return true;
}

void FragmentMerger::add_sample(const TileJob& job, const TileSamples& samples, const TileState& state, std::size_t p,
                                std::size_t k, std::size_t s, bool split, std::size_t first_of_pixel) {
  ++visible_;
  const std::uint32_t patch = state.patch[s], triangle = state.triangle[s];
  know(job, patch);
  if (!known_rests_) ++places_;
  const float t = samples.t(s);
  const int segment = known_curved_ && !known_rests_ ? job.frame->segment_of(t) : 0;
  // A still pinhole sample sees the surface where it is itself.
  const float x = known_rests_ ? samples.x[s] : state.rest_x[s], y = known_rests_ ? samples.y[s] : state.rest_y[s];
  const float cell_x = floor_of_place(x), cell_y = floor_of_place(y);
  const bool right = split && samples.x[s] - floor_of_place(samples.x[s]) >= 0.5f, positive = state.positive[s] != 0;
  const float dx = x - cell_x - (split ? (right ? 0.75f : 0.25f) : 0.5f), dy = y - cell_y - 0.5f,
              distance2 = dx * dx + dy * dy;
  std::size_t f = job.shading.rate == ShadingRate::kSample ? fragments_.size() : first_of_pixel;
  const auto same = [&](const Fragment& o) {
    return o.triangle == triangle && o.patch == patch && o.cell_x == cell_x && o.cell_y == cell_y && o.right == right &&
           o.positive == positive && o.segment == segment;
  };
  while (f < fragments_.size() && !same(fragments_[f])) ++f;
  if (f == fragments_.size()) {
    Fragment& fresh = fragments_.emplace_back();
    fresh.patch = patch, fresh.triangle = triangle, fresh.pixel = static_cast<std::uint32_t>(p);
    fresh.cell_x = cell_x, fresh.cell_y = cell_y, fresh.segment = segment;
    fresh.right = right, fresh.positive = positive, fresh.rests = known_rests_, fresh.moves = known_moves_;
    fresh.sample = s, fresh.distance2 = distance2;
    fresh.parent = static_cast<std::uint32_t>(f);
  }
  Fragment& fragment = fragments_[f];
  if (distance2 < fragment.distance2) fragment.sample = s, fragment.distance2 = distance2;
  fragment.time_sum += t;
  ++fragment.samples;
  run_of_[p * spp_ + k] = static_cast<std::uint32_t>(f);
}

std::uint32_t FragmentMerger::root(std::uint32_t f) {
  while (fragments_[f].parent != f) f = fragments_[f].parent = fragments_[fragments_[f].parent].parent;
  return f;
}

bool FragmentMerger::belong_together(const TileJob& job, Fragment& a, Fragment& b) {
  if (a.patch != b.patch || a.positive != b.positive || a.right != b.right || a.segment != b.segment) return false;
  if (a.pixel != b.pixel) {
    // In one quad: fragments of the same primitive, or with merging of its neighbours, at one time and through one lens
    // point.
    if (!a.rests) return false;
    if (job.shading.rate == ShadingRate::kSample) return a.triangle == b.triangle && a.sample % spp_ == b.sample % spp_;
  } else if (a.cell_x != b.cell_x || a.cell_y != b.cell_y) {
    return false;
  }
  if (a.triangle == b.triangle) return job.shading.rate != ShadingRate::kSample;
  if (job.shading.rate != ShadingRate::kPixel || a.triangle >= SurfaceLocation::kLine ||
      b.triangle >= SurfaceLocation::kLine || !is_smooth(job.frame->drawable_of(a.patch)))
    return false;
  for (Fragment* f : {&a, &b})
    if (!f->has_vertices) {
      f->vertices = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back(triangle_vertices(*job.frame, f->patch, f->triangle));
      f->has_vertices = true;
    }
  return share_edge(vertices_[a.vertices], vertices_[b.vertices]);
}

void FragmentMerger::merge_all(const TileJob& job) {
  const auto count = static_cast<std::uint32_t>(fragments_.size());
  for (std::uint32_t b = 1; b < count; ++b)
    for (std::uint32_t a = 0; a < b; ++a) {
      const std::uint32_t ra = root(a), rb = root(b);
      if (ra == rb || !belong_together(job, fragments_[a], fragments_[b])) continue;
      // The smaller number stays: the order in which pairs are looked at does not show.
      fragments_[ra < rb ? rb : ra].parent = ra < rb ? ra : rb;
    }
}

void FragmentMerger::make_runs() {
  for (std::uint32_t f = 0; f < fragments_.size(); ++f) {
    Fragment& fragment = fragments_[f];
    const std::uint32_t r = root(f);
    if (r == f) fragment.quad = static_cast<std::uint32_t>(quads_++);
    // Fragments of a group share the run of the group's first one in their pixel.
    std::uint32_t first = r;
    while (first < f && (fragments_[first].pixel != fragment.pixel || root(first) != r)) ++first;
    if (first == f) {
      fragment.run = static_cast<std::uint32_t>(runs_.size());
      runs_.push_back({fragment.sample, 0.0f, fragment.pixel, fragment.rests, fragment.moves, fragments_[r].quad});
    } else {
      ++merged_;
      Fragment& leader = fragments_[first];
      fragment.run = leader.run;
      leader.time_sum += fragment.time_sum;
      leader.samples += fragment.samples;
      if (fragment.distance2 < leader.distance2)
        runs_[leader.run].sample = fragment.sample, leader.distance2 = fragment.distance2;
    }
    const Fragment& leader = fragments_[first];
    runs_[leader.run].light_time = leader.time_sum / static_cast<float>(leader.samples);
  }
  for (std::uint32_t& run : run_of_)
    if (run != kNoRun) run = fragments_[run].run;
}

}  // namespace tessera::tilecore
