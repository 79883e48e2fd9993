#include "frontend/patch_splitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tessera::frontend {
namespace {

constexpr double kMandatory = std::numeric_limits<double>::infinity();
constexpr int kSmallestSide = 2;  // cells; a finer cut costs more in entries than it saves in overlap

std::uint64_t cell_count(const scene::CellRange& r) {
  return static_cast<std::uint64_t>(r.i1 - r.i0) * static_cast<std::uint64_t>(r.j1 - r.j0);
}

// Longer side of the part of a bound that lies in the frame, in pixels.
double extent_in_frame(const ScreenBounds& b, int width, int height) {
  const auto side = [](float low, float high, int size) {
    return static_cast<double>(std::min(high, static_cast<float>(size)) - std::max(low, 0.0f));
  };
  return std::max(side(b.x0, b.x1, width), side(b.y0, b.y1, height));
}

// Squared length on screen of the sides of a moving box along one of its axes, the largest of both motion keys and all four
// edges; corners behind the camera count as far as they go.
double side_length2(const MovingCorners& corners, std::size_t axis_bit) {
  double longest = 0;
  for (std::size_t k = 0; k < 16; ++k) {
    if ((k & axis_bit) != 0) continue;
    const DVec4 &a = corners[k], &b = corners[k | axis_bit];
    const double aw = std::max(a.w, 1e-9), bw = std::max(b.w, 1e-9), x = a.x / aw - b.x / bw, y = a.y / aw - b.y / bw;
    longest = std::max(longest, x * x + y * y);
  }
  return longest;
}

// Longer side on screen of a moving box, the larger of both motion keys. The further area that a sub-patch sweeps, by
// motion or by its circle of confusion, its halves would sweep as well.
double extent_at_keys(const MovingCorners& corners) {
  double longest = 0;
  for (const std::size_t first : {std::size_t{0}, std::size_t{8}}) {
    std::array<double, 2> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t k = first; k < first + 8; ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        const double at = corners[k][axis] / std::max(corners[k].w, 1e-9);
        const auto a = static_cast<std::size_t>(axis);
        low[a] = std::min(low[a], at);
        high[a] = std::max(high[a], at);
      }
    }
    for (std::size_t a = 0; a < 2; ++a) longest = std::max(longest, high[a] - low[a]);
  }
  return longest;
}

}  // namespace

double box_area(const MovingBox& box, const std::array<Mat4, 2>& to_world) {
  double area = 0;
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat3 linear{DMat4(to_world[key])};
    std::array<DVec3, 3> side;
    for (std::size_t axis = 0; axis < 3; ++axis)
      side[axis] = linear * (box.axes[axis] * (box.high[key][axis] - box.low[key][axis]));
    area = std::max(area, 2 * (glm::length(glm::cross(side[0], side[1])) + glm::length(glm::cross(side[1], side[2])) +
                               glm::length(glm::cross(side[2], side[0]))));
  }
  return area;
}

std::array<scene::CellRange, 2> halves(const scene::CellRange& range, bool along_u) {
  scene::CellRange first = range, second = range;
  if (along_u)
    first.i1 = second.i0 = static_cast<std::uint8_t>((range.i0 + range.i1) / 2);
  else
    first.j1 = second.j0 = static_cast<std::uint8_t>((range.j0 + range.j1) / 2);
  return {first, second};
}

double PatchSplitter::priority(const BoundedSubPatch& piece, const MovingCorners& corners, int depth) const {
  const int width = piece.range.i1 - piece.range.i0, height = piece.range.j1 - piece.range.j0;
  if (std::max(width, height) > settings_.max_cells) return kMandatory;
  if (depth >= settings_.split_depth || std::max(width, height) < 2 * kSmallestSide) return 0;
  const ScreenBounds& b = piece.bounds;
  const double extent =
      std::min(extent_in_frame(b, frame_.request.width, frame_.request.height), extent_at_keys(corners));
  if (!(extent > settings_.split_pixels)) return 0;
  switch (settings_.split_criterion) {
    case SplitCriterion::kScreenExtent:
      return extent;
    case SplitCriterion::kFrustum: {
      const bool straddles = b.crosses_near || b.x0 < 0 || b.y0 < 0 ||
                             b.x1 > static_cast<float>(frame_.request.width) ||
                             b.y1 > static_cast<float>(frame_.request.height);
      return straddles ? extent : 0;
    }
    case SplitCriterion::kNearest:
      return 1 / std::max(static_cast<double>(b.near_z), 1e-30);
    case SplitCriterion::kNormalSpread: {
      if (bounder_.drawable().material->double_sided || bounder_.drawable().procedure != nullptr) return 0;
      const CornerFrame frame = corner_frame(bounder_.nets());
      const NetMeasure m = measure_net(bounder_.nets()[0], frame.axes, frame.tangent_u, frame.tangent_v);
      const auto cones = tangent_cones(m, frame);
      // Without a cone the part turns by more than any that has one.
      return cones ? std::max(cones->sine_u, cones->sine_v) : 2.0;
    }
    case SplitCriterion::kSurfaceArea:
      return box_area(piece.box, bounder_.drawable().to_world);
  }
  return 0;
}

bool PatchSplitter::splits_along_u(const Node& node, bool mandatory) const {
  const scene::CellRange& r = node.piece.range;
  const int width = r.i1 - r.i0, height = r.j1 - r.j0;
  if (std::min(width, height) < 2 * kSmallestSide) return width > height;
  // If only one side is too long for a tile core, splits that side.
  if (mandatory && std::min(width, height) <= settings_.max_cells) return width > height;
  return side_length2(node.corners, 1) >= side_length2(node.corners, 2);
}

