// The buses of the daemon: one or two ports behind the core's two names, and which identifiers they let in.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/core/observation.hpp"
#include "daemon/shell/bus_port.hpp"

namespace bmu {

struct Buses {
  std::unique_ptr<BusPort> internal;
  std::unique_ptr<BusPort> vehicle;  // null: the same bus as `internal`, which then serves both

  [[nodiscard]] bool is_shared() const { return vehicle == nullptr; }
  [[nodiscard]] BusPort& serving(Port port) const {
    return port == Port::vehicle && vehicle != nullptr ? *vehicle : *internal;
  }
};

/// Every identifier of the internal bus: also those of modules this pack does not have, so that a stray one is counted,
/// and those that only a master sends, so that a second master is noticed. Nothing else leaves the kernel.
[[nodiscard]] std::vector<std::uint32_t> internal_receive_ids();
/// What the pack reports to the vehicle: to hear our own, and anybody who does the same.
[[nodiscard]] std::vector<std::uint32_t> vehicle_receive_ids(const CoreConfig& config);

/// Interfaces that are missing or down are no error: the daemon stays, waits and says so.
[[nodiscard]] Result<Buses, OsError> open_buses(const BusNames& names, const CoreConfig& config);

}  // namespace bmu
