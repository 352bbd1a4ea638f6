// Checks the commands to chargers and to an inverter: by the frames that were decided, those that really went over
// their bus and came back from it, the contactors that were commanded with them, the emulated cells, and the limits
// that the core publishes. It does not use the core's state of the charge, nor which devices the core takes for silent.
//
//   with every decision
//     asks        a charger is commanded to charge only while the way from it to the cells is commanded closed,
//     charging
//                 is permitted, it is plugged in, and no cell has been too high for longer than the catalogue allows;
//                 not for more than the pack's limit, all units together, nor for a higher voltage than the pack
//                 file's. It is commanded to stop in the decision that ends that, and never to stop and to go on at the
//                 same time
//     allows      an inverter is never allowed more than the pack's limits, and nothing by a pack that is not closed
//     withdraws   its allowance is withdrawn in time when the limit has fallen
//     silence     the reaction to a charger or an inverter that is not received any more, by the frames really received
//   every millisecond
//     stops       no charger follows a command that has not been permitted for longer than a stop takes to reach it
//     withdraws   and no inverter
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "devices/charger.hpp"
#include "devices/inverter.hpp"
#include "tests/simulation/rules.hpp"
#include "tests/simulation/stage.hpp"

namespace bmu::test {

/// A decision and its circumstances.
struct FlowScene {
  TimePoint now{};
  const View* view = nullptr;
  const Stage* stage = nullptr;
  ContactorOutputs outputs;
  bool was_away = false;       // the core was stalled for longer than permitted
  bool is_plugged_in = false;  // by the input; for some time after it fell, too
  TimePoint plugged_since{};   // zero: not plugged in now
  bool is_key_off = false;     // by the input, for longer than its report may take
  bool is_hidden = false;      // a fault delays what the core can detect
  bool is_deceived = false;    // a frame was received that cannot be distinguished from a true one
};

class FlowOracle {
 public:
  FlowOracle(const CoreConfig& config, TimePoint started_at, Blame blame);

  /// Observation of the core.
  void note_told(const ObservedThing& what, TimePoint now);
  /// A frame of the master has been on the bus of its guest.
  void note_carried(const CanFrame& frame, bool is_taken_in, TimePoint now);
  void note_decided(const Decisions& decisions, const FlowScene& scene);
  void note_millisecond(const Stage& stage);
  void note_boot();
  /// An operator has acted on the pack: an interrupted charge does not go on by itself.
  void note_hands() { is_interrupted_ = false; }
  /// Whether a unit that was charging is silent.
  [[nodiscard]] bool is_charger_silent(TimePoint now) const;
  /// Whether a charge that was interrupted by its charger's silence may go on, as after plugging in again.
  [[nodiscard]] bool may_resume(TimePoint now) const;
  void note_resumed() { is_interrupted_ = false; }

 private:
  struct Unit {
    ChargerOrder told;          // by the last decision with a command to it
    TimePoint stopped_at{};     // the last time at which that was a stop; zero: never
    ChargerOrder heard;         // received by the unit
    TimePoint heard_at{};       // zero: never
    TimePoint word_at{};        // its last report received; zero: none counts
    TimePoint talks_since{};    // without a silence
    bool was_charging = false;  // when it was last received
  };
  struct Allowed {
    std::int32_t charge_mA = 0;
    std::int32_t discharge_mA = 0;
  };

  void require(bool holds, Rule rule, TimePoint now, const std::string& text) {
    if (!holds) blame_(rule, now, text);
  }
  void forget_words();
  // the charger
  void check_charger(const Decisions& decisions, const FlowScene& scene);
  void check_order(const ChargerCommand& command, const FlowScene& scene);
  void check_stopped(const FlowScene& scene);
  void check_fall(const FlowScene& scene);
  void check_silent_units(const FlowScene& scene);
  void follow_high_cell(const FlowScene& scene);
  [[nodiscard]] bool is_way_closed(const ContactorOutputs& outputs) const;
  [[nodiscard]] bool is_talking(const Unit& unit, TimePoint now) const;
  [[nodiscard]] Duration silence_max() const;
  [[nodiscard]] std::int64_t asked_mA() const;
  [[nodiscard]] std::span<Unit> units() { return std::span(units_).first(config_->charger.unit_count); }
  [[nodiscard]] std::span<const Unit> units() const { return std::span(units_).first(config_->charger.unit_count); }
  // the inverter
  void check_inverter(const Decisions& decisions, const FlowScene& scene);
  void check_battery_frame(const CanFrame& frame, const Allowed& most, TimePoint now);
  void check_withdrawn(const Allowed& most, TimePoint now);
  void check_silent_inverter(const FlowScene& scene);
  [[nodiscard]] Allowed allowed_now(const FlowScene& scene) const;

