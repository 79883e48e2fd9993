#include <cstdio>
#include <new>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/error.h"
#include "replay/commands.h"

namespace {

using tessera::ExitStatus;

int fail(ExitStatus status, const char* what) {
  std::fprintf(stderr, "tessera: %s\n", what);
  return static_cast<int>(status);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tessera: emulates a tile-based deferred GPU that bins patches before tessellation.", "tessera");
  app.require_subcommand(1);
  app.footer("`tessera COMMAND --help` explains a command. Exit status: 0 done, 1 fault of the program, 2 wrong usage, 3 bad input, 4 limit exceeded.");

  using Make = std::unique_ptr<tessera::replay::Command> (*)(CLI::App&);
  const std::vector<std::pair<CLI::App*, Make>> commands = {
      {app.add_subcommand("replay", "Render frames of a capture and measure them"), tessera::replay::make_replay_command},
      {app.add_subcommand("inspect", "Say what is in a capture"), tessera::replay::make_inspect_command},
      {app.add_subcommand("pack", "Compress a glTF asset and attach capture settings"), tessera::replay::make_pack_command},
      {app.add_subcommand("compare", "Differences between two pictures or two replays"), tessera::replay::make_compare_command},
      {app.add_subcommand("describe", "Every counter, setting, machine number, extension and effect"), tessera::replay::make_describe_command},
  };
  std::vector<std::unique_ptr<tessera::replay::Command>> made;
  for (const auto& [sub, make] : commands) made.push_back(make(*sub));

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = app.exit(error);
    return status == 0 ? static_cast<int>(ExitStatus::kDone) : static_cast<int>(ExitStatus::kUsage);
  }
  try {
    for (std::size_t i = 0; i < commands.size(); ++i)
      if (commands[i].first->parsed()) made[i]->run();
    return static_cast<int>(ExitStatus::kDone);
  } catch (const tessera::InputError& error) {
    return fail(ExitStatus::kBadInput, error.what());
  } catch (const tessera::UsageError& error) {
    return fail(ExitStatus::kUsage, error.what());
  } catch (const tessera::LimitError& error) {
    return fail(ExitStatus::kLimit, error.what());
  } catch (const std::bad_alloc&) {
    return fail(ExitStatus::kLimit, "out of memory");
  } catch (const std::exception& error) {
    return fail(ExitStatus::kInternal, error.what());
  }
}
