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

What has to outlive the daemon (how often each fault came, who cleared it, locks, the wear of contactors) is kept in
--state FILE; without the option in state.json where systemd's STATE_DIRECTORY points, and else nowhere. What the pack did is kept in a
database, a row a minute: --history FILE.sqlite, by default history.sqlite beside the state; --history none: not at all.

The last minutes are kept in memory. When the pack opens, or a fault latches, what was before and the ten seconds after
go to a file in the --black-box folder; without the option in black-box where STATE_DIRECTORY points, and else nowhere.
"none" switches it off. --record writes everything. bmureplay runs both again.

On --serial DEVICE, or the pack file's serial/device, a serial console takes CellC:xx, LogReq and Help at 38400 Bd:
docs/serial.md.

--realtime-priority and --lock-memory are for a machine that is busy with other things: docs/performance.md. They need
the limits RLIMIT_RTPRIO and RLIMIT_MEMLOCK, or the capabilities CAP_SYS_NICE and CAP_IPC_LOCK; without the right the
daemon does not start (71). bmud.service forbids --realtime-priority: there systemd gives the priority, by the drop-in
realtime.conf.

A bus is the name of a CAN interface, or unix:NAME for the bus between programs of this machine.

SIGHUP takes up the pack file anew, as "bmuctl reload" does: while the pack is open, all of it or nothing; the log says what
has changed, or why it was refused. What the command line says stays as it is.

Exit codes: 0 ended by SIGTERM, SIGINT or a terminal that hung up, with all contactors commanded open (the log says if nobody
confirmed it); 2 command line; 70 an error of our own;
71 the system refused something: at start, as a bus, or the status socket or the state file because its directory is
missing; later a call or memory that the control loop needs, and then the contactors are commanded open first; or, at any
time, a second master on the internal bus where this daemon gives way: before it has sent anything, or while its pack rests;
78 the configuration is wrong, or the interface of the internal bus is set to a bit rate that it does not work with.

--open-gpio opens the lines that --driven-lines FILE names: those that the daemon drove, though the pack file may have
changed since, or have a mistake. Without the option, or where there is no such file, it opens those of the pack file.

With --open-gpio: 0 all outputs have been driven open, or the pack has none; 71 the chip, or a line of it, could not be had
(the others have been opened), as one that is in use by a daemon that still runs; 2, 70 and 78 as above.)";

/// One file may be full while the next one grows.
bool has_room_for_two_files(const Options& options) {
  return options.record_total_MB >= 2 * options.record_file_MB;
}

// Checks of option values: the error text, or "". An empty value, e.g. of an unset variable, does not count as an
// omitted option: the user expects the function that would then be missing.

/// A file that turns out not to be a history is quarantined as damaged, so the name must end as that of a history does.
std::string is_history_name(const std::string& name) {
  const bool is_one = name == "none" || name.ends_with(".sqlite");
  return is_one ? "" : "found '" + name + "', wanted a name that ends in .sqlite, or none";
}

std::string is_path(const std::string& path) {
  return path.empty() ? "found nothing, wanted a path" : "";
}

/// Accepts a file only, not a folder or a device: the daemon replaces it, or quarantines it as damaged.
std::string is_file(const std::string& path) {
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  const bool is_link = std::filesystem::is_symlink(path, error);
  using enum std::filesystem::file_type;
  // E.g. to a medium that is not mounted yet: its data would be missing, and the link would be replaced.
  if (is_link && type == not_found) return "found '" + path + "', a link that leads nowhere, wanted a file";
  // A path that cannot be examined is reported when it is read.
  if (type == regular || type == not_found || type == none) return is_path(path);
  return "found '" + path + "', " + (type == directory ? "a folder" : "no regular file") + ", wanted a file";
}

std::string is_bus(const std::string& name) {
  return is_bus_name(name) ? "" : "found '" + name + "', wanted " + std::string(bus_form);
}

std::string is_socket_path(const std::string& path) {
  constexpr std::size_t length_max = sizeof(sockaddr_un::sun_path) - 1;
  if (path.size() <= length_max) return is_path(path);
  return "found " + std::to_string(path.size()) + " characters, wanted at most " + std::to_string(length_max);
}

/// Error if the daemon would replace a file that holds something else; "" if it is a file of its own.
std::string wrong_driven_lines(const Options& options) {
  if (std::string wrong = is_file(options.driven_lines); !wrong.empty()) return wrong;
  const std::array<std::pair<const char*, std::string>, 3> others{
      {{"--config", options.config}, {"--state", state_path(options)}, {"--history", history_path(options)}}};
  const std::filesystem::path lines = std::filesystem::weakly_canonical(options.driven_lines);
  for (const auto& [option, path] : others) {
    if (path.empty() || std::filesystem::weakly_canonical(path) != lines) continue;
    return "found '" + options.driven_lines + "', which is the file of " + option + ", wanted one of its own";
  }
  return "";
}

void add_options(CLI::App& app, Options& options) {
  // Not "required": an unknown option would be answered with the missing one.
  app.add_option("--config,config", options.config, "the pack's file, with or without the option's name")
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
  app.add_option("--state", options.state, "file for what outlives the daemon (see below)")
      ->check(is_file)
      ->type_name("FILE");
  app.add_option("--record", options.record, "record everything into files of this folder")
      ->check(is_path)
      ->type_name("FOLDER");
  app.add_option("--record-file-MB", options.record_file_MB, "the next file after this size")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--record-total-MB", options.record_total_MB,
                 "the oldest files go when all are larger; at least twice --record-file-MB")
      ->check(CLI::Range(2, 10'000'000))
      ->capture_default_str();
  app.add_option("--black-box", options.black_box, "what was around an opening goes here (see below)")
      ->check(is_path)
      ->type_name("FOLDER");
  app.add_option("--serial", options.serial, "terminal device of the serial console, instead of the pack file's")
      ->check(is_path)
      ->type_name("DEVICE");
  app.add_option("--history", options.history, "database for a row a minute, or none (see below)")
      ->check(is_history_name)
      ->type_name("FILE.sqlite");
  app.add_option("--realtime-priority", options.real_time.priority,
                 "the control loop before all ordinary programs, as SCHED_FIFO; needs the right to it (see below)")
      ->check(command_line::whole_number(1, 99))
      ->type_name("1..99");
  app.add_flag("--lock-memory", options.real_time.lock_memory,
               "none of the daemon's memory ever waits for a disk; needs the right to it (see below)");
  CLI::Option* check = app.add_flag("--check-config", options.check_config,
                                    "say whether the pack file is good, on the buses that are named here, and end");
  app.add_flag("--open-gpio", options.open_gpio,
               "drive all outputs that are GPIO lines open, and end: after a daemon that is gone, as in a stop hook")
      ->excludes(check);
  app.add_option("--driven-lines", options.driven_lines,
                 "keep there which lines are driven; with --open-gpio those are opened (see below)")
      ->type_name("FILE");
  app.add_option("--log-level", options.log_level, "least severity to log: debug, info, warning, error")
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
  CLI::App app("Watches over a battery pack: polls its modules, switches its contactors, says why.", "bmud");
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
    std::fprintf(stderr, "bmud: no pack file given, wanted --config PACK.json (see bmud --help)\n");
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
                 "bmud: --record-total-MB: found %s, wanted at least %s: twice --record-file-MB %s, since one file is "
                 "full while the next one grows (see bmud --help)\n",
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
