// bmud: reads the command line and the pack, opens what the loop needs, runs it.
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "config/bus_checks.hpp"
#include "config/pack_config.hpp"
#include "daemon/history/history_tap.hpp"
#include "daemon/shell/buses.hpp"
#include "daemon/shell/cell_count_setting.hpp"
#include "daemon/shell/gpio_lines.hpp"
#include "daemon/shell/history_log.hpp"
#include "daemon/shell/journal.hpp"
#include "daemon/shell/line_feeder.hpp"
#include "daemon/shell/loop.hpp"
#include "daemon/shell/rate_watch.hpp"
#include "daemon/shell/recorder.hpp"
#include "daemon/shell/recorder_teller.hpp"
#include "daemon/shell/serial_console.hpp"
#include "daemon/shell/service_notify.hpp"
#include "daemon/shell/state_store.hpp"
#include "daemon/shell/status_requests.hpp"
#include "daemon/shell/status_socket.hpp"
#include "daemon/shell/user_names.hpp"

namespace {

using namespace bmu;

// sysexits.h has the same numbers; services and scripts know them.
constexpr int exit_ok = 0;
constexpr int exit_command_line = 2;
constexpr int exit_internal = 70;
constexpr int exit_system = 71;
constexpr int exit_config = 78;

constexpr const char* footer = R"(Examples:
  bmud --check-config config/packs/demo-48s.json
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock
  bmud --config /etc/bmud/pack.json --bus-internal can0 --bus-vehicle can1
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock --state /tmp/bmud-state.json
  bmud --open-gpio --config /etc/bmud/pack.json
  bmud --config config/packs/demo-48s.json --bus-internal unix:demo --socket /tmp/bmud.sock --record /tmp/drive

What has to outlive the daemon (how often each fault came, who cleared it, locks, the wear of contactors) is kept in
--state FILE; without the option in state.json where systemd's STATE_DIRECTORY points, and else nowhere. What the pack did is kept in a
database, a row a minute: --history FILE.sqlite, by default history.sqlite beside the state; --history none: not at all.

The last minutes are kept in memory. When the pack opens, or a fault latches, what was before and the ten seconds after
go to a file in the --black-box folder; without the option in black-box where STATE_DIRECTORY points, and else nowhere.
"none" switches it off. --record writes everything. bmureplay runs both again.

On --serial DEVICE, or the pack file's serial/device, a serial console takes CellC:xx, LogReq and Help at 38400 Bd:
docs/serial.md.

A bus is the name of a CAN interface, or unix:NAME for the bus between programs of this machine.

Exit codes: 0 ended by SIGTERM, SIGINT or SIGHUP with all contactors commanded open (the log says if nobody
confirmed it); 2 command line; 70 an error of our own;
71 the system refused something at start, as a bus, or the status socket or the state file because its directory is
missing;
78 the configuration is wrong, or the interface of the internal bus is set to a bit rate that it does not work with.

With --open-gpio: 0 all outputs have been driven open, or the pack has none; 71 the chip, or a line of it, could not be had
(the others have been opened), as one that is in use by a daemon that still runs; 2, 70 and 78 as above.)";

// A blocked log must not hold up the end; this is well within the service manager's patience.
constexpr Duration log_flush_max = 300ms;
// And nor may a disk.
constexpr Duration state_flush_max = 500ms;
constexpr Duration recorder_end_max = 500ms;
constexpr std::int64_t bytes_per_MB = 1'000'000;
constexpr Duration history_flush_max = 200ms;

struct Options {
  std::string config;
  std::string bus_internal;
  std::string bus_vehicle;
  std::string socket = "/run/bmud/bmud.sock";
  std::string state;
  std::string record;
  std::int64_t record_file_MB = 16;
  std::int64_t record_total_MB = 1000;
  std::string black_box;
  std::string serial;
  std::string history;
  std::string log_level = "info";
  bool check_config = false;
  bool open_gpio = false;
};