std::optional<PatchSplitter::Node> PatchSplitter::visit(std::uint32_t patch, const scene::CellRange& range,
                                                        const SiblingBound* bound, int depth,
                                                        FrontendCounters& counters) {
  const SubPatchBody body = bound != nullptr ? bounder_.use(*bound) : bounder_.body(range);
  if (bounder_.bounded_twice()) ++counters.bounds_computed;
  const std::optional<ScreenBounds> bounds = screen_bounds(body.corners, frame_.projection, body.margin);
  if (!bounds || outside_frame(*bounds, frame_.request.width, frame_.request.height)) {
    ++counters.culled_frustum;
    counters.cells_culled_frustum += cell_count(range);
    return std::nullopt;
  }
  const bool faces_away = settings_.backface_culling && back_face_.culls(bounder_, pyramids_, range, body.corners);
  if (faces_away) {
    ++counters.culled_backface;
    counters.cells_culled_backface += cell_count(range);
    return std::nullopt;
  }
  if (depth_ != nullptr && depth_->hides(depth_->footprint(*bounds), blocks_tested_)) return std::nullopt;
  Node node{0,
            visited_++,
            depth,
            {patch, range, *bounds, body.box, effects_.select(bounder_, body, *bounds)},
            body.corners,
            nullptr};
  if (has_grid(*bounder_.drawable().drawable)) node.priority = priority(node.piece, node.corners, depth);
  return node;
}

PatchSplitter::Halves* PatchSplitter::take_halves() {
  if (spare_.empty()) return &halves_.emplace_back();
  Halves* taken = spare_.back();
  spare_.pop_back();
  return taken;
}

PatchSplitter::Halves* PatchSplitter::bound_halves(Node& node, bool mandatory, bool next_as_well) {
  const std::array<scene::CellRange, 2> ranges = halves(node.piece.range, splits_along_u(node, mandatory));
  Halves* own = std::exchange(node.halves, nullptr);
  if (own != nullptr && (*own)[0].cells == ranges[0]) return own;
  if (own == nullptr) own = take_halves();
  if (!next_as_well || heap_.empty() || heap_.front().halves != nullptr) {
    bounder_.bound(ranges, *own);
    return own;
  }
  Node& next = heap_.front();
  const std::array<scene::CellRange, 2> others =
      halves(next.piece.range, splits_along_u(next, next.priority == kMandatory));
  const std::array<scene::CellRange, kSiblings> all = {ranges[0], ranges[1], others[0], others[1]};
  next.halves = take_halves();
  const std::array<SiblingBound*, kSiblings> to = {own->data(), own->data() + 1, next.halves->data(),
                                                   next.halves->data() + 1};
  bounder_.bound(all, to);
  return own;
}

void PatchSplitter::split(std::uint32_t patch, std::vector<BoundedSubPatch>& out, FrontendCounters& counters) {
  const scene::CellRange whole = patch_cells(frame_, patch);
  ++counters.base_patches;
  counters.cells += cell_count(whole);
  // A max-heap; equal priorities go in the order in which they were visited.
  const auto later = [](const Node& a, const Node& b) {
    return a.priority != b.priority ? a.priority < b.priority : a.order > b.order;
  };
  bounder_.begin(patch);
  back_face_.begin(patch);
  effects_.begin(patch);
  visited_ = 0;
  heap_.clear();
  const std::size_t first = out.size();
  const auto keep = [&](const scene::CellRange& part, const SiblingBound* bound, int depth) {
    ++counters.bounds_computed;
    std::optional<Node> node = visit(patch, part, bound, depth, counters);
    if (!node) return;
    if (node->priority > 0) {
      heap_.push_back(std::move(*node));
      std::push_heap(heap_.begin(), heap_.end(), later);
    } else {
      out.push_back(node->piece);
    }
  };
  keep(whole, nullptr, 0);
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), later);
    Node node = std::move(heap_.back());
    heap_.pop_back();
    const std::size_t pieces = out.size() - first + heap_.size() + 1;
    const bool mandatory = node.priority == kMandatory;
    if (!mandatory && pieces >= static_cast<std::size_t>(settings_.split_budget)) {
      if (node.halves != nullptr) give_back(std::exchange(node.halves, nullptr));
      out.push_back(node.piece);
      continue;
    }
    ++counters.splits;
    Halves* both = bound_halves(node, mandatory, pieces + 1 < static_cast<std::size_t>(settings_.split_budget));
    for (const SiblingBound& half : *both) keep(half.cells, &half, mandatory ? node.depth : node.depth + 1);
    give_back(both);
  }
  counters.sub_patches += out.size() - first;
  for (std::size_t k = first; k < out.size(); ++k) count_effects(out[k].effects, counters);
}

void PatchSplitter::count_effects(std::uint8_t effects, FrontendCounters& counters) const {
  const scene::PosedDrawable& drawable = bounder_.drawable();
  const auto count = [&](SubPatchEffect effect, bool asked, std::uint64_t& runs, std::uint64_t& elided) {
    if ((effects & effect) != 0)
      ++runs;
    else if (asked)
      ++elided;
  };
  count(kEffectMotion, drawable.moving, counters.sub_patches_moving, counters.motion_elided);
  count(kEffectDefocus, frame_.projection.lens_scale != 0, counters.sub_patches_defocused, counters.defocus_elided);
  count(kEffectDisplacement, bounder_.displaced(), counters.sub_patches_displaced, counters.displacement_elided);
  count(kEffectAlphaTest, drawable.material->alpha_mode == scene::AlphaMode::kMask, counters.sub_patches_alpha_tested,
        counters.alpha_test_elided);
  if ((effects & kEffectBlending) != 0) ++counters.sub_patches_blended;
}

}  // namespace tessera::frontend
