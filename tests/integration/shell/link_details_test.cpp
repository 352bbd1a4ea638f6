// The kernel's answer about a CAN interface: attributes as rtnetlink nests them, complete, damaged, and of other kinds.
// The request itself is sent to the running kernel, which may have no CAN, but always has a loopback interface.
#include "daemon/shell/can/link_details.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <unistd.h>

#include "tests/support/catch.hpp"

namespace bmu {
namespace {

using Bytes = std::vector<std::byte>;

template <class Value>
Bytes bytes_of(const Value& value) {
  Bytes bytes(sizeof(value));
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}
Bytes text_bytes(const std::string& text) {
  Bytes bytes(text.size() + 1);
  std::memcpy(bytes.data(), text.c_str(), bytes.size());
  return bytes;
}
Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}
Bytes attribute(unsigned type, const Bytes& content) {
  const rtattr header{.rta_len = static_cast<unsigned short>(sizeof(rtattr) + content.size()),
                      .rta_type = static_cast<unsigned short>(type)};
  Bytes bytes = joined({bytes_of(header), content});
  bytes.resize(RTA_ALIGN(bytes.size()));
  return bytes;
}
Bytes message(unsigned type, const Bytes& content) {
  nlmsghdr header{};
  header.nlmsg_len = static_cast<unsigned>(sizeof(nlmsghdr) + content.size());
  header.nlmsg_type = static_cast<unsigned short>(type);
  return joined({bytes_of(header), content});
}
Bytes link_message(const Bytes& attributes) {
  return message(RTM_NEWLINK, joined({bytes_of(ifinfomsg{}), attributes}));
}
Bytes link_info(const std::string& kind, const Bytes& data) {
  return attribute(IFLA_LINKINFO,
                   joined({attribute(IFLA_INFO_KIND, text_bytes(kind)), attribute(IFLA_INFO_DATA, data)}));
}
Bytes timing(std::uint32_t bit_per_s) {
  can_bittiming bits{};
  bits.bitrate = bit_per_s;
  bits.sample_point = 875;
  return attribute(IFLA_CAN_BITTIMING, bytes_of(bits));
}
/// As Linux 6.1 answers: with other attributes before and between.
Bytes can_link(std::uint32_t bit_per_s) {
  const Bytes clock = attribute(IFLA_CAN_CLOCK, bytes_of(can_clock{.freq = 8'000'000}));
  const Bytes state = attribute(IFLA_CAN_STATE, bytes_of(std::uint32_t{CAN_STATE_ERROR_ACTIVE}));
  return link_message(joined({attribute(IFLA_IFNAME, text_bytes("can0")), attribute(IFLA_MTU, bytes_of(16U)),
                              link_info("can", joined({clock, timing(bit_per_s), state}))}));
}

struct Answer {
  int result = 0;
  std::uint32_t bit_per_s = 0;
};
bool operator==(const Answer& one, const Answer& other) {
  return one.result == other.result && one.bit_per_s == other.bit_per_s;
}
Answer read(const Bytes& bytes) {
  Answer answer{.bit_per_s = 77};
  answer.result = bit_rate_in(bytes, answer.bit_per_s);
  return answer;
}

}  // namespace

