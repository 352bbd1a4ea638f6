#include "daemon/core/core.hpp"

#include <algorithm>
#include <utility>

#include "daemon/core/vehicle/swapped_buses.hpp"

namespace bmu {

namespace {

/// CAN_ERR_* classes of the kernel that affect the validity of received data.
constexpr std::uint32_t error_class_bus_off = 0x040;
constexpr std::uint32_t error_class_restarted = 0x100;
constexpr std::uint32_t error_class_controller = 0x004;
/// Bits of byte 1 with error_class_controller.
constexpr std::uint8_t controller_passive = 0x30;
constexpr std::uint8_t controller_active = 0x40;

/// Maximum of any configuration: a longer lockout in a state file is not from this daemon, and is clamped.
constexpr Duration lockout_max = 600s;

/// Catalogue of the internal bus: modules of another manufacturer exclude bmud modules.
const Catalogue& internal_catalogue(const CoreConfig& config) {
  using namespace internal_bus;
  const bool is_little = config.sensor.little_endian;
  if (are_modules_ours(config)) return is_little ? catalogue_little_endian_sensor : catalogue;
  return is_little ? catalogue_without_modules_little_endian_sensor : catalogue_without_modules;
}

constexpr Catalogue nobodys{"", {}};

std::array<bool, 4> contacts_of(const PduState& pdu) {
  return {pdu.main_positive_closed, pdu.main_negative_closed, pdu.precharge_closed, pdu.charge_closed};
}

}  // namespace

Core::Core(const CoreConfig& config, TimePoint started_at, std::uint8_t first_counter)
    : config_(config),
      started_at_(started_at),
      view_began_at_(started_at),
      next_tick_(started_at),
      check_(internal_catalogue(config), ReceiveCheck::Role::master),
      foreign_check_(are_modules_ours(config) ? nobodys : *config.foreign.driver->catalogue,
                     ReceiveCheck::Role::master),
      command_counter_(first_counter) {
  sensors_.insulation_known_at = started_at;
  sequence_.entered_at = started_at;  // open since then, as far as is known
  modules_.init(config_);
  counter_.init(config_);
  contactor_watch_.init(started_at);
  poll_.init(config_.poll, started_at, first_counter);
  rounds_.init(are_modules_ours(config_) ? std::uint8_t{0} : config_.foreign.driver->start_rounds, started_at);
  pace_.init(config_.poll, started_at);
  configured_ages_ = config_.ages;
  setup_.init(config_, first_counter);
  balancing_.init(config_);
  estimate_.init(config_);
  charge_pause_.init(config_);
  cell_charges_.init(config_);
  reporter_.init(started_at);
  cell_reporter_.init(config_, started_at);
  second_pack_.init(config_.second_pack, started_at);
  sensor_setup_.init(config_.sensor);
  second_sensor_setup_.init_second(config_.sensor);
  insulation_.init(config_.insulation);
  if (config_.insulation.driver != nullptr) {
    Duration& confirm = config_.limits.confirm.insulation_monitor_lost;
    confirm = std::min(confirm, InsulationTable::lost_confirm_max);
  }
  chargers_.init(config_.charger);
  charge_.init(config_);
  inverter_.init(config_.inverter);
  inverter_reporter_.init(config_.inverter, started_at);
  watchers_.overload.init(carried(config_));
  watchers_.stuck.init(config_);
  watchers_.steps.init(config_);
  watchers_.roster.init(config_);
  watchers_.switches.init(config_);
  guard_.init(config_.contactors);
  rest_.init(config_.rest);
  auxiliary_.init(config_.auxiliary);
}

void Core::restore(const PersistentState& state) {
  persistent_ = state;
  inverter_reporter_.restore(state.hours_since_full);
  ledger_.restore(state.contactors);
  guard_.restore(state.closing.precharge);
  watchers_.roster.restore(state.modules);
  estimate_.restore(state.soc);
  has_memory_ = true;
  former_totals_ = state.totals;
  cell_charges_.restore(state.cell_charges);
  const FormerBook former = cell_charges_.former();
  if (former != FormerBook::none) {
    events_.push({.id = EventId::former_charges, .at = started_at_, .number = static_cast<std::int64_t>(former)});
  }
  // The elapsed part of it is unknown.
  lockout_ = std::chrono::milliseconds{std::clamp<std::int64_t>(state.closing.lockout_ms, 0, to_ms(lockout_max))};
  locked_out_until_ = started_at_ + lockout_;
  for (const FaultRow& row : fault_table()) {
    const FaultRecord& record = state.faults[static_cast<std::size_t>(row.id)];
    if (!record.is_locked || row.latch == Latch::none) continue;
    const FreezeFrame frame = record.frame.value_or(FreezeFrame{});
    faults_.restore_lock(row.id, {record.frame.has_value(), frame.value, frame.element}, frame.threshold, started_at_);
  }
}

std::int64_t Core::unix_time_ms(TimePoint at) const {
  return is_clock_known_ ? to_ms(at.time_since_epoch() + clock_offset_) : 0;
}

// --- observe
// ----------------------------------------------------------------------------------------------------------

Urgency Core::observe(const Observation& observation) {
  return std::visit([&](const auto& what) { return take(observation.at, what); }, observation.what);
}

/// Frames of this node are received as echoes, never here.
void Core::take_vehicle_frame(const CanFrame& frame, TimePoint at) {
  if (frame.is_extended || frame.is_error) return;
  const VehicleConfig& vehicle = config_.vehicle;
  const bool is_report = frame.id - vehicle.base_id < vehicle_message_count;
  const bool is_reply = vehicle.request_id != 0 && frame.id == reply_id_of(vehicle);
  const bool is_cell_data =
      frame.id != 0 && (frame.id == vehicle.cell_voltages_id || frame.id == vehicle.cell_temperatures_id);
  if (is_report || is_reply || is_cell_data) watchers_.bus.note_foreign_report(at);
  if (vehicle.request_id != 0 && frame.id == vehicle.request_id && !frame.is_remote) take_request(frame, at);
}

/// A stored fault is cleared with the authority of a user, which excludes faults that require an inspection first.
void Core::take_request(const CanFrame& request, TimePoint at) {
  const bool clears = is_clear_request(request);
  if (clears && !config_.vehicle.may_clear_faults) return requests_.note_refused();
  if (clears) static_cast<void>(take(at, CommandGiven{.command = Command::clear_faults}));
  requests_.take(request);
}

Urgency Core::take(TimePoint at, const FrameReceived& what) {
  if (serves(config_, what.port, Port::vehicle)) take_vehicle_frame(what.frame, at);
  if (serves(config_, what.port, Port::second_pack)) static_cast<void>(second_pack_.observe(what.frame, at));
  if (serves(config_, what.port, Port::charger) && chargers_.observe(what.frame, at)) return Urgency::can_wait;
  if (serves(config_, what.port, Port::inverter) && inverter_.observe(what.frame, at)) return Urgency::can_wait;
  if (serves(config_, what.port, config_.insulation.bus) && insulation_.observe(what.frame, at)) {
    return Urgency::can_wait;
  }
  if (serves(config_, what.port, config_.sensor.bus)) {
    if (const std::optional<Urgency> urgency = take_foreign_current(what.frame, at)) return *urgency;
  }
  if (what.port != Port::internal) {
    if (what.port == Port::vehicle && is_misplaced(config_, what.frame)) watchers_.bus.note_misplaced_frame(at);
    return Urgency::can_wait;  // no other frame of these buses requires an immediate decision
  }
  if (is_foreign_sensor_command(what.frame)) return take_foreign_sensor_command(what.frame, at);
  if (take_sensor_answer(what.frame, at)) return Urgency::can_wait;
  if (is_foreign_modules(what.frame)) return take_foreign_frame(what.frame, at);
  const CheckedFrame checked = check_.check(what.frame);
  if (!checked.is_accepted) return take_rejected(checked, what.frame, at);
  note_sound_frame(at);
  return checked.message->sender == Sender::mmu ? take_module_frame(checked, what.frame, at)
                                                : take_sensor_frame(checked, what.frame, at);
}

/// Without a PDU the evidence is frames of the sensor, which have no checksum, and the vehicle may have another such
/// sensor: while modules or the pack's own sensor send on the internal bus, they are none.
bool Core::are_buses_swapped(TimePoint now) const {
  return watchers_.bus.has_misplaced_frames(now) && (config_.contactors.has_pdu || is_internal_bus_silent(now));
}

bool Core::is_internal_bus_silent(TimePoint at) const {
  const auto is_recent = [at](TimePoint sent_at) {
    return sent_at != TimePoint{} && at - sent_at <= BusWatch::misplaced_memory;
  };
  return !is_recent(sensors_.current_mA.taken_at) &&
         std::none_of(modules_.modules().begin(), modules_.modules().end(),
                      [&](const ModuleRecord& module) { return is_recent(module.last_answer_at); });
}

/// Not every driver reports a restart; a valid frame proves it.
void Core::note_sound_frame(TimePoint at) {
  if (!is_bus_off_) return;
  is_bus_off_ = false;
  update_bus_state(at);
}

/// The current sensor of a car in the same rows is not a module. The identifier of an error frame is a code of the
/// error, not of a module.
bool Core::is_foreign_modules(const CanFrame& frame) const {
  if (are_modules_ours(config_) || frame.is_error) return false;
  const MessageSpec* const message = config_.foreign.driver->catalogue->find(frame).message;
  return message != nullptr && message->sender != Sender::sensor;
}

namespace {

/// Node of the identifier, as counted by this daemon, even if the frame is invalid; 0: not of a module.
std::uint8_t node_of(const ModuleDriver& driver, const CanFrame& frame) {
  const MessageMatch match = driver.catalogue->find(frame);
  const bool is_of_module =
      match.message != nullptr && match.message->sender == Sender::module && match.message->has_node();
  return is_of_module ? static_cast<std::uint8_t>(match.node + driver.maker_less) : std::uint8_t{0};
}

}  // namespace

Urgency Core::take_foreign_frame(const CanFrame& frame, TimePoint at) {
  const ModuleDriver& driver = *config_.foreign.driver;
  const CheckedFrame checked = foreign_check_.check(frame);
  if (!checked.is_accepted) return take_foreign_rejected(checked, frame, at);
  note_sound_frame(at);
  const ModuleReport report = driver.take(frame, config_.foreign.options);
  if (report.node == 0) return Urgency::can_wait;  // no content that the core uses
  if (modules_.find(report.node) == nullptr) {
    foreign_check_.reject(frame, RejectReason::not_configured);
    watchers_.bus.note_unknown_module(report.node, at);
    return Urgency::can_wait;
  }
  const std::uint32_t cycles_before = modules_.complete_cycles();
  modules_.observe(report, at);
  const bool is_news = modules_.any_beyond(report.node, config_.limits) || modules_.complete_cycles() != cycles_before;
  return is_news ? Urgency::decide_now : Urgency::can_wait;
}

Urgency Core::take_foreign_rejected(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  if (checked.reason == RejectReason::foreign_master) return take_masters_frame(frame, at);
  const std::uint8_t node = node_of(*config_.foreign.driver, frame);
  modules_.note_rejected(node, checked.reason);
  if (checked.reason == RejectReason::wrong_crc) modules_.note_damaged(node, at);
  if (checked.reason != RejectReason::conflicting) return Urgency::can_wait;
  modules_.note_conflict(node, at);
  return Urgency::decide_now;
}

ReceiveCounts Core::receive_counts() const {
  ReceiveCounts counts = check_.counts();
  counts.accepted += foreign_check_.counts().accepted;
  for (std::size_t reason = 0; reason < counts.rejected.size(); ++reason) {
    counts.rejected[reason] += foreign_check_.counts().rejected[reason];
  }
  return counts;
}

/// A second master's frame.
Urgency Core::take_masters_frame(const CanFrame& frame, TimePoint at) {
  flags_.foreign_master_seen = claim_.note_rival(frame.id, at, rest_.is_resting()) || flags_.foreign_master_seen;
  return Urgency::decide_now;
}

Urgency Core::take_rejected(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  if (checked.reason == RejectReason::foreign_master) return take_masters_frame(frame, at);
  if (checked.message == nullptr) return Urgency::can_wait;
  const bool is_module = checked.message->sender == Sender::mmu;
  if (checked.message->sender == Sender::sensor) sensors_.refused.note_frame(checked.reason);
  if (is_module) modules_.note_rejected(checked.node, checked.reason);
  // A wrong length is not noise, which the bus itself would have detected, but another device or another firmware; a
  // part of the module's answer is then missing, which is a fault of its own.
  const bool is_damaged = checked.reason == RejectReason::wrong_crc;
  if (is_damaged && is_module) modules_.note_damaged(checked.node, at);
  const bool is_conflict = checked.reason == RejectReason::conflicting;
  if (is_conflict && checked.message->base_id == internal_bus::pdu_status.base_id) flags_.pdu_restarted = true;
  if (is_conflict && is_module) {
    modules_.note_conflict(checked.node, at);
    const ModuleRecord* module = modules_.find(checked.node);
    const bool has_rival = module != nullptr && module->rival_seen_at == at;  // a single one may be chance
    if (has_rival) forget_cells_of(checked.node);
  }
  return is_conflict ? Urgency::decide_now : Urgency::can_wait;
}

Urgency Core::take_module_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  const std::uint32_t cycles_before = modules_.complete_cycles();
  const ModuleRecord* known = modules_.find(checked.node);
  if (known == nullptr) {
    take_stranger(checked, frame, at);
    return Urgency::can_wait;
  }
  const Measured<ModuleIdentity> identity_before = known->identity;
  const std::size_t index = modules_.index_of(checked.node);
  if (checked.message->base_id == internal_bus::status.base_id) broadcasts_.note_answer();
  if (checked.message->base_id == internal_bus::response.base_id) {
    turns_.note_response(index);
    const SetupStage before = setup_.stage(index);
    if (setup_.observe_response(index, frame)) {
      events_.push({.id = EventId::module_refused_limits, .at = at, .number = checked.node});
    }
    note_set_up(before, index, checked.node, at);
    const bool had_failed = balancing_.has_failed(index);
    const bool refuses_minutes =
        balancing_.observe_response(index, frame, at, watchers_.switches) == OrderStage::refused;
    if (refuses_minutes && !had_failed) {
      events_.push({.id = EventId::module_refused_balancing, .at = at, .number = checked.node});
    }
    return Urgency::can_wait;
  }
  modules_.observe(*checked.message, checked.node, frame, at);
  if (checked.message->base_id == internal_bus::status.base_id) note_status(index, *known, at);
  if (checked.message->base_id == internal_bus::ident.base_id) note_identity(*known, identity_before, at);
  const bool crosses = modules_.any_beyond(checked, config_.limits);
  const bool cycle_completed = modules_.complete_cycles() != cycles_before;
  return crosses || cycle_completed ? Urgency::decide_now : Urgency::can_wait;
}

