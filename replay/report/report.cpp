#include "replay/report/report.h"

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "hardware/events.h"
#include "replay/describe.h"
#include "replay/report/page_parts.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// The parts of Vega 5 that the page's plots need, in the order of their dependencies. Distributions and npm ship Vega
// as these modules.
constexpr std::array kVegaModules = {
    "vega-util",       "vega-time",       "vega-format",          "vega-loader",     "vega-dataflow",
    "vega-canvas",     "vega-scale",      "vega-scenegraph",      "vega-expression", "vega-selection",
    "vega-statistics", "vega-functions",  "vega-runtime",         "vega-view",       "vega-event-selector",
    "vega-parser",     "vega-transforms", "vega-view-transforms", "vega-encode"};
constexpr std::string_view kLastScript = "start.js";
constexpr std::array<std::string_view, 24> kScripts = {
    "page.js",   "units.js",   "packed.js", "store.js",    "plots.js",    "bar.js",    "cards.js",    "frames.js",
    "viewer.js", "machine.js", "passes.js", "series.js",   "timeline.js", "pixels.js", "tiles.js",    "compare.js",
    "memory.js", "details.js", "replay.js", "parallel.js", "images.js",   "sweep.js",  "tradeoff.js", kLastScript};

json one_replay(const fs::path& folder, PageViews& views, std::string& note) {
  return replay_report({folder}, views, note);
}

// The kinds of folder, by the file that tells them. Another kind is another row and another function in page/start.js.
struct ReportKind {
  const char* kind;
  const char* file;
  json (*make)(const fs::path& folder, PageViews& views, std::string& note);
};
constexpr std::array<ReportKind, 3> kKinds = {{{"replay", "stats.json", one_replay},
                                               {"sweep", "sweep.json", sweep_report},
                                               {"tradeoff", "tradeoff.json", tradeoff_report}}};

// The modules as functions of (exports, require, module, define); page/plots.js calls them.
std::string vega_script() {
  std::string text = "const vegaModules = {\n";
  for (const char* name : kVegaModules)
    text += fmt::format("'{}': function (exports, require, module, define) {{\n{}\n}},\n", name,
                        read_whole_text(find_vega_module(name)));
  return text + "};\n";
}

// Replaces the template's @NAMES@, each of which occurs once; inserted text is not searched again.
std::string fill_page(const std::vector<std::pair<std::string_view, std::string_view>>& parts) {
  std::string_view rest = page_files().at("page.html");
  std::size_t bytes = rest.size();
  for (const auto& [name, text] : parts) bytes += text.size();
  std::string page;
  page.reserve(bytes);
  for (const auto& [name, text] : parts) {
    const std::size_t at = rest.find(name);
    page.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + name.size());
  }
  return page.append(rest);
}

json meanings(const std::vector<std::string>& topics, const char* name) {
  json out = json::object();
  for (const std::string& topic : topics)
    for (const json& row : describe_json(topic))
      out[row.at(name).get<std::string>()] = {{"unit", row.at("unit")}, {"meaning", row.at("meaning")}};
  return out;
}

void write_page(const fs::path& file, const char* kind, json data, PageViews& views) {
  PageElements elements;
  views.finish(data, elements);
  data["kind"] = kind;
  write_file_atomically(file, page_text(std::move(data), "", std::move(elements)));
}

// Charged events as the page's panels of units show them: the keys of their rates and energies.
json events() {
  json rows = json::array();
  for (const hardware::Event event : hardware::kAllEvents) {
    const hardware::EventRow& row = hardware::kEventTable[event];
    rows.push_back({{"unit", unit_name(event)}, {"keys", {row.rate.key, row.energy.key}}});
  }
  return rows;
}

void check_modules() {
  if (const std::string missing = missing_for_reports(); !missing.empty()) throw SystemError("no report: " + missing);
}

}  // namespace

std::string missing_for_reports() {
  std::vector<std::string> folders;
  for (const fs::path& folder : vega_folders()) folders.push_back(folder.string());
  for (const char* name : kVegaModules)
    if (find_vega_module(name).empty())
      return fmt::format(
          "{}.min.js is in none of {}; install Vega 5 (Debian's package libjs-vega) or say in TESSERA_VEGA where its "
          "files are",
          name, fmt::join(folders, ", "));
  return "";
}

std::string page_text(json data, const std::string& nonce, PageElements elements) {
  data["counters"] = meanings({"counters"}, "name");
  data["keys"] = meanings({"settings", "gpu"}, "key");
  data["events"] = events();
  const bool live = data.at("kind") == "view";
  std::string script = vega_script();
  for (const std::string_view name : kScripts) {
    if (live && name == kLastScript) script.append(page_files().at("view.js")).append("\n");
    script.append(page_files().at(name)).append("\n");
  }
  std::string style(page_files().at("page.css"));
  if (live) style.append(page_files().at("view.css"));
  const std::string title = markup_text(data.at("title")), mark = nonce.empty() ? "" : " nonce=\"" + nonce + "\"";
  append_script("data", gzip_base64(json_text(data)), elements.first);
  return fill_page({{"@TITLE@", title},
                    {"@STYLE@", style},
                    {"@FIRST@", elements.first},
                    {"@NONCE@", mark},
                    {"@SCRIPT@", script},
                    {"@REST@", elements.rest}});
}

std::string write_report(const fs::path& folder) {
  std::error_code ignored;
  for (const ReportKind& kind : kKinds) {
    if (!fs::is_regular_file(folder / kind.file, ignored)) continue;
    check_modules();
    std::string note;
    try {
      PageViews views;
      write_page(folder / "report.html", kind.kind, kind.make(folder, views, note), views);
    } catch (const json::exception& error) {
      throw InputError((folder / kind.file).string(), "",
                       fmt::format("does not match the output of a {}: {}", kind.kind, error.what()));
    }
    return note;
  }
  throw InputError(folder.string(), "",
                   fs::is_directory(folder, ignored)
                       ? "holds none of stats.json of a replay, sweep.json of a sweep and tradeoff.json of a tradeoff"
                       : "no such folder");
}

std::string write_joint_report(const std::vector<fs::path>& folders, const fs::path& file) {
  std::error_code ignored;
  for (const fs::path& folder : folders)
    if (!fs::is_regular_file(folder / "stats.json", ignored))
      throw InputError(folder.string(), "",
                       fs::is_directory(folder, ignored) ? "holds no stats.json of a replay" : "no such folder");
  check_modules();
  std::string note;
  PageViews views;
  try {
    write_page(file, "replay", replay_report(folders, views, note), views);
  } catch (const json::exception& error) {
    throw InputError(folders.front().string(), "",
                     fmt::format("does not match the output of a replay: {}", error.what()));
  }
  return note;
}

}  // namespace tessera::replay
