#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/report/page_views.h"

namespace tessera::replay {

// report.html: one file that needs no other and no network. It holds images, maps of tiles, plots (Vega, from the
// distribution's modules, built into the page), tables and the whole configuration. Writing it again from the same
// folder gives the same bytes.

// Why no report can be made here ("" when one can): the modules of Vega that pages need are in none of
// vega_folders().
std::string missing_for_reports();

// Writes report.html into the folder of a replay (stats.json), a tradeoff (tradeoff.json) or a sweep (sweep.json),
// whose sweep.csv it makes as well: that is how shards are joined. Returns what the reader of the terminal should know,
// or "". Throws InputError when the folder holds none or a damaged one, SystemError when missing_for_reports() has a
// reason.
std::string write_report(const std::filesystem::path& folder);
// One page over the folders of several replays, in the first one's place: `file`.
std::string write_joint_report(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& file);

// The page of what a kind of report made, as markup. Its member "kind" chooses the script: "replay", "sweep", "tradeoff"
// or "view" (view/view_server.h). `nonce`, unless empty: that of its scripts, for a Content-Security-Policy. `scripts`:
// elements that hold what PageViews packed. Throws SystemError as write_report().
std::string page_text(nlohmann::json data, const std::string& nonce = "", std::string scripts = "");

// Of a replay with more frames, the page shows every second, fourth, ..., so that no more are left; totals are those of
// all.
inline constexpr std::size_t kMaxFrames = 1024;
inline constexpr std::size_t kMaxSweepCells = 4'000'000;  // rows times columns
inline constexpr std::size_t kMaxRuns = 8;

// What follows is for the kinds of report. Each makes the page's data; its script in page/ knows what to do with them.

nlohmann::json replay_report(const std::vector<std::filesystem::path>& folders, PageViews& views, std::string& note);
nlohmann::json sweep_report(const std::filesystem::path& folder, PageViews& views, std::string& note);
nlohmann::json tradeoff_report(const std::filesystem::path& folder, PageViews& views, std::string& note);

}  // namespace tessera::replay
