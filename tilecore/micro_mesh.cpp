#include "tilecore/micro_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::tilecore {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

bool same_place(const MicroMesh& m, std::int32_t a, std::int32_t b, bool moving) {
  if (a == b) return true;
  const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
  if (m.x0[i] != m.x0[j] || m.y0[i] != m.y0[j] || m.z0[i] != m.z0[j] || m.projected[i] != m.projected[j]) return false;
  return !moving || (m.x1[i] == m.x1[j] && m.y1[i] == m.y1[j] && m.z1[i] == m.z1[j]);
}

// Box of a cell's corners at one key.
struct KeyBox {
  float x_low = kInfinity, x_high = -kInfinity, y_low = kInfinity, y_high = -kInfinity;
  void add(float x, float y) {
    x_low = std::min(x_low, x);
    x_high = std::max(x_high, x);
    y_low = std::min(y_low, y);
    y_high = std::max(y_high, y);
  }
};

// Range of rates and lens factors over a leaf.
struct LeafRanges {
  float rate_low = kInfinity, rate_high = 0;
  float z_low = kInfinity, z_high = -kInfinity;
};

LeafRanges leaf_ranges(const MicroMesh& m, std::size_t first, std::size_t count, const BoxSettings& settings) {
  LeafRanges ranges;
  for (std::size_t c = first; c < first + count; ++c)
    for (const auto& corners : m.corner) {
      const auto v = static_cast<std::size_t>(corners[c]);
      if (!m.projected[v]) continue;
      const float z1 = settings.moving ? m.z1[v] : m.z0[v];
      ranges.z_low = std::min({ranges.z_low, m.z0[v], z1});
      ranges.z_high = std::max({ranges.z_high, m.z0[v], z1});
      const float rate = settings.moving && !settings.orthographic ? z1 / m.z0[v] : 1.0f;
      ranges.rate_low = std::min(ranges.rate_low, rate);
      ranges.rate_high = std::max(ranges.rate_high, rate);
    }
  return ranges;
}

void set_empty(MicroMesh& m, std::size_t c) {
  m.box_x_low[c] = m.box_y_low[c] = kInfinity;
  m.box_x_high[c] = m.box_y_high[c] = -kInfinity;
  m.box_x_d_low[c] = m.box_x_d_high[c] = m.box_y_d_low[c] = m.box_y_d_high[c] = 0.0f;
}

// `spread` bounds |lambda_i(t) - tau(t)| over the leaf's vertices.
void set_box(MicroMesh& m, std::size_t c, const BoxSettings& settings, float spread) {
  const bool moving = settings.moving;
  KeyBox open, close;
  float travel = 0, extent = 0;
  for (const auto& corners : m.corner) {
    const auto v = static_cast<std::size_t>(corners[c]);
    open.add(m.x0[v], m.y0[v]);
    extent = std::max({extent, std::abs(m.x0[v]), std::abs(m.y0[v])});
    if (!moving) continue;
    close.add(m.x1[v], m.y1[v]);
    travel = std::max({travel, std::abs(m.x1[v] - m.x0[v]), std::abs(m.y1[v] - m.y0[v])});
  }
  if (!moving) close = open;
  // Vertices and box faces each round a handful of times at the size of the coordinates: 16 u. Without motion and lens
  // both are exact.
  const float pad = moving || settings.lens ? travel * spread + (extent + 2 * travel) * 0x1p-20f : 0.0f;
  m.box_x_low[c] = open.x_low - pad;
  m.box_x_high[c] = open.x_high + pad;
  m.box_y_low[c] = open.y_low - pad;
  m.box_y_high[c] = open.y_high + pad;
  m.box_x_d_low[c] = close.x_low - open.x_low;
  m.box_x_d_high[c] = close.x_high - open.x_high;
  m.box_y_d_low[c] = close.y_low - open.y_low;
  m.box_y_d_high[c] = close.y_high - open.y_high;
}

}  // namespace

void MicroMesh::resize_vertices(std::size_t count, bool moving) {
  vertex_count = count;
  for (auto* v : {&x0, &y0, &z0}) v->resize(count);
  if (moving)
    for (auto* v : {&x1, &y1, &z1}) v->resize(count);
  projected.resize(count);
}

void MicroMesh::clear_cells() {
  for (auto& c : corner) c.clear();
  triangle.clear();
  used.clear();
  leaves.clear();
  clipped_cells.clear();
  triangle_count = 0;
}

void MicroMesh::begin_leaf() {
  leaves.push_back(Leaf{});
  const std::size_t slots = leaves.size() * kLeafCells;
  for (auto& c : corner) c.resize(slots, 0);
  triangle.resize(slots, 0);
  used.resize(slots, 0);
}

