// Rows of the daemon's functions and their times: polling, contactors, sleep, auxiliaries, estimation, balancing,
// history.
#include <array>

#include "config/fields/pack_fields.hpp"
#include "config/fields/word_fields.hpp"
#include "daemon/core/balancing/balancing_plan.hpp"
#include "daemon/core/contactors/contactor_sequence.hpp"

namespace bmu {
namespace {

/// A poll period without a constant default.
template <Duration PollConfig::*Member>
constexpr Field<PollConfig> poll_period(std::string_view key, double min, double max, std::string_view meaning) {
  return {
      {.key = key, .min = min, .max = max, .meaning = meaning}, nullptr, [](PollConfig& poll, const FieldValue& value) {
        poll.*Member = std::chrono::milliseconds(static_cast<std::int64_t>(std::get<double>(value)));
      }};
}

constexpr std::array poll_table{
    number<&PollConfig::period>({.key = "period_ms",
                                 .min = to_ms(poll_period_min),
                                 .max = to_ms(poll_period_max),
                                 .meaning = "from one poll to the next"}),
    number<&PollConfig::temperature_every>(
        {.key = "temperature_every", .min = 1, .max = 10, .meaning = "temperatures once in so many periods"}),
    poll_period<&PollConfig::fast_period>("fast_period_ms", to_ms(poll_period_min), to_ms(poll_period_max),
                                          "the same near a limit, and while the current changes quickly; left out: "
                                          "half of it, or as much more as the bus needs"),
    poll_period<&PollConfig::parked_period>("parked_period_ms", to_ms(poll_period_min), to_ms(parked_period_max),
                                            "the same while the pack is open and nobody wants it; left out: 500"),
};

// One status of the contact may be lost.
constexpr double feedback_timeout_max =
    static_cast<double>(to_ms(feedback_reaction_max - internal_bus::pdu_status.period - tick_allowance));

constexpr std::array contactor_table{
    number<&ContactorConfig::settle>(
        {.key = "settle_ms", .min = 20, .max = 1'000, .meaning = "after one contactor, before the next"}),
    number<&ContactorConfig::feedback_timeout>({.key = "feedback_timeout_ms",
                                                .min = 50,
                                                .max = feedback_timeout_max,
                                                .meaning = "until the auxiliary contact must have followed",
                                                .because = "so that a contact that does not follow opens the pack "
                                                           "within 300 ms"}),
    number<&ContactorConfig::precharge_timeout>(
        {.key = "precharge_timeout_ms",
         .min = 100,
         .max = static_cast<double>(to_ms(precharge_timeout_max)),
         .meaning = "until the link must have followed",
         .because = "as a resistor that takes longer is the wrong one for its link"}),
    number<&ContactorConfig::precharge_done_permille>(
        {.key = "precharge_done_permille",
         .min = 900,
         .max = 1'000,
         .meaning = "link voltage, as a share of the pack voltage",
         .because = "as below that the main contactor would close into a surge, and above 1000 never"}),
    number<&ContactorConfig::precharge_current_max_mA>(
        {.key = "precharge_current_max_mA",
         .min = 1,
         .max = 5'000,
         .meaning = "and the current has fallen to this",
         .because = "as more than that is a load or a short behind the resistor"}),
    required(number<&ContactorConfig::precharge_min>(
        {.key = "precharge_min_ms",
         .min = static_cast<double>(to_ms(precharge_min_least)),
         .max = 1'000,
         .meaning = "a link that follows sooner, from empty, is no link: the resistor is shorted, or nothing is there",
         .because = "as the link voltage comes every 60 ms, and once at least between the contact and this"})),
    number<&ContactorConfig::precharge_overcurrent_mA>(
        {.key = "precharge_overcurrent_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "more than this during precharge is a short; 0: not watched"}),
    number<&ContactorConfig::precharge_tries>(
        {.key = "precharge_tries", .min = 1, .max = 3, .meaning = "that were too slow, before it is a fault"}),
    number<&ContactorConfig::precharge_cool_down>(
        {.key = "precharge_cool_down_ms",
         .min = 2'000,
         .max = 600'000,
         .meaning = "between two tries; the resistor gives off all its heat"}),
    number<&ContactorConfig::precharge_resistance_Ohm>({.key = "precharge_resistance_Ohm",
                                                        .min = 0,
                                                        .max = 1'000'000,
                                                        .meaning = "of the resistor, for its heat; 0: not watched"}),
    number<&ContactorConfig::precharge_energy_J>({.key = "precharge_energy_J",
                                                  .min = 0,
                                                  .max = 1'000'000,
                                                  .meaning = "what the resistor bears at once; 0: not watched"}),
    number<&ContactorConfig::charge_only_discharge_mA>(
        {.key = "charge_only_discharge_mA",
         .min = 100,
         .max = small_current_mA,
         .meaning = "more than this out of an empty pack that is closed for charging only opens it",
         .because = "as sensors are no more accurate than the one, and more than the other empties a small pack"}),
    number<&ContactorConfig::zero_current_grace>(
        {.key = "zero_current_grace_ms",
         .min = 0,
         .max = 210,
         .meaning = "how long the current may take to zero before it is broken",
         .because = "so that with the gap behind it nobody waits longer than 250 ms for an open pack"}),
    number<&ContactorConfig::break_gap>({.key = "break_gap_ms",
                                         .min = 10,
                                         .max = 40,
                                         .meaning = "from the contactor that breaks the current to the others"}),
    number<&ContactorConfig::break_current_max_mA>(
        {.key = "break_current_max_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning =
             "what the main contactors can break: while more flows, a fault of current or cell voltage asks for zero "
             "current and opens 250 ms later at the latest (docs/safety.md); 0: every fault opens at once"}),
    number<&ContactorConfig::link_decay>(
        {.key = "link_decay_ms",
         .min = 1'000,
         .max = static_cast<double>(to_ms(link_decay_max)),
         .meaning = "after opening, before a link that still follows the pack means a welded contactor"}),
    boolean<&ContactorConfig::has_charge_contactor>(
        {.key = "has_charge_contactor", .meaning = "one of its own, between the link and the charger"}),
    boolean<&ContactorConfig::has_pdu>(
        {.key = "pdu",
         .meaning =
             "a power distribution unit on the internal bus; without it contactors and inputs are `gpio` lines"}),
};

constexpr std::array history_table{
    number<&HistoryConfig::keep_days>({.key = "keep_days",
                                       .min = 1,
                                       .max = 3'650,
                                       .meaning = "older rows are removed; so are more than fit into so many days"}),
    number<&HistoryConfig::size_max_MB>({.key = "size_max_MB",
                                         .min = 20,
                                         .max = 100'000,
                                         .meaning = "of the database, with the log beside it; then the oldest rows go",
                                         .because = "10 h of the largest pack have to fit"}),
    number<&HistoryConfig::period_s>(
        {.key = "period_s", .min = 1, .max = 600, .meaning = "a row is the average over so long"}),
};

constexpr std::array rest_table{
    number<&RestConfig::after>({.key = "after_ms",
                                .min = 1'000,
                                .max = 86'400'000,
                                .meaning = "of an open pack with the fault and nobody there"}),
    number<&RestConfig::look_every>(
        {.key = "look_every_ms", .min = 5'000, .max = 86'400'000, .meaning = "the modules are woken for a look"}),
};

/// A threshold that may be missing: no such device.
template <auto Member>
constexpr Field<AuxiliaryConfig> device(FieldInfo info) {
  Field<AuxiliaryConfig> field = number<Member>(info);
  field.read = nullptr;
  return field;
}

/// A voltage that is derived from others if it is missing.
template <auto Member>
constexpr Field<BalancingConfig> from_others(FieldInfo info) {
  Field<BalancingConfig> field = number<Member, 1'000>(info);
  field.read = nullptr;
  return field;
}

constexpr std::array auxiliary_table{
    device<&AuxiliaryConfig::fan_on_dC>(
        {.key = "fan_on_dC", .min = -400, .max = 1'200, .meaning = "hottest cell; not given: there is no fan"}),
    device<&AuxiliaryConfig::fan_off_dC>(
        {.key = "fan_off_dC", .min = -400, .max = 1'200, .meaning = "hottest cell, when it stops again"}),
    number<&AuxiliaryConfig::fan_run_max>(
        {.key = "fan_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "its longest run"}),
    device<&AuxiliaryConfig::heater_on_dC>(
        {.key = "heater_on_dC", .min = -400, .max = 1'200, .meaning = "coldest cell; not given: there is no heater"}),
    device<&AuxiliaryConfig::heater_off_dC>(
        {.key = "heater_off_dC", .min = -400, .max = 1'200, .meaning = "coldest cell, when it stops again"}),
    number<&AuxiliaryConfig::heater_hot_dC>(
        {.key = "heater_hot_dC", .min = -400, .max = 1'200, .meaning = "hottest cell, from which nothing is heated"}),
    number<&AuxiliaryConfig::heater_run_max>(
        {.key = "heater_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "its longest run"}),
    number<&AuxiliaryConfig::pause>(
        {.key = "pause_ms", .min = 1'000, .max = 86'400'000, .meaning = "after a run that took too long"}),
    number<&AuxiliaryConfig::throttle_on_permille>({.key = "throttle_on_permille",
                                                    .min = 0,
                                                    .max = 1'000,
                                                    .meaning = "the motor controller works from here on; 0: always"}),
    number<&AuxiliaryConfig::throttle_off_permille>(
        {.key = "throttle_off_permille", .min = 0, .max = 1'000, .meaning = "and no longer below this"}),
};

constexpr std::array soc_table{
    number<&SocConfig::rest_current_mA>({.key = "rest_current_mA",
                                         .min = 1,
                                         .max = 5'000,
                                         .meaning = "below this, with the contactors open, the pack rests"}),
    number<&SocConfig::rest>({.key = "rest_ms",
                              .min = 100,
                              .max = 86'400'000,
                              .meaning = "for how long before balancing learns from its voltages, and at least as long "
                                         "as its cells take to settle; the state of charge begins after a second of "
                                         "rest, and says how sure it is"}),
    choice<&SocConfig::method, soc_method_names>(
        {.key = "method",
         .meaning = "whose state of charge is told: `ekf` a Kalman filter, `mixed` counting and, where the curve is "
                    "steep, the voltage, `coulomb` counting alone. The others run beside it, to be compared"}),
    number<&SocConfig::current_gain_error_permille>(
        {.key = "current_gain_error_permille",
         .min = 1,
         .max = 200,
         .meaning =
             "how well the current sensor counts, one standard deviation: what it may tell too much or too little"}),
    number<&SocConfig::current_offset_error_mA>(
        {.key = "current_offset_error_mA",
         .min = 1,
         .max = 10'000,
         .meaning = "and what it may tell without a current, one standard deviation"}),
    number<&SocConfig::resistance_pause_permille>(
        {.key = "resistance_pause_permille",
         .min = 0,
         .max = 950,
         .meaning =
             "a charger is paused at this state of charge: the steps show the cells' resistances; again after 8 s "
             "while one is not known, thirty times at most; 0: never"}),
    number<&SocConfig::resistance_pause>(
        {.key = "resistance_pause_ms", .min = 2'000, .max = 60'000, .meaning = "for how long"}),
};

constexpr std::array balancing_table{
    boolean<&BalancingConfig::is_enabled>({.key = "enabled", .meaning = "cells are balanced at all"}),
    choice<&BalancingConfig::method, balancing_method_names>(
        {.key = "method",
         .meaning = "what a plan goes by: `terminal_voltage` near the top of a charge, `ocv` the voltage without the "
                    "current's share, `charge` what is missing in each cell until it is full"}),
    boolean<&BalancingConfig::requires_closed>(
        {.key = "requires_closed", .meaning = "nothing is bled while the contactors are open"}),
    number<&BalancingConfig::bleed_resistance_Ohm>(
        {.key = "bleed_resistance_Ohm", .min = 1, .max = 1'000, .meaning = "of the resistor that bleeds a cell"}),
    number<&BalancingConfig::dead_band_uV, 1'000>(
        {.key = "dead_band_mV", .min = 1, .max = 100, .meaning = "`terminal_voltage` and `ocv` leave so much"}),
    number<&BalancingConfig::dead_band_permille>(
        {.key = "dead_band_permille", .min = 0, .max = 100, .meaning = "of the capacity: `charge` leaves so much"}),
    number<&BalancingConfig::capacity_tolerance_permille>(
        {.key = "capacity_tolerance_permille",
         .min = 0,
         .max = 500,
         .meaning =
             "by how much a cell's capacity may differ from its file's: `charge` counts with it until it has seen "
             "the cell at rest near empty and near full"}),
    from_others<&BalancingConfig::voltage_min_uV>(
        {.key = "voltage_min_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "nothing is bled while a cell is below. Left out: a tenth of the way from `warn_mV` of "
                    "`cell_undervoltage` to that of `cell_overvoltage`"}),
    from_others<&BalancingConfig::top_uV>(
        {.key = "top_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "`terminal_voltage` plans while a cell is at or above. Left out: halfway from the open-circuit "
                    "voltage at 900 permille to that of a full cell, if `cell_overvoltage` warns above that"}),
    number<&BalancingConfig::discharge_max_mA>({.key = "discharge_max_mA",
                                                .min = 10,
                                                .max = 100'000,
                                                .meaning = "nothing is bled while more current leaves the pack"}),
    number<&BalancingConfig::board_min_dC>(
        {.key = "board_min_dC", .min = -400, .max = 500, .meaning = "nothing is bled while a board is colder"}),
    number<&BalancingConfig::board_max_dC>(
        {.key = "board_max_dC", .min = 0, .max = 1'200, .meaning = "nothing is bled while a board is hotter"}),
    boolean<&BalancingConfig::without_board_sensor>(
        {.key = "without_board_sensor",
         .meaning = "cells are bled also where a module has no sensor on its board: its resistors cannot overheat"}),
    number<&BalancingConfig::settle>(
        {.key = "settle_ms", .min = 1'000, .max = 600'000, .meaning = "without bleeding, before cells are compared"}),
    boolean<&BalancingConfig::is_autonomous_allowed>(
        {.key = "autonomous",
         .meaning =
             "modules that are left alone on their own supply may balance by themselves; told to each while every "
             "module is the one that belongs on its node"}),
};

}  // namespace

std::span<const Field<PollConfig>> poll_fields() {
  return poll_table;
}
std::span<const Field<ContactorConfig>> contactor_fields() {
  return contactor_table;
}
std::span<const Field<RestConfig>> rest_fields() {
  return rest_table;
}
std::span<const Field<AuxiliaryConfig>> auxiliary_fields() {
  return auxiliary_table;
}
std::span<const Field<SocConfig>> soc_fields() {
  return soc_table;
}
std::span<const Field<BalancingConfig>> balancing_fields() {
  return balancing_table;
}
std::span<const Field<HistoryConfig>> history_fields() {
  return history_table;
}

}  // namespace bmu
