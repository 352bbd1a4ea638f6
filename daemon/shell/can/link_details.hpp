// What the kernel says of a CAN interface by rtnetlink: its bit rate, its controller's state and counters.
//
// One question for one interface, and one answer: RTM_NEWLINK, in it IFLA_LINKINFO, in that IFLA_INFO_KIND "can",
// IFLA_INFO_DATA with what it is set to and how it is (linux/can/netlink.h), and IFLA_INFO_XSTATS with what it has
// counted. Interfaces of other kinds (vcan, vxcan) have none of it, and one that was not set up yet has a bit rate of
// 0, which is that of the nominal bits; CAN FD's data have another.
//
// libmnl builds the request, carries it and takes the answer apart. By hand there is what an attribute of a CAN link
// means, and look_again(). Not by libsocketcan, which sets links up (link_system.cpp): its can_get_*() look the name up
// by if_nametoindex(), for which the kernel may run modprobe (below); they wait for the answer without a limit, print
// what fails on stderr, and read one value a request, so that state, counters and bit rate would be of different times.
//
// It needs no privilege, but the address family AF_NETLINK. The kernel answers before send returns, and the socket
// never waits for it; what can be waited for is its lock on link settings, as with the bind of a CAN socket, and a
// controller behind SPI, which is asked for its counters with that lock held. Ask for a bit rate when a bus is opened,
// and for all of it on another thread (`bmud-links`). A request takes a socket and some bytes of heap: -EMFILE and
// -ENOMEM are results like any other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace bmu {

enum class ControllerState : std::uint8_t {
  unknown,  // no controller, or a driver that does not say
  error_active,
  error_warning,  // 96 errors counted
  error_passive,  // 128: it may no longer speak up
  bus_off,        // 256: it takes no part
  stopped,        // the interface is down
  sleeping,
};

[[nodiscard]] std::string_view to_text(ControllerState state);

/// The errors a controller has counted of late: both go down again with what succeeds.
struct ErrorCounters {
  std::uint16_t sending = 0;    // TEC
  std::uint16_t receiving = 0;  // REC

  friend bool operator==(const ErrorCounters&, const ErrorCounters&) = default;
};

/// What has happened since the interface was made.
struct ControllerHistory {
  std::uint32_t bus_errors = 0;
  std::uint32_t times_passive = 0;
  std::uint32_t times_bus_off = 0;
  std::uint32_t restarts = 0;

  friend bool operator==(const ControllerHistory&, const ControllerHistory&) = default;
};

struct LinkDetails {
  bool is_can = false;  // of the kind "can"; with any other the rest says nothing
  bool is_up = false;   // as somebody wants it, whether its controller takes part or not
  std::uint32_t bit_rate_bit_per_s = 0;
  std::uint32_t restart_ms = 0;  // after bus-off; 0: it stays off
  ControllerState state = ControllerState::unknown;
  std::optional<ErrorCounters> errors{};       // not every driver tells
  std::optional<ControllerHistory> history{};  // the same

  friend bool operator==(const LinkDetails&, const LinkDetails&) = default;
};

struct FoundLink {
  int index = 0;
  bool is_running = false;  // up, and with a carrier: a controller in bus-off has none
};

/// The interface of this name. 0 or a negative errno value, -ENODEV for one that is not there; then `out` is empty.
///
/// An ioctl for it (SIOCGIFINDEX, if_nametoindex()) is none for a control loop: for an interface that is not there the
/// kernel first runs modprobe, and whoever may administer the network waits for it, a fifth of a second on a slow
/// machine.
[[nodiscard]] int find_link(std::string_view name, FoundLink& out);
/// The same for one that was found before, by ioctls that do without the kernel's lock on link settings. find_link()
/// waits for whoever holds that, be it for another interface: the driver of serial adapters holds it for a second when
/// one is pulled out (Linux 6.1), and rtnetlink, by libmnl too, knows no other way. -ENODEV if nothing has that index
/// any more, or something of another name.
[[nodiscard]] int look_again(std::string_view name, int index, FoundLink& out);
/// The same from the kernel's answer. -EBADMSG for what is none; the errno of a refusal. Answers begin where an
/// nlmsghdr may, here and below.
[[nodiscard]] int found_link_in(std::span<const std::byte> answer, FoundLink& out);
/// Of the interface with this index. 0 or a negative errno value; then `out` is empty.
[[nodiscard]] int ask_link_details(int interface_index, LinkDetails& out);
/// The same from the kernel's answer. -EBADMSG for what is none, or is damaged; the errno of a refusal.
[[nodiscard]] int link_details_in(std::span<const std::byte> answer, LinkDetails& out);

// The bit rate alone; 0 where it has none.
[[nodiscard]] int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s);
[[nodiscard]] int bit_rate_in(std::span<const std::byte> answer, std::uint32_t& out_bit_per_s);

}  // namespace bmu
