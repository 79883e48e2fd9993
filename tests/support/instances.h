#pragma once

#include "scene/capture.h"
#include "tests/support/captures.h"

namespace tessera::test {

// A transform anywhere in a box of half side `half`; one in four is mirrored.
scene::InstanceTransform random_instance(Random& random, float half);

// The same scene with a node for each instance, right behind the node that had them, so that base patches have the
// same numbers.
scene::Capture with_node_per_instance(const scene::Capture& capture);

// Nodes with instances of several primitives, clusters and displaced Bezier patches, some mirrored; they turn, move
// and deform during the first second, before a camera with a lens. `half` is half the side of the box of instances;
// the view is about 3 wide.
scene::Capture random_instanced_scene(Random& random, int instances, float half);

}  // namespace tessera::test
