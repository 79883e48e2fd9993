#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// A program text (shaders_cpp/procedures/program.h) for one node.
struct ProcedureFile {
  std::string node;  // its name or number; empty: a new node
  std::filesystem::path file;
};

// "[NODE=]FILE". Throws UsageError.
ProcedureFile parse_procedure(const std::string& text);

// Puts programs into a checked document: each text once, in the list of its TESSERA_procedure extension, and its number
// into the node's extension, where it replaces the stages that the text defines. A new node has the name of its program
// and belongs to the scene. The result must be checked again. Throws InputError with FILE:line:column, UsageError for
// an unknown node.
void attach_procedures(nlohmann::json& document, std::span<const ProcedureFile> procedures);

}  // namespace tessera::replay
