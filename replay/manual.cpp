#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "replay/describe.h"

namespace tessera::replay {
namespace {

// A text as roff prints it: no escapes, no requests, hyphens that can be copied.
std::string roff(const std::string& text) {
  std::string out;
  bool begin = true;
  for (const char c : text) {
    if (begin && (c == '.' || c == '\'')) out += "\\&";
    begin = c == '\n';
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

// "[OPTIONS] CAPTURE"
std::string synopsis(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string name =
        option->get_name() + (option->get_items_expected_max() > 1 ? " " + option->get_type_name() : "");
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  return "[OPTIONS]" + text;
}

std::string entry(const CLI::Option& option) {
  std::string head;
  if (option.get_positional()) {
    head = fmt::format(".I {}", roff(option.get_name()));
  } else {
    for (const std::string& name : option.get_snames()) head += fmt::format("\\-{}, ", name);
    head = fmt::format(".B {}{}", head, roff("--" + option.get_lnames().front()));
    if (option.get_items_expected_max() > 0) head += " \\fI" + roff(option.get_type_name()) + "\\fR";
  }
  std::string text = roff(option.get_description());
  if (!option.get_default_str().empty()) text += fmt::format(" (default {})", roff(option.get_default_str()));
  return fmt::format(".TP\n{}\n{}.\n", head, text);
}

// A footer as it is laid out.
std::string laid_out(const std::string& text) { return text.empty() ? "" : ".PP\n.nf\n" + roff(text) + "\n.fi\n"; }

}  // namespace

std::string manual_page(const CLI::App& program) {
  std::string text = fmt::format(
      ".\\\" Made by `tessera describe man`.\n.TH TESSERA 1 \"\" \"Tessera {}\" \"User Commands\"\n", TESSERA_VERSION);
  text +=
      fmt::format(".SH NAME\ntessera \\- emulate a tile\\-based deferred GPU that bins patches before tessellation\n");
  text += ".SH SYNOPSIS\n.B tessera\n.I COMMAND\n[OPTIONS] ARGUMENTS\n";
  text += ".SH DESCRIPTION\n" +
          roff(
              "Replays captures, any glTF 2.0 asset, and gives for every frame the image that such a GPU "
              "would show, and its costs: work of each unit, memory traffic, cycles and their bound, "
              "energy.") +
          "\n";
  text += ".SH COMMANDS\n";
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    text += fmt::format(".SS tessera {} {}\n{}.\n", roff(command->get_name()), roff(synopsis(*command)),
                        roff(command->get_description()));
    for (const CLI::Option* option : command->get_options()) text += entry(*option);
    text += laid_out(command->get_footer());
  }
  text += ".SH EXIT STATUS\n";
  for (const auto& [status, meaning] : exit_statuses()) text += fmt::format(".TP\n.B {}\n{}.\n", status, roff(meaning));
  text +=
      ".SH ENVIRONMENT\n.TP\n.B TESSERA_VEGA\nWhere the modules of Vega 5 are that reports are made of; else the usual "
      "folders.\n";
  return text + ".SH SEE ALSO\nDocuments in docs/ of the sources; " + roff("`tessera describe TOPIC`") +
         " for counters, settings and machines.\n";
}

}  // namespace tessera::replay
