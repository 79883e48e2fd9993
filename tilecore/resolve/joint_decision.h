#pragma once

#include <span>

#include "tilecore/resolve/rate_selector.h"
#include "tilecore/resolve/velocity_buffer.h"

namespace tessera::tilecore {

// What is known of a block of 8x8 or 16x16 pixels from the blocks of 4x4 in it: US 2015/0379692 [0028] makes decisions for
// "a 4x4 block of pixels, 16x16, or other size". Decisions alone are made for larger blocks; what is shaded in them goes
// by patterns of 4x4, which stay evenly spaced whatever the size (deviation: [0060] also has sparser squares in larger
// blocks, which no stencil of 5x5 could fill).
//
// Whatever forbids a rate in one of them forbids it in all:
//   edge, cut               one has it
//   outline                 one has it, and all with an edge have it: an edge that is none forbids
//   still, velocity usable, advection allowed: all
//   blur, blurred speed, foveation's limit: the least
//   contrast                the largest
//   speed                   of all their pixels by `statistic`: mean of means, max of max, min of min; of medians the median
//
// `parts`: those that see something, one at least; in raster order. last_samples is the first one's: it was the same for
// all.
//
// Invariants (cited by the tests):
//   JD1  Of one part it is that part.
//   JD2  What forbids a rate in one part forbids it in all: none gets more than foveation allows one of them, one with an
//        edge is not reconstructed, one that may not be advected is not.
BlockEvidence join(std::span<const BlockEvidence> parts, BlockSpeed statistic);

}  // namespace tessera::tilecore
