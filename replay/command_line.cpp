#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "base/check.h"
#include "base/error.h"
#include "base/option_numbers.h"
#include "base/text.h"
#include "gpu/configuration.h"
#include "replay/commands.h"
#include "replay/describe.h"
#include "replay/view_options.h"

namespace tessera::replay {
namespace {

int fail(ExitStatus status, const char* what) {
  std::fprintf(stderr, "tessera: %s\n", what);
  return static_cast<int>(status);
}

// Output that could not be written (a full disk behind a pipe or a redirection) is a failure.
int finish_output() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return static_cast<int>(ExitStatus::kDone);
  return fail(ExitStatus::kCannotWrite, (std::string("cannot write the output: ") + std::strerror(errno)).c_str());
}

// Turns "Could not convert: --threads = many" into one of our sentences.
std::string conversion_complaint(const std::string& text) {
  const std::size_t colon = text.find(": "), equals = text.find(" = ");
  if (colon == std::string::npos || equals == std::string::npos || equals < colon) return text;
  return text.substr(colon + 2, equals - colon - 2) + " " + escape_control(text.substr(equals + 3), 40) +
         ": expected a number that is not too large or negative";
}

// "--size: At Most 1 required but received 2" likewise.
std::string count_complaint(const std::string& text) {
  const std::string_view most = ": At Most 1 required but received ";
  const std::size_t at = text.find(most);
  if (at == std::string::npos) return text;
  return fmt::format("{}: is given {} times; give it once", text.substr(0, at), text.substr(at + most.size()));
}

// Removed options, and their replacements.
constexpr std::pair<std::string_view, const char*> kFormerOptions[] = {
    {"--ktx2",
     "--ktx2: pack writes no KTX2 images; use --webp, or make them first with an encoder such as "
     "basisu or toktx; the key texture.format puts blocks into the machine's memory"}};

const char* former_option_complaint(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments)
    for (const auto& [name, text] : kFormerOptions)
      if (std::string_view(argument).substr(0, argument.find('=')) == name) return text;
  return nullptr;
}

// The parser's complaint; for an unexpected argument, with the nearest known one.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> extras = app.remaining(true);
  if (const char* former = former_option_complaint(extras)) return former;
  if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) return conversion_complaint(error.what());
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) return count_complaint(error.what());
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr || extras.empty() || app.get_subcommands().empty())
    return error.what();
  const auto option =
      std::find_if(extras.begin(), extras.end(), [](const std::string& text) { return text.starts_with("-"); });
  if (option == extras.end()) return "unexpected argument '" + escape_control(extras.front(), 80) + "'";
  std::vector<std::string> known;
  for (const CLI::Option* o : app.get_subcommands().front()->get_options())
    for (const std::string& name : o->get_lnames()) known.push_back("--" + name);
  const std::string nearest = nearest_name(option->substr(0, option->find('=')), known);
  return "unknown option '" + escape_control(*option, 80) + "'" +
         (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
}

std::string unknown_command(const std::vector<std::string>& known, const std::string& name) {
  const std::string nearest = nearest_name(name, known);
  return "unknown command '" + escape_control(name, 80) + "'" +
         (nearest.empty() ? "; `tessera --help` lists them" : "; did you mean '" + nearest + "'?");
}

}  // namespace

const std::vector<std::pair<int, const char*>>& exit_statuses() {
  static const std::vector<std::pair<int, const char*>> kStatuses = {
      {0, "done"},
      {1, "fault of the program"},
      {2, "wrong usage"},
      {3, "bad input"},
      {4, "limit exceeded"},
      {5, "compare found more than --threshold allows"},
      {6, "a result could not be written"},
      {130, "stopped by Ctrl-C or SIGTERM, with complete results of the finished work"}};
  return kStatuses;
}

void say_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::fprintf(stderr, "note: %s\n", note.c_str());
}

void add_capture_argument(CLI::App& app, std::string& capture) {
  app.add_option("CAPTURE", capture, "The capture: any glTF 2.0 asset (.gltf or .glb)")->required()->type_name("FILE");
}

void add_machine_options(CLI::App& app, std::string& gpu, std::vector<std::string>& sets, const char* what) {
  app.add_option("--gpu", gpu,
                 fmt::format("The described machine: {} or a JSON file", fmt::join(gpu::preset_names(), ", ")))
      ->type_name("PRESET|FILE")
      ->capture_default_str();
  app.add_option("--set", sets, what)->type_name("KEY=VALUE")->allow_extra_args(false);
}

