#include "reference/shutter_slices.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::reference {
namespace {

using scene::FrameGeometry;

constexpr double kShortest = 0x1p-20;  // fraction of the shutter
constexpr std::size_t kPoints = 48;    // points of a drawable
constexpr int kLooks = 3;              // random times at which a slice is sampled
constexpr int kFirstLooks = 32;        // random times in the whole shutter, before its first split

// Steele, Lea and Flood 2014, SplitMix64.
class RandomTimes {
 public:
  explicit RandomTimes(std::uint64_t seed) : state_(seed) {}
  double next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

// Times of the shutter at which a played animation has a key, ascending.
std::vector<double> keys_of(const scene::Capture& capture, const scene::FrameRequest& request) {
  std::vector<double> keys;
  const double open = request.open_time, length = request.close_time - open;
  for (const int a : capture.played_animations)
    for (const scene::AnimationChannel& channel : capture.animations[static_cast<std::size_t>(a)].channels) {
      auto key = std::upper_bound(channel.times.begin(), channel.times.end(), open,
                                  [](double t, float k) { return t < static_cast<double>(k); });
      for (; key != channel.times.end() && static_cast<double>(*key) < request.close_time; ++key)
        keys.push_back((static_cast<double>(*key) - open) / length);
    }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

// Calls look(point) for some points of a posed drawable at a key, in raster space; displaced points are moved as far
// out as the displacement reaches.
template <class Look>
void look_at_points(const FrameGeometry& frame, std::size_t d, std::size_t key, const Look& look) {
  const scene::PosedDrawable& drawable = frame.drawables[d];
  const DMat4 m(drawable.to_raster[key]);
  if (drawable.procedure != nullptr) {
    const scene::Procedure& shape = key == 0 ? *drawable.procedure : *drawable.procedure_close;
    for (const auto& piece : shape.pieces)
      for (int k = 0; k < 9; ++k) {
        const auto p = shaders::shape_point(shape.shape, piece.input, 0.5 * (k % 3), 0.5 * (k / 3));
        look(m * DVec4(p.x, p.y, p.z, 1.0));
      }
    return;
  }
  double reach = 0;
  if (const auto& displaced = drawable.material->displacement)
    reach = std::max(std::abs(static_cast<double>(displaced->bias)),
                     std::abs(static_cast<double>(displaced->bias + displaced->scale)));
  const auto& positions = drawable.positions[drawable.moving ? key : 0];
  const std::size_t step = std::max<std::size_t>(1, positions.size() / kPoints);
  for (std::size_t v = 0; v < positions.size(); v += step) {
    const DVec3 p(positions[v]);
    look(m * DVec4(p, 1.0));
    if (reach > 0)
      for (int side = 0; side < 6; ++side) {
        DVec3 out = p;
        out[side / 2] += side % 2 == 0 ? reach : -reach;
        look(m * DVec4(out, 1.0));
      }
  }
}

// Largest distance in pixels between linear motion through a slice and the true positions, at `share` of the slice.
double distance(const FrameGeometry& slice, const FrameGeometry& truth, double share) {
  double most = 0;
  const scene::Projection& p = truth.projection;
  const scene::FrameRequest& request = truth.request;
  std::vector<DVec4> open, close, true_places;
  const auto compare = [&] {
    for (std::size_t k = 0; k < true_places.size(); ++k) {
      const DVec4 line = open[k] * (1 - share) + close[k] * share, at = true_places[k];
      if (!p.orthographic && at.w < p.near && line.w < p.near) continue;
      const double w = p.orthographic ? 1.0 : std::max(at.w, p.near),
                   w_line = p.orthographic ? 1.0 : std::max(line.w, p.near);
      const DVec2 there(at.x / w, at.y / w), on_line(line.x / w_line, line.y / w_line);
      // Points farther off the image than its size are ignored.
      if (there.x < -request.width || there.x > 2 * request.width || there.y < -request.height ||
          there.y > 2 * request.height)
        continue;
      const double lens = p.orthographic ? p.inverse_focus * std::abs(at.z - line.z) : std::abs(1 / w - 1 / w_line);
      most = std::max(most, glm::distance(there, on_line) + p.lens_scale * lens);
    }
  };
  for (std::size_t d = 0; d < slice.drawables.size(); ++d) {
    if (!slice.drawables[d].visible) continue;
    open.clear(), close.clear(), true_places.clear();
    look_at_points(slice, d, 0, [&](const DVec4& point) { open.push_back(point); });
    look_at_points(slice, d, 1, [&](const DVec4& point) { close.push_back(point); });
    look_at_points(truth, d, 0, [&](const DVec4& point) { true_places.push_back(point); });
    compare();
  }
  // The background turns with the camera.
  if (!p.orthographic) {
    open.clear(), close.clear(), true_places.clear();
    for (int k = 0; k < 9; ++k) {
      const DVec3 along((0.5 * (k % 3) * request.width - p.center_x) / p.scale,
                        -(0.5 * (k / 3) * request.height - p.center_y) / p.scale, -1);
      const DVec4 far(DMat3(truth.views[0].camera_to_world) * along, 0.0);
      open.push_back(slice.projections[0].matrix() * (slice.views[0].world_to_camera * far));
      close.push_back(slice.projections[1].matrix() * (slice.views[1].world_to_camera * far));
      true_places.push_back(p.matrix() * (truth.views[0].world_to_camera * far));
    }
    compare();
  }
  return most;
}

}  // namespace

ShutterSlices::ShutterSlices(const scene::Assembly& assembly, const scene::CameraChoice& camera,
                             const scene::FrameRequest& request, std::uint64_t seed,
                             std::unique_ptr<scene::FrameGeometry> grids)
    : assembly_(assembly), camera_(camera), request_(request), grids_(std::move(grids)), ends_{0.0, 1.0} {
  request_.state_time = request.state();
  if (request.open_time != request.close_time && !assembly.capture->played_animations.empty())
    for (double most = kMaxPixels;; most *= 2) {
      split(seed, most);
      if (count() <= kMaxSlices) break;
    }
  common_ = pose(0);
}

scene::FrameRequest ShutterSlices::slice_request(double a, double b) const {
  scene::FrameRequest out = request_;
  const double open = request_.open_time, length = request_.close_time - open;
  out.open_time = a == 0.0 ? open : open + length * a;
  // A slice that ends at a jump of an animation ends just before it.
  out.close_time = a == b     ? out.open_time
                   : b == 1.0 ? request_.close_time
                              : std::nextafter(open + length * b, -std::numeric_limits<double>::infinity());
  out.motion_segments = 1;
  out.projection_moves = true;
  return out;
}

std::unique_ptr<FrameGeometry> ShutterSlices::pose(std::size_t k) const {
  const bool shut = request_.open_time == request_.close_time;
  auto frame = scene::pose_frame(assembly_, camera_, slice_request(ends_[k], shut ? ends_[k] : ends_[k + 1]));
  if (grids_ != nullptr) frame->patterns = grids_->patterns, frame->displacement_lod = grids_->displacement_lod;
  return frame;
}

void ShutterSlices::split(std::uint64_t seed, double max_pixels) {
  RandomTimes random(seed);
  const std::vector<double> keys = keys_of(*assembly_.capture, request_);
  // Grids do not matter here, so they are as coarse as possible.
  const auto posed = [&](double a, double b) {
    scene::FrameRequest coarse = slice_request(a, b);
    coarse.tessellation.target_edge_pixels = 1e6;
    return scene::pose_frame(assembly_, camera_, coarse);
  };
  const auto off = [&](const FrameGeometry& slice, double a, double b, double share) {
    const double at = a + (b - a) * share;
    return distance(slice, *posed(at, at), share);
  };
  std::vector<std::pair<double, double>> waiting = {{0.0, 1.0}};
  ends_ = {0.0};
  while (!waiting.empty() && ends_.size() <= kMaxSlices + 1) {
    const auto [a, b] = waiting.back();
    waiting.pop_back();
    const auto slice = posed(a, b);
    const auto first = std::upper_bound(keys.begin(), keys.end(), a),
               last = std::lower_bound(keys.begin(), keys.end(), b);
    bool bends = false;
    const bool whole = a == 0.0 && b == 1.0;
    for (auto key = first; key < last && !bends; ++key) bends = off(*slice, a, b, (*key - a) / (b - a)) > max_pixels;
    for (int look = 0; look < (whole ? kFirstLooks : kLooks) && !bends; ++look)
      bends = off(*slice, a, b, random.next()) > max_pixels;
    if (!bends || b - a < kShortest) {
      ends_.push_back(b);
      continue;
    }
    // Split at the key in the middle, or at random in the middle third.
    const double middle = first < last ? *(first + (last - first) / 2) : a + (b - a) * (1 + random.next()) / 3;
    waiting.emplace_back(middle, b);
    waiting.emplace_back(a, middle);
  }
  if (!waiting.empty()) ends_.resize(kMaxSlices + 2);  // too many slices
}

}  // namespace tessera::reference
