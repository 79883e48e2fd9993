#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::scene {

// How the emulated memory keeps the positions of surfaces whose vertices rest: as the floats of the file; as integers on a
// grid that the capture's parts share; with as few bits as each record's box needs, and a code for the triangles of
// clusters (scene/geometry_record.h); or clusters as blocks of AMD's Dense Geometry Format (scene/dgf_block.h).
enum class GeometryEncoding : std::uint8_t { kRaw, kQuantised, kMeshlet, kDgf };

// Keys geometry.*.
struct GeometrySettings {
  GeometryEncoding encoding = GeometryEncoding::kRaw;
  int bits = 16;

  bool raw() const { return encoding == GeometryEncoding::kRaw; }
  auto operator<=>(const GeometrySettings&) const = default;
};
Keys<GeometrySettings> geometry_keys();

}  // namespace tessera::scene

namespace tessera {

template <>
inline constexpr auto kEnumWords<scene::GeometryEncoding> = std::to_array<std::string_view>({"raw", "quantised",
                                                                                             "meshlet", "dgf"});

}  // namespace tessera
