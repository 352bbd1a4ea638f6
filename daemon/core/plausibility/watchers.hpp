// Monitors that need previous measurements to check the present ones: one member per test, each in a file of its own.
#pragma once

#include "daemon/core/estimation/health/step_response.hpp"
#include "daemon/core/modules/module_roster.hpp"
#include "daemon/core/plausibility/balancing_switches.hpp"
#include "daemon/core/plausibility/bus_watch.hpp"
#include "daemon/core/plausibility/link_decay.hpp"
#include "daemon/core/plausibility/link_rise.hpp"
#include "daemon/core/plausibility/overload_counter.hpp"
#include "daemon/core/plausibility/stuck_watch.hpp"
#include "daemon/core/plausibility/temperature_trend.hpp"

namespace bmu {

struct Watchers {
  OverloadCounter overload;
  TemperatureTrend trend;
  StuckWatch stuck;
  StepResponse steps;
  BusWatch bus;
  ModuleRoster roster;
  BalancingSwitches switches;
  LinkDecay link;
  LinkRise rise;
};

}  // namespace bmu
