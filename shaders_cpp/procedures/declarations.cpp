#include "shaders_cpp/procedures/declarations.h"

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::shaders {
namespace {

template <class Stage>
StageDeclaration declare_shape() {
  return {Stage::kName, Stage::kMeaning, Stage::kParameters, Stage::kPatchesU, Stage::kPatchesV,
          requires {Stage::kKinks;
}
};  // namespace
}  // namespace tessera::shaders
template <class Stage>
StageDeclaration declare() {
  return {Stage::kName, Stage::kMeaning, Stage::kParameters};
}

}  // namespace

std::span<const StageDeclaration> shape_declarations() {
#define TESSERA_DECLARE(name) declare_shape<name>(),
  static const StageDeclaration kStages[] = {TESSERA_SHAPES(TESSERA_DECLARE)};
#undef TESSERA_DECLARE
  return kStages;
}

std::span<const StageDeclaration> texture_declarations() {
#define TESSERA_DECLARE(name) declare<name>(),
  static const StageDeclaration kStages[] = {TESSERA_TEXTURES(TESSERA_DECLARE)};
  return kStages;
}

std::span<const StageDeclaration> shading_declarations() {
  static const StageDeclaration kStages[] = {TESSERA_SHADING(TESSERA_DECLARE)};
#undef TESSERA_DECLARE
  return kStages;
}

}  // namespace tessera::shaders
