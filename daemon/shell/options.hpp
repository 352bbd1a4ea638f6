// Command line of bmud, and the default paths of omitted options.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/shell/system/real_time.hpp"

namespace bmu {

// Numbers as in sysexits.h, except 2; services and scripts rely on them.
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
  int exit_code = exit_ok;  // without options: --help or --version, or an error of the command line
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

// Each is the option, otherwise a path in the state folder of the service manager (STATE_DIRECTORY), otherwise "".
[[nodiscard]] std::string state_path(const Options& options);
/// Default: beside the state file. Absolute: a reader of the path may have another working directory.
[[nodiscard]] std::string history_path(const Options& options);
[[nodiscard]] std::string black_box_folder(const Options& options);

}  // namespace bmu
