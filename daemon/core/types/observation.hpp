// What the core is told. Nothing else ever reaches it: the same observations give the same decisions, on any machine.
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

/// Who gives a command: anybody who can reach the control socket, or somebody who may unlock a pack that had to be
/// looked at first.
enum class Authority : std::uint8_t { user, service };

[[nodiscard]] std::string_view to_text(Authority authority);

/// The buses of the daemon, by what they are for. One interface may serve several of them; the shell then tells each
/// frame once, to the first of these (CoreConfig::served_by).
enum class Port : std::uint8_t { internal, vehicle, charger, second_pack, inverter };
inline constexpr std::size_t port_count = 5;
inline constexpr std::array all_ports{Port::internal, Port::vehicle, Port::charger, Port::second_pack, Port::inverter};
static_assert(all_ports.size() == port_count);

[[nodiscard]] std::string_view to_text(Port port);
[[nodiscard]] std::optional<Port> port_of_text(std::string_view text);

/// The port that tells the frames of each.
using ServedBy = std::array<Port, port_count>;

/// Of buses by their names: those of one name are one. `names` has name(Port); an empty one is nobody's.
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

/// First observation of a session: how long the core listens for another master before it sends (master_claim.hpp).
/// Without it, as in recordings from before there was a claim, the core sends at once.
struct ClaimBegins {
  Duration length{};
  bool is_kept = false;  // held by the previous session, and silent for less than claim_kept_max since
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

/// The insulation monitor's pulses on a line of this machine: after every look that saw an edge, and once when the line
/// has become ours. Between two of them they grow old.
struct PulsesSeen {
  ir155::Pwm pwm;  // `since_edge` in whole microseconds
};

/// The temperature of the intake air, as a sensor of this machine reports it: after each reading that succeeded.
/// Between two of them it ages.
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

/// Whether the shell should call decide() at once instead of waiting for the next tick.
enum class Urgency : std::uint8_t {
  can_wait,
  decide_now,  // permission may have to be withdrawn, or a poll cycle is complete
};

}  // namespace bmu
