#include "daemon/shell/link_bit_rate.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
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

struct Question {
  nlmsghdr header{};
  ifinfomsg link{};
};

}  // namespace

int bit_rate_in(Bytes answer, std::uint32_t& out_bit_per_s) {
  out_bit_per_s = 0;
  const std::optional<nlmsghdr> header = header_of<nlmsghdr>(answer);
  if (!header || header->nlmsg_len < sizeof(nlmsghdr) || header->nlmsg_len > answer.size()) return -EBADMSG;
  const Bytes content = answer.first(header->nlmsg_len).subspan(NLMSG_HDRLEN);
  if (header->nlmsg_type == NLMSG_ERROR) {
    const std::optional<nlmsgerr> refusal = header_of<nlmsgerr>(content);
    return refusal && refusal->error < 0 ? refusal->error : -EBADMSG;
  }
  constexpr std::size_t link_bytes = NLMSG_ALIGN(sizeof(ifinfomsg));
  if (header->nlmsg_type != RTM_NEWLINK || content.size() < link_bytes) return -EBADMSG;
  const Bytes info = attribute(content.subspan(link_bytes), IFLA_LINKINFO);
  if (!is_can(attribute(info, IFLA_INFO_KIND))) return 0;
  const Bytes data = attribute(info, IFLA_INFO_DATA);
  const Bytes timing_bytes = attribute(data, IFLA_CAN_BITTIMING);
  if (timing_bytes.empty()) return 0;  // a driver that does not say
  const std::optional<can_bittiming> timing = header_of<can_bittiming>(timing_bytes);
  if (!timing) return -EBADMSG;
  out_bit_per_s = timing->bitrate;
  return 0;
}

int ask_bit_rate(int interface_index, std::uint32_t& out_bit_per_s) {
  out_bit_per_s = 0;
  const OwnedFd socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE));
  if (!socket.is_open()) return -errno;
  Question question;
  question.header.nlmsg_len = sizeof(question);
  question.header.nlmsg_type = RTM_GETLINK;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.link.ifi_family = AF_UNSPEC;
  question.link.ifi_index = interface_index;
  sockaddr_nl kernel{};
  kernel.nl_family = AF_NETLINK;
  const ssize_t sent = ::sendto(socket.get(), &question, sizeof(question), MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&kernel), sizeof(kernel));
  if (sent < 0) return -errno;
  std::array<std::byte, answer_bytes_max> answer{};
  const ssize_t got = ::recv(socket.get(), answer.data(), answer.size(), MSG_DONTWAIT | MSG_TRUNC);
  if (got < 0) return -errno;
  const auto length = static_cast<std::size_t>(got);
  return length > answer.size() ? -EMSGSIZE : bit_rate_in(Bytes(answer).first(length), out_bit_per_s);
}

}  // namespace bmu
