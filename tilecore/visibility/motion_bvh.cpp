#include "tilecore/visibility/motion_bvh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "tilecore/visibility/bounding_polygons.h"

namespace tessera::tilecore {
namespace {

constexpr std::uint32_t kNoCell = 0xFFFFFFFFu;
// Directions are kept away from zero: every slab constant stays finite, and over any depth that a float holds the ray
// moves by less than the boxes are wide.
constexpr double kLeastDirection = 0x1p-180;

// Position of column x, row y on a grid of 2^bits_x by 2^bits_y: bits taken in turns from both while both have some.
std::uint32_t morton(std::uint32_t x, std::uint32_t y, int bits_x, int bits_y) {
  std::uint32_t position = 0;
  int at = 0;
  for (int bit = 0; bit < std::max(bits_x, bits_y); ++bit) {
    if (bit < bits_x) position |= (x >> bit & 1u) << at++;
    if (bit < bits_y) position |= (y >> bit & 1u) << at++;
  }
  return position;
}

float round_down(double v) {
  const auto f = static_cast<float>(v);
  return static_cast<double>(f) > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float round_up(double v) {
  const auto f = static_cast<float>(v);
  return static_cast<double>(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

// Box of a cell. It holds the exact vertices widened by the rounding of the inside test, the widths of PrimitiveBound
// times the depth where that is w:
//   X, Y   8 u (Z (d + W) + R (Z / z) (1 + Z / f)), orthographic 8 u (d + W + R (1 + Z / f))
//   Z      16 u Z: depth at the sample's time, and the quotient that becomes the hit's depth
// with Z, z the largest and smallest depth of the cell's vertices, d their longest way, W the cell's size on screen
// over the whole shutter, R the lens radius, f the focus.
MotionBox cell_box(const MicroMesh& m, std::size_t cell, bool moving, const RaySpace& space) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  std::array<std::array<double, 3>, 2> low, high;
  std::array<double, 2> screen_low, screen_high;
  screen_low.fill(kEndless);
  screen_high.fill(-kEndless);
  for (auto& key : low) key.fill(kEndless);
  for (auto& key : high) key.fill(-kEndless);
  double nearest = kEndless, farthest = 0, way = 0, lens = 0;
  for (const auto& corners : m.corner) {
    const auto v = static_cast<std::size_t>(corners[cell]);
    for (std::size_t key = 0; key < 2; ++key) {
      const bool close = moving && key == 1;
      const std::array<double, 2> at = {static_cast<double>(close ? m.x1[v] : m.x0[v]) - space.center_x,
                                        static_cast<double>(close ? m.y1[v] : m.y0[v]) - space.center_y};
      const double z = static_cast<double>(close ? m.z1[v] : m.z0[v]), w = space.orthographic ? 1.0 : z;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        low[key][axis] = std::min(low[key][axis], at[axis] * w);
        high[key][axis] = std::max(high[key][axis], at[axis] * w);
        screen_low[axis] = std::min(screen_low[axis], at[axis]);
        screen_high[axis] = std::max(screen_high[axis], at[axis]);
      }
      low[key][2] = std::min(low[key][2], z);
      high[key][2] = std::max(high[key][2], z);
      nearest = std::min(nearest, std::abs(z));
      farthest = std::max(farthest, std::abs(z));
      if (space.lens_radius > 0)
        lens = std::max(lens, space.lens_radius * std::abs(space.orthographic ? 1 - z * space.inverse_focus
                                                                              : 1 / z - space.inverse_focus));
    }
    if (moving)
      way = std::max({way, std::abs(static_cast<double>(m.x1[v]) - static_cast<double>(m.x0[v])),
                      std::abs(static_cast<double>(m.y1[v]) - static_cast<double>(m.y0[v]))});
  }
  const double width = std::max(screen_high[0] - screen_low[0], screen_high[1] - screen_low[1]) + 2 * lens;
  const double focus = space.lens_radius * (1 + farthest * space.inverse_focus);
  const double pad =
      kRoundingMargin * (space.orthographic
                             ? way + width + focus
                             : farthest * (way + width) + (space.lens_radius > 0 ? focus * (farthest / nearest) : 0.0));
  // A vertex in focus is where the lens centre sees it, that much away from where a ray through another point
  // would.
  const double sharp = space.sharp_radius * (1 + 0x1p-20) * (space.orthographic ? 1.0 : farthest), across = pad + sharp;
  const std::array<double, 3> pads = {across, across, 2 * kRoundingMargin * farthest};
  MotionBox box;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[key][axis] = round_down(low[key][axis] - pads[axis]);
      box.high[key][axis] = round_up(high[key][axis] + pads[axis]);
    }
  return box;
}

// Each pair of bits of a word becomes one: set when either is.
std::uint32_t or_pairs(std::uint64_t word) {
  std::uint64_t x = (word | word >> 1) & 0x5555555555555555u;
  x = (x | x >> 1) & 0x3333333333333333u;
  x = (x | x >> 2) & 0x0F0F0F0F0F0F0F0Fu;
  x = (x | x >> 4) & 0x00FF00FF00FF00FFu;
  x = (x | x >> 8) & 0x0000FFFF0000FFFFu;
  return static_cast<std::uint32_t>(x | x >> 16);
}

}  // namespace

std::uint64_t MotionBvh::build(const MicroMesh& mesh, std::size_t leaf_columns, RayEffects effects,
                               const RaySpace& space) {
  space_ = space;
  const std::size_t leaves = std::max<std::size_t>(1, mesh.leaves.size()),
                    columns = std::clamp<std::size_t>(leaf_columns, 1, leaves);
  const std::size_t rows = (leaves + columns - 1) / columns;
  const int bits_x = std::bit_width(columns - 1), bits_y = std::bit_width(rows - 1);
  leaf_count_ = static_cast<std::uint32_t>(kLeafCells << (bits_x + bits_y));
  cells_.assign(leaf_count_, kNoCell);
  nodes_.assign(2 * leaf_count_, MotionBox::empty());
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const std::uint32_t first =
        static_cast<std::uint32_t>(kLeafCells) *
        morton(static_cast<std::uint32_t>(l % columns), static_cast<std::uint32_t>(l / columns), bits_x, bits_y);
    const std::uint32_t count = mesh.leaves[l].cell_count;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::size_t cell = l * kLeafCells + k;
      if (!is_projected(mesh, cell)) continue;
      // At the end of a grid a leaf is not 4x4; its order of rows serves then.
      const std::uint32_t leaf = first + (count == kLeafCells ? morton(k % 4, k / 4, 2, 2) : k);
      cells_[leaf] = static_cast<std::uint32_t>(cell);
      nodes_[leaf_count_ + leaf] = cell_box(mesh, cell, effects.motion, space);
    }
  }
  for (std::uint32_t n = leaf_count_; n-- > 1;) {
    nodes_[n] = nodes_[2 * n];
    nodes_[n].merge(nodes_[2 * n + 1]);
  }
  alive_.resize(static_cast<std::size_t>(std::bit_width(leaf_count_)) + 2);
  std::uint64_t built = 0;
  for (std::size_t n = 1; n < nodes_.size(); ++n) built += nodes_[n].is_empty() ? 0 : 1;
  return built;
}

