#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "scene/capture.h"
#include "scene/gltf/document.h"
#include "shaders_cpp/procedures/program.h"

namespace tessera::scene::gltf {

// TESSERA_procedure, an extension of nodes: docs/extensions/TESSERA_procedure.md. The stages' declarations
// (shaders_cpp/procedures/declarations.h) give the names and ranges of the parameters.

// The programs of one document: each text is compiled once.
class ProgramCache {
 public:
  static constexpr std::size_t kMaxPrograms = 64;  // texts of a document

  // `value` is the text or its number in the document's list. Throws InputError at `place` with line and column.
  const shaders::ProgramSet& get(const nlohmann::json& document, const nlohmann::json& value, const Place& place);

 private:
  std::map<std::string, shaders::ProgramSet> compiled_;
};

// Checks the shape of the extension object: known stages or programs that compile, known parameters with the right
// number of values in their ranges. Throws InputError.
void check_procedure_schema(const nlohmann::json& document, const nlohmann::json& procedure, ProgramCache& programs,
                            const Place& place);

// Checks its link to other objects: the accessor of a geometry image. Throws InputError.
void check_procedure_links(const nlohmann::json& document, const nlohmann::json& procedure, const Place& place);

// A parameter of one of its stages, for animations.
struct StageParameter {
  AnimatedPath path;
  int part;                // number of the parameter among its stage's
  int components, values;  // of a key: `values` values of `components` numbers
};
// `stage` is "parameters" (of the shape), "texture", "shading" or "sampling", as in the object. Returns nothing where
// the stage has no such parameter. The object must have passed check_procedure_schema().
std::optional<StageParameter> find_stage_parameter(const nlohmann::json& document, const nlohmann::json& procedure,
                                                   std::string_view stage, std::string_view name,
                                                   ProgramCache& programs, const Place& place);

// Builds the procedures of all nodes and sets Node::procedure. Charges their memory.
void build_procedures(Document& document, Capture& capture);

}  // namespace tessera::scene::gltf
