#pragma once

#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::frontend {

// What a base patch takes in memory, in bytes: one record behind the other, each a header, positions, cells, and then
// what else its material reads of its vertices.

// [assumed] material, pattern, neighbours, state
inline constexpr std::uint64_t kPatchHeaderBytes = 32;

// The record that bounds and vertices follow from. It holds a header; positions, at both motion keys where they differ, or
// encoded as geometry.encoding says; a cluster's cells; the texture coordinates of the corners of displaced patches; a
// procedure's numbers. `deforming`: positions at two keys.
std::uint64_t patch_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);
std::uint64_t patch_record_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming);

// Whether memory has room for positions at both keys: vertices, or a procedure's numbers, that may move by themselves.
bool keeps_two_keys(const scene::Assembly& assembly, const scene::Drawable& drawable);

// A decoder gives so many positions, and cells where those are coded, each time the record is read; none where the memory
// holds floats.
std::uint64_t decoded_elements(const scene::Assembly& assembly, std::uint32_t patch);

// What the front end reads of a base patch to bound and cull it. Clusters whose vertices rest always have a record of its
// own for that, one behind the other: their record proper is for units that need vertices. [assumed] 56 bytes: the aligned
// box (24), the cone (16), least height and edges of triangles (8), and material, state and sizes (8); 32 more for a box
// that is turned, and of masked materials 24, the box of texture coordinates and the least alpha. Of everything else the
// record proper.
inline constexpr std::uint64_t kClusterBoundBytes = 56, kTurnedBoxBytes = 32, kClusterMaskBytes = 24;
std::uint64_t bound_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);
// Of a cluster whose vertices rest always; else null.
const scene::ClusterBound* resting_bound(const scene::FrameGeometry& frame, std::uint32_t patch);

// Components that a vertex shader hands to the pixel shader besides the position: 3 of the point as seen from the camera
// and 3 of the normal unless the material is unlit, 4 of the tangent where the mesh has tangents and the material reads
// them, 2 for each set of texture coordinates that the material reads, and of vertex colours 3, or 4 where alpha counts
// [spec: what the vertex shader of Khronos's glTF Sample Viewer hands over, which takes 9 for a tangent frame].
std::uint64_t vertex_components(const scene::Primitive& primitive, const scene::Material& material);

// What records hold for the pixel shader alone: of clusters that for each vertex (at both motion keys where normals
// differ), normals where the mesh has them; of Bezier patches texture coordinates and colours of the four corners, as
// normals follow from positions.
std::uint64_t patch_attribute_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming);

// What the pixel shader reads of a record: all of it, of a procedure the header and what a point needs.
std::uint64_t patch_shading_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);

}  // namespace tessera::frontend
