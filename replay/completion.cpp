#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/compare/comparison.h"
#include "replay/describe.h"
#include "replay/frame_files.h"
#include "replay/schema/schemas.h"
#include "replay/tradeoff/knobs.h"
#include "replay/tradeoff/results.h"

namespace tessera::replay {
namespace {

using Words = std::vector<std::string>;

// The value after an option, or of an argument.
struct Value {
  Words words;
  bool files = false, list = false, keys = false;  // words in a list with commas; KEY=VALUE
};

bool plain_word(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return std::islower(static_cast<unsigned char>(c)) != 0 || std::isdigit(static_cast<unsigned char>(c)) != 0 ||
           c == '-';
  });
}

Words split(const std::string& text, char separator) {
  Words parts(1);
  for (const char c : text)
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

// Words that no name of a type lists.
const Words* listed_words(const std::string& option) {
  static const std::map<std::string, Words> kWords = [] {
    std::map<std::string, Words> words = {{"--aux", auxiliary_layers()},
                                          {"--method", {"auto", "edgebreaker", "sequential", "none"}},
                                          {"--cost", Words(kCostNames.begin(), kCostNames.end())}};
    Words& knob_words = words["--knobs"];
    for (const Knob& knob : knobs()) knob_words.push_back(knob.name);
    words["--joint"] = knob_words;
    return words;
  }();
  const auto found = kWords.find(option);
  return found == kWords.end() ? nullptr : &found->second;
}

Value value_of(const CLI::App& command, const CLI::Option& option) {
  Value value;
  const std::string type = option.get_type_name();
  if (option.get_positional() && command.get_name() == "describe") {
    value.words = describe_topics();
    value.words.insert(value.words.end(), {"completion", "man", "schema"});
    if (option.get_name() == "NAME") {
      value.words = schema_names();
      value.words.insert(value.words.end(), {"bash", "zsh"});
    }
    return value;
  }
  if (option.get_positional()) {
    value.files = true;
    return value;
  }
  const std::string name = "--" + option.get_lnames().front();
  value.keys = type == "KEY=VALUE";
  value.list = type == "LIST";
  if (const Words* words = listed_words(name)) value.words = *words;
  for (const std::string& part : split(type, '|'))
    if (plain_word(part)) value.words.push_back(part);
  if (type.find("PRESET") != std::string::npos)
    for (const std::string& preset : gpu::preset_names()) value.words.push_back(preset);
  value.files = type.find("FILE") != std::string::npos || type == "DIR" || type == "HEIGHTS[,SCALE[,BIAS]]";
  return value;
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

// The options with long names; --help belongs to every command.
std::vector<const CLI::Option*> options_of(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return !option->get_lnames().empty(); });
}

std::vector<const CLI::Option*> arguments_of(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return option->get_positional(); });
}

std::string joined(const Words& words) { return fmt::format("{}", fmt::join(words, " ")); }

// "shading.rate) words="pixel sample" ;;" for each key that takes words.
std::string key_cases() {
  std::string text;
  const auto add = [&](const KeyInfo& key, const KeyValue& value) {
    Words words(key.choices.begin(), key.choices.end());
    if (std::holds_alternative<bool>(value)) words = {"true", "false"};
    if (!words.empty()) text += fmt::format("    {}) words=\"{}\" ;;\n", key.name, joined(words));
  };
  for (const auto& key : gpu::settings_keys().keys()) add(key, gpu::settings_keys().default_value(key));
  for (const auto& key : gpu::gpu_keys().keys()) add(key, gpu::gpu_keys().default_value(key));
  return text;
}

std::string bash_value(const Value& value) {
  if (value.keys) return "_tessera_keys";
  std::string text;
  if (!value.words.empty())
    text = fmt::format("{} \"{}\"", value.list ? "_tessera_list" : "_tessera_words", joined(value.words));
  if (value.files) text += text.empty() ? "_tessera_files" : "; _tessera_files";
  return text.empty() ? ":" : text;
}

// An option's line in the `case` of a command: completion of the option's value.
std::string bash_cases(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : options_of(command)) {
    if (option->get_items_expected_max() == 0) continue;  // a flag
    text += fmt::format("        --{}) {}; return ;;\n", option->get_lnames().front(),
                        bash_value(value_of(command, *option)));
  }
  return text;
}

Words option_names(const CLI::App& command) {
  Words names;
  for (const CLI::Option* option : options_of(command)) names.push_back("--" + option->get_lnames().front());
  std::sort(names.begin(), names.end());
  return names;
}

// A text in single quotes for zsh: characters that are special in the specifications of _arguments are escaped.
std::string zsh_text(const std::string& text, const char* special = "[]:\\") {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (std::string_view(special).find(c) != std::string_view::npos)
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

std::string zsh_action(const Value& value) {
  if (value.keys) return "_tessera_keys";
  if (value.list) return fmt::format("_values -s , word {}", joined(value.words));
  if (value.words.empty()) return value.files ? "_files" : " ";
  if (value.files)
    return fmt::format("_alternative 'words\\:word\\:({})' 'files\\:file\\:_files'", joined(value.words));
  return fmt::format("({})", joined(value.words));
}

std::string zsh_specification(const CLI::App& command, const CLI::Option& option) {
  const std::string name = "--" + option.get_lnames().front();
  const bool repeats = option.get_type_name() == "KEY=VALUE";
  std::string text = fmt::format("'{}{}[{}]", repeats ? "*" : "", name, zsh_text(option.get_description()));
  if (option.get_items_expected_max() == 0) return text + "'";
  const bool optional = option.get_items_expected_min() == 0;
  return text + fmt::format("{}{}:{}'", optional ? "::" : ":", zsh_text(option.get_type_name()),
                            zsh_text(zsh_action(value_of(command, option)), ""));
}

}  // namespace

