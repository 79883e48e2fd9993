#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "base/json_text.h"
#include "replay/report/report.h"

namespace tessera::replay {

// tradeoff.json is what the page shows; the page needs nothing else of the folder.
nlohmann::json tradeoff_report(const std::filesystem::path& folder, std::string& note) {
  const std::filesystem::path file = folder / "tradeoff.json";
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  nlohmann::json tradeoff = parse_json(text, file.string());
  if (tradeoff.at("stopped").get<bool>()) note = "the tradeoff was stopped before its end";
  const std::string capture = tradeoff.at("capture");
  const int frame = tradeoff.at("frame"), width = tradeoff.at("size").at(0), height = tradeoff.at("size").at(1);
  return {{"title", fmt::format("What accuracy costs: {}", capture)}, {"subtitle", fmt::format("Frame {}, {}x{}, {} knobs", frame, width, height, tradeoff.at("knobs").size())}, {"tradeoff", std::move(tradeoff)}};
}

}  // namespace tessera::replay
