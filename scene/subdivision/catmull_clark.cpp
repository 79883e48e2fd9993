#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include "scene/subdivision/control_cage.h"
#include "scene/subdivision/limit_masks.h"
#include "scene/subdivision/refined_cage.h"

namespace tessera::scene::subdivision {
namespace {

// Values that OpenSubdiv and the masks sum up, in double precision: one rounding in the end.
struct PointSum {
  DVec3 value{0.0};
  void Clear() { value = DVec3(0.0); }
  void AddWithWeight(const PointSum& other, double weight) { value += other.value * weight; }
};

// Weights of joints, sorted by joint.
struct InfluenceSum {
  std::vector<std::pair<std::uint16_t, double>> weights;

  void Clear() { weights.clear(); }
  void AddWithWeight(const InfluenceSum& other, double weight) {
    if (weight == 0) return;
    for (const auto& [joint, w] : other.weights) {
      const auto at = std::lower_bound(weights.begin(), weights.end(), joint,
                                       [](const auto& entry, std::uint16_t j) { return entry.first < j; });
      if (at != weights.end() && at->first == joint)
        at->second += weight * w;
      else
        weights.insert(at, {joint, weight * w});
    }
  }
};

InfluenceSum as_sum(const SkinInfluence& influence) {
  InfluenceSum sum, one;
  for (std::size_t k = 0; k < 8; ++k) {
    one.weights = {{influence.joints[k], 1.0}};
    sum.AddWithWeight(one, static_cast<double>(influence.weights[k]));
  }
  return sum;
}

// The eight largest, renormalised. Masks of extraordinary points have a few negative weights; no joint repels.
SkinInfluence as_influence(InfluenceSum sum) {
  std::stable_sort(sum.weights.begin(), sum.weights.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  SkinInfluence out;
  double total = 0;
  std::size_t kept = 0;
  for (; kept < std::min<std::size_t>(8, sum.weights.size()) && sum.weights[kept].second > 0; ++kept)
    total += sum.weights[kept].second;
  for (std::size_t k = 0; k < kept; ++k) {
    out.joints[k] = sum.weights[k].first;
    out.weights[k] = static_cast<float>(sum.weights[k].second / total);
  }
  if (kept == 0) out.weights[0] = 1.0f;
  return out;
}

// One conversion: the masks, and where each patch's control points are.
class Conversion {
 public:
  Conversion(const Primitive& primitive, const ControlCage& cage, const CageRules& rules)
      : in_(primitive.vertices), cage_(cage), refined_(cage, rules), masks_(refined_.finest()) {}

  Vertices vertices() const {
    Vertices out;
    out.positions = points(in_.positions);
    for (const MorphTarget& target : in_.morph_targets) {
      MorphTarget& converted = out.morph_targets.emplace_back();
      if (!target.positions.empty()) converted.positions = points(target.positions);
    }
    if (!in_.influences.empty()) out.influences = influences();
    for (const std::vector<Vec2>& set : in_.texcoords) out.texcoords.push_back(set.empty() ? set : corners(set));
    if (!in_.colors.empty()) out.colors = corners(in_.colors);
    return out;
  }

 private:
  // Values of the cage's points -> of the control points of all patches.
  template <class Sum, class Value, class In, class Out>
  std::vector<Value> shared(const std::vector<Value>& values, const In& in, const Out& out) const {
    std::vector<Sum> sums;
    sums.reserve(cage_.point_vertex.size());
    for (const std::uint32_t v : cage_.point_vertex) sums.push_back(in(values[v]));
    sums = masks_.apply(refined_.refine(std::move(sums)));
    std::vector<Value> rounded;
    rounded.reserve(sums.size());
    for (Sum& sum : sums) rounded.push_back(out(sum));
    std::vector<Value> result;
    result.reserve(16 * static_cast<std::size_t>(refined_.patch_count()));
    for (int f = 0; f < refined_.patch_count(); ++f)
      for (const std::size_t point : masks_.patch(refined_.finest(), f)) result.push_back(rounded[point]);
    return result;
  }

  std::vector<Vec3> points(const std::vector<Vec3>& values) const {
    return shared<PointSum>(
        values, [](const Vec3& p) { return PointSum{DVec3(p)}; },
        [](const PointSum& s) {
          const Vec3 rounded(s.value);
          // Control points beside an extraordinary point may lie outside the hull of its neighbours.
          for (int axis = 0; axis < 3; ++axis)
            if (!std::isfinite(rounded[axis]))
              throw CageError("has coordinates too large for single precision once refined");
          return rounded;
        });
  }

  std::vector<SkinInfluence> influences() const {
    return shared<InfluenceSum>(in_.influences, as_sum, [](InfluenceSum& s) { return as_influence(std::move(s)); });
  }

  // Values of face corners, bilinear over each patch.
  template <class Value>
  std::vector<Value> corners(const std::vector<Value>& values) const {
    std::vector<Value> at_corners;
    at_corners.reserve(cage_.corner_vertex.size());
    for (const std::uint32_t v : cage_.corner_vertex) at_corners.push_back(values[v]);
    at_corners = refined_.refine_corners(std::move(at_corners));
    constexpr std::array<float, 4> kThirds = {0.0f, 1.0f / 3.0f, 2.0f / 3.0f, 1.0f};
    std::vector<Value> result;
    result.reserve(4 * at_corners.size());
    for (std::size_t c = 0; c < at_corners.size(); c += 4)
      for (const float v : kThirds)
        for (const float u : kThirds)
          result.push_back((at_corners[c] * (1.0f - u) + at_corners[c + 1] * u) * (1.0f - v) +
                           (at_corners[c + 3] * (1.0f - u) + at_corners[c + 2] * u) * v);
    return result;
  }

  const Vertices& in_;
  const ControlCage& cage_;
  RefinedCage refined_;
  LimitMasks masks_;
};

// Bytes that a patch needs during conversion: its share of the refined topology, of the masks (61 terms for a regular
// patch) and of the shared control points (9), and its own 16 control points. [measured] The first three take 1.5 kB on
// grids and 5 kB with skins of 20 joints: three quarters of the charge.
std::uint64_t bytes_per_patch(const Vertices& vertices) {
  std::uint64_t vertex = sizeof(Vec3) + vertices.texcoords.size() * sizeof(Vec2) +
                         vertices.colors.size() / std::max<std::size_t>(1, vertices.count()) * sizeof(Vec4);
  for (const MorphTarget& target : vertices.morph_targets) vertex += target.positions.empty() ? 0 : sizeof(Vec3);
  constexpr std::uint64_t kWorking = 2000,
                          kInfluenceWorking = 10 * (sizeof(InfluenceSum) + 12 * 16 + sizeof(SkinInfluence));
  if (!vertices.influences.empty()) vertex += sizeof(SkinInfluence);
  return 16 * vertex + kWorking + (vertices.influences.empty() ? 0 : kInfluenceWorking);
}

// Around a point of n edges each of the n control points beside it sums up 2 n + 1 points. The usual four edges are
// part of the charge per patch.
std::uint64_t edge_mask_terms(const ControlCage& cage) {
  std::vector<std::uint64_t> faces(cage.point_vertex.size(), 0);
  for (const int p : cage.face_points) ++faces[static_cast<std::size_t>(p)];
  std::uint64_t terms = 0;
  for (const std::uint64_t n : faces) terms += n > 4 ? (n + 1) * (2 * n + 1) : 0;
  return terms;
}

}  // namespace

Primitive convert(const Primitive& cage, const CageRules& rules, MemoryBudget& budget, const std::string& what) {
  budget.charge(cage.vertices.count(), 64, what);
  budget.charge(cage.indices.size(), 120, what);
  const ControlCage topology = build_cage(cage, rules);
  budget.charge(patch_count(topology, rules.levels), bytes_per_patch(cage.vertices), what);
  budget.charge(edge_mask_terms(topology), 16, what);
  Primitive out;
  out.kind = Primitive::Kind::kBezierPatches;
  out.material = cage.material;
  out.vertices = Conversion(cage, topology, rules).vertices();
  return out;
}

RefinedCage::RefinedCage(const ControlCage& cage, const CageRules& rules) {
  if (rules.levels == 0 && std::any_of(cage.face_sizes.begin(), cage.face_sizes.end(), [](int n) { return n != 4; }))
    throw CageError("has faces that are not quads; it needs at least one level of refinement");
  osd::TopologyDescriptor description;
  description.numVertices = static_cast<int>(cage.point_vertex.size());
  description.numFaces = static_cast<int>(cage.face_sizes.size());
  description.numVertsPerFace = cage.face_sizes.data();
  description.vertIndicesPerFace = cage.face_points.data();
  description.numCreases = static_cast<int>(cage.crease_sharpness.size());
  description.creaseVertexIndexPairs = cage.crease_points.data();
  description.creaseWeights = cage.crease_sharpness.data();
  description.numCorners = static_cast<int>(cage.corner_sharpness.size());
  description.cornerVertexIndices = cage.corner_points.data();
  description.cornerWeights = cage.corner_sharpness.data();

  using Options = OpenSubdiv::Sdc::Options;
  Options options;
  options.SetVtxBoundaryInterpolation(rules.boundary == BoundaryRule::kEdge ? Options::VTX_BOUNDARY_EDGE_ONLY
                                                                            : Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  using Factory = osd::TopologyRefinerFactory<osd::TopologyDescriptor>;
  refiner_.reset(Factory::Create(description, Factory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, options)));
  if (!refiner_) throw CageError("is refused by OpenSubdiv");
  osd::TopologyRefiner::UniformOptions uniform(rules.levels);
  uniform.fullTopologyInLastLevel = true;  // the limit masks walk around its points
  refiner_->RefineUniform(uniform);
  finest_ = refiner_->GetLevel(refiner_->GetMaxLevel());
}

std::uint64_t patch_count(const ControlCage& cage, int levels) {
  if (levels == 0) return cage.face_sizes.size();
  std::uint64_t faces = cage.face_points.size();  // the first step makes one quad for every corner
  for (int level = 1; level < levels; ++level) faces *= 4;
  return faces;
}

}  // namespace tessera::scene::subdivision
