// One CAN bus as a program sees it, whatever carries it.
//
//   "can0", "vcan0"   SocketCAN (can_socket.*)
//   "unix:NAME"       the embedded bus between processes of this machine (embedded_bus.*)
//
// A port never blocks. It has one descriptor, the same for its whole life, that is readable (level) while there is
// something to read; behind it a SocketCAN port may replace its sockets when an interface goes and comes back. Read
// until `empty` or until your own bound is reached, so that a flood cannot starve timers.
//
// Nothing here knows what a frame means, and a frame that was sent is not a frame that arrived: the proof of
// transmission is the echo (`is_own`), where the options ask for it.
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

/// CLOCK_BOOTTIME in whole microseconds, the only clock that ages are measured with. It goes on while the machine
/// sleeps: what was known before is as old afterwards as it really is, and the loop has been away for that long.
[[nodiscard]] TimePoint monotonic_now();

struct PortOptions {
  /// Exact 11-bit identifiers to receive; none of either length receives everything, extended and remote frames
  /// included.
  std::vector<std::uint32_t> receive_ids;
  std::vector<std::uint32_t> receive_extended_ids{};  // and of 29 bits, where not everything is received
  bool receive_own = false;     // deliver our own frames too, marked is_own, once they are on the bus
  bool receive_errors = false;  // deliver the controller's error frames (is_error); they have a socket of their own
  /// What a missing interface means: an error from open_bus (a tool's user mistyped), or a port that waits for it
  /// in state `absent` (the daemon: interfaces come and go, the daemon stays and reports).
  bool must_exist = true;
};

struct ReceivedFrame {
  CanFrame frame;
  TimePoint received_at;  // monotonic, taken in user space: kernel stamps follow the wall clock, which may jump
  bool is_own = false;    // sent through this very port; anybody else's frame, same machine or not, is not own
};

enum class ReadStatus : std::uint8_t {
  frame,  // `out` holds one
  empty,  // nothing now
  down,   // the interface went down or away since the last read; told once, `state()` says which
};

enum class BusState : std::uint8_t {
  up,
  down,    // exists, not up; the same socket works again once it is up
  absent,  // no such interface now; maintain() looks for it by name
};

[[nodiscard]] std::string_view to_text(BusState state);

enum class SendError : std::uint8_t {
  queue_full,  // ENOBUFS, EAGAIN: the frame is dropped; send fresh data next time, never a stale queue
  down,        // interface down or gone
  refused,     // anything else the system said; counted, and in last_error()
};

[[nodiscard]] std::string_view to_text(SendError error);

class BusPort {
 public:
  BusPort() = default;
  BusPort(const BusPort&) = delete;
  BusPort& operator=(const BusPort&) = delete;
  virtual ~BusPort() = default;

  /// Watch for EPOLLIN. Stable for the life of the port.
  [[nodiscard]] virtual int fd() const = 0;
  /// The next frame in the order of the bus.
  [[nodiscard]] virtual ReadStatus read(ReceivedFrame& out) = 0;
  [[nodiscard]] virtual Result<void, SendError> send(const CanFrame& frame) = 0;
  /// Call every 100 ms or so: notices an interface that came back and opens a new socket for it.
  virtual void maintain() = 0;

  [[nodiscard]] virtual BusState state() const = 0;
  /// Frames this port missed because it was read too slowly, since it was opened. Any increase makes what was
  /// received in the meantime suspect.
  [[nodiscard]] virtual std::uint64_t frames_lost() const = 0;
  /// What the interface was set to when it was last seen to come up; 0 if it has no bit rate (vcan, unix:NAME), if the
  /// system does not say (last_error() then has why), or if the interface is absent.
  [[nodiscard]] virtual std::uint32_t rate_bit_per_s() const { return 0; }
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual std::string last_error() const = 0;
};

/// "unix:NAME": no interface of the kernel's.
[[nodiscard]] bool is_embedded_bus(std::string_view name);

/// Opens `name` in either form. Errors say what is wrong with the name or what the system refused; on a kernel
/// without CAN the message points to `unix:NAME`.
[[nodiscard]] Result<std::unique_ptr<BusPort>, OsError> open_bus(std::string_view name, const PortOptions& options);

}  // namespace bmu
