#pragma once

#include <cstdint>

#include "scene/assembly.h"

namespace tessera::scene {

// Finds the drawable of a patch, for loops over patches most of which share a drawable with the previous one: the range
// of patches is kept from call to call.
class DrawableLookup {
 public:
  std::uint32_t operator()(const Assembly& assembly, std::uint32_t patch) {
    if (patch - first_ >= count_ || &assembly != assembly_) {
      assembly_ = &assembly;
      number_ = assembly.patch_drawable[patch];
      first_ = assembly.drawables[number_].first_patch, count_ = assembly.drawables[number_].patch_count;
    }
    return number_;
  }
  // Forgets the range, where another assembly may be at the same address.
  void forget() { assembly_ = nullptr; }

 private:
  const Assembly* assembly_ = nullptr;
  std::uint32_t first_ = 0, count_ = 0, number_ = 0;
};

}  // namespace tessera::scene