  const CoreConfig* config_;
  const ChargerDriver* charger_;
  const InverterDriver* inverter_;
  Blame blame_;

  std::array<Unit, charger_units_max> units_{};
  TimePoint permitted_at_{};  // the last decision that permitted a charger to charge
  TimePoint above_since_{};   // more is commanded than the limit, by a step that is sent at once; zero: no
  TimePoint high_since_{};    // a cell is above its opening limit; zero: none is
  TimePoint looked_at_{};     // last check of the cells
  bool is_interrupted_ = false;

  BatteryReport told_;   // to the inverter, by the decisions
  BatteryReport heard_;  // received by the inverter
  TimePoint heard_at_{};
  TimePoint too_much_since_{};        // zero: the allowance is within the limits
  TimePoint charge_allowed_at_{};     // the last decision that permitted any allowance
  TimePoint discharge_allowed_at_{};  //
  TimePoint alive_at_{};              // its last keep-alive received; zero: none counts
  TimePoint closed_since_{};          // commanded so; zero: not closed

  TimePoint port_down_at_{};  // the last decision that could not be sent
  TimePoint disturbed_at_{};  // the last time at which the master's frames did not come through
  TimePoint flooded_at_{};    // and at which they waited for those of another node
  TimePoint away_at_{};       // the last time at which there was no core to send anything
  bool was_resting_ = false;
};

// --------------------------------------------------------------------------------------------------------------------

namespace flow {

/// A tick and its effects.
inline constexpr Duration tick = 20ms;
/// From the decision to the arrival of a frame on a bus of its own, with the vehicle's messages before it.
inline constexpr Duration frame_arrives = 40ms;
/// For frames that waited in the master's queue while another node had the bus.
inline constexpr Duration queue_empties = 50ms;
/// An opening under a current waits for the current to fall.
inline constexpr Duration breaks_current = 300ms;
/// Row 1 of the catalogue; and the time for which another fault may hide it.
inline constexpr Duration high_cell_max = 450ms;
inline constexpr Duration hidden_for = 500ms;
inline constexpr double noise_mV = 1.0;
/// Steps that are sent at once; smaller ones wait for the next command.
inline constexpr std::int32_t step_mA = 500;
inline constexpr Duration charger_told_again = 50ms;
inline constexpr Duration resumes_after = 5s;
inline constexpr Duration inverter_grace = 5s;
/// From main positive's command until the pack counts as closed.
inline constexpr Duration settles_in = 1s;

inline std::string ms_text(Duration duration) {
  return std::to_string(to_ms(duration)) + " ms";
}
inline std::string current_text(std::int64_t current_mA) {
  return std::to_string(current_mA) + " mA";
}

inline bool are_mains_closed(const ContactorOutputs& outputs) {
  return outputs.main_positive && outputs.main_negative;
}

/// Time since which something applies; zero: it does not.
inline void keep_since(TimePoint& since, bool holds, TimePoint now) {
  if (!holds) since = {};
  if (holds && since == TimePoint{}) since = now;
}
inline bool lasts(TimePoint since, Duration at_most, TimePoint now) {
  return since != TimePoint{} && now - since > at_most;
}

}  // namespace flow

inline FlowOracle::FlowOracle(const CoreConfig& config, TimePoint started_at, Blame blame)
    : config_(&config),
      charger_(config.charger.driver),
      inverter_(config.inverter.driver),
      blame_(std::move(blame)),
      away_at_(started_at) {}

inline Duration FlowOracle::silence_max() const {
  return charger_->report_period * 5 / 2 + 100ms;
}

inline bool FlowOracle::is_talking(const Unit& unit, TimePoint now) const {
  return unit.word_at != TimePoint{} && now - unit.word_at <= silence_max();
}

/// After a gap no earlier report counts.
inline void FlowOracle::forget_words() {
  for (Unit& unit : units_) {
    unit.word_at = {};
    unit.was_charging = false;
  }
  alive_at_ = {};
}

/// Commands are cleared with the core that sent them; those that a device has received are not.
inline void FlowOracle::note_boot() {
  forget_words();
  for (Unit& unit : units_) {
    unit.told = {};
    unit.stopped_at = {};
  }
  told_ = {.discharge_voltage_limit_mV = config_->inverter.discharge_voltage_min_mV};
  is_interrupted_ = false;
  closed_since_ = too_much_since_ = above_since_ = {};
}

inline void FlowOracle::note_told(const ObservedThing& what, TimePoint now) {
  const auto* received = std::get_if<FrameReceived>(&what);
  if (received == nullptr) return;
  if (charger_ != nullptr && serves(*config_, received->port, Port::charger)) {
    std::array<ChargerReport, charger_units_max> ignored{};
    const ChargerNews news = charger_->take(received->frame, ignored);
    if (news.word != ChargerWord::values || news.unit >= config_->charger.unit_count) return;
    Unit& unit = units_[news.unit];
    if (!is_talking(unit, now)) unit.talks_since = now;
    unit.word_at = now;
  }
  if (inverter_ != nullptr && serves(*config_, received->port, Port::inverter)) {
    InverterReport ignored;
    if (inverter_->take(received->frame, ignored) == InverterWord::alive) alive_at_ = now;
  }
}

inline void FlowOracle::note_decided(const Decisions& decisions, const FlowScene& scene) {
  if (charger_ == nullptr && inverter_ == nullptr) return;
  if (scene.was_away || scene.view->is_resting != was_resting_) forget_words();
  was_resting_ = scene.view->is_resting;
  if (!scene.stage->outer.is_port_up()) port_down_at_ = scene.now;
  if (charger_ != nullptr) check_charger(decisions, scene);
  if (inverter_ != nullptr) check_inverter(decisions, scene);
}

// --- the charger, with every decision -------------------------------------------------------------------------------

inline bool FlowOracle::is_way_closed(const ContactorOutputs& outputs) const {
  return flow::are_mains_closed(outputs) && (!config_->contactors.has_charge_contactor || outputs.charge);
}

inline std::int64_t FlowOracle::asked_mA() const {
  std::int64_t sum_mA = 0;
  for (const Unit& unit : units()) sum_mA += unit.told.is_enabled ? unit.told.current_mA : 0;
  return sum_mA;
}

inline void FlowOracle::check_charger(const Decisions& decisions, const FlowScene& scene) {
  follow_high_cell(scene);
  bool is_told = false;
  if (is_way_closed(scene.outputs) && scene.view->may_charge) permitted_at_ = scene.now;
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port != Port::charger) continue;
    const std::optional<ChargerCommand> command = charger_->order_of(out.frame);
    const bool is_one = command && command->unit < config_->charger.unit_count;
    require(is_one, Rule::asks, scene.now, "what a charger is sent is no order of its");
    if (!is_one) continue;
    check_order(*command, scene);
    is_told = true;
  }
  require(!is_told || asked_mA() <= std::min(scene.view->charge_mA, config_->charger.current_max_mA), Rule::asks,
          scene.now,
          flow::current_text(asked_mA()) + " are asked for of " + flow::current_text(scene.view->charge_mA) +
              " that the pack may take");
  check_stopped(scene);
  check_fall(scene);
  check_silent_units(scene);
}

