#include "tests/support/wired_pack.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <malloc.h>

#include "protocol/tables/internal_bus.hpp"

namespace bmu::test {

Station station_of(const CanFrame& frame) {
  const MessageMatch match = internal_bus::catalogue.find(frame.id);
  if (match.message == nullptr) return Station::stranger;
  if (match.message->sender == Sender::mmu) return static_cast<Station>(match.node);
  return match.message->base_id == internal_bus::pdu_status.base_id ? Station::pdu : Station::sensor;
}

namespace {

/// Copies of a core have two megabytes each and are made by the thousand. Returning their memory to the system and
/// faulting it in again for each of them takes most of a test's time.
void keep_freed_memory() {
  static const bool is_kept = ::mallopt(M_MMAP_MAX, 0) == 1 && ::mallopt(M_TRIM_THRESHOLD, -1) == 1;
  static_cast<void>(is_kept);  // without it the tests are only slower
}

/// Modules of another maker use identifiers that have another meaning in this project's protocol.
Station station_in(const CoreConfig& config, const CanFrame& frame) {
  const ModuleDriver* const driver = config.foreign.driver;
  const MessageMatch match = driver != nullptr ? driver->catalogue->find(frame) : MessageMatch{};
  const bool is_foreign = match.message != nullptr && match.message->sender != Sender::sensor;
  return is_foreign ? static_cast<Station>(match.node + driver->maker_less) : station_of(frame);
}

// The kernel's CAN_ERR_* classes and the bits of the controller's byte.
constexpr std::uint32_t class_controller = 0x004;
constexpr std::uint32_t class_bus_off = 0x040;
constexpr std::uint32_t class_restarted = 0x100;
constexpr std::uint8_t receive_warning = 0x04;
constexpr std::uint8_t transmit_warning = 0x08;
constexpr std::uint8_t receive_passive = 0x10;
constexpr std::uint8_t transmit_passive = 0x20;
constexpr std::uint8_t active_again = 0x40;

/// The daemon's port checks its interface this often; an interface with a controller in bus-off has no carrier.
constexpr Duration look_period = 100ms;

/// Controller byte of a kernel's error frame: which of the two counters, and the state.
std::uint8_t controller_byte(const BusEvent& event) {
  const bool is_of_transmitter = event.counters.transmit >= event.counters.receive;
  if (event.state == ErrorState::passive) return is_of_transmitter ? transmit_passive : receive_passive;
  if (event.state == ErrorState::warning) return is_of_transmitter ? transmit_warning : receive_warning;
  return active_again;
}

FrontEndTransfer twin_transfer() {
  FrontEndInputs inputs;
  inputs.cell_voltage_uV.fill(3'600'000);
  inputs.module_mV = 3'600 * static_cast<std::int32_t>(mmu_cells_max);
  inputs.cell_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, 25.0));
  inputs.board_sensor_Ohm.fill(thermistor_Ohm(ThermistorCurve::table, 25.0));
  return convert(inputs, TransferWanted::everything);
}

}  // namespace

namespace {

SimulatorConfig noisy(SimulatorConfig config, std::int32_t cell_noise_uV) {
  config.cell_noise_uV = cell_noise_uV;
  return config;
}

}  // namespace

WiredPack::WiredPack(const CoreConfig& config, Duration devices_ahead, const BusConfig& bus, TimePoint starts_at,
                     std::int32_t cell_noise_uV)
    : now_(starts_at),
      devices_tick_at_(starts_at - devices_ahead % Plant::step_length + Plant::step_length),
      wake_at_(starts_at),
      given_(std::in_place, config),
      core_(std::in_place, config, starts_at),
      simulator_(noisy(simulator_config(config), cell_noise_uV), {}, starts_at - devices_ahead),
      bus_(bus) {
  keep_freed_memory();
  for (const Station station : {Station::master, Station::pdu, Station::sensor, Station::stranger}) {
    bus_.connect(station);
  }
  for (const ModuleConfig& module : config.modules) bus_.connect(static_cast<Station>(module.node));
  static_cast<void>(simulator_.advance(starts_at));  // received by no node
  raise_ports();
}

void WiredPack::raise_ports() {
  observe(PortChanged{Port::internal, is_port_up_});
  observe(PortChanged{Port::vehicle, true});
  if (given_->charger.driver != nullptr) observe(PortChanged{Port::charger, true});
  if (given_->inverter.driver != nullptr) observe(PortChanged{Port::inverter, true});
}

std::uint8_t WiredPack::last_node() const {
  return config().modules[config().modules.size() - 1].node;
}

