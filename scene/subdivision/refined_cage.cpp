#include "scene/subdivision/refined_cage.h"

#include <algorithm>

#include <fmt/format.h>
#include <opensubdiv/far/topologyDescriptor.h>

namespace tessera::scene::subdivision {

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
