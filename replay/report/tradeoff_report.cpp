#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/report/report.h"

namespace tessera::replay {

// tradeoff.json is what the page shows; the page needs nothing else of the folder.
nlohmann::json tradeoff_report(const std::filesystem::path& folder, std::string& note) {
  const std::filesystem::path file = folder / "tradeoff.json";
  nlohmann::json tradeoff = parse_json(read_whole_text(file), file.string());
  if (!tradeoff.is_object() || tradeoff.value("schema", nlohmann::json()) != "tessera.tradeoff/1") throw InputError(file.string(), "/schema", "is not tessera.tradeoff/1");
  if (tradeoff.at("stopped").get<bool>()) note = "the tradeoff was stopped before its end";
  const std::string capture = tradeoff.at("capture");
  const int frame = whole_number(tradeoff.at("frame")), width = whole_number(tradeoff.at("size").at(0)), height = whole_number(tradeoff.at("size").at(1));
  return {{"title", fmt::format("What accuracy costs: {}", capture)}, {"subtitle", fmt::format("Frame {}, {}x{}, {} knobs", frame, width, height, tradeoff.at("knobs").size())}, {"tradeoff", std::move(tradeoff)}};
}

}  // namespace tessera::replay
