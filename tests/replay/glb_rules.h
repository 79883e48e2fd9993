#pragma once

#include "tests/replay/gltf_source.h"
#include "tests/support/tests.h"

namespace tessera::test {

// Rules of glTF 2.0 that a reader need not insist on but a writer must keep: container, buffer views, strides, targets,
// accessors behind Draco, extension lists. Returns one line per violation. Written from the specification (sections 3.6
// and 4, KHR_draco_mesh_compression), not from the packer.
std::vector<std::string> glb_faults(const std::string& bytes);
std::vector<std::string> glb_faults(const GlbParts& parts);

}  // namespace tessera::test
