#include "tests/support/core_bench.hpp"

#include <algorithm>
#include <utility>

namespace bmu::test {

namespace {

using namespace internal_bus;

constexpr Duration contact_opens_after = 15ms;

void fill_limits(CoreConfig& config) {
  config.limits.cell_undervoltage = {.warn = 3'100'000, .open = 2'900'000, .hysteresis = 50'000};
  config.limits.cell_overvoltage = {.warn = 4'150'000, .open = 4'200'000, .hysteresis = 20'000};
  config.limits.cell_overtemperature = {.warn = 500, .open = 600, .hysteresis = 50};
  config.limits.cell_undertemperature = {.warn = -50, .open = -200, .hysteresis = 20};
  config.limits.discharge_overcurrent = {.warn = 90'000, .open = 100'000, .hysteresis = 5'000, .confirm = 100ms};
  config.limits.charge_overcurrent = {.warn = 25'000, .open = 30'000, .hysteresis = 2'000, .confirm = 100ms};
  // Values jump in this bench; a test of these faults sets the limits itself.
  config.limits.temperature_rise = never_above;
  config.limits.temperature_spread = never_above;
  config.limits.pack_voltage_mismatch = {.warn = 500, .open = 1'000, .hysteresis = 200, .confirm = 300ms};
}

CoreConfig pack_with(std::size_t modules, std::uint8_t cells, std::uint8_t sensors) {
  CoreConfig config;
  for (std::size_t index = 0; index < modules; ++index) {
    config.modules.push_back(
        {.node = static_cast<std::uint8_t>(index + 1), .cell_count = cells, .temperature_sensor_count = sensors});
  }
  config.cell.capacity_uAs = 50 * uAs_per_Ah;
  config.cell.ocv.push_back({0, 3'000'000});
  config.cell.ocv.push_back({500, 3'700'000});
  config.cell.ocv.push_back({1000, 4'200'000});
  config.current = {.discharge_continuous_mA = 80'000, .charge_continuous_mA = 20'000};
  fill_limits(config);
  config.contactors.precharge_tries = 1;  // the first failure is the fault
  return config;
}

}  // namespace

CoreConfig small_pack() {
  return pack_with(2, 4, 2);
}
CoreConfig pack_of(std::size_t modules) {
  return pack_with(modules, 12, 4);
}

CoreBench::CoreBench(const CoreConfig& config, const PersistentState& state, std::uint8_t first_counter,
                     const std::optional<ClaimBegins>& claim)
    : core_(std::in_place, config, now_, first_counter), wake_at_(now_) {
  core_->restore(state);
  for (const ModuleConfig& module : config.modules) {
    BenchModule one{
        .node = module.node, .cell_count = module.cell_count, .sensor_count = module.temperature_sensor_count};
    one.cell_voltage_uV.fill(known(3'700'000));
    one.cell_temperature_dC.fill(known(250));
    one.serial_number += module.node;
    modules.push_back(one);
  }
  inputs = {.estop_1_released = true,
            .estop_2_released = true,
            .interlock_closed = true,
            .insulation_monitor_ok = true,
            .insulation_state = InsulationState::normal,
            .insulation_resistance_Ohm = known(1'200'000)};
  if (claim) observe(*claim);
  observe(PortChanged{Port::internal, true});
  observe(PortChanged{Port::vehicle, true});
}

void CoreBench::observe(const ObservedThing& what) {
  if (on_observe) on_observe({now_, what});
  if (core_->observe({now_, what}) == Urgency::decide_now) decide();
}

void CoreBench::deliver(const CanFrame& frame) {
  if (is_lost && is_lost(frame)) return;
  observe(FrameReceived{Port::internal, frame});
}

void CoreBench::decide() {
  if (on_decide) on_decide(now_);
  last_ = core_->decide(now_);
  wake_at_ = last_.wake_at;
  for (const Event& event : last_.events) events_.push_back(event);
  for (const OutgoingFrame& frame : last_.frames) {
    sent_.push_back(frame);
    sent_at_.push_back(now_);
    if (!bus_echoes) continue;
    if (!bus_is_stuck) {
      put_on_bus(frame);
    } else if (queue_.size() < queue_length) {
      queue_.push_back(frame);
    } else {
      static_cast<void>(core_->observe({now_, SendFailed{frame.port, frame.frame}}));
    }
  }
}

void CoreBench::put_on_bus(const OutgoingFrame& frame) {
  if (!echo_is_lost || !echo_is_lost(frame)) echoes_.push_back(frame);
  if (frame.port == Port::internal) obey(frame);
}

void CoreBench::free_bus() {
  bus_is_stuck = false;
  for (const OutgoingFrame& frame : std::exchange(queue_, {})) put_on_bus(frame);
}

void CoreBench::restart_pdu() {
  pdu_counter_ = 0;
  commanded_ = contacts_ = {};
  opened_by_timeout_ = false;
}

void CoreBench::obey(const OutgoingFrame& out) {
  const MessageMatch match = catalogue.find(out.frame.id);
  if (match.message == &poll && !loses_polls) answer_poll(out.frame);
  if (match.message == &command) answer_command(out.frame, match.node);
  if (match.message != &contactor_command || !pdu_hears) return;
  command_expires_at_ = now_ + contactor_command_life;
  opened_by_timeout_ = false;
  const ContactorOutputs asked = outputs_of(out.frame);
  if (asked == commanded_) return;
  if (commanded_.any_contactor() && !asked.any_contactor()) opened_at_ = now_;
  const std::array was{commanded_.main_positive, commanded_.main_negative, commanded_.precharge, commanded_.charge};
  const std::array wanted{asked.main_positive, asked.main_negative, asked.precharge, asked.charge};
  for (std::size_t index = 0; index < wanted.size(); ++index) {
    if (was[index] == wanted[index]) continue;
    contacts_follow_at_[index] = now_ + (wanted[index] ? contact_delays[index] : contact_opens_after);
  }
  commanded_ = asked;
}

void CoreBench::answer_poll(const CanFrame& request) {
  if (before_poll) before_poll();
  const std::uint8_t counter = request.data[6];
  const auto put = [&](const MessageSpec& row, CanFrame frame) {
    seal(row, counter, frame);
    due_.push_back({now_ + answer_delay, frame});
  };
  const std::int64_t target = read_raw<poll, "target_node">(request);
  for (BenchModule& module : modules) {
    if (!module.talks || (target != 0 && target != module.node)) continue;
    CanFrame said = make_frame(status, module.node);
    write<status, "mode">(said, static_cast<std::int64_t>(module.mode));
    write<status, "supply">(said, module.on_module_supply ? 1 : 0);
    write<status, "cell_count">(said, module.cell_count);
    write<status, "limits_not_set">(said, module.limits_not_set ? 1 : 0);
    write<status, "restarted">(said, module.restarted ? 1 : 0);
    write<status, "undervoltage_cells">(said, module.undervoltage_cells);
    write<status, "overvoltage_cells">(said, module.overvoltage_cells);
    write<status, "cell_voltage_age_ms">(said, module.voltage_age_ms);
    write<status, "board_too_hot">(said, module.board_too_hot ? 1 : 0);
    module.restarted = false;
    if (module.sends_status) put(status, said);
    std::int64_t sum_uV = 0;
    for (unsigned block = 0; block * 3 < module.cell_count; ++block) {
      CanFrame cells = make_frame(*cells_rows[block], module.node);
      for (unsigned slot = 0; slot < 3; ++slot) {
        const unsigned cell = block * 3 + slot;
        const SignalValue value =
            cell < module.cell_count ? module.cell_voltage_uV[cell] : not_known(Validity::not_fitted);
        encode_signal(cells_rows[block]->signals[slot], value, cells.data);
        sum_uV += value.is_valid() ? value.value : 0;
      }
      put(*cells_rows[block], cells);
    }
    if (module.sends_temperatures && read_raw<poll, "want_temp">(request) != 0) {
      CanFrame first = make_frame(temp_1, module.node);
      for (unsigned slot = 0; slot < 3; ++slot) {
        encode_signal(temp_1.signals[slot],
                      slot < module.sensor_count ? module.cell_temperature_dC[slot] : not_known(Validity::not_fitted),
                      first.data);
      }
      put(temp_1, first);
      CanFrame second = make_frame(temp_2, module.node);
      encode_signal(temp_2.signals[0],
                    module.sensor_count > 3 ? module.cell_temperature_dC[3] : not_known(Validity::not_fitted),
                    second.data);
      for (unsigned slot = 1; slot <= 4; ++slot)
        encode_signal(temp_2.signals[slot], known(280 + 10 * slot), second.data);
      put(temp_2, second);
    }
    CanFrame stack = make_frame(internal_bus::module, module.node);
    write<internal_bus::module, "module_voltage_mV">(stack, sum_uV / 1000);
    write<internal_bus::module, "open_wire_cells">(stack, module.open_wire_cells);
    write<internal_bus::module, "balancing_cells">(stack, module.balancing_cells);
    put(internal_bus::module, stack);
    if (read_raw<poll, "want_ident">(request) != 0) {
      CanFrame who = make_frame(ident, module.node);
      write<ident, "protocol_version">(who, 1);
      write<ident, "cell_count">(who, module.cell_count);
      write<ident, "temperature_sensor_count">(who, module.sensor_count);
      write<ident, "serial_number">(who, module.serial_number);
      put(ident, who);
    }
  }
}

void CoreBench::answer_command(const CanFrame& request, std::uint8_t node) {
  const std::int64_t operation = read_raw<internal_bus::command, "operation">(request);
  const bool sets_node = operation == static_cast<std::int64_t>(Operation::set_node);
  for (BenchModule& module : modules) {
    const bool is_meant = read_raw<internal_bus::command, "serial_number">(request) == module.serial_number;
    if (sets_node && is_meant && module.talks && !module.ignores_commands) {
      module.node = static_cast<std::uint8_t>(read_raw<internal_bus::command, "new_node">(request));
    }
    if (module.node != node || !module.talks || module.ignores_commands) continue;
    const bool sets_limits = operation == static_cast<std::int64_t>(Operation::set_limits);
    if (sets_limits && !module.only_says_done && !module.refuses_limits) module.limits_not_set = false;
    CanFrame answer = make_frame(response, node);
    write<response, "operation">(answer, request.data[0]);
    const bool is_balance = operation == static_cast<std::int64_t>(Operation::balance);
    write<response, "result">(answer, module.refuses_limits || (is_balance && module.refuses_balancing) ? 3 : 0);
    seal(response, request.data[6], answer);
    due_.push_back({now_ + 2ms, answer});
  }
}

std::int32_t CoreBench::cell_sum_mV() const {
  std::int64_t sum_uV = 0;
  for (const BenchModule& module : modules) {
    for (std::size_t cell = 0; cell < module.cell_count; ++cell) sum_uV += module.cell_voltage_uV[cell].value;
  }
  return mV_from_uV(sum_uV);
}

void CoreBench::follow_contactors() {
  if (now_ >= command_expires_at_ && commanded_.any_contactor()) {  // as the PDU must
    commanded_ = {};
    contacts_follow_at_.fill(now_ + contact_opens_after);
    opened_by_timeout_ = true;
  }
  if (contacts_held_open) contacts_ = {};
  if (!contactors_stuck && !contacts_held_open) {
    if (now_ >= contacts_follow_at_[0]) contacts_.main_positive = commanded_.main_positive;
    if (now_ >= contacts_follow_at_[1]) contacts_.main_negative = commanded_.main_negative;
    if (now_ >= contacts_follow_at_[2]) contacts_.precharge = commanded_.precharge;
    if (now_ >= contacts_follow_at_[3]) contacts_.charge = commanded_.charge;
  }
  if (main_positive_held_open) contacts_.main_positive = false;
  const std::int32_t pack = pack_voltage_mV.value_or(cell_sum_mV());
  const bool mains_make = contacts_.main_negative && contacts_.main_positive;
  if (mains_make && !mains_made_ && on_mains_made) on_mains_made(link_voltage_mV, pack);
  mains_made_ = mains_make;
  if (mains_make) {
    link_voltage_mV = pack;
  } else if (contacts_.main_negative && contacts_.precharge) {
    link_voltage_mV = std::min(pack, link_voltage_mV + link_rise_mV_per_ms);
  } else {
    link_voltage_mV = std::max(0, link_voltage_mV - link_fall_mV_per_ms);
  }
}

void CoreBench::send_periodic() {
  const std::int64_t ms = to_ms(now_.time_since_epoch());
  const auto sensor = [&](const MessageSpec& row, std::int64_t value, std::uint8_t counter) {
    CanFrame frame = make_frame(row);
    encode_signal(row.signals[0], known(value), frame.data);
    seal(row, counter, frame);
    deliver(frame);
  };
  const bool is_precharging = contacts_.precharge && !contacts_.main_positive;
  if (sensor_talks && ms % 20 == 0) {
    sensor(sensor_current, is_precharging ? precharge_current_mA : current_mA, sensor_counter_++);
  }
  if (sensor_talks && voltage_talks && ms % 60 == 0) {
    sensor(sensor_u1, pack_voltage_mV.value_or(cell_sum_mV()), voltage_counter_);
    sensor(sensor_u2, link_voltage_mV, voltage_counter_++);
  }
  const bool has_news = pdu_tells_changes && contacts_ != told_contacts_;
  if (pdu_talks && (ms % 50 == 0 || has_news)) tell_pdu_status();
}

void CoreBench::tell_pdu_status() {
  told_contacts_ = contacts_;
  const ContactorOutputs told = feedback_lies ? commanded_ : contacts_;
  CanFrame frame = make_frame(pdu_status);
  write<pdu_status, "main_positive_closed">(frame, told.main_positive ? 1 : 0);
  write<pdu_status, "main_negative_closed">(frame, told.main_negative ? 1 : 0);
  write<pdu_status, "precharge_closed">(frame, told.precharge ? 1 : 0);
  write<pdu_status, "charge_closed">(frame, told.charge ? 1 : 0);
  write<pdu_status, "opened_by_timeout">(frame, opened_by_timeout_ ? 1 : 0);
  write<pdu_status, "vehicle_on">(frame, inputs.vehicle_on ? 1 : 0);
  write<pdu_status, "charger_connected">(frame, inputs.charger_connected ? 1 : 0);
  write<pdu_status, "estop_1_released">(frame, inputs.estop_1_released ? 1 : 0);
  write<pdu_status, "estop_2_released">(frame, inputs.estop_2_released ? 1 : 0);
  write<pdu_status, "interlock_closed">(frame, inputs.interlock_closed ? 1 : 0);
  write<pdu_status, "insulation_monitor_ok">(frame, inputs.insulation_monitor_ok ? 1 : 0);
  write<pdu_status, "insulation_resistance_Ohm">(frame, inputs.insulation_resistance_Ohm);
  write<pdu_status, "insulation_monitor_state">(frame, static_cast<std::int64_t>(inputs.insulation_state));
  write<pdu_status, "resume_button">(frame, inputs.resume_button ? 1 : 0);
  write<pdu_status, "throttle_permille">(frame, inputs.throttle_permille);
  seal(pdu_status, pdu_counter_++, frame);
  deliver(frame);
}

void CoreBench::advance_1ms() {
  now_ += 1ms;
  if (each_ms) each_ms();
  for (const OutgoingFrame& echo : std::exchange(echoes_, {})) observe(FrameEchoed{echo.port, echo.frame});
  follow_contactors();
  std::vector<Due> ready;
  std::erase_if(due_, [&](const Due& due) {
    if (due.at > now_) return false;
    ready.push_back(due);
    return true;
  });
  for (const Due& due : ready) deliver(due.frame);
  send_periodic();
  if (now_ >= wake_at_) decide();
}

void CoreBench::run(Duration duration) {
  const TimePoint end = now_ + duration;
  while (now_ < end) advance_1ms();
}

bool CoreBench::run_until(const std::function<bool()>& condition, Duration at_most) {
  const TimePoint end = now_ + at_most;
  while (now_ < end) {
    if (condition()) return true;
    advance_1ms();
  }
  return condition();
}

bool CoreBench::close() {
  run(1500ms);
  inputs.vehicle_on = true;
  return run_until([this] { return core_->sequence().phase == Phase::closed; }, 3s);
}

void CoreBench::stall(Duration duration) {
  now_ += duration;
  decide();
}

bool CoreBench::has_event(EventId id) const {
  return std::any_of(events_.begin(), events_.end(), [id](const Event& event) { return event.id == id; });
}

}  // namespace bmu::test
