#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/pack/draco_encoder.h"
#include "replay/pack/image_packer.h"
#include "replay/pack/procedures.h"
#include "replay/pack/surfaces.h"
#include "replay/view_options.h"
#include "scene/geometry_settings.h"

namespace tessera::replay {

enum class PackMethod { kAuto, kEdgebreaker, kSequential, kMeshopt, kNone };

struct PackOptions {
  // kAuto: sequential where the order of vertices matters, edgebreaker elsewhere. kMeshopt: EXT_meshopt_compression.
  PackMethod method = PackMethod::kAuto;
  QuantizationBits bits;  // of kMeshopt at most kMaxMeshoptBits each
  // With kMeshopt: positions and triangles are stored as clusters in this encoding (TESSERA_clusters), which is not
  // raw.
  std::optional<scene::GeometryEncoding> geometry;
  std::optional<WebpOptions> webp;
  // Members that replace members of the asset's TESSERA_capture extension; null: none.
  nlohmann::json capture_settings;
  // TESSERA_lens for every camera.
  std::optional<double> aperture_radius, focus_distance;
  // The scene and view that the result gets: its scene and its TESSERA_capture record them. A camera that frames the
  // scene, and its lens, become a camera of the file.
  ViewChoices view;
  SurfaceOptions surfaces;
  std::vector<ProcedureFile> procedures;
  bool strict = false;  // scene::CaptureLimits::strict, for the asset
};

struct PackReport {
  std::uint64_t bytes_in = 0, bytes_out = 0;  // all files of the asset / the .glb
  std::size_t primitives = 0, compressed = 0;
  std::size_t in_clusters = 0;  // number of primitives whose geometry is encoded, already in the asset or now
  std::size_t webp_images = 0;
  SurfaceReport surfaces;
  std::vector<std::string> notices;
};

// Reads a glTF asset, compresses its triangle primitives with Draco or meshoptimizer, attaches settings, and writes one
// .glb with everything inside (buffers, images). The result is read back before it is put in place.
//
//   - Positions move by at most half a step of their quantisation (largest drawn extent of the mesh / (2^bits - 1)), and
//     vertices in one place stay in one place (lattice.h); integers, morph targets, animations, matrices,
//     application-specific attributes, and normals that are no unit vectors stay exact.
//   - With meshoptimizer all other accessors are compressed without loss. Where nothing depends on their order, equal
//     vertices are joined, vertices and triangles are ordered for its codec, and triangles also in the order of clusters
//     (TESSERA_clusters), so that reading the capture need not search for them.
//   - With an encoding of geometry a primitive's positions and triangles lie in a stream of its clusters instead, where
//     nothing depends on their order and positions lie on a grid.
//   - Draco's sequential method is used where something depends on the order of vertices: Bezier patches, morph targets,
//     application-specific attributes. Data that a stream cannot hold stays as it is.
//   - Objects without data are kept word for word, unknown extensions included. An unknown extension that names accessors
//     or buffer views is refused, because these are renumbered.
//   - The same asset gives the same bytes, and packing a packed capture changes nothing.
//   - A missing or broken image that no texture samples becomes one white pixel, with a notice.
//
// Throws InputError for a bad asset, UsageError for options that do not fit it, WriteError when the target cannot be
// written; an existing file is then unchanged. A stream (base/output_file.h) is written through.
PackReport pack_capture(const std::filesystem::path& source, const std::filesystem::path& target,
                        const PackOptions& options);

}  // namespace tessera::replay
