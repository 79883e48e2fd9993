#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "replay/pack/draco_encoder.h"
#include "replay/pack/surfaces.h"

namespace tessera::replay {

enum class PackMethod { kAuto, kEdgebreaker, kSequential, kNone };

struct PackOptions {
  // kAuto: sequential where the order of vertices matters (Bezier patches, cages, morph targets), edgebreaker elsewhere.
  PackMethod method = PackMethod::kAuto;
  QuantizationBits bits;
  // Members that replace those of the asset's TESSERA_capture extension; null: none.
  nlohmann::json capture_settings;
  // TESSERA_lens for every camera.
  std::optional<double> aperture_radius, focus_distance;
  SurfaceOptions surfaces;
};

struct PackReport {
  std::uint64_t bytes_in = 0, bytes_out = 0;  // all files of the asset / the .glb
  std::size_t primitives = 0, compressed = 0;
  SurfaceReport surfaces;
};

// Reads a glTF asset, compresses its triangle primitives with Draco, attaches settings, and writes one .glb with
// everything inside (buffers, images). What glTF objects Tessera does not know is kept. The result is read back before
// it is put in place. Throws InputError for a bad asset, SystemError when the target cannot be written.
PackReport pack_capture(const std::filesystem::path& source, const std::filesystem::path& target, const PackOptions& options);

}  // namespace tessera::replay
