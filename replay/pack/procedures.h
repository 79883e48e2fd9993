#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// A text of programs (shaders_cpp/procedures/program.h) for one node.
struct ProcedureFile {
  std::string node;  // its name or number; empty: a new one
  std::filesystem::path file;
};

// "[NODE=]FILE". Throws UsageError.
ProcedureFile parse_procedure(const std::string& text);

// Puts programs into a checked document: each text once, in the list of its TESSERA_procedure, and its number into that
// of the node, in place of the stages that the text has. A new node is called like its program and stands in the scene.
// The result is to be checked again. Throws InputError with FILE:line:column, UsageError for an unknown node.
void attach_procedures(nlohmann::json& document, std::span<const ProcedureFile> procedures);

}  // namespace tessera::replay
