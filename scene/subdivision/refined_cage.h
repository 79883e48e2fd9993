#pragma once

#include <memory>
#include <vector>

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyRefiner.h>

#include "scene/subdivision/control_cage.h"

namespace tessera::scene::subdivision {

namespace osd = OpenSubdiv::Far;

// A control cage refined uniformly by OpenSubdiv: the same number of steps everywhere, so that no face meets two
// smaller ones along an edge (no T-junctions).
class RefinedCage {
 public:
  // Throws CageError for a cage with triangles when rules.levels is 0: only a step of refinement makes all faces quads.
  RefinedCage(const ControlCage& cage, const CageRules& rules);

  const osd::TopologyLevel& finest() const { return finest_; }
  int patch_count() const { return finest_.GetNumFaces(); }

  // Computes values at the finest level's points from values at the cage's points, by the rules of Catmull and Clark. T
  // has Clear() and AddWithWeight(const T&, double).
  template <class T>
  std::vector<T> refine(std::vector<T> values) const {
    const osd::PrimvarRefinerReal<double> refiner(*refiner_);
    for (int level = 1; level <= refiner_->GetMaxLevel(); ++level) {
      std::vector<T> finer(static_cast<std::size_t>(refiner_->GetLevel(level).GetNumVertices()));
      refiner.Interpolate(level, values, finer);
      values = std::move(finer);
    }
    return values;
  }

  // Computes values at the corners of the finest faces, four each, from values at the corners of the cage's faces:
  // linear along sides and bilinear inside. A face of the cage never affects another one's values.
  template <class T>
  std::vector<T> refine_corners(std::vector<T> values) const {
    for (int level = 0; level < refiner_->GetMaxLevel(); ++level) values = split_corners(level, values);
    return values;
  }

 private:
  template <class T>
  std::vector<T> split_corners(int level, const std::vector<T>& values) const {
    const osd::TopologyLevel& coarse = refiner_->GetLevel(level);
    const osd::TopologyLevel& fine = refiner_->GetLevel(level + 1);
    std::vector<T> out(4 * static_cast<std::size_t>(fine.GetNumFaces()));
    std::size_t first = 0;
    for (int f = 0; f < coarse.GetNumFaces(); ++f) {
      const osd::ConstIndexArray points = coarse.GetFaceVertices(f), edges = coarse.GetFaceEdges(f),
                                 children = coarse.GetFaceChildFaces(f);
      const auto n = static_cast<std::size_t>(points.size());
      T middle{};
      for (std::size_t k = 0; k < n; ++k) middle = middle + values[first + k] * (1.0f / static_cast<float>(n));
      for (int c = 0; c < children.size(); ++c) {
        const osd::ConstIndexArray child = fine.GetFaceVertices(children[c]);
        for (int j = 0; j < 4; ++j) {
          T& value = out[4 * static_cast<std::size_t>(children[c]) + static_cast<std::size_t>(j)];
          value = middle;
          for (std::size_t k = 0; k < n; ++k) {
            const auto i = static_cast<int>(k);
            if (child[j] == coarse.GetVertexChildVertex(points[i]))
              value = values[first + k];
            else if (child[j] == coarse.GetEdgeChildVertex(edges[i]))
              value = (values[first + k] + values[first + (k + 1) % n]) * 0.5f;
          }
        }
      }
      first += n;
    }
    return out;
  }

  std::unique_ptr<osd::TopologyRefiner> refiner_;
  osd::TopologyLevel finest_;
};

// Number of faces of the finest level, known before anything is refined.
std::uint64_t patch_count(const ControlCage& cage, int levels);

}  // namespace tessera::scene::subdivision
