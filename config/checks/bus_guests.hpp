// Periodic messages on a bus besides the rows of the internal bus: the messages to the vehicle, chargers and their
// commands, the inverter and the battery's reports to it, sensors and insulation monitors with frames of their own, the
// second pack.
//
// Lengths are those of the rows with the most stuff bits possible (protocol/can_bits.hpp). Periods are those of the
// rows; for messages to a charger or an inverter those of its driver and of the pack file. Messages on request or on
// change come in addition. Pure; some dozen rows.
#pragma once

#include <cstdint>
#include <vector>

#include "config/types/pack.hpp"

namespace bmu {

struct GuestMessage {
  std::uint32_t id = 0;
  std::uint8_t length = 8;
  bool is_extended = false;
  Duration period{};
};

/// Messages on the bus that is served by `bus`; none if another serves it.
[[nodiscard]] std::vector<GuestMessage> guests_on(const CoreConfig& core, Port bus);

/// Maximum number of bits on the wire.
[[nodiscard]] std::int64_t bits_of(const GuestMessage& message);

/// Whether the message wins arbitration against a frame with the 11-bit identifier `of_id`.
[[nodiscard]] bool goes_ahead(const GuestMessage& message, std::uint32_t of_id);

}  // namespace bmu
