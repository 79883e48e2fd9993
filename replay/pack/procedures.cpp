#include "replay/pack/procedures.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "shaders_cpp/procedures/program.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr const char* kProcedure = "TESSERA_procedure";

// The program's number in the document's list.
std::size_t listed_program(json& document, const std::string& text) {
  json& list = document["extensions"][kProcedure]["programs"];
  if (!list.is_array()) list = json::array();
  const auto known = std::find(list.begin(), list.end(), json(text));
  const auto number = static_cast<std::size_t>(known - list.begin());
  if (known == list.end()) list.push_back(text);
  return number;
}

// A node's number, by its name or as digits.
std::size_t find_node(const json& document, const std::string& node) {
  const json nodes = document.value("nodes", json::array());
  std::optional<std::size_t> found;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n].value("name", std::string()) != node) continue;
    if (found) throw UsageError(fmt::format("--procedure {}: several nodes have that name", escape_control(node, 100)));
    found = n;
  }
  if (found) return *found;
  const bool digits = node.size() <= 9 && node.find_first_not_of("0123456789") == std::string::npos;
  if (digits && std::stoul(node) < nodes.size()) return std::stoul(node);
  throw UsageError(fmt::format("--procedure {}: there is no such node", escape_control(node, 100)));
}

std::size_t new_node(json& document, std::string_view name) {
  json& nodes = document["nodes"];
  if (!nodes.is_array()) nodes = json::array();
  const std::size_t number = nodes.size();
  nodes.push_back({{"name", name}});
  json& scenes = document["scenes"];
  if (!scenes.is_array() || scenes.empty()) {
    scenes = json::array({json{{"nodes", json::array()}}});
    for (std::size_t n = 0; n < number; ++n) {
      const auto holds = [&](const json& other) {
        const json children = other.value("children", json::array());
        return std::find(children.begin(), children.end(), json(n)) != children.end();
      };
      if (std::none_of(nodes.begin(), nodes.end(), holds)) scenes[0]["nodes"].push_back(n);
    }
  }
  scenes[document.value("scene", std::size_t{0})]["nodes"].push_back(number);
  return number;
}

}  // namespace

ProcedureFile parse_procedure(const std::string& text) {
  const std::size_t cut = text.find('=');
  ProcedureFile out;
  if (cut != std::string::npos) out.node = text.substr(0, cut);
  out.file = cut == std::string::npos ? text : text.substr(cut + 1);
  if (out.file.empty() || cut == 0)
    throw UsageError(fmt::format("--procedure {}: expected [NODE=]FILE", escape_control(text, 100)));
  return out;
}

void attach_procedures(json& document, std::span<const ProcedureFile> procedures) {
  for (const ProcedureFile& procedure : procedures) {
    const std::string name = procedure.file.string();
    const std::vector<std::uint8_t> bytes = read_whole_file(procedure.file, shaders::ProgramLimits::kSourceBytes, name);
    const std::string text(bytes.begin(), bytes.end());
    const shaders::CompiledText compiled = shaders::compile_programs(text);
    if (compiled.fault)
      throw InputError(fmt::format("{}:{}:{}", name, compiled.fault->line, compiled.fault->column), "",
                       compiled.fault->message);
    const shaders::ProgramSet& set = compiled.programs;
    const shaders::Program& first = set.shape ? *set.shape : set.texture ? *set.texture : *set.rates;
    const std::size_t number =
        procedure.node.empty() ? new_node(document, first.declaration.name) : find_node(document, procedure.node);
    json& object = document["nodes"][number]["extensions"][kProcedure];
    object["program"] = listed_program(document, text);
    if (set.shape) object.erase("shape");
    if (set.texture && object.contains("texture")) object["texture"].erase("pattern");
    json& used = document["extensionsUsed"];
    if (!used.is_array()) used = json::array();
    if (std::find(used.begin(), used.end(), json(kProcedure)) == used.end()) used.push_back(kProcedure);
  }
}

}  // namespace tessera::replay
