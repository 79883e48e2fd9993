#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "replay/pack/draco_encoder.h"
#include "scene/capture.h"
#include "scene/gltf/document.h"

namespace tessera::replay {

// The grids of powers of two on which packing puts float values. They begin at zero, so a value lies where it lies
// whatever it is stored with.
//
// Invariants (cited by the tests):
//   LT1  Drawn values move by at most half of extent / (2^bits - 1), or of what 24 bits with sign can tell apart: extent
//        is that of the drawn values of a mesh, and of colours, weights and tangents the largest size of one.
//   LT2  Vertices that lie in one place of the world at rest lie in one place after packing.
//   LT3  What nobody draws makes no grid coarser: vertices that no triangle names, triangles without area.
class Lattices {
 public:
  // `capture` is what `document` reads as.
  Lattices(scene::gltf::Document& document, const scene::Capture& capture, const QuantizationBits& bits);

  // Puts a float attribute of a primitive of `mesh` on its grid, and says so in it; normals stay for the encoder. What
  // has no grid stays exact. Integers are left alone.
  void apply(std::size_t mesh, DracoAttribute& attribute) const;

 private:
  struct Extent {
    int step = 127;       // the exponent that the bits ask for
    int mantissa = -100;  // the least exponent with which drawn values have 24 bits
  };
  void measure(scene::gltf::Document& document, const nlohmann::json& primitive, bool deforms, std::size_t mesh,
               const QuantizationBits& bits);
  void join_touching(scene::gltf::Document& document, const scene::Capture& capture);
  std::size_t group_of(std::size_t mesh) const;

  std::vector<std::size_t> parents_;                                         // of meshes that touch, as a forest
  std::map<std::pair<std::size_t, std::string>, Extent> extents_;            // by mesh and attribute
  std::map<std::pair<std::size_t, std::string>, std::optional<int>> grids_;  // by group and attribute
};

}  // namespace tessera::replay
