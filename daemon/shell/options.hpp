// The command line of bmud, and where what it leaves out is.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/shell/system/real_time.hpp"

namespace bmu {

// sysexits.h has the same numbers; services and scripts know them.
inline constexpr int exit_ok = 0;
inline constexpr int exit_command_line = 2;
inline constexpr int exit_internal = 70;
inline constexpr int exit_system = 71;
inline constexpr int exit_config = 78;

struct Options {
  std::string config;
  std::string bus_internal;
  std::string bus_vehicle;
  std::string bus_charger;
  std::string bus_second_pack;
  std::string bus_inverter;
  std::string socket = "/run/bmud/bmud.sock";
  std::string state;
  std::string record;
  std::uint64_t record_file_MB = 16;
  std::uint64_t record_total_MB = 1000;
  std::string black_box;
  std::string serial;
  std::string history;
  std::string driven_lines;
  std::string log_level = "info";
  RealTimeWishes real_time;
  bool check_config = false;
  bool open_gpio = false;
};

struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;  // when there are none: help was asked for, or the line is wrong
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

// Each the option, else in the folder that the service manager made for us (STATE_DIRECTORY), else "": nowhere.
[[nodiscard]] std::string state_path(const Options& options);
/// Else beside the state. Absolute: who is told where it is may be somewhere else.
[[nodiscard]] std::string history_path(const Options& options);
[[nodiscard]] std::string black_box_folder(const Options& options);

}  // namespace bmu
