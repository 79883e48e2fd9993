#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/text.h"
#include "replay/commands.h"

namespace {

using tessera::ExitStatus;

int fail(ExitStatus status, const char* what) {
  std::fprintf(stderr, "tessera: %s\n", what);
  return static_cast<int>(status);
}

// Output that could not be written (a full disk behind a pipe or a redirection) is a failure.
int finish_output() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return static_cast<int>(ExitStatus::kDone);
  return fail(ExitStatus::kCannotWrite, (std::string("cannot write the output: ") + std::strerror(errno)).c_str());
}

// The parser's complaint; where it is an argument that nobody expects, with the nearest one that is.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extras = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr || extras.empty() || app.get_subcommands().empty())
    return error.what();
  const auto option =
      std::find_if(extras.begin(), extras.end(), [](const std::string& text) { return text.starts_with("-"); });
  if (option == extras.end()) return "unexpected argument '" + tessera::escape_control(extras.front(), 80) + "'";
  std::vector<std::string> known;
  for (const CLI::Option* o : app.get_subcommands().front()->get_options())
    for (const std::string& name : o->get_lnames()) known.push_back("--" + name);
  const std::string nearest = tessera::nearest_name(option->substr(0, option->find('=')), known);
  return "unknown option '" + tessera::escape_control(*option, 80) + "'" +
         (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
}

std::string unknown_command(const std::vector<std::string>& known, const std::string& name) {
  const std::string nearest = tessera::nearest_name(name, known);
  return "unknown command '" + tessera::escape_control(name, 80) + "'" +
         (nearest.empty() ? "; `tessera --help` lists them" : "; did you mean '" + nearest + "'?");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tessera: emulates a tile-based deferred GPU that bins patches before tessellation.", "tessera");
  app.require_subcommand(1);
  app.footer(
      "`tessera COMMAND --help` explains a command. Exit status: 0 done, 1 fault of the program, 2 wrong usage, 3 bad "
      "input, 4 limit exceeded, 6 a result could not be written.");

  using Make = std::unique_ptr<tessera::replay::Command> (*)(CLI::App&);
  const std::vector<std::pair<CLI::App*, Make>> commands = {
      {app.add_subcommand("replay", "Render frames of a capture and measure them"),
       tessera::replay::make_replay_command},
      {app.add_subcommand("inspect", "Say what is in a capture"), tessera::replay::make_inspect_command},
      {app.add_subcommand("pack", "Compress a glTF asset and attach capture settings"),
       tessera::replay::make_pack_command},
      {app.add_subcommand("compare", "Differences between two images or two replays"),
       tessera::replay::make_compare_command},
      {app.add_subcommand("sweep", "Render every point of a design space and measure it"),
       tessera::replay::make_sweep_command},
      {app.add_subcommand("tradeoff",
                          "What accuracy costs: error of every setting beside its time, cycles, traffic and energy"),
       tessera::replay::make_tradeoff_command},
      {app.add_subcommand("report", "One page about a replay, a sweep or a tradeoff"),
       tessera::replay::make_report_command},
      {app.add_subcommand("describe", "Every counter, setting, machine number, extension and effect"),
       tessera::replay::make_describe_command},
      {app.add_subcommand("selfcheck", "Known identities and published figures, computed again"),
       tessera::replay::make_selfcheck_command},
  };
  std::vector<std::unique_ptr<tessera::replay::Command>> made;
  for (const auto& [sub, make] : commands) made.push_back(make(*sub));

  std::vector<std::string> names;
  for (const auto& [sub, make] : commands) names.push_back(sub->get_name());
  if (argc > 1 && argv[1][0] != '-' && std::find(names.begin(), names.end(), argv[1]) == names.end())
    return fail(ExitStatus::kUsage, unknown_command(names, argv[1]).c_str());
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    app.exit(help);
    return finish_output();
  } catch (const CLI::ParseError& error) {
    return fail(ExitStatus::kUsage, (complaint(app, error) + " (--help explains)").c_str());
  }
  try {
    for (std::size_t i = 0; i < commands.size(); ++i)
      if (commands[i].first->parsed()) made[i]->run();
    return finish_output();
  } catch (const tessera::InputError& error) {
    return fail(ExitStatus::kBadInput, error.what());
  } catch (const tessera::UsageError& error) {
    return fail(ExitStatus::kUsage, error.what());
  } catch (const tessera::LimitError& error) {
    return fail(ExitStatus::kLimit, error.what());
  } catch (const tessera::WriteError& error) {
    return fail(ExitStatus::kCannotWrite, error.what());
  } catch (const std::bad_alloc&) {
    return fail(ExitStatus::kLimit, "out of memory");
  } catch (const std::exception& error) {
    return fail(std::ferror(stdout) != 0 ? ExitStatus::kCannotWrite : ExitStatus::kInternal, error.what());
  }
}