/// A file that turns out not to be a history of ours is put aside as damaged: none whose name says something else.
std::string is_history_name(const std::string& name) {
  const bool is_one = name.empty() || name == "none" || name.ends_with(".sqlite");
  return is_one ? "" : "--history: found '" + name + "', wanted a name that ends in .sqlite, or none";
}

void add_options(CLI::App& app, Options& options) {
  // Not "required": an option nobody knows would be answered with the one that is missing.
  app.add_option("--config,config", options.config, "the pack's file, with or without the option's name")
      ->type_name("PACK.json");
  app.add_option("--bus-internal", options.bus_internal, "internal bus, instead of the pack file's")->type_name("BUS");
  app.add_option("--bus-vehicle", options.bus_vehicle,
                 "vehicle bus, instead of the pack file's; where that has one bus for both, it follows --bus-internal")
      ->type_name("BUS");
  app.add_option("--socket", options.socket, "status socket for bmuctl")->type_name("PATH")->capture_default_str();
  app.add_option("--state", options.state, "file for what outlives the daemon (see below)")->type_name("FILE");
  app.add_option("--record", options.record, "record everything into files of this folder")->type_name("FOLDER");
  app.add_option("--record-file-MB", options.record_file_MB, "the next file after this size")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--record-total-MB", options.record_total_MB, "the oldest files go when all are larger")
      ->check(CLI::Range(2, 10'000'000))
      ->capture_default_str();
  app.add_option("--black-box", options.black_box, "what was around an opening goes here (see below)")
      ->type_name("FOLDER");
  app.add_option("--serial", options.serial, "terminal device of the serial console, instead of the pack file's")
      ->type_name("DEVICE");
  app.add_option("--history", options.history, "database for a row a minute, or none (see below)")
      ->check(is_history_name)
      ->type_name("FILE.sqlite");
  CLI::Option* check =
      app.add_flag("--check-config", options.check_config, "say whether the pack file is good, and end");
  app.add_flag("--open-gpio", options.open_gpio,
               "drive all outputs that are GPIO lines open, and end: after a daemon that is gone, as in a stop hook")
      ->excludes(check);
  app.add_option("--log-level", options.log_level, "least severity to log: debug, info, warning, error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}))
      ->capture_default_str();
  app.set_version_flag("--version", "bmud " BMUD_VERSION);
  app.footer(footer);
}

BusNames bus_names(const Options& options, const PackConfig& pack) {
  const bool is_shared = pack.buses.internal == pack.buses.vehicle;
  BusNames names = pack.buses;
  if (!options.bus_internal.empty()) names.internal = options.bus_internal;
  if (!options.bus_vehicle.empty()) {
    names.vehicle = options.bus_vehicle;
  } else if (is_shared) {
    names.vehicle = names.internal;
  }
  return names;
}

/// Before any thread starts: signals come through the loop's descriptor, and a client that hangs up is no signal.
void prepare_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, signal);
  sigprocmask(SIG_BLOCK, &set, nullptr);
  static_cast<void>(std::signal(SIGPIPE, SIG_IGN));
}

std::string hash_text(const PackConfig& pack) {
  std::array<char, 20> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(pack.core.hash));
  return hash.data();
}

void log_start(Journal& journal, const PackConfig& pack, const Options& options) {
  journal.log(Severity::info, "bmud " BMUD_VERSION ": " + pack.name + ", " + std::to_string(pack.core.modules.size()) +
                                  " modules, " + std::to_string(cell_count(pack.core)) + " cells, configuration " +
                                  hash_text(pack));
  journal.log(Severity::info, "buses: internal " + pack.buses.internal + ", vehicle " + pack.buses.vehicle +
                                  "; status socket " + options.socket);
  journal.log(Severity::info, bus_use_text(pack));
}

