// Inputs of the core. There are no others: the same observations give the same decisions on any host.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "daemon/core/types/line_image.hpp"
#include "protocol/frame.hpp"
#include "protocol/ir155.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Right under which a command is given: that of any operator of the control socket, or the right to unlock a pack that
/// must be inspected first.
enum class Authority : std::uint8_t { user, service };

[[nodiscard]] std::string_view to_text(Authority authority);

/// Buses of the daemon, by function. One interface may serve several of them; the shell then reports each frame once,
/// under the first of these (CoreConfig::served_by).
enum class Port : std::uint8_t { internal, vehicle, charger, second_pack, inverter };
inline constexpr std::size_t port_count = 5;
inline constexpr std::array all_ports{Port::internal, Port::vehicle, Port::charger, Port::second_pack, Port::inverter};
static_assert(all_ports.size() == port_count);

[[nodiscard]] std::string_view to_text(Port port);
[[nodiscard]] std::optional<Port> port_of_text(std::string_view text);

/// For each port, the port under which its frames are reported.
using ServedBy = std::array<Port, port_count>;

/// Groups the ports by the name of their interface. `names` has name(Port); a port with an empty name is not grouped.
template <class Names>
[[nodiscard]] ServedBy served_by(const Names& names) {
  ServedBy serving = all_ports;
  for (std::size_t port = 0; port < port_count; ++port) {
    for (std::size_t other = 0; other < port && serving[port] == all_ports[port]; ++other) {
      const bool is_same = names.name(all_ports[port]) == names.name(all_ports[other]);
      if (is_same && !names.name(all_ports[port]).empty()) serving[port] = all_ports[other];
    }
  }
  return serving;
}

/// A frame from another node.
struct FrameReceived {
  Port port = Port::internal;
  CanFrame frame;
};
/// Echo of a frame of this node: it was transmitted on the bus.
struct FrameEchoed {
  Port port = Port::internal;
  CanFrame frame;
};
/// A frame of this node that the kernel did not accept. The core never repeats it; the next frame has current data.
struct SendFailed {
  Port port = Port::internal;
  CanFrame frame;
};
struct PortChanged {
  Port port = Port::internal;
  bool is_up = false;
};
/// The receive queue overflowed: frames of this port may be missing since the previous observation of this kind.
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
  clear_faults,   // latched faults with a healed cause, if this authority may clear them
  wake,           // modules that sleep after an undervoltage
  balancing_off,  // no cell is bled until balancing_on, or a restart
  balancing_on,
  shut_down,       // open permanently: the session ends
  accept_modules,  // registers the modules found on their nodes; requires authority
  assign_node,     // assigns a node number to a module; requires authority
};
struct CommandGiven {
  Command command = Command::clear_faults;
  Authority authority = Authority::user;
  std::uint32_t user_id = 0;        // user id of the client, for the records
  std::uint8_t node = 0;            // accept_modules: this node, 0: all; assign_node: the new number
  std::uint32_t serial_number = 0;  // assign_node: of the module
  bool is_unheard_allowed = false;  // assign_node: see AssignmentRequest
};

/// First observation of a session: time for which the core listens for another master before it sends
/// (master_claim.hpp). Without it, as in recordings made before the claim existed, the core sends immediately.
struct ClaimBegins {
  Duration length{};
  bool is_kept = false;  // held by the previous session, and silent for less than claim_kept_max since
};

/// The wall clock, reported at start and about once per second: for records, never for decisions.
struct WallClockSeen {
  std::int64_t unix_time_ms = 0;
};

/// Health of the daemon's state file, memory and disk. Reported when it changes.
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

/// The GPIO lines of this host: after every edge, and once per tick.
struct LinesSeen {
  LineImage image;
};

/// Pulses of the insulation monitor on a GPIO line of this host: after every read with an edge, and once when the line
/// has been acquired. Between two observations the values age.
struct PulsesSeen {
  ir155::Pwm pwm;  // `since_edge` in whole microseconds
};

/// The temperature of the intake air, from a sensor of this host: after each successful reading. Between two readings
/// the value ages.
struct IntakeAirSeen {
  std::int32_t temperature_dC = 0;
};

using ObservedThing =
    std::variant<FrameReceived, FrameEchoed, SendFailed, PortChanged, FramesLost, BusErrorSeen, CommandGiven,
                 WallClockSeen, HealthSeen, LinesSeen, PulsesSeen, ClaimBegins, IntakeAirSeen>;

struct Observation {
  TimePoint at;
  ObservedThing what;
};

/// Whether the shell calls decide() immediately instead of at the next tick.
enum class Urgency : std::uint8_t {
  can_wait,
  decide_now,  // permission may have to be withdrawn, or a poll cycle is complete
};

}  // namespace bmu
