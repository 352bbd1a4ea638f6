#include "daemon/shell/cli/command_line.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include "daemon/shell/cli/completion.hpp"
#include "daemon/shell/cli/joined.hpp"
#include "daemon/shell/cli/manual_page.hpp"
#include "protocol/number_text.hpp"

namespace bmu::command_line {
namespace {

/// Not shown in --help, and so without a name in the errors of the library; the only such option with a value.
constexpr const char* completion_option = "--completion";

/// Numbers unquoted; quotes show where other words begin and end.
std::string found(const std::string& text) {
  return number_of_text<double>(text) ? text : "'" + text + "'";
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

std::string known_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) names.push_back(command->get_name());
  return joined(names, ", ");
}

/// Error for a word that fits nowhere. CLI11 only reports a missing command where one is misspelt.
std::string stray_text(const CLI::App& app, const std::string& word) {
  if (word.starts_with('-')) return word + ": there is no such option";
  const bool wants_command = app.get_require_subcommand_min() > 0 && app.get_subcommands().empty();
  if (wants_command) return found(word) + " is no command; there are " + known_commands(app);
  return found(word) + " is one word too many";
}

std::string text_of(const CLI::App& app, const CLI::ParseError& error) {
  std::string text = error.what();
  const bool is_required = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  const bool is_stray = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  const std::vector<std::string> strays = app.remaining(true);
  if ((is_required || is_stray) && !strays.empty()) return stray_text(app, strays.front());
  const bool wants_command = app.get_require_subcommand_min() > 0 && app.get_subcommands().empty();
  if (is_required && wants_command) return "a command is missing; there are " + known_commands(app);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) == nullptr) return text;
  const std::string name = text.substr(0, text.find(':'));
  return (name.empty() ? std::string(completion_option) : name) + ": wants one value";
}

/// Control characters of the command line must neither break the line nor control the terminal.
std::string one_line(std::string text) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

}  // namespace

CLI::Validator whole_number(std::uint64_t min, std::uint64_t max) {
  const auto check = [min, max](const std::string& text) -> std::string {
    const std::optional<std::uint64_t> value = number_of_text<std::uint64_t>(text);
    if (value && *value >= min && *value <= max) return "";
    const bool is_bounded = max != std::numeric_limits<std::uint64_t>::max();
    return found(text) + " is not a whole number from " + std::to_string(min) +
           (is_bounded ? " to " + std::to_string(max) : " up");
  };
  return CLI::Validator(check, "");
}

CLI::Validator number(double min, double max) {
  const auto check = [min, max](const std::string& text) -> std::string {
    const std::optional<double> value = number_of_text<double>(text);
    if (value && *value >= min && *value <= max) return "";
    return found(text) + " is not a number from " + number_text(min) + " to " + number_text(max);
  };
  return CLI::Validator(check, "");
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string description = "{" + joined(words, ",") + "}";
  const auto check = [words = std::move(words)](const std::string& text) -> std::string {
    if (std::find(words.begin(), words.end(), text) != words.end()) return "";
    return found(text) + " is none of " + joined(words, ", ");
  };
  return CLI::Validator(check, description);
}

void add_self_description(CLI::App& app, int section) {
  // Ends parsing like --version: before a required option is found to be missing.
  app.add_flag_callback("--man-page",
                        [&app, section] { throw CLI::CallForVersion(manual_page(app, section), exit_ok); })
      ->group("");
  // Checked here, because the library does not name an option that --help does not show.
  const auto complete = [&app](const std::string& shell) {
    if (shell == "bash") throw CLI::CallForVersion(bash_completion(app), exit_ok);
    if (shell == "zsh") throw CLI::CallForVersion(zsh_completion(app), exit_ok);
    throw CLI::ValidationError(completion_option, found(shell) + " is none of bash, zsh");
  };
  app.add_option_function<std::string>(completion_option, complete)->group("");
}

int report(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  const std::string& program = app.get_name();
  std::fprintf(stderr, "%s: %s (see %s --help)\n", program.c_str(), one_line(text_of(app, error)).c_str(),
               program.c_str());
  return exit_usage;
}

}  // namespace bmu::command_line