/// Values of a module of another pack are not used; its identity helps to find out why it is here.
void Core::take_stranger(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  check_.reject(frame, RejectReason::not_configured);
  watchers_.bus.note_unknown_module(checked.node, at);
  watchers_.roster.observe_stranger(*checked.message, checked.node, frame, at);
  const StrangerRecord& stranger = watchers_.roster.stranger(checked.node);
  if (checked.message->base_id != internal_bus::ident.base_id) return;
  note_identity_for_assignment(checked.node, stranger.serial_number, at);
}

/// Discards everything learned about the cells of a module, when these may have been replaced.
void Core::forget_cells_of(std::uint8_t node) {
  if (modules_.find(node) == nullptr) return;
  cell_charges_.forget_module(modules_.index_of(node));
  estimate_.forget_module(modules_.index_of(node));
  watchers_.steps.forget_module(node);
}

void Core::note_status(std::size_t index, const ModuleRecord& module, TimePoint at) {
  const SetupStage before = setup_.stage(index);
  static_cast<void>(setup_.observe_status(index, module.status.value, at));
  note_set_up(before, index, module.config.node, at);
  if (module.status.value.restarted && seen_complete_) {
    events_.push({.id = EventId::module_restarted, .at = at, .number = module.config.node});
  }
}

void Core::note_set_up(SetupStage before, std::size_t index, std::uint8_t node, TimePoint at) {
  if (before == SetupStage::done || setup_.stage(index) != SetupStage::done) return;
  events_.push({.id = EventId::module_limits_set, .at = at, .number = node});
}

