#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::tilecore {

// Settings of the sampling controller; keys procedures.*.
struct ProcedureSettings {
  enum class Path : std::uint8_t {
    kSampled,      // by the sampling controller
    kTessellated,  // as ordinary patches whose vertices the procedure evaluates
  };
  enum class Mode : std::uint8_t {
    // Cells of the parameter domain are bounded by interval evaluation, which is conservative by proof. A sample reaches
    // the tile buffer's sample points inside its footprint: half a step to each side, by its derivatives.
    kInterval,
    // US 2007/0002066: the cell's middle is evaluated, its neighbours give a radius, and a guess pads the radius. A
    // sample is written to the sub-pixel that holds it (surfaces that move or are out of focus still use footprints,
    // which the publication leaves open), and geometry images are read through the core's texture cache.
    kPublished,
  };
  enum class Style : std::uint8_t { kSurface, kLines };
  Path path = Path::kSampled;
  Mode mode = Mode::kInterval;
  Style style = Style::kSurface;
  double spacing = 4;         // sub-pixels: no sample is farther than this from its footprint's sides, along x or y
  double flatness = 0.0625;   // pixels that a smooth surface may leave the plane of a sample's footprint
  double cell_pixels = 28;    // interval mode: cells larger than this on screen are halved
  double padding = 0.5;       // published mode: padding of a cell's place on screen, in its radius
  double sparse_spacing = 2;  // published mode: sub-pixels between the tuples of the sparse pass
};
Keys<ProcedureSettings> procedure_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Path> = std::to_array<std::string_view>({"sampled",
                                                                                                       "tessellated"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Mode> = std::to_array<std::string_view>({"interval",
                                                                                                       "published"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Style> = std::to_array<std::string_view>({"surface",
                                                                                                        "lines"});

}  // namespace tessera
