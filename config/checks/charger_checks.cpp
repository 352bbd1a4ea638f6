#include "config/checks/charger_checks.hpp"

#include <cmath>
#include <string>

#include "config/fields/fields.hpp"
#include "config/fields/pack_fields.hpp"
#include "daemon/core/balancing/balancing_plan.hpp"

namespace bmu {
namespace {

struct Check {
  const PackConfig& pack;
  const Place& root;
  ProblemList& problems;

  [[nodiscard]] const ChargerConfig& charger() const { return pack.core.charger; }
  [[nodiscard]] Place at(std::string_view key) const { return root.at("charger").at(key); }
  /// Whether neither the key nor the one it is compared with was rejected.
  [[nodiscard]] bool may_judge(std::string_view key, const Place& other) const {
    return problems.is_good(at(key)) && problems.is_good(other);
  }
};

void check_units(const Check& check) {
  const ChargerConfig& charger = check.charger();
  const bool can_be_judged = charger.driver != nullptr && check.may_judge("units", check.at("protocol"));
  if (!can_be_judged || charger.unit_count <= charger.driver->unit_count_max) return;
  check.problems.add(check.at("units"), number_text(charger.unit_count),
                     "at most " + number_text(charger.driver->unit_count_max) + ": " +
                         std::string(charger.driver->name) + " has no word for more");
}

/// Checks that a full cell is between the warning thresholds of both sides, where a cell is healthy.
void check_cell_full(const Check& check) {
  const std::int32_t full_uV = check.charger().cell_full_uV;
  const LimitsConfig& limits = check.pack.core.limits;
  const Place high = check.root.at("limits").at("cell_overvoltage").at("warn_mV");
  const Place low = check.root.at("limits").at("cell_undervoltage").at("warn_mV");
  if (full_uV == 0 || !check.may_judge("cell_full_mV", high) || !check.problems.is_good(low)) return;
  const bool is_between = full_uV < limits.cell_overvoltage.warn && full_uV > limits.cell_undervoltage.warn;
  if (is_between) return;
  check.problems.add(check.at("cell_full_mV"), number_text(full_uV / 1e3),
                     "more than the warning of cell_undervoltage, " + number_text(limits.cell_undervoltage.warn / 1e3) +
                         ", and less than that of cell_overvoltage, " +
                         number_text(limits.cell_overvoltage.warn / 1e3));
}

void check_voltage(const Check& check) {
  const ChargerConfig& charger = check.charger();
  const Place high = check.root.at("limits").at("cell_overvoltage").at("open_mV");
  if (charger.voltage_max_mV == 0 || !check.may_judge("voltage_max_mV", high)) return;
  const std::int64_t open_uV = check.pack.core.limits.cell_overvoltage.open;
  const std::int64_t most_mV = open_uV * static_cast<std::int64_t>(cell_count(check.pack.core)) / 1'000;
  if (charger.voltage_max_mV <= most_mV) return;
  check.problems.add(
      check.at("voltage_max_mV"), number_text(charger.voltage_max_mV),
      "at most " + number_text(static_cast<double>(most_mV)) + ", all cells at the open_mV of cell_overvoltage");
}

/// A pack that opens when full cannot be charged again.
void check_resume(const Check& check) {
  const ChargerConfig& charger = check.charger();
  if (!check.may_judge("resume_below_permille", check.at("opens_when_full"))) return;
  if (charger.resume_below_permille == 0 || !charger.opens_when_full) return;
  check.problems.add(check.at("resume_below_permille"), number_text(charger.resume_below_permille),
                     "0, or \"opens_when_full\": false, as an open pack is not charged");
}

void check_mains_request(const Check& check) {
  const ChargerConfig& charger = check.charger();
  if (!charger.requests_mains || !check.may_judge("requests_mains", check.at("protocol"))) return;
  if (charger.driver != nullptr && charger.driver->can_request_mains) return;
  const std::string who = charger.driver != nullptr ? std::string(charger.driver->name) + " does not support it"
                                                    : std::string("no protocol is named");
  check.problems.add(check.at("requests_mains"), "true", "false, as " + who);
}

void check_master_address(const Check& check) {
  const ChargerConfig& charger = check.charger();
  const bool is_default = charger.master_address == ChargerConfig{}.master_address;
  if (is_default || !check.may_judge("master_address", check.at("protocol"))) return;
  if (charger.driver != nullptr && charger.driver->has_master_address) return;
  const std::string who = charger.driver != nullptr ? std::string(charger.driver->name) + " has no such address"
                                                    : std::string("no protocol is named");
  check.problems.add(check.at("master_address"), "\"F5\"", "\"F4\" or nothing, as " + who);
}

/// Otherwise a charge would end before it has started, or never.
void check_end_current(const Check& check) {
  const ChargerConfig& charger = check.charger();
  if (charger.end_current_mA * 2 <= charger.current_max_mA) return;
  check.problems.add(check.at("end_current_mA"), number_text(charger.end_current_mA),
                     "at most half of the maximum request, " + number_text(charger.current_max_mA));
}

/// A voltage below that of full cells ends no charge, and a full pack would look like a runaway.
void check_voltage_suffices(const Check& check) {
  const ChargerConfig& charger = check.charger();
  const std::int64_t full_mV =
      std::int64_t{charger.cell_full_uV} * static_cast<std::int64_t>(cell_count(check.pack.core)) / 1'000;
  if (charger.voltage_max_mV >= full_mV) return;
  check.problems.add(check.at("voltage_max_mV"), number_text(charger.voltage_max_mV),
                     "at least " + number_text(static_cast<double>(full_mV)) + ", all cells at cell_full_mV");
}

void check_full_is_full(const Check& check) {
  constexpr double half_permille = 500.0;
  const double half_uV = ocv_uV(check.pack.core.cell, half_permille);
  if (check.charger().cell_full_uV > half_uV) return;
  check.problems.add(check.at("cell_full_mV"), number_text(check.charger().cell_full_uV / 1e3),
                     "more than a cell that is half full has, " + number_text(std::ceil(half_uV / 1e3)));
}

}  // namespace

void check_completed_charger(const PackConfig& pack, const Place& place, ProblemList& problems) {
  if (pack.core.charger.driver == nullptr) return;
  const Check check{pack, place, problems};
  check_end_current(check);
  check_voltage_suffices(check);
  check_full_is_full(check);
}

void warn_of_balance_window(const PackConfig& pack, const Place& place, ProblemList& warnings) {
  const CoreConfig& core = pack.core;
  const bool goes_by_voltage = core.balancing.is_enabled && core.balancing.method != BalancingMethod::charge;
  const std::int32_t left_uV = left_by_voltage_uV(core);
  if (core.charger.driver == nullptr || !goes_by_voltage || core.charger.balance_window_uV >= left_uV) return;
  warnings.add(place.at("charger").at("balance_window_mV"), number_text(core.charger.balance_window_uV / 1e3),
               "at least " + number_text(left_uV / 1e3) + ", which balancing leaves: balancing/dead_band_mV, " +
                   number_text(core.balancing.dead_band_uV / 1e3) + ", and twice the cell's hysteresis_mV");
}

void check_charger(const PackConfig& pack, const Place& place, ProblemList& problems) {
  const Check check{pack, place, problems};
  check_units(check);
  check_cell_full(check);
  check_voltage(check);
  check_resume(check);
  check_mains_request(check);
  check_master_address(check);
}

}  // namespace bmu