bool WiredPack::coils_are_driven() const {
  const ContactorFlags& coils = simulator_.pdu().outputs().contactors;
  return std::any_of(coils.begin(), coils.end(), [](bool is_driven) { return is_driven; });
}

// --- time -----------------------------------------------------------------------------------------------------------

void WiredPack::run(Duration duration) {
  const TimePoint end = now_ + duration;
  while (now_ < end) advance_to(end);
}

bool WiredPack::run_until(const std::function<bool(const WiredPack&)>& condition, Duration at_most) {
  const TimePoint end = now_ + at_most;
  while (now_ < end && !condition(*this)) advance_to(end);
  return condition(*this);
}

/// Advances to the next event, at most to `end`.
void WiredPack::advance_to(TimePoint end) {
  const TimePoint wakes_at = has_power_ ? std::max(wake_at_, stalled_until_) : TimePoint::max();
  const TimePoint bus_at = bus_.next_at() > now_ ? bus_.next_at() : end;  // a frame from outside joins the next event
  TimePoint next = std::min({end, devices_tick_at_, bus_at, wakes_at, carrier_told_at_.value_or(end)});
  for (const Told& one : told_) next = std::min(next, one.at);
  now_ = next;
  take_from_bus();
  tell_carrier();
  tell_due();
  if (now_ >= devices_tick_at_) tick_devices();
  if (now_ >= wakes_at) {
    if (const std::uint64_t lost = std::exchange(lost_while_stalled_, 0); lost > 0) {
      observe(FramesLost{Port::internal, lost});
    }
    decide();
  }
  if (flood && bus_.waiting(Station::stranger) == 0) bus_.put(Station::stranger, *flood);
  bus_.start_if_idle(now_);
}

void WiredPack::tick_devices() {
  devices_tick_at_ += Plant::step_length;
  if (each_ms) each_ms(*this);
  std::erase_if(late_, [this](const Due& due) {
    if (due.at > now_) return false;
    put_of_device(station_in(*given_, due.frame), due.frame);
    return true;
  });
  for (const SentFrame& sent : simulator_.advance(now_)) {
    CanFrame frame = sent.frame;
    const Station station = station_in(*given_, frame);
    const Fate fate = on_sent ? on_sent(frame, *this) : Fate{};
    last_sent_[sent.frame.id] = sent.frame;
    if (fate.is_lost) continue;
    if (fate.delay > Duration{}) {
      late_.push_back({now_ + fate.delay, frame});
    } else {
      put_of_device(station, frame);
    }
    if (fate.twin) put_of_device(station, *fate.twin);
  }
  if (!twin_) return;
  static const FrontEndTransfer transfer = twin_transfer();
  for (const CanFrame& frame : twin_->tick(now_, transfer)) bus_.put(Station::twin, frame);
}

void WiredPack::put_of_device(Station station, const CanFrame& frame) {
  if (!device_queue_length || bus_.waiting(station) < *device_queue_length) bus_.put(station, frame);
}

void WiredPack::cut_power() {
  has_power_ = false;
  bus_.disconnect(Station::master);
  bus_.drop_queue(Station::master);
  told_.clear();
  carrier_told_at_.reset();
  lost_while_stalled_ = 0;
}

void WiredPack::boot(const PersistentState& kept, std::uint8_t first_counter) {
  *core_ = Core(*given_, now_, first_counter);
  core_->restore(kept);
  bus_.connect(Station::master);
  bus_.restart(Station::master, now_);
  is_off_ = false;
  has_power_ = true;
  wake_at_ = now_;
  raise_ports();
}

void WiredPack::connect_twin(const MmuConfig& module) {
  twin_.emplace(module, now_);
  bus_.connect(Station::twin);
}

void WiredPack::stall(Duration duration) {
  stop(duration);
  run(duration);
}

// --- frames ---------------------------------------------------------------------------------------------------------

void WiredPack::take_from_bus() {
  for (const BusEvent& event : bus_.take_due(now_)) {
    if (event.kind == BusEvent::Kind::heard) take_heard(event);
    if (event.kind == BusEvent::Kind::state && event.station == Station::master) take_master_state(event);
  }
}

void WiredPack::take_heard(const BusEvent& event) {
  const CanFrame& frame = event.frame;
  const bool is_ours = event.station == Station::master;
  const bool is_missed = is_cut || (devices_miss && devices_miss(frame));
  const bool is_for_devices = (is_ours && !is_missed) || event.station == Station::stranger;
  if (is_for_devices) simulator_.observe(frame, now_);
  if (is_for_devices && twin_) twin_->observe(frame, now_);
  if (is_ours && frame.id == internal_bus::contactor_command.base_id) commanded_ = outputs_of(frame);
  if (is_ours && frame.id == internal_bus::poll.base_id) poll_counter_ = frame.data[6];
  const bool is_deaf = is_cut || is_swallowing || event.missed_by == Station::master;
  if (is_ours) {
    tell(FrameEchoed{Port::internal, frame});
  } else if (!is_deaf && core_->port(Port::internal).is_up) {
    tell(FrameReceived{Port::internal, frame});
  }
}

