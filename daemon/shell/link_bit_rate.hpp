// The bit rate that a CAN interface is set to, from the kernel's own word (rtnetlink).
//
// One question for one interface, and one answer: RTM_NEWLINK, in it IFLA_LINKINFO, in that IFLA_INFO_KIND "can" and
// IFLA_INFO_DATA with IFLA_CAN_BITTIMING (linux/can/netlink.h). Interfaces of other kinds (vcan, vxcan) have no bit
// rate, and one that was not set up yet has 0. It is the rate of the nominal bits; that of CAN FD's data is another.
//
// It needs no privilege, but the address family AF_NETLINK. The kernel answers before send returns; what can be waited
// for is its lock on link settings, as with the bind of a CAN socket. Ask when a bus is opened, not in the loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace bmu {

/// Of the interface with this index; `out` is 0 where it has none. 0 or a negative errno value.
[[nodiscard]] int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s);

/// The same from the kernel's answer. -EBADMSG for what is none, or is damaged; the errno of a refusal.
[[nodiscard]] int bit_rate_in(std::span<const std::byte> answer, std::uint32_t& out_bit_per_s);

}  // namespace bmu
