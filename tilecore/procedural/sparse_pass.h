#pragma once

#include <vector>

#include "base/rect.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::tilecore {

// What the sparse pass says of one piece.
struct SparseResult {
  std::vector<ParameterCell> cells;
  std::vector<frontend::BoundedSubPatch> sub_patches;  // of these
  SamplingCounters counters;
};

// Appends a cell and its sub-patch. `box`: of its points in object space; null: not known, its rectangle on screen says
// all. `grow`: pixels around the box's projections that hold what is drawn.
void keep_cell(const scene::FrameGeometry& frame, const ProcedureSettings& settings, ParameterCell cell, float far_z,
               bool crosses_near, const frontend::MovingBox* box, double grow, SparseResult& out);

// The published sparse pass over one piece: a regular loop through the parameter domain, run on the SIMD array. A cell
// is what lies around a tuple; its place on screen is the tuple's, padded by the padding times the radius of its
// neighbourhood, and its rate follows from the distance to the neighbouring tuples along each parameter. Nothing is
// proved: what is thin or bends between the tuples is missed.
void run_published_pass(const scene::FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings,
                        int side, std::uint32_t drawable, std::uint32_t piece, SampleRegisters& registers,
                        SparseResult& out);

}  // namespace tessera::tilecore