void Core::note_identity(const ModuleRecord& module, const Measured<ModuleIdentity>& before, TimePoint at) {
  const std::uint32_t serial_number = module.identity.value.serial_number;
  const bool is_news = !before.is_valid() || before.value.serial_number != serial_number;
  note_identity_for_assignment(module.config.node, serial_number, at);
  if (!is_news) return;
  if (before.is_valid()) forget_cells_of(module.config.node);
  const Reading where{.element = {.module_node = module.config.node}};
  events_.push({.id = EventId::module_identified, .at = at, .reading = where, .number = serial_number});
  const KnownModule expected = watchers_.roster.finding(module, modules_, at).expected;
  if (!expected.is_known || expected.serial_number == serial_number) return;
  events_.push({.id = EventId::module_out_of_place,
                .at = at,
                .reading = where,
                .threshold = expected.serial_number,
                .number = serial_number});
}

/// From now on the module is registered on its new node, and on no other.
void Core::note_identity_for_assignment(std::uint8_t node, std::uint32_t serial_number, TimePoint at) {
  if (!assignment_.observe_identity(node, serial_number, at)) return;
  watchers_.bus.forget_unknown_module(watchers_.roster.assign(node, serial_number));
  keep_roster();
  forget_cells_of(assignment_.node_before());
  forget_cells_of(node);
  modules_.forget_identity(assignment_.node_before());
  if (modules_.find(node) != nullptr) setup_.start_over(modules_.index_of(node));
  events_.push({.id = EventId::module_given_node,
                .at = at,
                .reading = {.element = {.module_node = node}},
                .number = serial_number});
}