bool MotionBvh::test_node(const BundleFrustum& frustum, std::uint32_t node) {
  if (nodes_[node].is_empty()) return false;  // the pattern has no such node
  ++counters_.frustum_node_tests;
  if (node < leaf_count_) return !frustum.outside(nodes_[node]);
  const BundleFrustum::Times times = frustum.times(nodes_[node]);
  if (times.empty()) return false;
  // Exact: a sample of stencil value s has s <= 256 t < s + 1, and both t are the same floats.
  const auto value = [](float t) { return std::min(255, static_cast<int>(t * 256.0f)); };
  inside_.push_back({node - leaf_count_, {value(times.low), value(times.high)}});
  return true;
}

void MotionBvh::traverse_inside(const BundleFrustum& frustum, std::uint32_t node) {
  if (node >= leaf_count_) return;
  const bool left = test_node(frustum, 2 * node), right = test_node(frustum, 2 * node + 1);
  // Depth first: the first one found is above all others.
  if (left && right && fork_ == 0) fork_ = node;
  if (left) traverse_inside(frustum, 2 * node);
  if (right) traverse_inside(frustum, 2 * node + 1);
}

MotionBvh::Overlap MotionBvh::traverse(const BundleFrustum& frustum, std::uint32_t start, BranchNode method) {
  method_ = method;
  start_ = start;
  fork_ = 0;
  inside_.clear();
  if (test_node(frustum, start)) traverse_inside(frustum, start);
  return within({0, 255});
}

