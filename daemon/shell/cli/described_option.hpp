// An option in the form needed to describe it: for a manual page, for a shell.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// Kind of value, for shell completion.
enum class ValueKind : std::uint8_t {
  none,      // the option takes no value
  anything,  // no suggestion is possible
  words,     // one of a few
  file,
  folder,
  bus,  // a CAN interface, or unix:NAME
};

struct DescribedOption {
  std::vector<std::string> names;  // with their dashes; none for a positional
  std::string value_name;          // "" without a value
  std::string description;
  std::string default_text;  // "" if there is none, or it is not shown
  ValueKind kind = ValueKind::none;
  std::vector<std::string> words;  // of kind `words`
  bool is_repeated = false;        // takes several values, or as many as are given
};

/// All options that --help shows, in its order: the positionals, or those with dashes. One that can be given either way
/// is one with dashes.
[[nodiscard]] std::vector<DescribedOption> described_options(const CLI::App& app, bool positionals);

/// The commands of a program or of one of its commands, in the order of --help.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app);

/// "bmuctl modules accept": with the names of all its parents.
[[nodiscard]] std::string full_name(const CLI::App& app);

}  // namespace bmu::command_line
