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
    number<&PollConfig::period>(
        {.key = "period_ms", .min = to_ms(poll_period_min), .max = to_ms(poll_period_max), .meaning = "poll period"}),
    number<&PollConfig::temperature_every>(
        {.key = "temperature_every", .min = 1, .max = 10, .meaning = "temperatures are polled every n-th period"}),
    poll_period<&PollConfig::fast_period>("fast_period_ms", to_ms(poll_period_min), to_ms(poll_period_max),
                                          "poll period near a limit, and while the current changes quickly; left out: "
                                          "half of `period_ms`, or longer if the bus requires it"),
    poll_period<&PollConfig::parked_period>(
        "parked_period_ms", to_ms(poll_period_min), to_ms(parked_period_max),
        "poll period while the contactors are open without a close request; left out: 500"),
};

// One status of the contact may be lost.
constexpr double feedback_timeout_max =
    static_cast<double>(to_ms(feedback_reaction_max - internal_bus::pdu_status.period - tick_allowance));

constexpr std::array contactor_table{
    number<&ContactorConfig::settle>(
        {.key = "settle_ms", .min = 20, .max = 1'000, .meaning = "delay between two contactors"}),
    number<&ContactorConfig::feedback_timeout>(
        {.key = "feedback_timeout_ms",
         .min = 50,
         .max = feedback_timeout_max,
         .meaning = "maximum time until the auxiliary contact matches the command",
         .because = "required for the 300 ms reaction time to an auxiliary contact that does not follow"}),
    number<&ContactorConfig::precharge_timeout>({.key = "precharge_timeout_ms",
                                                 .min = 100,
                                                 .max = static_cast<double>(to_ms(precharge_timeout_max)),
                                                 .meaning = "maximum duration of precharge",
                                                 .because = "a resistor that takes longer does not fit the DC link"}),
    number<&ContactorConfig::precharge_done_permille>(
        {.key = "precharge_done_permille",
         .min = 900,
         .max = 1'000,
         .meaning = "DC link voltage at which precharge is done, relative to the pack voltage",
         .because =
             "below that the main contactor would close into an inrush current, above 1000 it would never close"}),
    number<&ContactorConfig::precharge_current_max_mA>(
        {.key = "precharge_current_max_mA",
         .min = 1,
         .max = 5'000,
         .meaning = "and the current has fallen to this",
         .because = "a higher current is a load or a short circuit behind the resistor"}),
    required(
        number<&ContactorConfig::precharge_min>({.key = "precharge_min_ms",
                                                 .min = static_cast<double>(to_ms(precharge_min_least)),
                                                 .max = 1'000,
                                                 .meaning = "minimum duration of precharge from a discharged DC link; "
                                                            "a shorter one indicates a shorted resistor or no load",
                                                 .because = "the interval of the DC link voltage is 60 ms, and one "
                                                            "sample must lie between the contact and this time"})),
    number<&ContactorConfig::precharge_overcurrent_mA>(
        {.key = "precharge_overcurrent_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning = "current during precharge above which a short circuit is assumed; 0: not monitored"}),
    number<&ContactorConfig::precharge_tries>({.key = "precharge_tries",
                                               .min = 1,
                                               .max = 3,
                                               .meaning = "attempts that may time out before the fault is confirmed"}),
    number<&ContactorConfig::precharge_cool_down>(
        {.key = "precharge_cool_down_ms",
         .min = 2'000,
         .max = 600'000,
         .meaning = "between two attempts; the resistor dissipates all its heat"}),
    number<&ContactorConfig::precharge_resistance_Ohm>({.key = "precharge_resistance_Ohm",
                                                        .min = 0,
                                                        .max = 1'000'000,
                                                        .meaning = "of the resistor, for its heat; 0: not monitored"}),
    number<&ContactorConfig::precharge_energy_J>({.key = "precharge_energy_J",
                                                  .min = 0,
                                                  .max = 1'000'000,
                                                  .meaning = "pulse energy rating of the resistor; 0: not monitored"}),
    number<&ContactorConfig::charge_only_discharge_mA>(
        {.key = "charge_only_discharge_mA",
         .min = 100,
         .max = small_current_mA,
         .meaning = "discharge current that opens an empty pack closed for charging only",
         .because = "the minimum is the accuracy of sensors, and more than the maximum empties a small pack"}),
    number<&ContactorConfig::zero_current_grace>(
        {.key = "zero_current_grace_ms",
         .min = 0,
         .max = 210,
         .meaning = "maximum wait for zero current before opening under load",
         .because = "with the breaking interval the pack must be open within 250 ms"}),
    number<&ContactorConfig::break_gap>(
        {.key = "break_gap_ms",
         .min = 10,
         .max = 40,
         .meaning = "delay between the contactor that breaks the current and the others"}),
    number<&ContactorConfig::break_current_max_mA>(
        {.key = "break_current_max_mA",
         .min = 0,
         .max = pack_current_max_mA,
         .meaning =
             "breaking capacity of the main contactors: above it a fault of current or cell voltage first requests "
             "zero current and opens 250 ms later at the latest (docs/safety.md); 0: every fault opens immediately"}),
    number<&ContactorConfig::link_decay>(
        {.key = "link_decay_ms",
         .min = 1'000,
         .max = static_cast<double>(to_ms(link_decay_max)),
         .meaning =
             "time for the DC link to discharge after opening; afterwards pack voltage indicates a welded contactor"}),
    boolean<&ContactorConfig::has_charge_contactor>(
        {.key = "has_charge_contactor", .meaning = "separate contactor between the DC link and the charger"}),
    boolean<&ContactorConfig::has_pdu>(
        {.key = "pdu",
         .meaning =
             "a power distribution unit on the internal bus; without it contactors and inputs are `gpio` lines"}),
};

constexpr std::array history_table{
    number<&HistoryConfig::keep_days>(
        {.key = "keep_days",
         .min = 1,
         .max = 3'650,
         .meaning = "retention of rows; older ones, and more than fit into so many days, are removed"}),
    number<&HistoryConfig::size_max_MB>(
        {.key = "size_max_MB",
         .min = 20,
         .max = 100'000,
         .meaning = "of the database, with the log beside it; then the oldest rows are removed",
         .because = "10 h of the largest pack have to fit"}),
    number<&HistoryConfig::period_s>({.key = "period_s", .min = 1, .max = 600, .meaning = "averaging period of a row"}),
};

constexpr std::array rest_table{
    number<&RestConfig::after>(
        {.key = "after_ms",
         .min = 1'000,
         .max = 86'400'000,
         .meaning =
             "time in standby with the undervoltage fault and without close request before the modules go to sleep"}),
    number<&RestConfig::look_every>({.key = "look_every_ms",
                                     .min = 5'000,
                                     .max = 86'400'000,
                                     .meaning = "interval of the periodic wake-up for measurement"}),
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
        {.key = "fan_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "maximum run time"}),
    device<&AuxiliaryConfig::heater_on_dC>(
        {.key = "heater_on_dC", .min = -400, .max = 1'200, .meaning = "coldest cell; not given: there is no heater"}),
    device<&AuxiliaryConfig::heater_off_dC>(
        {.key = "heater_off_dC", .min = -400, .max = 1'200, .meaning = "coldest cell, when it stops again"}),
    number<&AuxiliaryConfig::heater_hot_dC>({.key = "heater_hot_dC",
                                             .min = -400,
                                             .max = 1'200,
                                             .meaning = "hottest cell at which the heater switches off"}),
    number<&AuxiliaryConfig::heater_run_max>(
        {.key = "heater_run_max_ms", .min = 1'000, .max = 86'400'000, .meaning = "maximum run time"}),
    number<&AuxiliaryConfig::pause>(
        {.key = "pause_ms", .min = 1'000, .max = 86'400'000, .meaning = "delay after a run that exceeded its maximum"}),
    number<&AuxiliaryConfig::throttle_on_permille>(
        {.key = "throttle_on_permille",
         .min = 0,
         .max = 1'000,
         .meaning = "throttle at which the motor controller is enabled; 0: always enabled"}),
    number<&AuxiliaryConfig::throttle_off_permille>(
        {.key = "throttle_off_permille", .min = 0, .max = 1'000, .meaning = "and no longer below this"}),
};

constexpr std::array soc_table{
    number<&SocConfig::rest_current_mA>({.key = "rest_current_mA",
                                         .min = 1,
                                         .max = 5'000,
                                         .meaning = "below this, with the contactors open, the pack rests"}),
    number<&SocConfig::rest>(
        {.key = "rest_ms",
         .min = 100,
         .max = 86'400'000,
         .meaning = "rest time before balancing uses the open-circuit voltages, at least the relaxation time of the "
                    "cells; SOC is initialised after 1 s of rest, with its uncertainty"}),
    choice<&SocConfig::method, soc_method_names>(
        {.key = "method",
         .meaning = "published estimator: `ekf` extended Kalman filter; `mixed` coulomb counting corrected by OCV "
                    "where the curve is steep; `coulomb` coulomb counting only. The others run for comparison"}),
    number<&SocConfig::current_gain_error_permille>(
        {.key = "current_gain_error_permille",
         .min = 1,
         .max = 200,
         .meaning = "gain error of the current sensor, one standard deviation"}),
    number<&SocConfig::current_offset_error_mA>(
        {.key = "current_offset_error_mA",
         .min = 1,
         .max = 10'000,
         .meaning = "offset error of the current sensor, one standard deviation"}),
    number<&SocConfig::resistance_pause_permille>(
        {.key = "resistance_pause_permille",
         .min = 0,
         .max = 950,
         .meaning = "SOC at which charging is paused to measure the cell resistances; again after 8 s while one is "
                    "unknown, thirty times at most; 0: never"}),
    number<&SocConfig::resistance_pause>(
        {.key = "resistance_pause_ms", .min = 2'000, .max = 60'000, .meaning = "duration of the pause"}),
};

constexpr std::array balancing_table{
    boolean<&BalancingConfig::is_enabled>({.key = "enabled", .meaning = "cells are balanced at all"}),
    choice<&BalancingConfig::method, balancing_method_names>(
        {.key = "method",
         .meaning = "quantity that the plan equalises: `terminal_voltage` near the top of charge; `ocv` voltage "
                    "without the current's share; `charge` charge to full of each cell"}),
    boolean<&BalancingConfig::requires_closed>(
        {.key = "requires_closed", .meaning = "balance only with closed contactors"}),
    number<&BalancingConfig::bleed_resistance_Ohm>(
        {.key = "bleed_resistance_Ohm", .min = 1, .max = 1'000, .meaning = "of the resistor that bleeds a cell"}),
    number<&BalancingConfig::dead_band_uV, 1'000>(
        {.key = "dead_band_mV", .min = 1, .max = 100, .meaning = "dead band of `terminal_voltage` and `ocv`"}),
    number<&BalancingConfig::dead_band_permille>({.key = "dead_band_permille",
                                                  .min = 0,
                                                  .max = 100,
                                                  .meaning = "dead band of `charge`, relative to the capacity"}),
    number<&BalancingConfig::capacity_tolerance_permille>(
        {.key = "capacity_tolerance_permille",
         .min = 0,
         .max = 500,
         .meaning = "tolerance of a cell's capacity from that of its file: used by `charge` until the cell has been "
                    "measured at rest near empty and near full"}),
    from_others<&BalancingConfig::voltage_min_uV>(
        {.key = "voltage_min_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "minimum cell voltage for balancing. Left out: a tenth of the way from `warn_mV` of "
                    "`cell_undervoltage` to that of `cell_overvoltage`"}),
    from_others<&BalancingConfig::top_uV>(
        {.key = "top_mV",
         .min = ocv_min_mV,
         .max = ocv_max_mV,
         .meaning = "`terminal_voltage` plans while a cell is at or above. Left out: halfway from the open-circuit "
                    "voltage at 900 permille to that of a full cell, if `cell_overvoltage` warns above that"}),
    number<&BalancingConfig::discharge_max_mA>(
        {.key = "discharge_max_mA", .min = 10, .max = 100'000, .meaning = "maximum discharge current for balancing"}),
    number<&BalancingConfig::board_min_dC>(
        {.key = "board_min_dC", .min = -400, .max = 500, .meaning = "minimum board temperature for balancing"}),
    number<&BalancingConfig::board_max_dC>(
        {.key = "board_max_dC", .min = 0, .max = 1'200, .meaning = "maximum board temperature for balancing"}),
    boolean<&BalancingConfig::without_board_sensor>(
        {.key = "without_board_sensor",
         .meaning = "allow balancing in modules without board sensor (resistors that cannot overheat)"}),
    number<&BalancingConfig::settle>(
        {.key = "settle_ms", .min = 1'000, .max = 600'000, .meaning = "without bleeding, before cells are compared"}),
    boolean<&BalancingConfig::is_autonomous_allowed>(
        {.key = "autonomous",
         .meaning = "allow modules without master to balance autonomously; commanded only while every module has its "
                    "registered node"}),
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
