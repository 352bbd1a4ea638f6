#include "tests/support/polled_pack.hpp"

#include <algorithm>

#include "config/checks/bus_budget.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/worked_frames.hpp"

namespace bmu::test {

namespace {

constexpr TimePoint start{1s};
constexpr Duration devices_tick = 1ms;

MmuConfig module_config(const ModuleConfig& module, Pace pace) {
  MmuConfig config{.node = module.node,
                   .cell_count = module.cell_count,
                   .temperature_sensor_count = module.temperature_sensor_count,
                   .serial_number = 1'000U + module.node};
  if (pace != Pace::paced) config.frame_spacing = 0us;
  return config;
}

/// A pack in use: cells around 3.65 V, at most 20 mV apart, 22 to 30 C. The same numbers in every run.
FrontEndTransfer realistic(const ModuleConfig& module, Random& random) {
  constexpr double tenths = 10.0;
  FrontEndInputs inputs;
  std::int64_t sum_uV = 0;
  for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
    const std::int64_t voltage_uV = 3'650'000 + 100 * random.between(-100, 100);
    inputs.cell_voltage_uV[cell] = static_cast<std::int32_t>(voltage_uV);
    sum_uV += voltage_uV;
  }
  inputs.converted_cells = first_cells(module.cell_count);
  inputs.module_mV = static_cast<std::int32_t>(sum_uV / 1'000);
  const auto thermistor_at = [](std::int64_t temperature_dC) {
    return thermistor_Ohm(ThermistorCurve::table, static_cast<double>(temperature_dC) / tenths);
  };
  for (double& one : inputs.cell_sensor_Ohm) one = thermistor_at(random.between(220, 300));
  for (double& one : inputs.board_sensor_Ohm) one = thermistor_at(10 * random.between(25, 35));
  return convert(inputs, TransferWanted::everything);
}

bool is_answer(const CanFrame& frame) {
  const MessageMatch match = internal_bus::catalogue.find(frame.id);
  return match.message != nullptr && match.message->sender == Sender::mmu &&
         match.message->base_id != internal_bus::response.base_id;
}

}  // namespace

PolledPack::PolledPack(const CoreConfig& config, std::int64_t bits_per_s, Pace pace)
    : pace_(pace),
      core_(config, start),
      pdu_(start),
      sensor_(CurrentSensorConfig{}, start),
      bus_({.bits_per_s = bits_per_s, .stuffing = Stuffing::exact}),
      bit_time_(bit_time(bits_per_s)) {
  for (const Station station : {Station::master, Station::pdu, Station::sensor}) bus_.connect(station);
  Random random(63);
  for (const ModuleConfig& module : config.modules) {
    bus_.connect(static_cast<Station>(module.node));
    modules_.emplace_back(module_config(module, pace), start);
    transfers_.push_back(realistic(module, random));
    answers_wanted_ += static_cast<std::size_t>(answer_frames(module, {}));
  }
  observe(PortChanged{Port::internal, true});
  observe(PortChanged{Port::vehicle, true});
}

std::vector<PollCycle> PolledPack::run(Duration duration) {
  const TimePoint end = now_ + duration;
  done_.clear();
  while (now_ < end) step(end);
  return done_;
}

void PolledPack::step(TimePoint end) {
  now_ = std::max(now_, std::min({end, bus_.next_at(), devices_tick_at_, wake_at_}));
  for (const BusEvent& event : bus_.take_due(now_)) {
    if (event.kind == BusEvent::Kind::heard) take_heard(event);
  }
  if (now_ >= devices_tick_at_) tick_devices();
  if (now_ >= wake_at_) decide();
  bus_.start_if_idle(now_);
}

void PolledPack::take_heard(const BusEvent& event) {
  follow_cycle(event);
  if (event.station != Station::master) return observe(FrameReceived{Port::internal, event.frame});
  pdu_.observe(event.frame, now_);
  for (std::size_t module = 0; module < modules_.size(); ++module) {
    modules_[module].observe(event.frame, now_);
    if (pace_ == Pace::prompt) tick_module(module);
  }
  observe(FrameEchoed{Port::internal, event.frame});
}

/// A POLL to all modules for all data but identities starts a cycle; another POLL ends it unfinished.
void PolledPack::follow_cycle(const BusEvent& event) {
  using namespace internal_bus;
  const Duration length = bits_on_wire(event.frame) * bit_time_;
  if (event.frame.id == poll.base_id) {
    cycle_.reset();
    const bool is_measured = read_raw<poll, "target_node">(event.frame) == 0 &&
                             read_raw<poll, "want_temp">(event.frame) != 0 &&
                             read_raw<poll, "want_ident">(event.frame) == 0;
    const TimePoint began_at = event.at - (length - can_bits_between_frames * bit_time_);
    if (is_measured) cycle_ = PollCycle{.began_at = began_at, .minimum = length};
    return;
  }
  if (!cycle_) return;
  if (!is_answer(event.frame)) {
    cycle_->others += length;
    return;
  }
  cycle_->minimum += length;
  if (++cycle_->answers < answers_wanted_) return;
  cycle_->minimum -= can_bits_between_frames * bit_time_;  // not waited for after the last one
  cycle_->took = event.at - cycle_->began_at;
  done_.push_back(*cycle_);
  cycle_.reset();
}

void PolledPack::tick_devices() {
  devices_tick_at_ += devices_tick;
  for (std::size_t module = 0; module < modules_.size(); ++module) tick_module(module);
  PduMeasurements inputs;
  for (const CanFrame& frame : pdu_.tick(now_, inputs)) bus_.put(Station::pdu, frame);
  for (const CanFrame& frame : sensor_.tick(now_, {.pack_mV = 400'000})) bus_.put(Station::sensor, frame);
}

void PolledPack::tick_module(std::size_t module) {
  Mmu& mmu = modules_[module];
  for (const CanFrame& frame : mmu.tick(now_, transfers_[module])) {
    bus_.put(static_cast<Station>(mmu.node()), frame);
  }
}

void PolledPack::observe(const ObservedThing& what) {
  if (core_.observe({now_, what}) == Urgency::decide_now) decide();
}

void PolledPack::decide() {
  const Decisions decisions = core_.decide(now_);
  wake_at_ = decisions.wake_at;
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port == Port::internal) bus_.put(Station::master, out.frame);
  }
}

}  // namespace bmu::test
