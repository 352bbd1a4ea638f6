#include "daemon/shell/status/balance_json.hpp"

#include <bit>
#include <utility>

namespace bmu {

namespace {

Json reasons_json(BalancingBlockers blockers) {
  Json reasons = Json::array();
  for (const BalancingBlockerRow& row : balancing_blocker_table()) {
    const bool holds = (blockers >> static_cast<unsigned>(row.id) & 1U) != 0;
    if (holds) reasons.push_back({{"name", row.name}, {"text", row.meaning}});
  }
  return reasons;
}

std::size_t cells_on(const Core& core) {
  std::size_t cells = 0;
  for (std::size_t index = 0; index < core.modules().modules().size(); ++index) {
    cells += static_cast<std::size_t>(std::popcount(core.watchers().switches.on(index)));
  }
  return cells;
}

/// Switches that are on without a command: nothing is measured or planned before they are off.
Json untold_json(const Core& core) {
  const BalancingSwitches& switches = core.watchers().switches;
  Json untold = Json::array();
  for (std::size_t index = 0; index < core.modules().modules().size(); ++index) {
    for (std::size_t cell = 0; cell < internal_bus::cells_per_module_max; ++cell) {
      if ((switches.unwanted(index) >> cell & 1U) != 0)
        untold.push_back(element_json(switches.element_of(index, cell), Unit::uV));
    }
  }
  return untold;
}

Json missing_json(const CellCharge& charge) {
  return charge.is_known ? Json(charge.missing_uAs) : Json(nullptr);
}

Json module_json(const Core& core, std::size_t index) {
  const BalancingControl& balancing = core.balancing();
  const BalancingSwitches& switches = core.watchers().switches;
  const ModuleConfig& module = core.modules().modules()[index].config;
  Json to_go = Json::array();
  Json minutes = Json::array();
  Json on = Json::array();
  Json bled = Json::array();
  Json missing = Json::array();
  for (std::size_t cell = 0; cell < module.cell_count; ++cell) {
    const std::size_t number = switches.first_cell(index) + cell;
    to_go.push_back(balancing.to_go_uAs(number, switches));
    minutes.push_back(switches.minutes_told(index, cell));
    on.push_back((switches.on(index) >> cell & 1U) != 0);
    bled.push_back(switches.bled_uAs(number));
    missing.push_back(missing_json(core.cell_charges().cell(number)));
  }
  return {{"node", module.node},
          {"first_pack_number", switches.first_cell(index) + 1},
          {"command", to_text(balancing.stage(index))},
          {"to_go_uAs", std::move(to_go)},
          {"minutes_told", std::move(minutes)},
          {"is_on", std::move(on)},
          {"bled_uAs", std::move(bled)},
          {"missing_uAs", std::move(missing)}};
}

}  // namespace

Json balancing_state_json(const CoreView& view) {
  const Core& core = view.core;
  const BalancingControl& balancing = core.balancing();
  const BalancingConfig& config = core.config().balancing;
  return {{"is_enabled", config.is_enabled},
          {"is_switched_off", core.is_balancing_switched_off()},
          {"method", to_text(config.method)},
          {"state", to_text(balancing.state())},
          {"state_for_ms", ago_ms(view, balancing.since())},
          {"reasons", reasons_json(balancing.blockers())},
          {"plan", to_text(balancing.verdict())},
          {"planned_ago_ms", ago_ms(view, balancing.planned_at())},
          {"cells_told", balancing.state() == BalancingState::bleeding ? balancing.cells_told() : 0},
          {"cells_on", cells_on(core)},
          {"on_untold", untold_json(core)},
          {"cells_with_known_charge", core.cell_charges().known_cells()},
          {"former_charges", to_text(core.cell_charges().former())}};
}

Json balance_json(const CoreView& view) {
  Json json = balancing_state_json(view);
  Json modules = Json::array();
  for (std::size_t index = 0; index < view.core.modules().modules().size(); ++index) {
    modules.push_back(module_json(view.core, index));
  }
  json["modules"] = std::move(modules);
  return json;
}

}  // namespace bmu