Urgency Core::take_sensor_frame(const CheckedFrame& checked, const CanFrame& frame, TimePoint at) {
  const bool had_word = sensors_.pdu_word.is_valid();
  const PduState before = sensors_.pdu.value;
  const bool is_pdu = checked.message->base_id == internal_bus::pdu_status.base_id;
  if (checked.message->base_id == internal_bus::pdu_temperature.base_id) {
    sensors_.observe(*checked.message, frame, at, config_);
    return Urgency::can_wait;
  }
  const bool is_of_second = checked.message->base_id == internal_bus::sensor_current_2.base_id;
  // Results of a sensor with unknown settings are no measurements.
  const SensorSetup& setup = is_of_second ? second_sensor_setup_ : sensor_setup_;
  if (!is_pdu && !setup.are_results_good(at)) return Urgency::can_wait;
  sensors_.observe(*checked.message, frame, at, config_);
  if (is_pdu) {
    if (had_word) note_pdu_counter(frame.data[6]);
    pdu_counter_ = frame.data[6];
    pdu_words_lost_ = false;
    return flags_.pdu_restarted ? Urgency::decide_now : urgency_of(before, sensors_.pdu.value);
  }
  const bool is_first =
      checked.message->base_id == internal_bus::sensor_current.base_id && config_.sensor.first == nullptr;
  return is_first ? follow_current(at) : Urgency::can_wait;
}

