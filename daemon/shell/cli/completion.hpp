// What a shell offers behind a program's name when the tabulator is pressed, out of what the program's command line
// knows of itself: its commands, their options, and what each takes.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// A script to be read by bash; needs nothing but bash.
[[nodiscard]] std::string bash_completion(const CLI::App& app);
/// A function for zsh, as a file of its $fpath.
[[nodiscard]] std::string zsh_completion(const CLI::App& app);

}  // namespace bmu::command_line
