#include "tests/simulation/mutants.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <utility>

#include "daemon/core/contactors/output_gate.hpp"
#include "devices/device_list.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::test {

namespace {

/// Replaces the outputs in every contactor command of these decisions, well formed.
void command_instead(Decisions& decisions, const ContactorOutputs& outputs) {
  decisions.outputs = outputs;
  for (OutgoingFrame& out : decisions.frames) {
    if (out.port != Port::internal || out.frame.id != internal_bus::contactor_command.base_id) continue;
    out.frame = contactor_command_frame(outputs, out.frame.data[6]);
  }
}

/// An opening is carried out 300 ms late.
auto holds_on() {
  struct Memory {
    ContactorOutputs closed;
    TimePoint decided_at{};
  };
  return [memory = std::make_shared<Memory>()](Decisions& decisions, const Stage& stage) {
    if (decisions.outputs.main_positive) {
      *memory = {decisions.outputs, stage.pack.now()};
    } else if (memory->closed.main_positive && stage.pack.now() - memory->decided_at < 300ms) {
      command_instead(decisions, memory->closed);
    }
  };
}

/// A valid frame of this message, to be changed on its way to the core; nullptr if it is another.
CanFrame* sound_frame(ObservedThing& what, const MessageSpec& message) {
  auto* received = std::get_if<FrameReceived>(&what);
  const bool is_it = received != nullptr && received->frame.id == message.base_id && !form_fault(received->frame) &&
                     !content_fault(message, received->frame);
  return is_it ? &received->frame : nullptr;
}

/// The PDU reports the emergency stops as released.
void hide_emergency_stop(ObservedThing& what, TimePoint) {
  CanFrame* word = sound_frame(what, internal_bus::pdu_status);
  if (word == nullptr) return;
  write<internal_bus::pdu_status, "estop_1_released">(*word, 1);
  write<internal_bus::pdu_status, "estop_2_released">(*word, 1);
  seal(internal_bus::pdu_status, word->data[6], *word);
}

/// The sensor shows 1 A instead of more than 50 A.
void hide_current(ObservedThing& what, TimePoint) {
  constexpr std::int64_t much_mA = 50'000;
  constexpr std::int64_t little_mA = 1'000;
  CanFrame* result = sound_frame(what, internal_bus::sensor_current);
  if (result == nullptr) return;
  const SignalValue current = read<internal_bus::sensor_current, "pack_current_mA">(*result);
  if (current.value > much_mA) write<internal_bus::sensor_current, "pack_current_mA">(*result, little_mA);
}

void close_main_early(Decisions& decisions, const Stage&) {
  if (!decisions.outputs.precharge) return;
  ContactorOutputs outputs = decisions.outputs;
  outputs.main_positive = true;
  command_instead(decisions, outputs);
}

/// Main negative is closed a second after each opening, without a request.
auto closes_by_itself() {
  return [opened_at = std::make_shared<TimePoint>(), was_closed = std::make_shared<bool>(false)](Decisions& decisions,
                                                                                                 const Stage& stage) {
    const TimePoint now = stage.pack.now();
    const bool is_closed = decisions.outputs.any_contactor();
    if (std::exchange(*was_closed, is_closed) && !is_closed) *opened_at = now;
    const bool is_time = *opened_at != TimePoint{} && now - *opened_at > 1s && now - *opened_at < 1500ms;
    if (is_time && !is_closed) command_instead(decisions, {.main_negative = true});
  };
}

/// In an open pack 3 of every 200 status messages of the PDU, about 10 s, report the key as off.
auto turns_the_key() {
  return [words = std::make_shared<std::uint64_t>(0)](ObservedThing& what, TimePoint) {
    constexpr std::uint64_t seldom = 200;
    constexpr std::uint64_t some = 3;
    CanFrame* word = sound_frame(what, internal_bus::pdu_status);
    if (word == nullptr || read_raw<internal_bus::pdu_status, "main_negative_closed">(*word) != 0) return;
    if (++*words % seldom >= some) return;
    write<internal_bus::pdu_status, "vehicle_on">(*word, 0);
    seal(internal_bus::pdu_status, word->data[6], *word);
  };
}

/// For a second, from 30 s on.
void open_for_nothing(Decisions& decisions, const Stage& stage) {
  constexpr TimePoint from{30s};
  if (stage.pack.now() >= from && stage.pack.now() < from + 1s) command_instead(decisions, {});
}

void repeat_counter(Decisions& decisions, const Stage& stage) {
  if (to_ms(stage.pack.now().time_since_epoch()) / 1'000 % 20 != 19) return;
  for (OutgoingFrame& out : decisions.frames) {
    if (out.port != Port::internal || out.frame.id != internal_bus::contactor_command.base_id) continue;
    seal(internal_bus::contactor_command, static_cast<std::uint8_t>(out.frame.data[6] & 0xFEU), out.frame);
  }
}

/// Repeats the last valid voltage message to the vehicle.
auto tells_old_values() {
  return [good = std::make_shared<std::map<std::uint32_t, CanFrame>>()](Decisions& decisions, const Stage&) {
    for (OutgoingFrame& out : decisions.frames) {
      if (out.port != Port::vehicle) continue;
      const std::uint32_t index = out.frame.id & 0xFU;
      const bool is_voltage =
          index == 3 && read<vehicle_bus::pack_voltage, "cell_voltage_min_uV">(out.frame).is_valid();
      if (is_voltage) (*good)[out.frame.id] = out.frame;
      const auto found = good->find(out.frame.id);
      if (found != good->end()) out.frame = found->second;
    }
  };
}

// --- charger and inverter -------------------------------------------------------------------------------------------

/// The command to a charger in a frame, and its protocol.
struct Order {
  const ChargerDriver* driver = nullptr;
  ChargerCommand command;

  [[nodiscard]] CanFrame frame() const { return driver->command(command.unit, command.order); }
};
std::optional<Order> order_in(const OutgoingFrame& out) {
  if (out.port != Port::charger) return {};
  for (const ChargerDriver* driver : charger_drivers()) {
    if (const auto command = driver->order_of(out.frame)) return Order{driver, *command};
  }
  return {};
}

template <class Change>
void change_orders(Decisions& decisions, Change change) {
  for (OutgoingFrame& out : decisions.frames) {
    std::optional<Order> order = order_in(out);
    if (order && change(order->command.order)) out.frame = order->frame();
  }
}

/// A charger that was commanded to charge is commanded so for half a second more.
auto charges_on() {
  struct Memory {
    ChargerOrder last;
    TimePoint at{};
  };
  return [memory = std::make_shared<Memory>()](Decisions& decisions, const Stage& stage) {
    change_orders(decisions, [&](ChargerOrder& order) {
      if (order.is_enabled) *memory = {order, stage.pack.now()};
      const bool goes_on = !order.is_enabled && memory->at != TimePoint{} && stage.pack.now() - memory->at < 500ms;
      if (goes_on) order = memory->last;
      return goes_on;
    });
  };
}

/// Commands 1.5 times the charge limit.
void ask_for_too_much(Decisions& decisions, const Stage& stage) {
  const std::int32_t limit_mA = stage.pack.core().limits().charge.limit_mA;
  change_orders(decisions, [limit_mA](ChargerOrder& order) {
    if (order.is_enabled) order.current_mA = limit_mA * 3 / 2;
    return order.is_enabled;
  });
}

/// Commands that stop a charger never get to the bus.
void lose_stops(Decisions& decisions, TimePoint) {
  change_orders(decisions, [](ChargerOrder& order) {
    if (order.is_enabled) return false;
    order.is_enabled = true;
    order.current_mA = 1'000;
    return true;
  });
}

/// In the last part of a run, after all faults.
void never_charge_again(Decisions& decisions, const Stage& stage) {
  if (stage.pack.now() < TimePoint{60s}) return;
  change_orders(decisions, [](ChargerOrder& order) {
    order.is_enabled = false;
    order.current_mA = 0;
    return true;
  });
}

bool is_of_charger(const CanFrame& frame) {
  return std::any_of(charger_drivers().begin(), charger_drivers().end(), [&frame](const ChargerDriver* driver) {
    std::array<ChargerReport, charger_units_max> ignored{};
    return driver->take(frame, ignored).word != ChargerWord::none;
  });
}

bool is_of_inverter(const CanFrame& frame) {
  return std::any_of(inverter_drivers().begin(), inverter_drivers().end(), [&frame](const InverterDriver* driver) {
    InverterReport ignored;
    return driver->take(frame, ignored) == InverterWord::alive;
  });
}

/// Replaces each echo of the core on the device's bus by the device's last frame.
auto hears_itself(bool (*is_of_device)(const CanFrame&)) {
  return [is_of_device, last = std::make_shared<std::optional<FrameReceived>>()](ObservedThing& what, TimePoint) {
    const auto* received = std::get_if<FrameReceived>(&what);
    const bool is_word = received != nullptr && received->port != Port::internal && is_of_device(received->frame);
    if (is_word) *last = *received;
    const auto* echo = std::get_if<FrameEchoed>(&what);
    if (echo != nullptr && echo->port != Port::internal && last->has_value()) what = **last;
  };
}

const InverterDriver* inverter_of(const OutgoingFrame& out, BatteryReport& said) {
  if (out.port != Port::inverter) return nullptr;
  for (const InverterDriver* driver : inverter_drivers()) {
    if (driver->hear(out.frame, said) == BatteryWord::limits) return driver;
  }
  return nullptr;
}

/// Repeats the last limits to the inverter after they have fallen to zero.
auto keeps_limits() {
  return [last = std::make_shared<CanFrame>()](Decisions& decisions) {
    for (OutgoingFrame& out : decisions.frames) {
      BatteryReport said;
      if (inverter_of(out, said) == nullptr) continue;
      const bool is_something = said.charge_limit_mA > 0 && said.discharge_limit_mA > 0;
      if (is_something) *last = out.frame;
      if (!is_something && last->length != 0) out.frame = *last;
    }
  };
}

auto from_ten_seconds(void (*change)(View&)) {
  return [change, first = std::make_shared<TimePoint>()](View& view, TimePoint now) {
    if (*first == TimePoint{}) *first = now;
    if (now - *first > 10s) change(view);
  };
}

}  // namespace

std::vector<Mutant> make_mutants() {
  return {
      {.name = "opens 300 ms late", .noticed_by = Rule::permission, .decided = holds_on()},
      {.name = "opens 300 ms late and publishes permission",
       .noticed_by = Rule::in_time,
       .seed = 6,
       .decided = holds_on(),
       .published = [](View& view, TimePoint) { view.may_stay_closed = true; }},
      {.name = "does not see the emergency stop",
       .noticed_by = Rule::in_time,
       .seed = 124,
       .told = hide_emergency_stop},
      {.name = "does not see a high current", .noticed_by = Rule::in_time, .seed = 7, .told = hide_current},
      {.name = "closes main positive with the precharge", .noticed_by = Rule::precharge, .decided = close_main_early},
      {.name = "closes by itself", .noticed_by = Rule::edge, .decided = closes_by_itself()},
      {.name = "closes by itself and publishes permission",
       .noticed_by = Rule::pause,
       .seed = 13,
       .decided = closes_by_itself(),
       .published = [](View& view, TimePoint) { view.may_stay_closed = true; }},
      {.name = "turns the key itself", .noticed_by = Rule::edge, .seed = 25, .told = turns_the_key()},
      {.name = "repeats a counter", .noticed_by = Rule::counter, .decided = repeat_counter},
      {.name = "tells old values", .noticed_by = Rule::published, .decided = tells_old_values()},
      {.name = "asks for no tick",
       .noticed_by = Rule::wakes,
       .decided = [](Decisions& decisions, const Stage&) { decisions.wake_at += 20ms; }},
      {.name = "steps the state of charge", .noticed_by = Rule::soc, .published = from_ten_seconds([](View& view) {
                                                                       if (view.soc_permille) *view.soc_permille -= 150;
                                                                     })},
      {.name = "counts energy back", .noticed_by = Rule::totals, .published = from_ten_seconds([](View& view) {
                                                                   if (view.totals) view.totals->charge_out_uAs = 0;
                                                                 })},
      {.name = "forgets the wear of its contactors",
       .noticed_by = Rule::totals,
       .published = from_ten_seconds([](View& view) { view.wear = {}; })},
      {.name = "opens for nothing", .noticed_by = Rule::reason, .decided = open_for_nothing},
      {.name = "tells a charger to charge on", .noticed_by = Rule::asks, .seed = 5, .decided = charges_on()},
      {.name = "asks a charger for more than the pack may take",
       .noticed_by = Rule::asks,
       .seed = 5,
       .decided = ask_for_too_much},
      {.name = "loses what tells a charger to stop", .noticed_by = Rule::stops, .seed = 4, .sent = lose_stops},
      {.name = "takes its own word for the charger's",
       .noticed_by = Rule::silence,
       .seed = 24,
       .told = hears_itself(is_of_charger)},
      {.name = "takes its own word for the inverter's",
       .noticed_by = Rule::silence,
       .seed = 595,
       .told = hears_itself(is_of_inverter)},
      {.name = "never charges again", .noticed_by = Rule::recovery, .seed = 4, .decided = never_charge_again},
      {.name = "leaves an inverter its limits",
       .noticed_by = Rule::allows,
       .seed = 16,
       .decided = [keeps = keeps_limits()](Decisions& decisions, const Stage&) { keeps(decisions); }},
      {.name = "loses what takes an inverter's limits back",
       .noticed_by = Rule::withdraws,
       .seed = 10,
       .sent = [keeps = keeps_limits()](Decisions& decisions, TimePoint) { keeps(decisions); }},
  };
}

}  // namespace bmu::test