/// A frame of a sensor with frames of its own; none: another frame.
std::optional<Urgency> Core::take_foreign_current(const CanFrame& frame, TimePoint at) {
  const auto news_of = [&frame](const CurrentSensorDriver* driver) {
    return driver != nullptr ? driver->take(frame) : CurrentNews{};
  };
  CurrentNews news = news_of(config_.sensor.first);
  const bool is_first = news.word != CurrentWord::none;
  if (!is_first) news = news_of(config_.sensor.second);
  if (news.word == CurrentWord::none) return std::nullopt;
  if (news.word == CurrentWord::refused) {
    sensors_.refused.note(ResultRefusal::wrong_frame, at);
    return Urgency::can_wait;
  }
  sensors_.observe_current(news.current_mA, is_first, at, config_);
  return is_first ? follow_current(at) : Urgency::can_wait;
}

/// Frames of this node are not received: a command to a sensor is from another node, whatever the command.
bool Core::is_foreign_sensor_command(const CanFrame& frame) const {
  return sensor_setup_.is_command(frame) || second_sensor_setup_.is_command(frame);
}

Urgency Core::take_foreign_sensor_command(const CanFrame& frame, TimePoint at) {
  check_.note_rejected(frame, RejectReason::foreign_master);
  return take_masters_frame(frame, at);
}

