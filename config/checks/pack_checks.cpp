#include "config/checks/pack_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "config/checks/bus_checks.hpp"
#include "config/checks/charger_checks.hpp"
#include "config/checks/device_rates.hpp"
#include "config/checks/foreign_module_checks.hpp"
#include "config/checks/identifier_checks.hpp"
#include "config/checks/inverter_checks.hpp"
#include "config/checks/limit_bounds.hpp"
#include "config/checks/pack_defaults.hpp"
#include "config/checks/sensor_checks.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/fields/part_reader.hpp"
#include "config/fields/reaction_reader.hpp"
#include "daemon/core/charging/charge_pause.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/vehicle/cell_reporter.hpp"

namespace bmu {
namespace {

/// Minimum margin of an age. A signal may be lost once: an age covers two intervals and the time of an answer, but at
/// least this margin.
constexpr Duration answer_margin_min = 50ms;

struct Check {
  const PackConfig& pack;
  const Place& root;
  const Place& cell;
  ProblemList& problems;

  [[nodiscard]] const CoreConfig& core() const { return pack.core; }
  [[nodiscard]] Place limit(const LimitRow& row, std::string_view key) const {
    return root.at("limits").at(row.key).at(key);
  }
  [[nodiscard]] Place limit_quantity(const LimitRow& row, std::string_view quantity) const {
    return limit(row, row.key_of(quantity));
  }
  [[nodiscard]] bool are_good(std::initializer_list<Place> places) const {
    return std::all_of(places.begin(), places.end(), [this](const Place& place) { return problems.is_good(place); });
  }
};

const LimitRow& limit_row(std::string_view key) {
  const auto rows = limit_rows();
  const auto found = std::find_if(rows.begin(), rows.end(), [key](const LimitRow& row) { return row.key == key; });
  BMU_ASSERT(found != rows.end());
  return *found;
}

std::string digits_of(std::int64_t value) {
  return std::to_string(value);
}
std::string ms_text(Duration value) {
  return std::to_string(to_ms(value)) + " ms";
}

/// Whether the pack file leaves it to its default, which is valid by itself or derived from others.
bool is_default(const Check& check, const LimitRow& row) {
  return !row.is_required && check.core().limits.*row.member == LimitsConfig{}.*row.member;
}

// --- each limit by itself -------------------------------------------------------------------------------------------

/// Checks that the middle tier is at the warning or beyond it, and before the fault.
void check_middle_tier(const Check& check, const LimitRow& row, const LimitConfig& limit) {
  const Place place = check.limit_quantity(row, "limit");
  if (!limit.limit.has_value() || !check.are_good({place})) return;
  const std::int32_t from = *limit.limit;
  const bool is_between =
      row.is_upper ? from >= limit.warn && from < limit.open : from <= limit.warn && from > limit.open;
  if (is_between) return;
  check.problems.add(place, digits_of(from / row.scale),
                     "from " + row.key_of("warn") + ", " + digits_of(limit.warn / row.scale) + ", to before " +
                         row.key_of("open") + ", " + digits_of(limit.open / row.scale));
}

void check_limit_order(const Check& check, const LimitRow& row) {
  const Place warn_place = check.limit_quantity(row, "warn");
  const Place open_place = check.limit_quantity(row, "open");
  if (!check.are_good({warn_place, open_place})) return;
  const LimitConfig& limit = check.core().limits.*row.member;
  const bool is_in_order = row.is_upper ? limit.warn < limit.open : limit.warn > limit.open;
  if (is_in_order) return check_middle_tier(check, row, limit);
  check.problems.add(warn_place, digits_of(limit.warn / row.scale),
                     std::string(row.is_upper ? "less" : "more") + " than " + row.key_of("open") + ", " +
                         digits_of(limit.open / row.scale) + ", so that the warning comes first");
}

/// Checks that the hysteresis of a fault ends before its warning threshold: otherwise warning and fault would clear in
/// the wrong order.
void check_hysteresis(const Check& check, const LimitRow& row) {
  const Place place = check.limit_quantity(row, "hysteresis");
  if (!check.are_good({place, check.limit_quantity(row, "warn"), check.limit_quantity(row, "open")})) return;
  const LimitConfig& limit = check.core().limits.*row.member;
  const std::int32_t distance = row.is_upper ? limit.open - limit.warn : limit.warn - limit.open;
  if (limit.hysteresis < distance) return;
  check.problems.add(place, digits_of(limit.hysteresis / row.scale),
                     "less than the distance from " + row.key_of("warn") + " to " + row.key_of("open") + ", " +
                         digits_of(distance / row.scale));
}

struct Interval {
  Duration value;
  Duration sampled_every;
  bool is_good;
};

/// Interval of the limit's signal, and whether it is known.
Interval interval_of(const Check& check, const LimitRow& row) {
  const auto rows = age_rows();
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const AgeRow& age) { return age.key == row.age_key; });
  BMU_ASSERT(found != rows.end());
  const Place poll = check.root.at("poll");
  return {found->interval(check.core()), found->sampled_every,
          check.are_good({poll.at("period_ms"), poll.at("temperature_every")})};
}

