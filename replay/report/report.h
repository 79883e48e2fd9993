#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/report/page_parts.h"

#include "replay/report/page_views.h"

namespace tessera::replay {

// report.html: one file that needs no other file and no network. It holds images, maps of tiles, plots (Vega, from the
// distribution's modules, built into the page), tables and the whole configuration. Writing it again from the same
// folder gives the same bytes.

// Says why no report can be made here ("" when one can): Vega modules that pages need are in none of vega_folders().
std::string missing_for_reports();

// Writes report.html into the folder of a replay (stats.json), a tradeoff (tradeoff.json) or a sweep (sweep.json). For
// a sweep it also writes sweep.csv, which joins its shards. Returns a note for the terminal, or "". Throws InputError
// when the folder holds no such file or a damaged one, SystemError when missing_for_reports() has a reason.
std::string write_report(const std::filesystem::path& folder);
// Writes one page about several replays to `file`, in the first one's folder.
std::string write_joint_report(const std::vector<std::filesystem::path>& folders, const std::filesystem::path& file);

// The page for the data of a report, as markup. The member "kind" chooses the script: "replay", "sweep", "tradeoff" or
// "view" (view/view_server.h). `nonce`, unless empty, is the nonce of its scripts, for a Content-Security-Policy.
// `elements`: the output of PageViews::finish(). Throws SystemError as write_report().
std::string page_text(nlohmann::json data, const std::string& nonce = "", PageElements elements = {});

// For a replay with more frames, the page shows every second, fourth, ... frame, so that no more than these are left;
// totals include all frames.
inline constexpr std::size_t kMaxFrames = 1024;
inline constexpr std::size_t kMaxSweepCells = 4'000'000;  // rows times columns
inline constexpr std::size_t kMaxRuns = 8;

// The rest of this header is for the kinds of report. Each function makes the page's data; the kind's script in page/
// shows it.

nlohmann::json replay_report(const std::vector<std::filesystem::path>& folders, PageViews& views, std::string& note);
nlohmann::json sweep_report(const std::filesystem::path& folder, PageViews& views, std::string& note);
nlohmann::json tradeoff_report(const std::filesystem::path& folder, PageViews& views, std::string& note);

}  // namespace tessera::replay
