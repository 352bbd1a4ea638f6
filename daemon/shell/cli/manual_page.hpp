// Manual page of a program, generated from the definition of its command line, so that the two cannot differ.
//
// Options and commands become sections; the text below the options in --help is placed by its first words: "Examples:"
// and "Exit codes" in sections of their own, the rest in the description, an indented block as it is.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace bmu::command_line {

/// In the language of man(7). `section` is that of the page: 1 for programs, 8 for those of an administrator. Files and
/// related pages are unknown here: the installation appends them (docs/man).
[[nodiscard]] std::string manual_page(const CLI::App& app, int section);

}  // namespace bmu::command_line
