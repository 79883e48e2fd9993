#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "replay/commands.h"
#include "replay/describe.h"

namespace tessera::replay {
namespace {

class DescribeCommand final : public Command {
 public:
  explicit DescribeCommand(CLI::App& app) {
    app.add_option("TOPIC", topic_, fmt::format("One of {}", fmt::join(describe_topics(), ", ")))
        ->required()
        ->type_name("TOPIC");
    app.add_flag("--json", json_, "As JSON");
    app.add_flag("--markdown", markdown_, "As the page that docs/ holds");
  }
  void run() override {
    if (json_)
      fmt::print("{}\n", describe_json(topic_).dump(2));
    else
      fmt::print("{}", markdown_ ? describe_markdown(topic_) : describe_text(topic_));
  }

 private:
  std::string topic_;
  bool json_ = false, markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_describe_command(CLI::App& app) { return std::make_unique<DescribeCommand>(app); }

}  // namespace tessera::replay
