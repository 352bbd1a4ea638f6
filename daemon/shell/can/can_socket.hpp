// A CAN bus behind a SocketCAN interface such as can0 or vcan0.
//
// Beyond a plain socket it handles an interface that goes down and comes up (the same socket continues to work), or
// disappears and returns (the socket never receives again, and the new interface must be found by name). The kernel
// reports either only once. maintain() therefore also checks the interface itself, and the user of the port still
// judges a bus by the age of its data: a controller in bus-off accepts frames without an error, and transmits none.
//
// A bit rate can only be changed while an interface is down, so it is read whenever one has come up.
//
// A state other than `up` refuses to send until maintain() has seen the interface running again. A port that is opened
// on a missing interface, or one that is down, starts in that state without `ReadStatus::down`: nothing was lost.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <linux/can.h>
#include <sys/socket.h>

#include "daemon/shell/can/bus_port.hpp"

namespace bmu {

struct CanInterface {
  int index = 0;
  bool is_running = false;  // up, and with a carrier: a controller in bus-off has none
};

/// The system calls of a SocketCAN port; tests replace them, to have interfaces that vanish and sockets that cannot be
/// created on kernels without any CAN. A negative result is an errno value. Descriptors must be real enough for epoll.
class CanSystem {
 public:
  virtual ~CanSystem() = default;

  /// A non-blocking CAN_RAW socket.
  [[nodiscard]] virtual int open_socket() = 0;
  virtual void close_socket(int fd) = 0;
  [[nodiscard]] virtual int set_option(int fd, int level, int option, const void* value, socklen_t length) = 0;
  [[nodiscard]] virtual int bind_to(int fd, int interface_index) = 0;
  /// Reads and so clears the socket's pending error (SO_ERROR): an errno value, positive here, or 0.
  [[nodiscard]] virtual int take_error(int fd) = 0;
  [[nodiscard]] virtual int receive(int fd, msghdr& message) = 0;
  [[nodiscard]] virtual int send(int fd, const can_frame& frame) = 0;
  /// 0, or -ENODEV if there is no interface of this name. `known_index`: its index when last found, or 0; while it
  /// still has that index the call waits for no other interface.
  [[nodiscard]] virtual int look_up(const std::string& name, int known_index, CanInterface& out) = 0;
  /// Configured bit rate of the interface, 0 if it has none.
  [[nodiscard]] virtual int bit_rate(int interface_index, std::uint32_t& out_bit_per_s) = 0;
};

/// The running kernel.
[[nodiscard]] CanSystem& kernel_can_system();

[[nodiscard]] Result<std::unique_ptr<BusPort>, OsError> open_can_socket(std::string_view interface_name,
                                                                        const PortOptions& options,
                                                                        CanSystem& system = kernel_can_system());

}  // namespace bmu
