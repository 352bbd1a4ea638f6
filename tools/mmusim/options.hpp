// The command line of mmusim.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/shell/cli/exit_codes.hpp"

namespace bmu::sim {

// Exit codes, as --help lists them.
using exit_codes::exit_config;
using exit_codes::exit_data;
using exit_codes::exit_ok;
using exit_codes::exit_system;
using exit_codes::exit_usage;
inline constexpr int exit_failed = 3;

struct Options {
  std::string bus;          // empty: the bus in the pack file
  std::string charger_bus;  // likewise
  std::string vehicle_bus;
  std::string inverter_bus;
  std::string second_pack_bus;
  std::string pack;
  std::string scenario;  // empty: at rest, vehicle off
  std::string events;    // "-": standard input; empty: only those of the script
  std::string record;    // empty: no recording
  std::optional<double> seconds;
  std::uint64_t seed = 1;  // 0: no measurement noise
  std::uint32_t frame_spacing_us = 250;
  bool has_master = false;  // beside the pack in this process; implies virtual time
  bool is_virtual = false;
  bool is_json = false;
  bool is_quiet = false;
  bool only_check = false;
  bool only_properties = false;
};

struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;  // if there are no options: help was requested, or the command line is wrong
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace bmu::sim
