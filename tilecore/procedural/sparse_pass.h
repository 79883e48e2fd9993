#pragma once

#include <vector>

#include "base/rect.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::tilecore {

// What the sparse pass says of one piece.
struct SparseResult {
  std::vector<ParameterCell> cells;
  SamplingCounters counters;
};

// Steps along one parameter so that half a step moves the image by at most half of `max_reach` (pixels), when the half
// of the cell moves it by at most `reach`.
std::uint16_t sample_steps(double reach, double max_reach, bool& clamped);

// The published sparse pass over one piece: a regular loop through the parameter domain, run on the SIMD array. A cell
// is what lies around a tuple; its place on screen is the tuple's, padded by the padding times the radius of its
// neighbourhood, and its rate follows from the distance to the neighbouring tuples along each parameter. Nothing is
// proved: what is thin or bends between the tuples is missed.
void run_published_pass(const scene::FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings,
                        int side, std::uint32_t drawable, std::uint32_t piece, SampleRegisters& registers,
                        SparseResult& out);

}  // namespace tessera::tilecore
