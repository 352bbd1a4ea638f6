// Shared by the command lines of the tools. An error is a single line: the option, the given text and the expected one.
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

// Checks of an option's text, because those of CLI11 would answer with its internals or with the digits of the largest
// double.
[[nodiscard]] CLI::Validator whole_number(std::uint64_t min,
                                          std::uint64_t max = std::numeric_limits<std::uint64_t>::max());
[[nodiscard]] CLI::Validator number(double min, double max);
[[nodiscard]] CLI::Validator one_of(std::vector<std::string> words);

/// Adds --man-page and --completion SHELL, by which the program describes itself to packagers. They are not in --help.
/// `section` is that of the manual page. Precondition: all else has been added; the app outlives the parsing.
void add_self_description(CLI::App& app, int section);

/// Prints the result of parsing: help or version on standard output, an error on standard error. Returns the exit code.
[[nodiscard]] int report(const CLI::App& app, const CLI::ParseError& error);

}  // namespace bmu::command_line