/// Time that the limit's fault allows for the current to fall before it opens this pack.
Duration grace_of(const LimitRow& row, const StricterReactions& stricter) {
  const auto& faults = fault_table();
  const auto found = std::find_if(faults.begin(), faults.end(), [&row](const FaultRow& fault) {
    return fault.limit != nullptr && fault.limit == row.member;
  });
  BMU_ASSERT(found != faults.end());
  return reaction_of(*found, stricter).grace;
}

/// Checks the worst cases: the value crosses the limit just as its signal is lost, and is confirmed when the signal is
/// back; or just after it was sampled, and is reported with the next sample.
void check_reaction(const Check& check, const LimitRow& row) {
  const Place confirm_place = check.limit(row, "confirm_ms");
  const Place age_place = check.root.at("ages").at(row.age_key);
  const Interval interval = interval_of(check, row);
  if (!interval.is_good || !check.are_good({confirm_place, age_place})) return;
  const Duration age = check.core().ages.*row.age;
  const Duration confirm = (check.core().limits.*row.member).confirm;
  const Duration grace = grace_of(row, check.core().stricter_reactions);
  const Duration confirmed_max = row.reaction_max - grace;
  const std::string budget = ", so that " + std::string(row.key) + " opens the pack within " +
                             ms_text(row.reaction_max) +
                             (grace > 0ns ? ", its grace of " + ms_text(grace) + " included" : "");
  if (age + interval.value > confirmed_max) {
    check.problems.add(age_place, digits_of(to_ms(age)),
                       "at most " + digits_of(to_ms(confirmed_max - interval.value)) + " where a sample comes every " +
                           ms_text(interval.value) + budget);
    return;
  }
  const Duration unseen = interval.sampled_every + interval.value;
  const Duration confirm_max = confirmed_max - std::max(age, unseen) - tick_allowance;
  if (confirm <= confirm_max) return;
  const std::string reason = unseen > age ? "where modules sample every " + ms_text(interval.sampled_every) +
                                                " and are polled every " + ms_text(interval.value)
                                          : "with " + std::string(row.age_key) + " " + digits_of(to_ms(age));
  check.problems.add(confirm_place, digits_of(to_ms(confirm)),
                     "at most " + digits_of(std::max<std::int64_t>(to_ms(confirm_max), 0)) + " " + reason + budget);
}

// --- limits against each other and against the cell -----------------------------------------------------------------

struct WindowRow {
  std::string_view lower;
  std::string_view upper;
};
constexpr std::array window_rows{WindowRow{"cell_undervoltage", "cell_overvoltage"},
                                 WindowRow{"cell_undertemperature", "cell_overtemperature"},
                                 WindowRow{"charge_undertemperature", "charge_overtemperature"},
                                 WindowRow{"board_undertemperature", "board_overtemperature"}};

/// Checks that ok values remain between the two warnings after both hystereses. Reported for the lower limit, or for
/// the upper one if the file leaves the lower to its default.
void check_window(const Check& check, const WindowRow& window) {
  const LimitRow& lower_row = limit_row(window.lower);
  const LimitRow& upper_row = limit_row(window.upper);
  const bool is_lower_left_out = is_default(check, lower_row);
  const Place lower_place = check.limit_quantity(lower_row, "warn");
  const Place upper_place = check.limit_quantity(upper_row, "warn");
  if ((is_lower_left_out && is_default(check, upper_row)) ||
      !check.are_good({lower_place, upper_place, check.limit_quantity(lower_row, "hysteresis"),
                       check.limit_quantity(upper_row, "hysteresis")})) {
    return;
  }
  CoreConfig completed = check.core();
  complete_defaults(completed);
  const LimitConfig& lower = completed.limits.*lower_row.member;
  const LimitConfig& upper = completed.limits.*upper_row.member;
  const std::int32_t distance_min = upper.hysteresis + lower.hysteresis;
  if (lower.warn < upper.warn - distance_min) return;
  if (is_lower_left_out) {
    check.problems.add(upper_place, digits_of(upper.warn / upper_row.scale),
                       "more than " + digits_of((lower.warn + distance_min) / upper_row.scale) + ", which is " +
                           lower_row.key_of("warn") + " of " + std::string(window.lower) + " and both hystereses");
    return;
  }
  check.problems.add(lower_place, digits_of(lower.warn / lower_row.scale),
                     "less than " + digits_of((upper.warn - distance_min) / lower_row.scale) + ", which is " +
                         upper_row.key_of("warn") + " of " + std::string(window.upper) + " less both hystereses");
}

struct AbsoluteRow {
  std::string_view limit;
  std::string_view cell_key;
  std::int32_t CellModel::*absolute;
};
constexpr std::array absolute_rows{
    AbsoluteRow{"cell_undervoltage", "voltage_min_mV", &CellModel::voltage_min_uV},
    AbsoluteRow{"cell_deep_discharge", "voltage_min_mV", &CellModel::voltage_min_uV},
    AbsoluteRow{"cell_overvoltage", "voltage_max_mV", &CellModel::voltage_max_uV},
    AbsoluteRow{"cell_overtemperature", "temperature_max_dC", &CellModel::temperature_max_dC},
    AbsoluteRow{"cell_undertemperature", "temperature_min_dC", &CellModel::temperature_min_dC},
};

