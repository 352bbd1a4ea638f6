// Standard output of a tool that shows something: what of it could not be written is told at the end, once.
//
//   int main(...) { return end_output("bmuctl", run(...)); }
//
// A reader that has gone (`| head`) has seen what it wanted, and is no failure.
#pragma once

#include <string>

namespace bmu {

/// Writes all of it, past stdio. After a failure nothing more is written.
void write_out(const std::string& text);
/// Something could not be written, and not because its reader has gone.
[[nodiscard]] bool has_output_failed();
/// Writes what stdio still has, through which the standard streams go. Returns `status`; if something could not be
/// written it says so on standard error, by the program's name, and returns exit_system.
[[nodiscard]] int end_output(const char* program, int status);

}  // namespace bmu
