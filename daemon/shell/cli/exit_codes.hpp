// Exit codes that mean the same in every tool that has them: a script need not know which one it started. What only one
// tool can say stands in its options.hpp.
#pragma once

namespace bmu::exit_codes {

inline constexpr int exit_ok = 0;
inline constexpr int exit_system = 1;   // something could not be opened, read or written
inline constexpr int exit_usage = 2;    // the command line
inline constexpr int exit_damaged = 3;  // some of what was read was damaged and left out
inline constexpr int exit_data = 65;    // a file of data does not say what it should
inline constexpr int exit_config = 78;  // a file that describes a pack or a cell is wrong

}  // namespace bmu::exit_codes
