// The command line of bmureplay.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/cli/exit_codes.hpp"

namespace bmu::replay {

// Exit codes, as --help lists them.
using exit_codes::exit_config;
using exit_codes::exit_damaged;
using exit_codes::exit_ok;
using exit_codes::exit_usage;
inline constexpr int exit_differs = 1;
inline constexpr int exit_not_replayable = exit_codes::exit_data;

struct Options {
  std::vector<std::string> files;
  std::string config;  // empty: the recording's own
  std::size_t differences_max = 10;
  unsigned threads = 0;  // 0: as many as the machine has cores
  bool shows_config = false;
  bool is_json = false;
  bool is_quiet = false;
};

struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;  // if there are no options: help was requested, or the command line is wrong
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace bmu::replay
