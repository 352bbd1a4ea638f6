#include "daemon/shell/daemon_life.hpp"

#include <algorithm>
#include <random>
#include <utility>

#include "config/checks/bus_checks.hpp"
#include "config/checks/device_rates.hpp"
#include "config/checks/identifier_checks.hpp"
#include "daemon/shell/gpio/driven_lines.hpp"
#include "daemon/shell/serial/history_log.hpp"

namespace bmu {

namespace {

constexpr std::uint64_t bytes_per_MB = 1'000'000;
/// More than any receive queue holds.
constexpr int waiting_frames_max = 100'000;

BusNames bus_names(const Options& options, const PackConfig& pack) {
  return pack.buses.with({.internal = options.bus_internal,
                          .vehicle = options.bus_vehicle,
                          .charger = options.bus_charger,
                          .second_pack = options.bus_second_pack,
                          .inverter = options.bus_inverter});
}

MemoryOptions memory_options(const Options& options) {
  return {.history_path = history_path(options),
          .black_box_folder = black_box_folder(options),
          .record_folder = options.record,
          .record_file_bytes = options.record_file_MB * bytes_per_MB,
          .record_total_bytes = options.record_total_MB * bytes_per_MB};
}

/// Whether both packs use the same interfaces with the same receive filters.
bool has_same_ports(const PackConfig& one, const PackConfig& other) {
  return std::all_of(all_ports.begin(), all_ports.end(), [&](Port port) {
    return one.buses.name(port) == other.buses.name(port) &&
           receive_ids(port, one.core) == receive_ids(port, other.core);
  });
}

/// The CAN interfaces among the buses, each once, with their required settings.
std::vector<LinkWanted> wanted_links(const PackConfig& pack) {
  constexpr std::uint32_t kbit = 1'000;
  const InterfaceConfig& interfaces = pack.interfaces;
  const auto wanted = [&](const std::string& name, std::int32_t kbit_per_s) -> LinkWanted {
    if (!interfaces.set_up) return {.interface_name = name};
    return {.interface_name = name,
            .set_up = LinkSettings{.bit_rate_bit_per_s = static_cast<std::uint32_t>(kbit_per_s) * kbit,
                                   .restart_ms = static_cast<std::uint32_t>(interfaces.restart_ms)}};
  };
  std::vector<LinkWanted> links;
  if (!is_embedded_bus(pack.buses.internal)) {
    links.push_back(wanted(pack.buses.internal, pack.buses.internal_kbit_per_s));
  }
  for (const Port port : {Port::vehicle, Port::charger, Port::second_pack, Port::inverter}) {
    const std::string& name = pack.buses.name(port);
    const bool is_there = !receive_ids(port, pack.core).empty();
    const bool is_own = pack.core.served_by[static_cast<std::size_t>(port)] == port;
    if (is_there && is_own && !is_embedded_bus(name)) links.push_back(wanted(name, bit_rate_kbit_per_s(pack, port)));
  }
  return links;
}

/// Discards the frames received before the session starts. Their age is unknown, and they may include commands of the
/// previous session, which this one has not sent and would take for those of a second master.
void discard_waiting(const Buses& buses) {
  for (const Port port : all_ports) {
    if (!buses.is_own(port)) continue;
    ReceivedFrame ignored;
    BusPort& bus = buses.serving(port);
    for (int i = 0; i < waiting_frames_max && bus.read(ignored) != ReadStatus::empty; ++i) {
    }
  }
}

}  // namespace

Result<PackConfig, ConfigProblems> on_wanted_buses(PackConfig pack, const Options& options) {
  set_buses(pack, bus_names(options, pack));
  if (ConfigProblems clashes = bus_clashes(pack); !clashes.empty()) return failure(std::move(clashes));
  return pack;
}

// --- plan -----------------------------------------------------------------------------------------------------------

Result<std::unique_ptr<LifePlan>, LifeFailure> LifePlan::make(PackRead read, const Options& options,
                                                              const LifePlan* before) {
  // A medium that was there when this daemon started may be gone: the session that would lack it is refused, and the
  // running one continues.
  if (auto made = Memory::make_folders(memory_options(options)); !made) {
    return failure(LifeFailure{.exit_code = exit_system, .text = to_text(made.error())});
  }
  auto plan = std::make_unique<LifePlan>();
  plan->read = std::move(read);
  auto wanted = on_wanted_buses(plan->read.cell_count->pack(), options);
  if (!wanted) return failure(LifeFailure{.exit_code = exit_config, .text = to_text(wanted.error().front())});
  plan->wanted = std::move(*wanted);
  if (before != nullptr && has_same_ports(plan->wanted, before->wanted)) {
    plan->buses = before->buses;
  } else {
    auto opened = open_buses(plan->wanted.buses, plan->wanted.core);
    if (!opened) return failure(LifeFailure{.exit_code = exit_system, .text = to_text(opened.error())});
    plan->buses = std::make_shared<Buses>(std::move(*opened));
  }
  const RateFinding rate = judge_rate(plan->wanted, options.config, plan->buses->internal().rate_bit_per_s());
  if (rate.verdict == RateVerdict::too_slow) {
    return failure(
        LifeFailure{.exit_code = exit_config,
                    .text = rate.text + "; set the interface to the bitrate of the pack file, or correct the file"});
  }
  const bool differs = rate.verdict == RateVerdict::differs;
  plan->pack = differs ? at_rate(plan->wanted, rate.found_bit_per_s) : plan->wanted;
  return plan;
}

// --- session --------------------------------------------------------------------------------------------------------

Result<std::unique_ptr<DaemonLife>, OsError> DaemonLife::begin(const LifePlan& plan, const LifeWorld& world,
                                                               const Legacy& legacy) {
  std::unique_ptr<DaemonLife> life(new DaemonLife(plan, world));
  if (auto done = life->set_up(legacy); !done) return failure(done.error());
  return life;
}

DaemonLife::DaemonLife(const LifePlan& plan, const LifeWorld& world)
    : plan_(plan), world_(world), rate_(plan.wanted, world.options.config) {}

Result<void, OsError> DaemonLife::set_up(const Legacy& legacy) {
  log_begin();
  if (rate_.update(plan_.buses->internal())) log(rate_.severity(true), rate_.finding().text);
  if (plan_.pack.gpio) lines_.emplace(gpio_.emplace(*plan_.pack.gpio));
  make_core();
  auto memory = Memory::open(memory_options(world_.options), plan_.pack, *core_, world_.journal);
  if (!memory) return failure(memory.error());
  memory_ = std::move(*memory);
  open_pack_ = std::make_shared<OpenPack>(*core_);
  if (auto started = start_console(); !started) return started;
  if (auto started = start_link_watch(); !started) return started;
  if (auto started = start_intake_air(); !started) return started;
  make_loop(legacy);
  make_requests();
  if (auto ready = loop_->init(); !ready) return ready;
  write_down_lines();
  // Lines that cannot be opened now are retried while running: without them nothing closes, and the reason is reported.
  if (gpio_) static_cast<void>(gpio_->open());
  discard_waiting(*plan_.buses);
  return {};
}

/// Before the lines are requested. A failure is only logged: the stop hook (bmud --open-gpio) then uses the pack file,
/// as it does without this file.
void DaemonLife::write_down_lines() const {
  const auto written = write_driven_lines(world_.options.driven_lines, plan_.pack.gpio);
  if (!written) log(Severity::warning, to_text(written.error()) + "; bmud --open-gpio will use the pack file");
}

void DaemonLife::log_begin() const {
  const PackConfig& pack = plan_.wanted;
  if (!plan_.read.cell_count->told().empty()) log(Severity::warning, plan_.read.cell_count->told());
  log(Severity::info, "bmud " BMUD_VERSION ": " + pack.name + ", " + std::to_string(pack.core.modules.size()) +
                          " modules, " + std::to_string(cell_count(pack.core)) + " cells, configuration " +
                          hash_text(pack));
  log(Severity::info,
      "buses: internal " + pack.buses.internal + ", vehicle " + pack.buses.vehicle +
          (pack.core.charger.driver == nullptr ? "" : ", charger " + pack.buses.name(Port::charger)) +
          (pack.core.second_pack.base_id == 0 ? "" : ", second pack " + pack.buses.name(Port::second_pack)) +
          (pack.core.inverter.driver == nullptr ? "" : ", inverter " + pack.buses.name(Port::inverter)) +
          "; status socket " + world_.options.socket);
  log(Severity::info, bus_use_text(pack));
}

void DaemonLife::make_core() {
  // Does not continue the counter of the previous session: a node that received its last frame would take the first
  // frame of this session for that one.
  const auto first_counter = static_cast<std::uint8_t>(std::random_device{}());
  core_ = std::make_unique<Core>(plan_.pack.core, monotonic_now(), first_counter);
  const StateFound& found = world_.store.found();
  if (!world_.store.path().empty() || found.state) core_->restore(found.state.value_or(PersistentState{}));
}

/// Starts the serial console if the pack file or the option names a device.
Result<void, OsError> DaemonLife::start_console() {
  SerialConfig serial = plan_.pack.serial;
  if (!world_.options.serial.empty()) serial.device = world_.options.serial;
  if (serial.device.empty()) return {};
  service_ = std::make_shared<ServiceValues>(*core_);
  auto console = SerialConsole::start(
      {.device = serial.device, .bit_rate_Bd = serial.bit_rate_Bd},
      {.set_cell_count = [cell_count = plan_.read.cell_count, open_pack = open_pack_](
                             std::size_t wanted) { return cell_count->set(wanted, open_pack->is_open()); },
       .log_source = history_log(history_path(world_.options)),
       .set_service = [service = service_](bool is_on) { service->set_wanted(is_on); },
       .take_service_line = [service = service_] { return service->take_line(); },
       .log = [&journal = world_.journal](Severity severity, std::string_view line) { journal.log(severity, line); }});
  if (!console) return failure(console.error());
  console_ = std::move(*console);
  return {};
}

Result<void, OsError> DaemonLife::start_link_watch() {
  const auto log_line = [&journal = world_.journal](Severity severity, std::string_view line) {
    journal.log(severity, line);
  };
  auto watch = LinkWatch::start(wanted_links(plan_.wanted), log_line);
  if (!watch) return failure(watch.error());
  links_ = std::move(*watch);
  return {};
}

Result<void, OsError> DaemonLife::start_intake_air() {
  if (plan_.pack.intake_air.source != AirSource::file) return {};
  const auto log_line = [&journal = world_.journal](Severity severity, std::string_view line) {
    journal.log(severity, line);
  };
  auto reader = IntakeAirReader::start(plan_.pack.intake_air.file, log_line);
  if (!reader) return failure(reader.error());
  intake_air_ = std::move(*reader);
  return {};
}

void DaemonLife::make_loop(const Legacy& legacy) {
  std::vector<CoreTap*> taps = memory_->taps();
  taps.push_back(open_pack_.get());
  if (service_) taps.push_back(service_.get());
  std::vector<std::function<void()>> each_second;
  each_second.emplace_back([this] { memory_->tell(); });
  each_second.emplace_back([this] { world_.access.tell_left_out(monotonic_now()); });
  std::vector<CommandGiven> first;
  if (legacy.is_balancing_off) first.push_back({.command = Command::balancing_off});
  loop_ = std::make_unique<Loop>(LoopParts{.core = *core_,
                                           .buses = *plan_.buses,
                                           .status_socket = world_.socket,
                                           .journal = world_.journal,
                                           .notify = world_.notify,
                                           .store = world_.store,
                                           .rate = rate_,
                                           .claim = {.length = claim_length(plan_.pack.core, std::random_device{}()),
                                                     .kept_max = claim_kept_max(plan_.pack.core),
                                                     .held_until = legacy.claim_held_until},
                                           .lines = lines_ ? &*lines_ : nullptr,
                                           .intake_air = intake_air_.get(),
                                           .history = &memory_->history(),
                                           .taps = std::move(taps),
                                           .each_second = std::move(each_second),
                                           .watched = {world_.pack_reader},
                                           .first = std::move(first),
                                           .on_reload = world_.reload_by_signal});
}

Legacy DaemonLife::legacy(const LifePlan& next, TimePoint left_at) const {
  const bool has_same_buses = next.buses == plan_.buses;
  const bool held = core_->claim().stage() == ClaimStage::held;
  return {.is_balancing_off = core_->is_balancing_switched_off(),
          .claim_held_until = has_same_buses && held ? left_at : TimePoint{}};
}

void DaemonLife::make_requests() {
  requests_ = std::make_unique<StatusRequests>(
      StatusActions{.make_view = [this] { return view(); },
                    .carry_out = [this](const CommandGiven& command) { loop_->carry_out(command); },
                    .log = [this](std::string_view line) { log(Severity::info, line); },
                    .access = world_.access,
                    .reload = world_.reload});
  loop_->set_answers([this](std::string_view line, const Peer& peer) { return requests_->answer(line, peer); },
                     [this] { return requests_->picture(); });
}

StatusView DaemonLife::view() const {
  return {.core = *core_,
          .buses = *plan_.buses,
          .loop = loop_->counters(),
          .drive = loop_->drive(),
          .store = world_.store,
          .history = memory_->history(),
          .rate = rate_.finding(),
          .users = world_.access.users(),
          .lines = lines_ ? &*lines_ : nullptr,
          .recorder = memory_->recorder(),
          .links = links_.get(),
          .pack_name = plan_.pack.name,
          .cell_name = plan_.pack.cell_name,
          .reloads = world_.reloads,
          .log_lines_lost = world_.journal.lines_lost(),
          .notify_sends_failed = world_.notify.sends_failed(),
          .clients_dropped = world_.socket.clients_dropped(),
          .now = monotonic_now()};
}

}  // namespace bmu
