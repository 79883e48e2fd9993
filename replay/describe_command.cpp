#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "replay/commands.h"
#include "replay/describe.h"
#include "replay/schema/schemas.h"

namespace tessera::replay {
namespace {

class DescribeCommand final : public Command {
 public:
  explicit DescribeCommand(CLI::App& app) {
    app.add_option("TOPIC", topic_, fmt::format("One of {}, schema", fmt::join(describe_topics(), ", ")))
        ->required()
        ->type_name("TOPIC");
    app.add_option("NAME", name_,
                   fmt::format("Of a JSON schema: {}; without, all names", fmt::join(schema_names(), ", ")))
        ->type_name("NAME");
    app.add_flag("--json", json_, "As JSON");
    app.add_flag("--markdown", markdown_, "As the page that docs/ holds");
  }
  void run() override {
    if (topic_ == "schema") {
      fmt::print("{}", name_.empty() ? fmt::format("{}\n", fmt::join(schema_names(), "\n")) : schema_text(name_));
      return;
    }
    if (!name_.empty()) throw UsageError(fmt::format("describe {}: takes no NAME; it is of `describe schema`", topic_));
    if (json_)
      fmt::print("{}\n", describe_json(topic_).dump(2));
    else
      fmt::print("{}", markdown_ ? describe_markdown(topic_) : describe_text(topic_));
  }

 private:
  std::string topic_, name_;
  bool json_ = false, markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_describe_command(CLI::App& app) { return std::make_unique<DescribeCommand>(app); }

}  // namespace tessera::replay