inline void FlowOracle::check_order(const ChargerCommand& command, const FlowScene& scene) {
  const ChargerOrder& order = command.order;
  Unit& unit = units_[command.unit];
  const bool is_permitted = permitted_at_ == scene.now;
  require(is_permitted || !order.requests_mains, Rule::asks, scene.now,
          "mains are asked for by a pack that may not be charged");
  if (order.is_enabled) {
    require(is_permitted, Rule::asks, scene.now,
            is_way_closed(scene.outputs) ? "a charger is told to charge without permission"
                                         : "a charger is told to charge a pack that is not commanded closed");
    require(scene.is_plugged_in || scene.is_deceived, Rule::asks, scene.now,
            "a charger is told to charge though it is unplugged");
    require(order.voltage_mV <= config_->charger.voltage_max_mV, Rule::asks, scene.now,
            "a charger is told " + std::to_string(order.voltage_mV) + " mV");
    require(unit.stopped_at != scene.now, Rule::asks, scene.now,
            "a charger that was stopped is told to go on at the same moment");
  } else {
    require(order.current_mA == 0, Rule::asks, scene.now, "a charger is told to stop, and a current");
    unit.stopped_at = scene.now;
  }
  unit.told = order;
}

/// A command that is not permitted any more is withdrawn in the same decision, if it can be sent.
inline void FlowOracle::check_stopped(const FlowScene& scene) {
  const Duration until_next = charger_->command_period + flow::tick;
  if (port_down_at_ != TimePoint{} && scene.now - port_down_at_ <= until_next) return;
  const Duration high_max = flow::high_cell_max + (scene.is_hidden ? flow::hidden_for : Duration{});
  const bool is_too_high = flow::lasts(high_since_, high_max, scene.now);
  for (const Unit& unit : units()) {
    if (!unit.told.is_enabled) continue;
    require(permitted_at_ == scene.now, Rule::asks, scene.now,
            "charging is not permitted, and a charger is not told to stop");
    require(!is_too_high, Rule::asks, scene.now,
            "a cell is above its limit for " + flow::ms_text(scene.now - high_since_) +
                ", and a charger is told to charge");
  }
}

