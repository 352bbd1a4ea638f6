// Details of a CAN interface, read by rtnetlink: its bit rate, the state and the counters of its controller.
//
// One request for one interface, and one answer: RTM_NEWLINK, in it IFLA_LINKINFO, in that IFLA_INFO_KIND "can",
// IFLA_INFO_DATA with its settings and its state (linux/can/netlink.h), and IFLA_INFO_XSTATS with its counters.
// Interfaces of other kinds (vcan, vxcan) have none of it, and one that was not set up yet has a bit rate of 0, which
// is that of the nominal bits; CAN FD's data have another.
//
// libmnl builds the request, carries it and parses the answer. The meaning of the attributes of a CAN link, and
// look_again(), are implemented here. Not by libsocketcan, which sets interfaces up (link_system.cpp): its can_get_*()
// look the name up by if_nametoindex(), for which the kernel may run modprobe (below); they wait for the answer without
// a limit, print failures on stderr, and read one value per request, so that state, counters and bit rate would be of
// different times.
//
// It needs no privilege, but the address family AF_NETLINK. The kernel answers before send returns, and the socket
// never waits for it; a wait is possible for the kernel's lock on link settings, as with the bind of a CAN socket, and
// for a controller behind SPI, which is queried for its counters with that lock held. Read the bit rate when a bus is
// opened, and all details on another thread (`bmud-links`). A request takes a socket and some bytes of heap: -EMFILE
// and -ENOMEM are results like any other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace bmu {

enum class ControllerState : std::uint8_t {
  unknown,  // no controller, or a driver that does not report it
  error_active,
  error_warning,  // 96 errors counted
  error_passive,  // 128: it may no longer send active error flags
  bus_off,        // 256: it takes no part in the bus
  stopped,        // the interface is down
  sleeping,
};

[[nodiscard]] std::string_view to_text(ControllerState state);

/// Recent errors counted by a controller: both counters fall again with successful frames.
struct ErrorCounters {
  std::uint16_t sending = 0;    // TEC
  std::uint16_t receiving = 0;  // REC

  friend bool operator==(const ErrorCounters&, const ErrorCounters&) = default;
};

/// Counts since the interface was created.
struct ControllerHistory {
  std::uint32_t bus_errors = 0;
  std::uint32_t times_passive = 0;
  std::uint32_t times_bus_off = 0;
  std::uint32_t restarts = 0;

  friend bool operator==(const ControllerHistory&, const ControllerHistory&) = default;
};

struct LinkDetails {
  bool is_can = false;  // of the kind "can"; with any other kind the other members are meaningless
  bool is_up = false;   // administratively up, whether its controller takes part or not
  std::uint32_t bit_rate_bit_per_s = 0;
  std::uint32_t restart_ms = 0;  // after bus-off; 0: it stays off
  ControllerState state = ControllerState::unknown;
  std::optional<ErrorCounters> errors{};       // not every driver reports them
  std::optional<ControllerHistory> history{};  // nor these

  friend bool operator==(const LinkDetails&, const LinkDetails&) = default;
};

struct FoundLink {
  int index = 0;
  bool is_running = false;  // up, and with a carrier: a controller in bus-off has none
};

/// The interface of this name. 0 or a negative errno value, -ENODEV if there is none; then `out` is empty.
///
/// An ioctl for it (SIOCGIFINDEX, if_nametoindex()) is not for a control loop: for an interface that does not exist the
/// kernel first runs modprobe, and a process that may administer the network waits for it, a fifth of a second on a
/// slow machine.
[[nodiscard]] int find_link(std::string_view name, FoundLink& out);
/// The same for one that was found before, by ioctls that do without the kernel's lock on link settings. find_link()
/// waits for the holder of that lock, be it for another interface: the driver of serial adapters holds it for a second
/// when one is pulled out (Linux 6.1), and rtnetlink, by libmnl too, has no other way. -ENODEV if no interface has that
/// index any more, or one of another name.
[[nodiscard]] int look_again(std::string_view name, int index, FoundLink& out);
/// The same from the kernel's answer. -EBADMSG if it is not such an answer; the errno of a refusal. Answers have the
/// alignment of an nlmsghdr, here and below.
[[nodiscard]] int found_link_in(std::span<const std::byte> answer, FoundLink& out);
/// Details of the interface with this index. 0 or a negative errno value; then `out` is empty.
[[nodiscard]] int ask_link_details(int interface_index, LinkDetails& out);
/// The same from the kernel's answer. -EBADMSG if it is not such an answer, or damaged; the errno of a refusal.
[[nodiscard]] int link_details_in(std::span<const std::byte> answer, LinkDetails& out);

// The bit rate alone; 0 if there is none.
[[nodiscard]] int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s);
[[nodiscard]] int bit_rate_in(std::span<const std::byte> answer, std::uint32_t& out_bit_per_s);

}  // namespace bmu
