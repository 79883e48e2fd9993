#include "scene/position_lattice.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "scene/animation.h"
#include "scene/pose.h"

namespace tessera::scene {
namespace {

constexpr int kLeastExponent = -126;

double rounded(float coordinate, int exponent) {
  return std::nearbyint(std::ldexp(static_cast<double>(coordinate), -exponent));
}

struct Box {
  Vec3 low{std::numeric_limits<float>::infinity()}, high{-std::numeric_limits<float>::infinity()};

  void add(const Vec3& p) { low = glm::min(low, p), high = glm::max(high, p); }
  void add(const Box& box) { low = glm::min(low, box.low), high = glm::max(high, box.high); }
  bool empty() const { return low.x > high.x; }
};

// Sets of meshes that share a lattice, as a forest.
class MeshSets {
 public:
  explicit MeshSets(std::size_t meshes) : parent_(meshes) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t of(std::size_t mesh) {
    while (parent_[mesh] != mesh) mesh = parent_[mesh] = parent_[parent_[mesh]];
    return mesh;
  }
  void join(std::size_t a, std::size_t b) { parent_[of(b)] = of(a); }

 private:
  std::vector<std::size_t> parent_;
};

// Calls visit(position) for all vertices whose encoded positions the memory may hold. Vertices that no triangle has are
// left out: they need not be finite.
template <class Visit>
void visit_positions(const Mesh& mesh, const Visit& visit) {
  for (const Primitive& primitive : mesh.primitives) {
    const std::vector<Vec3>& positions = primitive.vertices.positions;
    if (!rests_always(primitive)) continue;
    if (primitive.kind == Primitive::Kind::kBezierPatches)
      for (const Vec3& position : positions) visit(position);
    else
      for (const std::uint32_t vertex : primitive.indices) visit(positions[vertex]);
  }
}

using Words = std::array<std::uint32_t, 3>;
Words words_of(const Vec3& p) {
  const auto word = [](float f) { return std::bit_cast<std::uint32_t>(f + 0.0f); };  // -0 and 0 are one place
  return {word(p.x), word(p.y), word(p.z)};
}

void join_that_touch(const Capture& capture, const std::vector<std::size_t>& meshes, MeshSets& sets) {
  std::vector<std::pair<Words, std::size_t>> points;
  for (const std::size_t mesh : meshes)
    visit_positions(capture.meshes[mesh], [&](const Vec3& p) { points.emplace_back(words_of(p), mesh); });
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (std::size_t k = 1; k < points.size(); ++k)
    if (points[k].first == points[k - 1].first) sets.join(points[k - 1].second, points[k].second);
}

}  // namespace

LatticePoint PositionLattice::place(const Vec3& position) const {
  LatticePoint out;
  for (int axis = 0; axis < 3; ++axis) {
    double k = rounded(position[axis], exponent);
    if (!std::isfinite(static_cast<float>(std::ldexp(k, exponent)))) k -= std::copysign(1.0, k);
    out[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(k);
  }
  return out;
}

Vec3 PositionLattice::point(const LatticePoint& place) const {
  const auto coordinate = [&](std::size_t axis) { return std::ldexp(static_cast<float>(place[axis]), exponent); };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

PositionLattice make_lattice(const Vec3& low, const Vec3& high, int bits, int place_bits) {
  const double limit = std::ldexp(1.0, bits) - 1;
  double largest = 0, extent = 0;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::abs(static_cast<double>(low[axis])), std::abs(static_cast<double>(high[axis]))});
    extent = std::max(extent, static_cast<double>(high[axis]) - static_cast<double>(low[axis]));
  }
  PositionLattice lattice;
  lattice.exponent = kLeastExponent;
  if (largest > 0) lattice.exponent = std::max(lattice.exponent, std::ilogb(largest) - (place_bits - 1));
  if (extent > 0) lattice.exponent = std::max(lattice.exponent, std::ilogb(extent) - bits);
  const auto fits = [&] {
    for (int axis = 0; axis < 3; ++axis)
      if (rounded(high[axis], lattice.exponent) - rounded(low[axis], lattice.exponent) > limit) return false;
    return true;
  };
  while (!fits()) ++lattice.exponent;
  lattice.origin = lattice.place(low);
  return lattice;
}

bool rests_always(const Primitive& primitive) {
  return primitive.wire == Primitive::Wire::kSurface && primitive.vertices.influences.empty() &&
         primitive.vertices.morph_targets.empty();
}

std::vector<PositionLattice> mesh_lattices(const Capture& capture, const GeometrySettings& settings) {
  const int place_bits = settings.encoding == GeometryEncoding::kDgf ? kDgfPlaceBits : kPlaceBits;
  std::vector<Box> boxes(capture.meshes.size());
  for (std::size_t m = 0; m < boxes.size(); ++m)
    visit_positions(capture.meshes[m], [&](const Vec3& p) { boxes[m].add(p); });
  using Matrix = std::array<std::uint64_t, 16>;
  std::map<Matrix, std::vector<std::size_t>> together;
  const Pose rest = pose_at(capture, 0.0);
  for (std::size_t n = 0; n < capture.nodes.size(); ++n) {
    const int mesh = capture.nodes[n].mesh;
    if (mesh == kNone || !rest.in_scene[n] || boxes[static_cast<std::size_t>(mesh)].empty()) continue;
    Matrix matrix;
    std::memcpy(matrix.data(), &rest.world[n][0].x, sizeof matrix);
    std::vector<std::size_t>& meshes = together[matrix];
    if (std::find(meshes.begin(), meshes.end(), static_cast<std::size_t>(mesh)) == meshes.end())
      meshes.push_back(static_cast<std::size_t>(mesh));
  }
  MeshSets sets(boxes.size());
  for (const auto& [matrix, meshes] : together)
    if (meshes.size() > 1) join_that_touch(capture, meshes, sets);
  std::vector<Box> shared(boxes.size());
  for (std::size_t m = 0; m < boxes.size(); ++m) shared[sets.of(m)].add(boxes[m]);
  std::vector<PositionLattice> lattices(boxes.size());
  for (std::size_t m = 0; m < boxes.size(); ++m)
    if (const Box& box = shared[sets.of(m)]; !box.empty())
      lattices[m] = make_lattice(box.low, box.high, settings.bits, place_bits);
  return lattices;
}

}  // namespace tessera::scene
