#include "daemon/shell/cli/completion.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "daemon/shell/cli/described_option.hpp"
#include "daemon/shell/cli/joined.hpp"

namespace bmu::command_line {
namespace {

std::vector<std::string> names_of(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return names;
}

/// A program and all its commands, each before its subcommands.
void collect(const CLI::App& app, std::vector<const CLI::App*>& out) {
  out.push_back(&app);
  for (const CLI::App* command : commands_of(app)) collect(*command, out);
}

std::vector<const CLI::App*> whole_tree(const CLI::App& app) {
  std::vector<const CLI::App*> all;
  collect(app, all);
  return all;
}

/// Options permitted at a place: those of the command and, if the program lets options follow its commands, those of
/// all its parents.
std::vector<DescribedOption> options_at(const CLI::App& app) {
  std::vector<DescribedOption> all = described_options(app, false);
  const CLI::App* parent = app.get_parent();
  if (parent == nullptr || !parent->get_fallthrough()) return all;
  for (DescribedOption& option : options_at(*parent)) {
    const auto is_same = [&](const DescribedOption& other) { return other.names == option.names; };
    if (std::none_of(all.begin(), all.end(), is_same)) all.push_back(std::move(option));
  }
  return all;
}

// --- bash -----------------------------------------------------------------------------------------------------------

constexpr std::string_view bash_buses = "$(cd /sys/class/net 2>/dev/null && compgen -G '*can*')";

/// One word per line: names of files may have spaces.
std::string bash_compgen(const std::string& what) {
  return "mapfile -t COMPREPLY < <(compgen " + what + " -- \"$word\")";
}

std::string bash_words(const std::string& words) {
  return bash_compgen("-W " + words);
}

/// The command that stores the matches in COMPREPLY.
std::string bash_offer(const DescribedOption& option) {
  switch (option.kind) {
    case ValueKind::words: return bash_words("'" + joined(option.words, " ") + "'");
    case ValueKind::file: return "compopt -o filenames; " + bash_compgen("-f");
    case ValueKind::folder: return "compopt -o filenames; " + bash_compgen("-d");
    case ValueKind::bus: return bash_words("\"" + std::string(bash_buses) + "\"");
    case ValueKind::none:
    case ValueKind::anything: break;
  }
  return "COMPREPLY=()";
}

/// case "$place" in: the values for the word before, then all else that may stand here.
std::string bash_place(const CLI::App& app) {
  std::string text = "    '" + full_name(app) + "')\n      case $before in\n";
  std::vector<std::string> words;
  for (const DescribedOption& option : options_at(app)) {
    words.insert(words.end(), option.names.begin(), option.names.end());
    if (option.kind != ValueKind::none) {
      text += "        " + joined(option.names, " | ") + ") " + bash_offer(option) + "; return ;;\n";
    }
  }
  text +=
      "      esac\n      if [[ $word == -* ]]; then " + bash_words("'" + joined(words, " ") + "'") + "; return; fi\n";
  const std::vector<DescribedOption> positionals = described_options(app, true);
  if (const auto commands = commands_of(app); !commands.empty()) {
    text += "      " + bash_words("'" + joined(names_of(commands), " ") + "'") + "\n";
  } else if (!positionals.empty()) {
    text += "      " + bash_offer(positionals.front()) + "\n";
  }
  return text + "      ;;\n";
}

/// case "$place $each" in: the words that lead on to a command.
std::string bash_way(const CLI::App& app) {
  std::string text;
  for (const CLI::App* each : whole_tree(app)) {
    if (each != &app) text += (text.empty() ? "'" : " | '") + full_name(*each) + "'";
  }
  if (text.empty()) return "";
  return "  local each\n  for each in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    case \"$place $each\" in\n      " +
         text + ") place+=\" $each\" ;;\n    esac\n  done\n";
}

// --- zsh ------------------------------------------------------------------------------------------------------------

/// Escaped for '...' and the brackets of _arguments.
std::string zsh_text(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, text.find('\n'))) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return out;
}

std::string zsh_value(const DescribedOption& option) {
  const std::string name = zsh_text(option.value_name.empty() ? "value" : option.value_name);
  switch (option.kind) {
    case ValueKind::none: return "";
    case ValueKind::words: return ":" + name + ":(" + joined(option.words, " ") + ")";
    case ValueKind::file: return ":" + name + ":_files";
    case ValueKind::folder: return ":" + name + ":_files -/";
    case ValueKind::bus: return ":" + name + ":_net_interfaces";
    case ValueKind::anything: break;
  }
  return ":" + name + ": ";
}

std::string zsh_option(const DescribedOption& option) {
  const std::string many = option.is_repeated ? "*" : "";
  std::string text;
  for (const std::string& name : option.names) {
    text += " \\\n    '";
    text += many;
    text += name;
    text += "[" + zsh_text(option.description) + "]" + zsh_value(option) + "'";
  }
  return text;
}

/// _bmuctl_modules_accept
std::string zsh_function(const CLI::App& app) {
  std::string name = "_" + full_name(app);
  std::replace(name.begin(), name.end(), ' ', '_');
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string zsh_commands(const std::vector<const CLI::App*>& commands) {
  std::string text = "  local -a commands=(\n";
  for (const CLI::App* command : commands) {
    std::string description = zsh_text(command->get_description());
    text += "    '" + command->get_name() + ":" + description + "'\n";
  }
  text += "  )\n  case $state in\n    command) _describe command commands ;;\n    rest)\n      case $words[1] in\n";
  for (const CLI::App* command : commands) {
    text += "        " + command->get_name() + ") " + zsh_function(*command) + " ;;\n";
  }
  return text + "      esac\n      ;;\n  esac\n";
}

std::string zsh_place(const CLI::App& app) {
  const std::vector<const CLI::App*> commands = commands_of(app);
  std::string text = zsh_function(app) + "() {\n";
  if (!commands.empty()) text += "  local state line\n";
  text += commands.empty() ? "  _arguments -S" : "  _arguments -C";
  for (const DescribedOption& option : options_at(app)) text += zsh_option(option);
  if (!commands.empty()) {
    text += " \\\n    '1: :->command' \\\n    '*:: :->rest'\n" + zsh_commands(commands);
  } else {
    for (const DescribedOption& option : described_options(app, true)) {
      text += std::string(" \\\n    '") + (option.is_repeated ? "*" : "") + zsh_value(option) + "'";
    }
    text += "\n";
  }
  return text + "}\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  const std::string& name = app.get_name();
  std::string text = "# bash completion for " + name + "; made by: " + name + " --completion bash\n_" + name +
                     "() {\n  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} place='" + name +
                     "'\n  COMPREPLY=()\n";
  text += bash_way(app) + "  case $place in\n";
  for (const CLI::App* each : whole_tree(app)) text += bash_place(*each);
  return text + "  esac\n}\ncomplete -F _" + name + " " + name + "\n";
}

std::string zsh_completion(const CLI::App& app) {
  const std::string& name = app.get_name();
  std::string text =
      "#compdef " + name + "\n# zsh completion for " + name + "; made by: " + name + " --completion zsh\n";
  for (const CLI::App* each : whole_tree(app)) text += zsh_place(*each);
  return text + "_" + name + " \"$@\"\n";
}

}  // namespace bmu::command_line
