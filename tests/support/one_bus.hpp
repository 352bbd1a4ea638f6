// Buses of a daemon with one bus for modules and vehicle, and no other bus.
#pragma once

#include <memory>
#include <utility>

#include "daemon/shell/can/buses.hpp"

namespace bmu::test {

inline Buses one_bus(std::unique_ptr<BusPort> port) {
  Buses buses{.served_by = {Port::internal, Port::internal, Port::charger, Port::second_pack, Port::inverter}};
  buses.ports[0] = std::move(port);
  return buses;
}

}  // namespace bmu::test