/// Answer of a sensor about its settings.
bool Core::take_sensor_answer(const CanFrame& frame, TimePoint at) {
  return take_sensor_answer(sensor_setup_, frame, at) || take_sensor_answer(second_sensor_setup_, frame, at);
}

bool Core::take_sensor_answer(SensorSetup& setup, const CanFrame& frame, TimePoint at) {
  if (!setup.is_there()) return false;
  const SensorSetup before = setup;
  const bool is_answer = setup.observe(frame, at, outputs_.any_contactor());
  if (is_answer) note_sensor_setup(before, setup, at);
  return is_answer;
}

void Core::note_sensor_setup(const SensorSetup& before, const SensorSetup& setup, TimePoint at) {
  const SensorSetupProblem& problem = setup.problem();
  if (setup.restarts() != before.restarts()) {
    events_.push({.id = EventId::sensor_restarted, .at = at, .reading = {.element = {.number = setup.first_told()}}});
  }
  if (setup.stage() == SensorSetupStage::done && before.stage() != SensorSetupStage::done) {
    note_sensor_set_up(setup, at);
  }
  if (problem == before.problem() || !setup.has_failed()) return;
  events_.push({.id = EventId::sensor_set_up_failed,
                .at = at,
                .reading = {.is_known = true, .value = problem.found, .element = {.number = problem.channel}},
                .threshold = problem.wanted,
                .number = static_cast<std::int64_t>(problem.trouble)});
}

/// One event for each channel that was corrected; a single one, without trouble, if the settings were as expected.
void Core::note_sensor_set_up(const SensorSetup& setup, TimePoint at) {
  bool has_changed = false;
  for (const SensorSetupProblem& changed : setup.changed()) {
    if (changed.trouble == SensorSetupTrouble::none) continue;
    has_changed = true;
    events_.push({.id = EventId::sensor_set_up,
                  .at = at,
                  .reading = {.is_known = true, .value = changed.found, .element = {.number = changed.channel}},
                  .threshold = changed.wanted,
                  .number = static_cast<std::int64_t>(changed.trouble)});
  }
  if (has_changed) return;
  events_.push({.id = EventId::sensor_set_up, .at = at, .reading = {.element = {.number = setup.first_told()}}});
}

/// Evaluates the first current, if the frame received at `at` contained a valid one.
Urgency Core::follow_current(TimePoint at) {
  const Measured<std::int32_t>& current = sensors_.current_mA;
  if (current.taken_at != at) return Urgency::can_wait;  // the result was not valid
  counter_.observe(current, sensors_.pack_voltage_mV);
  watchers_.overload.observe(current);
  const bool crosses = current.value >= config_.limits.discharge_overcurrent.open ||
                       -std::int64_t{current.value} >= config_.limits.charge_overcurrent.open;
  return crosses ? Urgency::decide_now : Urgency::can_wait;
}

/// An input is not healthy, a request ended, or a contact moved.
Urgency Core::urgency_of(const PduState& before, const PduState& now) {
  const bool request_fell =
      (before.vehicle_on && !now.vehicle_on) || (before.charger_connected && !now.charger_connected);
  const bool contact_moved = contacts_of(before) != contacts_of(now);
  return !now.is_healthy() || request_fell || contact_moved ? Urgency::decide_now : Urgency::can_wait;
}