void check_absolute(const Check& check, const AbsoluteRow& absolute_row) {
  const LimitRow& row = limit_row(absolute_row.limit);
  const Place place = check.limit_quantity(row, "open");
  if (is_default(check, row) || !check.are_good({place, check.cell.at(absolute_row.cell_key)})) return;
  const std::int32_t open = (check.core().limits.*row.member).open;
  const std::int32_t absolute = check.core().cell.*absolute_row.absolute;
  const bool is_within = row.is_upper ? open <= absolute : open >= absolute;
  if (is_within) return;
  check.problems.add(place, digits_of(open / row.scale),
                     std::string(row.is_upper ? "at most " : "at least ") + digits_of(absolute / row.scale) +
                         ", the cell's absolute " + std::string(absolute_row.cell_key));
}

struct ContinuousRow {
  std::string_view limit;
  std::string_view key;
  std::int32_t CurrentLimitConfig::*continuous_mA;
};
constexpr std::array continuous_rows{
    ContinuousRow{"discharge_overcurrent", "discharge_continuous_mA", &CurrentLimitConfig::discharge_continuous_mA},
    ContinuousRow{"charge_overcurrent", "charge_continuous_mA", &CurrentLimitConfig::charge_continuous_mA},
};

void check_continuous(const Check& check, const ContinuousRow& continuous_row) {
  const LimitRow& row = limit_row(continuous_row.limit);
  const Place place = check.limit_quantity(row, "open");
  if (!check.are_good({place, check.root.at("current").at(continuous_row.key)})) return;
  const std::int32_t open_mA = (check.core().limits.*row.member).open;
  const std::int32_t continuous_mA = check.core().current.*continuous_row.continuous_mA;
  if (open_mA > continuous_mA) return;
  check.problems.add(place, digits_of(open_mA),
                     "more than " + digits_of(continuous_mA) + ", the " + std::string(continuous_row.key) +
                         " the pack may always carry");
}

// --- two numbers that must stand in an order ------------------------------------------------------------------------

/// `value` must be greater than (or equal to) `other`, where the row applies.
struct OrderRow {
  std::string_view path;  // of the key, below the root
  std::string_view than;
  bool may_be_equal = false;
  std::int64_t (*value)(const CoreConfig&);
  std::int64_t (*other)(const CoreConfig&);
  bool (*applies)(const CoreConfig&) = nullptr;  // null: always
};

template <auto Section, auto Member>
std::int64_t number_in(const CoreConfig& core) {
  return static_cast<std::int64_t>(core.*Section.*Member);
}
template <auto Section, auto Member>
std::int64_t ms_in(const CoreConfig& core) {
  return to_ms(core.*Section.*Member);
}
template <auto Limit, auto Member, int Scale = 1>
std::int64_t limit_in(const CoreConfig& core) {
  return core.limits.*Limit.*Member / Scale;
}
template <auto Section, auto Member>
bool is_set(const CoreConfig& core) {
  return core.*Section.*Member != 0;
}
template <auto Limit>
bool is_given(const CoreConfig& core) {
  const std::int32_t open = (core.limits.*Limit).open;
  return open != never_above.open && open != never_below.open;
}
template <auto Member>
bool is_given_for_auxiliary(const CoreConfig& core) {
  return core.auxiliary.*Member != AuxiliaryConfig{}.*Member;
}
constexpr auto has_fan_on = is_given_for_auxiliary<&AuxiliaryConfig::fan_on_dC>;
constexpr auto has_fan_off = is_given_for_auxiliary<&AuxiliaryConfig::fan_off_dC>;
constexpr auto has_heater_on = is_given_for_auxiliary<&AuxiliaryConfig::heater_on_dC>;
constexpr auto has_heater_off = is_given_for_auxiliary<&AuxiliaryConfig::heater_off_dC>;
bool has_fan(const CoreConfig& core) {
  return has_fan_on(core) && has_fan_off(core);
}
bool has_heater(const CoreConfig& core) {
  return has_heater_on(core) && has_heater_off(core);
}
std::int64_t nothing_in(const CoreConfig&) {
  return 0;
}
bool has_fan_and_heater(const CoreConfig& core) {
  return has_fan(core) && has_heater(core);
}

template <auto Member>
std::int64_t number_of_uV(const CoreConfig& core) {
  return core.balancing.*Member / 1'000;
}
bool is_balancing(const CoreConfig& core) {
  return core.balancing.is_enabled;
}
bool has_balancing_min(const CoreConfig& core) {
  return is_balancing(core) && core.balancing.voltage_min_uV != 0;
}
bool has_balancing_top(const CoreConfig& core) {
  const BalancingConfig& balancing = core.balancing;
  return is_balancing(core) && balancing.method == BalancingMethod::terminal_voltage && balancing.top_uV != 0;
}