std::string bash_completion(const CLI::App& program) {
  std::string text =
      "# Completion of tessera for bash, made by `tessera describe completion bash`.\n\n"
      "_tessera_words() { mapfile -t -O \"${#COMPREPLY[@]}\" COMPREPLY < <(compgen -W \"$1\" -- \"$cur\"); }\n"
      "_tessera_files() {\n"
      "  compopt -o filenames 2>/dev/null\n"
      "  mapfile -t -O \"${#COMPREPLY[@]}\" COMPREPLY < <(compgen -f -- \"$cur\")\n"
      "}\n"
      "# The last word of a list with commas.\n"
      "_tessera_list() {\n"
      "  local before=\"\" last=$cur\n"
      "  case $cur in *,*) before=${cur%,*}, last=${cur##*,} ;; esac\n"
      "  mapfile -t COMPREPLY < <(compgen -P \"$before\" -W \"$1\" -- \"$last\")\n"
      "}\n"
      "# KEY=VALUE; bash takes the equals sign for a word of its own.\n"
      "_tessera_keys() {\n"
      "  if [ -n \"$key\" ]; then\n"
      "    local words=\"\"\n"
      "    case $key in\n";
  text += key_cases();
  text += "    esac\n    _tessera_words \"$words\"\n    return\n  fi\n  compopt -o nospace 2>/dev/null\n";
  text +=
      fmt::format("  mapfile -t COMPREPLY < <(compgen -S = -W \"{}\" -- \"$cur\")\n}}\n\n", joined(gpu::known_keys()));
  Words names;
  for (const CLI::App* command : commands_of(program)) names.push_back(command->get_name());
  text +=
      "_tessera() {\n"
      "  local cur=${COMP_WORDS[COMP_CWORD]} at=$((COMP_CWORD - 1)) prev key=\"\" command=${COMP_WORDS[1]}\n"
      "  COMPREPLY=()\n"
      "  # \"--option=word\" and \"--set key=word\" are three words.\n"
      "  if [ \"$cur\" = = ]; then\n"
      "    cur=\"\" key=${COMP_WORDS[at]} at=$((at - 1))\n"
      "  elif [ \"${COMP_WORDS[at]}\" = = ] && [ \"$at\" -gt 1 ]; then\n"
      "    key=${COMP_WORDS[at - 1]} at=$((at - 2))\n"
      "  fi\n"
      "  case $key in --*) at=$((at + 1)) key=\"\" ;; esac\n"
      "  prev=${COMP_WORDS[at]}\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n";
  text +=
      fmt::format("    _tessera_words \"{} --help --version\"\n    return\n  fi\n  case $command in\n", joined(names));
  for (const CLI::App* command : commands_of(program)) {
    text += fmt::format("    {})\n      case $prev in\n{}      esac\n", command->get_name(), bash_cases(*command));
    text +=
        fmt::format("      case $cur in -*) _tessera_words \"{}\"; return ;; esac\n", joined(option_names(*command)));
    const std::vector<const CLI::Option*> arguments = arguments_of(*command);
    if (command->get_name() == "describe") {
      text += "      case $prev in completion) _tessera_words \"bash zsh\"; return ;; esac\n";
      text +=
          fmt::format("      case $prev in schema) _tessera_words \"{}\"; return ;; esac\n", joined(schema_names()));
      text += fmt::format("      {}\n", bash_value(value_of(*command, *arguments.front())));
    } else {
      text += arguments.empty() ? "      :\n" : "      _tessera_files\n";
    }
    text += "      ;;\n";
  }
  return text + "  esac\n}\n\ncomplete -F _tessera tessera ./tessera\n";
}

std::string zsh_completion(const CLI::App& program) {
  std::string text =
      "#compdef tessera\n"
      "# Completion of tessera for zsh, made by `tessera describe completion zsh`.\n\n"
      "_tessera_keys() {\n"
      "  local -a keys\n";
  text += fmt::format("  keys=({})\n", joined(gpu::known_keys()));
  text +=
      "  if compset -P '*='; then\n"
      "    local key=${IPREFIX%=} words=\"\"\n"
      "    case ${key##*=} in\n" +
      key_cases() +
      "    esac\n"
      "    compadd -- ${=words}\n"
      "  else\n"
      "    compadd -S = -- $keys\n"
      "  fi\n"
      "}\n\n"
      "_tessera() {\n"
      "  local curcontext=$curcontext state line\n"
      "  local -a commands\n"
      "  commands=(\n";
  for (const CLI::App* command : commands_of(program))
    text += fmt::format("    '{}:{}'\n", command->get_name(), zsh_text(command->get_description(), ":"));
  text +=
      "  )\n"
      "  _arguments -C '1:command:->command' '*::argument:->argument'\n"
      "  case $state in\n"
      "    command) _describe command commands ;;\n"
      "    argument)\n"
      "      case $words[1] in\n";
  for (const CLI::App* command : commands_of(program)) {
    text += fmt::format("        {})\n          _arguments", command->get_name());
    for (const CLI::Option* option : options_of(*command))
      text += " \\\n            " + zsh_specification(*command, *option);
    std::size_t place = 0;
    for (const CLI::Option* argument : arguments_of(*command))
      text += fmt::format(" \\\n            '{}:{}:{}'",
                          argument->get_items_expected_max() > 1 ? "*" : std::to_string(++place), argument->get_name(),
                          zsh_action(value_of(*command, *argument)));
    text += "\n          ;;\n";
  }
  return text + "      esac\n      ;;\n  esac\n}\n\n_tessera \"$@\"\n";
}

}  // namespace tessera::replay
