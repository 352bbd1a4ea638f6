// The buses of the daemon: the ports behind the core's names, and which identifiers they let in.
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

  /// Something is expected there.
  [[nodiscard]] bool is_there(Port port) const {
    return ports.at(static_cast<std::size_t>(served_by.at(static_cast<std::size_t>(port)))) != nullptr;
  }
  /// And it is asked itself, not through another.
  [[nodiscard]] bool is_own(Port port) const {
    return is_there(port) && served_by.at(static_cast<std::size_t>(port)) == port;
  }
  /// Its interface serves another, too. Of a port that is there.
  [[nodiscard]] bool is_shared(Port port) const;
  [[nodiscard]] BusPort& serving(Port port) const {
    return *ports.at(static_cast<std::size_t>(served_by.at(static_cast<std::size_t>(port))));
  }
  [[nodiscard]] BusPort& internal() const { return serving(Port::internal); }
};

/// Every identifier of the internal bus: also those of modules this pack does not have, so that a stray one is counted,
/// and those that only a master sends, so that a second master is noticed. Of modules of another maker theirs in place
/// of ours. Nothing else leaves the kernel.
[[nodiscard]] std::vector<std::uint32_t> internal_receive_ids(const CoreConfig& config);
/// What the pack reports to the vehicle: to hear our own, and anybody who does the same; who asks for data, and who
/// answers; and what of the internal bus shows that the two are swapped (core/swapped_buses.hpp).
[[nodiscard]] std::vector<std::uint32_t> vehicle_receive_ids(const CoreConfig& config);
/// The messages of a pack beside this one, if there is one.
[[nodiscard]] std::vector<std::uint32_t> second_pack_receive_ids(const CoreConfig& config);
/// What chargers tell, and what they are told, of 11 or of 29 bits; nothing where none is told anything.
[[nodiscard]] std::vector<std::uint32_t> charger_receive_ids(const CoreConfig& config, bool is_extended);
/// What an inverter tells, and what it is told; nothing where none is told anything.
[[nodiscard]] std::vector<std::uint32_t> inverter_receive_ids(const CoreConfig& config);
/// What sensors of other makers tell there, and are told: all have 11 bits.
[[nodiscard]] std::vector<std::uint32_t> sensor_receive_ids(Port port, const CoreConfig& config);
/// Of any of them.
struct ReceiveIds {
  std::vector<std::uint32_t> standard;
  std::vector<std::uint32_t> extended;

  [[nodiscard]] bool empty() const { return standard.empty() && extended.empty(); }
  friend bool operator==(const ReceiveIds&, const ReceiveIds&) = default;
};
[[nodiscard]] ReceiveIds receive_ids(Port port, const CoreConfig& config);

/// Interfaces that are missing or down are no error: the daemon stays, waits and says so.
[[nodiscard]] Result<Buses, OsError> open_buses(const BusNames& names, const CoreConfig& config);

}  // namespace bmu
