#pragma once

#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Sizes of the records of base patches in memory, in bytes. Records lie back to back; each holds a header, positions,
// cells, and the further vertex attributes that its material reads.

// [assumed] The header holds material, pattern, neighbours and state.
inline constexpr std::uint64_t kPatchHeaderBytes = 32;

// The record that bounds and vertices follow from. It holds a header; positions, at both motion keys if they differ, or
// encoded by geometry.encoding; a cluster's cells; the texture coordinates of the corners of displaced patches; a
// procedure's numbers. `deforming`: positions at two keys.
std::uint64_t patch_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);
std::uint64_t patch_record_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming);

// Whether memory has room for positions at both keys, because vertices or a procedure's numbers may change by
// themselves.
bool keeps_two_keys(const scene::Assembly& assembly, const scene::Drawable& drawable);

// Number of positions, and of cells if they are encoded, that a decoder produces each time the record is read; 0 if
// memory holds floats.
std::uint64_t decoded_elements(const scene::Assembly& assembly, std::uint32_t patch);

// Bytes of a base patch that the front end reads to bound and cull it. Clusters whose vertices always rest have a
// separate bound record, back to back; units that need vertices read the full record. [assumed] A bound record has 56
// bytes: the aligned box (24), the cone (16), least height and edges of triangles (8), and material, state and sizes
// (8); 32 more for a turned box; and for masked materials 24 more: the box of texture coordinates and the least alpha.
// Other patches read their full record.
inline constexpr std::uint64_t kClusterBoundBytes = 56, kTurnedBoxBytes = 32, kClusterMaskBytes = 24;
std::uint64_t bound_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);
// The bound of a cluster whose vertices always rest; null for other patches.
const scene::ClusterBound* resting_bound(const scene::FrameGeometry& frame, std::uint32_t patch);

// Components that a vertex shader hands to the pixel shader besides the position: 3 for the point as seen from the
// camera and 3 for the normal unless the material is unlit, 4 for the tangent if the mesh has tangents and the material
// reads them, 2 for each set of texture coordinates that the material reads, and for vertex colours 3, or 4 if alpha
// counts [spec: the outputs of the vertex shader of Khronos's glTF Sample Viewer, which takes 9 for a tangent frame].
std::uint64_t vertex_components(const scene::Primitive& primitive, const scene::Material& material);

// Bytes of the attributes for the pixel shader alone. Clusters hold them for each vertex (at both motion keys if
// normals differ), with normals if the mesh has them; Bezier patches hold texture coordinates and colours of the four
// corners, as normals follow from positions.
std::uint64_t patch_attribute_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming);

// Bytes of a record that the pixel shader reads: all of it, or for a procedure the header and the numbers that a point
// needs.
std::uint64_t patch_shading_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);

}  // namespace tessera::frontend
