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

// The grids of powers of two to which packing rounds float values. They begin at zero, so the rounded value does not
// depend on the other values stored with it.
//
// Invariants (cited by the tests):
//   LT1  Drawn values move by at most half of extent / (2^bits - 1), or of a step of 24 bits with sign. The extent is
//        the range of the drawn values of a mesh; for colours, weights and tangents it is the largest size of a value.
//   LT2  Vertices that lie in one place of the world at rest lie in one place after packing.
//   LT3  Undrawn values make no grid coarser: vertices that no triangle names, triangles without area.
class Lattices {
 public:
  // `capture` was read from `document`.
  Lattices(scene::gltf::Document& document, const scene::Capture& capture, const QuantizationBits& bits);

  // Rounds a float attribute of a primitive of `mesh` to its grid, and sets the grid's exponent in it; the encoder
  // quantises normals. Values without a grid stay exact. Integers are left alone.
  void apply(std::size_t mesh, DracoAttribute& attribute) const;

 private:
  struct Extent {
    int step = 127;       // the exponent for the requested bits
    int mantissa = -100;  // the least exponent with which drawn values have 24 bits
  };
  void measure(scene::gltf::Document& document, const nlohmann::json& primitive, bool deforms, std::size_t mesh,
               const QuantizationBits& bits);
  void join_touching(scene::gltf::Document& document, const scene::Capture& capture);
  std::size_t group_of(std::size_t mesh) const;

  std::vector<std::size_t> parents_;                                         // meshes that touch, as a forest
  std::map<std::pair<std::size_t, std::string>, Extent> extents_;            // by mesh and attribute
  std::map<std::pair<std::size_t, std::string>, std::optional<int>> grids_;  // by group and attribute
};

}  // namespace tessera::replay
