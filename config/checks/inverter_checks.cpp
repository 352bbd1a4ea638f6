#include "config/checks/inverter_checks.hpp"

#include <string>

#include "config/fields/fields.hpp"
#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

/// Maximum on the wire: tenths of a volt in 16 bits, one of the codes for "unknown".
constexpr std::int32_t voltage_on_wire_max_mV = 6'553'400;

std::string text_of(std::int64_t number) {
  return number_text(static_cast<double>(number));
}

/// Sum of all cell voltages when each cell has this one.
std::int64_t all_cells_mV(const PackConfig& pack, std::int32_t cell_uV) {
  return std::int64_t{cell_uV} * static_cast<std::int64_t>(cell_count(pack.core)) / 1'000;
}

struct Check {
  const PackConfig& pack;
  const Place& root;
  ProblemList& problems;

  [[nodiscard]] const InverterConfig& inverter() const { return pack.core.inverter; }
  [[nodiscard]] Place at(std::string_view key) const { return root.at("inverter").at(key); }
  [[nodiscard]] bool may_judge(std::string_view key, std::string_view limit, std::string_view quantity) const {
    return problems.is_good(at(key)) && problems.is_good(root.at("limits").at(limit).at(quantity));
  }
};

void check_charge_voltage(const Check& check) {
  const std::int32_t most_mV = check.inverter().charge_voltage_max_mV;
  if (most_mV == 0 || !check.may_judge("charge_voltage_max_mV", "cell_overvoltage", "open_mV")) return;
  const std::int64_t open_mV = all_cells_mV(check.pack, check.pack.core.limits.cell_overvoltage.open);
  if (most_mV <= open_mV) return;
  check.problems.add(check.at("charge_voltage_max_mV"), text_of(most_mV),
                     "at most " + text_of(open_mV) + ", all cells at the open_mV of cell_overvoltage");
}

void check_discharge_voltage(const Check& check) {
  const std::int32_t least_mV = check.inverter().discharge_voltage_min_mV;
  if (least_mV == 0 || !check.may_judge("discharge_voltage_min_mV", "cell_undervoltage", "open_mV")) return;
  const std::int64_t open_mV = all_cells_mV(check.pack, check.pack.core.limits.cell_undervoltage.open);
  if (least_mV >= open_mV) return;
  check.problems.add(check.at("discharge_voltage_min_mV"), text_of(least_mV),
                     "at least " + text_of(open_mV) + ", all cells at the open_mV of cell_undervoltage");
}

/// Checks that the timeouts allow for the periods. Limits are sent again as soon as they fall, and never more often
/// than the inverter accepts.
void check_period(const Check& check) {
  const InverterConfig& inverter = check.inverter();
  if (!check.problems.is_good(check.at("period_ms")) || !check.problems.is_good(check.at("silence_max_ms"))) return;
  const auto ms = [](Duration span) { return std::to_string(to_ms(span)); };
  const Duration least = inverter.driver->keep_alive_period * 2;
  if (inverter.silence_max > Duration{} && inverter.silence_max < least) {
    check.problems.add(check.at("silence_max_ms"), ms(inverter.silence_max),
                       "0, or at least " + ms(least) + ": an inverter shows that it is there once every " +
                           ms(inverter.driver->keep_alive_period));
  }
  if (inverter.period * 2 <= inverter.driver->battery_life) return;
  check.problems.add(check.at("period_ms"), ms(inverter.period),
                     "at most " + ms(inverter.driver->battery_life / 2) + ": one that hears nothing for " +
                         ms(inverter.driver->battery_life) + " gives up");
}

}  // namespace

void check_inverter(const PackConfig& pack, const Place& place, ProblemList& problems) {
  const Check check{pack, place, problems};
  check_charge_voltage(check);
  check_discharge_voltage(check);
  if (pack.core.inverter.driver != nullptr) check_period(check);
}

void check_completed_inverter(const PackConfig& pack, const Place& place, ProblemList& problems) {
  const InverterConfig& inverter = pack.core.inverter;
  if (inverter.driver == nullptr) return;
  const Check check{pack, place, problems};
  if (inverter.charge_voltage_max_mV > voltage_on_wire_max_mV) {
    problems.add(check.at("charge_voltage_max_mV"), text_of(inverter.charge_voltage_max_mV),
                 "at most " + text_of(voltage_on_wire_max_mV) + ", which is all that the frame carries");
  }
  if (inverter.discharge_voltage_min_mV < inverter.charge_voltage_max_mV) return;
  problems.add(check.at("discharge_voltage_min_mV"), text_of(inverter.discharge_voltage_min_mV),
               "less than charge_voltage_max_mV, " + text_of(inverter.charge_voltage_max_mV));
}

}  // namespace bmu
