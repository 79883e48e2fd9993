#pragma once

#include <vector>

#include "captures/sources/asset.h"

namespace tessera::captures {

// Materials of buildings. Walls and slates are displaced; `panes` is an atlas of 4 x 2 windows and doors, displaced by their frames.
struct FacadeMaterials {
  int wall, side, trim, panes, slate, awning;
};

// A terraced building with a number of bays, and of floors above its ground floor. Lengths are in metres.
struct FacadeStyle {
  int bays, floors;
  float bay, floor, ground;
  float window_width, window_height, sill;  // the sill's height above its floor
  float recess;                             // depth of panes behind the wall
  float depth;
  int door;      // bay of the door
  bool shop;     // a shop window with an awning beside the door
  bool mansard;  // steep slates instead of a parapet
  unsigned seed;

  float width() const { return static_cast<float>(bays) * bay; }
  float height() const { return ground + static_cast<float>(floors) * floor + 0.7f; }
};

// The building's front lies in the plane z = 0 and faces +z, x in [0, width()], y in [0, height()]; single-sided.
std::vector<Part> terraced_building(const FacadeStyle& style, const FacadeMaterials& materials);

// A plain tower on the ground, centred, its front and back facing along z; one patch for each bay and floor. Texture
// coordinates are 1 per bay and floor.
Geometry tower(int bays_x, int bays_z, int floors, float bay, float floor);

}  // namespace tessera::captures
