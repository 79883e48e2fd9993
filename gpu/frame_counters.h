#pragma once

#include "binner/parameter_buffer.h"
#include "frontend/front_end.h"
#include "gpu/input_signatures.h"
#include "memory/l2.h"
#include "memory/ledger.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// All counters of one frame, or of several.
struct FrameCounters : tilecore::CoreCounters {
  frontend::FrontendCounters frontend;
  frontend::InstanceCounters instances;
  frontend::PatchGroupCounters groups;
  frontend::PreviousDepthCounters previous_depth;
  binner::BinnerCounters binner;
  tilecore::TessellationCounters tessellation;
  memory::L2Counters l2;
  EliminationCounters elimination;
  memory::Ledger ledger;

  // Joins the counters of a further frame into a total.
  void accumulate(const FrameCounters& frame);
  // Adds the counters of another view of the same frame.
  void merge(const FrameCounters& view);
  // Returns the frame's counts since `before`, an earlier state of it; peaks keep their values.
  FrameCounters since(const FrameCounters& before) const;
};

// Calls visit(a's, b's) for each counter struct.
template <class A, class B, class Visit>
void for_each_counter_struct(A& a, B& b, const Visit& visit) {
  visit(a.frontend, b.frontend);
  visit(a.instances, b.instances);
  visit(a.groups, b.groups);
  visit(a.previous_depth, b.previous_depth);
  visit(a.binner, b.binner);
  visit(a.tessellation, b.tessellation);
  tilecore::for_each_unit(a, b, visit);
  visit(a.l2, b.l2);
  visit(a.elimination, b.elimination);
}

}  // namespace tessera::gpu
