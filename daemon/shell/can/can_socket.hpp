// A CAN bus behind a SocketCAN interface such as can0 or vcan0.
//
// What makes this more than a socket: an interface goes down and comes up (the same socket goes on working), or goes
// away and comes back (the socket is deaf for ever, and a new one must be found by name). The kernel tells either only
// once. maintain() therefore also looks at the interface itself, and whoever uses the port still judges a bus by the
// age of its data: a controller in bus-off takes frames without a word, and transmits none.
//
// A bit rate can only be changed while an interface is down, so it is asked for whenever one has come up.
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

/// The system calls of a SocketCAN port, so that tests can have interfaces that vanish and sockets that cannot be had
/// on kernels without any CAN. A negative result is an errno value. Descriptors must be real enough for epoll.
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
  /// 0, or -ENODEV if there is no interface of this name. With the index it had when last looked up, or 0, nobody
  /// else's interface is waited for as long as it still has it.
  [[nodiscard]] virtual int look_up(const std::string& name, int known_index, CanInterface& out) = 0;
  /// What the interface is set to, 0 if it has no bit rate.
  [[nodiscard]] virtual int bit_rate(int interface_index, std::uint32_t& out_bit_per_s) = 0;
};

/// The running kernel.
[[nodiscard]] CanSystem& kernel_can_system();

[[nodiscard]] Result<std::unique_ptr<BusPort>, OsError> open_can_socket(std::string_view interface_name,
                                                                        const PortOptions& options,
                                                                        CanSystem& system = kernel_can_system());

}  // namespace bmu
