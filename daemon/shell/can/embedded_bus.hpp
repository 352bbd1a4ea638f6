// The embedded bus, `unix:NAME`: a frame sent by one process of this machine is received by all others, where CAN is
// not available.
//
// There is no server. The frames travel through a file in shared memory (embedded_ring.hpp), and each participant has a
// datagram socket with a name that contains which of the 32 numbers it owns: binding it is exclusive, and the kernel
// releases it however the owner dies. The socket carries no frames, only the byte that wakes its owner.
//
// It has no bit rate, never loses arbitration and is never down; the only error it can report is an overrun of a slow
// reader. frames_lost() then counts every position of the bus that was skipped, with frames of any sender: it is
// unknown whether they would have passed the filter.
//
// See docs/decisions/0001-embedded-bus.md for the reasons of this design, and its residual risks.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "daemon/shell/can/bus_port.hpp"

namespace bmu {

/// `bus` is the part after the colon: 1 to 32 letters, digits, `_`, `.` or `-`.
[[nodiscard]] Result<std::unique_ptr<BusPort>, OsError> open_embedded_bus(std::string_view bus,
                                                                          const PortOptions& options);

/// The file of a bus. It outlives its participants; removing it while there are any splits the bus in two.
[[nodiscard]] std::string embedded_bus_path(std::string_view bus);

}  // namespace bmu
