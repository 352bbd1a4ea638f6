// Access of a program to one CAN bus, whatever carries it.
//
//   "can0", "vcan0"   SocketCAN (can_socket.*)
//   "unix:NAME"       the embedded bus between processes of this machine (embedded_bus.*)
//
// A port never blocks. It has one descriptor, the same for its lifetime, that is readable (level) while there is
// something to read; behind it a SocketCAN port may replace its sockets when an interface disappears and returns. Read
// until `empty`, or until a bound of the caller, so that a flood cannot starve timers.
//
// A port does not interpret frames, and a frame that was sent is not a frame that arrived: the proof of transmission is
// the echo (`is_own`), if the options request it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/shell/system/os_error.hpp"
#include "protocol/frame.hpp"
#include "protocol/result.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// CLOCK_BOOTTIME in whole microseconds, the only clock that ages are measured with. It continues while the machine
/// sleeps: data from before has its real age afterwards, and the loop has stalled for that long.
[[nodiscard]] TimePoint monotonic_now();

struct PortOptions {
  /// Exact 11-bit identifiers to receive; none of either length receives everything, extended and remote frames
  /// included.
  std::vector<std::uint32_t> receive_ids;
  std::vector<std::uint32_t> receive_extended_ids{};  // and of 29 bits, if not everything is received
  bool receive_own = false;     // deliver frames of this port too, marked is_own, once they are on the bus
  bool receive_errors = false;  // deliver the controller's error frames (is_error); they have a socket of their own
  /// Reaction to a missing interface: an error of open_bus (the user of a tool mistyped), or a port that waits for it
  /// in state `absent` (the daemon: interfaces come and go, the daemon stays and reports).
  bool must_exist = true;
};

struct ReceivedFrame {
  CanFrame frame;
  TimePoint received_at;  // monotonic, taken in user space: kernel stamps follow the wall clock, which may jump
  bool is_own = false;    // sent through this very port; a frame of any other sender, same machine or not, is not own
};

enum class ReadStatus : std::uint8_t {
  frame,  // `out` holds a frame
  empty,  // no frame at present
  down,   // the interface went down or away since the last read; returned once, `state()` shows which
};

enum class BusState : std::uint8_t {
  up,
  down,    // exists, not up; the same socket works again once it is up
  absent,  // no such interface at present; maintain() searches for it by name
};

[[nodiscard]] std::string_view to_text(BusState state);

enum class SendError : std::uint8_t {
  queue_full,  // ENOBUFS, EAGAIN: the frame is dropped; send fresh data next time, never a stale queue
  down,        // interface down or gone
  refused,     // any other error of the system; counted, and in last_error()
};

[[nodiscard]] std::string_view to_text(SendError error);

class BusPort {
 public:
  BusPort() = default;
  BusPort(const BusPort&) = delete;
  BusPort& operator=(const BusPort&) = delete;
  virtual ~BusPort() = default;

  /// Watch for EPOLLIN. Stable for the lifetime of the port.
  [[nodiscard]] virtual int fd() const = 0;
  /// The next frame in the order of the bus.
  [[nodiscard]] virtual ReadStatus read(ReceivedFrame& out) = 0;
  [[nodiscard]] virtual Result<void, SendError> send(const CanFrame& frame) = 0;
  /// To be called about every 100 ms: detects an interface that has returned and opens a new socket for it.
  virtual void maintain() = 0;

  [[nodiscard]] virtual BusState state() const = 0;
  /// Frames that this port missed because it was read too slowly, since it was opened. After an increase the data
  /// received in the meantime is doubtful.
  [[nodiscard]] virtual std::uint64_t frames_lost() const = 0;
  /// Bit rate of the interface when it was last seen to come up; 0 if it has no bit rate (vcan, unix:NAME), if the
  /// system does not report it (last_error() then has the reason), or if the interface is absent.
  [[nodiscard]] virtual std::uint32_t rate_bit_per_s() const { return 0; }
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual std::string last_error() const = 0;
};

/// "unix:NAME": not an interface of the kernel.
[[nodiscard]] bool is_embedded_bus(std::string_view name);

/// Opens `name` in either form. Errors name the mistake in the name or the refusal of the system; on a kernel without
/// CAN the message points to `unix:NAME`.
[[nodiscard]] Result<std::unique_ptr<BusPort>, OsError> open_bus(std::string_view name, const PortOptions& options);

}  // namespace bmu