MotionBvh::Overlap MotionBvh::within(const TimeRange& values) {
  Overlap overlap;
  overlap.branch = start_;
  mask_.assign((leaf_count_ + 63) / 64, 0);
  for (const LeafInside& leaf : inside_) {
    const TimeRange stencils = leaf.stencils.intersect(values);
    if (stencils.empty()) continue;
    overlap.any = true;
    overlap.stencils = {std::min(overlap.stencils.first, stencils.first),
                        std::max(overlap.stencils.last, stencils.last)};
    mask_[leaf.leaf / 64] |= std::uint64_t{1} << (leaf.leaf % 64);
  }
  if (!overlap.any) return overlap;
  if (method_ == BranchNode::kLeafMask) overlap.branch = branch_of_mask();
  // Without a fork there is one leaf inside.
  else if (method_ == BranchNode::kBothChildren)
    overlap.branch = fork_ != 0 ? fork_ : leaf_count_ + inside_.front().leaf;
  return overlap;
}

std::uint32_t MotionBvh::branch_of_mask() {
  // Level by level from the leaves: each node's bit is the OR of its children's; the first level with one bit has it.
  std::vector<std::uint64_t>& level = mask_;
  for (std::uint32_t first = leaf_count_;; first /= 2) {
    std::uint64_t all = 0, words = 0, at = 0;
    for (std::size_t w = 0; w < level.size(); ++w)
      if (level[w] != 0) all = level[w], at = w, ++words;
    if (words == 1 && (all & (all - 1)) == 0)
      return first + static_cast<std::uint32_t>(64 * at) + static_cast<std::uint32_t>(std::countr_zero(all));
    for (std::size_t w = 0; w < level.size(); w += 2)
      level[w / 2] = or_pairs(level[w]) | (w + 1 < level.size() ? std::uint64_t{or_pairs(level[w + 1])} << 32 : 0);
    level.resize((level.size() + 1) / 2);
  }
}

MotionBvh::Ray MotionBvh::ray(const TileSamples& samples, std::uint32_t sample, float limit) const {
  Ray ray{};
  ray.t = space_.moving ? static_cast<double>(samples.t(sample)) : 0.0;
  ray.limit = static_cast<double>(limit);
  ray.sample = sample;
  const std::array<double, 2> at = {static_cast<double>(samples.x[sample]) - space_.center_x,
                                    static_cast<double>(samples.y[sample]) - space_.center_y};
  const bool lens = space_.lens_radius > 0;
  const std::array<double, 2> point = {lens ? static_cast<double>(samples.lens_u[sample]) : 0.0,
                                       lens ? static_cast<double>(samples.lens_v[sample]) : 0.0};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double origin = space_.orthographic ? at[axis] + point[axis] : point[axis];
    double direction =
        space_.orthographic ? -point[axis] * space_.inverse_focus : at[axis] - point[axis] * space_.inverse_focus;
    if (std::abs(direction) < kLeastDirection) direction = kLeastDirection;
    ray.a[axis] = (1 - ray.t) / direction;
    ray.b[axis] = ray.t / direction;
    ray.c[axis] = -origin / direction;
  }
  return ray;
}

bool MotionBvh::meets(const Ray& ray, const MotionBox& box) const {
  const auto at = [&](float open, float close) {
    return (1 - ray.t) * static_cast<double>(open) + ray.t * static_cast<double>(close);
  };
  double entry = at(box.low[0][2], box.low[1][2]), exit = at(box.high[0][2], box.high[1][2]);
  // Compares with the node's own near depth, not with the depth at which the ray enters: in a sliver the depth of a hit
  // is only known to lie between its corners' depths.
  if (entry > ray.limit) return false;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto slab = [&](float open, float close) {
      return ray.a[axis] * static_cast<double>(open) + ray.b[axis] * static_cast<double>(close) + ray.c[axis];
    };
    const double p = slab(box.low[0][axis], box.low[1][axis]), q = slab(box.high[0][axis], box.high[1][axis]);
    entry = std::max(entry, std::min(p, q));
    exit = std::min(exit, std::max(p, q));
  }
  return entry <= exit;
}

bool MotionBvh::visit_node(std::span<const Ray> rays, std::uint32_t node, std::size_t level) {
  if (nodes_[node].is_empty()) return false;
  const std::vector<std::uint32_t>& before = alive_[level - 1];
  std::vector<std::uint32_t>& after = alive_[level];
  counters_.node_visits += before.size();
  after.resize(before.size());
  std::size_t count = 0;
  for (const std::uint32_t k : before) {
    after[count] = k;
    count += meets(rays[k], nodes_[node]) ? 1 : 0;
  }
  after.resize(count);
  return count > 0;
}

RayCounters MotionBvh::take_counters() { return std::exchange(counters_, {}); }

}  // namespace tessera::tilecore
