#include "daemon/shell/link_details.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>

#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon/shell/owned_fd.hpp"

namespace bmu {

namespace {

using Bytes = std::span<const std::byte>;

// An answer about one link is some 2 KiB; longer ones are refused, not cut.
constexpr std::size_t answer_bytes_max = 32'768;

template <class Header>
std::optional<Header> header_of(Bytes bytes) {
  if (bytes.size() < sizeof(Header)) return std::nullopt;
  Header header{};
  std::memcpy(&header, bytes.data(), sizeof(header));
  return header;
}

/// The content of the first attribute of this type. Empty also where there is none; what does not fit ends the search.
Bytes attribute(Bytes attributes, std::uint16_t type) {
  while (const std::optional<rtattr> header = header_of<rtattr>(attributes)) {
    const std::size_t length = header->rta_len;
    if (length < sizeof(rtattr) || length > attributes.size()) return {};
    if ((header->rta_type & NLA_TYPE_MASK) == type) return attributes.subspan(sizeof(rtattr), length - sizeof(rtattr));
    attributes = attributes.subspan(std::min<std::size_t>(RTA_ALIGN(length), attributes.size()));
  }
  return {};
}

bool is_can(Bytes kind) {
  constexpr std::string_view name = "can";
  const bool is_ended = kind.size() == name.size() + 1 && kind.back() == std::byte{0};
  return (is_ended || kind.size() == name.size()) && std::memcmp(kind.data(), name.data(), name.size()) == 0;
}

ControllerState state_of(std::uint32_t raw) {
  switch (raw) {
    case CAN_STATE_ERROR_ACTIVE: return ControllerState::error_active;
    case CAN_STATE_ERROR_WARNING: return ControllerState::error_warning;
    case CAN_STATE_ERROR_PASSIVE: return ControllerState::error_passive;
    case CAN_STATE_BUS_OFF: return ControllerState::bus_off;
    case CAN_STATE_STOPPED: return ControllerState::stopped;
    case CAN_STATE_SLEEPING: return ControllerState::sleeping;
    default: return ControllerState::unknown;
  }
}

/// True if the attribute is missing, which a driver may leave it, or whole.
template <class Value>
bool take(Bytes attributes, std::uint16_t type, std::optional<Value>& out) {
  const Bytes bytes = attribute(attributes, type);
  if (bytes.empty()) return true;
  out = header_of<Value>(bytes);
  return out.has_value();
}

/// False: something in it is damaged.
bool take_data(Bytes data, LinkDetails& out) {
  std::optional<can_bittiming> timing;
  std::optional<std::uint32_t> state;
  std::optional<std::uint32_t> restart_ms;
  std::optional<can_berr_counter> errors;
  const bool is_whole = take(data, IFLA_CAN_BITTIMING, timing) && take(data, IFLA_CAN_STATE, state) &&
                        take(data, IFLA_CAN_RESTART_MS, restart_ms) && take(data, IFLA_CAN_BERR_COUNTER, errors);
  if (!is_whole) return false;
  if (timing) out.bit_rate_bit_per_s = timing->bitrate;
  if (state) out.state = state_of(*state);
  if (restart_ms) out.restart_ms = *restart_ms;
  if (errors) out.errors = {.sending = errors->txerr, .receiving = errors->rxerr};
  return true;
}

bool take_history(Bytes info, LinkDetails& out) {
  std::optional<can_device_stats> counts;
  if (!take(info, IFLA_INFO_XSTATS, counts)) return false;
  if (counts) {
    out.history = {.bus_errors = counts->bus_error,
                   .times_passive = counts->error_passive,
                   .times_bus_off = counts->bus_off,
                   .restarts = counts->restarts};
  }
  return true;
}

/// The content of the message, behind its header; or the negative errno value of a refusal.
int content_of(Bytes answer, Bytes& out) {
  const std::optional<nlmsghdr> header = header_of<nlmsghdr>(answer);
  if (!header || header->nlmsg_len < sizeof(nlmsghdr) || header->nlmsg_len > answer.size()) return -EBADMSG;
  out = answer.first(header->nlmsg_len).subspan(NLMSG_HDRLEN);
  if (header->nlmsg_type == NLMSG_ERROR) {
    const std::optional<nlmsgerr> refusal = header_of<nlmsgerr>(out);
    return refusal && refusal->error < 0 ? refusal->error : -EBADMSG;
  }
  return header->nlmsg_type == RTM_NEWLINK ? 0 : -EBADMSG;
}

struct Question {
  nlmsghdr header{};
  ifinfomsg link{};
  rtattr name_header{};
  std::array<char, IFNAMSIZ> name{};
};
static_assert(sizeof(Question) == NLMSG_HDRLEN + NLMSG_ALIGN(sizeof(ifinfomsg)) + RTA_SPACE(IFNAMSIZ));

Question question_for(std::uint32_t length) {
  Question question;
  question.header.nlmsg_len = length;
  question.header.nlmsg_type = RTM_GETLINK;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.link.ifi_family = AF_UNSPEC;
  return question;
}

/// The kernel's answer, in `room`; 0 or a negative errno value.
int ask(const Question& question, std::span<std::byte> room, Bytes& out) {
  const OwnedFd socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE));
  if (!socket.is_open()) return -errno;
  sockaddr_nl kernel{};
  kernel.nl_family = AF_NETLINK;
  const ssize_t sent = ::sendto(socket.get(), &question, question.header.nlmsg_len, MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&kernel), sizeof(kernel));
  if (sent < 0) return -errno;
  const ssize_t got = ::recv(socket.get(), room.data(), room.size(), MSG_DONTWAIT | MSG_TRUNC);
  if (got < 0) return -errno;
  const auto length = static_cast<std::size_t>(got);
  if (length > room.size()) return -EMSGSIZE;
  out = Bytes(room).first(length);
  return 0;
}

}  // namespace

