// A terminal device of any kind (RS-232, USB, one end of a pseudo-terminal) as a plain pipe of bytes.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Raw: 8 data bits, no parity, 1 stop bit, no echo, no flow control, modem lines ignored. Not blocking, not the
/// controlling terminal of this process, and closed to all other processes while it is open (except those of root). The
/// error names device and step.
[[nodiscard]] Result<OwnedFd, OsError> open_serial_port(const std::string& device, std::int32_t bit_rate_Bd);

/// Ends the exclusive use: a pseudo-terminal would keep it after it is closed.
void close_serial_port(OwnedFd port);

}  // namespace bmu
