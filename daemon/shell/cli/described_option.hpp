// An option as those see it who describe it to somebody: a manual page, a shell.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// What the shell may offer for a value.
enum class ValueKind : std::uint8_t {
  none,      // the option takes no value
  anything,  // one that nobody can guess
  words,     // one of a few
  file,
  folder,
  bus,  // a CAN interface, or unix:NAME
};

struct DescribedOption {
  std::vector<std::string> names;  // with their dashes; of a positional none
  std::string value_name;          // "" if it takes none
  std::string description;
  std::string default_text;  // "" if there is none, or it is not told
  ValueKind kind = ValueKind::none;
  std::vector<std::string> words;  // of kind `words`
  bool is_repeated = false;        // takes several values, or as many as are given
};

/// All that are shown in --help, in its order: the positionals, or those with dashes. One that can be given either way
/// is one with dashes.
[[nodiscard]] std::vector<DescribedOption> described_options(const CLI::App& app, bool positionals);

/// The commands of a program or of one of its commands, in the order of --help.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app);

/// "bmuctl modules accept": with the names of all that it is a command of.
[[nodiscard]] std::string full_name(const CLI::App& app);

}  // namespace bmu::command_line
