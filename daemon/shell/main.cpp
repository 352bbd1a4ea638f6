// bmud: reads the command line and the pack, opens what the loop needs, runs it.
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <unistd.h>

#include "config/bus_checks.hpp"
#include "config/pack_config.hpp"
#include "daemon/shell/access.hpp"
#include "daemon/shell/buses.hpp"
#include "daemon/shell/cell_count_setting.hpp"
#include "daemon/shell/gpio_lines.hpp"
#include "daemon/shell/history_log.hpp"
#include "daemon/shell/journal.hpp"
#include "daemon/shell/line_feeder.hpp"
#include "daemon/shell/loop.hpp"
#include "daemon/shell/memory.hpp"
#include "daemon/shell/options.hpp"
#include "daemon/shell/rate_watch.hpp"
#include "daemon/shell/serial_console.hpp"
#include "daemon/shell/service_notify.hpp"
#include "daemon/shell/state_store.hpp"
#include "daemon/shell/status_requests.hpp"
#include "daemon/shell/status_socket.hpp"
#include "daemon/shell/user_names.hpp"

namespace {

using namespace bmu;

// A blocked log must not hold up the end; this is well within the service manager's patience.
constexpr Duration log_flush_max = 300ms;
// And nor may a disk.
constexpr Duration state_flush_max = 500ms;
constexpr std::uint64_t bytes_per_MB = 1'000'000;

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

void log_start(Journal& journal, const PackConfig& pack, const Options& options) {
  journal.log(Severity::info, "bmud " BMUD_VERSION ": " + pack.name + ", " + std::to_string(pack.core.modules.size()) +
                                  " modules, " + std::to_string(cell_count(pack.core)) + " cells, configuration " +
                                  hash_text(pack));
  journal.log(Severity::info, "buses: internal " + pack.buses.internal + ", vehicle " + pack.buses.vehicle +
                                  "; status socket " + options.socket);
  journal.log(Severity::info, bus_use_text(pack));
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

MemoryOptions memory_options(const Options& options) {
  return {.history_path = history_path(options),
          .black_box_folder = black_box_folder(options),
          .record_folder = options.record,
          .record_file_bytes = options.record_file_MB * bytes_per_MB,
          .record_total_bytes = options.record_total_MB * bytes_per_MB};
}

int run_daemon(const PackConfig& file_pack, const Options& options, Journal& journal) {
  const auto fail = [&](const OsError& error) {
    journal.log(Severity::error, to_text(error));
    return exit_system;
  };
  const auto cell_count = std::make_shared<CellCountSetting>(file_pack, state_path(options));
  if (!cell_count->told().empty()) journal.log(Severity::warning, cell_count->told());
  PackConfig wanted = cell_count->pack();
  wanted.buses = bus_names(options, wanted);
  Access access({.own_user_id = ::geteuid(), .groups = access_groups()}, UserNames(),
                [&](std::string_view line) { journal.log(Severity::warning, line); });
  auto socket = StatusSocket::open({.path = options.socket, .is_for_all = access.is_by_group()});
  if (!socket) return fail(socket.error());
  (*socket)->set_door([&](const Peer& peer) {
    return access.may(peer, Right::read) ? "" : access.refuse(peer, Right::read, "read here", monotonic_now());
  });
  auto store = StateStore::open({.path = state_path(options)});
  if (!store) return fail(store.error());
  auto buses = open_buses(wanted.buses, wanted.core);
  if (!buses) return fail(buses.error());
  log_start(journal, wanted, options);
  journal.log(Severity::info, access.text());
  RateWatch rate(wanted, options.config);
  if (rate.update(*buses->internal) && !may_run_at(rate, journal)) return exit_config;
  const bool differs = rate.finding().verdict == RateVerdict::differs;
  const PackConfig pack = differs ? at_rate(wanted, rate.finding().found_bit_per_s) : wanted;
  log_state(journal, **store);
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
  auto memory = Memory::open(memory_options(options), pack, *core, journal);
  if (!memory) return fail(memory.error());
  const auto open_pack = std::make_shared<OpenPack>(*core);
  const auto console = start_console(pack.serial, options, cell_count, open_pack, journal);
  if (!console) return fail(console.error());
  std::vector<CoreTap*> taps = (*memory)->taps();
  taps.push_back(open_pack.get());
  LineFeeder* const used_lines = lines ? &*lines : nullptr;
  Loop loop({.core = *core,
             .buses = *buses,
             .status_socket = **socket,
             .journal = journal,
             .notify = notify,
             .store = **store,
             .rate = rate,
             .lines = used_lines,
             .history = &(*memory)->history(),
             .taps = taps,
             .each_second = {[&] { (*memory)->tell(); }, [&] { access.tell_left_out(monotonic_now()); }}});
  const auto make_view = [&]() -> StatusView {
    return {.core = *core,
            .buses = *buses,
            .loop = loop.counters(),
            .drive = loop.drive(),
            .store = **store,
            .history = (*memory)->history(),
            .rate = rate.finding(),
            .users = access.users(),
            .lines = used_lines,
            .recorder = (*memory)->recorder(),
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
                                 .access = access});
  loop.set_answers([&](std::string_view line, const Peer& peer) { return requests.answer(line, peer); },
                   [&] { return requests.picture(); });

  if (auto ready = loop.init(); !ready) return fail(ready.error());
  // What cannot be had now is tried again while running: without it nothing closes, and the reason is told.
  if (gpio) static_cast<void>(gpio->open());
  const auto ended = loop.run();
  (*memory)->end();
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

}  // namespace

int main(int argc, char** argv) {
  // No orderly opening from here: nobody knows what state we are in. The contactor command expires at its receiver.
  try {
    const ParsedOptions parsed = parse_options(argc, argv);
    return parsed.options ? check_or_run(*parsed.options) : parsed.exit_code;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bmud: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "bmud: an unknown error\n");
  }
  return exit_internal;
}