void add_threads_option(CLI::App& app, unsigned& threads) {
  app.add_option("--threads", threads, "Host threads (default: all). The result does not depend on it")->type_name("N");
}

void add_memory_option(CLI::App& app, double& gib, const char* what) {
  app.add_option("--max-memory", gib, fmt::format("Most memory that {}, in GiB", what))
      ->type_name("GIB")
      ->capture_default_str();
}

std::uint64_t memory_bytes(double gib) {
  return static_cast<std::uint64_t>(check_number("--max-memory", gib, 0, 1048576, true) * 0x1p30);
}

void add_strict_flag(CLI::App& app, bool& strict) {
  app.add_flag("--strict", strict,
               "Refuse every violation of the glTF specification, even one with a clear meaning, instead of "
               "noting it");
}

void add_variant_option(CLI::App& app, std::optional<std::string>& variant) {
  app.add_option("--variant", variant,
                 "Draw this variant's materials (KHR_materials_variants; `tessera inspect` lists the names)")
      ->type_name("NAME");
}

std::string variant_argument(const std::optional<std::string>& variant) {
  return variant ? " --variant " + shell_quoted(*variant) : "";
}

int run_command_line(int argc, char** argv, std::span<const CommandEntry> entries) {
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the file-size limit fails instead of ending the program
  CLI::App app("Tessera: emulates a tile-based deferred GPU that bins patches before tessellation.", "tessera");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("tessera ") + TESSERA_VERSION, "Print the version");
  std::string statuses;
  for (const auto& [status, meaning] : exit_statuses())
    statuses += fmt::format("{}{} {}", statuses.empty() ? "" : ", ", status, meaning);
  app.footer("`tessera COMMAND --help` explains a command. Exit status: " + statuses + ".");

  std::vector<CLI::App*> subs;
  std::vector<std::unique_ptr<Command>> made;
  for (const CommandEntry& entry : entries) {
    subs.push_back(app.add_subcommand(entry.name, entry.about));
    made.push_back(entry.make(*subs.back()));
  }

  std::vector<std::string> names;
  names.reserve(subs.size());
  for (const CLI::App* sub : subs) names.push_back(sub->get_name());
  if (argc > 1 && argv[1][0] != '-' && std::find(names.begin(), names.end(), argv[1]) == names.end())
    return fail(ExitStatus::kUsage, unknown_command(names, argv[1]).c_str());
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    app.exit(help);
    return finish_output();
  } catch (const CLI::CallForVersion& version) {
    app.exit(version);
    return finish_output();
  } catch (const CLI::ParseError& error) {
    return fail(ExitStatus::kUsage, (complaint(app, error) + " (--help explains)").c_str());
  }
  try {
    for (std::size_t i = 0; i < subs.size(); ++i)
      if (subs[i]->parsed()) made[i]->run();
    return finish_output();
  } catch (const EarlyEnd& end) {
    if (!end.line.empty()) std::fprintf(stderr, "%s\n", end.line.c_str());
    const int status = finish_output();
    return status == 0 ? static_cast<int>(end.status) : status;
  } catch (const InputError& error) {
    return fail(ExitStatus::kBadInput, error.what());
  } catch (const UsageError& error) {
    return fail(ExitStatus::kUsage, error.what());
  } catch (const LimitError& error) {
    return fail(ExitStatus::kLimit, error.what());
  } catch (const WriteError& error) {
    return fail(ExitStatus::kCannotWrite, error.what());
  } catch (const std::bad_alloc&) {
    return fail(ExitStatus::kLimit, "out of memory");
  } catch (const std::exception& error) {
    return fail(std::ferror(stdout) != 0 ? ExitStatus::kCannotWrite : ExitStatus::kInternal, error.what());
  }
}

namespace {

// The program runs one command.
std::string& command_line() {
  static std::string text;
  return text;
}

void print_command(const WorkPlace& place) {
  std::string text = "  repeat with: " + command_line();
  if (place.frame >= 0) text += fmt::format(" --frames {}:{}", place.frame, place.frame + 1);
  std::fprintf(stderr, "%s\n", text.c_str());
}

}  // namespace

void repeat_failures_with(std::string command) {
  command_line() = std::move(command);
  set_failure_hook(print_command);
}

}  // namespace tessera::replay
