#pragma once

#include <map>
#include <string>

#include "scene/capture.h"
#include "scene/gltf/document.h"
#include "shaders_cpp/procedures/program.h"

namespace tessera::scene::gltf {

// TESSERA_procedure, an extension of nodes: docs/extensions/TESSERA_procedure.md. The names and ranges of parameters
// are those of the stages' declarations (shaders_cpp/procedures/declarations.h).

// The programs of one document: each text is compiled once.
class ProgramCache {
 public:
  static constexpr std::size_t kMaxPrograms = 64;  // texts of a document

  // `value` is the text or its number in the document's list. Throws InputError at `place` with line and column.
  const shaders::ProgramSet& get(const nlohmann::json& document, const nlohmann::json& value, const Place& place);

 private:
  std::map<std::string, shaders::ProgramSet> compiled_;
};

// Shape of the extension object: known stages or programs that compile, known parameters with the right number of
// values in their ranges. Throws InputError.
void check_procedure_schema(const nlohmann::json& document, const nlohmann::json& procedure, ProgramCache& programs,
                            const Place& place);

// What links it to other objects: the accessor of a geometry image. Throws InputError.
void check_procedure_links(const nlohmann::json& document, const nlohmann::json& procedure, const Place& place);

// Procedures of all nodes; sets Node::procedure. Charges what they take.
void build_procedures(Document& document, Capture& capture);

}  // namespace tessera::scene::gltf
