// Shared by the command lines of the tools. A mistake gets a single line: the option, the text that was given and
// what would have been right.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "daemon/shell/cli/exit_codes.hpp"

namespace bmu::command_line {

using exit_codes::exit_ok;
using exit_codes::exit_usage;

// Checks of an option's text, where CLI11's own would answer with its internals or with the digits of the largest
// double.
[[nodiscard]] CLI::Validator whole_number(std::uint64_t min,
                                          std::uint64_t max = std::numeric_limits<std::uint64_t>::max());
[[nodiscard]] CLI::Validator number(double min, double max);
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> words);

/// Adds --man-page and --completion SHELL, by which the program describes itself to whoever installs it. They are not
/// in --help. `section` is that of the manual page. Call it when all else has been added; the app outlives the parsing.
void add_self_description(CLI::App& app, int section);

/// Prints what parsing ended with: help or version on standard output, a mistake on standard error. The exit code.
[[nodiscard]] int report(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bmu::command_line
