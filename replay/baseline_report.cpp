#include "replay/baseline_report.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/atomic_file.h"

namespace tessera::replay {
namespace {

using baselines::BaselineCounters;
using baselines::SchemeId;

constexpr const auto& kFields = kCounterFields<BaselineCounters>;
std::string csv_rows(const std::string& frame, const baselines::BaselineSet& set) {
  std::string text;
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    text += fmt::format("{},{},{}", frame, baselines::kSchemes[s].name, name(baselines::kSchemes[s].kind));
    for (const auto& field : kFields) text += fmt::format(",{}", set.schemes[s].*field.member);
    text += "\n";
  }
  return text;
}

}  // namespace

nlohmann::json baselines_json(const baselines::BaselineSet& set) {
  nlohmann::json out = nlohmann::json::object();
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    for (const auto& field : kFields)
      out[std::string(baselines::kSchemes[s].name)][std::string(field.name)] = set.schemes[s].*field.member;
  return out;
}

nlohmann::json baseline_passes_json(std::span<const baselines::PassSet> passes) {
  constexpr std::array kBytes = {&BaselineCounters::dram_bytes,       &BaselineCounters::texture_bytes,
                                 &BaselineCounters::frame_bytes_read, &BaselineCounters::frame_bytes_written,
                                 &BaselineCounters::queue_bytes_read, &BaselineCounters::queue_bytes_written};
  nlohmann::json out = nlohmann::json::array();
  for (const baselines::PassSet& pass : passes) {
    nlohmann::json& schemes = out.emplace_back(nlohmann::json{{"name", pass.name}})["baselines"];
    for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
      for (const auto& field : kFields)
        if (std::find(kBytes.begin(), kBytes.end(), field.member) != kBytes.end())
          schemes[std::string(baselines::kSchemes[s].name)][std::string(field.name)] =
              pass.set.schemes[s].*field.member;
  }
  return out;
}

nlohmann::json baseline_kinds_json() {
  nlohmann::json out = nlohmann::json::object();
  for (const baselines::SchemeRow& scheme : baselines::kSchemes) out[std::string(scheme.name)] = name(scheme.kind);
  return out;
}

void BaselineReport::add(int frame, const baselines::BaselineSet& set) {
  frames_.push_back({frame, set});
  total_.accumulate(set);
}

std::string BaselineReport::csv() const {
  std::string text = "frame,scheme,kind";
  for (const auto& field : kFields) text += fmt::format(",{}", field.name);
  text += "\n";
  for (const Frame& frame : frames_) text += csv_rows(std::to_string(frame.frame), frame.set);
  return text + csv_rows("total", total_);
}

void BaselineReport::write(const std::filesystem::path& folder) const {
  write_file_atomically(folder / "baselines.csv", csv());
}

}  // namespace tessera::replay
