#include "scene/gltf/audit.h"

namespace tessera::scene::gltf {

const std::vector<ValidatorCode>& validator_codes() {
  static const std::vector<ValidatorCode> kCodes = {
#include "scene/gltf/validator_codes.def"
  };
  return kCodes;
}

}  // namespace tessera::scene::gltf