std::string_view to_text(ControllerState state) {
  switch (state) {
    case ControllerState::unknown: return "unknown";
    case ControllerState::error_active: return "error-active";
    case ControllerState::error_warning: return "error-warning";
    case ControllerState::error_passive: return "error-passive";
    case ControllerState::bus_off: return "bus-off";
    case ControllerState::stopped: return "stopped";
    case ControllerState::sleeping: return "sleeping";
  }
  return "?";
}

int link_details_in(Bytes answer, LinkDetails& out) {
  out = {};
  Bytes content;
  if (const int result = content_of(answer, content); result < 0) return result;
  constexpr std::size_t link_bytes = NLMSG_ALIGN(sizeof(ifinfomsg));
  const std::optional<ifinfomsg> link = header_of<ifinfomsg>(content);
  if (!link || content.size() < link_bytes) return -EBADMSG;
  LinkDetails details{.is_up = (link->ifi_flags & IFF_UP) != 0};
  const Bytes info = attribute(content.subspan(link_bytes), IFLA_LINKINFO);
  details.is_can = is_can(attribute(info, IFLA_INFO_KIND));
  if (details.is_can && !(take_data(attribute(info, IFLA_INFO_DATA), details) && take_history(info, details))) {
    return -EBADMSG;
  }
  out = details;
  return 0;
}

int bit_rate_in(Bytes answer, std::uint32_t& out_bit_per_s) {
  LinkDetails details;
  const int result = link_details_in(answer, details);
  out_bit_per_s = details.bit_rate_bit_per_s;
  return result;
}

int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s) {
  LinkDetails details;
  const int result = ask_link_details(interface_index, details);
  out_bit_per_s = details.bit_rate_bit_per_s;
  return result;
}

int ask_link_details(int interface_index, LinkDetails& out) {
  out = {};
  Question question = question_for(NLMSG_HDRLEN + NLMSG_ALIGN(sizeof(ifinfomsg)));
  question.link.ifi_index = interface_index;
  std::array<std::byte, answer_bytes_max> room{};
  Bytes answer;
  const int result = ask(question, room, answer);
  return result < 0 ? result : link_details_in(answer, out);
}

int found_link_in(Bytes answer, FoundLink& out) {
  out = {};
  Bytes content;
  if (const int result = content_of(answer, content); result < 0) return result;
  const std::optional<ifinfomsg> link = header_of<ifinfomsg>(content);
  if (!link || link->ifi_index <= 0) return -EBADMSG;
  constexpr unsigned running = IFF_UP | IFF_RUNNING;
  out = {.index = link->ifi_index, .is_running = (link->ifi_flags & running) == running};
  return 0;
}

int find_link(std::string_view name, FoundLink& out) {
  out = {};
  Question question = question_for(sizeof(Question));
  question.name_header = {.rta_len = RTA_LENGTH(IFNAMSIZ), .rta_type = IFLA_IFNAME};
  // The last character ends the name.
  if (name.empty() || name.size() >= question.name.size()) return -ENODEV;
  name.copy(question.name.data(), question.name.size() - 1);
  std::array<std::byte, answer_bytes_max> room{};
  Bytes answer;
  const int result = ask(question, room, answer);
  return result < 0 ? result : found_link_in(answer, out);
}

int look_again(std::string_view name, int index, FoundLink& out) {
  out = {};
  // Of whatever family: interfaces are asked about by any socket.
  const OwnedFd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return -errno;
  ifreq request{};
  request.ifr_ifindex = index;
  // By number the kernel does not run modprobe, and by a name that is there neither.
  if (::ioctl(socket.get(), SIOCGIFNAME, &request) != 0) return -errno;
  const std::string_view found(request.ifr_name, ::strnlen(request.ifr_name, sizeof request.ifr_name));
  if (found != name) return -ENODEV;
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0) return -errno;
  out = {.index = index, .is_running = (static_cast<unsigned>(request.ifr_flags) & IFF_RUNNING) != 0};
  return 0;
}

}  // namespace bmu