inline void FlowOracle::check_fall(const FlowScene& scene) {
  flow::keep_since(above_since_, asked_mA() >= scene.view->charge_mA + flow::step_mA, scene.now);
  const bool is_excused =
      port_down_at_ != TimePoint{} && scene.now - port_down_at_ <= charger_->command_period + flow::tick;
  require(is_excused || !flow::lasts(above_since_, flow::charger_told_again + flow::tick, scene.now), Rule::asks,
          scene.now,
          flow::current_text(asked_mA()) + " were asked for, and the limit has been " +
              flow::current_text(scene.view->charge_mA) + " for " + flow::ms_text(scene.now - above_since_));
}

/// Row 98: a unit that was charging is not received any more.
inline void FlowOracle::check_silent_units(const FlowScene& scene) {
  const bool is_asked =
      std::any_of(units().begin(), units().end(), [](const Unit& unit) { return unit.told.is_enabled; });
  const bool is_excused =
      port_down_at_ != TimePoint{} && scene.now - port_down_at_ <= charger_->command_period + flow::tick;
  const bool is_plugged_for_long =
      scene.plugged_since != TimePoint{} && scene.now - scene.plugged_since > silence_max();
  if (scene.plugged_since == TimePoint{}) is_interrupted_ = false;
  for (Unit& unit : units()) {
    if (is_talking(unit, scene.now)) {
      unit.was_charging = is_asked;
      continue;
    }
    if (scene.plugged_since == TimePoint{}) unit.was_charging = false;
    if (!unit.was_charging) continue;
    is_interrupted_ = true;
    const Duration silent_for = scene.now - unit.word_at - silence_max();
    if (silent_for <= flow::tick || !is_plugged_for_long) continue;
    const std::string silent = "a charger is silent for " + flow::ms_text(scene.now - unit.word_at);
    require(!unit.told.is_enabled || is_excused, Rule::silence, scene.now, silent + ", and told to charge");
    const bool is_charge_open = !config_->contactors.has_charge_contactor || !scene.outputs.charge;
    require(is_charge_open || silent_for <= flow::breaks_current, Rule::silence, scene.now,
            silent + ", and the charge contactor is closed");
    const bool is_open = !scene.outputs.main_positive && !scene.outputs.main_negative;
    require(is_open || !scene.is_key_off || silent_for <= flow::breaks_current, Rule::silence, scene.now,
            silent + ", and the pack is closed for it");
  }
}

inline void FlowOracle::follow_high_cell(const FlowScene& scene) {
  constexpr Duration look_every = 20ms;
  if (scene.now - looked_at_ < look_every) return;
  looked_at_ = scene.now;
  const World& world = scene.stage->pack.simulator().world();
  const double limit_mV = config_->limits.cell_overvoltage.open * 1e-3 + flow::noise_mV;
  bool is_high = false;
  for (std::size_t cell = 0; cell < world.plant.cell_count() && !is_high; ++cell) {
    is_high = world.sensed_mV(cell) > limit_mV;
  }
  flow::keep_since(high_since_, is_high, scene.now);
}