/// Reported as by the kernel: an error frame for each change, and a carrier that goes and comes. The error frame of a
/// restart is reported when the controller is back on the bus, not when the restart was commanded.
void WiredPack::take_master_state(const BusEvent& event) {
  if (event.state == ErrorState::bus_off) {
    is_off_ = true;
    tell(BusErrorSeen{.port = Port::internal, .classes = class_bus_off});
    carrier_told_at_ = now_ + look_period;
  } else if (std::exchange(is_off_, false)) {
    tell(BusErrorSeen{.port = Port::internal, .classes = class_restarted});
    carrier_told_at_ = now_ + look_period;
  } else {
    tell(BusErrorSeen{.port = Port::internal, .classes = class_controller, .controller = controller_byte(event)});
  }
}

void WiredPack::tell_carrier() {
  if (!carrier_told_at_ || *carrier_told_at_ > now_) return;
  carrier_told_at_.reset();
  tell(PortChanged{Port::internal, !is_off_});
}

void WiredPack::tell(const ObservedThing& what) {
  if (!has_power_) return;
  if (now_ < stalled_until_) {
    ++lost_while_stalled_;
  } else if (latency > Duration{}) {
    told_.push_back({now_ + latency, what});
  } else {
    observe(what);
  }
}

void WiredPack::tell_due() {
  while (!told_.empty() && told_.front().at <= now_) {
    const ObservedThing what = told_.front().what;
    told_.erase(told_.begin());
    observe(what);
  }
}

void WiredPack::observe(const ObservedThing& what) {
  if (!has_power_) return;
  ObservedThing told = what;
  if (on_told && !on_told(told, *this)) return;
  if (core_->observe({now_, told}) == Urgency::decide_now) decide();
}

void WiredPack::decide() {
  const Phase before = phase();
  Decisions decisions = core_->decide(now_);
  if (on_decided) on_decided(decisions, *this);
  wake_at_ = decisions.wake_at;
  if (phase() != before) ++entered_[static_cast<std::size_t>(phase())];
  for (const OutgoingFrame& out : decisions.frames) {
    const bool is_on_this_bus = config().served_by[static_cast<std::size_t>(out.port)] == Port::internal;
    if (!is_on_this_bus || is_swallowing) continue;
    if (sends_fail || bus_.waiting(Station::master) >= queue_length) {
      static_cast<void>(core_->observe({now_, SendFailed{out.port, out.frame}}));
    } else {
      bus_.put(Station::master, out.frame);
    }
  }
}

void WiredPack::carry_elsewhere(Port told_by, const CanFrame& frame, bool is_ours, bool are_deaf) {
  if (is_ours && !are_deaf) simulator_.observe_elsewhere(told_by, frame, now_);
  if (is_ours) {
    tell(FrameEchoed{told_by, frame});
  } else if (core_->port(told_by).is_up) {
    tell(FrameReceived{told_by, frame});
  }
}

void WiredPack::set_port(bool is_up) {
  is_port_up_ = is_up;
  if (!is_up) bus_.drop_queue(Station::master);
  observe(PortChanged{Port::internal, is_up});
}

// --- for tests -------------------------------------------------------------------------------------------------------

void WiredPack::apply(std::string_view events) {
  const ModuleConfig& module = config().modules[config().modules.size() - 1];
  const std::string node = std::to_string(module.node);
  std::string text(events);
  const auto replace = [&text](std::string_view what, const std::string& with) {
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what)) text.replace(at, what.size(), with);
  };
  replace("$N", node);
  replace("$C", node + "." + std::to_string(module.cell_count));
  replace("$T", node + "." + std::to_string(module.temperature_sensor_count));
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    const std::size_t first = text.find_first_not_of(' ', begin);
    const std::string event = text.substr(first, end - first);
    if (!simulator_.apply(event)) throw std::runtime_error("event '" + event + "' is not understood");
    begin = end + 1;
  }
}

bool WiredPack::close() {
  run(1500ms);
  apply("vehicle on");
  return run_until([](const WiredPack& pack) { return pack.phase() == Phase::closed; }, 4s);
}

}  // namespace bmu::test
