// Frames of the internal bus that arrive on the vehicle bus: the sign of buses/internal and buses/vehicle swapped in
// the pack file. As few identifiers as that takes, since each of them wakes the daemon:
//
//   PDU_STATUS           every 50 ms
//   IDENT                of each module of the pack, once after each start of it, with counter 0; all else it sends
//                        answers a POLL, which goes to the other bus then. Not where an inverter is on the vehicle bus:
//                        its keep-alive has the identifier of node 5.
//   SENSOR_CURRENT, _U1, of a pack without a power distribution unit, where nothing else is sent unasked. They have no
//   _U2                  checksum, and the vehicle may have such a sensor of its own: without a unit the signs count
//   only
//                        while the internal bus is silent.
//
// Such a frame is a sign for the texts of faults, and never a measurement. An identifier that this pack has another
// use for on the vehicle bus is no sign; a test compares those of all devices.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "protocol/message.hpp"

namespace bmu {

/// The row of a standard identifier that is such a sign in this pack; null: it is none.
[[nodiscard]] const MessageSpec* misplaced_row(const CoreConfig& config, std::uint32_t id);

/// A whole frame of such a row: form, length, and checksum or channel; of IDENT one that nobody has asked for.
[[nodiscard]] bool is_misplaced(const CoreConfig& config, const CanFrame& frame);

}  // namespace bmu
