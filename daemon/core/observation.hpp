// What the core is told. Nothing else ever reaches it: the same observations give the same decisions, on any machine.
#pragma once

#include <cstdint>
#include <string_view>
#include <variant>

#include "daemon/core/line_image.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Who gives a command: anybody who can reach the control socket, or somebody who may unlock a pack that had to be
/// looked at first.
enum class Authority : std::uint8_t { user, service };

[[nodiscard]] std::string_view to_text(Authority authority);

/// The buses of the daemon. One interface may serve both; the shell then tells each frame once, to `internal`.
enum class Port : std::uint8_t { internal, vehicle };
inline constexpr std::size_t port_count = 2;

[[nodiscard]] std::string_view to_text(Port port);

/// A frame from somebody else.
struct FrameReceived {
  Port port = Port::internal;
  CanFrame frame;
};
/// A frame of our own, seen back: it really was on the bus.
struct FrameEchoed {
  Port port = Port::internal;
  CanFrame frame;
};
/// A frame of ours that the system did not take. The core sends fresh data next time, never this again.
struct SendFailed {
  Port port = Port::internal;
  CanFrame frame;
};
struct PortChanged {
  Port port = Port::internal;
  bool is_up = false;
};
/// The receive queue overflowed: what this port told since the last such observation may have holes.
struct FramesLost {
  Port port = Port::internal;
  std::uint64_t count = 0;
};
/// An error frame of the controller; `classes` are the kernel's CAN_ERR_* bits, `controller` its byte 1.
struct BusErrorSeen {
  Port port = Port::internal;
  std::uint32_t classes = 0;
  std::uint8_t controller = 0;
};

enum class Command : std::uint8_t {
  clear_faults,   // latched faults whose cause is gone, and which this authority may clear
  wake,           // modules that rest after an undervoltage
  balancing_off,  // no cell is bled until balancing_on, or a new start
  balancing_on,
  shut_down,       // open, for good: this process is ending
  accept_modules,  // those found on their nodes belong there from now on; with authority
  assign_node,     // give a module another node number; with authority
};
struct CommandGiven {
  Command command = Command::clear_faults;
  Authority authority = Authority::user;
  std::uint32_t user_id = 0;        // who gave it, for the record
  std::uint8_t node = 0;            // accept_modules: of this one, 0 of all; assign_node: the new number
  std::uint32_t serial_number = 0;  // assign_node: of the module that is meant
  bool is_unheard_allowed = false;  // assign_node: see AssignmentRequest
};

/// The wall clock, told at start and about once a second: for records, never for decisions.
struct WallClockSeen {
  std::int64_t unix_time_ms = 0;
};

/// How the daemon's own store, memory and disk are. Told when it changes.
struct OwnHealth {
  bool store_unreadable = false;
  bool store_write_failed = false;
  bool history_write_failed = false;
  bool memory_low = false;
  bool disk_low = false;

  friend constexpr bool operator==(const OwnHealth&, const OwnHealth&) = default;
};
struct HealthSeen {
  OwnHealth health;
};

/// The lines of this machine: after every edge, and once a tick.
struct LinesSeen {
  LineImage image;
};

using ObservedThing = std::variant<FrameReceived, FrameEchoed, SendFailed, PortChanged, FramesLost, BusErrorSeen,
                                   CommandGiven, WallClockSeen, HealthSeen, LinesSeen>;

struct Observation {
  TimePoint at;
  ObservedThing what;
};

/// Whether the shell should call decide() at once instead of waiting for the next tick.
enum class Urgency : std::uint8_t {
  can_wait,
  decide_now,  // permission may have to be withdrawn, or a poll cycle is complete
};

}  // namespace bmu