/// "NAME" in the folder the service manager made for us (the first, if it made several); "" if it made none.
std::string in_state_folder(const std::string& name) {
  const char* folders = std::getenv("STATE_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  if (folders == nullptr || *folders == '\0') return "";
  const std::string first(folders);
  return first.substr(0, first.find(':')) + "/" + name;
}

std::string state_path(const Options& options) {
  return options.state.empty() ? in_state_folder("state.json") : options.state;
}

RecorderOptions recorder_options(const Options& options, const PackConfig& pack) {
  RecorderOptions wanted;
  wanted.head = {.version = BMUD_VERSION,
                 .buses = {.internal = pack.buses.internal, .vehicle = pack.buses.vehicle},
                 .sources = pack.sources,
                 .hash = pack.core.hash,
                 .internal_kbit_per_s = pack.buses.internal_kbit_per_s};
  wanted.files.folder = options.record;
  wanted.files.file_bytes = static_cast<std::uint64_t>(options.record_file_MB * bytes_per_MB);
  wanted.files.total_bytes = static_cast<std::uint64_t>(options.record_total_MB * bytes_per_MB);
  wanted.black_box.folder = options.black_box.empty() ? in_state_folder("black-box") : options.black_box;
  if (wanted.black_box.folder == "none") wanted.black_box.folder.clear();
  return wanted;
}

/// The option, else beside the state, else nowhere. Absolute: who is told where it is may be somewhere else.
std::string history_path(const Options& options) {
  if (options.history == "none") return "";
  if (!options.history.empty()) return std::filesystem::absolute(options.history);
  const std::filesystem::path state = state_path(options);
  return state.empty() ? "" : std::filesystem::absolute(state).parent_path() / "history.sqlite";
}

HistoryStoreOptions history_options(const Options& options, const PackConfig& pack) {
  return {.file = {.path = history_path(options),
                   .keep_days = pack.history.keep_days,
                   .size_max_bytes = pack.history.size_max_MB * bytes_per_MB}};
}

HistoryLife history_life(const PackConfig& pack) {
  std::random_device random;
  return {.token = std::to_string(std::uint64_t{random()} << 32U | random()),
          .version = BMUD_VERSION,
          .pack_name = pack.name,
          .config = hash_text(pack),
          .period_s = pack.history.period_s,
          .layout = layout_of(pack.core)};
}

void log_state(Journal& journal, const StateStore& store) {
  const StateFound& found = store.found();
  if (store.path().empty()) {
    return journal.log(Severity::warning,
                       "no state file (--state): faults, locks and wear will be forgotten at the end");
  }
  if (found.found == FileFound::unreadable) {
    journal.log(Severity::error, "the state cannot be read: " + found.problems);
  } else if (!found.problems.empty()) {
    journal.log(Severity::warning, "the state is an older one: " + found.problems);
  }
  if (found.unknown_names > 0) {
    journal.log(Severity::warning, std::to_string(found.unknown_names) +
                                       " faults or contactors of the state file are unknown here and left out");
  }
  if (!found.charges_problem.empty()) {
    journal.log(Severity::warning, "what the cells missed is left out of the state: " + found.charges_problem);
  }
  if (!found.soc_problem.empty()) {
    journal.log(Severity::warning, "the states of charge are left out of the state: " + found.soc_problem);
  }
  journal.log(Severity::info, "state file " + store.path() + ": " + std::string(to_text(found.found)) + " found");
}

/// False: with this bit rate the pack file would have been refused.
bool may_run_at(const RateWatch& rate, Journal& journal) {
  journal.log(rate.severity(true), rate.finding().text);
  if (rate.finding().verdict != RateVerdict::too_slow) return true;
  journal.log(Severity::error, "not started: set the interface to the bit rate of the pack file, or mend the file");
  return false;
}

/// None if neither the pack file nor the option names a device.
Result<std::unique_ptr<SerialConsole>, OsError> start_console(SerialConfig serial, const Options& options,
                                                              std::shared_ptr<CellCountSetting> cell_count,
                                                              std::shared_ptr<const OpenPack> open_pack,
                                                              Journal& journal) {
  if (!options.serial.empty()) serial.device = options.serial;
  if (serial.device.empty()) return std::unique_ptr<SerialConsole>();
  return SerialConsole::start(
      {.device = serial.device, .bit_rate_Bd = serial.bit_rate_Bd},
      {.set_cell_count = [cell_count = std::move(cell_count), open_pack = std::move(open_pack)](
                             std::size_t wanted) { return cell_count->set(wanted, open_pack->is_open()); },
       .log_source = history_log(history_path(options)),
       .log = [&journal](Severity severity, std::string_view line) { journal.log(severity, line); }});
}

int run_daemon(const PackConfig& file_pack, const Options& options, Journal& journal) {
  const auto fail = [&](const OsError& error) {
    journal.log(Severity::error, to_text(error));
    return exit_system;
  };
  const auto log = [&](Severity severity, std::string_view line) { journal.log(severity, line); };
  const auto cell_count = std::make_shared<CellCountSetting>(file_pack, state_path(options));
  if (!cell_count->told().empty()) journal.log(Severity::warning, cell_count->told());
  PackConfig wanted = cell_count->pack();
  wanted.buses = bus_names(options, wanted);
  auto socket = StatusSocket::open({.path = options.socket});
  if (!socket) return fail(socket.error());
  auto store = StateStore::open({.path = state_path(options)});
  if (!store) return fail(store.error());
  auto buses = open_buses(wanted.buses, wanted.core);
  if (!buses) return fail(buses.error());
  log_start(journal, wanted, options);
  RateWatch rate(wanted, options.config);
  if (rate.update(*buses->internal) && !may_run_at(rate, journal)) return exit_config;
  const bool differs = rate.finding().verdict == RateVerdict::differs;
  const PackConfig pack = differs ? at_rate(wanted, rate.finding().found_bit_per_s) : wanted;
  log_state(journal, **store);
  const UserNames users;
  std::optional<GpioLines> gpio;
  if (pack.gpio) gpio.emplace(*pack.gpio);
  std::optional<LineFeeder> lines;
  if (gpio) lines.emplace(*gpio);

  ServiceNotify notify;
  // Not the counters of the life before: whoever heard its last frame would take the first of this one for it.
  const auto first_counter = static_cast<std::uint8_t>(std::random_device{}());
  const auto core = std::make_unique<Core>(pack.core, monotonic_now(), first_counter);
  if (!(*store)->path().empty()) core->restore((*store)->found().state.value_or(PersistentState{}));
  (*store)->start();
  HistoryStore history(history_options(options, pack), history_life(pack));
  HistoryTap history_tap(*core, history, std::chrono::seconds(pack.history.period_s), log);
  history.start();
  const RecorderOptions recorded = recorder_options(options, pack);
  std::unique_ptr<Recorder> recorder;
  if (!recorded.files.folder.empty() || !recorded.black_box.folder.empty()) {
    auto opened = Recorder::open(recorded, *core);
    if (!opened) return fail(opened.error());
    recorder = std::move(*opened);
    recorder->feed().begin(core->started_at());
    recorder->start();
  }
  RecorderTeller teller;
  const auto open_pack = std::make_shared<OpenPack>(*core);
  const auto console = start_console(pack.serial, options, cell_count, open_pack, journal);
  if (!console) return fail(console.error());
  std::vector<CoreTap*> taps{open_pack.get(), &history_tap};
  if (recorder) taps.push_back(&recorder->feed());
  LineFeeder* const used_lines = lines ? &*lines : nullptr;
  Loop loop({.core = *core,
             .buses = *buses,
             .status_socket = **socket,
             .journal = journal,
             .notify = notify,
             .store = **store,
             .rate = rate,
             .lines = used_lines,
             .history = &history,
             .taps = taps,
             .each_second = {[&] {
               if (recorder) teller.tell(recorder->status(), recorder->lines_lost(), log);
             }}});
  const auto make_view = [&]() -> StatusView {
    return {.core = *core,
            .buses = *buses,
            .loop = loop.counters(),
            .drive = loop.drive(),
            .store = **store,
            .history = history,
            .rate = rate.finding(),
            .users = users,
            .lines = used_lines,
            .recorder = recorder.get(),
            .pack_name = pack.name,
            .cell_name = pack.cell_name,
            .log_lines_lost = journal.lines_lost(),
            .notify_sends_failed = notify.sends_failed(),
            .clients_dropped = (*socket)->clients_dropped(),
            .now = monotonic_now()};
  };
  const StatusRequests requests({.make_view = make_view,
                                 .carry_out = [&](const CommandGiven& command) { loop.carry_out(command); },
                                 .log = [&](std::string_view line) { journal.log(Severity::info, line); },
                                 .own_user_id = ::geteuid()});
  loop.set_answers([&](std::string_view line, const Peer& peer) { return requests.answer(line, peer); },
                   [&] { return requests.picture(); });

  if (auto ready = loop.init(); !ready) return fail(ready.error());
  // What cannot be had now is tried again while running: without it nothing closes, and the reason is told.
  if (gpio) static_cast<void>(gpio->open());
  const auto ended = loop.run();
  if (recorder && !recorder->end(recorder_end_max))
    journal.log(Severity::warning, "the end did not wait for the recorder");
  history_tap.finish();
  if (!history.flush(history_flush_max)) journal.log(Severity::warning, "the end did not wait for the history");
  if (!(*store)->flush(state_flush_max)) journal.log(Severity::warning, "the end did not wait for the state file");
  if (!ended) return fail(ended.error());
  journal.log(Severity::info, "ended");
  return exit_ok;
}

int open_gpio(const PackConfig& pack) {
  if (!pack.gpio) {
    std::printf("no outputs on GPIO lines in this pack\n");
    return exit_ok;
  }
  const std::vector<OsError> errors = open_gpio_outputs(*pack.gpio);
  for (const OsError& error : errors) std::fprintf(stderr, "bmud: not opened: %s\n", to_text(error).c_str());
  if (!errors.empty()) return exit_system;
  std::printf("%s: all outputs open\n", pack.gpio->chip.c_str());
  return exit_ok;
}

int check_or_run(const Options& options) {
  const auto pack = load_pack_config(options.config);
  if (!pack) {
    for (const ConfigProblem& problem : pack.error()) std::fprintf(stderr, "%s\n", to_text(problem).c_str());
    return exit_config;
  }
  const ConfigProblems warnings = bus_warnings(*pack, options.config);
  if (options.check_config) {
    for (const ConfigProblem& warning : warnings) std::printf("warning: %s\n", to_text(warning).c_str());
    std::printf("%s: ok: %s, %zu modules, %zu cells\n%s\n", options.config.c_str(), pack->name.c_str(),
                pack->core.modules.size(), cell_count(pack->core), bus_use_text(*pack).c_str());
    return exit_ok;
  }
  if (options.open_gpio) return open_gpio(*pack);
  prepare_signals();
  Journal journal(*severity_from_text(options.log_level));
  for (const ConfigProblem& warning : warnings) journal.log(Severity::warning, to_text(warning));
  const int code = run_daemon(*pack, options, journal);
  // With a sink that is blocked an orderly exit() might wait for it; there is nothing left that needs one.
  if (!journal.flush(log_flush_max)) ::_exit(code);
  return code;
}

int parse_and_run(int argc, char** argv) {
  Options options;
  CLI::App app("Watches over a battery pack: polls its modules, switches its contactors, says why.", "bmud");
  add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "bmud: %s (see bmud --help)\n", error.what());
    return exit_command_line;
  }
  if (options.config.empty()) {
    std::fprintf(stderr, "bmud: no pack file given, wanted --config PACK.json (see bmud --help)\n");
    return exit_command_line;
  }
  return check_or_run(options);
}

}  // namespace

int main(int argc, char** argv) {
  // No orderly opening from here: nobody knows what state we are in. The contactor command expires at its receiver.
  try {
    return parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bmud: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "bmud: an unknown error\n");
  }
  return exit_internal;
}
