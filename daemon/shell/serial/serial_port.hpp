// A terminal device of any kind (RS-232, USB, one end of a pseudo-terminal) as a plain pipe of bytes.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Raw: 8 data bits, no parity, 1 stop bit, no echo, no flow control, modem lines ignored. Not blocking, not this
/// process's controlling terminal, and nobody else's while we have it (but for root's). The error names device and
/// step.
[[nodiscard]] Result<OwnedFd, OsError> open_serial_port(const std::string& device, std::int32_t bit_rate_Bd);

/// Others may have it again: a pseudo-terminal would remember that it is ours beyond our closing it.
void close_serial_port(OwnedFd port);

}  // namespace bmu
