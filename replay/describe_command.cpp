#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/json_text.h"
#include "base/key_table.h"
#include "base/text.h"
#include "gpu/configuration.h"
#include "gpu/presets.h"
#include "replay/commands.h"
#include "replay/describe.h"
#include "replay/schema/schemas.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Keys in which two machines differ: {"key", "a", "b", "unit", "pass", "meaning"}.
json difference_rows(const gpu::GpuConfiguration& a, const gpu::GpuConfiguration& b) {
  json rows = json::array();
  for (const auto& key : gpu::gpu_keys().keys()) {
    const json first = key_value_json(gpu::gpu_keys().value(a, key)),
               second = key_value_json(gpu::gpu_keys().value(b, key));
    if (first != second)
      rows.push_back({{"key", key.name},
                      {"a", first},
                      {"b", second},
                      {"unit", key.unit},
                      {"pass", key.timing ? "timing" : "function"},
                      {"meaning", key.meaning}});
  }
  return rows;
}

std::string title_of(const std::string& given, const gpu::GpuConfiguration& gpu) {
  std::string name = gpu.name, description = gpu.description;
  if (const gpu::Preset* preset = gpu::find_preset(given); preset != nullptr && name.empty())
    name = preset->name, description = preset->description;
  std::string text = escape_control(name.empty() || name == given ? given : fmt::format("{} ({})", name, given));
  return description.empty() ? text : text + ": " + escape_control(description);
}

std::string value_text(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

// The same as a table, with the names and descriptions of both.
std::string difference_text(const std::string& a, const std::string& b) {
  const gpu::GpuConfiguration first = gpu::load_gpu(a), second = gpu::load_gpu(b);
  std::string text = fmt::format("A  {}\nB  {}\n", title_of(a, first), title_of(b, second));
  const json rows = difference_rows(first, second);
  if (rows.empty()) return text + "no key differs\n";
  text += fmt::format("\n{:<40} {:>14} {:>14}  {}\n", "key", "A", "B", "unit");
  for (const json& row : rows)
    text += fmt::format("{:<40} {:>14} {:>14}  {}\n", row["key"].get<std::string>(), value_text(row["a"]),
                        value_text(row["b"]), row["unit"].get<std::string>());
  return text;
}

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
      fmt::print("{}\n", json_text(difference_rows(gpu::load_gpu(machines_[0]), gpu::load_gpu(machines_[1])), 2));
    else
      fmt::print("{}", difference_text(machines_[0], machines_[1]));
  }

  CLI::App& app_;
  std::string topic_, name_;
  std::vector<std::string> machines_;
  bool json_ = false, markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_describe_command(CLI::App& app) { return std::make_unique<DescribeCommand>(app); }

}  // namespace tessera::replay
