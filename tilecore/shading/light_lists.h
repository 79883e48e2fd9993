#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/counter.h"
#include "base/vec.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/shading_settings.h"
#include "timing/items.h"

namespace tessera::tilecore {

// Light lists (shading.light_lists): a core finds the lights that reach the surfaces of a tile, and its pixel shaders
// loop over these alone. Visibility comes first on this machine, so the surfaces are known: a box around them, whose
// third axis is the ray through the tile's middle, is the tile's frustum cut off at its nearest and farthest depth.
//
// Invariants (cited by the tests):
//   LL1  A light that is not in the list adds exactly 0 at every place in the box, at every time of the shutter: images have
//        the same bits as without lists.
//   LL2  A list has the order of the frame's lights.
//   LL3  A frame without the lights that the setting needs is rendered, counted and timed as with `off`.
//   LL4  Every light is tested once for each list, and every place is in the box of its list.

struct LightListCounters {
  std::uint64_t lists = 0;
  std::uint64_t places = 0;
  std::uint64_t tests = 0;
  std::uint64_t listed = 0;
  std::uint64_t warps = 0;
  std::uint64_t tile_bytes = 0;
};

// Bytes of a light's record in memory at one time; a light that may move has two: its colour, place, direction, range and
// the cosines of its cones.
inline constexpr std::uint64_t kLightRecordBytes = 48;

// Whether tiles of a frame have lists.
bool has_light_lists(const scene::FrameGeometry& frame, LightLists setting);
// Bytes of the records of a frame's lights.
std::uint64_t light_record_bytes(const scene::FrameGeometry& frame);
// Room for records of lights in memory, for all frames of a scene; 0 if no frame has lists.
std::uint64_t light_table_bytes(const scene::Assembly& assembly, LightLists setting);

// The reach of a light over the shutter: a sphere, and a cone if neither its place nor its cone moves.
struct LightBound {
  DVec3 center{0.0};
  double radius = std::numeric_limits<double>::infinity();  // infinity: everywhere
  bool has_cone = false;
  DVec3 direction{0.0};  // from the centre
  double cosine = 0, sine = 0;

  static LightBound of(const scene::FrameGeometry& frame, std::size_t light);
};

// A box around places in world space.
class PlaceBox {
 public:
  // `axis`: the direction of the third axis; any length but 0.
  explicit PlaceBox(const Vec3& axis);

  void add(const Vec3& place);
  // Whether some place of the box may lie within the reach.
  bool meets(const LightBound& bound) const;

 private:
  std::array<DVec3, 3> axes_;
  DVec3 low_{std::numeric_limits<double>::infinity()}, high_{-std::numeric_limits<double>::infinity()};
  bool everywhere_ = false;  // a place is not finite
};

// The list of a tile.
class LightList {
 public:
  // begin() starts a list; find() finds the lights that meet the box around all places added since.
  void begin(const Vec3& axis) { box_ = PlaceBox(axis), places_ = 0; }
  void add(const Vec3& place) { box_.add(place), ++places_; }
  void find(const scene::FrameGeometry& frame);

  std::uint64_t places() const { return places_; }
  // Numbers of lights, rising.
  std::span<const std::uint32_t> numbers() const { return numbers_; }

 private:
  PlaceBox box_{Vec3(0, 0, 1)};
  std::uint64_t places_ = 0;
  std::vector<std::uint32_t> numbers_;
};

// Warps that make a list: one lane for each place, then one for each light. `moving`: places have two motion keys.
// [assumed] Clocks of a lane are derived in docs/passes.md; registers are a shader's minimum.
timing::WarpItem place_warp(bool moving);
timing::WarpItem light_test_warp();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::LightListCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::LightListCounters> = std::to_array<
    CounterField<tilecore::LightListCounters>>({
    {"lights.lists", &tilecore::LightListCounters::lists, Combine::kSum, "lists",
     "Light lists that cores made: one for each tile that shades a lit surface, a second one where desampling shades "
     "skipped pixels after all.",
     ""},
    {"lights.places", &tilecore::LightListCounters::places, Combine::kSum, "places",
     "Pixel-shader invocations at whose places lists were made.", ""},
    {"lights.tests", &tilecore::LightListCounters::tests, Combine::kSum, "tests",
     "Lights whose reach was compared with the surfaces of a tile.", ""},
    {"lights.listed", &tilecore::LightListCounters::listed, Combine::kSum, "entries",
     "Entries of the lists: lights that reach the surfaces of a tile.", ""},
    {"lights.warps", &tilecore::LightListCounters::warps, Combine::kSum, "warps",
     "Warps that made the lists, beside the pixel shader's.", ""},
    {"lights.tile_bytes", &tilecore::LightListCounters::tile_bytes, Combine::kSum, "bytes",
     "Bytes of the tile memory that making and reading lists moved: corners of the triangles at the places, and "
     "records of listed lights, written once and read by every warp.",
     ""},
});
TESSERA_COUNTERS_COVER(tilecore::LightListCounters);

}  // namespace tessera
