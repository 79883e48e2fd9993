#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/parallel.h"
#include "reference/reference_scene.h"

namespace tessera::reference {
namespace {

// Grows a box by an interval, rounded outwards.
void grow(ReferenceScene::Box& box, const std::array<double, 3>& low, const std::array<double, 3>& high) {
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] =
        std::min(box.low[a], std::nextafterf(static_cast<float>(low[a]), -std::numeric_limits<float>::infinity()));
    box.high[a] =
        std::max(box.high[a], std::nextafterf(static_cast<float>(high[a]), std::numeric_limits<float>::infinity()));
  }
}

ReferenceScene::Box empty_box() {
  ReferenceScene::Box box;
  box.low.fill(std::numeric_limits<float>::infinity());
  box.high.fill(-std::numeric_limits<float>::infinity());
  return box;
}

void grow(ReferenceScene::Box& box, const ReferenceScene::Box& other) {
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] = std::min(box.low[a], other.low[a]);
    box.high[a] = std::max(box.high[a], other.high[a]);
  }
}

float middle(const std::array<ReferenceScene::Box, 2>& boxes, std::size_t axis) {
  return 0.25f * ((boxes[0].low[axis] + boxes[0].high[axis]) + (boxes[1].low[axis] + boxes[1].high[axis]));
}

// The cost of a node. Rays of a camera run along the depth, so it is the box's area across the depth, in pixels in
// perspective. Shadow rays run in any direction, so it is the box's surface, in scene units.
double cost_of(const std::array<ReferenceScene::Box, 2>& boxes, const ReferenceScene& scene) {
  double cost = 0;
  if (scene.casters) {
    const double unit = 1.0 / scene.posed.projection.scale;
    for (const ReferenceScene::Box& box : boxes) {
      const double x = static_cast<double>(box.high[0] - box.low[0]) * unit,
                   y = static_cast<double>(box.high[1] - box.low[1]) * unit,
                   z = static_cast<double>(box.high[2] - box.low[2]);
      cost += x * y + y * z + z * x;
    }
    return cost;
  }
  for (const ReferenceScene::Box& box : boxes) {
    const double z = scene.orthographic ? 1.0 : std::max(0.5 * static_cast<double>(box.low[2] + box.high[2]), 1e-6);
    cost += static_cast<double>(box.high[0] - box.low[0]) * static_cast<double>(box.high[1] - box.low[1]) / (z * z);
  }
  return cost;
}

}  // namespace

std::array<ReferenceScene::Box, 2> ReferenceScene::leaf_boxes(const Leaf& leaf) const {
  std::array<std::array<double, 3>, 2> low, high;
  for (std::size_t key = 0; key < 2; ++key)
    low[key].fill(std::numeric_limits<double>::infinity()), high[key].fill(-std::numeric_limits<double>::infinity());
  for (std::size_t v = leaf.first_vertex; v < std::size_t{leaf.first_vertex} + leaf.vertex_count; ++v) {
    // Margin for the walk through the tree, which rounds in single precision: 16 units in the last place of everything
    // that it adds up there. Walks of shadow rays are in double precision, as their start may be far from the box.
    double size = lens_scale;
    for (std::size_t key = 0; key < 2; ++key)
      for (std::size_t a = 0; a < 3; ++a)
        size = std::max(size, std::abs(vertices[v][3 * key + a]) * (a == 2 ? std::max(center_x, center_y) : 1.0));
    const double slack = size * (casters ? 0x1p-30 : 0x1p-20);
    for (std::size_t key = 0; key < 2; ++key)
      for (std::size_t a = 0; a < 3; ++a) {
        low[key][a] = std::min(low[key][a], vertices[v][3 * key + a] - slack);
        high[key][a] = std::max(high[key][a], vertices[v][3 * key + a] + slack);
      }
  }
  std::array<Box, 2> boxes = {empty_box(), empty_box()};
  for (std::size_t key = 0; key < 2; ++key) grow(boxes[key], low[key], high[key]);
  return boxes;
}

void ReferenceScene::build_tree() {
  leaf_boxes_.resize(leaves.size());
  parallel_for(leaves.size(), [&](std::size_t l) { leaf_boxes_[l] = leaf_boxes(leaves[l]); });
  if (leaves.empty()) return;
  std::vector<std::uint32_t> order(leaves.size());
  std::iota(order.begin(), order.end(), 0u);
  nodes.resize(2 * leaves.size() - 1);
  build(order, 0, order.size(), 0);
}

