#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/text.h"
#include "replay/command_tables.h"
#include "replay/commands.h"
#include "replay/describe.h"
#include "replay/machine_difference.h"
#include "replay/schema/schemas.h"

namespace tessera::replay {
namespace {

class DescribeCommand final : public Command {
 public:
  explicit DescribeCommand(CLI::App& app) : app_(app) {
    app.add_option("TOPIC", topic_,
                   fmt::format("One of {}; schema: the JSON schema of a file; man: this program's manual page; "
                               "completion: a script that completes its command lines",
                               fmt::join(describe_topics(), ", ")))
        ->required()
        ->type_name("TOPIC");
    app.add_option("NAME", name_,
                   fmt::format("Of schema: {}, without one the names; of completion: bash or zsh",
                               fmt::join(schema_names(), ", ")))
        ->type_name("NAME");
    app.add_flag("--json", json_, "As JSON");
    app.add_flag("--markdown", markdown_, "As the page that docs/ holds");
    app.add_option("--diff", machines_, "Of gpu: only the keys in which two machines differ")
        ->expected(2)
        ->type_name("PRESET|FILE");
    app.footer(
        "Examples:\n"
        "  tessera describe counters\n"
        "  tessera describe gpu --diff mid-mobile my_machine.json\n"
        "  source <(tessera describe completion bash)\n"
        "  tessera describe schema stats > stats.schema.json\n"
        "  tessera describe man > tessera.1");
  }

  void run() override {
    const bool script = topic_ == "completion", schema = topic_ == "schema";
    if (!name_.empty() && !script && !schema)
      throw UsageError(fmt::format("unexpected argument '{}'", escape_control(name_, 80)));
    if ((script || schema || topic_ == "man") && (json_ || markdown_))
      throw UsageError(fmt::format("describe {}: has one form; leave out --json and --markdown", topic_));
    if (!machines_.empty() && topic_ != "gpu") throw UsageError("--diff: is for `tessera describe gpu`");
    if (script)
      fmt::print("{}", completion());
    else if (schema)
      fmt::print("{}", name_.empty() ? fmt::format("{}\n", fmt::join(schema_names(), "\n")) : schema_text(name_));
    else if (topic_ == "man")
      fmt::print("{}", manual_page(*app_.get_parent()));
    else if (!machines_.empty())
      say_difference();
    else if (json_)
      fmt::print("{}\n", describe_json(topic_).dump(2));
    else
      fmt::print("{}", markdown_ ? describe_markdown(topic_) : describe_text(topic_));
  }

 private:
  std::string completion() const {
    if (name_ == "bash") return bash_completion(*app_.get_parent());
    if (name_ == "zsh") return zsh_completion(*app_.get_parent());
    throw UsageError(name_.empty()
                         ? "describe completion: say for which shell, bash or zsh"
                         : fmt::format("describe completion {}: shells are bash and zsh", escape_control(name_, 40)));
  }

  void say_difference() const {
    if (markdown_) throw UsageError("--diff: has no --markdown");
    if (json_)
      fmt::print("{}\n", json_text(machine_difference(machines_[0], machines_[1]), 2));
    else
      fmt::print("{}", machine_difference_text(machines_[0], machines_[1]));
  }

  CLI::App& app_;
  std::string topic_, name_;
  std::vector<std::string> machines_;
  bool json_ = false, markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_describe_command(CLI::App& app) { return std::make_unique<DescribeCommand>(app); }

}  // namespace tessera::replay
