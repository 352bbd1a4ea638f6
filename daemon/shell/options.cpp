#include "daemon/shell/options.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <CLI/CLI.hpp>
#include <sys/un.h>

#include "config/fields/pack_fields.hpp"
#include "daemon/shell/cli/command_line.hpp"

namespace bmu {

namespace {

constexpr const char* footer = R"(Examples:
  bmud --check-config config/packs/demo-48s.json
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock
  bmud --config /etc/bmud/pack.json --bus-internal can0 --bus-vehicle can1
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock --state /tmp/bmud-state.json
  bmud --open-gpio --config /etc/bmud/pack.json --driven-lines /run/bmud/driven-lines.json
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock --record /tmp/drive

The state file keeps what must survive a restart: fault counters, clear records, latches, contactor wear. --state FILE
sets its path; the default is state.json in systemd's STATE_DIRECTORY; without either there is none. The history
database has one row per minute: --history FILE.sqlite, by default history.sqlite beside the state file; --history none
switches it off.

The last minutes are buffered in memory. When the pack opens, or a fault latches, they and the following ten seconds
are written to a file in the --black-box directory; the default is black-box in STATE_DIRECTORY; without either there is
none. "none" switches it off. --record writes everything. bmureplay replays both.

On --serial DEVICE, or the pack file's serial/device, a serial console takes CellC:xx, LogReq and Help at 38400 Bd:
docs/serial.md.

--realtime-priority and --lock-memory are for a busy host: docs/performance.md. They require the limits RLIMIT_RTPRIO
and RLIMIT_MEMLOCK, or the capabilities CAP_SYS_NICE and CAP_IPC_LOCK; without the permission the daemon does not start
(71). bmud.service forbids --realtime-priority: systemd sets the priority, by the drop-in realtime.conf.

A bus is the name of a CAN interface, or unix:NAME for the embedded bus between programs of this host.

SIGHUP reloads the pack file like "bmuctl reload": only with open contactors, completely or not at all; the log shows
the changes, or the reason of a refusal. Options of the command line keep their values.

Exit codes: 0 ended by SIGTERM, SIGINT or a terminal that hung up, with all contactors commanded open (the log shows if
this was not confirmed); 2 command line; 70 internal software error;
71 system error: at start, e.g. of a bus, or of the status socket or the state file because its directory is missing;
later of a call or memory that the control loop needs, after the contactors were commanded open; or, at any time, a
second master on the internal bus to which this daemon yields: before it has sent anything, or while its modules are
asleep;
78 the configuration is wrong, or the interface of the internal bus is set to a bitrate that it does not work with.

--open-gpio opens the lines of --driven-lines FILE: those that the daemon drove, even if the pack file has changed since
or has an error. Without the option, or without such a file, it opens those of the pack file.

With --open-gpio: 0 all outputs have been switched off, or the pack has none; 71 the chip or one of its lines was not
available (the others have been opened), e.g. in use by a daemon that still runs; 2, 70 and 78 as above.)";

/// One file may be full while the next one grows.
bool has_room_for_two_files(const Options& options) {
  return options.record_total_MB >= 2 * options.record_file_MB;
}

// Checks of option values: the error text, or "". An empty value, e.g. of an unset variable, does not count as an
// omitted option: the user expects the function that would then be missing.

/// A file that turns out not to be a history is quarantined as damaged, so the name must end as that of a history does.
std::string is_history_name(const std::string& name) {
  const bool is_one = name == "none" || name.ends_with(".sqlite");
  return is_one ? "" : "found '" + name + "', expected a name that ends in .sqlite, or none";
}

std::string is_path(const std::string& path) {
  return path.empty() ? "found nothing, expected a path" : "";
}

/// Accepts a file only, not a folder or a device: the daemon replaces it, or quarantines it as damaged.
std::string is_file(const std::string& path) {
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  const bool is_link = std::filesystem::is_symlink(path, error);
  using enum std::filesystem::file_type;
  // E.g. to a medium that is not mounted yet: its data would be missing, and the link would be replaced.
  if (is_link && type == not_found) return "found '" + path + "', a dangling symbolic link, expected a file";
  // A path that cannot be examined is reported when it is read.
  if (type == regular || type == not_found || type == none) return is_path(path);
  return "found '" + path + "', " + (type == directory ? "a directory" : "not a regular file") + ", expected a file";
}

std::string is_bus(const std::string& name) {
  return is_bus_name(name) ? "" : "found '" + name + "', expected " + std::string(bus_form);
}

std::string is_socket_path(const std::string& path) {
  constexpr std::size_t length_max = sizeof(sockaddr_un::sun_path) - 1;
  if (path.size() <= length_max) return is_path(path);
  return "found " + std::to_string(path.size()) + " characters, expected at most " + std::to_string(length_max);
}

/// Error if the daemon would replace a file that holds something else; "" if it is a file of its own.
std::string wrong_driven_lines(const Options& options) {
  if (std::string wrong = is_file(options.driven_lines); !wrong.empty()) return wrong;
  const std::array<std::pair<const char*, std::string>, 3> others{
      {{"--config", options.config}, {"--state", state_path(options)}, {"--history", history_path(options)}}};
  const std::filesystem::path lines = std::filesystem::weakly_canonical(options.driven_lines);
  for (const auto& [option, path] : others) {
    if (path.empty() || std::filesystem::weakly_canonical(path) != lines) continue;
    return "found '" + options.driven_lines + "', which is the file of " + option + ", expected a file of its own";
  }
  return "";
}

void add_options(CLI::App& app, Options& options) {
  // Not "required": an unknown option would be answered with the missing one.
  app.add_option("--config,config", options.config, "pack file (the option name may be omitted)")
      ->type_name("PACK.json");
  app.add_option("--bus-internal", options.bus_internal, "internal bus, instead of the pack file's")
      ->check(is_bus)
      ->type_name("BUS");
  app.add_option("--bus-vehicle", options.bus_vehicle,
                 "vehicle bus, instead of the pack file's; where that has one bus for both, it follows --bus-internal")
      ->check(is_bus)
      ->type_name("BUS");
  app.add_option("--bus-charger", options.bus_charger,
                 "bus of the chargers, instead of the pack file's; it follows the others where it is one of them")
      ->check(is_bus)
      ->type_name("BUS");
  app.add_option("--bus-second-pack", options.bus_second_pack, "bus of the second pack, likewise")
      ->check(is_bus)
      ->type_name("BUS");
  app.add_option("--bus-inverter", options.bus_inverter, "bus of the inverter, likewise")
      ->check(is_bus)
      ->type_name("BUS");
  app.add_option("--socket", options.socket, "status socket for bmuctl")
      ->check(is_socket_path)
      ->type_name("PATH")
      ->capture_default_str();
  app.add_option("--state", options.state, "state file, persists over restarts (see below)")
      ->check(is_file)
      ->type_name("FILE");
  app.add_option("--record", options.record, "record continuously into files in this directory")
      ->check(is_path)
      ->type_name("FOLDER");
  app.add_option("--record-file-MB", options.record_file_MB, "maximum size of a file")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--record-total-MB", options.record_total_MB,
                 "maximum total size, oldest files are deleted; at least twice --record-file-MB")
      ->check(CLI::Range(2, 10'000'000))
      ->capture_default_str();
  app.add_option("--black-box", options.black_box, "directory for black boxes (see below)")
      ->check(is_path)
      ->type_name("FOLDER");
  app.add_option("--serial", options.serial, "terminal device of the serial console, instead of the pack file's")
      ->check(is_path)
      ->type_name("DEVICE");
  app.add_option("--history", options.history, "database with one row per minute, or none (see below)")
      ->check(is_history_name)
      ->type_name("FILE.sqlite");
  app.add_option("--realtime-priority", options.real_time.priority,
                 "run the control loop with this SCHED_FIFO priority; requires the permission (see below)")
      ->check(command_line::whole_number(1, 99))
      ->type_name("1..99");
  app.add_flag("--lock-memory", options.real_time.lock_memory,
               "lock all memory of the daemon into RAM; requires the permission (see below)");
  CLI::Option* check = app.add_flag("--check-config", options.check_config,
                                    "check the pack file, with the buses of the command line, and exit");
  app.add_flag("--open-gpio", options.open_gpio,
               "switch all GPIO outputs off (contactors open) and exit; for use after the daemon has died, e.g. in a "
               "stop hook")
      ->excludes(check);
  app.add_option("--driven-lines", options.driven_lines,
                 "file that lists the driven lines; --open-gpio opens these (see below)")
      ->type_name("FILE");
  app.add_option("--log-level", options.log_level, "minimum severity to log: debug, info, warning, error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}))
      ->capture_default_str();
  app.set_version_flag("--version", "bmud " BMUD_VERSION);
  app.footer(footer);
}

/// Path of `name` in the state folder of the service manager (the first, if there are several); "" if there is none.
std::string in_state_folder(const std::string& name) {
  const char* folders = std::getenv("STATE_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): no thread sets it
  if (folders == nullptr || *folders == '\0') return "";
  const std::string first(folders);
  return first.substr(0, first.find(':')) + "/" + name;
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  Options options;
  CLI::App app(
      "Battery management master: polls the modules, controls the contactors and reports the reason for every "
      "decision.",
      "bmud");
  add_options(app, options);
  command_line::add_self_description(app, 8);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0)
      return {.options = std::nullopt, .exit_code = app.exit(error)};  // --help, --version
    std::fprintf(stderr, "bmud: %s (see bmud --help)\n", error.what());
    return {.options = std::nullopt, .exit_code = exit_command_line};
  }
  if (options.config.empty()) {
    std::fprintf(stderr, "bmud: no pack file given, expected --config PACK.json (see bmud --help)\n");
    return {.options = std::nullopt, .exit_code = exit_command_line};
  }
  // --open-gpio is not refused because of that file: main.cpp then uses the pack file.
  if (!options.open_gpio && app.count("--driven-lines") > 0) {
    if (const std::string wrong = wrong_driven_lines(options); !wrong.empty()) {
      std::fprintf(stderr, "bmud: --driven-lines: %s (see bmud --help)\n", wrong.c_str());
      return {.options = std::nullopt, .exit_code = exit_command_line};
    }
  }
  if (!has_room_for_two_files(options)) {
    const std::string file = std::to_string(options.record_file_MB);
    std::fprintf(stderr,
                 "bmud: --record-total-MB: found %s, expected at least %s: twice --record-file-MB %s, since one file "
                 "is full while the next one grows (see bmud --help)\n",
                 std::to_string(options.record_total_MB).c_str(), std::to_string(2 * options.record_file_MB).c_str(),
                 file.c_str());
    return {.options = std::nullopt, .exit_code = exit_command_line};
  }
  return {.options = options};
}

std::string state_path(const Options& options) {
  return options.state.empty() ? in_state_folder("state.json") : options.state;
}

std::string history_path(const Options& options) {
  if (options.history == "none") return "";
  if (!options.history.empty()) return std::filesystem::absolute(options.history);
  const std::filesystem::path state = state_path(options);
  return state.empty() ? "" : std::filesystem::absolute(state).parent_path() / "history.sqlite";
}

std::string black_box_folder(const Options& options) {
  if (options.black_box == "none") return "";
  return options.black_box.empty() ? in_state_folder("black-box") : options.black_box;
}

}  // namespace bmu
