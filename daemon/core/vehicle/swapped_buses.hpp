// Frames of the internal bus that arrive on the vehicle bus: evidence that buses/internal and buses/vehicle are swapped
// in the pack file. As few identifiers as that takes, since each of them wakes the daemon:
//
//   PDU_STATUS           every 50 ms
//   IDENT                of each module of the pack, once after each start of it, with counter 0; all its other frames
//                        answer a POLL, which is sent on the other bus then. Not where an inverter is on the vehicle
//                        bus: its keep-alive has the identifier of node 5.
//   SENSOR_CURRENT, _U1, of a pack without a power distribution unit, where no other frame is sent unrequested. These
//   _U2                  have no checksum, and the vehicle may have such a sensor of its own: without a PDU they count
//                        only while the internal bus is silent.
//
// Such a frame is evidence for the texts of faults, and never a measurement. An identifier with another use on the
// vehicle bus of this pack is no evidence; a test compares those of all devices.
#pragma once

#include <cstdint>

#include "daemon/core/types/core_config.hpp"
#include "protocol/message.hpp"

namespace bmu {

/// The row of a standard identifier that is such evidence in this pack; null: none.
[[nodiscard]] const MessageSpec* misplaced_row(const CoreConfig& config, std::uint32_t id);

/// A valid frame of such a row: form, length, and checksum or channel; of IDENT an unrequested one.
[[nodiscard]] bool is_misplaced(const CoreConfig& config, const CanFrame& frame);

}  // namespace bmu