inline bool FlowOracle::is_charger_silent(TimePoint now) const {
  if (charger_ == nullptr) return false;
  return std::any_of(units().begin(), units().end(),
                     [this, now](const Unit& unit) { return unit.was_charging && !is_talking(unit, now); });
}

inline bool FlowOracle::may_resume(TimePoint now) const {
  if (charger_ == nullptr || !is_interrupted_) return false;
  return std::all_of(units().begin(), units().end(), [this, now](const Unit& unit) {
    return is_talking(unit, now) && now - unit.talks_since >= flow::resumes_after - flow::tick;
  });
}

// --- the inverter, with every decision ------------------------------------------------------------------------------

inline FlowOracle::Allowed FlowOracle::allowed_now(const FlowScene& scene) const {
  if (!flow::are_mains_closed(scene.outputs)) return {};
  const View& view = *scene.view;
  return {.charge_mA = view.may_charge ? view.charge_mA : 0,
          .discharge_mA = view.may_discharge ? view.discharge_mA : 0};
}

inline void FlowOracle::check_inverter(const Decisions& decisions, const FlowScene& scene) {
  const Allowed most = allowed_now(scene);
  if (most.charge_mA > 0) charge_allowed_at_ = scene.now;
  if (most.discharge_mA > 0) discharge_allowed_at_ = scene.now;
  flow::keep_since(closed_since_, flow::are_mains_closed(scene.outputs), scene.now);
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port == Port::inverter) check_battery_frame(out.frame, most, scene.now);
  }
  check_withdrawn(most, scene.now);
  check_silent_inverter(scene);
}

inline void FlowOracle::check_battery_frame(const CanFrame& frame, const Allowed& most, TimePoint now) {
  const BatteryWord word = inverter_->hear(frame, told_);
  require(word != BatteryWord::none && word != BatteryWord::refused, Rule::allows, now,
          "what an inverter is sent is no word for it");
  if (word == BatteryWord::limits) {
    require(told_.charge_limit_mA <= most.charge_mA, Rule::allows, now,
            "an inverter is allowed to charge with " + flow::current_text(told_.charge_limit_mA) + " of " +
                flow::current_text(most.charge_mA));
    require(told_.discharge_limit_mA <= most.discharge_mA, Rule::allows, now,
            "an inverter is allowed to draw " + flow::current_text(told_.discharge_limit_mA) + " of " +
                flow::current_text(most.discharge_mA));
    require(told_.charge_voltage_limit_mV <= config_->inverter.charge_voltage_max_mV, Rule::allows, now,
            "an inverter is told " + std::to_string(told_.charge_voltage_limit_mV) + " mV to charge to");
  }
  if (word != BatteryWord::requests) return;
  require(most.charge_mA > 0 || (!told_.may_charge && !told_.asks_for_charge), Rule::allows, now,
          "an inverter is told that it may charge");
  require(most.discharge_mA > 0 || !told_.may_discharge, Rule::allows, now, "an inverter is told that it may draw");
}

inline void FlowOracle::check_withdrawn(const Allowed& most, TimePoint now) {
  const auto is_more = [](std::int32_t told_mA, std::int32_t limit_mA) {
    return told_mA > 0 && (limit_mA == 0 || told_mA >= limit_mA + flow::step_mA);
  };
  const bool is_flagged = (told_.may_charge && most.charge_mA == 0) || (told_.may_discharge && most.discharge_mA == 0);
  const bool is_too_much = is_flagged || is_more(told_.charge_limit_mA, most.charge_mA) ||
                           is_more(told_.discharge_limit_mA, most.discharge_mA);
  flow::keep_since(too_much_since_, is_too_much, now);
  const bool is_excused =
      port_down_at_ != TimePoint{} && now - port_down_at_ <= config_->inverter.period + inverter_->period_min;
  require(is_excused || !flow::lasts(too_much_since_, inverter_->period_min + 2 * flow::tick, now), Rule::withdraws,
          now,
          "an inverter may charge with " + flow::current_text(told_.charge_limit_mA) + " and draw " +
              flow::current_text(told_.discharge_limit_mA) +
              " by what it was told, and the limits have been less for " + flow::ms_text(now - too_much_since_));
}