void ReferenceScene::build(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end, std::size_t number) {
  constexpr std::size_t kAlone = 1024;  // leaves that are too few for another thread
  Node& node = nodes[number];
  node.box = {empty_box(), empty_box()};
  for (std::size_t k = begin; k < end; ++k) {
    for (std::size_t key = 0; key < 2; ++key) grow(node.box[key], leaf_boxes_[order[k]][key]);
    node.moving = node.moving || leaves[order[k]].moving;
  }
  if (end - begin == 1) {
    node.right = static_cast<std::int32_t>(order[begin]);
    return;
  }
  // A tree over n leaves has 2 n - 1 nodes, so the begin of the right side is known before the left one is built.
  const std::size_t split = choose_split(order, begin, end), left = number + 1, right = number + 2 * (split - begin);
  node.left = static_cast<std::int32_t>(left);
  node.right = static_cast<std::int32_t>(right);
  const auto side = [&](std::size_t which) {
    if (which == 0)
      build(order, begin, split, left);
    else
      build(order, split, end, right);
  };
  if (end - begin > kAlone) {
    parallel_for(2, side);
  } else {
    side(0);
    side(1);
  }
}

std::size_t ReferenceScene::choose_split(std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) const {
  constexpr std::size_t kBins = 16;
  // Binned surface-area heuristic over the centres of the leaves.
  std::size_t best_axis = 3, best_bin = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  std::array<float, 3> low, high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::numeric_limits<float>::infinity(), high[axis] = -low[axis];
    for (std::size_t k = begin; k < end; ++k) {
      const float m = middle(leaf_boxes_[order[k]], axis);
      low[axis] = std::min(low[axis], m), high[axis] = std::max(high[axis], m);
    }
  }
  const auto bin_of = [&](std::uint32_t leaf, std::size_t axis) {
    const float share = (middle(leaf_boxes_[leaf], axis) - low[axis]) / (high[axis] - low[axis]);
    return std::min<std::size_t>(static_cast<std::size_t>(share * static_cast<float>(kBins)), kBins - 1);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(high[axis] > low[axis])) continue;
    std::array<std::array<Box, 2>, kBins> box;
    std::array<std::size_t, kBins> count{};
    for (auto& b : box) b = {empty_box(), empty_box()};
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t bin = bin_of(order[k], axis);
      ++count[bin];
      for (std::size_t key = 0; key < 2; ++key) grow(box[bin][key], leaf_boxes_[order[k]][key]);
    }
    std::array<double, kBins> below{};  // cost of the bins up to here
    for (const bool up : {true, false}) {
      std::array<Box, 2> sum = {empty_box(), empty_box()};
      std::size_t total = 0;
      for (std::size_t step = 0; step + 1 < kBins; ++step) {
        const std::size_t bin = up ? step : kBins - 1 - step;
        total += count[bin];
        for (std::size_t key = 0; key < 2; ++key) grow(sum[key], box[bin][key]);
        const double cost = total == 0 ? 0 : cost_of(sum, *this) * static_cast<double>(total);
        if (up) {
          below[bin] = total == 0 ? std::numeric_limits<double>::infinity() : cost;
        } else if (total > 0 && below[bin - 1] + cost < best_cost) {
          best_cost = below[bin - 1] + cost;
          best_axis = axis;
          best_bin = bin;  // first bin of the right side
        }
      }
    }
  }
  std::size_t split = begin + (end - begin) / 2;
  if (best_axis < 3) {
    const auto at = std::stable_partition(order.begin() + static_cast<std::ptrdiff_t>(begin),
                                          order.begin() + static_cast<std::ptrdiff_t>(end),
                                          [&](std::uint32_t leaf) { return bin_of(leaf, best_axis) < best_bin; });
    split = static_cast<std::size_t>(at - order.begin());
  }
  return split == begin || split == end ? begin + (end - begin) / 2 : split;
}

void ReferenceScene::measure_blur() {
  double travel = 0, confusion = 0;
  std::size_t count = 0;
  for (const std::array<Box, 2>& boxes : leaf_boxes_) {
    std::array<double, 2> x, y, z;
    for (std::size_t key = 0; key < 2; ++key) {
      z[key] = 0.5 * static_cast<double>(boxes[key].low[2] + boxes[key].high[2]);
      const double w = orthographic ? 1.0 : z[key];
      x[key] = 0.5 * static_cast<double>(boxes[key].low[0] + boxes[key].high[0]) / w;
      y[key] = 0.5 * static_cast<double>(boxes[key].low[1] + boxes[key].high[1]) / w;
    }
    if (!(z[0] > near) || !(z[1] > near) || std::abs(x[0]) > center_x || std::abs(y[0]) > center_y) continue;
    travel += std::hypot(x[1] - x[0], y[1] - y[0]);
    confusion += lens_scale * std::abs(orthographic ? 1.0 - z[0] * inverse_focus : 1.0 / z[0] - inverse_focus);
    ++count;
  }
  if (count == 0) return;
  mean_travel_pixels = travel / static_cast<double>(count);
  mean_confusion_pixels = confusion / static_cast<double>(count);
}

}  // namespace tessera::reference
