// Standard output of a tool: a failed write is reported once, at the end.
//
//   int main(...) { return end_output("bmuctl", run(...)); }
//
// A reader that closed the pipe (`| head`) is no failure.
#pragma once

#include <string>

namespace bmu {

/// Writes all of the text, bypassing stdio. After a failure nothing more is written.
void write_out(const std::string& text);
/// True if a write failed for another reason than a closed reader.
[[nodiscard]] bool has_output_failed();
/// Flushes stdio, which the standard streams use. Returns `status`; if a write failed, reports it on standard error
/// with the program's name, and returns exit_system.
[[nodiscard]] int end_output(const char* program, int status);

}  // namespace bmu
