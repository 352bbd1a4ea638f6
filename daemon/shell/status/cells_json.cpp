// Every cell, in columns by module: measured and estimated values.
#include <array>
#include <string>

#include "daemon/shell/status/measured_json.hpp"
#include "daemon/shell/status/status_json.hpp"

namespace bmu {

namespace {

/// Lists of equal length, one column each: value or null, validity, age.
template <std::size_t Room>
void put_column(JsonText& to, std::string_view stem, Unit unit, const std::array<Measured<std::int32_t>, Room>& values,
                std::size_t count, const StatusView& view, Duration age_max) {
  const auto column = [&](const std::string& name, auto add_one) {
    to.array(name, [&] {
      for (std::size_t i = 0; i < count; ++i) add_one(values[i]);
    });
  };
  using Value = Measured<std::int32_t>;
  column(key_with_unit(stem, unit),
         [&](const Value& one) { to.add(if_known(one.is_usable(view.now, age_max), one.value)); });
  column(std::string(stem) + "_validity", [&](const Value& one) { to.add(validity_text(one, view.now, age_max)); });
  column(std::string(stem) + "_age_ms", [&](const Value& one) { to.add(ago_ms(view, one.taken_at)); });
}

/// Columns of the SOC by the chosen method and its sigma, and of the SOC by each method.
void put_estimates(JsonText& to, std::size_t first_cell, std::size_t count, const PackEstimate& estimate) {
  const auto column = [&](std::string_view name, auto&& permille_of) {
    to.array(name, [&] {
      for (std::size_t cell = first_cell; cell < first_cell + count; ++cell) to.add(permille_of(cell));
    });
  };
  const auto soc_permille = [](const SocEstimate& one) { return if_known(one.is_known, in_permille(one.soc)); };
  column("soc_permille", [&](std::size_t cell) { return soc_permille(estimate.cell_soc(cell)); });
  column("soc_sigma_permille", [&](std::size_t cell) {
    const SocEstimate one = estimate.cell_soc(cell);
    return if_known(one.is_known, in_permille(one.sigma));
  });
  to.object("soc_by_method_permille", [&] {
    for (const SocMethod method : {SocMethod::ekf, SocMethod::mixed, SocMethod::coulomb}) {
      column(to_text(method), [&](std::size_t cell) { return soc_permille(estimate.cell(cell).estimate(method)); });
    }
  });
}

void put_module(JsonText& to, const ModuleRecord& module, std::size_t first_pack_number, const StatusView& view) {
  const AgeConfig& ages = view.core.config().ages;
  const ModuleConfig& config = module.config;
  to.put("node", config.node);
  to.put("is_answering", is_answering(module, ages, view.now));
  to.put("first_pack_number", first_pack_number);
  put_column(to, "cell_voltage", Unit::uV, module.cell_voltage_uV, config.cell_count, view, ages.cell_voltage);
  put_column(to, "cell_temperature", Unit::dC, module.cell_temperature_dC, config.temperature_sensor_count, view,
             ages.temperature);
  put_column(to, "board_temperature", Unit::dC, module.board_temperature_dC, module.board_temperature_dC.size(), view,
             ages.temperature);
  put_measured(to, "module_voltage", Unit::mV, module.module_voltage_mV, view, ages.cell_voltage);
  to.array("balancing", [&] {
    for (unsigned cell = 0; cell < config.cell_count; ++cell) to.add(((module.balancing_cells >> cell) & 1U) != 0);
  });
  put_estimates(to, first_pack_number - 1, config.cell_count, view.core.estimate());
  to.put("last_answer_age_ms", ago_ms(view, module.last_answer_at));
}

void put_band(JsonText& to, std::string_view name, const LimitConfig& low, const LimitConfig& high, Unit unit) {
  to.object(name, [&] {
    to.put(key_with_unit("low_open", unit), low.open);
    to.put(key_with_unit("low_warn", unit), low.warn);
    to.put(key_with_unit("high_warn", unit), high.warn);
    to.put(key_with_unit("high_open", unit), high.open);
  });
}

}  // namespace

void put_cells(JsonText& to, const StatusView& view) {
  const LimitsConfig& limits = view.core.config().limits;
  const PackState& pack = view.core.pack();
  put_band(to, "cell_voltage_limits", limits.cell_undervoltage, limits.cell_overvoltage, Unit::uV);
  put_band(to, "cell_temperature_limits", limits.cell_undertemperature, limits.cell_overtemperature, Unit::dC);
  put_spread(to, "cell_voltage", pack.cell_voltage_uV, Unit::uV, view);
  put_spread(to, "cell_temperature", pack.cell_temperature_dC, Unit::dC, view);
  to.array("modules", [&] {
    std::size_t pack_number = 1;
    for (const ModuleRecord& module : view.core.modules().modules()) {
      to.object([&] { put_module(to, module, pack_number, view); });
      pack_number += module.config.cell_count;
    }
  });
}

}  // namespace bmu
