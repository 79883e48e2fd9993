#pragma once

#include <vector>

#include "base/rect.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::tilecore {

// Result of the sparse pass for one piece.
struct SparseResult {
  std::vector<ParameterCell> cells;
  std::vector<frontend::BoundedSubPatch> sub_patches;  // of the cells
  SamplingCounters counters;
};

// Appends a cell and its sub-patch. `box`: of its points in object space; nullptr: unknown, so that only its rectangle
// on screen bounds it. `grow`: everything drawn lies within this many pixels of the box's projections.
void keep_cell(const scene::FrameGeometry& frame, const ProcedureSettings& settings, ParameterCell cell, float far_z,
               bool crosses_near, const frontend::MovingBox* box, double grow, SparseResult& out);

// The published sparse pass over one piece: a regular loop through the parameter domain, run on the SIMD array. A cell
// is the surroundings of a tuple. Its place on screen is the tuple's, padded by the padding times the radius of its
// neighbourhood, and its rate follows from the distance to the neighbouring tuples along each parameter. The method
// proves nothing: it misses features that are thin or bend between the tuples.
void run_published_pass(const scene::FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings,
                        int side, std::uint32_t drawable, std::uint32_t piece, SampleRegisters& registers,
                        SparseResult& out);

}  // namespace tessera::tilecore
