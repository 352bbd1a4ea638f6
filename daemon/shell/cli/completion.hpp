// Shell completion of a program, generated from the definition of its command line: its commands, their options, and
// the values of each.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// A script to be read by bash; needs nothing else.
[[nodiscard]] std::string bash_completion(const CLI::App& app);
/// A function for zsh, as a file of its $fpath.
[[nodiscard]] std::string zsh_completion(const CLI::App& app);

}  // namespace bmu::command_line
