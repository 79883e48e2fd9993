// The targets of tessera_fuzz_decoders: all that need no kernels of the machine.
#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {

std::span<const Target> targets() {
  static const Target kTargets[] = {kCaptureTarget, kDracoTarget,   kStudyTarget, kMachineTarget,
                                    kOptionTarget,  kResultTarget,  kPointTarget, kImageTarget,
                                    kExrTarget,     kHistoryTarget, kKtx2Target};
  return kTargets;
}

}  // namespace tessera::fuzz