inline void FlowOracle::check_silent_inverter(const FlowScene& scene) {
  const InverterConfig& config = config_->inverter;
  const bool is_heeded = config.when_silent != SilentInverter::warn && closed_since_ != TimePoint{};
  // An inverter that was silent when the pack closed has the time to start.
  const bool had_begun = alive_at_ != TimePoint{} && alive_at_ + config.silence_max >= closed_since_ + flow::settles_in;
  if (!is_heeded || !had_begun) return;
  const Duration silent_for = scene.now - alive_at_ - config.silence_max;
  const bool is_excused =
      port_down_at_ != TimePoint{} && scene.now - port_down_at_ <= config.period + inverter_->period_min;
  const std::string silent = "the inverter is silent for " + flow::ms_text(scene.now - alive_at_);
  const bool is_told_nothing = told_.charge_limit_mA == 0 && told_.discharge_limit_mA == 0;
  require(is_told_nothing || is_excused || silent_for <= inverter_->period_min + 2 * flow::tick, Rule::silence,
          scene.now, silent + ", and allowed something");
  const bool must_open =
      config.when_silent == SilentInverter::open && silent_for > flow::inverter_grace + flow::breaks_current;
  require(!must_open, Rule::silence, scene.now, silent + ", and the pack is closed");
}

// --- on the bus -----------------------------------------------------------------------------------------------------

inline void FlowOracle::note_carried(const CanFrame& frame, bool is_taken_in, TimePoint now) {
  if (charger_ != nullptr) {
    const std::optional<ChargerCommand> command = charger_->order_of(frame);
    if (!command || command->unit >= config_->charger.unit_count) return;
    const bool is_late = now - permitted_at_ > flow::frame_arrives;
    const bool has_waited = flooded_at_ != TimePoint{} && now - flooded_at_ <= flow::queue_empties;
    require(!command->order.is_enabled || !is_late || has_waited, Rule::stops, now,
            "a word on the bus tells a charger to charge, which has not been permitted for " +
                flow::ms_text(now - permitted_at_));
    if (!is_taken_in) return;
    units_[command->unit].heard = command->order;
    units_[command->unit].heard_at = now;
  }
  if (inverter_ != nullptr && is_taken_in && inverter_->hear(frame, heard_) == BatteryWord::limits) heard_at_ = now;
}

inline void FlowOracle::note_millisecond(const Stage& stage) {
  if (charger_ == nullptr && inverter_ == nullptr) return;
  const TimePoint now = stage.pack.now();
  if (stage.outer.is_disturbed()) disturbed_at_ = now;
  if (stage.outer.flood) flooded_at_ = now;
  // Without a core the last command remains valid for as long as the protocol defines.
  if (!stage.is_alive()) away_at_ = now;
  const auto is_over = [this, now](TimePoint allowed_at, Duration told_in, Duration told_again) {
    // The first frame of a core that starts may come before its port is up, so that the second is the first to get out.
    const bool is_new = now - away_at_ <= told_again + told_in;
    const bool is_excused = disturbed_at_ != TimePoint{} && now - disturbed_at_ <= told_again + told_in;
    return !is_new && !is_excused && now - allowed_at > told_in;
  };
  if (charger_ != nullptr && is_over(permitted_at_, flow::tick + flow::frame_arrives, charger_->command_period)) {
    for (const Unit& unit : units()) {
      const bool lives = unit.heard_at != TimePoint{} && now - unit.heard_at <= charger_->command_life;
      require(!lives || !unit.heard.is_enabled, Rule::stops, now,
              "a charger goes on by a word that has not been permitted for " + flow::ms_text(now - permitted_at_));
    }
  }
  if (inverter_ == nullptr || heard_at_ == TimePoint{} || now - heard_at_ > inverter_->battery_life) return;
  const Duration told_in = inverter_->period_min + 2 * flow::tick + flow::frame_arrives;
  require(heard_.charge_limit_mA == 0 || !is_over(charge_allowed_at_, told_in, config_->inverter.period),
          Rule::withdraws, now,
          "an inverter may charge by a word that has not been true for " + flow::ms_text(now - charge_allowed_at_));
  require(heard_.discharge_limit_mA == 0 || !is_over(discharge_allowed_at_, told_in, config_->inverter.period),
          Rule::withdraws, now,
          "an inverter may draw by a word that has not been true for " + flow::ms_text(now - discharge_allowed_at_));
}

}  // namespace bmu::test
