// The targets of tessera_fuzz_decoders: captures and images, the sanitized build of every push.
#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {

std::span<const Target> targets() {
  static const Target kTargets[] = {kCaptureTarget, kDracoTarget,    kMeshoptTarget, kImageTarget, kWebpTarget,
                                    kExrTarget,     kRadianceTarget, kHistoryTarget, kKtx2Target};
  return kTargets;
}

}  // namespace tessera::fuzz