using Core = CoreConfig;
using Limits = LimitsConfig;
constexpr OrderRow order_rows[] = {
    {"current/discharge_peak_mA", "discharge_continuous_mA", true,
     number_in<&Core::current, &CurrentLimitConfig::discharge_peak_mA>,
     number_in<&Core::current, &CurrentLimitConfig::discharge_continuous_mA>,
     is_set<&Core::current, &CurrentLimitConfig::discharge_peak_mA>},
    {"current/charge_peak_mA", "charge_continuous_mA", true,
     number_in<&Core::current, &CurrentLimitConfig::charge_peak_mA>,
     number_in<&Core::current, &CurrentLimitConfig::charge_continuous_mA>,
     is_set<&Core::current, &CurrentLimitConfig::charge_peak_mA>},
    // The contactors must be able to break the continuous current.
    {"contactors/break_current_max_mA", "discharge_continuous_mA", true,
     number_in<&Core::contactors, &ContactorConfig::break_current_max_mA>,
     number_in<&Core::current, &CurrentLimitConfig::discharge_continuous_mA>,
     is_set<&Core::contactors, &ContactorConfig::break_current_max_mA>},
    {"contactors/break_current_max_mA", "charge_continuous_mA", true,
     number_in<&Core::contactors, &ContactorConfig::break_current_max_mA>,
     number_in<&Core::current, &CurrentLimitConfig::charge_continuous_mA>,
     is_set<&Core::contactors, &ContactorConfig::break_current_max_mA>},
    {"limits/discharge_overcurrent/open_mA", "discharge_peak_mA", false,
     limit_in<&Limits::discharge_overcurrent, &LimitConfig::open>,
     number_in<&Core::current, &CurrentLimitConfig::discharge_peak_mA>},
    {"limits/charge_overcurrent/open_mA", "charge_peak_mA", false,
     limit_in<&Limits::charge_overcurrent, &LimitConfig::open>,
     number_in<&Core::current, &CurrentLimitConfig::charge_peak_mA>},
    {"limits/cell_undervoltage/open_mV", "open_mV of cell_deep_discharge", false,
     limit_in<&Limits::cell_undervoltage, &LimitConfig::open, 1'000>,
     limit_in<&Limits::cell_deep_discharge, &LimitConfig::open, 1'000>, is_given<&Limits::cell_deep_discharge>},
    {"limits/cell_overtemperature/open_dC", "open_dC of charge_overtemperature", true,
     limit_in<&Limits::cell_overtemperature, &LimitConfig::open>,
     limit_in<&Limits::charge_overtemperature, &LimitConfig::open>, is_given<&Limits::charge_overtemperature>},
    {"limits/charge_undertemperature/open_dC", "open_dC of cell_undertemperature", true,
     limit_in<&Limits::charge_undertemperature, &LimitConfig::open>,
     limit_in<&Limits::cell_undertemperature, &LimitConfig::open>, is_given<&Limits::charge_undertemperature>},
    // From there on the allowed current has no peak left: a load that stays below it must not open the pack.
    {"limits/discharge_overload/open_permille", "900", false, limit_in<&Limits::discharge_overload, &LimitConfig::open>,
     [](const Core&) { return std::int64_t{900}; }},
    {"limits/charge_overload/open_permille", "900", false, limit_in<&Limits::charge_overload, &LimitConfig::open>,
     [](const Core&) { return std::int64_t{900}; }},
    {"contactors/precharge_overcurrent_mA", "precharge_current_max_mA", false,
     number_in<&Core::contactors, &ContactorConfig::precharge_overcurrent_mA>,
     number_in<&Core::contactors, &ContactorConfig::precharge_current_max_mA>,
     is_set<&Core::contactors, &ContactorConfig::precharge_overcurrent_mA>},
    {"contactors/precharge_resistance_Ohm", "0, so that precharge_energy_J can be watched", false,
     number_in<&Core::contactors, &ContactorConfig::precharge_resistance_Ohm>, nothing_in,
     is_set<&Core::contactors, &ContactorConfig::precharge_energy_J>},
    {"insulation/warn_Ohm_per_V", "open_Ohm_per_V", false,
     number_in<&Core::insulation, &InsulationConfig::warn_Ohm_per_V>,
     number_in<&Core::insulation, &InsulationConfig::open_Ohm_per_V>},
    {"auxiliary/fan_on_dC", "fan_off_dC", false, number_in<&Core::auxiliary, &AuxiliaryConfig::fan_on_dC>,
     number_in<&Core::auxiliary, &AuxiliaryConfig::fan_off_dC>, has_fan},
    {"auxiliary/heater_off_dC", "heater_on_dC", false, number_in<&Core::auxiliary, &AuxiliaryConfig::heater_off_dC>,
     number_in<&Core::auxiliary, &AuxiliaryConfig::heater_on_dC>, has_heater},
    {"auxiliary/heater_hot_dC", "heater_off_dC", false, number_in<&Core::auxiliary, &AuxiliaryConfig::heater_hot_dC>,
     number_in<&Core::auxiliary, &AuxiliaryConfig::heater_off_dC>, has_heater},
    {"auxiliary/fan_off_dC", "heater_off_dC", false, number_in<&Core::auxiliary, &AuxiliaryConfig::fan_off_dC>,
     number_in<&Core::auxiliary, &AuxiliaryConfig::heater_off_dC>, has_fan_and_heater},
    {"balancing/voltage_min_mV", "warn_mV of cell_undervoltage", false, number_of_uV<&BalancingConfig::voltage_min_uV>,
     limit_in<&Limits::cell_undervoltage, &LimitConfig::warn, 1'000>, has_balancing_min},
    {"limits/cell_overvoltage/warn_mV", "voltage_min_mV of balancing", false,
     limit_in<&Limits::cell_overvoltage, &LimitConfig::warn, 1'000>, number_of_uV<&BalancingConfig::voltage_min_uV>,
     has_balancing_min},
    {"balancing/top_mV", "voltage_min_mV", false, number_of_uV<&BalancingConfig::top_uV>,
     number_of_uV<&BalancingConfig::voltage_min_uV>, has_balancing_top},
    {"limits/cell_overvoltage/warn_mV", "top_mV of balancing", true,
     limit_in<&Limits::cell_overvoltage, &LimitConfig::warn, 1'000>, number_of_uV<&BalancingConfig::top_uV>,
     has_balancing_top},
    {"balancing/board_max_dC", "board_min_dC and the 10 C in which both count as bad", false,
     number_in<&Core::balancing, &BalancingConfig::board_max_dC>,
     [](const Core& core) { return std::int64_t{core.balancing.board_min_dC} + 100; }, is_balancing},
    {"auxiliary/throttle_on_permille", "throttle_off_permille", true,
     number_in<&Core::auxiliary, &AuxiliaryConfig::throttle_on_permille>,
     number_in<&Core::auxiliary, &AuxiliaryConfig::throttle_off_permille>},
    {"auxiliary/throttle_off_permille", "0, or what throttle_on_permille has switched on stays on", false,
     number_in<&Core::auxiliary, &AuxiliaryConfig::throttle_off_permille>, nothing_in,
     is_set<&Core::auxiliary, &AuxiliaryConfig::throttle_on_permille>},
};

void check_order(const Check& check, const OrderRow& row) {
  const Place place{check.root.file, check.root.path + "/" + std::string(row.path)};
  if (!check.problems.is_good(place) || (row.applies != nullptr && !row.applies(check.core()))) return;
  const std::int64_t value = row.value(check.core());
  const std::int64_t other = row.other(check.core());
  if (value > other || (row.may_be_equal && value == other)) return;
  check.problems.add(place, digits_of(value),
                     (row.may_be_equal ? "at least " : "more than ") + std::string(row.than) +
                         (row.than.front() <= '9' ? "" : ", " + digits_of(other)));
}

// --- pairs of keys that are meaningless alone ------------------------------------------------------------------------

struct PairRow {
  std::string_view one;  // in `auxiliary`
  std::string_view other;
  bool (*has_one)(const CoreConfig&);
  bool (*has_other)(const CoreConfig&);
};
constexpr PairRow pair_rows[] = {
    {"fan_on_dC", "fan_off_dC", has_fan_on, has_fan_off},
    {"fan_off_dC", "fan_on_dC", has_fan_off, has_fan_on},
    {"heater_on_dC", "heater_off_dC", has_heater_on, has_heater_off},
    {"heater_off_dC", "heater_on_dC", has_heater_off, has_heater_on},
};

void check_pair(const Check& check, const PairRow& row) {
  const Place section = check.root.at("auxiliary");
  if (!check.are_good({section.at(row.one), section.at(row.other)})) return;
  if (!row.has_one(check.core()) || row.has_other(check.core())) return;
  check.problems.add(section.at(row.other), "nothing", "this key, as " + std::string(row.one) + " is given");
}

// --- times ----------------------------------------------------------------------------------------------------------

void check_age(const Check& check, const AgeRow& row) {
  const Place place = check.root.at("ages").at(row.key);
  const Place poll = check.root.at("poll");
  if (!check.are_good({place, poll.at("period_ms"), poll.at("temperature_every")})) return;
  const Duration age = check.core().ages.*row.member;
  const bool waits = row.takes_a_cycle && check.problems.is_good_throughout(check.root.at("modules")) &&
                     check.are_good({check.root.at("buses").at("internal_kbit_per_s")});
  const Duration margin = waits ? answer_margin(check.pack, answer_margin_min) : answer_margin_min;
  const Duration age_min = 2 * row.interval(check.core()) + margin;
  if (age >= age_min) return;
  check.problems.add(place, digits_of(to_ms(age)),
                     "at least " + digits_of(to_ms(age_min)) + ": twice " + std::string(row.source) + " and " +
                         ms_text(margin) + (margin > answer_margin_min ? ", which all answers may take" : ""));
}

/// Checks that the fast period is not longer and the parked one not shorter. Ages and reaction times use `period_ms`.
void check_paces(const Check& check) {
  const Place section = check.root.at("poll");
  const PollConfig& poll = check.core().poll;
  if (!check.are_good({section.at("period_ms")})) return;
  const std::string period = "period_ms, " + digits_of(to_ms(poll.period));
  const bool has_fast = poll.fast_period > 0ns && check.problems.is_good(section.at("fast_period_ms"));
  if (has_fast && poll.fast_period > poll.period) {
    check.problems.add(section.at("fast_period_ms"), digits_of(to_ms(poll.fast_period)), "at most " + period);
  }
  const bool has_parked = poll.parked_period > 0ns && check.problems.is_good(section.at("parked_period_ms"));
  if (has_parked && poll.parked_period < poll.period) {
    check.problems.add(section.at("parked_period_ms"), digits_of(to_ms(poll.parked_period)), "at least " + period);
  }
}

/// Checks that the timeout suffices for a contact as slow as permitted, and for a DC link as fast as permitted.
void check_precharge_time(const Check& check) {
  const Place section = check.root.at("contactors");
  const Place place = section.at("precharge_timeout_ms");
  if (!check.are_good({place, section.at("settle_ms"), section.at("feedback_timeout_ms")})) return;
  const ContactorConfig& contactors = check.core().contactors;
  const std::string found = digits_of(to_ms(contactors.precharge_timeout));
  const Duration slowest = contactors.settle + contactors.feedback_timeout;
  if (contactors.precharge_timeout <= slowest) {
    check.problems.add(place, found,
                       "more than settle_ms and feedback_timeout_ms, " + digits_of(to_ms(slowest)) +
                           ", or a contact that takes its time makes every precharge give up");
  }
  constexpr Duration two_results = 2 * internal_bus::sensor_u2.period;
  if (!check.problems.is_good(section.at("precharge_min_ms"))) return;
  if (contactors.precharge_timeout >= contactors.precharge_min + two_results) return;
  check.problems.add(place, found,
                     "precharge_min_ms, " + digits_of(to_ms(contactors.precharge_min)) + ", and " +
                         ms_text(two_results) + " at least, for two results of the sensor in between");
}

/// Resistance of the precharge resistor, and the voltage of a full pack.
struct Resistor {
  std::int64_t full_mV;
  std::int64_t resistance_Ohm;
};

std::optional<Resistor> resistor_of(const Check& check) {
  const LimitRow& full = limit_row("cell_overvoltage");
  const bool are_known = check.are_good({check.limit_quantity(full, "open"),
                                         check.root.at("contactors").at("precharge_resistance_Ohm")}) &&
                         check.problems.is_good_throughout(check.root.at("modules"));
  const CoreConfig& core = check.core();
  if (!are_known || core.contactors.precharge_resistance_Ohm == 0) return std::nullopt;
  const auto cells = static_cast<std::int64_t>(cell_count(core));
  return Resistor{std::int64_t{core.limits.cell_overvoltage.open} * cells / 1'000,
                  core.contactors.precharge_resistance_Ohm};
}

void check_precharge_current(const Check& check) {
  const Place place = check.root.at("contactors").at("precharge_overcurrent_mA");
  const std::optional<Resistor> resistor = resistor_of(check);
  const std::int32_t found_mA = check.core().contactors.precharge_overcurrent_mA;
  if (!check.problems.is_good(place) || !resistor || found_mA == 0) return;
  const std::int64_t begins_at_mA = resistor->full_mV / resistor->resistance_Ohm;
  if (found_mA > begins_at_mA) return;
  check.problems.add(place, digits_of(found_mA),
                     "more than " + digits_of(begins_at_mA) + ", with which the precharge of a full pack of " +
                         digits_of(resistor->full_mV) + " mV begins");
}

/// Minimum energy in the resistor when a DC link is charged from empty to `done` within `precharge_min` or longer: E =
/// C U^2 / 2 * (1 - rest^2), t = R C ln(1 / rest), rest = 1 - done. A DC link that must reach the full voltage takes
/// infinitely long, which gives no bound (0).
double precharge_energy_min_J(const ContactorConfig& contactors, const Resistor& resistor) {
  const double rest = 1.0 - contactors.precharge_done_permille / 1'000.0;
  if (rest <= 0.0) return 0.0;
  const double full_V = static_cast<double>(resistor.full_mV) / 1'000.0;
  const double power_W = full_V * full_V / static_cast<double>(resistor.resistance_Ohm);
  const double least_s = static_cast<double>(to_ms(contactors.precharge_min)) / 1'000.0;
  return power_W * least_s * (1.0 - rest * rest) / (2.0 * std::log(1.0 / rest));
}

void check_precharge_energy(const Check& check) {
  const Place section = check.root.at("contactors");
  const Place place = section.at("precharge_energy_J");
  const std::optional<Resistor> resistor = resistor_of(check);
  const ContactorConfig& contactors = check.core().contactors;
  const bool are_known = check.are_good({place, section.at("precharge_min_ms"), section.at("precharge_done_permille")});
  if (!are_known || !resistor || contactors.precharge_energy_J == 0) return;
  const auto least_J = static_cast<std::int64_t>(std::ceil(precharge_energy_min_J(contactors, *resistor)));
  if (contactors.precharge_energy_J >= least_J) return;
  check.problems.add(place, digits_of(contactors.precharge_energy_J),
                     "at least " + digits_of(least_J) +
                         ", what charging any link in precharge_min_ms or longer from a " + "full pack of " +
                         digits_of(resistor->full_mV) + " mV leaves in the resistor");
}

// --- contactors without a power distribution unit -------------------------------------------------------------------

bool has_output(const PackConfig& pack, GpioOutput output) {
  return pack.gpio && pack.gpio->outputs.at(static_cast<std::size_t>(output));
}
bool has_feedback(const PackConfig& pack, GpioOutput output) {
  return pack.gpio && pack.gpio->feedback.at(static_cast<std::size_t>(output));
}

/// Without a PDU only GPIO outputs drive the contactors, and only GPIO inputs report their feedback.
void check_contactor_lines(const Check& check) {
  const bool has_charge = check.core().contactors.has_charge_contactor;
  for (const GpioOutput output :
       {GpioOutput::main_positive, GpioOutput::main_negative, GpioOutput::precharge, GpioOutput::charge}) {
    if (output == GpioOutput::charge && !has_charge) continue;
    const std::string because = ", as contactors/pdu is false" +
                                std::string(output == GpioOutput::charge ? " and has_charge_contactor true" : "");
    const Place gpio = check.root.at("gpio");
    if (!has_output(check.pack, output)) {
      check.problems.add(gpio.at("outputs").at(to_text(output)), "nothing", "a line" + because);
    }
    if (!has_feedback(check.pack, output)) {
      check.problems.add(gpio.at("feedback").at(to_text(output)), "nothing",
                         "a line of its auxiliary contact" + because);
    }
  }
}

/// Rejects settings that only the PDU can provide the data for.
void check_unit_is_needed(const Check& check) {
  const Place monitoring = check.root.at("insulation").at("monitoring");
  if (check.problems.is_good(monitoring) && check.core().insulation.monitoring == InsulationMonitoring::measured &&
      !check.core().insulation.is_heard_itself()) {
    check.problems.add(
        monitoring, "\"measured\"",
        "\"ok_line\", because no PDU reports a resistance with contactors/pdu false, nor does a monitor of "
        "insulation/protocol or gpio/insulation_pulses");
  }
  const Place throttle = check.root.at("auxiliary").at("throttle_on_permille");
  const std::int32_t throttle_on_permille = check.core().auxiliary.throttle_on_permille;
  if (check.problems.is_good(throttle) && throttle_on_permille > 0) {
    check.problems.add(throttle, digits_of(throttle_on_permille),
                       "0, because no PDU reports the throttle with contactors/pdu false");
  }
}

void check_without_unit(const Check& check) {
  const Place place = check.root.at("contactors").at("pdu");
  const bool is_asked_for = check.problems.is_good(place) && !check.core().contactors.has_pdu;
  if (!is_asked_for || !check.problems.is_good_throughout(check.root.at("gpio"))) return;
  check_contactor_lines(check);
  const LinesConfig& lines = check.core().lines;
  if (!lines.has_vehicle_on && !lines.has_charger_connected) {
    check.problems.add(check.root.at("gpio").at("inputs"), "neither vehicle_on nor charger_connected",
                       "an input of either kind, because contactors/pdu is false: there is no other close request");
  }
  check_unit_is_needed(check);
}

// --- modules ---------------------------------------------------------------------------------------------------------

void check_sensors(const Check& check) {
  const Place place = check.root.at("modules");
  const auto& modules = check.core().modules;
  const bool has_sensor = std::any_of(modules.begin(), modules.end(),
                                      [](const ModuleConfig& module) { return module.temperature_sensor_count > 0; });
  // Elements that could not be read are not in the list: one of them may have a sensor.
  if (has_sensor || modules.empty() || !check.problems.is_good_throughout(place)) return;
  check.problems.add(place, "no temperature sensor in the whole pack",
                     "temperature_sensors above 0 in one module or more");
}

/// Checks the bleed current of the fullest cell allowed against the maximum of a module's switch.
void check_bleed_current(const Check& check) {
  constexpr std::int32_t bleed_max_mA = 250;
  const Place place = check.root.at("balancing").at("bleed_resistance_Ohm");
  const std::int32_t full_uV = check.core().limits.cell_overvoltage.open;
  const bool is_asked_for = check.core().balancing.is_enabled;
  if (!is_asked_for || !check.are_good({place, check.limit(limit_row("cell_overvoltage"), "open_mV")})) return;
  const std::int32_t least_Ohm = (full_uV / 1'000 + bleed_max_mA - 1) / bleed_max_mA;
  if (check.core().balancing.bleed_resistance_Ohm >= least_Ohm) return;
  check.problems.add(place, digits_of(check.core().balancing.bleed_resistance_Ohm),
                     "at least " + digits_of(least_Ohm) + ", so that a cell at open_mV of cell_overvoltage, " +
                         digits_of(full_uV / 1'000) + ", is bled with no more than " + digits_of(bleed_max_mA) + " mA");
}

/// Checks that the SOC can fall far enough below the pause, which arms it.
void check_resistance_pause(const Check& check) {
  const Place place = check.root.at("soc").at("resistance_pause_permille");
  const std::int32_t at_permille = check.core().soc.resistance_pause_permille;
  if (!check.are_good({place}) || at_permille == 0 || at_permille >= pause_span_permille) return;
  check.problems.add(place, digits_of(at_permille),
                     "0, or at least " + digits_of(pause_span_permille) +
                         ": a pause is only made after the charge has been so far below");
}

// --- cell data for the vehicle ---------------------------------------------------------------------------------------

/// Checks the period: at most one frame is sent in each tick.
void check_cell_data(const Check& check) {
  const Place place = check.root.at("vehicle").at("cell_data_period_ms");
  const auto frames = static_cast<std::int64_t>(cell_data_blocks(check.core()).count());
  const Duration least = tick_period * frames;
  if (!check.problems.is_good(place) || check.core().vehicle.cell_data_period >= least) return;
  check.problems.add(place, digits_of(to_ms(check.core().vehicle.cell_data_period)),
                     "at least " + digits_of(to_ms(least)) + ", as a round has " + digits_of(frames) +
                         " frames, and one goes out in " + ms_text(tick_period));
}

// --- the intake air --------------------------------------------------------------------------------------------------

/// Checks that the selected source has the settings it needs, and that no other source has any.
void check_intake_air(const Check& check) {
  const IntakeAirKeys& air = check.pack.intake_air;
  const Place place = check.root.at("intake_air");
  if (!check.problems.is_good_throughout(place)) return;
  const auto& modules = check.core().modules;
  const bool is_there = std::any_of(modules.begin(), modules.end(),
                                    [&air](const ModuleConfig& module) { return module.node == air.module; });
  const bool wants_module = air.source == AirSource::module;
  const bool wants_file = air.source == AirSource::file;
  if (wants_module && !is_there) {
    check.problems.add(place.at("module"), digits_of(air.module), "the node number of a module of this pack");
  }
  if (!wants_module && air.module != 0) {
    check.problems.add(place.at("module"), digits_of(air.module), "0, as the source is not module");
  }
  if (wants_file && air.file.empty()) check.problems.add(place.at("file"), "nothing", "a path, as the source is file");
  if (!wants_file && !air.file.empty()) {
    check.problems.add(place.at("file"), '"' + air.file + '"', "nothing, as the source is not file");
  }
}

// --- the serial console ---------------------------------------------------------------------------------------------

void check_serial_rate(const Check& check) {
  const Place place = check.root.at("serial").at("bit_rate_Bd");
  const std::int32_t bit_rate_Bd = check.pack.serial.bit_rate_Bd;
  if (!check.problems.is_good(place) || is_serial_rate(bit_rate_Bd)) return;
  std::string rates;
  for (const std::int32_t rate_Bd : serial_rates_Bd) rates += (rates.empty() ? "" : ", ") + digits_of(rate_Bd);
  check.problems.add(place, digits_of(bit_rate_Bd), "one of " + rates);
}

}  // namespace

void check_bus_times(const PackConfig& pack, const Place& pack_place, ProblemList& problems) {
  check_cycle(pack, pack_place, problems);
  check_own_buses(pack, pack_place, problems);
  const Check check{pack, pack_place, pack_place, problems};
  for (const AgeRow& row : age_rows()) check_age(check, row);
}

void check_pack(const PackConfig& pack, const Place& pack_place, const Place& cell_place, ProblemList& problems) {
  const Check check{pack, pack_place, cell_place, problems};
  check_sensors(check);
  check_bus_times(pack, pack_place, problems);
  for (const LimitRow& row : limit_rows()) {
    if (is_default(check, row)) continue;
    check_limit_order(check, row);
    check_hysteresis(check, row);
    if (!row.age_key.empty()) check_reaction(check, row);
  }
  for (const WindowRow& row : window_rows) check_window(check, row);
  for (const AbsoluteRow& row : absolute_rows) check_absolute(check, row);
  for (const ContinuousRow& row : continuous_rows) check_continuous(check, row);
  for (const OrderRow& row : order_rows) check_order(check, row);
  check_reaction_times(pack.core, pack_place, problems);
  check_limit_bounds(pack, pack_place, problems);
  check_bounds(pack.core, pack_place, problems);
  for (const PairRow& row : pair_rows) check_pair(check, row);
  check_paces(check);
  check_precharge_time(check);
  check_precharge_current(check);
  check_precharge_energy(check);
  check_without_unit(check);
  check_bleed_current(check);
  check_resistance_pause(check);
  check_charger(pack, pack_place, problems);
  check_inverter(pack, pack_place, problems);
  check_sensors_of_others(pack, pack_place, problems);
  check_modules(pack, pack_place, problems);
  check_identifiers(pack, pack_place, problems);
  check_device_rates(pack, pack_place, problems);
  check_serial_rate(check);
  check_intake_air(check);
  check_cell_data(check);
}

ConfigProblems pack_warnings(const PackConfig& pack, std::string_view file_name) {
  ProblemList warnings;
  warn_of_balance_window(pack, Place{std::string(file_name), ""}, warnings);
  ConfigProblems all = bus_warnings(pack, file_name);
  for (ConfigProblem& warning : warnings.take()) all.push_back(std::move(warning));
  return all;
}

}  // namespace bmu