/// The counter of a PDU that restarted starts elsewhere. A few messages may be lost in between, at 50 ms each.
void Core::note_pdu_counter(std::uint8_t counter) {
  constexpr std::uint8_t steps_max = 4;
  const auto steps = static_cast<std::uint8_t>(counter - pdu_counter_);
  if ((steps == 0 || steps > steps_max) && !pdu_words_lost_) flags_.pdu_restarted = true;
}

/// One of the messages that this node sends to the inverter.
bool Core::is_battery_frame(const CanFrame& frame) const {
  BatteryReport ignored;
  return inverter_.is_there() && config_.inverter.driver->hear(frame, ignored) != BatteryWord::none;
}

Urgency Core::take(TimePoint at, const FrameEchoed& what) {
  const VehicleConfig& vehicle = config_.vehicle;
  const bool is_reply = vehicle.request_id != 0 && what.frame.id == reply_id_of(vehicle);
  const bool is_report = is_reply || what.frame.id - vehicle.base_id < vehicle_message_count;
  // One interface for several buses reports every frame under the first of them; it is counted for the bus that sent
  // it.
  const bool is_charger_command = chargers_.is_there() && chargers_.driver().order_of(what.frame).has_value();
  const bool is_for_inverter = is_battery_frame(what.frame);
  const Port port = is_report            ? Port::vehicle
                    : is_charger_command ? Port::charger
                    : is_for_inverter    ? Port::inverter
                                         : what.port;
  ++ports_[static_cast<std::size_t>(port)].frames_echoed;
  if (port == Port::internal) claim_.note_echo(at);
  if (port == Port::internal && what.frame.id == internal_bus::contactor_command.base_id) {
    command_link_.note_echo(what.frame.data[6]);
  }
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const SendFailed& what) {
  ++ports_[static_cast<std::size_t>(what.port)].sends_failed;
  const bool is_command = what.port == Port::internal && what.frame.id == internal_bus::contactor_command.base_id &&
                          !what.frame.is_extended;
  if (is_command) command_link_.note_failed();
  const ModuleDriver* const foreign = config_.foreign.driver;
  const bool is_question = what.port == Port::internal && foreign != nullptr && foreign->question_of(what.frame);
  if (is_question) rounds_.note_failed();
  if (what.port == Port::inverter) inverter_reporter_.note_failed(what.frame);
  const bool is_order = what.port == Port::charger && chargers_.is_there() && chargers_.driver().order_of(what.frame);
  if (is_order) charger_command_at_ = at + charger_at_once - chargers_.driver().command_period;  // retried soon
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const PortChanged& what) {
  PortStatus& port = ports_[static_cast<std::size_t>(what.port)];
  if (port.is_up == what.is_up) return Urgency::can_wait;
  port.is_up = what.is_up;
  claim_.note_port(what.port, what.is_up, at);
  if (!what.is_up) ++port.times_down;
  events_.push({.id = what.is_up ? EventId::port_up : EventId::port_down, .at = at, .port = what.port});
  if (what.port != Port::internal) return Urgency::can_wait;
  is_bus_off_ = false;
  update_bus_state(at);
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint, const FramesLost& what) {
  ports_[static_cast<std::size_t>(what.port)].frames_lost += what.count;
  if (what.port != Port::internal) return Urgency::can_wait;
  flags_.frames_lost_seen = true;
  // A jump of the PDU's counter is then no evidence, whether its message came just before this or is still to come.
  flags_.pdu_restarted = false;
  pdu_words_lost_ = true;
  command_link_.note_echoes_lost();
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const BusErrorSeen& what) {
  ++ports_[static_cast<std::size_t>(what.port)].error_frames;
  if (what.port != Port::internal) return Urgency::can_wait;
  const bool was_bus_off = is_bus_off_;
  if ((what.classes & error_class_controller) != 0) {
    if ((what.controller & controller_passive) != 0) watchers_.bus.note_error_passive(true);
    if ((what.controller & controller_active) != 0) watchers_.bus.note_error_passive(false);
  }
  if ((what.classes & error_class_bus_off) != 0) {
    is_bus_off_ = true;
    watchers_.bus.note_bus_off(at);
  }
  if ((what.classes & error_class_restarted) != 0) is_bus_off_ = false;
  if (was_bus_off == is_bus_off_) return Urgency::can_wait;
  update_bus_state(at);
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint at, const CommandGiven& what) {
  switch (what.command) {
    case Command::clear_faults:
      clear_ours_ = true;
      broadcasts_.clear();
      clear_given_ = what;
      charge_resume_.cancel();
      break;
    case Command::wake: rest_.wake(); break;
    case Command::accept_modules: accept_given_ = what; break;
    case Command::assign_node: assign_given_ = what; break;
    case Command::balancing_off: balancing_off_ = true; break;
    case Command::balancing_on: balancing_off_ = false; break;
    case Command::shut_down:
      if (!shutting_down_) {
        shutting_down_ = true;
        shut_down_at_ = at;
        events_.push({.id = EventId::shutting_down, .at = at});
      }
      break;
  }
  return Urgency::decide_now;
}

