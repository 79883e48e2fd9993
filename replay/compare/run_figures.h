#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// The statistics of a replay (tessera.stats/1) or of a record timed again (tessera.time/1), checked as far as they are
// used; read from the file, or from stats.json of a folder.
struct RunStatistics {
  std::filesystem::path file;
  nlohmann::json root;
  std::vector<int> frames;  // numbers of the frames, in the file's order

  // Capture, settings and machine of the replay: "capture.file", "tile.width", "shading.rate", ... Host times are not
  // among the keys.
  std::map<std::string, nlohmann::json> keys() const;
};

// Throws InputError naming the file and the place in it.
RunStatistics read_run(const std::filesystem::path& file_or_folder);

// Numbers of the frames that all runs have; may be empty.
std::vector<int> common_frames(const std::vector<RunStatistics>& runs);

// Sections of figures that a comparison shows, in order. All but counters are means over the frames.
enum class Section { kSummary, kPath, kPasses, kUnits, kPurposes, kEnergy, kDrawables, kMaterials, kCounters };
inline constexpr std::size_t kSectionCount = 9;
struct SectionInfo {
  const char *name, *title, *unit;
};
const SectionInfo& info(Section section);

// Rows of the summary.
inline constexpr const char *kTimeRow = "time_ms", *kCyclesRow = "cycles", *kEnergyRow = "energy_mj",
                            *kTrafficRow = "dram_bytes";

// Figures of one run over some of its frames. Figures that the file lacks are missing here.
struct RunFigures {
  std::map<std::string, double> sections[kSectionCount];
  std::string bound_by;

  const std::map<std::string, double>& of(Section section) const { return sections[static_cast<std::size_t>(section)]; }
  std::map<std::string, double>& of(Section section) { return sections[static_cast<std::size_t>(section)]; }
  std::optional<double> value(Section section, const std::string& name) const;
  double value_or_0(Section section, const std::string& name) const { return value(section, name).value_or(0); }
};
RunFigures figures_of(const RunStatistics& run, const std::vector<int>& frames);

}  // namespace tessera::replay
