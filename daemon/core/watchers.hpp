// Everything that remembers measurements over time to judge the present ones: one member a question, each its own file.
#pragma once

#include "daemon/core/balancing_switches.hpp"
#include "daemon/core/bus_watch.hpp"
#include "daemon/core/estimators/step_response.hpp"
#include "daemon/core/link_decay.hpp"
#include "daemon/core/link_rise.hpp"
#include "daemon/core/module_roster.hpp"
#include "daemon/core/overload_counter.hpp"
#include "daemon/core/stuck_watch.hpp"
#include "daemon/core/temperature_trend.hpp"

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