void MicroMesh::add_cell(const std::array<std::int32_t, 4>& corners, std::uint32_t first_triangle, bool moving) {
  std::array<std::int32_t, 4> cell = corners;
  const auto [a, b, c, d] = corners;
  const bool first = !same_place(*this, a, b, moving) && !same_place(*this, b, c, moving) && !same_place(*this, a, c, moving);
  const bool second = c != d && !same_place(*this, a, c, moving) && !same_place(*this, c, d, moving) && !same_place(*this, a, d, moving);
  if (!first && !second) return;
  if (!first) {
    cell = {a, c, d, d};
    ++first_triangle;
  } else if (!second) {
    cell = {a, b, c, c};
  }
  Leaf& leaf = leaves.back();
  const std::size_t slot = (leaves.size() - 1) * kLeafCells + leaf.cell_count++;
  for (std::size_t k = 0; k < 4; ++k) corner[k][slot] = cell[k];
  triangle[slot] = first_triangle;
  used[slot] = 1;
  triangle_count += (first ? 1u : 0u) + (second ? 1u : 0u);
}

void build_boxes(MicroMesh& m, const BoxSettings& settings) {
  const std::size_t slots = m.leaves.size() * kLeafCells;
  for (auto* v : {&m.box_x_low, &m.box_x_high, &m.box_y_low, &m.box_y_high, &m.box_x_d_low, &m.box_x_d_high, &m.box_y_d_low, &m.box_y_d_high})
    v->resize(slots);
  for (std::size_t l = 0; l < m.leaves.size(); ++l) {
    MicroMesh::Leaf& leaf = m.leaves[l];
    const std::size_t first = l * kLeafCells;
    const LeafRanges ranges = leaf_ranges(m, first, leaf.cell_count, settings);
    leaf.rate = std::sqrt(ranges.rate_low * ranges.rate_high);
    if (!(leaf.rate > 0 && leaf.rate < kInfinity)) leaf.rate = 1.0f;
    // lambda is a logistic function of logit(t) + ln r. Two rates r and r' are at most tanh(|ln r'/r| / 4) apart, that
    // is (s - 1) / (s + 1) with s the square root of their ratio.
    const float ratio = std::sqrt(std::max(ranges.rate_high / leaf.rate, leaf.rate / ranges.rate_low));
    const float spread = ranges.rate_low < kInfinity ? (ratio - 1.0f) / (ratio + 1.0f) + 0x1p-20f : 0.0f;
    const auto lens_factor = [&](float z) { return settings.orthographic ? 1.0f - z * settings.inverse_focus : 1.0f / z - settings.inverse_focus; };
    const float a = lens_factor(ranges.z_low), b = lens_factor(ranges.z_high);
    const float slack = 0x1p-20f * (std::abs(a) + std::abs(b) + settings.inverse_focus);
    leaf.coc_low = std::min(a, b) - slack;
    leaf.coc_high = std::max(a, b) + slack;
    leaf.x_low = leaf.y_low = kInfinity;
    leaf.x_high = leaf.y_high = -kInfinity;
    float x1_low = kInfinity, x1_high = -kInfinity, y1_low = kInfinity, y1_high = -kInfinity;
    for (std::size_t c = first; c < first + kLeafCells; ++c) {
      bool clipped = false;
      for (const auto& corners : m.corner) clipped = clipped || !m.projected[static_cast<std::size_t>(corners[c])];
      if (!m.used[c] || clipped) {
        if (m.used[c]) m.clipped_cells.push_back(static_cast<std::uint32_t>(c));
        set_empty(m, c);
        continue;
      }
      set_box(m, c, settings, spread);
      leaf.x_low = std::min(leaf.x_low, m.box_x_low[c]);
      leaf.x_high = std::max(leaf.x_high, m.box_x_high[c]);
      leaf.y_low = std::min(leaf.y_low, m.box_y_low[c]);
      leaf.y_high = std::max(leaf.y_high, m.box_y_high[c]);
      x1_low = std::min(x1_low, m.box_x_low[c] + m.box_x_d_low[c]);
      x1_high = std::max(x1_high, m.box_x_high[c] + m.box_x_d_high[c]);
      y1_low = std::min(y1_low, m.box_y_low[c] + m.box_y_d_low[c]);
      y1_high = std::max(y1_high, m.box_y_high[c] + m.box_y_d_high[c]);
    }
    leaf.x_d_low = x1_low - leaf.x_low;
    leaf.x_d_high = x1_high - leaf.x_high;
    leaf.y_d_low = y1_low - leaf.y_low;
    leaf.y_d_high = y1_high - leaf.y_high;
    if (!(leaf.x_low <= leaf.x_high)) leaf.x_d_low = leaf.x_d_high = leaf.y_d_low = leaf.y_d_high = 0.0f;
  }
}

}  // namespace tessera::tilecore
