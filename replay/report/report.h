#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

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

// The page of what a kind of report made, as markup. Its member "kind" chooses the script: "replay", "sweep", "tradeoff"
// or "view" (view/view_server.h). `nonce`, unless empty: that of its scripts, for a Content-Security-Policy. Throws
// SystemError as write_report().
std::string page_text(nlohmann::json data, const std::string& nonce = "");

// Images beyond these are left out, evenly, and the page says so.
inline constexpr std::size_t kMaxImages = 48;
inline constexpr std::uint64_t kMaxImageBytes = 64u << 20;
// Of a replay with more frames, plots and tables show every second, fourth, ..., so that no more are left; totals are those of
// all.
inline constexpr std::size_t kMaxFrames = 1024;
inline constexpr std::size_t kMaxSweepCells = 4'000'000;  // rows times columns

// What follows is for the kinds of report. Each makes the page's data; its script in page/ knows what to do with them.

// An image with its tiles, for the browser of frames: {"label", "image", "size", "region", "tiles"}; without "tiles"
// where the file is missing. Null when there is no image.
nlohmann::json image_view(const std::string& label, const std::filesystem::path& image,
                          const std::filesystem::path& tiles, int region_x, int region_y);

// Every k-th of `count` images, so that at most kMaxImages are taken.
std::size_t image_stride(std::size_t count);

nlohmann::json replay_report(const std::filesystem::path& folder, std::string& note);
nlohmann::json sweep_report(const std::filesystem::path& folder, std::string& note);
nlohmann::json tradeoff_report(const std::filesystem::path& folder, std::string& note);

}  // namespace tessera::replay
