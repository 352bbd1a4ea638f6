#include "daemon/shell/serial/serial_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>

#include "config/types/serial_config.hpp"

namespace bmu {

namespace {

/// In the order of the rates.
constexpr std::array<speed_t, serial_rates_Bd.size()> speeds{B1200,  B2400,  B4800,  B9600,
                                                             B19200, B38400, B57600, B115200};

}  // namespace

Result<OwnedFd, OsError> open_serial_port(const std::string& device, std::int32_t bit_rate_Bd) {
  const auto refused = [&](const char* step) {
    return failure(OsError{.code = errno, .what = std::string(step) + " " + device});
  };
  const auto* const rate = std::find(serial_rates_Bd.begin(), serial_rates_Bd.end(), bit_rate_Bd);
  if (rate == serial_rates_Bd.end()) {
    return failure(OsError{.code = EINVAL, .what = std::to_string(bit_rate_Bd) + " Bd on " + device});
  }
  OwnedFd port(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port.is_open()) return refused("open");
  termios settings{};
  if (::tcgetattr(port.get(), &settings) != 0) return refused("take as a terminal");
  if (::ioctl(port.get(), TIOCEXCL) != 0) return refused("take for us alone");
  ::cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cflag |= CLOCAL | CREAD;
  const speed_t speed = speeds.at(static_cast<std::size_t>(rate - serial_rates_Bd.begin()));
  if (::cfsetspeed(&settings, speed) != 0 || ::tcsetattr(port.get(), TCSANOW, &settings) != 0) return refused("set up");
  return port;
}

void close_serial_port(OwnedFd port) {
  static_cast<void>(::ioctl(port.get(), TIOCNXCL));  // no effect if the device is gone
}

}  // namespace bmu
