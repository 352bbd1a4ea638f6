// Exit codes with the same meaning in every tool that has them: a script need not know which one it started. Codes of a
// single tool are in its options.hpp.
#pragma once

namespace bmu::exit_codes {

inline constexpr int exit_ok = 0;
inline constexpr int exit_system = 1;   // something could not be opened, read or written
inline constexpr int exit_usage = 2;    // error of the command line
inline constexpr int exit_damaged = 3;  // damaged parts of the input were left out
inline constexpr int exit_data = 65;    // a data file has unexpected content
inline constexpr int exit_config = 78;  // a file that describes a pack or a cell is invalid

}  // namespace bmu::exit_codes
