// Who is on a bus besides the modules and what belongs to them, and how much each says by itself: the messages to the
// vehicle, chargers and what they are told, the inverter and what it is told, sensors and insulation monitors with
// frames of their own, the second pack.
//
// Lengths are those of the rows, at their longest (protocol/can_bits.hpp). Periods are those of the rows; of what is
// told to a charger or an inverter those of its driver and of the pack file. What comes on request or on change comes
// on top. Pure; some dozen rows.
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

/// On the bus that is served by `bus`; none if another serves it.
[[nodiscard]] std::vector<GuestMessage> guests_on(const CoreConfig& core, Port bus);

/// On the wire, at worst.
[[nodiscard]] std::int64_t bits_of(const GuestMessage& message);

/// Whether it goes ahead of a frame of 11 bits that is ready at the same time.
[[nodiscard]] bool goes_ahead(const GuestMessage& message, std::uint32_t of_id);

}  // namespace bmu
