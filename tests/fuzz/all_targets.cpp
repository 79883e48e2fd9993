// The targets of tessera_fuzz.
#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {

std::span<const Target> targets() {
  static const Target kTargets[] = {kCaptureTarget,  kDracoTarget,   kMeshoptTarget, kReplayTarget,
                                    kStudyTarget,    kMachineTarget, kOptionTarget,  kResultTarget,
                                    kPointTarget,    kImageTarget,   kWebpTarget,    kExrTarget,
                                    kRadianceTarget, kHistoryTarget, kKtx2Target,    kProgramTarget};
  return kTargets;
}

}  // namespace tessera::fuzz
