#include "config/checks/foreign_module_checks.hpp"

#include <string>

#include "config/fields/fields.hpp"
#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

struct Check {
  const PackConfig& pack;
  const Place& root;
  ProblemList& problems;

  [[nodiscard]] const CoreConfig& core() const { return pack.core; }
  [[nodiscard]] const ModuleDriver& driver() const { return *pack.core.foreign.driver; }
  [[nodiscard]] std::string name() const { return std::string(driver().name); }
  void add(const Place& place, const std::string& found, const std::string& wanted) const {
    if (problems.is_good(place)) problems.add(place, found, wanted);
  }
};

void check_sensor_count(const Check& check, std::size_t index, std::size_t most, const std::string& who) {
  const ModuleConfig& module = check.core().modules[index];
  if (module.temperature_sensor_count <= most) return;
  check.add(check.root.at("modules").at(index).at("temperature_sensors"), number_text(module.temperature_sensor_count),
            "at most " + number_text(static_cast<double>(most)) + ", as a module " + who + " has no more");
}

void check_own(const Check& check) {
  for (std::size_t index = 0; index < check.core().modules.size(); ++index) {
    check_sensor_count(check, index, internal_bus::cell_temperatures_per_module_max, "of ours");
  }
}

void check_module(const Check& check, std::size_t index) {
  const ModuleConfig& module = check.core().modules[index];
  const Place place = check.root.at("modules").at(index);
  if (module.node > check.driver().node_max) {
    check.add(place.at("node"), number_text(module.node),
              "1 to " + number_text(check.driver().node_max) + ", the nodes of " + check.name());
  }
  if (module.cell_count > check.driver().cell_count_max) {
    check.add(
        place.at("cells"), number_text(module.cell_count),
        "at most " + number_text(check.driver().cell_count_max) + ", as a module of " + check.name() + " has no more");
  }
  check_sensor_count(check, index, check.driver().temperature_count_max, "of " + check.name());
  if (module.serial_number) {
    check.add(place.at("serial_number"), number_text(static_cast<double>(*module.serial_number)),
              "nothing, as " + check.name() + " reports none");
  }
  if (module.must_report_front_end) {
    check.add(place.at("front_end_faults"), "true", "false, as " + check.name() + " does not report them");
  }
}

void check_period(const Check& check, std::string_view key, Duration period) {
  if (period == Duration{}) return;  // never
  const ModuleDriver& driver = check.driver();
  if (period >= driver.round_min && period <= driver.round_max) return;
  check.add(check.root.at("poll").at(key), number_text(static_cast<double>(to_ms(period))),
            number_text(static_cast<double>(to_ms(driver.round_min))) + " to " +
                number_text(static_cast<double>(to_ms(driver.round_max))) + ", as " + check.name() + " can be polled");
}

void check_poll(const Check& check) {
  const PollConfig& poll = check.core().poll;
  check_period(check, "period_ms", poll.period);
  check_period(check, "fast_period_ms", poll.fast_period);
  check_period(check, "parked_period_ms", poll.parked_period);
  if (poll.temperature_every != 1) {
    check.add(check.root.at("poll").at("temperature_every"), number_text(poll.temperature_every),
              "1, as " + check.name() + " reports all of it with every answer");
  }
}

/// An MMU opens its alarm contact at limits of its own; with third-party modules the cell's limits are the last bound.
void check_margin(const Check& check) {
  const LimitsConfig& limits = check.core().limits;
  const Place limits_place = check.root.at("limits");
  const bool is_bled = check.core().balancing.is_enabled;
  const std::int32_t upper_margin_uV = foreign_overvoltage_margin_uV(check.core());
  const std::int32_t most_uV = check.core().cell.voltage_max_uV - upper_margin_uV;
  const std::int32_t least_uV = check.core().cell.voltage_min_uV + foreign_margin_uV;
  const auto why = [&check](std::int32_t left_uV, const char* what) {
    return ", " + number_text(left_uV / 1e3) + " mV within what the cell file allows, as a module of " + check.name() +
           what;
  };
  const char* const alone = " watches no cell by itself";
  if (limits.cell_overvoltage.open > most_uV) {
    check.add(limits_place.at("cell_overvoltage").at("open_mV"), number_text(limits.cell_overvoltage.open / 1e3),
              "at most " + number_text(most_uV / 1e3) +
                  why(upper_margin_uV, is_bled ? " reads a cell low while it bleeds it" : alone));
  }
  if (limits.cell_undervoltage.open < least_uV) {
    check.add(limits_place.at("cell_undervoltage").at("open_mV"), number_text(limits.cell_undervoltage.open / 1e3),
              "at least " + number_text(least_uV / 1e3) + why(foreign_margin_uV, alone));
  }
}

void check_balancing(const Check& check) {
  const BalancingConfig& balancing = check.core().balancing;
  const Place place = check.root.at("balancing");
  if (balancing.method == BalancingMethod::charge) {
    check.add(place.at("method"), "\"charge\"",
              "\"ocv\" or \"terminal_voltage\", as " + check.name() + " bleeds by voltage and takes no times");
  }
  if (balancing.is_autonomous_allowed) {
    check.add(place.at("autonomous"), "true", "false, as " + check.name() + " does not support it");
  }
}

}  // namespace

void check_modules(const PackConfig& pack, const Place& place, ProblemList& problems) {
  const Check check{pack, place, problems};
  if (!problems.is_good_throughout(place.at("modules")) ||
      !problems.is_good(place.at("foreign_modules").at("protocol")))
    return;
  if (are_modules_ours(pack.core)) return check_own(check);
  for (std::size_t index = 0; index < pack.core.modules.size(); ++index) check_module(check, index);
  check_poll(check);
  check_margin(check);
  check_balancing(check);
}

}  // namespace bmu
