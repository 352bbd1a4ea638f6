// The buses of the daemon: the ports for the buses of the core, and the identifiers that they receive.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/core/types/observation.hpp"
#include "daemon/shell/can/bus_port.hpp"

namespace bmu {

struct Buses {
  ServedBy served_by = all_ports;
  std::array<std::unique_ptr<BusPort>, port_count> ports;  // null: served by another, or nothing is expected there

  /// Something is expected on this bus.
  [[nodiscard]] bool is_there(Port port) const {
    return ports.at(static_cast<std::size_t>(served_by.at(static_cast<std::size_t>(port)))) != nullptr;
  }
  /// It is there, and served by its own port, not by that of another bus.
  [[nodiscard]] bool is_own(Port port) const {
    return is_there(port) && served_by.at(static_cast<std::size_t>(port)) == port;
  }
  /// Its port serves another bus, too. Precondition: is_there(port).
  [[nodiscard]] bool is_shared(Port port) const;
  [[nodiscard]] BusPort& serving(Port port) const {
    return *ports.at(static_cast<std::size_t>(served_by.at(static_cast<std::size_t>(port))));
  }
  [[nodiscard]] BusPort& internal() const { return serving(Port::internal); }
};

/// Every identifier of the internal bus: also those of modules that this pack does not have, so that a stray one is
/// counted, and those that only a master sends, so that a second master is detected. With modules of another maker
/// their identifiers instead. No other frame leaves the kernel.
[[nodiscard]] std::vector<std::uint32_t> internal_receive_ids(const CoreConfig& config);
/// Reports to the vehicle, to receive the echoes and the frames of another reporter; requests for data, and replies;
/// and frames of the internal bus which show that the two are swapped (core/vehicle/swapped_buses.hpp).
[[nodiscard]] std::vector<std::uint32_t> vehicle_receive_ids(const CoreConfig& config);
/// The messages of a second pack, if there is one.
[[nodiscard]] std::vector<std::uint32_t> second_pack_receive_ids(const CoreConfig& config);
/// Messages from and to chargers, of 11 or of 29 bits; empty if no charger is controlled.
[[nodiscard]] std::vector<std::uint32_t> charger_receive_ids(const CoreConfig& config, bool is_extended);
/// Messages from and to an inverter; empty if none is configured.
[[nodiscard]] std::vector<std::uint32_t> inverter_receive_ids(const CoreConfig& config);
/// Messages from and to sensors of other makers on this bus: all have 11 bits.
[[nodiscard]] std::vector<std::uint32_t> sensor_receive_ids(Port port, const CoreConfig& config);
/// Identifiers to receive on a bus.
struct ReceiveIds {
  std::vector<std::uint32_t> standard;
  std::vector<std::uint32_t> extended;

  [[nodiscard]] bool empty() const { return standard.empty() && extended.empty(); }
  friend bool operator==(const ReceiveIds&, const ReceiveIds&) = default;
};
[[nodiscard]] ReceiveIds receive_ids(Port port, const CoreConfig& config);

/// Interfaces that are missing or down are no error: the daemon stays, waits and reports them.
[[nodiscard]] Result<Buses, OsError> open_buses(const BusNames& names, const CoreConfig& config);

}  // namespace bmu