TEST_CASE("the bit rate of a CAN interface is in the bit timing of its link", "[integration][can_socket]") {
  for (const std::uint32_t bit_per_s : {0U, 83'333U, 500'000U, 1'000'000U}) {
    CHECK(read(can_link(bit_per_s)) == Answer{0, bit_per_s});
  }
  // Nested attributes may be flagged as such.
  const Bytes info =
      joined({attribute(IFLA_INFO_KIND, text_bytes("can")), attribute(IFLA_INFO_DATA | NLA_F_NESTED, timing(250'000))});
  CHECK(read(link_message(attribute(IFLA_LINKINFO | NLA_F_NESTED, info))) == Answer{0, 250'000});
}

TEST_CASE("links of other kinds have no bit rate, whatever their data look like", "[integration][can_socket]") {
  CHECK(read(link_message({})) == Answer{});
  CHECK(read(link_message(attribute(IFLA_LINKINFO, attribute(IFLA_INFO_KIND, text_bytes("vcan"))))) == Answer{});
  for (const char* kind : {"vcan", "vxcan", "canx", "ca", ""}) {
    INFO(kind);
    CHECK(read(link_message(link_info(kind, timing(500'000)))) == Answer{});
  }
  CHECK(read(link_message(link_info("can", {}))) == Answer{});
}

TEST_CASE("an answer that is cut anywhere is damaged or has no bit rate, and never a wrong one",
          "[integration][can_socket]") {
  const Bytes whole = can_link(500'000);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    INFO(length << " of " << whole.size());
    CHECK(read(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length))) == Answer{-EBADMSG, 0});
    // The same with a consistent header: then attributes are truncated.
    if (length < sizeof(nlmsghdr)) continue;
    const Bytes cut = message(
        RTM_NEWLINK, Bytes(whole.begin() + sizeof(nlmsghdr), whole.begin() + static_cast<std::ptrdiff_t>(length)));
    const Answer answer = read(cut);
    CHECK((answer == Answer{} || answer == Answer{-EBADMSG, 0}));
  }
  CHECK(read(link_message(link_info("can", attribute(IFLA_CAN_BITTIMING, Bytes(3))))) == Answer{-EBADMSG, 0});
}

TEST_CASE("attributes of impossible lengths end the search", "[integration][can_socket]") {
  for (const int length : {0, 1, 3, 5, 200, 65'535}) {
    INFO(length);
    const Bytes broken = bytes_of(rtattr{.rta_len = static_cast<unsigned short>(length), .rta_type = IFLA_MTU});
    CHECK(read(link_message(joined({broken, link_info("can", timing(500'000))}))) == Answer{});
  }
}

TEST_CASE("attributes of later kernels are passed over, and of two of one type the first counts",
          "[integration][can_socket]") {
  const Bytes later = joined({attribute(IFLA_MAX + 1, Bytes(4)), attribute(0x3FFF, Bytes(4))});
  const Bytes data = joined({attribute(IFLA_CAN_MAX + 1, Bytes(4)), later, timing(250'000), timing(500'000)});
  const Bytes info =
      attribute(IFLA_LINKINFO, joined({attribute(IFLA_INFO_MAX + 1, Bytes(4)), later,
                                       attribute(IFLA_INFO_KIND, text_bytes("can")), attribute(IFLA_INFO_DATA, data)}));
  CHECK(read(link_message(joined({later, info, link_info("can", timing(125'000))}))) == Answer{0, 250'000});
}

TEST_CASE("a refusal is the kernel's error, and another message none at all", "[integration][can_socket]") {
  nlmsgerr refusal{};
  refusal.error = -ENODEV;
  CHECK(read(message(NLMSG_ERROR, bytes_of(refusal))) == Answer{-ENODEV, 0});
  refusal.error = 0;  // an acknowledgement that was not requested
  CHECK(read(message(NLMSG_ERROR, bytes_of(refusal))) == Answer{-EBADMSG, 0});
  CHECK(read(message(NLMSG_ERROR, Bytes(2))) == Answer{-EBADMSG, 0});
  CHECK(read(message(NLMSG_DONE, Bytes(sizeof(ifinfomsg)))) == Answer{-EBADMSG, 0});
}

namespace {

Bytes with_state(std::uint32_t raw_state, const Bytes& more = {}) {
  return joined({timing(500'000), attribute(IFLA_CAN_STATE, bytes_of(raw_state)), more});
}
LinkDetails details_of(const Bytes& answer) {
  LinkDetails details;
  CHECK(link_details_in(answer, details) == 0);
  return details;
}

}  // namespace

TEST_CASE("a controller's state, errors, restart and counts are in its link", "[integration][can_socket]") {
  const Bytes data = with_state(CAN_STATE_ERROR_PASSIVE,
                                joined({attribute(IFLA_CAN_RESTART_MS, bytes_of(std::uint32_t{200})),
                                        attribute(IFLA_CAN_BERR_COUNTER, bytes_of(can_berr_counter{128, 7}))}));
  can_device_stats counts{};
  counts.bus_error = 11;
  counts.error_passive = 12;
  counts.bus_off = 13;
  counts.restarts = 14;
  const Bytes info =
      attribute(IFLA_LINKINFO, joined({attribute(IFLA_INFO_KIND, text_bytes("can")), attribute(IFLA_INFO_DATA, data),
                                       attribute(IFLA_INFO_XSTATS, bytes_of(counts))}));
  CHECK(details_of(link_message(info)) ==
        LinkDetails{
            .is_can = true,
            .bit_rate_bit_per_s = 500'000,
            .restart_ms = 200,
            .state = ControllerState::error_passive,
            .errors = ErrorCounters{.sending = 128, .receiving = 7},
            .history = ControllerHistory{.bus_errors = 11, .times_passive = 12, .times_bus_off = 13, .restarts = 14}});
  ifinfomsg up{};
  up.ifi_flags = IFF_UP;
  CHECK(details_of(message(RTM_NEWLINK, joined({bytes_of(up), info}))).is_up);
}

TEST_CASE("what a driver does not tell is not known, and no other kind of link has any of it",
          "[integration][can_socket]") {
  const LinkDetails plain = details_of(link_message(link_info("can", with_state(CAN_STATE_ERROR_ACTIVE))));
  CHECK(plain.state == ControllerState::error_active);
  CHECK_FALSE(plain.errors);
  CHECK_FALSE(plain.history);
  CHECK(details_of(link_message(link_info("can", timing(500'000)))).state == ControllerState::unknown);
  CHECK(details_of(link_message(link_info("can", with_state(99)))).state == ControllerState::unknown);
  CHECK(details_of(link_message(link_info("vcan", with_state(CAN_STATE_BUS_OFF)))) == LinkDetails{});
  const std::vector<std::pair<std::uint32_t, std::string>> states{{CAN_STATE_ERROR_ACTIVE, "error-active"},
                                                                  {CAN_STATE_ERROR_WARNING, "error-warning"},
                                                                  {CAN_STATE_ERROR_PASSIVE, "error-passive"},
                                                                  {CAN_STATE_BUS_OFF, "bus-off"},
                                                                  {CAN_STATE_STOPPED, "stopped"},
                                                                  {CAN_STATE_SLEEPING, "sleeping"}};
  for (const auto& [raw, text] : states) {
    CHECK(to_text(details_of(link_message(link_info("can", with_state(raw)))).state) == text);
  }
}

TEST_CASE("a state or counter that is cut is damage, and nothing is taken from it", "[integration][can_socket]") {
  for (const unsigned type : {IFLA_CAN_STATE, IFLA_CAN_RESTART_MS, IFLA_CAN_BERR_COUNTER}) {
    LinkDetails details{.is_can = true};
    CHECK(link_details_in(link_message(link_info("can", joined({timing(500'000), attribute(type, Bytes(1))}))),
                          details) == -EBADMSG);
    CHECK(details == LinkDetails{});
  }
}

TEST_CASE("the running kernel says that its loopback has no bit rate, and what it does not have",
          "[integration][can_socket]") {
  std::uint32_t bit_per_s = 77;
  const unsigned loopback = ::if_nametoindex("lo");
  REQUIRE(loopback > 0);
  CHECK(ask_bit_rate(static_cast<int>(loopback), bit_per_s) == 0);
  CHECK(bit_per_s == 0);
  CHECK(ask_bit_rate(0x7FFF'FFF0, bit_per_s) == -ENODEV);
}

TEST_CASE("the running kernel finds an interface by its name, and says which is not there",
          "[integration][can_socket]") {
  FoundLink found;
  REQUIRE(find_link("lo", found) == 0);
  CHECK(found.index == static_cast<int>(::if_nametoindex("lo")));
  for (const char* name : {"no-such-link", "", "lo2345678901234", "lo23456789012345", "a-name-that-is-too-long"}) {
    INFO(name);
    found = {.index = 1, .is_running = true};
    CHECK(find_link(name, found) == -ENODEV);
    CHECK(found.index == 0);
    CHECK_FALSE(found.is_running);
  }
}

TEST_CASE("requests to the kernel leave no file open, answered or refused", "[integration][can_socket]") {
  const auto next_file = [] {
    const int fd = ::dup(STDERR_FILENO);
    ::close(fd);
    return fd;
  };
  const int before = next_file();
  FoundLink found;
  LinkDetails details;
  CHECK(find_link("lo", found) == 0);
  CHECK(find_link("no-such-link", found) == -ENODEV);
  CHECK(ask_link_details(static_cast<int>(::if_nametoindex("lo")), details) == 0);
  CHECK(ask_link_details(0x7FFF'FFF0, details) == -ENODEV);
  CHECK(next_file() == before);
}

TEST_CASE("an interface that was found is looked at again by its index, as long as it has its name",
          "[integration][can_socket]") {
  FoundLink found;
  REQUIRE(find_link("lo", found) == 0);
  FoundLink again;
  REQUIRE(look_again("lo", found.index, again) == 0);
  CHECK(again.index == found.index);
  CHECK(again.is_running == found.is_running);
  CHECK(look_again("l", found.index, again) == -ENODEV);
  CHECK(again.index == 0);
  CHECK(look_again("lo", 0x7FFF'FFF0, again) == -ENODEV);
  CHECK(look_again("lo", 0, again) == -ENODEV);
}

TEST_CASE("a link that is found runs if it is up and has a carrier", "[integration][can_socket]") {
  const auto found_in = [](unsigned flags, int index) {
    FoundLink found;
    const int result =
        found_link_in(message(RTM_NEWLINK, bytes_of(ifinfomsg{.ifi_index = index, .ifi_flags = flags})), found);
    CHECK((result == 0) == (found.index != 0));
    return std::pair{result, found.is_running};
  };
  CHECK(found_in(IFF_UP | IFF_RUNNING, 3) == std::pair{0, true});
  CHECK(found_in(IFF_UP, 3) == std::pair{0, false});
  CHECK(found_in(IFF_RUNNING, 3) == std::pair{0, false});
  CHECK(found_in(IFF_UP | IFF_RUNNING, 0) == std::pair{-EBADMSG, false});
  FoundLink found;
  CHECK(found_link_in(message(RTM_NEWLINK, Bytes(sizeof(ifinfomsg) - 1)), found) == -EBADMSG);
  nlmsgerr refusal{};
  refusal.error = -ENODEV;
  CHECK(found_link_in(message(NLMSG_ERROR, bytes_of(refusal)), found) == -ENODEV);
}

}  // namespace bmu
