#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::tilecore {

// How the sampling controller works; keys procedures.*.
struct ProcedureSettings {
  enum class Path : std::uint8_t {
    kSampled,      // by the sampling controller
    kTessellated,  // as ordinary patches whose vertices the procedure evaluates
  };
  enum class Maps : std::uint8_t {
    kInterval,   // cells of the parameter domain bounded by interval evaluation: conservative by proof
    kPublished,  // US 2007/0002066: the cell's middle is evaluated, its neighbours give a radius, the radius is padded
                 // by a guess
  };
  enum class Scatter : std::uint8_t {
    kFootprint,  // a sample reaches the tile buffer's sample points inside its footprint: half a step to each side, by
                 // its derivatives
    kPoint,      // as published: a sample is written to the sub-pixel that it falls into
  };
  enum class Style : std::uint8_t { kSurface, kLines };
  enum class Lists : std::uint8_t {
    kCells,   // of a piece a tile knows the cells that it may see
    kRanges,  // as published for comparison: one range of u and v that holds them all
  };
  enum class Crossing : std::uint8_t {
    kEvaluated,  // every tile evaluates the samples whose footprints may reach it
    kLost,       // as published: a sample is evaluated by the tile of its middle alone; what falls outside is lost
    kHanded,     // by that tile alone, which hands it to the others through memory
  };
  enum class ImageReads : std::uint8_t { kL2, kTextureCache };
  Path path = Path::kSampled;
  Maps maps = Maps::kInterval;
  Scatter scatter = Scatter::kFootprint;
  Style style = Style::kSurface;
  Lists lists = Lists::kCells;
  Crossing crossing = Crossing::kEvaluated;
  ImageReads image_reads = ImageReads::kL2;
  double spacing = 4;         // sub-pixels: no sample is farther than this from its footprint's sides, along x or y
  double flatness = 0.0625;   // pixels that a smooth surface may leave the plane of a sample's footprint
  double cell_pixels = 28;    // interval maps: cells larger than this on screen are halved
  double padding = 0.5;       // published maps: padding of a cell's place on screen, in its radius
  double sparse_spacing = 2;  // published maps: sub-pixels between the tuples of the sparse pass
  bool refill = false;        // look for holes inside each tile and sample them again
  int lanes = 32;             // of the emulated SIMD array [assumed]
};
Keys<ProcedureSettings> procedure_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Path> = std::to_array<std::string_view>({"sampled",
                                                                                                       "tessellated"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Maps> = std::to_array<std::string_view>({"interval",
                                                                                                       "published"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Scatter> = std::to_array<std::string_view>({"footprint",
                                                                                                          "point"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Lists> = std::to_array<std::string_view>({"cells",
                                                                                                        "ranges"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Crossing> =
    std::to_array<std::string_view>({"evaluated", "lost", "handed"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::ImageReads> =
    std::to_array<std::string_view>({"l2", "texture_cache"});
template <>
inline constexpr auto kEnumWords<tilecore::ProcedureSettings::Style> = std::to_array<std::string_view>({"surface",
                                                                                                        "lines"});

}  // namespace tessera
