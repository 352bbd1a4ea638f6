#include "daemon/shell/status/health_json.hpp"

#include <cmath>
#include <utility>

#include "daemon/core/estimation/pack_health.hpp"

namespace bmu {

namespace {

constexpr double uOhm_per_Ohm = 1e6;
constexpr double uAs_per_As = 1e6;

template <class T>
Json or_null(bool is_known, T value) {
  return is_known ? Json(value) : Json(nullptr);
}

Json whole(bool is_known, double value) {
  return or_null(is_known, std::llround(value));
}

/// Adds `key`_permille and `key`_sigma_permille.
void put(Json& to, const std::string& key, const HealthFigure& figure) {
  to[key + "_permille"] = or_null(figure.is_known, figure.permille);
  to[key + "_sigma_permille"] = or_null(figure.is_known, figure.sigma_permille);
}

Json totals_json(const Core& core) {
  const std::optional<PackTotals> totals = core.totals();
  if (!totals) return nullptr;
  return {{"charge_out_uAs", totals->charge_out_uAs},
          {"charge_in_uAs", totals->charge_in_uAs},
          {"energy_out_mWh", totals->energy_out_mWh},
          {"energy_in_mWh", totals->energy_in_mWh},
          {"cycles_permille", cycles_permille(*totals, core.config().cell.capacity_uAs)}};
}

/// Columns, a number for each cell of the module.
Json module_json(const Core& core, const ModuleConfig& module, std::size_t first_cell) {
  const PackEstimate& estimate = core.estimate();
  Json json{{"node", module.node}, {"first_pack_number", first_cell + 1}};
  for (std::size_t cell = first_cell; cell < first_cell + module.cell_count; ++cell) {
    const CellHealth& health = estimate.cell_health(cell);
    const StateOfHealth figures = health.health();
    const ResistanceEstimate resistance = estimate.cell_resistance(cell);
    const bool has_capacity = health.is_capacity_known();
    json["capacity_uAs"].push_back(whole(has_capacity, health.capacity_As() * uAs_per_As));
    json["capacity_sigma_uAs"].push_back(whole(has_capacity, health.capacity_sigma_As() * uAs_per_As));
    json["capacity_pairs"].push_back(health.capacity_pairs());
    json["capacity_refused"].push_back(health.capacity_refused());
    json["resistance_uOhm"].push_back(whole(resistance.is_known, resistance.resistance_Ohm * uOhm_per_Ohm));
    json["resistance_sigma_uOhm"].push_back(whole(resistance.is_known, resistance.sigma_Ohm * uOhm_per_Ohm));
    const std::int32_t step_uOhm = core.watchers().steps.cell_resistance_uOhm(cell);
    json["step_resistance_uOhm"].push_back(or_null(step_uOhm > 0, step_uOhm));
    for (const auto& [key, figure] : {std::pair{"health_by_capacity", figures.by_capacity},
                                      std::pair{"health_by_resistance", figures.by_resistance}}) {
      json[std::string(key) + "_permille"].push_back(or_null(figure.is_known, figure.permille));
      json[std::string(key) + "_sigma_permille"].push_back(or_null(figure.is_known, figure.sigma_permille));
    }
  }
  return json;
}

}  // namespace

Json pack_health_json(const CoreView& view) {
  const PackEstimate& estimate = view.core.estimate();
  const PackHealth health = pack_health(estimate);
  const bool has_resistance = health.resistance.is_known;
  const auto cell = [&estimate](bool is_known, std::size_t number) {
    return is_known ? element_json(estimate.element(number), Unit::none) : Json(nullptr);
  };
  Json json = Json::object();
  put(json, "by_capacity", health.by_capacity);
  json["weakest_cell"] = cell(health.by_capacity.is_known, health.weakest_cell);
  put(json, "by_resistance", health.by_resistance);
  json["worst_cell"] = cell(health.by_resistance.is_known, health.worst_cell);
  json["pack_resistance_uOhm"] = whole(has_resistance, health.resistance.resistance_Ohm * uOhm_per_Ohm);
  json["pack_resistance_sigma_uOhm"] = whole(has_resistance, health.resistance.sigma_Ohm * uOhm_per_Ohm);
  json["cell_resistance_min_uOhm"] = whole(has_resistance, health.cell_resistance_min_Ohm * uOhm_per_Ohm);
  json["cell_resistance_min_at"] = cell(has_resistance, health.cell_resistance_min_cell);
  json["cell_resistance_max_uOhm"] = whole(has_resistance, health.cell_resistance_max_Ohm * uOhm_per_Ohm);
  json["cell_resistance_max_at"] = cell(has_resistance, health.resistance.worst_cell);
  json["cell_resistance_max_permille"] = or_null(has_resistance, health.resistance.worst_permille);
  json["rated_capacity_uAs"] = view.core.config().cell.capacity_uAs;
  json["totals"] = totals_json(view.core);
  json["is_charge_paused"] = view.core.charge_pause().is_pausing();
  return json;
}

Json health_json(const CoreView& view) {
  Json json = pack_health_json(view);
  Json modules = Json::array();
  std::size_t first_cell = 0;
  for (const ModuleConfig& module : view.core.config().modules) {
    modules.push_back(module_json(view.core, module, first_cell));
    first_cell += module.cell_count;
  }
  json["modules"] = std::move(modules);
  return json;
}

}  // namespace bmu
