#include "replay/report/report.h"

#include <array>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/describe.h"
#include "replay/report/page_files.h"
#include "replay/report/vega.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// What the page's plots need of Vega 5, in the order in which they need each other. Distributions and npm ship Vega as these modules.
constexpr std::array kVegaModules = {
    "vega-util",       "vega-time",       "vega-format",          "vega-loader",     "vega-dataflow",
    "vega-canvas",     "vega-scale",      "vega-scenegraph",      "vega-expression", "vega-selection",
    "vega-statistics", "vega-functions",  "vega-runtime",         "vega-view",       "vega-event-selector",
    "vega-parser",     "vega-transforms", "vega-view-transforms", "vega-encode"};
constexpr std::string_view kLastScript = "start.js";
constexpr std::array<std::string_view, 7> kScripts = {"page.js",  "plots.js",    "frames.js", "replay.js",
                                                      "sweep.js", "tradeoff.js", kLastScript};

// The kinds of folder, by the file that tells them. Another kind is another row and another function in page/start.js.
struct ReportKind {
  const char* kind;
  const char* file;
  json (*make)(const fs::path& folder, std::string& note);
};
constexpr std::array<ReportKind, 3> kKinds = {{{"replay", "stats.json", replay_report},
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

// Whether a text between quotes is JSON of itself, and without '<'. Images in base64 are, and long.
bool is_plain(std::string_view text) {
  bool plain = true;
  for (const char c : text) plain &= c >= ' ' && c <= '~' && c != '"' && c != '\\' && c != '<';
  return plain;
}

// Inside a script element nothing may look like the end of it, and inside markup nothing like markup.
void append_script_json(const json& value, std::string& out) {
  const auto append_each = [&](const auto& items, char open, char close) {
    out += open;
    const char* between = "";
    for (const auto& item : items) {
      out += std::exchange(between, ",");
      if constexpr (std::is_same_v<std::decay_t<decltype(items)>, json::object_t>) {
        append_script_json(item.first, out);
        out += ':';
        append_script_json(item.second, out);
      } else {
        append_script_json(item, out);
      }
    }
    out += close;
  };
  if (value.is_object()) return append_each(value.get_ref<const json::object_t&>(), '{', '}');
  if (value.is_array()) return append_each(value.get_ref<const json::array_t&>(), '[', ']');
  if (value.is_string() && is_plain(value.get_ref<const std::string&>())) {
    out.append(1, '"').append(value.get_ref<const std::string&>()).append(1, '"');
    return;
  }
  for (const char c : json_text(value)) c == '<' ? out += "\\u003c" : out += c;
}

std::string script_json(const json& value) {
  std::string text;
  append_script_json(value, text);
  return text;
}

std::string markup_text(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? std::string("&lt;") : c == '&' ? std::string("&amp;") : std::string(1, c);
  return out;
}

// Fills the template's @NAMES@, each of which is there once; what is filled in is not looked at again.
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

std::string page_text(json data, const std::string& nonce) {
  data["counters"] = meanings({"counters"}, "name");
  data["keys"] = meanings({"settings", "gpu"}, "key");
  std::string script = vega_script();
  for (const std::string_view name : kScripts) {
    if (name == kLastScript && data.at("kind") == "view") script.append(page_files().at("view.js")).append("\n");
    script.append(page_files().at(name)).append("\n");
  }
  std::string style(page_files().at("page.css"));
  if (data.at("kind") == "view") style.append(page_files().at("view.css"));
  const std::string title = markup_text(data.at("title")), text = script_json(data),
                    mark = nonce.empty() ? "" : " nonce=\"" + nonce + "\"";
  return fill_page({{"@TITLE@", title}, {"@STYLE@", style}, {"@DATA@", text}, {"@NONCE@", mark}, {"@SCRIPT@", script}});
}

std::string write_report(const fs::path& folder) {
  std::error_code ignored;
  for (const ReportKind& kind : kKinds) {
    if (!fs::is_regular_file(folder / kind.file, ignored)) continue;
    if (const std::string missing = missing_for_reports(); !missing.empty()) throw SystemError("no report: " + missing);
    std::string note;
    json data;
    try {
      data = kind.make(folder, note);
    } catch (const json::exception& error) {
      throw InputError((folder / kind.file).string(), "",
                       fmt::format("is not what a {} writes: {}", kind.kind, error.what()));
    }
    data["kind"] = kind.kind;
    write_file_atomically(folder / "report.html", page_text(std::move(data)));
    return note;
  }
  throw InputError(folder.string(), "",
                   fs::is_directory(folder, ignored)
                       ? "holds none of stats.json of a replay, sweep.json of a sweep and tradeoff.json of a tradeoff"
                       : "no such folder");
}

}  // namespace tessera::replay
