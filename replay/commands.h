#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"

namespace CLI {
class App;
}

namespace tessera::replay {

// A sub-command of the program: declares its options on an App, then runs. `run` throws the error types of
// base/error.h; main turns them into exit statuses.
class Command {
 public:
  virtual ~Command() = default;
  virtual void run() = 0;
};

// Thrown after all remaining work is done and written: the command ends with this status and prints `line`, if any, to
// standard error.
struct EarlyEnd {
  ExitStatus status;
  std::string line;
};
// Ends a command whose work a signal stopped: `line` says how to go on.
inline EarlyEnd stopped(std::string line) { return {ExitStatus::kStopped, std::move(line)}; }

// Prints each note as "note: ..." to standard error.
void say_notes(const std::vector<std::string>& notes);

// Options that several commands have. `what` is the meaning of --set or --max-memory in the command's help.
void add_capture_argument(CLI::App& app, std::string& capture);
void add_machine_options(CLI::App& app, std::string& gpu, std::vector<std::string>& sets, const char* what);
void add_threads_option(CLI::App& app, unsigned& threads);
void add_memory_option(CLI::App& app, double& gib,
                       const char* what = "the capture with a frame of it, and the images, may take");
// The bytes of --max-memory. Throws UsageError for a number out of range.
std::uint64_t memory_bytes(double gib);
// Adds --strict, for every command that reads captures: sets scene::CaptureLimits::strict.
void add_strict_flag(CLI::App& app, bool& strict);
// Adds --variant, for commands that draw one capture: sets scene::CaptureLimits::variant.
void add_variant_option(CLI::App& app, std::optional<std::string>& variant);
// " --variant 'NAME'", quoted for a shell; empty without a variant.
std::string variant_argument(const std::optional<std::string>& variant);

std::unique_ptr<Command> make_replay_command(CLI::App& app);
std::unique_ptr<Command> make_view_command(CLI::App& app);
std::unique_ptr<Command> make_time_command(CLI::App& app);
std::unique_ptr<Command> make_inspect_command(CLI::App& app);
std::unique_ptr<Command> make_pack_command(CLI::App& app);
std::unique_ptr<Command> make_compare_command(CLI::App& app);
std::unique_ptr<Command> make_sweep_command(CLI::App& app);
std::unique_ptr<Command> make_tradeoff_command(CLI::App& app);
std::unique_ptr<Command> make_report_command(CLI::App& app);
std::unique_ptr<Command> make_dram_command(CLI::App& app);
std::unique_ptr<Command> make_describe_command(CLI::App& app);
std::unique_ptr<Command> make_selfcheck_command(CLI::App& app);

// From now on a failed check also prints the command line that repeats this run: `command` without --frames, and the
// current frame.
void repeat_failures_with(std::string command);

struct CommandEntry {
  const char* name;
  const char* about;
  std::unique_ptr<Command> (*make)(CLI::App& app);
};

// Parses a command line for these commands, runs the one that it names and returns the exit status. Errors become one
// line on the standard error output.
int run_command_line(int argc, char** argv, std::span<const CommandEntry> entries);

}  // namespace tessera::replay