Urgency Core::take(TimePoint at, const WallClockSeen& what) {
  const Duration offset = std::chrono::milliseconds{what.unix_time_ms} - at.time_since_epoch();
  const Duration jump = offset > clock_offset_ ? offset - clock_offset_ : clock_offset_ - offset;
  flags_.clock_jumped = flags_.clock_jumped || (is_clock_known_ && jump >= clock_jump_min);
  is_clock_known_ = true;
  clock_offset_ = offset;
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint, const HealthSeen& what) {
  flags_.health = what.health;
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const LinesSeen& what) {
  const PduState before = sensors_.pdu.value;
  const bool fails = what.image.is_failed && !flags_.lines_failed;
  flags_.lines_failed = what.image.is_failed;
  sensors_.observe(what.image, at, config_);
  return fails ? Urgency::decide_now : urgency_of(before, sensors_.pdu.value);
}

Urgency Core::take(TimePoint at, const PulsesSeen& what) {
  insulation_.observe(what.pwm, at);
  sensors_.refused_pulses.observe(what.pwm, at);
  return Urgency::can_wait;  // no single period opens a pack
}

Urgency Core::take(TimePoint at, const ClaimBegins& what) {
  claim_.begin(what.length, what.is_kept);
  for (const Port port : all_ports) {
    if (ports_[static_cast<std::size_t>(port)].is_up) claim_.note_port(port, true, at);
  }
  return Urgency::can_wait;
}

Urgency Core::take(TimePoint at, const IntakeAirSeen& what) {
  sensors_.observe_intake_air(what.temperature_dC, at, config_);
  return Urgency::can_wait;
}

/// After the bus was down, previous values are invalid.
void Core::update_bus_state(TimePoint at) {
  const bool is_up = ports_[static_cast<std::size_t>(Port::internal)].is_up && !is_bus_off_;
  if (is_up == flags_.internal_bus_up) return;
  flags_.internal_bus_up = is_up;
  command_link_.forget();
  start_over(at);
}

/// As after a start: all values are invalid, and a module or sensor that was not yet received is not lost before
/// start_grace is over.
void Core::start_over(TimePoint at) {
  view_began_at_ = at;
  seen_complete_ = false;
  modules_.forget_values();
  sensors_.forget_values(at);
  watchers_.trend.forget();
  watchers_.stuck.forget();
  watchers_.steps.forget();
  watchers_.switches.forget();
  balancing_.forget(at);
  waiting_orders_ = {};
  setup_.start_over();
  rounds_.start_over(at);
  pace_.start_over(at);
  ages_slow_until_ = {};
  check_.forget_counters();
  foreign_check_.forget_counters();
  request_.lose_sight();
  second_pack_.forget_values(at);
  sensor_setup_.start_over();
  second_sensor_setup_.start_over();
  insulation_.forget_values();
  chargers_.forget_values();
  charger_watch_.forget();
  charge_.forget();
  inverter_.forget_values();
  requests_.forget();
}

}  // namespace bmu
