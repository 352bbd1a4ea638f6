// A program's manual page out of what its command line knows of itself, so that it cannot tell anything else.
//
// Options and commands become sections; what stands below the options in --help goes where its first words say:
// "Examples:" and "Exit codes" to sections of their own, the rest to the description, an indented block as it is.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// In the language of man(7). `section` is the page's: 1 for programs, 8 for what an administrator runs. Files and
/// other pages worth reading are not known here: whoever installs the page puts them behind it (docs/man).
[[nodiscard]] std::string manual_page(const CLI::App& app, int section);

}  // namespace bmu::command_line
